// Bodies for articulations from plain arrays: a description for add_articulation, with the storage that it points to.
// Target cab::rig. The conventions are those of cab/types.h; nothing here is thrown.
#pragma once

#include <cab/types.h>

namespace cab::rig {

// What a call of this library answers. The comments are the words of to_string(Status).
enum class Status : std::int32_t {
  kOk = 0,          // ok
  kOutOfMemory,     // an allocation failed
  kBadJoints,       // there must be 1 to 1024 joints
  kBadParents,      // parents must be -1 for the first joint, and -1 or an earlier joint for every other
  kBadNames,        // names must be empty or hold one string per joint
  kBadPoses,        // poses needs data of a known format, a valid stride, at least one pose, and rigid, finite values
  kBadSize,         // stature must be finite and 0 or more, thickness finite and above 0, sizes above 0 and up to 1e18
  kNothingToCover,  // no two joints are apart, so there is nothing to make bodies of
  kBadOutput,       // bodies is null
};

// Returns a status in words. The string lives as long as the program.
const char* to_string(Status status) noexcept;

// Owns an articulation's description and the arrays that it points to. It can be moved, not copied.
class Bodies {
 public:
  struct Storage;  // private to the library

  // Empty.
  Bodies() noexcept = default;

  // For the calls below. Takes the storage over.
  explicit Bodies(Storage* storage) noexcept : storage_(storage) {}

  // Takes over what `other` holds, which is empty afterwards.
  Bodies(Bodies&& other) noexcept;
  Bodies& operator=(Bodies&& other) noexcept;
  ~Bodies();

  // The description, for add_articulation. It points into this object. Empty before a call has made bodies.
  ArticulationDesc desc() const noexcept;

 private:
  Storage* storage_ = nullptr;
};

// ---------------------------------------------------------------------------------------------- from a skeleton alone

// A skeleton. Everything is borrowed for the call.
struct SkeletonDesc {
  // The index of each joint's parent: -1 for the first joint, and -1 or lower than the joint's own index for every
  // other. There are 1 to kMaxLinks joints.
  Span<const std::int32_t> parents;

  // The name of each joint, as a string that ends with 0. Names tell the body parts: "LeftUpLeg", "upperarm_l". Empty
  // (default): no part is known, so that thickness follows from the lengths of bones alone.
  Span<const char* const> names;

  // Joints to model in one pose or more, as BatchInput::poses holds them. The first is the rest pose: it gives the
  // lengths of bones. Frames of a motion tell which joints move in their parent's frame: what leads to these is no
  // bone.
  PoseView poses;
  std::uint32_t pose_count = 1;
};

// What sizes the bodies have.
struct SkeletonOptions {
  // The person's height in the caller's unit, for thickness and for the sizes of heads, hands and feet that have no
  // bone. 0 (default): by the figure's own legs and spine, or else arms, hand or height.
  float stature = 0;

  // Factor of the thickness of all bodies.
  float thickness = 1;
};

// Makes an articulation from a skeleton: one ellipsoid along each bone and past each end that has no bone, with
// anthropometric thickness, and one leaf box about those of a joint. The rules are in docs/import.md. All joints are
// links, in their order, so the poses of the skeleton are those of the articulation; some links have no leaf. A root
// that is not the first joint hangs below the first. Links that meet at a joint are ignored pairs. The model is
// right-handed; in a left-handed one, feet without toes point backwards. *bodies changes only with kOk.
[[nodiscard]] Status bodies_from_skeleton(const SkeletonDesc& skeleton, const SkeletonOptions& options,
                                          Bodies* bodies) noexcept;

}  // namespace cab::rig
