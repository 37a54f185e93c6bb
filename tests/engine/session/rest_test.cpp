// BatchInput::moved and PairRule::resting: frames in which some characters rest.
#include "engine/session/rest.h"

#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/engine/small_store.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>

namespace cab::tests {
namespace {

using namespace cab::oracle;

Member crowd_of(Random& random, std::uint32_t count, PoseFormat format, double spread) {
  Member member;
  member.rig = random_rig(random, Topology::kTree, 4, 2);
  member.poses = random_poses(random, member.rig, count, format, {spread, random.chance(0.5), true, {}});
  return member;
}

// How far two crowds spread, and a fifth of them in as dense a crowd.
constexpr double kSpread = 2.5, kFewSpread = 1.5;

// Two batches, enough of them to fill the kept grid more than once, or a fifth of that.
World two_crowds(Random& random, Resting resting, bool few = false) {
  World world;
  const double spread = few ? kFewSpread : kSpread;
  world.members.push_back(crowd_of(random, few ? 46 : 230, PoseFormat::kQuaternionTranslation, spread));
  world.members.push_back(crowd_of(random, few ? 24 : 120, PoseFormat::kMatrix3x4Rows, spread));
  world.rules = {{{1}, {1}, Pairing::kBetween, resting},
                 {{1}, {2}, Pairing::kBetween, resting},
                 {{2}, {2}, Pairing::kWithin, resting}};
  return world;
}

// Copies the pose and the place of an instance from another crowd of the same rig.
void take_instance(const Poses& from, std::uint32_t instance, Poses& to) {
  const auto copy = [instance, &to](const auto& source, auto& target) {
    const std::size_t per = source.size() / to.instance_count;
    std::copy_n(source.begin() + static_cast<std::ptrdiff_t>(instance * per), per,
                target.begin() + static_cast<std::ptrdiff_t>(instance * per));
  };
  copy(from.data, to.data);
  copy(from.origins, to.origins);
  copy(from.orientations, to.orientations);
}

// A world that goes on: which instances move in a frame, and what the engine says of it.
struct Story {
  World world;
  std::vector<std::vector<std::uint8_t>> moved, flags, in_contact;
  std::vector<std::vector<std::uint32_t>> lists = {{}, {}};
  std::vector<std::vector<float>> margins = {{}, {}};
  std::vector<std::uint32_t> counts = {kAllInstances, kAllInstances};
  Report report = Report::kHits;
  bool containment = true;

  explicit Story(const World& start) : world(start) {
    for (const Member& member : world.members) moved.emplace_back(member.poses.instance_count, std::uint8_t{1});
  }

  // Moves about this share of the instances to another place, in another pose.
  void move(Random& random, double share, double spread = kSpread) {
    for (std::size_t m = 0; m < world.members.size(); ++m) {
      Poses& poses = world.members[m].poses;
      const Poses next = random_poses(random, world.members[m].rig, poses.instance_count, poses.format,
                                      {spread, !poses.orientations.empty(), true, {}});
      for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
        moved[m][i] = random.chance(share) ? static_cast<std::uint8_t>(1 + random.index(255)) : std::uint8_t{0};
        if (moved[m][i]) take_instance(next, i, poses);
      }
    }
  }
  void all_rest() {
    for (auto& bytes : moved) std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
  }

  bool rests(BatchSlot batch, std::uint32_t instance) const { return moved[batch.value - 1][instance] == 0; }

  Status try_run(Engine& engine, const Policies& policies, std::size_t room, Outcome& out) {
    std::vector<BatchInput> inputs;
    flags.clear();
    in_contact.clear();
    for (const Member& member : world.members) {
      flags.emplace_back(member.poses.instance_count, std::uint8_t{0xee});
      in_contact.emplace_back(member.poses.instance_count, std::uint8_t{0xee});
    }
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      inputs.push_back(world.members[m].poses.input({m + 1}));
      inputs[m].moved = moved[m];
      inputs[m].flags = flags[m];
      inputs[m].in_contact = in_contact[m];
      inputs[m].instances = lists[m];
      inputs[m].margins = margins[m];
      inputs[m].count = counts[m];
      inputs[m].layers = world.members[m].layers;
      inputs[m].layer_masks = world.members[m].layer_masks;
    }
    out.hits.assign(room, {});
    FrameJob job;
    job.inputs = inputs;
    job.rules = world.rules;
    job.policies = policies;
    job.margin = world.margin;
    job.min_depth = world.min_depth;
    job.report = report;
    job.containment = containment;
    job.hits = out.hits;
    const Status status = run_frame(engine, job);
    out.hits.resize(status == Status::kOk ? job.hit_count : 0);
    out.stats = job.stats;
    return status;
  }
  Outcome run(Engine& engine, const Policies& policies = {}) {
    Outcome out;
    REQUIRE(try_run(engine, policies, 60000, out) == Status::kOk);
    return out;
  }
};

// The hits without those of two instances that both rest.
std::vector<Hit> without_resting(const Story& story, std::vector<Hit> hits) {
  hits.erase(std::remove_if(hits.begin(), hits.end(),
                            [&story](const Hit& hit) {
                              return story.rests(hit.batch_a, hit.instance_a) &&
                                     story.rests(hit.batch_b, hit.instance_b);
                            }),
             hits.end());
  return hits;
}

std::uint64_t resting_count(const Story& story) {
  std::uint64_t count = 0;
  for (const auto& bytes : story.moved)
    count += static_cast<std::uint64_t>(std::count(bytes.begin(), bytes.end(), std::uint8_t{0}));
  return count;
}

}  // namespace

TEST_CASE("a frame in which some rest has the hits of one in which all have moved, without those that a rule skips") {
  ThreadPool pool(4);
  const Scheduler scheduler = pool.scheduler();
  for (const Strategy strategy : {Strategy::kAuto, Strategy::kTree, Strategy::kLinks, Strategy::kBrute}) {
    CAPTURE(static_cast<int>(strategy));
    const bool tests_all = strategy == Strategy::kBrute;
    std::size_t hits = 0, skipped = 0, kept = 0;
    for (std::uint64_t seed = 1; seed <= rounds(4); ++seed)
      for (const Resting resting : {Resting::kReported, Resting::kSkipped}) {
        CAPTURE(seed);
        Random random(seed);
        Story story(two_crowds(random, resting, tests_all));
        if (random.chance(0.5)) story.world.margin = 0.05f;
        if (random.chance(0.3))
          for (Member& member : story.world.members) {
            for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
              member.layers.push_back(1u << random.index(3)), member.layer_masks.push_back(1 + random.index(7));
          }
        const Policies policies = {Refit::kCab, strategy, Exact::kNone};
        EngineDesc desc;
        if (random.chance(0.5)) desc.scheduler = &scheduler;
        const EnginePtr engine = make_engine_for(story.world, desc), skipping = make_engine_for(story.world);
        for (int frame = 0; frame < 8; ++frame) {
          CAPTURE(frame);
          const double shares[] = {1, 0, 0.1, 0.02, 0, 0.5, 0.9, 0.1};
          if (frame > 0) story.move(random, shares[frame], tests_all ? kFewSpread : kSpread);
          const Outcome found = story.run(*engine, policies), all = run_world(story.world, policies);
          const bool skips = resting == Resting::kSkipped && frame > 0;
          const std::vector<Hit> expected = skips ? without_resting(story, all.hits) : all.hits;
          CHECK(same_hits(found.hits, expected));
          CHECK(story.in_contact == in_contact_by(story.world, expected));
          CHECK(found.stats.instances_resting == (frame > 0 ? resting_count(story) : 0));
          CHECK(found.stats.instances_masked == 0);
          // What is kept is not tested: the counts are those of a frame that skips it.
          Story skipped_story = story;
          for (PairRule& rule : skipped_story.world.rules) rule.resting = Resting::kSkipped;
          const Outcome fewer = skipped_story.run(*skipping, policies);
          const bool keeps = resting == Resting::kReported;
          const FrameStats& tested = keeps || skips ? fewer.stats : all.stats;
          CHECK(found.stats.candidates == tested.candidates);
          CHECK(same_counts(found.stats, tested));
          CHECK(found.stats.hits_kept == (keeps ? all.hits.size() - fewer.hits.size() : 0));
          for (const auto& flags : story.flags)
            CHECK(std::all_of(flags.begin(), flags.end(), [](std::uint8_t flag) { return flag == kInstanceOk; }));
          hits += found.hits.size();
          skipped += all.hits.size() - found.hits.size();
          kept += engine->crowd.kept.end_sorted;
        }
      }
    CHECK(hits >= least_count(tests_all ? 4000 : 30000, 4));
    CHECK(skipped >= least_count(tests_all ? 1800 : 12000, 4));
    CHECK(kept >= least_count(tests_all ? 2000 : 10000, 4));
  }
}

TEST_CASE("characters of very different sizes find each other whoever rests") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(8); ++seed)
    for (const Resting resting : {Resting::kReported, Resting::kSkipped}) {
      CAPTURE(seed);
      Random random(seed);
      World world = two_crowds(random, resting);
      for (Member& member : world.members)
        for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
          member.poses.scales.push_back(
              static_cast<float>(random.chance(0.05) ? random.uniform(20, 300) : random.uniform(0.01, 1)));
      Story story(world);
      const EnginePtr engine = make_engine_for(world);
      for (int frame = 0; frame < 5; ++frame) {
        if (frame > 0) story.move(random, 0.2);
        const Outcome found = story.run(*engine), all = run_world(story.world);
        const bool skips = resting == Resting::kSkipped && frame > 0;
        CHECK(same_hits(found.hits, skips ? without_resting(story, all.hits) : all.hits));
        hits += found.hits.size();
      }
    }
  CHECK(hits >= least_count(10000, 8));
}

TEST_CASE("the store grows with the hits of a frame, whoever rests") {
  Random random(8);
  for (const Resting resting : {Resting::kReported, Resting::kSkipped}) {
    World world = two_crowds(random, resting);
    for (Member& member : world.members) std::fill(member.poses.origins.begin(), member.poses.origins.end(), 0.25);
    Story story(world);
    const EnginePtr engine = make_engine_for(world);
    shrink_store(*engine);
    for (int frame = 0; frame < 4; ++frame) {
      if (frame > 0) {
        story.move(random, 0.15);
        for (Member& member : story.world.members)
          std::fill(member.poses.origins.begin(), member.poses.origins.end(), 0.25);
      }
      Outcome found;
      REQUIRE(story.try_run(*engine, {}, 1000000, found) == Status::kOk);
      const Outcome all = run_world(story.world);
      const bool skips = resting == Resting::kSkipped && frame > 0;
      const std::vector<Hit> expected = skips ? without_resting(story, all.hits) : all.hits;
      CHECK(expected.size() > 5000);
      CHECK(same_hits(found.hits, expected));
      CHECK((found.stats.hits_kept > 0) == (frame > 0 && resting == Resting::kReported));
    }
    CHECK(has_grown(*engine));
  }
}

TEST_CASE("all instances count as moved after a frame that failed, or that had other settings") {
  Random random(9);
  const World start = two_crowds(random, Resting::kSkipped);
  // Runs two frames, then `change`, then a frame in which nothing moves. Returns how many rest in that.
  const auto resting_after = [&](auto&& change) {
    Story story(start);
    const EnginePtr engine = make_engine_for(start);
    story.run(*engine);
    story.all_rest();
    CHECK(story.run(*engine).stats.instances_resting == 350);
    change(*engine, story);
    const Outcome found = story.run(*engine);
    if (found.stats.instances_resting == 0) CHECK(same_hits(found.hits, run_world(story.world).hits));
    CHECK(story.run(*engine).stats.instances_resting == 350);
    return found.stats.instances_resting;
  };
  CHECK(resting_after([](Engine&, Story&) {}) == 350);
  CHECK(resting_after([](Engine&, Story& story) { story.world.margin = 0.25f; }) == 0);
  CHECK(resting_after([](Engine&, Story& story) { story.world.rules.pop_back(); }) == 0);
  CHECK(resting_after([](Engine&, Story& story) { story.world.rules[1].resting = Resting::kReported; }) == 0);
  CHECK(resting_after(
            [](Engine&, Story& story) { std::reverse(story.world.rules.begin(), story.world.rules.end()); }) == 350);
  CHECK(resting_after([](Engine& engine, Story& story) { story.run(engine, {Refit::kAabbHull}); }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {
          story.report = Report::kInContact;
          Outcome out;
          CHECK(story.try_run(engine, {}, 0, out) == Status::kOk);
          story.report = Report::kHits;
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {
          story.containment = false;
          story.run(engine);
          story.containment = true;
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {
          Policies policies;
          policies.exact = Exact::kConvex;
          story.world.min_depth = 0.01f;
          story.run(engine, policies);
          story.world.min_depth = 0;
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {
          story.world.rules[0].resting = story.world.rules[1].resting = story.world.rules[2].resting =
              Resting::kReported;
          Outcome out;
          CHECK(story.try_run(engine, {}, 1, out) == Status::kHitsOverflow);
          CHECK(story.try_run(engine, {}, 1, out) == Status::kHitsOverflow);
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story&) {
          BatchId id;
          REQUIRE(add_batch(engine, {{1}, 3}, &id) == Status::kOk);
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story&) {
          BatchId id;
          REQUIRE(add_batch(engine, {{1}, 3}, &id) == Status::kOk);
          REQUIRE(remove_batch(engine, id) == Status::kOk);
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {  // bounds that are not those of the boxes
          std::vector<float> bounds[2];
          std::vector<BatchInput> inputs;
          for (std::uint32_t m = 0; m < 2; ++m) {
            inputs.push_back(story.world.members[m].poses.input({m + 1}));
            bounds[m].assign(6 * std::size_t{story.world.members[m].poses.instance_count}, 0);
            inputs[m].bounds = bounds[m];
          }
          FrameJob job;
          job.inputs = inputs;
          job.rules = story.world.rules;
          CandidateList list;
          const Status status = find_candidates(engine, job, list);
          CHECK((status == Status::kOk || status == Status::kPairsOverflow));
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story&) { REQUIRE(reserve(engine, {}) == Status::kOk); }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {
          Outcome out;
          story.world.margin = -1;
          CHECK(story.try_run(engine, {}, 1, out) == Status::kBadMargin);
          story.world.margin = 0;
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {
          FrameJob bad;
          bad.rules = {nullptr, 1};
          CHECK(begin_frame(engine, bad) == Status::kBadPairRule);
          const World& world = story.world;
          const BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
          FrameJob job;
          job.inputs = inputs;
          job.rules = world.rules;
          REQUIRE(begin_frame(engine, job) == Status::kOk);
          CHECK(end_frame(engine) == Status::kTasksLeft);
        }) == 0);
  CHECK(resting_after([](Engine& engine, Story& story) {  // a frame that another one keeps out
          engine.holders.is_changing = true;
          Outcome out;
          CHECK(story.try_run(engine, {}, 1, out) == Status::kBusy);
          engine.holders.is_changing = false;
        }) == 0);
}

TEST_CASE("what moves in a frame that is refused is tested in the next one, whether it moves again or not") {
  World world;
  for (int m = 0; m < 2; ++m) {
    Member member;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {}}};
    member.poses.link_count = member.poses.instance_count = 1;
    member.poses.data = {0, 0, 0, 1, 0, 0, 0};
    member.poses.origins = {100.0 * m, 0, 0};
    world.members.push_back(member);
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  Story story(world);
  const EnginePtr engine = make_engine_for(world);
  CHECK(story.run(*engine).hits.empty());
  story.world.members[1].poses.origins[0] = 1;
  story.world.margin = -1;
  Outcome out;
  CHECK(story.try_run(*engine, {}, 1, out) == Status::kBadMargin);
  story.world.margin = 0;
  story.all_rest();
  const Outcome found = story.run(*engine);
  CHECK(found.hits.size() == 1);
  CHECK(found.stats.instances_resting == 0);
}

TEST_CASE("an instance rests if it was in its batch's last frame, whatever list or count it is given by") {
  std::size_t hits = 0, resting = 0;
  ThreadPool pool(4);
  const Scheduler scheduler = pool.scheduler();
  for (std::uint64_t seed = 1; seed <= rounds(6); ++seed)
    for (const Resting rule : {Resting::kReported, Resting::kSkipped}) {
      CAPTURE(seed);
      Random random(seed);
      Story story(two_crowds(random, rule));
      EngineDesc desc;
      if (random.chance(0.5)) desc.scheduler = &scheduler;
      const EnginePtr engine = make_engine_for(story.world, desc);
      std::vector<std::vector<std::uint8_t>> before, given;
      for (int frame = 0; frame < 12; ++frame) {
        CAPTURE(frame);
        if (frame > 0) story.move(random, random.chance(0.3) ? 0 : 0.2);
        before = given;
        given.clear();
        for (std::size_t m = 0; m < 2; ++m) {
          const std::uint32_t all = story.world.members[m].poses.instance_count;
          story.lists[m].clear();
          story.counts[m] = random.chance(0.3) ? 1 + random.index(all) : all;
          given.emplace_back(all, std::uint8_t{0});
          const double share = random.chance(0.5) ? 1 : 0.8;
          for (std::uint32_t i = 0; i < story.counts[m]; ++i)
            if ((given[m][i] = random.chance(share))) story.lists[m].push_back(i);
          if (story.lists[m].empty()) story.lists[m].push_back(0), given[m][0] = 1;
          if (share == 1) story.lists[m].clear();
        }
        Story fresh = story;
        for (auto& bytes : fresh.moved) std::fill(bytes.begin(), bytes.end(), std::uint8_t{1});
        const Outcome found = story.run(*engine), all = fresh.run(*make_engine_for(story.world));
        std::uint64_t rest = 0;
        for (std::size_t m = 0; m < 2; ++m)
          for (std::size_t i = 0; i < given[m].size(); ++i) {
            if (before.empty() || !before[m][i] || !given[m][i]) story.moved[m][i] = 1;
            rest += !story.moved[m][i];
          }
        CHECK(found.stats.instances_resting == rest);
        CHECK(same_hits(found.hits, rule == Resting::kSkipped ? without_resting(story, all.hits) : all.hits));
        CHECK(story.flags == fresh.flags);
        if (rule == Resting::kReported) CHECK(story.in_contact == fresh.in_contact);
        hits += found.hits.size();
        resting += rest;
      }
    }
  CHECK(hits >= least_count(5000, 6));
  CHECK(resting >= least_count(10000, 6));
}

TEST_CASE("without a statement all instances of a batch count as moved, of all batches in the next frame too") {
  Random random(10);
  const World start = two_crowds(random, Resting::kSkipped);
  Story story(start);
  const EnginePtr engine = make_engine_for(start);
  story.run(*engine);
  story.all_rest();
  CHECK(story.run(*engine).stats.instances_resting == 350);
  const std::vector<std::uint8_t> bytes = story.moved[0];
  story.moved[0].clear();
  CHECK(story.run(*engine).stats.instances_resting == 120);
  story.moved[0] = bytes;
  CHECK(story.run(*engine).stats.instances_resting == 350);
  story.moved[0].clear();
  story.moved[1].clear();
  CHECK(story.run(*engine).stats.instances_resting == 0);
  story.moved = {bytes, std::vector<std::uint8_t>(120, 0)};
  CHECK(same_hits(story.run(*engine).hits, run_world(story.world).hits));  // the first frame with `moved`
  CHECK(story.run(*engine).hits.empty());
}

TEST_CASE("a masked instance never rests, and rests once its pose is good") {
  Random random(11);
  Story story(two_crowds(random, Resting::kReported));
  const float good = story.world.members[0].poses.data[0];
  story.world.members[0].poses.data[0] = std::nanf("");
  const EnginePtr engine = make_engine_for(story.world);
  story.run(*engine);
  story.all_rest();
  for (int frame = 0; frame < 3; ++frame) {
    const Outcome found = story.run(*engine);
    CHECK(found.stats.instances_resting == 349);
    CHECK(found.stats.instances_masked == 1);
    CHECK(story.flags[0][0] == kInstanceNotFinite);
    CHECK(same_hits(found.hits, run_world(story.world).hits));
  }
  story.world.members[0].poses.data[0] = good;
  story.moved[0][0] = 1;
  CHECK(story.run(*engine).stats.instances_resting == 349);
  story.moved[0][0] = 0;
  const Outcome found = story.run(*engine);
  CHECK(found.stats.instances_resting == 350);
  CHECK(same_hits(found.hits, run_world(story.world).hits));

  story.moved[0][0] = 1;
  story.world.members[0].poses.data[0] = std::nanf("");
  const Outcome masked = story.run(*engine);
  CHECK(masked.stats.instances_masked == 1);
  CHECK(same_hits(masked.hits, run_world(story.world).hits));
  story.moved[0][0] = 0;
  const Outcome still = story.run(*engine);
  CHECK(still.stats.instances_resting == 349);
  CHECK(still.stats.instances_masked == 1);
  CHECK(story.flags[0][0] == kInstanceNotFinite);
}

TEST_CASE("moved is refused for sequences and with too few bytes, and so is an unknown value of resting") {
  Random random(12);
  World world = two_crowds(random, Resting::kReported);
  world.members[1].kind = BatchKind::kSequence;
  world.rules = {{{1}, {1}, Pairing::kBetween, Resting::kReported}};
  const EnginePtr engine = make_engine_for(world);
  Story story(world);
  Outcome out;
  CHECK(story.try_run(*engine, {}, 60000, out) == Status::kBadMoved);
  story.moved[1].clear();
  CHECK(story.try_run(*engine, {}, 60000, out) == Status::kOk);
  story.moved[0].pop_back();
  CHECK(story.try_run(*engine, {}, 60000, out) == Status::kBadMoved);
  story.moved[0].clear();
  CHECK(story.try_run(*engine, {}, 60000, out) == Status::kOk);
  story.world.rules[0].resting = static_cast<Resting>(2);
  CHECK(story.try_run(*engine, {}, 60000, out) == Status::kBadPairRule);
}

TEST_CASE("a checked build finds an instance that is said to rest and has changed") {
  if (!kChecksRest) {
    MESSAGE("skipped: this build does not compare what rests (NDEBUG is defined)");
    return;
  }
  Random random(13);
  const World start = two_crowds(random, Resting::kReported);
  const auto status_after = [&](auto&& change) {
    Story story(start);
    for (Member& member : story.world.members) {
      member.layers.assign(member.poses.instance_count, 1);
      member.layer_masks.assign(member.poses.instance_count, 1);
      member.poses.scales.assign(member.poses.instance_count, 1);
    }
    const EnginePtr engine = make_engine_for(start);
    story.run(*engine);
    story.all_rest();
    story.run(*engine);
    change(story);
    Outcome out;
    const Status status = story.try_run(*engine, {}, 60000, out);
    if (status != Status::kOk) {
      CHECK(story.try_run(*engine, {}, 60000, out) == Status::kOk);
      CHECK(out.stats.instances_resting == 0);
    }
    return status;
  };
  CHECK(status_after([](Story&) {}) == Status::kOk);
  CHECK(status_after([](Story& story) {
          Member& member = story.world.members[1];
          member.poses.pose(119, member.rig.leaves[0].link)[11] += 1;
        }) == Status::kMovedAtRest);
  CHECK(status_after([](Story& story) { story.world.members[0].poses.origins.back() += 1; }) == Status::kMovedAtRest);
  CHECK(status_after([](Story& story) { story.world.members[0].poses.scales[5] = 2; }) == Status::kMovedAtRest);
  CHECK(status_after([](Story& story) { story.world.members[0].layers[5] = 3; }) == Status::kMovedAtRest);
  CHECK(status_after([](Story& story) { story.world.members[0].layer_masks[5] = 3; }) == Status::kMovedAtRest);
  CHECK(status_after([](Story& story) { story.world.members[0].layers.clear(); }) == Status::kMovedAtRest);
  CHECK(status_after([](Story& story) { story.margins[1].assign(120, 0.5f); }) == Status::kMovedAtRest);
  CHECK(status_after([](Story& story) {
          Member& member = story.world.members[1];
          member.poses.pose(119, member.rig.leaves[0].link)[11] += 1;
          story.moved[1].back() = 1;
        }) == Status::kOk);
}

TEST_CASE("a checked build compares numbers that are read, whether they are given or go without saying") {
  if (!kChecksRest) {
    MESSAGE("skipped: this build does not compare what rests (NDEBUG is defined)");
    return;
  }
  constexpr std::uint32_t kCount = 40;
  Random random(14);
  World world;
  Member member;
  // Link 1 is a chain's middle without a leaf, and its joint is that of no merge: it is never read.
  member.rig.parents = {-1, 0, -1};
  member.rig.parent_offset.resize(3);
  const Box box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5f, 0.25f, 0.25f}};
  member.rig.leaves = {{0, box, {}}, {2, box, {}}};
  member.poses = random_poses(random, member.rig, kCount, PoseFormat::kMatrix4x4Columns, {2, false, false, {}});
  member.poses.origins.clear();
  member.poses.orientations.clear();
  world.members.push_back(member);
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  REQUIRE(engine->articulations[0]->articulation.posed_links.size == 2);
  Story story(world);
  story.run(*engine);
  story.all_rest();
  const auto rests_after = [&](auto&& change) {
    change(story.world.members[0]);
    Outcome out;
    REQUIRE(story.try_run(*engine, {}, 60000, out) == Status::kOk);
    return out.stats.instances_resting == kCount;
  };
  CHECK(rests_after([](Member&) {}));
  CHECK(rests_after([](Member& of) { of.poses.origins.assign(3 * kCount, 0.0); }));
  CHECK(rests_after([](Member& of) { of.poses.origins.assign(3 * kCount, -0.0); }));
  CHECK_FALSE(rests_after([](Member& of) {  // boxes of instances with orientations are padded more
    for (std::uint32_t i = 0; i < kCount; ++i)
      of.poses.orientations.insert(of.poses.orientations.end(), {0.0f, -0.0f, 0.0f, 1.0f});
  }));
  CHECK(rests_after([](Member&) {}));
  CHECK(rests_after([](Member& of) { of.poses.scales.assign(kCount, 1); }));
  CHECK(rests_after([](Member& of) { of.layers.assign(kCount, ~0u); }));
  CHECK(rests_after([](Member& of) { of.layer_masks.assign(kCount, ~0u); }));
  CHECK(rests_after([&](Member&) { story.margins[0].assign(kCount, 0.0f); }));
  CHECK(rests_after([&](Member&) { story.margins[0].clear(); }));
  CHECK(rests_after([](Member& of) { of.poses.scales.clear(); }));
  CHECK_FALSE(rests_after([](Member& of) { of.poses.orientations.clear(); }));
  CHECK(rests_after([](Member&) {}));
  CHECK(rests_after([](Member& of) {  // what is never read
    for (std::uint32_t i = 0; i < kCount; ++i) {
      std::fill_n(of.poses.pose(i, 1), 16, 7.0f);
      for (const int at : {3, 7, 11, 15}) of.poses.pose(i, 2)[at] = 9;
    }
  }));
  CHECK(rests_after([](Member& of) {  // the same matrices by rows
    std::vector<float> rows;
    for (std::uint32_t i = 0; i < kCount; ++i)
      for (std::uint32_t link = 0; link < 3; ++link)
        for (int row = 0; row < 3; ++row)
          for (int column = 0; column < 4; ++column) rows.push_back(of.poses.pose(i, link)[4 * column + row]);
    of.poses.data = rows;
    of.poses.format = PoseFormat::kMatrix3x4Rows;
  }));
}

}  // namespace cab::tests
