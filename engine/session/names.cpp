// Statuses, instruction sets and the version in words.
#include "kernels/isa_list.h"

#include <cab/cab.h>

namespace cab {

Version version() noexcept { return {CAB_VERSION_MAJOR, CAB_VERSION_MINOR, CAB_VERSION_PATCH, CAB_VERSION_STRING}; }

const char* to_string(Isa isa) noexcept {
  const char* const name = kernel::isa_name(isa);
  return name ? name : "unknown instruction set";
}

const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::kOk: return "ok";
    case Status::kOutOfMemory: return "an allocation failed";
    case Status::kBusy: return "another call on the same engine is running, and one of the two must run alone";
    case Status::kIsaNotAvailable: return "isa is an instruction set that this CPU or this build lacks";
    case Status::kBadAbiVersion: return "the program was compiled for another ABI of the C API than this library has";
    case Status::kBadScheduler: return "scheduler lacks parallel_for, or its worker_count is 0 or above 1024";
    case Status::kBadAllocator: return "allocator lacks allocate or release";
    case Status::kBadProfiler: return "profiler lacks begin or end";
    case Status::kNoLinks: return "link_parents is empty, but an articulation needs at least one link";
    case Status::kTooManyLinks: return "link_parents holds more than 1024 links";
    case Status::kNoLeaves: return "leaves is empty, but an articulation needs at least one leaf";
    case Status::kTooManyLeaves: return "leaves holds more than 1024 leaves";
    case Status::kBadParent:
      return "link_parents must be -1 for the first link, and -1 or an earlier link for every other";
    case Status::kBadJoint:
      return "link_joints must be empty or one finite point per link, joints as cab/kinematics.h says";
    case Status::kBadLeafLink: return "link of a leaf is not the index of a link";
    case Status::kBadLeafBox: return "box of a leaf is not finite, has a negative half extent or exceeds 1e18";
    case Status::kBadLeafAxes: return "box of a leaf has axes that are not orthonormal and right-handed to 1e-5";
    case Status::kBadShape:
      return "parts of a leaf need finite positions, unit quaternions, positive sizes and an area";
    case Status::kShapeOutsideLeafBox:
      return "parts of a leaf, and the positions of half spaces, must lie within its box";
    case Status::kBadVertices:
      return "vertices must hold x y z of at least one point, each number finite and at most 1e18";
    case Status::kBadIgnoredPair: return "ignored_pairs names a link that does not exist";
    case Status::kBadRestPose:
      return "rest_pose has an unknown format, an invalid stride, or values that are not a rigid pose";
    case Status::kUnknownArticulation:
      return "the articulation id is not one of this engine, or is of one that was removed";
    case Status::kUnknownBatch: return "the batch id is not one of this engine, or is of one that was removed";
    case Status::kArticulationInUse:
      return "the articulation has batches or levels of nodes, which must be removed first";
    case Status::kBadLod:
      return "a level needs an articulation that is no level, leaves for all links, and a finite play";
    case Status::kTooFewLeaves: return "max_leaves is 0, above 1024, or below the number of trees that have leaves";
    case Status::kLodLeafTooSmall: return "the box of a level's leaf does not hold all that its links can reach";
    case Status::kBadBatchKind: return "kind is not a value of BatchKind";
    case Status::kNoInstances: return "instance_count is 0, but a batch needs at least one instance";
    case Status::kBadStaticBody:
      return "a static body needs a finite origin, a quaternion that is not 0, and a box within 1e18";
    case Status::kBadTriangles:
      return "triangles must be three indices each of vertices, which are finite and at most 1e18";
    case Status::kTooManyInstances:
      return "instance_count is above 2^24, or the engine would exceed 4096 batches or 2^31 characters";
    case Status::kBatchGivenTwice: return "inputs holds the same batch twice";
    case Status::kBadPoses:
      return "poses has no data, an unknown format, or a stride that is too small or not a multiple of 4";
    case Status::kBadStates:
      return "states must be of a sequence, with enough values, and made into the poses of the input";
    case Status::kStaticInput:
      return "a batch of static bodies takes nothing that says where instances are or how they move";
    case Status::kBadOrigins: return "origins must be empty or hold three finite doubles per instance";
    case Status::kBadOrientations: return "orientations must be empty or hold four floats per instance";
    case Status::kBadFlags: return "flags must be empty or hold one byte per instance";
    case Status::kBadLayers: return "layers and layer_masks must each be empty or hold one word per instance";
    case Status::kBadInContact: return "in_contact must be empty or hold one byte per instance";
    case Status::kBadScales:
      return "scales must be empty or hold one float per instance, and be empty if matrices hold scales";
    case Status::kBadCount: return "count is above the batch's instance_count";
    case Status::kBadInstances:
      return "instances must be empty or ascend, below count and instance_count; never of a sequence";
    case Status::kBadBounds:
      return "bounds must be empty or hold six finite floats per instance, none below its lower one";
    case Status::kBadMoved: return "moved must be empty or hold one byte per instance; never of a sequence";
    case Status::kBadMargins:
      return "margins must be empty or hold one float per instance, each 0 to 1e18; never of a sequence";
    case Status::kMovedAtRest:
      return "moved is 0 for an instance whose pose, place, scale or layers changed (checked builds only)";
    case Status::kBadPairRule: return "rules names a batch without input, or a pairing that its batches cannot have";
    case Status::kPairRuleGivenTwice: return "rules pairs the same two batches twice in the same way";
    case Status::kBadPolicy: return "policies holds a value that its enumeration lacks";
    case Status::kExactNotBuilt: return "policies asks for an exact test that this build of the library lacks";
    case Status::kBadReport: return "report is not a value of Report";
    case Status::kBadMargin: return "margin must be finite, not negative and at most 1e18";
    case Status::kBadMinDepth: return "min_depth must be finite, not negative, and 0 if only in_contact is reported";
    case Status::kBadHitBuffer:
      return "hits or links has a size and no data, both are given, or contacts is not as long as hits";
    case Status::kContactsNeedExact: return "contacts, distances and min_depth need an exact test, such as convex";
    case Status::kLodWithoutShapes: return "an exact test needs shapes, but a batch with input is of a level of nodes";
    case Status::kBadInstance: return "instance is not one of the batch's instances in this call";
    case Status::kBadPairs:
      return "pairs names a batch without input, a missing instance, a link without leaves, or a link twice";
    case Status::kBadResolution: return "resolution must be above 0, and at most 1e18";
    case Status::kBadOutput: return "an output is null or too small";
    case Status::kNullArgument: return "a pointer of the C API that must not be null is null";
    case Status::kHitsOverflow: return "hits is too small for all hits";
    case Status::kPairsOverflow: return "pairs is too small for all candidates";
    case Status::kLinesOverflow: return "lines is too small for all edges";
    case Status::kNoFrame: return "no frame has begun";
    case Status::kBadTask: return "task or worker is out of range or in use, or the task has been run before";
    case Status::kTasksLeft: return "not all tasks have been run";
    case Status::kUnsortedHits: return "a list of hits has a size and no data, or is not in the order of run_frame";
    case Status::kBadQuery:
      return "a query has a value of no enumeration, a number that is not finite or out of range, or no direction";
    case Status::kNoQueryMemory: return "reserve has made no memory for queries";
    case Status::kBadTicks: return "ticks must be 1 to 65536";
    case Status::kUnknownHistory: return "the history id is not one of this engine, or is of one that was removed";
    case Status::kHistoryGivenTwice: return "histories holds two histories of the same batch";
    case Status::kBadTime: return "a time must be finite, and later than those that the history has";
    case Status::kBadHistoryPoses: return "a history takes neither mirrored links nor matrices that hold scales";
    case Status::kBadSkin:
      return "skin needs finite vertices, invertible finite matrices, and weights of existing links";
    case Status::kBadLeafTriangles:
      return "triangles of a leaf must be three vertices of the skin each, without parts beside them";
    case Status::kTooManyInfluences:
      return "triangles of a leaf are moved by more than 32 other links; a smaller leaf has fewer";
    case Status::kSkinNotTaken: return "the call, or the exact test, does not take an articulation with a skin yet";
  }
  return "unknown status";
}

}  // namespace cab
