// perf/tools/report/sorted_records.h: all records come out in order, however many runs they are written in.
#include "perf/tools/report/sorted_records.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

struct Record {
  std::uint32_t key;
  std::uint64_t value;
  bool operator==(const Record&) const = default;
};
bool by_key(const Record& one, const Record& other) {
  return one.key != other.key ? one.key < other.key : one.value < other.value;
}
using Sorter = perf::SortedRecords<Record, bool (*)(const Record&, const Record&)>;

TEST_CASE("records come out sorted, with none lost and none made up") {
  std::mt19937 random(1);
  for (const std::size_t most : {1u, 2u, 7u, 1000u, 3000u})
    for (const std::size_t count : {0u, 1u, 2u, 7u, 999u, 1000u, 1001u, 9000u}) {
      CAPTURE(most);
      CAPTURE(count);
      Sorter sorter(most, by_key);
      std::vector<Record> expected, found;
      // A second use finds nothing of the first.
      for (int use = 0; use < 2; ++use) {
        expected.clear();
        found.clear();
        for (std::size_t i = 0; i < count; ++i) {
          expected.push_back({static_cast<std::uint32_t>(random() % 50), random()});
          sorter.add(expected.back());
        }
        CHECK(sorter.count() == count);
        sorter.take_all([&](const Record& record) { found.push_back(record); });
        std::sort(expected.begin(), expected.end(), by_key);
        CHECK((found == expected));
        CHECK(sorter.count() == 0);
      }
    }
}

TEST_CASE("a folder for temporary files that does not exist is told") {
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before == nullptr ? "" : before;
  setenv("TMPDIR", "/nowhere", 1);
  perf::TemporaryStore store;
  CHECK_THROWS_AS(store.append("x", 1), std::runtime_error);
  if (before == nullptr)
    unsetenv("TMPDIR");
  else
    setenv("TMPDIR", kept.c_str(), 1);
}

}  // namespace
}  // namespace cab::tests
