// A peer library, as `cab peers` sees it: set-ups that find the touching leaves of different characters from poses.
// Each library has its own file <name>.cpp in this folder, which is compiled if its package is found.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "perf/measure/peers/query_world.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

// What leaves are: their boxes, or the one shape that each has.
enum class Leaves : std::uint8_t { kBoxes, kShapes };
inline const char* name_of(Leaves leaves) { return leaves == Leaves::kBoxes ? "boxes" : "shapes"; }

// Two leaves of different characters that touch, a < b, by their numbers in CrowdLeaves.
struct LeafPair {
  std::uint32_t a;
  std::uint32_t b;
  auto operator<=>(const LeafPair&) const = default;
};

inline LeafPair ordered_pair(std::uint32_t a, std::uint32_t b) { return a < b ? LeafPair{a, b} : LeafPair{b, a}; }

// One frame, the measured time: sets every box from the poses, updates the trees that it keeps, and appends the
// touching pairs in any order. It owns its world and is called frame after frame.
using PeerFrame = std::function<void(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& pairs)>;

// The frame of a World that is made from the arguments, by its run(posed, pairs).
template <class World, class... Arguments>
PeerFrame frame_of(Arguments&&... arguments) {
  const auto world = std::make_shared<World>(std::forward<Arguments>(arguments)...);
  return
      [world](const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& pairs) { world->run(posed, pairs); };
}

// One way to use a library. alone: the library finds the pairs by its own bounds and tests. Otherwise our code does
// part of the work (leaf_boxes.h), as an experienced user would write it around the library's broad phase. make builds
// the world of a crowd, outside of the measured time.
struct PeerSetup {
  const char* name;
  bool alone;
  const char* meaning;
  PeerFrame (*make)(const scenes::Crowd& crowd);
  Leaves leaves = Leaves::kBoxes;  // what it tests; of shapes, each leaf of a figure has one part, at its box's centre
};

// The frames of all runs: 1/30 s apart, there and back, so that every frame is one step of motion from the last.
inline constexpr std::uint32_t kFrameOrder[] = {0, 1, 2, 3, 2, 1};
inline constexpr std::uint32_t kFrameCount = 4;

// The number of characters of the verification, so that brute force takes only a moment.
inline constexpr std::uint32_t kVerifiedCharacters = 200;

struct Peer {
  const char* name;
  const char* package;  // Debian's package
  std::string version;  // of the library and its scalar; empty: not in this build
  std::vector<PeerSetup> setups;
  std::vector<QuerySetup> query_setups = {};
};

Peer fcl_peer();
Peer bullet_peer();
Peer embree_peer();
Peer ode_peer();

}  // namespace cab::perf
