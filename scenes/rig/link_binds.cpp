// One inverse bind matrix per link, for a skin whose meshes may each have their own.
#include "scenes/rig/link_binds.h"

#include "scenes/rig/disjoint_sets.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>

namespace cab::scenes {
namespace {

using rig::SkinStatus;

// Two matrices are the same if they take the corners of a group's box to places that are closer than this share of the
// box's diagonal. Exporters write matrices of floats, and compute them in floats from far away places.
constexpr double kSameMatrix = 1e-4;
// The determinant of a matrix with columns of length 1, below which it has no inverse: as in layout/fit_skin.cpp.
constexpr double kLeastBindVolume = 1e-9;

double volume(const Affine& a) { return dot(a.columns[0], cross(a.columns[1], a.columns[2])); }

bool has_inverse(const Affine& a) {
  return std::fabs(volume(a)) > kLeastBindVolume * length(a.columns[0]) * length(a.columns[1]) * length(a.columns[2]);
}

Affine inverse(const Affine& a) {
  const double scale = 1 / volume(a);
  const Vec3 rows[3] = {scale * cross(a.columns[1], a.columns[2]), scale * cross(a.columns[2], a.columns[0]),
                        scale * cross(a.columns[0], a.columns[1])};
  Affine back;
  for (std::size_t c = 0; c < 3; ++c) back.columns[c] = {rows[0][c], rows[1][c], rows[2][c]};
  back.translation = -1.0 * turn(back, a.translation);
  return back;
}

bool operator==(const Affine& a, const Affine& b) { return a.columns == b.columns && a.translation == b.translation; }

// Bones, and the box of the vertices that they move.
struct BoneGroup {
  std::vector<std::uint32_t> bones;
  Vec3 low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void add(const Vec3& point) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point[k]);
      high[k] = std::max(high[k], point[k]);
    }
  }
  std::vector<Vec3> corners() const {
    std::vector<Vec3> points;
    for (int c = 0; c < 8; ++c)
      points.push_back({c & 1 ? high[0] : low[0], c & 2 ? high[1] : low[1], c & 4 ? high[2] : low[2]});
    return points;
  }
  // Whether two maps take the box to the same place.
  bool are_same(const Affine& a, const Affine& b) const {
    if (a == b) return true;
    const std::vector<Vec3> points = corners();
    const double size = length(transform(a, points.back()) - transform(a, points.front()));
    return std::all_of(points.begin(), points.end(), [&](const Vec3& point) {
      return length(transform(a, point) - transform(b, point)) <= kSameMatrix * size;
    });
  }
};

// The bones that move triangles, those with a vertex in common in one group.
std::vector<BoneGroup> group_bones(const CheckedSkin& skin) {
  DisjointSets sets(skin.bone_count());
  for (const Triangle& triangle : skin.triangles())
    for (const std::uint32_t v : triangle)
      for (const CheckedSkin::Influence& influence : skin.influences(v))
        sets.join(skin.influences(v)[0].bone, influence.bone);
  std::vector<BoneGroup> groups(skin.bone_count());
  std::vector<bool> moves(skin.bone_count(), false);
  for (const Triangle& triangle : skin.triangles())
    for (const std::uint32_t v : triangle) {
      groups[sets.find(skin.influences(v)[0].bone)].add(skin.vertex(v));
      for (const CheckedSkin::Influence& influence : skin.influences(v)) moves[influence.bone] = true;
    }
  for (std::uint32_t bone = 0; bone < moves.size(); ++bone)
    if (moves[bone]) groups[sets.find(bone)].bones.push_back(bone);
  groups.erase(std::remove_if(groups.begin(), groups.end(), [](const BoneGroup& g) { return g.bones.empty(); }),
               groups.end());
  return groups;
}

// Takes groups one after the other, and keeps the matrices of their links.
class BindMaker {
 public:
  BindMaker(const CheckedSkin& skin, const LinkMap& map, const std::vector<Affine>& rest, LinkBinds& out)
      : skin_(skin), map_(map), rest_(rest), out_(out), is_bound_(map.joints.size(), false) {
    out.of_link.assign(map.joints.size(), {});
    out.move_of_bone.assign(skin.bone_count(), 0);
  }

  std::uint32_t link_of(std::uint32_t bone) const { return map_.link_of_joint[skin_.joint_of(bone)]; }

  SkinStatus add(const BoneGroup& group, std::uint32_t& bad_bone) {
    Affine move;
    bool is_found = false;
    for (const std::uint32_t bone : group.bones) {
      bad_bone = bone;
      const Affine bind = own_bind(bone);
      if (!has_inverse(bind)) return SkinStatus::kNoInverse;
      const std::uint32_t link = link_of(bone);
      if (is_found || !is_bound_[link]) continue;
      if (!(bind == out_.of_link[link])) move = multiply(inverse(out_.of_link[link]), bind);
      is_found = true;
    }
    const bool moves = !(move == Affine());
    for (const std::uint32_t bone : group.bones) {
      bad_bone = bone;
      out_.move_of_bone[bone] = static_cast<std::uint32_t>(out_.moves.size());
      const std::uint32_t link = link_of(bone);
      const Affine bind = own_bind(bone);
      if (!is_bound_[link])
        out_.of_link[link] = moves ? multiply(bind, inverse(move)) : bind;
      else if (!group.are_same(multiply(out_.of_link[link], move), bind))
        return SkinStatus::kBindsDiffer;
      is_bound_[link] = true;
    }
    out_.moves.push_back(moves ? std::optional<Affine>(move) : std::nullopt);
    return SkinStatus::kOk;
  }

 private:
  // From the bone's mesh to its link.
  Affine own_bind(std::uint32_t bone) const {
    const Affine& joint = rest_[skin_.joint_of(bone)];
    const RigidFrame link = rigid_frame(joint);
    Affine stretch;  // what is left of the joint's matrix
    for (std::size_t k = 0; k < 3; ++k) stretch.columns[k] = rotate(conjugate(link.rotation), joint.columns[k]);
    return multiply(stretch, skin_.inverse_bind(bone));
  }

  const CheckedSkin& skin_;
  const LinkMap& map_;
  const std::vector<Affine>& rest_;
  LinkBinds& out_;
  std::vector<bool> is_bound_;
};

}  // namespace

SkinStatus make_link_binds(const CheckedSkin& skin, const LinkMap& map, const std::vector<Affine>& rest, LinkBinds& out,
                           std::uint32_t& bad_bone) {
  std::vector<BoneGroup> groups = group_bones(skin);
  std::stable_sort(groups.begin(), groups.end(),
                   [](const BoneGroup& a, const BoneGroup& b) { return a.bones.size() > b.bones.size(); });
  BindMaker maker(skin, map, rest, out);
  std::vector<std::vector<std::size_t>> groups_of_link(map.joints.size());
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const std::uint32_t bone : groups[g].bones) groups_of_link[maker.link_of(bone)].push_back(g);
  // Next is a group that has a joint in common with those before, so that no group is bound before it must be moved;
  // among several the one of most bones.
  std::vector<bool> is_done(groups.size(), false);
  std::priority_queue<std::size_t, std::vector<std::size_t>, std::greater<std::size_t>> bound;
  for (std::size_t first = 0; first < groups.size(); ++first) {
    bound.push(first);
    while (!bound.empty()) {
      const std::size_t next = bound.top();
      bound.pop();
      if (is_done[next]) continue;
      is_done[next] = true;
      if (const SkinStatus status = maker.add(groups[next], bad_bone); status != SkinStatus::kOk) return status;
      for (const std::uint32_t bone : groups[next].bones) {
        for (const std::size_t group : groups_of_link[maker.link_of(bone)]) bound.push(group);
        groups_of_link[maker.link_of(bone)].clear();
      }
    }
  }
  return SkinStatus::kOk;
}

}  // namespace cab::scenes
