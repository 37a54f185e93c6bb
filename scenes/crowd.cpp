#include "scenes/crowd.h"

#include "scenes/bit_hash.h"
#include "scenes/humanoid.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace cab::scenes {
namespace {

// What the streams of draws are told apart by.
constexpr std::uint64_t kMotionSeed = 1, kPlaceSeed = 2, kOrderSeed = 3;

constexpr double kJitter = .25;  // metres

// A crowd of humanoids whose pelvises are above x y each at time 0. Each humanoid is drawn again whenever it is posed:
// what was drawn would take as much memory as its poses.
Crowd humanoid_crowd(std::vector<double> places) {
  CrowdGroup group;
  group.figure = make_humanoid();
  group.count = static_cast<std::uint32_t>(places.size() / 2);
  group.pose = [places = std::move(places)](double seconds, PosedGroup& posed) {
    const std::size_t count = places.size() / 2;
    posed.poses.resize(count * kHumanoidPoseFloats);
    posed.origins.resize(count * 3);
    posed.orientations.clear();
    for (std::size_t i = 0; i < count; ++i) {
      Random random = Random::of(kMotionSeed, i);
      pose_humanoid(draw_humanoid(random), places[2 * i], places[2 * i + 1], seconds,
                    posed.poses.data() + i * kHumanoidPoseFloats, posed.origins.data() + i * 3);
    }
  };
  Crowd crowd;
  crowd.groups.push_back(std::move(group));
  return crowd;
}

// x y of `count` characters at random in a square.
std::vector<double> uniform_places(std::uint32_t count, double characters_a_square_metre) {
  const double side = std::sqrt(count / characters_a_square_metre);
  std::vector<double> places(std::size_t{count} * 2);
  Random random(kPlaceSeed);
  for (double& coordinate : places) coordinate = random.uniform(0, side);
  return places;
}

// Puts things in random order (Fisher and Yates).
template <class T>
void shuffle(std::vector<T>& things) {
  Random random(kOrderSeed);
  for (std::size_t left = things.size(); left > 1; --left)
    std::swap(things[left - 1], things[random.index(static_cast<std::uint32_t>(left))]);
}

// x y of `count` characters about the points of a 1 m grid, in random order.
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

}  // namespace

std::uint32_t Crowd::count() const {
  std::uint32_t sum = 0;
  for (const CrowdGroup& group : groups) sum += group.count;
  return sum;
}

Crowd make_crowd(const std::string& name, std::uint32_t count) {
  if (count == 0) throw std::invalid_argument("make_crowd: a crowd needs at least one character");
  if (name == "uniform") return humanoid_crowd(uniform_places(count, 1));
  if (name == "jitter") return humanoid_crowd(jitter_places(count));
  throw std::invalid_argument("make_crowd: no crowd scene is called " + name);
}

void pose_crowd(const Crowd& crowd, double seconds, std::vector<PosedGroup>& posed) {
  posed.resize(crowd.groups.size());
  for (std::size_t g = 0; g < posed.size(); ++g) crowd.groups[g].pose(seconds, posed[g]);
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
