// compute_link_poses: poses of states, sixteen at a time.
#include "kernels/link_poses.h"
#include "engine/session/call.h"
#include "engine/step/joint_states.h"
#include "kernels/find_kernels.h"
#include "kernels/float_mode.h"
#include "layout/arena.h"

#include <cab/cab.h>

#include <algorithm>

namespace cab {

Status compute_link_poses(const KinematicsDesc& desc, Span<const double> states, Isa isa, Span<float> poses) noexcept {
  return guarded([&] {
    const kernel::KernelTable* const kernels = kernel::find_kernels(isa);
    if (!kernels) return Status::kIsaNotAvailable;
    if (const Status status = validate_kinematics(desc); status != Status::kOk) return status;
    const std::size_t floats = 7 * desc.link_parents.size, count = poses.size / floats;
    if (poses.size % floats != 0 || states.size != std::uint64_t{count} * desc.variable_count ||
        (poses.size && !poses.data) || (states.size && !states.data))
      return Status::kBadOutput;
    const kernel::FloatMode mode;
    Arena arena(default_allocator());
    const Span<double> scratch = arena.allocate<double>(7 * kLanes * desc.link_parents.size);
    const Span<float> block = arena.allocate<float>(kLanes * floats);
    const Span<kernel::RawPoses> links = arena.allocate<kernel::RawPoses>(desc.link_parents.size);
    for (std::size_t first = 0; first < count; first += kLanes) {
      const auto tile = static_cast<std::uint32_t>(std::min<std::size_t>(kLanes, count - first));
      kernels->pose_states({desc, states.data + first * desc.variable_count, tile, scratch.data, block.data, links.data,
                            poses.data + first * floats});
    }
    return Status::kOk;
  });
}

}  // namespace cab
