// The C API of cab, in C11. Every type and every call of the C++ API has a twin here with the same meaning and the same
// bytes; comments are those of the C++ headers. Made by engine/bindings/make_c_api: do not edit.
//
// Names       run_frame is cab_run_frame, FrameJob is cab_FrameJob, Status::kOk is CAB_STATUS_OK, kMaxLinks is
//             CAB_MAX_LINKS. Enumerations are integers of a fixed width. A span is a pointer to the first value and the
//             number of values; a cab_Const...Span is only read.
// Defaults    C has none for members: begin with cab_default_frame_job() and so on, and change what differs. "Default"
//             in a comment is what these functions give.
// Null        What is a reference in C++ is a pointer here, and must not be null: calls answer
//             CAB_STATUS_NULL_ARGUMENT, or 0.
// ABI         CAB_ABI_VERSION is raised when a struct, a value or a call changes. cab_create_engine refuses a program
//             that was compiled for another one, and the shared library has it in its name.
#pragma once

#include <cab/api.h>

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// The ABI that a program is compiled for: the first argument of cab_create_engine.
#define CAB_ABI_VERSION 1u

// Conventions, for all of the API:
//
// Units       All lengths are in one unit, which the caller chooses: no constant of the library is a length. The API
//             has no angles: rotations are quaternions or matrices. Times are in seconds.
// Frames      "link" is a link's own frame. "instance" is the frame of one posed articulation: a pose takes points of a
//             link to it. "world" is common to all instances: a point p of an instance stands there at
//             origin + orientation * p. "Relative to the instance's origin" means in the world's axes, counted from
//             that origin.
// Rotations   Quaternions are x y z w. Vectors are columns, so a rotated point is R * p. cab_PoseFormat says which
//             matrices are stored by rows and which by columns.
// Handedness  The caller's coordinates may be right-handed or left-handed, and any axis may point up, if all input
//             agrees. The determinant of quaternions' rotations, and of the axes of boxes, is 1; that of a pose's
//             matrix may be -1. Such a link is mirrored, with its leaves' shapes.
// Indices     Links, leaves, instances and entries of spans count from 0, ids from 1.
// Precision   Poses, boxes and shapes are float, relative to an instance. Origins are double. Every box is padded, so
//             that it contains what it stands for in spite of rounding. Rounding may add a pair that is apart, but
//             never loses a pair that touches.
// Ownership   The caller owns every span and pointer; a call borrows them until it returns. What a call writes must not
//             overlap anything else that it writes or reads. cab_add_articulation copies what it keeps.
// Statuses    "The input statuses" are what a call returns for a cab_BatchInput that it refuses:
//             CAB_STATUS_UNKNOWN_BATCH, CAB_STATUS_STATIC_INPUT, CAB_STATUS_BAD_POSES, CAB_STATUS_BAD_STATES, what
//             cab_compute_link_poses has for joints, CAB_STATUS_BAD_COUNT, CAB_STATUS_BAD_INSTANCES,
//             CAB_STATUS_BAD_ORIGINS, CAB_STATUS_BAD_ORIENTATIONS, CAB_STATUS_BAD_SCALES, CAB_STATUS_BAD_FLAGS,
//             CAB_STATUS_BAD_LAYERS, CAB_STATUS_BAD_IN_CONTACT, CAB_STATUS_BAD_BOUNDS, CAB_STATUS_BAD_MARGINS and
//             CAB_STATUS_BAD_MOVED. For a list of inputs, CAB_STATUS_UNKNOWN_BATCH also if it has a size and no data,
//             and CAB_STATUS_BATCH_GIVEN_TWICE.
// Same bits   Boxes, hits and their order depend on the input alone, not on the instruction set, the number of threads,
//             earlier frames (but for cab_BatchInput.moved) or the caller's floating-point mode. With CAB_EXACT_FCL,
//             hits are the same in every run of one build, but another build of FCL may decide otherwise.
//             docs/embedding.md, "What is promised", has the details.
// Defaults    A span is empty by default, an id is that of no object, and other members show their default. Plain
//             results, such as Hit and Contact, have no defaults.

typedef struct cab_ArticulationId cab_ArticulationId;
typedef struct cab_BatchId cab_BatchId;
typedef struct cab_BatchSlot cab_BatchSlot;
typedef struct cab_Box cab_Box;
typedef struct cab_PoseView cab_PoseView;
typedef struct cab_StateView cab_StateView;
typedef struct cab_ConvexPart cab_ConvexPart;
typedef struct cab_Leaf cab_Leaf;
typedef struct cab_SkinDesc cab_SkinDesc;
typedef struct cab_LinkPair cab_LinkPair;
typedef struct cab_ArticulationDesc cab_ArticulationDesc;
typedef struct cab_LodLeaf cab_LodLeaf;
typedef struct cab_LodDesc cab_LodDesc;
typedef struct cab_IgnoredPair cab_IgnoredPair;
typedef struct cab_MergeStep cab_MergeStep;
typedef struct cab_ArticulationInfo cab_ArticulationInfo;
typedef struct cab_BatchDesc cab_BatchDesc;
typedef struct cab_StaticBody cab_StaticBody;
typedef struct cab_StaticDesc cab_StaticDesc;
typedef struct cab_BatchInfo cab_BatchInfo;
typedef struct cab_ReserveDesc cab_ReserveDesc;
typedef struct cab_EngineMemory cab_EngineMemory;
typedef struct cab_MaskReason cab_MaskReason;
typedef struct cab_BatchInput cab_BatchInput;
typedef struct cab_PairRule cab_PairRule;
typedef struct cab_Hit cab_Hit;
typedef struct cab_InstancePair cab_InstancePair;
typedef struct cab_CandidateList cab_CandidateList;
typedef struct cab_HitChanges cab_HitChanges;
typedef struct cab_Contact cab_Contact;
typedef struct cab_TouchingTriangles cab_TouchingTriangles;
typedef struct cab_FrameStats cab_FrameStats;
typedef struct cab_FrameJob cab_FrameJob;
typedef struct cab_Allocator cab_Allocator;
typedef struct cab_Scheduler cab_Scheduler;
typedef struct cab_Profiler cab_Profiler;
typedef struct cab_EngineDesc cab_EngineDesc;
typedef struct cab_JointDesc cab_JointDesc;
typedef struct cab_LinkPlaceDesc cab_LinkPlaceDesc;
typedef struct cab_KinematicsDesc cab_KinematicsDesc;
typedef struct cab_HistoryId cab_HistoryId;
typedef struct cab_HistoryDesc cab_HistoryDesc;
typedef struct cab_HistorySpan cab_HistorySpan;
typedef struct cab_Query cab_Query;
typedef struct cab_QueryPlane cab_QueryPlane;
typedef struct cab_QueryHit cab_QueryHit;
typedef struct cab_QueryLink cab_QueryLink;
typedef struct cab_SurfacePoint cab_SurfacePoint;
typedef struct cab_QueryStats cab_QueryStats;
typedef struct cab_QueryJob cab_QueryJob;
typedef struct cab_Policies cab_Policies;
typedef struct cab_PolicyValue cab_PolicyValue;
typedef struct cab_PolicyField cab_PolicyField;
typedef struct cab_PolicyPreset cab_PolicyPreset;
typedef struct cab_BoxLine cab_BoxLine;
typedef struct cab_BoxLinesJob cab_BoxLinesJob;
typedef struct cab_Version cab_Version;
typedef struct cab_BuildInfo cab_BuildInfo;

// Borrowed arrays: `size` values from `data` on. data may be null if size is 0.
typedef struct cab_ConstDoubleSpan {
  const double* data;  // the first value
  size_t size;         // how many values
} cab_ConstDoubleSpan;
typedef struct cab_ConstFloatSpan {
  const float* data;  // the first value
  size_t size;        // how many values
} cab_ConstFloatSpan;
typedef struct cab_ConstConvexPartSpan {
  const cab_ConvexPart* data;  // the first value
  size_t size;                 // how many values
} cab_ConstConvexPartSpan;
typedef struct cab_ConstUint32Span {
  const uint32_t* data;  // the first value
  size_t size;           // how many values
} cab_ConstUint32Span;
typedef struct cab_ConstInt32Span {
  const int32_t* data;  // the first value
  size_t size;          // how many values
} cab_ConstInt32Span;
typedef struct cab_ConstLeafSpan {
  const cab_Leaf* data;  // the first value
  size_t size;           // how many values
} cab_ConstLeafSpan;
typedef struct cab_ConstLinkPairSpan {
  const cab_LinkPair* data;  // the first value
  size_t size;               // how many values
} cab_ConstLinkPairSpan;
typedef struct cab_ConstLodLeafSpan {
  const cab_LodLeaf* data;  // the first value
  size_t size;              // how many values
} cab_ConstLodLeafSpan;
typedef struct cab_ConstStaticBodySpan {
  const cab_StaticBody* data;  // the first value
  size_t size;                 // how many values
} cab_ConstStaticBodySpan;
typedef struct cab_Uint8Span {
  uint8_t* data;  // the first value
  size_t size;    // how many values
} cab_Uint8Span;
typedef struct cab_ConstUint8Span {
  const uint8_t* data;  // the first value
  size_t size;          // how many values
} cab_ConstUint8Span;
typedef struct cab_InstancePairSpan {
  cab_InstancePair* data;  // the first value
  size_t size;             // how many values
} cab_InstancePairSpan;
typedef struct cab_HitSpan {
  cab_Hit* data;  // the first value
  size_t size;    // how many values
} cab_HitSpan;
typedef struct cab_ConstBatchInputSpan {
  const cab_BatchInput* data;  // the first value
  size_t size;                 // how many values
} cab_ConstBatchInputSpan;
typedef struct cab_ConstPairRuleSpan {
  const cab_PairRule* data;  // the first value
  size_t size;               // how many values
} cab_ConstPairRuleSpan;
typedef struct cab_ContactSpan {
  cab_Contact* data;  // the first value
  size_t size;        // how many values
} cab_ContactSpan;
typedef struct cab_ConstLinkPlaceDescSpan {
  const cab_LinkPlaceDesc* data;  // the first value
  size_t size;                    // how many values
} cab_ConstLinkPlaceDescSpan;
typedef struct cab_ConstJointDescSpan {
  const cab_JointDesc* data;  // the first value
  size_t size;                // how many values
} cab_ConstJointDescSpan;
typedef struct cab_ConstHistoryIdSpan {
  const cab_HistoryId* data;  // the first value
  size_t size;                // how many values
} cab_ConstHistoryIdSpan;
typedef struct cab_ConstQuerySpan {
  const cab_Query* data;  // the first value
  size_t size;            // how many values
} cab_ConstQuerySpan;
typedef struct cab_ConstQueryPlaneSpan {
  const cab_QueryPlane* data;  // the first value
  size_t size;                 // how many values
} cab_ConstQueryPlaneSpan;
typedef struct cab_QueryHitSpan {
  cab_QueryHit* data;  // the first value
  size_t size;         // how many values
} cab_QueryHitSpan;
typedef struct cab_SurfacePointSpan {
  cab_SurfacePoint* data;  // the first value
  size_t size;             // how many values
} cab_SurfacePointSpan;
typedef struct cab_QueryLinkSpan {
  cab_QueryLink* data;  // the first value
  size_t size;          // how many values
} cab_QueryLinkSpan;
typedef struct cab_Uint32Span {
  uint32_t* data;  // the first value
  size_t size;     // how many values
} cab_Uint32Span;
typedef struct cab_ConstHitSpan {
  const cab_Hit* data;  // the first value
  size_t size;          // how many values
} cab_ConstHitSpan;
typedef struct cab_ConstContactSpan {
  const cab_Contact* data;  // the first value
  size_t size;              // how many values
} cab_ConstContactSpan;
typedef struct cab_BoxLineSpan {
  cab_BoxLine* data;  // the first value
  size_t size;        // how many values
} cab_BoxLineSpan;
typedef struct cab_ConstPolicyFieldSpan {
  const cab_PolicyField* data;  // the first value
  size_t size;                  // how many values
} cab_ConstPolicyFieldSpan;
typedef struct cab_ConstPolicyPresetSpan {
  const cab_PolicyPreset* data;  // the first value
  size_t size;                   // how many values
} cab_ConstPolicyPresetSpan;
typedef struct cab_FloatSpan {
  float* data;  // the first value
  size_t size;  // how many values
} cab_FloatSpan;
typedef struct cab_Uint16Span {
  uint16_t* data;  // the first value
  size_t size;     // how many values
} cab_Uint16Span;
typedef struct cab_BoxSpan {
  cab_Box* data;  // the first value
  size_t size;    // how many values
} cab_BoxSpan;
typedef struct cab_TouchingTrianglesSpan {
  cab_TouchingTriangles* data;  // the first value
  size_t size;                  // how many values
} cab_TouchingTrianglesSpan;
typedef struct cab_CharSpan {
  char* data;   // the first value
  size_t size;  // how many values
} cab_CharSpan;
typedef struct cab_MergeStepSpan {
  cab_MergeStep* data;  // the first value
  size_t size;          // how many values
} cab_MergeStepSpan;
typedef struct cab_IgnoredPairSpan {
  cab_IgnoredPair* data;  // the first value
  size_t size;            // how many values
} cab_IgnoredPairSpan;

// How inner boxes are made in each frame. The comments of the values are their meanings in cab_policy_table(), word for
// word; so are those of the enumerations below. From CAB_REFIT_CAB_SUM on they are the paper's others, for comparison:
// no measured scene with the same hits favours one of them. Refits of oriented boxes come first.
typedef uint8_t cab_Refit;
enum {
  CAB_REFIT_CAB = 0,    // the paper's CAB: oriented boxes along the main axis of two jointed children
  CAB_REFIT_BEST3 = 1,  // of three oriented boxes, along the axes of cab and of each child, the one of least surface
  // the paper's footnote: as cab, but along the sum of both major axes where their ends are closest
  CAB_REFIT_CAB_SUM = 2,
  CAB_REFIT_COVARIANCE = 3,     // the paper's OBB: oriented boxes along the principal axes of the children's corners
  CAB_REFIT_AABB_HULL = 4,      // the paper's AABB*: axis-aligned boxes about the leaf boxes, leaves included
  CAB_REFIT_AABB_VERTICES = 5,  // the paper's AABB+: axis-aligned boxes about all vertices below, leaves included
};

// How an inner box is sized along its axes.
typedef uint8_t cab_Extents;
enum {
  CAB_EXTENTS_CHILDREN = 0,  // an inner box is as large as its two children need
  CAB_EXTENTS_LEAVES = 1,    // an inner box is as large as the leaf boxes below it need
};

// How overlapping leaf pairs are found. For characters, CAB_STRATEGY_LINKS becomes CAB_STRATEGY_ROWS where the refit
// makes axis-aligned boxes, and in batches whose articulation has a skin, or no link with several leaves.
typedef uint8_t cab_Strategy;
enum {
  CAB_STRATEGY_TREE = 0,   // simultaneous descent of two hierarchies
  CAB_STRATEGY_ROWS = 1,   // each leaf's bounds against all leaf bounds of the other, then boxes; sequences: as brute
  CAB_STRATEGY_LINKS = 2,  // boxes of links by rows, then the leaves of those that overlap; sequences: as tree
  CAB_STRATEGY_BRUTE = 3,  // every leaf of one against every leaf of the other
  // characters: rows, links or tree by leaves and links; sequences: brute or tree by leaf pairs and nodes
  CAB_STRATEGY_AUTO = 4,
};

// What confirms an overlapping leaf pair.
typedef uint8_t cab_Exact;
enum {
  CAB_EXACT_NONE = 0,     // overlapping leaf boxes are the answer
  CAB_EXACT_FCL = 1,      // FCL tests the exact shapes of leaves whose boxes overlap
  CAB_EXACT_CONVEX = 2,   // kernels test the exact shapes of leaves whose boxes overlap, sixteen pairs at a time
  CAB_EXACT_SURFACE = 3,  // as convex, and of leaves with triangles these are tested
};

// Which axes can separate two oriented boxes, inner ones and leaves. Axis-aligned boxes have three axes in either case.
typedef uint8_t cab_Sat;
enum {
  CAB_SAT_ALL15 = 0,   // the six face normals and the nine cross products of edges
  CAB_SAT_FACES6 = 1,  // the six face normals: less time per test, but more pairs pass
};

// How many values each enumeration has.
#define CAB_REFIT_COUNT 6u
#define CAB_EXTENTS_COUNT 2u
#define CAB_STRATEGY_COUNT 5u
#define CAB_EXACT_COUNT 4u
#define CAB_SAT_COUNT 2u

// The policies of a frame. Every combination is valid and conservative; the defaults are the preset `balanced`.
typedef struct cab_Policies {
  cab_Refit refit;        // how inner boxes are made, and whether leaf boxes are axis-aligned too
  cab_Strategy strategy;  // how overlapping leaf pairs are found
  cab_Exact exact;        // what confirms an overlapping leaf pair
  cab_Extents extents;    // what inner boxes contain
  cab_Sat sat;            // which axes can separate two oriented boxes
} cab_Policies;

// One value of a field of Policies. The strings live as long as the program.
typedef struct cab_PolicyValue {
  uint8_t value;        // the enumerator as a number, which is also its index in cab_PolicyField.values
  const char* name;     // on the command line and in files, such as "cab_sum"
  const char* meaning;  // what the value does, in one phrase
} cab_PolicyValue;

// One field of Policies: a row of the table of policies. All of it lives as long as the program.
typedef struct cab_PolicyField {
  const char* name;               // the field's name in Policies
  const char* meaning;            // what the field decides, in one phrase
  const cab_PolicyValue* values;  // value_count of them, in the order of the enumeration
  uint32_t value_count;           // how many values the enumeration has
  uint32_t use_count;             // how many of them, from the first on, are for use; the rest is for comparison
} cab_PolicyField;

// The one table of policies, one row per field of Policies in the order of its fields. The library, the command line,
// files, tests and documents share it.
CAB_API cab_ConstPolicyFieldSpan cab_policy_table(void);

// The value of the field whose row in cab_policy_table() is `field`, as a number; 0 if the table has no such row.
CAB_API uint32_t cab_policy_get(const cab_Policies* policies, uint32_t field);

// Sets the field whose row in cab_policy_table() is `field` to the value with this name. Returns false and changes
// nothing if the table has no such row, if the row has no such value, or if the name is null.
CAB_API bool cab_policy_set(cab_Policies* policies, uint32_t field, const char* value_name);

// Values for all policies under one name. A preset says how boxes are made and tested. Whether hits are confirmed is
// the caller's choice, so `exact` is CAB_EXACT_NONE in all presets. The strings live as long as the program.
typedef struct cab_PolicyPreset {
  const char* name;       // on the command line and for cab_preset_set, such as "tight"
  const char* meaning;    // what the preset is for, in one phrase
  cab_Policies policies;  // the value of every field
} cab_PolicyPreset;

// The one table of presets. cab_preset_set, the command line and the documents share it.
CAB_API cab_ConstPolicyPresetSpan cab_preset_table(void);

// Sets every field to its value in the preset with this name. Returns false and changes nothing if there is no such
// preset, or if the name is null.
CAB_API bool cab_preset_set(cab_Policies* policies, const char* preset_name);

// ------------------------------------------------------------------------------------------------ statuses, limits

// What a call answers. The comments are the words of cab_status_to_string. A call that does not answer CAB_STATUS_OK
// leaves its outputs as they were, with three exceptions. After CAB_STATUS_HITS_OVERFLOW, CAB_STATUS_PAIRS_OVERFLOW and
// CAB_STATUS_LINES_OVERFLOW the call, or the job, says what holds. After CAB_STATUS_OUT_OF_MEMORY, CAB_STATUS_BAD_TASK
// and CAB_STATUS_TASKS_LEFT of calls that run tasks, outputs may be partly written. Calls write which element is at
// fault, such as *bad_element, when they refuse it.
typedef int32_t cab_Status;
enum {
  CAB_STATUS_OK = 0,                 // ok
  CAB_STATUS_OUT_OF_MEMORY = 1,      // an allocation failed
  CAB_STATUS_BUSY = 2,               // another call on the same engine is running, and one of the two must run alone
  CAB_STATUS_ISA_NOT_AVAILABLE = 3,  // isa is an instruction set that this CPU or this build lacks
  CAB_STATUS_BAD_ABI_VERSION = 4,    // the program was compiled for another ABI of the C API than this library has
  CAB_STATUS_BAD_SCHEDULER = 5,      // scheduler lacks parallel_for, or its worker_count is 0 or above 1024
  CAB_STATUS_BAD_ALLOCATOR = 6,      // allocator lacks allocate or release
  CAB_STATUS_BAD_PROFILER = 7,       // profiler lacks begin or end
  CAB_STATUS_NO_LINKS = 8,           // link_parents is empty, but an articulation needs at least one link
  CAB_STATUS_TOO_MANY_LINKS = 9,     // link_parents holds more than 1024 links
  CAB_STATUS_NO_LEAVES = 10,         // leaves is empty, but an articulation needs at least one leaf
  CAB_STATUS_TOO_MANY_LEAVES = 11,   // leaves holds more than 1024 leaves
  CAB_STATUS_BAD_PARENT = 12,  // link_parents must be -1 for the first link, and -1 or an earlier link for every other
  CAB_STATUS_BAD_JOINT = 13,  // link_joints must be empty or one finite point per link, joints as cab/kinematics.h says
  CAB_STATUS_BAD_LEAF_LINK = 14,  // link of a leaf is not the index of a link
  CAB_STATUS_BAD_LEAF_BOX = 15,   // box of a leaf is not finite, has a negative half extent or exceeds 1e18
  CAB_STATUS_BAD_LEAF_AXES = 16,  // box of a leaf has axes that are not orthonormal and right-handed to 1e-5
  CAB_STATUS_BAD_SHAPE = 17,      // parts of a leaf need finite positions, unit quaternions, positive sizes and an area
  CAB_STATUS_SHAPE_OUTSIDE_LEAF_BOX = 18,  // parts of a leaf, and the positions of half spaces, must lie within its box
  CAB_STATUS_BAD_VERTICES = 19,  // vertices must hold x y z of at least one point, each number finite and at most 1e18
  CAB_STATUS_BAD_IGNORED_PAIR = 20,  // ignored_pairs names a link that does not exist
  // rest_pose has an unknown format, an invalid stride, or values that are not a rigid pose
  CAB_STATUS_BAD_REST_POSE = 21,
  CAB_STATUS_UNKNOWN_ARTICULATION = 22,  // the articulation id is not one of this engine, or is of one that was removed
  CAB_STATUS_UNKNOWN_BATCH = 23,         // the batch id is not one of this engine, or is of one that was removed
  CAB_STATUS_ARTICULATION_IN_USE = 24,   // the articulation has batches or levels of nodes, which must be removed first
  CAB_STATUS_BAD_LOD = 25,  // a level needs an articulation that is no level, leaves for all links, and a finite play
  CAB_STATUS_TOO_FEW_LEAVES = 26,      // max_leaves is 0, above 1024, or below the number of trees that have leaves
  CAB_STATUS_LOD_LEAF_TOO_SMALL = 27,  // the box of a level's leaf does not hold all that its links can reach
  CAB_STATUS_BAD_BATCH_KIND = 28,      // kind is not a value of cab_BatchKind
  CAB_STATUS_NO_INSTANCES = 29,        // instance_count is 0, but a batch needs at least one instance
  // a static body needs a finite origin, a quaternion that is not 0, and a box within 1e18
  CAB_STATUS_BAD_STATIC_BODY = 30,
  CAB_STATUS_BAD_TRIANGLES = 31,  // triangles must be three indices each of vertices, which are finite and at most 1e18
  // instance_count is above 2^24, or the engine would exceed 4096 batches or 2^31 characters
  CAB_STATUS_TOO_MANY_INSTANCES = 32,
  CAB_STATUS_BATCH_GIVEN_TWICE = 33,  // inputs holds the same batch twice
  // poses has no data, an unknown format, or a stride that is too small or not a multiple of 4
  CAB_STATUS_BAD_POSES = 34,
  CAB_STATUS_BAD_STATES = 35,  // states must be of a sequence, with enough values, and made into the poses of the input
  // a batch of static bodies takes nothing that says where instances are or how they move
  CAB_STATUS_STATIC_INPUT = 36,
  CAB_STATUS_BAD_ORIGINS = 37,       // origins must be empty or hold three finite doubles per instance
  CAB_STATUS_BAD_ORIENTATIONS = 38,  // orientations must be empty or hold four floats per instance
  CAB_STATUS_BAD_FLAGS = 39,         // flags must be empty or hold one byte per instance
  CAB_STATUS_BAD_LAYERS = 40,        // layers and layer_masks must each be empty or hold one word per instance
  CAB_STATUS_BAD_IN_CONTACT = 41,    // in_contact must be empty or hold one byte per instance
  // scales must be empty or hold one float per instance, and be empty if matrices hold scales
  CAB_STATUS_BAD_SCALES = 42,
  CAB_STATUS_BAD_COUNT = 43,  // count is above the batch's instance_count
  // instances must be empty or ascend, below count and instance_count; never of a sequence
  CAB_STATUS_BAD_INSTANCES = 44,
  CAB_STATUS_BAD_BOUNDS = 45,  // bounds must be empty or hold six finite floats per instance, none below its lower one
  CAB_STATUS_BAD_MOVED = 46,   // moved must be empty or hold one byte per instance; never of a sequence
  // margins must be empty or hold one float per instance, each 0 to 1e18; never of a sequence
  CAB_STATUS_BAD_MARGINS = 47,
  // moved is 0 for an instance whose pose, place, scale or layers changed (checked builds only)
  CAB_STATUS_MOVED_AT_REST = 48,
  CAB_STATUS_BAD_PAIR_RULE = 49,  // rules names a batch without input, or a pairing that its batches cannot have
  CAB_STATUS_PAIR_RULE_GIVEN_TWICE = 50,  // rules pairs the same two batches twice in the same way
  CAB_STATUS_BAD_POLICY = 51,             // policies holds a value that its enumeration lacks
  CAB_STATUS_EXACT_NOT_BUILT = 52,        // policies asks for an exact test that this build of the library lacks
  CAB_STATUS_BAD_REPORT = 53,             // report is not a value of Report
  CAB_STATUS_BAD_MARGIN = 54,             // margin must be finite, not negative and at most 1e18
  CAB_STATUS_BAD_MIN_DEPTH = 55,  // min_depth must be finite, not negative, and 0 if only in_contact is reported
  // hits or links has a size and no data, both are given, or contacts is not as long as hits
  CAB_STATUS_BAD_HIT_BUFFER = 56,
  CAB_STATUS_CONTACTS_NEED_EXACT = 57,  // contacts, distances and min_depth need an exact test, such as convex
  CAB_STATUS_LOD_WITHOUT_SHAPES = 58,   // an exact test needs shapes, but a batch with input is of a level of nodes
  CAB_STATUS_BAD_INSTANCE = 59,         // instance is not one of the batch's instances in this call
  // pairs names a batch without input, a missing instance, a link without leaves, or a link twice
  CAB_STATUS_BAD_PAIRS = 60,
  CAB_STATUS_BAD_RESOLUTION = 61,  // resolution must be above 0, and at most 1e18
  CAB_STATUS_BAD_OUTPUT = 62,      // an output is null or too small
  CAB_STATUS_NULL_ARGUMENT = 63,   // a pointer of the C API that must not be null is null
  CAB_STATUS_HITS_OVERFLOW = 64,   // hits is too small for all hits
  CAB_STATUS_PAIRS_OVERFLOW = 65,  // pairs is too small for all candidates
  CAB_STATUS_LINES_OVERFLOW = 66,  // lines is too small for all edges
  CAB_STATUS_NO_FRAME = 67,        // no frame has begun
  CAB_STATUS_BAD_TASK = 68,        // task or worker is out of range or in use, or the task has been run before
  CAB_STATUS_TASKS_LEFT = 69,      // not all tasks have been run
  CAB_STATUS_UNSORTED_HITS = 70,   // a list of hits has a size and no data, or is not in the order of cab_run_frame
  // a query has a value of no enumeration, a number that is not finite or out of range, or no direction
  CAB_STATUS_BAD_QUERY = 71,
  CAB_STATUS_NO_QUERY_MEMORY = 72,      // reserve has made no memory for queries
  CAB_STATUS_BAD_TICKS = 73,            // ticks must be 1 to 65536
  CAB_STATUS_UNKNOWN_HISTORY = 74,      // the history id is not one of this engine, or is of one that was removed
  CAB_STATUS_HISTORY_GIVEN_TWICE = 75,  // histories holds two histories of the same batch
  CAB_STATUS_BAD_TIME = 76,             // a time must be finite, and later than those that the history has
  CAB_STATUS_BAD_HISTORY_POSES = 77,    // a history takes neither mirrored links nor matrices that hold scales
  CAB_STATUS_BAD_SKIN = 78,  // skin needs finite vertices, invertible finite matrices, and weights of existing links
  // triangles of a leaf must be three vertices of the skin each, without parts beside them
  CAB_STATUS_BAD_LEAF_TRIANGLES = 79,
  // triangles of a leaf are moved by more than 32 other links; a smaller leaf has fewer
  CAB_STATUS_TOO_MANY_INFLUENCES = 80,
  CAB_STATUS_SKIN_NOT_TAKEN = 81,  // the call, or the exact test, does not take an articulation with a skin yet
};

// Limits. Links and leaves are counted per articulation, instances per batch, batches and workers of a caller's
// scheduler per engine. An engine also holds at most 2^31 characters, over all its batches.
#define CAB_MAX_LINKS 1024u
#define CAB_MAX_LEAVES 1024u
#define CAB_MAX_INSTANCES (1u << 24)
#define CAB_MAX_BATCHES 4096u
#define CAB_MAX_WORKERS 1024u

// The largest magnitude of a coordinate or half extent, relative to the instance's origin, in the caller's unit. An
// instance whose pose, or whose box with padding and margin, exceeds it is masked like one whose pose is not finite:
// products of the overlap test would overflow float.
#define CAB_MAX_COORDINATE 1e18f

// The least and the largest scale of an instance or of a link.
#define CAB_MIN_SCALE 1e-3f
#define CAB_MAX_SCALE 1e3f

// ------------------------------------------------------------------------------------------------------ basic types

// An articulation and a batch of one engine. An id holds a slot in its lower 32 bits, and in its upper 32 a serial
// number, which differs for all ids of a process until 2^32 were given out. An id whose articulation or batch has been
// removed, or that is of another engine, is refused. A bare slot is an id too: that of whatever is in the slot. What is
// added takes the lowest free slot; slots count from 1. The value 0 (default) names nothing.
typedef struct cab_ArticulationId {
  uint64_t value;  // 0: no articulation
} cab_ArticulationId;
typedef struct cab_BatchId {
  uint64_t value;  // 0: no batch
} cab_BatchId;

// The slot of a batch. Hits name their batches by it, so that they do not depend on what a process did before.
typedef struct cab_BatchSlot {
  uint32_t value;  // from 1; 0: no batch
} cab_BatchSlot;

// The slot of an id: its lower 32 bits.
CAB_API cab_BatchSlot cab_slot_of(cab_BatchId id);

// The instruction set that kernels use. All give the same bits.
typedef uint8_t cab_Isa;
enum {
  CAB_ISA_AUTO = 0,     // the best that this CPU, its operating system and this build offer
  CAB_ISA_SCALAR = 1,   // no SIMD: the same source compiled for single floats
  CAB_ISA_SSE2 = 2,     // x86-64, always there
  CAB_ISA_AVX2 = 3,     // x86-64 with AVX2 and FMA
  CAB_ISA_AVX512 = 4,   // x86-64 with F, CD, DQ, BW and VL
  CAB_ISA_NEON64 = 5,   // 64-bit ARM, always there
  CAB_ISA_WASM128 = 6,  // WebAssembly with 128-bit SIMD
};

// How many values Isa has, CAB_ISA_AUTO included.
#define CAB_ISA_COUNT 7u

// An oriented box: the points center + x0 * axis[0] + x1 * axis[1] + x2 * axis[2] with |xk| <= half[k]. cab_Leaf.box
// and cab_fit_box use the link's frame. cab_compute_boxes writes boxes relative to the instance's origin. The default
// is a point at the frame's origin, with the frame's axes. A point is a valid box: one whose `half` was forgotten is
// not refused.
typedef struct cab_Box {
  float center[3];   // x y z of the centre, in the caller's unit
  float axis[3][3];  // axis[k] is x y z of the k-th: orthonormal, right-handed
  float half[3];     // half extent along each, in the caller's unit, 0 or more
} cab_Box;

// ------------------------------------------------------------------------------------------------------------ poses

// How one pose, from link to instance, is stored in floats.
typedef uint8_t cab_PoseFormat;
enum {
  // 7 floats: quaternion x y z w, whose length is divided out; translation x y z
  CAB_POSE_FORMAT_QUATERNION_TRANSLATION = 0,
  CAB_POSE_FORMAT_MATRIX3X4_ROWS = 1,  // 12 floats by rows: three rows of four, the translation in the last column
  // 16 floats by columns, as in glTF and ozz: translation in floats 12 to 14, last row unread
  CAB_POSE_FORMAT_MATRIX4X4_COLUMNS = 2,
};

// The poses of all links of all instances of a batch. Each goes from link to instance ("model space"), never from link
// to parent. The pose of link l of instance i begins at byte i * instance_stride + l * link_stride of data, so poses
// may be members of the caller's larger structures.
typedef struct cab_PoseView {
  // How every pose is stored. Translations are in the caller's unit.
  cab_PoseFormat format;

  // The first float of the first pose. Borrowed. Required, except in cab_ArticulationDesc.rest_pose.
  const float* data;

  // Bytes from one link's pose to the next link's: a multiple of 4, at least the size of a pose, at most 2^32.
  // 0 (default): the size of a pose, so poses follow each other without gaps.
  size_t link_stride;

  // Bytes from one instance's first pose to the next instance's: a multiple of 4, at least as long as the poses of all
  // links, at most 2^38. 0 (default): link_stride times the number of links.
  size_t instance_stride;

  // Whether matrices hold a uniform scale: each is a rotation, mirrored or not, times a factor from CAB_MIN_SCALE to
  // CAB_MAX_SCALE. The factor is the length of the first column. It is that of the link's leaves, their boxes and
  // shapes, and of its joint. Translations are taken as they are. With matrices only. Default: matrices are rotations.
  bool has_scale;
} cab_PoseView;

// Joint states, which become the poses of a sequence: cab_run_frame makes those of sixteen states where it tests them,
// on its threads, as cab_compute_link_poses does.
typedef struct cab_StateView {
  // Of the links of the batch. Borrowed. null (default): there are no states.
  const cab_KinematicsDesc* kinematics;

  // kinematics->variable_count numbers per instance. Borrowed.
  cab_ConstDoubleSpan values;

  // Output, which cab_BatchInput.poses must name as CAB_POSE_FORMAT_QUATERNION_TRANSLATION without gaps: 7 floats per
  // link and instance. Borrowed. All calls but cab_run_frame and cab_begin_frame read them as they are, and of the
  // states check the sizes alone.
  float* poses;
} cab_StateView;

// ----------------------------------------------------------------------------------------------------- articulation

// The shape of a convex part, and what cab_ConvexPart.size means for it. All shapes except hulls and half spaces are
// centred at the part's origin. A hull is where its vertices are.
//
// A half space is a floor or a wall that ends with the box of its leaf: shapes whose boxes do not overlap it are not
// found. So the box must extend as far along the plane as anything stands on it, and as far below it as anything may
// sink. Two half spaces touch wherever their boxes overlap, and have no contact.
typedef uint8_t cab_ShapeKind;
enum {
  CAB_SHAPE_KIND_BOX = 0,          // size: half extents along x, y, z
  CAB_SHAPE_KIND_ELLIPSOID = 1,    // size: radii along x, y, z
  CAB_SHAPE_KIND_CAPSULE = 2,      // size: radius, half the length of the cylinder along z, unused
  CAB_SHAPE_KIND_CONVEX_HULL = 3,  // the convex hull of `vertices`; size unused
  CAB_SHAPE_KIND_SPHERE = 4,       // size: radius, unused, unused
  CAB_SHAPE_KIND_CYLINDER = 5,     // size: radius, half the length along z, unused; its ends are flat
  CAB_SHAPE_KIND_HALF_SPACE = 6,   // all points with z <= 0; size unused
};

// One convex part of a leaf's exact shape, in a frame of its own. It must lie within its leaf's box, to 2^-22 of the
// sum of the box's half extents. Of a half space only the position must.
typedef struct cab_ConvexPart {
  // Which shape the part has.
  cab_ShapeKind kind;

  // x y z of the part's origin in the link's frame, in the caller's unit.
  float position[3];

  // Quaternion x y z w that rotates from the part's frame to the link's. Its squared length must be 1, to 1e-3.
  float rotation[4];

  // Three lengths in the caller's unit. cab_ShapeKind says what each one means. Those that the kind uses must be above
  // 0.
  float size[3];

  // x y z of each vertex in the part's frame, for CAB_SHAPE_KIND_CONVEX_HULL only. There must be at least three, not
  // all on one line. All in one plane they are a triangle or a polygon. Vertices inside the hull are allowed.
  cab_ConstFloatSpan vertices;
} cab_ConvexPart;

// A rigid body of an articulation, fixed to one link. A link may carry several leaves, or no leaf.
typedef struct cab_Leaf {
  // Index of the link that carries the leaf.
  uint32_t link;

  // The leaf's box, in the link's frame. Half extents may be 0: a plate, a segment or a point is a box. The axes must
  // be orthonormal and right-handed, to 1e-5. cab_fit_box makes such a box about a mesh. Default: a point at the link's
  // origin.
  cab_Box box;

  // The exact shape, as a union of convex parts. Exact tests and CAB_REFIT_AABB_VERTICES use it; to the latter a half
  // space is the box. Empty (default): the shape is the box itself.
  cab_ConstConvexPartSpan parts;

  // The triangles of cab_ArticulationDesc.skin that the leaf stands for: three indices of vertices each. The library
  // makes the box about them, and in every frame grows it by what other links do to them, so that it holds them in
  // every pose. Then `box` is not read, and there are no parts. Some 50 to 200 triangles that are next to each other,
  // most of whose weight is on `link`, make a tight box. Triangles that are connected by vertices in common are a part.
  // A part has an inside if each of its edges has an even number of triangles. Empty (default): the leaf is rigid.
  cab_ConstUint32Span triangles;
} cab_Leaf;

// The skin of a character: vertices that several links move by a linear blend ("linear blend skinning"). A vertex v is
// at the sum over its links of weight * pose of the link * bind of the link * v.
typedef struct cab_SkinDesc {
  // x y z per vertex, in the skin's own frame and in the caller's unit.
  cab_ConstFloatSpan vertices;

  // How many links move a vertex at most, 1 to CAB_MAX_LINKS; the index of each, and its weight: so many per vertex. A
  // weight of 0 has no effect, others are above 0. The weights of a vertex are divided by their sum, which is not 0.
  uint32_t influence_count;
  cab_ConstUint32Span influence_links;
  cab_ConstFloatSpan influence_weights;

  // One matrix per link from the skin's frame to the link's, the "inverse bind matrix": 16 floats by columns, as in
  // glTF and ozz; the last row is not read. It may scale, shear and mirror. Empty (default): the frames of links are
  // that of the skin, as where poses are the matrices of a palette.
  cab_ConstFloatSpan inverse_bind;
} cab_SkinDesc;

// Two links of one articulation, in either order.
typedef struct cab_LinkPair {
  uint32_t a;  // index of a link
  uint32_t b;  // index of a link; a pair of equal links has no effect
} cab_LinkPair;

// An articulation: one tree of links, or several, and the leaves on them. It does not change once it is added.
// ignored_pairs, ignored_hops and rest_pose say which links of one instance are never reported against each other. They
// have no effect on pairs of different instances.
typedef struct cab_ArticulationDesc {
  // The index of each link's parent, lower than the link's own index, or -1 for the root of a tree. The first link is a
  // root. There are 1 to CAB_MAX_LINKS links.
  cab_ConstInt32Span link_parents;

  // x y z per link: the joint with the parent, in the link's own frame. Empty (default): all joints are at the origins
  // of the links' frames. Joints guide how inner boxes are made.
  cab_ConstFloatSpan link_joints;

  // The leaves, in any order. There are 1 to CAB_MAX_LEAVES.
  cab_ConstLeafSpan leaves;

  // Pairs of links to ignore. A pair may be listed twice and in either order. Empty by default.
  cab_ConstLinkPairSpan ignored_pairs;

  // Two links are ignored if the path between them in the tree has at most this many joints: with 1 a link and its
  // parent, with 2 also siblings, and a link and its grandparent. 0 (default): no pair is ignored for this reason.
  uint32_t ignored_hops;

  // The pose of one instance. Two links are ignored if their oriented leaf boxes touch in this pose, without an
  // orientation or an exact test. Without data (default): no pair is ignored for this reason.
  cab_PoseView rest_pose;

  // The vertices of leaves with triangles. Default: there are none. An articulation with such leaves takes frames and
  // queries by boxes, levels of nodes, cab_compute_boxes, and frames with CAB_EXACT_SURFACE but without contacts. What
  // needs more answers CAB_STATUS_SKIN_NOT_TAKEN: other exact tests, sweeps, levels of boxes, the past for all queries
  // but rays.
  cab_SkinDesc skin;
} cab_ArticulationDesc;

// What the leaves of a coarser level are.
typedef uint8_t cab_LodKind;
enum {
  // boxes on some links, each with room for whatever its links can reach; no other links are posed
  CAB_LOD_KIND_REACH = 0,
  CAB_LOD_KIND_NODES = 1,  // nodes of the articulation's hierarchy, made in every frame from all leaves; without shapes
};

// What cab_lod_leaves writes for a link without leaves.
#define CAB_NO_LEAF 0xffffu

// A leaf of a coarser level: a box on one link that stands for several links.
typedef struct cab_LodLeaf {
  // Index of the link that carries the box. No two leaves of a level are on the same link.
  uint32_t link;

  // The box, in that link's frame. Required. As cab_Leaf.box. It must hold the leaf boxes of `link`, if the leaf stands
  // for it, and at each joint of `link` the ball that its other links can reach from there, with 2^-8 of all lengths to
  // spare.
  cab_Box box;

  // The links that it stands for, in any order. They are in one tree with `link`, which need not be one of them.
  cab_ConstUint32Span links;
} cab_LodLeaf;

// A coarser level of an articulation, for instances that are far away or matter little: the same links with fewer
// leaves. Every two instances of which leaves touch have leaves of coarser levels that touch and stand for these links.
// A level is an articulation too, with batches of its own: cab_BatchInput.instances says which instances are at which
// level in a frame. Links that one leaf stands for are not reported against each other.
typedef struct cab_LodDesc {
  // The articulation, which is no level itself. It must stay as long as its levels of nodes. Required.
  cab_ArticulationId of;

  // What the leaves are. Default: boxes that are fixed to links.
  cab_LodKind kind;

  // How many leaves there may be, 1 (default) to CAB_MAX_LEAVES, if the library makes them. It cuts the articulation at
  // joints, so that few leaves stand for many links. With CAB_LOD_KIND_REACH each tree that has leaves takes at least
  // one.
  uint32_t max_leaves;

  // Leaves that the caller makes, for CAB_LOD_KIND_REACH only. Each link that has leaves is in one of them. Empty
  // (default): the library makes them.
  cab_ConstLodLeafSpan leaves;

  // For CAB_LOD_KIND_REACH: poses of `rest_pose_count` instances, such as a rest pose or a clip. They say where each
  // joint is in the frame of its link's parent: in their middle, and as far from there as they are. Required for
  // CAB_LOD_KIND_REACH.
  cab_PoseView rest_poses;
  uint32_t rest_pose_count;

  // For CAB_LOD_KIND_REACH: a length in the links' unit, from 0 (default) to CAB_MAX_COORDINATE, by which a joint may
  // be farther away from there. Poses in which one is farther away, as where bones stretch, or whose links have scales
  // of their own, may lose hits.
  float joint_play;
} cab_LodDesc;

// Why two links of one instance are never reported against each other. cab_IgnoredPair.reasons combines these bits.
typedef uint8_t cab_IgnoredReason;
enum {
  CAB_IGNORED_EXPLICITLY = 1,  // cab_ArticulationDesc.ignored_pairs names the two links
  CAB_IGNORED_BY_HOPS = 2,     // they are at most cab_ArticulationDesc.ignored_hops joints apart
  CAB_IGNORED_AT_REST = 4,     // they touch in cab_ArticulationDesc.rest_pose, by oriented leaf boxes alone
};

// Two links that are never reported against each other within an instance. Written by ignored_pairs.
typedef struct cab_IgnoredPair {
  uint16_t a;       // index of the lower link
  uint16_t b;       // index of the higher link
  uint8_t reasons;  // cab_IgnoredReason bits, at least one
} cab_IgnoredPair;

// The value of cab_MergeStep.joint_link if the two children share no joint.
#define CAB_NO_JOINT 0xffffu

// One merge of the fixed bottom-up order of a hierarchy. Nodes 0 to leaf_count - 1 of the hierarchy are the leaves.
// Step s makes node leaf_count + s. Written by cab_merge_steps.
typedef struct cab_MergeStep {
  uint16_t left;        // index of one child: a leaf, or a node that an earlier step made
  uint16_t right;       // index of the other child
  uint16_t joint_link;  // the link whose joint the two children share, or CAB_NO_JOINT
} cab_MergeStep;

// Counts of an articulation. Written by cab_articulation_info.
typedef struct cab_ArticulationInfo {
  uint32_t link_count;          // links, with or without leaves
  uint32_t leaf_count;          // leaves on all links
  uint32_t node_count;          // nodes of the hierarchy, 2 * leaf_count - 1: leaves first, the root last
  uint32_t depth;               // merges on the longest path from the root to a leaf
  uint32_t ignored_pair_count;  // entries that ignored_pairs writes
} cab_ArticulationInfo;

// ---------------------------------------------------------------------------------------------------------- batches

// What the instances of a batch are.
typedef uint8_t cab_BatchKind;
enum {
  CAB_BATCH_KIND_CHARACTERS = 0,  // all instances live at once: each may touch every other
  CAB_BATCH_KIND_SEQUENCE = 1,  // instance f is frame f of one character: it may touch only frame f of other sequences
};

// A batch: instances of one articulation that are posed together.
typedef struct cab_BatchDesc {
  // The articulation of every instance, added to the same engine. Required.
  cab_ArticulationId articulation;

  // How many instances there are, 1 to CAB_MAX_INSTANCES. A sequence with one instance is a fixed object, such as a
  // table: it is paired with every frame of other sequences.
  uint32_t instance_count;

  // What the instances are to each other. Default: characters.
  cab_BatchKind kind;
} cab_BatchDesc;

// A body that never moves, such as a wall or a crate that is bolted down: one convex body, or several that are one.
typedef struct cab_StaticBody {
  double origin[3];   // x y z of the origin of its frame in the world
  float rotation[4];  // quaternion x y z w from its frame to the world; its length is divided out

  // The box, in the body's frame. As cab_Leaf.box. Default: a point at the body's origin.
  cab_Box box;

  // The exact shape, in the body's frame. As cab_Leaf.parts. Empty (default): the shape is the box itself.
  cab_ConstConvexPartSpan parts;
} cab_StaticBody;

// A batch of static bodies, such as the geometry of a level. Body i of `bodies` is instance i. Triangle t is the
// instance after them, bodies.size + t. Each has one link, 0, with one leaf, 0.
typedef struct cab_StaticDesc {
  // Bodies, in any order. Together with the triangles there are 1 to CAB_MAX_INSTANCES.
  cab_ConstStaticBodySpan bodies;

  // x y z per vertex of a mesh, relative to `origin`, along the world's axes.
  cab_ConstFloatSpan vertices;

  // Three indices of vertices per triangle. A triangle has two sides and no inside. It must have an area.
  cab_ConstUint32Span triangles;

  // x y z in the world to which vertices are relative. Sums are rounded to double.
  double origin[3];
} cab_StaticDesc;

// What a batch is. Written by cab_batch_info.
typedef struct cab_BatchInfo {
  cab_ArticulationId articulation;  // of every instance; 0 for static bodies
  uint32_t instance_count;          // as it was added
  cab_BatchKind kind;               // of static bodies too
  bool is_static;                   // whether cab_add_static_batch made it
} cab_BatchInfo;

// What reserve makes room for, counting what the engine has already.
typedef struct cab_ReserveDesc {
  uint32_t batches;     // most batches at a time
  uint32_t characters;  // most instances of all batches of characters together
  uint32_t queries;     // queries that cab_run_queries answers per chunk; larger jobs are split
  // Most hits of characters in one frame. A frame with more hits than any before it allocates unless they are reserved
  // (docs/embedding.md, Memory). Hits of sequences need no memory of the engine.
  uint32_t hits;
} cab_ReserveDesc;

// How many bytes an engine holds through its allocator. Written by cab_engine_memory.
typedef struct cab_EngineMemory {
  size_t articulations;  // topology, merge orders, boxes, shapes
  size_t batches;        // bounds and chains of hits of characters; static bodies
  size_t workers;        // boxes and lists of the threads
  size_t broad_phase;    // bounds and strips of characters
  size_t hits;           // the store, until they are written
  size_t queries;        // the index of instances, and what is kept per query
  size_t histories;      // the moments that are kept, and what workers need for them
  size_t total;          // all of these, and what rules take
} cab_EngineMemory;

// Why an instance is masked. A masked instance is in no pair of the frame, and changes no bit of other instances.
// cab_compute_boxes writes boxes with half extents 0 for it. The values are bits of cab_BatchInput.flags.
typedef uint8_t cab_InstanceFlag;
enum {
  CAB_INSTANCE_OK = 0,          // the instance takes part
  CAB_INSTANCE_NOT_FINITE = 1,  // a NaN, an infinity, or a coordinate above CAB_MAX_COORDINATE
  // a quaternion shorter than 1e-3 or longer than 1e3, a matrix off a rotation, mirrored or
  CAB_INSTANCE_NOT_RIGID = 2,
  // not, by over 1e-3, or a scale that is not within CAB_MIN_SCALE to CAB_MAX_SCALE
};

// What cab_why_masked found wrong with an instance.
typedef uint8_t cab_MaskCause;
enum {
  CAB_MASK_CAUSE_NONE = 0,                // nothing: the instance takes part
  CAB_MASK_CAUSE_POSE_NUMBER = 1,         // a number of a link's pose is a NaN or too large
  CAB_MASK_CAUSE_ORIENTATION_NUMBER = 2,  // a number of the instance's orientation is a NaN or too large
  CAB_MASK_CAUSE_QUATERNION_LENGTH = 3,   // the quaternion of a link's pose is too short or too long
  CAB_MASK_CAUSE_ORIENTATION_LENGTH = 4,  // the instance's orientation is too short or too long
  CAB_MASK_CAUSE_MATRIX = 5,              // the matrix of a link's pose is no rotation, mirrored or not
  CAB_MASK_CAUSE_SCALE = 6,  // the scale of the instance, or of a link's matrix, is a NaN, too small or too large
  CAB_MASK_CAUSE_JOINT = 7,  // a posed joint is out of range
  CAB_MASK_CAUSE_BOX = 8,    // a posed leaf box is out of range
};

// Why an instance is masked: the first cause that the engine finds. Written by cab_why_masked.
typedef struct cab_MaskReason {
  cab_InstanceFlag flag;  // the flag that the instance gets
  cab_MaskCause cause;    // what is wrong
  uint32_t link;          // index of the link whose pose it is about; 0 for the instance's own numbers
  uint32_t index;         // of the number in the pose or orientation, of the leaf, or of the joint's link
  float value;  // the number; the length; the scale; the largest entry of |R^T R - I|; or the largest coordinate
  float limit;  // what the value must not exceed, or, if it is below this, not fall short of
} cab_MaskReason;

// The value of cab_BatchInput.count for all instances of the batch.
#define CAB_ALL_INSTANCES 0xffffffffu

// The input and the outputs of one batch for one call. Of a batch of static bodies it has no poses, origins,
// orientations, scales, margins, moved and bounds: they are known, and the bodies rest. Every span has entries for all
// instances, in their order, or is empty. With a count, spans may end anywhere after its instances.
typedef struct cab_BatchInput {
  // Which batch this is. It must be a batch of the same engine. Required.
  cab_BatchId batch;

  // The pose of every link of every instance, from link to instance. Required unless `count` is 0. Poses of links
  // without leaves are read only if a merge needs their joint, or if they move triangles of a leaf.
  cab_PoseView poses;

  // x y z per instance: the instance's origin in the world. Must be finite. Empty (default): all origins are 0.
  cab_ConstDoubleSpan origins;

  // Quaternion x y z w per instance: it rotates the instance about its origin, from its frame to the world's axes. The
  // length of the quaternion is divided out. Empty (default): no instance is rotated.
  cab_ConstFloatSpan orientations;

  // Output of cab_run_frame and cab_compute_boxes, one byte per instance: cab_InstanceFlag bits that say why the
  // instance is masked, or 0. Empty (default): nothing is written.
  cab_Uint8Span flags;

  // One word per instance: bits of the layers that it is on. Two instances are tested against each other only if
  // (layers of a & mask of b) != 0 and (layers of b & mask of a) != 0. Empty (default): all bits are set.
  cab_ConstUint32Span layers;

  // One word per instance: bits of the layers that it is tested against. Empty (default): all bits are set.
  cab_ConstUint32Span layer_masks;

  // Output of cab_run_frame, one byte per instance: 1 if the instance is in a hit, with another instance or within
  // itself, else 0. Empty (default): nothing is written.
  cab_Uint8Span in_contact;

  // One factor per instance, from CAB_MIN_SCALE to CAB_MAX_SCALE, by which it is scaled about its origin: the
  // translations of its poses, its joints, leaf boxes and shapes. Not together with cab_PoseView.has_scale. Empty
  // (default): no instance is scaled.
  cab_ConstFloatSpan scales;

  // How many instances there are in this call, the first ones of the batch; 0 to its instance_count. The others take no
  // part, and nothing of theirs is read. CAB_ALL_INSTANCES (default): all. A sequence of which one
  // instance is given is a fixed object in that call.
  uint32_t count;

  // The numbers of the instances that are in this call, each above the one before and below `count`. The others take no
  // part: nothing of theirs is read, and only their bytes of in_contact are written. All other spans are by the number
  // of an instance, as without this list, and so are hits. Characters only. Empty (default): all instances up to
  // `count`; for none, set `count` to 0.
  cab_ConstUint32Span instances;

  // Input of cab_find_candidates: six floats per instance, its lower x y z and its upper x y z, relative to its origin
  // along the world's axes, that hold its leaf boxes as cab_compute_boxes gives them. cab_run_frame counts the
  // instances whose boxes leave them (cab_FrameStats.instances_beyond_bounds). Empty (default): no bounds are given.
  cab_ConstFloatSpan bounds;

  // One length per instance, from 0 to CAB_MAX_COORDINATE, in the caller's unit: its own margin. Two instances are
  // tested with the frame's margin and those of both, and two links of one instance with twice its own.
  // cab_sweep_margins fills it so that fast bodies do not pass through each other between two frames. Characters only.
  // Empty (default): instances have no margin of their own.
  cab_ConstFloatSpan margins;

  // One byte per instance. 0 states that the instance rests: its pose, origin, orientation, scale, margin, layers and
  // layer mask are those of this batch's last frame. Then it is neither posed for its bounds nor put into strips
  // again, and hits of two that rest are kept. Any other value states nothing. All instances count as moved in the
  // first frame with `moved`, after a frame that did not answer CAB_STATUS_OK or had other rules, policies, margin,
  // min_depth, containment or report, and after cab_find_candidates, cab_add_batch, cab_add_static_batch, reserve and
  // cab_remove_batch; those of a batch do where `orientations` become empty or cease to be; an instance does that was
  // not in its batch's last frame, by `count` or `instances`, or was masked there. A build without NDEBUG compares what
  // rests with the last frame, and may answer CAB_STATUS_MOVED_AT_REST. Characters only. Empty (default): all have
  // moved.
  cab_ConstUint8Span moved;

  // What the poses are made of. Sequences only. Default: the poses are the caller's.
  cab_StateView states;
} cab_BatchInput;

// What a rule does with the hits of two instances that both rest, and of one that rests and is tested within itself.
// They are those of the frame before.
typedef uint8_t cab_Resting;
enum {
  // they are reported like all others; the engine keeps them, or tests again where it could not
  CAB_RESTING_REPORTED = 0,
  CAB_RESTING_SKIPPED = 1,  // they are not reported again
};

// What a cab_PairRule pairs.
typedef uint8_t cab_Pairing;
enum {
  // links of instances of a with links of other instances of b, if the layers of both instances match
  CAB_PAIRING_BETWEEN = 0,
  CAB_PAIRING_WITHIN = 1,  // links of each instance with each other, except ignored pairs; layers do not matter
};

// Which instances a frame tests against each other. Instances that no rule pairs are not tested.
typedef struct cab_PairRule {
  // A batch that has input in the frame.
  cab_BatchId a;

  // With CAB_PAIRING_BETWEEN: a batch that has input in the frame and is of the same kind as `a`. For characters it may
  // be `a` itself. Static bodies count as characters, but are paired neither among themselves nor within. Two sequences
  // must differ, and must have equally many instances in this call unless one has a single one, or none. With
  // CAB_PAIRING_WITHIN: `a` itself.
  cab_BatchId b;

  // Whether different instances are paired, or the links of each instance. Default: different instances.
  cab_Pairing pairing;

  // What is done with instances that rest (cab_BatchInput.moved). Default: their hits are reported.
  cab_Resting resting;
} cab_PairRule;

// ------------------------------------------------------------------------------------------------------------ frame

// What a frame finds out.
typedef uint8_t cab_Report;
enum {
  CAB_REPORT_HITS = 0,  // every pair of links that touch, and cab_BatchInput.in_contact if the caller gives it
  // only cab_BatchInput.in_contact: faster, since a pair of instances is done at its first touching leaves
  CAB_REPORT_IN_CONTACT = 1,
  CAB_REPORT_DISTANCES = 2,  // for each pair of instances within the margin, the closest (or deepest) pair of links
};

// Two links that touch, or are at most the frame's margin apart. (batch_a, instance_a, link_a) is lower than
// (batch_b, instance_b, link_b). One hit stands for all leaves of the two links.
typedef struct cab_Hit {
  cab_BatchSlot batch_a;  // batch of the first link
  uint32_t instance_a;    // index of its instance in batch_a; for a sequence the frame, or 0 for a fixed object
  cab_BatchSlot batch_b;  // batch of the second link
  uint32_t instance_b;    // index of its instance in batch_b, likewise
  uint16_t link_a;        // index of the first link
  uint16_t link_b;        // index of the second link
  uint16_t leaf_a;        // index of a leaf on link_a; (leaf_a, leaf_b) is the lowest leaf pair that touches
  uint16_t leaf_b;        // index of a leaf on link_b
} cab_Hit;

// Two instances that a frame has to test. (batch_a, instance_a) is lower than (batch_b, instance_b).
typedef struct cab_InstancePair {
  cab_BatchSlot batch_a;  // batch of the first instance
  uint32_t instance_a;    // its index
  cab_BatchSlot batch_b;  // batch of the second instance
  uint32_t instance_b;    // its index
} cab_InstancePair;

// The candidates of cab_find_candidates.
typedef struct cab_CandidateList {
  cab_InstancePairSpan pairs;  // receives the pairs, in order
  size_t pair_count;           // how many pairs were written
  size_t pairs_needed;         // how many pairs there are, whether there is room for them or not
} cab_CandidateList;

// What changed between two lists of hits. Written by cab_diff_hits.
typedef struct cab_HitChanges {
  cab_HitSpan began;   // receives the hits that only the second list has, in order
  cab_HitSpan ended;   // receives the hits that only the first list has, in order
  size_t began_count;  // how many there are, also if `began` is too small
  size_t ended_count;  // likewise
} cab_HitChanges;

// What cab_find_touching_moments writes for links that touch at no moment.
#define CAB_NEVER_TOUCH 2.0f

// How two links touch: the deepest contact of all parts on the first with all parts on the second, by the frame's exact
// test. If the links are apart, the contact describes their smallest gap. All numbers but the leaves are 0 for two
// half spaces, and if FCL was asked and gave no contact.
// With CAB_EXACT_CONVEX, moving b by depth along normal always parts the two convex parts that the contact is of. For
// boxes, hulls of at most 256 vertices, spheres and capsules, and with a half space no way does that is shorter by more
// than 1e-6 of size; for other shapes the shortest way is searched for. A gap is never larger than the distance, to
// rounding, and at most 1e-5 of size and distance smaller. Each point is in or on its body. point_a - point_b is depth
// along normal, but for what docs/limits.md says.
typedef struct cab_Contact {
  float normal[3];   // unit vector from a to b, in the world's axes
  float depth;       // how far b must move along normal to be free, in the caller's unit; below 0: minus the gap
  float point_a[3];  // x y z of a's point deepest in b, or nearest to b; relative to the origin of instance_a, in the
                     // world's axes
  float point_b[3];  // the same of b, also relative to the origin of instance_a
  uint16_t leaf_a;   // index of the leaf of the first link that the contact is of
  uint16_t leaf_b;   // index of the leaf of the second link
} cab_Contact;

// Two triangles of skins that touch. Written by cab_find_touching_triangles.
typedef struct cab_TouchingTriangles {
  uint32_t pair;        // index of the two links
  uint16_t leaf_a;      // index of the leaf of the first link
  uint16_t leaf_b;      // index of the leaf of the second link
  uint32_t triangle_a;  // which triangle of the first leaf: an index in its cab_Leaf.triangles, over 3
  uint32_t triangle_b;  // the same of the second leaf
} cab_TouchingTriangles;

// What a frame did. Counts depend neither on the instruction set nor on threads. With CAB_REPORT_IN_CONTACT they depend
// on both, because what has already been reported is skipped, and candidates come in another order. Seconds are sums
// over threads, except seconds_total.
typedef struct cab_FrameStats {
  uint64_t candidates;               // pairs of characters whose bounds overlap, and characters tested within
  uint64_t box_tests;                // overlap tests of two boxes, inner ones and leaves
  uint64_t leaf_pairs;               // leaf pairs whose boxes overlap (#coll in the paper) or are inside
  uint64_t exact_tests;              // leaf pairs that went to the exact test, at most leaf_pairs
  uint64_t false_positives;          // exact tests that found the leaves apart: #false in the paper
  uint64_t instances_masked;         // instances that took no part (cab_InstanceFlag says why)
  uint64_t instances_beyond_bounds;  // characters whose leaf boxes leave cab_BatchInput.bounds; 0 by `links`
  uint64_t instances_resting;        // characters and static bodies that were not bounded again
  uint64_t hits_kept;                // of hits_needed: the last frame's hits of two that rest; no test counts
  uint64_t leaves_skinned;           // how often a leaf's triangles were skinned; depends on the threads
  uint64_t leaves_replaced;          // of these, in the place of another leaf that had been skinned
  double seconds_update;             // posing and refit: t[upd]
  double seconds_broad;              // broad phase: finding characters whose bounds overlap
  double seconds_test;               // box tests: t[test]
  double seconds_query;              // exact tests, reporting hits, and contacts: t[query]
  double seconds_contact;            // contacts, which seconds_query includes
  double seconds_total;              // wall time of the call

  // Where the time of characters goes. The rest of each phase is: posing again, searching, box tests, sorting and exact
  // tests.
  uint64_t instances_posed;   // how often a character was posed again for tests; depends on the threads
  uint64_t candidates_apart;  // candidates without two leaves whose bounds overlap; 0 without leaf bounds
  double seconds_bound;       // of seconds_update: posing every character for its bounds
  double seconds_sort;        // of seconds_broad: sorting rows into strips
  double seconds_filter;      // of seconds_test: comparing the bounds of leaves
  double seconds_write;       // of seconds_query: writing the hits in their order
} cab_FrameStats;

// One frame: what is posed, what is paired and how, and where the answer goes. Every batch with input is posed. Batches
// without input take no part.
//
// If `hits` is too small, cab_run_frame answers CAB_STATUS_HITS_OVERFLOW. Then hits_needed is the size of `hits` that a
// second call needs, hit_count is 0, and the contents of hits and contacts are unspecified. flags, in_contact and stats
// are complete, but with min_depth in_contact then follows hits of any depth.
typedef struct cab_FrameJob {
  // The batches that take part, each once, in any order. Empty (default): a frame without hits.
  cab_ConstBatchInputSpan inputs;

  // What is tested against what, in any order. The same two batches may be paired once per Pairing. Empty (default): a
  // frame without hits.
  cab_ConstPairRuleSpan rules;

  // How boxes are made and tested, and whether an exact test confirms them. Default: the preset `balanced`.
  cab_Policies policies;

  // A length in the caller's unit, from 0 (default) to CAB_MAX_COORDINATE. Links that are at most this far apart are
  // reported too. The distance is that of their leaf boxes, or of their shapes if there is an exact test. Two boxes
  // that face each other corner to corner may be reported up to 1.74 margins apart, and those of CAB_REFIT_AABB_HULL
  // and of levels of detail farther (docs/limits.md).
  float margin;

  // A length in the caller's unit, from 0 (default) on. Above 0, hits whose contact is less deep are dropped, so an
  // exact test is needed; 0 drops none. With CAB_EXACT_CONVEX no hit is dropped whose links must move at least this far
  // to part. `hits` needs room for the hits of any depth. Must be 0 with CAB_REPORT_IN_CONTACT.
  float min_depth;

  // What the frame finds out. Default: hits.
  cab_Report report;

  // With CAB_EXACT_SURFACE: whether what is wholly inside a closed part of another instance's skin is a hit, though no
  // triangles touch (docs/exact.md). Other exact tests do not read it. Default: it is a hit.
  bool containment;

  // Output: room for the hits, one per two links that touch. They are sorted by batch_a, instance_a, batch_b,
  // instance_b, link_a, link_b. Empty (default): room for no hit. With CAB_REPORT_IN_CONTACT nothing is written. With
  // CAB_REPORT_DISTANCES one hit per two instances is left, but there must be room for all links that it is chosen
  // from.
  cab_HitSpan hits;

  // Output: contacts[i] receives the contact of hits[i]. As long as hits, and only with an exact test. Empty (default):
  // no contacts are computed, and CAB_REPORT_DISTANCES is refused. With CAB_REPORT_IN_CONTACT nothing is written.
  cab_ContactSpan contacts;

  // Output: how many hits, and contacts if there is room for them, were written. 0 with CAB_REPORT_IN_CONTACT.
  size_t hit_count;

  // Output: how many hits the frame has before min_depth and CAB_REPORT_DISTANCES drop any, whether `hits` has room for
  // them or not. 0 with CAB_REPORT_IN_CONTACT.
  size_t hits_needed;

  // Output: counts and times of this frame.
  cab_FrameStats stats;
} cab_FrameJob;

// ----------------------------------------------------------------------------------------------------------- engine

// Where an engine takes its memory from. cab_create_engine copies this struct. Only the calls that add or remove,
// reserve, cab_destroy_engine, and reads beside others (cab/cab.h, Memory) call the functions: on their own thread, of
// one engine one call at a time. Neither function may throw, or call cab.
typedef struct cab_Allocator {
  // Passed to both functions. The caller owns what it points to, which must outlive the engine. Default: null.
  void* user;

  // Returns `bytes` of memory at a multiple of `alignment`, a power of two, or null if there is no memory. Required.
  void* (*allocate)(void* user, size_t bytes, size_t alignment);

  // Takes back memory that allocate returned, with the same bytes and alignment. Required.
  void (*release)(void* user, void* memory, size_t bytes, size_t alignment);
} cab_Allocator;

// How an engine runs its tasks. cab_create_engine copies this struct. cab_run_frame calls parallel_for about seven
// times; cab_find_candidates, cab_run_queries, cab_record_tick, cab_compute_contacts, cab_sweep_margins and
// cab_find_touching_moments call it too. A caller with a task graph may run a frame's tasks itself (cab_begin_frame);
// worker_count is the number of threads that do.
typedef struct cab_Scheduler {
  // Passed to parallel_for. The caller owns what it points to, which must outlive the engine. Default: null.
  void* user;

  // How many tasks may run at once, 1 to CAB_MAX_WORKERS. The engine keeps memory for each worker (cab_add_batch).
  // Required.
  uint32_t worker_count;

  // Calls task(context, t, worker) once for every t < task_count, and returns when all calls have returned. Calls that
  // run at the same time must have different `worker`s, each below worker_count. No task waits for another. Must not
  // throw. Required. If it skips tasks, the call answers CAB_STATUS_TASKS_LEFT; if it repeats or invents tasks or
  // workers, CAB_STATUS_BAD_TASK: then these do nothing.
  void (*parallel_for)(void* user, uint32_t task_count, void (*task)(void* context, uint32_t task, uint32_t worker),
                       void* context);
} cab_Scheduler;

// What a caller's profiler is told. cab_create_engine copies this struct. The functions are called on the thread that
// does the work, in pairs that lie within each other, and on several threads at the same time: by cab_run_frame with
// "frame" around all of it; by cab_run_queries with "queries"; and by cab_run_frame and cab_run_task, for each task,
// with the name of its step: "bound", "sort", "pair", "keep order", "count hits", "write hits", "sequences" or
// "contacts". They run in the library's floating-point mode, take time away from the frame, and must not throw.
typedef struct cab_Profiler {
  // Passed to both functions. The caller owns what it points to, which must outlive the engine. Default: null.
  void* user;

  // Called when a phase begins. The name lives as long as the program. worker: that of the Scheduler; 0 for "frame"
  // and "queries", so calls of cab_run_queries beside each other are told apart by their threads. Required.
  void (*begin)(void* user, const char* phase, uint32_t worker);

  // Called when the phase ends, with the same name and worker. Required.
  void (*end)(void* user, const char* phase, uint32_t worker);
} cab_Profiler;

// What cab_create_engine needs to know.
typedef struct cab_EngineDesc {
  // The instruction set of the kernels. Default: the best available one.
  cab_Isa isa;

  // Threads of the built-in scheduler. 1 (default): the calling thread. 0: TBB on every core. n: TBB on at most n
  // threads, and on no more than there are cores. A library built without TBB has one thread whatever is asked for;
  // cab_engine_thread_count tells. Ignored if `scheduler` is given.
  uint32_t thread_count;

  // Where memory comes from. Borrowed for the call. Null (default): aligned operator new. For large blocks on Linux it
  // asks for huge pages.
  const cab_Allocator* allocator;

  // How tasks run. Borrowed for the call. Null (default): the built-in scheduler.
  const cab_Scheduler* scheduler;

  // Profiler hooks, called when phases begin and end. Borrowed for the call. Null (default): nothing is.
  const cab_Profiler* profiler;
} cab_EngineDesc;

// How a joint moves its link.
typedef uint8_t cab_JointKind;
enum {
  CAB_JOINT_KIND_REVOLUTE = 0,   // it turns about its axis by one value, in radians
  CAB_JOINT_KIND_PRISMATIC = 1,  // it moves along its axis by one value, in the links' unit
  CAB_JOINT_KIND_BALL = 2,       // it turns by the rotation vector that three values are, in radians
};

// A joint. Its values are multiplier * state[variable] + offset, so that joints may follow the variable of another. A
// CAB_JOINT_KIND_BALL takes three variables from `variable` on.
typedef struct cab_JointDesc {
  cab_JointKind kind;  // how it moves its link
  uint32_t variable;   // index of its first variable in a state
  double axis[3];      // x y z in its link's frame, of length 1. CAB_JOINT_KIND_BALL: not read
  double anchor[3];    // x y z of the point that stays where it is when it turns, in its link's frame
  double multiplier;   // finite
  double offset;       // finite
} cab_JointDesc;

// Where a link is in its parent's frame, and the joints that move it from there.
typedef struct cab_LinkPlaceDesc {
  double rotation[4];     // quaternion x y z w of length 1, from the link's frame to the parent's
  double translation[3];  // x y z in the parent's frame
  uint32_t joint_count;   // how many joints it has, each in the frame that those before it leave
} cab_LinkPlaceDesc;

// The links of a body and their joints. Spans are read by the call alone, by cab_begin_frame until cab_end_frame.
typedef struct cab_KinematicsDesc {
  cab_ConstInt32Span link_parents;   // as cab_ArticulationDesc.link_parents: parents come first, -1 for a root
  cab_ConstLinkPlaceDescSpan links;  // one per link. That of a root is its place in the body's frame
  cab_ConstJointDescSpan joints;     // those of the first link, then those of the second, and so on
  uint32_t variable_count;           // numbers of a state
} cab_KinematicsDesc;

// ------------------------------------------------------------------------------------------------------- histories

// The poses that a batch had at its last moments, for queries about the past. The id is made like a cab_BatchId.
typedef struct cab_HistoryId {
  uint64_t value;  // 0: no history
} cab_HistoryId;

// Parameters of cab_add_history.
typedef struct cab_HistoryDesc {
  // A batch of characters of the same engine, neither static bodies nor a level of nodes. Required.
  cab_BatchId batch;

  // How many moments are kept, the last ones that were recorded: 1 to CAB_MAX_TICKS.
  uint32_t ticks;
} cab_HistoryDesc;

// The most moments that a history keeps.
#define CAB_MAX_TICKS 65536u

// The moments that a history has.
typedef struct cab_HistorySpan {
  uint32_t ticks;  // how many; with 0 the times have no meaning
  double first;    // the time of the earliest one that is kept
  double last;     // and of the latest
} cab_HistorySpan;

// The time of a query that asks the job's inputs: infinity.
#define CAB_NOW HUGE_VAL

// --------------------------------------------------------------------------------------------------------- queries

// What a query is, and what it finds. "Link" stands for the leaf boxes of the link, or for its exact shapes if
// cab_QueryJob.exact asks for them.
typedef uint8_t cab_QueryKind;
enum {
  CAB_QUERY_KIND_RAY = 0,      // links that a ray meets, or a sphere that is moved along it
  CAB_QUERY_KIND_SPHERE = 1,   // links that overlap a sphere
  CAB_QUERY_KIND_BOX = 2,      // links that overlap an oriented box
  CAB_QUERY_KIND_CAPSULE = 3,  // links that overlap a capsule
  CAB_QUERY_KIND_POINT = 4,    // links within a distance of a point, nearest first
  // links whose boxes are not wholly outside of any of several planes, such as those of a frustum
  CAB_QUERY_KIND_REGION = 5,
};

// How many values cab_QueryKind has.
#define CAB_QUERY_KIND_COUNT 6u

// Which hits a query returns.
typedef uint8_t cab_QueryWant;
enum {
  CAB_QUERY_WANT_ANY = 0,      // whether there is any link: cab_QueryJob.found; names no link, and is the fastest
  CAB_QUERY_WANT_CLOSEST = 1,  // the first link in the order of cab_QueryHit
  CAB_QUERY_WANT_ALL = 2,      // all links, or the first cab_Query.max_hits of them
};

// How many values cab_QueryWant has.
#define CAB_QUERY_WANT_COUNT 3u

// One query. Members that its kind does not name are not read.
typedef struct cab_Query {
  cab_QueryKind kind;  // what is asked
  cab_QueryWant want;  // which of the links that meet it are written

  // CAB_QUERY_KIND_SPHERE, CAB_QUERY_KIND_BOX, CAB_QUERY_KIND_CAPSULE: whether hits say how deep the link is in the
  // shape. Without it their distance is 0, and their points and normals are 0. Default: they do not.
  bool with_depth;

  // CAB_QUERY_WANT_ALL: the most hits that are written, 1 or more. Default: all of them.
  uint32_t max_hits;

  // An instance is looked at if one of these bits is in its layer (cab_BatchInput.layers). An instance of a batch
  // without layers has all bits. Default: all bits.
  uint32_t layer_mask;

  // An instance that is left out, such as the shooter. A batch of id 0 (default): none is. Any other must be a batch of
  // the engine, which need not have input.
  cab_BatchId ignored_batch;
  uint32_t ignored_instance;

  // When it is asked. CAB_NOW (default): of the job's inputs. A finite time: of the job's histories as they were then,
  // and of the static bodies among the inputs, but of no other input. A time before the first moment of a history
  // counts as its first, one after the last as its last (cab_QueryStats.clamped).
  double time;

  // x y z in the world, each finite and at most CAB_MAX_QUERY_COORDINATE. CAB_QUERY_KIND_RAY: where the ray begins.
  // CAB_QUERY_KIND_SPHERE, CAB_QUERY_KIND_BOX, CAB_QUERY_KIND_CAPSULE: the centre. CAB_QUERY_KIND_POINT: the point.
  // CAB_QUERY_KIND_REGION: what its planes are relative to.
  double position[3];

  // CAB_QUERY_KIND_BOX, CAB_QUERY_KIND_CAPSULE: quaternion x y z w that rotates from the shape's frame to the world's
  // axes. Its length is divided out, and must be at least 1e-3 and at most 1e3.
  float orientation[4];

  // CAB_QUERY_KIND_RAY: x y z of its direction in the world's axes. Its length is divided out; it must not be 0 unless
  // `length` is.
  float direction[3];

  // CAB_QUERY_KIND_RAY: how far it goes, in the caller's unit: 0 or more, or infinity. CAB_QUERY_KIND_POINT: the
  // largest distance, 0 or more, or infinity.
  float length;

  // Lengths in the caller's unit, 0 or more, at most CAB_MAX_COORDINATE. CAB_QUERY_KIND_RAY: the radius of the sphere
  // that is moved, 0 for a ray. CAB_QUERY_KIND_SPHERE: the radius. CAB_QUERY_KIND_CAPSULE: the radius.
  // CAB_QUERY_KIND_BOX: not read.
  float radius;

  // Likewise. CAB_QUERY_KIND_BOX: half extents along the shape's x y z. CAB_QUERY_KIND_CAPSULE: [2] is half the length
  // of its segment, along z.
  float half[3];

  // CAB_QUERY_KIND_REGION: its planes, from cab_QueryJob.planes[first_plane] on. With none, it is the whole world.
  uint32_t first_plane;
  uint32_t plane_count;
} cab_Query;

// The largest magnitude of a coordinate of a query, and how far apart along an axis a query's position and the origin
// of an instance may be that it finds, in the caller's unit.
#define CAB_MAX_QUERY_COORDINATE 1e30

// One side of a region: the points p of the world with dot(normal, p - position) <= offset, where `position` is that of
// the query.
typedef struct cab_QueryPlane {
  float normal[3];  // in the world's axes, finite, of any length but 0
  float offset;     // finite; in the caller's unit, times the length of `normal`
} cab_QueryPlane;

// A link that a query found. A half space is within its leaf's box: where the box is farther than the plane, the hit is
// that of the box. Hits are in the order of query, distance, batch, instance, link. There is one per query
// and link, for the link's nearest leaf; of equally near ones the lowest.
typedef struct cab_QueryHit {
  uint32_t query;       // index of the query
  cab_BatchSlot batch;  // batch of the instance
  uint32_t instance;    // instance of the link
  uint16_t link;        // index of the link
  uint16_t leaf;        // the leaf that the rest is of
  float
      distance;  // CAB_QUERY_KIND_RAY: along the ray, 0 where it begins inside. CAB_QUERY_KIND_POINT: from the point, 0
                 // inside. CAB_QUERY_KIND_SPHERE,
                 // CAB_QUERY_KIND_BOX, CAB_QUERY_KIND_CAPSULE: with depth minus the depth, which is 0 or more; else 0.
                 // CAB_QUERY_KIND_REGION: 0
  float point
      [3];  // relative to cab_Query.position, in the world's axes. CAB_QUERY_KIND_RAY: where the ray, or the sphere,
            // first touches the link. CAB_QUERY_KIND_POINT: the link's nearest point. With depth: the link's deepest
            // point
  float normal
      [3];  // of length 1, out of the link: CAB_QUERY_KIND_RAY: where the ray enters. CAB_QUERY_KIND_POINT: towards the
            // point. With
            // depth: along which the shape leaves the link. 0 0 0 where a ray or point begins inside
  bool
      inside;  // CAB_QUERY_KIND_RAY, CAB_QUERY_KIND_POINT: whether the ray begins, or the point is, inside the link, or
               // on its surface
} cab_QueryHit;

// A link that a query found, without where it was met: the first members of its cab_QueryHit, in a third of the memory.
typedef struct cab_QueryLink {
  uint32_t query;       // index of the query
  cab_BatchSlot batch;  // batch of the instance
  uint32_t instance;    // instance of the link
  uint16_t link;        // index of the link
  uint16_t leaf;        // its nearest leaf, as in cab_QueryHit
} cab_QueryLink;

// Where on the triangles of a skin a hit is.
typedef struct cab_SurfacePoint {
  uint32_t triangle;  // index of its first corner in cab_Leaf.triangles, over 3; of hits that are not on
                      // triangles 0xffffffff
  float weights[3];   // of the three corners, in their order: 0 to 1, and they add to 1 but for rounding
} cab_SurfacePoint;

// What a call did. Counts depend neither on the instruction set nor on threads, but for those that say so. With
// reuse_bounds those of the search depend on which calls came before. Seconds are sums over threads, except
// seconds_total.
typedef struct cab_QueryStats {
  uint64_t nodes;            // nodes of the index that were compared with a query, sixteen bounds at a time
  uint64_t instances;        // instances whose bounds a query met
  uint64_t leaf_tests;       // leaves that a query may meet, by their boxes or bounds in float
  uint64_t exact_tests;      // of those the ones whose exact shapes were tested
  uint64_t leaves_skinned;   // how often a leaf's triangles were skinned; depends on the threads
  uint64_t leaves_replaced;  // of these, in the place of another leaf that had been skinned; likewise
  uint64_t instances_posed;  // how often instances were posed for tests; depends on the threads
  // Instances of inputs that took no part (cab_InstanceFlag says why). 0 with reuse_bounds, and if no query asks for
  // inputs.
  uint64_t instances_masked;
  uint64_t clamped;       // how often a query's time was before or after all that a history has
  double seconds_bound;   // posing instances for their bounds
  double seconds_index;   // making the index
  double seconds_search;  // everything that is done per query
  double seconds_total;   // wall time of the call
} cab_QueryStats;

// Many queries at once.
//
// A job takes its hits in full (`hits`), as a short list (`links`), or counts them (`counts` alone). If the list is too
// small, cab_run_queries answers CAB_STATUS_HITS_OVERFLOW. Then hits_needed is the size that a second call needs,
// hit_count is 0, and the contents of the list are unspecified. counts, found and stats are complete.
typedef struct cab_QueryJob {
  // Whose links are asked for: as in cab_FrameJob. Margins, bounds and `moved` are not read, and flags and in_contact
  // not written. Characters only. Empty (default): nothing is found by queries of CAB_NOW.
  cab_ConstBatchInputSpan inputs;

  // Whose links are asked for by queries with a time of their own: each history once, and no two of one batch. Their
  // batches need no input. Empty (default): such queries find static bodies alone.
  cab_ConstHistoryIdSpan histories;

  // The queries, of any kinds in any order. Empty (default): none.
  cab_ConstQuerySpan queries;

  // The planes of regions.
  cab_ConstQueryPlaneSpan planes;

  // Whether shapes decide, or boxes alone: CAB_EXACT_NONE, CAB_EXACT_CONVEX or CAB_EXACT_SURFACE. With
  // CAB_EXACT_SURFACE rays meet the triangles of a skin, and shapes as with CAB_EXACT_CONVEX; if an input has a skin,
  // only rays and regions are answered, and about the past of one only rays. A region always asks for boxes. Default:
  // boxes, those that cab_compute_boxes gives.
  cab_Exact exact;

  // States that inputs are those of the last frame that answered CAB_STATUS_OK: same batches, counts, instances, poses,
  // origins, orientations and scales. Then instances are not posed for their bounds, unless that frame made none for
  // them, and further calls with reuse_bounds use the index and the boxes of calls before. Default: nothing is stated.
  bool reuse_bounds;

  // Output: room for the hits of all queries that want CAB_QUERY_WANT_CLOSEST or CAB_QUERY_WANT_ALL. Empty (default):
  // room for no hit.
  cab_QueryHitSpan hits;

  // Output: of each hit where on the triangles of a skin it is; as many as `hits` has room for. Empty
  // (default): not written.
  cab_SurfacePointSpan surface_points;

  // Output: the same hits in the same order, as a short list. If it has room for any, `hits` must have none.
  // Empty (default): not written.
  cab_QueryLinkSpan links;

  // Output: one number per query, how many hits it has. If there is room for no hit but for counts, the call answers
  // CAB_STATUS_OK without writing any hit. Empty (default): not written.
  cab_Uint32Span counts;

  // Output: one byte per query, 1 if it found a link, else 0. Empty (default): not written.
  cab_Uint8Span found;

  // Output: how many hits were written, in full or as a short list.
  size_t hit_count;

  // Output: how many hits there are, whether there is room for them or not.
  size_t hits_needed;

  // Output: after CAB_STATUS_BAD_QUERY, after CAB_STATUS_UNKNOWN_BATCH for its ignored_batch, and after
  // CAB_STATUS_SKIN_NOT_TAKEN for a query of a kind that is not answered: the index of the query at fault.
  size_t bad_query;

  // Output: counts and times of this call.
  cab_QueryStats stats;
} cab_QueryJob;

// The value of cab_BoxLinesJob.level for the leaves of all instances.
#define CAB_LEAF_LEVEL 0xffffffffu

// The value of cab_BoxLine.link for a box that is not on one link alone.
#define CAB_NO_LINK 0xffffu

// An edge of a box or of a shape, or a contact.
typedef struct cab_BoxLine {
  float from[3];      // x y z of one end, relative to cab_BoxLinesJob.origin, in the world's axes
  float to[3];        // x y z of the other end, likewise
  uint32_t instance;  // index of the instance that the box is of
  uint16_t node;      // index of the box in the hierarchy, as in cab_compute_boxes; a leaf's for its shapes
  uint16_t link;      // index of the link that a leaf is on, or CAB_NO_LINK for an inner box
  bool is_hit;        // whether a link that the box stands for is in one of cab_BoxLinesJob.hits
} cab_BoxLine;

// What cab_box_lines draws. If `lines` is too small, cab_box_lines answers CAB_STATUS_LINES_OVERFLOW. Then lines_needed
// is right, line_count is 0, and the contents of lines are unspecified.
typedef struct cab_BoxLinesJob {
  // How boxes are made: `refit` and `extents`. Default: the preset `balanced`.
  cab_Policies policies;

  // Which boxes of an instance are drawn: those that are `level` merges below the root, and leaves that are fewer
  // merges below it. 0 is the root. CAB_LEAF_LEVEL (default): the leaves.
  uint32_t level;

  // Whether leaves are drawn as their exact shapes: edges of boxes and hulls, circles of sixteen lines of what is
  // round. Half spaces, hulls of more than 256 vertices and leaves with triangles stay boxes. Default: all are boxes.
  bool shapes;

  // Hits of a frame with the same input, in any order. Empty (default): no box is hit.
  cab_ConstHitSpan hits;

  // The contacts of these hits, one each. For a hit whose instance a is one of `input` a line goes from point_a to
  // point_b, with its link and leaf of a. Empty (default): no contact is drawn.
  cab_ConstContactSpan contacts;

  // x y z in the world that lines are relative to, such as a camera's position. Must be finite. Default: 0.
  double origin[3];

  // Output: room for the lines, twelve per box. The boxes are in the order of instances, then of nodes; contacts come
  // last. Of each box four lines go along each of its axes, first the axis 0. Masked instances have no lines. Empty
  // (default): room for no line.
  cab_BoxLineSpan lines;

  // Output: how many lines were written.
  size_t line_count;

  // Output: how many lines there are, whether `lines` has room for them or not.
  size_t lines_needed;
} cab_BoxLinesJob;

// A version of cab.
typedef struct cab_Version {
  uint32_t major;    // raised by what programs must adapt to, such as a name that goes
  uint32_t minor;    // raised by what is added
  uint32_t patch;    // raised by a release that leaves the API as it is
  const char* text;  // CAB_VERSION_STRING; lives as long as the program
} cab_Version;

// Returns the version of the library that runs. It differs from the macros above if a program was compiled with the
// headers of one version and loads the shared libcab of another.
// Cost: constant time; allocates nothing. Thread: any.
CAB_API cab_Version cab_version(void);

// Which optional packages a library was built with.
typedef struct cab_BuildInfo {
  bool fcl;    // CAB_EXACT_FCL can be asked for; without it, the answer is CAB_STATUS_EXACT_NOT_BUILT
  bool qhull;  // vertices inside a hull are left out of it; without it they stay, and cost time per exact test
  bool tbb;    // thread_count has an effect; without it, engines without a caller's scheduler have one thread
} cab_BuildInfo;

// Returns which optional packages the library that runs was built with.
// Cost: constant time; allocates nothing. Thread: any.
CAB_API cab_BuildInfo cab_build_info(void);

// Owns articulations, batches and the memory of workers. Its contents are private to the library.
typedef struct cab_Engine cab_Engine;

// Makes an engine without articulations and batches, and writes its address to *out, which must not be null. The caller
// owns the engine and frees it with cab_destroy_engine. The structs that desc points to are copied.
// Cost: a few small allocations from operator new; with thread_count other than 1 also an arena of TBB, if that is
// built in.
// Statuses: CAB_STATUS_BAD_OUTPUT (out is null), CAB_STATUS_ISA_NOT_AVAILABLE, CAB_STATUS_BAD_ALLOCATOR,
// CAB_STATUS_BAD_SCHEDULER, CAB_STATUS_BAD_PROFILER, CAB_STATUS_OUT_OF_MEMORY. Thread: any.
// abi_version: CAB_ABI_VERSION; any other is refused with CAB_STATUS_BAD_ABI_VERSION.
CAB_API cab_Status cab_create_engine(uint32_t abi_version, const cab_EngineDesc* desc, cab_Engine** out);

// Frees an engine and everything that it owns. Its ids are invalid afterwards. Null is allowed and does nothing.
// Cost: gives every block back to the allocator.
// Thread: any, while no other call on this engine runs.
CAB_API void cab_destroy_engine(cab_Engine* engine);

// Adds an articulation, and writes its id to *out, which must not be null. All of desc is checked and copied. If desc
// is refused, *bad_element (may be null) receives the index of the bad element: of the link for CAB_STATUS_BAD_PARENT
// and CAB_STATUS_BAD_JOINT, of the leaf for CAB_STATUS_BAD_LEAF_LINK, CAB_STATUS_BAD_LEAF_BOX,
// CAB_STATUS_BAD_LEAF_AXES, CAB_STATUS_BAD_SHAPE, CAB_STATUS_SHAPE_OUTSIDE_LEAF_BOX, CAB_STATUS_BAD_LEAF_TRIANGLES and
// CAB_STATUS_TOO_MANY_INFLUENCES, of the vertex or the link for CAB_STATUS_BAD_SKIN, and of the entry of ignored_pairs
// for CAB_STATUS_BAD_IGNORED_PAIR. With other statuses *bad_element has no meaning. Cost: too high for every frame.
// Memory: one bit per ordered pair of links, and memory in proportion to leaves, parts and vertices. While the call
// runs, ignored_hops takes two bytes per ordered pair of links, and rest_pose about eight bytes per pair of leaves.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_BAD_OUTPUT (out is null), CAB_STATUS_NO_LINKS, CAB_STATUS_TOO_MANY_LINKS,
// CAB_STATUS_BAD_PARENT, CAB_STATUS_BAD_JOINT, CAB_STATUS_NO_LEAVES, CAB_STATUS_TOO_MANY_LEAVES,
// CAB_STATUS_BAD_LEAF_LINK, CAB_STATUS_BAD_LEAF_BOX, CAB_STATUS_BAD_LEAF_AXES, CAB_STATUS_BAD_SHAPE,
// CAB_STATUS_SHAPE_OUTSIDE_LEAF_BOX, CAB_STATUS_BAD_SKIN, CAB_STATUS_BAD_LEAF_TRIANGLES,
// CAB_STATUS_TOO_MANY_INFLUENCES, CAB_STATUS_BAD_IGNORED_PAIR, CAB_STATUS_BAD_REST_POSE, CAB_STATUS_OUT_OF_MEMORY.
// Thread: any, alone on its engine.
CAB_API cab_Status cab_add_articulation(cab_Engine* engine, const cab_ArticulationDesc* desc, cab_ArticulationId* out,
                                        uint32_t* bad_element);

// Fits an oriented box about the vertices of a mesh, for cab_Leaf.box. `vertices` holds x y z of each vertex in the
// link's frame. The box is written to *out, which must not be null. In exact arithmetic, every vertex is inside the
// box. The axes come from the covariance of the extreme vertices, then are rotated while that shrinks the surface. They
// are ordered to match the link's axes, and ties prefer the link's own axes. The order of vertices, repeated vertices
// and inner vertices have no effect. The last bits of the box may differ between builds: the box is input, so the
// promise of same bits begins after it.
// Cost: too high for every frame. About 370 dot products per vertex, and temporary memory from operator new; of up to
// three vertices far less, without a search.
// Statuses: CAB_STATUS_BAD_OUTPUT (out is null), CAB_STATUS_BAD_VERTICES, CAB_STATUS_OUT_OF_MEMORY.
// Thread: any, at any time; no engine is involved.
CAB_API cab_Status cab_fit_box(cab_ConstFloatSpan vertices, cab_Box* out);

// Writes the poses of joint states: poses[state][link] as CAB_POSE_FORMAT_QUATERNION_TRANSLATION, in the body's frame.
// states: desc.variable_count numbers per state. The work is in double, states as lanes, and rounded once: a pose is
// off by half a unit of a float's last place, and by some 1e-15 of the lengths of its chain. It has the same bits on
// every instruction set and platform. An angle beyond 2^20 counts as its remainder in the division by 4 pi in double
// (std::fmod). A link that a NaN or an infinity moves has NaN in its pose, so that a frame masks the state.
// Cost: some nanoseconds per link and state; allocates 896 bytes per link.
// Statuses: CAB_STATUS_ISA_NOT_AVAILABLE, CAB_STATUS_NO_LINKS, CAB_STATUS_TOO_MANY_LINKS, CAB_STATUS_BAD_PARENT,
// CAB_STATUS_BAD_JOINT (links is not as long as link_parents, the joint counts do not add up to the joints, an unknown
// kind, a variable out of range, a number that is not finite, or an axis or rotation that is not of length 1 to 1e-6),
// CAB_STATUS_BAD_OUTPUT (poses or states has no data, or poses is not 7 floats per link and state),
// CAB_STATUS_OUT_OF_MEMORY. Thread: any, at any time; no engine is involved.
CAB_API cab_Status cab_compute_link_poses(const cab_KinematicsDesc* desc, cab_ConstDoubleSpan states, cab_Isa isa,
                                          cab_FloatSpan poses);

// Adds a coarser level of an articulation (cab_LodDesc), and writes its id to *out, which must not be null. All of desc
// is checked and copied. If a leaf that the caller made is refused, *bad_leaf (may be null) receives its index. A level
// has the links of its articulation, so its batches take the same poses; a level of boxes on links reads only those of
// links that carry a box, and of joints between them, and an instance is masked for what is wrong with these alone. It
// works with all policies; a level of nodes without exact tests, contacts and cab_find_touching_moments.
// Cost: as cab_add_articulation, and with CAB_LOD_KIND_REACH up to 0.1 s for 1024 links; some seconds if most of them
// have one parent and hundreds of leaves are asked for.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_BAD_OUTPUT (out is null), CAB_STATUS_UNKNOWN_ARTICULATION, CAB_STATUS_BAD_LOD
// (also for a link with leaves in no leaf of the level or in two, for two leaves on one link, and for a leaf whose
// links are not in its link's tree), CAB_STATUS_BAD_REST_POSE, CAB_STATUS_TOO_FEW_LEAVES, CAB_STATUS_TOO_MANY_LEAVES,
// CAB_STATUS_BAD_LEAF_LINK, CAB_STATUS_BAD_LEAF_BOX (also for a reach beyond 1e18), CAB_STATUS_BAD_LEAF_AXES,
// CAB_STATUS_LOD_LEAF_TOO_SMALL, CAB_STATUS_SKIN_NOT_TAKEN (CAB_LOD_KIND_REACH), CAB_STATUS_OUT_OF_MEMORY. Thread: any,
// alone on its engine.
CAB_API cab_Status cab_add_lod(cab_Engine* engine, const cab_LodDesc* desc, cab_ArticulationId* out,
                               uint32_t* bad_leaf);

// Writes for each link of a level the index of the leaf that stands for it, or CAB_NO_LEAF if the link has no leaves in
// the level's articulation. `leaf_of_link` must have room for all links. Hits of a level name its leaves:
// cab_Hit.leaf_a is the leaf, and cab_Hit.link_a the link that carries its box, or for a node the lowest link below it.
// Cost: a copy; allocates nothing.
// Statuses: CAB_STATUS_UNKNOWN_ARTICULATION, CAB_STATUS_BAD_LOD (the articulation is no level), CAB_STATUS_BAD_OUTPUT.
// Thread: any, but not while an articulation or batch is added or removed.
CAB_API cab_Status cab_lod_leaves(const cab_Engine* engine, cab_ArticulationId level, cab_Uint16Span leaf_of_link);

// Adds a batch, and writes its id to *out, which must not be null. The call allocates memory for the instances. If the
// total exceeds both the largest so far and what is reserved, per-worker memory is reallocated. cab_run_frame and
// cab_compute_boxes allocate nothing for it.
// Cost: about 305 bytes per character and nothing per instance of a sequence. Each worker takes 0.4 to 35 MB, which
// depends on the largest articulation (docs/layout.md). All memory is zeroed. The workers' old memory is freed after
// the new memory is made.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_BAD_OUTPUT (out is null), CAB_STATUS_UNKNOWN_ARTICULATION,
// CAB_STATUS_BAD_BATCH_KIND, CAB_STATUS_NO_INSTANCES, CAB_STATUS_TOO_MANY_INSTANCES, CAB_STATUS_OUT_OF_MEMORY.
// Thread: any, alone on its engine.
CAB_API cab_Status cab_add_batch(cab_Engine* engine, const cab_BatchDesc* desc, cab_BatchId* out);

// Adds a batch of static bodies, such as the boxes and triangles of a level, and writes its id to *out, which must not
// be null. All of desc is checked and copied. If desc is refused, *bad_element (may be null) receives the number of the
// instance at fault. In frames the bodies are characters that rest: they cost little as long as nothing else of the
// frame changes that cab_BatchInput.moved names. A body whose layers or mask change counts as moved in that frame. With
// CAB_REFIT_AABB_VERTICES the bounds are those of their boxes.
// Cost: some microseconds per triangle, and about 800 bytes per body besides those of a character.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_BAD_OUTPUT (out is null), CAB_STATUS_NO_INSTANCES,
// CAB_STATUS_TOO_MANY_INSTANCES, CAB_STATUS_BAD_STATIC_BODY (also for bodies without data), CAB_STATUS_BAD_TRIANGLES,
// CAB_STATUS_BAD_LEAF_BOX, CAB_STATUS_BAD_LEAF_AXES, CAB_STATUS_BAD_SHAPE (also for a triangle without an area),
// CAB_STATUS_SHAPE_OUTSIDE_LEAF_BOX, CAB_STATUS_OUT_OF_MEMORY. Thread: any, alone on its engine.
CAB_API cab_Status cab_add_static_batch(cab_Engine* engine, const cab_StaticDesc* desc, cab_BatchId* out,
                                        uint32_t* bad_element);

// Makes room for as many batches and characters as `desc` says, of any articulations that the engine has. cab_add_batch
// then allocates only what its own instances take, about 60 bytes per character, as long as there are no more.
// Sequences still may need more memory of the workers. What the engine has is never made smaller.
// Cost: as that of cab_add_batch for the largest batch.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_TOO_MANY_INSTANCES, CAB_STATUS_OUT_OF_MEMORY.
// Thread: any, alone on its engine.
CAB_API cab_Status cab_reserve(cab_Engine* engine, const cab_ReserveDesc* desc);

// Removes a batch and gives back what its instances took. Workers keep their memory. The id becomes invalid, and the
// next cab_add_batch takes the slot.
// Cost: frees a few blocks.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_UNKNOWN_BATCH.
// Thread: any, alone on its engine.
CAB_API cab_Status cab_remove_batch(cab_Engine* engine, cab_BatchId id);

// Removes an articulation that no batch uses, and gives back its memory. The id becomes invalid.
// Cost: frees a few blocks; looks at all batches.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_UNKNOWN_ARTICULATION, CAB_STATUS_ARTICULATION_IN_USE.
// Thread: any, alone on its engine.
CAB_API cab_Status cab_remove_articulation(cab_Engine* engine, cab_ArticulationId id);

// Runs one frame: poses every batch with input, finds the instances whose bounds overlap, tests their boxes, applies
// the exact test if there is one, and writes the hits. cab_FrameJob says what is read and written. Without
// cab_BatchInput.moved no answer depends on earlier frames, so frames may come in any order. Inner boxes are made only
// for strategies that descend them.
// Cost: time grows with the number of instances, and with the number of pairs whose bounds overlap; docs/performance.md
// has figures. The engine allocates nothing. With TBB its tasks may allocate, and with CAB_EXACT_FCL FCL does, both by
// their own means.
// Statuses: CAB_STATUS_BUSY, the input statuses, CAB_STATUS_MOVED_AT_REST, CAB_STATUS_BAD_PAIR_RULE,
// CAB_STATUS_PAIR_RULE_GIVEN_TWICE, CAB_STATUS_BAD_POLICY, CAB_STATUS_EXACT_NOT_BUILT, CAB_STATUS_BAD_REPORT,
// CAB_STATUS_BAD_MARGIN, CAB_STATUS_BAD_MIN_DEPTH, CAB_STATUS_BAD_HIT_BUFFER, CAB_STATUS_CONTACTS_NEED_EXACT,
// CAB_STATUS_LOD_WITHOUT_SHAPES, CAB_STATUS_SKIN_NOT_TAKEN (with an exact test), CAB_STATUS_HITS_OVERFLOW,
// CAB_STATUS_OUT_OF_MEMORY (TBB had no memory for its tasks, or the hits needed more than there is). Thread: any, alone
// on its engine. It returns when all tasks have ended.
CAB_API cab_Status cab_run_frame(cab_Engine* engine, cab_FrameJob* job);

// Begins a frame whose tasks the caller runs, for engines with a task graph of their own: no thread waits for another
// between the steps of a frame. `job`, and all that it names, must stay as it is until cab_end_frame. Every other call
// on the engine answers CAB_STATUS_BUSY until then, reads too.
//
//   cab_begin_frame(engine, job);
//   while (cab_next_tasks(engine, &count) == CAB_STATUS_OK && count > 0)
//     cab_run_task(engine, t, worker);    // for every t < count, in any order, on any threads
//   status = cab_end_frame(engine);       // what cab_run_frame answers
//
// Hits and counts are those of cab_run_frame. Small frames have as many steps as large ones.
// Cost: that of the checks of cab_run_frame.
// Statuses: those of cab_run_frame without CAB_STATUS_HITS_OVERFLOW and CAB_STATUS_OUT_OF_MEMORY.
// Thread: any, alone on its engine.
CAB_API cab_Status cab_begin_frame(cab_Engine* engine, cab_FrameJob* job);

// Advances to the frame's next step once every task of the last one has ended, and writes its number of tasks to
// *count: 0 when the frame has no more. There are about seven steps with tasks; one of over 65 536 comes in several
// chunks.
// Cost: the work between two steps, such as laying out strips.
// Statuses: CAB_STATUS_NO_FRAME, CAB_STATUS_BAD_OUTPUT (count is null), CAB_STATUS_TASKS_LEFT.
// Thread: any, one at a time, after cab_run_task has returned for all tasks.
CAB_API cab_Status cab_next_tasks(cab_Engine* engine, uint32_t* count);

// Runs one task of the step, each number below the count once. worker: below cab_engine_thread_count; calls that run at
// the same time must have different workers. A call that breaks this runs nothing and answers CAB_STATUS_BAD_TASK. No
// task waits for another.
// Cost: some 10 to 100 microseconds.
// Statuses: CAB_STATUS_NO_FRAME, CAB_STATUS_BAD_TASK.
// Thread: any, at the same time as other tasks.
CAB_API cab_Status cab_run_task(cab_Engine* engine, uint32_t task, uint32_t worker);

// Ends the frame: fills in `job` and releases the engine. If tasks are left, the frame is given up: `hits`, `contacts`,
// flags and in_contact are unspecified, and the engine is ready for another frame.
// Cost: little.
// Statuses: CAB_STATUS_NO_FRAME, CAB_STATUS_TASKS_LEFT, CAB_STATUS_HITS_OVERFLOW, CAB_STATUS_OUT_OF_MEMORY (the hits
// needed more memory than there is). Thread: any, after all tasks have returned.
CAB_API cab_Status cab_end_frame(cab_Engine* engine);

// Finds the instances that cab_run_frame would have to test against each other, from cab_BatchInput.bounds alone: no
// pose is read. A caller then samples only instances that are in a pair, lists them in cab_BatchInput.instances, and
// has the hits of a frame of all. Uses the job's inputs, its rules between characters, layers and margin, and sets
// their in_contact, if given, to 1 for instances that are in a pair. An instance that is paired within itself is in no
// pair by that. Writes the pairs in order, and their number, to `out`. After CAB_STATUS_PAIRS_OVERFLOW its pairs are
// unspecified, and pairs_needed is right.
// Cost: strips and their search, as in a frame; allocates nothing.
// Statuses: those of cab_run_frame, without CAB_STATUS_BAD_POSES, CAB_STATUS_MOVED_AT_REST and
// CAB_STATUS_HITS_OVERFLOW; CAB_STATUS_BAD_BOUNDS (also without bounds), CAB_STATUS_BAD_OUTPUT (pairs has a size and no
// data), CAB_STATUS_PAIRS_OVERFLOW. Thread: any, alone on its engine.
CAB_API cab_Status cab_find_candidates(cab_Engine* engine, const cab_FrameJob* job, cab_CandidateList* out);

// Answers many queries: which links rays meet, shapes overlap, points are near, regions contain. The job says what is
// asked, and receives the hits, sorted by query, distance, batch, instance and link. Every link is found that a query
// meets in exact arithmetic, by its leaf boxes as given or by its shapes; docs/queries.md says how far off a distance
// may be. No answer depends on the other queries of the call. The call changes nothing that frames keep: characters go
// on resting. A query may have a time of its own (cab_Query.time): then it asks histories. At a moment that a history
// has, the answer is that for the poses that it keeps. Between two moments quaternions go over along a straight line
// between those of length 1, the shorter way round, and translations, origins and scales along straight lines, rounded
// to float, origins to double; layers are those of the earlier one. An instance that one of the two lacks is absent.
// Cost: posing every instance once for its bounds and an index of them, some 250 ns per instance, or with reuse_bounds
// only the index, some 150 ns, once a frame; then some 0.1 to 10 microseconds per query. Allocates nothing;
// `cab_reserve` makes room.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_NO_QUERY_MEMORY, the input statuses, CAB_STATUS_BAD_BATCH_KIND (a sequence),
// CAB_STATUS_BAD_QUERY, CAB_STATUS_EXACT_NOT_BUILT (exact is CAB_EXACT_FCL), CAB_STATUS_LOD_WITHOUT_SHAPES,
// CAB_STATUS_SKIN_NOT_TAKEN (with CAB_EXACT_CONVEX; with CAB_EXACT_SURFACE a query that is neither a ray nor a region;
// of the past of a skin all but rays with CAB_EXACT_SURFACE), CAB_STATUS_UNKNOWN_HISTORY,
// CAB_STATUS_HISTORY_GIVEN_TWICE, CAB_STATUS_BAD_HIT_BUFFER, CAB_STATUS_BAD_OUTPUT (found or counts is neither empty
// nor as long as queries, or surface_points neither empty nor as long as hits), CAB_STATUS_HITS_OVERFLOW,
// CAB_STATUS_OUT_OF_MEMORY (TBB had no memory for its tasks); and CAB_STATUS_UNKNOWN_BATCH for a history whose batch
// was removed, and for an ignored_batch that is not one of this engine. Thread: any, beside other reads.
CAB_API cab_Status cab_run_queries(cab_Engine* engine, cab_QueryJob* job);

// Adds a history: room for the poses that a batch of characters has at its last desc.ticks moments. Writes its id to
// *out, which must not be null. This call makes all the room; cab_record_tick and cab_run_queries allocate nothing for
// it. The batch must stay: the calls below answer CAB_STATUS_UNKNOWN_BATCH once it is removed, but for
// cab_remove_history. Cost: 28 bytes per link, character and moment, and about 140 bytes per character and moment; 200
// bytes more per character. Each worker takes 0.1 to 1.5 MB for the history with the largest articulation.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_BAD_OUTPUT (out is null), CAB_STATUS_UNKNOWN_BATCH, CAB_STATUS_BAD_BATCH_KIND
// (a sequence, static bodies, a level of nodes), CAB_STATUS_BAD_TICKS, CAB_STATUS_TOO_MANY_INSTANCES (4096 histories),
// CAB_STATUS_OUT_OF_MEMORY. Thread: any, alone on its engine.
CAB_API cab_Status cab_add_history(cab_Engine* engine, const cab_HistoryDesc* desc, cab_HistoryId* out);

// Removes a history, and gives back its memory. The id becomes invalid.
// Cost: frees a few blocks.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_UNKNOWN_HISTORY.
// Thread: any, alone on its engine.
CAB_API cab_Status cab_remove_history(cab_Engine* engine, cab_HistoryId id);

// Copies the poses of a batch at a moment, in seconds or whatever the caller counts in, in place of the earliest moment
// of the history once that is full. Of `input` the poses, origins, orientations, scales and layers are kept, and which
// instances are given. Those that are masked count as not given. Quaternions keep their bits; matrices become
// quaternions, by rounding. No link may be mirrored, and no matrix hold a scale. On failure the history is unchanged.
// Cost: some 0.3 to 1 microseconds per instance of twenty links, on all threads; allocates nothing.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_UNKNOWN_HISTORY, the input statuses but CAB_STATUS_STATIC_INPUT
// (CAB_STATUS_UNKNOWN_BATCH also for an input of another batch), CAB_STATUS_BAD_TIME (not finite, or not above that of
// the last moment), CAB_STATUS_BAD_HISTORY_POSES, CAB_STATUS_OUT_OF_MEMORY (TBB had no memory for its tasks).
// Thread: any, alone on its engine.
CAB_API cab_Status cab_record_tick(cab_Engine* engine, cab_HistoryId id, const cab_BatchInput* input, double time);

// Writes which moments a history has to *out, which must not be null.
// Cost: constant time; allocates nothing.
// Statuses: CAB_STATUS_UNKNOWN_HISTORY, CAB_STATUS_BAD_OUTPUT (out is null).
// Thread: any, while no other call changes this engine.
CAB_API cab_Status cab_history_span(const cab_Engine* engine, cab_HistoryId id, cab_HistorySpan* out);

// Writes a margin for each given instance of `input`, so that a frame with cab_BatchInput.margins finds all links that
// may have touched since `last`, the same batch in an earlier frame: how far any point of its leaf boxes can have been
// from where it is now. That holds if every link moves along a straight line, or on an arc of at most half a turn, and
// turns about one axis by at most half a turn; shapes in between are not compared, so the frame reports pairs that have
// passed each other at a distance too. Instances that `last` does not have, or that are masked in one of the two, get
// 0. `margins` must have room for all instances. Reads no layers and no margins, and writes no flags.
// Cost: poses every instance twice, on all threads; allocates nothing.
// Statuses: CAB_STATUS_BUSY, the input statuses, CAB_STATUS_BAD_BATCH_KIND (the two are not one batch of characters),
// CAB_STATUS_SKIN_NOT_TAKEN, CAB_STATUS_BAD_OUTPUT (margins is too small), CAB_STATUS_OUT_OF_MEMORY (TBB had no memory
// for its tasks). Thread: any, beside other reads.
CAB_API cab_Status cab_sweep_margins(cab_Engine* engine, const cab_BatchInput* last, const cab_BatchInput* input,
                                     cab_FloatSpan margins);

// Writes for each pair of links the first moment between two frames, 0 to 1, at which their shapes touch, by
// CAB_EXACT_CONVEX, or CAB_NEVER_TOUCH: which of the hits that a frame with cab_sweep_margins reports are real. Both
// answers are proven, not sampled: before the moment, or never, no point of one is in the other. At the moment they are
// nearer than `resolution` and what rounding poses to float moves them, so a pair that passes closer than that without
// touching may have a moment too.
// `last` and `inputs` hold the poses of all batches that are named, in the earlier frame and in this one. In between,
// the origins of instances and of links move along straight lines, links turn about one axis, the shorter way round,
// and scales go over evenly. Rotations go along the straight line between two quaternions: faster half way than at the
// ends, which is up to 0.03 degrees off an even turn of 30 degrees, 0.9 of 90 and 8 of 180. A link that is not valid in
// `last`, that is mirrored in one frame alone, or whose instance `last` does not have, is where it is now at all
// moments; one that is not valid now never touches. Of each Hit only batches, instances and links are read. resolution:
// a length in the caller's unit, above 0, at most 1e18. Moments are no finer than 2^-20.
// Cost: sixteen exact tests per pair of parts in the open. Where links slide along each other all the way, as many as
// they move resolutions, and at most 2^20. On all threads; some memory from operator new while it runs. Bits do not
// depend on instruction set or threads.
// Statuses: CAB_STATUS_BUSY, the input statuses, CAB_STATUS_BAD_RESOLUTION, CAB_STATUS_BAD_PAIRS (a pair that
// cab_compute_contacts refuses, or a batch that `last` lacks), CAB_STATUS_SKIN_NOT_TAKEN, CAB_STATUS_BAD_OUTPUT
// (moments is shorter than pairs), CAB_STATUS_OUT_OF_MEMORY. Thread: any, beside other reads.
CAB_API cab_Status cab_find_touching_moments(cab_Engine* engine, cab_ConstBatchInputSpan last,
                                             cab_ConstBatchInputSpan inputs, float resolution, cab_ConstHitSpan pairs,
                                             cab_FloatSpan moments);

// Writes every box of every given instance of one batch, relative to the instance's origin in the world's axes. Node n
// of instance i goes to boxes[i * node_count + n], leaves first, the root last. `boxes` must have room for all of them.
// They have the bits that cab_run_frame tests without a margin. With a refit of axis-aligned boxes, each Box lies along
// the world's axes and contains the stored bounds. The boxes of masked instances have half extents 0, and input.flags
// says which instances are masked. Layers, strategy, exact test and in_contact have no effect here, but must be valid.
// Cost: poses and refits all instances on the calling thread; writes 60 bytes per node. Allocates nothing.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_BAD_POLICY, CAB_STATUS_EXACT_NOT_BUILT, the input statuses,
// CAB_STATUS_BAD_OUTPUT (boxes is too small). Thread: any, beside other reads.
CAB_API cab_Status cab_compute_boxes(cab_Engine* engine, const cab_BatchInput* input, const cab_Policies* policies,
                                     cab_BoxSpan boxes);

// Writes contacts[i] for pairs[i], two links that the caller names: how deep they touch, or how far they are apart at
// any distance (beyond float's range the largest float), as CAB_EXACT_CONVEX measures it. Of each Hit only batches,
// instances and links are read; the leaves that the contact is of are written to the contact. The two links must
// differ, and may be of one instance. inputs holds the poses of all batches that are named; layers, flags and
// in_contact have no effect. A link whose pose is not finite or not rigid has depth minus infinity and all else 0.
// Cost: one exact contact per pair of leaves of the two links, on all threads; allocates nothing. Bits do not depend on
// instruction set, threads or other pairs.
// Statuses: CAB_STATUS_BUSY, the input statuses, CAB_STATUS_SKIN_NOT_TAKEN, CAB_STATUS_BAD_PAIRS (also for links of a
// level of nodes: they have boxes alone), CAB_STATUS_BAD_OUTPUT (contacts is shorter than pairs),
// CAB_STATUS_OUT_OF_MEMORY (TBB had no memory for its tasks). Thread: any, beside other reads.
CAB_API cab_Status cab_compute_contacts(cab_Engine* engine, cab_ConstBatchInputSpan inputs, cab_ConstHitSpan pairs,
                                        cab_ContactSpan contacts);

// Writes the triangles of skins (cab_Leaf.triangles) that touch, of each two links of `pairs`, such as the hits of a
// frame with CAB_EXACT_SURFACE. Of each Hit only batches, instances and links are read. The two links must differ, and
// may be of one instance, whose triangles with a vertex in common do not count. Leaves without triangles have none, and
// those that a link moves whose pose is not finite or not rigid. `out` is sorted by its members in their order; *found,
// which must not be null, receives how many there are. inputs holds the poses of all batches that are named; layers,
// flags and in_contact have no effect.
// Cost: skins leaves that several links move, and tests triangles near each other, on all threads; allocates nothing.
// Bits do not depend on instruction set, threads or other pairs.
// Statuses: CAB_STATUS_BUSY, the input statuses, CAB_STATUS_BAD_PAIRS, CAB_STATUS_BAD_OUTPUT, CAB_STATUS_HITS_OVERFLOW
// (`out` is too small: *found is the size that a second call needs, and the contents of `out` are unspecified),
// CAB_STATUS_OUT_OF_MEMORY (TBB had no memory for its tasks). Thread: any, beside other reads.
CAB_API cab_Status cab_find_touching_triangles(cab_Engine* engine, cab_ConstBatchInputSpan inputs,
                                               cab_ConstHitSpan pairs, cab_TouchingTrianglesSpan out, size_t* found);

// Writes to *out, which must not be null, why one instance of a batch is masked: which link, which number, and how far
// off. With CAB_MASK_CAUSE_NONE the instance takes part. A margin, which may take a box that is at the limit out of
// range, is not considered.
// Cost: up to the price of posing the instance; allocates nothing.
// Statuses: CAB_STATUS_BUSY, the input statuses, CAB_STATUS_BAD_INSTANCE, CAB_STATUS_BAD_OUTPUT (out is null).
// Thread: any, beside other reads.
CAB_API cab_Status cab_why_masked(cab_Engine* engine, const cab_BatchInput* input, uint32_t instance,
                                  cab_MaskReason* out);

// Writes in words what is wrong with a job: the first thing that cab_run_frame would refuse it for (but for
// CAB_STATUS_MOVED_AT_REST), with member, index and value, and the words of the status. For a job that cab_run_frame
// would take, it says what may not be meant: no inputs, no rules, more hits in its last frame than `hits` has room for,
// inputs that are in no rule or of a level that saves no time, instances that are masked, and why. One remark per line,
// without a newline at the end. Returns the number of characters of the whole text, without the 0 at its end. `text`
// receives as much of it as fits, with a 0 at the end unless its size is 0.
// Cost: poses every instance with input once. Writes no output of the job; allocates nothing. If another call on the
// engine is running, the text says so.
// Thread: any, alone on its engine.
CAB_API size_t cab_explain_job(cab_Engine* engine, const cab_FrameJob* job, cab_CharSpan text);

// Writes in words why an instance is masked, as cab_why_masked has found it, such as "the quaternion of link 3 has the
// length 0, below 0.001". Text and result as in cab_explain_job.
// Cost: little; allocates nothing.
// Thread: any.
CAB_API size_t cab_explain_mask(const cab_MaskReason* reason, cab_CharSpan text);

// Writes the statistics of a frame as one line of text: milliseconds in all and by phase, then counts. Text and result
// as in cab_explain_job.
// Cost: little; allocates nothing.
// Thread: any.
CAB_API size_t cab_stats_line(const cab_FrameStats* stats, cab_CharSpan text);

// Writes lines for a debug draw: the edges of boxes, of the leaves or of one level of the hierarchies, with the boxes
// that stand for links in hits marked; on request the exact shapes of leaves instead, and contacts. `job` says what is
// drawn, and receives the lines. The boxes are those of cab_compute_boxes. Layers, strategy, exact test and in_contact
// have no effect here, but must be valid.
// Cost: poses and refits all instances on the calling thread; operator new: 16 bytes a hit, 48 a line of leaf shapes.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_BAD_POLICY, CAB_STATUS_EXACT_NOT_BUILT, the input statuses
// (CAB_STATUS_BAD_ORIGINS also for an origin of the job), CAB_STATUS_BAD_PAIRS (hits or contacts have a size and no
// data, or contacts are neither none nor one per hit), CAB_STATUS_BAD_OUTPUT (lines has a size and no data),
// CAB_STATUS_LINES_OVERFLOW, CAB_STATUS_OUT_OF_MEMORY (operator new has no memory for hits or shapes). Thread: any,
// beside other reads.
CAB_API cab_Status cab_box_lines(cab_Engine* engine, const cab_BatchInput* input, cab_BoxLinesJob* job);

// Compares two lists of hits, such as those of two frames: which began and which ended. Hits are the same if their
// batches, instances and links are; leaves may differ. Both lists must be in the order of cab_run_frame. Lists that
// changes has no room for are cut off, and the counts are complete.
// Cost: one pass over both lists; allocates nothing.
// Statuses: CAB_STATUS_UNSORTED_HITS, CAB_STATUS_BAD_OUTPUT (a list of `changes` has a size and no data),
// CAB_STATUS_HITS_OVERFLOW (a list of `changes` is too small).
// Thread: any; no engine is involved.
CAB_API cab_Status cab_diff_hits(cab_ConstHitSpan previous, cab_ConstHitSpan current, cab_HitChanges* changes);

// Writes the numbers of a batch's instances to `order`, so that instances which are near each other in the world are
// near each other in the list: along a Z-order curve through the lower bounds that the last frame with input for the
// batch gave them. Masked instances come last, in ascending order. Instances without such a frame, and those of a
// sequence, keep their order. Large crowds that are stored in this order have faster frames (docs/crowd.md).
// Cost: a sort on the calling thread, and 16 bytes per instance from operator new while it runs.
// Statuses: CAB_STATUS_BUSY, CAB_STATUS_UNKNOWN_BATCH, CAB_STATUS_BAD_OUTPUT (order is too small),
// CAB_STATUS_OUT_OF_MEMORY. Thread: any, beside other reads.
CAB_API cab_Status cab_spatial_order(cab_Engine* engine, cab_BatchId batch, cab_Uint32Span order);

// Writes the counts of an articulation to *out, which must not be null.
// Cost: constant time; allocates nothing.
// Statuses: CAB_STATUS_UNKNOWN_ARTICULATION, CAB_STATUS_BAD_OUTPUT (out is null).
// Thread: any, while no call adds to or removes from this engine.
CAB_API cab_Status cab_articulation_info(const cab_Engine* engine, cab_ArticulationId id, cab_ArticulationInfo* out);

// Writes what a batch is to *out, which must not be null. Also tells whether an id names a batch.
// Cost: a look at all articulations; allocates nothing.
// Statuses: CAB_STATUS_UNKNOWN_BATCH, CAB_STATUS_BAD_OUTPUT (out is null).
// Thread: any, while no call adds to or removes from this engine.
CAB_API cab_Status cab_batch_info(const cab_Engine* engine, cab_BatchId id, cab_BatchInfo* out);

// Writes the merge order of an articulation's hierarchy, which is the same for all its instances and frames. It has
// leaf_count - 1 steps, and `steps` must have room for them.
// Cost: a copy; allocates nothing.
// Statuses: CAB_STATUS_UNKNOWN_ARTICULATION, CAB_STATUS_BAD_OUTPUT (steps is too small).
// Thread: any, while no call adds to or removes from this engine.
CAB_API cab_Status cab_merge_steps(const cab_Engine* engine, cab_ArticulationId id, cab_MergeStepSpan steps);

// Writes which links of an articulation are never reported against each other within an instance, and why: each pair
// once, sorted by a, then b. `pairs` must have room for cab_ArticulationInfo.ignored_pair_count entries.
// Cost: a copy; allocates nothing.
// Statuses: CAB_STATUS_UNKNOWN_ARTICULATION, CAB_STATUS_BAD_OUTPUT (pairs is too small).
// Thread: any, while no call adds to or removes from this engine.
CAB_API cab_Status cab_ignored_pairs(const cab_Engine* engine, cab_ArticulationId id, cab_IgnoredPairSpan pairs);

// Writes how many bytes the engine holds for what to *out, which must not be null. The engine object itself, and the
// shapes of CAB_EXACT_FCL, come from operator new and are not counted.
// Cost: a sum over articulations, batches and workers; allocates nothing.
// Statuses: CAB_STATUS_BAD_OUTPUT (out is null).
// Thread: any, while no other call changes this engine.
CAB_API cab_Status cab_engine_memory(const cab_Engine* engine, cab_EngineMemory* out);

// Returns how many workers an engine has: the caller's worker_count, or the threads of the built-in scheduler.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API uint32_t cab_engine_thread_count(const cab_Engine* engine);

// Returns the instruction set that an engine's kernels use, never CAB_ISA_AUTO.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API cab_Isa cab_engine_isa(const cab_Engine* engine);

// Returns whether this CPU, its operating system and this build can run an instruction set: always true for
// CAB_ISA_AUTO and CAB_ISA_SCALAR, always false for a number that is not an Isa.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API bool cab_isa_available(cab_Isa isa);

// Returns the name of an instruction set, such as "avx2". The string lives as long as the program.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API const char* cab_isa_to_string(cab_Isa isa);

// Returns a status in words, without a capital at the start or a period at the end. The string lives as long as the
// program.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API const char* cab_status_to_string(cab_Status status);

// ---------------------------------------------------------------------------------------------- defaults

// The defaults of the members of structs that callers fill in. Constant time; nothing is allocated.
CAB_API cab_Box cab_default_box(void);
CAB_API cab_PoseView cab_default_pose_view(void);
CAB_API cab_StateView cab_default_state_view(void);
CAB_API cab_ConvexPart cab_default_convex_part(void);
CAB_API cab_Leaf cab_default_leaf(void);
CAB_API cab_SkinDesc cab_default_skin_desc(void);
CAB_API cab_ArticulationDesc cab_default_articulation_desc(void);
CAB_API cab_LodLeaf cab_default_lod_leaf(void);
CAB_API cab_LodDesc cab_default_lod_desc(void);
CAB_API cab_BatchDesc cab_default_batch_desc(void);
CAB_API cab_StaticBody cab_default_static_body(void);
CAB_API cab_StaticDesc cab_default_static_desc(void);
CAB_API cab_ReserveDesc cab_default_reserve_desc(void);
CAB_API cab_BatchInput cab_default_batch_input(void);
CAB_API cab_PairRule cab_default_pair_rule(void);
CAB_API cab_CandidateList cab_default_candidate_list(void);
CAB_API cab_HitChanges cab_default_hit_changes(void);
CAB_API cab_FrameJob cab_default_frame_job(void);
CAB_API cab_Allocator cab_default_allocator(void);
CAB_API cab_Scheduler cab_default_scheduler(void);
CAB_API cab_EngineDesc cab_default_engine_desc(void);
CAB_API cab_JointDesc cab_default_joint_desc(void);
CAB_API cab_LinkPlaceDesc cab_default_link_place_desc(void);
CAB_API cab_KinematicsDesc cab_default_kinematics_desc(void);
CAB_API cab_HistoryDesc cab_default_history_desc(void);
CAB_API cab_Query cab_default_query(void);
CAB_API cab_QueryPlane cab_default_query_plane(void);
CAB_API cab_QueryJob cab_default_query_job(void);
CAB_API cab_Policies cab_default_policies(void);
CAB_API cab_BoxLinesJob cab_default_box_lines_job(void);

#ifdef __cplusplus
}
#endif
