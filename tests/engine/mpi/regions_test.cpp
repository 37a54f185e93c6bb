// Which rank tests two characters.
#include "engine/mpi/regions.h"

#include <doctest/doctest.h>

#include <limits>

namespace cab::tests {

TEST_CASE("of two ranks exactly one tests two characters, and the smaller one's if their sizes differ") {
  for (std::int32_t a = 0; a < 9; ++a)
    for (std::int32_t b = 0; b < 9; ++b)
      for (std::int32_t size_a = -2; size_a < 3; ++size_a)
        for (std::int32_t size_b = -2; size_b < 3; ++size_b) {
          if (a == b) continue;
          CHECK(mpi::tests({a, size_a}, {b, size_b}) != mpi::tests({b, size_b}, {a, size_a}));
          if (size_a < size_b) CHECK(mpi::tests({a, size_a}, {b, size_b}));
        }
}

TEST_CASE("a rank in the middle tests with about half of the others") {
  int tested = 0;
  for (std::int32_t b = 0; b < 100; ++b) tested += b != 50 && mpi::tests({50, 0}, {b, 0});
  CHECK(tested >= 45);
  CHECK(tested <= 55);
}

TEST_CASE("sizes are classes of powers of four") {
  const auto size = [](double extent) { return mpi::size_class({{0, 0, 0}, {extent, extent / 2, 0}}); };
  CHECK(size(1) == size(3.9));
  CHECK(size(4) == size(1) + 1);
  CHECK(size(.99) == size(1) - 1);
  CHECK(size(100) > size(4));
  CHECK(size(0) < size(1e-30));
  CHECK(size(1e300) < size(std::numeric_limits<double>::infinity()));
}

}  // namespace cab::tests
