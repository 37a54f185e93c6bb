// Which grid entries of a run overlap a given one, judged by plain comparisons.
#include "scenes/random.h"
#include "tests/kernels/isas.h"

#include <doctest/doctest.h>

#include <limits>

namespace cab::tests {
namespace {

constexpr std::uint64_t kSeed = 51;

// Bounds on a coarse lattice, so that sides are often equal; now and then one is infinite or a NaN.
GridEntry random_entry(scenes::Random& random) {
  GridEntry entry;
  for (std::uint32_t c = 0; c < 3; ++c) {
    const float lo = 0.25f * static_cast<float>(random.index(16));
    entry.side[c] = lo;
    entry.side[3 + c] = -(lo + 0.25f * static_cast<float>(random.index(8)));
  }
  constexpr float kOdd[] = {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::quiet_NaN(), -0.0f};
  if (random.index(8) == 0) entry.side[random.index(6)] = kOdd[random.index(4)];
  entry.batch = 0x7fc00000u;  // these fields hold bit patterns of a NaN and an infinity, but are not compared
  entry.instance = 0x7f800000u;
  return entry;
}

bool entries_overlap(const GridEntry& x, const GridEntry& y) {
  for (std::uint32_t c = 0; c < 6; ++c)
    if (x.side[c] > -y.side[(c + 3) % 6]) return false;
  return true;
}

}  // namespace

TEST_CASE("overlapping_entries lists the entries that overlap, whatever run it is given, on every instruction set") {
  constexpr std::uint32_t kEntries = 40;
  scenes::Random random(kSeed);
  std::size_t listed = 0;
  for (int round = 0; round < 300; ++round) {
    GridEntry entries[kEntries + 1];
    for (GridEntry& entry : entries) entry = random_entry(random);
    const GridEntry query = random_entry(random);
    const std::uint32_t first = random.index(kEntries), end = first + random.index(kEntries - first + 1);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = first; i < end; ++i)
      if (entries_overlap(entries[i], query)) expected.push_back(i);
    listed += expected.size();
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(name_of(*kernels));
      std::uint32_t found[kEntries + 1];
      const std::uint32_t count = kernels->overlapping_entries(entries, first, end, query, found);
      CHECK(std::vector<std::uint32_t>(found, found + count) == expected);
    }
  }
  CHECK(listed > 200);
}

}  // namespace cab::tests
