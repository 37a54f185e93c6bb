// Strategy links: the hits of brute, byte for byte, for all articulations, poses and options of a frame.
#include "engine/session/engine.h"
#include "kernels/overlap_sat.h"
#include "perf/harness/random_world.h"
#include "tests/engine/small_store.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;

// How much wider than exact the boxes of a reported pair may have to be made to touch, as in frame_test.
constexpr double kInvented = 1e-4;

constexpr Policies kLinks = {Refit::kCab, Strategy::kLinks}, kRows = {Refit::kCab, Strategy::kRows},
                   kBrute = {Refit::kCab, Strategy::kBrute}, kTree = {Refit::kCab, Strategy::kTree};

using V3 = oracle::Vec3<double>;

// One to three batches. In most rigs links have several leaves, in any order, and some links have no leaf. In some rigs
// each link has one leaf.
World detailed_world(Random& random, unsigned most_links, unsigned most_leaves) {
  World world;
  const bool far = random.chance(0.4);
  const V3 about = (far ? random.log_uniform(1e6, 1e9) : 0) * random.unit_vector();
  const double spread = random.uniform(0.2, 1);
  const std::uint32_t count = 1 + random.index(3);
  for (std::uint32_t m = 0; m < count; ++m) {
    Member member;
    const auto links = static_cast<unsigned>(random.log_uniform(1, most_links + 0.999));
    member.rig = random_rig(random, static_cast<Topology>(random.index(kTopologyCount)), links,
                            random.chance(0.2) ? 1 : 1 + random.index(most_leaves));
    member.poses = random_poses(random, member.rig, kInstanceCounts[random.index(6)],
                                static_cast<PoseFormat>(random.index(3)), any_pose_range(random, far, about, spread));
    world.members.push_back(member);
  }
  pair_all(world, 1, count);
  return world;
}

void check_same(const Outcome& got, const Outcome& expected) {
  CHECK(same_hits(got.hits, expected.hits));
  CHECK(got.stats.leaf_pairs >= got.hits.size());
  CHECK(got.in_contact == expected.in_contact);
  CHECK(got.flags == expected.flags);
  CHECK(got.stats.instances_masked == expected.stats.instances_masked);
}

// The world with every length times `by`, a power of two: only numbers that leave the range of float change.
World scaled(World world, double by) {
  const auto scale = [by](auto& value) {
    value = static_cast<std::decay_t<decltype(value)>>(static_cast<double>(value) * by);
  };
  for (Member& member : world.members) {
    for (float& v : member.rig.joints) scale(v);
    for (Leaf& leaf : member.rig.leaves)
      for (int c = 0; c < 3; ++c) {
        scale(leaf.box.center[c]);
        scale(leaf.box.half[c]);
      }
    const PoseFormat format = member.poses.format;
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
      for (std::uint32_t link = 0; link < member.poses.link_count; ++link)
        for (int c = 0; c < 3; ++c)
          scale(member.poses.pose(i, link)[format == PoseFormat::kQuaternionTranslation ? 4 + c
                                           : format == PoseFormat::kMatrix3x4Rows       ? 4 * c + 3
                                                                                        : 12 + c]);
    for (double& v : member.poses.origins) scale(v);
  }
  scale(world.margin);
  return world;
}

// Makes some boxes plates, lines or points.
void flatten(Random& random, World& world) {
  for (Member& member : world.members)
    for (Leaf& leaf : member.rig.leaves)
      for (float& half : leaf.box.half)
        if (random.chance(0.4)) half = 0;
}

// Two boxes that pass the leaf predicate may be this far apart, as a part of their sizes (docs/proof.md, 6.3).
constexpr Real kRho = 1.17e-3L;

// Half extents of two boxes, the rotation of the second against the first, and the direction from one to the other.
struct Setting {
  float half[2][3];
  double turn[4];
  V3 way;
};

kernel::BoxLanes<float> lanes_of(const Box& box) {
  const auto vector = [](const float* p) { return kernel::Vec3<float>{p[0], p[1], p[2]}; };
  return {vector(box.center), {vector(box.axis[0]), vector(box.axis[1]), vector(box.axis[2])}, vector(box.half)};
}

// The largest distance at which the boxes of a setting pass the leaf predicate, as a part of kRho.
Real farthest_apart(const Setting& setting) {
  double column[3][3];
  quaternion_matrix(setting.turn, column);
  // No world axis points from box to box: along one, the bounds would separate them.
  Random random(5);
  double about[3][3];
  random.rotation(about);
  const auto rotated = [&about](const V3& p) {
    return p[0] * to_vec3(about[0]) + p[1] * to_vec3(about[1]) + p[2] * to_vec3(about[2]);
  };
  Box box[2] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    store(oracle::convert<float>(to_vec3(about[k])), box[0].axis[k]);
    store(oracle::convert<float>(rotated(to_vec3(column[k]))), box[1].axis[k]);
    for (std::size_t b = 0; b < 2; ++b) box[b].half[k] = setting.half[b][k];
  }
  const V3 way = rotated(setting.way);
  double lo = 0, hi = 8;
  for (int halving = 0; halving < 30; ++halving) {
    const double middle = 0.5 * (lo + hi);
    const kernel::Vec3<float> between = {static_cast<float>(middle * way[0]), static_cast<float>(middle * way[1]),
                                         static_cast<float>(middle * way[2])};
    const kernel::BoxLanes<float> a = lanes_of(box[0]), b = lanes_of(box[1]);
    (kernel::separated<Sat::kAll15>(a, b, between) || kernel::separated_in_world(a, b, between) ? hi : lo) = middle;
  }
  ExactBox exact[2];
  for (std::size_t b = 0; b < 2; ++b)
    for (std::size_t k = 0; k < 3; ++k) {
      exact[b].center[k] = 0;
      exact[b].half[k] = box[b].half[k];
      for (std::size_t c = 0; c < 3; ++c) exact[b].axis[k][c] = box[b].axis[k][c];
    }
  Point between;
  for (std::size_t c = 0; c < 3; ++c) between[c] = static_cast<float>(lo * way[c]);
  return box_distance(exact[0], exact[1], between) / (kRho * (half_sum(exact[0]) + half_sum(exact[1])));
}

// Two characters of one link each, with given poses and origins.
World two_characters(const Rig& rig, const std::vector<float>& pose_a, const std::vector<float>& pose_b,
                     const V3& origin_b) {
  World world;
  for (int m = 0; m < 2; ++m) {
    Poses poses;
    poses.link_count = poses.instance_count = 1;
    poses.data = m ? pose_b : pose_a;
    poses.origins = {0, 0, 0};
    if (m) poses.origins = {origin_b[0], origin_b[1], origin_b[2]};
    world.members.push_back({rig, poses});
  }
  world.rules = {{{1}, {2}}};
  return world;
}

// Columns of a rotation and a translation as a pose of PoseFormat::kMatrix3x4Rows.
std::vector<float> matrix_pose(const double (&column)[3][3], const V3& at) {
  std::vector<float> out;
  for (std::size_t r = 0; r < 3; ++r) {
    for (const auto& k : column) out.push_back(static_cast<float>(k[r]));
    out.push_back(static_cast<float>(at[r]));
  }
  return out;
}

// The same worlds, some with layers and some with a margin.
World layered_world(Random& random, unsigned most_links, unsigned most_leaves) {
  World world = detailed_world(random, most_links, most_leaves);
  if (random.chance(0.3)) add_layers(random, world);
  if (random.chance(0.3)) world.margin = static_cast<float>(random.log_uniform(1e-4, 0.3));
  return world;
}

}  // namespace

TEST_CASE("edges that are nearly parallel: a pair within the leaf predicate's slack is not lost between links") {
  // Two rods stand edge against edge, one leaning by a small angle. The cross product of the edges is as small as the
  // angle, but the slack of an axis does not shrink with it. So the predicate passes rods that are apart by far more
  // than rounding. The second box of each link touches nothing. It makes the link's box align with the link's own axes,
  // one of which separates the rods.
  Random random(80);
  std::size_t hits = 0;
  for (const double thick : {0.01, 0.05}) {
    const auto side = static_cast<float>(std::sqrt(0.5));
    Rig rig;
    rig.parents = {-1};
    rig.leaves = {{0,
                   {{0, 0, 0},
                    {{side, side, 0}, {-side, side, 0}, {0, 0, 1}},
                    {static_cast<float>(thick), static_cast<float>(thick), 1}},
                   {}},
                  {0, {{-1, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.9f, 0.5f, 0.5f}}, {}}};
    const double edge = std::sqrt(2.0) * thick;
    for (double angle = 0x1p-12; angle < 0x1p-6; angle *= 1.25) {
      for (const double gap : {1e-4, 3e-4, 6e-4, 8e-4, 9e-4, 3e-3, 4e-3, 6e-3}) {
        CAPTURE(angle);
        CAPTURE(gap);
        const double leaning[3][3] = {
            {-1, 0, 0}, {0, -std::cos(angle), std::sin(angle)}, {0, std::sin(angle), std::cos(angle)}};
        double about[3][3];  // no world axis points from edge to edge: it would separate the rods
        random.rotation(about);
        const auto rotated = [&about](const V3& p) {
          return p[0] * to_vec3(about[0]) + p[1] * to_vec3(about[1]) + p[2] * to_vec3(about[2]);
        };
        double here[3][3], there[3][3];
        for (std::size_t k = 0; k < 3; ++k) {
          store(rotated(V3{{k == 0 ? 1. : 0., k == 1 ? 1. : 0., k == 2 ? 1. : 0.}}), here[k]);
          store(rotated(to_vec3(leaning[k])), there[k]);
        }
        World world =
            two_characters(rig, matrix_pose(here, {}), matrix_pose(there, {}), rotated({{2 * edge + gap, 0, 0}}));
        for (Member& member : world.members) member.poses.format = PoseFormat::kMatrix3x4Rows;
        for (const float length : {0.0f, 1.0f, 32.0f}) {
          // With one leaf, the second character has strategy rows. Its rod is not in a grown link box then.
          CAPTURE(length);
          Rig& second = world.members[1].rig;
          second.leaves.resize(length > 0 ? 1 : 2);
          if (length > 0) second.leaves[0].box.half[2] = length;
          const Outcome brute = run_world(world, kBrute);
          check_same(run_world(world, kLinks), brute);
          hits += brute.hits.size();
        }
      }
    }
  }
  CHECK(hits > 50);
}

TEST_CASE(
    "boxes that pass the leaf predicate are no farther apart than derived, edges that are nearly parallel included") {
  Real worst = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    Random random(seed);
    Setting best;
    const auto draw = [&random](Setting& out) {
      for (auto& half : out.half)
        for (float& h : half) h = static_cast<float>(random.log_uniform(1e-3, 1));
      // An edge of one box leans a little against an edge of the other, with any rotation about it.
      double lean[4], spin[4];
      quaternion_about({{0, 0, 1}}, random.uniform(-3, 3), spin);
      quaternion_about(random.unit_vector(), random.log_uniform(1e-5, 1), lean);
      const V3 u = {{spin[0], spin[1], spin[2]}}, v = {{lean[0], lean[1], lean[2]}};
      const V3 w = spin[3] * v + lean[3] * u + oracle::cross(v, u);
      for (std::size_t c = 0; c < 3; ++c) out.turn[c] = w[c];
      out.turn[3] = spin[3] * lean[3] - oracle::dot(u, v);
      const V3 out_of_plane = {{0, 0, random.chance(0.5) ? 0 : random.normal()}};
      const double angle = random.uniform(-3.15, 3.15);
      out.way = normalized(V3{{std::cos(angle), std::sin(angle), 0}} + 0.1 * out_of_plane);
    };
    draw(best);
    const bool rods = seed % 2 == 0;  // the climb starts from equal rods, edge against edge, leaning by 1e-3
    if (rods) {
      for (auto& half : best.half) half[0] = half[1] = 0.01f, half[2] = 1;
      best.way = normalized(V3{{1, 1, 0}});
      quaternion_about(best.way, 1e-3, best.turn);
    }
    Real most = farthest_apart(best);
    for (int step = 0; step < 1000; ++step) {
      Setting next = best;
      if (step < 200 && !rods) {
        draw(next);
      } else {
        const double by = random.log_uniform(1e-5, 0.3);
        const auto nudge = [&](auto& number) {
          number =
              static_cast<std::decay_t<decltype(number)>>(static_cast<double>(number) * (1 + by * random.normal()));
        };
        for (auto& half : next.half)
          for (float& h : half) {
            if (random.chance(0.4)) nudge(h);
            h = std::clamp(h, 1e-4f, 1.0f);
          }
        for (double& q : next.turn)
          if (random.chance(0.4)) nudge(q);
        next.way = normalized(next.way + by * random.normal() * random.unit_vector());
      }
      const Real apart = farthest_apart(next);
      if (apart < most) continue;
      most = apart;
      best = next;
    }
    worst = std::max(worst, most);
  }
  MESSAGE("farthest apart: " << static_cast<double>(worst) << " of what is derived");
  CHECK(worst <= 1);
  if (rounds(40) > 1) CHECK(worst > 0.3L);  // two equal rods: 2^-11 of 1.17e-3 is 0.42
}

TEST_CASE("corners of leaves far from their origin: what padding and rounding reach along a corner is not lost") {
  // A leaf at a point: its box is only padding, rotated so that a corner points along x. Other points make the link's
  // box align with the axes. Far out only padding and the rounding of positions decide.
  std::size_t hits = 0;
  Random random(81);
  for (std::uint64_t round = 0; round < rounds(1500); ++round) {
    CAPTURE(round);
    Rig rig;
    rig.parents = {-1};
    double corner[3][3];  // its three axes have the same angle with x
    const double about = random.uniform(0, 2);
    for (std::size_t k = 0; k < 3; ++k) {
      const double angle = about + 2.0943951023931953 * static_cast<double>(k);
      corner[k][0] = std::sqrt(1.0 / 3);
      corner[k][1] = std::sqrt(2.0 / 3) * std::cos(angle);
      corner[k][2] = std::sqrt(2.0 / 3) * std::sin(angle);
    }
    Box tip = {{1, 0, 0}, {}, {0, 0, 0}};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) tip.axis[k][c] = static_cast<float>(corner[k][c]);
    tip.center[0] = static_cast<float>(random.uniform(0.4, 1));
    Box base = {{-1, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.125f, 0.125f, 0.125f}};
    rig.leaves = {{0, base, {}}, {0, tip, {}}};
    const float far = std::exp2(static_cast<float>(13 + random.index(8))) * static_cast<float>(random.uniform(1, 1.2));
    // The other is this one after half a turn about y, tip against tip.
    const std::vector<float> here = {0, 0, 0, 1, far, 0, 0}, there = {0, 1, 0, 0, far, 0, 0};
    const double ulp = 0x1p-24 * static_cast<double>(far);
    const double apart = 2 * static_cast<double>(tip.center[0]) + random.uniform(12, 15) * ulp;
    const World world = two_characters(rig, here, there, {{apart, 0, 0}});
    const Outcome brute = run_world(world, kBrute);
    check_same(run_world(world, kLinks), brute);
    hits += brute.hits.size();
  }
  CHECK(hits >= least_count(300, 1500));
  CHECK(hits < rounds(1500));
}

TEST_CASE("boxes without size: what the least padding and the least slack reach is not lost") {
  std::size_t hits = 0, asked = 0;
  const auto third = static_cast<float>(std::sqrt(1.0 / 3)), half = static_cast<float>(std::sqrt(0.5)),
             sixth = static_cast<float>(std::sqrt(1.0 / 6));
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}, {}},
                {0, {{0, 0, 0}, {{third, third, third}, {half, -half, 0}, {sixth, sixth, -2 * sixth}}, {0, 0, 0}}, {}}};
  for (double apart = 0x1p-126; apart < 0x1p-112; apart *= 1.03)
    for (const V3& direction : {V3{{1, 0, 0}}, V3{{0.57735, 0.57735, 0.57735}}, V3{{0.70711, -0.70711, 0}}}) {
      CAPTURE(apart);
      const std::vector<float> still = {0, 0, 0, 1, 0, 0, 0};
      const World world = two_characters(rig, still, still, apart * direction);
      const Outcome brute = run_world(world, kBrute);
      check_same(run_world(world, kLinks), brute);
      hits += brute.hits.size();
      ++asked;
    }
  CHECK(hits > asked / 4);
  CHECK(hits < asked);
}

TEST_CASE("links report what brute reports in every world, on every instruction set and number of threads") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world = layered_world(random, 12, 10);
    if (random.chance(0.3)) flatten(random, world);
    const Outcome brute = run_world(world, kBrute), rows = run_world(world, kRows);
    hits += brute.hits.size();
    check_same(rows, brute);
    FrameStats first;
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 3u}) {
        ThreadPool pool(threads);
        const Scheduler scheduler = pool.scheduler();
        EngineDesc desc;
        desc.isa = isa;
        if (threads > 1) desc.scheduler = &scheduler;
        const EnginePtr engine = make_engine_for(world, desc);
        for (const Refit refit : {Refit::kCab, Refit::kCovariance}) {
          const Outcome links = run_on(*engine, world, {refit, Strategy::kLinks});
          check_same(links, brute);
          if (isa == Isa::kScalar && threads == 1) first = links.stats;
          CHECK(same_counts(links.stats, first));
          CHECK(links.stats.candidates == first.candidates);
        }
        const Outcome in_contact = run_on(*engine, world, kLinks, run_frame, Report::kInContact);
        CHECK(in_contact.in_contact == brute.in_contact);
        CHECK(in_contact.hits.empty());
      }
  }
  CHECK(hits >= least_count(10'000, 40));
}

TEST_CASE("links lose no pair that touches by the judge and invent none, with layers and margins") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 101; seed <= 100 + rounds(25); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world = layered_world(random, 4, 6);
    const Outcome links = run_world(world, kLinks);
    CHECK(missing_from(judge_world(world), links.hits) == 0);
    CHECK(missing_from(links.hits, judge_widened(world, kInvented)) == 0);
    hits += links.hits.size();
  }
  CHECK(hits >= least_count(2000, 25));
}

TEST_CASE("links confirmed by fcl are those that brute confirms, in_contact ones too") {
  if (!build_info().fcl) {
    MESSAGE("skipped: this build lacks FCL");
    return;
  }
  std::size_t hits = 0, false_positives = 0;
  for (std::uint64_t seed = 201; seed <= 212; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world = detailed_world(random, 5, 4);
    std::vector<std::vector<ConvexPart>> parts;  // every other box has an ellipsoid in it
    for (Member& member : world.members) {
      parts.emplace_back(member.rig.leaves.size());
      for (std::size_t l = 0; l < member.rig.leaves.size(); l += 2) {
        const Box& box = member.rig.leaves[l].box;
        ConvexPart& part = parts.back()[l];
        part.kind = ShapeKind::kEllipsoid;
        for (int c = 0; c < 3; ++c) {
          part.position[c] = box.center[c];
          part.size[c] = 0.5f * std::min({box.half[0], box.half[1], box.half[2]});
        }
        member.rig.leaves[l].parts = {&part, 1};
      }
    }
    if (random.chance(0.3)) world.margin = static_cast<float>(random.log_uniform(1e-4, 0.3));
    const Outcome brute = run_world(world, {Refit::kCab, Strategy::kBrute, Exact::kFcl});
    const Policies policies = {Refit::kCab, Strategy::kLinks, Exact::kFcl};
    const Outcome links = run_world(world, policies);
    check_same(links, brute);
    CHECK(links.stats.leaf_pairs == brute.stats.leaf_pairs);
    CHECK(links.stats.exact_tests == brute.stats.exact_tests);
    CHECK(links.stats.false_positives == brute.stats.false_positives);
    CHECK(run_on(*make_engine_for(world), world, policies, run_frame, Report::kInContact).in_contact ==
          brute.in_contact);
    hits += brute.hits.size();
    false_positives += brute.stats.false_positives;
  }
  CHECK(hits > 500);
  CHECK(false_positives > 100);
}

TEST_CASE("worlds of 1e-30 to 1e18, flat ones too: the same hits, and the same instances masked") {
  std::size_t hits = 0, masked = 0, unmasked_at_limit = 0;
  for (std::uint64_t seed = 301; seed <= 300 + rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world = detailed_world(random, 6, 6);
    if (random.chance(0.5)) flatten(random, world);
    if (random.chance(0.3)) world.margin = static_cast<float>(random.log_uniform(1e-4, 0.5));
    for (const int power : {-120, -100, -60, 30, 55, 58, 59, 60, 61}) {
      CAPTURE(power);
      const World large = scaled(world, std::ldexp(1.0, power));
      EnginePtr engine;
      try {
        engine = make_engine_for(large);
      } catch (const std::runtime_error&) {
        CHECK(power >= 60);  // a box or a joint leaves the range
        continue;
      }
      const Outcome brute = run_on(*engine, large, kBrute), links = run_on(*engine, large, kLinks);
      check_same(links, brute);
      hits += brute.hits.size();
      masked += brute.stats.instances_masked;
      if (power >= 58)
        for (const auto& flags : brute.flags)
          unmasked_at_limit += static_cast<std::size_t>(std::count(flags.begin(), flags.end(), kInstanceOk));
      CHECK(run_on(*engine, large, kLinks, run_frame, Report::kInContact).in_contact == brute.in_contact);
    }
  }
  CHECK(hits >= least_count(10'000, 40));
  CHECK(masked >= least_count(300, 40));
  CHECK(unmasked_at_limit >= least_count(1000, 40));
}

TEST_CASE("a spoilt pose masks its instance alone, by the flag that brute gives it") {
  Random random(9);
  World world;
  world.members.push_back({random_rig(random, Topology::kTree, 6, 5), {}});
  Member& member = world.members[0];
  member.poses = random_poses(random, member.rig, 40, PoseFormat::kQuaternionTranslation, {0.5, true, true, {}});
  world.rules = {{{1}, {1}}, {{1}, {1}, Pairing::kWithin}};
  member.poses.pose(3, 2)[0] = NAN;
  member.poses.pose(11, 5)[6] = INFINITY;
  member.poses.pose(17, 0)[4] = 2e18f;
  std::fill_n(member.poses.pose(29, 1), 4, 0.0f);
  member.poses.orientations[4 * 33] = NAN;
  const Outcome brute = run_world(world, kBrute), links = run_world(world, kLinks);
  check_same(links, brute);
  CHECK(links.stats.instances_masked == 5);
  CHECK(links.flags[0][29] == kInstanceNotRigid);
  CHECK(links.hits.size() > 1000);
}

namespace {

// A character whose links have the given number of leaves each: small boxes at random places near the link's origin.
Rig strewn(Random& random, const std::vector<unsigned>& leaves, double least, double most) {
  Rig rig;
  for (unsigned link = 0; link < leaves.size(); ++link) {
    rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
    rig.parent_offset.push_back(0.1 * random.unit_vector());
    for (unsigned n = 0; n < leaves[link]; ++n)
      rig.leaves.push_back(
          {link, random_box(random, random.uniform(0.0, 0.5) * random.unit_vector(), least, most), {}});
  }
  for (std::size_t i = rig.leaves.size(); i > 1; --i)
    std::swap(rig.leaves[i - 1], rig.leaves[random.index(static_cast<unsigned>(i))]);
  return rig;
}

World crowd_of(Random& random, const Rig& rig, std::uint32_t count, double spread) {
  World world;
  world.members.push_back(
      {rig, random_poses(random, rig, count, PoseFormat::kQuaternionTranslation, {spread, true, true, {}})});
  world.rules = {{{1}, {1}}, {{1}, {1}, Pairing::kWithin}};
  return world;
}

}  // namespace

TEST_CASE(
    "links with more leaves than a worker keeps posed: the same hits, within a candidate and from one to the next") {
  // A worker keeps up to 4096 posed leaves. Those of each link fill whole tiles.
  Random random(10);
  const std::vector<unsigned> shapes[] = {
      {1020, 4}, {512, 512}, std::vector<unsigned>(300, 2), std::vector<unsigned>(64, 16)};
  for (const auto& shape : shapes) {
    CAPTURE(shape.size());
    // With these box sizes many leaf pairs pass the test of bounds, and some touch.
    const World world = crowd_of(random, strewn(random, shape, 0.002, shape.size() < 3 ? 0.02 : 0.1), 7, 0.1);
    std::size_t padded = 0;
    for (const unsigned leaves : shape) padded += (leaves + 15) / 16 * 16;
    CHECK(7 * padded > 4096);
    if (shape.size() == 300) CHECK(padded > 4096);  // within a single character
    const Outcome rows = run_world(world, kRows), links = run_world(world, kLinks);
    check_same(links, rows);
    CHECK(rows.hits.size() > (shape.size() < 3 ? 20 : 2000));
    const EnginePtr engine = make_engine_for(world);
    CHECK(run_on(*engine, world, kLinks, run_frame, Report::kInContact).in_contact == rows.in_contact);
    check_same(run_on(*engine, world, kLinks), rows);
    if (shape.size() > 2) continue;
    if (!build_info().fcl) {
      MESSAGE("skipped: this build lacks FCL");
      continue;
    }
    const Policies exact = {Refit::kCab, Strategy::kLinks,
                            Exact::kFcl};  // all touching leaf pairs are kept for the exact test
    CHECK(run_on(*engine, world, exact).stats.leaf_pairs == rows.stats.leaf_pairs);
  }
}

TEST_CASE("more hits than the store holds: links report them in order, in this frame and those after it") {
  Random random(11);
  const World world = crowd_of(random, strewn(random, std::vector<unsigned>(8, 5), 0.02, 0.2), 60, 0.4);
  const Outcome brute = run_world(world, kBrute);
  CHECK(brute.hits.size() > 60u * 30);
  for (const std::uint32_t threads : {1u, 3u}) {
    ThreadPool pool(threads);
    const Scheduler scheduler = pool.scheduler();
    EngineDesc desc;
    if (threads > 1) desc.scheduler = &scheduler;
    const EnginePtr engine = make_engine_for(world, desc);
    shrink_store(*engine);
    for (int frame = 0; frame < 3; ++frame) check_same(run_on(*engine, world, kLinks), brute);
    CHECK(has_grown(*engine));
  }
}

TEST_CASE("links count as many box tests in whatever order a worker comes to its candidates") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Rig rig = strewn(random, std::vector<unsigned>(18, 50), 0.05, 0.1);
    World world = crowd_of(random, rig, 300, 1.0);
    world.rules = {{{1}, {1}, Pairing::kBetween}};
    std::vector<double>& origins = world.members[0].poses.origins;
    for (std::size_t i = 12; i < 300; ++i) origins[3 * i] += 10 * static_cast<double>(i);
    ThreadPool pool(3);
    const Scheduler scheduler = pool.scheduler();
    EngineDesc desc;
    desc.scheduler = &scheduler;
    const Outcome alone = run_on(*make_engine_for(world), world, kLinks),
                  together = run_on(*make_engine_for(world, desc), world, kLinks);
    check_same(together, alone);
    CHECK(same_counts(together.stats, alone.stats));
    CHECK(alone.hits.size() > 1000);
  }
}

TEST_CASE("on detailed rigs links need fewer box tests than rows, and far fewer than brute") {
  Random random(12);
  Rig rig;  // each link is cut into twenty slices instead of one box
  for (unsigned link = 0; link < 12; ++link) {
    rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
    rig.parent_offset.push_back(0.4 * random.unit_vector());
    for (unsigned n = 0; n < 20; ++n) {
      Leaf leaf = {link, random_box(random, {{0.02 * n - 0.2, 0, 0}}, 0.02, 0.08), {}};
      leaf.box.half[0] = 0.02f;
      rig.leaves.push_back(leaf);
    }
  }
  const World world = crowd_of(random, rig, 24, 0.8);
  const Outcome brute = run_world(world, kBrute), rows = run_world(world, kRows), links = run_world(world, kLinks);
  check_same(links, brute);
  MESSAGE("box tests: links " << links.stats.box_tests << ", rows " << rows.stats.box_tests << ", brute "
                              << brute.stats.box_tests);
  CHECK(links.stats.box_tests < rows.stats.box_tests);
  CHECK(links.stats.box_tests * 10 < brute.stats.box_tests);
}

TEST_CASE("links are rows where no link has several leaves or boxes are axis-aligned, and tree for frames") {
  Random random(13);
  const World plain = crowd_of(random, strewn(random, std::vector<unsigned>(10, 1), 0.05, 0.3), 40, 0.6);
  CHECK(same_counts(run_world(plain, kLinks).stats, run_world(plain, kRows).stats));
  check_same(run_world(plain, kLinks), run_world(plain, kRows));
  const World detailed = crowd_of(random, strewn(random, std::vector<unsigned>(10, 4), 0.05, 0.2), 40, 0.6);
  CHECK(!same_counts(run_world(detailed, kLinks).stats, run_world(detailed, kRows).stats));
  for (const Refit refit : {Refit::kAabbHull, Refit::kAabbVertices}) {
    const Outcome rows = run_world(detailed, {refit, Strategy::kRows});
    check_same(run_world(detailed, {refit, Strategy::kLinks}), rows);
    CHECK(same_counts(run_world(detailed, {refit, Strategy::kLinks}).stats, rows.stats));
  }
  World mixed = plain;  // one batch with several leaves per link makes all take links
  mixed.members.push_back(detailed.members[0]);
  mixed.rules.clear();
  pair_all(mixed, 1, 2);
  CHECK(!same_counts(run_world(mixed, kLinks).stats, run_world(mixed, kRows).stats));
  check_same(run_world(mixed, kLinks), run_world(mixed, kBrute));

  World frames;
  for (int m = 0; m < 2; ++m) {
    frames.members.push_back(detailed.members[0]);
    frames.members.back().kind = BatchKind::kSequence;
  }
  frames.members[1].poses =
      random_poses(random, frames.members[1].rig, 40, PoseFormat::kMatrix4x4Columns, {0.6, true, true, {}});
  pair_all(frames, 1, 2);
  const Outcome tree = run_world(frames, kTree), links = run_world(frames, kLinks);
  CHECK(tree.hits.size() > 100);
  check_same(links, tree);
  CHECK(same_counts(links.stats, tree.stats));
}
