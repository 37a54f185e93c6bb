// Crowds: the rig and motion of the humanoid, the number of touching links, and the places of characters that play
// clips or follow recorded ways.
#include "scenes/crowd/crowd.h"

#include "perf/harness/world.h"
#include "scenes/crowd/clip_crowd.h"
#include "scenes/crowd/humanoid.h"
#include "scenes/scene_list.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"
#include "tests/sanitizers.h"
#include "tests/scenes/crowd/made_crowds.h"
#include "tests/scenes/temporary_file.h"

#include <cab/cab.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <tuple>
#include <vector>

namespace cab::tests {
namespace {

using scenes::conjugate;
using scenes::length;
using scenes::multiply;
using scenes::operator-;
using scenes::Character;
using scenes::Crowd;
using scenes::PosedGroup;
using scenes::Quat;
using scenes::rotate;
using scenes::Vec3;

constexpr double kPi = 3.141592653589793;

struct Frame {
  std::vector<Hit> hits;
  FrameStats stats;
};

Frame run(const Crowd& crowd, const std::vector<PosedGroup>& posed, const Policies& policies,
          const EngineDesc& desc = {}) {
  Engine* engine = nullptr;
  REQUIRE(create_engine(desc, &engine) == Status::kOk);
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;
  for (std::size_t g = 0; g < posed.size(); ++g) {
    const scenes::ArticulationStorage storage(crowd.groups[g].figure);
    ArticulationId id;
    BatchInput input;
    REQUIRE(add_articulation(*engine, storage.desc(), &id) == Status::kOk);
    REQUIRE(add_batch(*engine, {id, crowd.groups[g].count, BatchKind::kCharacters}, &input.batch) == Status::kOk);
    input.poses.data = posed[g].poses.data();
    input.origins = posed[g].origins;
    input.orientations = posed[g].orientations;
    inputs.push_back(input);
    for (const BatchInput& other : inputs) rules.push_back({other.batch, input.batch, Pairing::kBetween});
  }
  Frame frame;
  FrameJob job;
  job.inputs = inputs;
  job.rules = rules;
  job.policies = policies;
  if (run_frame(*engine, job) == Status::kHitsOverflow) {
    frame.hits.resize(job.hits_needed);
    job.hits = frame.hits;
    REQUIRE(run_frame(*engine, job) == Status::kOk);
  }
  frame.stats = job.stats;
  destroy_engine(engine);
  return frame;
}

bool same_hit(const Hit& a, const Hit& b) {
  const auto key = [](const Hit& h) {
    return std::tuple(h.batch_a.value, h.instance_a, h.link_a, h.batch_b.value, h.instance_b, h.link_b);
  };
  return key(a) == key(b);
}

Quat rotation(const std::vector<float>& poses, std::size_t link) {
  const float* const q = poses.data() + 7 * link;
  return {q[0], q[1], q[2], q[3]};
}
Vec3 translation(const std::vector<float>& poses, std::size_t link) {
  const float* const t = poses.data() + 7 * link + 4;
  return {t[0], t[1], t[2]};
}

}  // namespace

TEST_CASE("the humanoid is a rig of 16 links that stands on the ground") {
  const Character humanoid = scenes::make_humanoid();
  CHECK(humanoid.link_parents.size() == scenes::kHumanoidLinks);
  CHECK(humanoid.leaves.size() == scenes::kHumanoidLinks);
  CHECK(std::set<std::string>(humanoid.link_names.begin(), humanoid.link_names.end()).size() == scenes::kHumanoidLinks);
  for (std::uint32_t l = 0; l < scenes::kHumanoidLinks; ++l) CHECK(humanoid.leaves[l].link == l);

  // All rotations are about z, which changes no heights, from the soles to the top of the head.
  scenes::HumanoidMotion still = {};
  for (Vec3& axis : still.axes) axis = {0, 0, 1};
  std::vector<float> poses(scenes::kHumanoidPoseFloats);
  double origin[3];
  scenes::pose_humanoid(still, 3, 4, 0, poses.data(), origin);
  CHECK(origin[0] == 3);
  CHECK(origin[1] == 4);
  double low = 9, high = -9;
  for (std::uint32_t l = 0; l < scenes::kHumanoidLinks; ++l) {
    const double z = origin[2] + translation(poses, l)[2] + static_cast<double>(humanoid.leaves[l].box.center[2]);
    low = std::min(low, z - static_cast<double>(humanoid.leaves[l].box.half[2]));
    high = std::max(high, z + static_cast<double>(humanoid.leaves[l].box.half[2]));
  }
  CHECK(low == doctest::Approx(.95 - .03 - .44 - .42 - .03 - .035).epsilon(1e-6));
  CHECK(high == doctest::Approx(.95 + .10 + .18 + .30 + .28).epsilon(1e-6));
}

TEST_CASE("links rotate about their axes by the formula, joints hold together, and the root walks where it faces") {
  // Worst measured 7.8e-8, of quaternions and metres, from rounding poses to float.
  constexpr double kTolerance = 3e-7;
  constexpr double kAmplitudes[] = {.10, .15, .15, .25, .6, .6, .3, .6, .6, .3, .4, .4, .2, .4, .4, .2};
  constexpr double kJointLengths[] = {0,   .10, .18,         .30, .3255764119, .30,         .26, .3255764119,
                                      .30, .26, .1044030651, .44, .42,         .1044030651, .44, .42};
  const Character humanoid = scenes::make_humanoid();
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    scenes::Random random(seed);
    const scenes::HumanoidMotion motion = scenes::draw_humanoid(random);
    const double t = .37 + static_cast<double>(seed);
    std::vector<float> poses(scenes::kHumanoidPoseFloats);
    double origin[3];
    scenes::pose_humanoid(motion, 5, -7, t, poses.data(), origin);
    const Quat yaw = {0, 0, std::sin(motion.yaw / 2), std::cos(motion.yaw / 2)};
    const Vec3 way = rotate(yaw, Vec3{0, motion.speed * t, 0});
    CHECK(std::abs(origin[0] - 5 - way[0]) < 1e-9);
    CHECK(std::abs(origin[1] + 7 - way[1]) < 1e-9);
    CHECK(motion.speed >= .85);
    CHECK(motion.speed < 1.15);
    double worst_turn = 0, worst_joint = 0;
    for (std::uint32_t l = 0; l < scenes::kHumanoidLinks; ++l) {
      const auto parent = static_cast<std::size_t>(std::max(humanoid.link_parents[l], 0));
      const Quat local = multiply(conjugate(l == 0 ? yaw : rotation(poses, parent)), rotation(poses, l));
      const double angle = motion.bases[l] + .3 * kAmplitudes[l] * std::sin(motion.phase + .7 * l + 2 * kPi * t);
      worst_turn = std::max(worst_turn, std::abs(local[3] - std::cos(angle / 2)));
      for (std::size_t k = 0; k < 3; ++k)
        worst_turn = std::max(worst_turn, std::abs(local[k] - std::sin(angle / 2) * motion.axes[l][k]));
      const double distance = length(translation(poses, l) - translation(poses, parent));
      worst_joint = std::max(worst_joint, std::abs(distance - kJointLengths[l]));
    }
    CHECK(worst_turn < kTolerance);
    CHECK(worst_joint < kTolerance);
  }
}

TEST_CASE("random draws have the moments of their distributions") {
  scenes::Random random(7);
  constexpr int kDraws = 100000;
  // Five deviations of the mean of this many draws of deviation 1.
  const double tolerance = 5 / std::sqrt(kDraws);
  double normal = 0, normal_sq = 0, third = 0;
  Vec3 sum = {0, 0, 0};
  for (int draw = 0; draw < kDraws; ++draw) {
    const double x = random.normal();
    normal += x / kDraws;
    normal_sq += x * x / kDraws;
    const Vec3 axis = random.unit_vector();
    CHECK_MESSAGE(std::abs(length(axis) - 1) < 1e-12, "draw ", draw);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += axis[k] / kDraws;
    third += axis[0] * axis[0] / kDraws;
  }
  CHECK(std::abs(normal) < tolerance);
  CHECK(std::abs(normal_sq - 1) < 2 * tolerance);
  CHECK(length(sum) < tolerance);
  CHECK(std::abs(third - 1.0 / 3) < tolerance);
}

// Every strategy.
std::vector<Policies> strategies() {
  std::vector<Policies> out;
  for (const Strategy strategy :
       {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute, Strategy::kAuto}) {
    out.emplace_back();
    out.back().strategy = strategy;
  }
  return out;
}

TEST_CASE("humanoids touch as often as the scene says, and every strategy finds the same links") {
  for (const scenes::NamedScene& row : scenes::scene_list()) {
    if (!row.is_for(scenes::kCrowdCommand)) continue;
    const std::string name = row.name;
    const scenes::CrowdScene& scene = scenes::crowd_scene(name);
    if (scene.clips == scenes::ClipUse::kNeeded) continue;
    CAPTURE(name);
    if (name == "detailed" || name == "ropes") continue;  // in large_test.cpp
    const bool known = scene.pairs_per_character > 0;
    const std::uint32_t count = known ? 2000 : 150;
    const Crowd crowd = scenes::make_crowd(name, count);
    CHECK(crowd.count() == count);
    const std::vector<PosedGroup> posed = posed_at(crowd, 0);
    const Frame expected = run(crowd, posed, strategies()[2]);
    CHECK(expected.stats.instances_masked == 0);
    CHECK(expected.hits.empty() == (name == "far" || name == "skins"));  // nobody there is near another
    const double pairs = static_cast<double>(expected.stats.leaf_pairs) / count;
    CAPTURE(pairs);
    if (known) CHECK(std::abs(pairs - scene.pairs_per_character) <= scene.tolerance * scene.pairs_per_character);
    for (const Policies& policies : strategies()) {
      CAPTURE(static_cast<int>(policies.strategy));
      const Frame frame = run(crowd, posed, policies);
      CHECK(frame.stats.leaf_pairs == expected.stats.leaf_pairs);
      CHECK(std::equal(frame.hits.begin(), frame.hits.end(), expected.hits.begin(), expected.hits.end(), same_hit));
    }
  }
}

TEST_CASE("a crowd's hits are the same for every strategy, instruction set and thread count") {
  tests::ThreadPool three(3);
  const Scheduler callers = three.scheduler();
  for (const std::uint32_t count : {200u, 2000u, 20000u}) {
    if ((tests::kThreadSanitizer && count > 200) || (tests::runs_fewer_rounds() && count > 2000)) {
      MESSAGE("skipped under a sanitizer: " << count << " characters take minutes");
      continue;
    }
    CAPTURE(count);
    const Crowd crowd = scenes::make_crowd("uniform", count);
    const std::vector<PosedGroup> posed = posed_at(crowd, 0);
    EngineDesc desc;
    desc.isa = Isa::kScalar;
    const std::vector<Hit> expected = run(crowd, posed, {}, desc).hits;
    CHECK(expected.size() > 4 * count);
    const auto check = [&](const Policies& policies) {
      CAPTURE(to_string(desc.isa));
      CAPTURE(static_cast<int>(policies.strategy));
      const std::vector<Hit> hits = run(crowd, posed, policies, desc).hits;
      CHECK(std::equal(hits.begin(), hits.end(), expected.begin(), expected.end(), same_hit));
    };
    for (const Isa isa : oracle::available_isas()) {
      desc.isa = isa;
      for (const Policies& policies : strategies())
        if (isa != Isa::kScalar || count < 20000) check(policies);
    }
    desc.isa = Isa::kAuto;
    for (const std::uint32_t threads : {2u, 8u}) {
      desc.thread_count = threads;
      check({});
    }
    desc.scheduler = &callers;
    check({});
  }
}

TEST_CASE("a crowd is the same each time it is made, does not depend on earlier poses, and moves with time") {
  for (const std::string name : {"uniform", "jitter"}) {
    CAPTURE(name);
    const Crowd crowd = scenes::make_crowd(name, 300);
    CHECK(crowd.count() == 300);
    const std::uint64_t at_0 = pose_hash(posed_at(crowd, 0)), at_1 = pose_hash(posed_at(crowd, 1.0 / 30));
    CHECK(at_0 != at_1);
    std::vector<PosedGroup> posed = posed_at(scenes::make_crowd(name, 300), 1.0 / 30);
    CHECK(pose_hash(posed) == at_1);
    scenes::pose_crowd(crowd, 0, posed);
    CHECK(pose_hash(posed) == at_0);
    const std::vector<PosedGroup> later = posed_at(crowd, 1);
    for (std::size_t i = 0; i < 300; ++i) {
      const double dx = later[0].origins[3 * i] - posed[0].origins[3 * i];
      const double dy = later[0].origins[3 * i + 1] - posed[0].origins[3 * i + 1];
      CHECK(std::abs(std::hypot(dx, dy) - 1) < .15 + 1e-9);
    }
  }
}

TEST_CASE("some characters of a crowd are posed as they are among all") {
  scenes::CrowdSources sources;
  sources.clips = {walking_stick(), walking_stick()};
  sources.trajectories.tracks = {straight_track(0, 0, 0), straight_track(1, 2, 1)};
  for (const scenes::NamedScene& scene : scenes::scene_list()) {
    if (!scene.is_for(scenes::kCrowdCommand)) continue;
    CAPTURE(scene.name);
    const scenes::CrowdScene& source = scenes::crowd_scene(scene.name);
    scenes::CrowdSources given = sources;
    if (source.clips == scenes::ClipUse::kNone) given.clips.clear();
    const Crowd crowd = scenes::make_crowd(scene.name, 60, given);
    const std::vector<PosedGroup> all = posed_at(crowd, .7);
    for (std::size_t g = 0; g < crowd.groups.size(); ++g) {
      std::vector<std::uint32_t> list;
      for (std::uint32_t i = 0; i < crowd.groups[g].count; ++i)
        if (i % 3 != 1) list.push_back(i);
      std::reverse(list.begin(), list.end());
      PosedGroup some;
      crowd.groups[g].pose(.7, scenes::Chosen::of(list), some);
      PosedGroup expected;
      for (const std::uint32_t i : list) {
        const auto take = [&](const auto& from, auto& to) {
          const std::size_t size = from.size() / crowd.groups[g].count;
          for (std::size_t k = 0; k < size; ++k) to.push_back(from[i * size + k]);
        };
        take(all[g].poses, expected.poses);
        take(all[g].origins, expected.origins);
        take(all[g].orientations, expected.orientations);
        take(all[g].moved, expected.moved);
      }
      CHECK(scenes::pose_hash({some}) == scenes::pose_hash({expected}));
      CHECK(some.poses.size() == expected.poses.size());
      CHECK(some.orientations.size() == expected.orientations.size());
      CHECK(some.moved == expected.moved);
      crowd.groups[g].pose(.7, scenes::Chosen::of({}), some);
      CHECK(some.origins.empty());
    }
  }
}

TEST_CASE("uniform characters fill their square, jittered ones have one grid point each, and neither are sorted") {
  const std::vector<PosedGroup> uniform = posed_at(scenes::make_crowd("uniform", 900), 0);
  const std::vector<PosedGroup> jitter = posed_at(scenes::make_crowd("jitter", 890), 0);
  std::set<std::pair<long, long>> cells;
  std::size_t left = 0, near = 0;
  for (std::size_t i = 0; i < 900; ++i) {
    const double x = uniform[0].origins[3 * i], y = uniform[0].origins[3 * i + 1];
    CHECK(std::min(x, y) >= 0);
    CHECK(std::max(x, y) < 30);
    left += x < 15 ? 1 : 0;
  }
  CHECK(std::abs(static_cast<double>(left) - 450) < 75);  // five deviations
  for (std::size_t i = 0; i < 890; ++i) {
    const double x = jitter[0].origins[3 * i], y = jitter[0].origins[3 * i + 1];
    CHECK(std::abs(x - std::round(x)) <= .25);
    CHECK(std::abs(y - std::round(y)) <= .25);
    CHECK(cells.emplace(std::lround(x), std::lround(y)).second);
    if (i == 0) continue;
    const double from_last = std::hypot(x - jitter[0].origins[3 * i - 3], y - jitter[0].origins[3 * i - 2]);
    near += from_last < 3 ? 1 : 0;
  }
  CHECK(near < 60);  // 3 % in random order, but nearly all in the order of the grid
  CHECK(cells.rbegin()->first == 29);
}

TEST_CASE("characters of churn live for a hundred frames in their square, and in each frame one in a hundred is new") {
  const scenes::Crowd churn = scenes::make_crowd("churn", 900);
  std::vector<PosedGroup> before = posed_at(churn, 0);
  for (std::uint32_t frame = 1; frame <= 100; ++frame) {
    std::vector<PosedGroup> now = posed_at(churn, frame / 30.0);
    std::size_t replaced = 0;
    for (std::size_t i = 0; i < 900; ++i) {
      const double x = now[0].origins[3 * i], y = now[0].origins[3 * i + 1];
      CHECK(std::min(x, y) > -10);  // 100 frames at 3 m/s
      CHECK(std::max(x, y) < 40);
      replaced += std::hypot(x - before[0].origins[3 * i], y - before[0].origins[3 * i + 1]) > 0.2 ? 1 : 0;
    }
    CHECK(replaced >= 8);  // nine, one of which may come where the last one went
    CHECK(replaced <= 9);
    before = std::move(now);
  }
}

TEST_CASE("clips are played upright, from different moments, and with the heading of the character") {
  const auto stand = [](std::uint32_t character, double seconds) {
    return scenes::Standing{10.0 * character, seconds, kPi / 3};
  };
  const Crowd crowd = scenes::clip_crowd({walking_stick(), walking_stick()}, 0, 5, stand);
  REQUIRE(crowd.groups.size() == 2);
  CHECK(crowd.groups[0].count == 3);
  CHECK(crowd.groups[1].count == 2);
  std::set<double> heights;
  for (const double seconds : {0.0, 1.7}) {
    const std::vector<PosedGroup> posed = posed_at(crowd, seconds);
    for (std::size_t g = 0; g < 2; ++g)
      for (std::size_t i = 0; i < crowd.groups[g].count; ++i) {
        const std::vector<float>& q = posed[g].orientations;
        const Quat turn = {q[4 * i], q[4 * i + 1], q[4 * i + 2], q[4 * i + 3]};
        const Vec3 up = rotate(turn, Vec3{0, 1, 0}), way = rotate(turn, Vec3{0, 0, 1});
        CHECK(up[2] == doctest::Approx(1).epsilon(1e-6));
        CHECK(std::atan2(way[1], way[0]) == doctest::Approx(kPi / 3).epsilon(1e-6));
        CHECK(posed[g].origins[3 * i] == 10.0 * static_cast<double>(g + 2 * i));
        CHECK(posed[g].origins[3 * i + 1] == seconds);
        CHECK(posed[g].origins[3 * i + 2] >= 0);
        CHECK(posed[g].origins[3 * i + 2] <= .19 + 1e-9);
        heights.insert(posed[g].origins[3 * i + 2]);
      }
  }
  CHECK(heights.size() > 4);  // the height of the root shows which frame of the clip is played
  const Crowd fewer = scenes::clip_crowd({walking_stick(), walking_stick()}, 'y', 1, stand);
  CHECK(fewer.groups.size() == 1);
  CHECK(fewer.count() == 1);
}

TEST_CASE("bottleneck characters are the people of the recording, copy by copy, and walk on along their ways") {
  scenes::CrowdSources sources;
  sources.clips.push_back(walking_stick());
  sources.trajectories.tracks = {straight_track(0, 0, 0), straight_track(0, 5, 0)};
  const Crowd crowd = scenes::make_crowd("bottleneck", 41, sources);
  CHECK(crowd.count() == 41);
  const std::vector<PosedGroup> start = posed_at(crowd, 0), later = posed_at(crowd, .5);
  // Copies are 10 + 2 m apart in x, 5 + 2 m in y, five of them side by side.
  std::set<std::tuple<int, int, int>> taken;
  for (std::size_t i = 0; i < 41; ++i) {
    const double x = start[0].origins[3 * i], y = start[0].origins[3 * i + 1];
    const double in_x = std::fmod(x, 12), in_y = std::fmod(y, 7);
    CHECK(in_x >= 0);
    CHECK(in_x <= 10);
    CHECK(x < 5 * 12);
    CHECK((in_y == 0 || in_y == 5));
    CHECK(taken.emplace(static_cast<int>(x / 12), static_cast<int>(y / 7), static_cast<int>(in_y)).second);
    // Half a second later on the way, or at its beginning again.
    const double on = later[0].origins[3 * i] - x;
    CHECK(std::min(std::abs(on - .5), std::abs(on + 9.5)) < 1e-9);
    CHECK(later[0].origins[3 * i + 1] == y);
  }
}

TEST_CASE("characters that play clips touch, and all strategies find the same links of several articulations") {
  const char* data = std::getenv("CAB_DATA_DIR");
  if (data == nullptr) {
    MESSAGE("skipped: CAB_DATA_DIR is not set");
    return;
  }
  const std::string folder = data;
  scenes::CrowdSources sources;
  scenes::ImportOptions options;
  for (const auto& [file, unit] : {std::pair("cmu1_jumping_jacks", .0564), std::pair("fair1_zombie", .04)}) {
    options.metres_per_unit = unit;
    sources.clips.push_back(scenes::import_clip(folder + "/bvh/" + file + ".bvh", options));
  }
  sources.trajectories = scenes::import_trajectories(folder + "/crowd/juelich_bottleneck_040_c_56_h.txt");
  CHECK(sources.trajectories.tracks.size() == 75);
  for (const std::string name : {"battle", "bottleneck"}) {
    CAPTURE(name);
    const Crowd crowd = scenes::make_crowd(name, 301, sources);
    REQUIRE(crowd.groups.size() == 2);
    const std::vector<PosedGroup> posed = posed_at(crowd, .2);
    CHECK(pose_hash(posed) == pose_hash(posed_at(crowd, .2)));
    CHECK(pose_hash(posed) != pose_hash(posed_at(crowd, .4)));
    // Heads are above feet: every figure is upright, between the ground and 2.5 m.
    for (std::size_t g = 0; g < 2; ++g) {
      const std::size_t links = crowd.groups[g].figure.link_parents.size();
      for (std::size_t i = 0; i < crowd.groups[g].count; ++i) {
        const std::vector<float>& q = posed[g].orientations;
        double low = 9, high = -9;
        for (std::size_t l = 0; l < links; ++l) {
          const Vec3 place = rotate(Quat{q[4 * i], q[4 * i + 1], q[4 * i + 2], q[4 * i + 3]},
                                    translation(posed[g].poses, i * links + l));
          low = std::min(low, posed[g].origins[3 * i + 2] + place[2]);
          high = std::max(high, posed[g].origins[3 * i + 2] + place[2]);
        }
        CHECK(low > -1e-6);
        CHECK(high > 1.2);
        CHECK(high < 2.5);
      }
    }
    const Frame expected = run(crowd, posed, {Refit::kCab, Strategy::kBrute});
    CHECK(expected.hits.size() > 301);
    CHECK(expected.stats.instances_masked == 0);
    for (const Policies& policies : strategies()) {
      const Frame frame = run(crowd, posed, policies);
      CHECK(std::equal(frame.hits.begin(), frame.hits.end(), expected.hits.begin(), expected.hits.end(), same_hit));
    }
  }
}

TEST_CASE("crowds that cannot be made are refused") {
  CHECK_THROWS_AS(scenes::make_crowd("party", 10), std::invalid_argument);
  CHECK_THROWS_AS(scenes::make_crowd("uniform", 0), std::invalid_argument);
  CHECK_THROWS_AS(scenes::make_crowd("battle", 10), std::invalid_argument);
  scenes::CrowdSources sources;
  sources.clips.push_back(walking_stick());
  CHECK_THROWS_AS(scenes::make_crowd("bottleneck", 10, sources), std::invalid_argument);
  CHECK(scenes::make_crowd("battle", 10, sources).count() == 10);
}

TEST_CASE("trajectories are read in any order of lines, and headings follow the way") {
  // Person 7 walks along +y at 1 m/s and then stands. Person 3 has one sample.
  std::string text = "# framerate: 10.00 fps\n# id frame x/m y/m\n3 0 9 9\n";
  for (int frame = 29; frame >= 0; --frame)
    text += "7\t" + std::to_string(frame) + "\t2\t" + std::to_string(.1 * std::min(frame, 10)) + "\t1.7\r\n";
  const TemporaryFile file("way.txt", text);
  const scenes::Trajectories read = scenes::import_trajectories(file.path());
  REQUIRE(read.tracks.size() == 1);
  const scenes::Track& track = read.tracks[0];
  REQUIRE(track.seconds.size() == 30);
  CHECK(track.seconds[29] == doctest::Approx(2.9));
  for (const double heading : track.headings) CHECK(heading == doctest::Approx(kPi / 2));
  const scenes::Standing between = stand_on(track, .55);
  CHECK(between.x == 2);
  CHECK(between.y == doctest::Approx(.55));
  CHECK(stand_on(track, -1).y == 0);
  CHECK(stand_on(track, 99).y == doctest::Approx(1));
}

TEST_CASE(
    "the columns of trajectories are found by names, by their number, or by the usual order, and a note says so") {
  // Two people in two frames; person 1 walks from (1, 2) to (1.5, 2).
  struct Form {
    std::string text;
    double frames_per_second;
    std::string note;
  };
  const std::string obsmat =
      "  7.8000000e+01   1.0000000e+00   1.0000000e+00   9.0000000e+00   2.0000000e+00   1.0e+00   0.0e+00   0.0e+00\n"
      "  7.8000000e+01   2.0000000e+00   5.0000000e+00   9.0000000e+00   5.0000000e+00   0.0e+00   0.0e+00   0.0e+00\n"
      "  8.4000000e+01   1.0000000e+00   1.5000000e+00   9.0000000e+00   2.0000000e+00   1.0e+00   0.0e+00   0.0e+00\n"
      "  8.4000000e+01   2.0000000e+00   5.0000000e+00   9.0000000e+00   5.0000000e+00   0.0e+00   0.0e+00   0.0e+00\n";
  const std::string rows = "1 78 1 2\n2 78 5 5\n1 84 1.5 2\n2 84 5 5\n";
  const std::vector<Form> forms = {
      {obsmat, 12, "eight columns are read as frame id x z y and velocities"},
      {"[frame_number pedestrian_ID pos_x pos_z pos_y v_x v_z v_y]\n" + obsmat, 12, ""},
      {rows, 12, "columns are read as id frame x y"},
      {"# framerate: 12.00\n# id frame x/m y/m\n" + rows, 0, ""},
      {"\xef\xbb\xbf# FPS = 12\n" + rows, 0, "columns are read as id frame x y"},
      {"#description: made\n#framerate: 12\n#ID: the number\n#X,Y,Z: metres\n\n#ID\tFR\tX\tY\tZ\tA\tB\tANGLE\tCOLOR\n"
       "1\t78\t1\t2\t0\t.3\t.2\t0\t1\n1\t84\t1.5\t2\t0\t.3\t.2\t0\t1\n2\t78\t5\t5\t0\t.3\t.2\t0\t1\n2\t84\t5\t5\t0\t."
       "3\t.2\t0\t1\n",
       12, ""},
      {"frame,ped_id,y,x\r\n78,1,2,1\r\n78,2,5,5\r\n84, 1, 2, 1.5\r\n84,2,5,5\r\n", 12, ""},
      {"\"x_cm\";\"y_cm\";\"id\";\"frame\"\n100;200;1;78\n+1.5e2;200;1;84\n500;500;2;78\n500;500;2;84\n", 12, ""},
  };
  for (const Form& form : forms) {
    CAPTURE(form.text);
    const TemporaryFile file("way.txt", form.text);
    const scenes::Trajectories read = scenes::import_trajectories(file.path(), form.frames_per_second);
    REQUIRE(read.tracks.size() == 2);
    CHECK(read.tracks[0].seconds == std::vector<double>{6.5, 7});
    CHECK(read.tracks[0].places == std::vector<double>{1, 2, 1.5, 2});
    CHECK(read.tracks[1].places == std::vector<double>{5, 5, 5, 5});
    CHECK(read.notes.empty() == form.note.empty());
    if (!read.notes.empty()) CHECK(read.notes[0].find(form.note) != std::string::npos);
  }
}

TEST_CASE("bad trajectory files are refused with the line and the reason") {
  const std::string head = "# framerate: 25 fps\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {head, "nobody"},
      {head + "1 0 1 2\n", "nobody"},
      {"1 0 1 2\n1 1 1 2\n", "framerate"},
      {"# framerate: fast fps\n1 0 1 2\n1 1 1 2\n", "framerate"},
      {"# framerate: -25 fps\n1 0 1 2\n1 1 1 2\n", "framerate"},
      {head + "1 0 1\n", ":2: column 4 (y) is missing: the line has 3"},
      {head + "id frame x z\n1 0 1 2\n", ":2: the header has no column y"},
      {head + "id,frame,x,y\n1,,1,2\n", ":3: column 2 (frame): '' is not a number"},
      {head + "1 0.5 1 2\n", ":2: column 2 (frame): '0.5' is not a whole number"},
      {head + "1e300 0 1 2\n", ":2: column 1 (id): '1e300' is not a whole number"},
      {head + "1 inf 1 2\n", ":2: column 2 (frame): 'inf' is not a whole number"},
      {"# framerate: 1e9\n1 0 1 2\n1 1 1 2\n", "framerate"},
      {"0 1 1 0 2 0 0 0\n1 1 1 0 2 0 0\n1 1 1 0\n", ":3: column 5 (y) is missing: the line has 4"},
      {head + "1 0 1 2\n1 1 x 2\n", ":3: "},
      {head + "1 0 1 2\n1 1 1 nan\n", ":3: x and y must be finite"},
      {head + "1 0 1 2\n1 1 1 2e9\n", ":3: x and y"},
      {head + "1 -1 1 2\n", ":2: "},
      {head + "1 2000000000 1 2\n", ":2: frames"},
      {head + "1 0 1 2\n1 0 1 3\n", ":3: person 1 is twice in frame 0"},
  };
  for (const auto& entry : cases) {  // clang cannot capture structured bindings
    const std::string &text = entry.first, &reason = entry.second;
    CAPTURE(text);
    const TemporaryFile file("bad.txt", text);
    std::string told;
    try {
      scenes::import_trajectories(file.path());
    } catch (const scenes::ImportError& error) { told = error.what(); }
    CAPTURE(told);
    CHECK(told.find("bad.txt") != std::string::npos);
    CHECK(told.find(reason) != std::string::npos);
  }
  const TemporaryFile own("way.txt", head + "1 0 1 2\n1 1 1 2\n");
  CHECK(scenes::import_trajectories(own.path(), 25).tracks.size() == 1);
  CHECK_THROWS_WITH_AS(scenes::import_trajectories(own.path(), 30),
                       (own.path() + ": the file has a frame rate of its own; leave out --fps").c_str(),
                       scenes::ImportError);
  CHECK_THROWS_AS(scenes::import_trajectories("/nonexistent/way.txt"), scenes::ImportError);
  CHECK_THROWS_AS(scenes::import_trajectories("/tmp"), scenes::ImportError);
}

}  // namespace cab::tests
