// add_history, remove_history, record_tick, history_span: the ring of moments, and the bounds of instances between two
// of them.
#include "engine/queries/history.h"

#include "engine/broad_phase/world_bounds.h"
#include "engine/exact/convex_pair.h"
#include "engine/queries/past.h"
#include "engine/session/call.h"
#include "engine/session/slots.h"
#include "engine/session/validate.h"
#include "engine/step/pose_scratch.h"
#include "engine/step/quaternion_of.h"
#include "engine/step/update.h"
#include "kernels/between_moments.h"
#include "kernels/float_mode.h"
#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>

namespace cab {
namespace {

constexpr std::size_t kMaxHistories = 4096;

// Instances are arranged anew for every so many moments: what moves in between is little.
constexpr std::uint32_t kTicksAlike = 8;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Up to this many tiles the calling thread works alone.
constexpr std::uint32_t kTilesAlone = 16;

bool has_history(const Engine& engine, HistoryId id) {
  return index_of(id.value, engine.histories) < engine.histories.size();
}

// ------------------------------------------------------------------------------------------------------------- room

// The memory of all indexes of a history, in few blocks: large ones have huge pages.
struct IndexRoom {
  std::size_t instances, clusters, nodes;  // of one index
  Span<QueryCluster> all_clusters;
  Span<AabbTile> all_nodes;
  Span<std::uint16_t> used;
  Span<IndexedPoint> order;

  IndexRoom(std::size_t instances_, std::size_t count, Arena& arena)
      : instances(instances_),
        clusters(tile_count(static_cast<std::uint32_t>(instances))),
        nodes(most_nodes(clusters)),
        all_clusters(arena.allocate<QueryCluster>(clusters, count)),
        all_nodes(arena.allocate<AabbTile>(nodes, count)),
        used(arena.allocate<std::uint16_t>(nodes, count)),
        order(arena.allocate<IndexedPoint>(instances, count)) {}

  QueryIndex index(std::size_t number, const StoredHistory& history) const {
    QueryIndex out;
    out.clusters = {all_clusters.data + number * clusters, static_cast<std::uint32_t>(clusters), 0};
    out.nodes = {all_nodes.data + number * nodes, static_cast<std::uint32_t>(nodes), 0};
    out.used = {used.data + number * nodes, nodes};
    out.order = {order.data + number * instances, instances};
    out.cluster_order = history.cluster_order;
    out.unordered = history.unordered;
    return out;
  }
};

// How far what each link moves is from its origin, and the balls that hold leaf boxes (docs/proof.md, steps 13.6 and
// 13.7).
void measure_leaves(const Articulation& articulation, Span<float> reach, Span<float> radius) {
  const auto length = [](const float(&v)[3]) {
    return std::sqrt(static_cast<double>(v[0]) * static_cast<double>(v[0]) +
                     static_cast<double>(v[1]) * static_cast<double>(v[1]) +
                     static_cast<double>(v[2]) * static_cast<double>(v[2]));
  };
  std::fill(reach.begin(), reach.end(), -1.0f);
  for (const SurfaceBone& bone : articulation.surface.bones) reach[bone.link] = std::max(reach[bone.link], bone.radius);
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
    const Box& box = articulation.leaf_box[leaf];
    float& of_link = reach[articulation.leaf_link[leaf]];
    of_link = std::max(of_link, rounded_up(length(box.center) + length(box.half)));
    radius[leaf] = rounded_up(length(box.half) + 2 * kHistoryPad * (length(box.center) + length(box.half)));
  }
}

void make_ring(const InstanceBatch& batch, std::uint32_t ticks, StoredHistory& out) {
  const std::size_t instances = batch.capacity, links = batch.articulation->link_count;
  const std::size_t leaves = batch.articulation->leaf_count;
  const std::size_t clusters = tile_count(batch.capacity);
  Arena& arena = out.arena;
  out.articulation = batch.articulation;
  out.instances = batch.capacity;
  out.reach = arena.allocate<float>(links);
  out.radius = arena.allocate<float>(leaves + kLanes);
  measure_leaves(*batch.articulation, out.reach, out.radius);
  out.bounds = arena.allocate<InstanceBounds>(instances);
  out.next = arena.allocate<InstanceBounds>(instances);
  out.between = arena.allocate<InstanceBounds>(instances);
  out.cluster_order = arena.allocate<IndexedPoint>(clusters);
  out.unordered = {arena.allocate<QueryCluster>(clusters).data, static_cast<std::uint32_t>(clusters), 0};
  out.ring = arena.allocate<HistoryTick>(std::size_t{ticks} + 1);
  const std::size_t floats = links * kTickFloats, ring = out.ring.size;
  const IndexRoom room(instances, ring, arena);
  const Span<float> poses = arena.allocate<float>(instances * ring, floats);
  const Span<KeptPlace> places = arena.allocate<KeptPlace>(instances, ring);
  const std::size_t words = kLanes * tile_count(static_cast<std::uint32_t>(leaves) + kGridWords);
  const Span<std::uint32_t> centers = arena.allocate<std::uint32_t>(instances * ring, words);
  for (std::size_t i = 0; i < ring; ++i) {
    HistoryTick& tick = out.ring[i];
    tick.poses = poses.data + i * instances * floats;
    tick.places = places.data + i * instances;
    tick.centers = centers.data + i * instances * words;
    tick.center_words = words;
    tick.pose_floats = floats;
    tick.index = room.index(i, out);
  }
}

// ---------------------------------------------------------------------------------------------------------- a moment

// A pose of a link without what places its instance.
StoredPose pose_alone(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link) {
  return {{batch.input->poses.format, Scaling::kNone}, pose_of(batch, instance, link), nullptr, 1};
}

// Whether a matrix turns a right-handed frame into a left-handed one.
bool is_mirrored(const StoredPose& pose) {
  const int across = pose.coding.format == PoseFormat::kMatrix3x4Rows ? 1 : 4;  // floats from one column to the next
  const int down = pose.coding.format == PoseFormat::kMatrix3x4Rows ? 4 : 1;
  Double3 column[3];
  for (int k = 0; k < 3; ++k)
    column[k] = {static_cast<double>(pose.pose[k * across]), static_cast<double>(pose.pose[k * across + down]),
                 static_cast<double>(pose.pose[k * across + 2 * down])};
  return kernel::dot(kernel::cross(column[0], column[1]), column[2]) < 0 && is_valid(pose);
}

bool has_mirrored(const InstanceBatch& batch) {
  if (batch.input->poses.format == PoseFormat::kQuaternionTranslation) return false;
  for (std::uint32_t place = 0; place < active_count(batch); ++place)
    for (const PosedLink& posed : batch.articulation->posed_links)
      if (is_mirrored(pose_alone(batch, active_instance(batch, place), posed.link))) return true;
  return false;
}

// Writes a pose as a quaternion of length 1 and a translation, rounded.
void write_quaternion(const StoredPose& pose, float* out) {
  const kernel::RigidLanes<double> posed = pose_in_double(pose);
  double m[3][3], q[4];
  for (int k = 0; k < 3; ++k) m[0][k] = posed.column[k].x, m[1][k] = posed.column[k].y, m[2][k] = posed.column[k].z;
  quaternion_of(m, q);
  for (int c = 0; c < 4; ++c) out[c] = static_cast<float>(q[c]);
  out[4] = static_cast<float>(posed.translation.x);
  out[5] = static_cast<float>(posed.translation.y);
  out[6] = static_cast<float>(posed.translation.z);
}

// Copies what places an instance, and the poses of its links that are posed.
void keep_instance(const InstanceBatch& batch, std::uint32_t instance, const HistoryTick& tick) {
  const bool is_quaternion = batch.input->poses.format == PoseFormat::kQuaternionTranslation;
  for (const PosedLink& posed : batch.articulation->posed_links) {
    float* const to = tick.pose(instance) + posed.link * kTickFloats;
    if (is_quaternion)
      std::memcpy(to, pose_of(batch, instance, posed.link), kTickFloats * sizeof(float));
    else
      write_quaternion(pose_alone(batch, instance, posed.link), to);
  }
  KeptPlace& place = tick.place(instance);
  place = {0, {0, 0, 0}, {0, 0, 0, 1}, 1, ~0u, 0};  // no moment has it until its pose is checked
  for (std::uint32_t c = 0; c < 3; ++c) place.origin[c] = origin_of(batch, instance, c);
  if (tick.has_orientations) std::copy_n(orientation_of(batch, instance), 4, place.orientation);
  if (tick.has_scales) place.scale = scale_of(batch, instance);
  if (!batch.input->layers.empty()) place.layers = batch.input->layers[instance];
}

// Copies the instances of a tile, and bounds them.
void keep_tile(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t tile, PoseScratch& posing,
               const HistoryTick& tick, Span<InstanceBounds> bounds) {
  TileInstances instances = instances_of(batch, tile);
  std::uint32_t live = ~0u;
  if (batch.input->poses.format != PoseFormat::kQuaternionTranslation)
    live = update_tile(frame, {&batch, instances, RefitScope::kNone, posing.boxes.data, posing.bounds.data}, posing);
  std::uint32_t count = 0;
  for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
    if (!(live >> lane & 1)) continue;
    keep_instance(batch, instances.instance[lane], tick);
    instances.instance[count++] = instances.instance[lane];
  }
  if (count == 0) return;
  PastTile past;
  const HistoryMoment moment = {&tick, &tick, 0, nullptr, false};
  for (std::uint32_t lane = 0; lane < count; ++lane) past.add(moment, instances.instance[lane]);
  AabbTile all;
  live = pose_past_tile(frame.kernels, *batch.articulation, past, posing);
  frame.kernels.bound_boxes(posing.boxes.data, batch.articulation->leaf_count, posing.bounds.data);
  frame.kernels.bound_together(posing.bounds.data, batch.articulation->leaf_count, &all);
  for (std::uint32_t lane = 0; lane < count; ++lane) {
    if (!(live >> lane & 1)) continue;
    const std::uint32_t i = instances.instance[lane], leaves = batch.articulation->leaf_count;
    tick.place(i).number = tick.number;
    bounds[i] = world_bounds(batch, i, all, lane);
    write_centers({posing.boxes.data, leaves}, lane, tick.grid(i), tick.center(i));
  }
}

// ------------------------------------------------------------------------------------------------ between two moments

// Whether the leaf boxes of an instance may be out of range between two moments.
bool is_far(const InstanceBounds& bounds, const KeptPlace& place) {
  constexpr double kMost = static_cast<double>(kMaxCoordinate) / 4;
  bool out = false;
  for (std::uint32_t c = 0; c < 3; ++c)
    out = out || bounds.lo[c] - place.origin[c] < -kMost || bounds.hi[c] - place.origin[c] > kMost;
  return out;
}

// The bounds of the instances of a tile between the last moment and the one that is recorded.
void bound_between(const kernel::KernelTable& kernels, const StoredHistory& history, const HistoryTick& from,
                   const HistoryTick& to, std::uint32_t tile) {
  const std::uint32_t begin = tile * kLanes, end = std::min(history.instances, begin + kLanes);
  kernel::BulgeTile bulge;
  bulge.articulation = history.articulation;
  bulge.reach = history.reach.data;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t i = std::min(begin + lane, end - 1);
    const KeptPlace &place_from = from.place(i), &place_to = to.place(i);
    bulge.from[lane] = from.pose(i);
    bulge.to[lane] = to.pose(i);
    bulge.from_orientation[lane] = place_from.orientation;
    bulge.to_orientation[lane] = place_to.orientation;
    bulge.from_scale[lane] = place_from.scale;
    bulge.to_scale[lane] = place_to.scale;
  }
  kernels.bound_bulge(bulge);
  for (std::uint32_t i = begin; i < end; ++i) {
    const InstanceBounds &a = history.bounds[i], &b = history.next[i];
    InstanceBounds& out = history.between[i];
    out = b;
    if (!has_bounds(a) || !has_bounds(b)) continue;
    to.place(i).bulge = is_far(a, from.place(i)) || is_far(b, to.place(i)) ? kInfinity : bulge.bulge[i - begin];
    for (std::uint32_t c = 0; c < 3; ++c) {
      const double origin = std::max(std::fabs(from.place(i).origin[c]), std::fabs(to.place(i).origin[c]));
      const double by = static_cast<double>(bulge.bulge[i - begin]) + kHistoryOriginPad * origin;
      out.lo[c] = std::min(a.lo[c], b.lo[c]) - by;
      out.hi[c] = std::max(a.hi[c], b.hi[c]) + by;
    }
  }
}

// Records a moment in the place after the last one, and then counts it.
void record(Engine& engine, const FrameContext& frame, const InstanceBatch& batch, std::uint32_t slot, double time,
            StoredHistory& history) {
  HistoryTick& tick = history.ring[(history.first + history.count) % history.ring.size];
  tick.number = ++history.recorded;
  tick.time = time;
  tick.has_orientations = !batch.input->orientations.empty();
  tick.has_scales = !batch.input->scales.empty();
  std::fill(history.next.begin(), history.next.end(), kNoBounds);
  const std::uint32_t given = tile_count(active_count(batch)), all = tile_count(history.instances);
  engine.pool.tasks->alone = all <= kTilesAlone;
  engine.pool.tasks->for_each(given, [&](std::uint32_t tile, std::uint32_t w) {
    keep_tile(frame, batch, tile, engine.pool.pose_of(w), tick, history.next);
  });
  if (history.count > 0) {
    const HistoryTick& last = history.last();
    engine.pool.tasks->for_each(
        all, [&](std::uint32_t tile, std::uint32_t) { bound_between(frame.kernels, history, last, tick, tile); });
  }
  tick.index.bounds = history.count > 0 ? history.between : history.next;
  const bool is_like_last = history.count > 0 && tick.number % kTicksAlike != 0;
  if (!is_like_last || !build_index_like(history.last().index, tick.index)) build_index_of_one(slot, tick.index);
  tick.index.bounds = {};
  std::swap(history.bounds, history.next);
  if (history.count + 1 < history.ring.size)
    ++history.count;
  else
    history.first = static_cast<std::uint32_t>((history.first + 1) % history.ring.size);
}

// A history without moments yet. Throws std::bad_alloc.
StoredHistoryPtr make_history(const Allocator& allocator) { return StoredHistoryPtr(new StoredHistory(allocator)); }

}  // namespace

std::uint32_t time_key(const StoredHistory& history, double time) {
  if (history.count == 0) return 0;
  const double first = history.tick(0).time, whole = 0.5 * history.last().time - 0.5 * first;
  const double part = (0.5 * time - 0.5 * first) / whole;                                   // halves: as in moment_of
  return static_cast<std::uint32_t>(std::min(std::max(0.0, part), 1.0) * (kTimeKeys - 1));  // 0 for NaN
}

HistoryMoment moment_of(const StoredHistory& history, double time) {
  const auto at = [&](std::uint32_t i, bool is_clamped) {
    const HistoryTick& tick = history.tick(i);
    return HistoryMoment{&tick, &tick, 0, &tick.index, is_clamped};
  };
  if (time <= history.tick(0).time) return at(0, time < history.tick(0).time);
  if (time >= history.last().time) return at(history.count - 1, time > history.last().time);
  std::uint32_t low = 0, high = history.count - 1;  // the time is above that of low, and below that of high
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (history.tick(middle).time == time) return at(middle, false);
    (history.tick(middle).time < time ? low : high) = middle;
  }
  const HistoryTick &from = history.tick(low), &to = history.tick(high);
  // Halves, since a difference of two times may be beyond the largest double.
  const double gone = 0.5 * time - 0.5 * from.time, whole = 0.5 * to.time - 0.5 * from.time;
  return {&from, &to, whole > 0 ? std::min(gone / whole, 1.0) : 0, &to.index, false};
}

Status add_history(Engine& engine, const HistoryDesc& desc, HistoryId* out) noexcept {
  return guarded([&] {
    const Call call(engine);
    if (!call.admitted()) return Status::kBusy;
    if (!out) return Status::kBadOutput;
    if (!has_batch(engine, desc.batch)) return Status::kUnknownBatch;
    const std::uint32_t slot = slot_of(desc.batch).value - 1;
    const InstanceBatch& batch = engine.batches[slot]->batch;
    if (batch.kind != BatchKind::kCharacters || is_static(batch) || batch.articulation->lod.posed)
      return Status::kBadBatchKind;
    if (desc.ticks == 0 || desc.ticks > kMaxTicks) return Status::kBadTicks;
    StoredHistoryPtr made = make_history(engine.allocator);
    made->batch.value = id_of(slot, engine.batches);
    make_ring(batch, desc.ticks, *made);
    const HistoryMemory* const past = engine.readers[0]->past.get();
    const std::size_t links = std::max<std::size_t>(batch.articulation->link_count, past ? past->links : 0);
    const std::size_t leaves = std::max<std::size_t>(batch.articulation->leaf_count, past ? past->leaves : 0);
    HistoryMemoryPtr memory;
    if (!past || past->links < links || past->leaves < leaves)
      memory = make_history_memory(links, leaves, engine.pool.workers.size(), engine.allocator);
    const std::size_t index = free_slot(engine.allocator, engine.histories);
    if (index == kMaxHistories) {
      engine.histories.pop_back();
      return Status::kTooManyInstances;
    }
    if (memory) {
      memory->asked.reserve(engine.histories.size());
      Reader& reader = *engine.readers[0];
      reader.past = std::move(memory);
      // Its tests have the numbers of earlier ones, by which leaves of the past are kept.
      if (reader.queries)
        for (const auto& own : reader.queries->workers) forget_skinned(own->skins);
      engine.readers.resize(1);
    }
    for (const auto& reader : engine.readers) reader->past->asked.reserve(engine.histories.size());
    fill_slot(std::move(made), engine.histories[index]);
    out->value = id_of(index, engine.histories);
    return Status::kOk;
  });
}

Status remove_history(Engine& engine, HistoryId id) noexcept {
  const Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  if (!has_history(engine, id)) return Status::kUnknownHistory;
  StoredHistory& slot = *engine.histories[static_cast<std::uint32_t>(id.value) - 1];
  slot.batch = {};
  slot.ring = {};
  slot.arena.release();
  return Status::kOk;
}

Status record_tick(Engine& engine, HistoryId id, const BatchInput& input, double time) noexcept try {
  Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  if (!has_history(engine, id)) return Status::kUnknownHistory;
  StoredHistory& history = *engine.histories[static_cast<std::uint32_t>(id.value) - 1];
  if (!has_batch(engine, history.batch) || !has_batch(engine, input.batch) ||
      slot_of(input.batch).value != slot_of(history.batch).value)
    return Status::kUnknownBatch;
  if (!std::isfinite(time) || (history.count > 0 && time <= history.last().time)) return Status::kBadTime;
  if (const Status status = bind_inputs(engine, call, {&input, 1}); status != Status::kOk) return status;
  InstanceBatch& batch = engine.batch(input.batch);
  batch.margins = {};
  if (input.poses.has_scale || has_mirrored(batch)) return Status::kBadHistoryPoses;
  const FrameContext frame = context_of(engine, {}, FrameJob{});
  record(engine, frame, batch, slot_of(input.batch).value - 1, time, history);
  return Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

Status history_span(const Engine& engine, HistoryId id, HistorySpan* out) noexcept {
  if (!has_history(engine, id)) return Status::kUnknownHistory;
  if (!out) return Status::kBadOutput;
  const StoredHistory& history = *engine.histories[static_cast<std::uint32_t>(id.value) - 1];
  *out = {};
  if (history.count > 0) *out = {history.count, history.tick(0).time, history.last().time};
  return Status::kOk;
}

void StoredHistoryDelete::operator()(StoredHistory* history) const { delete history; }

std::size_t history_bytes(const Engine& engine) {
  std::size_t out = 0;
  for (const auto& reader : engine.readers)
    if (reader->past) out += bytes_of(*reader->past);
  for (const auto& slot : engine.histories) out += slot->arena.bytes();
  return out;
}

}  // namespace cab
