#include "engine/queries/past.h"

#include "engine/step/update.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <optional>

namespace cab {
namespace {

constexpr std::size_t kPrefetchedBytes = 1024;  // of the poses of a candidate

// Candidates of the same number are posed together: those of one history that have orientations alike, and scales.
std::uint32_t group_of(const PastCandidate& one) {
  return 4 * one.history + 2 * one.moment.has_orientations() + one.moment.has_scales();
}

std::uint32_t slot_index(const StoredHistory& history) { return slot_of(history.batch).value - 1; }

bool looks_at(const Query& query, const HistoryMoment& moment, std::uint32_t slot, std::uint32_t instance) {
  return moment.has(instance) && !is_ignored(query, slot, instance) &&
         (query.layer_mask & moment.from->place(instance).layers) != 0;
}

// Calls take(candidate) for the instances of a history whose bounds the probe meets, until it returns false. Returns
// whether it never did.
template <class Probe, class Take>
bool walk_history(const QueryRun& run, std::uint32_t number, std::uint32_t history, const HistoryMoment& moment,
                  Probe& probe, Take&& take) {
  const StoredHistory& from = *run.asked[history];
  const Query& query = run.job.queries[number];
  kernel::IndexWalk walk;
  kernel::MetBounds met;
  bool goes_on = true;
  while (goes_on && !probe.is_done() && probe.next(walk, &met)) {
    const QueryCluster& cluster = moment.index->clusters.data[met.node];
    const std::uint32_t instance = moment.index->order[cluster.first + met.lane].number;
    if (!looks_at(query, moment, cluster.batch, instance)) continue;
    const std::size_t bytes = from.articulation->link_count * kTickFloats * sizeof(float);
    for (const HistoryTick* tick : {moment.from, moment.to})
      prefetch_bytes(tick->pose(instance), std::min(bytes, kPrefetchedBytes));
    goes_on = take(PastCandidate{number, history, instance, met.entry, moment, nullptr, 0, false});
  }
  run.own.stats.nodes += walk.opened;
  return goes_on;
}

// Calls visit(history, moment) for the histories that have moments.
template <class Visit>
void for_each_history(const QueryRun& run, double time, Visit&& visit) {
  for (std::uint32_t h = 0; h < run.asked.size; ++h)
    if (run.asked[h]->count > 0) visit(h, moment_of(*run.asked[h], time));
}

// Poses the candidates of the given places in the order, which are of one group.
void pose_group(const QueryRun& run, Span<const std::uint32_t> order) {
  PastWorker& own = *run.past;
  const StoredHistory& history = *run.asked[own.candidates.data[order[0]].history];
  const Articulation& articulation = *history.articulation;
  const std::uint32_t leaves = articulation.leaf_count;
  const std::uint32_t tiles = tile_count(leaves);
  PastTile tile;
  for (const std::uint32_t i : order) tile.add(own.candidates.data[i].moment, own.candidates.data[i].instance);
  const std::uint32_t live = pose_past_tile(run.frame.kernels, articulation, tile, run.pose);
  float reach[kLanes];
  take_posed(run.frame.kernels, run.pose, leaves, tile.count, {own.boxes.end(), reach});
  for (std::uint32_t lane = 0; lane < tile.count; ++lane) {
    PastCandidate& one = own.candidates.data[order[lane]];
    one.boxes = own.boxes.end() + std::size_t{lane} * tiles;
    one.reach = reach[lane];
    one.is_live = live >> lane & 1;
  }
  own.boxes.size += tile.count * tiles;
  run.own.stats.instances_posed += tile.count;
}

// Tests are told apart by numbers below this. Each and this, as the index of a batch, is one that no batch has, and
// leaves SkinCache::Key::batch a number above it.
constexpr std::uint32_t kMostTests = (1u << 31) - 1;

// Forgets the poses of the instance that was tested before.
void begin_test(const QueryRun& run) {
  PastWorker& own = *run.past;
  if (++own.test < kMostTests) return;
  std::fill(own.posed_for.begin(), own.posed_for.end(), 0u);
  forget_skinned(run.own.skins);
  own.test = 1;
}

// An instance as it was, for the leaves of its skin.
struct PastSkin {
  BatchInput input;
  InstanceBatch batch;

  // poses: of its links, kTickFloats each. place: with its orientation and scale, which are read while this is used.
  PastSkin(const StoredHistory& history, const HistoryMoment& moment, const float* poses, const PastPlace& place) {
    input.poses.format = PoseFormat::kQuaternionTranslation;
    input.poses.data = poses;
    if (place.orientation) input.orientations = {place.orientation, 4};
    if (moment.has_scales()) input.scales = {&place.scale, 1};
    batch.articulation = history.articulation;
    batch.input = &input;
    batch.link_stride = kTickFloats * sizeof(float);
  }
  PastSkin(const PastSkin&) = delete;
  PastSkin& operator=(const PastSkin&) = delete;
};

// Calls visit(posed) with a candidate as it was.
template <class Visit>
void visit_past(const QueryRun& run, const Query& query, const PastCandidate& one, Visit&& visit) {
  PastWorker& own = *run.past;
  const StoredHistory& history = *run.asked[one.history];
  const HistoryMoment& moment = one.moment;
  float orientation[4];
  std::optional<PastSkin> skin;  // made where it is asked for
  PastPlace place = {one, {PoseFormat::kQuaternionTranslation, Scaling::kNone}, nullptr, 1, own, nullptr};
  if (run.job.exact != Exact::kNone) {
    const auto part = static_cast<float>(moment.part);
    if (moment.has_orientations()) {
      kernel::RawPoses from, to;
      for (std::uint32_t c = 0; c < 4; ++c) {
        from.raw[c][0] = moment.from->place(one.instance).orientation[c];
        to.raw[c][0] = moment.to->place(one.instance).orientation[c];
      }
      kernel::blend_lanes<float>(to, &part, 4, 0, from);
      for (std::uint32_t c = 0; c < 4; ++c) orientation[c] = from.raw[c][0];
      place.orientation = orientation;
    }
    if (moment.has_scales()) {
      place.coding.scaling = Scaling::kPerInstance;
      place.scale = moment.scale(one.instance);
    }
    begin_test(run);
  }
  if (run.job.exact == Exact::kSurface && has_skin(*history.articulation)) {
    skin.emplace(history, moment, moment.is_between() ? own.poses.data : moment.from->pose(one.instance), place);
    place.skin = &skin->batch;
  }
  PosedInstance posed = {&run.frame.batch(slot_index(history)),
                         slot_index(history),
                         one.instance,
                         history.articulation->leaf_count,
                         one.boxes,
                         one.reach,
                         {},
                         &place};
  for (std::uint32_t c = 0; c < 3; ++c) posed.apart[c] = moment.origin(one.instance, c) - query.position[c];
  if (is_in_reach(posed.apart)) visit(posed);
}

// Tests one candidate.
template <class Probe>
void test_candidate(const QueryRun& run, const Query& query, const PastCandidate& one, Probe& probe) {
  if (!one.is_live || probe.skips(one.entry)) return;
  visit_past(run, query, one, [&](const PosedInstance& posed) {
    ++run.own.stats.instances;
    probe.test(posed);
  });
}

// The pose of a link of an instance that is tested.
const float* pose_of(const PastPlace& place, std::uint32_t link) {
  const HistoryMoment& moment = place.of.moment;
  const std::size_t at = std::size_t{link} * kTickFloats;
  const float* const from = moment.from->pose(place.of.instance) + at;
  if (!moment.is_between()) return from;
  float* const out = place.own.poses.data + at;
  if (place.own.posed_for[link] == place.own.test) return out;
  place.own.posed_for[link] = place.own.test;
  const float* const to = moment.to->pose(place.of.instance) + at;
  const auto part = static_cast<float>(moment.part);
  kernel::RawPoses raw, later;
  for (std::uint32_t f = 0; f < kTickFloats; ++f) raw.raw[f][0] = from[f], later.raw[f][0] = to[f];
  kernel::blend_lanes<float>(later, &part, kTickFloats, 0, raw);
  for (std::uint32_t f = 0; f < kTickFloats; ++f) out[f] = raw.raw[f][0];
  return out;
}

}  // namespace

void clear_candidates(PastWorker& own) {
  own.candidates.clear();
  own.boxes.clear();
}

LeafShapes shapes_of(const QueryRun& run, const PosedInstance& one, std::uint32_t leaf) {
  if (!one.past) return shapes_of(exact_leaf(run.frame, one.slot, one.instance, leaf));
  const PastPlace& place = *one.past;
  const Articulation& articulation = *one.batch->articulation;
  const ConvexShapes& shapes = *run.frame.batches[one.slot]->convex_shapes;
  const std::uint32_t begin = shapes.leaf_begin[leaf], end = shapes.leaf_begin[leaf + 1];
  const StoredPose at = {place.coding, pose_of(place, articulation.leaf_link[leaf]), place.orientation, place.scale};
  const float scale = at.coding.scaling == Scaling::kNone ? 1.0f : static_cast<float>(pose_in_double(at).scale);
  return {{shapes.shapes.data + begin, end - begin}, at, scale};
}

ExactLeaf surface_leaf(const QueryRun& run, const PosedInstance& one, std::uint32_t leaf) {
  if (!one.past || !one.past->skin) return exact_leaf(run.frame, one.slot, one.instance, leaf);
  const PastPlace& place = *one.past;
  const SurfaceLeaves& surface = one.batch->articulation->surface;
  const SurfaceLeaf& of = surface.leaves[leaf];
  for (std::uint32_t i = 0; i < of.bone_count; ++i) pose_of(place, surface.bones[of.bone_begin + i].link);
  // What is skinned is kept by a number that no batch and no other test has.
  return {nullptr, nullptr, place.skin, kMostTests + place.own.test, 0, leaf, leaf};
}

SurfacePoint past_surface_point(const QueryRun& run, const QueryHit& hit) {
  const Query& query = run.job.queries[hit.query];
  SurfacePoint out;
  for (std::uint32_t h = 0; h < run.asked.size; ++h) {
    const StoredHistory& history = *run.asked[h];
    if (slot_index(history) != hit.batch.value - 1) continue;
    const PastCandidate one = {hit.query, h, hit.instance, 0, moment_of(history, query.time), nullptr, 0, true};
    HitBuffer none({}, 0);
    LinkHits hits(run, query, hit.query, none);
    visit_past(run, query, one,
               [&](const PosedInstance& posed) { out = RayQuery(run, query, hits).surface_point(posed, hit.leaf); });
  }
  return out;
}

void PastTile::add(const HistoryMoment& moment, std::uint32_t instance) {
  const std::uint32_t lane = count++;
  is_between = is_between || moment.is_between();
  pose.coding.scaling = moment.has_scales() ? Scaling::kPerInstance : Scaling::kNone;
  pose.poses[lane] = moment.from->pose(instance);
  later.poses[lane] = moment.to->pose(instance);
  pose.orientations[lane] = moment.has_orientations() ? moment.from->place(instance).orientation : nullptr;
  later.orientations[lane] = moment.has_orientations() ? moment.to->place(instance).orientation : nullptr;
  pose.scales[lane] = moment.scale(instance);
  later.part[lane] = static_cast<float>(moment.part);
}

std::uint32_t pose_past_tile(const kernel::KernelTable& kernels, const Articulation& articulation, PastTile& tile,
                             PoseScratch& posing) {
  kernel::PoseTile& pose = tile.pose;
  std::uint8_t flags[kLanes];
  pose.articulation = &articulation;
  pose.coding.format = PoseFormat::kQuaternionTranslation;
  pose.link_stride = kTickFloats;
  for (std::uint32_t lane = tile.count; lane < kLanes; ++lane) {
    pose.poses[lane] = pose.poses[lane - 1];
    pose.orientations[lane] = pose.orientations[lane - 1];
    pose.scales[lane] = pose.scales[lane - 1];
    tile.later.poses[lane] = tile.later.poses[lane - 1];
    tile.later.orientations[lane] = tile.later.orientations[lane - 1];
    tile.later.part[lane] = tile.later.part[lane - 1];
  }
  pose.later = tile.is_between ? &tile.later : nullptr;
  pose.leaves = posing.boxes.data;
  pose.joints = posing.joints.data;
  pose.motions = nullptr;
  pose.skin = posing.skin.data;
  pose.skin_rows = posing.skin_rows.data;
  pose.grown = posing.grown.data;
  pose.count = tile.count;
  pose.flags = flags;
  std::fill_n(pose.margins, kLanes, 0.0f);
  if (is_reach_lod(articulation)) pose.pads = kLinkPads;
  kernels.pose_leaves(pose);
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < tile.count; ++lane) out |= std::uint32_t{flags[lane] == kInstanceOk} << lane;
  return out;
}

void pose_candidates(const QueryRun& run) {
  PastWorker& own = *run.past;
  const auto less = [&own](std::uint32_t x, std::uint32_t y) {
    const std::uint32_t of_x = group_of(own.candidates.data[x]), of_y = group_of(own.candidates.data[y]);
    return of_x != of_y ? of_x < of_y : x < y;
  };
  const std::uint32_t count = own.candidates.size;
  std::uint32_t* const order = own.order.data;
  for (std::uint32_t i = 0; i < count; ++i) order[i] = i;
  if (!std::is_sorted(order, order + count, less)) std::sort(order, order + count, less);
  for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
    const std::uint32_t group = group_of(own.candidates.data[order[begin]]);
    while (end < count && end - begin < kLanes && group_of(own.candidates.data[order[end]]) == group) ++end;
    pose_group(run, {order + begin, end - begin});
  }
}

bool collect_candidates(const QueryRun& run, std::uint32_t number) {
  const Query& query = run.job.queries[number];
  FixedList<PastCandidate>& candidates = run.past->candidates;
  const std::uint32_t size = candidates.size;
  const QueryStats counted = run.own.stats;
  HitBuffer buffer({}, 0);
  bool has_room = true;
  for_each_history(run, query.time, [&](std::uint32_t h, const HistoryMoment& moment) {
    if (!has_room) return;
    run.own.stats.clamped += moment.is_clamped;
    const QueryRun in = run.in(*moment.index);
    LinkHits none(in, query, number, buffer);
    with_probe(in, query, none, [&](auto& probe) {
      has_room = walk_history(in, number, h, moment, probe, [&](const PastCandidate& one) {
        if (candidates.size == candidates.capacity) return false;
        candidates.push(one);
        return true;
      });
    });
  });
  if (has_room) return true;
  candidates.size = size;
  run.own.stats = counted;
  return false;
}

std::uint32_t test_candidates(const QueryRun& run, std::uint32_t number, std::uint32_t begin, LinkHits& hits) {
  const Query& query = run.job.queries[number];
  const FixedList<PastCandidate>& candidates = run.past->candidates;
  while (begin < candidates.size && candidates.data[begin].query == number) {
    const PastCandidate& first = candidates.data[begin];
    std::uint32_t end = begin;
    while (end < candidates.size && candidates.data[end].query == number &&
           candidates.data[end].history == first.history)
      ++end;
    const QueryRun in = run.in(*first.moment.index);
    with_probe(in, query, hits, [&](auto& probe) {
      for (std::uint32_t i = begin; i < end && !probe.is_done(); ++i)
        test_candidate(in, query, candidates.data[i], probe);
    });
    begin = end;
  }
  return begin;
}

void answer_alone(const QueryRun& run, std::uint32_t number, LinkHits& hits) {
  const Query& query = run.job.queries[number];
  FixedList<PastCandidate>& candidates = run.past->candidates;
  clear_candidates(*run.past);
  for_each_history(run, query.time, [&](std::uint32_t h, const HistoryMoment& moment) {
    run.own.stats.clamped += moment.is_clamped;
    const QueryRun in = run.in(*moment.index);
    with_probe(in, query, hits, [&](auto& probe) {
      const auto test_all = [&] {
        pose_candidates(in);
        for (const PastCandidate& one : candidates)
          if (!probe.is_done()) test_candidate(in, query, one, probe);
        clear_candidates(*run.past);
      };
      walk_history(in, number, h, moment, probe, [&](const PastCandidate& one) {
        if (candidates.size == candidates.capacity) test_all();
        candidates.push(one);
        return true;
      });
      test_all();
    });
  });
}

}  // namespace cab
