// Joint states that become poses.
#pragma once

#include "engine/step/frame_context.h"
#include "engine/step/pose_scratch.h"

#include <cab/kinematics.h>

namespace cab {

// Why a KinematicsDesc is refused, or kOk. Statuses: those of compute_link_poses.
Status validate_kinematics(const KinematicsDesc& desc);

// Makes the poses of a tile of a sequence that is given by its states: the caller's, and the same in lanes, in
// scratch.links.
void pose_states(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t tile, PoseScratch& scratch);

}  // namespace cab
