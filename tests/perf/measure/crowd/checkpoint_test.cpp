// Checkpoints of runs of several ranks.
#include "perf/measure/crowd/checkpoint.h"

#include <doctest/doctest.h>

#include <stdexcept>
#include <utility>

#include "tests/perf/cli/spawn.h"

namespace cab::tests {

using perf::Checkpoint;

TEST_CASE("a checkpoint reads back as it was written") {
  const TemporaryFolder folder;
  const std::string path = folder / "state.json";
  CHECK(!perf::read_checkpoint(path));
  Checkpoint written;
  written.program = "cab \"1\" scene=uniform";
  written.frames = 96;
  written.ranks.resize(2);
  written.ranks[1] = {10, 0xffffffffffffffff, {1, 2, 3, 4}, {5, 6, 7, 8}, 9, 10};
  perf::write_checkpoint(path, written);
  const std::optional<Checkpoint> read = perf::read_checkpoint(path);
  REQUIRE(read);
  CHECK(read->program == written.program);
  CHECK(read->frames == 96);
  REQUIRE(read->ranks.size() == 2);
  CHECK(read->ranks[1].hits_sum == 0xffffffffffffffff);
  CHECK(read->ranks[1].bytes[3] == 8);
  CHECK(read->ranks[1].poses_sent == 10);
}

TEST_CASE("what is no checkpoint is refused with its path") {
  const TemporaryFolder folder;
  const std::string path = folder / "state.json";
  for (const char* const text : {"", "{", "[]", "{\"format\": \"cab crowd --mpi 2\"}", "{\"format\": \"another\"}"}) {
    write_text(path, text);
    CHECK_THROWS_WITH_AS(perf::read_checkpoint(path), doctest::Contains(path.c_str()), std::runtime_error);
  }
  write_text(path, "{\"format\": \"cab crowd --mpi 1\"}");
  CHECK_THROWS_WITH_AS(perf::read_checkpoint(path),
                       doctest::Contains("has the format \"cab crowd --mpi 1\", not \"cab crowd --mpi 2\""),
                       std::runtime_error);
}

TEST_CASE("a checkpoint in which anything was changed is refused") {
  const TemporaryFolder folder;
  const std::string path = folder / "state.json";
  Checkpoint written;
  written.program = "cab 1 scene=uniform";
  written.frames = 16;
  written.ranks.resize(1);
  written.ranks[0] = {280, 11, {1, 2, 3, 4}, {5, 6, 7, 8}, 9, 10};
  perf::write_checkpoint(path, written);
  const std::string good = read_text(path);
  const std::pair<const char*, const char*> changes[] = {
      {"\"frames\": 16", "\"frames\": 17"},         {"\"frames\": 16", "\"frames\": -1"},
      {"\"frames\": 16", "\"frames\": 4000000000"}, {"\"frames\": 16", "\"frames\": 4294967312"},
      {"\"frames\": 16", "\"frames\": 16.0"},       {"\"hits\": 280", "\"hits\": 281"},
      {"\"hits\": 280", "\"hits\": -280"},          {"\"hits_sum\": 11", "\"hits_sum\": 12"},
      {"\"bounds_sent\": 9", "\"bounds_sent\": 8"}, {"uniform", "jitter"}};
  for (const auto& [from, to] : changes) {
    const std::string changed = to;  // clang captures no structured binding
    CAPTURE(changed);
    std::string text = good;
    text.replace(text.find(from), std::string(from).size(), to);
    write_text(path, text);
    CHECK_THROWS_WITH_AS(perf::read_checkpoint(path), doctest::Contains("state.json is no checkpoint"),
                         std::runtime_error);
  }
}

}  // namespace cab::tests
