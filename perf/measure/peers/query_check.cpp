#include "perf/measure/peers/query_check.h"

#include <algorithm>
#include <cmath>

namespace cab::perf {
namespace {

// What is at the threshold: as of pairs in judge.cpp, by the size of a box and by its place.
constexpr oracle::Real kThresholdOfSize = 0x1p-15L;
constexpr oracle::Real kThresholdOfPlace = 0x1p-21L;

// How far off a reported distance may be, of the distance and of the place, beyond what the threshold allows.
constexpr double kOffOfPlace = 0x1p-20;

// Answers that name another leaf are at the threshold if their distances differ by more than this, in metres.
constexpr double kOtherLeaf = 1e-3;

// A scene whose boxes have grown by some times the threshold.
oracle::QueryScene grown(oracle::QueryScene scene, oracle::Real times) {
  for (oracle::QueryInstance& instance : scene)
    for (oracle::QueryLeaf& leaf : instance.leaves) {
      const oracle::ExactBox& box = leaf.box.box;
      const oracle::Real by = kThresholdOfSize * oracle::half_sum(box) +
                              kThresholdOfPlace * (oracle::norm_1(instance.origin) + oracle::norm_1(leaf.box.middle));
      for (oracle::Real& half : leaf.box.box.half) half = std::fmax(half + times * by, 0);
      oracle::complete(leaf.box);
    }
  return scene;
}

// The leaves that a query meets in a scene, sorted, and the nearest by `distance_of`.
template <class Visit>
void visit_leaves(const oracle::QueryScene& scene, const CrowdLeaves& leaves, const Query& query, Visit&& visit) {
  for (const oracle::JudgedLink& link : oracle::judge_query(scene, query, {}, Exact::kNone))
    for (const oracle::JudgedLeaf& leaf : link.leaves)
      if (leaf.must)
        visit(leaves.number_of(link.instance->batch.value - 1, link.instance->instance, leaf.leaf->leaf),
              static_cast<double>(leaf.most));
}

bool has(const std::vector<std::uint32_t>& sorted, std::uint32_t leaf) {
  return std::binary_search(sorted.begin(), sorted.end(), leaf);
}

void add_nearest(const JudgedQuery& judged, bool is_ray, float distance, std::uint32_t leaf, QueryDifferences& found) {
  const bool is_hit = distance < kNoHit;
  const double off = kOffOfPlace * (is_hit ? distance : 0) + 2e-5;
  found.hits += is_hit;
  if (std::isnan(distance))
    ++(judged.nearest < kNoHit ? found.misses : found.false_hits);
  else if (is_ray && judged.nearest_most == 0 && distance > off)
    ++found.not_inside;
  else if (judged.nearest_most < kNoHit && distance > judged.nearest_most + off)
    ++found.misses;
  else if (is_hit && !has(judged.grown, leaf))
    ++found.false_hits;
  else if (is_hit != (judged.nearest < kNoHit))
    ++found.threshold;
  else if (const double error = std::fabs(distance - judged.nearest); is_hit) {
    const bool is_inexact = distance < judged.nearest_least - off;
    found.inexact += is_inexact;
    if (!is_inexact && leaf != judged.leaf && error > kOtherLeaf)
      ++found.threshold;
    else
      found.largest_error = std::max(found.largest_error, error);
  }
}

void add_overlaps(const JudgedQuery& judged, Span<const Overlap> overlaps, QueryDifferences& found) {
  found.hits += overlaps.size;
  std::vector<std::uint32_t> leaves;
  for (const Overlap& overlap : overlaps) {
    if (!leaves.empty() && leaves.back() == overlap.leaf) {
      ++found.false_hits;  // twice
      continue;
    }
    leaves.push_back(overlap.leaf);
    if (!has(judged.grown, overlap.leaf))
      ++found.false_hits;
    else if (!has(judged.exact, overlap.leaf))
      ++found.threshold;
  }
  for (const std::uint32_t leaf : judged.exact)
    if (!has(leaves, leaf)) ++(has(judged.shrunk, leaf) ? found.misses : found.threshold);
}

}  // namespace

QueryCheck::QueryCheck(const scenes::Crowd& crowd, const std::vector<scenes::PosedGroup>& posed) : leaves_(crowd) {
  for (std::uint32_t g = 0; g < crowd.groups.size(); ++g) {
    const scenes::CrowdGroup& group = crowd.groups[g];
    oracle::Rig rig;
    rig.parents = group.figure.link_parents;
    for (const scenes::BodyLeaf& leaf : group.figure.leaves) rig.leaves.push_back({leaf.link, leaf.box, {}});
    oracle::Poses poses;
    poses.link_count = rig.link_count();
    poses.instance_count = group.count;
    poses.data = posed[g].poses;
    poses.origins = posed[g].origins;
    poses.orientations = posed[g].orientations;
    for (std::uint32_t i = 0; i < group.count; ++i) exact_.push_back(oracle::query_instance({g + 1}, rig, poses, i));
  }
  grown_ = grown(exact_, 1);
  shrunk_ = grown(exact_, -1);
}

JudgedQuery QueryCheck::judge(Query query, float within) const {
  JudgedQuery out;
  query.want = QueryWant::kAll;
  if (query.kind == QueryKind::kPoint) query.length = within;
  visit_leaves(exact_, leaves_, query, [&](std::uint32_t leaf, double distance) {
    out.exact.push_back(leaf);
    if (distance >= out.nearest) return;
    out.nearest = distance;
    out.leaf = leaf;
  });
  visit_leaves(grown_, leaves_, query, [&](std::uint32_t leaf, double distance) {
    out.grown.push_back(leaf);
    out.nearest_least = std::min(out.nearest_least, distance);
  });
  visit_leaves(shrunk_, leaves_, query, [&](std::uint32_t leaf, double distance) {
    out.shrunk.push_back(leaf);
    out.nearest_most = std::min(out.nearest_most, distance);
  });
  for (std::vector<std::uint32_t>* leaves : {&out.exact, &out.grown, &out.shrunk})
    std::sort(leaves->begin(), leaves->end());
  return out;
}

Span<const Overlap> overlaps_of(const Answers& answers, std::uint32_t index) {
  const auto at = [&](std::uint32_t query) {
    return std::lower_bound(answers.overlaps.begin(), answers.overlaps.end(), Overlap{query, 0});
  };
  const auto first = at(index), end = at(index + 1);
  return {answers.overlaps.data() + (first - answers.overlaps.begin()), static_cast<std::size_t>(end - first)};
}

void add_differences(const JudgedQuery& judged, QueryKind kind, const Answers& answers, std::uint32_t index,
                     QueryDifferences& found) {
  ++found.queries;
  if (kind == QueryKind::kSphere)
    add_overlaps(judged, overlaps_of(answers, index), found);
  else
    add_nearest(judged, kind == QueryKind::kRay, answers.distances[index], answers.leaves[index], found);
}

}  // namespace cab::perf
