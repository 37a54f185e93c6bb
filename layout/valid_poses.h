// Which views of poses are valid, whatever the poses are.
#pragma once

#include "layout/pose_coding.h"

namespace cab {

// Whether poses of link_count links, at least one, have data, if they need any, a known format, and strides that are
// wide enough and multiples of 4. Only matrices can hold a scale.
inline bool valid_poses(const PoseView& poses, std::size_t link_count, bool needs_data = true) {
  if ((needs_data && !poses.data) || poses.format > PoseFormat::kMatrix4x4Columns) return false;
  if (poses.has_scale && poses.format == PoseFormat::kQuaternionTranslation) return false;
  // In 64 bits, which hold the product below where std::size_t has 32.
  const std::uint64_t pose_bytes = pose_floats(poses.format) * sizeof(float);
  const std::uint64_t link_stride = poses.link_stride ? poses.link_stride : pose_bytes;
  const std::uint64_t instance_stride = poses.instance_stride;
  if (link_stride % 4 || instance_stride % 4 || link_stride < pose_bytes) return false;
  if (link_stride > (std::uint64_t{1} << 32) || instance_stride > (std::uint64_t{1} << 38)) return false;
  const std::uint64_t span = (link_count - 1) * link_stride + pose_bytes;
  return instance_stride == 0 || instance_stride >= span;
}

}  // namespace cab
