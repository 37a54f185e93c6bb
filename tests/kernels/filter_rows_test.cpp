// Which leaves of two instances have bounds that overlap, judged by plain comparisons.
#include "kernels/filter_rows.h"

#include "scenes/random.h"
#include "tests/kernels/isas.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace cab::tests {

TEST_CASE("filter_rows lists every pair of leaves whose bounds overlap, in order, the same on every instruction set") {
  scenes::Random random(52);
  std::size_t kept = 0, needed = 0;
  for (int round = 0; round < 300; ++round) {
    const bool self = round % 4 == 0;
    const bool many = round % 5 == 0;  // with leaves that are next to each other in runs, as those of a link are
    const std::uint32_t most = many ? 300 : 50;
    const std::uint32_t leaves_a = 1 + random.index(most), leaves_b = self ? leaves_a : 1 + random.index(most);
    const double far = round % 3 == 0 ? 1e5 : 1;  // metres between the origins
    std::vector<float> a(leaf_bounds_floats(leaves_a) + kLanes), b(leaf_bounds_floats(leaves_b) + kLanes);
    double shift[3];
    for (double& s : shift) s = self ? 0 : far * random.uniform(-1, 1);
    const auto aligned = [](std::vector<float>& rows) {
      return reinterpret_cast<float*>((reinterpret_cast<std::uintptr_t>(rows.data()) + 63) / 64 * 64);
    };
    const auto fill = [&](float* rows, std::uint32_t leaves, double sign) {
      const std::uint32_t width = leaf_bounds_width(leaves);
      for (std::uint32_t c = 0; c < 3; ++c) {
        double place = 0;
        for (std::uint32_t i = 0; i < width; ++i) {
          if (many && i % 12 == 0) place = random.uniform(-4, 4);
          const double at = sign * 0.5 * shift[c] + place + random.uniform(-1, 1);
          rows[c * width + i] = i < leaves ? static_cast<float>(at) : 3.402823466e38f;
          rows[(3 + c) * width + i] = i < leaves ? static_cast<float>(at + random.uniform(0, 1)) : -3.402823466e38f;
        }
      }
    };
    float *const rows_a = aligned(a), *const rows_b = self ? rows_a : aligned(b);
    fill(rows_a, leaves_a, 1);
    if (!self) fill(rows_b, leaves_b, -1);

    kernel::RowFilter filter;
    filter.a = rows_a;
    filter.b = rows_b;
    filter.leaves_a = leaves_a;
    filter.leaves_b = leaves_b;
    filter.begin_a = 0;
    filter.end_a = leaves_a;
    for (std::uint32_t c = 0; c < 3; ++c) {
      filter.shift[c] = static_cast<float>(shift[c]);
      filter.shift_rest[c] = static_cast<float>(shift[c] - static_cast<double>(filter.shift[c]));
      filter.region_lo[c] = -3.402823466e38f;
      filter.region_hi[c] = 3.402823466e38f;
    }
    filter.candidate = 7;
    filter.self = self;

    // The gap between the bounds of two leaves: at most zero if they overlap.
    const auto gap = [&](std::uint32_t i, std::uint32_t j) {
      double out = -std::numeric_limits<double>::infinity();
      for (std::uint32_t c = 0; c < 3; ++c) {
        const auto side = [c](const float* rows, std::uint32_t leaves, std::uint32_t leaf, std::uint32_t half) {
          return static_cast<double>(rows[(half + c) * leaf_bounds_width(leaves) + leaf]);
        };
        const double lo_a = side(rows_a, leaves_a, i, 0) - shift[c], hi_a = side(rows_a, leaves_a, i, 3) - shift[c];
        out = std::max({out, lo_a - side(rows_b, leaves_b, j, 3), side(rows_b, leaves_b, j, 0) - hi_a});
      }
      return out;
    };
    std::vector<std::pair<int, int>> first_list;
    bool is_first = true;
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(name_of(*kernels));
      std::vector<LeafPair> memory(leaves_a * leaves_b + kLanes);
      FixedList<LeafPair> found = {memory.data(), static_cast<std::uint32_t>(memory.size()), 0};
      filter.found = &found;
      kernels->filter_rows(filter);
      std::vector<std::pair<int, int>> list;
      for (const LeafPair& pair : found) {
        CHECK(pair.candidate == 7);
        list.push_back({pair.a, pair.b});
      }
      CHECK(std::is_sorted(list.begin(), list.end()));
      if (std::exchange(is_first, false)) first_list = list;
      CHECK(list == first_list);
    }
    for (std::uint32_t i = 0; i < leaves_a; ++i)
      for (std::uint32_t j = self ? i + 1 : 0; j < leaves_b; ++j) {
        const bool listed = std::binary_search(first_list.begin(), first_list.end(),
                                               std::pair<int, int>(static_cast<int>(i), static_cast<int>(j)));
        const double rounding = 4e-7 * (1 + far);
        if (gap(i, j) <= 0) CHECK(listed);
        if (gap(i, j) > rounding) CHECK_FALSE(listed);
        needed += gap(i, j) <= 0;
        kept += listed;
      }
    if (self)
      CHECK(std::all_of(first_list.begin(), first_list.end(), [](const auto& p) { return p.first < p.second; }));
  }
  CHECK(needed > 1000);
  CHECK(kept >= needed);
}

}  // namespace cab::tests
