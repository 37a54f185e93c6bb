// Bodies from a skeleton in plain arrays.
#include "layout/valid_poses.h"
#include "scenes/affine.h"
#include "scenes/rig/desc_of.h"
#include "scenes/rig/leaf_box.h"
#include "scenes/rig/leaf_range.h"
#include "scenes/rig/skeleton_bodies.h"

#include <cab/rig.h>

#include <cmath>
#include <memory>
#include <new>
#include <utility>

namespace cab::rig {

struct Bodies::Storage {
  std::vector<std::int32_t> link_parents;
  std::vector<std::vector<ConvexPart>> parts;  // [leaf]
  std::vector<Leaf> leaves;
  std::vector<LinkPair> ignored_pairs;
};

namespace {

using namespace cab::scenes;

// As validated by the library for the poses of a frame (InstanceFlag).
constexpr double kRigidTolerance = 1e-3;

// Arrays that a SkeletonView borrows.
struct Arrays {
  std::vector<std::string> names;
  std::vector<std::int32_t> parents;
  std::vector<bool> is_end_site;
  std::vector<double> rest_offsets, rotations, positions;
};

// Reads one pose. False if it is not rigid or not finite.
bool read_pose(PoseFormat format, const float* p, Arrays& out) {
  for (std::size_t i = 0; i < pose_floats(format); ++i) {
    const bool is_read = format != PoseFormat::kMatrix4x4Columns || i % 4 != 3;
    if (is_read && !(std::fabs(p[i]) <= kMaxCoordinate)) return false;
  }
  Quat q = {0, 0, 0, 1};
  Vec3 place = {0, 0, 0};
  if (format == PoseFormat::kQuaternionTranslation) {
    const double n = std::sqrt(double{p[0]} * p[0] + double{p[1]} * p[1] + double{p[2]} * p[2] + double{p[3]} * p[3]);
    if (!(n >= kRigidTolerance && n <= 1 / kRigidTolerance)) return false;
    q = normalized({p[0], p[1], p[2], p[3]});
    place = {p[4], p[5], p[6]};
  } else {
    const bool by_rows = format == PoseFormat::kMatrix3x4Rows;
    Affine matrix;
    for (std::size_t c = 0; c < 4; ++c) {
      Vec3& column = c < 3 ? matrix.columns[c] : matrix.translation;
      for (std::size_t r = 0; r < 3; ++r) column[r] = static_cast<double>(p[by_rows ? 4 * r + c : 4 * c + r]);
    }
    q = rotation_of(matrix);
    place = matrix.translation;
    for (std::size_t c = 0; c < 3; ++c) {
      Vec3 axis = {0, 0, 0};
      axis[c] = 1;
      if (!(length(rotate(q, axis) - matrix.columns[c]) <= kRigidTolerance)) return false;
    }
  }
  out.rotations.insert(out.rotations.end(), q.begin(), q.end());
  out.positions.insert(out.positions.end(), place.begin(), place.end());
  return true;
}

bool read_poses(const SkeletonDesc& skeleton, Arrays& out) {
  const PoseView& poses = skeleton.poses;
  const std::size_t joints = skeleton.parents.size;
  if (!valid_poses(poses, joints) || skeleton.pose_count == 0) return false;
  const std::size_t link_stride = link_bytes(poses), stride = instance_bytes(poses, joints);
  for (std::size_t f = 0; f < skeleton.pose_count; ++f) {
    for (std::size_t j = 0; j < joints; ++j)
      if (!read_pose(poses.format, poses.data + (f * stride + j * link_stride) / sizeof(float), out)) return false;
  }
  return true;
}

bool has_good_parents(Span<const std::int32_t> parents) {
  if (parents.data == nullptr || parents[0] != -1) return false;
  for (std::size_t j = 1; j < parents.size; ++j)
    if (parents[j] < -1 || parents[j] >= static_cast<std::int32_t>(j)) return false;
  return true;
}

Status make_bodies(const SkeletonDesc& skeleton, const SkeletonOptions& options, Bodies* bodies) {
  const std::size_t joints = skeleton.parents.size;
  if (joints == 0 || joints > kMaxLinks) return Status::kBadJoints;
  if (!has_good_parents(skeleton.parents)) return Status::kBadParents;
  const bool has_names = skeleton.names.size != 0;
  if (has_names && (skeleton.names.size != joints || skeleton.names.data == nullptr)) return Status::kBadNames;
  if (!(options.stature >= 0 && std::isfinite(options.stature) && options.thickness > 0 &&
        std::isfinite(options.thickness)))
    return Status::kBadSize;
  Arrays arrays;
  if (!read_poses(skeleton, arrays)) return Status::kBadPoses;
  for (std::size_t j = 0; j < joints; ++j) {
    if (has_names && skeleton.names[j] == nullptr) return Status::kBadNames;
    arrays.names.emplace_back(has_names ? skeleton.names[j] : "");
    arrays.parents.push_back(skeleton.parents[j]);
  }
  arrays.is_end_site.assign(joints, false);
  arrays.rest_offsets.assign(3 * joints, 0);
  const SkeletonView view = {arrays.names,     arrays.parents,   arrays.is_end_site, arrays.rest_offsets,
                             arrays.rotations, arrays.positions, skeleton.pose_count};
  for (std::size_t j = 1; j < joints; ++j) {
    const Vec3 offset = local_offset(view, 0, j);
    for (std::size_t k = 0; k < 3; ++k) arrays.rest_offsets[3 * j + k] = offset[k];
  }

  const SkeletonBodies guess = guess_bodies(view, {options.stature, options.thickness});
  auto storage = std::make_unique<Bodies::Storage>();
  for (std::size_t j = 0; j < joints; ++j)
    storage->link_parents.push_back(j == 0 ? -1 : static_cast<std::int32_t>(parent_of(view, j)));
  for (const SkeletonBody& body : guess.bodies) {
    if (!body.is_solid) continue;
    const auto link = static_cast<std::uint32_t>(body.joint);
    if (storage->leaves.empty() || storage->leaves.back().link != link) {
      storage->leaves.push_back({link, {}, {}});
      storage->parts.emplace_back();
    }
    storage->parts.back().push_back(convex_part(body));
  }
  if (storage->leaves.empty()) return Status::kNothingToCover;
  for (std::size_t l = 0; l < storage->leaves.size(); ++l) {
    const std::vector<ConvexPart>& parts = storage->parts[l];
    storage->leaves[l].box = leaf_box(parts);
    storage->leaves[l].parts = parts;
    if (!is_in_range(storage->leaves[l])) return Status::kBadSize;
  }
  storage->ignored_pairs = adjacent_joints(guess);
  *bodies = Bodies(storage.release());
  return Status::kOk;
}

}  // namespace

const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::kOk: return "ok";
    case Status::kOutOfMemory: return "an allocation failed";
    case Status::kBadJoints: return "there must be 1 to 1024 joints";
    case Status::kBadParents:
      return "parents must be -1 for the first joint, and -1 or an earlier joint for every other";
    case Status::kBadNames: return "names must be empty or hold one string per joint";
    case Status::kBadPoses:
      return "poses needs data of a known format, a valid stride, at least one pose, and rigid, finite values";
    case Status::kBadSize:
      return "stature must be finite and 0 or more, thickness finite and above 0, sizes above 0 and up to 1e18";
    case Status::kNothingToCover: return "no two joints are apart, so there is nothing to make bodies of";
    case Status::kBadOutput: return "bodies is null";
  }
  return "unknown status";
}

Bodies::Bodies(Bodies&& other) noexcept : storage_(std::exchange(other.storage_, nullptr)) {}

Bodies& Bodies::operator=(Bodies&& other) noexcept {
  if (this == &other) return *this;
  delete storage_;
  storage_ = std::exchange(other.storage_, nullptr);
  return *this;
}

Bodies::~Bodies() { delete storage_; }

ArticulationDesc Bodies::desc() const noexcept { return desc_of(storage_); }

Status bodies_from_skeleton(const SkeletonDesc& skeleton, const SkeletonOptions& options, Bodies* bodies) noexcept {
  if (bodies == nullptr) return Status::kBadOutput;
  try {
    return make_bodies(skeleton, options, bodies);
  } catch (const std::bad_alloc&) { return Status::kOutOfMemory; }
}

}  // namespace cab::rig
