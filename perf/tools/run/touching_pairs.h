// Which pairs of links touch in a run: in how many frames, when first, and how deep. It is the answer of `cab run`.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <vector>

#include "perf/base/engine_session.h"
#include "scenes/scene.h"

namespace cab::perf {

// Two links by their indices in the scene, and the frames in which they touch.
struct TouchingPair {
  std::uint32_t character_a = 0, link_a = 0;
  std::uint32_t character_b = 0, link_b = 0;
  std::uint32_t frames = 0;
  std::uint32_t first_frame = 0;
  std::optional<float> deepest;     // metres; empty: no contact was given
  std::uint32_t deepest_frame = 0;  // the first one that is so deep
};

// Whether the exact test gave the contact of a touch.
bool has_contact(const Touch& touch);

class TouchingPairs {
 public:
  // Adds the touches of a block, which is later than those before.
  void add(const std::vector<Touch>& touches);

  // The deepest first, then those without a depth; of equal ones that of the most frames, then by their indices.
  std::vector<TouchingPair> worst_first() const;

 private:
  std::map<std::array<std::uint32_t, 4>, TouchingPair> pairs_;  // by both characters and links
};

// What the pairs are of: the scene whose frames were run, and what a touch is there.
struct TouchingPairsContext {
  const scenes::Scene& scene;
  FrameRange frames;
  std::uint64_t frames_with_hits = 0;
  Exact exact = Exact::kNone;
  float min_depth = 0;  // metres
};

// Prints a sentence, and a table of the worst pairs with seconds and centimetres: at most 20.
void print_pairs(const TouchingPairsContext& context, const std::vector<TouchingPair>& pairs, std::ostream& out);

// All pairs by names, with frames, seconds and metres.
nlohmann::ordered_json pairs_json(const scenes::Scene& scene, const std::vector<TouchingPair>& pairs);

}  // namespace cab::perf
