// How far instances move between two frames: the margins by which a frame finds what touches in between.
#include "engine/session/call.h"
#include "engine/session/validate.h"
#include "engine/step/pose_scratch.h"
#include "engine/step/update.h"
#include "kernels/float_mode.h"
#include "kernels/pose_leaves.h"

#include <algorithm>
#include <cmath>
#include <exception>

namespace cab {
namespace {

// Up to this many tiles the calling thread works alone.
constexpr std::uint32_t kTilesAlone = 64;

// A number, or a vector, of each lane.
using Lane1 = double[kLanes];
using Lane3 = double[3][kLanes];

void lengths_of(const Lane3& v, Lane1& out) {
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    out[lane] = std::sqrt(v[0][lane] * v[0][lane] + v[1][lane] * v[1][lane] + v[2][lane] * v[2][lane]);
}

double length_of(const float (&v)[3]) {
  double sum = 0;
  for (const float component : v) sum += static_cast<double>(component) * static_cast<double>(component);
  return std::sqrt(sum);
}

// Adds `by` times the length of a vector of the link's frame as turned by one motion less by the other.
void add_turned(const MotionTile& from, const MotionTile& to, const float (&v)[3], double by, Lane1& sum) {
  Lane3 difference = {};
  for (std::uint32_t k = 0; k < 3; ++k)
    for (std::uint32_t c = 0; c < 3; ++c)
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        difference[c][lane] += static_cast<double>(v[k]) * (static_cast<double>(to.column[k][c][lane]) -
                                                            static_cast<double>(from.column[k][c][lane]));
  Lane1 lengths;
  lengths_of(difference, lengths);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) sum[lane] += by * lengths[lane];
}

// The bound of one link's leaves: how far any of their points may be, between two frames, from where it is in the
// second (docs/proof.md, step 2.10). shift: the second origin less the first.
void raise_by_link(const Articulation& articulation, const PosedLink& link, const MotionTile& from,
                   const MotionTile& to, const Lane3& shift, Lane1& most) {
  Lane3 moved, places;
  for (std::uint32_t c = 0; c < 3; ++c)
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const double a = static_cast<double>(from.translation[c][lane]), b = static_cast<double>(to.translation[c][lane]);
      moved[c][lane] = (b - a) + shift[c][lane];
      places[c][lane] = std::fabs(a) + std::fabs(b);
    }
  Lane1 translated, place;
  lengths_of(moved, translated);
  lengths_of(places, place);
  for (std::uint32_t i = link.leaf_begin; i < link.leaf_end; ++i) {
    const Box& box = articulation.leaf_box[articulation.leaf_order[i]];
    const double reach = length_of(box.center) + length_of(box.half);
    Lane1 turned = {};
    add_turned(from, to, box.center, 1, turned);
    for (std::uint32_t k = 0; k < 3; ++k) add_turned(from, to, box.axis[k], static_cast<double>(box.half[k]), turned);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const double a = static_cast<double>(from.scale[lane]), b = static_cast<double>(to.scale[lane]);
      const double way = translated[lane] + std::fabs(b - a) * reach + b * turned[lane];
      const double rounding = kSweepPad * (way + place[lane] + (a + b) * reach);
      most[lane] = std::max(most[lane], way + rounding);
    }
  }
}

// One batch in two frames.
struct Sweep {
  const kernel::KernelTable& kernels;
  const InstanceBatch& last;
  const InstanceBatch& now;
  Span<float> margins;

  // The motions of all links in one frame. Returns the bits of the lanes whose poses are valid.
  std::uint32_t pose(const InstanceBatch& batch, const TileInstances& instances, PoseScratch& posing,
                     MotionTile* motions) const {
    std::uint8_t flags[kLanes];
    kernel::PoseTile tile = instances_to_pose(batch, instances);
    std::fill_n(tile.margins, kLanes, 0.0f);
    tile.leaves = posing.boxes.data;
    tile.joints = posing.joints.data;
    tile.motions = motions;
    tile.flags = flags;
    kernels.pose_leaves(tile);
    std::uint32_t out = 0;
    for (std::uint32_t lane = 0; lane < instances.count; ++lane)
      out |= std::uint32_t{flags[lane] == kInstanceOk} << lane;
    return out;
  }

  // Writes the margins of up to sixteen instances that both frames have.
  void measure(const TileInstances& instances, PoseScratch& posing) const {
    const std::uint32_t valid =
        pose(last, instances, posing, posing.last_motions.data) & pose(now, instances, posing, posing.motions.data);
    Lane3 shift = {};
    for (std::uint32_t lane = 0; lane < instances.count; ++lane)
      for (std::uint32_t c = 0; c < 3; ++c)
        shift[c][lane] = origin_of(now, instances.instance[lane], c) - origin_of(last, instances.instance[lane], c);
    Lane1 most = {};
    const Articulation& articulation = posed_articulation(*now.articulation);
    for (const PosedLink& link : articulation.posed_links)
      raise_by_link(articulation, link, posing.last_motions[link.link], posing.motions[link.link], shift, most);
    for (std::uint32_t lane = 0; lane < instances.count; ++lane)
      margins[instances.instance[lane]] = valid >> lane & 1 ? std::min(rounded_up(most[lane]), kMaxCoordinate) : 0.0f;
  }

  // The same for a tile of the second frame, of which some may be missing in the first.
  void measure_tile(std::uint32_t tile, PoseScratch& posing) const {
    const TileInstances given = instances_of(now, tile);
    TileInstances both;
    both.count = 0;
    for (std::uint32_t lane = 0; lane < given.count; ++lane) {
      margins[given.instance[lane]] = 0;
      if (is_active(last, given.instance[lane])) both.instance[both.count++] = given.instance[lane];
    }
    if (both.count > 0) measure(both, posing);
  }
};

}  // namespace

Status sweep_margins(Engine& engine, const BatchInput& last, const BatchInput& input, Span<float> margins) noexcept
    try {
  Call call(engine, Access::kReads);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  if (const Status status = bind_inputs(engine, call, {&last, 1}); status != Status::kOk) return status;
  InstanceBatch& batch = call.batch(last.batch);
  const InstanceBatch before = batch;
  call.unbind();
  if (const Status status = bind_inputs(engine, call, {&input, 1}); status != Status::kOk) return status;
  if (&call.batch(input.batch) != &batch || batch.kind != BatchKind::kCharacters || is_static(batch))
    return Status::kBadBatchKind;
  if (has_skin(posed_articulation(*batch.articulation))) return Status::kSkinNotTaken;
  if (margins.size < batch.instance_count || (margins.size && !margins.data)) return Status::kBadOutput;
  const Sweep sweep = {*engine.kernels, before, batch, margins};
  const std::uint32_t tiles = tile_count(active_count(batch));
  WorkerPool& pool = *call.reader().pool;
  pool.tasks->alone = tiles <= kTilesAlone;
  pool.tasks->for_each(
      tiles, [&](std::uint32_t tile, std::uint32_t worker) { sweep.measure_tile(tile, pool.pose_of(worker)); });
  return Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace cab
