// Regions with equally many characters, by recursive bisection of counts.
#include <cab/mpi.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <new>
#include <vector>

namespace cab::mpi {
namespace {

// Characters by their numbers, and the regions that are left for them.
struct Part {
  std::uint32_t* begin;
  std::uint32_t* end;
  std::int32_t first_region, region_count;
};

std::size_t longest_side(Span<const double> places, const Part& part) {
  double lo[3], hi[3];
  for (std::size_t c = 0; c < 3; ++c) lo[c] = hi[c] = places[3 * std::size_t{*part.begin} + c];
  for (const std::uint32_t* i = part.begin; i != part.end; ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], places[3 * std::size_t{*i} + c]);
      hi[c] = std::max(hi[c], places[3 * std::size_t{*i} + c]);
    }
  std::size_t longest = 0;
  for (std::size_t c = 1; c < 3; ++c)
    if (hi[c] - lo[c] > hi[longest] - lo[longest]) longest = c;
  return longest;
}

void cut_part(Span<const double> places, const Part& part, Span<std::int32_t> owners) {
  if (part.region_count == 1) {
    for (const std::uint32_t* i = part.begin; i != part.end; ++i) owners[*i] = part.first_region;
    return;
  }
  if (part.begin == part.end) return;
  const std::size_t side = longest_side(places, part);
  const std::int32_t lower = part.region_count / 2;
  const auto count = static_cast<std::size_t>(part.end - part.begin);
  std::uint32_t* const middle =
      part.begin + count * static_cast<std::size_t>(lower) / static_cast<std::size_t>(part.region_count);
  std::nth_element(part.begin, middle, part.end, [&](std::uint32_t a, std::uint32_t b) {
    const double at_a = places[3 * std::size_t{a} + side], at_b = places[3 * std::size_t{b} + side];
    return at_a < at_b || (at_a == at_b && a < b);
  });
  cut_part(places, {part.begin, middle, part.first_region, lower}, owners);
  cut_part(places, {middle, part.end, part.first_region + lower, part.region_count - lower}, owners);
}

}  // namespace

Status cut(Span<const double> places, std::int32_t region_count, Span<std::int32_t> owners) noexcept try {
  if (region_count < 1 || owners.size * 3 != places.size) return Status::kBadOutput;
  if (!std::all_of(places.begin(), places.end(), [](double at) { return std::isfinite(at); }))
    return Status::kBadOrigins;
  std::vector<std::uint32_t> characters(owners.size);
  for (std::size_t i = 0; i < characters.size(); ++i) characters[i] = static_cast<std::uint32_t>(i);
  cut_part(places, {characters.data(), characters.data() + characters.size(), 0, region_count}, owners);
  return Status::kOk;
} catch (const std::bad_alloc&) { return Status::kOutOfMemory; }

}  // namespace cab::mpi
