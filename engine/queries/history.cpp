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
#include "kernels/float_mode.h"
#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>
#include <exception>

namespace cab {
namespace {

constexpr std::size_t kMaxHistories = 4096;
constexpr float kIdentity[4] = {0, 0, 0, 1};

// Up to this many tiles the calling thread works alone.
constexpr std::uint32_t kTilesAlone = 16;

bool has_history(const Engine& engine, HistoryId id) {
  return index_of(id.value, engine, engine.histories) < engine.histories.size();
}

// ------------------------------------------------------------------------------------------------------------- room

QueryIndex make_index(std::size_t instances, StoredHistory& history) {
  Arena& arena = history.arena;
  const std::size_t clusters = tile_count(static_cast<std::uint32_t>(instances));
  const auto nodes = static_cast<std::uint32_t>(most_nodes(clusters));
  QueryIndex out;
  out.clusters = {arena.allocate<QueryCluster>(clusters).data, static_cast<std::uint32_t>(clusters), 0};
  out.nodes = {arena.allocate<AabbTile>(nodes).data, nodes, 0};
  out.used = arena.allocate<std::uint16_t>(nodes);
  out.order = arena.allocate<IndexedPoint>(instances);
  out.cluster_order = history.cluster_order;
  out.unordered = history.unordered;
  return out;
}

// How far the leaf boxes of each link are from its origin.
void measure_reach(const Articulation& articulation, Span<float> reach) {
  const auto length = [](const float(&v)[3]) {
    return std::sqrt(static_cast<double>(v[0]) * static_cast<double>(v[0]) +
                     static_cast<double>(v[1]) * static_cast<double>(v[1]) +
                     static_cast<double>(v[2]) * static_cast<double>(v[2]));
  };
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
    const Box& box = articulation.leaf_box[leaf];
    float& of_link = reach[articulation.leaf_link[leaf]];
    of_link = std::max(of_link, rounded_up(length(box.center) + length(box.half)));
  }
}

void make_ring(const InstanceBatch& batch, std::uint32_t ticks, StoredHistory& out) {
  const std::size_t instances = batch.capacity, links = batch.articulation->link_count;
  const std::size_t clusters = tile_count(batch.capacity);
  Arena& arena = out.arena;
  out.articulation = batch.articulation;
  out.instances = batch.capacity;
  out.reach = arena.allocate<float>(links);
  measure_reach(*batch.articulation, out.reach);
  out.bounds = arena.allocate<InstanceBounds>(instances);
  out.next = arena.allocate<InstanceBounds>(instances);
  out.between = arena.allocate<InstanceBounds>(instances);
  out.cluster_order = arena.allocate<IndexedPoint>(clusters);
  out.unordered = {arena.allocate<QueryCluster>(clusters).data, static_cast<std::uint32_t>(clusters), 0};
  out.ring = arena.allocate<HistoryTick>(std::size_t{ticks} + 1);
  for (HistoryTick& tick : out.ring) {
    tick.poses = arena.allocate<float>(instances, links * kTickFloats);
    tick.orientations = arena.allocate<float>(4 * instances);
    tick.scales = arena.allocate<float>(instances);
    tick.origins = arena.allocate<double>(3 * instances);
    tick.layers = arena.allocate<std::uint32_t>(instances);
    tick.at = make_index(instances, out);
    tick.since = make_index(instances, out);
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
void keep_instance(const InstanceBatch& batch, std::uint32_t instance, HistoryTick& tick) {
  const bool is_quaternion = batch.input->poses.format == PoseFormat::kQuaternionTranslation;
  float* const poses = tick.poses.data + std::size_t{instance} * batch.articulation->link_count * kTickFloats;
  for (const PosedLink& posed : batch.articulation->posed_links) {
    float* const to = poses + posed.link * kTickFloats;
    if (is_quaternion)
      std::copy_n(pose_of(batch, instance, posed.link), kTickFloats, to);
    else
      write_quaternion(pose_alone(batch, instance, posed.link), to);
  }
  if (tick.has_orientations) std::copy_n(orientation_of(batch, instance), 4, tick.orientations.data + 4 * instance);
  if (tick.has_scales) tick.scales[instance] = scale_of(batch, instance);
  if (tick.has_layers) tick.layers[instance] = batch.input->layers[instance];
  for (std::uint32_t c = 0; c < 3; ++c) tick.origins[3 * std::size_t{instance} + c] = origin_of(batch, instance, c);
}

// Copies the instances of a tile, and bounds them.
void keep_tile(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t tile, PoseScratch& posing,
               HistoryTick& tick, Span<InstanceBounds> bounds) {
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
  for (std::uint32_t lane = 0; lane < count; ++lane) past.add(moment, *batch.articulation, instances.instance[lane]);
  AabbTile all;
  live = pose_past_tile(frame.kernels, *batch.articulation, past, posing);
  frame.kernels.bound_boxes(posing.boxes.data, batch.articulation->leaf_count, posing.bounds.data);
  frame.kernels.bound_together(posing.bounds.data, batch.articulation->leaf_count, &all);
  for (std::uint32_t lane = 0; lane < count; ++lane)
    if (live >> lane & 1) bounds[instances.instance[lane]] = world_bounds(batch, instances.instance[lane], all, lane);
}

// ------------------------------------------------------------------------------------------------ between two moments

// How far two rotations are from each other: the cosine and the sine of half the angle.
struct Turn {
  double cosine, sine;

  Turn(const float* from, const float* to) {
    double product = 0, from_sq = 0, to_sq = 0;
    for (int c = 0; c < 4; ++c) {
      const double a = static_cast<double>(from[c]), b = static_cast<double>(to[c]);
      product += a * b;
      from_sq += a * a;
      to_sq += b * b;
    }
    cosine = std::min(std::fabs(product) / std::sqrt(from_sq * to_sq), 1.0);
    sine = std::sqrt(1 - cosine * cosine);
  }
};

double length(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// How far any point of the leaf boxes of an instance can be, between two moments, from the straight line between where
// it is at both (docs/proof.md, step 13.3).
double bulge(const StoredHistory& history, const HistoryTick& from, const HistoryTick& to, std::uint32_t instance) {
  const Articulation& articulation = *history.articulation;
  const std::size_t begin = std::size_t{instance} * articulation.link_count * kTickFloats;
  const double scale_a = static_cast<double>(scale_of(from, instance)),
               scale_b = static_cast<double>(scale_of(to, instance));
  const double scale = std::max(scale_a, scale_b), rescaled = std::fabs(scale_b - scale_a);
  const Turn all(orientation_of(from, instance), orientation_of(to, instance));
  double out = 0;
  for (const PosedLink& posed : articulation.posed_links) {
    if (posed.leaf_begin == posed.leaf_end) continue;
    const float* const a = from.poses.data + begin + posed.link * kTickFloats;
    const float* const b = to.poses.data + begin + posed.link * kTickFloats;
    double at_a[3], at_b[3], way[3];
    for (int c = 0; c < 3; ++c) {
      at_a[c] = static_cast<double>(a[4 + c]);
      at_b[c] = static_cast<double>(b[4 + c]);
      way[c] = at_b[c] - at_a[c];
    }
    const Turn turn(a, b);
    const double reach = static_cast<double>(history.reach[posed.link]);
    const double most = std::max(length(at_a), length(at_b)) + reach;
    const double moved = length(way) + 2 * turn.sine * reach;
    const double in_instance = scale * (1 - turn.cosine) * reach + rescaled * moved / 4;
    const double by_orientation = (1 - all.cosine) * scale * most + all.sine * (scale * moved + rescaled * most) / 2;
    out = std::max(out, (in_instance + by_orientation) + kHistoryPad * scale * (most + reach));
  }
  return out;
}

// The bounds of the instances of a tile between the last moment and the one that is recorded.
void bound_between(const StoredHistory& history, const HistoryTick& from, const HistoryTick& to, std::uint32_t tile) {
  const std::uint32_t end = std::min(history.instances, (tile + 1) * kLanes);
  for (std::uint32_t i = tile * kLanes; i < end; ++i) {
    const InstanceBounds &a = history.bounds[i], &b = history.next[i];
    InstanceBounds& out = history.between[i];
    out = kNoBounds;
    if (!has_bounds(a) || !has_bounds(b)) continue;
    const double grow = bulge(history, from, to, i);
    for (std::uint32_t c = 0; c < 3; ++c) {
      const double origin =
          std::max(std::fabs(from.origins[3 * std::size_t{i} + c]), std::fabs(to.origins[3 * std::size_t{i} + c]));
      const double by = grow + kHistoryOriginPad * origin;
      out.lo[c] = std::min(a.lo[c], b.lo[c]) - by;
      out.hi[c] = std::max(a.hi[c], b.hi[c]) + by;
    }
  }
}

// Records a moment in the place after the last one, and then counts it.
void record(Engine& engine, const FrameContext& frame, const InstanceBatch& batch, std::uint32_t slot, double time,
            StoredHistory& history) {
  HistoryTick& tick = history.ring[(history.first + history.count) % history.ring.size];
  tick.time = time;
  tick.has_orientations = !batch.input->orientations.empty();
  tick.has_scales = !batch.input->scales.empty();
  tick.has_layers = !batch.input->layers.empty();
  std::fill(history.next.begin(), history.next.end(), kNoBounds);
  const std::uint32_t given = tile_count(active_count(batch)), all = tile_count(history.instances);
  engine.pool.tasks->alone = all <= kTilesAlone;
  engine.pool.tasks->for_each(given, [&](std::uint32_t tile, std::uint32_t w) {
    keep_tile(frame, batch, tile, engine.pool.pose_of(w), tick, history.next);
  });
  tick.at.bounds = history.next;
  build_index_of_one(slot, tick.at);
  tick.at.bounds = {};
  if (history.count > 0) {
    const HistoryTick& last = history.last();
    engine.pool.tasks->for_each(all,
                                [&](std::uint32_t tile, std::uint32_t) { bound_between(history, last, tick, tile); });
    tick.since.bounds = history.between;
    build_index_of_one(slot, tick.since);
    tick.since.bounds = {};
  }
  std::swap(history.bounds, history.next);
  if (history.count + 1 < history.ring.size)
    ++history.count;
  else
    history.first = static_cast<std::uint32_t>((history.first + 1) % history.ring.size);
}

// A history without moments yet. Throws std::bad_alloc.
StoredHistoryPtr make_history(const Allocator& allocator) { return StoredHistoryPtr(new StoredHistory(allocator)); }

}  // namespace

const float* orientation_of(const HistoryTick& tick, std::uint32_t instance) {
  return tick.has_orientations ? tick.orientations.data + 4 * std::size_t{instance} : kIdentity;
}

HistoryMoment moment_of(const StoredHistory& history, double time) {
  const auto at = [&](std::uint32_t i, bool is_clamped) {
    const HistoryTick& tick = history.tick(i);
    return HistoryMoment{&tick, &tick, 0, &tick.at, is_clamped};
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
  return {&from, &to, whole > 0 ? std::min(gone / whole, 1.0) : 0, &to.since, false};
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
    made->batch.value = id_of(slot, engine, engine.batches);
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
      engine.readers[0]->past = std::move(memory);
      engine.readers.resize(1);
    }
    for (const auto& reader : engine.readers) reader->past->asked.reserve(engine.histories.size());
    fill_slot(std::move(made), engine.histories[index]);
    out->value = id_of(index, engine, engine.histories);
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
  ++slot.generation;
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
  const FrameContext frame = context_of(engine, {}, 0, Report::kHits);
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
