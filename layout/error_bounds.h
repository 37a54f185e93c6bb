// The rounding bounds of the library, in one place. u = 2^-24, S = sum of half extents, M = largest magnitude of a
// centre's coordinate. docs/proof.md derives each constant. Beside it stand the step and the least value that the step
// allows.
#pragma once

namespace cab {

// ----------------------------------------------------------------------------------------------- posed leaf boxes

// What a posed leaf box grows by: half += body (S + |c|_1) + translation max|t| + kMergePadTiny + margin. c is the local
// centre, t the link's translation as it is added (rotated already, where the instance is). margin is kMarginShare of
// the frame's.
struct PosePad {
  float body;
  float translation;
  float margin = 0;
};
inline constexpr PosePad kPosePad = {0x1p-19f, 0x1p-22f};             // 32 u and 4 u; steps 2.5, 2.6: 31.3 u and 2 u
inline constexpr PosePad kPosePadRotated = {0x1.cp-19f, 0x1.8p-19f};  // 56 u and 48 u; step 2.7: 51.5 u and 39.1 u

// What each of two boxes grows by for a margin: a half, and 16 u of that; step 2.9: 15.3 u.
inline constexpr float kMarginShare = 0x1.00002p-1f;

// Axes of a leaf box closer to orthonormal than this are kept bit for bit. 4 u; a part of what steps 2.1 and 2.5 pad.
inline constexpr double kAxesExact = 0x1p-22;

// A convex part may exceed its leaf's box by this fraction of the box's S. 4 u: an eighth of the padding of step 2.5.
inline constexpr double kShapeTolerance = 0x1p-22;

// |R^T R - I| above which a pose's matrix is no rotation (step 2.3), and the range of a quaternion's squared length.
inline constexpr float kRigidTolerance = 1e-3f;
inline constexpr float kQuaternionSqMin = 1e-6f;
inline constexpr float kQuaternionSqMax = 1e6f;

// --------------------------------------------------------------------------------------------------- merged boxes

// A merged box: half += kMergePadSize S + kMergePadCenter M + kMergePadTiny, S and M of the unpadded result.
inline constexpr float kMergePadSize = 0x1p-18f;       // 64 u; step 3.6: 62.9 u
inline constexpr float kMergePadCenter = 0x1p-23f;     // 2 u; step 3.4: 1.74 u
inline constexpr float kMergePadTiny = 4 * 0x1p-126f;  // steps 2.8 and 3.7: 2^-144

// The paper's parallel test, two-sided and free of scale: |u1 x u2|^2 <= kParallel |u1|^2 |u2|^2.
inline constexpr float kParallel = 2e-5f;

// --------------------------------------------------------------------------------------------- axis-aligned bounds

// Stored bounds of a box: lo and hi are this much (S + M) wider than the box. 16 u; step 4.3: 13.1 u.
inline constexpr float kBoundsPad = 0x1p-20f;

// Bounds of an instance in the world are this much (|origin| + |bound|) wider. 2^-51; step 4.4: a little over 2^-52.
inline constexpr double kWorldPad = 0x1p-51;

// A number in double that becomes a float moves outwards by this fraction of it first. 4 u; step 4.5: a little over u.
inline constexpr double kOutwards = 0x1p-22;

// Leaf bounds moved to another origin grow by kMovePad of the result and kShiftPad of the shift. 4 u and 4 u^2; step
// 4.6: 2 u and 2 u^2, and what forming the sum rounds.
inline constexpr float kMovePad = 0x1p-22f;
inline constexpr float kShiftPad = 0x1p-46f;

// ------------------------------------------------------------------------------------------------ the overlap test

// World axes of leaves separate only beyond this fraction of Sa + Sb. 8 u; step 5.2: 6.1 u.
inline constexpr float kSlackWorld = 0x1p-21f;

// For the fifteen axes, each half extent of both boxes grows by kSlackGrow (Sa + Sb), so that slack shrinks with an
// axis: at least 48 u on a face (step 5.3: 28.6 u), 48 u times its length on an edge (step 5.6: 37.7 u).
inline constexpr float kSlackGrow = 0x1.8p-20f;

// An edge has this fraction of Sb on top, whatever its length: what is left of R's entries where they should be zero.
// 16 u; step 5.6: 13.2 u.
inline constexpr float kSlackEdge = 0x1p-20f;

// Added to Sa + Sb first, so that boxes near the end of float's range keep some slack; step 5.7.
inline constexpr float kOverlapTiny = 0x1p-100f;

// ------------------------------------------------------------------------------------------------- boxes of links

// The half extents of a link's box exceed what the boxes in it need by a part of S and a part of |C|_1: what the leaf
// predicate's slack and the rounding of posing reach (steps 6.3 and 6.5).
inline constexpr double kLinkGrowSize = 0x1.8p-10;       // 1.46e-3; step 6.5: 1.20e-3
inline constexpr double kLinkGrowTranslation = 0x1p-17;  // 128 u; step 6.5: 58 u

// Added to S, so that links of points keep some slack, as kOverlapTiny does for the overlap test (step 6.6).
inline constexpr double kLinkTiny = 0x1p-100;

// What padding and margins are multiplied by when a link's box is posed: a leaf's padding reaches sqrt 3 times as far
// along its corners, and the centres of both boxes are rounded. Step 6.4: 2.61.
inline constexpr float kLinkPads = 2.75f;

// Numbers of a posed link box are at most this many times as large as a leaf's may be. Step 6.7: 3.99.
inline constexpr float kLinkRange = 4;

// ---------------------------------------------------------------------------------------------- the box of a mesh

// Widths that differ by less than this fraction of the longest are equal, since vertices are rounded. 16 u; step 7.1.
inline constexpr double kSameWidth = 0x1p-20;

// Components of axes below this are rounding errors of the eigen-solver. u / 4; step 7.2.
inline constexpr double kZeroComponent = 0x1p-26;

// What a half extent in double is larger by, for each entry of the axis times its offset. 2^-48; step 7.3: 21 x 2^-53.
inline constexpr double kFitPad = 0x1p-48;

// ---------------------------------------------------------------------------------------------------- exact tests

// Rounding of FCL's support points and of poses in double, with room; step 8.1.
inline constexpr double kGapRounding = 0x1p-40;

}  // namespace cab
