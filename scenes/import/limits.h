// The limits of import. With them no file can make the import allocate or loop without bound.
#pragma once

#include "scenes/sandbox/sandbox.h"

#include <cstddef>

namespace cab::scenes {

inline constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxJoints = 8192;                         // of BVH and ASF
inline constexpr std::size_t kMaxJointFrames = std::size_t{1} << 24;    // 56 bytes per joint and frame in a Skeleton
inline constexpr std::size_t kMaxPoseFloats = std::size_t{1} << 28;     // of one character in a world
inline constexpr std::size_t kMaxSkinVertices = std::size_t{1} << 22;   // of all meshes of a file
inline constexpr std::size_t kMaxSkinTriangles = std::size_t{1} << 23;  // of all meshes of a file
inline constexpr double kLeastUnit = 1e-9, kGreatestUnit = 1e9;         // metres
inline constexpr double kMaxFrameSeconds = 3600;
inline constexpr double kMaxImportValue = 1e9;  // of an offset, key or angle, in the file's unit

// Of a child process that reads one file. A BVH file of 250 MB takes 10 s of processor time and 1.8 GiB; a Skeleton is
// at most 0.9 GiB.
inline constexpr SandboxLimits kImportSandbox = {std::size_t{4} << 30, 60, 600, std::size_t{1} << 30};

}  // namespace cab::scenes
