// The motion of named nodes.
#include "scenes/import/motion.h"

#include "scenes/vec3d.h"

#include <memory>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace cab::scenes {
namespace {

constexpr std::int32_t kSeveral = -2;

std::string_view after_colon(std::string_view name) {
  const std::size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

// The index of each name after its last colon, or kSeveral.
std::unordered_map<std::string_view, std::int32_t> by_last_part(const std::vector<std::string>& names) {
  std::unordered_map<std::string_view, std::int32_t> index_of;
  for (std::size_t n = 0; n < names.size(); ++n) {
    if (names[n].empty()) continue;
    const auto [entry, is_new] = index_of.try_emplace(after_colon(names[n]), static_cast<std::int32_t>(n));
    if (!is_new) entry->second = kSeveral;
  }
  return index_of;
}

}  // namespace

Motion motion_of_skeleton(Skeleton skeleton, const std::string& file) {
  Motion motion;
  motion.file = file;
  motion.frame_seconds = skeleton.frame_seconds;
  motion.frame_count = skeleton.frame_count;
  motion.notes = std::move(skeleton.notes);
  motion.alterations = std::move(skeleton.alterations);
  const std::size_t joints = skeleton.joint_names.size();
  std::unordered_map<std::string_view, std::size_t> seen;
  for (std::size_t j = 0; j < joints; ++j) {
    const std::string& name = skeleton.joint_names[j];
    const bool is_meant = !skeleton.is_end_site[j] && seen.try_emplace(name, j).second;
    motion.names.push_back(is_meant ? name : std::string());
  }
  motion.is_moved.assign(joints, true);
  motion.rest_scale.assign(joints, 1);
  motion.scale_above.assign(joints, 1);
  motion.local = [s = std::make_shared<const Skeleton>(std::move(skeleton)), joints](std::size_t j, std::uint32_t f) {
    const auto rotation = [&](std::size_t joint) -> Quat {
      const double* const q = s->rotations.data() + 4 * (f * joints + joint);
      return {q[0], q[1], q[2], q[3]};
    };
    const auto position = [&](std::size_t joint) -> Vec3 {
      const double* const p = s->positions.data() + 3 * (f * joints + joint);
      return {p[0], p[1], p[2]};
    };
    Quat turned = rotation(j);
    Affine local;
    local.translation = position(j);
    if (s->joint_parents[j] >= 0) {
      const auto parent = static_cast<std::size_t>(s->joint_parents[j]);
      const Quat back = conjugate(rotation(parent));
      turned = normalized(multiply(back, turned));
      local.translation = rotate(back, local.translation - position(parent));
    }
    for (Vec3& column : local.columns) column = rotate(turned, column);
    return local;
  };
  return motion;
}

std::vector<std::int32_t> match_names(const std::vector<std::string>& names, const std::vector<std::string>& others) {
  std::unordered_map<std::string_view, std::int32_t> exact;
  for (std::size_t n = 0; n < others.size(); ++n)
    if (!others[n].empty()) exact.try_emplace(others[n], static_cast<std::int32_t>(n));
  const auto own_parts = by_last_part(names), other_parts = by_last_part(others);
  std::vector<std::int32_t> match(names.size(), -1);
  for (std::size_t n = 0; n < names.size(); ++n) {
    if (names[n].empty()) continue;
    if (const auto found = exact.find(names[n]); found != exact.end()) {
      match[n] = found->second;
      continue;
    }
    const std::string_view part = after_colon(names[n]);
    const auto found = other_parts.find(part);
    if (found != other_parts.end() && found->second != kSeveral && own_parts.at(part) != kSeveral)
      match[n] = found->second;
  }
  return match;
}

}  // namespace cab::scenes
