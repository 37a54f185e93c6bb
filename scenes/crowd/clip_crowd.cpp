#include "scenes/crowd/clip_crowd.h"

#include "scenes/random.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

namespace cab::scenes {
namespace {

constexpr std::uint64_t kMomentSeed = 4;
constexpr double kLeastWay = .3;  // metres: a clip that moves less from first to last frame has no direction

// Floats per link in a pose.
constexpr std::size_t kPoseFloats = 7;

// The figure's extent along each axis, as the mean over all frames, and the lowest joint of all frames.
struct Extents3 {
  std::array<double, 3> mean = {};
  std::array<double, 3> lowest = {};
};

Extents3 measure_extents(const Clip& clip) {
  const Character& figure = clip.character;
  const std::size_t links = figure.link_parents.size();
  Extents3 extents;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t f = 0; f < clip.frame_count; ++f) {
      double low = 0, high = 0;  // the root joint
      for (std::size_t l = 0; l < links; ++l) {
        const auto place = static_cast<double>(figure.poses[(f * links + l) * kPoseFloats + 4 + axis]);
        low = std::min(low, place);
        high = std::max(high, place);
      }
      extents.mean[axis] += (high - low) / clip.frame_count;
      const double ground = figure.origins[3 * f + axis] + low;
      extents.lowest[axis] = f == 0 ? ground : std::min(extents.lowest[axis], ground);
    }
  }
  return extents;
}

// The rotation that takes axis x, y or z (0, 1 or 2) to z.
Quat turn_up(std::size_t axis) {
  const double half = std::sqrt(.5);
  if (axis == 0) return {0, -half, 0, half};
  return axis == 1 ? Quat{half, 0, 0, half} : Quat{0, 0, 0, 1};
}

// A clip that is prepared to be played upright.
struct Player {
  Clip clip;
  Quat upright;
  std::vector<double> heights;  // [frame] of the root above the ground
  double heading = 0;           // rad from +x, from the first frame to the last; 0 where the clip stays in place

  double seconds() const { return clip.frame_count * clip.frame_seconds; }

  // The frame shown at a time: the nearest earlier one, as in scenes/import/world.cpp.
  std::size_t frame_at(double time) const {
    const double frame = std::floor(std::fmod(time, seconds()) / clip.frame_seconds + 1e-6);
    return static_cast<std::size_t>(frame) % clip.frame_count;
  }
};

Player make_player(Clip clip, char up) {
  Player player;
  const Extents3 extents = measure_extents(clip);
  const auto tallest = std::max_element(extents.mean.begin(), extents.mean.end()) - extents.mean.begin();
  const auto axis = static_cast<std::size_t>(up == 0 ? tallest : up - 'x');
  player.upright = turn_up(axis);
  const std::vector<double>& origins = clip.character.origins;
  for (std::size_t f = 0; f < clip.frame_count; ++f)
    player.heights.push_back(origins[3 * f + axis] - extents.lowest[axis]);
  const std::size_t last = origins.size() - 3;
  const Vec3 way = rotate(player.upright,
                          {origins[last] - origins[0], origins[last + 1] - origins[1], origins[last + 2] - origins[2]});
  if (std::hypot(way[0], way[1]) >= kLeastWay) player.heading = std::atan2(way[1], way[0]);
  player.clip = std::move(clip);
  return player;
}

// Poses one character, the i-th of its group.
void pose_one(const Player& player, const Standing& standing, double time, std::size_t i, PosedGroup& posed) {
  const std::vector<float>& source = player.clip.character.poses;
  const std::size_t floats = player.clip.character.link_parents.size() * kPoseFloats;
  const std::size_t frame = player.frame_at(time);
  std::copy_n(source.begin() + static_cast<std::ptrdiff_t>(frame * floats), floats,
              posed.poses.begin() + static_cast<std::ptrdiff_t>(i * floats));
  const double yaw = standing.heading - player.heading;
  const Quat rotated = multiply({0, 0, std::sin(yaw / 2), std::cos(yaw / 2)}, player.upright);
  for (std::size_t k = 0; k < 4; ++k) posed.orientations[4 * i + k] = static_cast<float>(rotated[k]);
  posed.origins[3 * i] = standing.x;
  posed.origins[3 * i + 1] = standing.y;
  posed.origins[3 * i + 2] = player.heights[frame];
}

}  // namespace

Crowd clip_crowd(std::vector<Clip> clips, char up, std::uint32_t count, const StandAt& stand) {
  Crowd crowd;
  const auto clip_count = static_cast<std::uint32_t>(clips.size());
  for (std::uint32_t c = 0; c < std::min(clip_count, count); ++c) {
    const auto player = std::make_shared<const Player>(make_player(std::move(clips[c]), up));
    CrowdGroup group;
    group.count = (count - c + clip_count - 1) / clip_count;
    group.figure = player->clip.character;
    group.figure.poses.clear();
    group.figure.origins.clear();
    group.figure.is_static = false;
    group.pose = [player, stand, c, clip_count](double seconds, const Chosen& chosen, PosedGroup& posed) {
      posed.poses.resize(chosen.count() * player->clip.character.link_parents.size() * kPoseFloats);
      posed.origins.resize(std::size_t{chosen.count()} * 3);
      posed.orientations.resize(std::size_t{chosen.count()} * 4);
      for (std::uint32_t at = 0; at < chosen.count(); ++at) {
        const std::uint32_t character = c + chosen[at] * clip_count;
        const double moment = Random::of(kMomentSeed, character).uniform(0, player->seconds());
        pose_one(*player, stand(character, seconds), moment + seconds, at, posed);
      }
    };
    crowd.groups.push_back(std::move(group));
  }
  return crowd;
}

}  // namespace cab::scenes
