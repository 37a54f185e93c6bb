// The broad phase of a crowd: strips of rows, sorted along one axis.
#pragma once

#include "engine/broad_phase/crowd.h"
#include "engine/step/frame_context.h"
#include "kernels/search_strip.h"

#include <cstring>

namespace cab {

struct CrowdScratch;

// A float as a number whose order is that of floats.
inline std::uint32_t ordered_number(float v) {
  std::uint32_t bits;
  std::memcpy(&bits, &v, sizeof bits);
  return bits ^ (bits >> 31 ? 0xffffffffu : 0x80000000u);
}

// What a row is sorted by.
inline std::uint64_t sort_key(float lower, std::uint32_t row) {
  return std::uint64_t{ordered_number(lower)} << 32 | row;
}

// The strip of a class in which bounds begin, or the one nearest to it.
inline std::uint32_t strip_at(const CrowdClass& of, float lower) {
  const float at = (lower - of.low) * of.scale;
  if (!(at > 0)) return of.first_strip;
  return of.first_strip + (at < static_cast<float>(of.strips - 1) ? static_cast<std::uint32_t>(at) : of.strips - 1);
}

// Whether a row takes part. Those of masked instances do not.
inline bool is_there(const Crowd& crowd, std::uint32_t row) { return crowd.side(0)[row] < kernel::kNowhere; }

// Makes the survey of a worker know of no row, and its list of candidates empty.
void clear_survey(CrowdScratch& scratch);

// What is known of some rows together, along each axis of the world.
struct CrowdRanges {
  float low[3], high[3];     // of lower sides
  float wide[3], narrow[3];  // the greatest and the least extent
};
inline constexpr CrowdRanges kNoRanges = {{kernel::kNowhere, kernel::kNowhere, kernel::kNowhere},
                                          {-kernel::kNowhere, -kernel::kNowhere, -kernel::kNowhere},
                                          {0, 0, 0},
                                          {kernel::kNowhere, kernel::kNowhere, kernel::kNowhere}};
void add_survey(const kernel::CrowdSurvey& survey, CrowdRanges& out);

// Writes the sides of an instance's row, and adds them to a survey. InstanceBatch::bounds are rounded outwards, unless
// they came from sides as they do where the batch is by words.
void place_row(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t row, Crowd& crowd,
               kernel::CrowdSurvey& survey);

// Chooses the axes, makes the classes, lays out their strips after those that are kept, and puts all rows into them,
// unsorted. of: what the surveys of all workers say.
void lay_out_strips(StoredBatches batches, const CrowdRanges& of, Crowd& crowd);

// The same for the strays of a frame with bands: their classes come after class 0.
void lay_out_strays(Crowd& crowd, std::uint32_t count);

// Makes the strips that are kept anew, from the rows of all characters that rest, and sorts them.
void keep_rows(StoredBatches batches, Crowd& crowd);

// Keeps no rows any more.
void clear_kept(Crowd& crowd);

// Sorts the rows of a strip, and copies their sides.
void sort_strip(Crowd& crowd, std::uint32_t strip);

// The tasks that sort all strips but the kept ones, or those of strays.
std::uint32_t sort_tasks(const Crowd& crowd);
void sort_strips(Crowd& crowd, std::uint32_t task);

}  // namespace cab
