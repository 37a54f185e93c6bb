#include "perf/measure/peers/judge.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "perf/base/report.h"
#include "perf/judge/oracle/exact_pose.h"
#include "perf/judge/oracle/overlap_exact.h"

namespace cab::perf {
namespace {

// A pair counts as a threshold pair when its gap or depth is at most this share of its boxes' half extents' sum and of
// their coordinates. The engine's slack is 2^-17.1 of the former (docs/numerics.md), and a float of a world coordinate
// and the arithmetic on it are some 2^-23 of the latter.
constexpr double kThresholdOfSize = 0x1p-15;
constexpr double kThresholdOfPlace = 0x1p-21;

// How many misses and false positives are told one by one.
constexpr std::size_t kMostExamples = 3;

void add_example(const JudgedCrowd& judge, const LeafPair& pair, const char* what, Differences& found) {
  if (found.examples.size() >= kMostExamples) return;
  const double gap = judge.gap(pair);
  found.examples.push_back("leaves " + std::to_string(pair.a) + " and " + std::to_string(pair.b) + " " + what +
                           (gap > 0 ? ", apart by " : ", overlap by ") + shortest(std::abs(gap)) + " m");
}

}  // namespace

JudgedCrowd::JudgedCrowd(const scenes::Crowd& crowd, const std::vector<scenes::PosedGroup>& posed) : leaves_(crowd) {
  boxes_.reserve(leaves_.leaf_count());
  for (std::size_t g = 0; g < crowd.groups.size(); ++g) add(crowd.groups[g], posed[g]);
}

void JudgedCrowd::add(const scenes::CrowdGroup& group, const scenes::PosedGroup& posed) {
  const scenes::Character& figure = group.figure;
  oracle::Rig rig;
  rig.parents = figure.link_parents;
  for (const scenes::BodyLeaf& leaf : figure.leaves) rig.leaves.push_back({leaf.link, leaf.box, {}});
  oracle::Poses poses;
  poses.link_count = rig.link_count();
  poses.instance_count = group.count;
  poses.data = posed.poses;
  origins_.insert(origins_.end(), posed.origins.begin(), posed.origins.end());
  for (std::uint32_t i = 0; i < group.count; ++i) {
    for (const oracle::ExactBox& box : exact_leaf_boxes(rig, poses, i)) boxes_.push_back(oracle::convert<double>(box));
    for (const scenes::BodyLeaf& leaf : figure.leaves) {
      if (leaf.parts.empty()) continue;
      parts_.push_back({leaf.parts.front().shape, leaf.parts.front().vertices, {}});
      std::copy_n(poses.pose(i, leaf.link), 7, parts_.back().pose);
    }
  }
}

oracle::Vec3<double> JudgedCrowd::place_of(std::uint32_t leaf) const {
  const double* const origin = origin_of(leaf);
  return oracle::Vec3<double>{{origin[0], origin[1], origin[2]}} + center_of(boxes_[leaf]);
}

bool JudgedCrowd::boxes_overlap(const LeafPair& pair) const {
  const oracle::OracleBox<double>&a = boxes_[pair.a], &b = boxes_[pair.b];
  const oracle::Vec3<double> d = between(pair);
  const double reach = half_sum(a) + half_sum(b);
  return dot(d, d) <= reach * reach && separating_axes(a, b, d).none();
}

oracle::ConvexCase JudgedCrowd::case_of(const LeafPair& pair) const {
  oracle::ConvexCase out = {parts_[pair.a], parts_[pair.b], {}};
  for (std::size_t c = 0; c < 3; ++c) out.shift[c] = origin_of(pair.b)[c] - origin_of(pair.a)[c];
  bind_vertices(out);
  return out;
}

double JudgedCrowd::gap(const LeafPair& pair) const {
  if (parts_.empty()) {
    const oracle::AxisGaps gaps = axis_gaps(boxes_[pair.a], boxes_[pair.b], between(pair));
    return *std::max_element(gaps.begin(), gaps.end());
  }
  const oracle::Verdict verdict = judge_case(case_of(pair), oracle::Effort::kMeasure).verdict;
  return static_cast<double>(are_apart(verdict) ? verdict.gap_at_least : verdict.gap_at_most);
}

LeafVerdict JudgedCrowd::verdict(const LeafPair& pair) const {
  const double apart = gap(pair), place = std::max(norm_max(place_of(pair.a)), norm_max(place_of(pair.b)));
  const double threshold =
      kThresholdOfSize * (half_sum(boxes_[pair.a]) + half_sum(boxes_[pair.b])) + kThresholdOfPlace * place;
  return std::abs(apart) <= threshold ? LeafVerdict::kThreshold : apart > 0 ? LeafVerdict::kApart : LeafVerdict::kTouch;
}

// The boxes hold the shapes to rounding, which is far below the threshold.
Pairs JudgedCrowd::touching_pairs() const {
  Pairs pairs;
  const auto count = static_cast<std::uint32_t>(boxes_.size());
  for (std::uint32_t a = 0; a < count; ++a)
    for (std::uint32_t b = leaves_.end_leaf(leaves_.character_of(a)); b < count; ++b) {
      if (!boxes_overlap({a, b})) continue;
      if (parts_.empty() || !are_apart(judge_case(case_of({a, b}), oracle::Effort::kDecide).verdict))
        pairs.push_back({a, b});
    }
  return pairs;
}

void add_differences(const JudgedCrowd& judge, const Pairs& pairs, const Pairs& reference, Differences& found,
                     Differences* of_reference) {
  found.pairs += pairs.size();
  Pairs missing, more;
  std::set_difference(reference.begin(), reference.end(), pairs.begin(), pairs.end(), std::back_inserter(missing));
  std::set_difference(pairs.begin(), pairs.end(), reference.begin(), reference.end(), std::back_inserter(more));
  const auto add_miss = [&judge](const LeafPair& pair, Differences& of) {
    ++of.misses;
    add_example(judge, pair, "are missed", of);
  };
  const auto add_false_positive = [&judge](const LeafPair& pair, const char* what, Differences& of) {
    ++of.false_positives;
    add_example(judge, pair, what, of);
  };
  for (const LeafPair& pair : missing) {
    const LeafVerdict verdict = judge.verdict(pair);
    found.threshold += verdict == LeafVerdict::kThreshold;
    if (verdict == LeafVerdict::kTouch) add_miss(pair, found);
    if (verdict == LeafVerdict::kApart && of_reference != nullptr) add_false_positive(pair, "are found", *of_reference);
  }
  for (const LeafPair& pair : more) {
    if (std::binary_search(reference.begin(), reference.end(), pair)) {
      add_false_positive(pair, "are found twice", found);
      continue;
    }
    const LeafVerdict verdict = judge.verdict(pair);
    found.threshold += verdict == LeafVerdict::kThreshold;
    if (verdict == LeafVerdict::kApart) add_false_positive(pair, "are found", found);
    if (verdict == LeafVerdict::kTouch && of_reference != nullptr) add_miss(pair, *of_reference);
  }
}

}  // namespace cab::perf
