// The broad phase: it never loses a touching pair, however far the pair is from the world's origin.
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

namespace {

using namespace cab;
using namespace cab::oracle;
using tests::least_count;
using tests::rounds;

// Two instances of one unit cube, the second at a distance along x from the first.
World two_cubes(const oracle::Vec3<double>& at, double distance, BatchKind kind) {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5f, 0.5f, 0.5f}}, {}}};
  World world;
  for (int m = 0; m < 2; ++m) {
    Poses poses;
    poses.link_count = poses.instance_count = 1;
    poses.data = {0, 0, 0, 1, 0, 0, 0};
    poses.origins = {at[0] + (m ? distance : 0), at[1], at[2]};
    world.members.push_back({rig, poses, kind});
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  return world;
}

constexpr Policies kPolicies[] = {
    {Refit::kCab, Strategy::kTree, Exact::kNone},      {Refit::kCab, Strategy::kBrute, Exact::kNone},
    {Refit::kAabbHull, Strategy::kTree, Exact::kNone}, {Refit::kAabbHull, Strategy::kBrute, Exact::kNone},
    {Refit::kCab, Strategy::kRows, Exact::kNone},      {Refit::kCab, Strategy::kLinks, Exact::kNone}};
constexpr BatchKind kKinds[] = {BatchKind::kCharacters, BatchKind::kSequence};

}  // namespace

TEST_CASE("cubes that touch touch, and cubes a thousandth apart do not, out to 1e9 and across the world's origin") {
  for (const double out : {0.0, 1.0, 1e6, -1e9, 4e9}) {
    for (const BatchKind kind : kKinds) {
      for (const Policies& policies : kPolicies) {
        CAPTURE(out);
        const oracle::Vec3<double> at = {{out, -out / 3, out / 7}};
        CHECK(run_world(two_cubes(at, 1.0, kind), policies).hits.size() == 1);  // face on face
        CHECK(run_world(two_cubes(at, -1.0, kind), policies).hits.size() == 1);
        CHECK(run_world(two_cubes(at, 1.001, kind), policies).hits.empty());
        CHECK(run_world(two_cubes(at, -1.001, kind), policies).hits.empty());
      }
    }
  }
}

TEST_CASE("bounds that a caller gives grow by the margins of their instances") {
  const World world = two_cubes({}, 2, BatchKind::kCharacters);  // 1 apart
  const EnginePtr engine = make_engine_for(world);
  const float bounds[] = {-0.5f, -0.5f, -0.5f, 0.5f, 0.5f, 0.5f}, margins[] = {0.45f, 0.6f, 0.25f};
  const auto pairs_with = [&](const float* a, const float* b) {
    BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
    for (BatchInput& input : inputs) input.bounds = {bounds, 6};
    inputs[0].margins = {a, a ? std::size_t{1} : 0};
    inputs[1].margins = {b, b ? std::size_t{1} : 0};
    FrameJob job;
    job.inputs = inputs;
    job.rules = world.rules;
    CandidateList list;
    const Status status = find_candidates(*engine, job, list);
    CHECK((status == Status::kOk || status == Status::kPairsOverflow));
    return list.pairs_needed;
  };
  CHECK(pairs_with(nullptr, nullptr) == 0);
  CHECK(pairs_with(&margins[0], &margins[1]) == 1);  // 1.05 together
  CHECK(pairs_with(&margins[2], &margins[2]) == 0);
}

TEST_CASE("origins at the ends of double's range neither lose nor invent a pair") {
  const double huge = std::numeric_limits<double>::max();
  for (const double out : {1e30, 1e300, huge, -huge}) {
    for (const BatchKind kind : kKinds) {
      for (const Policies& policies : kPolicies) {
        CAPTURE(out);
        World world = two_cubes({{out, 0, -out}}, 0, kind);
        CHECK(run_world(world, policies).hits.size() == 1);
        world.members[1].poses.origins[0] = -out;
        CHECK(run_world(world, policies).hits.empty());
        world.members[1].poses.origins = {0, 0, 0};
        CHECK(run_world(world, policies).hits.empty());
      }
    }
  }
}

TEST_CASE("cubes face on face touch even where the step from one double to the next is as large as they are") {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const int scale = 20 + static_cast<int>(random.index(40));
    const double step = std::ldexp(1.0, scale - 53);  // between doubles of 2^(scale - 1) to 2^scale
    oracle::Vec3<double> at{};
    for (double& c : at.v) c = random.sign() * std::ldexp(0.5, scale) * random.uniform(1.0, 1.9);
    const double width = step * (1 + random.index(7));
    for (const BatchKind kind : kKinds) {
      World world = two_cubes(at, std::copysign(width, -at[0]), kind);  // towards the origin: exact
      for (Member& member : world.members)
        for (float& half : member.rig.leaves[0].box.half) half = static_cast<float>(width / 2);
      REQUIRE(std::fabs(world.members[1].poses.origins[0] - at[0]) == width);
      for (const Policies& policies : kPolicies) CHECK(run_world(world, policies).hits.size() == 1);
    }
  }
}

TEST_CASE("the broad phase rejects no pair that the leaf test accepts: characters as frames, at the edge of touching") {
  for (const double out : {0.0, 1e7, 1e9}) {
    std::size_t hits = 0;
    for (int i = 0; i < 400; ++i) {
      CAPTURE(out);
      CAPTURE(i);
      const double distance = 1 + 5e-8 * i;
      const auto answer = [&](BatchKind kind, const Policies& policies) {
        return run_world(two_cubes({{out, out, -out}}, distance, kind), policies).hits.size();
      };
      const std::size_t expected = answer(BatchKind::kSequence, kPolicies[0]);
      CHECK(answer(BatchKind::kCharacters, kPolicies[0]) == expected);
      CHECK(answer(BatchKind::kCharacters, kPolicies[1]) == expected);
      CHECK(answer(BatchKind::kCharacters, kPolicies[2]) == answer(BatchKind::kSequence, kPolicies[2]));
      hits += expected;
    }
    CHECK(hits > 20);
    CHECK(hits < 380);
  }
}

TEST_CASE("in a long line each character is paired only with its neighbours, once each") {
  // Shuffled, in order, and in two and five runs, each of which begins below the end of the one before.
  constexpr std::uint32_t n = 1000;
  const auto shuffled = [](std::uint32_t i) { return i * 617 % n; };
  const auto in_order = [](std::uint32_t i) { return i; };
  const auto in_two_runs = [](std::uint32_t i) { return (i + n / 2) % n; };
  const auto in_five_runs = [](std::uint32_t i) { return i % (n / 5) * 5 + i / (n / 5); };
  for (std::uint32_t (*const place)(std::uint32_t) : {+shuffled, +in_order, +in_two_runs, +in_five_runs}) {
    World world = two_cubes({}, 0, BatchKind::kCharacters);
    world.members.pop_back();
    Poses& poses = world.members[0].poses;
    poses.instance_count = n;
    poses.origins.clear();
    poses.data.clear();
    for (std::uint32_t i = 0; i < n; ++i) {
      poses.origins.insert(poses.origins.end(), {0.9 * place(i), 0, 0});
      poses.data.insert(poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
    }
    world.rules = {{{1}, {1}, Pairing::kBetween}};
    const Outcome outcome = run_world(world);
    CHECK(outcome.hits.size() == n - 1);
    for (const Hit& hit : outcome.hits)
      CHECK(std::abs(static_cast<int>(place(hit.instance_a)) - static_cast<int>(place(hit.instance_b))) == 1);
  }
}

namespace {

// Characters of one cube each, with the given half widths at the given places.
World cubes_at(const std::vector<oracle::Vec3<double>>& places, const std::vector<float>& halves) {
  World world;
  std::vector<float> sizes = halves;
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  for (const float half : sizes) {
    Member member;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half, half, half}}, {}}};
    member.poses.link_count = 1;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (halves[i] != half) continue;
      ++member.poses.instance_count;
      member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
      member.poses.origins.insert(member.poses.origins.end(), {places[i][0], places[i][1], places[i][2]});
    }
    world.members.push_back(member);
  }
  for (std::uint32_t a = 1; a <= world.members.size(); ++a)
    for (std::uint32_t b = a; b <= world.members.size(); ++b) world.rules.push_back({{a}, {b}, Pairing::kBetween});
  return world;
}

// The pairs of cubes that overlap once all are widened by a share of their size: each pair is compared in double.
std::size_t overlapping_cubes(const World& world, double share = 0) {
  std::vector<std::pair<oracle::Vec3<double>, double>> all;
  for (const Member& member : world.members)
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
      all.push_back({{{member.poses.origins[3 * i], member.poses.origins[3 * i + 1], member.poses.origins[3 * i + 2]}},
                     static_cast<double>(member.rig.leaves[0].box.half[0])});
  std::size_t count = 0;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      bool overlap = true;
      for (std::size_t c = 0; c < 3; ++c)
        overlap =
            overlap && std::fabs(all[i].first[c] - all[j].first[c]) <= (1 + share) * (all[i].second + all[j].second);
      count += overlap;
    }
  return count;
}

}  // namespace

TEST_CASE(
    "the grid finds every pair of cubes: of one size and of sizes from 1e-3 to 1e5, spread over 1 to 1e7, in a "
    "plane, on a line, in space") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const double spread = random.log_uniform(1, 1e7);
    const std::uint32_t dimensions = 1 + random.index(3);
    const bool many_sizes = random.chance(0.5);
    std::vector<oracle::Vec3<double>> places;
    std::vector<float> halves;
    for (int i = 0; i < 300; ++i) {
      oracle::Vec3<double> at{};
      for (std::uint32_t c = 0; c < dimensions; ++c) at[(seed + c) % 3] = random.uniform(-spread, spread);
      places.push_back(at);
      halves.push_back(many_sizes ? std::ldexp(1.0f, static_cast<int>(random.index(28)) - 10)
                                  : std::ldexp(1.0f, static_cast<int>(std::log2(spread)) - 3));
    }
    const World world = cubes_at(places, halves);
    const std::size_t least = overlapping_cubes(world), most = overlapping_cubes(world, 1e-4);
    for (const Policies& policies : kPolicies) {
      const std::size_t found = run_world(world, policies).hits.size();
      CHECK(found >= least);
      CHECK(found <= most);
    }
    hits += least;
  }
  CHECK(hits >= least_count(10'000, 60));
}

TEST_CASE(
    "cubes whose bounds begin at one number, or face on face, are found once each, in clusters near and far apart") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const double apart = random.chance(0.3) ? 0 : std::ldexp(1.0, static_cast<int>(random.index(40)));
    const std::uint32_t clusters = 1 + random.index(4), wide = 2 + random.index(24), sizes = 1 + random.index(5);
    const std::uint32_t dimensions = 1 + random.index(3);
    std::vector<oracle::Vec3<double>> places;
    std::vector<float> halves;
    for (int i = 0; i < 300; ++i) {
      oracle::Vec3<double> at{};
      const double cluster = random.index(clusters) - 1.0;
      for (std::uint32_t c = 0; c < dimensions; ++c) at[(seed + c) % 3] = cluster * apart + random.index(wide);
      places.push_back(at);
      halves.push_back(std::ldexp(0.5f, static_cast<int>(random.index(sizes))));
    }
    const World world = cubes_at(places, halves);
    const std::size_t expected = overlapping_cubes(world);
    for (const Policies& policies : kPolicies) CHECK(run_world(world, policies).hits.size() == expected);
    hits += expected;
  }
  CHECK(hits >= least_count(10'000, 40));
}

TEST_CASE("a giant among small ones is paired with exactly those under it, whether it is given first or last") {
  for (const bool giant_first : {false, true}) {
    std::vector<oracle::Vec3<double>> places;
    std::vector<float> halves;
    for (int i = 0; i < 40; ++i)
      for (int j = 0; j < 40; ++j) {
        places.push_back({{2.0 * i, 2.0 * j, 0}});
        halves.push_back(0.5f);
      }
    places.push_back({{20, 20, 0}});
    halves.push_back(19.25f);
    World world = cubes_at(places, halves);
    if (giant_first) std::swap(world.members[0], world.members[1]);
    const std::size_t expected = overlapping_cubes(world);
    CHECK(expected == 19 * 19);
    for (const Policies& policies : kPolicies) CHECK(run_world(world, policies).hits.size() == expected);
  }
}

TEST_CASE("an instance with thousands of partners is paired with each once") {
  const std::uint32_t n = 6144;
  std::vector<oracle::Vec3<double>> places(n + 1);
  std::vector<float> halves(n, 0.001f);
  for (std::uint32_t i = 0; i < n; ++i) places[i] = {{0.01 * (i % 80), 0.01 * (i / 80), 0}};
  halves.push_back(1000);  // one ground below all others
  World world = cubes_at(places, halves);
  std::swap(world.members[0], world.members[1]);
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  const Outcome outcome = run_world(world);
  CHECK(outcome.hits.size() == n);
  for (std::uint32_t i = 0; i < outcome.hits.size(); ++i) CHECK(outcome.hits[i].instance_b == i);
}

TEST_CASE("thousands of partners of several batches are found by cells and by rows, masked ones left out") {
  const std::uint32_t n = 3072;
  for (const float half :
       {0.001f, 1000.0f}) {  // as small as its partners, in one spot with them; larger than all cells
    CAPTURE(half);
    std::vector<World> parts;
    for (const std::size_t count : {std::size_t{1}, std::size_t{n}, std::size_t{n}, std::size_t{n}}) {
      std::vector<oracle::Vec3<double>> places(count);
      if (half > 1)
        for (std::size_t i = 0; i < count; ++i)
          places[i] = {{0.01 * static_cast<double>(i % 60), 0.01 * static_cast<double>(i / 60), 0}};
      parts.push_back(cubes_at(places, std::vector<float>(count, count == 1 ? half : 0.001f)));
    }
    World world = parts[0];
    for (std::size_t p = 1; p < parts.size(); ++p) world.members.push_back(parts[p].members[0]);
    world.rules = {{{1}, {2}, Pairing::kBetween}, {{1}, {4}, Pairing::kBetween}};
    const auto masked = [](std::uint32_t i) { return i % 100 == 7; };
    for (std::uint32_t i = 0; i < n; ++i)
      if (masked(i))
        for (std::size_t m = 1; m < 4; ++m) world.members[m].poses.data[7 * std::size_t{i} + 4] = std::nanf("");
    const Outcome outcome = run_world(world, {Refit::kCab, Strategy::kTree});
    std::size_t at = 0;
    for (const std::uint32_t batch : {2u, 4u})
      for (std::uint32_t i = 0; i < n; ++i) {
        if (masked(i)) continue;
        REQUIRE(at < outcome.hits.size());
        CHECK(outcome.hits[at].batch_b.value == batch);
        CHECK(outcome.hits[at++].instance_b == i);
      }
    CHECK(at > 4096);
    CHECK(at == outcome.hits.size());
    CHECK(outcome.stats.candidates == at);
  }
}

TEST_CASE("every instance of a crowd in one place is paired with every other") {
  World world = two_cubes({}, 0, BatchKind::kCharacters);
  for (Member& member : world.members) {
    member.poses.origins.clear();
    member.poses.instance_count = 40;
    for (int i = 1; i < 40; ++i) member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  CHECK(run_world(world).hits.size() == 1600);
  world.rules = {{{2}, {2}, Pairing::kBetween}};
  CHECK(run_world(world).hits.size() == 780);
}
