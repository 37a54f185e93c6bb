// A checked skin, and how its joints and bodies stand in a pose.
#pragma once

#include <cab/skin.h>

#include <array>
#include <cstdint>
#include <vector>

#include "scenes/affine.h"
#include "scenes/rig/solid.h"

namespace cab::scenes {

// What triangles are to the rest of this folder: three vertices, or the same vertex three times if the skin has no
// triangles.
using Triangle = std::array<std::uint32_t, 3>;

// A body and the link that carries it.
struct LinkSolid {
  std::uint32_t link = 0;
  Solid solid;
};

// A skin in double. The skin is borrowed.
class CheckedSkin {
 public:
  struct Influence {
    std::uint32_t bone;
    double weight;
  };

  // The status of the first thing that is wrong; the other members are for a skin without one.
  rig::SkinStatus check(const rig::Skin& skin);

  std::size_t joint_count() const { return skin_->joint_parents.size; }
  std::size_t pose_count() const { return skin_->poses.size / (16 * joint_count()); }
  std::uint32_t bone_count() const { return static_cast<std::uint32_t>(inverse_bind_.size()); }
  std::uint32_t joint_of(std::uint32_t bone) const;
  const Affine& inverse_bind(std::uint32_t bone) const { return inverse_bind_[bone]; }

  std::size_t vertex_count() const { return influences_.size(); }

  // A vertex in the space of its mesh.
  Vec3 vertex(std::uint32_t v) const;

  // The bones that move a vertex; their weights add up to 1. Empty for a vertex without weight.
  const std::vector<Influence>& influences(std::uint32_t v) const { return influences_[v]; }

  // The triangles whose vertices all have weights.
  const std::vector<Triangle>& triangles() const { return triangles_; }
  // Of each of these: which triangle of the skin it is, or which vertex.
  const std::vector<std::uint32_t>& sources() const { return sources_; }

  // The matrices of all joints in a pose, and all vertices as the bones carry them, in model space.
  std::vector<Affine> joints(std::size_t pose) const;
  std::vector<Vec3> vertices(const std::vector<Affine>& joints) const;

 private:
  const rig::Skin* skin_ = nullptr;
  std::vector<Affine> inverse_bind_;
  std::vector<std::vector<Influence>> influences_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> sources_;
};

// A rigid frame: a point p of it is at position + rotation p.
struct RigidFrame {
  Quat rotation = {0, 0, 0, 1};
  Vec3 position = {0, 0, 0};

  Vec3 out(const Vec3& point) const { return position + rotate(rotation, point); }
  Vec3 in(const Vec3& point) const { return rotate(conjugate(rotation), point - position); }
};

// The frame of a link whose joint has this matrix.
RigidFrame rigid_frame(const Affine& joint);

// Bodies in one pose. They are borrowed.
class PosedBodies {
 public:
  // `joints` are those of the links.
  PosedBodies(const std::vector<LinkSolid>& bodies, Span<const std::uint32_t> joints, const std::vector<Affine>& pose);

  const RigidFrame& frame(std::uint32_t link) const { return frames_[link]; }

  // Whether a point of the model is in a body. Those of one link, on which the point is likely to be, are tried first.
  bool is_inside(const Vec3& point, std::uint32_t link) const;

  // The distance from a point to the nearest body, if that is more than `least`; else `least`. Those of one link are
  // tried first.
  double distance_above(const Vec3& point, std::uint32_t link, double least) const;

 private:
  // Whether the ball about a body is more than a distance away.
  bool is_beyond(std::size_t body, const Vec3& point, double distance) const;

  const std::vector<LinkSolid>& bodies_;
  std::vector<RigidFrame> frames_;
  std::vector<Vec3> centres_;
};

// The points in which a triangle is looked at: its corners, then the middles of its four quarters.
std::array<Vec3, 7> samples(const std::array<Vec3, 3>& corners);

}  // namespace cab::scenes

namespace cab::rig {

// What ArticulationDesc::skin and the triangles of leaves point to.
struct SurfaceStorage {
  std::vector<float> vertices;
  std::uint32_t influence_count = 0;
  std::vector<std::uint32_t> influence_links;
  std::vector<float> influence_weights;
  std::vector<float> inverse_bind;
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint32_t> sources;  // of each triangle: which one of the skin it is

  SkinDesc desc() const { return {vertices, influence_count, influence_links, influence_weights, inverse_bind}; }
};

struct SkinBodyStorage {
  std::size_t joint_count = 0;
  std::vector<std::int32_t> link_parents;
  std::vector<std::uint32_t> joints;
  std::vector<LinkPair> ignored_pairs;
  std::vector<scenes::LinkSolid> solids;  // one per leaf
  std::vector<std::uint32_t> owners;      // the link with most of the weight of each triangle
  std::vector<ConvexPart> parts;          // one per leaf, those of boxes unused
  std::vector<Leaf> leaves;
  SurfaceStorage surface;  // empty if bodies are solids
};

struct SkinBodiesAccess {
  static const SkinBodyStorage* get(const SkinBodies& bodies) { return bodies.storage_; }
  static void set(SkinBodies& bodies, SkinBodyStorage* storage) { bodies.storage_ = storage; }
};

}  // namespace cab::rig
