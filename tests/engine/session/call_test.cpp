// Calls that read an engine run beside each other and give the bits that they give alone; a call that changes it runs
// alone. Beside each other: inside the tasks of another read, and on several threads.
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/query_judge.h"
#include "perf/judge/oracle/random_queries.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// Characters of quaternions in two frames, static boxes, a history of the first batch, and queries about all of them.
// Batch m + 1 is that of member m, and the last one that of the boxes.
struct Scene {
  World world, last;
  std::vector<StaticBody> bodies;
  RandomQueries about;
  std::vector<double> times = {1, 2, 3};

  explicit Scene(Random& random, std::uint32_t queries) {
    PoseRange range;
    range.spread = 2;
    for (const std::uint32_t count : {33u, 17u}) {
      Member member;
      member.rig = any_rig(random, 12);
      member.poses = random_poses(random, member.rig, count, PoseFormat::kQuaternionTranslation, range);
      last.members.push_back(member);
      member.poses = random_poses(random, member.rig, count, PoseFormat::kQuaternionTranslation, range);
      world.members.push_back(member);
    }
    pair_all(world, 1, 2);
    for (int i = 0; i < 20; ++i) {
      StaticBody& body = bodies.emplace_back();
      for (double& x : body.origin) x = random.uniform(-2, 2);
      body.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.1f, .2f, .3f}};
    }
    QueryScene scene;
    for (std::uint32_t m = 0; m < 2; ++m)
      for (std::uint32_t i = 0; i < world.members[m].poses.instance_count; ++i)
        scene.push_back(query_instance({m + 1}, world.members[m].rig, world.members[m].poses, i, ~0u));
    add_queries(random, scene, queries, about);
    for (Query& query : about.queries)
      if (random.chance(0.3)) query.time = random.uniform(0, 4);
  }

  EnginePtr engine(const EngineDesc& desc = {}) const {
    EnginePtr out = make_engine_for(world, desc);
    StaticDesc level;
    level.bodies = bodies;
    BatchId id;
    require(add_static_batch(*out, level, &id));
    ReserveDesc room;
    room.queries = 16;
    require(reserve(*out, room));
    HistoryId history;
    require(add_history(*out, {{1}, 4}, &history));
    for (const double time : times) require(record_tick(*out, history, world.members[0].poses.input({1}), time));
    return out;
  }

  std::vector<BatchInput> inputs(const World& of, bool with_bodies) const {
    std::vector<BatchInput> out;
    for (std::uint32_t m = 0; m < 2; ++m) out.push_back(of.members[m].poses.input({m + 1}));
    if (with_bodies) out.emplace_back().batch = {3};
    return out;
  }
};

constexpr HistoryId kHistory = {1};

// All that the reads of an engine write, as bytes.
struct Bytes {
  std::string all;

  template <class T>
  void add(const std::vector<T>& values) {
    for (T value : values) {
      clear_padding(value);
      all.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
  }

 private:
  static void clear_after(void* value, std::size_t used, std::size_t size) {
    std::memset(static_cast<char*>(value) + used, 0, size - used);
  }
  template <class T>
  static void clear_padding(T&) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_same_v<T, float> || std::is_same_v<T, Box> ||
                      std::is_same_v<T, Contact>,
                  "a type whose bytes are all of members");
  }
  static void clear_padding(QueryHit& hit) { clear_after(&hit, offsetof(QueryHit, inside) + 1, sizeof hit); }
  static void clear_padding(BoxLine& line) { clear_after(&line, offsetof(BoxLine, is_hit) + 1, sizeof line); }
};

std::string queries_of(Engine& engine, const Scene& scene, bool reuse_bounds) {
  const std::vector<BatchInput> inputs = scene.inputs(scene.world, true);
  QueryJob job;
  job.inputs = inputs;
  job.queries = scene.about.queries;
  job.planes = scene.about.planes;
  job.histories = {&kHistory, 1};
  job.reuse_bounds = reuse_bounds;
  std::vector<QueryHit> hits(4096);
  std::vector<std::uint8_t> found(job.queries.size);
  job.hits = hits;
  job.found = found;
  require(run_queries(engine, job));
  hits.resize(job.hit_count);
  Bytes out;
  out.add(hits);
  out.add(found);
  return out.all;
}

std::string boxes_of(Engine& engine, const Scene& scene) {
  Bytes out;
  for (const BatchInput& input : scene.inputs(scene.world, true)) {
    std::vector<Box> boxes(1024 * 33);
    require(compute_boxes(engine, input, {}, boxes));
    out.add(boxes);
    BoxLinesJob job;
    std::vector<BoxLine> lines(1 << 16);
    job.lines = lines;
    require(box_lines(engine, input, job));
    lines.resize(job.line_count);
    out.add(lines);
  }
  MaskReason reason;
  require(why_masked(engine, scene.inputs(scene.world, false)[0], 3, &reason));
  CHECK(reason.cause == MaskCause::kNone);
  return out.all;
}

std::string contacts_of(Engine& engine, const Scene& scene, const std::vector<Hit>& hits) {
  const std::vector<BatchInput> inputs = scene.inputs(scene.world, false), last = scene.inputs(scene.last, false);
  Bytes out;
  std::vector<Contact> contacts(hits.size());
  require(compute_contacts(engine, inputs, hits, contacts));
  out.add(contacts);
  std::vector<float> moments(hits.size()), margins(33);
  require(find_touching_moments(engine, last, inputs, 0.01f, hits, moments));
  out.add(moments);
  require(sweep_margins(engine, last[0], inputs[0], margins));
  out.add(margins);
  std::vector<std::uint32_t> order(33);
  require(spatial_order(engine, {1}, order));
  out.add(order);
  return out.all;
}

using Read = std::function<std::string(Engine&)>;

// Every kind of read. hits: of a frame.
std::vector<Read> reads_of(const Scene& scene, const std::vector<Hit>& hits) {
  return {[&scene](Engine& engine) { return queries_of(engine, scene, false); },
          [&scene](Engine& engine) { return queries_of(engine, scene, true); },
          [&scene](Engine& engine) { return boxes_of(engine, scene); },
          [&scene, &hits](Engine& engine) { return contacts_of(engine, scene, hits); }};
}

// Runs a function inside the next phase that an engine tells its profiler of.
struct Inside {
  std::function<void()> run;

  static void begin(void* user, const char*, std::uint32_t) {
    if (const auto run = std::exchange(static_cast<Inside*>(user)->run, nullptr)) run();
  }
  // An engine with that profiler, of which it keeps a copy.
  EnginePtr engine(const Scene& scene) {
    const Profiler profiler = {this, begin, [](void*, const char*, std::uint32_t) {}};
    EngineDesc desc;
    desc.profiler = &profiler;
    return scene.engine(desc);
  }

  // The same for the next tasks that it runs: then the inputs of a call are bound.
  static void run_tasks(void* user, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t),
                        void* context) {
    begin(user, nullptr, 0);
    for (std::uint32_t t = 0; t < count; ++t) task(context, t, 0);
  }
  Scheduler scheduler() { return {this, 1, run_tasks}; }
};

}  // namespace

TEST_CASE(
    "a read inside a read gives what it gives alone, and what changes the engine is refused until both have ended") {
  Random random(1);
  const Scene scene(random, 40);
  Inside inside;
  const Scheduler scheduler = inside.scheduler();
  EngineDesc desc;
  desc.scheduler = &scheduler;
  const EnginePtr engine = scene.engine(desc);
  const std::vector<Hit> hits = run_on(*engine, scene.world, {}).hits;
  REQUIRE(hits.size() > 20);
  const std::vector<Read> reads = reads_of(scene, hits);
  const std::string outer = reads[1](*engine);
  for (const Read& read : reads) {
    const std::string alone = read(*engine);
    CHECK(alone.size() > 100);
    std::string within;
    inside.run = [&] {
      within = read(*engine);
      FrameJob frame;
      CHECK(run_frame(*engine, frame) == Status::kBusy);
      CHECK(begin_frame(*engine, frame) == Status::kBusy);
      CHECK(reserve(*engine, {}) == Status::kBusy);
      CHECK(remove_batch(*engine, {1}) == Status::kBusy);
      CHECK(remove_history(*engine, kHistory) == Status::kBusy);
      CHECK(record_tick(*engine, kHistory, scene.world.members[0].poses.input({1}), 9) == Status::kBusy);
    };
    CHECK((reads[1](*engine) == outer));
    CHECK(!inside.run);
    CHECK((within == alone));
    CHECK(same_hits(run_on(*engine, scene.world, {}).hits, hits));
  }
}

TEST_CASE("a read inside a frame is refused as busy") {
  Random random(2);
  const Scene scene(random, 10);
  Inside inside;
  const EnginePtr engine = inside.engine(scene);
  QueryJob job;
  const BatchInput input = scene.world.members[0].poses.input({1});
  inside.run = [&] {
    CHECK(run_queries(*engine, job) == Status::kBusy);
    CHECK(compute_boxes(*engine, input, {}, {}) == Status::kBusy);
    CHECK(compute_contacts(*engine, {&input, 1}, {}, {}) == Status::kBusy);
    MaskReason reason;
    CHECK(why_masked(*engine, input, 0, &reason) == Status::kBusy);
    CHECK(spatial_order(*engine, {1}, {}) == Status::kBusy);
  };
  run_on(*engine, scene.world, {});
  CHECK(!inside.run);
  CHECK(run_queries(*engine, job) == Status::kOk);
}

TEST_CASE("reads on several threads give the bits that they give alone, in every frame") {
  constexpr std::uint32_t kThreads = 4;
  Random random(3);
  const Scene scene(random, 40);
  for (const std::uint32_t threads : {1u, 2u}) {
    EngineDesc desc;
    desc.thread_count = threads;
    const EnginePtr engine = scene.engine(desc), alone = scene.engine();
    const std::vector<Hit> hits = run_on(*alone, scene.world, {}).hits;
    const std::vector<Read> reads = reads_of(scene, hits);
    std::vector<std::string> expected;
    for (const Read& read : reads) expected.push_back(read(*alone));
    for (unsigned frame = 0; frame < rounds(6); ++frame) {
      run_on(*engine, scene.world, {});
      std::atomic<std::uint32_t> wrong{0}, threw{0}, ready{0};
      std::vector<std::thread> all;
      for (std::uint32_t t = 0; t < kThreads; ++t)
        all.emplace_back([&, t] {
          ++ready;
          while (ready < kThreads) std::this_thread::yield();
          for (std::size_t i = 0; i < 2 * reads.size(); ++i) {
            const std::size_t which = (i + t) % reads.size();
            try {
              wrong += reads[which](*engine) != expected[which];
            } catch (const std::exception&) { ++threw; }
          }
        });
      for (std::thread& thread : all) thread.join();
      CHECK(wrong == 0);
      CHECK(threw == 0);
    }
  }
}

TEST_CASE("reads beside each other have memory of their own: as many readers as run at a time, until reserve") {
  Random random(4);
  const Scene scene(random, 10);
  Inside inside;
  const EnginePtr engine = inside.engine(scene);
  const auto bytes = [&] {
    EngineMemory memory;
    require(engine_memory(*engine, &memory));
    CHECK(memory.total >= memory.queries + memory.workers + memory.histories);
    return std::array<std::size_t, 3>{memory.queries, memory.workers, memory.histories};
  };
  const auto before = bytes();
  queries_of(*engine, scene, false);
  CHECK(bytes() == before);
  const auto read_in_read = [&] {
    inside.run = [&] { queries_of(*engine, scene, false); };
    queries_of(*engine, scene, false);
  };
  read_in_read();
  const auto with_two = bytes();
  for (std::size_t i = 0; i < 3; ++i) CHECK(with_two[i] > before[i]);
  read_in_read();
  CHECK(bytes() == with_two);
  CHECK(engine->readers.size() == 2);
  ReserveDesc more;
  more.queries = 64;
  require(reserve(*engine, more));
  CHECK(engine->readers.size() == 1);
  read_in_read();
  CHECK(engine->readers.size() == 2);
}

TEST_CASE("a read beside another sees batches and histories that were added after its reader was made") {
  Random random(5);
  const Scene scene(random, 10);
  Inside inside;
  const EnginePtr engine = inside.engine(scene);
  const auto read_in_read = [&](const std::function<std::string()>& read) {
    const std::string alone = read();
    std::string within;
    inside.run = [&] { within = read(); };
    queries_of(*engine, scene, false);
    CHECK((within == alone));
    CHECK(within.size() > 0);
  };
  read_in_read([&] { return queries_of(*engine, scene, true); });
  require(remove_batch(*engine, {2}));
  const Member& member = scene.world.members[1];
  ArticulationId articulation = {2};
  const BatchId id = add_instances(*engine, articulation, member.poses.instance_count);
  HistoryId history;
  require(add_history(*engine, {id, 4}, &history));
  require(record_tick(*engine, history, member.poses.input(id), 1));
  read_in_read([&] {
    Query query;
    query.kind = QueryKind::kPoint;
    query.length = std::numeric_limits<float>::infinity();
    query.time = 1;
    QueryJob job;
    job.queries = {&query, 1};
    job.histories = {&history, 1};
    std::vector<QueryHit> hits(1);
    job.hits = hits;
    require(run_queries(*engine, job));
    CHECK(job.hit_count == 1);
    std::vector<Box> boxes(1024 * 33);
    require(compute_boxes(*engine, member.poses.input(id), {}, boxes));
    Bytes out;
    out.add(boxes);
    out.add(hits);
    return out.all;
  });
}

}  // namespace cab::tests
