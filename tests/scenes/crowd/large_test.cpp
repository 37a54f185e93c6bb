// Large characters: the boxes and places of detailed rigs and ropes, and that every strategy finds the links that the
// judge finds.
#include "perf/base/crowd_session.h"
#include "perf/harness/world.h"
#include "scenes/crowd/detailed.h"
#include "scenes/crowd/humanoid.h"
#include "scenes/crowd/ropes.h"
#include "scenes/random.h"
#include "scenes/scene_list.h"
#include "tests/scenes/crowd/made_crowds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab::tests {
namespace {

using perf::CrowdSession;
using scenes::BodyLeaf;
using scenes::Character;
using scenes::Crowd;
using scenes::PosedGroup;
using scenes::RopeOptions;
using scenes::RopeShape;
using scenes::operator-;
using scenes::operator+;
using scenes::operator*;
using scenes::Vec3;

Crowd detailed_crowd(std::uint32_t count, std::uint32_t boxes_per_link) {
  scenes::CrowdSources sources;
  sources.boxes_per_link = boxes_per_link;
  return scenes::make_crowd("detailed", count, sources);
}

Crowd rope_crowd(std::uint32_t count, const RopeOptions& options) {
  scenes::CrowdSources sources;
  sources.ropes = options;
  return scenes::make_crowd("ropes", count, sources);
}

std::vector<Hit> hits_of(const Crowd& crowd, const std::vector<PosedGroup>& posed, Strategy strategy,
                         Isa isa = Isa::kAuto, std::uint32_t threads = 1) {
  CrowdSession session(crowd, isa, threads);
  Policies policies;
  policies.strategy = strategy;
  CHECK(session.run(posed, policies).instances_masked == 0);
  return {session.hits().data, session.hits().data + session.hits().size};
}

// The crowd in the form that the judge reads.
oracle::World judged_world(const Crowd& crowd, const std::vector<PosedGroup>& posed) {
  oracle::World world;
  for (std::size_t g = 0; g < posed.size(); ++g) {
    oracle::Member member;
    for (const BodyLeaf& leaf : crowd.groups[g].figure.leaves) member.rig.leaves.push_back({leaf.link, leaf.box, {}});
    member.rig.parents = crowd.groups[g].figure.link_parents;
    member.poses.link_count = member.rig.link_count();
    member.poses.instance_count = crowd.groups[g].count;
    member.poses.data = posed[g].poses;
    member.poses.origins = posed[g].origins;
    world.members.push_back(member);
    const auto id = static_cast<std::uint32_t>(g + 1);
    world.rules.push_back({{id}, {id}, Pairing::kBetween});
  }
  return world;
}

// Checks that the hits of every strategy are those of brute force. Brute force must find all links that touch, and none
// that stay apart when they are widened by more than padding and slack. Returns how many touch.
std::size_t check_against_judge(const Crowd& crowd, double seconds) {
  constexpr double kPaddingAndSlack = 0x1p-14;
  const std::vector<PosedGroup> posed = posed_at(crowd, seconds);
  const oracle::World world = judged_world(crowd, posed);
  const auto nobody = [](std::size_t, std::uint32_t) { return false; };
  const std::vector<Hit> touching = oracle::judge_world(world, 0, nobody);
  const std::vector<Hit> brute = hits_of(crowd, posed, Strategy::kBrute);
  CHECK(oracle::missing_from(touching, brute) == 0);
  CHECK(oracle::missing_from(brute, oracle::judge_world(world, kPaddingAndSlack, nobody)) == 0);
  for (std::uint32_t s = 0; s < policy_table()[1].value_count; ++s) {
    CAPTURE(std::string(policy_table()[1].values[s].name));
    CHECK(oracle::same_hits(hits_of(crowd, posed, static_cast<Strategy>(s)), brute));
  }
  for (const Isa isa : oracle::available_isas())
    CHECK(oracle::same_hits(hits_of(crowd, posed, Strategy::kAuto, isa, 2), brute));
  return touching.size();
}

Vec3 vec3(const float* v) { return {v[0], v[1], v[2]}; }

// A point of the link in the frame of a box, in shares of the half extents of the box.
Vec3 in_box(const Box& box, const Vec3& point) {
  Vec3 share;
  for (std::size_t k = 0; k < 3; ++k)
    share[k] = scenes::dot(point - vec3(box.center), vec3(box.axis[k])) / static_cast<double>(box.half[k]);
  return share;
}
bool is_inside(const Vec3& share) {
  return std::all_of(share.begin(), share.end(), [](double s) { return std::abs(s) <= 1; });
}

}  // namespace

TEST_CASE(
    "a detailed humanoid has as many boxes on each link as asked for, inside the link's own box, which they fill") {
  const Character plain = scenes::make_humanoid();
  for (const std::uint32_t count : scenes::kBoxesPerLink) {
    CAPTURE(count);
    const Character detailed = scenes::with_detail(plain, count);
    CHECK(detailed.link_parents == plain.link_parents);
    REQUIRE(detailed.leaves.size() == std::size_t{scenes::kHumanoidLinks} * count);
    double least = 1, most = 0;
    for (std::uint32_t l = 0; l < scenes::kHumanoidLinks; ++l) {
      const Box& whole = plain.leaves[l].box;
      const auto first = detailed.leaves.begin() + l * count;
      for (auto leaf = first; leaf != first + count; ++leaf) {
        CHECK(leaf->link == l);
        CHECK(leaf->parts.empty());
        for (int corner = 0; corner < 8; ++corner) {
          Vec3 at = vec3(leaf->box.center);
          for (std::size_t k = 0; k < 3; ++k) {
            const double way = corner >> k & 1 ? 1 : -1;
            at = at + way * static_cast<double>(leaf->box.half[k]) * vec3(leaf->box.axis[k]);
          }
          CHECK(is_inside(in_box(whole, at)));
        }
      }
      // The volume by points that are drawn in the link's box.
      scenes::Random random(l + 1);
      constexpr int kPoints = 2000;
      int filled = 0;
      for (int p = 0; p < kPoints; ++p) {
        Vec3 point = vec3(whole.center);
        for (std::size_t k = 0; k < 3; ++k) point[k] += random.uniform(-1, 1) * static_cast<double>(whole.half[k]);
        filled +=
            std::any_of(first, first + count, [&](const BodyLeaf& leaf) { return is_inside(in_box(leaf.box, point)); });
      }
      least = std::min(least, 1.0 * filled / kPoints);
      most = std::max(most, 1.0 * filled / kPoints);
    }
    // A barrel fills .8 of its box. Measured: .67 to .95.
    CHECK(least > .6);
    CHECK((count == 1 || most < .97));
  }
}

TEST_CASE("a detailed crowd stands where a uniform crowd does, and with one box per link it is the uniform crowd") {
  const std::vector<PosedGroup> uniform = posed_at(scenes::make_crowd("uniform", 100), .3);
  CHECK(pose_hash(posed_at(detailed_crowd(100, 16), .3)) == pose_hash(uniform));
  CHECK(oracle::same_hits(hits_of(detailed_crowd(100, 1), uniform, Strategy::kAuto),
                          hits_of(scenes::make_crowd("uniform", 100), uniform, Strategy::kAuto)));
}

TEST_CASE("every strategy finds the links of detailed humanoids that the judge finds") {
  CHECK(check_against_judge(detailed_crowd(30, 4), 0) > 60);
  CHECK(check_against_judge(detailed_crowd(12, 16), .1) > 10);
  CHECK(check_against_judge(detailed_crowd(3, 64), 0) > 0);
}

TEST_CASE("the links of a rope hold together, and their joints keep the distance of their shape from the line") {
  const scenes::Quat way =
      scenes::multiply({0, 0, std::sin(.55), std::cos(.55)}, {0, std::sin(-.25), 0, std::cos(.25)});
  for (std::size_t s = 0; s < scenes::kRopeShapeNames.size(); ++s) {
    CAPTURE(std::string(scenes::kRopeShapeNames[s]));
    RopeOptions options;
    options.link_count = 200;
    options.shape = static_cast<RopeShape>(s);
    const double reach = std::array<double, 4>{0, .148, .24, .03}[s];
    const Crowd crowd = rope_crowd(5, options);
    CHECK(crowd.groups[0].figure.link_parents.size() == 200);
    CHECK(crowd.groups[0].figure.leaves.size() == 200);
    for (const double seconds : {0.0, 1.7}) {
      const std::vector<PosedGroup> posed = posed_at(crowd, seconds);
      double worst = 0, farthest = 0;
      for (std::size_t i = 0; i < 5; ++i)
        for (std::size_t l = 0; l < 200; ++l) {
          const float* const pose = posed[0].poses.data() + (i * 200 + l) * 7;
          const Vec3 joint = vec3(pose + 4);
          const Vec3 line = scenes::rotate(scenes::conjugate(way), joint);
          farthest = std::max(farthest, std::hypot(line[1], line[2]));
          if (l == 199) continue;
          const Vec3 end =
              joint + scenes::rotate({pose[0], pose[1], pose[2], pose[3]}, {scenes::kRopeLinkLength, 0, 0});
          worst = std::max(worst, scenes::length(vec3(pose + 7 + 4) - end));
        }
      CHECK(worst < 3e-6);  // worst measured 1.4e-6 m, of 20 m in float
      CHECK(farthest <= reach + 3e-6);
      CHECK(farthest >= .98 * reach);
    }
    CHECK(pose_hash(posed_at(crowd, .5)) == pose_hash(posed_at(rope_crowd(5, options), .5)));
    CHECK(pose_hash(posed_at(crowd, .5)) != pose_hash(posed_at(crowd, .6)));
  }
}

TEST_CASE(
    "every strategy finds the links of ropes that the judge finds, and neighbours touch where they are spaced "
    "closely") {
  for (std::size_t s = 0; s < scenes::kRopeShapeNames.size(); ++s) {
    CAPTURE(std::string(scenes::kRopeShapeNames[s]));
    RopeOptions options;
    options.link_count = 64;
    options.shape = static_cast<RopeShape>(s);
    options.spacing = .2;
    CHECK(check_against_judge(rope_crowd(16, options), 0) > 0);
    options.spacing = 3;
    CHECK(check_against_judge(rope_crowd(16, options), 0) == 0);
    options.link_count = 2;
    check_against_judge(rope_crowd(2, options), 0);
  }
}

TEST_CASE("large characters that cannot be made are refused") {
  CHECK_THROWS_AS(detailed_crowd(10, 0), std::invalid_argument);
  CHECK_THROWS_AS(detailed_crowd(10, 3), std::invalid_argument);
  CHECK_THROWS_AS(detailed_crowd(10, 128), std::invalid_argument);
  CHECK_THROWS_AS(scenes::with_detail(scenes::make_rope(17), 64), std::invalid_argument);
  for (const double spacing : {0.0, -1.0, 11.0, std::nan("")})
    CHECK_THROWS_AS(rope_crowd(3, {64, RopeShape::kStraight, spacing}), std::invalid_argument);
  for (const std::uint32_t links : {0u, 1u, 1025u})
    CHECK_THROWS_AS(rope_crowd(3, {links, RopeShape::kStraight, 1}), std::invalid_argument);
}

}  // namespace cab::tests
