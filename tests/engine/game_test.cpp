// All that a game gives a frame at once: who is where and at which level, who rests, sizes, margins, layers, a level.
#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCharacters = 70, kFrames = 5, kLevels = 3;

// The inputs of one frame. Poses are matrices that hold the scale.
struct Moment {
  Poses poses;
  std::vector<float> margins;
  std::vector<std::uint8_t> moved;
  std::vector<std::uint32_t> at_level[kLevels];
};

// What is told to an engine, frame by frame.
struct Script {
  Rig rig;
  Poses rest;
  std::vector<StaticBody> bodies;
  std::vector<float> vertices;
  std::vector<std::uint32_t> triangles, layers, masks;
  std::vector<Moment> moments;
  Policies policies;
  LodKind middle = LodKind::kReach;  // the kind of the level between
  float margin = 0;
};

Script any_script(Random& random) {
  Script out;
  out.rig = random_rig(random, static_cast<Topology>(random.index(3)), 2 + random.index(14), 2);
  out.rig.joints.clear();
  out.policies.exact = random.chance(0.4) ? Exact::kConvex : Exact::kNone;
  out.policies.refit = static_cast<Refit>(random.index(kRefitCount));
  if (out.policies.exact == Exact::kNone && random.chance(0.5)) out.middle = LodKind::kNodes;
  out.margin = random.chance(0.5) ? 0.0f : 0.05f;
  const auto pose = [&] {
    Poses poses = random_poses(random, out.rig, kCharacters, PoseFormat::kMatrix4x4Columns, {2, true, true, {}});
    for (std::uint32_t i = 0; i < kCharacters; ++i) {
      const auto factor = static_cast<float>(random.uniform(0.8, 1.25));
      for (std::uint32_t link = 0; link < poses.link_count; ++link) {
        scale_matrix(poses.format, factor, poses.pose(i, link));
        for (std::size_t c = 0; c < 3; ++c) poses.pose(i, link)[12 + c] *= factor;
      }
    }
    poses.has_scale = true;
    return poses;
  };
  out.rest = pose();
  for (int b = 0; b < 30; ++b) {
    StaticBody body;
    body.box = random_box(random, 0.1 * random.unit_vector(), 0.05, 0.4);
    for (double& at : body.origin) at = random.uniform(-2.5, 2.5);
    out.bodies.push_back(body);
  }
  for (std::uint32_t v = 0; v < 60; ++v) {
    for (int c = 0; c < 3; ++c) out.vertices.push_back(static_cast<float>(random.uniform(-2.5, 2.5)));
    out.triangles.push_back(v);
  }
  for (std::uint32_t i = 0; i < kCharacters; ++i) {
    out.layers.push_back(1u << random.index(3));
    out.masks.push_back(random.chance(0.3) ? 5u : 7u);
  }
  for (std::uint32_t f = 0; f < kFrames; ++f) {
    Moment moment = {pose(), {}, {}, {}};
    for (std::uint32_t i = 0; i < kCharacters; ++i) {
      const bool rests = f > 0 && random.chance(0.6);
      moment.moved.push_back(!rests);
      moment.margins.push_back(rests                ? out.moments[f - 1].margins[i]
                               : random.chance(0.3) ? static_cast<float>(random.uniform(0, 0.3))
                                                    : 0.0f);
      if (rests) {
        const Poses& last = out.moments[f - 1].poses;
        std::copy_n(last.pose(i, 0), 16 * std::size_t{last.link_count}, moment.poses.pose(i, 0));
        std::copy_n(last.origins.begin() + 3 * i, 3, moment.poses.origins.begin() + 3 * i);
        std::copy_n(last.orientations.begin() + 4 * i, 4, moment.poses.orientations.begin() + 4 * i);
      }
      const std::uint32_t level = random.index(kLevels + 1);  // the last is that of those who are not there
      if (level < kLevels) moment.at_level[level].push_back(i);
    }
    out.moments.push_back(std::move(moment));
  }
  return out;
}

// An engine that a script is told to.
struct Player {
  EnginePtr engine;
  std::vector<BatchId> batches;  // by level, then the static bodies
  std::vector<PairRule> rules;

  Player(const Script& script, const EngineDesc& desc) : engine(make_engine(desc)) {
    const ArticulationId fine = add_rig(*engine, script.rig);
    batches.push_back(add_instances(*engine, fine, kCharacters));
    for (const auto& [kind, leaves] : {std::make_pair(script.middle, 4u), std::make_pair(LodKind::kReach, 1u)}) {
      LodDesc lod;
      lod.of = fine;
      lod.kind = kind;
      lod.max_leaves = leaves;
      lod.rest_poses.format = script.rest.format;
      lod.rest_poses.data = script.rest.data.data();
      lod.rest_poses.has_scale = true;
      ArticulationId level;
      require(add_lod(*engine, lod, &level));
      batches.push_back(add_instances(*engine, level, kCharacters));
    }
    StaticDesc ground;
    ground.bodies = script.bodies;
    ground.vertices = script.vertices;
    ground.triangles = script.triangles;
    require(add_static_batch(*engine, ground, &batches.emplace_back()));
    for (std::size_t a = 0; a < batches.size(); ++a)
      for (std::size_t b = a; b < batches.size(); ++b)
        if (a != batches.size() - 1) rules.push_back({batches[a], batches[b]});
    rules.push_back({batches[0], batches[0], Pairing::kWithin});
  }

  struct Answer {
    std::vector<Hit> hits;
    std::vector<Contact> contacts;
    std::vector<std::uint8_t> in_contact[kLevels];
    FrameStats stats;
  };

  Answer play(const Script& script, std::uint32_t f, const Policies& policies, bool says_who_rests,
              decltype(&run_frame) frame = run_frame) {
    const Moment& moment = script.moments[f];
    Answer out;
    std::vector<BatchInput> inputs;
    for (std::uint32_t level = 0; level < kLevels; ++level) {
      out.in_contact[level].assign(kCharacters, 0xee);
      BatchInput input = moment.poses.input(batches[level]);
      input.layers = script.layers;
      input.layer_masks = script.masks;
      input.margins = moment.margins;
      if (says_who_rests) input.moved = moment.moved;
      input.instances = moment.at_level[level];
      if (input.instances.empty()) input.count = 0;
      input.in_contact = {out.in_contact[level].data(), kCharacters};
      inputs.push_back(input);
    }
    inputs.emplace_back();
    inputs.back().batch = batches.back();
    out.hits.resize(60000);
    if (policies.exact != Exact::kNone) out.contacts.resize(out.hits.size());
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.policies = policies;
    job.margin = script.margin;
    job.hits = out.hits;
    job.contacts = out.contacts;
    require(frame(*engine, job));
    out.hits.resize(job.hit_count);
    if (!out.contacts.empty()) out.contacts.resize(job.hit_count);
    out.stats = job.stats;
    return out;
  }
};

void check_same(const Player::Answer& found, const Player::Answer& expected) {
  CHECK(same_hits(found.hits, expected.hits));
  REQUIRE(found.contacts.size() == expected.contacts.size());
  CHECK((found.contacts.empty() ||
         std::memcmp(found.contacts.data(), expected.contacts.data(), found.contacts.size() * sizeof(Contact)) == 0));
  for (std::uint32_t level = 0; level < kLevels; ++level) CHECK(found.in_contact[level] == expected.in_contact[level]);
}

// Runs a frame's tasks in descending order on alternating workers.
Status run_backwards(Engine& engine, FrameJob& job) noexcept {
  Status status = begin_frame(engine, job);
  if (status != Status::kOk) return status;
  std::uint32_t count = 0;
  while ((status = next_tasks(engine, &count)) == Status::kOk && count > 0)
    for (std::uint32_t t = count; t-- > 0;)
      if (run_task(engine, t, t % engine_thread_count(engine)) != Status::kOk) return Status::kBadTask;
  return status == Status::kOk ? end_frame(engine) : status;
}

}  // namespace

TEST_CASE("frames with all that a game gives them are the same on every instruction set, thread and way to run tasks") {
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  std::size_t hits = 0, resting = 0, contacts = 0;
  for (std::uint64_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Script script = any_script(random);
    EngineDesc plain;
    plain.isa = Isa::kScalar;
    Player fresh(script, plain);
    std::vector<Player::Answer> expected;
    for (std::uint32_t f = 0; f < kFrames; ++f) expected.push_back(fresh.play(script, f, script.policies, false));
    for (const Isa isa : available_isas())
      for (int way = 0; way < 3; ++way) {
        CAPTURE(way);
        EngineDesc desc;
        desc.isa = isa;
        if (way > 0) desc.scheduler = &scheduler;
        Player player(script, desc);
        for (std::uint32_t f = 0; f < kFrames; ++f) {
          CAPTURE(f);
          const Player::Answer found =
              player.play(script, f, script.policies, true, way == 2 ? run_backwards : run_frame);
          check_same(found, expected[f]);
          hits += found.hits.size();
          contacts += found.contacts.size();
          resting += found.stats.instances_resting;
        }
      }
    // Every strategy finds the same.
    for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kBrute}) {
      Policies policies = script.policies;
      policies.strategy = strategy;
      for (std::uint32_t f = 0; f < kFrames; ++f)
        CHECK(same_hits(fresh.play(script, f, policies, false).hits, expected[f].hits));
    }
  }
  const std::size_t isas = available_isas().size();
  CHECK(hits >= isas * least_count(25000, 10));
  CHECK(contacts >= isas * least_count(2500, 10));
  CHECK(resting >= isas * least_count(5000, 10));
}

}  // namespace cab::tests
