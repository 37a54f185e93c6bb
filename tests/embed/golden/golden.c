/* 300 frames whose hits have one hash in every language and on every platform: golden.cpp in C. */
#include <cab/cab_c.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINKS = 8, INSTANCES = 64, FRAMES = 300, HITS = 1 << 16 };

static float poses[INSTANCES * LINKS * 7];
static double origins[INSTANCES * 3];
static cab_Hit hits[HITS];
static cab_Contact contacts[HITS];

static void check(cab_Status status) {
  if (status == CAB_STATUS_OK) return;
  fprintf(stderr, "golden: %s\n", cab_status_to_string(status));
  exit(1);
}

/* Multiples of 2^-15 from -1 to 1. */
static float next_number(uint32_t* state) {
  *state = *state * 1664525u + 1013904223u;
  return (float)((int32_t)(*state >> 16) - 32768) / 32768;
}

/* FNV-1a of words, their lowest byte first. */
static void add_word(uint64_t* hash, uint32_t word) {
  int shift;
  for (shift = 0; shift < 32; shift += 8) {
    *hash ^= (word >> shift) & 0xffu;
    *hash *= 1099511628211u;
  }
}

static cab_BatchId add_characters(cab_Engine* engine) {
  static const cab_Box box = {{.5f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .125f, .125f}};
  int32_t parents[LINKS];
  cab_Leaf leaves[LINKS];
  cab_ArticulationDesc chain = cab_default_articulation_desc();
  cab_BatchDesc batch = cab_default_batch_desc();
  cab_BatchId id;
  int32_t link;
  for (link = 0; link < LINKS; ++link) {
    parents[link] = link - 1;
    leaves[link] = cab_default_leaf();
    leaves[link].link = (uint32_t)link;
    leaves[link].box = box;
  }
  chain.link_parents.data = parents;
  chain.link_parents.size = LINKS;
  chain.leaves.data = leaves;
  chain.leaves.size = LINKS;
  batch.instance_count = INSTANCES;
  check(cab_add_articulation(engine, &chain, &batch.articulation, NULL));
  check(cab_add_batch(engine, &batch, &id));
  return id;
}

static cab_Policies policies_of(uint32_t frame) {
  cab_Policies policies = cab_default_policies();
  policies.refit = (cab_Refit)(frame % CAB_REFIT_COUNT);
  policies.strategy = (cab_Strategy)(frame % 4); /* tree, rows, links, brute */
  policies.extents = (cab_Extents)(frame % CAB_EXTENTS_COUNT);
  policies.exact = frame % 3 == 2 ? CAB_EXACT_CONVEX : CAB_EXACT_NONE;
  return policies;
}

/* `golden ISA` takes an instruction set by its name. */
int main(int argument_count, char** arguments) {
  cab_EngineDesc desc = cab_default_engine_desc();
  cab_BatchInput input = cab_default_batch_input();
  cab_PairRule rules[2];
  cab_FrameJob job = cab_default_frame_job();
  cab_Engine* engine = NULL;
  uint64_t hash = 14695981039346656037u;
  uint32_t numbers = 1, frame, i;

  if (argument_count > 1) {
    for (i = 0; i < CAB_ISA_COUNT && strcmp(cab_isa_to_string((cab_Isa)i), arguments[1]) != 0;) ++i;
    desc.isa = (cab_Isa)i;
  }
  check(cab_create_engine(CAB_ABI_VERSION, &desc, &engine));

  for (i = 0; i < INSTANCES; ++i) {
    origins[3 * i] = 1.5 * (i % 8);
    origins[3 * i + 1] = 1.5 * (i / 8);
  }
  input.batch = add_characters(engine);
  input.poses.data = poses;
  input.origins.data = origins;
  input.origins.size = INSTANCES * 3;
  rules[0] = rules[1] = cab_default_pair_rule();
  rules[0].a = rules[0].b = rules[1].a = rules[1].b = input.batch;
  rules[1].pairing = CAB_PAIRING_WITHIN;
  job.inputs.data = &input;
  job.inputs.size = 1;
  job.rules.data = rules;
  job.rules.size = 2;
  job.hits.data = hits;
  job.hits.size = HITS;

  for (frame = 0; frame < FRAMES; ++frame) {
    for (i = 0; i < INSTANCES * LINKS * 7; ++i) {
      const float number = next_number(&numbers);
      poses[i] = i % 7 < 4 ? number : 2 * number;
    }
    job.policies = policies_of(frame);
    job.contacts.data = contacts;
    job.contacts.size = job.policies.exact == CAB_EXACT_CONVEX ? HITS : 0;
    check(cab_run_frame(engine, &job));
    add_word(&hash, (uint32_t)job.hit_count);
    for (i = 0; i < job.hit_count; ++i) {
      add_word(&hash, hits[i].batch_a.value);
      add_word(&hash, hits[i].instance_a);
      add_word(&hash, hits[i].batch_b.value);
      add_word(&hash, hits[i].instance_b);
      add_word(&hash, hits[i].link_a);
      add_word(&hash, hits[i].link_b);
      if (job.contacts.size) {
        uint32_t depth;
        memcpy(&depth, &contacts[i].depth, sizeof depth);
        add_word(&hash, depth);
      }
    }
  }
  cab_destroy_engine(engine);
  printf("%08x%08x\n", (unsigned)(hash >> 32), (unsigned)hash);
  return 0;
}
