// The limits of import. With them no file can make the import allocate or loop without bound.
#pragma once

#include <cstddef>

namespace cab::scenes {

inline constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxJoints = 8192;                       // of BVH and ASF
inline constexpr std::size_t kMaxJointFrames = std::size_t{1} << 24;  // 56 bytes per joint and frame in a Skeleton
inline constexpr std::size_t kMaxPoseFloats = std::size_t{1} << 28;   // of one character in a world
inline constexpr double kMaxFrameSeconds = 3600;
inline constexpr double kMaxImportValue = 1e9;  // of an offset, key or angle, in the file's unit

}  // namespace cab::scenes
