// Static bodies: frames with them report what frames report in which every body is a character of its own.
#include "engine/session/static_bodies.h"

#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/convex_pairs.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <list>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr Box kUnitBox = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};

// Bodies, and what they point to.
struct Level {
  std::vector<StaticBody> bodies;
  std::list<std::vector<float>> vertices;
  std::list<std::vector<ConvexPart>> parts;

  StaticDesc desc() const {
    StaticDesc out;
    out.bodies = bodies;
    return out;
  }
};

ConvexPart any_part(Random& random, Level& level) {
  constexpr ShapeKind kKinds[] = {ShapeKind::kBox,        ShapeKind::kEllipsoid, ShapeKind::kCapsule,
                                  ShapeKind::kConvexHull, ShapeKind::kSphere,    ShapeKind::kCylinder};
  ConvexPart part;
  part.kind = kKinds[random.index(6)];
  for (float& size : part.size) size = static_cast<float>(random.uniform(0.05, 0.3));
  for (float& at : part.position) at = static_cast<float>(random.uniform(-0.2, 0.2));
  double q[4];
  random_turn(random, q);
  for (std::size_t c = 0; c < 4; ++c) part.rotation[c] = static_cast<float>(q[c]);
  if (part.kind != ShapeKind::kConvexHull) return part;
  std::vector<float> vertices;
  for (std::uint32_t v = 0; v < 5 + random.index(10); ++v) {
    const Vec3<double> at = random.unit_vector();
    for (std::size_t c = 0; c < 3; ++c) vertices.push_back(static_cast<float>(0.3 * at[c]));
  }
  level.vertices.push_back(std::move(vertices));
  part.vertices = {level.vertices.back().data(), level.vertices.back().size()};
  return part;
}

// Bodies about a point: boxes of their own size, or up to two parts in a box.
Level random_level(Random& random, std::uint32_t count, double spread, const Vec3<double>& about) {
  Level out;
  for (std::uint32_t i = 0; i < count; ++i) {
    StaticBody body;
    double q[4];
    random_turn(random, q);
    const double length = random.chance(0.3) ? random.log_uniform(0.01, 100) : 1;
    for (std::size_t c = 0; c < 4; ++c) body.rotation[c] = static_cast<float>(length * q[c]);
    for (std::size_t c = 0; c < 3; ++c) body.origin[c] = about[c] + random.uniform(-spread, spread);
    if (random.chance(0.5)) {
      body.box = random_box(random, random.uniform(0, 0.3) * random.unit_vector(), 0.02, 0.5);
    } else {
      body.box = kUnitBox;
      std::vector<ConvexPart> parts;
      for (std::uint32_t p = 0; p < 1 + random.index(2); ++p) parts.push_back(any_part(random, out));
      out.parts.push_back(std::move(parts));
      body.parts = {out.parts.back().data(), out.parts.back().size()};
    }
    out.bodies.push_back(body);
  }
  return out;
}

// Two crowds of several poses, and the level among them.
World crowds(Random& random, double spread, const Vec3<double>& about) {
  World world;
  for (const std::uint32_t count : {20u, 33u}) {
    PoseRange range = any_pose_range(random, true, about, spread);
    world.members.push_back(any_member(random, count, BatchKind::kCharacters, range, 12));
  }
  pair_all(world, 1, 2);
  return world;
}

// The same world with every body of a level as a batch of one character, which rules pair with the members before.
World with_characters(World world, const Level& level) {
  const auto members = static_cast<std::uint32_t>(world.members.size());
  for (const StaticBody& body : level.bodies) {
    Member member;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, body.box, body.parts}};
    member.poses.link_count = member.poses.instance_count = 1;
    member.poses.data = {body.rotation[0], body.rotation[1], body.rotation[2], body.rotation[3], 0, 0, 0};
    member.poses.origins.assign(body.origin, body.origin + 3);
    world.members.push_back(member);
    for (std::uint32_t m = 1; m <= members; ++m)
      world.rules.push_back({{static_cast<std::uint32_t>(world.members.size())}, {m}, Pairing::kBetween});
  }
  return world;
}

BatchId add_level(Engine& engine, const StaticDesc& desc) {
  BatchId id;
  std::uint32_t bad = 0;
  REQUIRE(add_static_batch(engine, desc, &id, &bad) == Status::kOk);
  return id;
}

// What a frame gets of static bodies.
BatchInput input_of(BatchId level) {
  BatchInput out;
  out.batch = level;
  return out;
}

// An engine with the members of a world and a level, and its frames.
struct Scene {
  World world;
  EnginePtr engine;
  BatchId level;
  std::uint32_t bodies;
  Resting resting = Resting::kReported;
  std::vector<std::uint32_t> layers, masks;        // of the bodies
  std::vector<std::uint8_t> flags, in_contact;     // likewise
  std::vector<std::vector<std::uint8_t>> touches;  // of the members
  std::vector<std::vector<std::uint8_t>> moved;    // likewise; empty for all

  Scene(const World& of, const StaticDesc& desc, const EngineDesc& how = {})
      : world(of), engine(make_engine_for(of, how)), level(add_level(*engine, desc)) {
    bodies = static_cast<std::uint32_t>(desc.bodies.size + desc.triangles.size / 3);
    moved.resize(of.members.size());
  }

  Status try_run(const Policies& policies, Report report, std::size_t room, Outcome& out) {
    std::vector<BatchInput> inputs;
    touches.clear();
    for (const Member& member : world.members) touches.emplace_back(member.poses.instance_count, std::uint8_t{0xee});
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      inputs.push_back(world.members[m].poses.input({m + 1}));
      inputs[m].in_contact = touches[m];
      inputs[m].moved = moved[m];
    }
    BatchInput own = input_of(level);
    flags.assign(bodies, 0xee);
    in_contact.assign(bodies, 0xee);
    own.flags = flags;
    own.in_contact = in_contact;
    own.layers = layers;
    own.layer_masks = masks;
    inputs.push_back(own);
    std::vector<PairRule> rules = world.rules;
    for (PairRule& rule : rules) rule.resting = resting;
    for (std::uint32_t m = 1; m <= world.members.size(); ++m) rules.push_back({{m}, level, Pairing::kBetween, resting});
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.policies = policies;
    job.margin = world.margin;
    job.report = report;
    out.hits.assign(room, {});
    out.contacts.assign(world.contacts ? room : 0, {});
    job.hits = out.hits;
    job.contacts = out.contacts;
    const Status status = run_frame(*engine, job);
    out.hits.resize(status == Status::kOk ? job.hit_count : 0);
    if (world.contacts) out.contacts.resize(out.hits.size());
    out.stats = job.stats;
    return status;
  }
  Outcome run(const Policies& policies = {}, Report report = Report::kHits) {
    Outcome out;
    REQUIRE(try_run(policies, report, 40000, out) == Status::kOk);
    return out;
  }

  // The hits as those of with_characters: body i is the only instance of batch level + i.
  std::vector<Hit> as_characters(std::vector<Hit> hits) const {
    const std::uint32_t slot = slot_of(level).value;
    for (Hit& hit : hits) {
      REQUIRE(hit.batch_a.value < slot);
      if (hit.batch_b.value != slot) continue;
      REQUIRE(hit.instance_b < bodies);
      hit.batch_b.value = slot + hit.instance_b;
      hit.instance_b = 0;
    }
    return hits;
  }
};

bool same_contacts(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Contact)) == 0);
}

std::size_t hits_of(BatchId level, const std::vector<Hit>& hits) {
  return static_cast<std::size_t>(std::count_if(
      hits.begin(), hits.end(), [level](const Hit& hit) { return hit.batch_b.value == slot_of(level).value; }));
}

Policies policies_of(Refit refit, Strategy strategy, Exact exact) {
  Policies out;
  out.refit = refit;
  out.strategy = strategy;
  out.exact = exact;
  return out;
}

}  // namespace

TEST_CASE("static bodies are hit like characters of one leaf, by every strategy, refit, exact test, ISA and thread") {
  std::size_t hits = 0;
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  for (std::uint32_t seed = 1; seed <= rounds(6); ++seed) {
    Random random(seed);
    const bool far = random.chance(0.3);
    const Vec3<double> about = far ? Vec3<double>{2e9, -3e6, 1e5} : Vec3<double>{};
    World world = crowds(random, 2, about);
    if (random.chance(0.5)) world.margin = 0.1f;
    const Level level = random_level(random, 1 + random.index(60), 2, about);
    const World reference = with_characters(world, level);
    for (const Refit refit : {Refit::kCab, Refit::kBest3, Refit::kAabbHull})
      for (const Strategy strategy :
           {Strategy::kAuto, Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute})
        for (const Exact exact : {Exact::kNone, Exact::kConvex, Exact::kFcl}) {
          if (exact == Exact::kFcl && (!build_info().fcl || strategy != Strategy::kRows)) continue;
          CAPTURE(seed);
          CAPTURE(static_cast<int>(refit));
          CAPTURE(static_cast<int>(strategy));
          CAPTURE(static_cast<int>(exact));
          const Policies policies = policies_of(refit, strategy, exact);
          const EnginePtr engine = make_engine_for(reference);
          const Outcome expected = run_on(*engine, reference, policies);
          const bool reference_has_words =
              std::any_of(engine->batches.begin(), engine->batches.end(),
                          [](const auto& stored) { return stored->crowd.has_words || stored->crowd.is_by_place; });
          const std::vector<Isa> isas = available_isas();
          EngineDesc how;
          how.isa = isas[random.index(static_cast<unsigned>(isas.size()))];
          if (random.chance(0.5)) how.scheduler = &scheduler;
          Scene scene(world, level.desc(), how);
          for (int frame = 0; frame < 3; ++frame) {  // from the second one on the bodies rest
            const Outcome found = scene.run(policies);
            CHECK(same_hits(scene.as_characters(found.hits), expected.hits));
            // Where characters have words, sides in float find candidates that bounds in double tell apart.
            if (!reference_has_words) CHECK(found.stats.candidates == expected.stats.candidates);
            CHECK(found.stats.leaf_pairs == expected.stats.leaf_pairs);
            CHECK(found.stats.exact_tests == expected.stats.exact_tests);
            CHECK(found.stats.instances_resting == (frame ? scene.bodies : 0));
            CHECK(scene.flags == std::vector<std::uint8_t>(scene.bodies, 0));
            hits += hits_of(scene.level, found.hits);
            for (std::uint32_t i = 0; i < scene.bodies; ++i) {
              const bool hit = std::any_of(found.hits.begin(), found.hits.end(), [&](const Hit& one) {
                return one.batch_b.value == slot_of(scene.level).value && one.instance_b == i;
              });
              if (scene.in_contact[i] != hit) FAIL_CHECK("body ", i);
            }
          }
          Scene touching(world, level.desc(), how);
          touching.run(policies, Report::kInContact);
          touching.run(policies, Report::kInContact);
          CHECK(touching.in_contact == scene.in_contact);
          CHECK(touching.touches == scene.touches);
        }
  }
  CHECK(hits >= least_count(1000, 6));
}

TEST_CASE("contacts and distances of static bodies are those of characters of one leaf, bit for bit") {
  std::size_t contacts = 0;
  for (std::uint32_t seed = 1; seed <= rounds(8); ++seed) {
    CAPTURE(seed);
    Random random(100 + seed);
    World world = crowds(random, 2, {});
    world.contacts = true;
    const Level level = random_level(random, 40, 2, {});
    for (const Report report : {Report::kHits, Report::kDistances}) {
      world.margin = report == Report::kDistances ? 0.3f : 0;
      const World reference = with_characters(world, level);
      const Policies policies = policies_of(Refit::kCab, Strategy::kAuto, Exact::kConvex);
      const Outcome expected = run_on(*make_engine_for(reference), reference, policies, run_frame, report);
      Scene scene(world, level.desc());
      for (int frame = 0; frame < 2; ++frame) {
        const Outcome found = scene.run(policies, report);
        CHECK(same_hits(scene.as_characters(found.hits), expected.hits));
        CHECK(same_contacts(found.contacts, expected.contacts));
        contacts += hits_of(scene.level, found.hits);
      }
    }
  }
  CHECK(contacts >= least_count(500, 8));
}

TEST_CASE("no frame with static bodies loses a pair that the judge finds") {
  std::size_t judged = 0;
  for (std::uint32_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(200 + seed);
    const Vec3<double> about = random.chance(0.5) ? Vec3<double>{4e6, 0, -5e6} : Vec3<double>{};
    World world = crowds(random, 2, about);
    world.margin = random.chance(0.5) ? 0.2f : 0;
    const Level level = random_level(random, 30, 2, about);
    const std::vector<Hit> touching = judge_world(with_characters(world, level));
    for (const Refit refit : {Refit::kCab, Refit::kAabbHull, Refit::kAabbVertices}) {
      // Without parts, so that the vertices of a body are those of its box.
      Level boxes = level;
      for (StaticBody& body : boxes.bodies) body.parts = {};
      Scene scene(world, boxes.desc());
      for (int frame = 0; frame < 2; ++frame) {
        std::vector<Hit> hits = scene.as_characters(scene.run(policies_of(refit, Strategy::kAuto, Exact::kNone)).hits);
        std::sort(hits.begin(), hits.end(), link_less);
        CHECK(missing_from(touching, hits) == 0);
      }
    }
    judged += touching.size();
  }
  CHECK(judged >= least_count(500, 6));
}

TEST_CASE("characters that rest among static bodies are tested, or skipped where the rule says so") {
  Random random(7);
  World world = crowds(random, 2, {});
  const Level level = random_level(random, 50, 2, {});
  const Outcome expected = run_world(with_characters(world, level));
  for (const Resting resting : {Resting::kReported, Resting::kSkipped}) {
    Scene scene(world, level.desc());
    scene.resting = resting;
    for (std::size_t m = 0; m < 2; ++m) scene.moved[m].assign(world.members[m].poses.instance_count, 1);
    scene.run();
    const auto rests = [&scene](BatchSlot batch, std::uint32_t instance) {
      return batch.value > 2 || scene.moved[batch.value - 1][instance] == 0;
    };
    for (int frame = 0; frame < 4; ++frame) {
      std::uint32_t resting_count = scene.bodies;
      for (auto& bytes : scene.moved)
        for (std::uint8_t& byte : bytes) {
          byte = random.chance(0.4);
          resting_count += !byte;
        }
      std::vector<Hit> hits = expected.hits;
      if (resting == Resting::kSkipped)
        hits.erase(std::remove_if(hits.begin(), hits.end(),
                                  [&rests](const Hit& hit) {
                                    return rests(hit.batch_a, hit.instance_a) && rests(hit.batch_b, hit.instance_b);
                                  }),
                   hits.end());
      const Outcome found = scene.run();
      CHECK(same_hits(scene.as_characters(found.hits), hits));
      CHECK(found.stats.instances_resting == resting_count);
    }
  }
}

TEST_CASE("layers of static bodies decide which characters they are tested against") {
  Random random(9);
  World world = crowds(random, 2, {});
  const Level level = random_level(random, 50, 2, {});
  World reference = with_characters(world, level);
  Scene scene(world, level.desc());
  for (std::uint32_t i = 0; i < scene.bodies; ++i) {
    scene.layers.push_back(random.index(3));
    scene.masks.push_back(random.chance(0.3) ? 0 : ~0u);
    reference.members[2 + i].layers = {scene.layers[i]};
    reference.members[2 + i].layer_masks = {scene.masks[i]};
  }
  const Outcome expected = run_world(reference);
  for (int frame = 0; frame < 2; ++frame) {
    const Outcome found = scene.run();
    CHECK(same_hits(scene.as_characters(found.hits), expected.hits));
    CHECK(hits_of(scene.level, found.hits) > 10);
  }
}

namespace {

// Frames in which some bodies change one of their words, their layers or their masks.
void check_words_that_change(std::vector<std::uint32_t> Scene::*words, std::vector<std::uint32_t> Member::*of_member,
                             Resting resting) {
  Random random(10);
  const World world = crowds(random, 2, {});
  const Level level = random_level(random, 50, 2, {});
  Scene scene(world, level.desc());
  scene.resting = resting;
  for (std::size_t m = 0; m < 2; ++m) scene.moved[m].assign(world.members[m].poses.instance_count, 0);
  std::vector<std::uint32_t> layers(scene.bodies, ~0u);
  std::size_t changed_hits = 0;
  for (int frame = 0; frame < 12; ++frame) {
    CAPTURE(frame);
    std::vector<std::uint32_t> next = layers;
    if (frame % 4 == 3) {
      next.assign(scene.bodies, ~0u);  // no layers are given
    } else if (frame % 4 != 2) {
      for (std::uint32_t& layer : next)
        if (random.chance(0.2)) layer = random.index(2);
    }
    scene.*words = frame % 4 == 3 ? std::vector<std::uint32_t>() : next;
    World reference = with_characters(world, level);
    for (std::uint32_t i = 0; i < scene.bodies; ++i) reference.members[2 + i].*of_member = {next[i]};
    std::vector<Hit> hits = run_world(reference).hits;
    const auto changed = [&](const Hit& hit) {
      return hit.batch_b.value > 2 && next[hit.batch_b.value - 3] != layers[hit.batch_b.value - 3];
    };
    if (frame > 0) {
      changed_hits += static_cast<std::size_t>(std::count_if(hits.begin(), hits.end(), changed));
      if (resting == Resting::kSkipped)
        hits.erase(std::remove_if(hits.begin(), hits.end(), [&](const Hit& hit) { return !changed(hit); }), hits.end());
    }
    const Outcome found = scene.run();
    CHECK(same_hits(scene.as_characters(found.hits), hits));
    layers = next;
  }
  CHECK(changed_hits > 20);
}

}  // namespace

TEST_CASE("a static body whose layers change counts as moved, whoever rests beside it") {
  for (const Resting resting : {Resting::kReported, Resting::kSkipped})
    check_words_that_change(&Scene::layers, &Member::layers, resting);
}

TEST_CASE("a static body whose layer mask alone changes counts as moved, whoever rests beside it") {
  for (const Resting resting : {Resting::kReported, Resting::kSkipped})
    check_words_that_change(&Scene::masks, &Member::layer_masks, resting);
}

TEST_CASE("static bodies are kept in their strips, whatever else changes") {
  Random random(11);
  World world = crowds(random, 3, {});
  const Level level = random_level(random, 400, 3, {});
  Scene scene(world, level.desc());
  scene.run();
  scene.run();
  CrowdClasses& kept = scene.engine->crowd.kept;
  CHECK(kept.end_sorted == 400);
  const float mark = kept.of[0].reach *= 1.25f;  // as good, and gone when the strips are made anew
  for (int frame = 0; frame < 5; ++frame) {
    for (Member& member : scene.world.members)
      member.poses = random_poses(random, member.rig, member.poses.instance_count, member.poses.format,
                                  {3, !member.poses.orientations.empty(), true, {}});
    const Outcome found = scene.run();
    CHECK(same_hits(scene.as_characters(found.hits), run_world(with_characters(scene.world, level)).hits));
    CHECK(kept.end_sorted == 400);
    CHECK(kept.of[0].reach == mark);
    CHECK(found.stats.instances_resting == 400);
  }
  scene.world.margin = 0.25f;  // all are bounded again
  const World wider = with_characters(scene.world, level);
  const Outcome expected = run_world(wider);
  for (int frame = 0; frame < 3; ++frame) {
    const Outcome found = scene.run();
    CHECK(same_hits(scene.as_characters(found.hits), expected.hits));
    CHECK(found.stats.instances_resting == (frame ? 400 : 0));
  }
}

TEST_CASE("a triangle mesh is hit where the hulls of its triangles are, wherever its vertices lie") {
  std::size_t hits = 0;
  for (std::uint32_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(300 + seed);
    // Vertices near the mesh's origin, or far from it.
    const double far = seed % 2 ? 0 : 4096;
    StaticDesc desc;
    std::vector<float> vertices;
    std::vector<std::uint32_t> triangles;
    for (int v = 0; v < 60; ++v)
      for (int c = 0; c < 3; ++c) vertices.push_back(static_cast<float>(far + random.uniform(-2, 2)));
    for (std::uint32_t t = 0; t < 80; ++t) {
      const std::uint32_t first = random.index(60);
      for (const std::uint32_t corner : {first, (first + 1 + random.index(29)) % 60, (first + 30) % 60})
        triangles.push_back(corner);
    }
    desc.vertices = vertices;
    desc.triangles = triangles;
    for (double& at : desc.origin) at = -far;
    const World world = crowds(random, 2, {});
    // The same triangles as bodies, with vertices in double and then rounded about a point near the triangle.
    Level level;
    for (std::size_t t = 0; t < triangles.size(); t += 3) {
      StaticBody body;
      std::vector<float> corners;
      for (std::size_t i = 0; i < 9; ++i)
        corners.push_back(static_cast<float>(static_cast<double>(vertices[3 * triangles[t + i / 3] + i % 3]) - far));
      level.vertices.push_back(corners);
      ConvexPart hull;
      hull.kind = ShapeKind::kConvexHull;
      hull.vertices = {level.vertices.back().data(), 9};
      level.parts.push_back({hull});
      REQUIRE(fit_box(hull.vertices, &body.box) == Status::kOk);
      body.parts = {level.parts.back().data(), 1};
      level.bodies.push_back(body);
    }
    const Policies policies = policies_of(Refit::kCab, Strategy::kAuto, Exact::kConvex);
    const Outcome expected = run_world(with_characters(world, level), policies);
    Scene scene(world, desc);
    for (int frame = 0; frame < 2; ++frame) {
      const Outcome found = scene.run(policies);
      CHECK(same_hits(scene.as_characters(found.hits), expected.hits));
      hits += hits_of(scene.level, found.hits);
    }
    // The boxes of distant vertices are no larger for their distance.
    const BatchInput input = input_of(scene.level);
    std::vector<Box> boxes(80);
    REQUIRE(compute_boxes(*scene.engine, input, {}, boxes) == Status::kOk);
    for (std::size_t t = 0; t < 80; ++t)
      for (int c = 0; c < 3; ++c) CHECK(boxes[t].half[c] <= level.bodies[t].box.half[c] + 2e-5f);
  }
  CHECK(hits >= least_count(500, 6));
}

TEST_CASE("candidates of static bodies are found by the bounds that the engine has") {
  Random random(13);
  World world = crowds(random, 2, {});
  const Level level = random_level(random, 60, 2, {});
  Scene scene(world, level.desc());
  const Outcome expected = scene.run();
  std::vector<std::vector<float>> bounds;
  std::vector<BatchInput> inputs;
  for (std::uint32_t m = 0; m < 2; ++m) {
    const Poses& poses = world.members[m].poses;
    inputs.push_back(poses.input({m + 1}));
    std::vector<Box> boxes(std::size_t{poses.instance_count} * world.members[m].rig.node_count());
    REQUIRE(compute_boxes(*scene.engine, inputs[m], policies_of(Refit::kAabbHull, Strategy::kAuto, Exact::kNone),
                          boxes) == Status::kOk);
    bounds.emplace_back();
    for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
      const Box& root = boxes[(std::size_t{i} + 1) * world.members[m].rig.node_count() - 1];
      for (const int side : {-1, 1})
        for (int c = 0; c < 3; ++c)
          bounds[m].push_back(root.center[c] + 1.0001f * static_cast<float>(side) * root.half[c]);
    }
    inputs[m].bounds = bounds[m];
  }
  inputs.push_back(input_of(scene.level));
  std::vector<PairRule> rules;
  for (std::uint32_t m = 1; m <= 2; ++m) rules.push_back({{m}, scene.level, Pairing::kBetween});
  FrameJob job;
  job.inputs = inputs;
  job.rules = rules;
  std::vector<InstancePair> pairs(60 * 53);
  CandidateList list = {pairs};
  REQUIRE(find_candidates(*scene.engine, job, list) == Status::kOk);
  CHECK(list.pair_count < pairs.size());
  for (const Hit& hit : expected.hits) {
    if (hit.batch_b.value != slot_of(scene.level).value) continue;
    const bool found = std::any_of(pairs.data(), pairs.data() + list.pair_count, [&hit](const InstancePair& pair) {
      return pair.batch_a.value == hit.batch_a.value && pair.instance_a == hit.instance_a &&
             pair.batch_b.value == hit.batch_b.value && pair.instance_b == hit.instance_b;
    });
    if (!found) FAIL_CHECK("body ", hit.instance_b);
  }
  // The frame after it counts all bodies as moved, and has the same hits.
  CHECK(same_hits(scene.run().hits, expected.hits));
}

TEST_CASE("a bad static body or triangle is refused by its number, and nothing is added") {
  EnginePtr engine = make_engine();
  const float vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 1, NAN, 0, 0};
  const std::uint32_t good[] = {0, 1, 2, 0, 1, 4};
  const ConvexPart outside = {ShapeKind::kSphere, {3, 0, 0}, {0, 0, 0, 1}, {0.5f, 0, 0}, {}};
  const ConvexPart empty = {ShapeKind::kSphere, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, {}};
  const auto refuse = [&](Status status, std::uint32_t element, auto&& spoil) {
    StaticBody bodies[20];
    for (StaticBody& body : bodies) body.box = kUnitBox;
    StaticDesc desc;
    desc.bodies = {bodies, 20};
    desc.vertices = {vertices, 15};
    desc.triangles = {good, 6};
    spoil(desc, bodies);
    BatchId id = {77};
    std::uint32_t bad = 1234;
    CHECK(add_static_batch(*engine, desc, &id, &bad) == status);
    CHECK(id.value == 77);
    CHECK(bad == element);
    CHECK(add_static_batch(*engine, desc, &id, nullptr) == status);
  };
  constexpr std::uint32_t kNoElement = 1234;
  const std::uint32_t line[] = {0, 1, 2, 0, 1, 3}, beyond[] = {0, 1, 2, 0, 1, 5};
  refuse(Status::kNoInstances, kNoElement, [](StaticDesc& desc, StaticBody*) { desc = {}; });
  refuse(Status::kNoInstances, kNoElement,
         [](StaticDesc& desc, StaticBody*) { desc.bodies = {}, desc.triangles = {}; });
  for (const std::size_t numbers : {1u, 2u})
    refuse(Status::kBadTriangles, 0,
           [=](StaticDesc& desc, StaticBody*) { desc.bodies = {}, desc.triangles.size = numbers; });
  refuse(Status::kBadStaticBody, kNoElement, [](StaticDesc& desc, StaticBody*) { desc.bodies = {nullptr, 20}; });
  refuse(Status::kBadStaticBody, 17, [](StaticDesc&, StaticBody* bodies) { bodies[17].origin[1] = HUGE_VAL; });
  refuse(Status::kBadStaticBody, 17, [](StaticDesc&, StaticBody* bodies) { bodies[17].rotation[3] = 0; });
  refuse(Status::kBadStaticBody, 3, [](StaticDesc&, StaticBody* bodies) { bodies[3].rotation[0] = NAN; });
  refuse(Status::kBadStaticBody, 16, [](StaticDesc&, StaticBody* bodies) { bodies[16].box.half[0] = kMaxCoordinate; });
  refuse(Status::kBadLeafBox, 5, [](StaticDesc&, StaticBody* bodies) { bodies[5].box.half[2] = -1; });
  refuse(Status::kBadLeafAxes, 6, [](StaticDesc&, StaticBody* bodies) { bodies[6].box.axis[0][0] = 2; });
  refuse(Status::kShapeOutsideLeafBox, 7, [&](StaticDesc&, StaticBody* bodies) { bodies[7].parts = {&outside, 1}; });
  refuse(Status::kBadShape, 8, [&](StaticDesc&, StaticBody* bodies) { bodies[8].parts = {&empty, 1}; });
  refuse(Status::kBadShape, 21, [&](StaticDesc& desc, StaticBody*) { desc.triangles = {line, 6}; });
  refuse(Status::kBadTriangles, 21, [&](StaticDesc& desc, StaticBody*) { desc.triangles = {beyond, 6}; });
  refuse(Status::kBadTriangles, 20, [](StaticDesc& desc, StaticBody*) { desc.triangles.size = 5; });
  refuse(Status::kBadTriangles, 20, [](StaticDesc& desc, StaticBody*) { desc.vertices.size = 14; });
  refuse(Status::kBadTriangles, 20, [](StaticDesc& desc, StaticBody*) { desc.vertices.size = 18; });
  refuse(Status::kBadTriangles, 20, [](StaticDesc& desc, StaticBody*) { desc.triangles.data = nullptr; });
  refuse(Status::kBadTriangles, 20, [](StaticDesc& desc, StaticBody*) { desc.origin[2] = HUGE_VAL; });
  std::vector<StaticBody> many(3);
  refuse(Status::kTooManyInstances, kNoElement,
         [](StaticDesc& desc, StaticBody*) { desc.triangles.size = 3 * (std::size_t{kMaxInstances} + 1); });
  StaticBody body;
  body.box = kUnitBox;
  StaticDesc desc;
  desc.bodies = {&body, 1};
  CHECK(add_static_batch(*engine, desc, nullptr) == Status::kBadOutput);
  EngineMemory memory;
  REQUIRE(engine_memory(*engine, &memory) == Status::kOk);
  CHECK(memory.batches == 0);
  BatchId id;
  CHECK(add_static_batch(*engine, desc, &id) == Status::kOk);
  CHECK(slot_of(id).value == 1);
  REQUIRE(engine_memory(*engine, &memory) == Status::kOk);
  CHECK(memory.batches > 0);
  CHECK(remove_batch(*engine, id) == Status::kOk);
  REQUIRE(engine_memory(*engine, &memory) == Status::kOk);
  CHECK(memory.batches == 0);
}

TEST_CASE("a batch of static bodies takes no poses, and no rule pairs it with itself or another") {
  Random random(17);
  const World world = crowds(random, 2, {});
  const Level level = random_level(random, 5, 2, {});
  Scene scene(world, level.desc());
  const BatchId second = add_level(*scene.engine, level.desc());
  const float zeros[64] = {};
  const double places[15] = {};
  const std::uint8_t bytes[5] = {};
  const auto status = [&](auto&& spoil) {
    BatchInput inputs[2] = {input_of(scene.level), input_of(second)};
    PairRule rule = {scene.level, second, Pairing::kBetween};
    FrameJob job;
    job.inputs = {inputs, 2};
    spoil(inputs[0], rule, job);
    return run_frame(*scene.engine, job);
  };
  CHECK(status([](BatchInput&, PairRule&, FrameJob&) {}) == Status::kOk);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) { input.poses.data = zeros; }) == Status::kStaticInput);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) { input.origins = {places, 15}; }) == Status::kStaticInput);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) {
          input.orientations = {zeros, 20};
        }) == Status::kStaticInput);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) { input.scales = {zeros, 5}; }) == Status::kStaticInput);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) { input.moved = {bytes, 5}; }) == Status::kStaticInput);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) { input.bounds = {zeros, 30}; }) == Status::kStaticInput);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) { input.count = 6; }) == Status::kBadCount);
  CHECK(status([&](BatchInput& input, PairRule&, FrameJob&) { input.layers = {nullptr, 5}; }) == Status::kBadLayers);
  CHECK(status([](BatchInput&, PairRule& rule, FrameJob& job) { job.rules = {&rule, 1}; }) == Status::kBadPairRule);
  CHECK(status([](BatchInput&, PairRule& rule, FrameJob& job) {
          rule.b = rule.a;
          job.rules = {&rule, 1};
        }) == Status::kBadPairRule);
  CHECK(status([](BatchInput&, PairRule& rule, FrameJob& job) {
          rule.b = rule.a;
          rule.pairing = Pairing::kWithin;
          job.rules = {&rule, 1};
        }) == Status::kBadPairRule);
}

TEST_CASE("some of the static bodies take part: the first ones, or those that are listed") {
  Random random(19);
  const World world = crowds(random, 2, {});
  const Level level = random_level(random, 40, 2, {});
  Scene scene(world, level.desc());
  const std::vector<Hit> all = scene.run().hits;
  const std::vector<std::uint32_t> listed = {1, 3, 4, 17, 30, 39};
  for (int frame = 0; frame < 6; ++frame) {
    std::vector<BatchInput> inputs;
    for (std::uint32_t m = 0; m < 2; ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs.push_back(input_of(scene.level));
    const std::uint32_t count = frame == 3 ? 21 : kAllInstances;
    inputs.back().count = count;
    if (frame < 2) inputs.back().instances = listed;
    std::vector<PairRule> rules = world.rules;
    for (std::uint32_t m = 1; m <= 2; ++m) rules.push_back({{m}, scene.level, Pairing::kBetween});
    std::vector<Hit> hits(40000);
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.hits = hits;
    REQUIRE(run_frame(*scene.engine, job) == Status::kOk);
    hits.resize(job.hit_count);
    std::vector<Hit> expected = all;
    expected.erase(std::remove_if(expected.begin(), expected.end(),
                                  [&](const Hit& hit) {
                                    if (hit.batch_b.value != slot_of(scene.level).value) return false;
                                    if (frame < 2)
                                      return !std::binary_search(listed.begin(), listed.end(), hit.instance_b);
                                    return count != kAllInstances && hit.instance_b >= count;
                                  }),
                   expected.end());
    CHECK(same_hits(hits, expected));
  }
}

}  // namespace cab::tests
