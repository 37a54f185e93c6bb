// Rays about the past. Each goes on to the next instance whose bounds it meets. There it looks for leaves that it comes
// near, by the balls that hold them. Only these leaves are posed, sixteen at a time, each with its own ray beside it.
// What a ray is then known to meet ends it there.
#include "engine/queries/past_rays.h"

#include "engine/queries/past.h"
#include "kernels/past_leaves.h"

#include <algorithm>
#include <new>

namespace cab {
namespace {

constexpr std::uint32_t kMostRays = HistoryMemory::kMostRays;

// An instance whose bounds a ray has met.
struct MetPast {
  PastRay* ray;
  kernel::MetBounds at;
  std::uint32_t instance;
  double apart[3];       // its origin less where the ray begins
  double first;          // at which distance `local` begins
  kernel::BoxRay local;  // the ray there
};

// Begins the search of one history. Rays keep what they met in others.
void begin(const QueryRun& run, const StoredHistory& history, PastRay* const* rays, std::uint32_t count) {
  for (std::uint32_t first = 0; first < count; first += kLanes) {
    const std::uint32_t some = std::min(kLanes, count - first);
    std::uint32_t numbers[kLanes];
    const QueryIndex* indexes[kLanes];
    kernel::RaySearch* searches[kLanes];
    double ends[kLanes];
    bool is_met[kLanes];
    for (std::uint32_t i = 0; i < some; ++i) {
      PastRay& ray = *rays[first + i];
      ends[i] = ray.search.end;
      is_met[i] = ray.search.is_met;
      ray.moment = moment_of(history, run.job.queries[ray.query].time);
      ray.clamped += ray.moment.is_clamped;
      numbers[i] = ray.query;
      indexes[i] = ray.moment.index;
      searches[i] = new (&ray.search) kernel::RaySearch;
    }
    begin_searches(run, {numbers, some}, indexes, searches);
    for (std::uint32_t i = 0; i < some; ++i) {
      searches[i]->is_met = is_met[i];
      if (ends[i] < searches[i]->end) kernel::shorten(*searches[i], ends[i]);
    }
  }
}

// Takes a ray to an instance. Returns whether it looks at it, and still wants what it enters there.
bool enter(std::uint32_t slot, MetPast& met) {
  PastRay& ray = *met.ray;
  kernel::RaySearch& search = ray.search;
  const kernel::SearchFilter& filter = search.filter;
  if (search.lanes.skips(met.at.entry) || (search.any && search.is_met)) return false;
  if (filter.ignored_batch == slot && filter.ignored_instance == met.instance) return false;
  if (!ray.moment.has(met.instance)) return false;
  if ((ray.moment.from->place(met.instance).layers & filter.layer_mask) == 0) return false;
  for (std::uint32_t c = 0; c < 3; ++c) met.apart[c] = ray.moment.origin(met.instance, c) - filter.position[c];
  if (!is_in_reach(met.apart)) return false;
  search.way.at = met.at;
  met.local = kernel::at_instance(search, met.apart, 0, &met.first);
  return true;
}

// Leaves of instances of one history that rays have come near, sixteen at a time.
class NearTile {
 public:
  NearTile(const QueryRun& run, const StoredHistory& history)
      : run_(run), articulation_(*history.articulation), slot_(slot_of(history.batch).value - 1) {
    tile_.coding = {PoseFormat::kQuaternionTranslation, Scaling::kNone};
    tile_.pads = is_reach_lod(articulation_) ? kLinkPads : 1;
  }

  // Takes a leaf. Tests those that are there first if there is no room or if they are not posed alike.
  void take(const MetPast& met, std::uint32_t leaf) {
    const HistoryMoment& moment = met.ray->moment;
    const Scaling scaling = moment.has_scales() ? Scaling::kPerInstance : Scaling::kNone;
    const bool is_alike =
        tile_.coding.scaling == scaling && (tile_.orientations[0] != nullptr) == moment.has_orientations();
    if (count_ == kLanes || (count_ > 0 && !is_alike)) test();
    const std::uint32_t lane = count_++;
    lanes_[lane] = {&met, leaf};
    tile_.coding.scaling = scaling;
    tile_.is_between = (lane > 0 && tile_.is_between) || moment.is_between();
    const std::uint32_t at = articulation_.leaf_link[leaf] * kTickFloats;
    const KeptPlace &from = moment.from->place(met.instance), &to = moment.to->place(met.instance);
    tile_.poses[lane] = moment.from->pose(met.instance) + at;
    tile_.later.poses[lane] = moment.to->pose(met.instance) + at;
    tile_.boxes[lane] = articulation_.leaf_box[leaf].center;
    tile_.orientations[lane] = moment.has_orientations() ? from.orientation : nullptr;
    tile_.later.orientations[lane] = moment.has_orientations() ? to.orientation : nullptr;
    tile_.later.part[lane] = static_cast<float>(moment.part);
    tile_.scales[lane] = moment.scale(met.instance);
    for (int c = 0; c < 3; ++c) {
      tile_.at[c][lane] = met.local.at[c];
      tile_.direction[c][lane] = met.local.direction[c];
    }
    tile_.radius[lane] = met.local.radius;
    tile_.rounding[lane] = met.local.rounding;
    tile_.end[lane] = met.local.end;
    tile_.end_below[lane] = float_below(met.ray->search.end - met.first);
  }

  // Tests the leaves, and forgets them.
  void test() {
    if (count_ == 0) return;
    for (std::uint32_t lane = count_; lane < kLanes; ++lane) {
      tile_.poses[lane] = tile_.poses[0];
      tile_.boxes[lane] = tile_.boxes[0];
      tile_.orientations[lane] = tile_.orientations[0];
      tile_.later.poses[lane] = tile_.later.poses[0];
      tile_.later.orientations[lane] = tile_.later.orientations[0];
    }
    run_.frame.kernels.meet_past_leaves(tile_);
    for (std::uint32_t lane = 0; lane < count_; ++lane) {
      if (tile_.live >> lane & 1)
        shorten(lane);
      else
        lanes_[lane].met->ray->is_known = false;
    }
    for (std::uint32_t left = tile_.met & ((1u << count_) - 1); left; left &= left - 1) keep(lowest_bit(left));
    count_ = 0;
  }

 private:
  // Ends the ray of a lane where it has surely met the leaf.
  void shorten(std::uint32_t lane) {
    if (!(tile_.surely[lane] < std::numeric_limits<float>::infinity())) return;
    const MetPast& met = *lanes_[lane].met;
    kernel::RaySearch& search = met.ray->search;
    search.is_met = true;
    const double most = (1 + kOutwards) * (met.first + static_cast<double>(tile_.surely[lane]));
    if (most < search.end) kernel::shorten(search, most);
  }

  // Keeps a leaf that may be the first.
  void keep(std::uint32_t lane) {
    const MetPast& met = *lanes_[lane].met;
    PastRay& ray = *met.ray;
    const float entry = float_below(met.first + static_cast<double>(tile_.entry[lane]));
    const auto is_late = [&ray](float at) { return static_cast<double>(at) > ray.search.end; };
    if (is_late(entry) || (ray.search.any && ray.search.is_met)) return;
    if (ray.met_count == PastRay::kMostMet) {
      PastLeaf* const end = ray.met + ray.met_count;
      const auto is_late_leaf = [&](const PastLeaf& leaf) { return is_late(leaf.entry); };
      ray.met_count = static_cast<std::uint32_t>(std::remove_if(ray.met, end, is_late_leaf) - ray.met);
    }
    if (ray.met_count == PastRay::kMostMet) {
      ray.is_known = false;
      return;
    }
    ray.met[ray.met_count++] = {entry,
                                slot_,
                                met.instance,
                                lanes_[lane].leaf,
                                {met.apart[0], met.apart[1], met.apart[2]},
                                lane_box(tile_.posed, lane)};
  }

  const QueryRun& run_;
  const Articulation& articulation_;
  std::uint32_t slot_, count_ = 0;
  kernel::PastLeaves tile_;
  struct {
    const MetPast* met;
    std::uint32_t leaf;
  } lanes_[kLanes];
};

// Takes each ray on to the next instance that it meets. Rays that meet none are taken out of `rays`. Returns how many
// are left.
std::uint32_t go_on(const QueryRun& run, PastRay** rays, std::uint32_t count, MetPast* to) {
  constexpr std::uint32_t kAhead = 8;  // rays from the prefetch of an instance's number to that of the instance
  const auto prefetch_instance = [](MetPast& met) {
    const HistoryMoment& moment = met.ray->moment;
    const QueryIndex& index = *moment.index;
    met.instance = index.order[index.clusters.data[met.at.node].first + met.at.lane].number;
    for (const HistoryTick* tick : {moment.from, moment.to}) {
      prefetch_line(&tick->place(met.instance));
      prefetch_bytes(tick->center(met.instance), tick->center_words * sizeof(std::uint32_t));
    }
  };
  std::uint32_t left = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    PastRay& ray = *rays[i];
    kernel::RaySearch& search = ray.search;
    const QueryIndex& index = *ray.moment.index;
    MetPast& met = to[left];
    if (search.any && search.is_met) continue;
    if (!run.frame.kernels.walk_ray(index.view(), search.lanes, search.way.walk, &met.at)) continue;
    met.ray = &ray;
    prefetch_line(index.order.data + index.clusters.data[met.at.node].first + met.at.lane);
    rays[left++] = &ray;
    if (left > kAhead) prefetch_instance(to[left - 1 - kAhead]);
  }
  for (std::uint32_t i = left - std::min(left, kAhead); i < left; ++i) prefetch_instance(to[i]);
  return left;
}

// Tests rays at the leaves that they come near of instances that they have met.
void test_leaves(const QueryRun& run, const StoredHistory& history, Span<MetPast> all) {
  constexpr std::uint32_t kMostNear = 128;  // that are prefetched before they are posed
  struct {
    const MetPast* met;
    std::uint32_t leaf;
  } near[kMostNear];
  std::uint32_t count = 0;
  NearTile tile(run, history);
  const auto test_all = [&] {
    for (std::uint32_t i = 0; i < count; ++i) tile.take(*near[i].met, near[i].leaf);
    count = 0;
  };
  const std::uint32_t slot = slot_of(history.batch).value - 1;
  std::uint16_t* const leaves = run.past->near.data;
  for (MetPast& met : all) {
    if (!enter(slot, met)) continue;
    ++run.own.stats.instances;
    const HistoryMoment& moment = met.ray->moment;
    const kernel::NearLeaves args = {met.local,
                                     moment.from->grid(met.instance),
                                     moment.to->grid(met.instance),
                                     moment.from->center(met.instance),
                                     moment.to->center(met.instance),
                                     history.radius.data,
                                     history.articulation->leaf_count,
                                     static_cast<float>(moment.part),
                                     moment.scale(met.instance),
                                     moment.is_between() ? moment.to->place(met.instance).bulge : 0};
    const std::uint32_t found = run.frame.kernels.near_leaves(args, leaves);
    run.own.stats.instances_posed += found > 0;
    for (std::uint32_t i = 0; i < found; ++i) {
      const std::size_t at = history.articulation->leaf_link[leaves[i]] * std::size_t{kTickFloats};
      prefetch_bytes(moment.from->pose(met.instance) + at, kTickFloats * sizeof(float));
      prefetch_bytes(moment.to->pose(met.instance) + at, kTickFloats * sizeof(float));
      near[count++] = {&met, leaves[i]};
      if (count == kMostNear) test_all();
    }
  }
  test_all();
  tile.test();
}

}  // namespace

void search_past(const QueryRun& run, PastRay* const* rays, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) {
    PastRay& ray = *rays[i];
    ray.search.end = std::numeric_limits<double>::infinity();
    ray.search.is_met = false;
    ray.met_count = 0;
    ray.is_known = true;
    ray.clamped = 0;
  }
  for (const StoredHistory* const history : run.asked) {
    if (history->count == 0) continue;
    begin(run, *history, rays, count);
    std::uint32_t going = 0;
    PastRay* left[kMostRays];
    MetPast met[kMostRays];
    for (std::uint32_t i = 0; i < count; ++i)
      if (rays[i]->search.stop != kernel::SearchStop::kEnd) left[going++] = rays[i];
    while (going > 0) {
      going = go_on(run, left, going, met);
      test_leaves(run, *history, {met, going});
    }
    for (std::uint32_t i = 0; i < count; ++i) run.own.stats.nodes += rays[i]->search.way.walk.opened;
  }
  for (std::uint32_t i = 0; i < count; ++i) run.own.stats.clamped += rays[i]->is_known ? rays[i]->clamped : 0;
}

}  // namespace cab
