// The plain data of cab's public API: ids, statuses, descriptions, poses, hits, jobs. The calls are in cab/cab.h.
//
// Conventions, for all of the API:
//
// Units       All lengths are in one unit, the caller's choice: no constant of the library is a length. Angles do not
//             occur: rotations are quaternions or matrices. Times are in seconds.
// Frames      "link" is a link's own frame. "instance" is the frame of one posed articulation: a pose takes points of a
//             link to it. "world" is common to all instances: a point p of an instance stands there at
//             origin + orientation * p. "Relative to the instance's origin" means in the world's axes, less the origin.
// Rotations   Quaternions are x y z w. Vectors are columns, so a rotated point is R * p. PoseFormat says which matrices
//             are stored by rows and which by columns.
// Handedness  Any will do, as will any axis as "up", if all input agrees. Rotations, and the axes of boxes, have
//             determinant 1.
// Indices     Links, leaves, instances and entries of spans count from 0, ids from 1.
// Precision   Poses, boxes and shapes are float, relative to an instance. Origins are double. Every box contains, in
//             floating point, what it stands for: rounding may add a pair that is apart, but loses none that touches.
// Ownership   The caller owns every span and pointer; a call borrows them until it returns. What a call writes must not
//             overlap what else it writes or reads. add_articulation copies what it keeps.
// Same bits   Boxes, hits and their order depend on the input alone, not on the instruction set, the number of threads,
//             earlier frames or the caller's floating-point mode. With an exact test the hits are those of one build.
//             docs/embedding.md, "What is promised", has the details.
// Defaults    Spans are empty by default, ids name no object, and other members show their default. Plain results, such
//             as Hit and Contact, have no defaults.
#pragma once

#include <cab/policy.h>
#include <cab/span.h>

#include <cstddef>
#include <cstdint>

namespace cab {

// ------------------------------------------------------------------------------------------------ statuses, limits

// What a call answers. The comments are the words of to_string(Status). Every answer but kOk leaves all outputs as they
// were, with two exceptions: kHitsOverflow (see FrameJob), and kOutOfMemory of run_frame, after which `flags` and
// `in_contact` may be half written.
enum class Status : std::int32_t {
  kOk = 0,               // ok
  kOutOfMemory,          // an allocation failed
  kBusy,                 // another call on the same engine is running
  kIsaNotAvailable,      // isa is an instruction set that this CPU or this build lacks
  kBadScheduler,         // scheduler lacks parallel_for, or its worker_count is 0
  kBadAllocator,         // allocator lacks allocate or release
  kNoLinks,              // link_parents is empty, but an articulation needs at least one link
  kTooManyLinks,         // link_parents holds more than 1024 links
  kNoLeaves,             // leaves is empty, but an articulation needs at least one leaf
  kTooManyLeaves,        // leaves holds more than 1024 leaves
  kBadParent,            // link_parents must be -1 for the first link and an earlier link for every other
  kBadJoint,             // link_joints must be empty or hold one finite point per link
  kBadLeafLink,          // link of a leaf is not the index of a link
  kBadLeafBox,           // box of a leaf is not finite, has a negative half extent or exceeds 1e18
  kBadLeafAxes,          // box of a leaf has axes that are not orthonormal and right-handed to 1e-5
  kBadShape,             // parts of a leaf need finite positions, unit quaternions, positive sizes and a volume
  kShapeOutsideLeafBox,  // parts of a leaf must lie within its box
  kBadVertices,          // vertices must hold x y z of at least one point, each number finite and at most 1e18
  kBadIgnoredPair,       // ignored_pairs names a link that does not exist
  kBadRestPose,          // rest_pose has an unknown format, an invalid stride, or values that are not a rigid pose
  kUnknownArticulation,  // the articulation id is not one of this engine
  kUnknownBatch,         // the batch id is not one of this engine
  kBadBatchKind,         // kind is not a value of BatchKind
  kNoInstances,          // instance_count is 0, but a batch needs at least one instance
  kTooManyInstances,     // instance_count is above 2^24, or the engine would exceed 4096 batches or 2^31 characters
  kBatchGivenTwice,      // inputs holds the same batch twice
  kBadPoses,             // poses has no data, an unknown format, or a stride that is too small or not a multiple of 4
  kBadOrigins,           // origins must be empty or hold three finite doubles per instance
  kBadOrientations,      // orientations must be empty or hold four floats per instance
  kBadFlags,             // flags must be empty or hold one byte per instance
  kBadLayers,            // layers and layer_masks must each be empty or hold one word per instance
  kBadInContact,         // in_contact must be empty or hold one byte per instance
  kBadPairRule,          // rules names a batch without input, or a pairing that its batches cannot have
  kPairRuleGivenTwice,   // rules pairs the same two batches twice in the same way
  kBadPolicy,            // policies holds a value that its enumeration lacks
  kBadReport,            // report is not a value of Report
  kBadMargin,            // margin must be finite, not negative and at most 1e18
  kBadHitBuffer,         // hits has a size and no data, or contacts is neither empty nor as long as hits
  kContactsNeedExact,    // contacts need an exact test
  kBadOutput,            // an output is null or too small
  kHitsOverflow,         // hits is too small for all hits
};

// Limits. Links and leaves are counted per articulation, instances per batch, batches per engine. An engine also holds
// at most 2^31 characters, over all its batches.
inline constexpr std::uint32_t kMaxLinks = 1024;
inline constexpr std::uint32_t kMaxLeaves = 1024;
inline constexpr std::uint32_t kMaxInstances = 1u << 24;
inline constexpr std::uint32_t kMaxBatches = 4096;

// The largest magnitude of a coordinate or half extent, relative to the instance's origin. An instance whose pose
// exceeds it is masked like one whose pose is not finite: products of the overlap test would overflow float.
inline constexpr float kMaxCoordinate = 1e18f;

// ------------------------------------------------------------------------------------------------------ basic types

// An articulation of one engine. It stays valid until the engine is destroyed.
struct ArticulationId {
  std::uint32_t value = 0;  // counts from 1 in the order of add_articulation; 0 (default) is no articulation
};

// A batch of one engine. It stays valid until the engine is destroyed.
struct BatchId {
  std::uint32_t value = 0;  // counts from 1 in the order of add_batch; 0 (default) is no batch
};

// The instruction set that kernels use. All give the same bits.
enum class Isa : std::uint8_t {
  kAuto,    // the best that this CPU, its operating system and this build offer
  kScalar,  // no SIMD: the same source compiled for single floats
  kSse2,    // x86-64, always there
  kAvx2,    // x86-64
  kAvx512,  // x86-64 with F, CD, DQ, BW and VL
  kNeon64,  // 64-bit ARM, always there
};
inline constexpr std::uint32_t kIsaCount = 6;

// An oriented box: the points center + x0 * axis[0] + x1 * axis[1] + x2 * axis[2] with |xk| <= half[k]. The frame is
// that of what the box belongs to: the link's for Leaf::box and fit_box, relative to the instance's origin for
// compute_boxes.
struct Box {
  float center[3];   // x y z of the centre, in the caller's unit
  float axis[3][3];  // axis[k] is x y z of the k-th axis: orthonormal, right-handed
  float half[3];     // half extent along each axis, in the caller's unit, 0 or more
};

// ------------------------------------------------------------------------------------------------------------ poses

// How one pose, from link to instance, is stored in floats.
enum class PoseFormat : std::uint8_t {
  kQuaternionTranslation,  // 7 floats: quaternion x y z w, whose length is divided out; translation x y z
  kMatrix3x4,              // 12 floats by rows: three rows of four, the translation in the last column
  kMatrix4x4,              // 16 floats by columns, as in glTF and ozz: translation in floats 12 to 14, last row unread
};

// The poses of all links of all instances of a batch. Each goes from link to instance ("model space"), never from link
// to parent. The pose of link l of instance i begins at byte i * instance_stride + l * link_stride of data, so poses
// may be members of larger structures of the caller's.
struct PoseView {
  // How every pose is stored. Translations are in the caller's unit.
  PoseFormat format = PoseFormat::kQuaternionTranslation;

  // The first float of the first pose. Borrowed. Required, except in ArticulationDesc::rest_pose.
  const float* data = nullptr;

  // Bytes from one link's pose to the next link's: a multiple of 4, at least the size of a pose. 0 (default): packed.
  std::size_t link_stride = 0;

  // Bytes from one instance's first pose to the next instance's: a multiple of 4, at least as long as the poses of all
  // links. 0 (default): link_stride times the number of links.
  std::size_t instance_stride = 0;
};

// ----------------------------------------------------------------------------------------------------- articulation

// The shape of a convex part, and what its size means. All shapes are centred at the part's origin but hulls, whose
// vertices say where they are.
enum class ShapeKind : std::uint8_t {
  kBox,         // size: half extents along x, y, z
  kEllipsoid,   // size: radii along x, y, z
  kCapsule,     // size: radius, half the length of the cylinder along z, unused
  kConvexHull,  // the convex hull of `vertices`; size unused
};

// One convex part of a leaf's exact shape, in a frame of its own. It must lie within its leaf's box, to 2^-22 of the
// sum of the box's half extents.
struct ConvexPart {
  // Which shape it is.
  ShapeKind kind = ShapeKind::kBox;

  // x y z of the part's origin in the link's frame.
  float position[3] = {0, 0, 0};

  // Quaternion x y z w that rotates from the part's frame to the link's. Its squared length must be 1, to 1e-3.
  float rotation[4] = {0, 0, 0, 1};

  // Lengths along the part's axes; ShapeKind says which. Those that the kind uses must be above 0.
  float size[3] = {0, 0, 0};

  // kConvexHull alone: x y z of each vertex in the part's frame. At least four, not all in one plane; vertices inside
  // the hull are allowed.
  Span<const float> vertices;
};

// A rigid body of an articulation, fixed to one link. A link may carry several leaves, or no leaf.
struct Leaf {
  // Index of the link that carries it.
  std::uint32_t link = 0;

  // Its box, in the link's frame. Half extents may be 0: a plate, a segment or a point is a box. The axes must be
  // orthonormal and right-handed, to 1e-5. fit_box makes one about a mesh.
  Box box = {};

  // The exact shape, as a union of convex parts. Used by exact tests and by Refit::kAabbVertices. Empty (default): the
  // box itself.
  Span<const ConvexPart> parts;
};

// Two links of one articulation, in either order.
struct LinkPair {
  std::uint32_t a = 0;  // index of a link
  std::uint32_t b = 0;  // index of a link; a pair of equal links says nothing
};

// An articulation: a tree of links and the leaves on them. It does not change once it is added. The last three members
// say which links of one instance are never reported against each other. They change nothing between two instances.
struct ArticulationDesc {
  // The index of each link's parent: -1 for the first link, lower than its own index for every other. 1 to kMaxLinks.
  Span<const std::int32_t> link_parents;

  // x y z per link: the joint with its parent, in the link's own frame. Empty (default): all joints are at the origins
  // of the frames. Joints guide how inner boxes are made.
  Span<const float> link_joints;

  // The leaves, in any order. 1 to kMaxLeaves.
  Span<const Leaf> leaves;

  // Pairs of links to ignore. A pair may be listed twice and in either order. Empty by default.
  Span<const LinkPair> ignored_pairs;

  // Two links are ignored if the way between them has at most this many joints: with 1 a link and its parent, with 2
  // also siblings, and a link and its grandparent. 0 (default): no pair is ignored for this.
  std::uint32_t ignored_hops = 0;

  // The pose of one instance. Two links are ignored if their leaf boxes touch in it, as oriented boxes in a frame
  // without orientation or exact test. Without data (default): no pair is ignored for this.
  PoseView rest_pose = {};
};

// Why two links of one instance are no pair. Bits, which IgnoredPair::reasons combines.
enum IgnoredReason : std::uint8_t {
  kIgnoredExplicitly = 1,  // ArticulationDesc::ignored_pairs names them
  kIgnoredByHops = 2,      // they are at most ArticulationDesc::ignored_hops joints apart
  kIgnoredAtRest = 4,      // they touch in ArticulationDesc::rest_pose, by oriented leaf boxes alone
};

// Two links that are never reported against each other within an instance. Written by ignored_pairs.
struct IgnoredPair {
  std::uint16_t a;       // index of the lower link
  std::uint16_t b;       // index of the higher link
  std::uint8_t reasons;  // a set of IgnoredReason, never empty
};

// MergeStep::joint_link of two nodes that share no joint.
inline constexpr std::uint16_t kNoJoint = 0xffff;

// One merge of the fixed bottom-up order of a hierarchy. Its nodes are the leaves, 0 to leaf_count - 1, and after them
// one per step: step s makes node leaf_count + s. Written by merge_steps.
struct MergeStep {
  std::uint16_t left;        // index of one child, a leaf or a node of an earlier step
  std::uint16_t right;       // index of the other child
  std::uint16_t joint_link;  // the link whose joint the two children share, or kNoJoint
};

// Counts of an articulation. Written by articulation_info.
struct ArticulationInfo {
  std::uint32_t link_count = 0;          // links
  std::uint32_t leaf_count = 0;          // leaves
  std::uint32_t node_count = 0;          // nodes of the hierarchy, 2 * leaf_count - 1: leaves first, the root last
  std::uint32_t depth = 0;               // merges on the longest way from the root to a leaf
  std::uint32_t ignored_pair_count = 0;  // entries that ignored_pairs writes
};

// ---------------------------------------------------------------------------------------------------------- batches

// What the instances of a batch are.
enum class BatchKind : std::uint8_t {
  kCharacters,  // all live at once: each may touch every other
  kSequence,    // instance f is frame f of one character: it may touch only frame f of other sequences
};

// A batch: instances of one articulation that are posed together.
struct BatchDesc {
  // What every instance is; of the same engine. Required.
  ArticulationId articulation;

  // How many instances there are, 1 to kMaxInstances. A sequence with one instance is a fixed object, such as a table:
  // it is paired with every frame of other sequences.
  std::uint32_t instance_count = 0;

  // What the instances are to each other.
  BatchKind kind = BatchKind::kCharacters;
};

// Why an instance is masked. A masked instance is in no pair of the frame, and compute_boxes writes zero boxes for it;
// it changes no bit of other instances. The values are bits of BatchInput::flags.
enum InstanceFlag : std::uint8_t {
  kInstanceOk = 0,         // it takes part
  kInstanceNotFinite = 1,  // a NaN, an infinity, or a coordinate above kMaxCoordinate
  kInstanceNotRigid = 2,   // a quaternion shorter than 1e-3 or longer than 1e3, or a matrix off a rotation by over 1e-3
};

// What one batch brings to one call. Every span has entries for all instances, in their order, or is empty.
struct BatchInput {
  // Which batch this is; of the same engine. Required.
  BatchId batch;

  // The pose of every link of every instance, from link to instance. Required. Poses of links without leaves are read
  // only where a merge needs their joint.
  PoseView poses;

  // x y z per instance: its origin in the world, in double. Finite. Empty (default): all 0.
  Span<const double> origins;

  // Quaternion x y z w per instance: rotates the instance about its origin, from its frame to the world's axes. Its
  // length is divided out. Empty (default): no rotation.
  Span<const float> orientations;

  // Output, one byte per instance: the InstanceFlag set that says why it is masked, or 0. Empty (default): not asked.
  Span<std::uint8_t> flags;

  // One word per instance: the layers it is on, as bits. Two instances are tested against each other only if
  // (layers of a & mask of b) != 0 and (layers of b & mask of a) != 0. Empty (default): all bits are set.
  Span<const std::uint32_t> layers;

  // One word per instance: the layers it is tested against, as bits. Empty (default): all bits are set.
  Span<const std::uint32_t> layer_masks;

  // Output of run_frame, one byte per instance: 1 if it is in a hit, with another instance or within itself, else 0.
  // Empty (default): not asked.
  Span<std::uint8_t> in_contact;
};

// What a rule pairs.
enum class Pairing : std::uint8_t {
  kBetween,  // links of instances of a with links of other instances of b, where the layers of the two match
  kWithin,   // links of each instance with each other, but for ignored pairs; layers do not matter
};

// Which instances a frame tests against each other. What no rule pairs is not tested.
struct PairRule {
  // A batch that has input.
  BatchId a;

  // With kBetween a batch that has input and is of the same kind. For characters it may be `a` itself. Two sequences
  // must differ, and must have equally many instances unless one has a single instance. With kWithin it must be `a`.
  BatchId b;

  // What is paired.
  Pairing pairing = Pairing::kBetween;
};

// ------------------------------------------------------------------------------------------------------------ frame

// What a frame finds out.
enum class Report : std::uint8_t {
  kHits,       // every two links that touch, and BatchInput::in_contact where it is asked for
  kInContact,  // BatchInput::in_contact alone: faster, since a pair of instances ends at its first touching leaves
};

// Two links that touch, or are nearer than the frame's margin. (batch_a, instance_a, link_a) is lower than
// (batch_b, instance_b, link_b). One hit stands for all leaves of the two links.
struct Hit {
  BatchId batch_a;           // batch of the first link
  std::uint32_t instance_a;  // index of its instance in batch_a; for a sequence the frame, or 0 if it has only one
  BatchId batch_b;           // batch of the second link
  std::uint32_t instance_b;  // index of its instance in batch_b, likewise
  std::uint16_t link_a;      // index of the first link
  std::uint16_t link_b;      // index of the second link
  std::uint16_t leaf_a;      // index of a leaf on link_a; (leaf_a, leaf_b) is the lowest leaf pair that touches
  std::uint16_t leaf_b;      // index of a leaf on link_b
};

// Where the two leaves of a hit touch, by FCL: the deepest contact of their parts. If they are apart, but nearer than
// the margin, it is the smallest gap. All numbers are 0 where FCL called the leaves touching but gave no contact.
struct Contact {
  float normal[3];  // unit vector from a to b, in the world's axes
  float depth;      // how far b must move along normal to be free, in the caller's unit; a gap counts below 0
  float point[3];   // x y z relative to the origin of instance_a; of a gap the middle
};

// What a frame did. Counts depend on neither instruction set nor threads, except with Report::kInContact, where they
// depend on which task comes first. Seconds are sums over threads, but for seconds_total.
struct FrameStats {
  std::uint64_t candidates = 0;        // pairs of characters that come near each other, and characters tested within
  std::uint64_t box_tests = 0;         // overlap tests of two boxes, inner ones and leaves
  std::uint64_t leaf_pairs = 0;        // leaf pairs whose boxes overlap: #coll in the paper
  std::uint64_t exact_tests = 0;       // leaf pairs that the exact test was asked about, at most leaf_pairs
  std::uint64_t false_positives = 0;   // exact tests that denied the overlap: #false in the paper
  std::uint64_t instances_masked = 0;  // instances whose pose took no part (InstanceFlag)
  double seconds_update = 0;           // posing and refit: t[upd]
  double seconds_broad = 0;            // which characters come near each other
  double seconds_test = 0;             // box tests: t[test]
  double seconds_query = 0;            // exact tests, reporting of hits, contacts: t[query]
  double seconds_contact = 0;          // the part of seconds_query that contacts took
  double seconds_total = 0;            // wall time of the call
};

// One frame: what is posed, what is paired and how, and where the answer goes. Every batch with input is posed. Batches
// without input take no part.
//
// If `hits` is too small, run_frame answers kHitsOverflow. hits_needed is then the room that a second call needs,
// hit_count is 0, and the contents of hits and contacts mean nothing. flags, in_contact and stats are complete.
struct FrameJob {
  // The batches that take part, each once, in any order. Empty (default): a frame without hits.
  Span<const BatchInput> inputs;

  // What is tested against what, in any order. The same two batches may be paired once per Pairing. Empty (default): a
  // frame without hits.
  Span<const PairRule> rules;

  // How boxes are made and tested, and whether an exact test confirms them. Default: the preset `balanced`.
  Policies policies;

  // A length, 0 (default) to kMaxCoordinate. Links that are at most this far apart are reported too: by their boxes, or
  // by their shapes if there is an exact test. Boxes may also be reported whose corners are up to 1.74 margins apart.
  float margin = 0;

  // What the frame finds out.
  Report report = Report::kHits;

  // Output: room for the hits, one per two links that touch. They are sorted by batch_a, instance_a, batch_b,
  // instance_b, link_a, link_b. Empty (default): room for no hit. With Report::kInContact it is left alone.
  Span<Hit> hits;

  // Output: room for the contact of each hit, as many as hits. Needs an exact test. Empty (default): not asked. With
  // Report::kInContact it is left alone.
  Span<Contact> contacts;

  // Output: how many hits (and contacts) were written. 0 with Report::kInContact.
  std::size_t hit_count = 0;

  // Output: how many hits the frame has, whether there was room or not. 0 with Report::kInContact.
  std::size_t hits_needed = 0;

  // Output: counts and times.
  FrameStats stats;
};

// ----------------------------------------------------------------------------------------------------------- engine

// Where an engine takes its memory from. create_engine copies it. Only the calls that add or destroy something use it,
// on their own thread. Neither function may throw.
struct Allocator {
  // Handed to both functions. It is the caller's, and must outlive the engine.
  void* user = nullptr;

  // Returns `bytes` of memory at a multiple of `alignment`, a power of two, or null if there is no memory. Required.
  void* (*allocate)(void* user, std::size_t bytes, std::size_t alignment) = nullptr;

  // Takes back what allocate returned, with the same bytes and alignment. Required.
  void (*release)(void* user, void* memory, std::size_t bytes, std::size_t alignment) = nullptr;
};

// How an engine runs its tasks. create_engine copies it. Only run_frame uses it, about five times per frame.
struct Scheduler {
  // Handed to parallel_for. It is the caller's, and must outlive the engine.
  void* user = nullptr;

  // How many tasks may run at once, at least 1. Each worker has memory of its own (add_batch).
  std::uint32_t worker_count = 0;

  // Calls task(context, t, worker) once for every t < task_count, and returns when all calls have returned. Calls that
  // run at the same time must have different `worker`s, each below worker_count. A task may wait for others that have
  // begun, so a call must not be suspended for another task of the same thread. Must not throw. Required.
  void (*parallel_for)(void* user, std::uint32_t task_count,
                       void (*task)(void* context, std::uint32_t task, std::uint32_t worker), void* context) = nullptr;
};

// How an engine is made.
struct EngineDesc {
  // The instruction set of its kernels.
  Isa isa = Isa::kAuto;

  // Threads of the built-in scheduler. 1 (default): the calling thread. 0: TBB on every core. n: TBB on at most n
  // threads, and on no more than there are cores. Ignored if `scheduler` is given.
  std::uint32_t thread_count = 1;

  // Where memory comes from. Borrowed for the call. Null (default): aligned operator new, which on Linux asks for huge
  // pages for large blocks.
  const Allocator* allocator = nullptr;

  // How tasks run. Borrowed for the call. Null (default): the built-in scheduler.
  const Scheduler* scheduler = nullptr;
};

}  // namespace cab
