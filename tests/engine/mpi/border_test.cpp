// Frames of all ranks have the hits of one engine, bit for bit, in random worlds. CAB_TEST_SEED=N runs one world.
#include "tests/engine/mpi/random_crowd.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <string>

namespace cab::tests {
namespace {

using namespace cab::oracle;

struct Ranks {
  int rank = 0, count = 1;
  Ranks() {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &count);
  }
};

struct Deleter {
  void operator()(mpi::DistributedEngine* engine) const { mpi::destroy(engine); }
};
using DistributedPtr = std::unique_ptr<mpi::DistributedEngine, Deleter>;

void require(const mpi::Answer& answer) {
  if (!answer.ok())
    throw std::runtime_error(std::string(to_string(answer.status)) + "; " + mpi::to_string(answer.difference));
}

DistributedPtr make_distributed(const mpi::DistributedDesc& desc = {}) {
  mpi::DistributedEngine* engine = nullptr;
  require(mpi::create(MPI_COMM_WORLD, desc, &engine));
  return DistributedPtr(engine);
}

StaticDesc level_of(const RandomCrowd& crowd) {
  StaticDesc level;
  level.bodies = crowd.bodies;
  return level;
}

// All that one process gives and gets. The flags and hits of characters that nobody owns are not there.
struct Frame {
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::vector<std::vector<std::uint8_t>> flags;
};

Frame by_one_engine(const RandomCrowd& crowd, bool containment) {
  const World& world = crowd.world;
  const EnginePtr engine = make_engine();
  for (std::size_t m = 0; m < world.members.size(); ++m) {
    ArticulationId articulation;
    oracle::require(add_articulation(*engine, crowd.desc(m), &articulation));
    add_instances(*engine, articulation, world.members[m].poses.instance_count);
  }
  Frame out;
  std::vector<BatchInput> inputs;
  std::vector<std::vector<std::uint32_t>> owned(world.members.size());
  for (const Member& member : world.members) out.flags.emplace_back(member.poses.instance_count, std::uint8_t{0});
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    const Member& member = world.members[m];
    BatchInput input = member.poses.input({m + 1});
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
      if (crowd.owners[m][i] != kNobody) owned[m].push_back(i);
    input.instances = owned[m];
    if (owned[m].empty()) input.count = 0;
    input.layers = member.layers;
    input.layer_masks = member.layer_masks;
    input.margins = crowd.margins[m];
    input.flags = out.flags[m];
    inputs.push_back(input);
  }
  if (!crowd.bodies.empty()) {
    BatchInput level;
    oracle::require(add_static_batch(*engine, level_of(crowd), &level.batch));
    inputs.push_back(level);
  }
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.policies = crowd.policies;
  job.margin = world.margin;
  job.min_depth = world.min_depth;
  job.report = crowd.report;
  job.containment = containment;
  out.hits.resize(1);
  out.contacts.resize(world.contacts ? 1 : 0);
  for (;;) {
    job.hits = out.hits;
    job.contacts = out.contacts;
    const Status status = run_frame(*engine, job);
    if (status != Status::kHitsOverflow) {
      oracle::require(status);
      break;
    }
    out.hits.resize(job.hits_needed);
    out.contacts.resize(world.contacts ? job.hits_needed : 0);
  }
  out.hits.resize(job.hit_count);
  out.contacts.resize(world.contacts ? job.hit_count : 0);
  return out;
}

// One rank's part of a member.
struct Share {
  std::vector<std::uint32_t> numbers;
  Member member;
  std::vector<float> margins;
  std::vector<std::uint8_t> flags;
};

template <class T>
void take(const std::vector<T>& from, std::size_t i, std::size_t size, std::vector<T>& out) {
  if (!from.empty())
    out.insert(out.end(), from.begin() + static_cast<std::ptrdiff_t>(i * size),
               from.begin() + static_cast<std::ptrdiff_t>((i + 1) * size));
}

Share share_of(const RandomCrowd& crowd, std::size_t m, int rank) {
  const Member& whole = crowd.world.members[m];
  Share out;
  Poses& poses = out.member.poses;
  poses.format = whole.poses.format;
  poses.link_count = whole.poses.link_count;
  poses.has_scale = whole.poses.has_scale;
  for (std::uint32_t i = 0; i < whole.poses.instance_count; ++i) {
    if (crowd.owners[m][i] != rank) continue;
    out.numbers.push_back(i);
    take(whole.poses.data, i, whole.poses.link_count * whole.poses.floats_per_pose(), poses.data);
    take(whole.poses.origins, i, 3, poses.origins);
    take(whole.poses.orientations, i, 4, poses.orientations);
    take(whole.poses.scales, i, 1, poses.scales);
    take(whole.layers, i, 1, out.member.layers);
    take(whole.layer_masks, i, 1, out.member.layer_masks);
    take(crowd.margins[m], i, 1, out.margins);
  }
  out.flags.resize(out.numbers.size());
  return out;
}

// The values of all ranks, one rank after the other.
template <class T>
std::vector<T> gather(const Ranks& ranks, Span<const T> own) {
  std::vector<int> sizes(static_cast<std::size_t>(ranks.count)), offsets;
  const int size = static_cast<int>(own.size * sizeof(T));
  MPI_Allgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, MPI_COMM_WORLD);
  int sum = 0;
  for (const int one : sizes) {
    offsets.push_back(sum);
    sum += one;
  }
  std::vector<T> out(static_cast<std::size_t>(sum) / sizeof(T));
  MPI_Allgatherv(own.data, size, MPI_BYTE, out.data(), sizes.data(), offsets.data(), MPI_BYTE, MPI_COMM_WORLD);
  return out;
}

struct AllRanks {
  Frame frame;
  std::uint64_t poses_sent = 0;
};

// What all ranks find, merged. Two frames run on the engine, and both must give the same.
AllRanks by_all_ranks(const RandomCrowd& crowd, const Ranks& ranks) {
  const World& world = crowd.world;
  const DistributedPtr engine = make_distributed();
  for (std::size_t m = 0; m < world.members.size(); ++m) {
    const Member& member = world.members[m];
    ArticulationId articulation;
    require(mpi::add_articulation(*engine, crowd.desc(m), &articulation));
    BatchId batch;
    require(mpi::add_batch(*engine, {articulation, member.poses.instance_count, member.kind}, &batch));
  }
  std::vector<Share> shares;
  for (std::size_t m = 0; m < world.members.size(); ++m) shares.push_back(share_of(crowd, m, ranks.rank));
  std::vector<mpi::RankInput> inputs;
  for (std::uint32_t m = 0; m < shares.size(); ++m) {
    BatchInput input = shares[m].member.poses.input({m + 1});
    input.layers = shares[m].member.layers;
    input.layer_masks = shares[m].member.layer_masks;
    input.margins = shares[m].margins;
    input.flags = shares[m].flags;
    inputs.push_back({input, shares[m].numbers});
  }
  if (!crowd.bodies.empty()) {
    BatchInput level;
    require(mpi::add_static_batch(*engine, level_of(crowd), &level.batch));
    inputs.push_back({level, {}});
  }
  mpi::DistributedJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.policies = crowd.policies;
  job.margin = world.margin;
  job.min_depth = world.min_depth;
  job.report = crowd.report;
  job.containment = crowd.containment;
  job.contacts = world.contacts;
  require(mpi::run_frame(*engine, job));
  const std::vector<Hit> first(job.hit_list.begin(), job.hit_list.end());
  require(mpi::run_frame(*engine, job));
  CHECK(same_hits(first, {job.hit_list.begin(), job.hit_list.end()}));
  CHECK(std::is_sorted(first.begin(), first.end(), link_less));

  AllRanks out;
  const std::vector<Hit> hits = gather(ranks, job.hit_list);
  const std::vector<Contact> contacts = gather(ranks, job.contact_list);
  std::vector<std::size_t> order(hits.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return link_less(hits[a], hits[b]); });
  for (const std::size_t i : order) {
    out.frame.hits.push_back(hits[i]);
    if (!contacts.empty()) out.frame.contacts.push_back(contacts[i]);
  }
  for (std::size_t m = 0; m < shares.size(); ++m) {
    std::vector<std::uint8_t>& flags = out.frame.flags.emplace_back(crowd.owners[m].size(), std::uint8_t{0});
    for (std::size_t i = 0; i < shares[m].numbers.size(); ++i) flags[shares[m].numbers[i]] = shares[m].flags[i];
    MPI_Allreduce(MPI_IN_PLACE, flags.data(), static_cast<int>(flags.size()), MPI_UINT8_T, MPI_MAX, MPI_COMM_WORLD);
  }
  MPI_Allreduce(&job.traffic.poses_sent, &out.poses_sent, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
  return out;
}

bool same_contacts(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Contact)) == 0);
}

// How many hits are of characters on two ranks, one of which has a skin.
std::uint64_t skins_across(const RandomCrowd& crowd, const std::vector<Hit>& hits) {
  const std::size_t members = crowd.world.members.size();
  return static_cast<std::uint64_t>(std::count_if(hits.begin(), hits.end(), [&](const Hit& hit) {
    const std::size_t a = hit.batch_a.value - 1, b = hit.batch_b.value - 1;
    return a < members && b < members && (crowd.skins[a] || crowd.skins[b]) &&
           crowd.owners[a][hit.instance_a] != crowd.owners[b][hit.instance_b];
  }));
}

void check_same_frame(const Frame& expected, const Frame& found) {
  CHECK(missing_from(expected.hits, found.hits) == 0);
  CHECK(missing_from(found.hits, expected.hits) == 0);
  CHECK(same_hits(expected.hits, found.hits));
  CHECK(same_contacts(expected.contacts, found.contacts));
  CHECK(expected.flags == found.flags);
}

}  // namespace

TEST_CASE("all ranks together find the hits and contacts of one engine, bit for bit") {
  constexpr std::uint64_t kUsual = 40;
  const Ranks ranks;
  const std::uint64_t alone = number_from_environment("CAB_TEST_SEED", 0);
  std::uint64_t hits = 0, poses_sent = 0;
  std::uint64_t surfaces = 0,
                inside = 0;  // hits of skins on two ranks by triangles, and those of what is wholly inside
  for (std::uint64_t seed = alone ? alone : 1; seed <= (alone ? alone : rounds(kUsual)); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const RandomCrowd crowd = random_crowd(random, ranks.count);
    const Frame expected = by_one_engine(crowd, crowd.containment);
    const AllRanks found = by_all_ranks(crowd, ranks);
    check_same_frame(expected, found.frame);
    hits += expected.hits.size();
    poses_sent += found.poses_sent;
    if (!crowd.has_skins() || crowd.policies.exact != Exact::kSurface) continue;
    const std::uint64_t touching = skins_across(crowd, by_one_engine(crowd, false).hits);
    surfaces += touching;
    inside += skins_across(crowd, expected.hits) - touching;
  }
  if (ranks.rank == 0)
    MESSAGE("hits ", hits, ", characters whose poses were sent ", poses_sent, ", of skins on two ranks ", surfaces,
            " by triangles and ", inside, " inside, ranks ", ranks.count);
  if (alone == 0) {
    CHECK(hits >= least_count(1000, kUsual));
    if (ranks.count > 1) {
      CHECK(poses_sent >= least_count(100, kUsual));
      CHECK(surfaces >= least_count(100, kUsual));
      CHECK(inside >= least_count(20, kUsual));
    }
  }
}

TEST_CASE("characters as far apart as doubles go have the hits of one engine, though each rank has some near and far") {
  constexpr double kMost = std::numeric_limits<double>::max();
  const Ranks ranks;
  std::uint64_t far_hits = 0, poses_sent = 0;
  for (const double distance : {1e20, -1e30, 1.2e32, 1e39, -1e300, kMost})
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      CAPTURE(distance);
      CAPTURE(seed);
      Random random(seed);
      RandomCrowd crowd = random_crowd(random, ranks.count);
      // There all are at one place, so these are few.
      constexpr std::uint32_t kOneIn = 8;
      for (Member& member : crowd.world.members)
        for (std::size_t i = 0; i < member.poses.origins.size(); i += 3 * kOneIn) {
          member.poses.origins[i] = distance;
          member.poses.origins[i + 1] = seed % 2 == 0 ? 0 : -distance;
        }
      const Frame expected = by_one_engine(crowd, crowd.containment);
      const AllRanks found = by_all_ranks(crowd, ranks);
      check_same_frame(expected, found.frame);
      poses_sent += found.poses_sent;
      far_hits +=
          static_cast<std::uint64_t>(std::count_if(expected.hits.begin(), expected.hits.end(), [](const Hit& hit) {
            return hit.instance_a % kOneIn == 0 && hit.instance_b % kOneIn == 0;
          }));
    }
  if (ranks.rank == 0) MESSAGE("hits far away ", far_hits, ", characters whose poses were sent ", poses_sent);
  CHECK(far_hits > 500);
  if (ranks.count > 1) CHECK(poses_sent > 100);
}

TEST_CASE("characters as large as boxes and margins go have the hits of one engine") {
  constexpr float kHalf = 5e17f, kMargin = 9e17f;
  constexpr std::uint32_t kInstances = 12;
  const Ranks ranks;
  std::uint64_t hits = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    RandomCrowd crowd;
    Member& member = crowd.world.members.emplace_back();
    member.rig = random_rig(random, Topology::kTree, 3, 1);
    for (Leaf& leaf : member.rig.leaves)
      for (float& half : leaf.box.half) half *= kHalf;
    const auto format = static_cast<PoseFormat>(random.index(3));
    member.poses = random_poses(random, member.rig, kInstances, format, {6 * double{kHalf}, true, true, {}});
    crowd.skins.resize(1);
    std::vector<float>& margins = crowd.margins.emplace_back();
    for (std::uint32_t i = 0; i < kInstances; ++i) margins.push_back(random.chance(0.3) ? kMargin : 0);
    pair_all(crowd.world, 1, 1);
    own_all(random, ranks.count, crowd);
    const Frame expected = by_one_engine(crowd, crowd.containment);
    check_same_frame(expected, by_all_ranks(crowd, ranks).frame);
    hits += expected.hits.size();
  }
  if (ranks.rank == 0) MESSAGE("hits ", hits);
  CHECK(hits > 100);
}

}  // namespace cab::tests
