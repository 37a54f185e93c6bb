// Robots with leaves of triangles: CollisionChecker and AttachedObject beside brute force in double.
#include <cab/attached_object.h>
#include <cab/collision_checker.h>

#include "perf/harness/random_joints.h"
#include "perf/harness/random_rig.h"
#include "perf/judge/oracle/touching_triangles.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::int32_t kOneLink[] = {-1};

// A robot each of whose leaves is some triangles in the box that the leaf had.
struct TriangleRobot {
  JointedRig rig;
  std::vector<std::vector<std::uint32_t>> corners;  // by leaf
  std::vector<float> vertices, weights, inverse_bind;
  std::vector<std::uint32_t> links;

  TriangleRobot(Random& random, unsigned most_links, bool has_binds)
      : rig(random_jointed_rig(random, most_links, 2, 0.2)) {
    for (unsigned l = 0; has_binds && l < rig.rig.link_count(); ++l) {
      double axis[3][3];
      random.rotation(axis);
      const double scale = random.uniform(0.5, 2);
      for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t c = 0; c < 3; ++c)
          inverse_bind.push_back(static_cast<float>(k < 3 ? scale * axis[k][c] : random.uniform(-0.3, 0.3)));
        inverse_bind.push_back(k == 3 ? 1.0f : 0.0f);
      }
    }
    for (Leaf& leaf : rig.rig.leaves) {
      std::vector<std::uint32_t>& own = corners.emplace_back();
      const unsigned count = 1 + random.index(60);
      for (unsigned v = 0; v < 3 * count; ++v) {
        own.push_back(static_cast<std::uint32_t>(links.size()));
        links.push_back(leaf.link);
        weights.push_back(1);
        const bool is_new_triangle = v % 3 == 0;
        float at[3];
        std::copy_n(leaf.box.center, 3, at);
        for (std::size_t k = 0; k < 3; ++k) {
          const auto along = static_cast<float>(random.uniform(-1, 1));
          for (std::size_t c = 0; c < 3; ++c) at[c] += along * leaf.box.half[k] * leaf.box.axis[k][c];
        }
        // Triangles of a mesh are short beside its body.
        for (std::size_t c = 0; c < 3; ++c) {
          const float first = is_new_triangle ? at[c] : vertices[vertices.size() - 3 * (v % 3)];
          vertices.push_back(first + (at[c] - first) * 0.7f);
        }
      }
      leaf.box = {};
    }
    for (std::size_t n = 0; n < corners.size(); ++n) rig.rig.leaves[n].triangles = corners[n];
  }

  ArticulationDesc desc() const {
    ArticulationDesc out = rig.rig.desc();
    out.skin = {vertices, 1, links, weights, inverse_bind};
    return out;
  }

  // The corners of a leaf's triangles at the pose of its link.
  std::vector<Vec3<double>> places(std::size_t leaf, const float* pose) const {
    const double q[4] = {pose[0], pose[1], pose[2], pose[3]};
    double turn[3][3];
    quaternion_matrix(q, turn);
    std::vector<Vec3<double>> out;
    for (const std::uint32_t corner : corners[leaf]) {
      const float* const v = vertices.data() + 3 * std::size_t{corner};
      Vec3<double> at = {{v[0], v[1], v[2]}};
      if (!inverse_bind.empty()) {
        const float* const m = inverse_bind.data() + 16 * std::size_t{rig.rig.leaves[leaf].link};
        for (std::size_t c = 0; c < 3; ++c)
          at[c] = double{m[c]} * double{v[0]} + double{m[4 + c]} * double{v[1]} + double{m[8 + c]} * double{v[2]} +
                  double{m[12 + c]};
      }
      out.push_back({{pose[4], pose[5], pose[6]}});
      for (std::size_t k = 0; k < 3; ++k) out.back() = out.back() + at[k] * to_vec3(turn[k]);
    }
    return out;
  }

  TriangleSet placed(std::size_t leaf, const float* pose) const {
    const std::vector<Vec3<double>> at = places(leaf, pose);
    std::vector<Triangle<double>> out(at.size() / 3);
    for (std::size_t i = 0; i < at.size(); ++i) out[i / 3].corner[i % 3] = at[i];
    return TriangleSet(std::move(out));
  }

  bool ignores(std::uint32_t link_a, std::uint32_t link_b) const {
    return std::any_of(rig.rig.ignored.begin(), rig.rig.ignored.end(), [&](const LinkPair& pair) {
      return (pair.a == link_a && pair.b == link_b) || (pair.a == link_b && pair.b == link_a);
    });
  }

  std::vector<float> poses(const std::vector<double>& states) const {
    std::vector<float> out(7 * rig.rig.link_count() * (states.size() / rig.body.variable_count));
    REQUIRE(compute_link_poses(rig.body.desc(), states, Isa::kScalar, out) == Status::kOk);
    return out;
  }
};

std::vector<double> random_states(Random& random, const JointedBody& body, std::size_t count) {
  std::vector<double> states(count * body.variable_count);
  for (double& x : states) x = random.uniform(-3, 3);
  return states;
}

// State, whether the second link is of what stands around, and links.
using Row = std::array<std::uint32_t, 4>;
using Rows = std::set<Row>;

// A cube about the origin of a link: its faces, and its inside.
struct Cube {
  float half;
  Leaf leaf;

  explicit Cube(float half_edge) : half(half_edge) {
    leaf.box = axis_aligned_box({0, 0, 0}, {half_edge, half_edge, half_edge});
  }
  ArticulationDesc desc() const { return {kOneLink, {}, {&leaf, 1}, {}}; }

  TriangleSet faces(const float* at) const {
    std::vector<Triangle<double>> out;
    const auto corner = [&](std::size_t axis, double side, double u, double v) {
      Vec3<double> p;
      p[axis] = side;
      p[(axis + 1) % 3] = u;
      p[(axis + 2) % 3] = v;
      const double h = double{half};
      return Vec3<double>{{at[4] + h * p[0], at[5] + h * p[1], at[6] + h * p[2]}};
    };
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0}) {
        out.push_back({{corner(axis, side, -1, -1), corner(axis, side, 1, -1), corner(axis, side, 1, 1)}});
        out.push_back({{corner(axis, side, -1, -1), corner(axis, side, 1, 1), corner(axis, side, -1, 1)}});
      }
    return TriangleSet(std::move(out));
  }
};

bool is_in_cube(const std::vector<Vec3<double>>& places, const Cube& cube, const float* at) {
  return std::any_of(places.begin(), places.end(), [&](const Vec3<double>& p) {
    return norm_max(p - Vec3<double>{{at[4], at[5], at[6]}}) <= double{cube.half};
  });
}

Rows rows_of(CollisionChecker& checker, const std::vector<double>& states, std::uint32_t count) {
  REQUIRE(checker.find_hits(states, count) == Status::kOk);
  Rows rows;
  for (const Hit& hit : checker.world().hits())
    rows.insert({hit.instance_a, checker.fixed_of(hit) < 0 ? 0u : 1u, hit.link_a, hit.link_b});
  return rows;
}

}  // namespace

TEST_CASE("links of a robot touch where triangles of them do, each other, a surface and a solid that stand around") {
  std::size_t touching = 0, apart = 0, around = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const TriangleRobot robot(random, 7, random.chance(0.5));
    const bool is_solid = random.chance(0.5);
    const TriangleRobot other(random, 1, false);
    const Cube cube(0.3f);
    const std::vector<float> at = {0, 0, 0, 1, 0.5f, -0.4f, 0.3f};
    const std::uint32_t count = 1 + random.index(60), links = robot.rig.rig.link_count();
    const std::vector<double> states = random_states(random, robot.rig.body, count);
    const std::vector<float> poses = robot.poses(states);

    CollisionChecker checker;
    REQUIRE(checker.set_robot(robot.desc(), robot.rig.body.desc()) == Status::kOk);
    CHECK(checker.world().job().policies.exact == Exact::kSurface);
    REQUIRE(checker.add_fixed(is_solid ? cube.desc() : other.desc(), at) == Status::kOk);
    Rows expected;
    for (std::uint32_t s = 0; s < count; ++s) {
      std::vector<TriangleSet> sets;
      for (std::size_t n = 0; n < robot.corners.size(); ++n)
        sets.push_back(robot.placed(n, &poses[7 * (s * links + robot.rig.rig.leaves[n].link)]));
      for (std::size_t a = 0; a < sets.size(); ++a) {
        const std::uint32_t link_a = robot.rig.rig.leaves[a].link;
        for (std::size_t b = 0; b < a; ++b) {
          const std::uint32_t link_b = robot.rig.rig.leaves[b].link;
          if (link_a == link_b || robot.ignores(link_a, link_b)) continue;
          const bool touch = any_touch(sets[a], sets[b]);
          if (touch) expected.insert({s, 0, std::min(link_a, link_b), std::max(link_a, link_b)});
          ++(touch ? touching : apart);
        }
        const bool touch = is_solid ? any_touch(sets[a], cube.faces(at.data())) ||
                                          is_in_cube(robot.places(a, &poses[7 * (s * links + link_a)]), cube, at.data())
                                    : any_touch(sets[a], other.placed(0, at.data())) ||
                                          (other.corners.size() > 1 && any_touch(sets[a], other.placed(1, at.data())));
        if (touch) expected.insert({s, 1, link_a, 0});
        around += touch;
      }
    }
    CHECK(rows_of(checker, states, count) == expected);
    std::vector<StateAnswer> answers(count);
    REQUIRE(checker.check(states, answers) == Status::kOk);
    for (std::uint32_t s = 0; s < count; ++s)
      CHECK((answers[s] == StateAnswer::kColliding) ==
            std::any_of(expected.begin(), expected.end(), [&](const Row& row) { return row[0] == s; }));
  }
  CHECK(touching >= least_count(150, 40));
  CHECK(apart >= least_count(1000, 40));
  CHECK(around >= least_count(50, 40));
}

TEST_CASE("a motion of triangles that is called free has no state that collides, also beside points") {
  std::size_t free = 0, colliding = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const TriangleRobot robot(random, 5, random.chance(0.5));
    const std::uint32_t variables = robot.rig.body.variable_count;
    CollisionChecker checker;
    REQUIRE(checker.set_robot(robot.desc(), robot.rig.body.desc()) == Status::kOk);
    if (random.chance(0.5)) {
      std::vector<float> points;
      for (int i = 0; i < 30; ++i) points.push_back(static_cast<float>(random.uniform(-2, 2)));
      REQUIRE(checker.add_points(points, 0.05f) == Status::kOk);
    }
    constexpr std::size_t kMotions = 40, kMoments = 129;
    std::vector<double> from = random_states(random, robot.rig.body, kMotions), to = from;
    for (double& x : to) x += random.uniform(-0.3, 0.3);
    std::vector<MotionAnswer> answers(kMotions);
    MotionSearch search;
    REQUIRE(checker.check_motions(from, to, answers, search) == Status::kOk);
    for (std::size_t m = 0; m < kMotions; ++m) {
      CAPTURE(m);
      std::vector<double> along;
      for (std::size_t i = 0; i < kMoments; ++i)
        for (std::size_t v = m * variables; v < (m + 1) * variables; ++v)
          along.push_back(from[v] + (to[v] - from[v]) * static_cast<double>(i) / (kMoments - 1));
      std::vector<StateAnswer> states(kMoments);
      REQUIRE(checker.check(along, states) == Status::kOk);
      const bool any = std::count(states.begin(), states.end(), StateAnswer::kColliding) > 0;
      if (answers[m] == MotionAnswer::kFree) CHECK_FALSE(any);
      if (any) CHECK(answers[m] == MotionAnswer::kColliding);
      free += answers[m] == MotionAnswer::kFree;
      colliding += any;
    }
  }
  CHECK(free >= least_count(200, 40));
  CHECK(colliding >= least_count(200, 40));
}

TEST_CASE("no vertex of a robot's triangles moves farther than the bound says, and one by other links has none") {
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    TriangleRobot robot(random, 5, random.chance(0.5));
    detail::MotionBound bound;
    REQUIRE(bound.set(robot.desc(), robot.rig.body.desc(), {}) == Status::kOk);
    std::vector<double> from = random_states(random, robot.rig.body, 1), to = from;
    for (double& x : to) x += random.uniform(-0.5, 0.5);
    const double length = bound.length(from.data(), to.data(), true);
    const std::vector<float> a = robot.poses(from), b = robot.poses(to);
    for (std::size_t n = 0; n < robot.corners.size(); ++n) {
      const std::size_t link = robot.rig.rig.leaves[n].link;
      const std::vector<Vec3<double>> at_a = robot.places(n, &a[7 * link]), at_b = robot.places(n, &b[7 * link]);
      for (std::size_t i = 0; i < at_a.size(); ++i) CHECK(norm(at_b[i] - at_a[i]) <= length + bound.rounding());
    }
    if (robot.rig.rig.link_count() < 2) continue;
    robot.links[0] = (robot.links[0] + 1) % robot.rig.rig.link_count();
    CHECK(bound.set(robot.desc(), robot.rig.body.desc(), {}) == Status::kSkinNotTaken);
  }
}

TEST_CASE("a robot of triangles holds an object, which touches the links that a link of its shapes at its place does") {
  std::size_t touching = 0;
  for (std::uint64_t seed = 1; seed <= rounds(30); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const TriangleRobot robot(random, 5, random.chance(0.5));
    const std::uint32_t count = 40, links = robot.rig.rig.link_count();
    const std::vector<double> states = random_states(random, robot.rig.body, count);
    const std::vector<float> poses = robot.poses(states);
    const Cube cube(0.2f);
    AttachedDesc object;
    object.link = random.index(links);
    object.leaves = {&cube.leaf, 1};
    AttachedObject held;
    REQUIRE(held.set(robot.desc(), robot.rig.body.desc(), object) == Status::kOk);
    CollisionChecker checker;
    REQUIRE(checker.set_robot(held.desc(), held.kinematics()) == Status::kOk);
    const Rows rows = rows_of(checker, states, count);
    for (std::uint32_t s = 0; s < count; ++s)
      for (std::uint32_t link = 0; link < links; ++link) {
        bool touches = false;
        for (std::size_t n = 0; n < robot.corners.size(); ++n) {
          if (robot.rig.rig.leaves[n].link != link || link == object.link) continue;
          // Both in the frame of the link that holds the cube, which is about its origin.
          const float* const of_cube = &poses[7 * (s * links + object.link)];
          const double q[4] = {of_cube[0], of_cube[1], of_cube[2], of_cube[3]};
          double turn[3][3];
          quaternion_matrix(q, turn);
          std::vector<Vec3<double>> places = robot.places(n, &poses[7 * (s * links + link)]);
          std::vector<Triangle<double>> triangles(places.size() / 3);
          for (std::size_t i = 0; i < places.size(); ++i) {
            const Vec3<double> away = places[i] - Vec3<double>{{of_cube[4], of_cube[5], of_cube[6]}};
            for (std::size_t k = 0; k < 3; ++k) places[i][k] = dot(to_vec3(turn[k]), away);
            triangles[i / 3].corner[i % 3] = places[i];
          }
          constexpr float kOrigin[7] = {0, 0, 0, 1, 0, 0, 0};
          touches = touches || is_in_cube(places, cube, kOrigin) ||
                    any_touch(TriangleSet(std::move(triangles)), cube.faces(kOrigin));
        }
        CHECK(rows.count({s, 0, link, links}) == touches);
        touching += touches;
      }
  }
  CHECK(touching >= least_count(100, 30));
}

TEST_CASE("depths, distances and padding of triangles are refused, and answers stay as they were") {
  Random random(5);
  const TriangleRobot robot(random, 5, true);
  const Cube cube(0.3f);
  const std::vector<float> at = {0, 0, 0, 1, 0, 0, 0};
  const std::vector<double> states = random_states(random, robot.rig.body, 20);
  CollisionChecker checker;
  REQUIRE(checker.set_robot(robot.desc(), robot.rig.body.desc()) == Status::kOk);
  const std::vector<float> padding(robot.rig.rig.link_count(), 0.1f);
  CHECK(checker.set_padding(robot.desc(), padding) == Status::kSkinNotTaken);
  REQUIRE(checker.add_fixed(cube.desc(), at) == Status::kOk);
  const Rows before = rows_of(checker, states, 20);
  std::vector<NearestLinks> nearest(20);
  CHECK(checker.find_nearest(states, nearest, 1) == Status::kSkinNotTaken);
  checker.world().want_contacts();
  CHECK(checker.find_hits(states, 20) == Status::kSkinNotTaken);
  checker.world().want_contacts(false);
  CHECK(rows_of(checker, states, 20) == before);

  // Solids take what stands around as triangles, and boxes stay boxes where they are asked for.
  CollisionChecker solid;
  JointedBody one = robot.rig.body;
  one.parents = {-1};
  one.links.resize(1);
  one.links[0].joint_count = 0;
  one.joints.clear();
  REQUIRE(solid.set_robot(cube.desc(), one.desc()) == Status::kOk);
  CHECK(solid.world().job().policies.exact == Exact::kConvex);
  std::vector<float> poses;
  for (std::uint32_t l = 0; l < robot.rig.rig.link_count(); ++l) poses.insert(poses.end(), at.begin(), at.end());
  REQUIRE(solid.add_fixed(robot.desc(), poses) == Status::kOk);
  CHECK(solid.world().job().policies.exact == Exact::kSurface);
  CollisionChecker boxes;
  boxes.world().job().policies.exact = Exact::kNone;
  REQUIRE(boxes.set_robot(robot.desc(), robot.rig.body.desc()) == Status::kOk);
  CHECK(boxes.world().job().policies.exact == Exact::kNone);
}

}  // namespace cab::tests
