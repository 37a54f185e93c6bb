// Parts of a batch's input.
#pragma once

#include <cab/types.h>

#include <cstddef>
#include <cstdint>

namespace cab::mpi {

inline std::size_t floats_of(PoseFormat format) {
  if (format == PoseFormat::kQuaternionTranslation) return 7;
  return format == PoseFormat::kMatrix3x4Rows ? 12 : 16;
}
inline std::size_t link_stride(const PoseView& poses) {
  return poses.link_stride != 0 ? poses.link_stride : floats_of(poses.format) * sizeof(float);
}
inline std::size_t instance_stride(const PoseView& poses, std::uint32_t link_count) {
  return poses.instance_stride != 0 ? poses.instance_stride : link_stride(poses) * link_count;
}

// The pose of one link of one instance.
inline const float* pose_at(const PoseView& poses, std::uint32_t link_count, std::size_t instance, std::size_t link) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(poses.data);
  return reinterpret_cast<const float*>(bytes + instance * instance_stride(poses, link_count) +
                                        link * link_stride(poses));
}

template <class T>
Span<const T> part_of(Span<const T> values, std::size_t per_instance, std::uint32_t first, std::uint32_t count) {
  if (values.empty()) return {};
  return {values.data + per_instance * first, per_instance * count};
}

// Poses, places, scales and margins of the instances from `first` on, for an input with no other lists.
inline BatchInput part_of(const BatchInput& input, std::uint32_t first, std::uint32_t count, std::uint32_t link_count) {
  BatchInput out;
  out.poses = input.poses;
  out.poses.data = pose_at(input.poses, link_count, first, 0);
  out.origins = part_of(input.origins, 3, first, count);
  out.orientations = part_of(input.orientations, 4, first, count);
  out.scales = part_of(input.scales, 1, first, count);
  out.margins = part_of(input.margins, 1, first, count);
  out.count = count;
  return out;
}

}  // namespace cab::mpi
