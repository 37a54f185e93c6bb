#include "scenes/crowd/skins.h"

#include "scenes/crowd/humanoid.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace cab::scenes {
namespace {

// Of a leaf: sides about the axis, and steps along it. 8 x 7 quads are 112 triangles.
constexpr std::uint32_t kSides = 8, kSteps = 7;
static_assert(2 * kSides * kSteps * kSkinLeaves == kSkinTriangles);

// The points of a cross-section of a box, in half extents.
constexpr double kSection[kSides][2] = {{1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}};

// What another link moves at most, and how far from the joint with it, in half extents of the longest axis.
constexpr double kMostWeight = .5, kReach = .7;

// The joint of each link in the frame of its parent.
std::vector<Vec3> joints_of(const Character& body, const PosedGroup& posed) {
  std::vector<Vec3> joints;
  for (std::size_t l = 0; l < body.link_parents.size(); ++l) {
    const float* const own = posed.poses.data() + 7 * l;
    if (body.link_parents[l] < 0) {
      joints.push_back({0, 0, 0});
      continue;
    }
    const float* const parent = posed.poses.data() + 7 * static_cast<std::size_t>(body.link_parents[l]);
    Vec3 away;
    for (std::size_t c = 0; c < 3; ++c) away[c] = static_cast<double>(own[4 + c]) - static_cast<double>(parent[4 + c]);
    joints.push_back(rotate(conjugate(normalized({parent[0], parent[1], parent[2], parent[3]})), away));
  }
  return joints;
}

double weight_at(const Vec3& point, const Vec3& joint, double reach) {
  return std::max(0.0, kMostWeight * (1 - length(point - joint) / reach));
}

// Makes the skin of a body whose links have one box along their frame's axes each.
class SkinMaker {
 public:
  SkinMaker(const Character& body, std::vector<Vec3> joints) : body_(body), joints_(std::move(joints)) {
    for (std::size_t l = 0; l < joints_.size(); ++l) {
      const std::int32_t parent = body.link_parents[l];
      rest_.push_back(parent < 0 ? joints_[l] : rest_[static_cast<std::size_t>(parent)] + joints_[l]);
      most_ = std::max<std::size_t>(
          most_, 2 + static_cast<std::size_t>(
                         std::count(body.link_parents.begin(), body.link_parents.end(), static_cast<std::int32_t>(l))));
    }
  }

  Character make(SkinLeafKind kind) {
    Character out = body_;
    out.leaves.clear();
    const auto links = static_cast<std::uint32_t>(joints_.size());
    for (std::uint32_t l = 0; l < links; ++l) {
      const std::uint32_t pieces = kSkinLeaves / links + (l < kSkinLeaves % links ? 1 : 0);
      const auto first = static_cast<std::uint32_t>(skin_.vertices.size() / 3);
      const Box& box = body_.leaves[l].box;
      const auto axis = static_cast<std::size_t>(std::max_element(box.half, box.half + 3) - box.half);
      for (std::uint32_t r = 0; r <= pieces * kSteps; ++r) add_ring(l, axis, 2.0 * r / (pieces * kSteps) - 1);
      for (std::uint32_t p = 0; p < pieces; ++p) {
        BodyLeaf leaf;
        leaf.link = l;
        leaf.box = box;
        const float share = 1 / static_cast<float>(pieces);
        leaf.box.center[axis] += (static_cast<float>(2 * p + 1) * share - 1) * box.half[axis];
        leaf.box.half[axis] *= share;
        if (kind == SkinLeafKind::kGrown) add_triangles(first + p * kSteps * kSides, leaf.triangles);
        out.leaves.push_back(std::move(leaf));
      }
    }
    if (kind == SkinLeafKind::kRigid) return out;
    skin_.influence_count = static_cast<std::uint32_t>(most_);
    for (const Vec3& at : rest_)
      for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t c = 0; c < 3; ++c)
          skin_.inverse_bind.push_back(k == 3 ? static_cast<float>(-at[c]) : k == c ? 1.0f : 0.0f);
        skin_.inverse_bind.push_back(k == 3 ? 1.0f : 0.0f);
      }
    out.skin = std::move(skin_);
    return out;
  }

 private:
  // A ring of vertices across an axis of a link's box, at a place of -1 to 1 along it.
  void add_ring(std::uint32_t link, std::size_t axis, double along) {
    const Box& box = body_.leaves[link].box;
    for (const auto& corner : kSection) {
      Vec3 point;
      for (std::size_t k = 0; k < 3; ++k) {
        const double at = k == axis ? along : corner[(k + 2 - axis) % 3];
        point[k] = static_cast<double>(box.center[k]) + at * static_cast<double>(box.half[k]);
      }
      for (std::size_t c = 0; c < 3; ++c) skin_.vertices.push_back(static_cast<float>(point[c] + rest_[link][c]));
      add_weights(link, point, kReach * static_cast<double>(box.half[axis]));
    }
  }

  void add_weights(std::uint32_t link, const Vec3& point, double reach) {
    double left = 1;
    std::size_t used = 0;
    const auto add = [&](std::uint32_t by, double weight) {
      skin_.influence_links.push_back(by);
      skin_.influence_weights.push_back(static_cast<float>(weight));
      left -= weight;
      ++used;
    };
    const std::int32_t parent = body_.link_parents[link];
    if (parent >= 0) add(static_cast<std::uint32_t>(parent), weight_at(point, {0, 0, 0}, reach));
    for (std::uint32_t child = link + 1; child < joints_.size(); ++child)
      if (body_.link_parents[child] == static_cast<std::int32_t>(link))
        add(child, std::min(weight_at(point, joints_[child], reach), left / 2));
    add(link, left);
    for (; used < most_; ++used) {
      skin_.influence_links.push_back(link);
      skin_.influence_weights.push_back(0);
    }
  }

  static void add_triangles(std::uint32_t first, std::vector<std::uint32_t>& out) {
    for (std::uint32_t r = 0; r < kSteps; ++r)
      for (std::uint32_t s = 0; s < kSides; ++s) {
        const std::uint32_t low = first + r * kSides + s, beside = first + r * kSides + (s + 1) % kSides;
        for (const std::uint32_t v : {low, beside, low + kSides, beside, beside + kSides, low + kSides})
          out.push_back(v);
      }
  }

  const Character& body_;
  std::vector<Vec3> joints_, rest_;  // in the parent's frame, and in the skin's
  std::size_t most_ = 0;             // links that move a vertex
  BodySkin skin_;
};

}  // namespace

CrowdGroup with_skin(CrowdGroup humanoids, SkinLeafKind leaves) {
  PosedGroup posed;
  const std::uint32_t one = 0;
  humanoids.pose(0, Chosen::of({&one, 1}), posed);
  humanoids.figure = SkinMaker(humanoids.figure, joints_of(humanoids.figure, posed)).make(leaves);
  return humanoids;
}

}  // namespace cab::scenes
