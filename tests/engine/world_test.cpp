// World: the answers of the calls that it is made of, buffers that grow, ownership, and a status for every misuse.
#include <cab/world.h>

#include "perf/harness/random_world.h"
#include "tests/engine/counted_new.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cstring>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

namespace cab::tests {
namespace {

using oracle::Member;
using oracle::Outcome;
using oracle::Random;

static_assert(!std::is_copy_constructible_v<World> && !std::is_copy_assignable_v<World>);
static_assert(std::is_nothrow_move_constructible_v<World> && std::is_nothrow_move_assignable_v<World>);
static_assert(std::is_nothrow_default_constructible_v<World>);

constexpr std::int32_t kOneLink[] = {-1};
constexpr float kPose[7] = {0, 0, 0, 1, 0, 0, 0};

template <class T>
bool same_bytes(Span<const T> a, const std::vector<T>& b) {
  return a.size == b.size() && (a.empty() || std::memcmp(a.data, b.data(), a.size * sizeof(T)) == 0);
}

// Adds `count` cubes of side 1, 0.9 apart along x, each of which touches the next one. `poses` and `origins` hold them.
struct Cubes {
  BatchId batch;
  std::vector<float> poses;
  std::vector<double> origins;

  Status add(World& world, std::uint32_t count) {
    const Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {.5f, .5f, .5f}), {}};
    if (const Status status = world.add_batch({kOneLink, {}, {&leaf, 1}, {}}, count, &batch); status != Status::kOk)
      return status;
    for (std::uint32_t i = 0; i < count; ++i) {
      poses.insert(poses.end(), kPose, kPose + 7);
      origins.insert(origins.end(), {.9 * i, 0, 0});
    }
    world.input(batch)->poses.data = poses.data();
    world.input(batch)->origins = origins;
    return world.add_rule({batch, batch});
  }
  void move_to(double spacing) {
    for (std::size_t i = 0; i < origins.size(); i += 3) origins[i] = spacing * static_cast<double>(i / 3);
  }
};

// Counts the frames that an engine runs, overflows included.
struct FrameCounter {
  int frames = 0;
  Profiler profiler = {this,
                       [](void* user, const char* phase, std::uint32_t) {
                         static_cast<FrameCounter*>(user)->frames += std::strcmp(phase, "frame") == 0;
                       },
                       [](void*, const char*, std::uint32_t) {}};
  EngineDesc desc() const {
    EngineDesc out;
    out.profiler = &profiler;
    return out;
  }
};

// Adds the batches and rules of a random world, whose batches have the ids 1, 2, ... there.
void add_all(World& world, const oracle::World& from) {
  for (const Member& member : from.members) {
    BatchId id;
    REQUIRE(world.add_batch(member.rig.desc(), member.poses.instance_count, &id, nullptr, member.kind) == Status::kOk);
    BatchInput& input = *world.input(id);
    input = member.poses.input(id);
    input.layers = member.layers;
    input.layer_masks = member.layer_masks;
  }
  for (const PairRule& rule : from.rules) REQUIRE(world.add_rule(rule) == Status::kOk);
}

std::size_t bytes_of_articulations(const World& world) {
  EngineMemory memory;
  REQUIRE(engine_memory(world.engine(), &memory) == Status::kOk);
  return memory.articulations;
}

}  // namespace

TEST_CASE("a world has the hits and the contacts of the plain calls, frame after frame") {
  std::size_t hit_count = 0;
  for (std::uint64_t seed = 1; seed <= rounds(30); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    oracle::World from;
    oracle::add_characters(random, from, 16);
    if (random.chance(0.5)) oracle::add_frames(random, from, 16);
    oracle::add_layers(random, from);
    from.margin = random.chance(0.5) ? 0.1f : 0;
    from.contacts = random.chance(0.5);
    Policies policies;
    if (from.contacts) policies.exact = Exact::kConvex;
    const Outcome expected = oracle::run_world(from, policies);

    World world;
    add_all(world, from);
    world.job().policies = policies;
    world.job().margin = from.margin;
    world.want_contacts(from.contacts);
    for (int frame = 0; frame < 2; ++frame) {
      REQUIRE(world.run() == Status::kOk);
      CHECK(same_bytes(world.hits(), expected.hits));
      CHECK(same_bytes(world.contacts(), expected.contacts));
      CHECK(world.job().stats.leaf_pairs == expected.stats.leaf_pairs);
      CHECK(world.job().hits_needed == expected.hits.size());
    }
    hit_count += expected.hits.size();
  }
  CHECK(hit_count >= least_count(1000, 30));
}

TEST_CASE("a frame with too many hits runs twice, and then once, without an allocation") {
  for (const bool with_contacts : {false, true}) {
    CAPTURE(with_contacts);
    FrameCounter counter;
    World world(counter.desc());
    Cubes cubes;
    REQUIRE(cubes.add(world, 60) == Status::kOk);
    world.want_contacts(with_contacts);
    if (with_contacts) world.job().policies.exact = Exact::kConvex;
    const auto runs = [&](std::size_t hits) {
      const int before = counter.frames;
      REQUIRE(world.run() == Status::kOk);
      CHECK(world.hits().size == hits);
      CHECK(world.contacts().size == (with_contacts ? hits : 0));
      return counter.frames - before;
    };
    CHECK(runs(59) == 1);  // the first buffers are large enough
    cubes.move_to(.01);    // all touch
    CHECK(runs(60 * 59 / 2) == 2);
    const std::uint64_t news = new_call_count();
    CHECK(runs(60 * 59 / 2) == 1);
    cubes.move_to(.9);
    CHECK(runs(59) == 1);
    cubes.move_to(.01);
    CHECK(runs(60 * 59 / 2) == 1);
    CHECK(new_call_count() == news);
  }
}

TEST_CASE("a frame that skips what rests runs until there is room for all that rests, too") {
  FrameCounter counter;
  World world(counter.desc());
  Cubes cubes;
  constexpr std::uint32_t kPairs = 900;
  REQUIRE(cubes.add(world, 2 * kPairs) == Status::kOk);
  world.rules()[0].resting = Resting::kSkipped;
  cubes.move_to(10);
  std::vector<std::uint8_t> moved(2 * kPairs);
  world.input(cubes.batch)->moved = moved;
  std::uint32_t landed = 0;
  // Returns how many hits there are once that many more pairs touch.
  const auto land = [&](std::uint32_t count) {
    std::fill(moved.begin(), moved.end(), std::uint8_t{0});
    for (; count > 0; --count, ++landed) {
      cubes.origins[6 * landed + 3] = cubes.origins[6 * landed] + .9;
      moved[2 * landed + 1] = 1;
    }
    REQUIRE(world.run() == Status::kOk);
    return world.hits().size;
  };
  CHECK(land(0) == 0);
  for (int frame = 0; frame < 3; ++frame) CHECK(land(200) == 200);  // the first buffer has room for these
  const int before = counter.frames;
  CHECK(land(300) == 900);  // all count as moved after the first run, whose buffer was too small for 300
  CHECK(counter.frames - before == 3);
}

TEST_CASE("reserve makes the room of frames to come, and of their contacts if they are wanted by then") {
  FrameCounter counter;
  World world(counter.desc());
  Cubes cubes;
  REQUIRE(cubes.add(world, 60) == Status::kOk);
  cubes.move_to(.01);
  world.want_contacts();
  world.job().policies.exact = Exact::kConvex;
  ReserveDesc room;
  room.hits = 2000;
  REQUIRE(world.reserve(room) == Status::kOk);
  const std::uint64_t news = new_call_count();
  REQUIRE(world.run() == Status::kOk);
  CHECK(new_call_count() == news);
  CHECK(counter.frames == 1);
  CHECK(world.contacts().size == 60 * 59 / 2);
}

TEST_CASE("contacts that are wanted after a large frame have room for as many hits") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 60) == Status::kOk);
  cubes.move_to(.01);
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.contacts().empty());
  world.want_contacts();
  CHECK(world.run() == Status::kContactsNeedExact);
  CHECK(world.hits().empty());
  world.job().policies.exact = Exact::kConvex;
  REQUIRE(world.run() == Status::kOk);
  REQUIRE(world.contacts().size == 60 * 59 / 2);
  for (const Contact& contact : world.contacts()) CHECK(contact.depth > 0);
  world.want_contacts(false);
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.contacts().empty());
  world.job().report = Report::kDistances;  // computes them in any case
  world.job().margin = .1f;
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.contacts().size == world.hits().size);
  CHECK(!world.contacts().empty());
}

TEST_CASE("a world that is moved goes on, and the one that it is moved from has no engine") {
  std::size_t bytes = 0;
  const Allocator allocator = {&bytes,
                               [](void* user, std::size_t size, std::size_t alignment) -> void* {
                                 *static_cast<std::size_t*>(user) += size;
                                 return ::operator new(size, std::align_val_t(alignment));
                               },
                               [](void* user, void* memory, std::size_t size, std::size_t alignment) {
                                 *static_cast<std::size_t*>(user) -= size;
                                 ::operator delete(memory, std::align_val_t(alignment));
                               }};
  EngineDesc desc;
  desc.allocator = &allocator;
  Cubes cubes;
  {
    World first(desc);
    REQUIRE(cubes.add(first, 10) == Status::kOk);
    REQUIRE(first.run() == Status::kOk);
    const Hit* const hits = first.hits().data;

    World second(std::move(first));
    CHECK(second.status() == Status::kOk);
    CHECK(second.hits().data == hits);
    CHECK(second.hits().size == 9);
    REQUIRE(second.run() == Status::kOk);
    CHECK(second.hits().size == 9);

    // NOLINTBEGIN(bugprone-use-after-move)
    CHECK(first.status() == Status::kNullArgument);
    CHECK(first.hits().empty());
    CHECK(first.contacts().empty());
    CHECK(first.query_hits().empty());
    CHECK(first.inputs().empty());
    CHECK(first.rules().empty());
    CHECK(first.input(cubes.batch) == nullptr);
    CHECK(first.job().hits.empty());
    CHECK(first.run() == Status::kNullArgument);
    CHECK(first.add_rule({cubes.batch, cubes.batch}) == Status::kNullArgument);
    CHECK(first.remove_batch(cubes.batch) == Status::kNullArgument);
    CHECK(first.reserve({}) == Status::kNullArgument);
    BatchId id;
    CHECK(first.add_batch({{1}, 1}, &id) == Status::kNullArgument);
    CHECK(first.add_batch(ArticulationDesc(), 1, &id) == Status::kNullArgument);
    CHECK(first.add_static_batch({}, &id) == Status::kNullArgument);
    QueryJob queries;
    CHECK(first.run_queries(queries) == Status::kNullArgument);
    // NOLINTEND(bugprone-use-after-move)

    // Another engine takes the place of none, and of one that it ends.
    first = World(desc);
    Cubes others;
    REQUIRE(others.add(first, 5) == Status::kOk);
    REQUIRE(first.run() == Status::kOk);
    CHECK(first.hits().size == 4);
    const std::size_t both = bytes;
    first = std::move(second);
    CHECK(bytes < both);
    REQUIRE(first.run() == Status::kOk);
    CHECK(first.hits().size == 9);
  }
  CHECK(bytes == 0);
}

TEST_CASE("a removed batch takes its input, its rules and its own articulation along") {
  World world;
  const std::size_t none = bytes_of_articulations(world);
  Cubes cubes[3];
  for (Cubes& of : cubes) REQUIRE(of.add(world, 4) == Status::kOk);
  const BatchId a = cubes[0].batch, b = cubes[1].batch, c = cubes[2].batch;
  REQUIRE(world.add_rule({a, b}) == Status::kOk);
  REQUIRE(world.add_rule({b, c}) == Status::kOk);
  REQUIRE(world.add_rule({a, c}) == Status::kOk);
  REQUIRE(world.run() == Status::kOk);
  const std::size_t all_hits = world.hits().size;
  CHECK(all_hits == 3 * 3 + 3 * (4 + 2 * 3));

  CHECK(world.remove_batch(b) == Status::kOk);
  CHECK(world.input(b) == nullptr);
  CHECK(world.input(slot_of(b)) == nullptr);
  REQUIRE(world.inputs().size == 2);
  CHECK(world.inputs()[0].batch == a);
  CHECK(world.inputs()[1].batch == c);
  CHECK(world.input(c)->poses.data == cubes[2].poses.data());
  REQUIRE(world.rules().size == 3);
  for (const PairRule& rule : world.rules()) CHECK((rule.a != b && rule.b != b));
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.hits().size == 2 * 3 + 4 + 2 * 3);
  CHECK(world.remove_batch(b) == Status::kUnknownBatch);

  // The next batch takes the slot, with an input of its own, and the old id is not that of it.
  Cubes next;
  REQUIRE(next.add(world, 2) == Status::kOk);
  CHECK(slot_of(next.batch) == slot_of(b));
  CHECK(world.input(b) == nullptr);
  CHECK(world.input(slot_of(b)) == world.input(next.batch));
  CHECK(world.input(BatchId{slot_of(b).value}) == world.input(next.batch));
  CHECK(world.input(next.batch) == &world.inputs()[1]);
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.input(world.hits()[0].batch_a)->batch == a);

  for (const BatchId id : {a, c, next.batch}) CHECK(world.remove_batch(BatchId{slot_of(id).value}) == Status::kOk);
  CHECK(world.inputs().empty());
  CHECK(world.rules().empty());
  CHECK(bytes_of_articulations(world) == none);
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.hits().empty());
}

TEST_CASE("an articulation goes with its last batch if the world has added it, and stays if the caller has") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 4) == Status::kOk);
  BatchInfo info;
  REQUIRE(batch_info(world.engine(), cubes.batch, &info) == Status::kOk);
  BatchId second;
  REQUIRE(world.add_batch({info.articulation, 3}, &second) == Status::kOk);
  ArticulationInfo counts;
  CHECK(world.remove_batch(cubes.batch) == Status::kOk);
  CHECK(articulation_info(world.engine(), info.articulation, &counts) == Status::kOk);
  CHECK(world.remove_batch(second) == Status::kOk);
  CHECK(articulation_info(world.engine(), info.articulation, &counts) == Status::kUnknownArticulation);

  const Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {1, 1, 1}), {}};
  ArticulationId kept;
  REQUIRE(add_articulation(world.engine(), {kOneLink, {}, {&leaf, 1}, {}}, &kept) == Status::kOk);
  REQUIRE(world.add_batch({kept, 3}, &second) == Status::kOk);
  CHECK(world.remove_batch(second) == Status::kOk);
  CHECK(articulation_info(world.engine(), kept, &counts) == Status::kOk);
}

TEST_CASE("what is refused has its status, and leaves the world as it was") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 10) == Status::kOk);
  REQUIRE(world.run() == Status::kOk);
  const std::size_t articulations = bytes_of_articulations(world);

  // Inputs of a frame.
  BatchInput& input = *world.input(cubes.batch);
  input.poses.data = nullptr;
  CHECK(world.run() == Status::kBadPoses);
  input.poses.data = cubes.poses.data();
  cubes.origins[4] = std::numeric_limits<double>::infinity();
  CHECK(world.run() == Status::kBadOrigins);
  cubes.origins[4] = 0;
  world.job().margin = -1;
  CHECK(world.run() == Status::kBadMargin);
  world.job().margin = 0;
  REQUIRE(world.add_rule({cubes.batch, cubes.batch}) == Status::kOk);
  CHECK(world.run() == Status::kPairRuleGivenTwice);
  CHECK(world.hits().empty());
  world.clear_rules();
  CHECK(world.run() == Status::kOk);
  CHECK(world.hits().empty());
  REQUIRE(world.add_rule({cubes.batch, cubes.batch}) == Status::kOk);

  // What is added and removed.
  const BatchId foreign = {cubes.batch.value + (std::uint64_t{1} << 48)};
  CHECK(world.add_rule({cubes.batch, foreign}) == Status::kUnknownBatch);
  CHECK(world.add_rule({{}, cubes.batch}) == Status::kUnknownBatch);
  CHECK(world.remove_batch(foreign) == Status::kUnknownBatch);
  CHECK(world.remove_batch({}) == Status::kUnknownBatch);
  CHECK(world.input(foreign) == nullptr);
  CHECK(world.input(BatchId()) == nullptr);
  CHECK(world.input(BatchSlot()) == nullptr);
  BatchId id = {77};
  std::uint32_t bad = 0;
  Leaf leaves[] = {{0, axis_aligned_box({0, 0, 0}, {1, 1, 1}), {}}, {1, Box(), {}}};
  CHECK(world.add_batch({kOneLink, {}, leaves, {}}, 3, &id, &bad) == Status::kBadLeafLink);
  CHECK(bad == 1);
  leaves[1].link = 0;
  CHECK(world.add_batch({kOneLink, {}, leaves, {}}, 0, &id, &bad) == Status::kNoInstances);
  CHECK(world.add_batch({kOneLink, {}, leaves, {}}, 3, nullptr) == Status::kBadOutput);
  CHECK(world.add_batch({{99}, 3}, &id) == Status::kUnknownArticulation);
  CHECK(world.add_batch({{99}, 3}, nullptr) == Status::kBadOutput);
  CHECK(world.add_static_batch({}, &id) == Status::kNoInstances);
  StaticBody bodies[2];
  bodies[1].rotation[3] = 0;
  StaticDesc desc;
  desc.bodies = bodies;
  CHECK(world.add_static_batch(desc, &id, &bad) == Status::kBadStaticBody);
  CHECK(bad == 1);
  CHECK(world.reserve({0, 0x80000001u, 0, 0}) == Status::kTooManyInstances);
  CHECK(id.value == 77);
  CHECK(world.inputs().size == 1);
  CHECK(bytes_of_articulations(world) == articulations);
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.hits().size == 9);

  EngineDesc without_functions;
  const Allocator allocator;
  without_functions.allocator = &allocator;
  World none(without_functions);
  CHECK(none.status() == Status::kBadAllocator);
  CHECK(none.run() == Status::kBadAllocator);
  CHECK(cubes.add(none, 3) == Status::kBadAllocator);
}

TEST_CASE("static bodies take part with nothing but a rule") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 10) == Status::kOk);
  StaticBody floor;
  floor.box = axis_aligned_box({2, -1, 0}, {1, .6f, 1});
  StaticDesc desc;
  desc.bodies = {&floor, 1};
  BatchId ground;
  REQUIRE(world.add_static_batch(desc, &ground) == Status::kOk);
  REQUIRE(world.add_rule({ground, cubes.batch}) == Status::kOk);
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.hits().size == 9 + 3);  // cubes 1 to 3, whose bounds reach from 0.4 to 3.2
  CHECK(world.remove_batch(ground) == Status::kOk);
  REQUIRE(world.run() == Status::kOk);
  CHECK(world.hits().size == 9);
}

TEST_CASE("queries ask the world's inputs, and find room for themselves and for all hits") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 500) == Status::kOk);
  Query ray;
  ray.want = QueryWant::kAll;
  ray.position[0] = -10;
  ray.direction[0] = 1;
  ray.length = 1000;
  QueryJob job;
  job.queries = {&ray, 1};
  for (int time = 0; time < 2; ++time) {
    REQUIRE(world.run_queries(job) == Status::kOk);
    REQUIRE(world.query_hits().size == 500);
    for (std::uint32_t i = 0; i < 500; ++i) CHECK(world.query_hits()[i].instance == i);
  }
  const std::uint64_t news = new_call_count();
  REQUIRE(world.run_queries(job) == Status::kOk);
  CHECK(new_call_count() == news);
  ray.direction[0] = 0;
  CHECK(world.run_queries(job) == Status::kBadQuery);
  CHECK(world.query_hits().empty());
  ray.direction[1] = 1;
  REQUIRE(world.run_queries(job) == Status::kOk);
  CHECK(world.query_hits().empty());
}

TEST_CASE("queries of a world have the places of hits on skins if they are wanted, however many hits there are") {
  World world;
  const float vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, weights[] = {1, 1, 1};
  const std::uint32_t triangle[] = {0, 1, 2}, links[] = {0, 0, 0};
  Leaf leaf;
  leaf.triangles = triangle;
  ArticulationDesc desc;
  desc.link_parents = kOneLink;
  desc.leaves = {&leaf, 1};
  desc.skin = {vertices, 1, links, weights, {}};
  BatchId batch;
  REQUIRE(world.add_batch(desc, 700, &batch) == Status::kOk);
  std::vector<float> poses;
  std::vector<double> origins;
  for (int i = 0; i < 700; ++i) {
    poses.insert(poses.end(), kPose, kPose + 7);
    origins.insert(origins.end(), {0, 0, .01 * i});
  }
  world.input(batch)->poses.data = poses.data();
  world.input(batch)->origins = origins;
  Query ray;
  ray.want = QueryWant::kAll;
  for (int c = 0; c < 3; ++c) ray.position[c] = c < 2 ? .25 : -1;
  ray.direction[2] = 1;
  ray.length = 100;
  QueryJob job;
  job.queries = {&ray, 1};
  job.exact = Exact::kSurface;
  REQUIRE(world.run_queries(job) == Status::kOk);
  CHECK(world.query_hits().size == 700);
  CHECK(world.surface_points().empty());
  world.want_surface_points();
  for (int time = 0; time < 2; ++time) {
    REQUIRE(world.run_queries(job) == Status::kOk);
    REQUIRE(world.query_hits().size == 700);
    REQUIRE(world.surface_points().size == 700);
    for (const SurfacePoint& point : world.surface_points()) CHECK(point.triangle == 0);
  }
  world.want_surface_points(false);
  REQUIRE(world.run_queries(job) == Status::kOk);
  CHECK(world.surface_points().empty());
}

TEST_CASE("a batch whose count is 0 needs no poses") {
  World world;
  Cubes cubes, none;
  REQUIRE(cubes.add(world, 10) == Status::kOk);
  REQUIRE(none.add(world, 5) == Status::kOk);
  REQUIRE(world.add_rule({cubes.batch, none.batch}) == Status::kOk);
  BatchInput& input = *world.input(none.batch);
  input.poses.data = nullptr;
  CHECK(world.run() == Status::kBadPoses);
  input.count = 0;
  for (const BatchKind kind : {BatchKind::kCharacters, BatchKind::kSequence}) {
    if (kind == BatchKind::kSequence) {
      BatchId sequence;
      const Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {1, 1, 1}), {}};
      REQUIRE(world.add_batch({kOneLink, {}, {&leaf, 1}, {}}, 3, &sequence, nullptr, kind) == Status::kOk);
      world.input(sequence)->count = 0;
    }
    REQUIRE(world.run() == Status::kOk);
    CHECK(world.hits().size == 9);
  }
  world.input(none.batch)->poses.format = static_cast<PoseFormat>(9);
  CHECK(world.run() == Status::kBadPoses);
}

TEST_CASE("a run that a frame in progress refuses leaves no hits") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 10) == Status::kOk);
  REQUIRE(world.run() == Status::kOk);
  REQUIRE(world.hits().size == 9);
  REQUIRE(begin_frame(world.engine(), world.job()) == Status::kOk);
  CHECK(world.run() == Status::kBusy);
  CHECK(world.hits().empty());
}

TEST_CASE("while a frame is in progress a world refuses to change, and its inputs and rules stay where they are") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 10) == Status::kOk);
  ReserveDesc few;
  few.hits = 9;
  REQUIRE(world.reserve(few) == Status::kOk);
  REQUIRE(begin_frame(world.engine(), world.job()) == Status::kOk);
  const Hit* const hits = world.job().hits.data;
  const Span<BatchInput> inputs = world.inputs();
  const Span<PairRule> rules = world.rules();
  const Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {1, 1, 1}), {}};
  const ArticulationDesc body = {kOneLink, {}, {&leaf, 1}, {}};
  StaticBody block;
  block.box = leaf.box;
  StaticDesc statics;
  statics.bodies = {&block, 1};
  BatchId id;
  for (int time = 0; time < 20; ++time) {
    CHECK(world.add_batch(body, 1, &id) == Status::kBusy);
    CHECK(world.add_static_batch(statics, &id) == Status::kBusy);
    CHECK(world.add_rule({cubes.batch, cubes.batch, Pairing::kWithin}) == Status::kBusy);
    CHECK(world.remove_batch(cubes.batch) == Status::kBusy);
    CHECK(world.run() == Status::kBusy);
  }
  CHECK(world.inputs().data == inputs.data);
  CHECK(world.rules().data == rules.data);
  CHECK(world.job().hits.data == hits);
  std::uint32_t count = 0;
  while (next_tasks(world.engine(), &count) == Status::kOk && count > 0)
    for (std::uint32_t t = 0; t < count; ++t) REQUIRE(run_task(world.engine(), t, 0) == Status::kOk);
  REQUIRE(end_frame(world.engine()) == Status::kOk);
  REQUIRE(world.job().hit_count == 9);
  for (std::uint32_t i = 0; i < 9; ++i) CHECK(world.job().hits[i].instance_a == i);
  for (int time = 0; time < 20; ++time) REQUIRE(world.add_batch(body, 1, &id) == Status::kOk);
  REQUIRE(world.add_rule({cubes.batch, cubes.batch, Pairing::kWithin}) == Status::kOk);
  CHECK(world.rules().size == 2);
}

TEST_CASE("calls that take a job take the world's: frames by tasks, candidates, words") {
  World world;
  Cubes cubes;
  REQUIRE(cubes.add(world, 40) == Status::kOk);
  cubes.move_to(.01);
  const auto by_tasks = [&] {
    REQUIRE(begin_frame(world.engine(), world.job()) == Status::kOk);
    std::uint32_t count = 0;
    while (next_tasks(world.engine(), &count) == Status::kOk && count > 0)
      for (std::uint32_t t = 0; t < count; ++t) REQUIRE(run_task(world.engine(), t, 0) == Status::kOk);
    return end_frame(world.engine());
  };
  REQUIRE(by_tasks() == Status::kHitsOverflow);
  ReserveDesc room;
  room.hits = static_cast<std::uint32_t>(world.job().hits_needed);
  REQUIRE(world.reserve(room) == Status::kOk);
  REQUIRE(by_tasks() == Status::kOk);
  CHECK(world.job().hit_count == 40 * 39 / 2);
  CHECK(world.job().hits.size >= 40 * 39 / 2);

  std::vector<float> bounds;
  for (int i = 0; i < 40; ++i) bounds.insert(bounds.end(), {-1, -1, -1, 1, 1, 1});
  world.input(cubes.batch)->bounds = bounds;
  CandidateList list;
  CHECK(find_candidates(world.engine(), world.job(), list) == Status::kPairsOverflow);
  CHECK(list.pairs_needed == 40 * 39 / 2);

  char words[200];
  world.clear_rules();
  explain_job(world.engine(), world.job(), words);
  CHECK(std::string(words).find("rules is empty") != std::string::npos);
}

TEST_CASE("operator new that fails at any call of a world gives kOutOfMemory, and the world goes on") {
  const auto story = [](World& world, Cubes& cubes) {
    if (const Status status = cubes.add(world, 40); status != Status::kOk) return status;
    if (const Status status = world.run(); status != Status::kOk) return status;
    cubes.move_to(.01);
    if (const Status status = world.run(); status != Status::kOk) return status;
    Query query;
    QueryJob job;
    job.queries = {&query, 1};
    return world.run_queries(job);
  };
  int failures = 0;
  for (std::int64_t k = 0;; ++k) {
    CAPTURE(k);
    Cubes cubes;
    cubes.poses.reserve(7 * 40);
    cubes.origins.reserve(3 * 40);
    fail_new_after(k);
    World world;
    const Status status = story(world, cubes);
    fail_new_after(-1);
    if (status == Status::kOk) break;
    REQUIRE(status == Status::kOutOfMemory);
    ++failures;
    if (world.status() != Status::kOk) continue;
    // What there is by now is as if nothing had failed.
    if (world.inputs().empty()) {
      CHECK(world.rules().empty());
      CHECK(bytes_of_articulations(world) == bytes_of_articulations(World()));
      continue;
    }
    if (world.rules().empty()) REQUIRE(world.add_rule({cubes.batch, cubes.batch}) == Status::kOk);
    REQUIRE(world.run() == Status::kOk);
    const bool was_moved = cubes.origins[3] == .01;
    CHECK(world.hits().size == (was_moved ? 40 * 39 / 2 : 39));
  }
  CHECK(failures > 10);
}

}  // namespace cab::tests
