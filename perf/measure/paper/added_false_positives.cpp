#include "perf/measure/paper/added_false_positives.h"

#include <array>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "perf/base/engine_session.h"
#include "perf/base/report.h"
#include "perf/measure/paper/judged_character.h"

namespace cab::perf {
namespace {

using oracle::ExactBox;
using oracle::Point;

// The engine's stored leaf boxes in the judge's type.
std::vector<ExactBox> exactly(Span<const Box> boxes, std::size_t leaf_count) {
  std::vector<ExactBox> out(leaf_count);
  for (std::size_t i = 0; i < leaf_count; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      out[i].center[k] = boxes.data[i].center[k];
      out[i].half[k] = boxes.data[i].half[k];
      for (std::size_t c = 0; c < 3; ++c) out[i].axis[k][c] = boxes.data[i].axis[k][c];
    }
  return out;
}

using LinkPairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

// The pairs of a link of a and a link of b that have touching leaf boxes. shift: the origin of b less the origin of a.
LinkPairs touching_links(const JudgedCharacter& a, const std::vector<ExactBox>& boxes_a, const JudgedCharacter& b,
                         const std::vector<ExactBox>& boxes_b, const Point& shift) {
  LinkPairs out;
  for (std::size_t i = 0; i < boxes_a.size(); ++i)
    for (std::size_t j = 0; j < boxes_b.size(); ++j) {
      const Point between = shift + (center_of(boxes_b[j]) - center_of(boxes_a[i]));
      const oracle::Real reach = half_sum(boxes_a[i]) + half_sum(boxes_b[j]);
      if (dot(between, between) <= 1.01L * reach * reach && oracle::exactly_overlap(boxes_a[i], boxes_b[j], between))
        out.emplace(a.rig.leaves[i].link, b.rig.leaves[j].link);
    }
  return out;
}

void count(const LinkPairs& found, const LinkPairs& touching, const LinkPairs& padded, AddedFalsePositives& added) {
  added.found += found.size();
  added.touching += touching.size();
  for (const auto& pair : found)
    if (!touching.count(pair)) ++(padded.count(pair) ? added.by_padding : added.by_slack);
  for (const auto& pair : touching) added.missed += !found.count(pair);
}

}  // namespace

double AddedFalsePositives::percent() const {
  const auto added = static_cast<double>(by_padding + by_slack);
  return touching > 0 ? 100 * added / static_cast<double>(touching) : 0;
}

AddedFalsePositives count_added_false_positives(const scenes::Scene& scene, Isa isa) {
  SessionOptions options;
  options.isa = isa;
  options.frames = {0, scene.frame_count};
  EngineSession session(scene, options);
  Policies policies;
  policies.exact = Exact::kNone;

  // By frame and the two characters.
  std::map<std::array<std::uint32_t, 3>, LinkPairs> found;
  session.run(policies, false, [&](const BlockResult& block) {
    for (const Touch& touch : block.touches)
      found[{touch.frame, touch.character_a, touch.character_b}].emplace(touch.link_a, touch.link_b);
  });

  const auto characters = static_cast<std::uint32_t>(scene.characters.size());
  const std::vector<JudgedCharacter> judged(scene.characters.begin(), scene.characters.end());
  std::vector<scenes::CharacterPair> pairs = scene.pairs;
  for (std::uint32_t a = 0; scene.pairs.empty() && a < characters; ++a)
    for (std::uint32_t b = a + 1; b < characters; ++b)
      if (!judged[a].is_static || !judged[b].is_static) pairs.push_back({a, b});

  AddedFalsePositives added;
  std::vector<std::vector<ExactBox>> padded, described;
  std::uint32_t frame = 0;
  session.visit_boxes(policies, [&](const ArticulationInfo& info, Span<const Box> boxes) {
    described.push_back(judged[padded.size()].boxes(frame));
    padded.push_back(exactly(boxes, info.leaf_count));
    if (padded.size() < characters) return;
    for (const scenes::CharacterPair& pair : pairs) {
      const JudgedCharacter &a = judged[pair.a], &b = judged[pair.b];
      const Point shift = b.origin(frame) - a.origin(frame);
      count(found[{frame, pair.a, pair.b}], touching_links(a, described[pair.a], b, described[pair.b], shift),
            touching_links(a, padded[pair.a], b, padded[pair.b], shift), added);
    }
    padded.clear();
    described.clear();
    ++frame;
  });
  return added;
}

std::string describe(const AddedFalsePositives& added) {
  return "padding and slack add " + std::to_string(added.by_padding) + " and " + std::to_string(added.by_slack) +
         " to the " + std::to_string(added.touching) + " pairs whose leaf boxes touch, " + fixed(added.percent(), 3) +
         " %";
}

std::vector<Gate> false_positive_gates(const AddedFalsePositives& added, bool full_run) {
  std::vector<Gate> gates;
  gates.push_back({"no pair whose leaf boxes touch is missed: " + std::to_string(added.missed) + " of " +
                       std::to_string(added.touching),
                   added.missed == 0});
  if (full_run)
    gates.push_back(
        {describe(added) + ", below " + fixed(kAddedPercentLimit, 1) + " %", added.percent() < kAddedPercentLimit});
  return gates;
}

}  // namespace cab::perf
