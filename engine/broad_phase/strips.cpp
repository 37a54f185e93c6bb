#include "engine/broad_phase/strips.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/broad_phase/crowd_scratch.h"

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

// Some rows, in the order in which they are put into strips: all those that take part, those that rest, or those in a
// list.
struct AllRows {
  StoredBatches batches;
  const Crowd& crowd;

  template <class Take>
  void for_each(Take&& take) const {
    for_each_crowd_batch(batches, [&](const StoredBatch& stored) {
      const CrowdBatch& own = stored.crowd;
      for (std::uint32_t place = 0; place < own.row_count; ++place) {
        const std::uint32_t row = own.first_row + (own.visits_by_order ? own.order[place] : place);
        if (is_there(crowd, row)) take(row);
      }
    });
  }
};
struct RestingRows {
  StoredBatches batches;

  template <class Take>
  void for_each(Take&& take) const {
    for_each_crowd_batch(batches, [&](const StoredBatch& stored) {
      const InstanceBatch& batch = stored.batch;
      for (std::uint32_t i = 0; !stored.crowd.is_by_place && i < stored.crowd.row_count; ++i)
        if ((batch.live[i / kLanes] >> i % kLanes & 1) && rests(batch, i)) take(stored.crowd.first_row + i);
    });
  }
};
struct ListedRows {
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
void make_classes(const Rows& rows, float least, float most, std::uint32_t first, const Crowd& crowd,
                  CrowdClasses& out) {
  out.count = first + 1;
  out.of[first] = {};
  out.of[first].most = HUGE_VALF;
  if (most <= 8 * least) return;
  std::uint32_t counts[256] = {}, count = 0;
  const auto exponent_of = [](float extent) { return ordered_number(extent) >> 23 & 0xff; };
  rows.for_each([&](std::uint32_t row) {
    ++counts[exponent_of(extents_of(crowd, row).most)];
    ++count;
  });
  if (count == 0) return;  // extents are those of kept rows
  std::uint32_t median = 0;
  for (std::uint32_t below = counts[0]; below < count - below; below += counts[++median]) {}
  std::uint32_t limit = std::min(median + 2, 254u);
  for (out.count = first;; limit = std::min(limit + 2, 254u)) {
    const std::uint32_t bits = (limit + 1) << 23;  // the power of two above all extents of that exponent
    float end;
    std::memcpy(&end, &bits, sizeof end);
    const bool last = end > most || limit == 254 || out.count + 1 == kCrowdClasses;
    CrowdClass& of = out.of[out.count++];
    of = {};
    of.most = last ? HUGE_VALF : end;
    if (last) return;
  }
}

std::uint32_t class_of(const CrowdClasses& classes, std::uint32_t first, float extent) {
  std::uint32_t out = first;
  while (out + 1 < classes.count && extent > classes.of[out].most) ++out;
  return out;
}

// Lays out the strips of the classes from `first` on, and puts the rows into them. low, spread: of lower sides along
// the second axis. The strips begin with end_strip, and their sorted rows with end_sorted.
template <class Rows>
void fill_strips(const Rows& rows, std::uint32_t first, float low, float spread, Crowd& crowd, CrowdClasses& out) {
  std::uint32_t rows_of[kCrowdClasses] = {};
  std::uint32_t* const strip_of = crowd.strip_of.data;
  rows.for_each([&](std::uint32_t row) {
    const Extents extents = extents_of(crowd, row);
    const std::uint32_t number = class_of(out, first, extents.most);
    CrowdClass& of = out.of[number];
    of.reach = std::max(of.reach, extents.first);
    of.extent = std::max(of.extent, extents.second);
    strip_of[row] = number;
    ++rows_of[number];
  });
  out.first_strip = out.end_strip;
  out.first_sorted = out.end_sorted;
  for (std::uint32_t k = first; k < out.count; ++k) {
    CrowdClass& of = out.of[k];
    constexpr std::uint32_t kMostStrips = 1u << 16;
    constexpr float kLeastHeight = 1e-30f;
    const auto most = static_cast<float>(std::min(rows_of[k] + 1, kMostStrips));
    const float height = std::max({1.05f * of.extent, spread / most, kLeastHeight});
    of.low = low;
    of.scale = 1 / height;
    of.strips = static_cast<std::uint32_t>(std::min(spread * of.scale, most)) + 1;
    of.first_strip = out.end_strip;
    of.reach *= 1 + kStripRounding;
    of.extent *= 1 + kStripRounding;
    out.end_strip += of.strips;
  }
  std::uint32_t *const begin = crowd.strip_begin.data, *const end = crowd.strip_end.data;
  std::fill(end + out.first_strip, end + out.end_strip, 0u);
  const float* const lower = crowd.side(crowd.axes[1]);
  rows.for_each([&](std::uint32_t row) {
    strip_of[row] = strip_at(out.of[strip_of[row]], lower[row]);
    ++end[strip_of[row]];
  });
  for (std::uint32_t s = out.first_strip; s < out.end_strip; ++s) {
    begin[s] = out.end_sorted;
    out.end_sorted += end[s];
    end[s] = begin[s];
  }
  const float* const sorted_by = crowd.side(crowd.axes[0]);
  std::uint64_t* const keys = crowd.keys.data;
  rows.for_each([&](std::uint32_t row) { keys[end[strip_of[row]]++] = sort_key(sorted_by[row], row); });
}

// Chooses the axes by how widely rows are spread.
void choose_axes(const CrowdRanges& of, Crowd& crowd) {
  std::uint32_t* const axes = crowd.axes;
  std::iota(axes, axes + 3, 0u);
  const auto spread = [&](std::uint32_t axis) { return of.high[axis] - of.low[axis]; };
  for (const auto& [i, j] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)})
    if (spread(axes[i]) < spread(axes[j])) std::swap(axes[i], axes[j]);
}

// Makes classes and strips of rows from nothing.
template <class Rows>
void make_strips(const Rows& rows, const CrowdRanges& of, Crowd& crowd, CrowdClasses& out) {
  const std::uint32_t x = crowd.axes[0], y = crowd.axes[1];
  make_classes(rows, std::min(of.narrow[x], of.narrow[y]), std::max(of.wide[x], of.wide[y]), 0, crowd, out);
  fill_strips(rows, 0, of.low[y], std::max(of.high[y] - of.low[y], 0.0f), crowd, out);
}

void clear(kernel::CrowdSurvey& survey) {
  for (int c = 0; c < 3; ++c) {
    std::fill_n(survey.low[c], kLanes, kernel::kNowhere);
    std::fill_n(survey.high[c], kLanes, -kernel::kNowhere);
    std::fill_n(survey.wide[c], kLanes, 0.0f);
    std::fill_n(survey.narrow[c], kLanes, kernel::kNowhere);
  }
}

// Up to so many moves per key, inserting is as fast as std::sort.
constexpr std::size_t kMostMoves = 16;

// Sorts keys. Those of one batch in the last frame's order are nearly sorted; those of several are as many runs, in
// which few keys are lower than the one before, and many have far to go.
void sort_keys(std::uint64_t* begin, std::uint64_t* end) {
  std::size_t falls = 0, moves = 0;
  for (std::uint64_t* at = begin; at + 1 < end; ++at) falls += at[1] < at[0];
  if (falls * 8 > static_cast<std::size_t>(end - begin) + 64) return std::sort(begin, end);
  for (std::uint64_t* at = begin + 1; at < end; ++at) {
    const std::uint64_t one = *at;
    std::uint64_t* to = at;
    for (; to > begin && to[-1] > one; --to) *to = to[-1];
    *to = one;
    moves += static_cast<std::size_t>(at - to);
    if (moves > kMostMoves * static_cast<std::size_t>(end - begin)) return std::sort(begin, end);
  }
}

}  // namespace

void clear_survey(CrowdScratch& scratch) {
  clear(scratch.survey);
  scratch.count = scratch.kept = scratch.resting = 0;  // a frame that was given up may have left some
}

void add_survey(const kernel::CrowdSurvey& survey, CrowdRanges& out) {
  for (int c = 0; c < 3; ++c) {
    out.low[c] = std::min(out.low[c], *std::min_element(survey.low[c], survey.low[c] + kLanes));
    out.high[c] = std::max(out.high[c], *std::max_element(survey.high[c], survey.high[c] + kLanes));
    out.wide[c] = std::max(out.wide[c], *std::max_element(survey.wide[c], survey.wide[c] + kLanes));
    out.narrow[c] = std::min(out.narrow[c], *std::min_element(survey.narrow[c], survey.narrow[c] + kLanes));
  }
}

void place_row(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t row, Crowd& crowd,
               kernel::CrowdSurvey& survey) {
  const InstanceBounds& bounds = batch.bounds[instance];
  constexpr auto kMost = static_cast<double>(kernel::kMostSide);
  for (std::uint32_t c = 0; c < 3; ++c) {
    const double least = std::clamp(bounds.lo[c], -kMost, kMost), most = std::clamp(bounds.hi[c], -kMost, kMost);
    const float lo = batch.by_words ? static_cast<float>(least) : float_below(least),
                hi = batch.by_words ? static_cast<float>(most) : float_above(most);
    crowd.side(c)[row] = lo;
    crowd.side(3 + c)[row] = hi;
    survey.low[c][0] = std::min(survey.low[c][0], lo);
    survey.high[c][0] = std::max(survey.high[c][0], lo);
    survey.wide[c][0] = std::max(survey.wide[c][0], hi - lo);
    survey.narrow[c][0] = std::min(survey.narrow[c][0], hi - lo);
  }
}

void lay_out_strips(StoredBatches batches, const CrowdRanges& of, Crowd& crowd) {
  if (crowd.kept.count == 0) choose_axes(of, crowd);
  crowd.classes.end_strip = crowd.kept.end_strip;
  crowd.classes.end_sorted = crowd.kept.end_sorted + (crowd.kept.count ? kLanes : 0);
  const AllRows all = {batches, crowd};
  if (crowd.kept.count == 0) return make_strips(all, of, crowd, crowd.classes);
  // Most rows may be among the kept ones: then the others are listed once.
  std::uint32_t count = 0;
  all.for_each([&](std::uint32_t row) {
    if (count < crowd.strays.size) crowd.strays[count] = row;
    ++count;
  });
  if (count <= crowd.strays.size)
    make_strips(ListedRows{crowd.strays.data, count}, of, crowd, crowd.classes);
  else
    make_strips(all, of, crowd, crowd.classes);
}

void lay_out_strays(Crowd& crowd, std::uint32_t count) {
  const ListedRows rows = {crowd.strays.data, count};
  CrowdClasses& classes = crowd.classes;
  float least = kernel::kNowhere, most = 0, high = classes.of[0].low;
  const float* const lower = crowd.side(crowd.axes[1]);
  rows.for_each([&](std::uint32_t row) {
    const float extent = extents_of(crowd, row).most;
    least = std::min(least, extent);
    most = std::max(most, extent);
    high = std::max(high, lower[row]);
  });
  classes.count = 1;
  classes.first_strip = classes.end_strip = classes.of[0].strips;
  classes.first_sorted = classes.end_sorted = crowd.bands.first_stray;
  if (count == 0) return;
  make_classes(rows, least, most, 1, crowd, classes);
  fill_strips(rows, 1, classes.of[0].low, high - classes.of[0].low, crowd, classes);
}

void keep_rows(StoredBatches batches, Crowd& crowd) {
  clear_kept(crowd);
  const RestingRows rows = {batches};
  kernel::CrowdSurvey survey;
  clear(survey);
  std::uint32_t count = 0;
  rows.for_each([&](std::uint32_t row) {
    ++count;
    const CrowdRow& of = crowd.rows[row];
    InstanceBatch& batch = batches[of.batch]->batch;
    place_row(batch, of.instance, row, crowd, survey);
    batch.rest[of.instance] |= kKept;
  });
  if (count == 0) return;
  CrowdRanges of = kNoRanges;
  add_survey(survey, of);
  choose_axes(of, crowd);
  make_strips(rows, of, crowd, crowd.kept);
  for (std::uint32_t strip = 0; strip < crowd.kept.end_strip; ++strip) sort_strip(crowd, strip);
  rows.for_each([&](std::uint32_t row) { crowd.side(0)[row] = kernel::kNowhere; });
}

void clear_kept(Crowd& crowd) {
  crowd.kept = {};
  crowd.kept_is_stale = false;
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
  }
}

constexpr std::uint32_t kSortTasks = 32;

namespace {

std::uint32_t strips_per_task(const CrowdClasses& classes) {
  return std::max(1u, (classes.end_strip - classes.first_strip + kSortTasks - 1) / kSortTasks);
}

}  // namespace

std::uint32_t sort_tasks(const Crowd& crowd) {
  const std::uint32_t each = strips_per_task(crowd.classes);
  return (crowd.classes.end_strip - crowd.classes.first_strip + each - 1) / each;
}

void sort_strips(Crowd& crowd, std::uint32_t task) {
  const std::uint32_t each = strips_per_task(crowd.classes), first = crowd.classes.first_strip + task * each,
                      end = std::min(crowd.classes.end_strip, first + each);
  for (std::uint32_t strip = first; strip < end; ++strip) sort_strip(crowd, strip);
}

}  // namespace cab
