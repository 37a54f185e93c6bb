// Which instances touch anything: a frame with hits and a frame with Report::kInContact give the same answer.
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::oracle;
using tests::least_count;
using tests::rounds;

constexpr Strategy kStrategies[] = {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute};

using Bytes = std::vector<std::vector<std::uint8_t>>;

std::size_t count_of(const Bytes& bytes, std::uint8_t value) {
  std::size_t out = 0;
  for (const auto& member : bytes) out += static_cast<std::size_t>(std::count(member.begin(), member.end(), value));
  return out;
}

// A sparse world, so that there are instances that touch nothing.
World sparse_world(Random& random) {
  World world;
  for (int m = 0; m < 2; ++m)
    world.members.push_back(
        any_member(random, 60, BatchKind::kCharacters, {random.uniform(1, 4), random.chance(0.5), true, {}}, 8));
  const std::uint32_t frames = kInstanceCounts[random.index(6)];
  for (int m = 0; m < 3; ++m)
    world.members.push_back(any_member(random, m == 2 ? 1 : frames, BatchKind::kSequence, {1, false, true, {}}, 4));
  world.rules = {{{1}, {1}, Pairing::kBetween},
                 {{2}, {1}, Pairing::kBetween},
                 {{3}, {4}, Pairing::kBetween},
                 {{5}, {3}, Pairing::kBetween}};
  if (random.chance(0.3)) world.rules.push_back({{2}, {2}, Pairing::kWithin});
  if (random.chance(0.3)) add_layers(random, world);
  if (random.chance(0.3)) world.margin = 0.05f;
  return world;
}

}  // namespace

TEST_CASE("in_contact names the instances that are in a hit, with either report and for every way to compute it") {
  std::size_t yes = 0, no = 0;
  for (std::uint64_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = sparse_world(random);
    const std::vector<Hit> judged = judge_world(world);
    for (const Exact exact : {Exact::kNone, Exact::kFcl, Exact::kConvex})
      for (const Strategy strategy : kStrategies) {
        if (exact == Exact::kFcl && !build_info().fcl) {
          MESSAGE("skipped: this build lacks FCL");
          continue;
        }
        const Policies policies = {Refit::kCab, strategy, exact};
        const Outcome hits = run_world(world, policies);
        const Bytes expected = in_contact_by(world, hits.hits);
        CHECK(hits.in_contact == expected);
        if (strategy == Strategy::kTree) {
          yes += count_of(expected, 1);
          no += count_of(expected, 0);
        }
        if (exact == Exact::kNone) {
          const Bytes least = in_contact_by(world, judged);
          for (std::size_t m = 0; m < least.size(); ++m)
            for (std::size_t i = 0; i < least[m].size(); ++i) CHECK(expected[m][i] >= least[m][i]);
        }
        for (const Isa isa : available_isas())
          for (const std::uint32_t threads : {1u, 2u}) {
            EngineDesc desc;
            desc.isa = isa;
            desc.thread_count = threads;
            const EnginePtr engine = make_engine_for(world, desc);
            const Outcome alone = run_on(*engine, world, policies, run_frame, Report::kInContact);
            CHECK(alone.in_contact == expected);
            CHECK(alone.hits.empty());
          }
      }
  }
  CHECK(yes >= least_count(114, 6));
  CHECK(no >= least_count(114, 6));
}

TEST_CASE("a crowd in one spot needs far fewer box tests than it has pairs, and no tests if no batch asks") {
  Random random(7);
  World world;
  world.members.push_back(any_member(random, 300, BatchKind::kCharacters, {0.1, false, true, {}}, 8));
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute}) {
    const Policies policies = {Refit::kCab, strategy, Exact::kNone};
    const Outcome hits = run_on(*engine, world, policies);
    const Outcome alone = run_on(*engine, world, policies, run_frame, Report::kInContact);
    CHECK(alone.in_contact == hits.in_contact);
    CHECK(alone.stats.box_tests * 20 < hits.stats.box_tests);
    CHECK(alone.stats.candidates * 20 < hits.stats.candidates);
  }
  BatchInput input = world.members[0].poses.input({1});
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = world.rules;
  job.report = Report::kInContact;
  CHECK(run_frame(*engine, job) == Status::kOk);
  CHECK(job.stats.candidates == 0);
}
