// The paper's scenes give the bits of the committed table on every instruction set and thread count, and for every
// split of their frames into batches.
#include "tests/scenes/golden_hashes.h"

#include "perf/harness/world.h"
#include "scenes/paper/registry.h"
#include "tests/engine/thread_pool.h"

#include <doctest/doctest.h>

#include <map>

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;
using scenes::Character;
using scenes::Scene;

// A scene in an engine. Its frames run in parts of given lengths, and each length has batches of its own.
class SceneOnEngine {
 public:
  SceneOnEngine(const Scene& scene, const EngineDesc& desc, BatchKind kind = BatchKind::kSequence)
      : scene_(scene), kind_(kind), engine_(make_engine(desc)) {
    for (const Character& character : scene.characters) {
      const scenes::ArticulationStorage storage(character);
      articulations_.emplace_back();
      oracle::require(add_articulation(*engine_, storage.desc(), &articulations_.back()));
    }
  }

  std::uint64_t boxes_hash(const Policies& policies, const std::vector<std::uint32_t>& runs) {
    cab::BitHash hash;
    std::uint32_t first = 0;
    for (const std::uint32_t count : runs) {
      const std::vector<BatchId>& batches = batches_of(count);
      std::vector<std::vector<Box>> boxes(batches.size());
      std::vector<std::size_t> nodes;
      for (std::size_t c = 0; c < batches.size(); ++c) {
        ArticulationInfo info;
        oracle::require(articulation_info(*engine_, articulations_[c], &info));
        nodes.push_back(info.node_count);
        boxes[c].resize(instances(c, count) * nodes[c]);
        oracle::require(compute_boxes(*engine_, input(c, batches[c], first), policies, boxes[c]));
      }
      for (std::uint32_t frame = 0; frame < count; ++frame)
        for (std::size_t c = 0; c < batches.size(); ++c)
          for (std::size_t node = 0; node < nodes[c]; ++node)
            hash.add(boxes[c][(scene_.characters[c].is_static ? 0 : frame) * nodes[c] + node]);
      first += count;
    }
    return hash.value();
  }

  std::uint64_t hits_hash(const Policies& policies, const std::vector<std::uint32_t>& runs) {
    std::vector<GoldenTouch> touches;
    std::uint32_t first = 0;
    for (const std::uint32_t count : runs) {
      run(policies, first, count, touches);
      first += count;
    }
    return hash_touches(std::move(touches));
  }

 private:
  std::size_t instances(std::size_t character, std::uint32_t count) const {
    return scene_.characters[character].is_static ? 1 : count;
  }

  const std::vector<BatchId>& batches_of(std::uint32_t count) {
    std::vector<BatchId>& batches = batches_[count];
    for (std::size_t c = batches.size(); c < articulations_.size(); ++c)
      batches.push_back(
          add_instances(*engine_, articulations_[c], static_cast<std::uint32_t>(instances(c, count)), kind_));
    return batches;
  }

  BatchInput input(std::size_t c, BatchId batch, std::uint32_t first) const {
    const Character& character = scene_.characters[c];
    const std::size_t floats = character.link_parents.size() * pose_floats(character.pose_format);
    BatchInput out;
    out.batch = batch;
    out.poses.format = character.pose_format;
    out.poses.data = character.poses.data() + (character.is_static ? 0 : first * floats);
    return out;
  }

  void run(const Policies& policies, std::uint32_t first, std::uint32_t count, std::vector<GoldenTouch>& touches) {
    const std::vector<BatchId>& batches = batches_of(count);
    std::vector<BatchInput> inputs;
    for (std::size_t c = 0; c < batches.size(); ++c) inputs.push_back(input(c, batches[c], first));
    std::vector<PairRule> rules;
    for (const scenes::CharacterPair& pair : scene_.pairs)
      rules.push_back({batches[pair.a], batches[pair.b], Pairing::kBetween});
    std::vector<Hit> hits(std::size_t{count} * 200);
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.policies = policies;
    job.hits = hits;
    oracle::require(run_frame(*engine_, job));
    for (std::size_t h = 0; h < job.hit_count; ++h) {
      const Hit& hit = hits[h];
      const std::uint32_t first_slot = slot_of(batches[0]).value, a = hit.batch_a.value - first_slot,
                          b = hit.batch_b.value - first_slot;
      const std::uint32_t frame = first + (scene_.characters[a].is_static ? hit.instance_b : hit.instance_a);
      touches.push_back({frame, a, hit.link_a, b, hit.link_b});
    }
  }

  const Scene& scene_;
  BatchKind kind_;
  EnginePtr engine_;
  std::vector<ArticulationId> articulations_;
  std::map<std::uint32_t, std::vector<BatchId>> batches_;
};

// The row of the table that a scene gives on one engine.
GoldenScene row_of(const Scene& scene, std::uint32_t table, const EngineDesc& desc,
                   const std::vector<std::uint32_t>& runs = {kGoldenFrames}) {
  GoldenScene row = {table, scenes::pose_hash(scene), scenes::shape_hash(scene), {}};
  SceneOnEngine on(scene, desc);
  for (std::size_t m = 0; m < kGoldenPolicies.size(); ++m)
    row.bits[m] = {on.boxes_hash(kGoldenPolicies[m], runs), on.hits_hash(kGoldenPolicies[m], runs)};
  return row;
}

// Compares a row with the table, or, where the scene itself differs, with the row that scalar code gives.
class Judge {
 public:
  Judge(const Scene& scene, const GoldenScene& golden) : expected_(golden) {
    const std::string reason = other_scene(scene, golden);
    if (reason.empty()) return;
    EngineDesc scalar;
    scalar.isa = Isa::kScalar;
    expected_ = row_of(scene, golden.table, scalar);
    MESSAGE("skipped: " << reason << ", but with scalar code on one thread:\n" << golden_row(expected_));
  }
  void check(const GoldenScene& found) const { CHECK(golden_row(found) == golden_row(expected_)); }
  void check_hits(std::size_t method, std::uint64_t found) const { CHECK(found == expected_.bits[method].hits); }
  void check_boxes(std::size_t method, std::uint64_t found) const { CHECK(found == expected_.bits[method].boxes); }

 private:
  GoldenScene expected_;
};

template <class Check>
void for_each_scene(Check&& check) {
  for (const GoldenScene& golden : kGoldenScenes) {
    CAPTURE(golden.table);
    const Scene scene = scenes::make_paper_scene(golden.table, kGoldenFrames);
    for (const Character& character : scene.characters) REQUIRE(character.origins.empty());
    check(scene, golden.table, Judge(scene, golden));
  }
}

}  // namespace

TEST_CASE("300 frames of every paper scene have the golden hashes by every method on every instruction set") {
  for_each_scene([](const Scene& scene, std::uint32_t table, const Judge& judge) {
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      EngineDesc desc;
      desc.isa = isa;
      judge.check(row_of(scene, table, desc));
    }
  });
}

TEST_CASE(
    "300 frames of every paper scene have the golden hits on 1 to 8 threads of a caller's scheduler, and on TBB") {
  for_each_scene([](const Scene& scene, std::uint32_t, const Judge& judge) {
    const auto check = [&](const EngineDesc& desc) {
      SceneOnEngine on(scene, desc);
      for (std::size_t m = 0; m < kGoldenPolicies.size(); ++m)
        judge.check_hits(m, on.hits_hash(kGoldenPolicies[m], {kGoldenFrames}));
    };
    for (std::uint32_t workers = 1; workers <= 8; ++workers) {
      CAPTURE(workers);
      ThreadPool pool(workers);
      const Scheduler scheduler = pool.scheduler();
      EngineDesc desc;
      desc.scheduler = &scheduler;
      check(desc);
      CHECK(pool.tasks_run() > 0);
    }
    for (const std::uint32_t threads : {0u, 2u, 3u, 8u}) {  // TBB starts no more threads than there are cores
      CAPTURE(threads);
      EngineDesc desc;
      desc.thread_count = threads;
      check(desc);
    }
  });
}

TEST_CASE("300 frames of every paper scene have the golden hashes however they are split into batches") {
  const std::vector<std::uint32_t> one_by_one(kGoldenFrames, 1), splits[] = {
                                                                     {1, 15, 16, 17, 33, 218},
                                                                     {150, 150},
                                                                     {7, 100, 193},
                                                                 };
  for_each_scene([&](const Scene& scene, std::uint32_t table, const Judge& judge) {
    for (const std::vector<std::uint32_t>& runs : splits) {
      CAPTURE(runs[0]);
      judge.check(row_of(scene, table, {}, runs));
    }
    for (const BatchKind kind : {BatchKind::kSequence, BatchKind::kCharacters}) {
      SceneOnEngine on(scene, {}, kind);
      for (const std::size_t method : {std::size_t{0}, kGoldenOriented - 2, kGoldenOriented - 1, kGoldenOriented}) {
        judge.check_boxes(method, on.boxes_hash(kGoldenPolicies[method], one_by_one));
        judge.check_hits(method, on.hits_hash(kGoldenPolicies[method], one_by_one));
      }
    }
  });
}
