// Random worlds for all ranks: the characters of a world, who owns them, and one frame by one engine or by all ranks.
#pragma once

#include "perf/harness/random_world.h"
#include "perf/judge/oracle/random_surfaces.h"
#include "tests/layout/closed_skin.h"

#include <cab/mpi.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace cab::tests {

// A rank that owns nobody, for characters that take no part.
inline constexpr std::int32_t kNobody = -1;

struct RandomCrowd {
  oracle::World world;
  oracle::KeptParts kept;
  std::vector<std::optional<oracle::SkinRig>> skins;  // of each member, in the place of its rig; or none
  std::vector<std::vector<float>> margins;            // of each member; empty: none
  std::vector<StaticBody> bodies;                     // of a static batch behind the members; empty: none
  std::vector<std::vector<std::int32_t>> owners;      // of each member's instances
  Policies policies;
  Report report = Report::kHits;
  bool containment = true;

  ArticulationDesc desc(std::size_t member) const {
    return skins[member] ? skins[member]->desc() : world.members[member].rig.desc();
  }
  bool has_skins() const {
    return std::any_of(skins.begin(), skins.end(), [](const auto& skin) { return skin.has_value(); });
  }
};

// How characters are given to ranks.
enum class Owners : std::uint8_t { kCut, kAny, kOneRank, kSomeRanks, kNotAll };
inline constexpr std::uint32_t kOwnersCount = 5;

inline void own_all(oracle::Random& random, std::int32_t ranks, RandomCrowd& crowd) {
  const auto how = static_cast<Owners>(random.index(kOwnersCount));
  const auto count = static_cast<std::uint32_t>(ranks);
  const auto one = static_cast<std::int32_t>(random.index(count));
  std::vector<double> places;
  for (const oracle::Member& member : crowd.world.members)
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        const bool posed = member.poses.origins.empty();
        const float* const pose = member.poses.pose(i, 0);
        const std::size_t at = member.poses.format == PoseFormat::kQuaternionTranslation ? 4 + c
                               : member.poses.format == PoseFormat::kMatrix3x4Rows       ? 4 * c + 3
                                                                                         : 12 + c;
        const double place = posed ? static_cast<double>(pose[at]) : member.poses.origins[3 * std::size_t{i} + c];
        places.push_back(std::isfinite(place) ? place : 0);
      }
  std::vector<std::int32_t> cut(places.size() / 3);
  oracle::require(mpi::cut(places, ranks, cut));
  std::size_t next = 0;
  for (const oracle::Member& member : crowd.world.members) {
    std::vector<std::int32_t>& owners = crowd.owners.emplace_back();
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i, ++next) {
      const auto any = static_cast<std::int32_t>(random.index(count));
      switch (how) {
        case Owners::kCut: owners.push_back(cut[next]); break;
        case Owners::kAny: owners.push_back(any); break;
        case Owners::kOneRank: owners.push_back(one); break;
        case Owners::kSomeRanks: owners.push_back(any / 2 * 2); break;
        case Owners::kNotAll: owners.push_back(random.chance(0.3) ? kNobody : cut[next]); break;
      }
    }
  }
}

// Some characters are larger than others, and a few are giants.
inline void add_scales(oracle::Random& random, oracle::Member& member) {
  for (std::uint32_t i = 0; i < member.poses.instance_count; ++i) {
    const double scale = random.chance(0.06) ? random.uniform(10, 60) : random.uniform(0.5, 2);
    member.poses.scales.push_back(static_cast<float>(scale));
  }
}

// The same in the matrices of poses.
inline void add_pose_scales(oracle::Random& random, oracle::Member& member) {
  oracle::Poses& poses = member.poses;
  poses.has_scale = true;
  for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
    const auto scale = static_cast<float>(random.chance(0.06) ? random.uniform(10, 60) : random.uniform(0.5, 2));
    for (std::uint32_t link = 0; link < poses.link_count; ++link)
      oracle::scale_matrix(poses.format, scale, poses.pose(i, link));
  }
}

// A skin of any triangles, or of one or two closed parts.
inline oracle::SkinRig any_skin(oracle::Random& random) {
  if (random.chance(0.4)) {
    for (;;) {
      oracle::SkinRig skin =
          oracle::random_surface(random, static_cast<oracle::SkinRegime>(random.index(oracle::kSkinRegimeCount)), 10);
      if (skin.size == 1) return skin;
    }
  }
  Mesh mesh = lump_mesh(random, 1 + random.index(2), {{0.6, 0.3, 0.3}}, {{0.3, 0, 0}});
  if (random.chance(0.3)) mesh.add(lump_mesh(random, 1, {{0.1, 0.1, 0.1}}, {{0.3, 0.5, 0}}));
  return rig_of(mesh, 1 + random.index(3), 0.3, 8 + random.index(40), random.chance(0.2) ? &random : nullptr);
}

// A member with that skin, as any_member makes one of a rig.
inline oracle::Member skinned_member(oracle::Random& random, const oracle::SkinRig& skin, std::uint32_t instances,
                                     const oracle::PoseRange& range) {
  oracle::Member member;
  const auto format = static_cast<PoseFormat>(random.index(3));
  const double angle = random.uniform(0, 2), shift = random.chance(0.5) ? 0.1 : 0;
  member.poses = oracle::random_skin_poses(random, skin, instances, format, angle, shift,
                                           range.origins ? 0 : range.spread / skin.size);
  member.poses.scales.clear();
  for (std::uint32_t i = 0; range.origins && i < instances; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      member.poses.origins.push_back(range.about[c] + random.uniform(-range.spread, range.spread));
  return member;
}

inline void break_poses(oracle::Random& random, oracle::Member& member) {
  for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
    if (random.chance(0.1))
      member.poses.pose(i, random.index(member.poses.link_count))[random.index(7)] =
          random.chance(0.5) ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
}

inline void add_level(oracle::Random& random, const oracle::Vec3<double>& about, double spread, RandomCrowd& crowd) {
  for (std::uint32_t b = 0; b < 1 + random.index(20); ++b) {
    StaticBody body;
    body.box = oracle::random_box(random, 0.1 * random.unit_vector(), 0.05, 0.6);
    for (std::size_t c = 0; c < 3; ++c) body.origin[c] = about[c] + random.uniform(-spread, spread);
    crowd.bodies.push_back(body);
  }
  const auto level = static_cast<std::uint32_t>(crowd.world.members.size() + 1);
  for (std::uint32_t m = 1; m < level; ++m)
    if (random.chance(0.7)) crowd.world.rules.push_back({{m}, {level}, Pairing::kBetween});
}

inline Policies any_policies(oracle::Random& random) {
  Policies out;
  if (random.chance(0.3)) return out;
  for (std::uint32_t field = 0; field < policy_table().size; ++field) {
    const PolicyField& one = policy_table()[field];
    policy_set(out, field, one.values[random.index(one.value_count)].name);
  }
  return out;
}

// Half of the crowds have skins.
inline RandomCrowd random_crowd(oracle::Random& random, std::int32_t ranks) {
  RandomCrowd out;
  oracle::World& world = out.world;
  const bool far = random.chance(0.3);
  const oracle::Vec3<double> about = (far ? random.log_uniform(1e6, 1e9) : 0) * random.unit_vector();
  const double spread = random.uniform(0.5, 4);
  const std::uint32_t count = 1 + random.index(3);
  const bool with_skins = random.chance(0.5);
  for (std::uint32_t m = 0; m < count; ++m) {
    const std::uint32_t instances =
        random.chance(0.3) ? oracle::kInstanceCounts[random.index(6)] : 20 + random.index(80);
    const oracle::PoseRange range = oracle::any_pose_range(random, far, about, spread);
    std::optional<oracle::SkinRig>& skin = out.skins.emplace_back();
    if (with_skins && (m == 0 || random.chance(0.5))) skin = any_skin(random);
    world.members.push_back(skin ? skinned_member(random, *skin, instances, range)
                                 : oracle::any_member(random, instances, BatchKind::kCharacters, range, 12));
    oracle::Member& member = world.members.back();
    const bool is_scaled = random.chance(0.4);
    if (is_scaled &&
        (member.poses.has_scale || (member.poses.format != PoseFormat::kQuaternionTranslation && random.chance(0.5))))
      add_pose_scales(random, member);
    else if (is_scaled)
      add_scales(random, member);
    if (random.chance(0.3)) break_poses(random, member);
    if (!skin && random.chance(0.4)) oracle::add_parts(random, member.rig, out.kept);
    std::vector<float>& margins = out.margins.emplace_back();
    if (random.chance(0.3))
      for (std::uint32_t i = 0; i < instances; ++i)
        margins.push_back(random.chance(0.5) ? 0.0f : static_cast<float>(random.uniform(0, 0.5)));
  }
  oracle::pair_all(world, 1, count);
  if (random.chance(0.4))
    world.rules.erase(world.rules.begin() + random.index(static_cast<std::uint32_t>(world.rules.size())));
  if (random.chance(0.4)) oracle::add_layers(random, world);
  if (random.chance(0.4)) world.margin = static_cast<float>(random.log_uniform(0.001, 0.5));
  if (random.chance(0.4)) add_level(random, about, spread, out);
  out.policies = any_policies(random);
  if (with_skins) {
    out.policies.exact = random.chance(0.8) ? Exact::kSurface : Exact::kNone;
    out.containment = random.chance(0.8);
  } else if (out.policies.exact != Exact::kNone) {
    world.contacts = random.chance(0.7);
    if (world.contacts && random.chance(0.2)) out.report = Report::kDistances;
    if (random.chance(0.3)) world.min_depth = static_cast<float>(random.uniform(0, 0.05));
  }
  own_all(random, ranks, out);
  return out;
}

}  // namespace cab::tests
