/* Two arms of two jointed links each: which links touch? */
#include <cab/cab_c.h>

#include <stdio.h>
#include <stdlib.h>

static void check(cab_Status status) {
  if (status == CAB_STATUS_OK) return;
  fprintf(stderr, "cab: %s\n", cab_status_to_string(status));
  exit(1);
}

int main(void) {
  // quote
  /* Structs begin with their defaults. Then what differs is set. */
  cab_EngineDesc engine_desc = cab_default_engine_desc();
  cab_Engine* engine = NULL;
  check(cab_create_engine(CAB_ABI_VERSION, &engine_desc, &engine));
  // end quote

  /* Once: link 1 hangs on link 0. Each is a box 1 long, with its joint at the frame's origin and x along it. */
  const int32_t parents[] = {-1, 0};
  const cab_Box bone = {{.5f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .1f, .1f}};
  cab_Leaf leaves[2];
  for (uint32_t i = 0; i < 2; ++i) {
    leaves[i] = cab_default_leaf();
    leaves[i].link = i;
    leaves[i].box = bone;
  }
  cab_ArticulationDesc arm_desc = cab_default_articulation_desc();
  arm_desc.link_parents.data = parents;
  arm_desc.link_parents.size = 2;
  arm_desc.leaves.data = leaves;
  arm_desc.leaves.size = 2;
  cab_ArticulationId arm;
  check(cab_add_articulation(engine, &arm_desc, &arm, NULL));
  cab_BatchDesc batch_desc = cab_default_batch_desc();
  batch_desc.articulation = arm;
  batch_desc.instance_count = 2;
  cab_BatchId arms;
  check(cab_add_batch(engine, &batch_desc, &arms));

  /* Every frame: a quaternion x y z w and a translation for each link of each arm, and where each arm stands. */
  const float poses[2][2][7] = {{{0, 0, 0, 1, 0, 0, 0}, {0, 0, .7071068f, .7071068f, 1, 0, 0}}, /* bent upwards */
                                {{0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 1, 1, 0, 0}}};                /* straight */
  const double origins[] = {0, 0, 0, .6, .5, 0};
  // quote
  cab_PairRule rule = cab_default_pair_rule();
  rule.a = rule.b = arms;
  cab_BatchInput input = cab_default_batch_input();
  input.batch = arms;
  input.poses.data = &poses[0][0][0];
  input.origins.data = origins;
  input.origins.size = 6;
  cab_Hit hits[16];
  cab_FrameJob job = cab_default_frame_job();
  job.inputs.data = &input;
  job.inputs.size = 1;
  job.rules.data = &rule;
  job.rules.size = 1;
  job.hits.data = hits;
  job.hits.size = 16;
  check(cab_run_frame(engine, &job));
  // end quote
  for (size_t i = 0; i < job.hit_count; ++i)
    printf("link %d of arm %u touches link %d of arm %u\n", hits[i].link_a, (unsigned)hits[i].instance_a,
           hits[i].link_b, (unsigned)hits[i].instance_b);
  cab_destroy_engine(engine);
  return 0;
}
