// Two real dancers in close contact. The hits hold every pair that an independent box test finds.
#include "perf/harness/world.h"
#include "perf/judge/oracle/overlap_exact.h"
#include "perf/measure/paper/added_false_positives.h"
#include "scenes/import/import.h"

#include <cab/cab.h>
#include <doctest/doctest.h>

#include <cstdlib>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace cab::tests {
namespace {

constexpr double kMetresPerUnit = 1.4;

using FramePair = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  // frame, link of a, link of b

// An engine with both dancers as sequences.
struct Dance {
  Dance(const scenes::Scene& scene, Isa isa, std::uint32_t threads) {
    REQUIRE(create_engine({isa, threads, nullptr, nullptr}, &engine) == Status::kOk);
    for (const scenes::Character& dancer : scene.characters) {
      const scenes::ArticulationStorage storage(dancer);
      ArticulationId id;
      BatchInput input;
      REQUIRE(add_articulation(*engine, storage.desc(), &id) == Status::kOk);
      REQUIRE(add_batch(*engine, {id, scene.frame_count, BatchKind::kSequence}, &input.batch) == Status::kOk);
      input.poses = {dancer.pose_format, dancer.poses.data(), 0, 0};
      input.origins = dancer.origins;
      inputs.push_back(input);
    }
  }
  ~Dance() { destroy_engine(engine); }
  Dance(const Dance&) = delete;
  Dance& operator=(const Dance&) = delete;

  std::set<FramePair> hits(Strategy strategy) {
    const PairRule rule = {inputs[0].batch, inputs[1].batch, Pairing::kBetween};
    std::vector<Hit> buffer(1 << 16);
    FrameJob job;
    job.inputs = inputs;
    job.rules = {&rule, 1};
    job.policies.strategy = strategy;
    job.hits = buffer;
    REQUIRE(run_frame(*engine, job) == Status::kOk);
    std::set<FramePair> out;
    for (std::size_t i = 0; i < job.hit_count; ++i)
      out.emplace(buffer[i].instance_a, buffer[i].link_a, buffer[i].link_b);
    CHECK(out.size() == job.hit_count);
    return out;
  }

  Engine* engine = nullptr;
  std::vector<BatchInput> inputs;
};

// Every box of one dancer, [frame][node].
std::vector<Box> boxes_of(Engine& engine, const BatchInput& input, std::uint32_t nodes, std::uint32_t frames) {
  std::vector<Box> out(std::size_t{nodes} * frames);
  REQUIRE(compute_boxes(engine, input, {}, out) == Status::kOk);
  return out;
}

oracle::OracleBox<double> in_double(const Box& box) {
  oracle::OracleBox<double> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out.center[c] = static_cast<double>(box.center[c]);
    out.half[c] = static_cast<double>(box.half[c]);
    for (std::size_t k = 0; k < 3; ++k) out.axis[k][c] = static_cast<double>(box.axis[k][c]);
  }
  return out;
}

// Link pairs whose leaf boxes no axis separates in double. The importer makes one leaf per link, in order.
std::set<FramePair> overlaps_in_double(Dance& dance, const scenes::Scene& scene) {
  const std::uint32_t leaves = static_cast<std::uint32_t>(scene.characters[0].leaves.size()), nodes = 2 * leaves - 1;
  std::vector<Box> boxes[2];
  for (std::size_t d = 0; d < 2; ++d) boxes[d] = boxes_of(*dance.engine, dance.inputs[d], nodes, scene.frame_count);
  std::set<FramePair> out;
  for (std::uint32_t frame = 0; frame < scene.frame_count; ++frame) {
    oracle::Vec3<double> apart{};
    for (std::size_t c = 0; c < 3; ++c)
      apart[c] = scene.characters[1].origins[3 * frame + c] - scene.characters[0].origins[3 * frame + c];
    for (std::uint32_t i = 0; i < leaves; ++i) {
      const auto a = in_double(boxes[0][std::size_t{frame} * nodes + i]);
      for (std::uint32_t j = 0; j < leaves; ++j) {
        const auto b = in_double(boxes[1][std::size_t{frame} * nodes + j]);
        const oracle::Vec3<double> offset = apart + (oracle::center_of(b) - oracle::center_of(a));
        if (oracle::norm(offset) > oracle::half_sum(a) + oracle::half_sum(b)) continue;
        if (oracle::separating_axes(a, b, offset).none())
          out.emplace(frame, scene.characters[0].leaves[i].link, scene.characters[1].leaves[j].link);
      }
    }
  }
  return out;
}

}  // namespace

TEST_CASE("the dancers' hits hold every pair of overlapping boxes, and every way of finding them gives the same hits") {
  const char* data = std::getenv("CAB_DATA_DIR");
  for (const std::string take : {"05", "10"}) {
    const std::string folder = std::string(data ? data : "") + "/pairs/cmu_salsa_" + take + "/";
    if (!data) {
      MESSAGE("skipped: CAB_DATA_DIR is not set, so the salsa pairs cannot be read");
      return;
    }
    scenes::ImportOptions options;
    options.metres_per_unit = kMetresPerUnit;
    const scenes::Scene scene =
        scenes::make_world({scenes::import_clip(folder + "60_" + take + "_scaled.bvh", options),
                            scenes::import_clip(folder + "61_" + take + "_scaled.bvh", options)});
    Dance dance(scene, Isa::kAuto, 1);
    const std::set<FramePair> truth = overlaps_in_double(dance, scene), found = dance.hits(Strategy::kTree);
    std::size_t lost = 0;
    for (const FramePair& pair : truth) lost += !found.count(pair);
    MESSAGE("take " << take << ": " << found.size() << " hits, of which " << found.size() - truth.size()
                    << " by slack alone");
    CHECK(truth.size() > 1000);
    const perf::AddedFalsePositives added = perf::count_added_false_positives(scene, Isa::kAuto);
    MESSAGE("take " << take << ": " << perf::describe(added));
    CHECK(added.found == found.size());
    CHECK(added.touching > 1000);
    CHECK(added.missed == 0);
    CHECK(added.percent() < perf::kAddedPercentLimit);
    CHECK(lost == 0);
    CHECK(dance.hits(Strategy::kBrute) == found);
    for (const Isa isa : oracle::available_isas()) {
      for (const std::uint32_t threads : {1u, 2u, 4u}) {
        Dance other(scene, isa, threads);
        CAPTURE(to_string(isa));
        CAPTURE(threads);
        CHECK(other.hits(Strategy::kTree) == found);
      }
    }
  }
}

}  // namespace cab::tests
