// Properties of whole frames over random articulations, poses, batches and policies. Every world is made from one
// seed, which is printed where a check fails. CAB_TEST_SEED=N runs the world of that seed alone. CAB_TEST_ROUNDS says
// how many worlds run (tests/rounds.h).
#include "engine/frame/all_pairs.h"
#include "kernels/descend_tiles.h"
#include "perf/harness/random_world.h"
#include "tests/seeds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;

// How much wider than exact the boxes of a reported pair may have to be made to touch, as in frame_test.
constexpr double kInvented = 1e-4;

// Two placements of a world differ only by the rounding of poses: a product of two float quaternions is off by less
// than 8 u. Boxes that touch in one placement are apart in the other once they are made narrower by this.
constexpr double kReplaced = 1e-6;

// Every combination of the values of policy_table().
std::vector<Policies> all_policies() {
  std::vector<Policies> out(1);
  for (std::uint32_t field = 0; field < policy_table().size; ++field) {
    std::vector<Policies> longer;
    for (Policies policies : out)
      for (std::uint32_t value = 0; value < policy_table()[field].value_count; ++value) {
        policy_set(policies, field, policy_table()[field].values[value].name);
        longer.push_back(policies);
      }
    out = longer;
  }
  return out;
}

std::string name_of(const Policies& policies) {
  std::string out;
  for (std::uint32_t field = 0; field < policy_table().size; ++field)
    out += std::string(field ? " " : "") + policy_table()[field].values[policy_get(policies, field)].name;
  return out;
}

bool is_oriented(Refit refit) { return refit != Refit::kAabbHull && refit != Refit::kAabbVertices; }

// One refit per leaf predicate: oriented boxes, and two kinds of bounds.
constexpr Refit kLeafPredicates[] = {Refit::kCab, Refit::kAabbHull, Refit::kAabbVertices};

Policies by_brute(Refit refit) { return {refit, Strategy::kBrute, Exact::kNone}; }

// Whether a strategy may test inner boxes. Then it may test fewer leaf pairs.
bool may_descend(Strategy strategy) {
  return strategy == Strategy::kTree || strategy == Strategy::kLinks || strategy == Strategy::kAuto;
}

// Two batches of characters and two to three sequences, small enough for every combination of policies.
World small_world(Random& random, unsigned most_links = 6) {
  constexpr std::uint32_t kCounts[] = {1, 2, 3, 5, 17};
  World world;
  const bool far = random.chance(0.3);
  const double out = far ? random.log_uniform(1e6, 1e9) : 0;
  const oracle::Vec3<double> about = out * random.unit_vector();
  for (int m = 0; m < 2; ++m)
    world.members.push_back(any_member(random, kCounts[random.index(5)], BatchKind::kCharacters,
                                       any_pose_range(random, far, about, random.uniform(0.3, 1)), most_links));
  const std::uint32_t frames = kCounts[random.index(5)], sequences = 2 + random.index(2);
  for (std::uint32_t m = 0; m < sequences; ++m)
    world.members.push_back(any_member(random, random.chance(0.25) ? 1 : frames, BatchKind::kSequence,
                                       any_pose_range(random, far, about, 0.5), most_links));
  pair_all(world, 1, 2);
  pair_all(world, 3, sequences);
  return world;
}

// Two sequences of one box each. In every frame they are as far apart as the leaf predicate allows, to two roundings.
World world_at_edge(Random& random) {
  constexpr std::uint32_t kFrameCount = 40;
  World world;
  for (int m = 0; m < 2; ++m) {
    Member member;
    member.kind = BatchKind::kSequence;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, random_box(random, 0.1 * random.unit_vector(), 0.1, 1), {}}};
    member.rig.parent_offset.resize(1);
    member.poses =
        random_poses(random, member.rig, kFrameCount, static_cast<PoseFormat>(random.index(3)), {0, true, true, {}});
    world.members.push_back(member);
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  std::vector<oracle::Vec3<double>> direction(kFrameCount);
  for (auto& d : direction) d = random.unit_vector();
  double lo[kFrameCount] = {}, hi[kFrameCount];  // centres within 0.2 meet, centres 8 apart do not
  std::fill_n(hi, kFrameCount, 8.0);
  const auto place = [&](std::uint32_t f, double distance) {
    for (std::size_t c = 0; c < 3; ++c) world.members[1].poses.origins[3 * f + c] = distance * direction[f][c];
  };
  for (int halving = 0; halving < 40; ++halving) {
    for (std::uint32_t f = 0; f < kFrameCount; ++f) place(f, (lo[f] + hi[f]) / 2);
    std::vector<bool> meet(kFrameCount);
    for (const Hit& hit : run_on(*engine, world, {}).hits) meet[hit.instance_a] = true;
    for (std::uint32_t f = 0; f < kFrameCount; ++f) (meet[f] ? lo[f] : hi[f]) = (lo[f] + hi[f]) / 2;
  }
  for (std::uint32_t f = 0; f < kFrameCount; ++f) place(f, lo[f] * (1 + random.uniform(-2, 2) * 0x1p-24));
  return world;
}

bool is_ignored(const Rig& rig, std::uint32_t a, std::uint32_t b) {
  return std::any_of(rig.ignored.begin(), rig.ignored.end(), [&](const LinkPair& pair) {
    return (pair.a == a && pair.b == b) || (pair.a == b && pair.b == a);
  });
}

std::size_t count_ignored(const World& world, const std::vector<Hit>& hits) {
  return static_cast<std::size_t>(std::count_if(hits.begin(), hits.end(), [&](const Hit& hit) {
    return hit.batch_a.value == hit.batch_b.value && hit.instance_a == hit.instance_b &&
           (hit.link_a == hit.link_b || is_ignored(world.members[hit.batch_a.value - 1].rig, hit.link_a, hit.link_b));
  }));
}

bool is_sorted_once(const std::vector<Hit>& hits) {
  for (std::size_t i = 1; i < hits.size(); ++i)
    if (!link_less(hits[i - 1], hits[i])) return false;
  return true;
}

// The link pairs that are in one of two lists and not in the other.
std::vector<Hit> differing(const std::vector<Hit>& a, const std::vector<Hit>& b) {
  std::vector<Hit> out;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out), link_less);
  return out;
}

// The hits with every instance renamed, their sides ordered, sorted. rename(batch, instance) changes both in place.
// Leaves are set to 0: which leaf pair is the lowest depends on the order of the sides.
template <class Rename>
std::vector<Hit> renamed(std::vector<Hit> hits, Rename&& rename) {
  for (Hit& hit : hits) {
    rename(hit.batch_a.value, hit.instance_a);
    rename(hit.batch_b.value, hit.instance_b);
    hit.leaf_a = hit.leaf_b = 0;
    if (std::make_tuple(hit.batch_b.value, hit.instance_b, hit.link_b) <
        std::make_tuple(hit.batch_a.value, hit.instance_a, hit.link_a)) {
      std::swap(hit.batch_a, hit.batch_b);
      std::swap(hit.instance_a, hit.instance_b);
      std::swap(hit.link_a, hit.link_b);
    }
  }
  std::sort(hits.begin(), hits.end(), link_less);
  return hits;
}

FrameStats sum_of(const FrameStats& a, const FrameStats& b) {
  FrameStats out = a;
  out.box_tests += b.box_tests;
  out.leaf_pairs += b.leaf_pairs;
  out.exact_tests += b.exact_tests;
  out.false_positives += b.false_positives;
  out.instances_masked += b.instances_masked;
  return out;
}

// The poses of one instance, or of several in the order given.
Poses chosen(const Poses& poses, const std::vector<std::uint32_t>& instances) {
  Poses out = poses;
  out.instance_count = static_cast<std::uint32_t>(instances.size());
  out.data.clear();
  out.origins.clear();
  out.orientations.clear();
  const auto append = [](auto& to, const auto& from, std::size_t each, std::size_t which) {
    for (std::size_t i = 0; !from.empty() && i < each; ++i) to.push_back(from[which * each + i]);
  };
  for (const std::uint32_t i : instances) {
    append(out.data, poses.data, poses.link_count * poses.floats_per_pose(), i);
    append(out.origins, poses.origins, 3, i);
    append(out.orientations, poses.orientations, 4, i);
  }
  return out;
}

std::vector<std::uint32_t> shuffled(Random& random, std::uint32_t count) {
  std::vector<std::uint32_t> out(count);
  for (std::uint32_t i = 0; i < count; ++i) out[i] = i;
  for (std::uint32_t i = count; i > 1; --i) std::swap(out[i - 1], out[random.index(i)]);
  return out;
}

}  // namespace

TEST_CASE(
    "policies: by every combination hits lose no touching pair and are the same after an exact test, before it they "
    "depend on the leaf predicate alone, or with fewer axes lie between that of all axes and that of brute") {
  std::size_t hits = 0, more_by_fewer_axes = 0;
  if (!build_info().fcl) MESSAGE("skipped: policies by FCL, which this build lacks");
  const auto is_built = [](Exact exact) { return exact != Exact::kFcl || build_info().fcl; };
  const bool whole = for_seeds(60, [&](Random& random) {
    World world = small_world(random);
    if (random.chance(0.3)) add_layers(random, world);
    if (random.chance(0.3)) world.margin = static_cast<float>(random.log_uniform(1e-4, 0.3));
    const EnginePtr engine = make_engine_for(world);
    const std::vector<Hit> touching = judge_world(world), wider = judge_widened(world, kInvented);
    const std::vector<Hit> all = run_on(*engine, world, {}, run_all_pairs).hits;
    std::vector<Hit> all_exact[kExactCount];
    for (const Exact exact : {Exact::kFcl, Exact::kConvex, Exact::kSurface})
      if (is_built(exact))
        all_exact[static_cast<std::size_t>(exact)] =
            run_on(*engine, world, {Refit::kCab, Strategy::kAuto, exact}, run_all_pairs).hits;
    CHECK(missing_from(touching, all_exact[static_cast<std::size_t>(Exact::kConvex)]) == 0);
    CHECK(same_hits(all_exact[static_cast<std::size_t>(Exact::kSurface)],
                    all_exact[static_cast<std::size_t>(Exact::kConvex)]));  // no leaf has triangles
    std::map<Refit, std::vector<Hit>> by_predicate;
    for (const Refit refit : kLeafPredicates) by_predicate[refit] = run_on(*engine, world, by_brute(refit)).hits;
    hits += by_predicate[Refit::kCab].size();

    // With fewer axes more leaf pairs pass. Of these a descent reports those that its inner boxes do not separate.
    const std::vector<Hit> fewer_axes =
        run_on(*engine, world, {Refit::kCab, Strategy::kBrute, Exact::kNone, Extents::kChildren, Sat::kFaces6}).hits;
    more_by_fewer_axes += fewer_axes.size() - by_predicate[Refit::kCab].size();
    CHECK(missing_from(by_predicate[Refit::kCab], fewer_axes) == 0);
    CHECK(missing_from(fewer_axes, by_predicate[Refit::kAabbHull]) == 0);

    CHECK(missing_from(touching, by_predicate[Refit::kCab]) == 0);
    CHECK(missing_from(by_predicate[Refit::kCab], wider) == 0);
    // Bounds of the posed leaf boxes overlap wherever the boxes do by the predicate, slack included. Bounds of vertices
    // are tighter: they contain the shapes, and need not overlap where boxes do by their padding alone.
    CHECK(missing_from(by_predicate[Refit::kCab], by_predicate[Refit::kAabbHull]) == 0);
    CHECK(missing_from(touching, by_predicate[Refit::kAabbVertices]) == 0);

    for (const Policies& policies : all_policies()) {
      if (!is_built(policies.exact)) continue;
      INFO(name_of(policies));
      const Outcome got = run_on(*engine, world, policies);
      CHECK(is_sorted_once(got.hits));
      CHECK(got.in_contact == in_contact_by(world, got.hits));
      CHECK(run_on(*engine, world, policies, run_frame, Report::kInContact).in_contact == got.in_contact);
      CHECK(count_ignored(world, got.hits) == 0);
      CHECK(missing_from(got.hits, all) == 0);
      CHECK(got.stats.leaf_pairs >= got.hits.size());
      CHECK(got.stats.exact_tests <= got.stats.leaf_pairs);
      if (policies.exact != Exact::kNone) {
        CHECK(got.stats.exact_tests >= got.stats.false_positives + got.hits.size());
        CHECK(same_hits(got.hits, all_exact[static_cast<std::size_t>(policies.exact)]));
      } else if (is_oriented(policies.refit) && policies.sat != Sat::kAll15) {
        CHECK(missing_from(by_predicate[Refit::kCab], got.hits) == 0);
        CHECK(missing_from(got.hits, fewer_axes) == 0);
        if (!may_descend(policies.strategy)) CHECK(same_hits(got.hits, fewer_axes));
      } else {
        CHECK(same_hits(got.hits, by_predicate[is_oriented(policies.refit) ? Refit::kCab : policies.refit]));
      }
    }
  });
  if (whole) CHECK(hits > 1500);
  if (whole) CHECK(more_by_fewer_axes > 50);
}

TEST_CASE("moving the whole world by what its origins can hold changes nothing") {
  std::size_t hits = 0;
  const bool whole = for_seeds(60, [&](Random& random) {
    World world;
    if (random.chance(0.5))
      add_characters(random, world, 8);
    else
      add_frames(random, world, 8);
    for (Member& member : world.members) {  // origins of 20 bits below 1 stay exact when up to 2^31 is added
      member.poses.origins.resize(3 * std::size_t{member.poses.instance_count});
      for (double& v : member.poses.origins) v = std::round(random.uniform(-1, 1) * 0x1p20) * 0x1p-20;
    }
    double by[3];
    for (double& v : by) v = std::round(random.sign() * random.log_uniform(1, 0x1p31) * 0x1p20) * 0x1p-20;
    World moved = world;
    for (Member& member : moved.members)
      for (std::size_t i = 0; i < member.poses.origins.size(); ++i) member.poses.origins[i] += by[i % 3];
    const EnginePtr engine = make_engine_for(world);
    for (const Refit refit : kLeafPredicates)
      for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
        const Policies policies = {refit, strategy, Exact::kNone};
        INFO(name_of(policies));
        const Outcome here = run_on(*engine, world, policies), there = run_on(*engine, moved, policies);
        CHECK(same_hits(here.hits, there.hits));
        CHECK(here.stats.leaf_pairs == there.stats.leaf_pairs);
        hits += here.hits.size();
      }
  });
  if (whole) CHECK(hits > 10000);
}

TEST_CASE("turning the whole world changes only pairs within the padding and the slack of touching") {
  std::size_t hits = 0, changed = 0;
  const bool whole = for_seeds(150, [&](Random& random) {
    World world;
    if (random.chance(0.2)) {
      world = world_at_edge(random);
    } else {
      if (random.chance(0.5))
        add_characters(random, world, 6);
      else
        add_frames(random, world, 6);
      for (Member& member : world.members)
        member.poses =
            random_poses(random, member.rig, member.poses.instance_count, member.poses.format, {0.7, true, true, {}});
    }
    double turn[4], column[3][3];
    random_turn(random, turn);
    quaternion_matrix(turn, column);
    World rotated = world;
    for (Member& member : rotated.members) {
      for (std::size_t i = 0; i < member.poses.instance_count; ++i) {
        double* const o = &member.poses.origins[3 * i];
        const oracle::Vec3<double> at =
            o[0] * to_vec3(column[0]) + o[1] * to_vec3(column[1]) + o[2] * to_vec3(column[2]);
        for (std::size_t c = 0; c < 3; ++c) o[c] = at[c];
        float* const f = &member.poses.orientations[4 * i];
        const double q[4] = {f[0], f[1], f[2], f[3]};
        const double product[4] = {turn[3] * q[0] + turn[0] * q[3] + turn[1] * q[2] - turn[2] * q[1],
                                   turn[3] * q[1] - turn[0] * q[2] + turn[1] * q[3] + turn[2] * q[0],
                                   turn[3] * q[2] + turn[0] * q[1] - turn[1] * q[0] + turn[2] * q[3],
                                   turn[3] * q[3] - turn[0] * q[0] - turn[1] * q[1] - turn[2] * q[2]};
        for (std::size_t k = 0; k < 4; ++k) f[k] = static_cast<float>(product[k]);
      }
    }
    const Outcome before = run_world(world), after = run_world(rotated);
    const std::vector<Hit> difference = differing(before.hits, after.hits);
    hits += before.hits.size();
    changed += difference.size();
    CHECK(missing_from(judge_world(world, -kReplaced), after.hits) == 0);  // so these do not differ
    CHECK(missing_from(difference, judge_world(world, kInvented)) == 0);
    // Bounds along the world's axes change when the world turns. They must not lose a touching pair either.
    CHECK(missing_from(judge_world(world, -kReplaced), run_world(rotated, {Refit::kAabbHull}).hits) == 0);
  });
  if (!whole) return;
  CHECK(hits > 5000);
  CHECK(changed > 100);  // the worlds at the edge
}

TEST_CASE("an instance, a batch and a rule that are far from all others change nothing of them") {
  std::size_t hits = 0;
  const bool whole = for_seeds(60, [&](Random& random) {
    World world = small_world(random, 12);
    World more = world;
    Member& joined = more.members[random.index(2)];  // a character: the last of its batch
    const std::uint32_t last = joined.poses.instance_count;
    if (joined.poses.origins.empty()) joined.poses.origins.resize(3 * std::size_t{last});
    std::vector<std::uint32_t> instances(last);
    for (std::uint32_t i = 0; i < last; ++i) instances[i] = i;
    instances.push_back(random.index(last));
    joined.poses = chosen(joined.poses, instances);
    for (std::size_t c = 0; c < 3; ++c) joined.poses.origins[3 * std::size_t{last} + c] += random.sign() * 3e4;
    const auto joined_batch = static_cast<std::uint32_t>(&joined - more.members.data()) + 1;

    const auto stranger = static_cast<std::uint32_t>(more.members.size() + 1);
    more.members.push_back(any_member(random, 3, BatchKind::kCharacters, {0.5, true, true, {{0, -4e9, 7e8}}}, 8));
    more.rules.push_back({{stranger}, {1}, Pairing::kBetween});
    more.rules.push_back({{2}, {stranger}, Pairing::kBetween});
    for (const Refit refit : kLeafPredicates)
      for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
        const Policies policies = {refit, strategy, Exact::kNone};
        INFO(name_of(policies));
        const Outcome expected = run_world(world, policies);
        Outcome got = run_world(more, policies);
        const auto is_new = [&](std::uint32_t batch, std::uint32_t instance) {
          return batch == stranger || (batch == joined_batch && instance == last);
        };
        const auto alone_with_itself = [&](const Hit& hit) {
          return is_new(hit.batch_a.value, hit.instance_a) && is_new(hit.batch_b.value, hit.instance_b);
        };
        got.hits.erase(std::remove_if(got.hits.begin(), got.hits.end(), alone_with_itself), got.hits.end());
        CHECK(same_hits(got.hits, expected.hits));
        hits += expected.hits.size();
      }
  });
  if (whole) CHECK(hits > 10000);
}

TEST_CASE("batches and instances in another order have the same hits, but for pairs within the slack of touching") {
  std::size_t hits = 0, changed = 0;
  const bool whole = for_seeds(150, [&](Random& random) {
    const World world = random.chance(0.2) ? world_at_edge(random) : small_world(random, 12);
    const auto count = static_cast<std::uint32_t>(world.members.size());
    const std::vector<std::uint32_t> batch_from = shuffled(random, count);  // new place -> old place
    std::vector<std::uint32_t> batch_to(count);
    for (std::uint32_t m = 0; m < count; ++m) batch_to[batch_from[m]] = m;
    World other;
    std::vector<std::vector<std::uint32_t>> instance_from;
    for (std::uint32_t m = 0; m < count; ++m) {
      Member member = world.members[batch_from[m]];
      instance_from.push_back(shuffled(random, member.poses.instance_count));
      // Instance f of a sequence is frame f, so sequences would have to be permuted alike. They are left as they are.
      if (member.kind == BatchKind::kSequence)
        for (std::uint32_t i = 0; i < member.poses.instance_count; ++i) instance_from.back()[i] = i;
      member.poses = chosen(member.poses, instance_from.back());
      other.members.push_back(member);
    }
    for (PairRule rule : world.rules) {
      rule.a.value = batch_to[rule.a.value - 1] + 1;
      rule.b.value = batch_to[rule.b.value - 1] + 1;
      other.rules.push_back(rule);
    }
    const auto to_old = [&](std::uint32_t& batch, std::uint32_t& instance) {
      instance = instance_from[batch - 1][instance];
      batch = batch_from[batch - 1] + 1;
    };
    const auto as_they_are = [](std::uint32_t&, std::uint32_t&) {};
    const std::vector<Hit> touching = judge_world(world), wider = judge_world(world, kInvented);
    for (const Refit refit : kLeafPredicates) {
      INFO(name_of(by_brute(refit)));
      const std::vector<Hit> before = renamed(run_world(world, by_brute(refit)).hits, as_they_are);
      const std::vector<Hit> after = renamed(run_world(other, by_brute(refit)).hits, to_old);
      if (refit != Refit::kCab) {  // bounds overlap or do not, whichever is asked first
        CHECK(same_hits(before, after));
        continue;
      }
      const std::vector<Hit> difference = differing(before, after);
      hits += before.size();
      changed += difference.size();
      CHECK(missing_from(touching, after) == 0);
      CHECK(missing_from(difference, wider) == 0);
    }
  });
  if (!whole) return;
  CHECK(hits > 5000);
  CHECK(changed > 10);  // the worlds at the edge
}

TEST_CASE("every rule has the hits and counts that it has alone") {
  std::size_t hits = 0;
  const bool whole = for_seeds(100, [&](Random& random) {
    const World world = small_world(random, 12);
    const EnginePtr engine = make_engine_for(world);
    for (const Refit refit : kLeafPredicates)
      for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
        const Policies policies = {refit, strategy, Exact::kNone};
        INFO(name_of(policies));
        const Outcome together = run_on(*engine, world, policies);
        std::vector<Hit> sum;
        FrameStats stats;
        for (const PairRule& rule : world.rules) {
          World alone = world;
          alone.rules = {rule};
          const Outcome one = run_on(*engine, alone, policies);
          sum.insert(sum.end(), one.hits.begin(), one.hits.end());
          stats = sum_of(stats, one.stats);
        }
        std::sort(sum.begin(), sum.end(), link_less);
        CHECK(same_hits(together.hits, sum));
        CHECK(together.stats.box_tests == stats.box_tests);
        CHECK(together.stats.leaf_pairs == stats.leaf_pairs);
        hits += sum.size();
      }
  });
  if (whole) CHECK(hits > 10000);
}

TEST_CASE("the links of one instance touch as those of two copies in one place do, except for ignored pairs") {
  std::size_t hits = 0, ignored = 0;
  const bool whole = for_seeds(150, [&](Random& random) {
    Member member;
    member.rig = random_rig(random, static_cast<Topology>(random.index(3)), 2 + random.index(20), 1);
    member.kind = random.chance(0.5) ? BatchKind::kCharacters : BatchKind::kSequence;
    const std::uint32_t instances = member.kind == BatchKind::kSequence ? 17 : 1;
    const bool far = random.chance(0.5);
    member.poses = random_poses(random, member.rig, instances, static_cast<PoseFormat>(random.index(3)),
                                any_pose_range(random, far, {{far ? 3e8 : 0, 0, far ? -2e6 : 0}}, 0.5));
    World world;
    world.members = {member, member};
    std::vector<std::uint32_t> leaf_of(member.rig.link_count());  // one leaf per link, in random order
    for (std::uint32_t leaf = 0; leaf < member.rig.leaf_count(); ++leaf) leaf_of[member.rig.leaves[leaf].link] = leaf;
    for (const Refit refit : kLeafPredicates) {
      const Policies policies = {refit, Strategy::kTree, Exact::kNone};
      INFO(name_of(policies));
      world.rules = {{{1}, {2}, Pairing::kBetween}};
      std::set<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> expected, got;  // instance, links
      for (const Hit& hit : run_world(world, policies).hits) {
        if (hit.link_a == hit.link_b) continue;
        if (leaf_of[hit.link_a] > leaf_of[hit.link_b]) continue;  // within one, the lower leaf is asked first
        const std::uint32_t low = std::min(hit.link_a, hit.link_b), high = std::max(hit.link_a, hit.link_b);
        if (is_ignored(member.rig, low, high))
          ++ignored;
        else
          expected.emplace(hit.instance_a, low, high);
      }
      world.rules = {{{1}, {1}, Pairing::kWithin}};
      for (const Hit& hit : run_world(world, policies).hits) got.emplace(hit.instance_a, hit.link_a, hit.link_b);
      CHECK(got == expected);
      hits += got.size();
    }
  });
  if (!whole) return;
  CHECK(hits > 1000);
  CHECK(ignored > 1000);
}

TEST_CASE("frames run together have the hits and counts that they have one at a time") {
  std::size_t hits = 0;
  const bool whole = for_seeds(60, [&](Random& random) {
    World world;
    add_frames(random, world, 12);
    std::uint32_t frames = 1;
    for (const Member& member : world.members) frames = std::max(frames, member.poses.instance_count);
    World one = world;  // its poses are replaced frame by frame
    for (Member& member : one.members) member.poses.instance_count = 1;
    const EnginePtr together = make_engine_for(world), alone = make_engine_for(one);
    for (const Refit refit : kLeafPredicates) {
      // Only rules with a sequence of all frames: a rule between two sequences of one frame would hold in every frame.
      const Policies policies = {refit, Strategy::kTree, Exact::kNone};
      INFO(name_of(policies));
      const auto count_of = [&](BatchSlot batch) { return world.members[batch.value - 1].poses.instance_count; };
      World some = world;
      some.rules.clear();
      for (const PairRule& rule : world.rules)
        if (std::max(count_of(slot_of(rule.a)), count_of(slot_of(rule.b))) == frames) some.rules.push_back(rule);
      one.rules = some.rules;
      std::vector<Hit> sum;
      FrameStats stats;
      for (std::uint32_t f = 0; f < frames; ++f) {
        for (std::size_t m = 0; m < world.members.size(); ++m) {
          const Poses& poses = world.members[m].poses;
          one.members[m].poses = chosen(poses, {poses.instance_count == 1 ? 0 : f});
        }
        const Outcome outcome = run_on(*alone, one, policies);
        for (Hit hit : outcome.hits) {
          if (count_of(hit.batch_a) > 1) hit.instance_a = f;
          if (count_of(hit.batch_b) > 1) hit.instance_b = f;
          sum.push_back(hit);
        }
        stats = sum_of(stats, outcome.stats);
      }
      std::sort(sum.begin(), sum.end(), link_less);
      const Outcome outcome = run_on(*together, some, policies);
      CHECK(same_hits(outcome.hits, sum));
      CHECK(same_counts(outcome.stats, stats));
      hits += sum.size();
    }
  });
  if (whole) CHECK(hits > 5000);
}

namespace {

// A descent of one frame's two hierarchies, one pair of boxes at a time, over the boxes that compute_boxes wrote.
struct PlainDescent {
  const Rig* rig[2];
  const MergeStep* steps[2];
  std::vector<std::uint32_t> leaves_below[2];
  const Box* boxes[2];
  const ShiftTile* shift;  // null: one origin
  Sat sat;
  std::uint64_t box_tests = 0, leaf_pairs = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::uint32_t, std::uint32_t>> lowest;  // by links

  static kernel::BoxLanes<float> lanes_of(const Box& box) {
    const auto vec = [](const float(&v)[3]) { return kernel::Vec3<float>{v[0], v[1], v[2]}; };
    return {vec(box.center), {vec(box.axis[0]), vec(box.axis[1]), vec(box.axis[2])}, vec(box.half)};
  }

  void descend(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t leaf_count[2] = {rig[0]->leaf_count(), rig[1]->leaf_count()};
    const bool leaves = a < leaf_count[0] && b < leaf_count[1];
    const kernel::BoxLanes<float> box_a = lanes_of(boxes[0][a]), box_b = lanes_of(boxes[1][b]);
    const kernel::Vec3<float> between = kernel::between_centers(box_a, box_b, shift, 0);
    ++box_tests;
    if (sat == Sat::kFaces6 ? kernel::separated<Sat::kFaces6>(box_a, box_b, between)
                            : kernel::separated<Sat::kAll15>(box_a, box_b, between))
      return;
    if (leaves) {
      if (kernel::separated_in_world(box_a, box_b, between)) return;
      ++leaf_pairs;
      const std::pair links(rig[0]->leaves[a].link, rig[1]->leaves[b].link), pair(a, b);
      const auto known = lowest.emplace(links, pair).first;
      known->second = std::min(known->second, pair);
    } else if (leaves_below[0][a] >= leaves_below[1][b]) {
      descend(steps[0][a - leaf_count[0]].left, b);
      descend(steps[0][a - leaf_count[0]].right, b);
    } else {
      descend(a, steps[1][b - leaf_count[1]].left);
      descend(a, steps[1][b - leaf_count[1]].right);
    }
  }
};

}  // namespace

TEST_CASE("compute_boxes writes the bits that a frame tests: a plain descent of them makes the same tests and hits") {
  std::size_t hits = 0;
  const bool whole = for_seeds(150, [&](Random& random) {
    World world;
    const std::uint32_t frames = kInstanceCounts[random.index(6)];
    const bool far = random.chance(0.5);
    for (int m = 0; m < 2; ++m)
      world.members.push_back(any_member(random, frames, BatchKind::kSequence,
                                         any_pose_range(random, far, {{far ? 1e7 : 0, 0, 0}}, 0.7), 24));
    world.rules = {{{1}, {2}, Pairing::kBetween}};
    const EnginePtr engine = make_engine_for(world);
    PlainDescent plain;
    std::vector<MergeStep> steps[2];
    for (std::uint32_t m = 0; m < 2; ++m) {
      const std::uint32_t leaves = world.members[m].rig.leaf_count();
      plain.rig[m] = &world.members[m].rig;
      steps[m].resize(leaves - 1);
      REQUIRE(merge_steps(*engine, {m + 1}, steps[m]) == Status::kOk);
      plain.steps[m] = steps[m].data();
      plain.leaves_below[m].assign(leaves, 1);
      for (const MergeStep& step : steps[m])
        plain.leaves_below[m].push_back(plain.leaves_below[m][step.left] + plain.leaves_below[m][step.right]);
    }
    for (const Policies& policies : all_policies()) {
      // Bounds are written as the smallest box about them, which is not what is tested.
      if (!is_oriented(policies.refit) || policies.strategy != Strategy::kTree || policies.exact != Exact::kNone)
        continue;
      INFO(name_of(policies));
      std::vector<Box> boxes[2];
      for (std::uint32_t m = 0; m < 2; ++m) {
        boxes[m].resize(std::size_t{frames} * plain.rig[m]->node_count());
        REQUIRE(compute_boxes(*engine, world.members[m].poses.input({m + 1}), policies, boxes[m]) == Status::kOk);
      }
      plain.sat = policies.sat;
      plain.box_tests = plain.leaf_pairs = 0;
      std::vector<Hit> expected;
      for (std::uint32_t f = 0; f < frames; ++f) {
        const std::vector<double>&o_a = world.members[0].poses.origins, &o_b = world.members[1].poses.origins;
        ShiftTile shift;
        for (std::size_t c = 0; c < 3; ++c)
          shift.by[c][0] = (o_b.empty() ? 0 : o_b[3 * f + c]) - (o_a.empty() ? 0 : o_a[3 * f + c]);
        plain.shift = o_a.empty() && o_b.empty() ? nullptr : &shift;
        for (int m = 0; m < 2; ++m) plain.boxes[m] = boxes[m].data() + std::size_t{f} * plain.rig[m]->node_count();
        plain.lowest.clear();
        plain.descend(plain.rig[0]->node_count() - 1, plain.rig[1]->node_count() - 1);
        for (const auto& [links, leaves] : plain.lowest)
          expected.push_back({{1},
                              f,
                              {2},
                              f,
                              static_cast<std::uint16_t>(links.first),
                              static_cast<std::uint16_t>(links.second),
                              static_cast<std::uint16_t>(leaves.first),
                              static_cast<std::uint16_t>(leaves.second)});
      }
      const Outcome got = run_on(*engine, world, policies);
      CHECK(same_hits(got.hits, expected));
      CHECK(got.stats.box_tests == plain.box_tests);
      CHECK(got.stats.leaf_pairs == plain.leaf_pairs);
      hits += expected.size();
    }
  });
  if (whole) CHECK(hits > 5000);
}
