// The rounding bounds of every kernel, in one place. u = 2^-24, S = sum of half extents, M = largest magnitude of
// a centre coordinate. docs/proof.md derives each; the step is named beside it, with what it must be at least.
#pragma once

namespace cab::kernel {

// A posed leaf box: half += body (S + |c|_1) + place max|t| + kMergePadTiny, c the local centre, t the link's
// translation as it is added, turned already where the instance is. apart comes on top: kMarginShare of a margin.
struct PosePad {
  float body;
  float place;
  float apart = 0;
};
inline constexpr PosePad kPosePad = {0x1p-19f, 0x1p-22f};            // 32 u and 4 u; steps 2.5, 2.6: 31.3 u and 2 u
inline constexpr PosePad kPosePadTurned = {0x1.cp-19f, 0x1.8p-19f};  // 56 u and 48 u; step 2.7: 51.5 u and 39.1 u

// What each of two boxes grows by for a margin: a half and 16 u of that; step 2.9: 15.3 u.
inline constexpr float kMarginShare = 0x1.00002p-1f;

// A merged box: half += kMergePadSize S + kMergePadPlace M + kMergePadTiny, S and M of the unpadded result.
inline constexpr float kMergePadSize = 0x1p-18f;       // 64 u; step 3.6: 62.9 u
inline constexpr float kMergePadPlace = 0x1p-23f;      // 2 u; step 3.4: 1.74 u
inline constexpr float kMergePadTiny = 4 * 0x1p-126f;  // steps 2.8 and 3.7: 2^-144

// Stored bounds of a box: lo and hi are this much (S + M) wider than the box. 16 u; step 4.3: 13.1 u.
inline constexpr float kBoundsPad = 0x1p-20f;

// The overlap test. World axes of leaves separate only beyond this fraction of Sa + Sb. 8 u; step 5.2: 6.1 u.
inline constexpr float kSlackWorld = 0x1p-21f;

// For the fifteen axes, each half extent of both boxes grows by kSlackGrow (Sa + Sb), so that slack shrinks with an
// axis: at least 48 u on a face (step 5.3: 28.6 u), 48 u times its length on an edge (step 5.6: 37.7 u).
inline constexpr float kSlackGrow = 0x1.8p-20f;

// An edge has this fraction of Sb on top, whatever its length: what is left of R's entries where they should be zero.
// 16 u; step 5.6: 13.2 u.
inline constexpr float kSlackEdge = 0x1p-20f;

// Added to Sa + Sb first, so that boxes near the end of float's range keep some slack; step 5.7.
inline constexpr float kOverlapTiny = 0x1p-100f;

// The paper's parallel test, two-sided and free of scale: |u1 x u2|^2 <= kParallel |u1|^2 |u2|^2.
inline constexpr float kParallel = 2e-5f;

// |R^T R - I| above which a pose's matrix is no rotation (step 2.3), and the range of a quaternion's squared length.
inline constexpr float kRigidTolerance = 1e-3f;
inline constexpr float kQuaternionSqMin = 1e-6f;
inline constexpr float kQuaternionSqMax = 1e6f;

}  // namespace cab::kernel
