#include "scenes/crowd/crowd.h"

#include "layout/bit_hash.h"
#include "scenes/crowd/clip_crowd.h"
#include "scenes/crowd/detailed.h"
#include "scenes/crowd/humanoid.h"
#include "scenes/crowd/rigs.h"
#include "scenes/crowd/skins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

namespace cab::scenes {
namespace {

// Seeds that keep the streams of draws apart.
constexpr std::uint64_t kMotionSeed = 1, kPlaceSeed = 2, kOrderSeed = 3;

constexpr double kJitter = .25;             // metres
constexpr double kBattleDensity = 1.5;      // characters per square metre
constexpr double kLineStep = .5;            // metres
constexpr double kFarSide = 1e7;            // metres
constexpr double kSkinStep = 3;             // metres: farther than two humanoids reach
constexpr float kGiant = 100;               // times as large
constexpr float kMixedGiant = 4;            // likewise, in `mixed`
constexpr std::uint32_t kCityWalkers = 10;  // one in how many walks, in `city`
constexpr double kChurnFramesPerSecond = 30;
constexpr std::uint32_t kLifetime = 100;  // frames that a character of `churn` lives
constexpr double kTileGap = 2;            // metres between copies of a recording, farther than anyone reaches

// The links of the bodies in `mixed`, and one in how many is a giant.
constexpr std::array<std::uint32_t, 3> kMixedLinks = {20, 48, 100};
constexpr std::uint32_t kMixedGiants = 20;

// A crowd of humanoids. places holds x y per humanoid: the pelvis is above that point at time 0. The random numbers of
// a humanoid are drawn again whenever it is posed, because they would take as much memory as its poses. One in
// `walkers` moves, and the others are as at time 0.
Crowd humanoid_crowd(std::vector<double> places, std::uint32_t walkers = 1) {
  CrowdGroup group;
  group.figure = make_humanoid();
  group.count = static_cast<std::uint32_t>(places.size() / 2);
  group.pose = [places = std::move(places), walkers](double seconds, const Chosen& chosen, PosedGroup& posed) {
    const std::size_t count = chosen.count();
    posed.moved.resize(walkers > 1 ? count : 0);
    posed.poses.resize(count * kHumanoidPoseFloats);
    posed.origins.resize(count * 3);
    posed.orientations.clear();
    for (std::uint32_t at = 0; at < count; ++at) {
      const std::size_t i = chosen[at];
      const bool walks = i % walkers == 0;
      if (walkers > 1) posed.moved[at] = walks;
      Random random = Random::of(kMotionSeed, i);
      pose_humanoid(draw_humanoid(random), places[2 * i], places[2 * i + 1], walks ? seconds : 0,
                    posed.poses.data() + std::size_t{at} * kHumanoidPoseFloats,
                    posed.origins.data() + std::size_t{at} * 3);
    }
  };
  Crowd crowd;
  crowd.groups.push_back(std::move(group));
  return crowd;
}

// x y of `count` characters at random places in a square.
std::vector<double> square_places(std::uint32_t count, double side) {
  std::vector<double> places(std::size_t{count} * 2);
  Random random(kPlaceSeed);
  for (double& coordinate : places) coordinate = random.uniform(0, side);
  return places;
}

std::vector<double> uniform_places(std::uint32_t count, double characters_per_square_metre) {
  return square_places(count, std::sqrt(count / characters_per_square_metre));
}

// Puts things into a random order (Fisher and Yates).
template <class T>
void shuffle(std::vector<T>& things) {
  Random random(kOrderSeed);
  for (std::size_t left = things.size(); left > 1; --left)
    std::swap(things[left - 1], things[random.index(static_cast<std::uint32_t>(left))]);
}

// x y of `count` characters in random order, each near its own point of a 1 m grid.
std::vector<double> jitter_places(std::uint32_t count) {
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(count)));
  std::vector<std::uint32_t> cells(count);
  for (std::uint32_t i = 0; i < count; ++i) cells[i] = i;
  shuffle(cells);
  std::vector<double> places;
  places.reserve(std::size_t{count} * 2);
  Random random(kPlaceSeed);
  for (const std::uint32_t cell : cells)
    for (const std::uint32_t point : {cell % side, cell / side})
      places.push_back(point + random.uniform(-kJitter, kJitter));
  return places;
}

// x y of `count` characters in random order on a line.
std::vector<double> line_places(std::uint32_t count) {
  std::vector<double> at(count);
  for (std::uint32_t i = 0; i < count; ++i) at[i] = kLineStep * i;
  shuffle(at);
  std::vector<double> places(std::size_t{count} * 2, 0.0);
  for (std::uint32_t i = 0; i < count; ++i) places[2 * i] = at[i];
  return places;
}

// A crowd that plays clips at fixed places. places holds x y per character.
Crowd clips_on(std::vector<double> places, CrowdSources sources) {
  const auto count = static_cast<std::uint32_t>(places.size() / 2);
  const auto stand = [places = std::move(places)](std::uint32_t character, double) {
    return Standing{places[std::size_t{character} * 2], places[std::size_t{character} * 2 + 1],
                    Random::of(kMotionSeed, character).angle()};
  };
  return clip_crowd(std::move(sources.clips), sources.up, count, stand);
}

void check(const RopeOptions& options) {
  if (options.link_count < kLeastRopeLinks || options.link_count > kMaxLinks)
    throw std::invalid_argument("make_crowd: no rope has " + std::to_string(options.link_count) + " links");
  if (!(options.spacing >= kLeastSpacing && options.spacing <= kMostSpacing))
    throw std::invalid_argument("make_crowd: a spacing of " + std::to_string(options.spacing) + " is out of range");
}

// A person in one copy of a recording.
struct Walker {
  const Track* track;
  double moment;  // seconds: the moment of the recording that the copy shows at time 0
  std::uint32_t copy;
};

// Draws random moments of the recording until they have `count` people. The people of one moment are one copy. A moment
// is the time of a random sample, so that somebody is there, and moments with many people are likelier.
std::vector<Walker> draw_walkers(const Trajectories& trajectories, std::uint32_t count) {
  std::vector<double> moments;
  for (const Track& track : trajectories.tracks)
    moments.insert(moments.end(), track.seconds.begin(), track.seconds.end() - 1);
  std::vector<Walker> walkers;
  Random random(kPlaceSeed);
  for (std::uint32_t copy = 0; walkers.size() < count; ++copy) {
    const double moment = moments[random.index(static_cast<std::uint32_t>(moments.size()))];
    for (const Track& track : trajectories.tracks)
      if (walkers.size() < count && track.seconds.front() <= moment && moment < track.seconds.back())
        walkers.push_back({&track, moment, copy});
  }
  return walkers;
}

}  // namespace

std::uint32_t Crowd::count() const {
  std::uint32_t sum = 0;
  for (const CrowdGroup& group : groups) sum += group.count;
  return sum;
}

Crowd make_uniform(std::uint32_t count, CrowdSources sources) {
  return humanoid_crowd(uniform_places(count, 1 / sources.area));
}

Crowd make_city(std::uint32_t count, CrowdSources) { return humanoid_crowd(uniform_places(count, 1), kCityWalkers); }

// As many static bodies as characters.
Crowd make_level(std::uint32_t count, CrowdSources sources) {
  Crowd crowd = humanoid_crowd(uniform_places(count, 1));
  crowd.level = level_of(sources.level, count, std::sqrt(count));
  return crowd;
}

// In every frame one character in kLifetime is replaced by another at another place.
Crowd make_churn(std::uint32_t count, CrowdSources) {
  CrowdGroup group;
  group.figure = make_humanoid();
  group.count = count;
  group.pose = [count, side = std::sqrt(count)](double seconds, const Chosen& chosen, PosedGroup& posed) {
    posed.poses.resize(std::size_t{chosen.count()} * kHumanoidPoseFloats);
    posed.origins.resize(std::size_t{chosen.count()} * 3);
    posed.orientations.clear();
    const auto frame = static_cast<std::uint64_t>(std::llround(seconds * kChurnFramesPerSecond));
    for (std::uint32_t at = 0; at < chosen.count(); ++at) {
      const std::uint32_t i = chosen[at];
      const std::uint64_t life = (frame + i) / kLifetime;
      Random place = Random::of(kPlaceSeed, life * count + i), motion = Random::of(kMotionSeed, life * count + i);
      const double x = place.uniform(0, side), y = place.uniform(0, side);
      pose_humanoid(draw_humanoid(motion), x, y, static_cast<double>((frame + i) % kLifetime) / kChurnFramesPerSecond,
                    posed.poses.data() + std::size_t{at} * kHumanoidPoseFloats,
                    posed.origins.data() + std::size_t{at} * 3);
    }
  };
  Crowd crowd;
  crowd.groups.push_back(std::move(group));
  return crowd;
}

Crowd make_jitter(std::uint32_t count, CrowdSources) { return humanoid_crowd(jitter_places(count)); }

// Copies lie on a grid. A person who comes to the end of the track begins it again.
Crowd make_bottleneck(std::uint32_t count, CrowdSources sources) {
  const auto trajectories = std::make_shared<const Trajectories>(std::move(sources.trajectories));
  double low[2], high[2];
  for (std::size_t k = 0; k < 2; ++k) {
    low[k] = high[k] = trajectories->tracks[0].places[k];
    for (const Track& track : trajectories->tracks)
      for (std::size_t place = k; place < track.places.size(); place += 2) {
        low[k] = std::min(low[k], track.places[place]);
        high[k] = std::max(high[k], track.places[place]);
      }
  }
  const double width = high[0] - low[0] + kTileGap, depth = high[1] - low[1] + kTileGap;
  std::vector<Walker> walkers = draw_walkers(*trajectories, count);
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(walkers.back().copy + 1)));
  shuffle(walkers);
  const auto stand = [trajectories, walkers = std::move(walkers), side, width, depth](std::uint32_t character,
                                                                                      double seconds) {
    const Walker& walker = walkers[character];
    const double begin = walker.track->seconds.front(), length = walker.track->seconds.back() - begin;
    Standing standing = stand_on(*walker.track, begin + std::fmod(walker.moment + seconds - begin, length));
    standing.x += width * (walker.copy % side);
    standing.y += depth * (walker.copy / side);
    return standing;
  };
  return clip_crowd(std::move(sources.clips), sources.up, count, stand);
}

Crowd make_battle(std::uint32_t count, CrowdSources sources) {
  return clips_on(uniform_places(count, kBattleDensity), std::move(sources));
}

Crowd make_spot(std::uint32_t count, CrowdSources) {
  return humanoid_crowd(std::vector<double>(std::size_t{count} * 2, 0.0));
}

Crowd make_line(std::uint32_t count, CrowdSources) { return humanoid_crowd(line_places(count)); }

// A uniform crowd whose last humanoid is larger and a group of its own.
Crowd make_giant(std::uint32_t count, CrowdSources) {
  std::vector<double> places = uniform_places(count, 1);
  const std::vector<double> place(places.end() - 2, places.end());
  places.resize(places.size() - 2);
  Crowd crowd;
  if (!places.empty()) crowd = humanoid_crowd(std::move(places));
  crowd.groups.push_back(enlarged(humanoid_crowd(place).groups[0], kGiant));
  return crowd;
}

Crowd make_rigs(std::uint32_t count, CrowdSources sources) {
  Crowd crowd = humanoid_crowd(uniform_places(count, 1 / sources.area));
  crowd.groups[0] = with_links(std::move(crowd.groups[0]), sources.rig_links);
  return crowd;
}

Crowd make_skins(std::uint32_t count, CrowdSources sources) {
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(count)));
  std::vector<std::uint32_t> cells(count);
  for (std::uint32_t i = 0; i < count; ++i) cells[i] = i;
  shuffle(cells);
  std::vector<double> places;
  for (const std::uint32_t cell : cells)
    for (const std::uint32_t point : {cell % side, cell / side}) places.push_back(kSkinStep * point);
  Crowd crowd = humanoid_crowd(std::move(places));
  crowd.groups[0] = with_skin(std::move(crowd.groups[0]), sources.skin_leaves);
  return crowd;
}

// Every twentieth is a giant, and the others are of kMixedLinks in turns.
Crowd make_mixed(std::uint32_t count, CrowdSources) {
  const std::vector<double> all = uniform_places(count, 1);
  std::array<std::vector<double>, kMixedLinks.size()> places;
  std::vector<double> giants;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::vector<double>& group = i % kMixedGiants == kMixedGiants - 1 ? giants : places[i % places.size()];
    group.insert(group.end(), {all[2 * std::size_t{i}], all[2 * std::size_t{i} + 1]});
  }
  Crowd crowd;
  const auto add = [&crowd](std::vector<double>& at, std::uint32_t links, float size) {
    if (!at.empty()) crowd.groups.push_back(enlarged(with_links(humanoid_crowd(std::move(at)).groups[0], links), size));
  };
  for (std::size_t g = 0; g < places.size(); ++g) add(places[g], kMixedLinks[g], 1);
  add(giants, kMixedLinks[1], kMixedGiant);
  return crowd;
}

Crowd make_detailed(std::uint32_t count, CrowdSources sources) {
  const std::uint32_t boxes_per_link = sources.boxes_per_link;
  std::vector<double> places = uniform_places(count, 1);
  Crowd crowd =
      sources.clips.empty() ? humanoid_crowd(std::move(places)) : clips_on(std::move(places), std::move(sources));
  for (CrowdGroup& group : crowd.groups) group.figure = with_detail(std::move(group.figure), boxes_per_link);
  return crowd;
}

// Bundles lie on a square grid in random order. The strands of a braid follow each other; the last strand may be alone.
Crowd make_ropes(std::uint32_t count, CrowdSources sources) {
  const RopeOptions options = sources.ropes;
  check(options);
  const std::uint32_t strands = options.shape == RopeShape::kBraided ? 2 : 1;
  std::vector<std::uint32_t> points((count + strands - 1) / strands);
  for (std::uint32_t i = 0; i < points.size(); ++i) points[i] = i;
  shuffle(points);
  CrowdGroup group;
  group.figure = make_rope(options.link_count);
  group.count = count;
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(points.size())));
  group.pose = [options, strands, side, points = std::move(points)](double seconds, const Chosen& chosen,
                                                                    PosedGroup& posed) {
    const std::size_t floats = std::size_t{options.link_count} * 7;
    posed.poses.resize(chosen.count() * floats);
    posed.origins.resize(std::size_t{chosen.count()} * 3);
    posed.orientations.clear();
    for (std::uint32_t at = 0; at < chosen.count(); ++at) {
      const std::uint32_t i = chosen[at], bundle = i / strands, point = points[bundle];
      pose_rope(options, {bundle, point % side, point / side, i % strands}, seconds, posed.poses.data() + at * floats,
                posed.origins.data() + std::size_t{at} * 3);
    }
  };
  Crowd crowd;
  crowd.groups.push_back(std::move(group));
  return crowd;
}

Crowd make_far(std::uint32_t count, CrowdSources) { return humanoid_crowd(square_places(count, kFarSide)); }

void pose_crowd(const Crowd& crowd, double seconds, std::vector<PosedGroup>& posed) {
  posed.resize(crowd.groups.size());
  for (std::size_t g = 0; g < posed.size(); ++g) {
    const CrowdGroup& group = crowd.groups[g];
    group.pose(seconds, Chosen::all(group.count), posed[g]);
  }
}

std::uint64_t pose_hash(const std::vector<PosedGroup>& posed) {
  BitHash hash;
  for (const PosedGroup& group : posed) {
    for (const float value : group.poses) hash.add(value);
    for (const double value : group.origins) hash.add(value);
    for (const float value : group.orientations) hash.add(value);
  }
  return hash.value();
}

}  // namespace cab::scenes
