// Turns bytes into a BVH text, which goes through import's own check, to links and to a world: all without assimp.
#include "scenes/import/bvh_text.h"
#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/taken_by_engine.h"

namespace {

using namespace cab;
using namespace cab::scenes;

void check_text(const BvhText& text) {
  FUZZ_CHECK(text.frame_count >= 1 && text.frame_seconds > 0);
  FUZZ_CHECK(text.values.size() == text.frame_count * text.channel_count);
  FUZZ_CHECK(text.frame_count * text.joints.size() <= kMaxJointFrames);
  for (const double value : text.values) FUZZ_CHECK(std::fabs(value) <= kMaxImportValue);
  std::size_t channels = 0;
  for (std::size_t j = 0; j < text.joints.size(); ++j) {
    const BvhJoint& joint = text.joints[j];
    FUZZ_CHECK(j == 0 ? joint.parent == -1 : joint.parent >= 0 && static_cast<std::size_t>(joint.parent) < j);
    FUZZ_CHECK(printable(joint.name) == joint.name && !joint.name.empty());
    FUZZ_CHECK(joint.first_value == channels || joint.channels.empty());
    channels += joint.channels.size();
  }
  FUZZ_CHECK(channels == text.channel_count);
}

// The figure without rotations: offsets and position channels alone.
Skeleton unrotated(const BvhText& text) {
  Skeleton out;
  out.frame_seconds = text.frame_seconds;
  out.frame_count = text.frame_count;
  for (const BvhJoint& joint : text.joints) {
    out.joint_names.push_back(joint.name);
    out.joint_parents.push_back(joint.parent);
    out.is_end_site.push_back(joint.is_end_site);
    out.rest_offsets.insert(out.rest_offsets.end(), joint.offset.begin(), joint.offset.end());
  }
  for (std::uint32_t f = 0; f < text.frame_count; ++f) {
    const std::size_t frame = out.positions.size();
    for (const BvhJoint& joint : text.joints) {
      std::array<double, 3> at = joint.offset;
      for (std::size_t c = 0; c < joint.channels.size(); ++c)
        if (joint.channels[c] <= BvhChannel::kPositionZ)
          at[static_cast<std::size_t>(joint.channels[c])] = text.values[f * text.channel_count + joint.first_value + c];
      for (std::size_t k = 0; k < 3; ++k)
        out.positions.push_back(
            at[k] + (joint.parent < 0 ? 0 : out.positions[frame + 3 * static_cast<std::size_t>(joint.parent) + k]));
      out.rotations.insert(out.rotations.end(), {0, 0, 0, 1});
    }
  }
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    const BvhText text = check_bvh_text(bytes, "clip.bvh");
    check_text(text);
    const std::string checked = bytes;
    FUZZ_CHECK(check_bvh_text(bytes, "clip.bvh").values == text.values && bytes == checked);
    Clip clip = make_clip(unrotated(text), "clip", {});
    Clip slower = clip;
    slower.frame_seconds *= 1.5;
    fuzz::taken_by_engine(make_world({std::move(clip), std::move(slower)}));
  } catch (const ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind("clip", 0) == 0 && printable(line) == line);
  }
  return 0;
}
