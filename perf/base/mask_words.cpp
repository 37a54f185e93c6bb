#include "perf/base/mask_words.h"

#include "perf/base/report.h"

namespace cab::perf {
namespace {

// What is wrong with the number, length or place.
std::string cause_of(const MaskReason& reason) {
  const auto number = [](float v) { return shortest(static_cast<double>(v)); };
  const std::string at = std::to_string(reason.index);
  switch (reason.cause) {
    case MaskCause::kNone: return "nothing";
    case MaskCause::kPoseNumber:
      return "number " + at + " of its pose is " + number(reason.value) + "; it must be at most " +
             number(reason.limit);
    case MaskCause::kOrientationNumber:
      return "number " + at + " of the orientation is " + number(reason.value) + "; it must be at most " +
             number(reason.limit);
    case MaskCause::kQuaternionLength:
      return "its quaternion has the length " + number(reason.value) + "; the limit is " + number(reason.limit);
    case MaskCause::kOrientationLength:
      return "the orientation has the length " + number(reason.value) + "; the limit is " + number(reason.limit);
    case MaskCause::kMatrix:
      return "its matrix is off a rotation by " + number(reason.value) + "; it may be off by " + number(reason.limit);
    case MaskCause::kScale: return "its scale is " + number(reason.value) + "; the limit is " + number(reason.limit);
    case MaskCause::kJoint:
      return "its joint lies at " + number(reason.value) + "; it must be within " + number(reason.limit);
    case MaskCause::kBox:
      return "the box of its leaf " + at + " reaches " + number(reason.value) + "; it must be within " +
             number(reason.limit);
  }
  return "unknown";
}

}  // namespace

std::string words_of(const MaskReason& reason, const std::vector<std::string>& link_names) {
  const std::string name = reason.link < link_names.size() ? " (" + link_names[reason.link] + ")" : "";
  return "link " + std::to_string(reason.link) + name + ": " + cause_of(reason);
}

}  // namespace cab::perf
