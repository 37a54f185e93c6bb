#include "perf/tools/report/contact_intervals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace cab::perf {
namespace {

// What sorts ascending as depths descend. A depth is no larger than any float.
double shallowness(float depth) {
  return std::isnan(depth) ? std::numeric_limits<double>::infinity() : -static_cast<double>(depth);
}

// What sorts ascending, the worst first.
std::pair<double, std::int64_t> mildness(float depth, std::uint32_t triangles) {
  return {shallowness(depth), -std::int64_t{triangles}};
}

}  // namespace

void IntervalFinder::add_frame(const Moment& moment, std::vector<LinkHit> hits) {
  if (!open_.empty() && open_.front().last.frame + 1 != moment.frame) finish();
  std::sort(hits.begin(), hits.end(), [](const LinkHit& one, const LinkHit& other) {
    return std::make_pair(one.links, mildness(one.depth, one.triangles)) <
           std::make_pair(other.links, mildness(other.depth, other.triangles));
  });
  const auto same = [](const LinkHit& one, const LinkHit& other) { return one.links == other.links; };
  hits.erase(std::unique(hits.begin(), hits.end(), same), hits.end());

  next_.clear();
  auto before = open_.begin();
  for (const LinkHit& hit : hits) {
    for (; before != open_.end() && before->links < hit.links; ++before) found_(*before);
    if (before == open_.end() || before->links != hit.links) {
      next_.push_back({file_, hit.links, moment, moment, moment, hit.depth, hit.triangles, hit.point});
      continue;
    }
    Interval& interval = next_.emplace_back(*before++);
    interval.last = moment;
    if (mildness(hit.depth, hit.triangles) >= mildness(interval.worst_depth, interval.worst_triangles)) continue;
    interval.worst = moment;
    interval.worst_depth = hit.depth;
    interval.worst_triangles = hit.triangles;
    interval.worst_point = hit.point;
  }
  std::for_each(before, open_.end(), found_);
  std::swap(open_, next_);
}

void IntervalFinder::finish() {
  std::for_each(open_.begin(), open_.end(), found_);
  open_.clear();
}

bool is_worse(const Interval& one, const Interval& other) {
  const auto key = [](const Interval& interval) {
    return std::make_tuple(mildness(interval.worst_depth, interval.worst_triangles), -std::int64_t{interval.frames()},
                           interval.file, interval.links, interval.first.frame);
  };
  return key(one) < key(other);
}

bool is_worse(const PairTotals& one, const PairTotals& other) {
  const auto key = [](const PairTotals& pair) {
    return std::make_tuple(mildness(pair.worst_depth, pair.worst_triangles), -std::int64_t{pair.frames}, pair.file,
                           pair.links);
  };
  return key(one) < key(other);
}

void PairCounter::add(const Interval& interval) {
  if (pair_.intervals > 0 && (pair_.file != interval.file || pair_.links != interval.links)) finish();
  if (pair_.intervals == 0) {
    pair_.file = interval.file;
    pair_.links = interval.links;
    worst_ = interval;
  }
  ++pair_.intervals;
  pair_.frames += interval.frames();
  pair_.longest = std::max(pair_.longest, interval.frames());
  if (is_worse(interval, worst_)) worst_ = interval;
}

void PairCounter::finish() {
  if (pair_.intervals == 0) return;
  pair_.worst = worst_.worst;
  pair_.worst_depth = worst_.worst_depth;
  pair_.worst_triangles = worst_.worst_triangles;
  pair_.worst_point = worst_.worst_point;
  found_(std::exchange(pair_, {}));
}

}  // namespace cab::perf
