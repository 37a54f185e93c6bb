// The public API with and without the optional packages: what the library says it was built with, and how it acts.
#include <cab/cab.h>

#include <doctest/doctest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace {

using namespace cab;

constexpr bool kFcl = CAB_EXPECT_FCL != 0, kQhull = CAB_EXPECT_QHULL != 0, kTbb = CAB_EXPECT_TBB != 0;
constexpr std::uint32_t kCharacters = 600;

// An engine with a row of kCharacters octahedra, each a hull with a vertex inside.
struct Row {
  Engine* engine = nullptr;
  BatchId batch;
  std::vector<float> poses;
  std::vector<Hit> hits = std::vector<Hit>(2 * kCharacters);
  FrameJob job;

  explicit Row(const EngineDesc& desc) {
    REQUIRE(create_engine(desc, &engine) == Status::kOk);
    const float vertices[] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0.1f, 0.1f, 0.1f};
    ConvexPart hull;
    hull.kind = ShapeKind::kConvexHull;
    hull.vertices = {vertices, 21};
    const std::int32_t parent = -1;
    const Leaf leaf = {0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {&hull, 1}};
    ArticulationId octahedron;
    REQUIRE(add_articulation(*engine, {{&parent, 1}, {}, {&leaf, 1}, {}}, &octahedron) == Status::kOk);
    REQUIRE(add_batch(*engine, {octahedron, kCharacters, BatchKind::kCharacters}, &batch) == Status::kOk);
    // Neighbours overlap by box. The shapes of every second pair do.
    for (std::uint32_t i = 0; i < kCharacters; ++i)
      poses.insert(poses.end(), {0, 0, 0, 1, 1.7f * static_cast<float>(i), i / 2 % 2 ? 0.5f : 0.0f, 0});
  }
  Row(const Row&) = delete;
  Row& operator=(const Row&) = delete;
  ~Row() { destroy_engine(engine); }

  Status run(Exact exact) {
    BatchInput input;
    input.batch = batch;
    input.poses.data = poses.data();
    const PairRule rule = {batch, batch, Pairing::kBetween};
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    job.policies.exact = exact;
    job.hits = hits;
    return run_frame(*engine, job);
  }
};

// A scheduler on threads of the caller; where there are none, workers take turns.
constexpr std::uint32_t kWorkers = 3;
void run_on_threads(void*, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) {
#ifdef __EMSCRIPTEN__
  for (std::uint32_t t = 0; t < count; ++t) task(context, t, t % kWorkers);
#else
  std::atomic<std::uint32_t> next{0};
  std::vector<std::thread> threads;
  for (std::uint32_t worker = 0; worker < kWorkers; ++worker)
    threads.emplace_back([&, worker] {
      for (std::uint32_t t = next++; t < count; t = next++) task(context, t, worker);
    });
  for (std::thread& thread : threads) thread.join();
#endif
}

}  // namespace

TEST_CASE("the library says what it was built with") {
  CHECK(build_info().fcl == kFcl);
  CHECK(build_info().qhull == kQhull);
  CHECK(build_info().tbb == kTbb);
}

TEST_CASE("the exact test by FCL answers, or its absence is a status") {
  Row row({});
  REQUIRE(row.run(Exact::kNone) == Status::kOk);
  CHECK(row.job.hit_count == kCharacters - 1);
  if (kFcl) {
    REQUIRE(row.run(Exact::kFcl) == Status::kOk);
    CHECK(row.job.hit_count == kCharacters / 2);
  } else {
    CHECK(row.run(Exact::kFcl) == Status::kExactNotBuilt);
    CHECK(row.run(Exact::kNone) == Status::kOk);
  }
}

TEST_CASE("a flat hull is accepted, and one on a line refused, whatever was built in") {
  float vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0.5f, 0.25f, 0};
  ConvexPart hull;
  hull.kind = ShapeKind::kConvexHull;
  hull.vertices = {vertices, 15};
  const std::int32_t parent = -1;
  const Leaf leaf = {0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {&hull, 1}};
  Engine* engine = nullptr;
  REQUIRE(create_engine({}, &engine) == Status::kOk);
  ArticulationId id;
  CHECK(add_articulation(*engine, {{&parent, 1}, {}, {&leaf, 1}, {}}, &id) == Status::kOk);
  for (int v = 0; v < 5; ++v) vertices[3 * v + 1] = 0;
  CHECK(add_articulation(*engine, {{&parent, 1}, {}, {&leaf, 1}, {}}, &id) == Status::kBadShape);
  destroy_engine(engine);
}

TEST_CASE("without TBB an engine has one thread, and a caller's scheduler works with and without") {
  Row serial({});
  CHECK(engine_thread_count(*serial.engine) == 1);
  REQUIRE(serial.run(Exact::kNone) == Status::kOk);
  EngineDesc two_threads;
  two_threads.thread_count = 2;
  EngineDesc own;
  const Scheduler scheduler = {nullptr, kWorkers, run_on_threads};
  own.scheduler = &scheduler;
  Row threaded(two_threads), scheduled(own);
  CHECK(engine_thread_count(*threaded.engine) <= (kTbb ? 2u : 1u));
  CHECK(engine_thread_count(*scheduled.engine) == kWorkers);
  for (Row* row : {&threaded, &scheduled}) {
    REQUIRE(row->run(Exact::kNone) == Status::kOk);
    REQUIRE(row->job.hit_count == serial.job.hit_count);
    std::size_t different = 0;
    for (std::size_t i = 0; i < serial.job.hit_count; ++i)
      different +=
          row->hits[i].instance_a != serial.hits[i].instance_a || row->hits[i].instance_b != serial.hits[i].instance_b;
    CHECK(different == 0);
  }
}
