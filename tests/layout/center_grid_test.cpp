// The grid of the centres of leaf boxes: how far each is from the middle of its cell.
#include "layout/center_grid.h"

#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace cab;

TEST_CASE("every centre is nearer to the middle of its cell than the grid says, also in a line, a point or far away") {
  constexpr double kWorst = 0.867;  // of the root of 3/4, and rounding; measured: 0.837
  oracle::Random random(31);
  double worst = 0;
  for (std::uint64_t round = tests::rounds(2000); round > 0; --round) {
    const double size = random.log_uniform(1e-40, 1e6), away = random.chance(0.3) ? size * random.uniform(-9, 9) : 0;
    const double extent[3] = {random.chance(0.2) ? 0 : size, random.chance(0.2) ? 0 : size * random.uniform(0, 1),
                              size};
    std::vector<BoxTile> boxes(1 + random.index(40));
    const auto lane = static_cast<std::uint32_t>(random.index(kLanes));
    for (BoxTile& box : boxes)
      for (int c = 0; c < 3; ++c) {
        const double sign = random.chance(0.2) ? 1 : random.uniform(-1, 1);
        box.center[c][lane] = static_cast<float>(away + sign * extent[c]);
      }
    CenterGrid grid;
    std::vector<std::uint32_t> cells(boxes.size());
    write_centers({boxes.data(), boxes.size()}, lane, grid, cells.data());
    CAPTURE(size);
    REQUIRE(grid.cell > 0);
    REQUIRE(std::isfinite(grid.cell));
    for (std::size_t leaf = 0; leaf < boxes.size(); ++leaf) {
      double off_sq = 0;
      for (std::uint32_t c = 0; c < 3; ++c) {
        const auto number = static_cast<double>(cells[leaf] >> (CenterGrid::kBits * c) & CenterGrid::kMostCell);
        const double off = static_cast<double>(grid.low[c]) + static_cast<double>(grid.cell) * number -
                           static_cast<double>(boxes[leaf].center[c][lane]);
        off_sq += off * off;
      }
      worst = std::max(worst, std::sqrt(off_sq) / static_cast<double>(grid.cell));
    }
  }
  CHECK(worst <= kWorst);
  CHECK(worst >= 0.8);
}
