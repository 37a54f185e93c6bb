#include "perf/tools/run/touching_pairs.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

using perf::Touch;
using perf::TouchingPair;
using perf::TouchingPairs;

// Of the first character and its link against the second one's link 0; a depth below 0 stands for no contact.
Touch touch(std::uint32_t frame, std::uint32_t link, float depth) {
  Touch made = {};
  made.frame = frame;
  made.link_a = link;
  made.character_b = 1;
  if (depth >= 0) made.contact.normal[1] = 1, made.contact.depth = depth;
  return made;
}

scenes::Scene two_characters(std::uint32_t links) {
  scenes::Scene scene;
  scene.frame_count = 100;
  scene.frame_seconds = 0.5;
  for (const char* const name : {"anna", "ben"}) {
    scenes::Character& character = scene.characters.emplace_back();
    character.name = name;
    for (std::uint32_t l = 0; l < links; ++l) character.link_names.push_back("l" + std::to_string(l));
  }
  return scene;
}

TEST_CASE("pairs are sorted by depth, those without one last and by frames, and the first deepest frame counts") {
  TouchingPairs pairs;
  pairs.add({touch(3, 0, -1), touch(3, 1, -1), touch(3, 2, 0.1f), touch(3, 3, 0.2f)});
  pairs.add({touch(4, 1, -1), touch(4, 2, 0.3f), touch(4, 3, -1), touch(5, 2, 0.3f)});
  const std::vector<TouchingPair> sorted = pairs.worst_first();
  REQUIRE(sorted.size() == 4);
  const std::uint32_t links[] = {2, 3, 1, 0}, frames[] = {3, 2, 2, 1};
  for (std::size_t p = 0; p < 4; ++p) {
    CHECK(sorted[p].link_a == links[p]);
    CHECK(sorted[p].frames == frames[p]);
    CHECK(sorted[p].first_frame == 3);
  }
  CHECK(sorted[0].deepest == 0.3f);
  CHECK(sorted[0].deepest_frame == 4);
  CHECK(sorted[1].deepest_frame == 3);
  CHECK_FALSE(sorted[2].deepest);
  const nlohmann::ordered_json json = perf::pairs_json(two_characters(4), sorted);
  CHECK(json[0]["deepest_seconds"] == 2.0);
  CHECK(json[2]["first_seconds"] == 1.5);
  CHECK_FALSE(json[2].contains("deepest_metres"));
}

TEST_CASE("the table has a row for each pair, and at most twenty") {
  for (const std::uint32_t count : {1u, 20u, 21u}) {
    CAPTURE(count);
    const scenes::Scene scene = two_characters(count);
    TouchingPairs pairs;
    std::vector<Touch> touches;
    for (std::uint32_t link = 0; link < count; ++link) touches.push_back(touch(7, link, 0.25f));
    pairs.add(touches);
    std::ostringstream out;
    perf::print_pairs({scene, {0, 100}, 1, Exact::kConvex, 0.125f}, pairs.worst_first(), out);
    const std::string text = out.str();
    CHECK(static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n')) == 2 + std::min(count, 20u));
    const auto has = [&](const std::string& words) { return text.find(words) != std::string::npos; };
    CHECK(has(count == 1 ? "1 pair of links touches" : std::to_string(count) + " pairs of links touch"));
    CHECK(has(" at least 12.5 cm deep in 1 of 100 frames (50.0 s)"));
    CHECK(has("the worst 20 follow") == (count > 20));
    CHECK(has("\nanna l0 - ben l0 "));
    CHECK(has(" 3.50        25.0  3.50\n"));
  }
}

}  // namespace
}  // namespace cab::tests
