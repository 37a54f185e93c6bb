// Checkpoints of runs of several ranks.
#include "perf/crowd/checkpoint.h"

#include <doctest/doctest.h>

#include <stdexcept>

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
  written.ranks[1] = {280, 10, 0xffffffffffffffff, {1, 2, 3, 4}, {5, 6, 7, 8}, 9, 10};
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
  for (const char* const text : {"", "{", "[]", "{\"format\": \"cab crowd --mpi 1\"}", "{\"format\": \"another\"}"}) {
    write_text(path, text);
    CHECK_THROWS_WITH_AS(perf::read_checkpoint(path), doctest::Contains(path.c_str()), std::runtime_error);
  }
}

}  // namespace cab::tests
