// Coarser levels of detail: what touches at a finer level touches at a coarser one, by leaves that stand for its links.
#include "engine/frame/all_pairs.h"
#include "perf/harness/random_world.h"
#include "scenes/crowd/crowd.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// A rig whose joints may be away from the origins of links on either side.
Rig jointed_rig(Random& random, Topology topology, unsigned links) {
  Rig rig = random_rig(random, topology, links, 1 + random.index(3));
  rig.ignored.clear();
  if (random.chance(0.5)) {
    rig.joints.clear();
    for (unsigned i = 0; i < 3 * links; ++i) rig.joints.push_back(static_cast<float>(random.uniform(-0.2, 0.2)));
  } else {
    rig.joints.assign(3 * links, 0.0f);
  }
  return rig;
}

// Moves every link so that its joint is where its parent has it, `play` away at most.
void join(Random& random, const Rig& rig, double play, Poses& poses) {
  for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
    std::vector<std::array<double, 12>> placed(rig.parents.size());  // columns, then the translation
    for (std::uint32_t link = 0; link < poses.link_count; ++link) {
      float* const pose = poses.pose(i, link);
      std::array<double, 12>& own = placed[link];
      double column[3][3];
      const double q[4] = {static_cast<double>(pose[0]), static_cast<double>(pose[1]), static_cast<double>(pose[2]),
                           static_cast<double>(pose[3])};
      quaternion_matrix(q, column);
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c) own[3 * k + c] = column[k][c];
      for (std::size_t c = 0; c < 3; ++c) own[9 + c] = static_cast<double>(pose[4 + c]);
      if (rig.parents[link] < 0) continue;
      const std::array<double, 12>& parent = placed[static_cast<std::size_t>(rig.parents[link])];
      const Vec3<double> away = play * random.uniform(0, 1) * random.unit_vector();
      for (std::size_t c = 0; c < 3; ++c) {
        own[9 + c] = parent[9 + c] + away[c];
        for (std::size_t k = 0; k < 3; ++k)
          own[9 + c] += rig.parent_offset[link][k] * parent[3 * k + c] -
                        static_cast<double>(rig.joints[3 * link + k]) * own[3 * k + c];
        pose[4 + c] = static_cast<float>(own[9 + c]);
      }
    }
  }
}

Poses joined_poses(Random& random, const Rig& rig, std::uint32_t count, double spread, double play = 0) {
  Poses out = random_poses(random, rig, count, PoseFormat::kQuaternionTranslation,
                           {spread, random.chance(0.5), random.chance(0.5), {}});
  join(random, rig, play, out);
  if (random.chance(0.3))
    for (std::uint32_t i = 0; i < count; ++i) out.scales.push_back(static_cast<float>(random.log_uniform(0.5, 2)));
  return out;
}

// The same poses as matrices, in which links may be mirrored as a whole.
Poses as_matrices(const Poses& from, PoseFormat format) {
  Poses out = from;
  out.format = format;
  out.data.resize(std::size_t{out.instance_count} * out.link_count * out.floats_per_pose());
  for (std::uint32_t i = 0; i < out.instance_count; ++i)
    for (std::uint32_t link = 0; link < out.link_count; ++link) {
      const float* const pose = from.pose(i, link);
      const double q[4] = {static_cast<double>(pose[0]), static_cast<double>(pose[1]), static_cast<double>(pose[2]),
                           static_cast<double>(pose[3])};
      write_pose(format, q,
                 {{static_cast<double>(pose[4]), static_cast<double>(pose[5]), static_cast<double>(pose[6])}},
                 out.pose(i, link));
    }
  return out;
}

ArticulationId add_lod_of(Engine& engine, ArticulationId of, LodKind kind, std::uint32_t leaves, const Poses& rest,
                          double play = 0) {
  LodDesc desc;
  desc.of = of;
  desc.kind = kind;
  desc.max_leaves = leaves;
  if (kind == LodKind::kReach) {
    desc.rest_poses.format = rest.format;
    desc.rest_poses.data = rest.data.data();
    desc.rest_pose_count = rest.instance_count;
    desc.joint_play = static_cast<float>(play);
  }
  ArticulationId id;
  require(add_lod(engine, desc, &id));
  return id;
}

std::vector<std::uint16_t> leaves_by_link(const Engine& engine, ArticulationId level) {
  ArticulationInfo info;
  require(articulation_info(engine, level, &info));
  std::vector<std::uint16_t> out(info.link_count, 0xeeee);
  require(lod_leaves(engine, level, out));
  return out;
}

std::vector<Hit> frame_of(Engine& engine, const std::vector<BatchInput>& inputs, const std::vector<PairRule>& rules,
                          const Policies& policies, float margin = 0, FrameStats* stats = nullptr,
                          decltype(&run_frame) frame = run_frame) {
  FrameJob job;
  job.inputs = inputs;
  job.rules = rules;
  job.policies = policies;
  job.margin = margin;
  std::vector<Hit> hits(1 << 17);
  Status status = Status::kHitsOverflow;
  while (status == Status::kHitsOverflow) {
    hits.resize(std::max(hits.size(), job.hits_needed));
    job.hits = hits;
    status = frame(engine, job);
  }
  require(status);
  hits.resize(job.hit_count);
  if (stats) *stats = job.stats;
  return hits;
}

// A crowd of which every instance is at one of several levels, on an engine that also knows the finest one. Batch b of
// `level_batches` is that of level b; level 0 is the finest.
struct Crowd {
  Poses poses;
  std::vector<BatchId> level_batches;
  std::vector<std::vector<std::uint16_t>> leaf_of_link;  // by level; of level 0 empty
  std::vector<std::uint32_t> level;                      // by instance
};

Crowd make_crowd(Random& random, Engine& engine, const Rig& rig, std::uint32_t count, double spread, bool nodes) {
  Crowd out;
  const double play = random.chance(0.3) ? 0.02 : 0;
  out.poses = joined_poses(random, rig, count, spread, play);
  Poses rest = joined_poses(random, rig, 1 + random.index(3), 1);
  rest.scales.clear();
  const ArticulationId fine = add_rig(engine, rig);
  out.level_batches.push_back(add_instances(engine, fine, count));
  out.leaf_of_link.emplace_back();
  for (const std::uint32_t leaves : {1 + random.index(8), 1u}) {
    const LodKind kind = nodes && random.chance(0.5) ? LodKind::kNodes : LodKind::kReach;
    const ArticulationId id = add_lod_of(engine, fine, kind, leaves, rest, play * 1.01);
    out.level_batches.push_back(add_instances(engine, id, count));
    out.leaf_of_link.push_back(leaves_by_link(engine, id));
  }
  if (random.chance(0.5) && out.poses.orientations.empty())
    out.poses = as_matrices(out.poses, random.chance(0.5) ? PoseFormat::kMatrix3x4Rows : PoseFormat::kMatrix4x4Columns);
  for (std::uint32_t i = 0; i < count; ++i) out.level.push_back(random.index(3));
  return out;
}

// The inputs of a crowd: every instance at the finest level, or each at its own.
void add_inputs(const Crowd& crowd, bool own_levels, std::vector<std::vector<std::uint32_t>>& lists,
                std::vector<BatchInput>& out) {
  for (std::uint32_t level = 0; level < crowd.level_batches.size(); ++level) {
    std::vector<std::uint32_t> list;
    for (std::uint32_t i = 0; i < crowd.level.size(); ++i)
      if ((own_levels ? crowd.level[i] : 0) == level) list.push_back(i);
    BatchInput input = crowd.poses.input(crowd.level_batches[level]);
    lists.push_back(std::move(list));
    input.instances = {lists.back().data(), lists.back().size()};
    if (input.instances.empty()) input.count = 0;
    out.push_back(input);
  }
}

// Rules between all batches, and within all.
std::vector<PairRule> all_rules(const std::vector<BatchInput>& inputs) {
  std::vector<PairRule> out;
  for (std::size_t a = 0; a < inputs.size(); ++a) {
    for (std::size_t b = a; b < inputs.size(); ++b) out.push_back({inputs[a].batch, inputs[b].batch});
    out.push_back({inputs[a].batch, inputs[a].batch, Pairing::kWithin});
  }
  return out;
}

// The hit of coarser leaves that stand for the links of a finer hit; none if one leaf stands for both.
struct Named {
  std::uint32_t batch, instance, leaf;
  bool operator<(const Named& other) const {
    return std::tie(batch, instance, leaf) < std::tie(other.batch, other.instance, other.leaf);
  }
};

const std::vector<Policies>& policies_to_try() {
  static const std::vector<Policies> out = [] {
    std::vector<Policies> all;
    for (const Policies& refit : all_refits())
      for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute})
        all.push_back({refit.refit, strategy, Exact::kNone, refit.extents});
    return all;
  }();
  return out;
}

// Checks that each fine hit lies under a coarse one. Returns how many did.
std::size_t check_covered(const std::vector<Crowd>& crowds, const std::vector<Hit>& fine,
                          const std::vector<Hit>& coarse, std::size_t* missing) {
  const auto named = [&crowds](BatchSlot slot, std::uint32_t instance, std::uint16_t link, std::uint16_t leaf) {
    for (const Crowd& crowd : crowds)
      for (std::uint32_t level = 0; level < crowd.level_batches.size(); ++level) {
        if (slot_of(crowd.level_batches[level]).value != slot.value) continue;
        const std::uint32_t own = crowd.level[instance];
        // The finest level is named by its links, others by their leaves.
        if (level > 0) return Named{slot.value, instance, leaf};
        if (own == 0) return Named{slot.value, instance, link};
        return Named{slot_of(crowd.level_batches[own]).value, instance, crowd.leaf_of_link[own][link]};
      }
    return Named{};
  };
  std::vector<std::pair<Named, Named>> have;
  for (const Hit& hit : coarse) {
    const Named a = named(hit.batch_a, hit.instance_a, hit.link_a, hit.leaf_a),
                b = named(hit.batch_b, hit.instance_b, hit.link_b, hit.leaf_b);
    have.push_back(a < b ? std::make_pair(a, b) : std::make_pair(b, a));
  }
  std::sort(have.begin(), have.end());
  std::size_t covered = 0;
  *missing = 0;
  for (const Hit& hit : fine) {
    const Named a = named(hit.batch_a, hit.instance_a, hit.link_a, hit.leaf_a),
                b = named(hit.batch_b, hit.instance_b, hit.link_b, hit.leaf_b);
    if (!(a < b) && !(b < a)) continue;  // one leaf stands for both links
    const bool found =
        std::binary_search(have.begin(), have.end(), a < b ? std::make_pair(a, b) : std::make_pair(b, a));
    *missing += !found;
    covered += found;
  }
  return covered;
}

}  // namespace

TEST_CASE("what touches at the finest level touches at any level, by leaves that stand for its links") {
  std::size_t covered = 0, coarse_hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const EnginePtr engine = make_engine();
    std::vector<Crowd> crowds;
    for (std::uint32_t c = 0; c < 2; ++c) {
      const auto topology = static_cast<Topology>(random.index(kTopologyCount));
      const Rig rig = jointed_rig(random, topology, static_cast<unsigned>(random.log_uniform(1, 40)));
      crowds.push_back(make_crowd(random, *engine, rig, 1 + random.index(30), random.uniform(0.5, 3), true));
    }
    std::vector<std::vector<std::uint32_t>> lists;
    lists.reserve(16);
    std::vector<BatchInput> fine, own;
    for (const Crowd& crowd : crowds) add_inputs(crowd, false, lists, fine);
    for (const Crowd& crowd : crowds) add_inputs(crowd, true, lists, own);
    const Policies policies = policies_to_try()[random.index(static_cast<unsigned>(policies_to_try().size()))];
    const float margin = random.chance(0.5) ? 0.0f : static_cast<float>(random.uniform(0, 0.3));
    FrameStats stats;
    const std::vector<Hit> at_finest = frame_of(*engine, fine, all_rules(fine), policies, margin, &stats),
                           at_own = frame_of(*engine, own, all_rules(own), policies, margin);
    CHECK(stats.instances_masked == 0);
    std::size_t missing = 0;
    covered += check_covered(crowds, at_finest, at_own, &missing);
    CHECK(missing == 0);
    coarse_hits += at_own.size();
  }
  CHECK(covered >= least_count(20000, 40));
  CHECK(coarse_hits >= least_count(10000, 40));
}

TEST_CASE(
    "no pair that the judge finds in a crowd is lost at a level of few leaves, of humanoids and of a rig of 368") {
  std::size_t judged = 0, reported = 0;
  for (const std::uint32_t links : {16u, 368u})
    for (std::uint64_t round = 1; round <= rounds(links == 16 ? 4 : 1); ++round) {
      CAPTURE(links);
      CAPTURE(round);
      scenes::CrowdSources sources;
      sources.rig_links = links;
      sources.area = 0.5;
      const std::uint32_t count = links == 16 ? 150 : 24;
      const scenes::Crowd scene = scenes::make_rigs(count, sources);
      std::vector<scenes::PosedGroup> posed, rest;
      scenes::pose_crowd(scene, 0.01 * static_cast<double>(round), posed);
      scenes::pose_crowd(scene, 0, rest);
      World world;
      world.members.emplace_back();
      Member& member = world.members[0];
      for (const std::int32_t parent : scene.groups[0].figure.link_parents) member.rig.parents.push_back(parent);
      for (const scenes::BodyLeaf& leaf : scene.groups[0].figure.leaves)
        member.rig.leaves.push_back({leaf.link, leaf.box, {}});
      member.poses.link_count = links;
      member.poses.instance_count = count;
      member.poses.data = posed[0].poses;
      member.poses.origins = posed[0].origins;
      world.rules = {{{1}, {1}}};
      const std::vector<Hit> truth = judge_world(world);
      const EnginePtr engine = make_engine();
      const ArticulationId fine = add_rig(*engine, member.rig);
      Poses at_rest = member.poses;
      at_rest.data = rest[0].poses;
      for (const LodKind kind : {LodKind::kReach, LodKind::kNodes})
        for (const std::uint32_t leaves : {1u, 5u}) {
          const ArticulationId level = add_lod_of(*engine, fine, kind, leaves, at_rest);
          const std::vector<std::uint16_t> leaf_of_link = leaves_by_link(*engine, level);
          const BatchId batch = add_instances(*engine, level, count);
          const std::vector<Hit> hits = frame_of(*engine, {member.poses.input(batch)}, {{batch, batch}}, {});
          std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint16_t, std::uint16_t>> have;
          for (const Hit& hit : hits) have.emplace_back(hit.instance_a, hit.instance_b, hit.leaf_a, hit.leaf_b);
          std::sort(have.begin(), have.end());
          std::size_t lost = 0;
          for (const Hit& hit : truth)
            lost += !std::binary_search(
                have.begin(), have.end(),
                std::make_tuple(hit.instance_a, hit.instance_b, leaf_of_link[hit.link_a], leaf_of_link[hit.link_b]));
          CHECK(lost == 0);
          judged += truth.size();
          reported += hits.size();
        }
    }
  MESSAGE(judged, " judged pairs of links, ", reported, " pairs of leaves reported");
  CHECK(judged >= least_count(20000, 1));
}

TEST_CASE("shapes that touch at the finest level are found at a level of boxes, by both exact tests") {
  std::size_t covered = 0;
  for (std::uint64_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    for (const Exact exact : {Exact::kConvex, Exact::kFcl}) {
      if (exact == Exact::kFcl && !build_info().fcl) {
        MESSAGE("skipped: this build lacks FCL");
        continue;
      }
      const EnginePtr engine = make_engine();
      std::vector<Crowd> crowds;
      const Rig rig = jointed_rig(random, Topology::kTree, 1 + random.index(10));
      crowds.push_back(make_crowd(random, *engine, rig, 12, 0.8, false));
      std::vector<std::vector<std::uint32_t>> lists;
      lists.reserve(8);
      std::vector<BatchInput> fine, own;
      add_inputs(crowds[0], false, lists, fine);
      add_inputs(crowds[0], true, lists, own);
      const Policies policies = {Refit::kCab, Strategy::kAuto, exact};
      const float margin = exact == Exact::kFcl || random.chance(0.5) ? 0 : 0.1f;
      std::size_t missing = 0;
      covered += check_covered(crowds, frame_of(*engine, fine, all_rules(fine), policies, margin),
                               frame_of(*engine, own, all_rules(own), policies, margin), &missing);
      CHECK(missing == 0);
    }
  }
  CHECK(covered >= least_count(1000, 10));
}

TEST_CASE("hits of levels are the same by every strategy, instruction set and number of threads") {
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(4); ++seed)
    for (const Refit refit : {Refit::kCab, Refit::kCovariance, Refit::kAabbHull, Refit::kAabbVertices}) {
      CAPTURE(seed);
      std::vector<Hit> expected;
      for (const Isa isa : available_isas())
        for (const bool threads : {false, true})
          for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute}) {
            Random random(100 + seed);
            EngineDesc desc;
            desc.isa = isa;
            if (threads) desc.scheduler = &scheduler;
            const EnginePtr engine = make_engine(desc);
            const Rig rig = jointed_rig(random, Topology::kTree, 12);
            const Crowd crowd = make_crowd(random, *engine, rig, 40, 1.5, true);
            std::vector<std::vector<std::uint32_t>> lists;
            lists.reserve(4);
            std::vector<BatchInput> own;
            add_inputs(crowd, true, lists, own);
            const std::vector<Hit> found =
                frame_of(*engine, own, all_rules(own), {refit, strategy, Exact::kNone, Extents::kChildren});
            if (expected.empty()) expected = found;
            // Boxes of links have larger bounds, with which nodes of more instances are compared.
            CHECK(missing_from(expected, found) == 0);
            if (strategy != Strategy::kLinks) CHECK(same_hits(found, expected));
          }
      hits += expected.size();
    }
  CHECK(hits >= least_count(2000, 4));
}

TEST_CASE("a level of nodes has boxes of the hierarchy, bit by bit, as many as asked for") {
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Rig rig = jointed_rig(random, static_cast<Topology>(random.index(3)), 2 + random.index(30));
    const Poses poses = joined_poses(random, rig, 17, 3);
    const EnginePtr engine = make_engine();
    const ArticulationId fine = add_rig(*engine, rig);
    std::vector<std::uint32_t> links_with_leaves;
    for (const Leaf& leaf : rig.leaves) links_with_leaves.push_back(leaf.link);
    std::sort(links_with_leaves.begin(), links_with_leaves.end());
    links_with_leaves.erase(std::unique(links_with_leaves.begin(), links_with_leaves.end()), links_with_leaves.end());
    const std::uint32_t asked = 1 + random.index(40);
    const ArticulationId level = add_lod_of(*engine, fine, LodKind::kNodes, asked, poses);
    ArticulationInfo of_fine, of_level;
    require(articulation_info(*engine, fine, &of_fine));
    require(articulation_info(*engine, level, &of_level));
    CHECK(of_level.leaf_count == std::min<std::size_t>(asked, links_with_leaves.size()));
    CHECK(of_level.node_count == 2 * of_level.leaf_count - 1);
    CHECK(of_level.depth <= of_fine.depth);
    const BatchId fine_batch = add_instances(*engine, fine, 17), batch = add_instances(*engine, level, 17);
    for (const Policies& policies : all_refits()) {
      std::vector<Box> a(17 * of_fine.node_count), b(17 * of_level.node_count);
      require(compute_boxes(*engine, poses.input(fine_batch), policies, a));
      require(compute_boxes(*engine, poses.input(batch), policies, b));
      const auto box = [](const std::vector<Box>& boxes, std::uint32_t nodes, std::uint32_t i, std::uint32_t n) {
        return boxes.data() + i * nodes + n;
      };
      for (std::uint32_t i = 0; i < 17; ++i) {
        CHECK(same_bits(box(a, of_fine.node_count, i, of_fine.node_count - 1),
                        box(b, of_level.node_count, i, of_level.node_count - 1), 1));
        for (std::uint32_t n = 0; n < of_level.node_count; ++n) {
          bool found = false;
          for (std::uint32_t m = 0; m < of_fine.node_count && !found; ++m)
            found = same_bits(box(a, of_fine.node_count, i, m), box(b, of_level.node_count, i, n), 1);
          CHECK(found);
        }
      }
    }
  }
}

TEST_CASE("sequences may be at levels too") {
  std::size_t covered = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed)
    for (const LodKind kind : {LodKind::kReach, LodKind::kNodes})
      for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
        CAPTURE(seed);
        Random random(seed);
        const EnginePtr engine = make_engine();
        Rig rigs[2];
        Poses poses[2];
        ArticulationId fine[2], level[2];
        std::vector<BatchInput> inputs[2];
        std::vector<std::uint16_t> leaf_of_link[2];
        for (std::size_t m = 0; m < 2; ++m) {
          rigs[m] = jointed_rig(random, Topology::kTree, 1 + random.index(20));
          poses[m] = joined_poses(random, rigs[m], 20, 0.5);
          fine[m] = add_rig(*engine, rigs[m]);
          Poses rest = joined_poses(random, rigs[m], 1, 1);
          level[m] = add_lod_of(*engine, fine[m], kind, 1 + random.index(5), rest);
          leaf_of_link[m] = leaves_by_link(*engine, level[m]);
          inputs[0].push_back(poses[m].input(add_instances(*engine, fine[m], 20, BatchKind::kSequence)));
          inputs[1].push_back(poses[m].input(add_instances(*engine, level[m], 20, BatchKind::kSequence)));
        }
        std::vector<Hit> hits[2];
        for (std::size_t l = 0; l < 2; ++l)
          hits[l] = frame_of(*engine, inputs[l], {{inputs[l][0].batch, inputs[l][1].batch}},
                             {Refit::kCab, strategy, Exact::kNone, Extents::kChildren});
        for (const Hit& hit : hits[0]) {
          const bool found = std::any_of(hits[1].begin(), hits[1].end(), [&](const Hit& other) {
            return other.instance_a == hit.instance_a && other.instance_b == hit.instance_b &&
                   other.leaf_a == leaf_of_link[0][hit.link_a] && other.leaf_b == leaf_of_link[1][hit.link_b];
          });
          CHECK(found);
          covered += found;
        }
      }
  CHECK(covered >= least_count(1000, 20));
}

TEST_CASE("a joint may be off by its play and no farther") {
  // An arm of 1 x 0.1 x 0.1 on a base of size 0, whose joint the rest pose has at 1 along x.
  const std::int32_t parents[] = {-1, 0};
  const Box point = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
  Box arm = point;
  arm.center[0] = 0.5f;
  arm.half[0] = 0.5f;
  const Leaf leaves[] = {{0, point, {}}, {1, arm, {}}};
  const float rest[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0};
  const EnginePtr engine = make_engine();
  ArticulationDesc desc;
  desc.link_parents = {parents, 2};
  desc.leaves = {leaves, 2};
  ArticulationId fine;
  require(add_articulation(*engine, desc, &fine));
  const std::uint32_t links[] = {0, 1};
  for (const float play : {0.0f, 0.5f})
    for (const float half : {2.02f, 2.52f}) {
      Box box = point;
      std::fill_n(box.half, 3, half);
      const LodLeaf coarse = {0, box, {links, 2}};
      LodDesc lod;
      lod.of = fine;
      lod.leaves = {&coarse, 1};
      lod.rest_poses.data = rest;
      lod.joint_play = play;
      ArticulationId level;
      const Status expected = play == 0 || half > 2.5f ? Status::kOk : Status::kLodLeafTooSmall;
      CHECK(add_lod(*engine, lod, &level) == expected);
    }
  // Two rest poses that have it 1 apart: it is half a unit from their middle.
  const float two[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  for (const float half : {1.9f, 2.02f}) {
    Box box = point;
    std::fill_n(box.half, 3, half);
    const LodLeaf coarse = {0, box, {links, 2}};
    LodDesc lod;
    lod.of = fine;
    lod.leaves = {&coarse, 1};
    lod.rest_poses.data = two;
    lod.rest_pose_count = 2;
    ArticulationId level;
    CHECK(add_lod(*engine, lod, &level) == (half > 2 ? Status::kOk : Status::kLodLeafTooSmall));
  }
}

TEST_CASE("a joint may be off by its play, seen from the child too") {
  // A base of size 0, and an arm of size 0 whose joint the rest pose has at 1 along x. The box is on the arm.
  const std::int32_t parents[] = {-1, 0};
  const Box point = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
  const Leaf leaves[] = {{0, point, {}}, {1, point, {}}};
  const float rest[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0};
  const EnginePtr engine = make_engine();
  ArticulationDesc desc;
  desc.link_parents = {parents, 2};
  desc.leaves = {leaves, 2};
  ArticulationId fine;
  require(add_articulation(*engine, desc, &fine));
  const std::uint32_t links[] = {0, 1};
  for (const float play : {0.0f, 0.5f})
    for (const float half : {1.02f, 1.52f}) {
      Box box = point;
      std::fill_n(box.half, 3, half);
      const LodLeaf coarse = {1, box, {links, 2}};
      LodDesc lod;
      lod.of = fine;
      lod.leaves = {&coarse, 1};
      lod.rest_poses.data = rest;
      lod.joint_play = play;
      ArticulationId level;
      const Status expected = play == 0 || half > 1.5f ? Status::kOk : Status::kLodLeafTooSmall;
      CHECK(add_lod(*engine, lod, &level) == expected);
    }
}

TEST_CASE("a level of boxes reports within a margin as docs/limits.md says: faces, and corners, of two boxes") {
  // A cube with sides of 2, in a box that is as large.
  const Box cube = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};
  Box around = cube;
  std::fill_n(around.half, 3, 1.02f);
  const std::int32_t parents[] = {-1};
  const Leaf leaf = {0, cube, {}};
  const std::uint32_t links[] = {0};
  const LodLeaf coarse = {0, around, {links, 1}};
  const float identity[] = {0, 0, 0, 1, 0, 0, 0};
  const EnginePtr engine = make_engine();
  ArticulationDesc desc;
  desc.link_parents = {parents, 1};
  desc.leaves = {&leaf, 1};
  ArticulationId fine, level;
  require(add_articulation(*engine, desc, &fine));
  LodDesc lod;
  lod.of = fine;
  lod.leaves = {&coarse, 1};
  lod.rest_poses.data = identity;
  require(add_lod(*engine, lod, &level));
  Poses poses;
  poses.link_count = 1;
  poses.instance_count = 2;
  poses.data = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  const struct {
    ArticulationId id;
    double half, faces, corners;  // the box, and how many margins apart two of them may be
  } cases[] = {{fine, 1, 1, std::sqrt(3.0)}, {level, 1.02, 2.75, 2.75 * std::sqrt(3.0)}};
  for (const auto& one : cases) {
    const BatchId batch = add_instances(*engine, one.id, 2);
    const auto is_reported = [&](double x, double y, double z) {
      poses.origins = {0, 0, 0, x, y, z};
      return frame_of(*engine, {poses.input(batch)}, {{batch, batch}}, {}, 1).size() == 1;
    };
    const double side = 2 * one.half, diagonal = one.corners / std::sqrt(3.0);
    for (const double off : {-1e-4, 1e-4}) {
      CHECK(is_reported(side + one.faces + off, 0, 0) == (off < 0));
      CHECK(is_reported(side + diagonal + off, side + diagonal + off, side + diagonal + off) == (off < 0));
    }
  }
}

TEST_CASE("two boxes on one link that meet corner to corner within the margin do so in boxes about them, too") {
  // A box whose corners point along x, in a larger one along the axes.
  const float h = std::sqrt(0.5f);
  const Box rotated = {{0, 0, 0}, {{h, h, 0}, {-h, h, 0}, {0, 0, 1}}, {1, 1, 1}},
            around = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1.43f, 1.43f, 1.02f}};
  const std::int32_t parents[] = {-1};
  const Leaf leaf = {0, rotated, {}};
  const std::uint32_t links[] = {0};
  const LodLeaf coarse = {0, around, {links, 1}};
  const float identity[] = {0, 0, 0, 1, 0, 0, 0};
  const EnginePtr engine = make_engine();
  ArticulationDesc desc;
  desc.link_parents = {parents, 1};
  desc.leaves = {&leaf, 1};
  ArticulationId fine, level;
  require(add_articulation(*engine, desc, &fine));
  LodDesc lod;
  lod.of = fine;
  lod.leaves = {&coarse, 1};
  lod.rest_poses.data = identity;
  require(add_lod(*engine, lod, &level));
  Poses poses;
  poses.link_count = 1;
  poses.instance_count = 2;
  poses.data = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  poses.origins = {0, 0, 0, 4.1, 0, 0};
  for (const ArticulationId id : {fine, level}) {
    const BatchId batch = add_instances(*engine, id, 2);
    CHECK(frame_of(*engine, {poses.input(batch)}, {{batch, batch}}, {}, 1).size() == 1);
  }
}

TEST_CASE("a level names for each link with leaves the leaf that stands for it, and ignores what its links ignore") {
  for (std::uint64_t seed = 1; seed <= rounds(30); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Rig rig = jointed_rig(random, Topology::kTree, 3 + random.index(15));
    for (std::uint32_t a = 0; a < rig.link_count(); ++a)
      for (std::uint32_t b = a + 1; b < rig.link_count(); ++b)
        if (random.chance(0.8)) rig.ignored.push_back({a, b});
    const Poses rest = joined_poses(random, rig, 1, 1);
    const EnginePtr engine = make_engine();
    const ArticulationId fine = add_rig(*engine, rig);
    for (const LodKind kind : {LodKind::kReach, LodKind::kNodes}) {
      const ArticulationId level = add_lod_of(*engine, fine, kind, 4, rest);
      const std::vector<std::uint16_t> leaf_of_link = leaves_by_link(*engine, level);
      ArticulationInfo info;
      require(articulation_info(*engine, level, &info));
      std::vector<bool> has_leaf(rig.link_count(), false), stands(info.leaf_count, false);
      for (const Leaf& leaf : rig.leaves) has_leaf[leaf.link] = true;
      for (std::uint32_t link = 0; link < rig.link_count(); ++link) {
        CHECK((leaf_of_link[link] == kNoLeaf) == !has_leaf[link]);
        if (has_leaf[link]) REQUIRE(leaf_of_link[link] < info.leaf_count);
        if (has_leaf[link]) stands[leaf_of_link[link]] = true;
      }
      CHECK(std::count(stands.begin(), stands.end(), true) == static_cast<std::ptrdiff_t>(info.leaf_count));
      // Leaves of the level are reported within an instance unless all of their links are ignored.
      const auto is_ignored = [&rig](std::uint32_t a, std::uint32_t b) {
        return std::any_of(rig.ignored.begin(), rig.ignored.end(), [&](const LinkPair& pair) {
          return (pair.a == a && pair.b == b) || (pair.a == b && pair.b == a);
        });
      };
      const BatchId batch = add_instances(*engine, level, 1);
      // All pairs of leaves that are not ignored.
      const std::vector<Hit> hits =
          frame_of(*engine, {rest.input(batch)}, {{batch, batch, Pairing::kWithin}}, {}, 0, nullptr, run_all_pairs);
      for (std::uint16_t a = 0; a < info.leaf_count; ++a)
        for (std::uint16_t b = static_cast<std::uint16_t>(a + 1); b < info.leaf_count; ++b) {
          bool reported = false;
          for (std::uint32_t x = 0; x < rig.link_count(); ++x)
            for (std::uint32_t y = 0; y < rig.link_count(); ++y)
              reported = reported || (leaf_of_link[x] == a && leaf_of_link[y] == b && !is_ignored(x, y));
          CHECK(std::any_of(hits.begin(), hits.end(), [&](const Hit& hit) {
                  return std::min(hit.leaf_a, hit.leaf_b) == a && std::max(hit.leaf_a, hit.leaf_b) == b;
                }) == reported);
        }
    }
  }
}

TEST_CASE("levels that do not fit are refused, and say which leaf is at fault") {
  const Box unit = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};
  // A chain of three, each 3 above its parent, and a tree of its own.
  const std::int32_t parents[] = {-1, 0, 1, -1};
  const Leaf leaves[] = {{0, unit, {}}, {1, unit, {}}, {2, unit, {}}, {3, unit, {}}};
  const float rest[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 3, 0, 0, 0, 1, 0, 0, 6, 0, 0, 0, 1, 0, 0, 100};
  const EnginePtr engine = make_engine();
  ArticulationDesc desc;
  desc.link_parents = {parents, 4};
  desc.leaves = {leaves, 4};
  ArticulationId fine, level = {77};
  require(add_articulation(*engine, desc, &fine));
  LodDesc good;
  good.of = fine;
  good.max_leaves = 2;
  good.rest_poses.data = rest;
  std::uint32_t bad = 99;
  const auto add = [&](const LodDesc& lod) { return add_lod(*engine, lod, &level, &bad); };

  LodDesc lod = good;
  lod.max_leaves = 1;
  CHECK(add(lod) == Status::kTooFewLeaves);  // two trees
  lod.kind = LodKind::kNodes;
  CHECK(add(lod) == Status::kOk);
  lod.max_leaves = 0;
  CHECK(add(lod) == Status::kTooFewLeaves);
  lod = good;
  lod.max_leaves = kMaxLeaves + 1;
  CHECK(add(lod) == Status::kTooFewLeaves);
  lod = good;
  lod.rest_poses.data = nullptr;
  CHECK(add(lod) == Status::kBadRestPose);
  lod = good;
  lod.rest_pose_count = 0;
  CHECK(add(lod) == Status::kBadRestPose);
  lod = good;
  const float off[28] = {};
  lod.rest_poses.data = off;
  CHECK(add(lod) == Status::kBadRestPose);
  for (const float play : {-1.0f, std::nanf(""), HUGE_VALF}) {
    lod = good;
    lod.joint_play = play;
    CHECK(add(lod) == Status::kBadLod);
  }
  lod = good;
  lod.kind = static_cast<LodKind>(2);
  CHECK(add(lod) == Status::kBadLod);
  lod = good;
  lod.of = {12345};
  CHECK(add(lod) == Status::kUnknownArticulation);
  CHECK(add_lod(*engine, good, nullptr) == Status::kBadOutput);
  REQUIRE(add(good) == Status::kOk);
  std::uint16_t of_link[4];
  CHECK(lod_leaves(*engine, level, {of_link, 4}) == Status::kOk);
  CHECK(lod_leaves(*engine, level, {of_link, 3}) == Status::kBadOutput);
  CHECK(lod_leaves(*engine, fine, {of_link, 4}) == Status::kBadLod);
  CHECK(lod_leaves(*engine, {12345}, {of_link, 4}) == Status::kUnknownArticulation);
  lod = good;
  lod.of = level;
  CHECK(add(lod) == Status::kBadLod);  // a level of a level

  // What the caller makes: from the middle of the chain, its ends reach sqrt(2) from their joints, 0 and 3 away.
  const auto cube = [&unit](float half) {
    Box out = unit;
    for (float& h : out.half) h = half;
    return out;
  };
  const std::uint32_t chain[] = {0, 1, 2}, alone[] = {3}, two[] = {0, 1}, unknown[] = {4};
  const float needed = 3 + std::sqrt(3.0f);  // link 2 is 3 away; link 0 is 3 below, and turns about the origin of 1
  const auto caller = [&](std::vector<LodLeaf> made) {
    LodDesc with = good;
    with.leaves = made;
    bad = 99;
    return add(with);
  };
  CHECK(caller({{1, cube(1.02f * needed), {chain, 3}}, {3, cube(1.02f), {alone, 1}}}) == Status::kOk);
  CHECK(caller({{1, cube(0.99f * needed), {chain, 3}}, {3, cube(1.02f), {alone, 1}}}) == Status::kLodLeafTooSmall);
  CHECK(bad == 0);
  CHECK(caller({{1, cube(1.02f * needed), {chain, 3}}, {3, cube(1), {alone, 1}}}) == Status::kLodLeafTooSmall);
  CHECK(bad == 1);
  CHECK(caller({{0, cube(1.02f * (6 + std::sqrt(3.0f))), {chain, 3}}, {3, cube(1.02f), {alone, 1}}}) == Status::kOk);
  CHECK(caller({{0, cube(0.99f * (6 + std::sqrt(3.0f))), {chain, 3}}, {3, cube(1.02f), {alone, 1}}}) ==
        Status::kLodLeafTooSmall);
  CHECK(caller({{1, cube(9), {two, 2}}, {3, cube(9), {alone, 1}}}) == Status::kBadLod);  // link 2 is missing
  CHECK(caller({{1, cube(9), {chain, 3}}, {1, cube(9), {alone, 1}}}) == Status::kBadLod);
  CHECK(bad == 1);
  CHECK(caller({{1, cube(9), {chain, 3}}, {2, cube(9), {alone, 1}}}) == Status::kBadLod);  // of another tree
  CHECK(bad == 1);
  CHECK(caller({{4, cube(9), {chain, 3}}, {3, cube(9), {alone, 1}}}) == Status::kBadLeafLink);
  CHECK(caller({{1, cube(9), {chain, 3}}, {3, cube(9), {unknown, 1}}}) == Status::kBadLeafLink);
  CHECK(bad == 1);
  CHECK(caller({{1, cube(-9), {chain, 3}}, {3, cube(9), {alone, 1}}}) == Status::kBadLeafBox);
  CHECK(caller({{1, {}, {chain, 3}}, {3, cube(9), {alone, 1}}}) == Status::kLodLeafTooSmall);  // a point
  Box flat = cube(9);
  flat.axis[2][2] = 0;
  CHECK(caller({{1, flat, {chain, 3}}, {3, cube(9), {alone, 1}}}) == Status::kBadLeafAxes);
  lod = good;
  const LodLeaf one = {1, cube(9), {chain, 3}};
  lod.leaves = {&one, 1};
  lod.kind = LodKind::kNodes;
  CHECK(add(lod) == Status::kBadLod);
  lod.kind = LodKind::kReach;
  lod.leaves = {nullptr, 1};
  CHECK(add(lod) == Status::kBadLod);
  lod.leaves = {&one, kMaxLeaves + 1};
  CHECK(add(lod) == Status::kTooManyLeaves);
}

TEST_CASE("a level of nodes keeps its articulation, and has no exact test") {
  Random random(5);
  const Rig rig = jointed_rig(random, Topology::kChain, 6);
  const Poses poses = joined_poses(random, rig, 2, 0.1);
  const EnginePtr engine = make_engine();
  const ArticulationId fine = add_rig(*engine, rig), level = add_lod_of(*engine, fine, LodKind::kNodes, 2, poses),
                       boxes = add_lod_of(*engine, fine, LodKind::kReach, 1, poses);
  const BatchId batch = add_instances(*engine, level, 2);
  CHECK(remove_articulation(*engine, fine) == Status::kArticulationInUse);
  FrameJob job;
  const BatchInput input = poses.input(batch);
  const PairRule rule = {batch, batch};
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};
  job.policies.exact = Exact::kConvex;
  CHECK(run_frame(*engine, job) == Status::kLodWithoutShapes);
  const Hit pair = {{slot_of(batch).value}, 0, {slot_of(batch).value}, 1, 0, 0, 0, 0};
  Contact contact;
  CHECK(compute_contacts(*engine, {&input, 1}, {&pair, 1}, {&contact, 1}) == Status::kBadPairs);
  CHECK(frame_of(*engine, {input}, {rule}, {}).size() > 0);
  MaskReason reason;
  CHECK(why_masked(*engine, input, 0, &reason) == Status::kOk);
  CHECK(reason.cause == MaskCause::kNone);
  REQUIRE(remove_batch(*engine, batch) == Status::kOk);
  CHECK(remove_articulation(*engine, fine) == Status::kArticulationInUse);
  REQUIRE(remove_articulation(*engine, level) == Status::kOk);
  CHECK(remove_articulation(*engine, fine) == Status::kOk);
  // A level of boxes stays without its articulation.
  const BatchId left = add_instances(*engine, boxes, 2);
  CHECK(frame_of(*engine, {poses.input(left)}, {{left, left}}, {}).size() == 1);
}

TEST_CASE("an instance that changes its level counts as moved, and the others rest") {
  Random random(6);
  const Rig rig = jointed_rig(random, Topology::kHumanoid, 19);
  const EnginePtr engine = make_engine();
  const Crowd crowd = make_crowd(random, *engine, rig, 60, 1.5, true);
  const std::vector<std::uint8_t> none(60, 0);
  std::size_t resting = 0;
  Crowd changing = crowd;
  std::vector<std::vector<Hit>> kept;              // by frame
  std::vector<std::vector<std::uint32_t>> levels;  // by frame: the levels
  for (int frame = 0; frame < 12; ++frame) {
    CAPTURE(frame);
    changing.level[random.index(60)] = random.index(3);
    std::vector<std::vector<std::uint32_t>> lists;
    lists.reserve(4);
    std::vector<BatchInput> inputs;
    add_inputs(changing, true, lists, inputs);
    std::vector<BatchInput> at_rest = inputs;
    for (BatchInput& input : at_rest) input.moved = none;
    FrameStats stats;
    const std::vector<Hit> found = frame_of(*engine, at_rest, all_rules(inputs), {}, 0, &stats);
    resting += stats.instances_resting;
    kept.push_back(found);
    levels.push_back(changing.level);
  }
  for (std::size_t frame = 0; frame < kept.size(); ++frame) {
    changing.level = levels[frame];
    std::vector<std::vector<std::uint32_t>> lists;
    lists.reserve(4);
    std::vector<BatchInput> inputs;
    add_inputs(changing, true, lists, inputs);
    CHECK(same_hits(frame_of(*engine, inputs, all_rules(inputs), {}), kept[frame]));
  }
  CHECK(resting > 400);
}

}  // namespace cab::tests
