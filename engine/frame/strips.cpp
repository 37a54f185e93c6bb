#include "engine/frame/strips.h"

#include "engine/frame/crowd_batch.h"
#include "engine/frame/crowd_scratch.h"
#include "engine/worker.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace cab {
namespace {

struct Extents {
  float first, second, most;
};
Extents extents_of(const Crowd& crowd, std::uint32_t row) {
  const std::uint32_t x = crowd.axes[0], y = crowd.axes[1];
  const float first = crowd.side(3 + x)[row] - crowd.side(x)[row], second = crowd.side(3 + y)[row] - crowd.side(y)[row];
  return {first, second, std::max(first, second)};
}

// Some rows, in the order in which they are put into strips: all those that take part, or the strays.
struct AllRows {
  const FrameRun& run;

  template <class Take>
  void for_each(Take&& take) const {
    for_each_crowd_batch(run.engine, [&](const StoredBatch& stored) {
      const std::uint32_t first = stored.crowd.first_row, end = first + stored.crowd.row_count;
      for (std::uint32_t row = first; row < end; ++row)
        if (is_there(run.engine.crowd, row)) take(row);
    });
  }
};
struct Strays {
  const std::uint32_t* rows;
  std::uint32_t count;

  template <class Take>
  void for_each(Take&& take) const {
    for (std::uint32_t i = 0; i < count; ++i) take(rows[i]);
  }
};

// Makes the classes of rows by their extents, from class `first` on. Nearly always there is one. Where extents differ
// by more than 8, the first ends at four times the power of two above the median, and each further one at four times
// the one before.
template <class Rows>
void make_classes(const Rows& rows, float least, float most, std::uint32_t first, Crowd& crowd) {
  crowd.class_count = first + 1;
  crowd.classes[first] = {HUGE_VALF, 0, 0, 0, 0, 0};
  if (most <= 8 * least) return;
  std::uint32_t counts[256] = {}, count = 0;
  const auto exponent_of = [](float extent) { return ordered_number(extent) >> 23 & 0xff; };
  rows.for_each([&](std::uint32_t row) {
    ++counts[exponent_of(extents_of(crowd, row).most)];
    ++count;
  });
  std::uint32_t median = 0;
  for (std::uint32_t below = counts[0]; below * 2 < count; below += counts[++median]) {}
  std::uint32_t limit = std::min(median + 2, 254u);
  for (crowd.class_count = first;; limit = std::min(limit + 2, 254u)) {
    const std::uint32_t bits = (limit + 1) << 23;  // the power of two above all extents of that exponent
    float end;
    std::memcpy(&end, &bits, sizeof end);
    const bool last = end > most || limit == 254 || crowd.class_count + 1 == kCrowdClasses;
    crowd.classes[crowd.class_count++] = {last ? HUGE_VALF : end, 0, 0, 0, 0, 0};
    if (last) return;
  }
}

std::uint32_t class_of(const Crowd& crowd, std::uint32_t first, float extent) {
  std::uint32_t out = first;
  while (out + 1 < crowd.class_count && extent > crowd.classes[out].most) ++out;
  return out;
}

// Lays out the strips of the classes from `first` on, and puts the rows into them. spread: of lower sides along the
// second axis. sorted: where their sorted rows begin. Returns where these end.
template <class Rows>
std::uint32_t fill_strips(const Rows& rows, std::uint32_t first, float spread, std::uint32_t sorted, Crowd& crowd) {
  std::uint32_t rows_of[kCrowdClasses] = {};
  std::uint32_t* const strip_of = crowd.strip_of.data;
  rows.for_each([&](std::uint32_t row) {
    const Extents extents = extents_of(crowd, row);
    const std::uint32_t number = class_of(crowd, first, extents.most);
    CrowdClass& of = crowd.classes[number];
    of.reach = std::max(of.reach, extents.first);
    of.extent = std::max(of.extent, extents.second);
    strip_of[row] = number;
    ++rows_of[number];
  });
  const std::uint32_t first_strip = crowd.strip_count;
  for (std::uint32_t k = first; k < crowd.class_count; ++k) {
    CrowdClass& of = crowd.classes[k];
    constexpr std::uint32_t kMostStrips = 1u << 16;
    constexpr float kLeastHeight = 1e-30f;
    const auto most = static_cast<float>(std::min(rows_of[k] + 1, kMostStrips));
    const float height = std::max({1.05f * of.extent, spread / most, kLeastHeight});
    of.scale = 1 / height;
    of.strips = static_cast<std::uint32_t>(std::min(spread * of.scale, most)) + 1;
    of.first_strip = crowd.strip_count;
    of.reach *= 1 + kStripRounding;
    of.extent *= 1 + kStripRounding;
    crowd.strip_count += of.strips;
  }
  std::uint32_t *const begin = crowd.strip_begin.data, *const end = crowd.strip_end.data;
  std::fill(end + first_strip, end + crowd.strip_count, 0u);
  const float* const lower = crowd.side(crowd.axes[1]);
  rows.for_each([&](std::uint32_t row) {
    strip_of[row] = strip_at(crowd, crowd.classes[strip_of[row]], lower[row]);
    ++end[strip_of[row]];
  });
  for (std::uint32_t s = first_strip; s < crowd.strip_count; ++s) {
    begin[s] = sorted;
    sorted += end[s];
    end[s] = begin[s];
  }
  const float* const sorted_by = crowd.side(crowd.axes[0]);
  std::uint64_t* const keys = crowd.keys.data;
  rows.for_each([&](std::uint32_t row) { keys[end[strip_of[row]]++] = sort_key(sorted_by[row], row); });
  crowd.first_strip = first_strip;
  return sorted;
}

// Sorts keys. Those of rows in the last frame's order are nearly sorted.
void sort_keys(std::uint64_t* begin, std::uint64_t* end) {
  std::size_t falls = 0;
  for (std::uint64_t* at = begin; at + 1 < end; ++at) falls += at[1] < at[0];
  if (falls * 8 > static_cast<std::size_t>(end - begin) + 64) return std::sort(begin, end);
  for (std::uint64_t* at = begin + 1; at < end; ++at) {
    const std::uint64_t one = *at;
    std::uint64_t* to = at;
    for (; to > begin && to[-1] > one; --to) *to = to[-1];
    *to = one;
  }
}

}  // namespace

bool are_in_range(const FrameRun& run) {
  constexpr float kMost = 1e30f;
  for (const auto& worker : run.engine.pool.workers) {
    const kernel::CrowdSurvey& survey = worker->crowd[0].survey;
    for (int c = 0; c < 3; ++c)
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        if (survey.low[c][lane] <= survey.high[c][lane] &&
            !(survey.low[c][lane] > -kMost && survey.high[c][lane] < kMost && survey.wide[c][lane] < kMost))
          return false;
  }
  return true;
}

bool lay_out_strips(FrameRun& run) {
  if (!are_in_range(run)) return false;
  Crowd& crowd = run.engine.crowd;
  float low[3], high[3], wide[3], narrow[3];
  for (int c = 0; c < 3; ++c) {
    low[c] = narrow[c] = kernel::kNowhere;
    high[c] = -kernel::kNowhere;
    wide[c] = 0;
    for (const auto& worker : run.engine.pool.workers) {
      const kernel::CrowdSurvey& survey = worker->crowd[0].survey;
      low[c] = std::min(low[c], *std::min_element(survey.low[c], survey.low[c] + kLanes));
      high[c] = std::max(high[c], *std::max_element(survey.high[c], survey.high[c] + kLanes));
      wide[c] = std::max(wide[c], *std::max_element(survey.wide[c], survey.wide[c] + kLanes));
      narrow[c] = std::min(narrow[c], *std::min_element(survey.narrow[c], survey.narrow[c] + kLanes));
    }
  }
  std::uint32_t* const axes = crowd.axes;
  std::iota(axes, axes + 3, 0u);
  const auto spread = [&](std::uint32_t axis) { return high[axis] - low[axis]; };
  for (const auto& [i, j] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)})
    if (spread(axes[i]) < spread(axes[j])) std::swap(axes[i], axes[j]);
  crowd.low = low[axes[1]];
  crowd.strip_count = 0;
  const AllRows rows = {run};
  make_classes(rows, std::min(narrow[axes[0]], narrow[axes[1]]), std::max(wide[axes[0]], wide[axes[1]]), 0, crowd);
  crowd.first_sorted = 0;
  crowd.end_sorted = fill_strips(rows, 0, std::max(high[axes[1]] - low[axes[1]], 0.0f), 0, crowd);
  return true;
}

void lay_out_strays(Crowd& crowd, std::uint32_t count) {
  const Strays rows = {crowd.strays.data, count};
  float least = kernel::kNowhere, most = 0, high = crowd.low;
  const float* const lower = crowd.side(crowd.axes[1]);
  rows.for_each([&](std::uint32_t row) {
    const float extent = extents_of(crowd, row).most;
    least = std::min(least, extent);
    most = std::max(most, extent);
    high = std::max(high, lower[row]);
  });
  crowd.class_count = 1;
  crowd.strip_count = crowd.first_strip = crowd.classes[0].strips;
  crowd.first_sorted = crowd.end_sorted = crowd.bands.first_stray;
  if (count == 0) return;
  make_classes(rows, least, most, 1, crowd);
  crowd.end_sorted = fill_strips(rows, 1, high - crowd.low, crowd.first_sorted, crowd);
}

void sort_strip(Crowd& crowd, std::uint32_t strip) {
  const std::uint32_t begin = crowd.strip_begin[strip], end = crowd.strip_end[strip];
  sort_keys(crowd.keys.data + begin, crowd.keys.data + end);
  const float* from[6];
  float* to[6];
  for (std::uint32_t s = 0; s < 6; ++s) {
    from[s] = crowd.side(s / 3 * 3 + crowd.axes[s % 3]);
    to[s] = crowd.sorted_side(s);
  }
  for (std::uint32_t i = begin; i < end; ++i) {
    const auto row = static_cast<std::uint32_t>(crowd.keys[i]);
    for (std::uint32_t s = 0; s < 6; ++s) to[s][i] = from[s][row];
    crowd.sorted[i] = crowd.rows[row];
  }
}

}  // namespace cab
