/* Two arms of two jointed links each, in C: which links touch, what a ray meets, now and a moment ago. */
#include <cab/cab_c.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void print_layout(void);

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static void require(int is_true, const char* what) {
  if (is_true) return;
  fprintf(stderr, "embed_c: %s\n", what);
  exit(1);
}

static void check(cab_Status status) { require(status == CAB_STATUS_OK, cab_status_to_string(status)); }

static cab_ArticulationId add_arm(cab_Engine* engine) {
  /* Link 1 hangs on link 0. Each is a box 1 long, with its joint at the frame's origin and x along it. */
  static const int32_t parents[] = {-1, 0};
  static const cab_Box bone = {{.5f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .1f, .1f}};
  cab_ArticulationDesc desc = cab_default_articulation_desc();
  cab_Leaf leaves[2];
  cab_ArticulationId arm;
  uint32_t i, bad_leaf = 7;
  for (i = 0; i < 2; ++i) {
    leaves[i] = cab_default_leaf();
    leaves[i].link = i;
    leaves[i].box = bone;
  }
  desc.link_parents.data = parents;
  desc.link_parents.size = COUNT_OF(parents);
  desc.leaves.data = leaves;
  desc.leaves.size = COUNT_OF(leaves);
  leaves[1].link = 2;
  require(cab_add_articulation(engine, &desc, &arm, &bad_leaf) == CAB_STATUS_BAD_LEAF_LINK && bad_leaf == 1,
          "a leaf on a link that is not there is refused by its index");
  leaves[1].link = 1;
  check(cab_add_articulation(engine, &desc, &arm, NULL));
  return arm;
}

int main(int argument_count, char** arguments) {
  /* A quaternion x y z w and a translation for each link of each arm: bent upwards, and straight. */
  static const float poses[2][2][7] = {{{0, 0, 0, 1, 0, 0, 0}, {0, 0, .7071068f, .7071068f, 1, 0, 0}},
                                       {{0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 1, 1, 0, 0}}};
  static const double origins[] = {0, 0, 0, .6, .5, 0}, away[] = {0, 0, 0, 100, .5, 0};
  cab_EngineDesc desc = cab_default_engine_desc();
  cab_BatchDesc arms_desc = cab_default_batch_desc();
  cab_ReserveDesc room = cab_default_reserve_desc();
  cab_HistoryDesc history_desc = cab_default_history_desc();
  cab_BatchInput input = cab_default_batch_input();
  cab_PairRule rule = cab_default_pair_rule();
  cab_FrameJob job = cab_default_frame_job();
  cab_QueryJob asked = cab_default_query_job();
  cab_Query rays[2];
  cab_Engine* engine = NULL;
  cab_BatchId arms;
  cab_HistoryId history;
  cab_HistorySpan span;
  cab_Hit hits[16];
  cab_QueryHit met[16];
  size_t i;

  if (argument_count > 1 && strcmp(arguments[1], "--layout") == 0) {
    print_layout();
    return 0;
  }
  require(cab_create_engine(CAB_ABI_VERSION + 1, &desc, &engine) == CAB_STATUS_BAD_ABI_VERSION && !engine,
          "a program of another ABI is refused");
  require(cab_create_engine(CAB_ABI_VERSION, NULL, &engine) == CAB_STATUS_NULL_ARGUMENT, "null is refused");
  check(cab_create_engine(CAB_ABI_VERSION, &desc, &engine));

  arms_desc.articulation = add_arm(engine);
  arms_desc.instance_count = 2;
  check(cab_add_batch(engine, &arms_desc, &arms));

  input.batch = arms;
  input.poses.data = &poses[0][0][0];
  input.origins.data = origins;
  input.origins.size = COUNT_OF(origins);
  rule.a = rule.b = arms;
  job.inputs.data = &input;
  job.inputs.size = 1;
  job.rules.data = &rule;
  job.rules.size = 1;
  require(cab_run_frame(engine, &job) == CAB_STATUS_HITS_OVERFLOW && job.hits_needed == 1, "the needed room is told");
  job.hits.data = hits;
  job.hits.size = COUNT_OF(hits);
  check(cab_run_frame(engine, &job));
  for (i = 0; i < job.hit_count; ++i)
    printf("link %u of arm %u touches link %u of arm %u\n", (unsigned)hits[i].link_a, (unsigned)hits[i].instance_a,
           (unsigned)hits[i].link_b, (unsigned)hits[i].instance_b);

  room.queries = 2;
  check(cab_reserve(engine, &room));
  history_desc.batch = arms;
  history_desc.ticks = 4;
  check(cab_add_history(engine, &history_desc, &history));
  check(cab_record_tick(engine, history, &input, 1));
  check(cab_history_span(engine, history, &span));
  require(span.ticks == 1 && span.last == 1, "the history has its moment");

  /* The second arm has gone away since. */
  input.origins.data = away;
  rays[0] = cab_default_query();
  rays[0].position[0] = 1.2;
  rays[0].position[1] = 5;
  rays[0].direction[1] = -1;
  rays[0].length = 4.45f;
  rays[1] = rays[0];
  rays[1].time = 1;
  asked.inputs = job.inputs;
  asked.histories.data = &history;
  asked.histories.size = 1;
  asked.queries.data = rays;
  asked.queries.size = COUNT_OF(rays);
  asked.hits.data = met;
  asked.hits.size = COUNT_OF(met);
  check(cab_run_queries(engine, &asked));
  for (i = 0; i < asked.hit_count; ++i)
    printf("ray %u meets link %u of arm %u after %.2f\n", (unsigned)met[i].query, (unsigned)met[i].link,
           (unsigned)met[i].instance, (double)met[i].distance);
  cab_destroy_engine(engine);
  return 0;
}
