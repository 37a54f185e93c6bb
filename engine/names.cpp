// Statuses and instruction sets in words.
#include "kernels/isa_list.h"

#include <cab/cab.h>

namespace cab {

const char* to_string(Isa isa) noexcept {
  const char* const name = kernel::isa_name(isa);
  return name ? name : "no instruction set";
}

const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::kOk: return "ok";
    case Status::kOutOfMemory: return "out of memory";
    case Status::kBusy: return "another call on the same engine is running";
    case Status::kIsaNotAvailable: return "this CPU or build lacks the instruction set asked for";
    case Status::kBadScheduler: return "the scheduler has no workers or no parallel_for";
    case Status::kBadAllocator: return "the allocator lacks allocate or release";
    case Status::kNoLinks: return "the articulation has no links";
    case Status::kTooManyLinks: return "the articulation has more than 1024 links";
    case Status::kNoLeaves: return "the articulation has no leaves";
    case Status::kTooManyLeaves: return "the articulation has more than 1024 leaves";
    case Status::kBadParent: return "a link's parent must be a link before it, and -1 for the first link alone";
    case Status::kBadJoint: return "joints must be one finite point a link, or none at all";
    case Status::kBadLeafLink: return "a leaf names a link that does not exist";
    case Status::kBadLeafBox: return "a leaf box is not finite, has a negative half extent or is larger than 1e18";
    case Status::kBadLeafAxes: return "the axes of a leaf box are not orthonormal and right-handed to 1e-5";
    case Status::kBadShape:
      return "a convex part has sizes that are not positive, a rotation that is none, or no volume";
    case Status::kShapeOutsideLeafBox: return "a convex part sticks out of its leaf's box";
    case Status::kBadVertices: return "vertices must be x y z of at least one point, finite and no larger than 1e18";
    case Status::kBadIgnoredPair: return "an ignored pair names a link that does not exist";
    case Status::kBadRestPose: return "the rest pose is not finite, not rigid, of no known format or badly strided";
    case Status::kUnknownArticulation: return "the engine has no articulation of that id";
    case Status::kUnknownBatch: return "the engine has no batch of that id";
    case Status::kBadBatchKind: return "the batch is of no known kind";
    case Status::kNoInstances: return "a batch needs at least one instance";
    case Status::kTooManyInstances: return "too many instances in a batch, or batches in an engine";
    case Status::kBatchGivenTwice: return "a batch is given poses twice in one call";
    case Status::kBadPoses:
      return "poses are missing, of no known format, or strided too narrowly or by no multiple of 4 bytes";
    case Status::kBadOrigins: return "origins must be none or three finite doubles an instance";
    case Status::kBadOrientations: return "orientations must be none or four floats an instance";
    case Status::kBadFlags: return "flags must be none or one byte an instance";
    case Status::kBadLayers: return "layers and their masks must be none or one word an instance";
    case Status::kBadInContact: return "in_contact must be empty or hold one byte per instance";
    case Status::kBadPairRule:
      return "a pair rule names a batch without poses, or a pairing that its batches cannot have";
    case Status::kPairRuleGivenTwice: return "two batches are paired twice in the same way";
    case Status::kBadPolicy: return "a policy has a value that does not exist";
    case Status::kBadReport: return "the report is of no known kind";
    case Status::kBadMargin: return "the margin must be finite, not negative and at most 1e18";
    case Status::kBadHitBuffer: return "hits has a size and no data, or contacts is neither empty nor as long as hits";
    case Status::kContactsNeedExact: return "contacts need an exact test";
    case Status::kBadOutput: return "an output span is too small";
    case Status::kHitsOverflow: return "more hits than the buffer holds";
  }
  return "no status";
}

}  // namespace cab
