// Clips on one clock in one world.
#include "scenes/import/import.h"
#include "scenes/import/limits.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace cab::scenes {
namespace {

// The frame of a clip shown at a time: the nearest earlier one. The tolerance lets a frame begin a rounding error
// before its own time.
double frame_at(double seconds, double frame_seconds) { return std::floor(seconds / frame_seconds + 1e-6); }

// The number of frames of the world's clock until a clip ends. Each frame of the clip lasts until the next would begin.
std::uint32_t frames_until_end(const Clip& clip, double frame_seconds) {
  const double limit = std::ceil(clip.frame_count * clip.frame_seconds / frame_seconds) + 1;
  auto count = static_cast<std::uint32_t>(std::min(limit, 4e9));
  while (count > 0 && frame_at((count - 1) * frame_seconds, clip.frame_seconds) >= clip.frame_count) --count;
  return count;
}

// Repeats and drops frames of an array so that it follows the world's clock.
template <class T>
std::vector<T> resampled(const std::vector<T>& values, const Clip& clip, std::uint32_t frame_count,
                         double frame_seconds) {
  const std::size_t stride = values.size() / clip.frame_count;
  std::vector<T> result;
  result.reserve(frame_count * stride);
  for (std::uint32_t f = 0; f < frame_count; ++f) {
    const auto source = static_cast<std::size_t>(frame_at(f * frame_seconds, clip.frame_seconds));
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(source * stride);
    result.insert(result.end(), begin, begin + static_cast<std::ptrdiff_t>(stride));
  }
  return result;
}

// Says how many frames of a clip come after the scene's end, which is that of the clip that ends first.
void note_cut(const Scene& scene, const std::string& first_to_end, Clip& clip) {
  if (clip.character.is_static) return;
  const auto shown =
      1 + static_cast<std::uint64_t>(frame_at((scene.frame_count - 1) * scene.frame_seconds, clip.frame_seconds));
  if (shown >= clip.frame_count) return;
  const std::uint64_t cut = clip.frame_count - shown;
  clip.notes.push_back(std::to_string(cut) + " of " + std::to_string(clip.frame_count) +
                       (cut == 1 ? " frames is" : " frames are") + " not tested: " + first_to_end + " ends first");
  clip.alterations.push_back({AlterationKind::kDropped, kCutFrames, cut, clip.notes.back()});
}

// Adds what import did to the file of a clip.
void add_to(ImportReport& report, const Clip& clip) {
  const std::string& name = clip.character.name;
  report.units.push_back(clip.unit);
  for (Alteration alteration : clip.alterations) {
    if (!alteration.note.empty()) alteration.note = name + ": " + alteration.note;
    report.alterations.push_back(std::move(alteration));
  }
  if (!clip.size_doubt.empty()) report.size_doubts.push_back(name + ": " + clip.size_doubt);
}

// Says which people are long along another axis than the first: y is up in some files, z in others.
void doubt_axes(std::vector<Clip>& clips) {
  const auto is_upright = [](const Clip& clip) { return clip.is_upright; };
  const auto first = std::find_if(clips.begin(), clips.end(), is_upright);
  for (auto clip = first; clip != clips.end(); ++clip) {
    if (!clip->is_upright || clip->up == first->up) continue;
    clip->notes.push_back(std::string("warning: the figure is longest along ") + clip->up + ", and " +
                          first->character.name + " along " + first->up + ": cab turns neither, so one may lie");
  }
}

}  // namespace

Scene make_world(std::vector<Clip> clips, ImportReport* report) {
  if (clips.empty()) throw std::invalid_argument("make_world: at least one clip is needed");
  Scene scene;
  bool is_moving = false;
  for (const Clip& clip : clips) {
    if (clip.character.is_static) continue;
    scene.frame_seconds = is_moving ? std::min(scene.frame_seconds, clip.frame_seconds) : clip.frame_seconds;
    is_moving = true;
  }
  scene.frame_count = is_moving ? 0xffffffffu : 1;
  if (!is_moving) scene.frame_seconds = clips[0].frame_seconds;
  std::string first_to_end;
  for (const Clip& clip : clips) {
    if (clip.character.is_static) continue;
    const std::uint32_t frames = frames_until_end(clip, scene.frame_seconds);
    if (frames >= scene.frame_count) continue;
    scene.frame_count = frames;
    first_to_end = clip.character.name;
  }

  doubt_axes(clips);
  scene.up = clips[0].up;
  for (Clip& clip : clips) {
    note_cut(scene, first_to_end, clip);
    Character& character = clip.character;
    scene.name += (scene.name.empty() ? "" : " + ") + character.name;
    for (const std::string& note : clip.notes) scene.notes.push_back(character.name + ": " + note);
    if (report != nullptr) add_to(*report, clip);
    const bool is_on_clock = clip.frame_seconds == scene.frame_seconds && clip.frame_count == scene.frame_count;
    if (character.poses.size() / clip.frame_count > kMaxPoseFloats / scene.frame_count)
      throw ImportError(character.name + ": too many frames on the clock of the fastest clip");
    if (!character.is_static && !is_on_clock) {
      if (report != nullptr && clip.frame_seconds != scene.frame_seconds)
        report->alterations.push_back({AlterationKind::kResampled, "clips to the clock of the fastest", 1, {}});
      character.poses = resampled(character.poses, clip, scene.frame_count, scene.frame_seconds);
      character.origins = resampled(character.origins, clip, scene.frame_count, scene.frame_seconds);
    }
    scene.characters.push_back(std::move(character));
  }
  return scene;
}

}  // namespace cab::scenes
