// The rounding bounds of every kernel, in one place. u = 2^-24, S = sum of half extents, M = largest magnitude of
// a centre coordinate. docs/numerics.md says where each comes from.
#pragma once

namespace cab::kernel {

// A posed leaf box: half += kPosePadSize S + kPosePadPlace (max|t| + |c|_1), t the link's translation, c the local
// centre.
inline constexpr float kPosePadSize = 0x1p-19f;
inline constexpr float kPosePadPlace = 0x1p-19f;

// A merged box: half += kMergePadSize S + kMergePadPlace M + kMergePadTiny, S and M of the unpadded result.
inline constexpr float kMergePadSize = 0x1p-18f;
inline constexpr float kMergePadPlace = 0x1p-23f;
inline constexpr float kMergePadTiny = 4 * 0x1p-126f;

// Stored bounds of a box: lo and hi are this much (S + M) wider than the box.
inline constexpr float kBoundsPad = 0x1p-20f;

// The overlap test: an axis separates only beyond this fraction of Sa + Sb. kOverlapTiny is added to Sa + Sb first,
// so that boxes near the end of float's range keep some slack.
inline constexpr float kSlackWorld = 0x1p-21f;
inline constexpr float kSlackFace = 0x1p-18f;
inline constexpr float kSlackEdge = 0x1p-17f;
inline constexpr float kOverlapTiny = 0x1p-100f;

// The paper's parallel test, two-sided and free of scale: |u1 x u2|^2 <= kParallel |u1|^2 |u2|^2.
inline constexpr float kParallel = 2e-5f;

// |R^T R - I| above which a pose's matrix is no rotation, and the range of a quaternion's squared length.
inline constexpr float kRigidTolerance = 1e-3f;
inline constexpr float kQuaternionSqMin = 1e-6f;
inline constexpr float kQuaternionSqMax = 1e6f;

}  // namespace cab::kernel
