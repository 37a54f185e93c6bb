// Every rounding constant of layout, kernels and engine. The comment of a constant names the step of docs/proof.md that
// derives it, and the least value that the step allows. u = 2^-24, the rounding of a float. S is the sum of a box's
// half extents, M the largest magnitude of a coordinate of its centre.
#pragma once

namespace cab {

// ----------------------------------------------------------------------------------------------- posed leaf boxes

// How much a posed leaf box grows: half += body (S + |c|_1) + translation max|t| + kMergePadTiny + margin. c is the
// box's centre in the link's frame. t is the link's translation after the rotation by the instance's orientation.
// margin is kMarginShare times that of the frame plus twice the instance's own.
struct PosePad {
  float body;
  float translation;
};
// Without an orientation 32 u and 4 u; steps 2.5 and 2.6: 31.3 u and 2 u.
inline constexpr PosePad kPosePad = {0x1p-19f, 0x1p-22f};
// With an orientation 56 u and 48 u; step 2.7: 51.5 u and 39.1 u.
inline constexpr PosePad kPosePadRotated = {0x1.cp-19f, 0x1.8p-19f};

// Each of two boxes grows by half of a margin, and by 16 u of that half; step 2.9: 15.3 u.
inline constexpr float kMarginShare = 0x1.00002p-1f;

// How far an instance moves between two frames grows by this share of all lengths that it is made of. 128 u; step 2.11:
// 54 u.
inline constexpr double kSweepPad = 0x1p-17;

// The box of a skinned leaf grows for each link that moves it by this share of the lengths that it is made of, times
// the gain of the link's weights. 160 u; step 19.4: 146 u.
inline constexpr float kGrowPad = 0x1.4p-17f;

// These lengths have this share of the numbers in double that they come from; step 19.3: 2^-47 over kGrowPad.
inline constexpr double kGrowDoubles = 0x1p-30;

// Axes of a leaf box that are closer to orthonormal than this keep their bits. 4 u; steps 2.1 and 2.5 allow for it.
inline constexpr double kAxesExact = 0x1p-22;

// Axes of a leaf box whose max |R^T R - I| exceeds this are refused. Axes between kAxesExact and this are made
// orthonormal. Step 0.3.
inline constexpr double kAxesTolerance = 1e-5;

// A convex part may exceed its leaf's box by this fraction of the box's S. 4 u: an eighth of the padding of step 2.5.
inline constexpr double kShapeTolerance = 0x1p-22;

// The matrix of a pose is not a rotation if |R^T R - I| exceeds this; steps 0.3 and 2.3.
inline constexpr float kRigidTolerance = 1e-3f;

// The range of the squared length of a pose's quaternion; steps 0.3 and 2.2.
inline constexpr float kQuaternionSqMin = 1e-6f;
inline constexpr float kQuaternionSqMax = 1e6f;

// --------------------------------------------------------------------------------------------------- merged boxes

// A merged box grows: half += kMergePadSize S + kMergePadCenter M + kMergePadTiny, with S and M of the unpadded result.
inline constexpr float kMergePadSize = 0x1p-18f;       // 64 u; step 3.6: 62.9 u
inline constexpr float kMergePadCenter = 0x1p-23f;     // 2 u; step 3.4: 1.74 u
inline constexpr float kMergePadTiny = 4 * 0x1p-126f;  // for underflow; steps 2.8 and 3.7: 2^-144

// The paper's test of parallel axes, two-sided and free of scale: |u1 x u2|^2 <= kParallel |u1|^2 |u2|^2; step 1.3.
inline constexpr float kParallel = 2e-5f;

// --------------------------------------------------------------------------------------------- axis-aligned bounds

// Stored bounds extend beyond their box by this share of S + M at each end. 16 u; step 4.3: 13.1 u.
inline constexpr float kBoundsPad = 0x1p-20f;

// Bounds of an instance in the world are wider by this share of |origin| + |bound|. 2^-51; step 4.4: a little over
// 2^-52.
inline constexpr double kWorldPad = 0x1p-51;

// Bounds that the caller gives for an instance grow by this share of their largest coordinate, 1024 u, and by this
// share of the margin; step 4.7: 130 u, and 0.867.
inline constexpr double kGivenPad = 0x1p-14;
inline constexpr double kGivenMargin = 0.875;

// A bound in double first moves outwards by this share of itself, then becomes a float. 4 u; step 4.5: a little over u.
inline constexpr double kOutwards = 0x1p-22;

// Leaf bounds that move to another origin grow by kMovePad times the result and kShiftPad times the shift. 4 u and 4
// u^2; step 4.6: 2 u and 2 u^2, and the rounding of the sum itself.
inline constexpr float kMovePad = 0x1p-22f;
inline constexpr float kShiftPad = 0x1p-46f;

// ------------------------------------------------------------------------------------------------ the overlap test

// A world axis separates two leaves only if the gap exceeds this share of Sa + Sb. 8 u; step 5.2: 6.1 u.
inline constexpr float kSlackWorld = 0x1p-21f;

// For the fifteen axes each half extent of both boxes grows by kSlackGrow (Sa + Sb), so a shorter axis has less slack.
// The slack is at least 48 u for a face normal (step 5.3: 28.6 u), and 48 u times the length of the axis for a product
// of edges (step 5.6: 37.7 u).
inline constexpr float kSlackGrow = 0x1.8p-20f;

// The slack of a product of edges has this share of Sb in addition, whatever the length of the axis. It covers the
// rounding of entries of R that should be zero. 16 u; step 5.6: 13.2 u.
inline constexpr float kSlackEdge = 0x1p-20f;

// Added to Sa + Sb first, so that boxes near the small end of float's range keep some slack; step 5.7.
inline constexpr float kOverlapTiny = 0x1p-100f;

// ------------------------------------------------------------------------------------------------ leaves of a crowd

// Bounds that a crowd's leaves get straight from poses exceed those of the exactly posed box, with its margin, by
// kRigidBoundsSize (S + |c|_1) and kRigidBoundsCenter |C|_1. C is the posed centre. 192 u and 32 u; step 14.2: 180 u,
// or 121 u if a leaf has the axes of its link, and 10 u.
inline constexpr float kRigidBoundsSize = 0x1.8p-17f;
inline constexpr float kRigidBoundsCenter = 0x1p-19f;

// The same where instances have orientations, scales or margins of their own. 384 u and 160 u; step 14.10: 365 u and
// 133 u.
inline constexpr float kPlacedBoundsSize = 0x1.8p-16f;
inline constexpr float kPlacedBoundsCenter = 0x1.4p-17f;

// S + |c|_1 as these have it is larger by this share of itself, for its rounding to float. 16 u; step 14.2: u.
inline constexpr float kRigidSizeRounding = 0x1p-20f;

// Words of leaves are rounded down from numbers that are smaller by this, in words; step 14.3: 2^-8.
inline constexpr float kWordRounding = 0x1p-6f;

// A gap of two such leaves beyond kRigidUnsureSize times the sum of both S + |c|_1, and kRigidUnsureCenter times the
// sum of how far both instances reach, decides as the leaf predicate does. 768 u and 32 u; step 14.6: 744 u, or 447 u
// if leaves have the axes of their links, and 13 u.
inline constexpr float kRigidUnsureSize = 0x1.8p-15f;
inline constexpr float kRigidUnsureCenter = 0x1p-19f;

// The same where an instance has an orientation, a scale or a margin of its own. 1024 u and 192 u; step 14.11: 995 u
// and 168 u.
inline constexpr float kPlacedUnsureSize = 0x1p-14f;
inline constexpr float kPlacedUnsureCenter = 0x1.8p-17f;

// Sides of an instance in the world move outwards by these shares of themselves and of its bounds about its origin, and
// by kSideTiny. 3 u, and 2^-50; step 14.8: 2 u, and nothing, since origins have moved by kWorldPad.
inline constexpr float kSideRounding = 0x1.8p-23f;
inline constexpr float kSideOwn = 0x1p-50f;
inline constexpr float kSideTiny = 0x1p-120f;

// Searches of strips begin lower by this share, and what rows of a strip may reach grows by it. 16 u; step 14.9: 4 u.
inline constexpr float kStripRounding = 0x1p-20f;

// ------------------------------------------------------------------------------------------------- boxes of links

// The half extents of a link's box exceed what its leaf boxes need by these shares of S and of |C|_1, where C is its
// centre. They cover the slack of the leaf predicate and the rounding of posing (steps 6.3 and 6.5).
inline constexpr double kLinkGrowSize = 0x1.8p-10;       // 1.46e-3; step 6.5: 1.20e-3
inline constexpr double kLinkGrowTranslation = 0x1p-17;  // 128 u; step 6.5: 58 u

// Added to S, so that links whose leaves are points keep some slack, as kOverlapTiny does for the overlap test; step
// 6.6.
inline constexpr double kLinkTiny = 0x1p-90;

// The padding and the margin of a link's box are those of a leaf, times this. At a corner a leaf's padding extends sqrt
// 3 times as far, and the centres of both boxes are rounded. Step 6.4: 2.61.
inline constexpr float kLinkPads = 2.75f;

// The numbers of a posed link box may be this many times as large as those of a leaf box. Step 6.7: 3.99.
inline constexpr float kLinkRange = 4;

// ------------------------------------------------------------------------------------------------------- queries

// The index of run_queries holds positions between -1 and 1. Its bounds are larger by kQueryPad, 64 u, and where a ray
// or a point is may move by kQueryRayPad, 16 u, as a share of 1 and of all other lengths; steps 12.1, 12.2 and 12.4:
// 9 u in all, and 4 u.
inline constexpr double kQueryPad = 0x1p-18;
inline constexpr double kQueryRayPad = 0x1p-20;

// The same for bounds of the leaves of an instance, as a share of all coordinates. 32 u; steps 12.3 and 12.5: 12 u.
inline constexpr double kQueryLeafPad = 0x1p-19;

// The same for their boxes: 64 u of all coordinates there, and 32 u of the sum of a box's half extents for axes that
// are skew; step 12.7: 30 u, and 23 u. The distance of a point from a box may be off by 512 u of all coordinates; step
// 12.8: 150 u.
inline constexpr double kQueryBoxPad = 0x1p-18;
inline constexpr float kQueryBoxSkew = 0x1p-19f;
inline constexpr double kQueryBoxDistance = 0x1p-15;

// How far a posed box reaches from its centre, in the sum of its half extents: 256 u more, since its axes may be a
// little longer than 1; steps 1.5 and 11.1: 12 u.
inline constexpr double kBoxReach = 1 + 0x1p-16;

// What rounding in double may move, as a share of the lengths from a query to an instance; steps 12.2 and 12.3: 2^-50.
inline constexpr double kQueryRounding = 0x1p-49;

// A component of a ray's direction counts as this if it is smaller; step 12.2.
inline constexpr double kQueryLeastDirection = 0x1p-40;

// Bounds of an instance between two moments grow by this share of how far its leaf boxes are from its origin and from
// their links', 1024 u, and by this share of its origin, for rounding; step 13.4: 570 u, and 2^-51.
inline constexpr double kHistoryPad = 0x1p-14;
inline constexpr double kHistoryOriginPad = 0x1p-49;

// How far they grow is computed in float: the cosine of half an angle may be off by 16 u, and all else by 64 u of
// itself; step 13.5: 11.5 u, and 30 u.
inline constexpr float kHistoryCosine = 0x1p-20f;
inline constexpr float kHistoryRounding = 1 + 0x1p-18f;

// ------------------------------------------------------------------------------------------------ boxes of levels

// How far links can reach grows by this share of the lengths that it is a sum of, for poses that are rotations only to
// kRigidTolerance and for the slack of the leaf predicate. 3.91e-3; step 10.2: 2.07e-3.
inline constexpr double kReachGrow = 0x1p-8;

// The half extents of a box about what is reached grow by this share of its size and centre, since the centre is
// rounded. 16 u; step 10.3: 3 u. And by as much as kLinkTiny, for levels whose leaves are points.
inline constexpr double kReachRounding = 0x1p-20;
inline constexpr double kReachTiny = 0x1p-90;

// ---------------------------------------------------------------------------------------------- the box of a mesh

// Widths that differ by less than this share of the longest count as equal, since vertices are rounded. 16 u; step 7.1.
inline constexpr double kSameWidth = 0x1p-20;

// Components of axes below this are rounding errors of the eigen-solver. u / 4; step 7.2.
inline constexpr double kZeroComponent = 0x1p-26;

// A half extent in double grows by this share of each product that is summed for it. 2^-48; step 7.3: 21 x 2^-53.
inline constexpr double kFitPad = 0x1p-48;

// ---------------------------------------------------------------------------------------------------- exact tests

// The slack of a pair of convex shapes is kConvexSlack N + kConvexPoseSlack w, N = |t|_1 + Ra + Rb. t is the centre of
// b's shape in the frame of a's shape, Ra and Rb are how far the shapes reach from their centres, and w is how far
// their centres are from the origins of their links and instances. 256 u and 64 u; steps 9.2 and 9.3: 195 u and 49 u.
inline constexpr float kConvexSlack = 0x1p-16f;
inline constexpr float kConvexPoseSlack = 0x1p-18f;

// The rounding of a product of three edges of a tetrahedron, as a share of N (Ra + Rb)^2. 256 u; step 9.4: 224 u.
inline constexpr float kTetrahedronRounding = 0x1p-16f;

// How far a coordinate of a skinned vertex less one of another may be from the truth, of the numbers on the way. 128 u;
// step 21.1: 98 u. In double 2^-46; step 21.3.
inline constexpr float kSurfaceError = 0x1p-17f;
inline constexpr double kSurfaceErrorDouble = 0x1p-46;

// Added to the square of a direction's length across a cylinder's axis, so that the root of it is above 0. It makes the
// support point lie deeper by 2^-51 and 2^-451 of the radius at most; step 9.2.
inline constexpr float kAcrossTiny = 0x1p-100f;
inline constexpr double kAcrossTinyDouble = 0x1p-900;

// In double a plane counts if the square of its direction's length is above this; step 9.8.
inline constexpr double kLeastDirectionSqDouble = 0x1p-400;

// A point counts as in an ellipsoid up to this share of its radii. 16 u; step 9.4: 12 u.
inline constexpr float kEllipsoidInside = 0x1p-20f;

// kConvexSlack, kConvexPoseSlack and kTetrahedronRounding where a pair is tested in double; step 9.6.
inline constexpr double kConvexSlackDouble = 0x1p-45;
inline constexpr double kConvexPoseSlackDouble = 0x1p-46;
inline constexpr double kTetrahedronRoundingDouble = 0x1p-45;

// Two boxes touch if their gap along all axes is below minus kBoxDepth N and the slack. If the squared sine of two
// edges is at most kParallelEdges, the gaps along the faces suffice; step 9.5.
inline constexpr float kBoxDepth = 0x1p-14f;
inline constexpr float kParallelEdges = 0x1p-36f;

// The shapes of a pair that together reach less far are tested in double alone; step 9.7.
inline constexpr float kLeastConvexReach = 0x1p-100f;

// Segments whose directions have a smaller sine, squared, count as parallel; step 9.7.
inline constexpr float kParallelSegments = 0x1p-20f;

// GJK stops when a step shortens the square of the distance by less than this share of it; step 9.7.
inline constexpr double kGjkProgress = 0x1p-20;
inline constexpr double kGjkProgressDouble = 0x1p-44;

// Contacts are searched in double to these shares: GJK's of the square of the distance, the search for a depth's of
// both shapes' reach; they are rounded to float. None of these constants decides whether shapes touch, and each answer
// is a supporting plane; step 9.9.
inline constexpr double kContactProgress = 0x1p-20;
// Shapes of size 1 within a margin that GJK parts by more than this have their contact from GJK alone: heights of
// vertices in float are off by far less.
inline constexpr double kFarApart = 0x1p-16;
inline constexpr double kDepthProgress = 0x1p-18;
inline constexpr double kSettledCosine = 1 - 0x1p-20;  // of two rays in turn, at the end of the search
inline constexpr double kLeastNormal = 0x1p-1000;      // a shorter vector has no direction
inline constexpr double kFlatTriangle = 0x1p-60;       // a triangle with a smaller sine, squared, is a segment
inline constexpr double kParallelInDouble = 0x1p-50;   // segments with a smaller sine, squared, are parallel
inline constexpr double kMeetingSegments = 0x1p-66;    // the square of a distance of segments that meet
inline constexpr float kDepthRounding = 0x1p-19f;      // of a separation of polytopes of size 1 in float
inline constexpr double kFarPolytopes = 0x1p10;        // so far apart in sizes, polytopes are left to GJK
inline constexpr double kSameHeight = 0x1p-42;         // vertices of a face, along its normal
inline constexpr double kSameInPlane = 0x1p-80;        // the square of a distance of faces that meet
inline constexpr double kLeastCurvature = 0x1p-7;      // Newton's lower eigenvalue over the greater one
inline constexpr double kLeastDamping = 0x1p-12;       // Newton stops below this share of a step

// A ray that touches a shape touches it grown by at most this many times the slack of step 11.1. Four of them are where
// the search for the parameter ends; step 11.4.
inline constexpr double kRayGrowth = 6;

// A hull whose vertices are within this share of its extent from one line has no area. 2^-46; step 8.1: 2^-49.
inline constexpr double kThinHull = 0x1p-46;

// Two hulls, or a hull and a box, that are flat to this share of their radius are tested by their gap, since libccd may
// call them apart. 16 u, so that float vertices in a tilted plane are flat; any value would do: step 8.3.
inline constexpr double kFlatShare = 0x1p-20;

// The gap of two parts shrinks by this share of the lengths that its two ends are sums of, for the rounding of poses
// and support points. 2^-40; step 8.2: 2^-46, and what qhull leaves out of a hull.
inline constexpr double kGapRounding = 0x1p-40;

// ----------------------------------------------------------------------------------------------------- triangles

// The rounding of a gap between two triangles along a product of two edges, of each of the products of three lengths
// that are bounds of it, and along any direction. 96 u; steps 20.3, 20.4 and 20.6: 94 u, 24 u and 5 u. In double 96
// times 2^-53; step 20.8.
inline constexpr float kTriangleRounding = 0x1.8p-18f;
inline constexpr double kTriangleRoundingDouble = 0x1.8p-47;

// The caller's error and margin grow by this factor, for the rounding of their products. 64 u; step 20.4: 12 u. In
// double 64 times 2^-53; step 20.8.
inline constexpr float kTriangleUp = 0x1.00004p0f;
inline constexpr double kTriangleUpDouble = 0x1.000000000002p0;

// The size of pairs that are tested, and what they may lose to underflow, over 1 and the sum of their lengths; steps
// 20.7 and 20.8: 2^-144 and 2^-1069.
inline constexpr float kLeastTriangles = 0x1p-24f;
inline constexpr float kMostTriangles = 0x1p28f;
inline constexpr float kTriangleTiny = 0x1p-124f;
inline constexpr double kLeastTrianglesDouble = 0x1p-200;
inline constexpr double kMostTrianglesDouble = 0x1p200;
inline constexpr double kTriangleTinyDouble = 0x1p-1000;

// The square of more than a margin; step 20.9.
inline constexpr float kFarTriangles = 0x1p126f;

// How far on either side of the margin a triangle touches a convex part for certain, or is apart from it, over all
// lengths of the pair together. 64 u; step 21.9: 42 u.
inline constexpr float kPartRounding = 0x1p-18f;

// ------------------------------------------------------------------------------------- round leaves, motions, sine

// Round leaves (kernels/round_leaves.h): how far two posed leaves may be nearer or farther than their tiles say, per
// length that went into them. 2^-17; step 16.1: 52 u. kRoundTiny: what may be lost to underflow, by step 16.2 2e-19.
inline constexpr float kRoundSlack = 0x1p-17f;
inline constexpr float kRoundTiny = 0x1p-49f;

// How far rounding poses between two frames to float moves points, of the lengths that they are sums of. 2^-20; step
// 17.4: 2^-21.
inline constexpr double kPathRounding = 0x1p-20;

// The sine and cosine of kernels/sine.h are off by at most this. 2^-51; step 15.1: 2^-51.6.
inline constexpr double kSineError = 0x1p-51;

}  // namespace cab
