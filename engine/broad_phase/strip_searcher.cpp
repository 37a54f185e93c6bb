#include "engine/broad_phase/strip_searcher.h"

#include "engine/broad_phase/crowd_scratch.h"
#include "engine/broad_phase/strips.h"

#include <algorithm>
#include <cmath>

namespace cab {

StripSearcher::StripSearcher(const FrameContext& frame, const Crowd& crowd, CrowdScratch& scratch)
    : frame_(frame), crowd_(crowd), scratch_(scratch) {
  for (std::uint32_t s = 0; s < 6; ++s) sides_.side[s] = crowd_.sorted_side(s);
}

void StripSearcher::search(const StripRows& rows) {
  kernel::StripSearch job = {sides_,         rows.first, rows.end,      rows.from,  kernel::StripSearch::kFromNext,
                             rows.own_end,   rows.next,  rows.next_end, rows.reach, kernel::kPairEntries,
                             scratch_.count, scratch_.a, scratch_.b};
  for (bool done = false; !done;) {
    const std::uint32_t before = job.count;
    done = frame_.kernels.search_strip(job);
    scratch_.count = crowd_.takes_all ? job.count : keep_paired(before, job.count);
    if (scratch_.count >= kernel::kPairEntries) test();
    job.count = scratch_.count;
  }
}

// Keeps those of the candidates from `begin` to `end` - 1 that some rule pairs and whose layers match. Returns the end
// of all that are kept.
std::uint32_t StripSearcher::keep_paired(std::uint32_t begin, std::uint32_t end) const {
  std::uint32_t kept = begin;
  for (std::uint32_t n = begin; n < end; ++n) {
    const CrowdRow &a = crowd_.sorted_row(scratch_.a[n]), &b = crowd_.sorted_row(scratch_.b[n]);
    if (!frame_.paired.paired(a.batch, b.batch) ||
        !layers_match(frame_.batch(a.batch), a.instance, frame_.batch(b.batch), b.instance))
      continue;
    scratch_.a[kept] = scratch_.a[n];
    scratch_.b[kept++] = scratch_.b[n];
  }
  return kept;
}

namespace {

// The first sorted row of a strip whose lower side along the first axis is not below `least`.
std::uint32_t first_from(const Crowd& crowd, std::uint32_t strip, float least) {
  const float* const lower = crowd.sorted_side(0);
  return static_cast<std::uint32_t>(
      std::lower_bound(lower + crowd.strip_begin[strip], lower + crowd.strip_end[strip], least) - lower);
}

// A little less than from - by, for rounding (docs/proof.md, step 14.9).
float below(float from, float by) {
  const float out = from - by;
  return out - kStripRounding * std::fabs(out);
}

// Takes the candidates of sorted rows that follow each other in one strip with rows of the first `count` classes.
void search_classes(StripSearcher& searcher, const CrowdClasses& classes, std::uint32_t count, std::uint32_t first,
                    std::uint32_t end) {
  const Crowd& crowd = searcher.crowd();
  const float *const from = crowd.sorted_side(0), *const to = crowd.sorted_side(3), *const low = crowd.sorted_side(1),
                     *const high = crowd.sorted_side(4);
  const float lowest = *std::min_element(low + first, low + end), highest = *std::max_element(high + first, high + end);
  for (std::uint32_t k = 0; k < count; ++k) {
    const CrowdClass& of = classes.of[k];
    const std::uint32_t last = strip_at(of, highest);
    for (std::uint32_t s = strip_at(of, below(lowest, of.extent)); s <= last; ++s) {
      const std::uint32_t end_of_strip = crowd.strip_end[s];
      std::uint32_t at = first_from(crowd, s, below(from[first], of.reach));
      for (std::uint32_t i = first; i < end; ++i) {
        const float least = below(from[i], of.reach);
        while (at < end_of_strip && from[at] < least) ++at;
        if (at == end_of_strip) break;
        if (from[at] <= to[i] && strip_at(of, below(low[i], of.extent)) <= s && s <= strip_at(of, high[i]))
          searcher.search({i, i + 1, at, end_of_strip, 0, 0, 0});
      }
    }
  }
}

}  // namespace

void pair_in_strip(StripSearcher& searcher, std::uint32_t number, float reach, std::uint32_t strip, std::uint32_t first,
                   std::uint32_t end, bool has_next) {
  if (first == end) return;
  const Crowd& crowd = searcher.crowd();
  std::uint32_t next = 0, next_end = 0;
  if (has_next) {
    next = first_from(crowd, strip + 1, below(crowd.sorted_side(0)[first], reach));
    next_end = crowd.strip_end[strip + 1];
  }
  searcher.search({first, end, first + 1, crowd.strip_end[strip], next, next_end, reach});
  const CrowdClasses& classes = strip < crowd.kept.end_strip ? crowd.kept : crowd.classes;
  if (number > 0) search_classes(searcher, classes, number, first, end);
}

void pair_with_next(StripSearcher& searcher, std::uint32_t strip) {
  const Crowd& crowd = searcher.crowd();
  searcher.search({crowd.strip_begin[strip], crowd.strip_end[strip], 0, 0, crowd.strip_begin[strip + 1],
                   crowd.strip_end[strip + 1], crowd.classes.of[0].reach});
}

void pair_rows(StripSearcher& searcher, const CrowdClasses& classes, std::uint32_t first, std::uint32_t end) {
  const Crowd& crowd = searcher.crowd();
  const std::uint32_t* const begin = crowd.strip_begin.data;
  auto strip = static_cast<std::uint32_t>(
                   std::upper_bound(begin + classes.first_strip, begin + classes.end_strip, first) - begin) -
               1;
  std::uint32_t number = 0;
  while (first < end) {
    while (first >= crowd.strip_end[strip]) ++strip;
    while (strip >= classes.of[number].first_strip + classes.of[number].strips) ++number;
    const CrowdClass& of = classes.of[number];
    const std::uint32_t until = std::min(end, crowd.strip_end[strip]);
    pair_in_strip(searcher, number, of.reach, strip, first, until, strip + 1 < of.first_strip + of.strips);
    if (crowd.kept.count > 0 && &classes != &crowd.kept)
      search_classes(searcher, crowd.kept, crowd.kept.count, first, until);
    first = until;
  }
}

}  // namespace cab
