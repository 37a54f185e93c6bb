// perf/tools/report/recording_names.h: what characters and links are called.
#include "perf/tools/report/recording_names.h"

#include <doctest/doctest.h>

namespace cab::tests {
namespace {

TEST_CASE("a character is called as its batch, and of several by name or number") {
  const perf::RecordingNames names = {{{"anna", {}, 1, 1, false, 0},
                                       {"crowd", {}, 3, 2, false, 1},
                                       {"team", {"red", "", "team"}, 4, 3, false, 2},
                                       {"", {"lone"}, 1, 4, false, 9},
                                       {"", {}, 2, 5, false, 0},
                                       {"hall", {}, 2, 6, true, 0}},
                                      {{"hips", ""}, {}, {"ro\not"}}};
  CHECK(names.character({0, 0, 0}) == "anna");
  CHECK(names.character({1, 2, 0}) == "crowd 2");
  CHECK(names.character({2, 0, 0}) == "team red");
  CHECK(names.character({2, 1, 0}) == "team 1");
  CHECK(names.character({2, 2, 0}) == "team team");
  CHECK(names.character({2, 3, 0}) == "team 3");
  CHECK(names.character({3, 0, 0}) == "batch 3");
  CHECK(names.character({4, 1, 0}) == "batch 4 1");
  CHECK(names.character({5, 1, 0}) == "hall 1");
  CHECK(names.link({0, 0, 0}) == "hips");
  CHECK(names.link({0, 0, 1}) == "link 1");
  CHECK(names.link({0, 0, 2}) == "link 2");
  CHECK(names.link({1, 0, 7}) == "link 7");
  CHECK(names.link({2, 0, 0}) == "ro?ot");
  CHECK(names.link({3, 0, 1}) == "link 1");
  CHECK(names.link({5, 0, 0}) == "body");
}

}  // namespace
}  // namespace cab::tests
