// The index of run_queries, as calls leave it: who is in it, that bounds hold bounds, and how it is ordered. It is the
// same whether it is sorted or not, but for its order.
#include "engine/queries/query_index.h"

#include "engine/queries/query_indexes.h"
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCounts[] = {0, 1, 15, 16, 17, 257, 5000};

// More queries than these in one call, and the index is sorted.
constexpr std::size_t kMany = 65, kFew = 64;
constexpr std::size_t kIdle = 20000;  // so many queries more, and instances are halved

// Where instances are.
enum class Spread { kCube, kEqual, kLine, kSteps, kFar, kVeryFar, kHuge };
constexpr Spread kSpreads[] = {Spread::kCube, Spread::kEqual,   Spread::kLine, Spread::kSteps,
                               Spread::kFar,  Spread::kVeryFar, Spread::kHuge};

Vec3<double> any_place(Random& random, Spread spread) {
  Vec3<double> out{};
  for (double& c : out.v) c = random.uniform(-1, 1);
  switch (spread) {
    case Spread::kCube: return 20.0 * out;
    case Spread::kEqual: return {{1, 2, 3}};
    case Spread::kLine: return {{0, 100 * out[0], 0}};
    case Spread::kSteps: return {{64 * (random.index(3) - 1.0), out[1], out[2]}};  // many at the edge of a bin
    case Spread::kFar: return Vec3<double>{{1e9, -1e9, 3e8}} + 20.0 * out;
    case Spread::kVeryFar: return random.chance(0.5) ? Vec3<double>{{1e100, 0, 0}} : 1e100 * out;
    case Spread::kHuge: return random.log_uniform(1e-20, 1e28) * out;
  }
  return out;
}

// Batches of a cube each, or of points, at random places; batch m + 1 is that of member m.
World world_of(Random& random, const std::vector<std::uint32_t>& counts, Spread spread, float half) {
  World world;
  for (const std::uint32_t count : counts) {
    Member& member = world.members.emplace_back();
    member.rig.parents = {-1};
    member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half, half, half}}, {}}};
    member.poses.link_count = 1;
    member.poses.instance_count = std::max(count, 1u);  // a batch has at least one
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i) {
      member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
      const Vec3<double> at = any_place(random, spread);
      member.poses.origins.insert(member.poses.origins.end(), {at[0], at[1], at[2]});
    }
  }
  return world;
}

struct Answer {
  std::vector<QueryHit> hits;
  std::vector<std::uint8_t> found;
};

// Asks the queries from `first` on, and appends to the answer.
void ask(Engine& engine, const World& world, const std::vector<std::uint32_t>& counts, std::vector<Query> queries,
         std::size_t first, std::size_t count, Answer& out, std::size_t idle = 0) {
  std::vector<BatchInput> inputs;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs.back().count = counts[m];
  }
  queries.resize(first + count + idle);  // rays of length 0 that want the nearest link
  count += idle;
  std::vector<std::uint8_t> found(count);
  std::vector<QueryHit> hits(1 << 17);
  QueryJob job;
  job.inputs = inputs;
  job.queries = {queries.data() + first, count};
  job.found = found;
  job.hits = hits;
  require(run_queries(engine, job));
  for (std::size_t h = 0; h < job.hit_count; ++h) {
    out.hits.push_back(hits[h]);
    out.hits.back().query += static_cast<std::uint32_t>(first);
  }
  out.found.insert(out.found.end(), found.begin(), found.end());
}

// Queries about the world's instances and about nowhere.
std::vector<Query> any_queries(Random& random, const World& world, Spread spread) {
  std::vector<Query> out(kMany);
  for (Query& query : out) {
    query.kind = random.chance(0.5) ? QueryKind::kRay : random.chance(0.5) ? QueryKind::kPoint : QueryKind::kSphere;
    query.want = static_cast<QueryWant>(random.index(kQueryWantCount));
    query.max_hits = 1 + random.index(20);
    const Member& member = world.members[random.index(static_cast<std::uint32_t>(world.members.size()))];
    const std::uint32_t to = random.index(member.poses.instance_count);
    const Vec3<double> away = (random.chance(0.1) ? 0 : random.log_uniform(0.1, 100)) * random.unit_vector();
    for (std::size_t c = 0; c < 3; ++c) {
      const double at = spread == Spread::kVeryFar ? 0 : member.poses.origins[3 * to + c];
      query.position[c] = std::clamp(at + away[c], -kMaxQueryCoordinate, kMaxQueryCoordinate);
      query.direction[c] = static_cast<float>(-away[c] + random.uniform(-0.5, 0.5));
    }
    query.length = static_cast<float>(random.log_uniform(1, 1e3));
    query.radius = static_cast<float>(random.log_uniform(1e-3, 10));
  }
  return out;
}

bool is_before(const IndexedPoint& a, const IndexedPoint& b, int axis) {
  return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.number < b.number;
}

// What is wrong with the order of points: the first 16, 32, 64 ... of more points are those that come first along the
// axis of most spread, and the same holds for both parts.
std::string order_fault(const IndexedPoint* points, std::size_t count) {
  if (count <= kLanes) {
    for (std::size_t i = 1; i < count; ++i)
      if (points[i - 1].number >= points[i].number) return "sixteen points are not in the order of their numbers";
    return {};
  }
  std::size_t first = kLanes;
  while (2 * first < count) first *= 2;
  float width[3];
  for (int c = 0; c < 3; ++c) {
    float lo = points[0].at[c], hi = lo;
    for (std::size_t i = 1; i < count; ++i) {
      lo = std::min(lo, points[i].at[c]);
      hi = std::max(hi, points[i].at[c]);
    }
    width[c] = hi - lo;
  }
  const int axis = static_cast<int>(std::max_element(width, width + 3) - width);
  const auto less = [axis](const IndexedPoint& a, const IndexedPoint& b) { return is_before(a, b, axis); };
  if (less(*std::min_element(points + first, points + count, less), *std::max_element(points, points + first, less)))
    return "one of the first " + std::to_string(first) + " of " + std::to_string(count) + " points is behind the rest";
  const std::string fault = order_fault(points, first);
  return fault.empty() ? order_fault(points + first, count - first) : fault;
}

// What is wrong with the index.
std::string fault_of(const QueryIndex& index, const std::vector<std::uint32_t>& counts) {
  // Everybody is in one cluster, and clusters lie one after the other.
  std::map<std::uint32_t, std::set<std::uint32_t>> members;
  std::size_t listed = 0, given = 0;
  for (std::uint32_t i = 0; i < index.clusters.size; ++i) {
    const QueryCluster& of = index.clusters.data[i];
    if (of.count < 1 || of.count > kLanes) return "a cluster of " + std::to_string(of.count);
    for (std::uint32_t k = 0; k < of.count; ++k) members[of.batch].insert(index.order[of.first + k].number);
    const TileInstances tile = index.instances_of(of);
    if (tile.count != of.count || tile.instance[of.count - 1] != index.order[of.first + of.count - 1].number)
      return "instances_of a cluster are others";
    listed += of.count;
  }
  for (std::uint32_t m = 0; m < counts.size(); ++m) {
    given += counts[m];
    if (members[m].size() != counts[m]) return "an instance is missing";
    if (counts[m] > 0 && *members[m].rbegin() >= counts[m]) return "an instance was not given";
  }
  if (listed != given) return "an instance is in several clusters";

  // Levels end with one node, and children are counted.
  if (given == 0) return index.levels == 0 && index.nodes.size == 0 ? "" : "an index of nobody has levels";
  if (index.levels > QueryIndex::kMostLevels || index.node_count(index.levels - 1) != 1) return "no single root";
  if (index.node_count(0) != index.clusters.size) return "the lowest level is not that of the clusters";
  if (index.nodes.size > most_nodes(index.clusters.size)) return "more nodes than there is room for";
  for (std::uint32_t level = 0; level < index.levels; ++level) {
    std::uint32_t children = 0;
    for (std::uint32_t node = 0; node < index.node_count(level); ++node) {
      const std::uint32_t count = index.child_count(level, node);
      if (count < 1 || count > kLanes) return "a node with " + std::to_string(count) + " children";
      if (level > 0 && node + 1 < index.node_count(level) && count != kLanes) return "a node in between is not full";
      children += count;
      const AabbTile& tile = index.nodes.data[index.level_begin[level] + node];
      for (std::uint32_t lane = 0; lane < count; ++lane)
        for (int c = 0; c < 3; ++c) {
          const float lo = tile.lo[c][lane], hi = tile.hi[c][lane];
          if (!(lo <= hi && lo >= -1.01f && hi <= 1.01f)) return "bounds are not in the cube of the index";
          if (level == 0) {
            const QueryCluster& of = index.clusters.data[node];
            const std::uint32_t number = index.order[of.first + lane].number;
            const InstanceBounds& bounds = index.bounds[index.batch_begin[of.batch] + number];
            const long double scale = index.scale, center = index.center[c];
            if (lo > scale * (bounds.lo[c] - center) || hi < scale * (bounds.hi[c] - center))
              return "a node does not hold an instance";
          } else {
            const std::uint32_t child = node * kLanes + lane;
            const AabbTile& below = index.nodes.data[index.level_begin[level - 1] + child];
            for (std::uint32_t k = 0; k < index.child_count(level - 1, child); ++k)
              if (lo > below.lo[c][k] || hi < below.hi[c][k]) return "a node does not hold a child";
          }
        }
    }
    if (children != (level == 0 ? given : index.node_count(level - 1))) return "children are missing";
  }
  if (index.arrangement != Arrangement::kHalved) return {};
  for (std::uint32_t m = 0; m < counts.size(); ++m)
    if (const std::string fault = order_fault(index.order.data + index.batch_begin[m], counts[m]); !fault.empty())
      return "instances: " + fault;
  for (std::uint32_t i = 0; i < index.clusters.size; ++i) {
    const QueryCluster& of = index.clusters.data[i];
    const IndexedPoint &middle = index.order[of.first + of.count / 2], &point = index.cluster_order[i];
    if (!std::equal(middle.at, middle.at + 3, point.at)) return "clusters are not in their order";
  }
  const std::string fault = order_fault(index.cluster_order.data, index.clusters.size);
  return fault.empty() ? fault : "clusters: " + fault;
}

// Whether the bounds of the index hold the boxes that they are of: cubes about the origins.
bool holds_boxes(const QueryIndex& index, const World& world, const std::vector<std::uint32_t>& counts, float half) {
  for (std::uint32_t m = 0; m < counts.size(); ++m)
    for (std::uint32_t i = 0; i < counts[m]; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        const InstanceBounds& bounds = index.bounds[index.batch_begin[m] + i];
        const long double at = world.members[m].poses.origins[3 * std::size_t{i} + c];
        if (bounds.lo[c] > at - half || bounds.hi[c] < at + half) return false;
      }
  return true;
}

// The index of a world, halved and along a curve, and the same answers by both.
void check_world(Random& random, const std::vector<std::uint32_t>& counts, Spread spread, float half) {
  CAPTURE(counts.size());
  CAPTURE(counts[0]);
  CAPTURE(static_cast<int>(spread));
  CAPTURE(half);
  const World world = world_of(random, counts, spread, half);
  const EnginePtr engine = make_engine_for(world);
  require(reserve(*engine, {0, 0, 32}));
  const std::vector<Query> queries = any_queries(random, world, spread);
  const QueryIndex& index = engine->query_indexes->all[0]->index;
  Answer halved, on_curve;
  ask(*engine, world, counts, queries, 0, kMany, halved, kIdle);
  CHECK(index.arrangement == Arrangement::kHalved);
  CHECK(fault_of(index, counts) == "");
  CHECK(holds_boxes(index, world, counts, half));
  ask(*engine, world, counts, queries, 0, kFew, on_curve);
  CHECK(index.arrangement == Arrangement::kOnCurve);
  CHECK(fault_of(index, counts) == "");
  ask(*engine, world, counts, queries, kFew, kMany - kFew, on_curve);
  halved.found.resize(kMany);
  while (!halved.hits.empty() && halved.hits.back().query >= kMany) halved.hits.pop_back();
  CHECK(halved.found == on_curve.found);
  CHECK(halved.hits.size() == on_curve.hits.size());
  for (std::size_t h = 0; h < std::min(halved.hits.size(), on_curve.hits.size()); ++h)
    CHECK(std::memcmp(&halved.hits[h], &on_curve.hits[h], offsetof(QueryHit, inside)) == 0);
}

}  // namespace

TEST_CASE("query index: it holds everybody once, in bounds that hold theirs, halved or along a curve") {
  Random random(81);
  for (const std::uint32_t count : kCounts)
    for (const Spread spread : kSpreads)
      for (const float half : {0.5f, 0.0f}) check_world(random, {count}, spread, half);
}

TEST_CASE("query index: clusters are of one batch, however many batches there are") {
  Random random(82);
  for (const Spread spread : kSpreads) {
    check_world(random, {17, 0, 1, 300}, spread, 0.25f);
    check_world(random, {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, spread, 0);
  }
}

TEST_CASE("query index: instances that are masked, or not listed, are not in it") {
  Random random(83);
  World world = world_of(random, {40}, Spread::kCube, 0.5f);
  for (std::uint32_t i = 0; i < 40; i += 3) world.members[0].poses.pose(i, 0)[3] = 0;  // no rotation
  const EnginePtr engine = make_engine_for(world);
  require(reserve(*engine, {0, 0, 32}));
  BatchInput input = world.members[0].poses.input({1});
  const std::vector<std::uint32_t> listed = {0, 1, 2, 5, 6, 30, 31, 39};
  input.instances = listed;
  QueryJob job;
  job.inputs = {&input, 1};
  require(run_queries(*engine, job));
  std::vector<std::uint32_t> in_index;
  const QueryIndex& index = engine->query_indexes->all[0]->index;
  for (const QueryCluster& cluster : index.clusters)
    for (std::uint32_t k = 0; k < cluster.count; ++k) in_index.push_back(index.order[cluster.first + k].number);
  std::sort(in_index.begin(), in_index.end());
  CHECK(in_index == std::vector<std::uint32_t>{1, 2, 5, 31});
  CHECK(job.stats.instances_masked == 4);
}

TEST_CASE("query index: keys sort as by std::stable_sort, and every point has one") {
  Random random(84);
  for (std::uint64_t round = rounds(50); round > 0; --round) {
    std::vector<KeyedNumber> order(random.index(3000)), other(order.size());
    const std::uint32_t range = random.chance(0.5) ? 5 : 1u << 30;
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = {random.index(range), i};
    std::vector<KeyedNumber> wanted = order;
    std::stable_sort(wanted.begin(), wanted.end(),
                     [](const KeyedNumber& a, const KeyedNumber& b) { return a.key < b.key; });
    sort_by_key(order, other);
    CHECK(
        std::equal(order.begin(), order.end(), wanted.begin(), wanted.end(),
                   [](const KeyedNumber& a, const KeyedNumber& b) { return a.key == b.key && a.number == b.number; }));
  }
  QueryIndex index;
  index.scale = 0x1p-4;
  for (double& c : index.center) c = 3;
  const double low[3] = {-13, -13, -13}, high[3] = {18.99, 18.99, 18.99}, beyond[3] = {1e30, -1e30, HUGE_VAL};
  CHECK(curve_key(index, low) == 0);
  CHECK(curve_key(index, high) == (1u << 30) - 1);
  CHECK(curve_key(index, beyond) < 1u << 30);
  for (double& c : index.center) c = std::nan("");  // of no bounds at all
  CHECK(curve_key(index, low) == 0);
}

}  // namespace cab::tests
