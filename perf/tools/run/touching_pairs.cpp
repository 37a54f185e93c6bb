#include "perf/tools/run/touching_pairs.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>

#include "perf/base/report.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// The most pairs that the table prints, so that it fits on a screen.
constexpr std::size_t kPrintedPairs = 20;

double seconds_of(const scenes::Scene& scene, std::uint32_t frame) { return frame * scene.frame_seconds; }

// Characters are named where there are several, and once if both links are of one.
std::string pair_name(const scenes::Scene& scene, const TouchingPair& pair) {
  const scenes::Character& a = scene.characters[pair.character_a];
  const scenes::Character& b = scene.characters[pair.character_b];
  const auto name = [&](const scenes::Character& character, bool is_named, std::uint32_t link) {
    return (is_named ? character.name + " " : std::string()) + character.link_names[link];
  };
  return name(a, scene.characters.size() > 1, pair.link_a) + " - " + name(b, &a != &b, pair.link_b);
}

std::string counted(std::uint64_t count, const char* one, const char* several) {
  return std::to_string(count) + " " + (count == 1 ? one : several);
}

// How links touch, and how deep at least.
std::string kind_of_touch(const TouchingPairsContext& context) {
  std::string words;
  if (context.exact == Exact::kNone) words = " by their boxes alone";
  if (context.exact == Exact::kSurface) words = " by their surfaces";
  if (context.min_depth > 0)
    words += " at least " + fixed(100 * static_cast<double>(context.min_depth), 1) + " cm deep";
  return words;
}

}  // namespace

bool has_contact(const Touch& touch) {
  const float* const normal = touch.contact.normal;
  return normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
}

void TouchingPairs::add(const std::vector<Touch>& touches) {
  for (const Touch& touch : touches) {
    TouchingPair& pair = pairs_[{touch.character_a, touch.link_a, touch.character_b, touch.link_b}];
    if (pair.frames++ == 0) {
      pair.character_a = touch.character_a, pair.link_a = touch.link_a;
      pair.character_b = touch.character_b, pair.link_b = touch.link_b;
      pair.first_frame = touch.frame;
    }
    if (has_contact(touch) && !(pair.deepest >= touch.contact.depth)) {
      pair.deepest = touch.contact.depth;
      pair.deepest_frame = touch.frame;
    }
  }
}

std::vector<TouchingPair> TouchingPairs::worst_first() const {
  std::vector<TouchingPair> pairs;
  for (const auto& [links, pair] : pairs_) pairs.push_back(pair);
  std::stable_sort(pairs.begin(), pairs.end(), [](const TouchingPair& l, const TouchingPair& r) {
    return std::tie(l.deepest, l.frames) > std::tie(r.deepest, r.frames);
  });
  return pairs;
}

void print_pairs(const TouchingPairsContext& context, const std::vector<TouchingPair>& pairs, std::ostream& out) {
  const scenes::Scene& scene = context.scene;
  const std::string frames = counted(context.frames.count(), "frame", "frames") + " (" +
                             fixed(context.frames.count() * scene.frame_seconds, 1) + " s)";
  if (pairs.empty()) {
    out << "no links touch" << kind_of_touch(context) << " in " << frames << '\n';
    return;
  }
  out << counted(pairs.size(), "pair of links touches", "pairs of links touch") << kind_of_touch(context) << " in "
      << context.frames_with_hits << " of " << frames;
  if (pairs.size() > kPrintedPairs) out << "; the worst " << kPrintedPairs << " follow, --json has all";
  out << '\n';
  const bool has_depths = pairs.front().deepest.has_value();
  TextTable table;
  std::vector<std::string> header = {"pair", "frames", "first s"};
  if (has_depths) header.insert(header.end(), {"deepest cm", "at s"});
  table.add_row(std::move(header));
  for (std::size_t p = 0; p < std::min(pairs.size(), kPrintedPairs); ++p) {
    const TouchingPair& pair = pairs[p];
    std::vector<std::string> row = {pair_name(scene, pair), std::to_string(pair.frames),
                                    fixed(seconds_of(scene, pair.first_frame), 2)};
    if (pair.deepest) {
      row.push_back(fixed(100 * static_cast<double>(*pair.deepest), 1));
      row.push_back(fixed(seconds_of(scene, pair.deepest_frame), 2));
    }
    table.add_row(std::move(row));
  }
  table.print(out);
}

Json pairs_json(const scenes::Scene& scene, const std::vector<TouchingPair>& pairs) {
  Json json = Json::array();
  for (const TouchingPair& pair : pairs) {
    const scenes::Character& a = scene.characters[pair.character_a];
    const scenes::Character& b = scene.characters[pair.character_b];
    json.push_back({{"character_a", a.name},
                    {"link_a", a.link_names[pair.link_a]},
                    {"character_b", b.name},
                    {"link_b", b.link_names[pair.link_b]},
                    {"frames", pair.frames},
                    {"first_frame", pair.first_frame},
                    {"first_seconds", seconds_of(scene, pair.first_frame)}});
    if (!pair.deepest) continue;
    json.back()["deepest_metres"] = *pair.deepest;
    json.back()["deepest_frame"] = pair.deepest_frame;
    json.back()["deepest_seconds"] = seconds_of(scene, pair.deepest_frame);
  }
  return json;
}

}  // namespace cab::perf
