// Random skins for tests of their triangles: triangles of all shapes that share vertices, and poses of instances.
#pragma once

#include "perf/judge/oracle/random_queries.h"
#include "perf/judge/oracle/random_skins.h"

namespace cab::oracle {

// Copies a vertex, with all that moves it.
inline void copy_vertex(SkinRig& rig, std::uint32_t from, std::uint32_t to) {
  const auto copy = [from, to](auto& list, std::size_t each) {
    std::copy_n(list.begin() + static_cast<std::ptrdiff_t>(each * from), each,
                list.begin() + static_cast<std::ptrdiff_t>(each * to));
  };
  copy(rig.vertices, 3);
  copy(rig.links, rig.influence_count);
  copy(rig.weights, rig.influence_count);
}

// Moves a vertex to another: what is left of the way is so much of what it was.
inline void draw_near(SkinRig& rig, std::uint32_t vertex, std::uint32_t to, double left) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double at = rig.vertices[3 * std::size_t{to} + c];
    float& moved = rig.vertices[3 * std::size_t{vertex} + c];
    moved = static_cast<float>(at + left * (moved - at));
  }
}

// A skin whose leaves are large beside its links. Some leaves have small triangles; one triangle in ten is a needle,
// one in sixteen has no area, and one in four has corners of others, of its leaf or of one before.
inline SkinRig random_surface(Random& random, SkinRegime regime, unsigned most_triangles) {
  SkinRig out = random_skin(random, regime, 0.3, most_triangles);
  for (std::size_t leaf = 0; leaf < out.leaves.size(); ++leaf) {
    std::vector<std::uint32_t>& corners = out.triangles[leaf];
    const double size = random.chance(0.4) ? 1 : random.log_uniform(0.03, 1);
    for (std::size_t t = 0; t < corners.size(); t += 3) {
      for (std::size_t k = 1; k < 3; ++k) draw_near(out, corners[t + k], corners[t], size);
      if (random.chance(0.1)) draw_near(out, corners[t + 2], corners[t + 1], random.log_uniform(1e-6, 1e-2));
      if (random.chance(0.06)) {
        const unsigned how = random.index(4);
        if (how == 0) corners[t + 2] = corners[t + 1];
        if (how == 1) copy_vertex(out, corners[t + 1], corners[t + 2]);
        if (how == 2) draw_near(out, corners[t + 2], corners[t + 1], 0);
        if (how == 3) corners[t + 1] = corners[t + 2] = corners[t];
      }
      if (!random.chance(0.25)) continue;
      const std::vector<std::uint32_t>& others =
          out.triangles[random.chance(0.3) ? random.index(static_cast<unsigned>(leaf + 1)) : leaf];
      const unsigned shared = 1 + random.index(2);
      for (unsigned k = 0; k < shared; ++k) corners[t + k] = others[random.index(static_cast<unsigned>(others.size()))];
    }
    out.leaves[leaf].triangles = corners;
  }
  return out;
}

// Turns one link by 180 degrees about where it was bound, and leaves it where it is.
inline void turn_around(Random& random, const SkinRig& rig, Poses& poses, std::uint32_t instance) {
  const std::uint32_t link = random.index(poses.link_count);
  float* const pose = poses.pose(instance, link);
  Vec3<double> at;
  for (std::size_t c = 0; c < 3; ++c)
    at[c] = pose[poses.format == PoseFormat::kQuaternionTranslation ? 4 + c
                 : poses.format == PoseFormat::kMatrix3x4Rows       ? 4 * c + 3
                                                                    : 12 + c];
  const Vec3<double> axis = random.unit_vector();
  const std::array<double, 4> turn = product({axis[0], axis[1], axis[2], 0}, rig.bound_turn[link]);
  const double all[4] = {turn[0], turn[1], turn[2], turn[3]};
  write_pose(poses.format, all, at, pose);
}

// Poses of three instances, each up to `away` sizes from its origin. The third has those of the first. Origins are 0.
inline Poses random_surface_poses(Random& random, const SkinRig& rig, PoseFormat format, double away) {
  constexpr double kAngles[] = {0.1, 1, 3.14159265}, kShifts[] = {0, 0.1, 0.5};
  const double angle = kAngles[random.index(3)], shift = kShifts[random.index(3)];
  Poses out = random_skin_poses(random, rig, 3, format, angle, shift, away);
  if (random.chance(0.3)) turn_around(random, rig, out, random.index(2));
  if (random.chance(0.3)) mirror_links(random, out);
  const auto repeat = [](auto& list) {
    const auto each = static_cast<std::ptrdiff_t>(list.size() / 3);
    std::copy_n(list.begin(), each, list.begin() + 2 * each);
  };
  repeat(out.data);
  repeat(out.orientations);
  repeat(out.scales);
  out.origins.assign(9, 0);
  return out;
}

// How large the numbers are that put a vertex where skinned_vertex has it.
inline Real numbers_of_vertex(const SkinDesc& skin, const std::vector<ExactPose>& poses, std::size_t vertex) {
  Real out = 0;
  const float* const v = skin.vertices.data + 3 * vertex;
  for (std::uint32_t i = 0; i < skin.influence_count; ++i) {
    const std::size_t at = vertex * skin.influence_count + i;
    if (skin.influence_weights[at] == 0) continue;
    const std::uint32_t link = skin.influence_links[at];
    Point reach;
    for (std::size_t c = 0; c < 3; ++c) {
      reach[c] = std::fabs(Real{v[c]});
      if (skin.inverse_bind.size == 0) continue;
      const float* const m = skin.inverse_bind.data + std::size_t{16} * link;
      reach[c] = std::fabs(Real{m[c]} * v[0]) + std::fabs(Real{m[4 + c]} * v[1]) + std::fabs(Real{m[8 + c]} * v[2]) +
                 std::fabs(Real{m[12 + c]});
    }
    out = std::max(out, poses[link].scale * norm_1(reach) + norm_1(poses[link].at));
  }
  return out;
}

}  // namespace cab::oracle
