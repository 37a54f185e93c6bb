// perf/tools/report/contact_intervals.h: intervals and pairs of random hits, beside those of another algorithm, and the
// rules that docs/report.md states.
#include "perf/tools/report/contact_intervals.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>
#include <vector>

namespace cab::tests {
namespace {

using perf::Interval;
using perf::LinkHit;
using perf::LinkPlaces;
using perf::PairTotals;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
const LinkPlaces kPair = {{0, 0, 1}, {1, 0, 2}}, kOther = {{0, 0, 1}, {1, 0, 3}};

struct Frame {
  std::uint32_t index;
  std::vector<LinkHit> hits;
};

double seconds_of(std::uint32_t frame) { return 0.25 * frame; }

std::vector<Interval> intervals_of(const std::vector<Frame>& frames) {
  std::vector<Interval> intervals;
  perf::IntervalFinder finder(7, [&](const Interval& interval) { intervals.push_back(interval); });
  for (const Frame& frame : frames) finder.add_frame({frame.index, seconds_of(frame.index)}, frame.hits);
  finder.finish();
  return intervals;
}

std::vector<PairTotals> pairs_of(std::vector<Interval> intervals) {
  std::stable_sort(intervals.begin(), intervals.end(),
                   [](const Interval& one, const Interval& other) { return one.links < other.links; });
  std::vector<PairTotals> pairs;
  perf::PairCounter counter([&](const PairTotals& pair) { pairs.push_back(pair); });
  for (const Interval& interval : intervals) counter.add(interval);
  counter.finish();
  return pairs;
}

TEST_CASE("a gap of one frame ends an interval") {
  const auto intervals = intervals_of(
      {{3, {{kPair, 1}}}, {4, {{kPair, 3}}}, {5, {{kPair, 3}}}, {6, {}}, {7, {{kPair, 2}}}, {8, {{kOther, 9}}}});
  REQUIRE(intervals.size() == 3);
  CHECK(intervals[0].file == 7);
  CHECK(intervals[0].links == kPair);
  CHECK(intervals[0].first.frame == 3);
  CHECK(intervals[0].first.seconds == seconds_of(3));
  CHECK(intervals[0].last.frame == 5);
  CHECK(intervals[0].last.seconds == seconds_of(5));
  CHECK(intervals[0].frames() == 3);
  CHECK(intervals[0].worst_depth == 3);
  CHECK(intervals[0].worst.frame == 4);  // the first of the deepest
  CHECK(intervals[0].worst.seconds == seconds_of(4));
  CHECK(intervals[1].first.frame == 7);
  CHECK(intervals[1].frames() == 1);
  CHECK(intervals[2].links == kOther);
}

TEST_CASE("a frame that cannot be read ends every interval") {
  const auto intervals = intervals_of({{0, {{kPair, 1}}}, {2, {{kPair, 1}}}});
  REQUIRE(intervals.size() == 2);
  CHECK(intervals[0].last.frame == 0);
  CHECK(intervals[1].first.frame == 2);
}

TEST_CASE("without depths the worst frame is the first, and one known depth is enough") {
  auto intervals = intervals_of({{0, {{kPair, kNone}}}, {1, {{kPair, kNone}}}});
  REQUIRE(intervals.size() == 1);
  CHECK(std::isnan(intervals[0].worst_depth));
  CHECK(intervals[0].worst.frame == 0);
  intervals = intervals_of({{0, {{kPair, kNone}}}, {1, {{kPair, -2}}}, {2, {{kPair, kNone}}}});
  REQUIRE(intervals.size() == 1);
  CHECK(intervals[0].worst_depth == -2);
  CHECK(intervals[0].worst.frame == 1);
}

TEST_CASE("of several hits of one pair in a frame the deepest counts, and without depths that of most triangles") {
  auto intervals = intervals_of({{0, {{kPair, 1}, {kPair, kNone, 99}, {kPair, 5}, {kPair, 2}}}});
  REQUIRE(intervals.size() == 1);
  CHECK(intervals[0].worst_depth == 5);
  CHECK(intervals[0].worst_triangles == 0);
  intervals = intervals_of({{0, {{kPair, kNone, 2}, {kPair, kNone, 7}, {kPair, kNone}}}});
  REQUIRE(intervals.size() == 1);
  CHECK(intervals[0].worst_triangles == 7);
}

TEST_CASE("without depths the worst frame is the first of those with most triangles, and its point is kept") {
  const auto intervals = intervals_of({{0, {{kPair, kNone, 3, {0, 0, 0}}}},
                                       {1, {{kPair, kNone, 8, {1, 2, 3}}}},
                                       {2, {{kPair, kNone, 8, {4, 5, 6}}}},
                                       {3, {{kPair, kNone}}}});
  REQUIRE(intervals.size() == 1);
  CHECK(intervals[0].worst.frame == 1);
  CHECK(intervals[0].worst_triangles == 8);
  CHECK(intervals[0].worst_point.x == 1);
  CHECK(intervals[0].worst_point.y == 2);
  CHECK(intervals[0].worst_point.z == 3);
  const std::vector<PairTotals> pairs = pairs_of(intervals);
  REQUIRE(pairs.size() == 1);
  CHECK(pairs[0].worst_triangles == 8);
  CHECK(pairs[0].worst_point.z == 3);
  CHECK(std::isnan(intervals_of({{0, {{kPair, 1}}}})[0].worst_point.x));
}

TEST_CASE("worst first: the deeper, of more triangles, longer, then by file, links and frame, without a depth last") {
  const auto interval = [](float depth, std::uint32_t frames, std::uint32_t file = 0, std::uint32_t first = 0,
                           std::uint32_t triangles = 0) {
    return Interval{file, kPair, {first, 0}, {first + frames - 1, 0}, {first, 0}, depth, triangles};
  };
  const std::vector<Interval> in_order = {interval(2, 1),
                                          interval(1, 9),
                                          interval(1, 3),
                                          interval(1, 3, 0, 50),
                                          interval(1, 3, 1),
                                          interval(-1, 99),
                                          interval(kNone, 1, 0, 0, 9),
                                          interval(kNone, 200, 0, 0, 8),
                                          interval(kNone, 100),
                                          interval(kNone, 9, 4),
                                          interval(kNone, 8)};
  for (std::size_t i = 0; i < in_order.size(); ++i)
    for (std::size_t j = 0; j < in_order.size(); ++j) CHECK(perf::is_worse(in_order[i], in_order[j]) == (i < j));

  const auto pair = [](float depth, std::uint32_t frames, std::uint32_t file = 0) {
    return PairTotals{file, kPair, frames, 1, frames, {}, depth};
  };
  std::vector<PairTotals> pairs = {pair(2, 1), pair(1, 9), pair(1, 3), pair(1, 3, 1), pair(kNone, 1), pair(kNone, 9)};
  pairs[4].worst_triangles = 1;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = 0; j < pairs.size(); ++j) CHECK(perf::is_worse(pairs[i], pairs[j]) == (i < j));
}

// Frames in which few pairs come and go. Some frames are missing, some depths are.
std::vector<Frame> random_frames(std::mt19937& random) {
  const auto below = [&](std::uint32_t count) { return static_cast<std::uint32_t>(random() % count); };
  std::vector<Frame> frames;
  const std::uint32_t count = 1 + below(60), stays = 1 + below(9);
  const bool has_depths = below(3) > 0;
  std::map<LinkPlaces, bool> touching;
  for (std::uint32_t b = 0; b < 2; ++b)
    for (std::uint32_t i = 0; i < 2; ++i)
      for (std::uint32_t l = 0; l < 3; ++l) touching[{{0, i, l}, {b + 1, 1 - i, l}}] = false;
  for (std::uint32_t f = 0; f < count; ++f) {
    for (auto& [links, touches] : touching)
      if (below(stays) == 0) touches = !touches;
    if (below(20) == 0) continue;
    Frame& frame = frames.emplace_back(Frame{f, {}});
    for (const auto& [links, touches] : touching)
      for (std::uint32_t copies = touches ? 1 + below(2) : 0; copies > 0; --copies) {
        const bool known = has_depths && below(10) > 0;
        frame.hits.push_back({links, known ? static_cast<float>(below(12)) / 4 - 1 : kNone});
      }
    std::shuffle(frame.hits.begin(), frame.hits.end(), random);
  }
  return frames;
}

// The depths by frame of each pair; no depth is -infinity. The oracle reads runs off these.
using Touches = std::map<LinkPlaces, std::map<std::uint32_t, float>>;

Touches touches_of(const std::vector<Frame>& frames) {
  Touches touches;
  for (const Frame& frame : frames)
    for (const LinkHit& hit : frame.hits) {
      const float depth = std::isnan(hit.depth) ? -std::numeric_limits<float>::infinity() : hit.depth;
      const auto [place, is_new] = touches[hit.links].emplace(frame.index, depth);
      if (!is_new) place->second = std::max(place->second, depth);
    }
  return touches;
}

// Links, first, last, worst frame, worst depth.
using Row = std::tuple<LinkPlaces, std::uint32_t, std::uint32_t, std::uint32_t, float>;

TEST_CASE("random hits: intervals and pairs are those of the sets of frames") {
  std::mt19937 random(1);
  for (int round = 0; round < 2000; ++round) {
    CAPTURE(round);
    const std::vector<Frame> frames = random_frames(random);
    const std::vector<Interval> intervals = intervals_of(frames);
    std::vector<Row> found, expected;
    for (const Interval& interval : intervals)
      found.emplace_back(
          interval.links, interval.first.frame, interval.last.frame, interval.worst.frame,
          std::isnan(interval.worst_depth) ? -std::numeric_limits<float>::infinity() : interval.worst_depth);
    const std::vector<PairTotals> pairs = pairs_of(intervals);
    const Touches touches = touches_of(frames);
    REQUIRE(pairs.size() == touches.size());
    auto pair = pairs.begin();
    for (const auto& [links, depths] : touches) {
      std::uint32_t longest = 0, count = 0;
      for (const auto& [first, unused] : depths) {
        if (depths.count(first - 1) > 0) continue;
        std::uint32_t last = first, worst = first;
        for (std::uint32_t f = first; depths.count(f) > 0; last = f++)
          if (depths.at(f) > depths.at(worst)) worst = f;
        expected.emplace_back(links, first, last, worst, depths.at(worst));
        longest = std::max(longest, last - first + 1);
        ++count;
      }
      float deepest = -std::numeric_limits<float>::infinity();
      for (const auto& [f, depth] : depths) deepest = std::max(deepest, depth);
      CHECK(pair->file == 7);
      CHECK(pair->links == links);
      CHECK(pair->frames == depths.size());
      CHECK(pair->intervals == count);
      CHECK(pair->longest == longest);
      CHECK(std::isnan(pair->worst_depth) == std::isinf(deepest));
      if (!std::isinf(deepest)) CHECK(pair->worst_depth == deepest);
      if (!std::isinf(deepest)) CHECK(depths.at(pair->worst.frame) == deepest);
      ++pair;
    }
    std::sort(found.begin(), found.end());
    std::sort(expected.begin(), expected.end());
    CHECK(found == expected);
  }
}

}  // namespace
}  // namespace cab::tests
