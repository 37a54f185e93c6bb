// Medians and spreads of measured values.
#include "perf/base/statistics.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

namespace {

using namespace cab;
using namespace cab::perf;

}  // namespace

TEST_CASE("of an odd number of values the median is the middle one") {
  CHECK(median({5, 1, 3}) == 3);
  CHECK(median({-2, 8, 8, 0, 7}) == 7);
}

TEST_CASE("of an even number of values the median is the upper of the two in the middle") {
  CHECK(median({1, 2}) == 2);
  CHECK(median({4, 1, 3, 2}) == 3);
}

TEST_CASE("a single value is its own median, least and greatest") {
  const Spread spread = spread_of({2.5});
  CHECK(spread.median == 2.5);
  CHECK(spread.least == 2.5);
  CHECK(spread.most == 2.5);
}

TEST_CASE("a spread is the same for every order of the values, equal values included") {
  std::vector<double> values = {-1, 0.5, 0.5, 2, 9};
  do {
    const Spread spread = spread_of(values);
    CHECK(spread.median == 0.5);
    CHECK(spread.least == -1);
    CHECK(spread.most == 9);
  } while (std::next_permutation(values.begin(), values.end()));
}

TEST_CASE("the phases of a frame are four different seconds, without the total") {
  FrameStats stats;
  double expected = 0;
  for (const Phase& phase : kPhases) {
    CHECK(stats.*phase.seconds == 0);
    stats.*phase.seconds = 1;
    expected += 1;
  }
  CHECK(stats.seconds_update + stats.seconds_broad + stats.seconds_test + stats.seconds_query == expected);
  CHECK(stats.seconds_total == 0);
}
