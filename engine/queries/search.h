// How a query goes through the index, from the top to the instances whose bounds it meets.
#pragma once

#include "engine/exact/convex_queues.h"
#include "engine/queries/history_memory.h"
#include "engine/queries/hit_buffer.h"
#include "engine/queries/query_memory.h"
#include "engine/step/pose_scratch.h"
#include "kernels/query_boxes.h"
#include "kernels/search_index.h"
#include "kernels/vec3.h"
#include "layout/box_aos.h"
#include "layout/compiler.h"

#include <array>
#include <cmath>

namespace cab {

// What every query of a call reads, and the memory of the worker that answers it.
struct QueryRun {
  const FrameContext& frame;
  const QueryIndex& index;
  Span<const std::uint32_t* const> layers;  // by index of the batch: those of its input, or null
  const QueryJob& job;
  PoseScratch& pose;
  ExactScratch& exact;
  QueryWorker& own;
  bool links_are_leaves;                   // whether each link of the inputs has at most one leaf, in their order
  bool asks_static;                        // whether static bodies are among the inputs
  Span<const StoredHistory* const> asked;  // the job's histories
  PastWorker* past;                        // not null if there are histories

  // The same for another index.
  QueryRun in(const QueryIndex& other) const {
    return {frame, other, layers, job, pose, exact, own, links_are_leaves, asks_static, asked, past};
  }
};

// Where the poses of an instance at a query's time are.
struct PastPlace {
  const PastCandidate& of;
  PoseCoding coding;
  const float* orientation;  // null if it has none
  float scale;
  PastWorker& own;
  const InstanceBatch* skin;  // of this instance alone, posed so, for surface_leaf; or null
};

// What a search of the run's index reads.
inline kernel::SearchedIndex searched_index(const QueryRun& run) {
  const PosedClusters& posed = run.own.posed;
  return {run.index.view(), posed.clusters.data, posed.generation, run.layers.data};
}

// Where a query is, and what it looks at.
inline kernel::SearchFilter filter_of(const Query& query) {
  const double* const at = query.position;
  return {{at[0], at[1], at[2]},
          query.layer_mask,
          slot_of(query.ignored_batch).value - 1,
          query.ignored_instance,
          query.time != kNow};
}

// The position of a query in an index, and a distance about it (docs/proof.md, step 12.4).
inline kernel::PointLanes point_in_index(const QueryIndex& index, const Query& query, double distance) {
  kernel::PointLanes out;
  double at[3], away = 0;
  for (int c = 0; c < 3; ++c) {
    at[c] = index.scale * (query.position[c] - index.center[c]);
    away += std::fabs(at[c]);
  }
  const double pad = kQueryRayPad * (1 + away);
  for (int c = 0; c < 3; ++c) {
    out.above[c] = float_above(at[c] + pad);
    out.below[c] = float_below(at[c] - pad);
  }
  out.most_sq = kernel::square_above(index.scale * distance + pad);
  return out;
}

// Whether an instance at `apart` from a query may be found at all.
inline bool is_in_reach(const double (&apart)[3]) {
  return std::fabs(apart[0]) <= kMaxQueryCoordinate && std::fabs(apart[1]) <= kMaxQueryCoordinate &&
         std::fabs(apart[2]) <= kMaxQueryCoordinate;
}

// One box of sixteen.
inline BoxAos lane_box(const BoxTile& tile, std::uint32_t lane) {
  BoxAos out;
  for (int c = 0; c < 3; ++c) {
    out.center[c] = tile.center[c][lane];
    out.half[c] = tile.half[c][lane];
    for (int k = 0; k < 3; ++k) out.axis[3 * k + c] = tile.axis[k][c][lane];
  }
  return out;
}

// An instance whose leaf boxes are posed.
struct PosedInstance {
  const InstanceBatch* batch;
  std::uint32_t slot, instance;  // slot: index of the batch
  std::uint32_t leaves;
  const BoxTile* boxes;             // leaves as lanes
  float reach;                      // the largest coordinate of any leaf's bounds
  double apart[3];                  // its origin less the query's position
  const PastPlace* past = nullptr;  // null: it is posed by the job's inputs

  BoxAos box(std::uint32_t leaf) const { return lane_box(boxes[leaf / kLanes], leaf % kLanes); }
};

// The exact shapes of a leaf, posed.
LeafShapes shapes_of(const QueryRun& run, const PosedInstance& one, std::uint32_t leaf);

// A leaf with the poses of the links that move its triangles, if it has some.
ExactLeaf surface_leaf(const QueryRun& run, const PosedInstance& one, std::uint32_t leaf);

// Where the leaf boxes of a posed tile go, with leaves as lanes: those of lane i begin at boxes[i *
// tile_count(leaves)].
struct PosedLanes {
  BoxTile* boxes;
  float (&reach)[kLanes];  // receives the largest coordinate of any leaf's bounds
};

// Takes the leaf boxes of the first lanes of a tile out of posing.boxes.
void take_posed(const kernel::KernelTable& kernels, PoseScratch& posing, std::uint32_t leaves, std::uint32_t count,
                const PosedLanes& to);

// Poses a cluster that is not posed.
const kernel::PosedCluster& pose_cluster(const QueryRun& run, std::uint32_t cluster);

// The same, unless it is posed already.
inline const kernel::PosedCluster& posed_cluster(const QueryRun& run, std::uint32_t cluster) {
  const PosedClusters& posed = run.own.posed;
  const kernel::PosedCluster& out = posed.clusters[cluster];
  return out.generation == posed.generation ? out : pose_cluster(run, cluster);
}

// Forgets all posed clusters: when there is no room for another, and between calls.
void forget_clusters(PosedClusters& posed);

inline bool is_ignored(const Query& query, std::uint32_t slot, std::uint32_t instance) {
  return slot_of(query.ignored_batch).value == slot + 1 && query.ignored_instance == instance;
}

// Whether a query looks at an instance of a batch that it asks.
inline bool looks_at(const Query& query, const InstanceBatch& batch, std::uint32_t slot, std::uint32_t instance) {
  const Span<const std::uint32_t> layers = batch.input->layers;
  return !is_ignored(query, slot, instance) && (query.layer_mask & (layers.empty() ? ~0u : layers[instance])) != 0;
}

// A query on its way through the index of its run. A probe has:
//   enter()             takes the query to the index. False: it meets nothing there
//   next(walk, met)     goes on to the next instance whose bounds it meets. False: there is none, or none is wanted
//   test(instance)      tests the leaves
//   skips(entry)        whether what is entered then is not wanted any more
//   is_done()           whether nothing more is wanted
//   is_in_order()       whether hits have no distance, so that they are in the order of instances
//   has_all_wanted()    whether hits that come after all others are not wanted any more

// A posed instance of the job's inputs. Poses its cluster.
inline PosedInstance instance_at(const QueryRun& run, const Query& query, std::uint32_t node, std::uint32_t lane) {
  const kernel::PosedCluster& posed = posed_cluster(run, node);
  const kernel::PosedCluster::Lane& of = posed.lanes[lane];
  PosedInstance out = {&run.frame.batch(posed.batch), posed.batch, of.instance, posed.leaves,
                       posed.boxes_of(lane),          of.reach,    {}};
  for (std::uint32_t c = 0; c < 3; ++c) out.apart[c] = of.origin[c] - query.position[c];
  return out;
}

// Tests an instance of the job's inputs whose bounds the query meets, if the query looks at it.
template <class Probe>
void test_lane(const QueryRun& run, const Query& query, std::uint32_t node, std::uint32_t lane, Probe& probe) {
  const kernel::PosedCluster& posed = posed_cluster(run, node);
  const kernel::PosedCluster::Lane& of = posed.lanes[lane];
  const InstanceBatch& batch = run.frame.batch(posed.batch);
  if (!looks_at(query, batch, posed.batch, of.instance) || !(posed.live >> lane & 1)) return;
  const PosedInstance one = instance_at(run, query, node, lane);
  if (!is_in_reach(one.apart)) return;
  ++run.own.stats.instances;
  probe.test(one);
}

// Prefetches what test_lane reads. Poses the cluster.
inline void prefetch_lane(const QueryRun& run, std::uint32_t node, std::uint32_t lane) {
  const kernel::PosedCluster& posed = posed_cluster(run, node);
  prefetch_bytes(posed.boxes_of(lane), sizeof(BoxTile));
  prefetch_bytes(&posed.lanes[lane], sizeof(kernel::PosedCluster::Lane));
}

// Calls probe.test(instance) for every instance of the job's inputs whose bounds the query meets, the nearest first, or
// in the order of hits if these have no distance, until probe.is_done().
template <class Probe>
void search_index(const QueryRun& run, const Query& query, Probe& probe) {
  kernel::IndexWalk walk;
  kernel::MetBounds met;
  FixedList<MetInstance>& list = run.own.met;
  list.clear();
  while (!probe.is_done() && probe.next(walk, &met)) {
    const QueryCluster& cluster = run.index.clusters.data[met.node];
    if (query.time != kNow && !is_static(run.frame.batch(cluster.batch))) continue;
    if (!probe.is_in_order())
      test_lane(run, query, met.node, met.lane, probe);
    else
      list.push({cluster.batch, run.index.order[cluster.first + met.lane].number, met.node, met.lane});
  }
  run.own.stats.nodes += walk.opened;
  std::sort(list.begin(), list.end(), [](const MetInstance& x, const MetInstance& y) {
    return x.batch != y.batch ? x.batch < y.batch : x.instance < y.instance;
  });
  constexpr std::uint32_t kAhead = 2;
  for (std::uint32_t i = 0; i < list.size && !probe.has_all_wanted(); ++i) {
    if (i + kAhead < list.size) prefetch_lane(run, list.data[i + kAhead].node, list.data[i + kAhead].lane);
    test_lane(run, query, list.data[i].node, list.data[i].lane, probe);
  }
}

// Calls test(leaf) for the leaves of an instance that a query meets by meets(boxes, entry), of every sixteen the
// nearest first. meets, skips(entry): as in a probe. Stops when is_done().
template <class Meets, class Skips, class Test, class IsDone>
void for_each_leaf(const QueryRun& run, const PosedInstance& one, Meets&& meets, Skips&& skips, Test&& test,
                   IsDone&& is_done) {
  for (std::uint32_t first = 0; first < one.leaves && !is_done(); first += kLanes) {
    alignas(64) float entry[kLanes];
    const std::uint32_t count = std::min(kLanes, one.leaves - first);
    std::uint32_t met = meets(one.boxes[first / kLanes], entry) & ((1u << count) - 1);
    while (met && !is_done()) {
      const std::uint32_t lane = kernel::nearest_lane<float>(met, entry);
      if (skips(entry[lane])) break;
      met &= ~(1u << lane);
      ++run.own.stats.leaf_tests;
      test(first + lane);
    }
  }
}

// The bounds of sixteen boxes, as a query compares them.
class BoundsOfBoxes {
 public:
  BoundsOfBoxes(const QueryRun& run, const BoxTile& boxes) { run.frame.kernels.bound_boxes(&boxes, 1, &bounds_); }
  kernel::BoundsRow row() const { return {&bounds_.lo[0][0], kLanes}; }

 private:
  AabbTile bounds_;
};

// A point or a direction as hits have it.
inline std::array<float, 3> floats(const kernel::Vec3<double>& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// Goes on with searches, one to sixteen, by a kernel, until each has ended or has met leaves that have to be tested
// before it goes on.
template <class Search>
void search_by_turns(const QueryRun& run,
                     void (*kernel)(const kernel::SearchedIndex&, Search* const* searches, std::uint32_t count),
                     Search* searches, std::uint32_t count) {
  Search* going[kLanes];
  for (std::uint32_t i = 0; i < count; ++i) going[i] = searches + i;
  for (;;) {
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      Search* const search = going[i];
      if (search->stop == kernel::SearchStop::kPose) posed_cluster(run, search->way.at.node);
      if (search->stop == kernel::SearchStop::kPose || search->stop == kernel::SearchStop::kGoesOn)
        going[left++] = search;
    }
    if (left == 0) return;
    kernel(searched_index(run), going, left);
    count = left;
  }
}

// Counts what a search did.
template <class Search>
void count_search(const QueryRun& run, const Search& search) {
  run.own.stats.nodes += search.way.walk.opened;
  run.own.stats.instances += search.way.tested;
}

// Collects the hits of one query, one per link.
class LinkHits {
 public:
  LinkHits(const QueryRun& run, const Query& query, std::uint32_t number, HitBuffer& buffer)
      : run_(run), query_(query), number_(number), buffer_(buffer) {}

  // A leaf that the query meets, or a part of one.
  void add(const PosedInstance& one, std::uint32_t leaf, float distance, const std::array<float, 3>& point,
           const std::array<float, 3>& normal, bool inside) {
    nearest_ = std::min(nearest_, distance);
    const bool is_first = !is_found_;
    is_found_ = true;
    if (query_.want == QueryWant::kAny) return;
    const Articulation& articulation = *one.batch->articulation;
    QueryHit hit = {number_,
                    {one.slot + 1},
                    one.instance,
                    articulation.leaf_link[leaf],
                    static_cast<std::uint16_t>(leaf),
                    distance,
                    {},
                    {},
                    inside};
    std::copy_n(point.data(), 3, hit.point);
    std::copy_n(normal.data(), 3, hit.normal);
    if (query_.want == QueryWant::kClosest) {
      if (is_first || is_nearer(hit, closest_)) closest_ = hit;
    } else if (articulation.leaves_by_link && run_.job.exact == Exact::kNone) {
      buffer_.add(hit);  // a link has one leaf, and that is added once
    } else {
      add_to_link(hit);
    }
  }

  // Ends an instance.
  void finish() {
    FixedList<QueryHit>& hits = run_.own.of_instance;
    for (const QueryHit& hit : hits) {
      run_.own.at_link[hit.link] = 0;
      buffer_.add(hit);
    }
    hits.clear();
  }

  // Ends the query.
  void end() {
    if (query_.want == QueryWant::kClosest && is_found_) buffer_.add(closest_);
  }

  // Notes that there is a link, for a query that wants none by name.
  void set_found() { is_found_ = true; }

  bool is_found() const { return is_found_; }
  bool is_done() const { return is_found_ && query_.want == QueryWant::kAny; }

  // Whether hits that come after all others are not wanted any more.
  bool has_all_wanted() const { return query_.want == QueryWant::kAll ? buffer_.has_all_wanted() : is_found_; }

  // No link that is farther is wanted any more.
  float most() const { return query_.want == QueryWant::kAll ? buffer_.most() : nearest_; }

 private:
  // Of two hits of one link the one of the lower leaf counts, if they are equally near.
  static bool is_nearer(const QueryHit& hit, const QueryHit& than) {
    return precedes(hit, than) || (!precedes(than, hit) && hit.leaf < than.leaf);
  }

  void add_to_link(const QueryHit& hit) {
    std::uint32_t& at = run_.own.at_link[hit.link];
    FixedList<QueryHit>& hits = run_.own.of_instance;
    if (at == 0) {
      hits.push(hit);
      at = hits.size;
    } else if (is_nearer(hit, hits.data[at - 1])) {
      hits.data[at - 1] = hit;
    }
  }

  const QueryRun& run_;
  const Query& query_;
  std::uint32_t number_;
  HitBuffer& buffer_;
  bool is_found_ = false;
  float nearest_ = std::numeric_limits<float>::infinity();
  QueryHit closest_;  // of kClosest, if one is found
};

// Tests the leaves that a search has met, the nearest first, and goes on with it until nothing is left that is wanted.
// kernel: as in search_by_turns. test(instance, leaf): adds a leaf to `hits`, if the query meets it.
template <class Search, class Test>
void finish_search(const QueryRun& run,
                   void (*kernel)(const kernel::SearchedIndex&, Search* const* searches, std::uint32_t count),
                   const Query& query, Search& search, LinkHits& hits, Test&& test) {
  for (;; search_by_turns(run, kernel, &search, 1)) {
    if (search.any && search.is_met) hits.set_found();
    kernel::MetLeaf* const end = search.met + search.met_count;
    std::sort(search.met, end, kernel::MetNearer());
    for (const kernel::MetLeaf* leaf = search.met; leaf != end && !hits.is_done(); ++leaf) {
      if (static_cast<double>(leaf->entry) > search.end) break;
      ++run.own.stats.leaf_tests;
      test(instance_at(run, query, leaf->node, leaf->lane), leaf->leaf);
      if (hits.is_found()) shorten(search, static_cast<double>(hits.most()));
    }
    search.met_count = 0;
    if (!search.way.is_within) hits.finish();
    if (search.stop == kernel::SearchStop::kEnd || hits.is_done()) break;
    search.stop = kernel::SearchStop::kGoesOn;
  }
  count_search(run, search);
}

}  // namespace cab
