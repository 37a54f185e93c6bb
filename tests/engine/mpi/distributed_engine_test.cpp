// What frames and calls of all ranks refuse: with one answer for all, and an engine that goes on.
#include "perf/harness/random_world.h"
#include "tests/layout/closed_skin.h"

#include <cab/mpi.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCount = 40;

struct Deleter {
  void operator()(mpi::DistributedEngine* engine) const { mpi::destroy(engine); }
};

// One batch, of which each rank has every `ranks`th character.
struct Fixture {
  int rank = 0, ranks = 1;
  Rig rig;
  Poses poses;
  std::vector<std::uint32_t> numbers;
  std::unique_ptr<mpi::DistributedEngine, Deleter> engine;
  std::vector<PairRule> rules = {{{1}, {1}, Pairing::kBetween}};
  std::vector<mpi::RankInput> inputs;
  mpi::DistributedJob job;

  Fixture() {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    Random random(3);
    rig = random_rig(random, Topology::kTree, 5, 1);
    for (auto i = static_cast<std::uint32_t>(rank); i < kCount; i += static_cast<std::uint32_t>(ranks))
      numbers.push_back(i);
    poses = random_poses(random, rig, static_cast<std::uint32_t>(numbers.size()), PoseFormat::kQuaternionTranslation,
                         {1, true, true, {}});
    mpi::DistributedEngine* made = nullptr;
    REQUIRE(mpi::create(MPI_COMM_WORLD, {}, &made).ok());
    engine.reset(made);
    ArticulationId articulation;
    REQUIRE(mpi::add_articulation(*engine, rig.desc(), &articulation).ok());
    BatchId batch;
    REQUIRE(mpi::add_batch(*engine, {articulation, kCount, BatchKind::kCharacters}, &batch).ok());
    REQUIRE(batch.value == 1);
    inputs = {{poses.input({1}), numbers}};
    job.inputs = inputs;
    job.rules = rules;
  }

  bool is_last() const { return rank == ranks - 1; }

  // The answer to a frame that `change` changes on the last rank; a frame without it must then run.
  template <class Change>
  mpi::Answer answer(Change&& change) {
    const std::vector<mpi::RankInput> kept_inputs = inputs;
    const mpi::DistributedJob kept = job;
    if (is_last()) change();
    job.inputs = inputs;
    const mpi::Answer out = mpi::run_frame(*engine, job);
    inputs = kept_inputs;
    job = kept;
    job.inputs = inputs;
    CHECK(mpi::run_frame(*engine, job).ok());
    return out;
  }

  template <class Change>
  void check_status(Status status, Change&& change) {
    const mpi::Answer got = answer(change);
    CHECK(got.status == status);
    CHECK(got.rank == ranks - 1);
  }
};

// What all ranks are told of an articulation that each adds to an engine of its own.
mpi::Answer answer_to(const ArticulationDesc& desc) {
  mpi::DistributedEngine* made = nullptr;
  REQUIRE(mpi::create(MPI_COMM_WORLD, {}, &made).ok());
  ArticulationId id;
  const mpi::Answer answer = mpi::add_articulation(*made, desc, &id);
  mpi::destroy(made);
  return answer;
}

// An articulation that the last rank has otherwise is told, unless there is one rank alone.
void check_differs(const Fixture& f, const mpi::Answer& answer) {
  CHECK(answer.difference == (f.ranks == 1 ? mpi::Difference::kNone : mpi::Difference::kAdded));
  CHECK(answer.status == Status::kOk);
}

}  // namespace

TEST_CASE("what one rank gives wrongly is refused on all, and the next frame runs") {
  Fixture f;
  const std::vector<std::uint32_t> twice(f.numbers.size(), 1), beyond = {kCount};
  f.check_status(Status::kBadInstances, [&] { f.inputs[0].numbers = twice; });
  f.check_status(Status::kBadInstances, [&] { f.inputs[0].numbers = beyond; });
  f.check_status(Status::kBadInstances, [&] { f.inputs[0].input.count = 1; });
  f.check_status(Status::kBadPoses, [&] { f.inputs[0].input.poses.data = nullptr; });
  f.check_status(Status::kBadOrigins, [&] { f.inputs[0].input.origins.size = 1; });
  f.check_status(Status::kUnknownBatch, [&] { f.inputs[0].input.batch = {9}; });
  f.check_status(Status::kBatchGivenTwice, [&] { f.inputs.push_back(f.inputs[0]); });
  const float margin = -1;
  f.check_status(Status::kBadMargins, [&] { f.inputs[0].input.margins = {&margin, 1}; });
  f.check_status(Status::kBadReport, [&] { f.job.report = Report::kInContact; });
  f.check_status(Status::kBadPolicy, [&] { f.job.policies.strategy = static_cast<Strategy>(kStrategyCount); });
  f.check_status(Status::kContactsNeedExact, [&] { f.job.contacts = true; });
  f.check_status(Status::kBadMargin, [&] { f.job.margin = -1; });
  const PairRule unknown = {{7}, {1}, Pairing::kBetween};
  f.check_status(Status::kBadPairRule, [&] { f.job.rules = {&unknown, 1}; });
}

TEST_CASE("a frame that is refused leaves no hits or contacts of an earlier one in the job") {
  Fixture f;
  std::fill(f.poses.origins.begin(), f.poses.origins.end(), 0.25);
  f.job.policies.exact = Exact::kConvex;
  f.job.contacts = true;
  REQUIRE(mpi::run_frame(*f.engine, f.job).ok());
  const auto found = static_cast<unsigned>(f.job.hit_list.size);
  unsigned least = 0;  // of all ranks
  MPI_Allreduce(&found, &least, 1, MPI_UNSIGNED, MPI_MIN, MPI_COMM_WORLD);
  REQUIRE(least > 0);
  CHECK(f.job.contact_list.size == f.job.hit_list.size);
  if (f.is_last()) f.job.margin = -1;
  CHECK(mpi::run_frame(*f.engine, f.job).status == Status::kBadMargin);
  CHECK(f.job.hit_list.size == 0);
  CHECK(f.job.contact_list.size == 0);
  f.job.margin = 0;
  CHECK(mpi::run_frame(*f.engine, f.job).ok());
  CHECK(f.job.hit_list.size == found);
}

TEST_CASE("what differs between ranks is told") {
  Fixture f;
  if (f.ranks == 1) return;
  CHECK(f.answer([&] { f.job.margin = 1; }).difference == mpi::Difference::kJob);
  CHECK(f.answer([&] { f.job.rules = {}; }).difference == mpi::Difference::kJob);
  CHECK(f.answer([&] { f.job.containment = false; }).difference == mpi::Difference::kJob);
  const std::vector<std::uint32_t> layers(f.numbers.size(), 1);
  CHECK(f.answer([&] { f.inputs[0].input.layers = layers; }).difference == mpi::Difference::kMembers);

  // The first rank's characters once more, at the same places.
  std::vector<std::uint32_t> same = f.numbers;
  for (std::uint32_t& number : same) number -= static_cast<std::uint32_t>(f.rank);
  CHECK(f.answer([&] { f.inputs[0].numbers = same; }).difference == mpi::Difference::kNumbers);

  mpi::DistributedDesc desc;
  desc.program = f.is_last() ? "one" : "another";
  mpi::DistributedEngine* engine = nullptr;
  const mpi::Answer program = mpi::create(MPI_COMM_WORLD, desc, &engine);
  CHECK(program.difference == mpi::Difference::kProgram);
  CHECK(program.rank == f.ranks - 1);

  BatchId batch;
  const mpi::Answer added =
      mpi::add_batch(*f.engine, {{1}, kCount + (f.is_last() ? 1u : 0u), BatchKind::kCharacters}, &batch);
  CHECK(added.difference == mpi::Difference::kAdded);
}

TEST_CASE("a skin that differs between ranks in any number is told, and a bad one is refused on all") {
  const Fixture f;
  const auto add = [&f](auto&& change) {
    SkinRig skin = rig_of(ball_mesh(1), 2, 0.5, 8);
    ArticulationDesc desc = skin.desc();
    if (f.is_last()) change(skin, desc);
    return answer_to(desc);
  };
  const auto differs = [&](auto&& change) { check_differs(f, add(change)); };
  CHECK(add([](SkinRig&, ArticulationDesc&) {}).ok());
  differs([](SkinRig& skin, ArticulationDesc&) { skin.vertices[4] += 1; });
  differs([](SkinRig& skin, ArticulationDesc&) { skin.weights[1] += 1; });
  differs([](SkinRig& skin, ArticulationDesc&) { std::swap(skin.links[0], skin.links[1]); });
  differs([](SkinRig& skin, ArticulationDesc&) { skin.inverse_bind[12] += 1; });
  differs([](SkinRig& skin, ArticulationDesc&) { std::swap(skin.triangles[0][0], skin.triangles[0][1]); });
  CHECK(add([](SkinRig& skin, ArticulationDesc&) { skin.leaves[0].box.center[0] = 1; }).ok());  // is not read
  CHECK(add([](SkinRig&, ArticulationDesc& desc) { desc.skin.vertices.data = nullptr; }).status == Status::kBadSkin);
  CHECK(add([](SkinRig& skin, ArticulationDesc&) { skin.weights[0] = -1; }).status == Status::kBadSkin);
}

TEST_CASE("a rest pose that differs between ranks in any number is told, and a bad one is refused on all") {
  const Fixture f;
  const std::int32_t parents[] = {-1, 0};
  const Leaf leaves[] = {{0, {}, {}, {}}, {1, {}, {}, {}}};
  const auto add = [&](auto&& change) {
    std::vector<float> poses;
    for (std::size_t link = 0; link < std::size(leaves); ++link)
      poses.insert(poses.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    ArticulationDesc desc;
    desc.link_parents = parents;
    desc.leaves = leaves;
    desc.rest_pose = {PoseFormat::kMatrix4x4Columns, poses.data(), 16 * sizeof(float), 0, false};
    if (f.is_last()) change(desc.rest_pose, poses);
    return answer_to(desc);
  };
  const auto differs = [&](auto&& change) { check_differs(f, add(change)); };
  using Numbers = std::vector<float>;
  differs([](PoseView&, Numbers& numbers) { numbers[12] = 5; });
  differs([](PoseView&, Numbers& numbers) { numbers[16 + 14] = 5; });
  differs([](PoseView& poses, Numbers&) { poses.has_scale = true; });
  differs([](PoseView& poses, Numbers&) { poses.format = PoseFormat::kMatrix3x4Rows; });
  differs([](PoseView& poses, Numbers&) { poses.data = nullptr; });
  CHECK(add([](PoseView&, Numbers& numbers) { numbers[16 + 15] = 5; }).ok());  // is not read
  const auto bad = [](PoseView& poses, Numbers&) { poses.format = static_cast<PoseFormat>(3); };
  CHECK(add(bad).status == Status::kBadRestPose);
  CHECK(add([](PoseView& poses, Numbers&) { poses.link_stride = 1; }).status == Status::kBadRestPose);
}

TEST_CASE("what is wholly inside a closed part of another rank's body is a hit of all ranks, unless that is off") {
  const Fixture f;
  const SkinRig skin = rig_of(ball_mesh(2), 2, 0.5, 40);
  mpi::DistributedEngine* made = nullptr;
  REQUIRE(mpi::create(MPI_COMM_WORLD, {}, &made).ok());
  const std::unique_ptr<mpi::DistributedEngine, Deleter> engine(made);
  ArticulationId articulation;
  REQUIRE(mpi::add_articulation(*engine, skin.desc(), &articulation).ok());
  BatchId batch;
  REQUIRE(mpi::add_batch(*engine, {articulation, 2, BatchKind::kCharacters}, &batch).ok());

  // Rank 0 has one of ten times the size about that of the last rank.
  constexpr float kSizes[] = {10, 1};
  std::vector<std::uint32_t> numbers;
  std::vector<float> poses, scales;
  for (const std::uint32_t number : {0u, 1u}) {
    if (f.rank != (number == 0 ? 0 : f.ranks - 1)) continue;
    numbers.push_back(number);
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0.5f, 0, 0});
    scales.push_back(kSizes[number]);
  }
  mpi::RankInput input;
  input.input.batch = batch;
  input.input.poses.data = poses.data();
  input.input.scales = scales;
  input.numbers = numbers;
  const PairRule rule = {batch, batch, Pairing::kBetween};
  mpi::DistributedJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};
  job.policies.exact = Exact::kSurface;
  for (const bool containment : {true, false}) {
    job.containment = containment;
    REQUIRE(mpi::run_frame(*engine, job).ok());
    auto hits = static_cast<unsigned>(job.hit_list.size);
    MPI_Allreduce(MPI_IN_PLACE, &hits, 1, MPI_UNSIGNED, MPI_SUM, MPI_COMM_WORLD);
    CHECK(hits == (containment ? 1 : 0));
  }
  // Contacts of triangles are refused by all.
  job.contacts = true;
  CHECK(mpi::run_frame(*engine, job).status == Status::kSkinNotTaken);
}

TEST_CASE("sequences, and what an engine refuses, cannot be added") {
  Fixture f;
  BatchId batch;
  CHECK(mpi::add_batch(*f.engine, {{1}, 3, BatchKind::kSequence}, &batch).status == Status::kBadBatchKind);
  Fixture g;
  CHECK(mpi::add_batch(*g.engine, {{8}, 3, BatchKind::kCharacters}, &batch).status == Status::kUnknownArticulation);
  Fixture h;
  ArticulationId articulation;
  CHECK(mpi::add_articulation(*h.engine, {}, &articulation).status == Status::kNoLinks);
}

}  // namespace cab::tests
