// The index of run_queries: the order of instances along a curve, clusters of sixteen, and the levels above them.
#include "engine/queries/query_index.h"

#include "engine/broad_phase/z_order.h"
#include "engine/session/worker_pool.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab {
namespace {

constexpr int kBitsPerAxis = 10;  // of a key
constexpr std::uint32_t kNodesPerTask = 64;

// Bounds of instances, while the index is made. No bounds have no effect.
struct Hull {
  double lo[3], hi[3];

  Hull() {
    for (int c = 0; c < 3; ++c) lo[c] = std::numeric_limits<double>::infinity(), hi[c] = -lo[c];
  }
  void add(const InstanceBounds& bounds) {
    for (int c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], bounds.lo[c]);
      hi[c] = std::max(hi[c], bounds.hi[c]);
    }
  }
};

// Sets the centre and the scale: a power of two that brings the larger half width of all bounds to between 1/2 and 1.
void place(const Hull& all, QueryIndex& index) {
  constexpr int kMostExponent = 900;  // the scale of a world without extent stays finite
  double width = 0;
  std::fill_n(index.center, 3, 0.0);
  for (int c = 0; c < 3 && all.lo[c] <= all.hi[c]; ++c) {
    index.center[c] = 0.5 * all.lo[c] + 0.5 * all.hi[c];
    width = std::max(width, 0.5 * all.hi[c] - 0.5 * all.lo[c]);
  }
  int exponent = 0;
  std::frexp(width, &exponent);
  index.scale = std::ldexp(1.0, -std::max(exponent, -kMostExponent));
}

// The centre of bounds in the index.
IndexedPoint point_of(const InstanceBounds& bounds, std::uint32_t number, const QueryIndex& index) {
  IndexedPoint out = {{}, number};
  for (int c = 0; c < 3; ++c)
    out.at[c] = static_cast<float>(index.scale * (0.5 * bounds.lo[c] + 0.5 * bounds.hi[c] - index.center[c]));
  return out;
}

// Where points are along the axis along which they spread most.
struct Spread {
  int axis;
  float lo, width;
};
Spread widest(Span<const IndexedPoint> points) {
  float lo[3], hi[3];
  for (int c = 0; c < 3; ++c) lo[c] = hi[c] = points[0].at[c];
  for (const IndexedPoint& point : points)
    for (int c = 0; c < 3; ++c) {
      lo[c] = point.at[c] < lo[c] ? point.at[c] : lo[c];
      hi[c] = point.at[c] > hi[c] ? point.at[c] : hi[c];
    }
  Spread out = {0, lo[0], hi[0] - lo[0]};
  for (int c = 1; c < 3; ++c)
    if (hi[c] - lo[c] > out.width) out = {c, lo[c], hi[c] - lo[c]};
  return out;
}

// Moves the points for which is_first holds before the others, without a branch. Returns how many there are.
template <class IsFirst>
std::size_t move_first(Span<IndexedPoint> points, const IsFirst& is_first) {
  std::size_t count = 0;
  for (IndexedPoint& point : points) {
    const std::size_t is_one = is_first(point);
    std::swap(point, points[count]);
    count += is_one;
  }
  return count;
}

// Moves the first `half` points along an axis before the others, as std::nth_element does. It counts how many points
// are where along the axis first: what is left to order then is little.
void halve(Span<IndexedPoint> points, std::size_t half, const Spread& along) {
  constexpr std::size_t kFew = 128;
  constexpr std::uint32_t kBins = 64;
  constexpr float kThin = 1e-30f;
  const int axis = along.axis;
  std::size_t begin = 0, end = points.size;
  if (points.size > kFew && along.width > kThin) {
    const float scale = static_cast<float>(kBins) / along.width;
    const auto bin_of = [&](const IndexedPoint& point) { return (point.at[axis] - along.lo) * scale; };
    std::uint32_t counts[kBins] = {};
    for (const IndexedPoint& point : points) ++counts[std::min(static_cast<std::uint32_t>(bin_of(point)), kBins - 1)];
    std::uint32_t bin = 0;
    for (; begin + counts[bin] <= half; ++bin) begin += counts[bin];
    end = begin + counts[bin];
    const auto before = static_cast<float>(bin), after = static_cast<float>(bin + 1);
    move_first(points, [&](const IndexedPoint& point) { return bin_of(point) < before; });
    if (bin + 1 < kBins)
      move_first({points.data + begin, points.size - begin},
                 [&](const IndexedPoint& point) { return bin_of(point) < after; });
  }
  std::nth_element(points.begin() + begin, points.begin() + half, points.begin() + end,
                   [axis](const IndexedPoint& x, const IndexedPoint& y) {
                     return x.at[axis] != y.at[axis] ? x.at[axis] < y.at[axis] : x.number < y.number;
                   });
}

// Halves points along the axis of most spread until at most `most` are left, a power of two from sixteen on, so that
// every run of `most`, 2 most, 4 most ... points from a multiple of its length on is a box of its own. Calls
// take(points) for what is left.
template <class Take>
void halve_points(Span<IndexedPoint> points, std::size_t most, const Take& take) {
  while (points.size > most) {
    std::size_t half = kLanes;
    while (2 * half < points.size) half *= 2;
    halve(points, half, widest({points.data, points.size}));
    halve_points({points.data, half}, most, take);
    points = {points.data + half, points.size - half};
  }
  take(points);
}

// Halves points until sixteen are left, which are in the order of their numbers.
void order_points(Span<IndexedPoint> points) {
  halve_points(points, kLanes, [](Span<IndexedPoint> few) {
    std::sort(few.begin(), few.end(), [](const IndexedPoint& x, const IndexedPoint& y) { return x.number < y.number; });
  });
}

// The same on all threads: the first halves are made on one.
void order_points(Span<IndexedPoint> points, TaskRunner& tasks) {
  constexpr std::size_t kParts = 16;
  std::size_t most = kLanes;
  while (kParts * most < points.size) most *= 2;
  Span<IndexedPoint> parts[2 * kParts];
  std::uint32_t count = 0;
  halve_points(points, most, [&](Span<IndexedPoint> part) { parts[count++] = part; });
  tasks.for_each(count, [&](std::uint32_t task, std::uint32_t) { order_points(parts[task]); });
}

// The number of a point's cell along the curve. at: between -1 and 1, or outside of the index.
std::uint32_t curve_key(const double (&at)[3]) {
  constexpr double kCells = 1 << kBitsPerAxis;
  std::uint64_t key = 0;
  for (int c = 0; c < 3; ++c) {
    const double cell = std::min(std::max(0.0, 0.5 * (at[c] + 1) * kCells), kCells - 1);  // 0 for NaN
    key |= spread_bits(static_cast<std::uint64_t>(cell)) << c;
  }
  return static_cast<std::uint32_t>(key);
}
std::uint32_t curve_key(const IndexedPoint& point) {
  return curve_key(
      {static_cast<double>(point.at[0]), static_cast<double>(point.at[1]), static_cast<double>(point.at[2])});
}

// Arranges the points of some instances, which begin at `begin` of the bounds, along the curve.
void order_on_curve(std::uint32_t begin, Span<IndexedPoint> points, const QueryIndex& index) {
  const Span<KeyedNumber> keys = {index.keys.data, points.size};
  for (std::size_t i = 0; i < points.size; ++i) keys[i] = {curve_key(points[i]), points[i].number};
  sort_by_key(keys, {index.other_keys.data, points.size});
  for (std::size_t i = 0; i < points.size; ++i)
    points[i] = point_of(index.bounds[begin + keys[i].number], keys[i].number, index);
}

// Lists the instances of one batch that have bounds, and cuts them into clusters. given: how many there are, of which
// instance_at gives the numbers.
template <class InstanceAt, class Order>
void add_batch(std::uint32_t slot, std::uint32_t given, InstanceAt&& instance_at, Order&& order, QueryIndex& index) {
  const std::uint32_t begin = index.begin_of(slot);
  std::uint32_t count = 0;
  for (std::uint32_t place = 0; place < given; ++place) {
    const std::uint32_t instance = instance_at(place);
    const InstanceBounds& bounds = index.bounds[begin + instance];
    if (has_bounds(bounds)) index.order[begin + count++] = point_of(bounds, instance, index);
  }
  order(begin, Span<IndexedPoint>{index.order.data + begin, count});
  for (std::uint32_t first = 0; first < count; first += kLanes)
    index.clusters.push({slot, begin + first, std::min(kLanes, count - first)});
}

// Puts clusters near each other together.
void order_clusters(QueryIndex& index) {
  const FixedList<QueryCluster>& clusters = index.clusters;
  for (std::uint32_t i = 0; i < clusters.size; ++i) {
    const QueryCluster& of = clusters.data[i];
    index.cluster_order[i] = index.order[of.first + of.count / 2];
    index.cluster_order[i].number = i;
    index.unordered.data[i] = of;
  }
  if (index.arrangement == Arrangement::kHalved) {
    order_points({index.cluster_order.data, clusters.size});
    for (std::uint32_t i = 0; i < clusters.size; ++i)
      clusters.data[i] = index.unordered.data[index.cluster_order[i].number];
  } else {
    const Span<KeyedNumber> keys = {index.keys.data, clusters.size};
    for (std::uint32_t i = 0; i < clusters.size; ++i) keys[i] = {curve_key(index.cluster_order[i]), i};
    sort_by_key(keys, {index.other_keys.data, clusters.size});
    for (std::uint32_t i = 0; i < clusters.size; ++i) clusters.data[i] = index.unordered.data[keys[i].number];
  }
}

// Writes one child of a node. Rounding to float is less than half of kQueryPad.
void set_child(const double (&lo)[3], const double (&hi)[3], std::uint32_t lane, AabbTile& node) {
  for (int c = 0; c < 3; ++c) {
    node.lo[c][lane] = static_cast<float>(lo[c] - kQueryPad);
    node.hi[c][lane] = static_cast<float>(hi[c] + kQueryPad);
  }
}

// Notes which children a node has.
void set_used(const QueryIndex& index, std::uint32_t level, std::uint32_t node) {
  index.used[index.level_begin[level] + node] = static_cast<std::uint16_t>((1u << index.child_count(level, node)) - 1);
}

void make_cluster_node(const QueryIndex& index, std::uint32_t cluster) {
  const QueryCluster& of = index.clusters.data[cluster];
  const std::uint32_t begin = index.begin_of(of.batch);
  for (std::uint32_t lane = 0; lane < of.count; ++lane) {
    const InstanceBounds& bounds = index.bounds[begin + index.order[of.first + lane].number];
    double lo[3], hi[3];
    for (int c = 0; c < 3; ++c) {
      lo[c] = index.scale * (bounds.lo[c] - index.center[c]);
      hi[c] = index.scale * (bounds.hi[c] - index.center[c]);
    }
    set_child(lo, hi, lane, index.nodes.data[cluster]);
  }
  set_used(index, 0, cluster);
}

// Makes a node of a level above from the nodes below it, whose bounds are floats already.
void make_inner_node(const QueryIndex& index, std::uint32_t level, std::uint32_t node) {
  AabbTile& out = index.nodes.data[index.level_begin[level] + node];
  for (std::uint32_t lane = 0; lane < index.child_count(level, node); ++lane) {
    const std::uint32_t child = node * kLanes + lane;
    const AabbTile& from = index.nodes.data[index.level_begin[level - 1] + child];
    const std::uint32_t count = index.child_count(level - 1, child);
    for (int c = 0; c < 3; ++c) {
      out.lo[c][lane] = *std::min_element(from.lo[c], from.lo[c] + count);
      out.hi[c][lane] = *std::max_element(from.hi[c], from.hi[c] + count);
    }
  }
  set_used(index, level, node);
}

void make_inner_nodes(const QueryIndex& index) {
  for (std::uint32_t level = 1; level < index.levels; ++level)
    for (std::uint32_t node = 0; node < index.node_count(level); ++node) make_inner_node(index, level, node);
}

// Lays out levels until one has a single node.
void lay_out_levels(QueryIndex& index) {
  std::uint32_t count = index.clusters.size;
  index.levels = 0;
  index.level_begin[0] = 0;
  while (count > 0) {
    index.level_begin[index.levels + 1] = index.level_begin[index.levels] + count;
    ++index.levels;
    count = count == 1 ? 0 : tile_count(count);
  }
  index.nodes.size = index.level_begin[index.levels];
}

// Makes all nodes, on the calling thread.
void make_all_nodes(QueryIndex& index) {
  lay_out_levels(index);
  for (std::uint32_t cluster = 0; cluster < index.clusters.size; ++cluster) make_cluster_node(index, cluster);
  make_inner_nodes(index);
}

Hull hull_of(Span<const InstanceBounds> all) {
  Hull out;
  for (const InstanceBounds& bounds : all)
    if (has_bounds(bounds)) out.add(bounds);
  return out;
}

}  // namespace

std::uint32_t curve_key(const QueryIndex& index, const double* point) {
  double at[3];
  for (int c = 0; c < 3; ++c) at[c] = index.scale * (point[c] - index.center[c]);
  return curve_key(at);
}

void sort_by_key(Span<KeyedNumber> order, Span<KeyedNumber> other) {
  constexpr int kDigitBits = 10, kDigits = 3;
  constexpr std::uint32_t kValues = 1 << kDigitBits;
  static_assert(kDigits * kDigitBits == 3 * kBitsPerAxis);
  std::uint32_t begin[kDigits][kValues] = {};
  const auto digit_of = [](const KeyedNumber& one, int digit) {
    return one.key >> (digit * kDigitBits) & (kValues - 1);
  };
  for (const KeyedNumber& one : order)
    for (int d = 0; d < kDigits; ++d) ++begin[d][digit_of(one, d)];
  Span<KeyedNumber> from = order, to = other;
  for (int d = 0; d < kDigits; ++d) {
    std::uint32_t next = 0;
    for (std::uint32_t& at : begin[d]) {
      const std::uint32_t count = at;
      at = next;
      next += count;
    }
    for (const KeyedNumber& one : from) to[begin[d][digit_of(one, d)]++] = one;
    std::swap(from, to);
  }
  std::copy(from.begin(), from.end(), order.begin());
}

std::size_t most_nodes(std::size_t clusters) { return clusters + clusters / (kLanes - 1) + QueryIndex::kMostLevels; }

void lay_out_index(StoredBatches batches, QueryIndex& index) {
  std::uint32_t begin = 0;
  for (std::size_t slot = 0; slot < batches.size; ++slot) {
    const InstanceBatch& batch = batches[slot]->batch;
    index.batch_begin[slot] = begin;
    if (batch.input) begin += batch.capacity;
  }
}

void build_index(StoredBatches batches, WorkerPool& pool, QueryIndex& index) {
  Hull all;
  const auto for_each_given = [&](auto&& take) {
    for (std::uint32_t slot = 0; slot < batches.size; ++slot)
      if (batches[slot]->batch.input) take(batches[slot]->batch, slot);
  };
  for_each_given([&](const InstanceBatch& batch, std::uint32_t slot) {
    for (std::uint32_t place = 0; place < active_count(batch); ++place) {
      const InstanceBounds& bounds = index.bounds[index.batch_begin[slot] + active_instance(batch, place)];
      if (has_bounds(bounds)) all.add(bounds);
    }
  });
  place(all, index);
  index.clusters.clear();
  for_each_given([&](const InstanceBatch& batch, std::uint32_t slot) {
    add_batch(
        slot, active_count(batch), [&batch](std::uint32_t place) { return active_instance(batch, place); },
        [&](std::uint32_t begin, Span<IndexedPoint> points) {
          if (index.arrangement == Arrangement::kHalved)
            order_points(points, *pool.tasks);
          else
            order_on_curve(begin, points, index);
        },
        index);
  });
  order_clusters(index);
  lay_out_levels(index);
  const std::uint32_t clusters = index.clusters.size;
  pool.tasks->for_each((clusters + kNodesPerTask - 1) / kNodesPerTask, [&](std::uint32_t task, std::uint32_t) {
    const std::uint32_t end = std::min(clusters, (task + 1) * kNodesPerTask);
    for (std::uint32_t cluster = task * kNodesPerTask; cluster < end; ++cluster) make_cluster_node(index, cluster);
  });
  make_inner_nodes(index);
}

void build_index_of_one(std::uint32_t slot, QueryIndex& index) {
  place(hull_of(index.bounds), index);
  index.clusters.clear();
  add_batch(
      slot, static_cast<std::uint32_t>(index.bounds.size), [](std::uint32_t i) { return i; },
      [](std::uint32_t, Span<IndexedPoint> points) { order_points(points); }, index);
  index.arrangement = Arrangement::kHalved;
  order_clusters(index);
  make_all_nodes(index);
}

bool build_index_like(const QueryIndex& other, QueryIndex& index) {
  place(hull_of(index.bounds), index);
  index.clusters.clear();
  std::uint32_t first = 0;
  for (const QueryCluster& cluster : other.clusters) {
    std::uint32_t count = 0;
    for (std::uint32_t lane = 0; lane < cluster.count; ++lane) {
      const IndexedPoint& point = other.order[cluster.first + lane];
      if (has_bounds(index.bounds[point.number])) index.order[first + count++] = point;
    }
    if (count > 0) index.clusters.push({cluster.batch, first, count});
    first += count;
  }
  if (first != static_cast<std::size_t>(std::count_if(index.bounds.begin(), index.bounds.end(), has_bounds)))
    return false;
  make_all_nodes(index);
  index.arrangement = other.arrangement;
  return true;
}

}  // namespace cab
