// run_queries: the index of all instances, then the queries in chunks of as many as there is memory for.
#include "engine/broad_phase/world_bounds.h"
#include "engine/queries/past.h"
#include "engine/queries/past_rays.h"
#include "engine/queries/query_indexes.h"
#include "engine/queries/sphere_query.h"
#include "engine/queries/surface_rays.h"
#include "engine/queries/validate_queries.h"
#include "engine/session/call.h"
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "engine/step/profiled.h"
#include "engine/step/timed.h"
#include "engine/step/update.h"
#include "kernels/float_mode.h"
#include "layout/frame_stats.h"

#include <algorithm>
#include <exception>
#include <optional>

namespace cab {
namespace {

constexpr std::uint32_t kTilesPerTask = 8;

// A worker takes so many tasks of a chunk, unless they would have fewer or more queries than this.
constexpr std::uint32_t kTasksPerWorker = 8, kLeastQueriesPerTask = 8, kMostQueriesPerTask = HistoryMemory::kMostRays;
constexpr std::uint32_t kHitsPerTask = 64;  // whose places on surfaces are found
constexpr std::uint32_t kPrefetched = 12;   // how many queries ahead one is prefetched

// Queries are put in order along the curve if a chunk has more than this.
constexpr std::uint32_t kQueriesInAnyOrder = 64;

// Up to this many instances and queries the calling thread works alone.
constexpr std::size_t kInstancesAlone = 256, kQueriesAlone = 32;

// --------------------------------------------------------------------------------------------------------- checks

// Checks the histories, and lists them in HistoryMemory::asked.
Status bind_histories(const Engine& engine, Call& call, Span<const HistoryId> histories) {
  HistoryMemory* const past = call.reader().past.get();
  if (past) past->asked.clear();
  if (histories.size && !histories.data) return Status::kUnknownHistory;
  for (const HistoryId id : histories) {
    const std::size_t index = index_of(id.value, engine.histories);
    if (index == engine.histories.size()) return Status::kUnknownHistory;
    const StoredHistory& history = *engine.histories[index];
    if (!has_batch(engine, history.batch)) return Status::kUnknownBatch;
    std::vector<const StoredHistory*>& asked = past->asked;
    if (std::any_of(asked.begin(), asked.end(),
                    [&history](const StoredHistory* other) { return other->batch.value == history.batch.value; }))
      return Status::kHistoryGivenTwice;
    if (!call.batch(history.batch).input) call.copy_stored(slot_of(history.batch).value - 1);
    asked.push_back(&history);
  }
  return Status::kOk;
}

// The first query about the past that the skins of the job's histories do not answer, or none: null.
const Query* first_not_taken(const Call& call, const QueryJob& job) {
  const HistoryMemory* const past = call.reader().past.get();
  const bool has_skins = past && std::any_of(past->asked.begin(), past->asked.end(), [](const StoredHistory* history) {
                           return has_skin(*history->articulation);
                         });
  if (!has_skins) return nullptr;
  const Query* const end = job.queries.data + job.queries.size;
  const Query* const first = std::find_if(job.queries.data, end, [&job](const Query& query) {
    return query.time != kNow && !(query.kind == QueryKind::kRay && job.exact == Exact::kSurface);
  });
  return first == end ? nullptr : first;
}

Status validate(const Engine& engine, Call& call, QueryJob& job) {
  const auto any_input = [&](auto&& is) {
    return std::any_of(job.inputs.begin(), job.inputs.end(),
                       [&](const BatchInput& input) { return is(call.batch(input.batch)); });
  };
  if (any_input([](const InstanceBatch& batch) { return batch.kind != BatchKind::kCharacters; }))
    return Status::kBadBatchKind;
  if (job.exact != Exact::kNone && job.exact != Exact::kConvex && job.exact != Exact::kSurface)
    return Status::kExactNotBuilt;
  if (job.exact != Exact::kNone &&
      any_input([](const InstanceBatch& batch) { return batch.articulation->lod.posed != nullptr; }))
    return Status::kLodWithoutShapes;
  const bool has_skins = any_input([](const InstanceBatch& batch) { return has_skin(*batch.articulation); });
  if (job.exact == Exact::kConvex && has_skins) return Status::kSkinNotTaken;
  if (job.queries.size && !job.queries.data) return Status::kBadQuery;
  if (const BadQuery bad = first_bad_query(engine, job); bad.status != Status::kOk) {
    job.bad_query = bad.index;
    return bad.status;
  }
  if (job.exact == Exact::kSurface && has_skins) {
    const auto is_taken = [](const Query& query) {
      return query.kind == QueryKind::kRay || query.kind == QueryKind::kRegion;
    };
    const Query* const end = job.queries.data + job.queries.size;
    const Query* const other = std::find_if_not(job.queries.data, end, is_taken);
    if (other != end) {
      job.bad_query = static_cast<std::size_t>(other - job.queries.data);
      return Status::kSkinNotTaken;
    }
  }
  if (const Status status = bind_histories(engine, call, job.histories); status != Status::kOk) return status;
  if (const Query* const query = first_not_taken(call, job)) {
    job.bad_query = static_cast<std::size_t>(query - job.queries.data);
    return Status::kSkinNotTaken;
  }
  if ((job.hits.size && !job.hits.data) || (job.links.size && !job.links.data)) return Status::kBadHitBuffer;
  if (job.hits.size && job.links.size) return Status::kBadHitBuffer;
  const Span<SurfacePoint> points = job.surface_points;
  if (!points.empty() && (!points.data || points.size != job.hits.size)) return Status::kBadOutput;
  if (!job.counts.empty() && (!job.counts.data || job.counts.size != job.queries.size)) return Status::kBadOutput;
  if (!job.found.empty() && (!job.found.data || job.found.size != job.queries.size)) return Status::kBadOutput;
  return Status::kOk;
}

// ---------------------------------------------------------------------------------------------------------- index

// Whether the bounds that the last frame stored for a batch are those of its leaf boxes as they are now, if the caller
// says so. A level of nodes is asked for nodes, but bounded by leaves.
bool has_frame_bounds(const Engine& engine, const InstanceBatch& batch) {
  return batch.bounded_by == engine.bounds_of_frame && !batch.articulation->lod.posed;
}

// Stores the bounds of the instances of one batch as the last frame had them.
void take_frame_bounds(const InstanceBatch& batch, std::uint32_t slot, QueryIndex& index) {
  for (std::uint32_t place = 0; place < active_count(batch); ++place) {
    const std::uint32_t i = active_instance(batch, place);
    const bool is_live = batch.live[i / kLanes] >> (i % kLanes) & 1;
    index.bounds[index.batch_begin[slot] + i] = is_live ? batch.bounds[i] : kNoBounds;
  }
}

// Poses one tile, and stores the bounds of its instances.
void bound_tile(const FrameContext& frame, std::uint32_t slot, std::uint32_t tile, PoseScratch& posing,
                QueryWorker& own, QueryIndex& index) {
  const InstanceBatch& batch = frame.batch(slot);
  const TileInstances instances = instances_of(batch, tile);
  const std::uint32_t leaves = batch.active->leaf_count;
  const std::uint32_t live = update_tile(
      frame, {&batch, instances, refit_scope(Strategy::kRows, *batch.active), posing.boxes.data, posing.bounds.data},
      posing);
  AabbTile all;
  frame.kernels.bound_boxes(posing.boxes.data, leaves, posing.bounds.data);
  frame.kernels.bound_together(posing.bounds.data, leaves, &all);
  for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
    const std::uint32_t i = instances.instance[lane];
    const bool is_live = live >> lane & 1;
    index.bounds[index.batch_begin[slot] + i] = is_live ? world_bounds(batch, i, all, lane) : kNoBounds;
    own.stats.instances_masked += !is_live;
  }
}

// The frame that a job states to be that of its inputs, if the bounds of all of them are stored since then, else 0.
std::uint64_t frame_of(const Engine& engine, const Call& call, const QueryJob& job) {
  const bool has_bounds = std::all_of(job.inputs.begin(), job.inputs.end(), [&](const BatchInput& input) {
    return has_frame_bounds(engine, call.batch(input.batch));
  });
  return job.reuse_bounds && has_bounds ? engine.bounds_of_frame : 0;
}

// Stores the bounds of all instances that are given, and makes the index of them.
void make_index(const Engine& engine, Call& call, const FrameContext& frame, const QueryJob& job, QueryIndex& index) {
  QueryMemory& memory = *call.reader().queries;
  WorkerPool& pool = *call.reader().pool;
  QueryStats& stats = memory.workers[0]->stats;
  {
    const Timed timed(stats.seconds_bound);
    lay_out_index(frame.batches, index);
    for (std::uint32_t slot = 0; slot < frame.batches.size; ++slot) {
      const InstanceBatch& batch = frame.batch(slot);
      if (!batch.input) continue;
      if (job.reuse_bounds && has_frame_bounds(engine, batch)) {
        call.store_last_bounds(slot);
        take_frame_bounds(batch, slot, index);
        continue;
      }
      const std::uint32_t tiles = tile_count(active_count(batch));
      pool.tasks->for_each((tiles + kTilesPerTask - 1) / kTilesPerTask, [&](std::uint32_t task, std::uint32_t w) {
        const std::uint32_t end = std::min(tiles, (task + 1) * kTilesPerTask);
        for (std::uint32_t tile = task * kTilesPerTask; tile < end; ++tile)
          bound_tile(frame, slot, tile, pool[w].pose, *memory.workers[w], index);
      });
    }
  }
  const Timed timed(stats.seconds_index);
  build_index(frame.batches, pool, index);
}

// The index that the queries of a job search, made if there is none. Empty if they ask no inputs. given: how many
// instances are.
const QueryIndex& index_for(Engine& engine, Call& call, const FrameContext& frame, const QueryJob& job,
                            std::size_t given, bool asks_static, std::optional<IndexLease>& lease) {
  static const QueryIndex kEmpty;
  const bool asks_inputs =
      asks_static || job.histories.empty() ||
      std::any_of(job.queries.begin(), job.queries.end(), [](const Query& query) { return query.time == kNow; });
  if (!asks_inputs) return kEmpty;
  lease.emplace(*engine.query_indexes, IndexWanted{frame_of(engine, call, job), frame.batches, given, job.queries});
  if (lease->is_to_make()) {
    make_index(engine, call, frame, job, lease->index_to_make());
    lease->finish();
  }
  QueryMemory& memory = *call.reader().queries;
  if (memory.posed_of != lease->serial())
    for (const auto& worker : memory.workers) {
      forget_clusters(worker->posed);
      forget_skinned(worker->skins);
    }
  memory.posed_of = lease->serial();
  return lease->index();
}

// -------------------------------------------------------------------------------------------------------- queries

// What becomes of the hits of a job.
enum class Output { kHits, kLinks, kCounts };

Output output_of(const QueryJob& job) {
  if (job.links.size) return Output::kLinks;
  return job.hits.size || job.counts.empty() ? Output::kHits : Output::kCounts;
}

// How many hits the job's list has room for. None are written where they are counted.
std::size_t room_of(const QueryJob& job) { return job.hits.size + job.links.size; }

// The queries of a job from `first` on that are answered together.
struct Chunk {
  const FrameContext& frame;
  const QueryIndex& index;
  const QueryJob& job;
  QueryMemory& memory;
  WorkerPool& pool;
  const HistoryMemory* past;  // null if the job has no histories
  bool links_are_leaves, asks_static;
  std::size_t first;
  std::uint32_t count;

  // Queries about the past are posed for together, so their tasks do not depend on the number of workers.
  std::uint32_t queries_per_task() const {
    const std::uint32_t each = count / (kTasksPerWorker * static_cast<std::uint32_t>(memory.workers.size()));
    return past ? kMostQueriesPerTask : std::clamp(each, kLeastQueriesPerTask, kMostQueriesPerTask);
  }
  std::uint32_t task_count() const { return (count + queries_per_task() - 1) / queries_per_task(); }
  std::uint32_t begin_of(std::uint32_t task) const { return std::min(count, task * queries_per_task()); }

  QueryRun run(std::uint32_t worker) const {
    const Span<const StoredHistory* const> asked = {past ? past->asked.data() : nullptr, past ? past->asked.size() : 0};
    return {frame,
            index,
            {memory.layers.data, memory.layers.size},
            job,
            pool[worker].pose,
            pool[worker].exact,
            *memory.workers[worker],
            links_are_leaves,
            asks_static,
            asked,
            past ? past->workers[worker].get() : nullptr};
  }
};

// Whether the candidates of a query are in the worker's list, from an index on, which then moves past them.
struct Collected {
  bool is_collected = false;
  std::uint32_t at = 0;
};

// What is left of the search for a query that others were searched for with, if there is one.
struct Begun {
  kernel::RaySearch* ray = nullptr;
  kernel::PointSearch* point = nullptr;
  PastRay* past = nullptr;
};

// Finds the links of the job's inputs that a query wants.
void search(const QueryRun& run, const Query& query, std::uint32_t number, const Begun& begun, LinkHits& hits) {
  if (query.kind == QueryKind::kRay) {
    if (begun.ray) return RayQuery(run, query, hits).finish(*begun.ray);
    kernel::RaySearch one;
    search_together(run, {&number, 1}, &one);
    return RayQuery(run, query, hits).finish(one);
  }
  if (wants_nearest(run, query)) {
    if (begun.point) return ShapeQuery(run, query, hits).finish(*begun.point);
    kernel::PointSearch one;
    search_together(run, {&number, 1}, &one);
    return ShapeQuery(run, query, hits).finish(one);
  }
  const auto search_by = [&](auto&& probe) {
    if (probe.enter()) search_index(run, query, probe);
  };
  switch (query.kind) {
    case QueryKind::kRay: return;  // searched above
    case QueryKind::kRegion: return search_by(RegionQuery(run, query, hits));
    case QueryKind::kSphere:
    case QueryKind::kBox:
    case QueryKind::kCapsule:
    case QueryKind::kPoint: return search_by(ShapeQuery(run, query, hits));
  }
}

// How many hits a query wants.
std::size_t wanted_by(const Query& query) {
  return query.want == QueryWant::kAny ? 0 : query.want == QueryWant::kAll ? query.max_hits : 1;
}

// Answers one query by bits, which go to the worker's list if it has room.
QueryResult answer_by_bits(const QueryRun& run, std::size_t number) {
  const Query& query = run.job.queries[number];
  const Span<const kernel::MetLeaves> found = find_overlapped(run, query);
  std::size_t count = 0;
  for (const kernel::MetLeaves& at : found) count += count_bits(at.inside);
  FixedList<kernel::MetLeaves>& to = run.own.overlapped;
  const bool is_stored = output_of(run.job) != Output::kCounts && to.size + found.size <= to.capacity;
  if (is_stored) std::copy_n(found.data, found.size, to.end());
  return {0,
          0,
          static_cast<std::uint32_t>(std::min(count, wanted_by(query))),
          static_cast<std::uint32_t>(found.size),
          is_stored,
          count > 0};
}

// Answers one query, whose hits go to `buffer`. Returns how many there are and whether they are sorted there.
QueryResult answer(const QueryRun& run, std::size_t number, HitBuffer buffer, Collected& collected,
                   const Begun& begun = {}) {
  const Query& query = run.job.queries[number];
  LinkHits hits(run, query, static_cast<std::uint32_t>(number), buffer);
  const auto at = static_cast<std::uint32_t>(number);
  if (query.time == kNow || run.asks_static) search(run, query, at, begun, hits);
  if (begun.past)
    RayQuery(run, query, hits).finish(*begun.past);
  else if (query.time != kNow && collected.is_collected)
    collected.at = test_candidates(run, at, collected.at, hits);
  else if (query.time != kNow && !run.asked.empty())
    answer_alone(run, at, hits);
  hits.end();
  if (buffer.is_complete()) buffer.sort();
  return {0, 0, static_cast<std::uint32_t>(buffer.count()), 0, buffer.is_complete(), hits.is_found()};
}

// Puts the queries of a chunk in an order in which those that follow each other read the same: of now in the order of
// the index's curve, and before them those about the past in the order of their times.
void order_queries(const Chunk& chunk) {
  const QueryIndex& index = chunk.index;
  const bool is_ordered = chunk.count > kQueriesInAnyOrder && (index.levels > 0 || chunk.past);
  const Span<const StoredHistory* const> asked = chunk.run(0).asked;
  const auto key_of = [&](const Query& query) {
    if (query.time != kNow) return asked.empty() ? 0 : time_key(*asked[0], query.time);
    return index.levels > 0 ? kTimeKeys + curve_key(index, query.position) / 2 : 0;
  };
  chunk.pool.tasks->for_each(chunk.task_count(), [&](std::uint32_t task, std::uint32_t) {
    for (std::uint32_t i = chunk.begin_of(task); i < chunk.begin_of(task + 1); ++i)
      chunk.memory.order[i] = {is_ordered ? key_of(chunk.job.queries[chunk.first + i]) : 0, i};
  });
  if (is_ordered) sort_by_key({chunk.memory.order.data, chunk.count}, {chunk.memory.other_order.data, chunk.count});
}

// Keeps the result of a query, whose hits begin at `begin` of the worker's if they are there.
void keep_result(const Chunk& chunk, std::uint32_t query, std::uint32_t w, std::uint32_t begin,
                 const QueryResult& result) {
  QueryResult& kept = chunk.memory.results[query];
  kept = result;
  kept.worker = w;
  kept.begin = begin;
  if (!chunk.job.found.empty()) chunk.job.found[chunk.first + query] = result.is_found;
  if (!chunk.job.counts.empty()) chunk.job.counts[chunk.first + query] = result.count;
}

// Prefetches queries that are asked soon.
CAB_INLINE void prefetch_queries(const Chunk& chunk, std::uint32_t place, std::uint32_t count) {
  for (; count > 0 && place < chunk.count; ++place, --count)
    prefetch_bytes(&chunk.job.queries[chunk.first + chunk.memory.order[place].number], sizeof(Query));
}

// Answers the query in a place of the order, and keeps its hits if the worker has room.
void answer_in_order(const Chunk& chunk, const QueryRun& run, std::uint32_t place, std::uint32_t w,
                     Collected& collected, const Begun& begun = {}) {
  FixedList<QueryHit>& hits = run.own.hits;
  prefetch_queries(chunk, place + kPrefetched, 1);
  const std::uint32_t query = chunk.memory.order[place].number;
  if (is_answered_by_bits(run, chunk.job.queries[chunk.first + query])) {
    FixedList<kernel::MetLeaves>& found = run.own.overlapped;
    const QueryResult result = answer_by_bits(run, chunk.first + query);
    keep_result(chunk, query, w, found.size, result);
    if (result.is_stored) found.size += result.tiles;
    return;
  }
  // Where hits are counted they are stored for no longer than it takes to leave out what is farther.
  const bool is_counted = output_of(chunk.job) == Output::kCounts;
  const std::size_t room = hits.capacity - hits.size, wanted = wanted_by(chunk.job.queries[chunk.first + query]);
  const HitBuffer buffer({hits.end(), is_counted && wanted > room ? 0 : room}, wanted);
  const QueryResult result = answer(run, chunk.first + query, buffer, collected, begun);
  keep_result(chunk, query, w, hits.size, result);
  if (result.is_stored && !is_counted) hits.size += result.count;
}

// The numbers of the queries from a place of the order on that are searched for together: up to another query, or as
// many as the worker's memory is good for.
struct Together {
  std::uint32_t numbers[kLanes], count = 0;

  template <class Takes>
  Together(const Chunk& chunk, std::uint32_t place, std::uint32_t end, Takes&& takes) {
    for (; count < chunk.memory.together && place + count < end; ++count) {
      numbers[count] = static_cast<std::uint32_t>(chunk.first + chunk.memory.order[place + count].number);
      const Query& query = chunk.job.queries[numbers[count]];
      if (query.time != kNow || !takes(query)) break;
    }
  }
  Span<const std::uint32_t> span() const { return {numbers, count}; }
};

// Answers the rays from a place of the order on. Returns how many.
std::uint32_t answer_rays(const Chunk& chunk, const QueryRun& run, std::uint32_t place, std::uint32_t end,
                          std::uint32_t w, Collected& collected) {
  const Together rays(chunk, place, end, [](const Query& query) { return query.kind == QueryKind::kRay; });
  if (rays.count == 0) return 0;
  kernel::RaySearch searches[kLanes];
  FirstTouches touches;
  prefetch_queries(chunk, place + rays.count, rays.count);
  search_together(run, rays.span(), searches);
  cast_first(run, rays.span(), searches, touches);
  FixedList<QueryHit>& hits = run.own.hits;
  for (std::uint32_t i = 0; i < rays.count; ++i) {
    if (!(touches.decided >> i & 1)) {
      answer_in_order(chunk, run, place + i, w, collected, {&searches[i], nullptr});
      continue;
    }
    const bool is_found = touches.found >> i & 1, is_named = touches.named >> i & 1;
    const bool is_stored = !is_named || hits.size < hits.capacity;
    keep_result(chunk, static_cast<std::uint32_t>(rays.numbers[i] - chunk.first), w, hits.size,
                {0, 0, is_named, 0, is_stored, is_found});
    if (is_named && is_stored) touches.write(run, i, rays.numbers[i], hits.data[hits.size++]);
  }
  return rays.count;
}

// The same for points that want the nearest link.
std::uint32_t answer_points(const Chunk& chunk, const QueryRun& run, std::uint32_t place, std::uint32_t end,
                            std::uint32_t w, Collected& collected) {
  const Together points(chunk, place, end, [&run](const Query& query) { return wants_nearest(run, query); });
  if (points.count == 0) return 0;
  kernel::PointSearch searches[kLanes];
  prefetch_queries(chunk, place + points.count, points.count);
  search_together(run, points.span(), searches);
  for (std::uint32_t i = 0; i < points.count; ++i)
    answer_in_order(chunk, run, place + i, w, collected, {nullptr, &searches[i]});
  return points.count;
}

// Searches the histories for the rays of a task. In every other place nothing is known.
void search_past_rays(const Chunk& chunk, const QueryRun& run, std::uint32_t begin, std::uint32_t end) {
  PastRay* rays[kMostQueriesPerTask];
  std::uint32_t count = 0;
  for (std::uint32_t place = begin; place < end; ++place) {
    PastRay& ray = run.past->rays[place - begin];
    ray.query = static_cast<std::uint32_t>(chunk.first + chunk.memory.order[place].number);
    ray.is_known = false;
    if (is_past_ray(run, chunk.job.queries[ray.query])) rays[count++] = &ray;
  }
  search_past(run, rays, count);
}

// Answers the queries of one task: first histories are searched for the rays, then the instances of the past are
// collected and posed that as many of the others meet as there is room for, and these queries are answered one after
// the other.
void answer_task(const Chunk& chunk, std::uint32_t task, std::uint32_t w) {
  const QueryRun run = chunk.run(w);
  const Timed timed(run.own.stats.seconds_search);
  const std::uint32_t first = chunk.begin_of(task), end = chunk.begin_of(task + 1);
  if (!run.asked.empty()) search_past_rays(chunk, run, first, end);
  const auto past_ray = [&](std::uint32_t place) {
    PastRay* const ray = run.asked.empty() ? nullptr : &run.past->rays[place - first];
    return ray && ray->is_known ? ray : nullptr;
  };
  for (std::uint32_t begin = first; begin < end;) {
    Collected collected;
    std::uint32_t last = end;
    if (!run.asked.empty()) {
      clear_candidates(*run.past);
      const auto fits = [&](std::uint32_t place) {
        const auto number = static_cast<std::uint32_t>(chunk.first + chunk.memory.order[place].number);
        return chunk.job.queries[number].time == kNow || past_ray(place) || collect_candidates(run, number);
      };
      for (last = begin; last < end && fits(last);) ++last;
      pose_candidates(run);
      collected.is_collected = last > begin;
      last = std::max(last, begin + 1);
    }
    while (begin < last) {
      std::uint32_t answered = answer_rays(chunk, run, begin, last, w, collected);
      if (answered == 0) answered = answer_points(chunk, run, begin, last, w, collected);
      if (answered == 0) answer_in_order(chunk, run, begin, w, collected, {nullptr, nullptr, past_ray(begin)});
      begin += std::max(answered, 1u);
    }
  }
}

// A hit in full, and as an entry of a short list.
void write(const QueryHit& hit, QueryHit& to) { to = hit; }
void write(const QueryHit& hit, QueryLink& to) { to = {hit.query, hit.batch, hit.instance, hit.link, hit.leaf}; }

// Writes the hits of the queries of one task to a list of the job, of those that the workers have stored.
template <class Hit>
void write_stored(const Chunk& chunk, const QueryRun& run, std::uint32_t task, Span<Hit> list) {
  const std::uint32_t end = chunk.begin_of(task + 1);
  for (std::uint32_t query = chunk.begin_of(task); query < end; ++query) {
    const QueryResult& result = chunk.memory.results[query];
    if (!result.is_stored) continue;
    const std::size_t number = chunk.first + query;
    const Span<Hit> to = {list.data + chunk.memory.hit_begin[query], result.count};
    const QueryWorker& from = *chunk.memory.workers[result.worker];
    if (is_answered_by_bits(run, chunk.job.queries[number]))
      write_overlapped(run, static_cast<std::uint32_t>(number), {from.overlapped.data + result.begin, result.tiles},
                       to);
    else
      for (std::uint32_t i = 0; i < result.count; ++i) write(from.hits.data[result.begin + i], to[i]);  // mostly one
  }
}

// Finds the hits of one query again, and writes them to the job's.
void write_again(const QueryRun& run, std::size_t number, Span<QueryHit> to) {
  Collected none;
  answer(run, number, HitBuffer(to, to.size), none);
}

// The same as a short list: as many at a time as the worker has room for, all of which are written.
void write_again(const QueryRun& run, std::size_t number, Span<QueryLink> to) {
  const FixedList<QueryHit>& room = run.own.hits;
  QueryHit last;
  for (std::size_t done = 0; done < to.size;) {
    Collected none;
    const std::size_t count = std::min<std::size_t>(room.capacity, to.size - done);
    answer(run, number, HitBuffer({room.data, count}, count, done ? &last : nullptr), none);
    for (std::size_t i = 0; i < count; ++i) write(room.data[i], to[done + i]);
    last = room.data[count - 1];
    done += count;
  }
}

// Writes the hits of the queries of one task for which the workers had no room, where all others are written.
template <class Hit>
void write_others(const Chunk& chunk, const QueryRun& run, std::uint32_t task, Span<Hit> list) {
  const QueryStats counted = run.own.stats;
  const std::uint32_t end = chunk.begin_of(task + 1);
  for (std::uint32_t query = chunk.begin_of(task); query < end; ++query) {
    const QueryResult& result = chunk.memory.results[query];
    if (result.is_stored || result.count == 0) continue;
    const std::size_t number = chunk.first + query;
    const Span<Hit> to = {list.data + chunk.memory.hit_begin[query], result.count};
    if (is_answered_by_bits(run, chunk.job.queries[number]))
      write_overlapped(run, static_cast<std::uint32_t>(number), find_overlapped(run, chunk.job.queries[number]), to);
    else
      write_again(run, number, to);
  }
  run.own.stats = counted;  // by answer_task
}

// Writes the hits of a chunk to a list of the job, which has room for them.
template <class Hit>
void write_hits(const Chunk& chunk, Span<Hit> list) {
  const std::uint32_t tasks = chunk.task_count();
  chunk.pool.tasks->for_each(
      tasks, [&](std::uint32_t task, std::uint32_t w) { write_stored(chunk, chunk.run(w), task, list); });
  const QueryResult* const results = chunk.memory.results.data;
  if (std::all_of(results, results + chunk.count, [](const QueryResult& result) { return result.is_stored; })) return;
  chunk.pool.tasks->for_each(
      tasks, [&](std::uint32_t task, std::uint32_t w) { write_others(chunk, chunk.run(w), task, list); });
}

// Where on a surface a hit is.
SurfacePoint surface_point(const QueryRun& run, const QueryHit& hit) {
  const Query& query = run.job.queries[hit.query];
  const ExactLeaf leaf = exact_leaf(run.frame, hit.batch.value - 1, hit.instance, hit.leaf);
  if (run.job.exact != Exact::kSurface || query.kind != QueryKind::kRay || !has_triangles(leaf)) return {};
  if (query.time != kNow) return past_surface_point(run, hit);
  PosedInstance one = {leaf.batch, leaf.batch_index, hit.instance, 0, nullptr, 0, {}};
  for (std::uint32_t c = 0; c < 3; ++c) one.apart[c] = origin_of(*leaf.batch, hit.instance, c) - query.position[c];
  HitBuffer none({}, 0);
  LinkHits hits(run, query, hit.query, none);
  return RayQuery(run, query, hits).surface_point(one, hit.leaf);
}

// Writes where on surfaces the hits of a chunk are, of hits[first] on.
void write_surface_points(const Chunk& chunk, const QueryJob& job, std::size_t first) {
  const std::size_t count = job.hits_needed - first;
  const auto tasks = static_cast<std::uint32_t>((count + kHitsPerTask - 1) / kHitsPerTask);
  chunk.pool.tasks->for_each(tasks, [&](std::uint32_t task, std::uint32_t w) {
    const QueryRun run = chunk.run(w);
    const std::size_t begin = first + std::size_t{task} * kHitsPerTask;
    for (std::size_t i = begin; i < std::min(begin + kHitsPerTask, job.hits_needed); ++i)
      job.surface_points[i] = surface_point(run, job.hits[i]);
  });
}

void run_chunk(const Chunk& chunk, QueryJob& job) {
  for (const auto& worker : chunk.memory.workers) {
    worker->hits.clear();
    worker->overlapped.clear();
  }
  order_queries(chunk);
  const std::uint32_t tasks = chunk.task_count();
  chunk.pool.tasks->for_each(tasks, [&](std::uint32_t task, std::uint32_t w) { answer_task(chunk, task, w); });
  for (std::uint32_t query = 0; query < chunk.count; ++query) {
    chunk.memory.hit_begin[query] = job.hits_needed;
    job.hits_needed += chunk.memory.results[query].count;
  }
  if (job.hits_needed > room_of(job)) return;
  if (output_of(job) == Output::kLinks)
    write_hits(chunk, job.links);
  else
    write_hits(chunk, job.hits);
  if (!job.surface_points.empty()) write_surface_points(chunk, job, chunk.memory.hit_begin[0]);
}

// Answers all queries of a job, as many in a chunk as are likely to have so few hits that these stay in cache until
// they are written, and that workers have room for.
void run_chunks(const FrameContext& frame, const QueryIndex& index, Reader& reader, bool links_are_leaves,
                bool asks_static, QueryJob& job) {
  constexpr std::size_t kFirst = 512, kHitsInCache = 16384;
  QueryMemory& memory = *reader.queries;
  const HistoryMemory* const past = job.histories.empty() ? nullptr : reader.past.get();
  const std::size_t least = std::min<std::size_t>(memory.queries, kQueriesInAnyOrder);
  const std::size_t most_hits = std::min(kHitsInCache, std::size_t{memory.workers[0]->hits.capacity} / 2);
  std::size_t most = std::min(memory.queries, kFirst);
  for (std::size_t first = 0; first < job.queries.size;) {
    const auto count = static_cast<std::uint32_t>(std::min(most, job.queries.size - first));
    run_chunk({frame, index, job, memory, *reader.pool, past, links_are_leaves, asks_static, first, count}, job);
    std::size_t hits = 1;
    for (const auto& worker : memory.workers) hits += worker->hits.size + worker->overlapped.size;
    most = std::clamp(count * most_hits / hits, least, std::min(2 * most, memory.queries));
    first += count;
  }
}

}  // namespace

Status run_queries(Engine& engine, QueryJob& job) noexcept try {
  const Clock::time_point start = Clock::now();
  Call call(engine, Access::kReads);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  const Profiled profiled(engine.profiler, "queries", 0);
  Reader& reader = call.reader();
  if (!reader.queries) return Status::kNoQueryMemory;
  const Needs needs = job.reuse_bounds ? Needs::kPosesOfFrame : Needs::kPoses;
  if (const Status status = bind_inputs(engine, call, job.inputs, needs); status != Status::kOk) return status;
  if (const Status status = validate(engine, call, job); status != Status::kOk) return status;
  QueryMemory& memory = *reader.queries;
  std::size_t given = 0;
  bool asks_static = false, links_are_leaves = true;
  for (const BatchInput& input : job.inputs) {
    InstanceBatch& batch = call.batch(input.batch);
    asks_static = asks_static || is_static(batch);
    links_are_leaves = links_are_leaves && batch.active->leaves_by_link;
    batch.margins = {};
    given += active_count(batch);
  }
  for (std::uint32_t slot = 0; slot < call.batches().size; ++slot) {
    const BatchInput* const input = call.batches()[slot]->batch.input;
    memory.layers[slot] = input && !input->layers.empty() ? input->layers.data : nullptr;
  }
  for (const auto& worker : memory.workers) worker->stats = {};
  reader.pool->tasks->alone = given <= kInstancesAlone && job.queries.size <= kQueriesAlone;
  Policies policies;
  policies.exact = job.exact;
  const FrameContext frame = call.context(policies, 0);
  std::optional<IndexLease> lease;
  const QueryIndex& index = index_for(engine, call, frame, job, given, asks_static, lease);
  job.hits_needed = 0;
  run_chunks(frame, index, reader, links_are_leaves, asks_static, job);
  const bool is_written = job.hits_needed <= room_of(job);
  const Status status = is_written || output_of(job) == Output::kCounts ? Status::kOk : Status::kHitsOverflow;
  job.hit_count = is_written ? job.hits_needed : 0;
  job.stats = {};
  for (const auto& worker : memory.workers) add_stats(job.stats, worker->stats);
  job.stats.seconds_total = seconds_since(start);
  return status;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace cab
