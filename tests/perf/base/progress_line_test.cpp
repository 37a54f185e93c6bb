#include "perf/base/progress_line.h"

#include <doctest/doctest.h>

namespace cab::tests {
namespace {

using perf::progress_line;

TEST_CASE(
    "a line of progress comes after a quarter of a second or before a long step, and says how far the run is and how "
    "long it takes") {
  CHECK(progress_line("files", 1, 2, 0.249).empty());
  CHECK(progress_line("files", 0, 2, 0, true) == "files [..............................] 0 %");
  CHECK(progress_line("files", 1, 2, 0.25) == "files [###############...............] 50 %");
  CHECK(progress_line("files", 2, 2, 9) == "files [##############################] 100 %");
  CHECK(progress_line("files", 1, 2, 10) == "files [###############...............] 50 %, about 10 s left");
}

}  // namespace
}  // namespace cab::tests
