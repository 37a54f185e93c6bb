// The clock of an animation whose keys disagree: by times of keys, and from a file to frames.
#include "scenes/import/scene_clock.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_skin.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using namespace cab::scenes;
using namespace cab::tests;
using Times = KeyTimes;

struct MadeClock {
  SceneClock clock;
  std::vector<std::string> notes;
  std::vector<Alteration> alterations;
};

// The clock of tracks of positions with keys at these ticks.
MadeClock clock_of(const std::vector<Times>& tracks, double ticks_per_second = 1, double own_rate = 0) {
  MadeClock made;
  made.clock = make_clock(tracks, {ticks_per_second, own_rate, 1}, "clip", made.notes, made.alterations);
  return made;
}

// Keys at first, first + step, and so on.
Times keys(std::size_t count, double step, double first = 0) {
  Times times;
  for (std::size_t k = 0; k < count; ++k) times.push_back(first + static_cast<double>(k) * step);
  return times;
}

Times with_more(Times times, const Times& more) {
  times.insert(times.end(), more.begin(), more.end());
  std::sort(times.begin(), times.end());
  return times;
}

void check_clock(const MadeClock& made, double seconds, std::uint32_t frames) {
  CHECK(made.clock.frame_seconds == doctest::Approx(seconds).epsilon(1e-6));
  CHECK(made.clock.frame_count == frames);
}

}  // namespace

TEST_CASE("extra keys of some tracks, few or many, leave the step of the others, and a note counts these tracks") {
  const double step = 1.0 / 30;
  const Times regular = keys(31, step);
  for (const std::size_t extra : {std::size_t{1}, std::size_t{15}, std::size_t{40}, std::size_t{400}}) {
    CAPTURE(extra);
    const MadeClock made =
        clock_of({regular, regular, with_more(regular, keys(extra, .1 / static_cast<double>(extra + 1), .4001))});
    check_clock(made, step, 31);
    REQUIRE(made.notes.size() == 1);
    CHECK(made.notes[0] ==
          "1 of 3 tracks have keys between the frames, which are 0.03333 s apart (30.00 a second), "
          "the step that tracks keep");
    REQUIRE(made.alterations.size() == 1);
    CHECK(made.alterations[0].kind == AlterationKind::kResampled);
    CHECK(made.alterations[0].count == 1);
  }
  // A track with twice the keys is one of three; as one of two it has the smaller step, which loses no key.
  check_clock(clock_of({regular, regular, keys(61, step / 2)}), step, 31);
  check_clock(clock_of({regular, keys(61, step / 2)}), step / 2, 61);
}

TEST_CASE("the times of tracks are the frames' in ticks, milliseconds or seconds, also where they are rounded") {
  for (const double rate : {23.976, 24.0, 25.0, 29.97, 30.0, 60.0, 120.0}) {
    CAPTURE(rate);
    Times ticks = keys(2001, 1), rounded;
    for (const double tick : ticks) rounded.push_back(1000 * static_cast<double>(static_cast<float>(tick / rate)));
    check_clock(clock_of({ticks, ticks}, rate), 1 / rate, 2001);
    const MadeClock made = clock_of({rounded, rounded}, 1000);
    check_clock(made, 1 / rate, 2001);
    CHECK(made.notes.empty());
  }
}

TEST_CASE("tracks that begin later, end earlier, are constant or have one key leave the clock of the others") {
  const Times regular = keys(61, .05);
  const MadeClock made = clock_of({{0}, {0, 4}, keys(31, .05, 1), regular, {}, {1, 2}, keys(3, 1)});
  check_clock(made, .05, 81);
  CHECK(made.notes.empty());
  // A dense track among many of few keys.
  std::vector<Times> sparse(100, keys(3, 1));
  sparse.push_back(keys(61, 1.0 / 30));
  check_clock(clock_of(sparse), 1.0 / 30, 61);
  // Poses that somebody set, and one track of two keys alone.
  check_clock(clock_of({keys(5, .5), keys(3, 1)}), .5, 5);
  check_clock(clock_of({with_more(keys(11, 1), {4.1, 4.3, 4.4}), keys(11, 1), keys(11, 1)}), 1, 11);
  check_clock(clock_of({{0, 2}}), 2, 2);
  CHECK(clock_of({{0}, {1}}).clock.frame_count == 1);
  CHECK(clock_of({{1, 1, 1}}).clock.frame_count == 1);
}

TEST_CASE("where an exporter dropped keys, frames are the steps that divide what is left") {
  std::mt19937 random(5);
  std::vector<Times> tracks;
  for (int t = 0; t < 20; ++t) {
    Times times = {0};
    while (times.back() < 120) times.push_back(times.back() + 1 + static_cast<double>(random() % 6));
    for (double& time : times) time /= 24;
    tracks.push_back(times);
  }
  const MadeClock made = clock_of(tracks);
  CHECK(made.clock.frame_seconds == doctest::Approx(1.0 / 24).epsilon(1e-6));
  CHECK(made.notes.empty());
}

TEST_CASE("keys without a common step take the file's own rate, or else the mean of the densest track, with a note") {
  const Times irregular = {0, .013, .05, .101, .18, .207, .33, .41, .427, .6};
  const MadeClock own = clock_of({irregular, {0, .21, .5}}, 1, 30);
  check_clock(own, 1.0 / 30, 19);
  REQUIRE(own.notes.size() == 1);
  CHECK(own.notes[0].find("(30.00 a second), the file's own rate") != std::string::npos);
  const MadeClock none = clock_of({irregular, {0, .21, .5}});
  check_clock(none, .6 / 9, 10);
  REQUIRE(none.notes.size() == 1);
  CHECK(none.notes[0].find("the mean step of the densest track") != std::string::npos);
  // Two poses two seconds apart have 61 frames at the file's rate, but a rate of 1 is how FBX says that it has none.
  check_clock(clock_of({{0, 2}}, 1, 30), 1.0 / 30, 61);
  check_clock(clock_of({{0, 2}}, 1, 1), 2, 2);
  // The step that tracks keep comes before the file's rate.
  check_clock(clock_of({keys(61, 1.0 / 60)}, 1, 24), 1.0 / 60, 61);
}

TEST_CASE("a clock that no film has is refused or held in its limits") {
  check_clock(clock_of({keys(11, 1e-5)}), 1e-3, 1);
  CHECK_THROWS_WITH_AS(clock_of({{0, 1e5}}), doctest::Contains("more than an hour"), ImportError);
  CHECK_THROWS_WITH_AS(clock_of({keys(11, .1)}, -1), doctest::Contains("ticks a second"), ImportError);
  CHECK_THROWS_WITH_AS(clock_of({with_more(keys(3, .001), {1e9})}), doctest::Contains("frames x nodes"), ImportError);
  const MadeClock without = clock_of({keys(26, 1)}, 0);
  check_clock(without, .04, 26);
  CHECK(without.notes == std::vector<std::string>{"the file has no clock: 25 ticks a second assumed"});
}

TEST_CASE("a frame of a file with extra keys in one track shows the time of that frame") {
  SkinWriter file;
  std::vector<float> times, more, places, turns;
  for (int k = 0; k <= 30; ++k) times.push_back(static_cast<float>(k) / 30);
  more = times;
  for (int k = 1; k <= 15; ++k) more.push_back(.4f + .1f * static_cast<float>(k) / 16);
  std::sort(more.begin(), more.end());
  for (const float t : times) places.insert(places.end(), {0, 1, t});
  for (const float t : more) {
    const double half = t / 2;
    turns.insert(turns.end(), {0, 0, static_cast<float>(std::sin(half)), static_cast<float>(std::cos(half))});
  }
  const std::size_t regular = file.add(times, "SCALAR", 1), extra = file.add(more, "SCALAR", 1);
  const std::size_t place = file.add(places, "VEC3", 3), turn = file.add(turns, "VEC4", 4);
  file.json["nodes"] = {{{"name", "Upper"}, {"translation", {0, 1, 0}}, {"children", {1}}},
                        {{"name", "Lower"}, {"translation", {0, .4, 0}}, {"children", {2}}},
                        {{"name", "End"}, {"translation", {0, .4, 0}}}};
  file.json["scenes"] = {{{"nodes", {0}}}};
  file.json["animations"] = {{{"samplers",
                               {{{"input", regular}, {"output", place}},
                                {{"input", regular}, {"output", place}},
                                {{"input", extra}, {"output", turn}}}},
                              {"channels",
                               {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}},
                                {{"sampler", 1}, {"target", {{"node", 1}, {"path", "translation"}}}},
                                {{"sampler", 2}, {"target", {{"node", 1}, {"path", "rotation"}}}}}}}};
  file.json["buffers"][0]["byteLength"] = file.bytes.size();
  const TemporaryFile clip("clip.glb", glb({file.json, file.bytes}));
  const Skeleton skeleton = import_skeleton(clip.path(), {});
  CHECK(skeleton.frame_count == 31);
  CHECK(skeleton.frame_seconds == doctest::Approx(1.0 / 30).epsilon(1e-6));
  // In frame 15 Upper is at z = .5; it was at .333 where the clock had 46 frames.
  CHECK(skeleton.positions[3 * (15 * skeleton.joint_names.size()) + 2] == doctest::Approx(.5).epsilon(1e-6));
}
