// Articulations with a skin: frames and queries take their boxes, by every strategy, and other calls refuse them.
#include "layout/tile.h"
#include "perf/harness/world.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/random_skins.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <cab/attached_object.h>
#include <cab/collision_checker.h>
#include <cab/motion_bound.h>
#include <cab/padded_leaves.h>
#include <cab/query.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <limits>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCount = 40;

// An engine with one batch of a skin, instance by instance near each other.
struct SkinWorld {
  SkinRig rig;
  Poses poses;
  EnginePtr engine;
  ArticulationId articulation;
  BatchId batch;

  SkinWorld(Random& random, SkinRegime regime, const EngineDesc& desc = {}, BatchKind kind = BatchKind::kCharacters)
      : rig(random_skin(random, regime)),
        poses(random_skin_poses(random, rig, kCount, PoseFormat::kMatrix3x4Rows, 1, 0.1, 8)),
        engine(make_engine(desc)) {
    require(add_articulation(*engine, rig.desc(), &articulation));
    batch = add_instances(*engine, articulation, kCount, kind);
  }

  Status run(FrameJob& job, std::vector<Hit>& hits) const {
    const BatchInput input = poses.input(batch);
    const PairRule rules[] = {{batch, batch, Pairing::kBetween}, {batch, batch, Pairing::kWithin}};
    job.inputs = {&input, 1};
    job.rules = rules;
    Status status = run_frame(*engine, job);
    if (status == Status::kHitsOverflow) {
      hits.resize(job.hits_needed);
      job.hits = hits;
      status = run_frame(*engine, job);
    }
    hits.resize(job.hit_count);
    return status;
  }
};

std::vector<std::array<std::uint32_t, 4>> names_of(const std::vector<Hit>& hits) {
  std::vector<std::array<std::uint32_t, 4>> out;
  for (const Hit& hit : hits) out.push_back({hit.instance_a, hit.link_a, hit.instance_b, hit.link_b});
  return out;
}

}  // namespace

TEST_CASE("boxes that compute_boxes writes hold a skin, on leaves and in every node above, by every refit") {
  Random random(70);
  std::size_t checked = 0;
  const std::uint64_t count = rounds(40);
  for (std::uint64_t round = 0; round < count; ++round) {
    const SkinWorld world(random, static_cast<SkinRegime>(round % kSkinRegimeCount));
    ArticulationInfo info;
    require(articulation_info(*world.engine, world.articulation, &info));
    std::vector<Box> boxes(std::size_t{info.node_count} * kCount);
    for (const Refit refit : {Refit::kCab, Refit::kCovariance, Refit::kAabbHull, Refit::kAabbVertices}) {
      Policies policies;
      policies.refit = refit;
      policies.strategy = Strategy::kTree;
      REQUIRE(compute_boxes(*world.engine, world.poses.input(world.batch), policies, boxes) == Status::kOk);
      const ArticulationDesc desc = world.rig.desc();
      for (std::uint32_t i = 0; i < kCount; i += 7) {
        const std::vector<ExactPose> exact = exact_poses(world.poses, i);
        for (std::size_t leaf = 0; leaf < world.rig.leaves.size(); ++leaf)
          for (const std::uint32_t vertex : world.rig.triangles[leaf]) {
            const ExactBox point = vertex_box(desc.skin, exact, vertex);
            for (const std::size_t node : {leaf, std::size_t{info.node_count} - 1}) {
              const Box& box = boxes[std::size_t{i} * info.node_count + node];
              OracleBox<float> stored{};
              std::copy_n(box.center, 3, stored.center);
              std::copy_n(box.half, 3, stored.half);
              for (int k = 0; k < 3; ++k) std::copy_n(box.axis[k], 3, stored.axis[k]);
              REQUIRE(judge_containment(stored, point).inside);
              ++checked;
            }
          }
      }
    }
  }
  CHECK(checked >= least_count(10000, 40));
}

TEST_CASE("frames of skins have the same hits by every strategy, instruction set and number of threads, as sequences") {
  Random random(71);
  std::size_t hits_seen = 0;
  const std::uint64_t count = rounds(20);
  for (std::uint64_t round = 0; round < count; ++round) {
    const auto regime = static_cast<SkinRegime>(round % kSkinRegimeCount);
    Random again = random;
    const SkinWorld world(random, regime);
    std::vector<Hit> first;
    FrameJob job;
    REQUIRE(world.run(job, first) == Status::kOk);
    hits_seen += first.size();
    for (const Strategy strategy : {Strategy::kBrute, Strategy::kRows, Strategy::kLinks, Strategy::kTree}) {
      FrameJob other;
      other.policies.strategy = strategy;
      std::vector<Hit> hits;
      REQUIRE(world.run(other, hits) == Status::kOk);
      CHECK(names_of(hits) == names_of(first));
    }
    for (const Isa isa : available_isas()) {
      EngineDesc desc;
      desc.isa = isa;
      desc.thread_count = 3;
      Random same = again;
      const SkinWorld one(same, regime, desc);
      std::vector<Hit> hits;
      FrameJob other;
      REQUIRE(one.run(other, hits) == Status::kOk);
      REQUIRE(hits.size() == first.size());
      CHECK((hits.empty() || std::memcmp(hits.data(), first.data(), hits.size() * sizeof(Hit)) == 0));
    }
    // Frame by frame, what a frame of characters reports of each instance alone.
    Random same = again;
    const SkinWorld sequence(same, regime, {}, BatchKind::kSequence);
    FrameJob within;
    const BatchInput input = sequence.poses.input(sequence.batch);
    const PairRule rule = {sequence.batch, sequence.batch, Pairing::kWithin};
    within.inputs = {&input, 1};
    within.rules = {&rule, 1};
    std::vector<Hit> hits(first.size() + 1);
    within.hits = hits;
    REQUIRE(run_frame(*sequence.engine, within) == Status::kOk);
    hits.resize(within.hit_count);
    std::vector<Hit> own;
    std::copy_if(first.begin(), first.end(), std::back_inserter(own),
                 [](const Hit& hit) { return hit.instance_a == hit.instance_b; });
    CHECK(names_of(hits) == names_of(own));
  }
  CHECK(hits_seen >= least_count(200, 20));
}

TEST_CASE("a batch that one tile holds has the hits of a larger one, and none of its instances is posed again") {
  constexpr std::uint32_t kFrames = 4;
  Random random(79);
  std::size_t hits_seen = 0;
  const std::uint64_t count = rounds(40);
  for (std::uint64_t round = 0; round < count; ++round) {
    const auto regime = static_cast<SkinRegime>(round % kSkinRegimeCount);
    // The boxes of few are posed with leaves as lanes.
    const std::uint32_t given = round / 3 % 2 == 0 ? 12 : 2 + random.index(kFewInstances - 1);
    const SkinRig rig = random_skin(random, regime);
    const Poses first = random_skin_poses(random, rig, given, PoseFormat::kMatrix3x4Rows, 1, 0.1, 2);
    std::vector<std::uint32_t> listed;
    for (std::uint32_t i = 0; i < given; ++i)
      if (i + 1 == given || random.chance(0.7)) listed.push_back(i);
    std::vector<std::uint8_t> moved(given);
    for (std::uint8_t& one : moved) one = random.chance(0.5);
    constexpr Refit kRefits[] = {Refit::kCab, Refit::kAabbHull, Refit::kCovariance};
    std::vector<Hit> found[2][kFrames];
    for (const bool large : {false, true}) {
      const EnginePtr engine = make_engine({});
      ArticulationId articulation;
      require(add_articulation(*engine, rig.desc(), &articulation));
      const BatchId batch = add_instances(*engine, articulation, large ? kCount : given);
      const PairRule rules[] = {{batch, batch, Pairing::kBetween}, {batch, batch, Pairing::kWithin}};
      Poses poses = first;
      for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
        if (frame == 3)
          for (std::uint32_t i = 0; i < given; ++i)
            for (std::uint32_t link = 0; link < poses.link_count && moved[i]; ++link)
              poses.pose(i, link)[3] += static_cast<float>(0.2 * rig.size);
        BatchInput input = poses.input(batch);
        input.count = given;
        if (frame == 1) input.instances = listed;
        if (frame >= 2) input.moved = moved;  // in the third frame all count as moved
        FrameJob job;
        job.policies.refit = kRefits[round % 3];
        job.inputs = {&input, 1};
        job.rules = rules;
        std::vector<Hit>& hits = found[large][frame];
        hits.resize(1 << 14);
        job.hits = hits;
        REQUIRE(run_frame(*engine, job) == Status::kOk);
        hits.resize(job.hit_count);
        hits_seen += hits.size();
        // Of some bodies of one leaf one link moves all.
        if (frame < 2 && regime != SkinRegime::kRigid && rig.leaves.size() > 1 && job.stats.candidates > 0)
          CHECK((job.stats.instances_posed > 0) == large);
      }
    }
    for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
      const std::vector<Hit>&few = found[0][frame], &many = found[1][frame];
      REQUIRE(few.size() == many.size());
      CHECK((few.empty() || std::memcmp(few.data(), many.data(), few.size() * sizeof(Hit)) == 0));
    }
  }
  CHECK(hits_seen >= least_count(1000, 40));
}

TEST_CASE("a level of nodes of a skin has boxes of the hierarchy, bit by bit, and loses nothing that touches") {
  Random random(80);
  std::size_t hits_seen = 0, boxes_seen = 0;
  const std::uint64_t count = rounds(20);
  for (std::uint64_t round = 0; round < count; ++round) {
    CAPTURE(round);
    const SkinWorld world(random, static_cast<SkinRegime>(round % kSkinRegimeCount));
    // An engine of the level alone, with a batch of a tile or of several.
    const EnginePtr engine = make_engine();
    LodDesc desc;
    require(add_articulation(*engine, world.rig.desc(), &desc.of));
    desc.kind = LodKind::kNodes;
    desc.max_leaves = 1 + random.index(4);
    ArticulationId level;
    require(add_lod(*engine, desc, &level));
    const std::uint32_t instances = round % 2 == 0 ? 2 : kCount;
    const BatchId batch = add_instances(*engine, level, instances);
    BatchInput input = world.poses.input(batch);
    if (!input.orientations.empty()) input.orientations.size = 4 * instances;
    if (!input.scales.empty()) input.scales.size = instances;
    ArticulationInfo of_fine, of_level;
    require(articulation_info(*world.engine, world.articulation, &of_fine));
    require(articulation_info(*engine, level, &of_level));
    for (const Policies& policies : all_refits()) {
      std::vector<Box> fine(kCount * of_fine.node_count), nodes(instances * of_level.node_count);
      require(compute_boxes(*world.engine, world.poses.input(world.batch), policies, fine));
      require(compute_boxes(*engine, input, policies, nodes));
      for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        const Box* const first = &fine[n / of_level.node_count * of_fine.node_count];
        CHECK(std::any_of(first, first + of_fine.node_count,
                          [&](const Box& box) { return same_bits(&box, &nodes[n], 1); }));
        ++boxes_seen;
      }
    }
    std::vector<std::uint16_t> leaf_of_link(world.rig.parents.size());
    require(lod_leaves(*engine, level, leaf_of_link));
    std::vector<Hit> hits;
    FrameJob job;
    REQUIRE(world.run(job, hits) == Status::kOk);
    const PairRule rule = {batch, batch, Pairing::kBetween};
    FrameJob coarse;
    coarse.inputs = {&input, 1};
    coarse.rules = {&rule, 1};
    std::vector<Hit> found(1 << 14);
    coarse.hits = found;
    REQUIRE(run_frame(*engine, coarse) == Status::kOk);
    found.resize(coarse.hit_count);
    for (const Hit& hit : hits) {
      if (hit.instance_a == hit.instance_b || hit.instance_b >= instances) continue;
      CHECK(std::any_of(found.begin(), found.end(), [&](const Hit& one) {
        return one.instance_a == hit.instance_a && one.instance_b == hit.instance_b &&
               one.leaf_a == leaf_of_link[hit.link_a] && one.leaf_b == leaf_of_link[hit.link_b];
      }));
      ++hits_seen;
    }
    // Rays of queries meet the boxes about what they are shot at.
    ReserveDesc reserved;
    reserved.queries = 1000;
    require(reserve(*engine, reserved));
    const std::vector<ExactPose> exact = exact_poses(world.poses, 1);
    for (std::size_t leaf = 0; leaf < world.rig.leaves.size(); ++leaf) {
      const Point at = skinned_vertex(world.rig.desc().skin, exact, world.rig.triangles[leaf][0]);
      Query query;
      query.want = QueryWant::kAll;
      query.length = static_cast<float>(2 * world.rig.size);
      query.direction[0] = 1;
      for (std::size_t c = 0; c < 3; ++c) query.position[c] = static_cast<double>(at[c]);
      query.position[0] -= world.rig.size;
      std::vector<QueryHit> met(4 * kCount);
      QueryJob shot;
      shot.inputs = {&input, 1};
      shot.queries = {&query, 1};
      shot.hits = met;
      REQUIRE(run_queries(*engine, shot) == Status::kOk);
      CHECK(
          std::any_of(met.begin(), met.begin() + static_cast<std::ptrdiff_t>(shot.hit_count), [&](const QueryHit& hit) {
            return hit.instance == 1 && hit.leaf == leaf_of_link[world.rig.leaves[leaf].link];
          }));
    }
    std::vector<float> margins(instances);
    CHECK(sweep_margins(*engine, input, input, margins) == Status::kSkinNotTaken);
    coarse.policies.exact = Exact::kSurface;
    CHECK(run_frame(*engine, coarse) == Status::kLodWithoutShapes);
  }
  CHECK(hits_seen >= least_count(100, 20));
  CHECK(boxes_seen >= least_count(1000, 20));
}

TEST_CASE("rays find the link of every vertex of a skin that they are shot at") {
  Random random(72);
  std::size_t shot = 0;
  for (int round = 0; round < 10; ++round) {
    const SkinWorld world(random, static_cast<SkinRegime>(round % 2));
    ReserveDesc reserved;
    reserved.queries = 1000;
    require(reserve(*world.engine, reserved));
    const ArticulationDesc desc = world.rig.desc();
    for (std::uint32_t i = 0; i < kCount; i += 11) {
      const std::vector<ExactPose> exact = exact_poses(world.poses, i);
      for (std::size_t leaf = 0; leaf < world.rig.leaves.size(); ++leaf) {
        const Point at = skinned_vertex(desc.skin, exact, world.rig.triangles[leaf][0]);
        const Vec3<double> direction = random.unit_vector();
        Query query;
        query.want = QueryWant::kAll;
        query.length = static_cast<float>(2 * world.rig.size);
        for (std::size_t c = 0; c < 3; ++c) {
          query.direction[c] = static_cast<float>(direction[c]);
          query.position[c] = static_cast<double>(at[c]) - world.rig.size * static_cast<double>(query.direction[c]);
        }
        const BatchInput input = world.poses.input(world.batch);
        std::vector<QueryHit> hits(kCount * world.rig.leaves.size());
        QueryJob job;
        job.inputs = {&input, 1};
        job.queries = {&query, 1};
        job.hits = hits;
        REQUIRE(run_queries(*world.engine, job) == Status::kOk);
        CHECK(std::any_of(
            hits.begin(), hits.begin() + static_cast<std::ptrdiff_t>(job.hit_count),
            [&](const QueryHit& hit) { return hit.instance == i && hit.link == world.rig.leaves[leaf].link; }));
        ++shot;
      }
    }
  }
  CHECK(shot > 20);
}

TEST_CASE("calls that need more than a skin's boxes refuse it by name") {
  Random random(73);
  const SkinWorld world(random, SkinRegime::kMany);
  const BatchInput input = world.poses.input(world.batch);
  ReserveDesc reserved;
  reserved.queries = 1;
  require(reserve(*world.engine, reserved));
  FrameJob job;
  std::vector<Hit> hits;
  job.policies.exact = Exact::kConvex;
  CHECK(world.run(job, hits) == Status::kSkinNotTaken);
  QueryJob queries;
  queries.inputs = {&input, 1};
  queries.exact = Exact::kConvex;
  CHECK(run_queries(*world.engine, queries) == Status::kSkinNotTaken);
  LodDesc lod;
  lod.of = world.articulation;
  ArticulationId level;
  CHECK(add_lod(*world.engine, lod, &level) == Status::kSkinNotTaken);
  std::vector<float> numbers(kCount);
  CHECK(sweep_margins(*world.engine, input, input, numbers) == Status::kSkinNotTaken);
  CHECK(find_touching_moments(*world.engine, {&input, 1}, {&input, 1}, 1, {}, numbers) == Status::kSkinNotTaken);
  CHECK(compute_contacts(*world.engine, {&input, 1}, {}, {}) == Status::kSkinNotTaken);

  const ArticulationDesc desc = world.rig.desc();
  const std::vector<float> lengths(world.rig.parents.size(), 0.5f);
  PaddedLeaves padded;
  CHECK(padded.set(desc.leaves, lengths) == Status::kSkinNotTaken);
  const std::vector<LinkPlaceDesc> places(world.rig.parents.size());
  KinematicsDesc kinematics;
  kinematics.link_parents = world.rig.parents;
  kinematics.links = places;
  detail::MotionBound bound;
  CHECK(bound.set(desc, kinematics, {}) == Status::kSkinNotTaken);
  CollisionChecker checker;
  REQUIRE(checker.set_robot(desc, kinematics) == Status::kOk);
  MotionSearch search;
  CHECK(checker.check_motions({}, {}, {}, search) == Status::kSkinNotTaken);
  CHECK(checker.set_padding(desc, lengths) == Status::kSkinNotTaken);
  AttachedDesc object;
  object.leaves = {desc.leaves.data, 1};
  Leaf leaf;
  const ArticulationDesc robot = {world.rig.parents, {}, {&leaf, 1}, {}};
  AttachedObject attached;
  CHECK(attached.set(robot, kinematics, object) ==
        (desc.leaves[0].link == 0 ? Status::kSkinNotTaken : Status::kBadLeafLink));
  object.leaves = {&leaf, 1};
  ArticulationDesc wrong = desc;
  wrong.skin.inverse_bind.size -= 16;
  CHECK(attached.set(wrong, kinematics, object) == Status::kBadSkin);
}

TEST_CASE("an instance that is masked since its skin is out of range says so") {
  SkinRig rig;
  rig.parents = {-1, 0};
  rig.influence_count = 2;
  rig.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  rig.links = {0, 1, 0, 1, 0, 1};
  rig.weights = {.01f, .99f, .01f, .99f, .01f, .99f};
  rig.inverse_bind = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,     0, 0, 1,
                      1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 9e17f, 0, 0, 1};
  rig.leaves.resize(1);
  rig.triangles = {{0, 1, 2}};
  rig.leaves[0].triangles = rig.triangles[0];
  const EnginePtr engine = make_engine();
  ArticulationId articulation;
  require(add_articulation(*engine, rig.desc(), &articulation));
  const BatchId batch = add_instances(*engine, articulation, 1);
  const float poses[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 9e17f, 0, 0};
  std::uint8_t flag = kInstanceOk;
  BatchInput input;
  input.batch = batch;
  input.poses.data = poses;
  input.flags = {&flag, 1};
  Box box;
  REQUIRE(compute_boxes(*engine, input, {}, {&box, 1}) == Status::kOk);
  CHECK(flag == kInstanceNotFinite);
  MaskReason reason;
  REQUIRE(why_masked(*engine, input, 0, &reason) == Status::kOk);
  CHECK(reason.flag == kInstanceNotFinite);
  CHECK(reason.cause == MaskCause::kBox);
}

TEST_CASE("a bad skin is refused with the vertex, link or leaf at fault, and nothing is added") {
  Random random(74);
  SkinRig rig = random_skin(random, SkinRegime::kMany);
  while (rig.inverse_bind.empty() || rig.leaves.size() < 2) rig = random_skin(random, SkinRegime::kMany);
  const auto refuse = [&](Status expected, std::uint32_t element, auto&& spoil) {
    SkinRig bad = rig;
    for (std::size_t leaf = 0; leaf < bad.leaves.size(); ++leaf) bad.leaves[leaf].triangles = bad.triangles[leaf];
    ArticulationDesc desc = bad.desc();
    spoil(bad, desc);
    const EnginePtr engine = make_engine();
    ArticulationId id;
    std::uint32_t element_at_fault = 0xffffffff;
    CHECK(add_articulation(*engine, desc, &id, &element_at_fault) == expected);
    if (element != 0xffffffff) CHECK(element_at_fault == element);
    CHECK(id.value == 0);
  };
  const std::size_t each = rig.influence_count;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refuse(Status::kBadSkin, 4, [&](SkinRig& bad, ArticulationDesc&) { bad.vertices[13] = nan; });
  refuse(Status::kBadSkin, 0, [&](SkinRig& bad, ArticulationDesc&) { bad.vertices[0] = 2e18f; });
  refuse(Status::kBadSkin, 2, [&](SkinRig& bad, ArticulationDesc&) { bad.weights[2 * each] = -0.1f; });
  refuse(Status::kBadSkin, 2, [&](SkinRig& bad, ArticulationDesc&) { bad.weights[2 * each + 1] = nan; });
  refuse(Status::kBadSkin, 1, [&](SkinRig& bad, ArticulationDesc&) {
    std::fill_n(bad.weights.begin() + static_cast<std::ptrdiff_t>(each), each, 0.0f);
  });
  refuse(Status::kBadSkin, 1, [&](SkinRig& bad, ArticulationDesc&) { bad.links[each] = 1000; });
  refuse(Status::kBadSkin, 1, [&](SkinRig& bad, ArticulationDesc&) { bad.inverse_bind[16 + 5] = nan; });
  refuse(Status::kBadSkin, 1,
         [&](SkinRig& bad, ArticulationDesc&) { std::fill_n(bad.inverse_bind.begin() + 16, 4, 0.0f); });
  refuse(Status::kBadSkin, 0xffffffff, [&](SkinRig&, ArticulationDesc& desc) { --desc.skin.inverse_bind.size; });
  refuse(Status::kBadSkin, 0xffffffff, [&](SkinRig&, ArticulationDesc& desc) { desc.skin.influence_count = 0; });
  refuse(Status::kBadSkin, 0xffffffff, [&](SkinRig&, ArticulationDesc& desc) { --desc.skin.influence_weights.size; });
  // Of one link many times, or of none: more influences than there may be links.
  for (const std::uint32_t count : {kMaxLinks, kMaxLinks + 1}) {
    SkinRig many = rig;
    many.influence_count = count;
    many.links.clear();
    many.weights.clear();
    for (std::size_t v = 0; 3 * v < rig.vertices.size(); ++v)
      for (std::size_t i = 0; i < count; ++i) {
        many.links.push_back(i < each ? rig.links[each * v + i] : 0xffffffff);
        many.weights.push_back(i < each ? rig.weights[each * v + i] : 0);
      }
    for (std::size_t leaf = 0; leaf < many.leaves.size(); ++leaf) many.leaves[leaf].triangles = many.triangles[leaf];
    ArticulationId id;
    CHECK(add_articulation(*make_engine(), many.desc(), &id) == (count == kMaxLinks ? Status::kOk : Status::kBadSkin));
  }
  refuse(Status::kBadSkin, 0xffffffff, [&](SkinRig&, ArticulationDesc& desc) { desc.skin.vertices.data = nullptr; });
  refuse(Status::kBadLeafTriangles, 1, [&](SkinRig& bad, ArticulationDesc&) { bad.triangles[1][2] = 1u << 30; });
  refuse(Status::kBadLeafTriangles, 1, [&](SkinRig& bad, ArticulationDesc&) { --bad.leaves[1].triangles.size; });
  refuse(Status::kBadLeafTriangles, 1, [&](SkinRig& bad, ArticulationDesc&) { bad.leaves[1].triangles.size = 1; });
  const ConvexPart part = {ShapeKind::kSphere, {}, {0, 0, 0, 1}, {1, 0, 0}, {}};
  refuse(Status::kBadLeafTriangles, 0, [&](SkinRig& bad, ArticulationDesc&) { bad.leaves[0].parts = {&part, 1}; });
  refuse(Status::kBadLeafTriangles, 0, [&](SkinRig&, ArticulationDesc& desc) { desc.skin = {}; });

  // Out of range in the link's frame alone.
  refuse(Status::kBadLeafBox, 0, [&](SkinRig& bad, ArticulationDesc&) {
    for (float& x : bad.vertices) x *= 1e10f;
    for (std::size_t i = 0; i < bad.inverse_bind.size(); ++i)
      if (i % 16 < 12) bad.inverse_bind[i] *= 1e10f;
  });

  // Forty links that all move one triangle.
  SkinRig many;
  many.influence_count = 40;
  for (std::uint32_t link = 0; link < 40; ++link) many.parents.push_back(static_cast<std::int32_t>(link) - 1);
  many.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  for (std::uint32_t i = 0; i < 120; ++i) {
    many.links.push_back(i % 40);
    many.weights.push_back(1);
  }
  many.triangles = {{0, 1, 2}};
  many.leaves.resize(1);
  many.leaves[0].triangles = many.triangles[0];
  const EnginePtr engine = make_engine();
  ArticulationId id;
  CHECK(add_articulation(*engine, many.desc(), &id) == Status::kTooManyInfluences);
}

}  // namespace cab::tests
