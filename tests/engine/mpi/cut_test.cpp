// Regions with equally many characters.
#include "perf/judge/oracle/random.h"

#include <cab/mpi.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

std::vector<double> random_places(oracle::Random& random, std::size_t count, double width) {
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(random.uniform(0, width));
    out.push_back(random.uniform(0, 1));
    out.push_back(0);
  }
  return out;
}

}  // namespace

TEST_CASE("all regions have equally many characters, and are apart along the longer side") {
  oracle::Random random(1);
  for (const std::int32_t regions : {1, 2, 3, 4, 7, 64}) {
    CAPTURE(regions);
    const std::vector<double> places = random_places(random, 1000, 100);
    std::vector<std::int32_t> owners(1000, -1);
    REQUIRE(mpi::cut(places, regions, owners) == Status::kOk);
    for (std::int32_t r = 0; r < regions; ++r) {
      const auto count = std::count(owners.begin(), owners.end(), r);
      CHECK(std::abs(count - 1000 / regions) <= 7);
    }
  }
  const std::vector<double> places = random_places(random, 1000, 100);
  std::vector<std::int32_t> owners(1000);
  REQUIRE(mpi::cut(places, 2, owners) == Status::kOk);
  double highest = 0, lowest = 100;
  for (std::size_t i = 0; i < 1000; ++i)
    if (owners[i] == 0)
      highest = std::max(highest, places[3 * i]);
    else
      lowest = std::min(lowest, places[3 * i]);
  CHECK(highest <= lowest);
}

TEST_CASE("characters at one place are cut by their numbers, and there may be fewer of them than regions") {
  std::vector<std::int32_t> owners(4);
  REQUIRE(mpi::cut(std::vector<double>(12, 5.0), 2, owners) == Status::kOk);
  CHECK(owners == std::vector<std::int32_t>{0, 0, 1, 1});
  owners.assign(2, -1);
  REQUIRE(mpi::cut(std::vector<double>{0, 0, 0, 9, 0, 0}, 7, owners) == Status::kOk);
  CHECK(owners[0] != owners[1]);
  owners.clear();
  CHECK(mpi::cut({}, 3, owners) == Status::kOk);
}

TEST_CASE("a cut that cannot be made is refused") {
  std::vector<std::int32_t> owners(1);
  CHECK(mpi::cut(std::vector<double>{0, 0, 0}, 0, owners) == Status::kBadOutput);
  CHECK(mpi::cut(std::vector<double>{0, 0}, 1, owners) == Status::kBadOutput);
  CHECK(mpi::cut(std::vector<double>{0, 0, std::numeric_limits<double>::quiet_NaN()}, 1, owners) ==
        Status::kBadOrigins);
}

}  // namespace cab::tests
