// The plain data of cab's public API: ids, statuses, descriptions, poses, hits, jobs. The calls are in cab/cab.h.
//
// Conventions, for all of the API:
//
// Units       All lengths are in one unit, which the caller chooses: no constant of the library is a length. The API
//             has no angles: rotations are quaternions or matrices. Times are in seconds.
// Frames      "link" is a link's own frame. "instance" is the frame of one posed articulation: a pose takes points of a
//             link to it. "world" is common to all instances: a point p of an instance stands there at
//             origin + orientation * p. "Relative to the instance's origin" means in the world's axes, counted from
//             that origin.
// Rotations   Quaternions are x y z w. Vectors are columns, so a rotated point is R * p. PoseFormat says which matrices
//             are stored by rows and which by columns.
// Handedness  The caller's coordinates may be right-handed or left-handed, and any axis may point up, if all input
//             agrees. The determinant of quaternions' rotations, and of the axes of boxes, is 1; that of a pose's
//             matrix may be -1. Such a link is mirrored, with its leaves' shapes.
// Indices     Links, leaves, instances and entries of spans count from 0, ids from 1.
// Precision   Poses, boxes and shapes are float, relative to an instance. Origins are double. Every box is padded, so
//             that it contains what it stands for in spite of rounding. Rounding may add a pair that is apart, but
//             never loses a pair that touches.
// Ownership   The caller owns every span and pointer; a call borrows them until it returns. What a call writes must not
//             overlap anything else that it writes or reads. add_articulation copies what it keeps.
// Statuses    "The input statuses" are what a call returns for a BatchInput that it refuses: Status::kUnknownBatch,
//             kStaticInput, kBadPoses, kBadStates, what compute_link_poses has for joints, kBadCount, kBadInstances,
//             kBadOrigins, kBadOrientations, kBadScales, kBadFlags, kBadLayers, kBadInContact, kBadBounds, kBadMargins
//             and kBadMoved. For a list of inputs, kUnknownBatch also if it has a size and no data, and
//             kBatchGivenTwice.
// Same bits   Boxes, hits and their order depend on the input alone, not on the instruction set, the number of threads,
//             earlier frames (but for BatchInput::moved) or the caller's floating-point mode. With Exact::kFcl, hits
//             are the same in every run of one build, but another build of FCL may decide otherwise. docs/embedding.md,
//             "What is promised", has the details.
// Defaults    A span is empty by default, an id is that of no object, and other members show their default. Plain
//             results, such as Hit and Contact, have no defaults.
#pragma once

#include <cab/policy.h>
#include <cab/span.h>

#include <cstddef>
#include <cstdint>
#include <typeindex>  // std::hash

namespace cab {

// ------------------------------------------------------------------------------------------------ statuses, limits

// What a call answers. The comments are the words of to_string(Status). A call that does not answer kOk leaves its
// outputs as they were, with three exceptions. After kHitsOverflow, kPairsOverflow and kLinesOverflow the call, or the
// job, says what holds. After kOutOfMemory, kBadTask and kTasksLeft of calls that run tasks, outputs may be partly
// written. Calls write which element is at fault, such as *bad_element, when they refuse it.
enum class Status : std::int32_t {
  kOk = 0,               // ok
  kOutOfMemory,          // an allocation failed
  kBusy,                 // another call on the same engine is running, and one of the two must run alone
  kIsaNotAvailable,      // isa is an instruction set that this CPU or this build lacks
  kBadAbiVersion,        // the program was compiled for another ABI of the C API than this library has
  kBadScheduler,         // scheduler lacks parallel_for, or its worker_count is 0 or above 1024
  kBadAllocator,         // allocator lacks allocate or release
  kBadProfiler,          // profiler lacks begin or end
  kNoLinks,              // link_parents is empty, but an articulation needs at least one link
  kTooManyLinks,         // link_parents holds more than 1024 links
  kNoLeaves,             // leaves is empty, but an articulation needs at least one leaf
  kTooManyLeaves,        // leaves holds more than 1024 leaves
  kBadParent,            // link_parents must be -1 for the first link, and -1 or an earlier link for every other
  kBadJoint,             // link_joints must be empty or one finite point per link, joints as cab/kinematics.h says
  kBadLeafLink,          // link of a leaf is not the index of a link
  kBadLeafBox,           // box of a leaf is not finite, has a negative half extent or exceeds 1e18
  kBadLeafAxes,          // box of a leaf has axes that are not orthonormal and right-handed to 1e-5
  kBadShape,             // parts of a leaf need finite positions, unit quaternions, positive sizes and an area
  kShapeOutsideLeafBox,  // parts of a leaf, and the positions of half spaces, must lie within its box
  kBadVertices,          // vertices must hold x y z of at least one point, each number finite and at most 1e18
  kBadIgnoredPair,       // ignored_pairs names a link that does not exist
  kBadRestPose,          // rest_pose has an unknown format, an invalid stride, or values that are not a rigid pose
  kUnknownArticulation,  // the articulation id is not one of this engine, or is of one that was removed
  kUnknownBatch,         // the batch id is not one of this engine, or is of one that was removed
  kArticulationInUse,    // the articulation has batches or levels of nodes, which must be removed first
  kBadLod,               // a level needs an articulation that is no level, leaves for all links, and a finite play
  kTooFewLeaves,         // max_leaves is 0, above 1024, or below the number of trees that have leaves
  kLodLeafTooSmall,      // the box of a level's leaf does not hold all that its links can reach
  kBadBatchKind,         // kind is not a value of BatchKind
  kNoInstances,          // instance_count is 0, but a batch needs at least one instance
  kBadStaticBody,        // a static body needs a finite origin, a quaternion that is not 0, and a box within 1e18
  kBadTriangles,         // triangles must be three indices each of vertices, which are finite and at most 1e18
  kTooManyInstances,     // instance_count is above 2^24, or the engine would exceed 4096 batches or 2^31 characters
  kBatchGivenTwice,      // inputs holds the same batch twice
  kBadPoses,             // poses has no data, an unknown format, or a stride that is too small or not a multiple of 4
  kBadStates,            // states must be of a sequence, with enough values, and made into the poses of the input
  kStaticInput,          // a batch of static bodies takes nothing that says where instances are or how they move
  kBadOrigins,           // origins must be empty or hold three finite doubles per instance
  kBadOrientations,      // orientations must be empty or hold four floats per instance
  kBadFlags,             // flags must be empty or hold one byte per instance
  kBadLayers,            // layers and layer_masks must each be empty or hold one word per instance
  kBadInContact,         // in_contact must be empty or hold one byte per instance
  kBadScales,            // scales must be empty or hold one float per instance, and be empty if matrices hold scales
  kBadCount,             // count is above the batch's instance_count
  kBadInstances,         // instances must be empty or ascend, below count and instance_count; never of a sequence
  kBadBounds,            // bounds must be empty or hold six finite floats per instance, none below its lower one
  kBadMoved,             // moved must be empty or hold one byte per instance; never of a sequence
  kBadMargins,           // margins must be empty or hold one float per instance, each 0 to 1e18; never of a sequence
  kMovedAtRest,          // moved is 0 for an instance whose pose, place, scale or layers changed (checked builds only)
  kBadPairRule,          // rules names a batch without input, or a pairing that its batches cannot have
  kPairRuleGivenTwice,   // rules pairs the same two batches twice in the same way
  kBadPolicy,            // policies holds a value that its enumeration lacks
  kExactNotBuilt,        // policies asks for an exact test that this build of the library lacks
  kBadReport,            // report is not a value of Report
  kBadMargin,            // margin must be finite, not negative and at most 1e18
  kBadMinDepth,          // min_depth must be finite, not negative, and 0 if only in_contact is reported
  kBadHitBuffer,         // hits or links has a size and no data, both are given, or contacts is not as long as hits
  kContactsNeedExact,    // contacts, distances and min_depth need an exact test, such as convex
  kLodWithoutShapes,     // an exact test needs shapes, but a batch with input is of a level of nodes
  kBadInstance,          // instance is not one of the batch's instances in this call
  kBadPairs,       // pairs names a batch without input, a missing instance, a link without leaves, or a link twice
  kBadResolution,  // resolution must be above 0, and at most 1e18
  kBadOutput,      // an output is null or too small
  kNullArgument,   // a pointer of the C API that must not be null is null
  kHitsOverflow,   // hits is too small for all hits
  kPairsOverflow,  // pairs is too small for all candidates
  kLinesOverflow,  // lines is too small for all edges
  kNoFrame,        // no frame has begun
  kBadTask,        // task or worker is out of range or in use, or the task has been run before
  kTasksLeft,      // not all tasks have been run
  kUnsortedHits,   // a list of hits has a size and no data, or is not in the order of run_frame
  kBadQuery,  // a query has a value of no enumeration, a number that is not finite or out of range, or no direction
  kNoQueryMemory,      // reserve has made no memory for queries
  kBadTicks,           // ticks must be 1 to 65536
  kUnknownHistory,     // the history id is not one of this engine, or is of one that was removed
  kHistoryGivenTwice,  // histories holds two histories of the same batch
  kBadTime,            // a time must be finite, and later than those that the history has
  kBadHistoryPoses,    // a history takes neither mirrored links nor matrices that hold scales
  kBadSkin,            // skin needs finite vertices, invertible finite matrices, and weights of existing links
  kBadLeafTriangles,   // triangles of a leaf must be three vertices of the skin each, without parts beside them
  kTooManyInfluences,  // triangles of a leaf are moved by more than 32 other links; a smaller leaf has fewer
  kSkinNotTaken,       // the call, or the exact test, does not take an articulation with a skin yet
};

// Limits. Links and leaves are counted per articulation, instances per batch, batches and workers of a caller's
// scheduler per engine. An engine also holds at most 2^31 characters, over all its batches.
inline constexpr std::uint32_t kMaxLinks = 1024;
inline constexpr std::uint32_t kMaxLeaves = 1024;
inline constexpr std::uint32_t kMaxInstances = 1u << 24;
inline constexpr std::uint32_t kMaxBatches = 4096;
inline constexpr std::uint32_t kMaxWorkers = 1024;

// The largest magnitude of a coordinate or half extent, relative to the instance's origin, in the caller's unit. An
// instance whose pose, or whose box with padding and margin, exceeds it is masked like one whose pose is not finite:
// products of the overlap test would overflow float.
inline constexpr float kMaxCoordinate = 1e18f;

// The least and the largest scale of an instance or of a link.
inline constexpr float kMinScale = 1e-3f;
inline constexpr float kMaxScale = 1e3f;

// ------------------------------------------------------------------------------------------------------ basic types

// An articulation and a batch of one engine. An id holds a slot in its lower 32 bits, and in its upper 32 a serial
// number, which differs for all ids of a process until 2^32 were given out. An id whose articulation or batch has been
// removed, or that is of another engine, is refused. A bare slot is an id too: that of whatever is in the slot. What is
// added takes the lowest free slot; slots count from 1. The value 0 (default) names nothing.
struct ArticulationId {
  std::uint64_t value = 0;  // 0: no articulation
};
struct BatchId {
  std::uint64_t value = 0;  // 0: no batch
};

// The slot of a batch. Hits name their batches by it, so that they do not depend on what a process did before.
struct BatchSlot {
  std::uint32_t value = 0;  // from 1; 0: no batch
};

// The slot of an id: its lower 32 bits.
inline constexpr BatchSlot slot_of(BatchId id) { return {static_cast<std::uint32_t>(id.value)}; }

// The instruction set that kernels use. All give the same bits.
enum class Isa : std::uint8_t {
  kAuto,     // the best that this CPU, its operating system and this build offer
  kScalar,   // no SIMD: the same source compiled for single floats
  kSse2,     // x86-64, always there
  kAvx2,     // x86-64 with AVX2 and FMA
  kAvx512,   // x86-64 with F, CD, DQ, BW and VL
  kNeon64,   // 64-bit ARM, always there
  kWasm128,  // WebAssembly with 128-bit SIMD
};

// How many values Isa has, Isa::kAuto included.
inline constexpr std::uint32_t kIsaCount = 7;

// An oriented box: the points center + x0 * axis[0] + x1 * axis[1] + x2 * axis[2] with |xk| <= half[k]. Leaf::box and
// fit_box use the link's frame. compute_boxes writes boxes relative to the instance's origin. The default is a point at
// the frame's origin, with the frame's axes. A point is a valid box: one whose `half` was forgotten is not refused.
struct Box {
  float center[3] = {0, 0, 0};                           // x y z of the centre, in the caller's unit
  float axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  // axis[k] is x y z of the k-th: orthonormal, right-handed
  float half[3] = {0, 0, 0};                             // half extent along each, in the caller's unit, 0 or more
};

// ------------------------------------------------------------------------------------------------------------ poses

// How one pose, from link to instance, is stored in floats.
enum class PoseFormat : std::uint8_t {
  kQuaternionTranslation,  // 7 floats: quaternion x y z w, whose length is divided out; translation x y z
  kMatrix3x4Rows,          // 12 floats by rows: three rows of four, the translation in the last column
  kMatrix4x4Columns,       // 16 floats by columns, as in glTF and ozz: translation in floats 12 to 14, last row unread
};

// The poses of all links of all instances of a batch. Each goes from link to instance ("model space"), never from link
// to parent. The pose of link l of instance i begins at byte i * instance_stride + l * link_stride of data, so poses
// may be members of the caller's larger structures.
struct PoseView {
  // How every pose is stored. Translations are in the caller's unit.
  PoseFormat format = PoseFormat::kQuaternionTranslation;

  // The first float of the first pose. Borrowed. Required, except in ArticulationDesc::rest_pose.
  const float* data = nullptr;

  // Bytes from one link's pose to the next link's: a multiple of 4, at least the size of a pose, at most 2^32.
  // 0 (default): the size of a pose, so poses follow each other without gaps.
  std::size_t link_stride = 0;

  // Bytes from one instance's first pose to the next instance's: a multiple of 4, at least as long as the poses of all
  // links, at most 2^38. 0 (default): link_stride times the number of links.
  std::size_t instance_stride = 0;

  // Whether matrices hold a uniform scale: each is a rotation, mirrored or not, times a factor from kMinScale to
  // kMaxScale. The factor is the length of the first column. It is that of the link's leaves, their boxes and shapes,
  // and of its joint. Translations are taken as they are. With matrices only. Default: matrices are rotations.
  bool has_scale = false;
};

struct KinematicsDesc;

// Joint states, which become the poses of a sequence: run_frame makes those of sixteen states where it tests them, on
// its threads, as compute_link_poses does.
struct StateView {
  // Of the links of the batch. Borrowed. null (default): there are no states.
  const KinematicsDesc* kinematics = nullptr;

  // kinematics->variable_count numbers per instance. Borrowed.
  Span<const double> values;

  // Output, which BatchInput::poses must name as kQuaternionTranslation without gaps: 7 floats per link and instance.
  // Borrowed. All calls but run_frame and begin_frame read them as they are, and of the states check the sizes alone.
  float* poses = nullptr;
};

// ----------------------------------------------------------------------------------------------------- articulation

// The shape of a convex part, and what ConvexPart::size means for it. All shapes except hulls and half spaces are
// centred at the part's origin. A hull is where its vertices are.
//
// A half space is a floor or a wall that ends with the box of its leaf: shapes whose boxes do not overlap it are not
// found. So the box must extend as far along the plane as anything stands on it, and as far below it as anything may
// sink. Two half spaces touch wherever their boxes overlap, and have no contact.
enum class ShapeKind : std::uint8_t {
  kBox,         // size: half extents along x, y, z
  kEllipsoid,   // size: radii along x, y, z
  kCapsule,     // size: radius, half the length of the cylinder along z, unused
  kConvexHull,  // the convex hull of `vertices`; size unused
  kSphere,      // size: radius, unused, unused
  kCylinder,    // size: radius, half the length along z, unused; its ends are flat
  kHalfSpace,   // all points with z <= 0; size unused
};

// One convex part of a leaf's exact shape, in a frame of its own. It must lie within its leaf's box, to 2^-22 of the
// sum of the box's half extents. Of a half space only the position must.
struct ConvexPart {
  // Which shape the part has.
  ShapeKind kind = ShapeKind::kBox;

  // x y z of the part's origin in the link's frame, in the caller's unit.
  float position[3] = {0, 0, 0};

  // Quaternion x y z w that rotates from the part's frame to the link's. Its squared length must be 1, to 1e-3.
  float rotation[4] = {0, 0, 0, 1};

  // Three lengths in the caller's unit. ShapeKind says what each one means. Those that the kind uses must be above 0.
  float size[3] = {0, 0, 0};

  // x y z of each vertex in the part's frame, for kConvexHull only. There must be at least three, not all on one line.
  // All in one plane they are a triangle or a polygon. Vertices inside the hull are allowed.
  Span<const float> vertices;
};

// A rigid body of an articulation, fixed to one link. A link may carry several leaves, or no leaf.
struct Leaf {
  // Index of the link that carries the leaf.
  std::uint32_t link = 0;

  // The leaf's box, in the link's frame. Half extents may be 0: a plate, a segment or a point is a box. The axes must
  // be orthonormal and right-handed, to 1e-5. fit_box makes such a box about a mesh. Default: a point at the link's
  // origin.
  Box box = {};

  // The exact shape, as a union of convex parts. Exact tests and Refit::kAabbVertices use it; to the latter a half
  // space is the box. Empty (default): the shape is the box itself.
  Span<const ConvexPart> parts;

  // The triangles of ArticulationDesc::skin that the leaf stands for: three indices of vertices each. The library makes
  // the box about them, and in every frame grows it by what other links do to them, so that it holds them in every
  // pose. Then `box` is not read, and there are no parts. Some 50 to 200 triangles that are next to each other, most of
  // whose weight is on `link`, make a tight box. Triangles that are connected by vertices in common are a part. A part
  // has an inside if each of its edges has an even number of triangles. Empty (default): the leaf is rigid.
  Span<const std::uint32_t> triangles = {};
};

// The skin of a character: vertices that several links move by a linear blend ("linear blend skinning"). A vertex v is
// at the sum over its links of weight * pose of the link * bind of the link * v.
struct SkinDesc {
  // x y z per vertex, in the skin's own frame and in the caller's unit.
  Span<const float> vertices;

  // How many links move a vertex at most, 1 to kMaxLinks; the index of each, and its weight: so many per vertex. A
  // weight of 0 has no effect, others are above 0. The weights of a vertex are divided by their sum, which is not 0.
  std::uint32_t influence_count = 4;
  Span<const std::uint32_t> influence_links;
  Span<const float> influence_weights;

  // One matrix per link from the skin's frame to the link's, the "inverse bind matrix": 16 floats by columns, as in
  // glTF and ozz; the last row is not read. It may scale, shear and mirror. Empty (default): the frames of links are
  // that of the skin, as where poses are the matrices of a palette.
  Span<const float> inverse_bind;
};

// Two links of one articulation, in either order.
struct LinkPair {
  std::uint32_t a = 0;  // index of a link
  std::uint32_t b = 0;  // index of a link; a pair of equal links has no effect
};

// An articulation: one tree of links, or several, and the leaves on them. It does not change once it is added.
// ignored_pairs, ignored_hops and rest_pose say which links of one instance are never reported against each other. They
// have no effect on pairs of different instances.
struct ArticulationDesc {
  // The index of each link's parent, lower than the link's own index, or -1 for the root of a tree. The first link is a
  // root. There are 1 to kMaxLinks links.
  Span<const std::int32_t> link_parents;

  // x y z per link: the joint with the parent, in the link's own frame. Empty (default): all joints are at the origins
  // of the links' frames. Joints guide how inner boxes are made.
  Span<const float> link_joints;

  // The leaves, in any order. There are 1 to kMaxLeaves.
  Span<const Leaf> leaves;

  // Pairs of links to ignore. A pair may be listed twice and in either order. Empty by default.
  Span<const LinkPair> ignored_pairs;

  // Two links are ignored if the path between them in the tree has at most this many joints: with 1 a link and its
  // parent, with 2 also siblings, and a link and its grandparent. 0 (default): no pair is ignored for this reason.
  std::uint32_t ignored_hops = 0;

  // The pose of one instance. Two links are ignored if their oriented leaf boxes touch in this pose, without an
  // orientation or an exact test. Without data (default): no pair is ignored for this reason.
  PoseView rest_pose = {};

  // The vertices of leaves with triangles. Default: there are none. An articulation with such leaves takes frames and
  // queries by boxes, levels of nodes, compute_boxes, and frames with Exact::kSurface but without contacts. What needs
  // more answers Status::kSkinNotTaken: other exact tests, sweeps, levels of boxes, the past for all queries but rays.
  SkinDesc skin = {};
};

// What the leaves of a coarser level are.
enum class LodKind : std::uint8_t {
  kReach,  // boxes on some links, each with room for whatever its links can reach; no other links are posed
  kNodes,  // nodes of the articulation's hierarchy, made in every frame from all leaves; without shapes
};

// What lod_leaves writes for a link without leaves.
inline constexpr std::uint16_t kNoLeaf = 0xffff;

// A leaf of a coarser level: a box on one link that stands for several links.
struct LodLeaf {
  // Index of the link that carries the box. No two leaves of a level are on the same link.
  std::uint32_t link = 0;

  // The box, in that link's frame. Required. As Leaf::box. It must hold the leaf boxes of `link`, if the leaf stands
  // for it, and at each joint of `link` the ball that its other links can reach from there, with 2^-8 of all lengths to
  // spare.
  Box box = {};

  // The links that it stands for, in any order. They are in one tree with `link`, which need not be one of them.
  Span<const std::uint32_t> links;
};

// A coarser level of an articulation, for instances that are far away or matter little: the same links with fewer
// leaves. Every two instances of which leaves touch have leaves of coarser levels that touch and stand for these links.
// A level is an articulation too, with batches of its own: BatchInput::instances says which instances are at which
// level in a frame. Links that one leaf stands for are not reported against each other.
struct LodDesc {
  // The articulation, which is no level itself. It must stay as long as its levels of nodes. Required.
  ArticulationId of;

  // What the leaves are. Default: boxes that are fixed to links.
  LodKind kind = LodKind::kReach;

  // How many leaves there may be, 1 (default) to kMaxLeaves, if the library makes them. It cuts the articulation at
  // joints, so that few leaves stand for many links. With kReach each tree that has leaves takes at least one.
  std::uint32_t max_leaves = 1;

  // Leaves that the caller makes, for kReach only. Each link that has leaves is in one of them. Empty (default): the
  // library makes them.
  Span<const LodLeaf> leaves;

  // For kReach: poses of `rest_pose_count` instances, such as a rest pose or a clip. They say where each joint is in
  // the frame of its link's parent: in their middle, and as far from there as they are. Required for kReach.
  PoseView rest_poses = {};
  std::uint32_t rest_pose_count = 1;

  // For kReach: a length in the links' unit, from 0 (default) to kMaxCoordinate, by which a joint may be farther away
  // from there. Poses in which one is farther away, as where bones stretch, or whose links have scales of their own,
  // may lose hits.
  float joint_play = 0;
};

// Why two links of one instance are never reported against each other. IgnoredPair::reasons combines these bits.
enum IgnoredReason : std::uint8_t {
  kIgnoredExplicitly = 1,  // ArticulationDesc::ignored_pairs names the two links
  kIgnoredByHops = 2,      // they are at most ArticulationDesc::ignored_hops joints apart
  kIgnoredAtRest = 4,      // they touch in ArticulationDesc::rest_pose, by oriented leaf boxes alone
};

// Two links that are never reported against each other within an instance. Written by ignored_pairs.
struct IgnoredPair {
  std::uint16_t a;       // index of the lower link
  std::uint16_t b;       // index of the higher link
  std::uint8_t reasons;  // IgnoredReason bits, at least one
};

// The value of MergeStep::joint_link if the two children share no joint.
inline constexpr std::uint16_t kNoJoint = 0xffff;

// One merge of the fixed bottom-up order of a hierarchy. Nodes 0 to leaf_count - 1 of the hierarchy are the leaves.
// Step s makes node leaf_count + s. Written by merge_steps.
struct MergeStep {
  std::uint16_t left;        // index of one child: a leaf, or a node that an earlier step made
  std::uint16_t right;       // index of the other child
  std::uint16_t joint_link;  // the link whose joint the two children share, or kNoJoint
};

// Counts of an articulation. Written by articulation_info.
struct ArticulationInfo {
  std::uint32_t link_count = 0;          // links, with or without leaves
  std::uint32_t leaf_count = 0;          // leaves on all links
  std::uint32_t node_count = 0;          // nodes of the hierarchy, 2 * leaf_count - 1: leaves first, the root last
  std::uint32_t depth = 0;               // merges on the longest path from the root to a leaf
  std::uint32_t ignored_pair_count = 0;  // entries that ignored_pairs writes
};

// ---------------------------------------------------------------------------------------------------------- batches

// What the instances of a batch are.
enum class BatchKind : std::uint8_t {
  kCharacters,  // all instances live at once: each may touch every other
  kSequence,    // instance f is frame f of one character: it may touch only frame f of other sequences
};

// A batch: instances of one articulation that are posed together.
struct BatchDesc {
  // The articulation of every instance, added to the same engine. Required.
  ArticulationId articulation;

  // How many instances there are, 1 to kMaxInstances. A sequence with one instance is a fixed object, such as a table:
  // it is paired with every frame of other sequences.
  std::uint32_t instance_count = 0;

  // What the instances are to each other. Default: characters.
  BatchKind kind = BatchKind::kCharacters;
};

// A body that never moves, such as a wall or a crate that is bolted down: one convex body, or several that are one.
struct StaticBody {
  double origin[3] = {0, 0, 0};      // x y z of the origin of its frame in the world
  float rotation[4] = {0, 0, 0, 1};  // quaternion x y z w from its frame to the world; its length is divided out

  // The box, in the body's frame. As Leaf::box. Default: a point at the body's origin.
  Box box = {};

  // The exact shape, in the body's frame. As Leaf::parts. Empty (default): the shape is the box itself.
  Span<const ConvexPart> parts;
};

// A batch of static bodies, such as the geometry of a level. Body i of `bodies` is instance i. Triangle t is the
// instance after them, bodies.size + t. Each has one link, 0, with one leaf, 0.
struct StaticDesc {
  // Bodies, in any order. Together with the triangles there are 1 to kMaxInstances.
  Span<const StaticBody> bodies;

  // x y z per vertex of a mesh, relative to `origin`, along the world's axes.
  Span<const float> vertices;

  // Three indices of vertices per triangle. A triangle has two sides and no inside. It must have an area.
  Span<const std::uint32_t> triangles;

  // x y z in the world to which vertices are relative. Sums are rounded to double.
  double origin[3] = {0, 0, 0};
};

// What a batch is. Written by batch_info.
struct BatchInfo {
  ArticulationId articulation;              // of every instance; 0 for static bodies
  std::uint32_t instance_count = 0;         // as it was added
  BatchKind kind = BatchKind::kCharacters;  // of static bodies too
  bool is_static = false;                   // whether add_static_batch made it
};

// What reserve makes room for, counting what the engine has already.
struct ReserveDesc {
  std::uint32_t batches = 0;     // most batches at a time
  std::uint32_t characters = 0;  // most instances of all batches of characters together
  std::uint32_t queries = 0;     // queries that run_queries answers per chunk; larger jobs are split
  // Most hits of characters in one frame. A frame with more hits than any before it allocates unless they are reserved
  // (docs/embedding.md, Memory). Hits of sequences need no memory of the engine.
  std::uint32_t hits = 0;
};

// How many bytes an engine holds through its allocator. Written by engine_memory.
struct EngineMemory {
  std::size_t articulations = 0;  // topology, merge orders, boxes, shapes
  std::size_t batches = 0;        // bounds and chains of hits of characters; static bodies
  std::size_t workers = 0;        // boxes and lists of the threads
  std::size_t broad_phase = 0;    // bounds and strips of characters
  std::size_t hits = 0;           // the store, until they are written
  std::size_t queries = 0;        // the index of instances, and what is kept per query
  std::size_t histories = 0;      // the moments that are kept, and what workers need for them
  std::size_t total = 0;          // all of these, and what rules take
};

// Why an instance is masked. A masked instance is in no pair of the frame, and changes no bit of other instances.
// compute_boxes writes boxes with half extents 0 for it. The values are bits of BatchInput::flags.
enum InstanceFlag : std::uint8_t {
  kInstanceOk = 0,         // the instance takes part
  kInstanceNotFinite = 1,  // a NaN, an infinity, or a coordinate above kMaxCoordinate
  kInstanceNotRigid = 2,   // a quaternion shorter than 1e-3 or longer than 1e3, a matrix off a rotation, mirrored or
                           // not, by over 1e-3, or a scale that is not within kMinScale to kMaxScale
};

// What why_masked found wrong with an instance.
enum class MaskCause : std::uint8_t {
  kNone,               // nothing: the instance takes part
  kPoseNumber,         // a number of a link's pose is a NaN or too large
  kOrientationNumber,  // a number of the instance's orientation is a NaN or too large
  kQuaternionLength,   // the quaternion of a link's pose is too short or too long
  kOrientationLength,  // the instance's orientation is too short or too long
  kMatrix,             // the matrix of a link's pose is no rotation, mirrored or not
  kScale,              // the scale of the instance, or of a link's matrix, is a NaN, too small or too large
  kJoint,              // a posed joint is out of range
  kBox,                // a posed leaf box is out of range
};

// Why an instance is masked: the first cause that the engine finds. Written by why_masked.
struct MaskReason {
  InstanceFlag flag = kInstanceOk;     // the flag that the instance gets
  MaskCause cause = MaskCause::kNone;  // what is wrong
  std::uint32_t link = 0;              // index of the link whose pose it is about; 0 for the instance's own numbers
  std::uint32_t index = 0;             // of the number in the pose or orientation, of the leaf, or of the joint's link
  float value = 0;  // the number; the length; the scale; the largest entry of |R^T R - I|; or the largest coordinate
  float limit = 0;  // what the value must not exceed, or, if it is below this, not fall short of
};

// The value of BatchInput::count for all instances of the batch.
inline constexpr std::uint32_t kAllInstances = 0xffffffff;

// The input and the outputs of one batch for one call. Of a batch of static bodies it has no poses, origins,
// orientations, scales, margins, moved and bounds: they are known, and the bodies rest. Every span has entries for all
// instances, in their order, or is empty. With a count, spans may end anywhere after its instances.
struct BatchInput {
  // Which batch this is. It must be a batch of the same engine. Required.
  BatchId batch;

  // The pose of every link of every instance, from link to instance. Required unless `count` is 0. Poses of links
  // without leaves are read only if a merge needs their joint, or if they move triangles of a leaf.
  PoseView poses;

  // x y z per instance: the instance's origin in the world. Must be finite. Empty (default): all origins are 0.
  Span<const double> origins;

  // Quaternion x y z w per instance: it rotates the instance about its origin, from its frame to the world's axes. The
  // length of the quaternion is divided out. Empty (default): no instance is rotated.
  Span<const float> orientations;

  // Output of run_frame and compute_boxes, one byte per instance: InstanceFlag bits that say why the instance is
  // masked, or 0. Empty (default): nothing is written.
  Span<std::uint8_t> flags;

  // One word per instance: bits of the layers that it is on. Two instances are tested against each other only if
  // (layers of a & mask of b) != 0 and (layers of b & mask of a) != 0. Empty (default): all bits are set.
  Span<const std::uint32_t> layers;

  // One word per instance: bits of the layers that it is tested against. Empty (default): all bits are set.
  Span<const std::uint32_t> layer_masks;

  // Output of run_frame, one byte per instance: 1 if the instance is in a hit, with another instance or within itself,
  // else 0. Empty (default): nothing is written.
  Span<std::uint8_t> in_contact;

  // One factor per instance, from kMinScale to kMaxScale, by which it is scaled about its origin: the translations of
  // its poses, its joints, leaf boxes and shapes. Not together with PoseView::has_scale. Empty (default): no instance
  // is scaled.
  Span<const float> scales;

  // How many instances there are in this call, the first ones of the batch; 0 to its instance_count. The others take no
  // part, and nothing of theirs is read. kAllInstances (default): all. A sequence of which one
  // instance is given is a fixed object in that call.
  std::uint32_t count = kAllInstances;

  // The numbers of the instances that are in this call, each above the one before and below `count`. The others take no
  // part: nothing of theirs is read, and only their bytes of in_contact are written. All other spans are by the number
  // of an instance, as without this list, and so are hits. Characters only. Empty (default): all instances up to
  // `count`; for none, set `count` to 0.
  Span<const std::uint32_t> instances;

  // Input of find_candidates: six floats per instance, its lower x y z and its upper x y z, relative to its origin
  // along the world's axes, that hold its leaf boxes as compute_boxes gives them. run_frame counts the instances whose
  // boxes leave them (FrameStats::instances_beyond_bounds). Empty (default): no bounds are given.
  Span<const float> bounds;

  // One length per instance, from 0 to kMaxCoordinate, in the caller's unit: its own margin. Two instances are tested
  // with the frame's margin and those of both, and two links of one instance with twice its own. sweep_margins fills it
  // so that fast bodies do not pass through each other between two frames. Characters only. Empty (default): instances
  // have no margin of their own.
  Span<const float> margins;

  // One byte per instance. 0 states that the instance rests: its pose, origin, orientation, scale, margin, layers and
  // layer mask are those of this batch's last frame. Then it is neither posed for its bounds nor put into strips
  // again, and hits of two that rest are kept. Any other value states nothing. All instances count as moved in the
  // first frame with `moved`, after a frame that did not answer kOk or had other rules, policies, margin, min_depth,
  // containment or report, and after find_candidates, add_batch, add_static_batch, reserve and remove_batch; those of a
  // batch do where `orientations` become empty or cease to be; an instance does that was not in its batch's last frame,
  // by `count` or `instances`, or was masked there. A build without NDEBUG compares what rests with the last frame, and
  // may answer kMovedAtRest. Characters only. Empty (default): all have moved.
  Span<const std::uint8_t> moved;

  // What the poses are made of. Sequences only. Default: the poses are the caller's.
  StateView states;
};

// What a rule does with the hits of two instances that both rest, and of one that rests and is tested within itself.
// They are those of the frame before.
enum class Resting : std::uint8_t {
  kReported,  // they are reported like all others; the engine keeps them, or tests again where it could not
  kSkipped,   // they are not reported again
};

// What a PairRule pairs.
enum class Pairing : std::uint8_t {
  kBetween,  // links of instances of a with links of other instances of b, if the layers of both instances match
  kWithin,   // links of each instance with each other, except ignored pairs; layers do not matter
};

// Which instances a frame tests against each other. Instances that no rule pairs are not tested.
struct PairRule {
  // A batch that has input in the frame.
  BatchId a;

  // With kBetween: a batch that has input in the frame and is of the same kind as `a`. For characters it may be `a`
  // itself. Static bodies count as characters, but are paired neither among themselves nor within. Two sequences must
  // differ, and must have equally many instances in this call unless one has a single one, or none. With kWithin: `a`
  // itself.
  BatchId b;

  // Whether different instances are paired, or the links of each instance. Default: different instances.
  Pairing pairing = Pairing::kBetween;

  // What is done with instances that rest (BatchInput::moved). Default: their hits are reported.
  Resting resting = Resting::kReported;
};

// ------------------------------------------------------------------------------------------------------------ frame

// What a frame finds out.
enum class Report : std::uint8_t {
  kHits,       // every pair of links that touch, and BatchInput::in_contact if the caller gives it
  kInContact,  // only BatchInput::in_contact: faster, since a pair of instances is done at its first touching leaves
  kDistances,  // for each pair of instances within the margin, the closest (or deepest) pair of links
};

// Two links that touch, or are at most the frame's margin apart. (batch_a, instance_a, link_a) is lower than
// (batch_b, instance_b, link_b). One hit stands for all leaves of the two links.
struct Hit {
  BatchSlot batch_a;         // batch of the first link
  std::uint32_t instance_a;  // index of its instance in batch_a; for a sequence the frame, or 0 for a fixed object
  BatchSlot batch_b;         // batch of the second link
  std::uint32_t instance_b;  // index of its instance in batch_b, likewise
  std::uint16_t link_a;      // index of the first link
  std::uint16_t link_b;      // index of the second link
  std::uint16_t leaf_a;      // index of a leaf on link_a; (leaf_a, leaf_b) is the lowest leaf pair that touches
  std::uint16_t leaf_b;      // index of a leaf on link_b
};

// Two instances that a frame has to test. (batch_a, instance_a) is lower than (batch_b, instance_b).
struct InstancePair {
  BatchSlot batch_a;         // batch of the first instance
  std::uint32_t instance_a;  // its index
  BatchSlot batch_b;         // batch of the second instance
  std::uint32_t instance_b;  // its index
};

// The candidates of find_candidates.
struct CandidateList {
  Span<InstancePair> pairs;      // receives the pairs, in order
  std::size_t pair_count = 0;    // how many pairs were written
  std::size_t pairs_needed = 0;  // how many pairs there are, whether there is room for them or not
};

// What changed between two lists of hits. Written by diff_hits.
struct HitChanges {
  Span<Hit> began;              // receives the hits that only the second list has, in order
  Span<Hit> ended;              // receives the hits that only the first list has, in order
  std::size_t began_count = 0;  // how many there are, also if `began` is too small
  std::size_t ended_count = 0;  // likewise
};

// What find_touching_moments writes for links that touch at no moment.
inline constexpr float kNeverTouch = 2;

// How two links touch: the deepest contact of all parts on the first with all parts on the second, by the frame's exact
// test. If the links are apart, the contact describes their smallest gap. All numbers but the leaves are 0 for two
// half spaces, and if FCL was asked and gave no contact.
// With Exact::kConvex, moving b by depth along normal always parts the two convex parts that the contact is of. For
// boxes, hulls of at most 256 vertices, spheres and capsules, and with a half space no way does that is shorter by more
// than 1e-6 of size; for other shapes the shortest way is searched for. A gap is never larger than the distance, to
// rounding, and at most 1e-5 of size and distance smaller. Each point is in or on its body. point_a - point_b is depth
// along normal, but for what docs/limits.md says.
struct Contact {
  float normal[3];   // unit vector from a to b, in the world's axes
  float depth;       // how far b must move along normal to be free, in the caller's unit; below 0: minus the gap
  float point_a[3];  // x y z of a's point deepest in b, or nearest to b; relative to the origin of instance_a, in the
                     // world's axes
  float point_b[3];  // the same of b, also relative to the origin of instance_a
  std::uint16_t leaf_a;  // index of the leaf of the first link that the contact is of
  std::uint16_t leaf_b;  // index of the leaf of the second link
};

// Two triangles of skins that touch. Written by find_touching_triangles.
struct TouchingTriangles {
  std::uint32_t pair;        // index of the two links
  std::uint16_t leaf_a;      // index of the leaf of the first link
  std::uint16_t leaf_b;      // index of the leaf of the second link
  std::uint32_t triangle_a;  // which triangle of the first leaf: an index in its Leaf::triangles, over 3
  std::uint32_t triangle_b;  // the same of the second leaf
};

// What a frame did. Counts depend neither on the instruction set nor on threads. With Report::kInContact they depend on
// both, because what has already been reported is skipped, and candidates come in another order. Seconds are sums over
// threads, except seconds_total.
struct FrameStats {
  std::uint64_t candidates = 0;               // pairs of characters whose bounds overlap, and characters tested within
  std::uint64_t box_tests = 0;                // overlap tests of two boxes, inner ones and leaves
  std::uint64_t leaf_pairs = 0;               // leaf pairs whose boxes overlap (#coll in the paper) or are inside
  std::uint64_t exact_tests = 0;              // leaf pairs that went to the exact test, at most leaf_pairs
  std::uint64_t false_positives = 0;          // exact tests that found the leaves apart: #false in the paper
  std::uint64_t instances_masked = 0;         // instances that took no part (InstanceFlag says why)
  std::uint64_t instances_beyond_bounds = 0;  // characters whose leaf boxes leave BatchInput::bounds; 0 by `links`
  std::uint64_t instances_resting = 0;        // characters and static bodies that were not bounded again
  std::uint64_t hits_kept = 0;                // of hits_needed: the last frame's hits of two that rest; no test counts
  std::uint64_t leaves_skinned = 0;           // how often a leaf's triangles were skinned; depends on the threads
  std::uint64_t leaves_replaced = 0;          // of these, in the place of another leaf that had been skinned
  double seconds_update = 0;                  // posing and refit: t[upd]
  double seconds_broad = 0;                   // broad phase: finding characters whose bounds overlap
  double seconds_test = 0;                    // box tests: t[test]
  double seconds_query = 0;                   // exact tests, reporting hits, and contacts: t[query]
  double seconds_contact = 0;                 // contacts, which seconds_query includes
  double seconds_total = 0;                   // wall time of the call

  // Where the time of characters goes. The rest of each phase is: posing again, searching, box tests, sorting and exact
  // tests.
  std::uint64_t instances_posed = 0;   // how often a character was posed again for tests; depends on the threads
  std::uint64_t candidates_apart = 0;  // candidates without two leaves whose bounds overlap; 0 without leaf bounds
  double seconds_bound = 0;            // of seconds_update: posing every character for its bounds
  double seconds_sort = 0;             // of seconds_broad: sorting rows into strips
  double seconds_filter = 0;           // of seconds_test: comparing the bounds of leaves
  double seconds_write = 0;            // of seconds_query: writing the hits in their order
};

// One frame: what is posed, what is paired and how, and where the answer goes. Every batch with input is posed. Batches
// without input take no part.
//
// If `hits` is too small, run_frame answers kHitsOverflow. Then hits_needed is the size of `hits` that a second call
// needs, hit_count is 0, and the contents of hits and contacts are unspecified. flags, in_contact and stats are
// complete, but with min_depth in_contact then follows hits of any depth.
struct FrameJob {
  // The batches that take part, each once, in any order. Empty (default): a frame without hits.
  Span<const BatchInput> inputs;

  // What is tested against what, in any order. The same two batches may be paired once per Pairing. Empty (default): a
  // frame without hits.
  Span<const PairRule> rules;

  // How boxes are made and tested, and whether an exact test confirms them. Default: the preset `balanced`.
  Policies policies;

  // A length in the caller's unit, from 0 (default) to kMaxCoordinate. Links that are at most this far apart are
  // reported too. The distance is that of their leaf boxes, or of their shapes if there is an exact test. Two boxes
  // that face each other corner to corner may be reported up to 1.74 margins apart, and those of Refit::kAabbHull and
  // of levels of detail farther (docs/limits.md).
  float margin = 0;

  // A length in the caller's unit, from 0 (default) on. Above 0, hits whose contact is less deep are dropped, so an
  // exact test is needed; 0 drops none. With Exact::kConvex no hit is dropped whose links must move at least this far
  // to part. `hits` needs room for the hits of any depth. Must be 0 with Report::kInContact.
  float min_depth = 0;

  // What the frame finds out. Default: hits.
  Report report = Report::kHits;

  // With Exact::kSurface: whether what is wholly inside a closed part of another instance's skin is a hit, though no
  // triangles touch (docs/exact.md). Other exact tests do not read it. Default: it is a hit.
  bool containment = true;

  // Output: room for the hits, one per two links that touch. They are sorted by batch_a, instance_a, batch_b,
  // instance_b, link_a, link_b. Empty (default): room for no hit. With Report::kInContact nothing is written. With
  // Report::kDistances one hit per two instances is left, but there must be room for all links that it is chosen from.
  Span<Hit> hits;

  // Output: contacts[i] receives the contact of hits[i]. As long as hits, and only with an exact test. Empty (default):
  // no contacts are computed, and Report::kDistances is refused. With Report::kInContact nothing is written.
  Span<Contact> contacts;

  // Output: how many hits, and contacts if there is room for them, were written. 0 with Report::kInContact.
  std::size_t hit_count = 0;

  // Output: how many hits the frame has before min_depth and Report::kDistances drop any, whether `hits` has room for
  // them or not. 0 with Report::kInContact.
  std::size_t hits_needed = 0;

  // Output: counts and times of this frame.
  FrameStats stats;
};

// ----------------------------------------------------------------------------------------------------------- engine

// Where an engine takes its memory from. create_engine copies this struct. Only the calls that add or remove, reserve,
// destroy_engine, and reads beside others (cab/cab.h, Memory) call the functions: on their own thread, of one engine
// one call at a time. Neither function may throw, or call cab.
struct Allocator {
  // Passed to both functions. The caller owns what it points to, which must outlive the engine. Default: null.
  void* user = nullptr;

  // Returns `bytes` of memory at a multiple of `alignment`, a power of two, or null if there is no memory. Required.
  void* (*allocate)(void* user, std::size_t bytes, std::size_t alignment) = nullptr;

  // Takes back memory that allocate returned, with the same bytes and alignment. Required.
  void (*release)(void* user, void* memory, std::size_t bytes, std::size_t alignment) = nullptr;
};

// How an engine runs its tasks. create_engine copies this struct. run_frame calls parallel_for about seven times;
// find_candidates, run_queries, record_tick, compute_contacts, sweep_margins and find_touching_moments call it too. A
// caller with a task graph may run a frame's tasks itself (begin_frame); worker_count is the number of threads that do.
struct Scheduler {
  // Passed to parallel_for. The caller owns what it points to, which must outlive the engine. Default: null.
  void* user = nullptr;

  // How many tasks may run at once, 1 to kMaxWorkers. The engine keeps memory for each worker (add_batch). Required.
  std::uint32_t worker_count = 0;

  // Calls task(context, t, worker) once for every t < task_count, and returns when all calls have returned. Calls that
  // run at the same time must have different `worker`s, each below worker_count. No task waits for another. Must not
  // throw. Required. If it skips tasks, the call answers kTasksLeft; if it repeats or invents tasks or workers,
  // kBadTask: then these do nothing.
  void (*parallel_for)(void* user, std::uint32_t task_count,
                       void (*task)(void* context, std::uint32_t task, std::uint32_t worker), void* context) = nullptr;
};

// What a caller's profiler is told. create_engine copies this struct. The functions are called on the thread that does
// the work, in pairs that lie within each other, and on several threads at the same time: by run_frame with "frame"
// around all of it; by run_queries with "queries"; and by run_frame and run_task, for each task, with the name of its
// step: "bound", "sort", "pair", "keep order", "count hits", "write hits", "sequences" or "contacts". They run in the
// library's floating-point mode, take time away from the frame, and must not throw.
struct Profiler {
  // Passed to both functions. The caller owns what it points to, which must outlive the engine. Default: null.
  void* user = nullptr;

  // Called when a phase begins. The name lives as long as the program. worker: that of the Scheduler; 0 for "frame"
  // and "queries", so calls of run_queries beside each other are told apart by their threads. Required.
  void (*begin)(void* user, const char* phase, std::uint32_t worker) = nullptr;

  // Called when the phase ends, with the same name and worker. Required.
  void (*end)(void* user, const char* phase, std::uint32_t worker) = nullptr;
};

// What create_engine needs to know.
struct EngineDesc {
  // The instruction set of the kernels. Default: the best available one.
  Isa isa = Isa::kAuto;

  // Threads of the built-in scheduler. 1 (default): the calling thread. 0: TBB on every core. n: TBB on at most n
  // threads, and on no more than there are cores. A library built without TBB has one thread whatever is asked for;
  // engine_thread_count tells. Ignored if `scheduler` is given.
  std::uint32_t thread_count = 1;

  // Where memory comes from. Borrowed for the call. Null (default): aligned operator new. For large blocks on Linux it
  // asks for huge pages.
  const Allocator* allocator = nullptr;

  // How tasks run. Borrowed for the call. Null (default): the built-in scheduler.
  const Scheduler* scheduler = nullptr;

  // Profiler hooks, called when phases begin and end. Borrowed for the call. Null (default): nothing is.
  const Profiler* profiler = nullptr;
};

}  // namespace cab

// ------------------------------------------------------------------------------------------ ids in containers, for C++

namespace cab {

// Whether two ids, or two slots, have the same value; and an order, which has no other meaning.
constexpr bool operator==(ArticulationId a, ArticulationId b) noexcept { return a.value == b.value; }
constexpr bool operator!=(ArticulationId a, ArticulationId b) noexcept { return a.value != b.value; }
constexpr bool operator<(ArticulationId a, ArticulationId b) noexcept { return a.value < b.value; }
constexpr bool operator==(BatchId a, BatchId b) noexcept { return a.value == b.value; }
constexpr bool operator!=(BatchId a, BatchId b) noexcept { return a.value != b.value; }
constexpr bool operator<(BatchId a, BatchId b) noexcept { return a.value < b.value; }
constexpr bool operator==(BatchSlot a, BatchSlot b) noexcept { return a.value == b.value; }
constexpr bool operator!=(BatchSlot a, BatchSlot b) noexcept { return a.value != b.value; }
constexpr bool operator<(BatchSlot a, BatchSlot b) noexcept { return a.value < b.value; }

}  // namespace cab

namespace std {

// The hash of an articulation's id.
template <>
struct hash<cab::ArticulationId> {
  // Of its value.
  size_t operator()(cab::ArticulationId id) const noexcept { return static_cast<size_t>(id.value ^ id.value >> 32); }
};

// The hash of a batch's id.
template <>
struct hash<cab::BatchId> {
  // Of its value.
  size_t operator()(cab::BatchId id) const noexcept { return static_cast<size_t>(id.value ^ id.value >> 32); }
};

// The hash of a batch's slot.
template <>
struct hash<cab::BatchSlot> {
  // Of its value.
  size_t operator()(cab::BatchSlot slot) const noexcept { return slot.value; }
};

}  // namespace std
