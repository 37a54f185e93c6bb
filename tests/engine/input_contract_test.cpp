// The table of bad and extreme inputs in docs/embedding.md. Each input has the answer that its row gives, and no other
// instance of the tile or the engine changes.
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/containment.h"
#include "tests/sanitizers.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <string>

namespace {

using namespace cab;
using namespace cab::oracle;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kDenormal = 1e-40f;

// The text of a row in the table.
struct Row {
  std::string input;
  std::string answer;
};

// ------------------------------------------------------------------------------------------------------- poses

// A row about one instance's pose: variants of the pose, and the engine's answer.
struct PoseRow {
  Row row;
  InstanceFlag flag;  // kInstanceOk: the pose is taken, and boxes contain what it places
  std::vector<PoseFormat> formats;
  std::vector<std::function<void(Random&, Poses&, std::uint32_t)>> variants;
};

constexpr std::uint32_t kNeeded = 1, kUnneeded = 4;  // links without leaves: a merge needs the joint of one

// Links 0 to 4. Link 1 is on 0, links 2 and 3 are on 1, link 4 is on 3. Link 0 has two leaves, links 2 and 3 have one.
Rig contract_rig(Random& random) {
  Rig rig;
  rig.parents = {-1, 0, 1, 1, 3};
  for (int l = 0; l < 5; ++l) {
    rig.parent_offset.push_back(0.3 * random.unit_vector());
    for (int c = 0; c < 3; ++c) rig.joints.push_back(static_cast<float>(random.uniform(-0.2, 0.2)));
  }
  for (const std::uint32_t link : {0u, 2u, 3u, 0u})
    rig.leaves.push_back({link, random_box(random, 0.15 * random.unit_vector(), 0.03, 0.2), {}});
  return rig;
}

float& entry(float* pose, PoseFormat format, std::size_t row, std::size_t column) {
  return pose[format == PoseFormat::kMatrix3x4Rows ? 4 * row + column : 4 * column + row];
}

using Matrix = std::array<std::array<double, 3>, 3>;  // columns

// Applies a function to the rotation of a random link of an instance that has leaves.
std::function<void(Random&, Poses&, std::uint32_t)> on_matrix(std::function<void(Random&, Matrix&)> change) {
  return [change](Random& random, Poses& poses, std::uint32_t i) {
    float* const pose = poses.pose(i, random.chance(0.5) ? 0 : 2 + random.index(2));
    Matrix m;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) m[k][c] = double{entry(pose, poses.format, c, k)};
    change(random, m);
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) entry(pose, poses.format, c, k) = static_cast<float>(m[k][c]);
  };
}

double off_by(const Matrix& m) {
  double out = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = i == j ? -1 : 0;
      for (std::size_t c = 0; c < 3; ++c) dot += m[i][c] * m[j][c];
      out = std::max(out, std::fabs(dot));
    }
  return out;
}

// Moves all nine entries at random until the largest entry of |R^T R - I| has the given value.
auto drifted(double by) {
  return on_matrix([by](Random& random, Matrix& m) {
    Matrix drift;
    for (auto& column : drift)
      for (double& v : column) v = random.uniform(-1, 1);
    double lo = 0, hi = 1;
    const auto at = [&](double s) {
      Matrix out = m;
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c) out[k][c] += s * drift[k][c];
      return out;
    };
    while (off_by(at(hi)) > by) hi /= 2;  // the first crossing, not a later one
    lo = hi, hi *= 2;
    for (int halving = 0; halving < 60; ++halving) (off_by(at((lo + hi) / 2)) > by ? hi : lo) = (lo + hi) / 2;
    m = at(lo);
  });
}

auto scaled(double x, double y, double z) {
  return on_matrix([=](Random&, Matrix& m) {
    for (std::size_t c = 0; c < 3; ++c) m[0][c] *= x, m[1][c] *= y, m[2][c] *= z;
  });
}

auto sheared(double by) {
  return on_matrix([=](Random&, Matrix& m) {
    for (std::size_t c = 0; c < 3; ++c) m[0][c] += by * m[1][c];
  });
}

auto quaternion_scaled(float by) {
  return [by](Random& random, Poses& poses, std::uint32_t i) {
    float* const pose = poses.pose(i, random.chance(0.5) ? 0 : 3);
    for (int c = 0; c < 4; ++c) pose[c] *= by;
  };
}

// Sets one of the numbers of a link's pose that are read.
auto number(std::uint32_t link, float value) {
  return [=](Random& random, Poses& poses, std::uint32_t i) {
    float* const pose = poses.pose(i, link);
    const bool quaternion = poses.format == PoseFormat::kQuaternionTranslation;
    const unsigned at = random.index(quaternion ? 7 : 12);
    (quaternion ? pose[at] : entry(pose, poses.format, at / 4, at % 4)) = value;
  };
}

// Moves every link to the same place, each with a random rotation.
auto moved(std::array<double, 3> to) {
  return [=](Random& random, Poses& poses, std::uint32_t i) {
    for (std::uint32_t l = 0; l < poses.link_count; ++l) {
      double q[4];
      random_turn(random, q);
      write_pose(poses.format, q, {{to[0], to[1], to[2]}}, poses.pose(i, l));
    }
  };
}

auto oriented(std::array<float, 4> q) {
  return [=](Random&, Poses& poses, std::uint32_t i) { std::copy(q.begin(), q.end(), &poses.orientations[4 * i]); };
}

// Gives one instance a scale, and all others 1.
auto sized_instance(float scale) {
  return [=](Random&, Poses& poses, std::uint32_t i) {
    poses.scales.assign(poses.instance_count, 1.0f);
    poses.scales[i] = scale;
  };
}

std::vector<PoseRow> pose_rows() {
  const std::string not_rigid = "masked, `kInstanceNotRigid`", not_finite = "masked, `kInstanceNotFinite`";
  const std::vector<PoseFormat> matrices = {PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns},
                                quaternions = {PoseFormat::kQuaternionTranslation},
                                all = {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows,
                                       PoseFormat::kMatrix4x4Columns};
  const auto out_of_range = [](Random& random, Poses& poses, std::uint32_t i) {
    moved({9e17, 9e17, 0})(random, poses, i);
    oriented({0, 0, 0.38268343f, 0.92387953f})(random, poses, i);
  };
  const auto last_row = [](Random&, Poses& poses, std::uint32_t i) {
    for (std::uint32_t l = 0; l < poses.link_count; ++l)
      for (const std::size_t f : {3u, 7u, 11u, 15u}) poses.pose(i, l)[f] = f == 7 ? kInfinity : kNan;
  };
  return {
      {{"matrix off by 1e-7 to 9.9e-4", "made orthonormal, first column kept"},
       kInstanceOk,
       matrices,
       {drifted(1e-6), drifted(1e-5), drifted(1e-4), drifted(9.9e-4), on_matrix([](Random& random, Matrix& m) {
          for (auto& column : m)
            for (double& v : column) v += random.uniform(-1e-7, 1e-7);
        })}},
      {{"matrix off by 1.01e-3 to 1e-2", not_rigid}, kInstanceNotRigid, matrices, {drifted(1.01e-3), drifted(1e-2)}},
      {{"matrix with uniform scale beyond 5e-4, or zero, without `has_scale`", not_rigid},
       kInstanceNotRigid,
       matrices,
       {scaled(1.001, 1.001, 1.001), scaled(0.99, 0.99, 0.99), scaled(100, 100, 100), scaled(0, 0, 0),
        scaled(1e17, 1e17, 1e17)}},
      {{"matrix with scale along one axis beyond 5e-4", not_rigid},
       kInstanceNotRigid,
       matrices,
       {scaled(1.001, 1, 1), scaled(1, 0.99, 1), scaled(1, 1, 0)}},
      {{"mirrored matrix", "taken, and the leaves' shapes are mirrored"},
       kInstanceOk,
       matrices,
       {scaled(-1, 1, 1), scaled(-1, -1, -1)}},
      {{"sheared matrix, beyond 1e-3", not_rigid}, kInstanceNotRigid, matrices, {sheared(1.1e-3), sheared(0.5)}},
      {{"quaternion of length 1e-3 to 1e3, not 1", "length divided out"},
       kInstanceOk,
       quaternions,
       {quaternion_scaled(1.1e-3f), quaternion_scaled(-0.5f), quaternion_scaled(1.0001f), quaternion_scaled(900)}},
      {{"zero quaternion, or length beyond 1e-3 to 1e3", not_rigid},
       kInstanceNotRigid,
       quaternions,
       {quaternion_scaled(0), quaternion_scaled(-0.0f), quaternion_scaled(9e-4f), quaternion_scaled(1e-41f),
        quaternion_scaled(1.1e3f), quaternion_scaled(1e17f)}},
      {{"NaN in a pose that is read", not_finite}, kInstanceNotFinite, all, {number(0, kNan), number(3, -kNan)}},
      {{"infinity in a pose that is read", not_finite},
       kInstanceNotFinite,
       all,
       {number(0, kInfinity), number(2, -kInfinity)}},
      {{"number above 1e18 in a pose that is read", not_finite},
       kInstanceNotFinite,
       all,
       {number(0, 1.0001e18f), number(3, -3e38f)}},
      {{"numbers to 1e18 whose boxes or joints leave that range", not_finite}, kInstanceNotFinite, all, {out_of_range}},
      {{"translation to 5e17", "taken"}, kInstanceOk, all, {moved({5e17, -5e17, 5e17}), moved({0, 1e9, 0})}},
      {{"denormal translation", "taken"}, kInstanceOk, all, {moved({1e-40, -1e-42, 0})}},
      {{"denormal entries of a quaternion", "taken"},
       kInstanceOk,
       quaternions,
       {[](Random&, Poses& poses, std::uint32_t i) {
         const float q[4] = {kDenormal, -kDenormal, 1e-45f, 1};
         std::copy_n(q, 4, poses.pose(i, 0));
       }}},
      {{"last row of a 4x4 matrix", "not read"}, kInstanceOk, {PoseFormat::kMatrix4x4Columns}, {last_row}},
      {{"NaN in a link that has no leaf, its joint needed by a merge", not_finite},
       kInstanceNotFinite,
       all,
       {number(kNeeded, kNan)}},
      {{"pose of a link that has no leaf, its joint needed by no merge", "not read"},
       kInstanceOk,
       all,
       {number(kUnneeded, kNan), number(kUnneeded, kInfinity)}},
      {{"orientation of length 1e-3 to 1e3, not 1", "length divided out"},
       kInstanceOk,
       all,
       {oriented({0.002f, 0, 0, 0}), oriented({30, -40, 5, 700})}},
      {{"zero orientation, or length beyond 1e-3 to 1e3", not_rigid},
       kInstanceNotRigid,
       all,
       {oriented({0, 0, 0, 0}), oriented({0, 0, 9e-4f, 0}), oriented({2000, 0, 0, 0})}},
      {{"orientation that is not finite or above 1e18", not_finite},
       kInstanceNotFinite,
       all,
       {oriented({kNan, 0, 0, 1}), oriented({0, kInfinity, 0, 1}), oriented({0, 0, 0, 2e18f})}},
      {{"scale of an instance, 1e-3 to 1e3", "taken: its lengths are multiplied"},
       kInstanceOk,
       all,
       {sized_instance(1e-3f), sized_instance(0.9f), sized_instance(1.1f), sized_instance(1e3f)}},
      {{"scale of an instance beyond 1e-3 to 1e3, or NaN", not_rigid},
       kInstanceNotRigid,
       all,
       {sized_instance(0), sized_instance(-1), sized_instance(9.99e-4f), sized_instance(1001),
        sized_instance(kInfinity), sized_instance(kNan)}},
  };
}

OracleBox<float> oracle_box(const Box& box) {
  OracleBox<float> out;
  static_assert(sizeof(out) == sizeof(box));
  std::memcpy(&out, &box, sizeof(out));
  return out;
}

std::vector<Box> boxes_of(Engine& engine, const World& world, std::uint32_t batch, const Policies& policies) {
  const Member& member = world.members[batch - 1];
  std::vector<Box> out(std::size_t{member.poses.instance_count} * member.rig.node_count());
  REQUIRE(compute_boxes(engine, member.poses.input({batch}), policies, out) == Status::kOk);
  return out;
}

constexpr Policies kCabTree = {Refit::kCab, Strategy::kTree}, kHullTree = {Refit::kAabbHull, Strategy::kTree},
                   kObbLeaves = {Refit::kCovariance, Strategy::kTree, Exact::kNone, Extents::kLeaves};

// Checks that the engine's leaf boxes of one instance contain the exact ones.
bool leaves_hold(const World& world, std::uint32_t i, const std::vector<Box>& boxes) {
  const Member& member = world.members[0];
  const std::vector<ExactBox> exact = exact_leaf_boxes(member.rig, member.poses, i);
  bool hold = true;
  for (std::size_t leaf = 0; leaf < exact.size(); ++leaf)
    hold = hold &&
           judge_containment_exactly(oracle_box(boxes[i * member.rig.node_count() + leaf]), convert<Quad>(exact[leaf]))
               .inside;
  return hold;
}

// Spoils one of eighteen instances. Checks its flag, its boxes, and that the bits of all others stay.
void check_pose(const World& sound, const World& given, std::uint32_t who, InstanceFlag flag) {
  const std::size_t nodes = sound.members[0].rig.node_count();
  const std::uint32_t n = sound.members[0].poses.instance_count;
  std::vector<Hit> first_hits;
  for (const Isa isa : available_isas()) {
    CAPTURE(to_string(isa));
    EngineDesc desc;
    desc.isa = isa;
    const EnginePtr engine = make_engine_for(sound, desc);
    const auto others = [&](const std::vector<Hit>& hits) {
      std::vector<Hit> out;
      for (const Hit& hit : hits)
        if (hit.instance_a != who && hit.instance_b != who) out.push_back(hit);
      return out;
    };
    const Outcome before = run_on(*engine, sound, {}), after = run_on(*engine, given, {});
    for (std::uint32_t i = 0; i < n; ++i) CHECK(after.flags[0][i] == (i == who ? flag : kInstanceOk));
    CHECK(after.stats.instances_masked == (flag == kInstanceOk ? 0 : 1));
    CHECK(same_hits(others(before.hits), others(after.hits)));
    if (flag != kInstanceOk) CHECK(others(after.hits).size() == after.hits.size());
    if (isa == Isa::kScalar) first_hits = after.hits;
    CHECK(same_hits(after.hits, first_hits));
    for (const Policies& policies : {kCabTree, kHullTree, kObbLeaves}) {
      const std::vector<Box> was = boxes_of(*engine, sound, 1, policies), is = boxes_of(*engine, given, 1, policies);
      for (std::uint32_t i = 0; i < n; ++i)
        if (i != who) CHECK(same_bits(&was[i * nodes], &is[i * nodes], nodes));
      const Box cleared = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
      for (std::size_t node = 0; node < nodes && flag != kInstanceOk; ++node)
        CHECK(same_bits(&is[who * nodes + node], &cleared, 1));
      if (flag == kInstanceOk) CHECK(leaves_hold(given, who, is));
    }
  }
  if (flag == kInstanceOk) CHECK(missing_from(judge_world(given), first_hits) == 0);
}

}  // namespace

TEST_CASE("every row of the input table about poses has its answer, and the neighbours in the tile keep their bits") {
  std::uint64_t seed = 0;
  for (const PoseRow& row : pose_rows()) {
    CAPTURE(row.row.input);
    for (const PoseFormat format : row.formats) {
      for (std::size_t variant = 0; variant < row.variants.size(); ++variant) {
        CAPTURE(variant);
        ++seed;
        CAPTURE(seed);
        Random random(seed);
        World sound;
        Member member;
        member.rig = contract_rig(random);
        member.poses = random_poses(random, member.rig, 18, format, {0.4, true, random.chance(0.5), {}});
        sound.members.push_back(member);
        sound.rules = {{{1}, {1}, Pairing::kWithin}, {{1}, {1}, Pairing::kBetween}};
        World given = sound;
        const std::uint32_t who = random.index(18);
        row.variants[variant](random, given.members[0].poses, who);
        check_pose(sound, given, who, row.flag);
      }
    }
  }
}

TEST_CASE("of the links without leaves in the tests of the table, a merge needs one and not the other") {
  Random random(1);
  const Rig rig = contract_rig(random);
  const EnginePtr engine = make_engine();
  std::vector<MergeStep> steps(rig.leaf_count() - 1);
  REQUIRE(merge_steps(*engine, add_rig(*engine, rig), steps) == Status::kOk);
  const auto needs = [&](std::uint32_t link) {
    return std::any_of(steps.begin(), steps.end(), [&](const MergeStep& step) { return step.joint_link == link; });
  };
  CHECK(needs(kNeeded));
  CHECK_FALSE(needs(kUnneeded));
}

// ----------------------------------------------------------------------------------------------- articulations

namespace {

// A row about an articulation: variants of a rig, and the answer of add_articulation.
struct RigRow {
  Row row;
  Status status;
  std::vector<std::function<void(Random&, Rig&)>> variants;
  InstanceFlag flag = kInstanceOk;  // of every instance, where the rig is taken
};

auto half_of_0(float half) {
  return [=](Random& random, Rig& rig) { rig.leaves[0].box.half[random.index(3)] = half; };
}

// Gives every leaf box the same size, about the origin of its link.
auto sized(float half) {
  return [=](Random& random, Rig& rig) {
    for (Leaf& leaf : rig.leaves)
      for (int k = 0; k < 3; ++k) {
        leaf.box.half[k] = half * static_cast<float>(random.uniform(0.5, 1));
        leaf.box.center[k] = 0.1f * half;
      }
  };
}

auto axes_of_0(std::function<void(Random&, Box&)> change) {
  return [=](Random& random, Rig& rig) { change(random, rig.leaves[0].box); };
}

auto axes_drift(double by) {
  return axes_of_0([=](Random& random, Box& box) {
    for (auto& axis : box.axis)
      for (float& v : axis) v = static_cast<float>(double{v} + random.uniform(-by, by));
  });
}

auto links(std::uint32_t count, std::uint32_t leaves) {
  return [=](Random& random, Rig& rig) {
    rig = {};
    for (std::uint32_t l = 0; l < count; ++l) {
      rig.parents.push_back(static_cast<std::int32_t>(l) - 1);
      rig.parent_offset.push_back(0.1 * random.unit_vector());
    }
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf)
      rig.leaves.push_back({count == 0 ? 0 : leaf % count, random_box(random, {}, 0.01, 0.05), {}});
  };
}

std::vector<RigRow> rig_rows() {
  const auto refused = [](const char* status) { return std::string("refused, `") + status + "`"; };
  return {
      {{"half extent 0 or -0: a plate, a segment, a point", "taken"},
       Status::kOk,
       {half_of_0(0), half_of_0(-0.0f),
        [](Random&, Rig& rig) { rig.leaves[0].box.half[0] = rig.leaves[0].box.half[1] = 0; },
        [](Random&, Rig& rig) { std::fill_n(rig.leaves[0].box.half, 3, 0.0f); }, sized(0)}},
      {{"denormal half extents and centres", "taken"}, Status::kOk, {half_of_0(1e-45f), sized(kDenormal)}},
      {{"half extent to 9e17", "taken"}, Status::kOk, {sized(1e9f), sized(9e17f), half_of_0(9e17f)}},
      {{"half extent of 1e18", "taken, but padding leaves the range: instances masked, `kInstanceNotFinite`"},
       Status::kOk,
       {half_of_0(1e18f)},
       kInstanceNotFinite},
      {{"half extent negative, above 1e18, infinite or NaN", refused("kBadLeafBox")},
       Status::kBadLeafBox,
       {half_of_0(-1e-45f), half_of_0(-1), half_of_0(1.0001e18f), half_of_0(kInfinity), half_of_0(kNan)}},
      {{"centre above 1e18, infinite or NaN", refused("kBadLeafBox")},
       Status::kBadLeafBox,
       {[](Random&, Rig& rig) { rig.leaves[0].box.center[1] = -1.0001e18f; },
        [](Random&, Rig& rig) { rig.leaves[0].box.center[1] = kInfinity; },
        [](Random&, Rig& rig) { rig.leaves[0].box.center[1] = kNan; }}},
      {{"leaf axes off by 1e-5 or less", "made orthonormal beyond 4 u, the box grown over its corners"},
       Status::kOk,
       {axes_drift(1e-8), axes_drift(1e-7), axes_drift(2.5e-6)}},
      {{"leaf axes off by more, scaled, mirrored, skewed, zero or NaN", refused("kBadLeafAxes")},
       Status::kBadLeafAxes,
       {axes_of_0([](Random&, Box& box) {
          for (float& v : box.axis[1]) v *= 1.0001f;
        }),
        axes_of_0([](Random&, Box& box) {
          for (auto& axis : box.axis)
            for (float& v : axis) v *= 2;
        }),
        axes_of_0([](Random&, Box& box) {
          for (float& v : box.axis[2]) v = -v;
        }),
        axes_of_0([](Random&, Box& box) {
          for (int c = 0; c < 3; ++c) box.axis[0][c] += 1e-3f * box.axis[1][c];
        }),
        axes_of_0([](Random&, Box& box) { std::fill_n(&box.axis[0][0], 9, 0.0f); }),
        axes_of_0([](Random&, Box& box) { box.axis[1][1] = kNan; })}},
      {{"joint that is not finite or above 1e18", refused("kBadJoint")},
       Status::kBadJoint,
       {[](Random&, Rig& rig) { rig.joints[4] = kNan; }, [](Random&, Rig& rig) { rig.joints[0] = -kInfinity; },
        [](Random&, Rig& rig) { rig.joints[7] = 2e18f; }}},
      {{"1024 links or leaves", "taken"}, Status::kOk, {links(1024, 1024), links(1, 1024), links(1024, 1)}},
      {{"1025 links or more", refused("kTooManyLinks")}, Status::kTooManyLinks, {links(1025, 1), links(5000, 1)}},
      {{"1025 leaves or more", refused("kTooManyLeaves")}, Status::kTooManyLeaves, {links(1, 1025), links(4, 5000)}},
      {{"no links", refused("kNoLinks")}, Status::kNoLinks, {links(0, 1)}},
      {{"no leaves", refused("kNoLeaves")}, Status::kNoLeaves, {links(3, 0)}},
      {{"one link with one leaf", "taken; no pair within it"}, Status::kOk, {links(1, 1)}},
  };
}

// Checks a rig that is accepted: its boxes are finite, contain the exact leaf boxes and have the same bits on every
// instruction set.
void check_taken(Random& random, const Rig& rig, InstanceFlag flag) {
  if (cab::tests::kThreadSanitizer && rig.leaf_count() > 16) {
    MESSAGE("under ThreadSanitizer frames of " << rig.leaf_count() << " leaves are left out: minutes on one thread");
    return;
  }
  World world;
  Member member;
  member.rig = rig;
  const std::uint32_t instances = rig.leaf_count() > 16 ? 1 : 3;  // a frame of large rigs has a million hits
  member.poses = random_poses(random, rig, instances, PoseFormat::kMatrix3x4Rows, {0.1, false, false, {}});
  world.members.push_back(member);
  world.rules = {{{1}, {1}, Pairing::kWithin}, {{1}, {1}, Pairing::kBetween}};
  for (const Policies& policies : {kCabTree, kHullTree, kObbLeaves}) {
    std::vector<Box> first_boxes;
    std::vector<Hit> first_hits;
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      EngineDesc desc;
      desc.isa = isa;
      const EnginePtr engine = make_engine_for(world, desc);
      const std::vector<Box> boxes = boxes_of(*engine, world, 1, policies);
      const Outcome outcome = run_on(*engine, world, policies);
      for (const std::uint8_t found : outcome.flags[0]) CHECK(found == flag);
      if (isa == Isa::kScalar) {
        first_boxes = boxes;
        first_hits = outcome.hits;
      }
      CHECK(same_bits(boxes.data(), first_boxes.data(), boxes.size()));
      CHECK(same_hits(outcome.hits, first_hits));
    }
    bool finite = true;
    for (const Box& box : first_boxes)
      for (const float v : {box.center[0], box.center[1], box.center[2], box.half[0], box.half[1], box.half[2],
                            box.axis[0][0], box.axis[1][1], box.axis[2][2]})
        finite = finite && std::isfinite(v);
    CHECK(finite);
    if (flag != kInstanceOk) {
      CHECK(first_hits.empty());
      continue;
    }
    for (std::uint32_t i = 0; i < instances; ++i) CHECK(leaves_hold(world, i, first_boxes));
    if (rig.leaf_count() <= 16) CHECK(missing_from(judge_world(world), first_hits) == 0);
    if (rig.link_count() == 1)
      for (const Hit& hit : first_hits) CHECK(hit.instance_a != hit.instance_b);
  }
}

}  // namespace

TEST_CASE("every row of the input table about articulations has its answer, and a refused one changes nothing") {
  std::uint64_t seed = 0;
  for (const RigRow& row : rig_rows()) {
    CAPTURE(row.row.input);
    for (std::size_t variant = 0; variant < row.variants.size(); ++variant) {
      CAPTURE(variant);
      ++seed;
      CAPTURE(seed);
      Random random(seed);
      Rig rig = contract_rig(random);
      row.variants[variant](random, rig);
      World bystander;
      bystander.members.push_back(any_member(random, 17, BatchKind::kCharacters, {0.5, false, false, {}}, 8));
      bystander.rules = {{{1}, {1}, Pairing::kBetween}};
      const EnginePtr engine = make_engine_for(bystander);
      const std::vector<Box> boxes = boxes_of(*engine, bystander, 1, {});
      const Outcome before = run_on(*engine, bystander, {});
      ArticulationId id = {77};
      CHECK(add_articulation(*engine, rig.desc(), &id) == row.status);
      CHECK(static_cast<std::uint32_t>(id.value) == (row.status == Status::kOk ? 2 : 77));
      const std::vector<Box> after = boxes_of(*engine, bystander, 1, {});
      CHECK(same_bits(boxes.data(), after.data(), boxes.size()));
      CHECK(same_hits(before.hits, run_on(*engine, bystander, {}).hits));
      if (row.status == Status::kOk) check_taken(random, rig, row.flag);
    }
  }
}

// ------------------------------------------------------------------------------------------------------- calls

namespace {

// A row about a call, with the check of its answer.
struct CallRow {
  Row row;
  std::function<void()> check;
};

// Characters on a grid of 2^-10, so that origins can be moved by whole numbers without rounding.
World grid_world(double far) {
  Random random(5);
  World world;
  world.members.push_back(any_member(random, 19, BatchKind::kCharacters, {0.5, false, true, {}}, 8));
  for (double& v : world.members[0].poses.origins) v = std::round(v * 1024) / 1024 + far;
  world.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin}};
  return world;
}

struct Call {
  World world = grid_world(0);
  EnginePtr engine = make_engine_for(world);
  BatchInput input = world.members[0].poses.input({1});
  std::vector<Hit> hits = std::vector<Hit>(5000);
  FrameJob job;

  Call() {
    job.inputs = {&input, 1};
    job.rules = world.rules;
    job.hits = hits;
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
};

void check_far_origins() {
  const World near_by = grid_world(0);
  const std::vector<Hit> expected = run_world(near_by).hits;
  CHECK(expected.size() > 0);
  for (const double far : {1e9, -123456789.0, 4e12}) {  // 2^-10 is kept to 2^42
    const World world = grid_world(far);
    const EnginePtr engine = make_engine_for(world);
    CHECK(same_hits(run_on(*engine, world, {}).hits, expected));
    const auto a = boxes_of(*engine, world, 1, {}), b = boxes_of(*engine, near_by, 1, {});
    CHECK(same_bits(a.data(), b.data(), a.size()));
  }
  World apart = grid_world(0);  // differences that float and even double cannot hold
  for (std::uint32_t i = 0; i < 19; ++i)
    for (std::size_t c = 0; c < 3; ++c) apart.members[0].poses.origins[3 * i + c] = (i % 2 ? -1.7e308 : 1.7e308);
  for (const Policies& policies : {kCabTree, kHullTree})
    for (const Hit& hit : run_world(apart, policies).hits) CHECK(hit.instance_a % 2 == hit.instance_b % 2);
}

void check_bad_origins() {
  for (const double bad : {double{kNan}, double{kInfinity}, -double{kInfinity}}) {
    Call call;
    call.world.members[0].poses.origins[40] = bad;
    CHECK(run_frame(*call.engine, call.job) == Status::kBadOrigins);
    CHECK(call.job.hit_count == 0);
  }
}

void check_empty_frames() {
  for (const bool inputs : {false, true}) {
    Call call;
    if (!inputs) call.job.inputs = {};
    call.job.rules = {};
    call.job.hit_count = 7;
    CHECK(run_frame(*call.engine, call.job) == Status::kOk);
    CHECK(call.job.hit_count == 0);
    CHECK(call.job.hits_needed == 0);
    CHECK(call.job.stats.box_tests == 0);
  }
}

void check_rule_without_input() {
  Call call;
  call.job.inputs = {};
  CHECK(run_frame(*call.engine, call.job) == Status::kBadPairRule);
}

void check_empty_batch() {
  Call call;
  BatchId id = {9};
  CHECK(add_batch(*call.engine, {{1}, 0, BatchKind::kCharacters}, &id) == Status::kNoInstances);
  CHECK(id.value == 9);
}

void check_one_short() {
  Call call;
  REQUIRE(run_frame(*call.engine, call.job) == Status::kOk);
  const std::size_t count = call.job.hit_count;
  REQUIRE(count > 1);
  const std::vector<Hit> expected(call.hits.begin(), call.hits.begin() + static_cast<std::ptrdiff_t>(count));
  for (const std::size_t room : {count - 1, std::size_t{0}}) {
    call.job.hits.size = room;
    Hit guard = {};
    guard.instance_a = 0xabcdef;
    call.hits[room] = guard;
    CHECK(run_frame(*call.engine, call.job) == Status::kHitsOverflow);
    CHECK(call.job.hits_needed == count);
    CHECK(call.job.hit_count == 0);
    CHECK(call.hits[room].instance_a == 0xabcdef);
  }
  call.job.hits.size = count;
  CHECK(run_frame(*call.engine, call.job) == Status::kOk);
  call.hits.resize(count);
  CHECK(same_hits(call.hits, expected));
}

void check_boxes_short() {
  Call call;
  const std::size_t count = 19 * call.world.members[0].rig.node_count();
  std::vector<Box> boxes(count);
  CHECK(compute_boxes(*call.engine, call.input, {}, {boxes.data(), count - 1}) == Status::kBadOutput);
  CHECK(compute_boxes(*call.engine, call.input, {}, {boxes.data(), count}) == Status::kOk);
}

void check_order_short() {
  Call call;
  std::vector<std::uint32_t> order(19);
  CHECK(spatial_order(*call.engine, {1}, {order.data(), 18}) == Status::kBadOutput);
  CHECK(spatial_order(*call.engine, {1}, {order.data(), 19}) == Status::kOk);
}

void check_vertices() {
  const float far = 1.0001e18f;
  for (const float bad : {kNan, kInfinity, -kInfinity, far}) {
    const float vertices[6] = {1, 2, 3, 4, bad, 6};
    Box box = {};
    box.half[0] = 7;
    CHECK(fit_box({vertices, 6}, &box) == Status::kBadVertices);
    CHECK(fit_box({vertices, 2}, &box) == Status::kBadVertices);
    CHECK(fit_box({vertices, 0}, &box) == Status::kBadVertices);
    CHECK(box.half[0] == 7);
    CHECK(fit_box({vertices, 3}, &box) == Status::kOk);
  }
}

// Adds the rig of the table with a rest pose that `change` has changed, and checks the answer.
void check_rest(Status status, const std::function<void(Random&, Poses&, PoseView&)>& change) {
  for (const PoseFormat format :
       {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns}) {
    Random random(11);
    const Rig rig = contract_rig(random);
    Poses poses = random_poses(random, rig, 1, format, {0.1, false, false, {}});
    ArticulationDesc desc = rig.desc();
    desc.rest_pose = {format, poses.data.data(), 0, 0};
    change(random, poses, desc.rest_pose);
    const EnginePtr engine = make_engine();
    ArticulationId id = {77};
    CHECK(add_articulation(*engine, desc, &id) == status);
    CHECK(static_cast<std::uint32_t>(id.value) == (status == Status::kOk ? 1 : 77));
    ArticulationInfo info;
    CHECK(articulation_info(*engine, {1}, &info) ==
          (status == Status::kOk ? Status::kOk : Status::kUnknownArticulation));
  }
}

void check_rest_numbers() {
  for (const std::uint32_t link : {0u, kNeeded, 3u})
    for (const float bad : {kNan, kInfinity, -kInfinity, 1.0001e18f})
      check_rest(Status::kBadRestPose,
                 [&](Random& random, Poses& poses, PoseView&) { number(link, bad)(random, poses, 0); });
  check_rest(Status::kBadRestPose, [](Random&, Poses& poses, PoseView&) {
    for (std::uint32_t link = 0; link < poses.link_count; ++link)
      std::fill_n(poses.pose(0, link), poses.floats_per_pose(), 0.0f);
  });
}

void check_rest_layout() {
  check_rest(Status::kBadRestPose, [](Random&, Poses&, PoseView& view) { view.format = static_cast<PoseFormat>(3); });
  for (const std::size_t stride : {std::size_t{1}, std::size_t{24}, std::size_t{66}, std::size_t{1} << 33})
    check_rest(Status::kBadRestPose, [&](Random&, Poses&, PoseView& view) { view.link_stride = stride; });
  check_rest(Status::kBadRestPose, [](Random&, Poses&, PoseView& view) { view.instance_stride = 28; });
}

void check_rest_unread() {
  for (const float bad : {kNan, kInfinity})
    check_rest(Status::kOk, [&](Random&, Poses& poses, PoseView&) {
      std::fill_n(poses.pose(0, kUnneeded), poses.floats_per_pose(), bad);
    });
  check_rest(Status::kOk, [](Random&, Poses&, PoseView& view) { view = {static_cast<PoseFormat>(9), nullptr, 1, 1}; });
}

void check_many_hops() {
  Random random(11);
  Rig rig = contract_rig(random);
  for (Leaf& leaf : rig.leaves) std::fill_n(leaf.box.center, 3, 0.0f);
  Poses poses = random_poses(random, rig, 1, PoseFormat::kQuaternionTranslation, {});
  for (std::uint32_t link = 0; link < rig.link_count(); ++link)
    std::copy_n(poses.pose(0, 0), poses.floats_per_pose(), poses.pose(0, link));  // every leaf in one place
  World world;
  world.members.push_back({rig, poses, BatchKind::kCharacters});
  world.rules = {{{1}, {1}, Pairing::kWithin}};
  CHECK(run_world(world).hits.size() == 3);
  for (const std::uint32_t hops : {3u, 65536u, 0xffffffffu}) {
    ArticulationDesc desc = rig.desc();
    desc.ignored_hops = hops;
    const EnginePtr engine = make_engine();
    ArticulationId id;
    REQUIRE(add_articulation(*engine, desc, &id) == Status::kOk);
    add_instances(*engine, id, 1);
    CHECK(run_on(*engine, world, {}).hits.empty());
  }
}

void check_ignored_short() {
  Call call;
  ArticulationInfo info;
  REQUIRE(articulation_info(*call.engine, {1}, &info) == Status::kOk);
  REQUIRE(info.ignored_pair_count > 0);
  std::vector<IgnoredPair> pairs(info.ignored_pair_count);
  CHECK(ignored_pairs(*call.engine, {1}, {pairs.data(), pairs.size() - 1}) == Status::kBadOutput);
  CHECK(ignored_pairs(*call.engine, {1}, pairs) == Status::kOk);
}

void check_bad_layers() {
  std::uint32_t words[20] = {};
  for (const auto layers : {&BatchInput::layers, &BatchInput::layer_masks})
    for (const Span<const std::uint32_t> bad : {Span<const std::uint32_t>{words, 18}, {words, 20}, {nullptr, 19}}) {
      Call call;
      call.input.*layers = bad;
      CHECK(run_frame(*call.engine, call.job) == Status::kBadLayers);
      CHECK(call.job.hit_count == 0);
    }
}

void check_bad_scales() {
  const std::vector<float> ones(20, 1.0f);
  for (const Span<const float> bad : {Span<const float>{ones.data(), 18}, {ones.data(), 20}, {nullptr, 19}}) {
    Call call;
    call.input.scales = bad;
    CHECK(run_frame(*call.engine, call.job) == Status::kBadScales);
    CHECK(call.job.hit_count == 0);
  }
  Call call;
  call.input.scales = {ones.data(), 19};
  CHECK(run_frame(*call.engine, call.job) == Status::kOk);
  call.input.poses.format = PoseFormat::kMatrix3x4Rows;
  call.input.poses.has_scale = true;
  CHECK(run_frame(*call.engine, call.job) == Status::kBadScales);
}

void check_scaled_quaternions() {
  Call call;
  call.input.poses.format = PoseFormat::kQuaternionTranslation;
  call.input.poses.has_scale = true;
  CHECK(run_frame(*call.engine, call.job) == Status::kBadPoses);
}

void check_scaled_matrices() {
  for (const PoseFormat format : {PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns})
    for (const bool mirrored : {false, true}) {
      Random random(mirrored ? 8 : 9);
      World world;
      Member member;
      member.rig = contract_rig(random);
      member.poses = random_poses(random, member.rig, 18, format, {0.4, random.chance(0.5), true, {}});
      member.poses.has_scale = true;
      for (std::uint32_t i = 0; i < 18; ++i)
        for (std::uint32_t link = 0; link < member.poses.link_count; ++link) {
          scale_matrix(format, static_cast<float>(random.log_uniform(1.001e-3, 999)), member.poses.pose(i, link));
          for (std::size_t c = 0; c < 3 && mirrored; ++c)
            entry(member.poses.pose(i, link), format, c, 1) = -entry(member.poses.pose(i, link), format, c, 1);
        }
      world.members.push_back(member);
      world.rules = {{{1}, {1}, Pairing::kBetween}};
      for (const Isa isa : available_isas()) {
        EngineDesc desc;
        desc.isa = isa;
        const EnginePtr engine = make_engine_for(world, desc);
        for (const Policies& policies : {kCabTree, kHullTree, kObbLeaves}) {
          const std::vector<Box> boxes = boxes_of(*engine, world, 1, policies);
          for (std::uint32_t i = 0; i < 18; ++i) CHECK(leaves_hold(world, i, boxes));
        }
        const Outcome outcome = run_on(*engine, world, {});
        CHECK(outcome.stats.instances_masked == 0);
        CHECK(missing_from(judge_world(world), outcome.hits) == 0);
      }
    }
}

void check_bad_count() {
  Call call;
  call.input.count = 20;
  CHECK(run_frame(*call.engine, call.job) == Status::kBadCount);
  call.input.count = 19;
  CHECK(run_frame(*call.engine, call.job) == Status::kOk);
}

void check_no_layers() {
  for (const auto layers : {&BatchInput::layers, &BatchInput::layer_masks}) {
    Call call;
    std::vector<std::uint32_t> words(19, ~0u);
    words[7] = 0;
    REQUIRE(run_frame(*call.engine, call.job) == Status::kOk);
    std::vector<Hit> expected;
    for (const Hit& hit : Span<Hit>{call.hits.data(), call.job.hit_count})
      if (hit.instance_a == hit.instance_b || (hit.instance_a != 7 && hit.instance_b != 7)) expected.push_back(hit);
    CHECK(expected.size() < call.job.hit_count);
    CHECK(std::any_of(expected.begin(), expected.end(), [](const Hit& hit) { return hit.instance_a == 7; }));
    call.input.*layers = {words.data(), 19};
    REQUIRE(run_frame(*call.engine, call.job) == Status::kOk);
    call.hits.resize(call.job.hit_count);
    CHECK(same_hits(call.hits, expected));
  }
}

void check_bad_margin() {
  for (const float bad : {-1e-45f, -1.0f, 1.0001e18f, kInfinity, kNan}) {
    Call call;
    call.job.margin = bad;
    CHECK(run_frame(*call.engine, call.job) == Status::kBadMargin);
    CHECK(call.job.hit_count == 0);
  }
}

void check_margins() {
  World world = grid_world(0);
  const std::vector<Hit> touching = run_world(world).hits;
  for (const float margin : {-0.0f, 1e-45f, 1e-30f, 1e6f, 9e17f}) {
    CAPTURE(margin);
    world.margin = margin;
    const Outcome outcome = run_world(world);
    CHECK(outcome.stats.instances_masked == 0);
    CHECK(missing_from(judge_world(world), outcome.hits) == 0);
    if (margin < 1e-20f) CHECK(same_hits(outcome.hits, touching));
  }
  world.margin = 1e18f;
  world.members[0].rig.leaves[0].box.half[0] = 9e17f;
  const Outcome outcome = run_world(world);
  CHECK(outcome.stats.instances_masked == 19);
  CHECK(outcome.hits.empty());
}

void check_bad_in_contact() {
  std::uint8_t bytes[20] = {};
  for (const Span<std::uint8_t> bad : {Span<std::uint8_t>{bytes, 18}, {bytes, 20}, {nullptr, 19}}) {
    Call call;
    call.input.in_contact = bad;
    CHECK(run_frame(*call.engine, call.job) == Status::kBadInContact);
  }
}

void check_bad_report() {
  Call call;
  call.job.report = static_cast<Report>(3);
  CHECK(run_frame(*call.engine, call.job) == Status::kBadReport);
}

void check_bad_min_depth() {
  for (const float bad : {-1e-45f, -1.0f, kInfinity, kNan}) {
    Call call;
    call.job.policies.exact = Exact::kConvex;
    call.job.min_depth = bad;
    CHECK(run_frame(*call.engine, call.job) == Status::kBadMinDepth);
  }
  Call call;
  call.job.policies.exact = Exact::kConvex;
  call.job.report = Report::kInContact;
  call.job.min_depth = 1;
  CHECK(run_frame(*call.engine, call.job) == Status::kBadMinDepth);
}

void check_depth_without_exact() {
  Call depth;
  depth.job.min_depth = 1;
  CHECK(run_frame(*depth.engine, depth.job) == Status::kContactsNeedExact);
  Call distances;
  std::vector<Contact> contacts(distances.hits.size());
  distances.job.contacts = contacts;
  distances.job.report = Report::kDistances;
  CHECK(run_frame(*distances.engine, distances.job) == Status::kContactsNeedExact);
  distances.job.policies.exact = Exact::kConvex;
  CHECK(run_frame(*distances.engine, distances.job) == Status::kOk);
}

void check_bad_pairs() {
  Call call;
  Contact contact;
  for (const Hit& pair : {Hit{{1}, 0, {1}, 0, 0, 0, 0, 0}, Hit{{1}, 0, {1}, 0, 0, 1024, 0, 0},
                          Hit{{9}, 0, {1}, 0, 0, 0, 0, 0}, Hit{{1}, 0, {1}, kMaxInstances, 0, 0, 0, 0}})
    CHECK(compute_contacts(*call.engine, call.job.inputs, {&pair, 1}, {&contact, 1}) == Status::kBadPairs);
}

void check_masked_pair() {
  Random random(11);
  Member member;
  member.rig = contract_rig(random);
  member.poses = random_poses(random, member.rig, 2, PoseFormat::kQuaternionTranslation, {});
  World world;
  world.members = {member};
  const EnginePtr engine = make_engine_for(world);
  world.members[0].poses.pose(1, 2)[4] = kNan;
  const BatchInput input = world.members[0].poses.input({1});
  const Hit pairs[] = {{{1}, 0, {1}, 1, 0, 2, 0, 0}, {{1}, 0, {1}, 1, 0, 3, 0, 0}};
  Contact contacts[2];
  REQUIRE(compute_contacts(*engine, {&input, 1}, {pairs, 2}, {contacts, 2}) == Status::kOk);
  CHECK(contacts[0].depth == -kInfinity);
  CHECK(std::isfinite(contacts[1].depth));
}

void check_in_contact_without_room() {
  Call call;
  std::uint8_t expected[19], bytes[19] = {};
  call.input.in_contact = {expected, 19};
  REQUIRE(run_frame(*call.engine, call.job) == Status::kOk);
  CHECK(std::count(expected, expected + 19, 1) > 0);
  call.job.hits = {};
  call.input.in_contact = {bytes, 19};
  CHECK(run_frame(*call.engine, call.job) == Status::kHitsOverflow);
  CHECK(std::equal(bytes, bytes + 19, expected));
  std::fill_n(bytes, 19, std::uint8_t{7});
  call.job.report = Report::kInContact;
  CHECK(run_frame(*call.engine, call.job) == Status::kOk);
  CHECK(call.job.hits_needed == 0);
  CHECK(std::equal(bytes, bytes + 19, expected));
  call.input.in_contact = {};
  CHECK(run_frame(*call.engine, call.job) == Status::kOk);
  CHECK(call.job.stats.box_tests == 0);
}

std::vector<CallRow> call_rows() {
  return {
      {{"origins far out, 1e9 m and more", "taken: boxes as at 0, hits by differences in double"}, check_far_origins},
      {{"origin that is not finite", "refused, `kBadOrigins`"}, check_bad_origins},
      {{"scales of another count than instances, or with `has_scale`", "refused, `kBadScales`"}, check_bad_scales},
      {{"`has_scale` with quaternions", "refused, `kBadPoses`"}, check_scaled_quaternions},
      {{"matrices times 1e-3 to 1e3, with `has_scale`", "taken: lengths of the link are multiplied"},
       check_scaled_matrices},
      {{"count above the batch's", "refused, `kBadCount`"}, check_bad_count},
      {{"layers or layer masks of another count than instances", "refused, `kBadLayers`"}, check_bad_layers},
      {{"layer 0, or layer mask 0", "in no pair with others; its own links are paired"}, check_no_layers},
      {{"margin negative, above 1e18, infinite or NaN", "refused, `kBadMargin`"}, check_bad_margin},
      {{"min_depth negative, infinite or NaN, or above 0 with `kInContact`", "refused, `kBadMinDepth`"},
       check_bad_min_depth},
      {{"min_depth above 0, or `kDistances`, without an exact test", "refused, `kContactsNeedExact`"},
       check_depth_without_exact},
      {{"pair of `compute_contacts` that is no two links with leaves", "refused, `kBadPairs`"}, check_bad_pairs},
      {{"pair of `compute_contacts` with a pose that a frame would mask", "taken, depth minus infinity"},
       check_masked_pair},
      {{"margin to 1e18", "taken; instances whose grown boxes leave the range are masked"}, check_margins},
      {{"in_contact of another count than instances", "refused, `kBadInContact`"}, check_bad_in_contact},
      {{"report that is not a value of `Report`", "refused, `kBadReport`"}, check_bad_report},
      {{"in_contact, and no room for hits", "complete: with `kInContact` `kOk`, with `kHits` `kHitsOverflow`"},
       check_in_contact_without_room},
      {{"frame without inputs or without rules", "`kOk`, no hits"}, check_empty_frames},
      {{"rule for a batch without input", "refused, `kBadPairRule`"}, check_rule_without_input},
      {{"batch of no instances", "refused, `kNoInstances`"}, check_empty_batch},
      {{"room for one hit too few, or for none", "`kHitsOverflow`, `hits_needed` is exact, nothing beyond is written"},
       check_one_short},
      {{"room for one box too few", "refused, `kBadOutput`"}, check_boxes_short},
      {{"room for one instance too few in `spatial_order`", "refused, `kBadOutput`"}, check_order_short},
      {{"vertices of `fit_box`: none, part of one, not finite or above 1e18", "refused, `kBadVertices`"},
       check_vertices},
      {{"rest pose with numbers that a frame would mask", "refused, `kBadRestPose`"}, check_rest_numbers},
      {{"rest pose of no known format, or badly strided", "refused, `kBadRestPose`"}, check_rest_layout},
      {{"rest pose without data, or bad where a frame would not read it", "taken"}, check_rest_unread},
      {{"`ignored_hops` as large as the longest way, or larger", "taken; no pair within an instance"}, check_many_hops},
      {{"room for one ignored pair too few", "refused, `kBadOutput`"}, check_ignored_short},
  };
}

}  // namespace

TEST_CASE("every row of the input table about calls has its answer") {
  for (const CallRow& row : call_rows()) {
    CAPTURE(row.row.input);
    row.check();
  }
}

// ------------------------------------------------------------------------------------------------ the document

TEST_CASE("the table of inputs in docs/embedding.md has the rows that are tested, and no other") {
  std::set<std::string> tested, written;
  const auto add = [&](const Row& row) { tested.insert("| " + row.input + " | " + row.answer + " |"); };
  for (const PoseRow& row : pose_rows()) add(row.row);
  for (const RigRow& row : rig_rows()) add(row.row);
  for (const CallRow& row : call_rows()) add(row.row);
  std::ifstream file(CAB_DOCS "/embedding.md");
  REQUIRE(file.good());
  bool in_table = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("## ", 0) == 0) in_table = line == "## Bad and extreme input";
    if (in_table && line.rfind("| ", 0) == 0 && line != "| input | answer |") written.insert(line);
  }
  for (const std::string& row : tested) CHECK_MESSAGE(written.count(row) == 1, "tested and not written: " << row);
  for (const std::string& row : written) CHECK_MESSAGE(tested.count(row) == 1, "written and not tested: " << row);
}
