// Frames with the exact kernels: bodies of random shapes against the judge of convex shapes, and what must not change
// an answer.
#include "engine/frame/all_pairs.h"
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/convex_pairs.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <list>

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::rounds;

constexpr Policies kConvex = {Refit::kCab, Strategy::kBrute, Exact::kConvex};

// The parts of rigs, and the vertices of their hulls, which outlive the rigs.
struct Parts {
  std::list<std::vector<float>> vertices;
  std::list<std::vector<ConvexPart>> lists;
};

ConvexPart random_part(Random& random, ShapeKind kind, Parts& parts) {
  ConvexPart part;
  part.kind = kind;
  for (float& size : part.size) size = static_cast<float>(random.uniform(0.05, 0.3));
  for (float& at : part.position) at = static_cast<float>(random.uniform(-0.3, 0.3));
  double q[4];
  random_turn(random, q);
  for (std::size_t c = 0; c < 4; ++c) part.rotation[c] = static_cast<float>(q[c]);
  if (kind != ShapeKind::kConvexHull) return part;
  std::vector<float> vertices;
  for (std::uint32_t v = 0; v < 6 + random.index(20); ++v) {
    const Vec3<double> at = random.unit_vector();
    for (std::size_t c = 0; c < 3; ++c)
      vertices.push_back(static_cast<float>(at[c] * static_cast<double>(part.size[c])));
  }
  parts.vertices.push_back(std::move(vertices));
  part.vertices = {parts.vertices.back().data(), parts.vertices.back().size()};
  return part;
}

// A link with one leaf of the given parts, in a box that holds them all.
Rig body(Span<const ConvexPart> of) {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, of}};
  return rig;
}

// Two bodies of `count` parts each, of the given kinds in turn, `instances` times.
World bodies(Random& random, const std::vector<ShapeKind>& kinds, std::size_t count, std::uint32_t instances,
             Parts& parts) {
  World world;
  for (std::size_t member = 0; member < 2; ++member) {
    std::vector<ConvexPart> list;
    for (std::size_t p = 0; p < count; ++p)
      list.push_back(random_part(random, kinds[(p + member) % kinds.size()], parts));
    parts.lists.push_back(std::move(list));
    const Rig rig = body({parts.lists.back().data(), count});
    world.members.push_back(
        {rig, random_poses(random, rig, instances, PoseFormat::kQuaternionTranslation, {0.5, false, false, {}})});
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  return world;
}

double origin(const Member& member, std::size_t instance, std::size_t c) {
  return member.poses.origins.empty() ? 0 : member.poses.origins[3 * instance + c];
}

// The gap of two instances by the judge: the least over all pairs of parts. Above 0 it is a lower bound, else an upper.
Real gap_of(const World& world, std::uint32_t instance_a, std::uint32_t instance_b) {
  Real least = 1e30L;
  const Member &a = world.members[0], &b = world.members[1];
  for (const ConvexPart& part_a : a.rig.leaves[0].parts)
    for (const ConvexPart& part_b : b.rig.leaves[0].parts) {
      ConvexCase one = {};
      one.a.part = part_a;
      one.b.part = part_b;
      one.a.vertices.assign(part_a.vertices.begin(), part_a.vertices.end());
      one.b.vertices.assign(part_b.vertices.begin(), part_b.vertices.end());
      std::copy_n(a.poses.pose(instance_a, 0), 7, one.a.pose);
      std::copy_n(b.poses.pose(instance_b, 0), 7, one.b.pose);
      for (std::size_t c = 0; c < 3; ++c) one.shift[c] = origin(b, instance_b, c) - origin(a, instance_a, c);
      bind_vertices(one);
      if (part_a.kind == ShapeKind::kHalfSpace && part_b.kind == ShapeKind::kHalfSpace) return -1e30L;
      const Verdict verdict = judge_case(one, Effort::kMeasure).verdict;
      least = std::min(least, verdict.gap_at_least > 0 ? verdict.gap_at_least : verdict.gap_at_most);
    }
  return least;
}

bool has_hit(const std::vector<Hit>& hits, std::uint32_t instance_a, std::uint32_t instance_b) {
  return std::any_of(hits.begin(), hits.end(),
                     [&](const Hit& hit) { return hit.instance_a == instance_a && hit.instance_b == instance_b; });
}

// Whether every two instances are reported that are no farther apart than the margin, and no others, but for pairs
// within a millionth of it. Bodies without end may all touch.
void check_by_judge(const World& world, const std::vector<Hit>& hits, bool has_end = true) {
  constexpr Real kNear = 1e-6L;
  std::size_t yes = 0, no = 0;
  for (std::uint32_t i = 0; i < world.members[0].poses.instance_count; ++i)
    for (std::uint32_t j = 0; j < world.members[1].poses.instance_count; ++j) {
      const Real beyond = gap_of(world, i, j) - static_cast<Real>(world.margin);
      if (std::fabs(beyond) < kNear) continue;
      CHECK(has_hit(hits, i, j) == (beyond < 0));
      ++(beyond < 0 ? yes : no);
    }
  CHECK(yes > 0);
  CHECK((no > 0 || !has_end));
}

}  // namespace

TEST_CASE("leaves of many parts touch where any two parts do") {
  for (std::uint64_t seed = 1; seed <= rounds(4); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Parts parts;
    for (const std::size_t count : {1u, 2u, 5u, 7u}) {
      CAPTURE(count);
      // With seven parts, one is a half space.
      const World world = bodies(random, {std::begin(kCaseKinds), std::end(kCaseKinds)}, count, 7, parts);
      const Outcome outcome = run_world(world, kConvex);
      check_by_judge(world, outcome.hits, count < 7);
      CHECK(outcome.stats.exact_tests == outcome.stats.leaf_pairs);
      CHECK(outcome.stats.false_positives == outcome.stats.exact_tests - outcome.hits.size());
    }
  }
}

TEST_CASE("bodies far smaller than any unit touch where they touch at a size of about 1") {
  for (std::uint64_t seed = 1; seed <= rounds(4); ++seed)
    for (const ShapeKind kind : {ShapeKind::kBox, ShapeKind::kSphere, ShapeKind::kConvexHull, ShapeKind::kCapsule}) {
      CAPTURE(seed);
      CAPTURE(static_cast<int>(kind));
      Random random(seed);
      Parts parts;
      World world = bodies(random, {kind}, 2, 7, parts);
      REQUIRE(world.members[0].poses.origins.empty());
      const Outcome expected = run_world(world, kConvex);
      constexpr float kTiny = 0x1p-120f;
      for (Member& member : world.members) {
        parts.lists.emplace_back(member.rig.leaves[0].parts.begin(), member.rig.leaves[0].parts.end());
        for (ConvexPart& part : parts.lists.back()) {
          for (float& size : part.size) size *= kTiny;
          for (float& at : part.position) at *= kTiny;
          std::vector<float> vertices(part.vertices.begin(), part.vertices.end());
          for (float& at : vertices) at *= kTiny;
          parts.vertices.push_back(std::move(vertices));
          part.vertices = {parts.vertices.back().data(), parts.vertices.back().size()};
        }
        member.rig.leaves[0].parts = {parts.lists.back().data(), parts.lists.back().size()};
        for (float& half : member.rig.leaves[0].box.half) half *= kTiny;
        for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
          for (int c = 4; c < 7; ++c) member.poses.pose(i, 0)[c] *= kTiny;
      }
      CHECK(same_hits(run_world(world, kConvex).hits, expected.hits));
      CHECK(expected.hits.size() > 0);
      CHECK(expected.hits.size() < 49);
    }
}

TEST_CASE("with a margin exact kernels report every pair within it, for every pair of kinds") {
  std::uint64_t seed = 100;
  for (const ShapeKind kind_a : kCaseKinds)
    for (const ShapeKind kind_b : kCaseKinds) {
      CAPTURE(static_cast<int>(kind_a));
      CAPTURE(static_cast<int>(kind_b));
      Random random(++seed);
      Parts parts;
      World world = bodies(random, {kind_a, kind_b}, 1, 12, parts);
      world.margin = 0.1f;
      check_by_judge(world, run_world(world, kConvex).hits,
                     kind_a != ShapeKind::kHalfSpace || kind_b != ShapeKind::kHalfSpace);
    }
}

namespace {

// A shape of every kind but half spaces, and a flat hull. Each has the extent 1 on both sides along x.
std::vector<ConvexPart> unit_shapes() {
  static constexpr float kOctahedron[] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
  std::vector<ConvexPart> out;
  for (const ShapeKind kind : kCaseKinds) {
    if (kind == ShapeKind::kHalfSpace) continue;
    ConvexPart part;
    part.kind = kind;
    std::fill_n(part.size, 3, 1.0f);
    if (kind == ShapeKind::kConvexHull) part.vertices = {kOctahedron, 18};
    out.push_back(part);
  }
  out.push_back(out[3]);
  out.back().vertices = {kOctahedron, 9};
  return out;
}

}  // namespace

TEST_CASE("leaves that touch in one point are reported, by every kind") {
  // Each has the extent 1 along x on both sides, so two of them whose centres are 2 apart touch in a point or a face.
  const std::vector<ConvexPart> shapes = unit_shapes();
  for (const ConvexPart& a : shapes)
    for (const ConvexPart& b : shapes)
      for (const float unit : {1.0f, 0x1p-40f, 0x1p30f})
        for (const bool is_beyond : {false, true}) {
          CAPTURE(static_cast<int>(a.kind));
          CAPTURE(static_cast<int>(b.kind));
          CAPTURE(unit);
          CAPTURE(is_beyond);
          World world;
          std::array<std::vector<float>, 2> vertices;
          std::array<ConvexPart, 2> parts = {a, b};
          for (std::size_t m = 0; m < 2; ++m) {
            for (float& size : parts[m].size) size *= unit;
            for (const float v : parts[m].vertices) vertices[m].push_back(v * unit);
            parts[m].vertices = vertices[m];
            Rig rig = body({&parts[m], 1});
            for (float& half : rig.leaves[0].box.half) half = 4 * unit;
            Poses poses;
            poses.link_count = poses.instance_count = 1;
            const float at = is_beyond ? 2 * (1 + 0x1p-20f) : 2;
            poses.data = {0, 0, 0, 1, m == 0 ? 0 : at * unit, 0, 0};
            world.members.push_back({rig, poses});
          }
          world.rules = {{{1}, {2}, Pairing::kBetween}};
          CHECK(run_world(world, kConvex).hits.size() == (is_beyond ? 0 : 1));
        }
}

TEST_CASE("a box and a cylinder that meet in a corner by a hundred-millionth of their size touch") {
  // Found by cab verify: GJK's direction ended so short that the support of the cylinder along it was wrong.
  const struct {
    float box[3], box_at[3], cylinder[2], cylinder_at[3], rotation[4], turn[2][4], at[2][3];
    double shift[3];
  } cases[] = {
      {{0.15506934f, 0.15953305f, 0.20630172f},
       {0.047276482f, -0.01374049f, 0.05936117f},
       {0.07777778f, 0.28517038f},
       {-0.027507016f, 0.0058835796f, -0.03620842f},
       {0, 0, 0, 1},
       {{4.8108237e-09f, -1.4341963e-09f, 1.9994545e-08f, 1}, {-6.4854913e-09f, 7.979668e-09f, 2.4272895e-09f, 1}},
       {{-0.08979054f, -0.20344394f, 0.09772963f}, {-0.14569165f, 0.01424282f, 0.68477136f}},
       {7.775061960604195e-09, -2.6767370850181696e-09, -4.2217527000329436e-08}},
      {{0.17469566f, 0.17171417f, 0.13371946f},
       {0.038632795f, -0.03818041f, -0.048954774f},
       {0.17469566f, 0.17171417f},
       {0.018711109f, -0.043264203f, -0.032035824f},
       {0.47533542f, -0.39804363f, -0.7538766f, -0.21745709f},
       {{-0.6844639f, -0.24960762f, -0.31374612f, 0.6089077f}, {-0.6844639f, -0.24960762f, -0.31374612f, 0.6089077f}},
       {{-0.23320997f, 0.093384854f, -0.14347698f}, {-0.5312237f, -0.22160819f, 0.06325072f}},
       {4.343828085916863e-08, 1.1711870461717975e-08, 3.7031161821590285e-09}}};
  for (const auto& one : cases) {
    ConvexPart parts[2];
    parts[0].kind = ShapeKind::kBox;
    std::copy_n(one.box, 3, parts[0].size);
    std::copy_n(one.box_at, 3, parts[0].position);
    parts[1].kind = ShapeKind::kCylinder;
    std::copy_n(one.cylinder, 2, parts[1].size);
    std::copy_n(one.cylinder_at, 3, parts[1].position);
    World world;
    for (int m = 0; m < 2; ++m) {
      std::copy_n(one.rotation, 4, parts[m].rotation);
      Member member;
      member.rig = body({&parts[m], 1});
      member.poses.link_count = member.poses.instance_count = 1;
      member.poses.data.assign(one.turn[m], one.turn[m] + 4);
      member.poses.data.insert(member.poses.data.end(), one.at[m], one.at[m] + 3);
      if (m == 1) member.poses.origins.assign(one.shift, one.shift + 3);
      world.members.push_back(member);
    }
    world.rules = {{{1}, {2}, Pairing::kBetween}};
    for (const Isa isa : available_isas()) CHECK(run_world(world, kConvex, {isa}).hits.size() == 1);
  }
}

TEST_CASE("needles that part by a few millionths of a millionth of their size are apart") {
  // Found by cab verify. The plane that parts the first two was made from a point that rounding had moved next to the
  // origin. For the second two GJK goes in circles.
  const struct {
    float cylinder[2], cylinder_at[3], cylinder_turn[4], box[3], box_at[3], box_turn[4];
    std::vector<float> pose[2];
    std::vector<double> shift;
    Real size;  // of both, with the distances of their links and shapes from their origins
  } cases[] = {{{0.0003328304f, 0.0011187089f},
                {-0.055021558f, -0.054245263f, -0.010690664f},
                {0.16760945f, 0.681701f, 0.11267388f, 0.7032037f},
                {1.4809393e-05f, 3.260492e-06f, 0.26652226f},
                {-0.041469958f, -0.056077916f, 0.05470544f},
                {0.43538946f, 0.8213352f, 0.16381548f, 0.33016512f},
                {{-0.42636168f, 0.43694288f, -0.082196645f, 0.7877438f, 0.20597573f, -0.07790722f, 0.14401731f},
                 {-0.82586f, -0.55338f, -0.015877284f, -0.10711527f, 0.25735548f, 0.048485976f, 0.3726343f}},
                {-4.4269831497194875e-09, 2.2152789270575492e-09, -7.846692474109459e-09},
                1.79L},
               {{1.3811742e-05f, 2.9676314e-06f},
                {-0.019332768f, 0.024339303f, 0.050507993f},
                {-0.47204763f, 0.013853391f, -0.20654741f, -0.85692316f},
                {0.0003179489f, 0.00023783911f, 0.10645959f},
                {-0.0129463235f, 0.009458487f, 0.00068518816f},
                {0.3531945f, -0.7237747f, 0.5338669f, -0.2576625f},
                {{-0.29476786f, -0.10355731f, -0.2052172f, -0.9275094f, 0.1398632f, 0.18241966f, -0.011940809f},
                 {-0.16807593f, 0.34346858f, 0.9127527f, 0.14374392f, 0.08114857f, 0.21092401f, -0.057900988f}},
                {3.6373431354955145e-09, 1.2148277614225898e-08, 4.7064956788694695e-09},
                1.01L}};
  for (const auto& one : cases) {
    ConvexPart parts[2];
    parts[0].kind = ShapeKind::kCylinder;
    std::copy_n(one.cylinder, 2, parts[0].size);
    std::copy_n(one.cylinder_at, 3, parts[0].position);
    std::copy_n(one.cylinder_turn, 4, parts[0].rotation);
    parts[1].kind = ShapeKind::kBox;
    std::copy_n(one.box, 3, parts[1].size);
    std::copy_n(one.box_at, 3, parts[1].position);
    std::copy_n(one.box_turn, 4, parts[1].rotation);
    World world;
    for (std::size_t m = 0; m < 2; ++m) {
      Member member;
      member.rig = body({&parts[m], 1});
      member.poses.link_count = member.poses.instance_count = 1;
      member.poses.data = one.pose[m];
      if (m == 1) member.poses.origins = one.shift;
      world.members.push_back(member);
    }
    world.rules = {{{1}, {2}, Pairing::kBetween}};
    CHECK(gap_of(world, 0, 0) > 0x1p-40L * one.size);
    for (const Isa isa : available_isas()) CHECK(run_world(world, kConvex, {isa}).hits.empty());
  }
}

TEST_CASE("a half space is touched from its plane on down, by every kind, as far as its leaf's box says") {
  // Extents along -z: a capsule's is the sum of its sizes, a flat hull's is 0.
  constexpr float kLowest[] = {1, 1, 2, 1, 1, 1, 0};
  const std::vector<ConvexPart> shapes = unit_shapes();
  REQUIRE(shapes.size() == std::size(kLowest));
  for (std::size_t s = 0; s < shapes.size(); ++s)
    for (const float unit : {1.0f, 0x1p-40f, 0x1p30f})
      for (const bool floor_first : {false, true})
        for (const float above : {-9.0f, -2.0f, -0x1p-19f, 0.0f, 0x1p-19f, 1.0f}) {
          CAPTURE(s);
          CAPTURE(unit);
          CAPTURE(floor_first);
          CAPTURE(above);
          ConvexPart floor, other = shapes[s];
          floor.kind = ShapeKind::kHalfSpace;
          floor.position[2] = 0.5f * unit;
          for (float& size : other.size) size *= unit;
          std::vector<float> vertices;
          for (const float v : other.vertices) vertices.push_back(v * unit);
          other.vertices = vertices;
          World world;
          for (const bool is_floor : {floor_first, !floor_first}) {
            Rig rig = body({is_floor ? &floor : &other, 1});
            Box& box = rig.leaves[0].box;
            for (float& half : box.half) half = (is_floor ? 100 : 2) * unit;
            box.half[2] = 2 * unit;
            Poses poses;
            poses.link_count = poses.instance_count = 1;
            poses.data = {0, 0, 0, 1, 7 * unit, -30 * unit, (is_floor ? 0 : 0.5f + kLowest[s] + above) * unit};
            world.members.push_back({rig, poses});
          }
          world.rules = {{{1}, {2}, Pairing::kBetween}};
          const bool touches = above <= 0 && above > -8;
          CHECK(run_world(world, kConvex).hits.size() == (touches ? 1 : 0));
          CHECK(run_world(world, {Refit::kAabbVertices, Strategy::kBrute, Exact::kConvex}).hits.size() ==
                (touches ? 1 : 0));
          CHECK(run_on(*make_engine_for(world), world, kConvex, run_all_pairs).hits.size() == (above <= 0));
        }
}

TEST_CASE("characters whose poses are stored in different ways share no block") {
  std::size_t hits_found = 0;
  // Quarter turns, whose quaternions and matrices say the same; the first member turns by orientations instead.
  for (std::uint64_t seed = 1; seed <= rounds(8); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Parts parts;
    std::vector<Hit> expected;
    const World world = bodies(random, {ShapeKind::kEllipsoid, ShapeKind::kBox}, 2, 9, parts);
    std::vector<unsigned> turns;
    for (int i = 0; i < 18; ++i) turns.push_back(random.index(4));
    for (const PoseFormat format_a : {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows})
      for (const PoseFormat format_b :
           {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns})
        for (const bool by_orientation : {false, true}) {
          World stored;
          stored.rules = {{{1}, {2}, Pairing::kBetween}, {{1}, {1}, Pairing::kBetween}, {{2}, {2}, Pairing::kBetween}};
          for (std::size_t m = 0; m < 2; ++m) {
            const Poses& from = world.members[m].poses;
            Poses poses;
            poses.format = m == 0 ? format_a : format_b;
            poses.link_count = 1;
            poses.instance_count = from.instance_count;
            poses.data.resize(poses.floats_per_pose() * from.instance_count);
            for (std::uint32_t i = 0; i < from.instance_count; ++i) {
              static constexpr double kTurns[4][4] = {{0, 0, 0, 1}, {0, 0, 1, 1}, {0, 0, 1, 0}, {0, 0, -1, 1}};
              double q[4], none[4] = {0, 0, 0, 1};
              std::copy_n(kTurns[turns[9 * m + i]], 4, q);
              const float* const f = from.pose(i, 0);
              const Vec3<double> at = {
                  {static_cast<double>(f[4]), static_cast<double>(f[5]), static_cast<double>(f[6])}};
              const bool orients = by_orientation && m == 0;
              poses.origins.insert(poses.origins.end(), {at[0], at[1], at[2]});
              write_pose(poses.format, orients ? none : q, {}, poses.pose(i, 0));
              if (orients)
                for (const double v : q) poses.orientations.push_back(static_cast<float>(v));
            }
            stored.members.push_back({world.members[m].rig, poses});
          }
          const std::vector<Hit> hits = run_world(stored, kConvex).hits;
          if (expected.empty()) expected = hits;
          CHECK(same_hits(hits, expected));
        }
    hits_found += expected.size();
  }
  CHECK(hits_found > 20 * rounds(8));
}

TEST_CASE("exact kernels report the same on every instruction set, thread and strategy, and in every unit") {
  for (std::uint64_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Parts parts;
    std::vector<ShapeKind> kinds = {std::begin(kCaseKinds), std::end(kCaseKinds)};
    std::rotate(kinds.begin(), kinds.begin() + seed % 2 * 3, kinds.end());
    const World world = bodies(random, kinds, 3, 40, parts);
    const std::vector<Hit> expected = run_world(world, kConvex).hits;
    CHECK(expected.size() > 100);
    CHECK(expected.size() < 1600);
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 2u})
        for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kLinks}) {
          EngineDesc desc;
          desc.isa = isa;
          desc.thread_count = threads;
          const EnginePtr engine = make_engine_for(world, desc);
          CHECK(same_hits(run_on(*engine, world, {Refit::kCab, strategy, Exact::kConvex}).hits, expected));
          CHECK(same_hits(run_on(*engine, world, kConvex, run_all_pairs).hits, expected));
        }
    for (const int exponent : {-38, 38}) {
      CAPTURE(exponent);
      const auto scaled = [exponent](float v) { return std::ldexp(v, exponent); };
      World other = world;
      Parts copies;
      for (Member& member : other.members) {
        for (std::size_t i = 0; i < member.poses.data.size(); ++i)
          if (i % 7 >= 4) member.poses.data[i] = scaled(member.poses.data[i]);
        Leaf& leaf = member.rig.leaves[0];
        for (float& half : leaf.box.half) half = scaled(half);
        std::vector<ConvexPart> list(leaf.parts.begin(), leaf.parts.end());
        for (ConvexPart& part : list) {
          for (std::size_t c = 0; c < 3; ++c) {
            part.size[c] = scaled(part.size[c]);
            part.position[c] = scaled(part.position[c]);
          }
          std::vector<float> vertices;
          for (const float v : part.vertices) vertices.push_back(scaled(v));
          copies.vertices.push_back(std::move(vertices));
          part.vertices = {copies.vertices.back().data(), copies.vertices.back().size()};
        }
        copies.lists.push_back(std::move(list));
        leaf.parts = {copies.lists.back().data(), copies.lists.back().size()};
      }
      CHECK(same_hits(run_world(other, kConvex).hits, expected));
    }
  }
}
