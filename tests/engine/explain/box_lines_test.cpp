// box_lines: edges of the boxes that compute_boxes gives, of the level that was asked for, with hits marked.
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// What the edges of one box are drawn for.
struct Drawn {
  std::vector<BoxLine> edges;
};
using DrawnBoxes = std::map<std::pair<std::uint32_t, std::uint16_t>, Drawn>;  // by instance and node

DrawnBoxes draw(Engine& engine, const BatchInput& input, BoxLinesJob job) {
  REQUIRE(box_lines(engine, input, job) == Status::kLinesOverflow);
  CHECK(job.line_count == 0);
  std::vector<BoxLine> lines(job.lines_needed);
  job.lines = lines;
  REQUIRE(box_lines(engine, input, job) == Status::kOk);
  CHECK(job.line_count == lines.size());
  DrawnBoxes out;
  std::pair<std::uint32_t, std::uint16_t> last = {0, 0};
  for (const BoxLine& line : lines) {
    const std::pair<std::uint32_t, std::uint16_t> key = {line.instance, line.node};
    CHECK(last <= key);
    last = key;
    out[key].edges.push_back(line);
  }
  return out;
}

// The level of every node, by the public merge steps: how many merges it is below the root.
std::vector<std::uint32_t> levels_of(const Engine& engine, ArticulationId id) {
  ArticulationInfo info;
  REQUIRE(articulation_info(engine, id, &info) == Status::kOk);
  std::vector<MergeStep> steps(info.leaf_count - 1);
  REQUIRE(merge_steps(engine, id, steps) == Status::kOk);
  std::vector<std::uint32_t> out(info.node_count, 0);
  for (std::size_t s = steps.size(); s-- > 0;) out[steps[s].left] = out[steps[s].right] = out[info.leaf_count + s] + 1;
  return out;
}

double distance(const float (&a)[3], const double (&b)[3]) {
  return std::hypot(std::hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

// Checks that twelve edges are those of a box at an offset: each joins two corners that differ along one axis.
void check_edges(const Drawn& drawn, const Box& box, const double (&offset)[3]) {
  REQUIRE(drawn.edges.size() == 12);
  double corners[8][3], size = 0;
  for (int signs = 0; signs < 8; ++signs)
    for (int c = 0; c < 3; ++c) {
      corners[signs][c] = offset[c] + double{box.center[c]};
      for (int k = 0; k < 3; ++k)
        corners[signs][c] += (signs >> k & 1 ? 1 : -1) * double{box.half[k]} * double{box.axis[k][c]};
      size = std::max(size, std::fabs(corners[signs][c]));
    }
  std::set<std::pair<int, int>> joined;
  for (const BoxLine& line : drawn.edges)
    for (int from = 0; from < 8; ++from)
      for (int k = 0; k < 3; ++k)
        if (const int to = from ^ (1 << k); from < to && distance(line.from, corners[from]) <= 3e-7 * size &&
                                            distance(line.to, corners[to]) <= 3e-7 * size)
          joined.insert({from, to});
  CHECK(joined.size() == 12);
}

World one_batch(Random& random, std::uint32_t instances) {
  World world;
  PoseRange range = any_pose_range(random, random.chance(0.3), {{10, 20, 30}}, 2);
  world.members.push_back(any_member(random, instances, BatchKind::kCharacters, range, 24));
  world.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin}};
  return world;
}

}  // namespace

TEST_CASE("lines are of boxes without a margin, whatever margins their instances have of their own") {
  Random random(6);
  const World world = one_batch(random, 5);
  const EnginePtr engine = make_engine_for(world);
  const std::vector<float> margins(5, 10);
  BatchInput input = world.members[0].poses.input({1});
  const DrawnBoxes expected = draw(*engine, input, {});
  input.margins = margins;
  const DrawnBoxes drawn = draw(*engine, input, {});
  REQUIRE(drawn.size() == expected.size());
  for (const auto& [key, box] : expected)
    for (std::size_t edge = 0; edge < box.edges.size(); ++edge)
      CHECK(std::equal(box.edges[edge].from, box.edges[edge].from + 3, drawn.at(key).edges[edge].from));
}

TEST_CASE("lines are the edges of the boxes of a level, relative to the origin that was asked for") {
  std::size_t boxes_seen = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = one_batch(random, 1 + random.index(20));
    const Poses& poses = world.members[0].poses;
    const EnginePtr engine = make_engine_for(world);
    const BatchInput input = poses.input({1});
    BoxLinesJob job;
    job.policies.refit = static_cast<Refit>(random.index(kRefitCount));
    job.policies.extents = static_cast<Extents>(random.index(kExtentsCount));
    for (double& c : job.origin) c = random.uniform(-5, 40);
    ArticulationInfo info;
    REQUIRE(articulation_info(*engine, {1}, &info) == Status::kOk);
    const std::vector<std::uint32_t> level_of = levels_of(*engine, {1});
    std::vector<Box> boxes(std::size_t{poses.instance_count} * info.node_count);
    REQUIRE(compute_boxes(*engine, input, job.policies, boxes) == Status::kOk);
    for (const std::uint32_t level : {0u, 1u, 2u, random.index(info.depth + 2), kLeafLevel}) {
      CAPTURE(level);
      job.level = level;
      const DrawnBoxes drawn = draw(*engine, input, job);
      std::size_t expected = 0;
      for (std::uint32_t i = 0; i < poses.instance_count; ++i)
        for (std::uint32_t node = 0; node < info.node_count; ++node) {
          const bool is_leaf = node < info.leaf_count;
          if (level_of[node] != level && !(is_leaf && level_of[node] < level)) continue;
          ++expected;
          const auto found = drawn.find({i, static_cast<std::uint16_t>(node)});
          REQUIRE(found != drawn.end());
          double offset[3];
          for (int c = 0; c < 3; ++c)
            offset[c] =
                (input.origins.empty() ? 0 : input.origins[3 * i + static_cast<std::uint32_t>(c)]) - job.origin[c];
          check_edges(found->second, boxes[i * info.node_count + node], offset);
          for (const BoxLine& line : found->second.edges) {
            CHECK_FALSE(line.is_hit);
            CHECK(line.link == (is_leaf ? world.members[0].rig.leaves[node].link : kNoLink));
          }
        }
      CHECK(drawn.size() == expected);
      boxes_seen += expected;
    }
  }
  CHECK(boxes_seen >= least_count(5000, 40));
}

TEST_CASE("boxes of links in hits, and all boxes above them, are marked, and no others") {
  std::size_t marked = 0, unmarked = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = one_batch(random, 12);
    const EnginePtr engine = make_engine_for(world);
    std::vector<Hit> hits = run_on(*engine, world, {}).hits;
    if (hits.size() > 8) hits.resize(8);
    std::set<std::pair<std::uint32_t, std::uint32_t>> links;
    for (const Hit& hit : hits) links.insert({hit.instance_a, hit.link_a}), links.insert({hit.instance_b, hit.link_b});
    const BatchInput input = world.members[0].poses.input({1});
    BoxLinesJob job;
    job.hits = hits;
    for (const auto& [key, drawn] : draw(*engine, input, job))
      for (const BoxLine& line : drawn.edges) {
        CHECK(line.is_hit == (links.count({line.instance, line.link}) == 1));
        (line.is_hit ? marked : unmarked) += 1;
      }
    std::set<std::uint32_t> instances;
    for (const auto& link : links) instances.insert(link.first);
    job.level = 0;
    for (const auto& [key, drawn] : draw(*engine, input, job))
      for (const BoxLine& line : drawn.edges) CHECK(line.is_hit == (instances.count(line.instance) == 1));
    // Hits of other batches are not this one's.
    for (Hit& hit : hits) hit.batch_a.value = hit.batch_b.value = 2;
    for (const auto& [key, drawn] : draw(*engine, input, job))
      for (const BoxLine& line : drawn.edges) CHECK_FALSE(line.is_hit);
  }
  CHECK(marked > 0);
  CHECK(unmarked > 0);
}

TEST_CASE("lines are drawn of static bodies, of levels of nodes, of listed instances and of sequences") {
  Random random(9);
  const World world = one_batch(random, 5);
  const EnginePtr engine = make_engine_for(world);
  const Poses& poses = world.members[0].poses;
  LodDesc desc;
  desc.of = {1};
  desc.kind = LodKind::kNodes;
  desc.max_leaves = 2;
  ArticulationId coarse;
  REQUIRE(add_lod(*engine, desc, &coarse) == Status::kOk);
  const BatchId level = add_instances(*engine, coarse, 5),
                frames = add_instances(*engine, {1}, 5, BatchKind::kSequence);
  StaticBody wall;
  wall.box = random_box(random, {}, 1, 2);
  wall.origin[0] = 7;
  BatchId walls;
  REQUIRE(add_static_batch(*engine, {{&wall, 1}, {}, {}, {}}, &walls) == Status::kOk);

  ArticulationInfo info;
  REQUIRE(articulation_info(*engine, coarse, &info) == Status::kOk);
  CHECK(draw(*engine, poses.input(level), {}).size() == std::size_t{5} * info.leaf_count);
  CHECK(draw(*engine, poses.input(frames), {}).size() == world.members[0].rig.leaves.size() * 5);
  BatchInput listed = poses.input({1});
  const std::uint32_t numbers[] = {1, 4};
  listed.instances = numbers;
  std::set<std::uint32_t> instances;
  for (const auto& [key, drawn] : draw(*engine, listed, {})) instances.insert(key.first);
  CHECK(instances == std::set<std::uint32_t>{1, 4});
  BatchInput still;
  still.batch = walls;
  const DrawnBoxes drawn = draw(*engine, still, {});
  REQUIRE(drawn.size() == 1);
  Box padded;
  REQUIRE(compute_boxes(*engine, still, {}, {&padded, 1}) == Status::kOk);
  check_edges(drawn.begin()->second, padded, wall.origin);
}

TEST_CASE("masked instances have no lines, and what cannot be drawn is refused") {
  Random random(5);
  World world = one_batch(random, 3);
  world.members[0].poses.pose(1, world.members[0].rig.leaves[0].link)[0] = std::numeric_limits<float>::quiet_NaN();
  const EnginePtr engine = make_engine_for(world);
  const BatchInput input = world.members[0].poses.input({1});
  BoxLinesJob job;
  std::set<std::uint32_t> instances;
  for (const auto& [key, drawn] : draw(*engine, input, job)) instances.insert(key.first);
  CHECK(instances == std::set<std::uint32_t>{0, 2});

  job.origin[1] = std::numeric_limits<double>::infinity();
  CHECK(box_lines(*engine, input, job) == Status::kBadOrigins);
  job.origin[1] = 0;
  job.hits.size = 1;
  CHECK(box_lines(*engine, input, job) == Status::kBadPairs);
  job.hits = {};
  job.lines.size = 1;
  CHECK(box_lines(*engine, input, job) == Status::kBadOutput);
  job.lines = {};
  job.policies.refit = static_cast<Refit>(200);
  CHECK(box_lines(*engine, input, job) == Status::kBadPolicy);
}

}  // namespace cab::tests
