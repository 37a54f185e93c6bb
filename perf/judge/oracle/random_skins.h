// Random skins and poses of their links, and the judge of where their vertices are: by the definition of a linear blend
// in long double, which shares nothing with the boxes that hold them.
#pragma once

#include "perf/harness/random_rig.h"
#include "perf/judge/oracle/exact_pose.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace cab::oracle {

// How the links of a skin move it.
enum class SkinRegime : std::uint8_t {
  kSmooth,  // each vertex by the two links that are nearest along a limb, little by little
  kMany,    // by one to seven links with any weights
  kTiny,    // by one link, and by others with weights down to 1e-7
  kRigid,   // by one link
  kFlat,    // as kSmooth, all vertices of a leaf in a plane or on a line
};
inline constexpr unsigned kSkinRegimeCount = 5;

// An articulation with a skin that owns what its description points to. Links are a chain along a limb.
struct SkinRig {
  std::vector<std::int32_t> parents;
  std::vector<std::vector<std::uint32_t>> triangles;  // by leaf
  std::vector<Leaf> leaves;
  std::vector<float> vertices, weights, inverse_bind;
  std::vector<std::uint32_t> links;
  std::uint32_t influence_count = 1;
  double size = 1;  // of a link
  // By link: where it was bound, as a quaternion x y z w and a translation.
  std::vector<std::array<double, 4>> bound_turn;
  std::vector<Vec3<double>> bound_at;

  ArticulationDesc desc() const {
    ArticulationDesc out;
    out.link_parents = parents;
    out.leaves = leaves;
    out.skin = {vertices, influence_count, links, weights, inverse_bind};
    return out;
  }
  std::uint32_t link_count() const { return static_cast<std::uint32_t>(parents.size()); }
};

inline std::array<double, 4> product(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

inline Vec3<double> turned(const std::array<double, 4>& q, const Vec3<double>& p) {
  double one[4], column[3][3];
  std::copy(q.begin(), q.end(), one);
  quaternion_matrix(one, column);
  return p[0] * to_vec3(column[0]) + p[1] * to_vec3(column[1]) + p[2] * to_vec3(column[2]);
}

// Writes the inverse bind matrix of a link that was bound at a pose: the inverse of that pose, then `deform`, of which
// column k is deform[k].
inline void append_inverse_bind(const std::array<double, 4>& turn, const Vec3<double>& at,
                                const Vec3<double> (&deform)[3], std::vector<float>& out) {
  const std::array<double, 4> back = {-turn[0], -turn[1], -turn[2], turn[3]};
  const auto deformed = [&](const Vec3<double>& p) { return p[0] * deform[0] + p[1] * deform[1] + p[2] * deform[2]; };
  for (std::size_t k = 0; k < 4; ++k) {
    Vec3<double> unit{};
    if (k < 3) unit[k] = 1;
    const Vec3<double> column = deformed(turned(back, k < 3 ? unit : -1.0 * at));
    for (std::size_t c = 0; c < 3; ++c) out.push_back(static_cast<float>(column[c]));
    out.push_back(k == 3 ? 1.0f : 0.0f);
  }
}

// least_spread: of the vertices of a leaf, as a share of a link's size. most_triangles: of a leaf.
inline SkinRig random_skin(Random& random, SkinRegime regime, double least_spread = 1e-3,
                           unsigned most_triangles = 10) {
  SkinRig out;
  const unsigned count = regime == SkinRegime::kRigid ? 1 + random.index(4) : 2 + random.index(7);
  out.size = random.chance(0.5) ? 1 : random.log_uniform(1e-4, 1e4);
  const bool has_binds = random.chance(0.7), is_deformed = random.chance(0.3);
  for (unsigned link = 0; link < count; ++link) {
    out.parents.push_back(static_cast<std::int32_t>(link) - 1);
    double q[4] = {0, 0, 0, 1};
    Vec3<double> at{};
    if (has_binds) {
      random_turn(random, q);
      at = out.size * Vec3<double>{{static_cast<double>(link), 0, 0}};
    }
    out.bound_turn.push_back({q[0], q[1], q[2], q[3]});
    out.bound_at.push_back(at);
    if (!has_binds) continue;
    Vec3<double> deform[3] = {{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}};
    if (is_deformed)
      for (std::size_t k = 0; k < 3; ++k) {
        deform[k] = deform[k] + 0.3 * random.unit_vector();
        if (k == 2 && random.chance(0.3)) deform[k] = -1.0 * deform[k];
      }
    append_inverse_bind(out.bound_turn.back(), at, deform, out.inverse_bind);
  }
  out.influence_count = regime == SkinRegime::kRigid                                 ? 1
                        : regime == SkinRegime::kMany || regime == SkinRegime::kTiny ? 7
                                                                                     : 2;
  const unsigned leaf_count = 1 + random.index(5);
  for (unsigned leaf = 0; leaf < leaf_count; ++leaf) {
    const unsigned own = random.index(count);
    std::vector<std::uint32_t> triangles;
    const Vec3<double> place = out.size * Vec3<double>{{own + random.uniform(-0.5, 0.5), 0, 0}};
    Vec3<double> spread = random.log_uniform(least_spread, 0.5) * out.size * Vec3<double>{{1, 1, 1}};
    if (regime == SkinRegime::kFlat)
      for (std::size_t c = 0; c < 2; ++c)
        if (random.chance(0.6)) spread[c] = 0;
    const unsigned vertices = 3 * (1 + random.index(most_triangles));
    for (unsigned v = 0; v < vertices; ++v) {
      triangles.push_back(static_cast<std::uint32_t>(out.vertices.size() / 3));
      Vec3<double> p = place;
      for (std::size_t c = 0; c < 3; ++c) p[c] += spread[c] * random.uniform(-1, 1);
      for (std::size_t c = 0; c < 3; ++c) out.vertices.push_back(static_cast<float>(p[c]));
      const auto link = static_cast<double>(std::min(count - 1, static_cast<unsigned>(std::max(0.0, p[0] / out.size))));
      for (std::uint32_t i = 0; i < out.influence_count; ++i) {
        std::uint32_t by = i == 0 ? own : random.index(count);
        double weight = i == 0 ? 1 : 0;
        if (regime == SkinRegime::kSmooth || regime == SkinRegime::kFlat) {
          const double along = std::clamp(p[0] / out.size - link, 0.0, 1.0);
          by = std::min(count - 1, static_cast<std::uint32_t>(link) + i);
          weight = i == 0 ? 1 - along : along;
        } else if (i > 0) {
          weight = regime == SkinRegime::kTiny ? random.log_uniform(1e-8, 1e-3) : random.uniform(0, 1);
          if (random.chance(0.4)) weight = 0;
        }
        out.links.push_back(by);
        out.weights.push_back(static_cast<float>(weight));
      }
    }
    out.triangles.push_back(std::move(triangles));
    Leaf one;
    one.link = own;
    out.leaves.push_back(one);
  }
  for (std::size_t leaf = 0; leaf < out.leaves.size(); ++leaf) out.leaves[leaf].triangles = out.triangles[leaf];
  return out;
}

// Poses of instances of a skin: links turn about where they were bound by up to `angle`, shift by up to `shift` sizes,
// and all are `away` sizes from the instance's origin.
inline Poses random_skin_poses(Random& random, const SkinRig& rig, std::uint32_t instances, PoseFormat format,
                               double angle, double shift, double away) {
  Poses out;
  out.format = format;
  out.link_count = rig.link_count();
  out.instance_count = instances;
  out.data.resize(std::size_t{instances} * out.link_count * out.floats_per_pose());
  const bool rotated = random.chance(0.5);
  const bool scaled = format == PoseFormat::kQuaternionTranslation && random.chance(0.3);
  out.has_scale = format != PoseFormat::kQuaternionTranslation && random.chance(0.5);
  for (std::uint32_t i = 0; i < instances; ++i) {
    const Vec3<double> place = random.uniform(0, away) * rig.size * random.unit_vector();
    for (std::uint32_t link = 0; link < out.link_count; ++link) {
      double q[4];
      quaternion_about(random.unit_vector(), random.uniform(-angle, angle), q);
      const std::array<double, 4> turn = product({q[0], q[1], q[2], q[3]}, rig.bound_turn[link]);
      const Vec3<double> at = rig.bound_at[link] + shift * rig.size * random.unit_vector() + place;
      const double all[4] = {turn[0], turn[1], turn[2], turn[3]};
      write_pose(format, all, at, out.pose(i, link));
      if (out.has_scale) scale_matrix(format, static_cast<float>(random.log_uniform(0.5, 2)), out.pose(i, link));
    }
    double q[4];
    random_turn(random, q);
    for (std::size_t c = 0; c < 4 && rotated; ++c) out.orientations.push_back(static_cast<float>(q[c]));
    if (scaled) out.scales.push_back(static_cast<float>(random.log_uniform(1e-2, 1e2)));
  }
  return out;
}

// The exact pose of each link of an instance.
inline std::vector<ExactPose> exact_poses(const Poses& poses, std::uint32_t instance) {
  std::vector<ExactPose> out;
  for (std::uint32_t link = 0; link < poses.link_count; ++link) out.push_back(exact_pose(poses, instance, link));
  return out;
}

// Where a vertex of a skin is, relative to its instance's origin. poses: exact_pose of each link of the instance.
inline Point skinned_vertex(const SkinDesc& skin, const std::vector<ExactPose>& poses, std::size_t vertex) {
  Point out{};
  Real weights = 0;
  for (std::uint32_t i = 0; i < skin.influence_count; ++i) {
    const std::size_t at = vertex * skin.influence_count + i;
    const Real weight = skin.influence_weights[at];
    if (weight == 0) continue;
    const std::uint32_t link = skin.influence_links[at];
    const float* const v = skin.vertices.data + 3 * vertex;
    Point bound{{v[0], v[1], v[2]}};
    if (skin.inverse_bind.size > 0) {
      const float* const m = skin.inverse_bind.data + std::size_t{16} * link;
      for (std::size_t c = 0; c < 3; ++c)
        bound[c] = Real{m[c]} * v[0] + Real{m[4 + c]} * v[1] + Real{m[8 + c]} * v[2] + Real{m[12 + c]};
    }
    out = out + weight * (poses[link].at + rotated(poses[link].column, poses[link].scale * bound));
    weights += weight;
  }
  return (1 / weights) * out;
}

// A vertex of a skin as a box, for judge_containment.
inline ExactBox vertex_box(const SkinDesc& skin, const std::vector<ExactPose>& poses, std::size_t vertex) {
  ExactBox out{};
  store(skinned_vertex(skin, poses, vertex), out.center);
  for (std::size_t k = 0; k < 3; ++k) out.axis[k][k] = 1;
  return out;
}

}  // namespace cab::oracle
