// The broad phase of a crowd: which rows of a strip, sorted by their lower sides along one axis, meet one row.
#pragma once

#include "kernels/words.h"
#include "layout/error_bounds.h"

namespace cab::kernel {

// The sides of the bounds of a crowd's instances, as arrays by row: lower sides, then upper sides. The first of each
// three is the axis that strips are sorted along.
struct CrowdSides {
  const float* side[6];
};

// What is known of all rows that one worker has placed, by lane: the least and the greatest lower side along each axis,
// and the greatest and the least extent.
struct CrowdSurvey {
  alignas(64) float low[3][kLanes];
  alignas(64) float high[3][kLanes];
  alignas(64) float wide[3][kLanes];
  alignas(64) float narrow[3][kLanes];
};

// Sixteen instances to place. all: the bounds of their leaves about their origins. from_lo, from_hi: the origins, moved
// outwards by what sums in double may round. there: bits of the lanes that take part; sides of others meet nothing.
// to: their sides, as CrowdSides.
struct PlaceTile {
  const AabbTile* all;
  alignas(64) double from_lo[3][kLanes];
  alignas(64) double from_hi[3][kLanes];
  std::uint32_t there;
  float* to[6];
};

// Float's largest number. An origin beyond it is infinite in float, which must not become NaN.
inline constexpr float kMostFinite = 3.402823466e38f;

// Sides go no farther: bounds beyond it meet there.
inline constexpr float kMostSide = 1e30f;

// Sides that meet nothing, if the lower ones are this and the upper ones its opposite.
inline constexpr float kNowhere = 3e38f;

// Writes the sides of sixteen instances in the world, rounded outwards, and adds them to the survey (docs/proof.md,
// step 14.8).
template <class V>
void place_tile(const PlaceTile& tile, CrowdSurvey& survey) {
  alignas(64) float taken[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) taken[lane] = static_cast<float>(tile.there >> lane & 1);
  const V zero(0.0f), nowhere(kNowhere);
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const Mask<V> there = Lanes<V>::load(taken + lane) > zero;
    for (int c = 0; c < 3; ++c) {
      const V low = Lanes<V>::load(tile.all->lo[c] + lane), high = Lanes<V>::load(tile.all->hi[c] + lane);
      const V in_world_lo = difference(low, zero, tile.from_lo[c] + lane);
      const V in_world_hi = difference(high, zero, tile.from_hi[c] + lane);
      const auto rounding = [](V world, V own) {
        return (V(kSideRounding) * min(abs(world), V(kMostFinite)) + V(kSideOwn) * abs(own)) + V(kSideTiny);
      };
      const auto within = [](V side) { return min(max(side, V(-kMostSide)), V(kMostSide)); };
      const V lo = within(in_world_lo - rounding(in_world_lo, low));
      const V hi = within(in_world_hi + rounding(in_world_hi, high));
      Lanes<V>::store(tile.to[c] + lane, select(there, lo, nowhere));
      Lanes<V>::store(tile.to[3 + c] + lane, select(there, hi, zero - nowhere));
      const V l = Lanes<V>::load(survey.low[c] + lane), h = Lanes<V>::load(survey.high[c] + lane);
      const V w = Lanes<V>::load(survey.wide[c] + lane), n = Lanes<V>::load(survey.narrow[c] + lane);
      Lanes<V>::store(survey.low[c] + lane, select(there, min(l, lo), l));
      Lanes<V>::store(survey.high[c] + lane, select(there, max(h, lo), h));
      Lanes<V>::store(survey.wide[c] + lane, select(there, max(w, hi - lo), w));
      Lanes<V>::store(survey.narrow[c] + lane, select(there, min(n, hi - lo), n));
    }
  }
}

// Rows of a strip that are to be paired: with those after them in their strip, and with those of the next strip. In a
// strip lower sides along the first axis do not fall. at: the row to go on with, up to end - 1. first, second: where
// its searches in its own and in the next strip go on; a new row begins with at + 1 and kFromNext. next: no row of the
// next strip before it can meet row `at` or a later one. reach: no row of the next strip is longer along the first
// axis. most: the search pauses when it has found as many. found_a, found_b: pairs of rows that meet; there is room for
// 2 kLanes more than `most`.
struct StripSearch {
  static constexpr std::uint32_t kFromNext = 0xffffffff;
  CrowdSides sides;
  std::uint32_t at, end, first, second, own_end, next, next_end;
  float reach;
  std::uint32_t most, count;
  std::uint32_t* found_a;
  std::uint32_t* found_b;
};

// What row `at` is compared with.
template <class V>
struct SoughtRow {
  V lo[3], hi[3];
  float last;  // upper side along the first axis

  CAB_INLINE SoughtRow(const CrowdSides& sides, std::uint32_t at) : last(sides.side[3][at]) {
    for (int c = 0; c < 3; ++c) {
      lo[c] = V(sides.side[c][at]);
      hi[c] = V(sides.side[3 + c][at]);
    }
  }

  // Appends the rows from `row` to end - 1 that meet this one, until the strip goes beyond it or `most` are found.
  // Returns the row to go on with, `end` if none is left.
  CAB_INLINE std::uint32_t search(StripSearch& job, std::uint32_t at, std::uint32_t row, std::uint32_t end) const {
    const float* const* side = job.sides.side;
    for (; row < end; row += kWidth<V>) {
      if (job.count >= job.most) return row;
      const auto load = [&](int s) { return Lanes<V>::load_unaligned(side[s] + row); };
      const Mask<V> meet =
          both(both(both(load(0) <= hi[0], load(3) >= lo[0]), both(load(1) <= hi[1], load(4) >= lo[1])),
               both(load(2) <= hi[2], load(5) >= lo[2]));
      std::uint32_t set = bits(meet);
      if (end - row < kWidth<V>) set &= (1u << (end - row)) - 1;
      append_numbers<V>(job.found_b + job.count, row, 0, set);
      fill_lanes<V>(job.found_a + job.count, at);
      job.count += count_bits(set);
      if (!(side[0][row + kWidth<V> - 1] <= last)) return end;
    }
    return end;
  }
};

// The first row from `row` on whose number is not below `least`, or a row from `end` on. Numbers do not fall up to
// there.
template <class V>
CAB_INLINE std::uint32_t skip_below(const float* numbers, std::uint32_t row, std::uint32_t end, float least) {
  constexpr std::uint32_t kAll = (1u << kWidth<V>)-1;
  while (row < end) {
    const std::uint32_t kept = ~bits(Lanes<V>::load_unaligned(numbers + row) < V(least)) & kAll;
    if (kept) return row + lowest_bit(kept);
    row += kWidth<V>;
  }
  return row;
}

// Goes on with a search until all rows are paired or job.most pairs are found. Returns whether all are.
template <class V>
bool search_strip(StripSearch& job) {
  const float* const lower = job.sides.side[0];
  for (; job.at < job.end; ++job.at, job.first = job.at + 1, job.second = StripSearch::kFromNext) {
    const SoughtRow<V> sought(job.sides, job.at);
    job.first = sought.search(job, job.at, job.first, job.own_end);
    if (job.first < job.own_end) return false;
    if (job.next >= job.next_end) continue;
    if (job.second == StripSearch::kFromNext) {
      const float from = lower[job.at] - job.reach, least = from - kStripRounding * std::fabs(from);
      job.second = job.next = skip_below<V>(lower, job.next, job.next_end, least);
    }
    job.second = sought.search(job, job.at, job.second, job.next_end);
    if (job.second < job.next_end) return false;
  }
  return true;
}

}  // namespace cab::kernel
