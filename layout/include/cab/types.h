// The plain data of cab's public API: ids, statuses, descriptions, poses, boxes, hits.
//
// Units: lengths in the caller's unit (metres are assumed nowhere); angles never appear.
// Frames: "link" is a link's own frame, "instance" is the world's orientation with its origin at the
// instance's origin, "world" adds that origin in double.
// Ownership: every Span and pointer is borrowed for the duration of the call that takes it.
#pragma once

#include <cab/policy.h>
#include <cab/span.h>

#include <cstddef>
#include <cstdint>

namespace cab {

// What a call answers. Anything but kOk left its outputs untouched, but for kHitsOverflow (see FrameJob) and run_frame's
// kOutOfMemory, after which flags and in_contact may be half written.
enum class Status : std::int32_t {
  kOk = 0,
  kOutOfMemory,          // the allocator returned null, or std::bad_alloc
  kBusy,                 // another call on the same engine is running
  kIsaNotAvailable,      // this CPU or this build lacks the instruction set asked for
  kBadScheduler,         // worker_count 0, or no parallel_for
  kBadAllocator,         // one of allocate and release is null
  kNoLinks,              // an articulation needs at least one link
  kTooManyLinks,         // more than kMaxLinks
  kNoLeaves,             // an articulation needs at least one leaf
  kTooManyLeaves,        // more than kMaxLeaves
  kBadParent,            // the first link must have parent -1, every other a parent before it
  kBadJoint,             // joints must be one finite point a link, or none at all
  kBadLeafLink,          // a leaf names a link that does not exist
  kBadLeafBox,           // centre or half extents not finite, negative or above kMaxCoordinate
  kBadLeafAxes,          // axes of a leaf box not orthonormal and right-handed to 1e-5
  kBadShape,             // a convex part with sizes not finite or not positive, or a rotation that is none
  kShapeOutsideLeafBox,  // a convex part sticks out of its leaf's box
  kBadVertices,          // no vertices, not x y z of each, not finite, or a coordinate above kMaxCoordinate
  kBadIgnoredPair,       // an ignored pair names a link that does not exist
  kBadRestPose,          // a rest pose's format or strides are none that poses may have, or its numbers no pose
  kUnknownArticulation,  // no articulation of this engine has that id
  kUnknownBatch,         // no batch of this engine has that id
  kBadBatchKind,         // a batch's kind holds a value that its enumeration lacks
  kNoInstances,          // a batch needs at least one instance
  kTooManyInstances,     // more than kMaxInstances in a batch, kMaxBatches, or 2^31 characters in an engine
  kBatchGivenTwice,      // a batch appears twice in the inputs of one call
  kBadPoses,             // poses missing, or the stride is too small or no multiple of 4 bytes
  kBadOrigins,           // origins must be none or three doubles an instance, and finite
  kBadOrientations,      // orientations must be none or four floats an instance
  kBadFlags,             // flags must be none or one an instance
  kBadLayers,            // layers and layer_masks must each be none or one an instance
  kBadInContact,         // in_contact must be none or one byte an instance
  kBadPairRule,          // a rule names a batch without input, or a pairing its batches cannot have
  kPairRuleGivenTwice,   // the same two batches are paired twice in the same way
  kBadPolicy,            // a policy field holds a value that its enumeration lacks
  kBadReport,            // a frame's report holds a value that its enumeration lacks
  kBadMargin,            // the margin must be finite, not negative and at most kMaxCoordinate
  kBadHitBuffer,         // hits has a size and no data, or contacts is neither empty nor as long as hits
  kContactsNeedExact,    // contacts were asked for with the exact test `none`
  kBadOutput,            // an output span is too small for what was asked
  kHitsOverflow,         // more hits than the caller's buffer holds; hits_needed says how many
};

// Limits of one engine.
inline constexpr std::uint32_t kMaxLinks = 1024;
inline constexpr std::uint32_t kMaxLeaves = 1024;
inline constexpr std::uint32_t kMaxInstances = 1u << 24;
inline constexpr std::uint32_t kMaxBatches = 4096;

// Largest magnitude of a coordinate or half extent relative to the instance's origin. A pose that leaves it is
// masked like one that is not finite: beyond it products of the overlap test would overflow float32.
inline constexpr float kMaxCoordinate = 1e18f;

// Ids of one engine; 0 is no object.
struct ArticulationId {
  std::uint32_t value = 0;
};
struct BatchId {
  std::uint32_t value = 0;
};

// Instruction sets. kAuto is the best that this CPU, its operating system and this build offer.
enum class Isa : std::uint8_t { kAuto, kScalar, kSse2, kAvx2, kAvx512, kNeon64 };
inline constexpr std::uint32_t kIsaCount = 6;

// An oriented box: {center + sum x_k axis[k] : |x_k| <= half[k]}, axis[k] is the k-th unit axis.
struct Box {
  float center[3];
  float axis[3][3];
  float half[3];
};

// ------------------------------------------------------------------------------------------------------ poses

enum class PoseFormat : std::uint8_t {
  kQuaternionTranslation,  // 7 floats: unit quaternion x y z w, translation x y z
  kMatrix3x4,              // 12 floats: three rows of four, the translation in the last column
  kMatrix4x4,              // 16 floats: four columns of four, the translation in floats 12..14 (glTF, ozz)
};

// Poses of all links of all instances, link to instance (model space, never parent-local). The pose of link l of
// instance i starts at data + i * instance_stride + l * link_stride, strides in bytes, multiples of 4.
// Strides of 0 mean densely packed.
struct PoseView {
  PoseFormat format = PoseFormat::kQuaternionTranslation;
  const float* data = nullptr;
  std::size_t link_stride = 0;
  std::size_t instance_stride = 0;
};

// ---------------------------------------------------------------------------------------------- articulation

enum class ShapeKind : std::uint8_t {
  kBox,         // size = half extents
  kEllipsoid,   // size = radii
  kCapsule,     // size = {radius, half length of the cylinder along z, unused}
  kConvexHull,  // the hull of `vertices`; size unused
};

// One convex part of a leaf's exact shape. vertex is in the part's own frame; the part is placed in the link's
// frame by rotation (unit quaternion x y z w) and then position.
struct ConvexPart {
  ShapeKind kind = ShapeKind::kBox;
  float position[3] = {0, 0, 0};
  float rotation[4] = {0, 0, 0, 1};
  float size[3] = {0, 0, 0};
  Span<const float> vertices;  // kConvexHull: x y z of each vertex, at least 4 that are not in one plane
};

// A rigid body of the hierarchy: a box fixed in the frame of one link, and what the exact test sees instead of
// it (no parts: the box itself).
struct Leaf {
  std::uint32_t link = 0;
  Box box = {};
  Span<const ConvexPart> parts;
};

struct LinkPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};

// An acyclic articulation. link_parents[0] is -1, every other parent has a lower index. link_joints (x y z of
// each link's joint with its parent, in the link's own frame) may be empty: the joint is then at the frame's
// origin. Between links of one instance are never reported:
//   ignored_pairs, whatever the order of the two;
//   links that are ignored_hops joints apart or less (0: none; 1: parent and child; 2: also siblings and the like);
//   links whose leaf boxes touch in rest_pose, the pose of one instance (no data: none). They touch where a frame
//   with that pose and no orientation would report them by any refit of oriented boxes, without an exact test.
struct ArticulationDesc {
  Span<const std::int32_t> link_parents;
  Span<const float> link_joints;
  Span<const Leaf> leaves;
  Span<const LinkPair> ignored_pairs;
  std::uint32_t ignored_hops = 0;
  PoseView rest_pose = {};
};

// Why two links of one instance are no pair (bits).
enum IgnoredReason : std::uint8_t {
  kIgnoredExplicitly = 1,  // ArticulationDesc::ignored_pairs
  kIgnoredByHops = 2,      // ArticulationDesc::ignored_hops
  kIgnoredAtRest = 4,      // ArticulationDesc::rest_pose
};

// Two different links, a < b, that are never reported against each other within an instance; reasons is an
// IgnoredReason set.
struct IgnoredPair {
  std::uint16_t a;
  std::uint16_t b;
  std::uint8_t reasons;
};

inline constexpr std::uint16_t kNoJoint = 0xffff;

// One merge of the fixed bottom-up order: node leaf_count + s of the hierarchy is step s, made of nodes left and
// right. joint_link is the link whose joint the two share, kNoJoint where they share none.
struct MergeStep {
  std::uint16_t left;
  std::uint16_t right;
  std::uint16_t joint_link;
};

struct ArticulationInfo {
  std::uint32_t link_count = 0;
  std::uint32_t leaf_count = 0;
  std::uint32_t node_count = 0;  // 2 leaf_count - 1; leaves first, the root last
  std::uint32_t depth = 0;       // merges on the longest way from the root to a leaf
  std::uint32_t ignored_pair_count = 0;
};

// ---------------------------------------------------------------------------------------------------- batches

enum class BatchKind : std::uint8_t {
  kCharacters,  // instances live at once: every one may meet every other
  kSequence,    // instance f is frame f of one character: it meets only instance f of other sequences
};

// n instances of one articulation. A sequence of one instance meets every frame of the others (a table).
struct BatchDesc {
  ArticulationId articulation;
  std::uint32_t instance_count = 0;
  BatchKind kind = BatchKind::kCharacters;
};

// Why an instance takes no part in a frame (bits).
enum InstanceFlag : std::uint8_t {
  kInstanceOk = 0,
  kInstanceNotFinite = 1,  // a NaN, an infinity, or a coordinate above kMaxCoordinate
  kInstanceNotRigid = 2,   // a zero quaternion, or a matrix that is scaled, mirrored or skewed by more than 1e-3
};

// One batch's poses of a frame. origins: x y z of each instance in the world, empty = all zero. orientations:
// x y z w of each instance, applied about its origin, empty = identity. flags (optional) receives one
// InstanceFlag set an instance. layers and layer_masks: one word an instance, empty = all bits set; two different
// instances are tested only when (layer of a & mask of b) != 0 and (layer of b & mask of a) != 0. Within one instance
// they change nothing. in_contact (optional, written by run_frame alone) receives 1 for an instance that is in a hit, with
// another or within itself, else 0.
struct BatchInput {
  BatchId batch;
  PoseView poses;
  Span<const double> origins;
  Span<const float> orientations;
  Span<std::uint8_t> flags;
  Span<const std::uint32_t> layers;
  Span<const std::uint32_t> layer_masks;
  Span<std::uint8_t> in_contact;
};

enum class Pairing : std::uint8_t {
  kBetween,  // instances of a against instances of b; a = b: every two different instances of one batch
  kWithin,   // links of one instance against each other; a = b
};

struct PairRule {
  BatchId a;
  BatchId b;
  Pairing pairing = Pairing::kBetween;
};

// ------------------------------------------------------------------------------------------------------ frame

// What a frame is to find out.
enum class Report : std::uint8_t {
  kHits,       // every link pair that touches
  kInContact,  // which instances touch anything (BatchInput::in_contact), and no hits: stops at an instance's first
};

// Two links that touch, or are nearer than the frame's margin. (batch_a, instance_a, link_a) <
// (batch_b, instance_b, link_b); leaf_a and leaf_b are the lowest leaves of the two links that touch.
struct Hit {
  BatchId batch_a;
  std::uint32_t instance_a;
  BatchId batch_b;
  std::uint32_t instance_b;
  std::uint16_t link_a, link_b;
  std::uint16_t leaf_a, leaf_b;
};

// Where two links touch, from FCL: the deepest contact of the hit's leaf pair. normal is a unit vector from a to
// b in world axes, depth is how far b must move along it, point lies relative to the origin of instance a. Of a pair
// that is apart, but nearer than the frame's margin, depth is the distance below 0, and point the middle of the gap.
// A normal of 0: FCL called the pair touching but gave no contact; depth and point are 0 then.
struct Contact {
  float normal[3];
  float depth;
  float point[3];
};

// What a frame did; the paper's columns. Seconds are summed over the threads that worked. With Report::kInContact counts
// depend on which task came first.
struct FrameStats {
  std::uint64_t candidates = 0;       // characters: pairs whose layers and bounds overlap, and those tested within
  std::uint64_t box_tests = 0;        // overlap tests of two boxes, inner or leaf
  std::uint64_t leaf_pairs = 0;       // the paper's #coll: leaf pairs whose boxes overlap
  std::uint64_t exact_tests = 0;      // exact queries made (at most leaf_pairs)
  std::uint64_t false_positives = 0;  // the paper's #false: exact queries that answered no
  std::uint64_t instances_masked = 0;
  double seconds_update = 0;   // posing and refit: t[upd]
  double seconds_broad = 0;    // which instances come near each other (of characters)
  double seconds_test = 0;     // box tests: t[test]
  double seconds_query = 0;    // exact tests, the reporting of hits and the contacts: t[query]
  double seconds_contact = 0;  // the part of seconds_query that contacts took
  double seconds_total = 0;    // wall time of the call
};

// One frame: what is posed, what is paired, how, and where the answer goes. The caller owns every span.
// hits receives one entry a touching link pair, sorted by (batch_a, instance_a, batch_b, instance_b, link_a,
// link_b), the same for any thread count. contacts is empty or as long as hits. margin, a length, reports links that are
// apart too: none is left out whose boxes (with an exact test: shapes) are at most that far from each other, and boxes
// somewhat farther apart at their corners may be reported with Exact::kNone. With Report::kInContact hits and contacts are
// left alone, may be empty, and hit_count and hits_needed are 0.
struct FrameJob {
  Span<const BatchInput> inputs;
  Span<const PairRule> rules;
  Policies policies;
  float margin = 0;
  Report report = Report::kHits;
  Span<Hit> hits;
  Span<Contact> contacts;

  // Written by run_frame. On kHitsOverflow hits_needed is the count a retry needs, hit_count is 0 and the
  // contents of hits and contacts are unspecified; in_contact is complete.
  std::size_t hit_count = 0;
  std::size_t hits_needed = 0;
  FrameStats stats;
};

// ----------------------------------------------------------------------------------------------------- engine

// Where an engine gets its memory. allocate returns null on failure; alignment is a power of two.
struct Allocator {
  void* user = nullptr;
  void* (*allocate)(void* user, std::size_t bytes, std::size_t alignment) = nullptr;
  void (*release)(void* user, void* memory, std::size_t bytes, std::size_t alignment) = nullptr;
};

// How an engine runs tasks: parallel_for calls task(context, t, worker) once for every t < task_count, each call
// with a worker < worker_count that no other running call has, and returns when all are done.
struct Scheduler {
  void* user = nullptr;
  std::uint32_t worker_count = 0;
  void (*parallel_for)(void* user, std::uint32_t task_count,
                       void (*task)(void* context, std::uint32_t task, std::uint32_t worker), void* context) = nullptr;
};

struct EngineDesc {
  Isa isa = Isa::kAuto;
  // Built-in scheduler: 1 = the calling thread; else TBB with at most that many threads, and no more than cores;
  // 0 = every core.
  std::uint32_t thread_count = 1;
  const Allocator* allocator = nullptr;  // null = aligned operator new; on Linux large blocks ask for huge pages
  const Scheduler* scheduler = nullptr;  // null = built-in
};

}  // namespace cab
