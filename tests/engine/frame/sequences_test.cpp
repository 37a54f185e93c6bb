// Sequences of balls and capsules alone, which `auto` tests without boxes, beside the same by boxes.
#include "engine/frame/sequences.h"

#include "layout/round_leaf.h"
#include "perf/harness/random_rig.h"
#include "perf/harness/round_rig.h"
#include "perf/harness/world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <limits>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

struct RoundFrames {
  RoundRig rig;
  Poses poses;
  float margin = 0;
  Report report = Report::kHits;
  bool contacts = false;
};

RoundFrames random_frames(Random& random) {
  RoundFrames out;
  out.rig = random_round_rig(random, 2 + random.index(9), 1 + random.index(4));
  out.poses.link_count = static_cast<std::uint32_t>(out.rig.parents.size());
  out.poses.instance_count = 1 + random.index(60);
  const double spread = random.uniform(0.2, 1), away = random.chance(0.2) ? random.log_uniform(1, 1e7) : 0;
  for (std::uint32_t p = 0; p < out.poses.instance_count * out.poses.link_count; ++p) {
    double q[4];
    random_turn(random, q);
    if (random.chance(0.1))
      for (double& x : q) x *= 30;
    float pose[7];
    auto at = random.uniform(0, spread) * random.unit_vector();
    at[0] += away;
    write_pose(PoseFormat::kQuaternionTranslation, q, at, pose);
    out.poses.data.insert(out.poses.data.end(), pose, pose + 7);
  }
  if (random.chance(0.3)) out.margin = static_cast<float>(random.log_uniform(1e-3, 0.3));
  out.contacts = random.chance(0.3);
  return out;
}

// Puts what masks an instance, or is at the limit, into some poses.
void damage(Random& random, Poses& poses) {
  constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  for (int k = 0; k < 3; ++k) {
    float* const pose = poses.pose(random.index(poses.instance_count), random.index(poses.link_count));
    switch (random.index(6)) {
      case 0: pose[random.index(7)] = kNan; break;
      case 1: pose[random.index(7)] = kInf; break;
      case 2: pose[0] = pose[1] = pose[2] = pose[3] = 0; break;
      case 3: pose[4] = 2e18f; break;
      case 4: pose[5] = 2e9f; break;  // beyond kMostRoundLength, but no mask
      case 5: pose[6] = 1e18f; break;
    }
  }
}

struct Result {
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::vector<std::uint8_t> flags, in_contact;
  FrameStats stats;
};

Result run(const RoundFrames& frames, Strategy strategy, Isa isa, std::uint32_t threads = 1) {
  EngineDesc desc;
  desc.isa = isa;
  desc.thread_count = threads;
  Engine* made = nullptr;
  REQUIRE(create_engine(desc, &made) == Status::kOk);
  const EnginePtr engine(made);
  ArticulationId articulation;
  REQUIRE(add_articulation(*engine, frames.rig.desc(), &articulation, nullptr) == Status::kOk);
  BatchId batch;
  REQUIRE(add_batch(*engine, {articulation, frames.poses.instance_count, BatchKind::kSequence}, &batch) == Status::kOk);
  Result out;
  out.hits.resize(20000);
  out.contacts.resize(frames.contacts ? out.hits.size() : 0);
  out.flags.assign(frames.poses.instance_count, 0xee);
  out.in_contact.assign(frames.poses.instance_count, 0xee);
  BatchInput input = frames.poses.input(batch);
  input.flags = out.flags;
  input.in_contact = out.in_contact;
  const PairRule rule = {batch, batch, Pairing::kWithin};
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};
  job.policies.strategy = strategy;
  job.policies.exact = Exact::kConvex;
  job.margin = frames.margin;
  job.report = frames.report;
  job.hits = out.hits;
  job.contacts = out.contacts;
  REQUIRE(run_frame(*engine, job) == Status::kOk);
  out.hits.resize(job.hit_count);
  out.contacts.resize(frames.contacts ? job.hit_count : 0);
  out.stats = job.stats;
  return out;
}

void check_same(const Result& a, const Result& b) {
  CHECK(same_hits(a.hits, b.hits));
  CHECK(a.flags == b.flags);
  CHECK(a.in_contact == b.in_contact);
  CHECK(a.stats.instances_masked == b.stats.instances_masked);
  REQUIRE(a.contacts.size() == b.contacts.size());
  CHECK((a.contacts.empty() ||
         std::memcmp(a.contacts.data(), b.contacts.data(), a.contacts.size() * sizeof(Contact)) == 0));
}

}  // namespace

TEST_CASE("balls and capsules without boxes have the hits, contacts and flags that they have with them") {
  std::size_t hits = 0, masked = 0, other_tests = 0;
  for (std::uint64_t seed = 1; seed <= rounds(300); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    RoundFrames frames = random_frames(random);
    if (random.chance(0.2)) damage(random, frames.poses);
    const Result boxes = run(frames, random.chance(0.5) ? Strategy::kTree : Strategy::kBrute, Isa::kScalar);
    const Result round = run(frames, Strategy::kAuto, Isa::kScalar, 1 + random.index(2));
    check_same(round, boxes);
    hits += round.hits.size();
    masked += round.stats.instances_masked;
    other_tests += round.stats.exact_tests != boxes.stats.exact_tests;
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      const Result same = run(frames, Strategy::kAuto, isa);
      check_same(same, round);
      CHECK(same.stats.exact_tests == round.stats.exact_tests);
      CHECK(same.stats.box_tests == round.stats.box_tests);
    }
    frames.report = Report::kInContact;
    frames.contacts = false;
    CHECK(run(frames, Strategy::kAuto, Isa::kAuto).in_contact == boxes.in_contact);
  }
  CHECK(hits >= least_count(20000, 300));
  CHECK(masked >= least_count(50, 300));
  CHECK(other_tests >= least_count(200, 300));
}

TEST_CASE(
    "balls are balls in memory that another sequence left, and a short sequence beside a long one has its flags") {
  Random random(7);
  const EnginePtr engine = make_engine();
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    RoundFrames frames = random_frames(random), beside = random_frames(random);
    frames.contacts = false;
    if (random.chance(0.5)) frames.poses.instance_count = 1;
    const Result alone = run(frames, Strategy::kBrute, Isa::kAuto);
    ArticulationId articulations[2];
    BatchId batches[2];
    std::vector<BatchInput> inputs;
    std::vector<std::uint8_t> flags(frames.poses.instance_count, 0xee);
    const RoundFrames* const both[] = {&frames, &beside};
    for (std::size_t b = 0; b < 2; ++b) {
      require(add_articulation(*engine, both[b]->rig.desc(), &articulations[b], nullptr));
      require(add_batch(*engine, {articulations[b], both[b]->poses.instance_count, BatchKind::kSequence}, &batches[b]));
      inputs.push_back(both[b]->poses.input(batches[b]));
    }
    inputs[0].flags = flags;
    const PairRule rules[] = {{batches[0], batches[0], Pairing::kWithin}, {batches[1], batches[1], Pairing::kWithin}};
    std::vector<Hit> hits(20000);
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.policies.exact = Exact::kConvex;
    job.margin = frames.margin;
    job.hits = hits;
    require(run_frame(*engine, job));
    CHECK(flags == alone.flags);
    std::size_t found = 0;
    for (std::size_t h = 0; h < job.hit_count; ++h) {
      if (hits[h].batch_a != slot_of(batches[0])) continue;
      REQUIRE(found < alone.hits.size());
      const Hit& expected = alone.hits[found++];
      CHECK(hits[h].instance_a == expected.instance_a);
      CHECK(hits[h].link_a == expected.link_a);
      CHECK(hits[h].link_b == expected.link_b);
      CHECK(hits[h].leaf_a == expected.leaf_a);
      CHECK(hits[h].leaf_b == expected.leaf_b);
    }
    CHECK(found == alone.hits.size());
    for (std::size_t b = 0; b < 2; ++b) {
      require(remove_batch(*engine, batches[b]));
      require(remove_articulation(*engine, articulations[b]));
    }
  }
}

}  // namespace cab::tests
