// Random articulations and poses for the engine's tests.
#pragma once

#include "perf/judge/oracle/random.h"
#include "perf/judge/oracle/real.h"

#include <cab/types.h>

#include <cstdint>
#include <vector>

namespace cab::oracle {

// An articulation that owns what its description points to. parent_offset: a link's joint in its parent's frame, by
// which poses are made. The engine does not get it.
struct Rig {
  std::vector<std::int32_t> parents;
  std::vector<float> joints;
  std::vector<Leaf> leaves;
  std::vector<LinkPair> ignored;
  std::vector<Vec3<double>> parent_offset;

  ArticulationDesc desc() const { return {parents, joints, leaves, ignored}; }
  std::uint32_t link_count() const { return static_cast<std::uint32_t>(parents.size()); }
  std::uint32_t leaf_count() const { return static_cast<std::uint32_t>(leaves.size()); }
  std::uint32_t node_count() const { return 2 * leaf_count() - 1; }
};

enum class Topology { kChain, kStar, kTree, kHumanoid, kHand };
inline constexpr unsigned kTopologyCount = 5;

// The parent of any link but link 0. The first 19 links of a humanoid are spine, neck, head, arms and legs, the links
// after them are five fingers per hand. A hand has five fingers with equal numbers of links.
inline unsigned parent_link(Random& random, Topology topology, unsigned link) {
  static constexpr unsigned kHumanoid[] = {0, 0, 1, 2, 3, 2, 5, 6, 7, 2, 9, 10, 11, 0, 13, 14, 0, 16, 17};
  switch (topology) {
    case Topology::kChain: return link - 1;
    case Topology::kStar: return 0;
    case Topology::kHumanoid:
      if (link < 19) return kHumanoid[link];
      return link >= 29 ? link - 10 : (link % 2 == 0 ? 8 : 12);
    case Topology::kHand: return link <= 5 ? 0 : link - 5;
    case Topology::kTree: break;
  }
  return random.index(link);
}

// A box with random axes, rounded to float, about a point.
inline Box random_box(Random& random, const Vec3<double>& center, double least_half, double most_half) {
  Box box;
  double axis[3][3];
  random.rotation(axis);
  for (std::size_t k = 0; k < 3; ++k) {
    box.center[k] = static_cast<float>(center[k]);
    box.half[k] = static_cast<float>(random.log_uniform(least_half, most_half));
    for (std::size_t c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axis[k][c]);
  }
  return box;
}

// A random rig. Links are about 0.3 long and have 1 to most_leaves leaves each; one link in eight has no leaf. In half
// of the rigs joints are away from the frames' origins. Pairs of parent and child are ignored, and sometimes another
// pair.
inline Rig random_rig(Random& random, Topology topology, unsigned links, unsigned most_leaves) {
  Rig rig;
  const bool own_joints = random.chance(0.5);
  for (unsigned link = 0; link < links; ++link) {
    const unsigned parent = link == 0 ? 0 : parent_link(random, topology, link);
    rig.parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(parent));
    const double length = random.uniform(0.2, 0.4);
    rig.parent_offset.push_back(length * random.unit_vector());
    for (int c = 0; c < 3; ++c) {
      if (own_joints) rig.joints.push_back(static_cast<float>(random.uniform(-0.2, 0.2)));
    }
    if (link > 0) rig.ignored.push_back({parent, link});
    if (links > 2 && random.chance(0.1)) {
      const unsigned a = random.index(links);
      rig.ignored.push_back({a, random.index(links)});
    }
    if (link > 0 && random.chance(0.125)) continue;
    for (unsigned leaf = 1 + random.index(most_leaves); leaf > 0; --leaf)
      rig.leaves.push_back({link, random_box(random, 0.15 * random.unit_vector(), 0.03, 0.2), {}});
  }
  for (std::size_t i = rig.leaves.size(); i > 1; --i)
    std::swap(rig.leaves[i - 1], rig.leaves[random.index(static_cast<unsigned>(i))]);
  return rig;
}

// Poses of n instances in one format, owning what a BatchInput points to.
struct Poses {
  PoseFormat format = PoseFormat::kQuaternionTranslation;
  std::uint32_t link_count = 0;
  std::uint32_t instance_count = 0;
  std::vector<float> data;
  std::vector<double> origins;
  std::vector<float> orientations;
  std::vector<float> scales;
  bool has_scale = false;  // matrices hold a scale

  std::size_t floats_per_pose() const {
    return format == PoseFormat::kQuaternionTranslation ? 7 : format == PoseFormat::kMatrix3x4Rows ? 12 : 16;
  }
  float* pose(std::uint32_t instance, std::uint32_t link) {
    return data.data() + (std::size_t{instance} * link_count + link) * floats_per_pose();
  }
  const float* pose(std::uint32_t instance, std::uint32_t link) const {
    return const_cast<Poses*>(this)->pose(instance, link);
  }
  BatchInput input(BatchId batch) const {
    BatchInput out;
    out.batch = batch;
    out.poses.format = format;
    out.poses.data = data.data();
    out.origins = origins;
    out.orientations = orientations;
    out.scales = scales;
    out.poses.has_scale = has_scale;
    return out;
  }
};

// Rotation x y z w about a unit axis.
inline void quaternion_about(const Vec3<double>& axis, double angle, double (&q)[4]) {
  for (std::size_t c = 0; c < 3; ++c) q[c] = std::sin(angle / 2) * axis[c];
  q[3] = std::cos(angle / 2);
}

inline void random_turn(Random& random, double (&q)[4]) {
  const Vec3<double> axis = random.unit_vector();
  quaternion_about(axis, random.uniform(-3, 3), q);
}

// Where instances are: in a cube with the half width `spread`, placed by origins about a point or by their poses alone.
struct PoseRange {
  double spread = 1;
  bool orientations = false;
  bool origins = false;
  Vec3<double> about = {};
};

// Writes one pose in a format; q need not be of unit length in the quaternion format.
inline void write_pose(PoseFormat format, const double (&q)[4], const Vec3<double>& t, float* out) {
  if (format == PoseFormat::kQuaternionTranslation) {
    for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<float>(q[i]);
    for (std::size_t c = 0; c < 3; ++c) out[4 + c] = static_cast<float>(t[c]);
    return;
  }
  double column[3][3];
  quaternion_matrix(q, column);
  const bool rows = format == PoseFormat::kMatrix3x4Rows;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < 3; ++k) out[rows ? 4 * c + k : 4 * k + c] = static_cast<float>(column[k][c]);
    out[rows ? 4 * c + 3 : 12 + c] = static_cast<float>(t[c]);
    if (!rows) out[4 * c + 3] = 0;
  }
  if (!rows) out[15] = 1;
}

// Writes one matrix times a factor.
inline void scale_matrix(PoseFormat format, float factor, float* pose) {
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c) pose[format == PoseFormat::kMatrix3x4Rows ? 4 * c + k : 4 * k + c] *= factor;
}

// Random poses of a rig: every link has a new rotation, and links stay joined to their parents.
inline Poses random_poses(Random& random, const Rig& rig, std::uint32_t instances, PoseFormat format,
                          const PoseRange& range) {
  Poses out;
  out.format = format;
  out.link_count = rig.link_count();
  out.instance_count = instances;
  out.data.resize(std::size_t{instances} * out.link_count * out.floats_per_pose());
  for (std::uint32_t i = 0; i < instances; ++i) {
    Vec3<double> stand{};
    for (double& c : stand.v) c = random.uniform(-range.spread, range.spread);
    if (range.origins)
      for (std::size_t c = 0; c < 3; ++c) out.origins.push_back(range.about[c] + stand[c]);
    std::vector<Vec3<double>> at(rig.parents.size());
    std::vector<double> turn(9 * rig.parents.size());
    for (std::uint32_t link = 0; link < out.link_count; ++link) {
      double q[4], column[3][3];
      random_turn(random, q);
      quaternion_matrix(q, column);
      at[link] = range.origins ? Vec3<double>{} : stand;
      if (rig.parents[link] >= 0) {
        const auto parent = static_cast<std::size_t>(rig.parents[link]);
        at[link] = at[parent];
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t c = 0; c < 3; ++c) at[link][c] += rig.parent_offset[link][k] * turn[9 * parent + 3 * k + c];
      }
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c) turn[9 * link + 3 * k + c] = column[k][c];
      write_pose(format, q, at[link], out.pose(i, link));
    }
    if (range.orientations) {
      double q[4];
      random_turn(random, q);
      for (const double v : q) out.orientations.push_back(static_cast<float>(v));
    }
  }
  return out;
}

}  // namespace cab::oracle
