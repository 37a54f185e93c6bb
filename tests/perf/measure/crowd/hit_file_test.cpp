// Hits of a rank on disk.
#include "perf/measure/crowd/hit_file.h"

#include <doctest/doctest.h>
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "perf/base/hit_sum.h"
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
    HitFile file(path);
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

  // What is behind a checkpoint is cut off, and what comes next follows it.
  {
    HitFile again(path);
    again.go_on_behind(many.size(), perf::hits_sum(4, many));
    CHECK(std::filesystem::file_size(path) == end);
    again.append(7, few);
  }
  CHECK(std::filesystem::file_size(path) == end + 3 * sizeof(HitRecord));
}

TEST_CASE("a file that is shorter than its checkpoint, or cannot be written, is told with its path") {
  const TemporaryFolder folder;
  const std::string path = folder / "rank-0.hits";
  write_text(path, "12345");
  CHECK_THROWS_WITH_AS(HitFile{path}.go_on_behind(1, 0), doctest::Contains("shorter than at the last checkpoint"),
                       std::runtime_error);
  CHECK_THROWS_WITH_AS(HitFile{folder / "none/rank-0.hits"}, doctest::Contains("No such file"), std::runtime_error);
  CHECK_THROWS_AS(perf::replace_file(folder / "none/state.json", "text"), std::runtime_error);
}

TEST_CASE("any changed bit of the hits before a checkpoint is seen, and the file stays as it is") {
  const TemporaryFolder folder;
  const std::string path = folder / "rank-0.hits";
  const std::vector<Hit> hits = some_hits(40);
  const std::uint64_t sum = perf::hits_sum(2, hits);
  HitFile{path}.append(2, hits);
  const std::string good = read_text(path);
  for (std::size_t at = 0; at < good.size(); at += 13) {
    CAPTURE(at);
    std::string changed = good;
    changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
    write_text(path, changed);
    CHECK_THROWS_WITH_AS(HitFile{path}.go_on_behind(hits.size(), sum), doctest::Contains("is damaged"),
                         std::runtime_error);
    CHECK(read_text(path) == changed);
  }
  write_text(path, good);
  HitFile{path}.go_on_behind(hits.size(), sum);
  CHECK(read_text(path) == good);
}

TEST_CASE("a file of hits has one run at a time, and is neither a link nor a pipe") {
  const TemporaryFolder folder;
  const std::string path = folder / "rank-0.hits", precious = folder / "precious";
  {
    const HitFile first(path);
    CHECK_THROWS_WITH_AS(HitFile{path}, doctest::Contains("another run writes to"), std::runtime_error);
  }
  HitFile{path}.append(0, {});
  write_text(precious, "precious");
  for (const char* const name : {"link.hits", "state.json.new"})
    std::filesystem::create_symlink(precious, folder / name);
  CHECK_THROWS_WITH_AS(HitFile{folder / "link.hits"}, doctest::Contains("is a symbolic link"), std::runtime_error);
  perf::replace_file(folder / "state.json", "text");
  CHECK(read_text(precious) == "precious");
  CHECK(read_text(folder / "state.json") == "text");
  REQUIRE(mkfifo((folder / "pipe.hits").c_str(), 0600) == 0);
  CHECK_THROWS_WITH_AS(HitFile{folder / "pipe.hits"}, doctest::Contains("is no regular file"), std::runtime_error);
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
