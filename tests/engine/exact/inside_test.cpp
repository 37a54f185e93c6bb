// What is wholly inside a closed part of a skin, judged by solid angles in long double.
#include "engine/exact/inside.h"

#include "engine/frame/all_pairs.h"
#include "perf/harness/world.h"
#include "tests/engine/hit_links.h"
#include "tests/engine/thread_pool.h"
#include "tests/layout/closed_skin.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cstring>
#include <set>
#include <utility>

namespace cab::tests {
namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;  // an outer and an inner instance

std::set<Pair> pairs_of(const std::vector<Hit>& hits) {
  std::set<Pair> out;
  for (const Hit& hit : hits) out.insert({hit.instance_a, hit.instance_b});
  return out;
}

// Two skins: instances of the second are inside instances of the first, or touch them, or neither.
struct Nest {
  SkinRig rigs[2];
  Poses poses[2];
};

Nest random_nest(Random& random, std::uint64_t round) {
  Nest out;
  const double unit = round % 3 == 0 ? random.log_uniform(1e-4, 1e4) : 1;
  Mesh outer = lump_mesh(random, 2, unit * Vec3<double>{{2, 0.6, 0.6}}, unit * Vec3<double>{{1.5, 0, 0}});
  if (round % 4 == 1)  // another part, apart from the first
    outer.add(lump_mesh(random, 1, unit * Vec3<double>{{0.4, 0.4, 0.4}}, unit * Vec3<double>{{1.5, 1.2, 0}}));
  const double small = unit * random.log_uniform(0.02, 0.2);
  Mesh inner = lump_mesh(random, 1, small * Vec3<double>{{1, 1, 1}}, {});
  out.rigs[0] = rig_of(outer, 4, unit, 20 + random.index(40), random.chance(0.3) ? &random : nullptr);
  out.rigs[1] = rig_of(inner, 2, small, 10 + random.index(30));
  const PoseFormat format = random.chance(0.5) ? PoseFormat::kMatrix3x4Rows : PoseFormat::kQuaternionTranslation;
  out.poses[0] = random_skin_poses(random, out.rigs[0], 3, format, 0.3, 0.05, 0);
  out.poses[1] = random_skin_poses(random, out.rigs[1], 12, format, 0.3, 0.05, 0);
  for (Poses& poses : out.poses) poses.scales.clear();  // the outer skin is the larger one
  // Some are mirrored: one axis of all links of all instances.
  if (format == PoseFormat::kMatrix3x4Rows && random.chance(0.3))
    for (std::size_t p = 0; p < out.poses[1].data.size(); p += 12)
      for (std::size_t c = 0; c < 3; ++c) out.poses[1].data[p + 4 * c] = -out.poses[1].data[p + 4 * c];
  const double away = round % 3 == 1 ? 1e7 : 0;
  for (std::uint32_t i = 0; i < 3; ++i)
    for (std::size_t c = 0; c < 3; ++c) out.poses[0].origins.push_back(away + (c == 1 ? 8 * unit * i : 0));
  for (std::uint32_t i = 0; i < 12; ++i) {
    const std::vector<Triangle<Real>> around = placed_triangles(out.rigs[0], out.poses[0], i % 3);
    const Point& at = around[random.index(static_cast<unsigned>(around.size()))].corner[0];
    const Point& to = around[random.index(static_cast<unsigned>(around.size()))].corner[0];
    const Real part = random.uniform(-0.1, 1.1);
    for (std::size_t c = 0; c < 3; ++c)
      out.poses[1].origins.push_back(static_cast<double>(at[c] + part * (to[c] - at[c])));
  }
  return out;
}

// A world of both, and its frames.
struct World {
  EnginePtr engine;
  BatchId batch[2];
  const Nest& nest;

  World(const Nest& of, const EngineDesc& desc = {}, BatchKind kind = BatchKind::kCharacters, bool swapped = false)
      : engine(make_engine(desc)), nest(of) {
    for (const std::size_t k : swapped ? std::array<std::size_t, 2>{1, 0} : std::array<std::size_t, 2>{0, 1}) {
      ArticulationId articulation;
      require(add_articulation(*engine, nest.rigs[k].desc(), &articulation));
      batch[k] = add_instances(*engine, articulation, nest.poses[k].instance_count, kind);
    }
  }

  // Hits of the outer with the inner skin, as if the outer one were the first batch.
  std::vector<Hit> run(FrameJob job = {}, decltype(&run_frame) frame = run_frame, FrameStats* stats = nullptr) const {
    const BatchInput inputs[] = {nest.poses[0].input(batch[0]), nest.poses[1].input(batch[1])};
    const PairRule rule = {batch[0], batch[1], Pairing::kBetween};
    job.policies.exact = Exact::kSurface;
    job.inputs = inputs;
    job.rules = {&rule, 1};
    std::vector<Hit> hits(4096);
    job.hits = hits;
    require(frame(*engine, job));
    hits.resize(job.hit_count);
    if (stats) *stats = job.stats;
    for (Hit& hit : hits)
      if (slot_of(batch[1]).value < slot_of(batch[0]).value) {
        std::swap(hit.instance_a, hit.instance_b);
        std::swap(hit.link_a, hit.link_b);
        std::swap(hit.leaf_a, hit.leaf_b);
      }
    return hits;
  }
};

// A skin of one link and of one leaf, at rest.
SkinRig still_rig(const Mesh& mesh) { return rig_of(mesh, 1, 1, 1000); }

Mesh scaled(Mesh mesh, double by, const Vec3<double>& at) {
  for (Vec3<double>& v : mesh.vertices) v = by * v + at;
  return mesh;
}

// A cube from -1 to 1, of two triangles a side.
Mesh cube_mesh() {
  Mesh out;
  for (std::uint32_t i = 0; i < 8; ++i)
    out.vertices.push_back({{i & 1 ? 1.0 : -1.0, i >> 1 & 1 ? 1.0 : -1.0, i >> 2 ? 1.0 : -1.0}});
  static constexpr std::uint32_t kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                                 {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& side : kSides) {
    out.triangles.push_back({side[0], side[1], side[2]});
    out.triangles.push_back({side[0], side[2], side[3]});
  }
  return out;
}

// One instance of each of two still skins, at rest.
Nest still_nest(const Mesh& outer, const Mesh& inner) {
  Nest out;
  out.rigs[0] = still_rig(outer);
  out.rigs[1] = still_rig(inner);
  for (Poses& poses : out.poses) {
    poses.link_count = poses.instance_count = 1;
    poses.data = {0, 0, 0, 1, 0, 0, 0};
  }
  return out;
}

bool is_found(const Nest& nest) { return !World(nest).run().empty(); }

}  // namespace

TEST_CASE("what is inside a closed skin is found, and nothing else that does not touch it") {
  Random random(411);
  std::size_t inside = 0, touching = 0, apart = 0;
  const std::uint64_t count = rounds(24);
  for (std::uint64_t round = 0; round < count; ++round) {
    const Nest nest = random_nest(random, round);
    const World world(nest);
    const std::vector<Hit> hits = world.run();
    FrameJob without;
    without.containment = false;
    const std::set<Pair> found = pairs_of(hits), touch = pairs_of(world.run(without));
    std::vector<std::vector<Triangle<Real>>> outer;
    for (std::uint32_t i = 0; i < 3; ++i) outer.push_back(placed_triangles(nest.rigs[0], nest.poses[0], i));
    for (std::uint32_t k = 0; k < 12; ++k) {
      const std::vector<Triangle<Real>> inner = placed_triangles(nest.rigs[1], nest.poses[1], k);
      for (std::uint32_t i = 0; i < 3; ++i) {
        CAPTURE(round);
        CAPTURE(i);
        CAPTURE(k);
        const Real gap = distance_of(outer[i], inner);
        if (gap <= 0) {
          ++touching;
          CHECK(touch.count({i, k}) == 1);
          CHECK(found.count({i, k}) == 1);
          continue;
        }
        CHECK(touch.count({i, k}) == 0);
        const Real winding = winding_of(outer[i], inner[0].corner[0]);
        REQUIRE(std::fabs(winding - std::round(winding)) < 1e-9L);
        const bool is_inside = std::round(winding) != 0;
        CHECK((found.count({i, k}) == 1) == is_inside);
        ++(is_inside ? inside : apart);
      }
    }
  }
  CHECK(inside >= least_count(40, 24));
  CHECK(touching >= least_count(40, 24));
  CHECK(apart >= least_count(200, 24));
}

TEST_CASE("what is inside is the same by every strategy, instruction set, thread, margin, order and kind of frame") {
  Random random(412);
  std::size_t seen = 0;
  const std::uint64_t count = rounds(8);
  for (std::uint64_t round = 0; round < count; ++round) {
    const Nest nest = random_nest(random, round);
    const std::vector<Hit> first = World(nest).run();
    FrameJob without;
    without.containment = false;
    seen += pairs_of(first).size() - pairs_of(World(nest).run(without)).size();
    CHECK(links_of(World(nest).run({}, run_all_pairs)) == links_of(first));
    CHECK(links_of(World(nest, {}, BatchKind::kCharacters, true).run()) == links_of(first));
    for (const Strategy strategy : {Strategy::kBrute, Strategy::kRows, Strategy::kLinks, Strategy::kTree}) {
      FrameJob job;
      job.policies.strategy = strategy;
      CHECK(links_of(World(nest).run(job)) == links_of(first));
    }
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 3u}) {
        EngineDesc desc;
        desc.isa = isa;
        desc.thread_count = threads;
        const std::vector<Hit> hits = World(nest, desc).run();
        REQUIRE(hits.size() == first.size());
        CHECK((hits.empty() || std::memcmp(hits.data(), first.data(), hits.size() * sizeof(Hit)) == 0));
      }
    for (const double share : {1e-3, 1e-1}) {
      FrameJob job;
      job.margin = static_cast<float>(share * nest.rigs[1].size);
      const std::set<Pair> wide = pairs_of(World(nest).run(job)), own = pairs_of(first);
      CHECK(std::includes(wide.begin(), wide.end(), own.begin(), own.end()));
      job.margin = 0;
    }
    // The order of triangles in leaves, and of leaves, changes no pair of instances.
    Nest other = nest;
    std::reverse(other.rigs[0].triangles.begin(), other.rigs[0].triangles.end());
    std::reverse(other.rigs[0].leaves.begin(), other.rigs[0].leaves.end());
    for (std::size_t leaf = 0; leaf < other.rigs[0].leaves.size(); ++leaf)
      other.rigs[0].leaves[leaf].triangles = other.rigs[0].triangles[leaf];
    CHECK(links_of(World(other).run()) == links_of(first));
  }
  CHECK(seen >= least_count(8, 8));
}

TEST_CASE("what is inside is found in sequences, and sets in_contact") {
  Random random(413);
  std::size_t seen = 0;
  const std::uint64_t count = rounds(6);
  for (std::uint64_t round = 0; round < count; ++round) {
    Nest nest = random_nest(random, round);
    // Frame k of the inner skin is tested with frame k of the outer one: that whose surroundings it was put into.
    Poses outer = nest.poses[0];
    outer.instance_count = 12;
    outer.data.clear();
    outer.origins.clear();
    outer.orientations.clear();
    outer.scales.clear();
    const Poses& from = nest.poses[0];
    const std::size_t floats = from.link_count * from.floats_per_pose();
    for (std::size_t k = 0; k < 12; ++k) {
      const std::size_t i = k % 3;
      outer.data.insert(outer.data.end(), from.data.begin() + static_cast<std::ptrdiff_t>(i * floats),
                        from.data.begin() + static_cast<std::ptrdiff_t>((i + 1) * floats));
      for (std::size_t c = 0; c < 3; ++c) outer.origins.push_back(from.origins[3 * i + c]);
      for (std::size_t c = 0; c < 4 && !from.orientations.empty(); ++c)
        outer.orientations.push_back(from.orientations[4 * i + c]);
      if (!from.scales.empty()) outer.scales.push_back(from.scales[i]);
    }
    const std::vector<Hit> characters = World(nest).run();
    nest.poses[0] = outer;
    const std::vector<Hit> hits = World(nest, {}, BatchKind::kSequence).run();
    for (std::uint32_t k = 0; k < 12; ++k) {
      const bool is_hit = pairs_of(hits).count({k, k}) == 1;
      CHECK(is_hit == (pairs_of(characters).count({k % 3, k}) == 1));
      seen += is_hit;
    }
    for (const BatchKind kind : {BatchKind::kCharacters, BatchKind::kSequence}) {
      const World world(nest, {}, kind);
      std::vector<std::uint8_t> flags(12);
      BatchInput inputs[] = {nest.poses[0].input(world.batch[0]), nest.poses[1].input(world.batch[1])};
      inputs[1].in_contact = flags;
      const PairRule rule = {world.batch[0], world.batch[1], Pairing::kBetween};
      FrameJob job;
      job.policies.exact = Exact::kSurface;
      job.report = Report::kInContact;
      job.inputs = inputs;
      job.rules = {&rule, 1};
      REQUIRE(run_frame(*world.engine, job) == Status::kOk);
      std::set<std::uint32_t> in_hits;
      for (const Hit& hit : kind == BatchKind::kCharacters ? world.run() : hits) in_hits.insert(hit.instance_b);
      for (std::uint32_t k = 0; k < 12; ++k) CHECK((flags[k] != 0) == (in_hits.count(k) == 1));
    }
  }
  CHECK(seen >= least_count(12, 6));
}

TEST_CASE("a ray that passes edges and vertices is cast again, and a point beside a plane is on its side") {
  const Mesh small = scaled(ball_mesh(0), 0x1p-10, {});
  // All vertices of an octahedron are as near to its middle, so the first is where rays begin. Numbers are such that
  // floats hold the places along rays.
  const Vec3<double> start = 0x1p-10 * Vec3<double>{{1, 0, 0}};
  const auto corner = [&start](std::size_t ray, double by) {
    return start + by * Vec3<double>{{kInsideRays[ray][0], kInsideRays[ray][1], kInsideRays[ray][2]}};
  };
  // Vertices on both sides of the start along as many rays, which so pass through vertices.
  for (std::size_t grazed = 1; grazed <= 3; ++grazed) {
    CAPTURE(grazed);
    Mesh outer = ball_mesh(0);
    const Vec3<double> others[] = {{{1, 0.1, 0.2}}, {{-0.1, 1, 0.3}}, {{0.2, -0.3, 1}}};
    for (std::size_t k = 0; k < 3; ++k)
      for (const double side : {1.0, -1.0})
        outer.vertices[2 * k + (side < 0)] = k < grazed ? corner(k, 0x1p-6 * side) : side * others[k];
    CHECK(is_found(still_nest(outer, small)));
    CHECK_FALSE(is_found(still_nest(scaled(outer, 1, {{4, 4, 4}}), small)));
    // Behind the start nothing is crossed, though the line passes through vertices.
    for (Vec3<double>& v : outer.vertices) v = v + corner(0, -0x1p-5);
    CHECK_FALSE(is_found(still_nest(outer, small)));
  }
  // Each ray grazes a part that others miss, and the point is in none of them.
  Mesh around;
  for (std::size_t ray = 0; ray < kInsideRayCount; ++ray)
    around.add(scaled(ball_mesh(0), 0x1p-4, corner(ray, 0x1p-6) - 0x1p-4 * Vec3<double>{{0, 0, 1}}));
  CHECK_FALSE(is_found(still_nest(around, small)));
  around.add(scaled(ball_mesh(1), 8, {{0, 0, 0}}));
  CHECK(is_found(still_nest(around, small)));
  // Cubes whose sides, edges and diagonals are in planes with those of the other.
  for (const double shift : {0.0, 0.25, 0.5}) {
    CHECK(is_found(still_nest(cube_mesh(), scaled(cube_mesh(), 0.25, {{shift, shift, shift}}))));
    CHECK(is_found(still_nest(cube_mesh(), scaled(cube_mesh(), 0.25, {{shift, 0, 0}}))));
  }
  // Beside a notch: in the planes of its sides, and outside.
  Mesh notched = cube_mesh();
  notched.vertices.push_back({{0, 0, 0.5}});  // the middle of the upper side, lower
  notched.triangles.erase(notched.triangles.begin() + 2, notched.triangles.begin() + 4);
  const std::uint32_t upper[] = {4, 5, 7, 6};
  for (std::size_t k = 0; k < 4; ++k) notched.triangles.push_back({upper[k], upper[(k + 1) % 4], 8});
  CHECK_FALSE(is_found(still_nest(notched, scaled(cube_mesh(), 0.0625, {{0, 0, 0.875}}))));
  CHECK(is_found(still_nest(notched, scaled(cube_mesh(), 0.0625, {{0, 0, 0.25}}))));
  CHECK(is_found(still_nest(notched, scaled(cube_mesh(), 0.0625, {{0.875, 0, 0.5}}))));
}

TEST_CASE("only closed parts have an inside, whichever way their triangles turn") {
  const Mesh small = scaled(ball_mesh(1), 0.1, {{0.05, 0.02, 0.03}});
  Mesh outer = ball_mesh(2);
  CHECK(is_found(still_nest(outer, small)));
  for (auto& t : outer.triangles) std::swap(t[1], t[2]);
  CHECK(is_found(still_nest(outer, small)));
  for (std::size_t t = 0; t < outer.triangles.size(); t += 3) std::swap(outer.triangles[t][1], outer.triangles[t][2]);
  CHECK(is_found(still_nest(outer, small)));
  CHECK_FALSE(is_found(still_nest(outer, scaled(ball_mesh(1), 0.1, {{0.9, 0.9, 0.9}}))));
  outer.triangles.pop_back();
  CHECK_FALSE(is_found(still_nest(outer, small)));
  // An open part inside a closed one is found, and a closed one about it in the same skin changes nothing.
  Mesh open = small;
  open.triangles.pop_back();
  CHECK(is_found(still_nest(ball_mesh(2), open)));
  Mesh two = ball_mesh(2);
  two.add(scaled(ball_mesh(1), 3, {}));
  CHECK(is_found(still_nest(two, small)));
  // A part that winds twice about the point, as where an arm is in the belly: two balls with a vertex in common.
  Mesh twice = ball_mesh(2);
  const auto first = static_cast<std::uint32_t>(twice.vertices.size());
  twice.add(scaled(ball_mesh(2), 0.5, {}));
  for (auto& t : twice.triangles)
    for (std::uint32_t& corner : t)
      if (corner == first) corner = 0;
  CHECK(is_found(still_nest(twice, small)));
}

TEST_CASE("each frame looks at the poses of its own") {
  Mesh open = scaled(ball_mesh(1), 0.1, {});
  open.triangles.pop_back();
  Nest nest = still_nest(ball_mesh(2), open);
  const World world(nest);
  for (int frame = 0; frame < 4; ++frame) {
    nest.poses[0].data[4] = frame % 2 == 0 ? 1.5f : 0.0f;  // at first beside it, where the bounds of both overlap
    nest.poses[1].data[4] = frame % 2 == 0 ? 0.62f : 0.0f;
    nest.poses[1].data[5] = frame % 2 == 0 ? 0.75f : 0.0f;
    CHECK(world.run().empty() == (frame % 2 == 0));
  }
}

TEST_CASE("many parts that are inside one make one hit of two links") {
  Mesh many;
  for (std::size_t i = 0; i < 300; ++i) {
    const auto at = static_cast<double>(i);
    many.add(scaled(ball_mesh(0), 0.01, 0.4 * Vec3<double>{{std::sin(at), std::cos(1.7 * at), std::sin(2.3 * at)}}));
  }
  const Nest nest = still_nest(ball_mesh(2), many);
  const World world(nest);
  CHECK(world.run().size() == 1);
  CHECK(world.run({}, run_all_pairs).size() == 1);
}

TEST_CASE("convex shapes wholly inside a closed skin are found, and skins wholly inside convex shapes") {
  Random random(414);
  std::size_t inside = 0, outside = 0;
  const std::uint64_t count = rounds(20);
  for (std::uint64_t round = 0; round < count; ++round) {
    const Mesh mesh = lump_mesh(random, 2, {{1, 1, 1}}, {{3, -2, 1}});
    const SkinRig rig = rig_of(mesh, 2, 1, 40);
    const EnginePtr engine = make_engine();
    ArticulationId articulation;
    require(add_articulation(*engine, rig.desc(), &articulation));
    const BatchId batch = add_instances(*engine, articulation, 1);
    const Poses poses = random_skin_poses(random, rig, 1, PoseFormat::kQuaternionTranslation, 0.2, 0.02, 0);
    const std::vector<Triangle<Real>> triangles = placed_triangles(rig, poses, 0);
    Point middle{};
    for (const Triangle<Real>& triangle : triangles)
      middle = middle + (Real{1} / static_cast<Real>(triangles.size())) * triangle.corner[0];
    const Real scale = poses.scales.empty() ? 1 : Real{poses.scales[0]};
    // Small shapes of each kind at places in and about the skin, a triangle, and a large box about all.
    static constexpr ShapeKind kKinds[] = {ShapeKind::kSphere,    ShapeKind::kBox,        ShapeKind::kCapsule,
                                           ShapeKind::kEllipsoid, ShapeKind::kConvexHull, ShapeKind::kCylinder};
    const auto small = static_cast<float>(0.01L * scale);
    const float hull[] = {small, 0, 0, -small, 0, 0, 0, small, 0, 0, 0, small};
    std::vector<ConvexPart> parts(24);
    std::vector<StaticBody> bodies(24);
    std::vector<Point> places;
    for (std::size_t i = 0; i < 24; ++i) {
      const Vec3<double> by = random.uniform(0, 1.5) * static_cast<double>(scale) * random.unit_vector();
      places.push_back(middle + Point{{by[0], by[1], by[2]}});
      for (std::size_t c = 0; c < 3; ++c) {
        bodies[i].origin[c] = static_cast<double>(places[i][c]);
        places[i][c] = bodies[i].origin[c];
        parts[i].size[c] = small;
        bodies[i].box.half[c] = 4 * small;
      }
      parts[i].kind = kKinds[i % 6];
      if (parts[i].kind == ShapeKind::kConvexHull) parts[i].vertices = {hull, 12};
      bodies[i].parts = {&parts[i], 1};
    }
    ConvexPart around;
    around.kind = ShapeKind::kBox;
    for (std::size_t c = 0; c < 3; ++c) around.size[c] = static_cast<float>(10 * scale);
    StaticBody large;
    for (std::size_t c = 0; c < 3; ++c) {
      large.origin[c] = static_cast<double>(middle[c]);
      large.box.half[c] = around.size[c];
    }
    large.parts = {&around, 1};
    bodies.push_back(large);
    std::vector<float> vertices;
    for (const double side : {-1.0, 1.0, 0.0})
      for (std::size_t c = 0; c < 3; ++c)
        vertices.push_back(static_cast<float>(middle[c] + Real{c == (side == 0 ? 1 : 0) ? (side == 0 ? 1 : side) : 0} *
                                                              0.01L * scale));
    const std::uint32_t corners[] = {0, 1, 2};
    StaticDesc level;
    level.bodies = bodies;
    level.vertices = vertices;
    level.triangles = corners;
    BatchId fixed;
    std::uint32_t bad = 0;
    REQUIRE(add_static_batch(*engine, level, &fixed, &bad) == Status::kOk);
    BatchInput inputs[2] = {poses.input(batch), {}};
    inputs[1].batch = fixed;
    const PairRule rule = {batch, fixed, Pairing::kBetween};
    std::vector<Hit> hits(4096), touch(4096);
    for (const bool containment : {true, false}) {
      std::vector<Hit>& out = containment ? hits : touch;
      FrameJob job;
      job.policies.exact = Exact::kSurface;
      job.containment = containment;
      job.inputs = inputs;
      job.rules = {&rule, 1};
      job.hits = out;
      REQUIRE(run_frame(*engine, job) == Status::kOk);
      out.resize(job.hit_count);
    }
    const std::set<Pair> found = pairs_of(hits), touching = pairs_of(touch);
    CHECK(touching.count({0, 24}) == 1);  // a solid holds what is in it without any search
    const bool holds_triangle = std::round(winding_of(triangles, middle)) != 0;
    if (touching.count({0, 25}) == 0) CHECK((found.count({0, 25}) == 1) == holds_triangle);
    for (std::uint32_t i = 0; i < 24; ++i) {
      CAPTURE(i);
      if (touching.count({0, i})) {
        CHECK(found.count({0, i}) == 1);
        continue;
      }
      const bool is_inside = std::round(winding_of(triangles, places[i])) != 0;
      CHECK((found.count({0, i}) == 1) == is_inside);
      ++(is_inside ? inside : outside);
    }
  }
  CHECK(inside >= least_count(60, 20));
  CHECK(outside >= least_count(60, 20));
}

TEST_CASE("an added pair names the leaf inside and the one that a ray leaves by, and none where links touch already") {
  Random random(415);
  // A long skin of four links, and a ball in its last quarter.
  const Mesh outer = lump_mesh(random, 3, {{4, 1, 1}}, {{4, 0, 0}});
  Nest nest;
  nest.rigs[0] = rig_of(outer, 4, 2, 50);
  nest.rigs[1] = still_rig(scaled(ball_mesh(1), 0.1, {}));
  for (std::size_t k = 0; k < 2; ++k) {
    Poses& poses = nest.poses[k];
    poses.instance_count = 1;
    poses.link_count = nest.rigs[k].link_count();
    for (std::uint32_t link = 0; link < poses.link_count; ++link)
      poses.data.insert(poses.data.end(), {0, 0, 0, 1, k == 0 ? 2.0f * static_cast<float>(link) : 0.0f, 0, 0});
  }
  nest.poses[1].origins = {6.6, 0, 0};
  const std::vector<Hit> hits = World(nest).run();
  REQUIRE(hits.size() == 1);
  CHECK(hits[0].link_b == 0);
  CHECK(hits[0].link_a >= 2);
  CHECK(nest.rigs[0].leaves[hits[0].leaf_a].link == hits[0].link_a);
  // Where the ball touches the skin, only the links whose triangles touch are hits.
  FrameJob without;
  without.containment = false;
  for (const bool has_two_parts : {false, true}) {
    Mesh parts = outer;
    if (has_two_parts) parts.add(scaled(ball_mesh(1), 0.2, {{0, 3, 0}}));  // on the first link alone
    nest.rigs[0] = rig_of(parts, 4, 2, 50);
    const World world(nest);
    std::size_t touching = 0;
    FrameStats with_search, without_search;
    for (double along = 1; along < 7; along += 0.1)
      for (double height = 0; height < 1.2; height += 0.1) {
        nest.poses[1].origins = {along, 0, height};
        const std::vector<Hit> both = world.run({}, run_frame, &with_search),
                               alone = world.run(without, run_frame, &without_search);
        if (alone.empty()) continue;
        ++touching;
        CHECK(links_of(both) == links_of(alone));
        // No ray is cast where a link of each touches all there is of the other.
        if (!has_two_parts) CHECK(with_search.leaves_skinned == without_search.leaves_skinned);
      }
    CHECK(touching >= 50);
  }
}

}  // namespace cab::tests
