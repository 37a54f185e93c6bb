// Every misuse of run_frame and compute_boxes has its status, and leaves the caller's data as they were.
#include "perf/harness/random_world.h"

#include <doctest/doctest.h>

#include <functional>
#include <limits>

namespace {

using namespace cab;
using namespace cab::oracle;

// An engine with two character batches (1: three instances, 2: two) and three sequences (3 and 4: four frames,
// 5: one), and a job over all of them that is in order.
struct Bench {
  World world;
  EnginePtr engine;
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::vector<std::uint8_t> flags;
  FrameJob job;

  Bench() : hits(4000), contacts(4000), flags(3, 0xcc) {
    Random random(17);
    const PoseRange range = {0.3, true, true, {}};
    for (const std::uint32_t n : {3u, 2u, 4u, 4u, 1u})
      world.members.push_back(
          any_member(random, n, world.members.size() < 2 ? BatchKind::kCharacters : BatchKind::kSequence, range, 4));
    rules = {{{1}, {2}, Pairing::kBetween}, {{1}, {1}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin},
             {{3}, {4}, Pairing::kBetween}, {{5}, {3}, Pairing::kBetween}, {{4}, {4}, Pairing::kWithin}};
    engine = make_engine_for(world);
    for (std::uint32_t m = 0; m < 5; ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs[0].flags = flags;
    std::memset(static_cast<void*>(hits.data()), 0xcd, hits.size() * sizeof(Hit));
    std::memset(static_cast<void*>(contacts.data()), 0xcd, contacts.size() * sizeof(Contact));
    job.hit_count = 123;
    job.hits_needed = 456;
    job.stats.box_tests = 789;
    job.stats.seconds_total = -1;
    point();
  }

  void point() {
    job.inputs = inputs;
    job.rules = rules;
    job.hits = hits;
  }
};

template <class T>
std::vector<unsigned char> bytes_of(const std::vector<T>& values) {
  const auto* const from = reinterpret_cast<const unsigned char*>(values.data());
  return std::vector<unsigned char>(from, from + values.size() * sizeof(T));
}

// Spoils the job in one way. The frame must answer with the status and write nothing.
void refuse(Status status, const std::function<void(Bench&)>& spoil) {
  Bench bench;
  spoil(bench);
  const auto hits = bytes_of(bench.hits);
  const auto contacts = bytes_of(bench.contacts);
  const auto flags = bench.flags;
  FrameJob before = bench.job;
  CHECK(run_frame(*bench.engine, bench.job) == status);
  CHECK(std::memcmp(static_cast<const void*>(&before), static_cast<const void*>(&bench.job), sizeof(FrameJob)) == 0);
  CHECK(bytes_of(bench.hits) == hits);
  CHECK(bytes_of(bench.contacts) == contacts);
  CHECK(bench.flags == flags);
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("the job that the misuses start from is in order") {
  Bench bench;
  CHECK(run_frame(*bench.engine, bench.job) == Status::kOk);
  CHECK(bench.job.hit_count > 0);
  CHECK(bench.job.stats.seconds_total >= 0);
  for (const std::uint8_t flag : bench.flags) CHECK(flag == kInstanceOk);
}

TEST_CASE("inputs must name batches of the engine, each once") {
  refuse(Status::kUnknownBatch, [](Bench& b) { b.inputs[1].batch = {0}; });
  refuse(Status::kUnknownBatch, [](Bench& b) { b.inputs[1].batch = {6}; });
  refuse(Status::kUnknownBatch, [](Bench& b) { b.inputs[4].batch = {0xffffffffu}; });
  refuse(Status::kUnknownBatch, [](Bench& b) { b.job.inputs.data = nullptr; });
  refuse(Status::kBatchGivenTwice, [](Bench& b) {
    b.inputs.push_back(b.inputs[2]);
    b.point();
  });
}

TEST_CASE("poses must be there, of a known format, and strided by whole floats that do not overlap") {
  refuse(Status::kBadPoses, [](Bench& b) { b.inputs[0].poses.data = nullptr; });
  refuse(Status::kBadPoses, [](Bench& b) { b.inputs[0].poses.format = static_cast<PoseFormat>(3); });
  refuse(Status::kBadPoses,
         [](Bench& b) { b.inputs[0].poses.link_stride = 4 * b.world.members[0].poses.floats_per_pose() + 2; });
  refuse(Status::kBadPoses,
         [](Bench& b) { b.inputs[0].poses.link_stride = 4 * b.world.members[0].poses.floats_per_pose() - 4; });
  refuse(Status::kBadPoses, [](Bench& b) { b.inputs[0].poses.instance_stride = 4096 + 1; });
  refuse(Status::kBadPoses, [](Bench& b) { b.inputs[0].poses.instance_stride = 4; });
  refuse(Status::kBadPoses, [](Bench& b) {
    const Poses& poses = b.world.members[0].poses;
    b.inputs[0].poses.instance_stride = 4 * (poses.floats_per_pose() * poses.link_count - 1);
  });
  refuse(Status::kBadPoses, [](Bench& b) { b.inputs[0].poses.link_stride = ~std::size_t{3}; });
  refuse(Status::kBadPoses, [](Bench& b) { b.inputs[0].poses.instance_stride = ~std::size_t{3}; });
}

TEST_CASE("origins must be empty or three finite doubles per instance") {
  static double origins[12] = {};
  refuse(Status::kBadOrigins, [](Bench& b) { b.inputs[0].origins = {origins, 8}; });
  refuse(Status::kBadOrigins, [](Bench& b) { b.inputs[0].origins = {origins, 12}; });
  refuse(Status::kBadOrigins, [](Bench& b) { b.inputs[0].origins = {nullptr, 9}; });
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    static double with_bad[9] = {};
    with_bad[7] = bad;
    refuse(Status::kBadOrigins, [](Bench& b) { b.inputs[0].origins = {with_bad, 9}; });
  }
}

TEST_CASE("orientations and flags must be empty or one per instance") {
  static float orientations[16] = {};
  refuse(Status::kBadOrientations, [](Bench& b) { b.inputs[0].orientations = {orientations, 3}; });
  refuse(Status::kBadOrientations, [](Bench& b) { b.inputs[0].orientations = {orientations, 16}; });
  refuse(Status::kBadOrientations, [](Bench& b) { b.inputs[0].orientations = {nullptr, 12}; });
  refuse(Status::kBadFlags, [](Bench& b) { b.inputs[0].flags.size = 2; });
  refuse(Status::kBadFlags, [](Bench& b) { b.inputs[1].flags = {b.flags.data(), 3}; });
  refuse(Status::kBadFlags, [](Bench& b) { b.inputs[0].flags = {nullptr, 3}; });
}

TEST_CASE("layers and their masks must be empty or one per instance") {
  static std::uint32_t words[4] = {};
  for (const auto layers : {&BatchInput::layers, &BatchInput::layer_masks}) {
    refuse(Status::kBadLayers, [=](Bench& b) { b.inputs[0].*layers = {words, 2}; });
    refuse(Status::kBadLayers, [=](Bench& b) { b.inputs[0].*layers = {words, 4}; });
    refuse(Status::kBadLayers, [=](Bench& b) { b.inputs[2].*layers = {nullptr, 4}; });
  }
}

TEST_CASE("a rule must name batches that have input, and a pairing that they can have") {
  const auto refuse_rule = [](BatchId a, BatchId b, Pairing pairing) {
    refuse(Status::kBadPairRule, [&](Bench& bench) {
      bench.rules.push_back({a, b, pairing});
      bench.point();
    });
  };
  refuse_rule({0}, {1}, Pairing::kBetween);
  refuse_rule({1}, {6}, Pairing::kBetween);
  refuse_rule({1}, {3}, Pairing::kBetween);  // characters and frames
  refuse_rule({3}, {3}, Pairing::kBetween);  // a frame is not paired with other frames of its sequence
  refuse_rule({1}, {2}, Pairing::kWithin);
  refuse_rule({1}, {2}, static_cast<Pairing>(2));
  refuse(Status::kBadPairRule, [](Bench& b) { b.job.rules.data = nullptr; });
  refuse(Status::kBadPairRule, [](Bench& b) { b.job.inputs.size = 4; });  // batch 5 is in a rule but has no input
  refuse(Status::kPairRuleGivenTwice, [](Bench& b) {
    b.rules.push_back({{2}, {1}, Pairing::kBetween});
    b.point();
  });
  refuse(Status::kPairRuleGivenTwice, [](Bench& b) {
    b.rules.push_back({{4}, {4}, Pairing::kWithin});
    b.point();
  });
}

TEST_CASE("sequences of different lengths are no pair unless one has a single frame") {
  World world;
  Random random(3);
  for (const std::uint32_t n : {4u, 5u, 1u})
    world.members.push_back(any_member(random, n, BatchKind::kSequence, {}, 3));
  const EnginePtr engine = make_engine_for(world);
  const auto status_of = [&](std::uint32_t a, std::uint32_t b) {
    std::vector<BatchInput> inputs;
    for (std::uint32_t m = 0; m < 3; ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
    const PairRule rule = {{a}, {b}, Pairing::kBetween};
    std::vector<Hit> hits(1000);
    FrameJob job;
    job.inputs = {inputs.data(), 3};
    job.rules = {&rule, 1};
    job.hits = hits;
    return run_frame(*engine, job);
  };
  CHECK(status_of(1, 2) == Status::kBadPairRule);
  CHECK(status_of(1, 3) == Status::kOk);
  CHECK(status_of(3, 2) == Status::kOk);
}

TEST_CASE("policies must hold values of their enumerations") {
  refuse(Status::kBadPolicy, [](Bench& b) { b.job.policies.refit = static_cast<Refit>(200); });
  refuse(Status::kBadPolicy, [](Bench& b) { b.job.policies.strategy = static_cast<Strategy>(200); });
  refuse(Status::kBadPolicy, [](Bench& b) { b.job.policies.exact = static_cast<Exact>(200); });
  refuse(Status::kBadPolicy, [](Bench& b) { b.job.policies.extents = static_cast<Extents>(2); });
}

TEST_CASE("in_contact must be empty or one per instance, and the report a value of Report") {
  static std::uint8_t bytes[4] = {};
  refuse(Status::kBadInContact, [](Bench& b) { b.inputs[0].in_contact = {bytes, 2}; });
  refuse(Status::kBadInContact, [](Bench& b) { b.inputs[0].in_contact = {bytes, 4}; });
  refuse(Status::kBadInContact, [](Bench& b) { b.inputs[2].in_contact = {nullptr, 4}; });
  refuse(Status::kBadReport, [](Bench& b) { b.job.report = static_cast<Report>(3); });
  refuse(Status::kBadMargin, [](Bench& b) {  // a refused call leaves the bytes as they were
    std::fill_n(bytes, 4, std::uint8_t{0xcc});
    b.inputs[2].in_contact = {bytes, 4};
    b.job.margin = -1;
  });
  for (const std::uint8_t byte : bytes) CHECK(byte == 0xcc);
}

TEST_CASE("a margin must be finite and not negative") {
  for (const float bad : {-1e-45f, -1.0f, 1.0001e18f, static_cast<float>(kInfinity), static_cast<float>(kNan)})
    refuse(Status::kBadMargin, [=](Bench& b) { b.job.margin = bad; });
}

TEST_CASE("buffers must be there, and contacts be asked for with an exact test") {
  refuse(Status::kBadHitBuffer, [](Bench& b) { b.job.hits.data = nullptr; });
  const auto with_contacts = [](Bench& b, Exact exact, std::size_t size) {
    b.job.policies.exact = exact;
    b.job.contacts = {b.contacts.data(), size};
  };
  refuse(Status::kBadHitBuffer, [&](Bench& b) { with_contacts(b, Exact::kConvex, 3999); });
  refuse(Status::kBadHitBuffer, [&](Bench& b) {
    with_contacts(b, Exact::kConvex, 4000);
    b.job.contacts.data = nullptr;
  });
  refuse(Status::kContactsNeedExact, [&](Bench& b) { with_contacts(b, Exact::kNone, 4000); });
  refuse(Status::kContactsNeedExact, [](Bench& b) { b.job.min_depth = 1; });
  refuse(Status::kBadHitBuffer, [](Bench& b) {
    b.job.policies.exact = Exact::kConvex;
    b.job.report = Report::kDistances;
  });
  refuse(Status::kBadMinDepth, [](Bench& b) {
    b.job.policies.exact = Exact::kConvex;
    b.job.min_depth = -1;
  });
}

TEST_CASE("compute_boxes refuses what run_frame refuses, and a buffer that is too small") {
  Bench bench;
  const std::size_t count = 3 * bench.world.members[0].rig.node_count();
  std::vector<Box> boxes(count);
  std::memset(static_cast<void*>(boxes.data()), 0xcd, count * sizeof(Box));
  const auto before = bytes_of(boxes);
  const auto refuse_boxes = [&](Status status, const std::function<void(BatchInput&, Policies&, Span<Box>&)>& spoil) {
    BatchInput input = bench.inputs[0];
    Policies policies;
    Span<Box> out = {boxes.data(), count};
    spoil(input, policies, out);
    CHECK(compute_boxes(*bench.engine, input, policies, out) == status);
    CHECK(bytes_of(boxes) == before);
    for (const std::uint8_t flag : bench.flags) CHECK(flag == 0xcc);
  };
  refuse_boxes(Status::kUnknownBatch, [](BatchInput& input, Policies&, Span<Box>&) { input.batch = {9}; });
  refuse_boxes(Status::kBadPoses, [](BatchInput& input, Policies&, Span<Box>&) { input.poses.data = nullptr; });
  refuse_boxes(Status::kBadOrigins, [](BatchInput& input, Policies&, Span<Box>&) { input.origins.size = 1; });
  refuse_boxes(Status::kBadOrientations, [](BatchInput& input, Policies&, Span<Box>&) { input.orientations.size = 1; });
  refuse_boxes(Status::kBadFlags, [](BatchInput& input, Policies&, Span<Box>&) { input.flags.size = 1; });
  refuse_boxes(Status::kBadPolicy,
               [](BatchInput&, Policies& policies, Span<Box>&) { policies.refit = static_cast<Refit>(77); });
  refuse_boxes(Status::kBadOutput, [](BatchInput&, Policies&, Span<Box>& out) { --out.size; });
  refuse_boxes(Status::kBadOutput, [](BatchInput&, Policies&, Span<Box>& out) { out.data = nullptr; });
}
