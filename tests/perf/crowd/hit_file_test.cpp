// Hits of a rank on disk.
#include "perf/crowd/hit_file.h"

#include <doctest/doctest.h>

#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using perf::HitFile;
using perf::HitRecord;

std::vector<Hit> some_hits(std::size_t count) {
  std::vector<Hit> out(count, Hit{{1}, 0, {2}, 7, 3, 4, 5, 6});
  for (std::size_t i = 0; i < count; ++i) out[i].instance_a = static_cast<std::uint32_t>(i);
  return out;
}

}  // namespace

TEST_CASE("a file of hits has a record of 28 bytes per hit, and can be cut back to a frame's end") {
  const TemporaryFolder folder;
  const std::string path = folder / "rank-0.hits";
  const std::vector<Hit> many = some_hits(100000), few = some_hits(3);
  std::uint64_t end = 0;
  {
    HitFile file(path, 0);
    file.append(4, many);
    end = file.size();
    CHECK(end == 2800000);
    file.append(5, few);
    file.sync();
    file.cut_to(end);
    file.append(6, few);
  }
  const std::string bytes = read_text(path);
  REQUIRE(bytes.size() == end + 3 * sizeof(HitRecord));
  HitRecord last;
  std::memcpy(&last, bytes.data() + bytes.size() - sizeof last, sizeof last);
  CHECK(last.frame == 6);
  CHECK(std::memcmp(&last.hit, &few[2], sizeof(Hit)) == 0);

  // What is behind a checkpoint is cut off.
  { HitFile again(path, end); }
  CHECK(std::filesystem::file_size(path) == end);
}

TEST_CASE("a file that is shorter than its checkpoint, or cannot be written, is told with its path") {
  const TemporaryFolder folder;
  const std::string path = folder / "rank-0.hits";
  write_text(path, "12345");
  CHECK_THROWS_WITH_AS(HitFile(path, 6), doctest::Contains("shorter than at the last checkpoint"), std::runtime_error);
  CHECK_THROWS_WITH_AS(HitFile(folder / "none/rank-0.hits", 0), doctest::Contains("No such file"), std::runtime_error);
  CHECK_THROWS_AS(perf::replace_file(folder / "none/state.json", "text"), std::runtime_error);
}

TEST_CASE("a file is replaced as a whole") {
  const TemporaryFolder folder;
  const std::string path = folder / "state.json";
  perf::replace_file(path, "first");
  perf::replace_file(path, "second");
  CHECK(read_text(path) == "second");
  CHECK(!std::filesystem::exists(path + ".new"));
}

}  // namespace cab::tests
