// Pairs that are never tested within an instance. An independent judge says which they are; no other pair is lost.
#include "perf/harness/random_world.h"
#include "tests/engine/touching_links.h"
#include "tests/layout/joints_from.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <map>

namespace {

using namespace cab;
using namespace cab::oracle;
using tests::least_count;
using tests::rounds;

// How much wider than exact the boxes of links masked at rest may have to be made to touch, as in frame_test.
constexpr double kInvented = 1e-4;

// A random rig without explicit pairs. At rest some of its links touch and others do not.
Rig bare_rig(Random& random, unsigned most_links) {
  Rig rig = random_rig(random, static_cast<Topology>(random.index(kTopologyCount)), 2 + random.index(most_links - 1),
                       1 + random.index(3));
  rig.ignored.clear();
  return rig;
}

Poses any_pose(Random& random, const Rig& rig) {
  return random_poses(random, rig, 1, static_cast<PoseFormat>(random.index(3)), {0.5, false, false, {}});
}

PoseView view_of(const Poses& poses) { return {poses.format, poses.data.data(), 0, 0}; }

// The reasons of every ignored pair of an articulation. Checks that pairs are sorted and name two different links.
std::map<Links, unsigned> reasons_of(const Engine& engine, ArticulationId id) {
  ArticulationInfo info;
  require(articulation_info(engine, id, &info));
  std::vector<IgnoredPair> pairs(info.ignored_pair_count);
  require(ignored_pairs(engine, id, pairs));
  std::map<Links, unsigned> out;
  for (const IgnoredPair& pair : pairs) {
    CHECK(pair.a < pair.b);
    CHECK(pair.b < info.link_count);
    CHECK(pair.reasons != 0);
    const Links links(pair.a, pair.b);
    CHECK((out.empty() || out.rbegin()->first < links));
    out.emplace(links, pair.reasons);
  }
  return out;
}

std::set<Links> masked_for(const std::map<Links, unsigned>& reasons, IgnoredReason reason) {
  std::set<Links> out;
  for (const auto& [links, why] : reasons)
    if (why & reason) out.insert(links);
  return out;
}

bool has_all(const std::set<Links>& a, const std::set<Links>& b) {
  return std::includes(a.begin(), a.end(), b.begin(), b.end());
}

ArticulationId add(Engine& engine, const ArticulationDesc& desc) {
  ArticulationId id;
  require(add_articulation(engine, desc, &id));
  return id;
}

}  // namespace

TEST_CASE("links masked for their joints are those that a search by breadth reaches in as many") {
  const EnginePtr engine = make_engine();
  std::size_t masked = 0, left = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Rig rig = bare_rig(random, 40);
    ArticulationDesc desc = rig.desc();
    desc.ignored_hops = random.chance(0.1) ? 0xffffffffu : random.index(7);
    const std::set<Links> got = masked_for(reasons_of(*engine, add(*engine, desc)), kIgnoredByHops);
    std::set<Links> expected;
    for (std::uint32_t a = 0; a < rig.link_count(); ++a) {
      const std::vector<std::uint32_t> joints = joints_from(rig.parents, a);
      for (std::uint32_t b = a + 1; b < rig.link_count(); ++b) {
        if (joints[b] <= desc.ignored_hops) expected.emplace(a, b);
        ++(joints[b] <= desc.ignored_hops ? masked : left);
      }
    }
    CHECK(got == expected);
  }
  CHECK(masked > 1000);
  CHECK(left > 1000);
}

TEST_CASE("links masked at rest are all that touch exactly, and boxes a ten-thousandth wider touch for the others") {
  const EnginePtr engine = make_engine();
  std::size_t masked = 0, left = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Rig rig = bare_rig(random, 24);
    const Poses poses = any_pose(random, rig);
    ArticulationDesc desc = rig.desc();
    desc.rest_pose = view_of(poses);
    const std::set<Links> got = masked_for(reasons_of(*engine, add(*engine, desc)), kIgnoredAtRest);
    CHECK(has_all(got, links_exactly_touching(rig, poses, 0, 0)));
    CHECK(has_all(links_exactly_touching(rig, poses, 0, kInvented), got));
    masked += got.size();
    left += rig.link_count() * (rig.link_count() - 1) / 2 - got.size();
  }
  CHECK(masked > 1000);
  CHECK(left > 1000);
}

TEST_CASE("links masked at rest are those that a frame of that pose reports, on every instruction set") {
  std::size_t masked = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    world.members.emplace_back();
    world.members[0].rig = bare_rig(random, 24);
    world.members[0].poses = any_pose(random, world.members[0].rig);
    world.rules = {{{1}, {1}, Pairing::kWithin}};
    std::set<Links> touching;
    for (const Hit& hit : run_world(world, {Refit::kCab, Strategy::kBrute}).hits)
      touching.emplace(hit.link_a, hit.link_b);
    ArticulationDesc desc = world.members[0].rig.desc();
    desc.rest_pose = view_of(world.members[0].poses);
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      EngineDesc engine_desc;
      engine_desc.isa = isa;
      const EnginePtr engine = make_engine(engine_desc);
      CHECK(masked_for(reasons_of(*engine, add(*engine, desc)), kIgnoredAtRest) == touching);
    }
    masked += touching.size();
  }
  CHECK(masked > 200);
}

TEST_CASE("a pair that is masked for several reasons has them all, and one given as an explicit pair twice is one") {
  const EnginePtr engine = make_engine();
  Random random(3);
  Rig rig = bare_rig(random, 24);
  const Poses poses = any_pose(random, rig);
  ArticulationDesc desc = rig.desc();
  desc.ignored_hops = 1;
  desc.rest_pose = view_of(poses);
  const std::map<Links, unsigned> before = reasons_of(*engine, add(*engine, desc));
  const auto both = std::find_if(before.begin(), before.end(),
                                 [](const auto& each) { return each.second == (kIgnoredByHops | kIgnoredAtRest); });
  REQUIRE(both != before.end());
  rig.ignored = {{both->first.second, both->first.first}, {both->first.first, both->first.second}, {1, 1}};
  desc.ignored_pairs = rig.ignored;
  std::map<Links, unsigned> expected = before;
  expected[both->first] = kIgnoredExplicitly | kIgnoredByHops | kIgnoredAtRest;
  CHECK(reasons_of(*engine, add(*engine, desc)) == expected);
}

TEST_CASE("masks take the masked pairs out of the hits within an instance, and nothing else, by every strategy") {
  std::size_t taken = 0, within = 0, between = 0;
  for (std::uint64_t seed = 1; seed <= rounds(25); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Member member;
    member.rig = bare_rig(random, 12);
    member.kind = random.chance(0.5) ? BatchKind::kCharacters : BatchKind::kSequence;
    const PoseRange range = {0.5, random.chance(0.5), random.chance(0.5), {}};
    member.poses = random_poses(random, member.rig, 17, static_cast<PoseFormat>(random.index(3)), range);
    World world;
    world.members = {member, member};
    world.rules = {{{1}, {1}, Pairing::kWithin}, {{2}, {2}, Pairing::kWithin}, {{1}, {2}, Pairing::kBetween}};

    const Poses rest = any_pose(random, member.rig);
    const LinkPair explicit_pair = {random.index(member.rig.link_count()), random.index(member.rig.link_count())};
    ArticulationDesc desc = member.rig.desc();
    desc.ignored_pairs = {&explicit_pair, 1};
    desc.ignored_hops = random.index(3);
    if (random.chance(0.75)) desc.rest_pose = view_of(rest);
    const EnginePtr engine = make_engine();
    const ArticulationId masked = add(*engine, desc), bare = add_rig(*engine, member.rig);
    const std::map<Links, unsigned> reasons = reasons_of(*engine, masked);
    CHECK(reasons_of(*engine, bare).empty());
    const EnginePtr bare_engine = make_engine_for(world);
    for (int m = 0; m < 2; ++m) add_instances(*engine, masked, 17, member.kind);

    for (const Refit refit : {Refit::kCab, Refit::kAabbHull, Refit::kAabbVertices})
      for (const Strategy strategy :
           {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute, Strategy::kAuto}) {
        CAPTURE(static_cast<int>(refit));
        CAPTURE(static_cast<int>(strategy));
        const Policies policies = {refit, strategy};
        std::vector<Hit> expected;
        for (const Hit& hit : run_on(*bare_engine, world, policies).hits) {
          const bool self = hit.batch_a.value == hit.batch_b.value && hit.instance_a == hit.instance_b;
          if (self && reasons.count({hit.link_a, hit.link_b})) {
            ++taken;
            continue;
          }
          ++(self ? within : between);
          expected.push_back(hit);
        }
        CHECK(same_hits(run_on(*engine, world, policies).hits, expected));
      }
  }
  CHECK(taken >= least_count(1000, 25));
  CHECK(within >= least_count(1000, 25));
  CHECK(between >= least_count(1000, 25));
}

TEST_CASE("ignored_pairs needs room for all pairs, and none where nothing is ignored") {
  const EnginePtr engine = make_engine();
  Random random(4);
  const Rig rig = bare_rig(random, 12);
  ArticulationDesc desc = rig.desc();
  const ArticulationId bare = add(*engine, desc);
  CHECK(ignored_pairs(*engine, bare, {}) == Status::kOk);
  desc.ignored_hops = 1;
  const ArticulationId masked = add(*engine, desc);
  ArticulationInfo info;
  REQUIRE(articulation_info(*engine, masked, &info) == Status::kOk);
  CHECK(info.ignored_pair_count == rig.link_count() - 1);
  std::vector<IgnoredPair> pairs(info.ignored_pair_count, IgnoredPair{9, 9, 9});
  CHECK(ignored_pairs(*engine, masked, {pairs.data(), pairs.size() - 1}) == Status::kBadOutput);
  CHECK(ignored_pairs(*engine, masked, {nullptr, pairs.size()}) == Status::kBadOutput);
  CHECK(ignored_pairs(*engine, {masked.value + 1}, pairs) == Status::kUnknownArticulation);
  CHECK(pairs[0].reasons == 9);
  CHECK(ignored_pairs(*engine, masked, pairs) == Status::kOk);
  CHECK(pairs[0].reasons == kIgnoredByHops);
}
