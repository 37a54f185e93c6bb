// Which grid entries of a run overlap one, judged by plain comparisons.
#include "scenes/random.h"
#include "tests/kernels/isas.h"

#include <doctest/doctest.h>

#include <limits>

namespace cab::tests {
namespace {

constexpr std::uint64_t kSeed = 51;

// Bounds on a coarse lattice, so that sides are often equal; now and then endless or not a number.
GridEntry random_row(scenes::Random& random) {
  GridEntry row;
  for (std::uint32_t c = 0; c < 3; ++c) {
    const float lo = 0.25f * static_cast<float>(random.index(16));
    row.side[c] = lo;
    row.side[3 + c] = -(lo + 0.25f * static_cast<float>(random.index(8)));
  }
  constexpr float kOdd[] = {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::quiet_NaN(), -0.0f};
  if (random.index(8) == 0) row.side[random.index(6)] = kOdd[random.index(4)];
  row.batch = 0x7fc00000u;  // what is no number of a row must not be taken for one
  row.instance = 0x7f800000u;
  return row;
}

bool entries_overlap(const GridEntry& x, const GridEntry& y) {
  for (std::uint32_t c = 0; c < 6; ++c)
    if (x.side[c] > -y.side[(c + 3) % 6]) return false;
  return true;
}

}  // namespace

TEST_CASE("overlapping_entries lists the entries that overlap, whatever run it is given, on every instruction set") {
  constexpr std::uint32_t kRows = 40;
  scenes::Random random(kSeed);
  std::size_t listed = 0;
  for (int round = 0; round < 300; ++round) {
    GridEntry rows[kRows + 1];
    for (GridEntry& row : rows) row = random_row(random);
    const GridEntry of = random_row(random);
    const std::uint32_t first = random.index(kRows), end = first + random.index(kRows - first + 1);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = first; i < end; ++i)
      if (entries_overlap(rows[i], of)) expected.push_back(i);
    listed += expected.size();
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(name_of(*kernels));
      std::uint32_t found[kRows + 1];
      const std::uint32_t count = kernels->overlapping_entries(rows, first, end, of, found);
      CHECK(std::vector<std::uint32_t>(found, found + count) == expected);
    }
  }
  CHECK(listed > 200);
}

}  // namespace cab::tests
