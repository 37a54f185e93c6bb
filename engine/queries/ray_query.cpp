// Rays, and spheres that are moved along them. The parameter of a ray is its length from the start.
#include "engine/queries/ray_query.h"

#include "engine/exact/convex.h"
#include "engine/exact/convex_queues.h"
#include "engine/queries/surface_rays.h"
#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double sum_of(const Double3& v) { return kernel::sum(kernel::abs(v)); }

}  // namespace

RayQuery::RayQuery(const QueryRun& run, const Query& query, LinkHits& hits)
    : run_(run), query_(query), hits_(hits), length_(static_cast<double>(query.length)) {}

// Leaves out what is farther than the links that were found.
void RayQuery::shorten() {
  const double most = static_cast<double>(hits_.most());
  if (most == kInfinity) return;
  const double end = (1 + kOutwards) * (run_.index.scale * most) - entered_;
  lanes_.end = std::min(lanes_.end, float_above(end + kQueryPad * (1 + std::fabs(end))));
}

bool RayQuery::enter() {
  const QueryIndex& index = run_.index;
  kernel::EnteringRay<double> ray;
  ray.from = {query_.position[0], query_.position[1], query_.position[2]};
  ray.direction = double3(query_.direction);
  ray.length = length_;
  ray.radius = static_cast<double>(query_.radius);
  aim(ray);
  enter_index({index.center[0], index.center[1], index.center[2]}, index.scale, ray);
  direction_ = ray.along;
  if (ray.misses) return false;
  entered_ = ray.entered;
  const double start[3] = {ray.start.x, ray.start.y, ray.start.z};
  const double inverse[3] = {ray.inverse.x, ray.inverse.y, ray.inverse.z};
  for (int c = 0; c < 3; ++c) {
    lanes_.above[c] = static_cast<float>(start[c] + ray.pad);
    lanes_.below[c] = static_cast<float>(start[c] - ray.pad);
    lanes_.inverse[c] = static_cast<float>(inverse[c]);
  }
  lanes_.begin = 0;
  lanes_.end = float_above(ray.end);
  shorten();
  return true;
}

// Casts the ray against the triangles of a leaf, or against its box and then its shapes, and writes the first touch.
bool RayQuery::cast(const PosedInstance& one, const LocalRay& ray, std::uint32_t leaf, const BoxAos& box,
                    RayTouch* out) const {
  if (run_.job.exact == Exact::kSurface) {
    const ExactLeaf exact = surface_leaf(run_, one, leaf);
    if (has_triangles(exact)) {
      ++run_.own.stats.exact_tests;
      SurfaceTouch first;
      if (!cast_surface(run_, exact, ray, &first)) return false;
      *out = first.touch;
      return true;
    }
  }
  RayTouch at_box;
  if (!cast_ray(ray, box, &at_box)) return false;
  *out = at_box;
  if (run_.job.exact == Exact::kNone) return true;
  ++run_.own.stats.exact_tests;
  const LeafShapes shapes = shapes_of(run_, one, leaf);
  LocalRay in_box = ray;  // half spaces begin where the box does
  in_box.begin = at_box.at;
  bool touches = false;
  for (const ConvexShape& shape : shapes.shapes) {
    RayTouch touch;
    const bool is_half_space = shape.kind == ConvexKind::kHalfSpace;
    if (!cast_ray(is_half_space ? in_box : ray, shape, shapes.at, &touch)) continue;
    if (is_half_space && touch.inside) touch = at_box;
    if (!touches || touch.at < out->at) *out = touch;
    touches = true;
  }
  return touches;
}

RayQuery::Local RayQuery::at_instance(const PosedInstance& one) const {
  Local out;
  out.to = {one.apart[0], one.apart[1], one.apart[2]};
  out.nearest = std::min(std::max(kernel::dot(out.to, direction_), 0.0), length_);
  out.ray.at = out.nearest * direction_ - out.to;
  out.ray.direction = direction_;
  out.ray.begin = -out.nearest;
  out.ray.radius = static_cast<double>(query_.radius);
  out.ray.error = kQueryRounding * (sum_of(out.to) + out.nearest);
  set_end(out);
  return out;
}

// Ends the ray where nothing that comes then is wanted.
void RayQuery::set_end(Local& local) const {
  const double most = (1 + kOutwards) * static_cast<double>(hits_.most());
  local.ray.end = std::min(length_, most) - local.nearest;
}

void RayQuery::test_leaf(const PosedInstance& one, Local& local, std::uint32_t leaf, const BoxAos& box) {
  RayTouch touch;
  if (!cast(one, local.ray, leaf, box, &touch)) return;
  const Double3 point = touch.inside ? Double3{0, 0, 0} : touch.point + local.to;
  hits_.add(one, leaf, static_cast<float>(std::max(local.nearest + touch.at, 0.0)), floats(point), floats(touch.normal),
            touch.inside);
  set_end(local);
}

void RayQuery::test(const PosedInstance& one) {
  Local local = at_instance(one);
  const LocalRay& ray = local.ray;
  const double size = sum_of(ray.at) + static_cast<double>(one.reach);
  kernel::BoxRay lanes = {
      {static_cast<float>(ray.at.x), static_cast<float>(ray.at.y), static_cast<float>(ray.at.z)},
      {static_cast<float>(direction_.x), static_cast<float>(direction_.y), static_cast<float>(direction_.z)},
      float_above(ray.radius),
      float_above(ray.error + kQueryBoxPad * (size + ray.radius)) + 4 * std::numeric_limits<float>::min(),
      float_below(ray.begin),
      float_above(ray.end)};
  for_each_leaf(
      run_, one, [&](const BoxTile& boxes, float* entry) { return run_.frame.kernels.ray_boxes(boxes, lanes, entry); },
      [&](float entry) { return entry > lanes.end; },
      [&](std::uint32_t leaf) {
        test_leaf(one, local, leaf, one.box(leaf));
        lanes.end = float_above(ray.end);
      },
      [&] { return hits_.is_done(); });
  hits_.finish();
  shorten();
}

void RayQuery::finish(kernel::RaySearch& search) {
  direction_ = {search.along[0], search.along[1], search.along[2]};
  finish_search(run_, run_.frame.kernels.search_rays, query_, search, hits_,
                [this](const PosedInstance& one, std::uint32_t leaf) {
                  Local local = at_instance(one);
                  test_leaf(one, local, leaf, one.box(leaf));
                });
}

void RayQuery::finish(PastRay& ray) {
  kernel::RaySearch& search = ray.search;
  direction_ = {search.along[0], search.along[1], search.along[2]};
  if (search.any && search.is_met) hits_.set_found();
  std::sort(ray.met, ray.met + ray.met_count, [](const PastLeaf& x, const PastLeaf& y) {
    return std::make_tuple(x.entry, x.slot, x.instance, x.leaf) < std::make_tuple(y.entry, y.slot, y.instance, y.leaf);
  });
  for (const PastLeaf* leaf = ray.met; leaf != ray.met + ray.met_count && !hits_.is_done(); ++leaf) {
    if (static_cast<double>(leaf->entry) > search.end) break;
    ++run_.own.stats.leaf_tests;
    const InstanceBatch& batch = run_.frame.batch(leaf->slot);
    const PosedInstance one = {
        &batch, leaf->slot, leaf->instance, 0, nullptr, 0, {leaf->apart[0], leaf->apart[1], leaf->apart[2]}};
    Local local = at_instance(one);
    test_leaf(one, local, leaf->leaf, leaf->box);
    if (hits_.is_found()) kernel::shorten(search, static_cast<double>(hits_.most()));
  }
  hits_.finish();
}

SurfacePoint RayQuery::surface_point(const PosedInstance& one, std::uint32_t leaf) {
  const ExactLeaf exact = surface_leaf(run_, one, leaf);
  kernel::EnteringRay<double> ray;
  ray.direction = double3(query_.direction);
  aim(ray);
  direction_ = ray.along;
  SurfaceTouch first;
  return cast_surface(run_, exact, at_instance(one).ray, &first) ? cab::surface_point(exact, first) : SurfacePoint();
}

namespace {

void begin_search(const QueryRun& run, const Query& query, const kernel::RayTile& entering, std::uint32_t lane,
                  kernel::RaySearch& out) {
  out.stop = entering.enters >> lane & 1 ? kernel::SearchStop::kGoesOn : kernel::SearchStop::kEnd;
  out.filter = filter_of(query);
  for (int c = 0; c < 3; ++c) {
    out.lanes.above[c] = entering.above[c][lane];
    out.lanes.below[c] = entering.below[c][lane];
    out.lanes.inverse[c] = entering.inverse[c][lane];
    out.along[c] = entering.along[c][lane];
  }
  out.lanes.begin = 0;
  out.lanes.end = entering.end[lane];
  out.entered = entering.entered[lane];
  out.scale = entering.scale[lane];
  out.unit = std::min(1 / out.scale, std::numeric_limits<double>::max());
  out.radius = entering.radius[lane];
  out.end = entering.length[lane];
  out.box_decides = run.job.exact == Exact::kNone && query.want != QueryWant::kAll;
  out.any = query.want == QueryWant::kAny;
}

// The leaf that a search has met first.
const kernel::MetLeaf& nearest_met(const kernel::RaySearch& search) {
  return *std::min_element(search.met, search.met + search.met_count, kernel::MetNearer());
}

}  // namespace

void begin_searches(const QueryRun& run, Span<const std::uint32_t> numbers, const QueryIndex* const* indexes,
                    kernel::RaySearch* const* searches) {
  kernel::RayTile entering;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t of = lane < numbers.size ? lane : 0;
    const Query& query = run.job.queries[numbers[of]];
    for (int c = 0; c < 3; ++c) {
      entering.center[c][lane] = indexes[of]->center[c];
      entering.position[c][lane] = query.position[c];
      entering.direction[c][lane] = static_cast<double>(query.direction[c]);
    }
    entering.scale[lane] = indexes[of]->scale;
    entering.length[lane] = static_cast<double>(query.length);
    entering.radius[lane] = static_cast<double>(query.radius);
  }
  run.frame.kernels.enter_rays(entering);
  for (std::uint32_t i = 0; i < numbers.size; ++i)
    begin_search(run, run.job.queries[numbers[i]], entering, i, *searches[i]);
}

void search_together(const QueryRun& run, Span<const std::uint32_t> numbers, kernel::RaySearch* searches) {
  const QueryIndex* indexes[kLanes];
  kernel::RaySearch* each[kLanes];
  for (std::uint32_t i = 0; i < numbers.size; ++i) indexes[i] = &run.index, each[i] = searches + i;
  begin_searches(run, numbers, indexes, each);
  search_by_turns(run, run.frame.kernels.search_rays, searches, static_cast<std::uint32_t>(numbers.size));
}

void cast_first(const QueryRun& run, Span<const std::uint32_t> numbers, const kernel::RaySearch* searches,
                FirstTouches& out) {
  out.decided = out.found = out.named = 0;
  std::uint32_t cast = 0;
  for (std::uint32_t i = 0; i < numbers.size; ++i) {
    const kernel::RaySearch& search = searches[i];
    if (search.stop != kernel::SearchStop::kEnd || !search.box_decides) continue;
    if (search.met_count == 0 || (search.any && search.is_met)) {
      out.decided |= 1u << i;
      out.found |= std::uint32_t{search.is_met} << i;
    } else if (!search.any && search.radius == 0) {
      cast |= 1u << i;
      const kernel::MetLeaf& leaf = nearest_met(search);
      const kernel::PosedCluster& cluster = posed_cluster(run, leaf.node);
      const kernel::PosedCluster::Lane& of = cluster.lanes[leaf.lane];
      const BoxTile& box = cluster.boxes_of(leaf.lane)[leaf.leaf / kLanes];
      const std::uint32_t lane = leaf.leaf % kLanes;
      out.at[i] = {cluster.batch, of.instance, leaf.leaf};
      for (int c = 0; c < 3; ++c) {
        out.tile.apart[c][i] = of.origin[c] - search.filter.position[c];
        out.tile.along[c][i] = search.along[c];
        out.tile.center[c][i] = box.center[c][lane];
        out.tile.half[c][i] = box.half[c][lane];
        for (int k = 0; k < 3; ++k) out.tile.axis[k][c][i] = box.axis[k][c][lane];
      }
      out.tile.length[i] = static_cast<double>(run.job.queries[numbers[i]].length);
    }
  }
  if (cast) run.frame.kernels.cast_boxes(out.tile);
  for (std::uint32_t left = cast & out.tile.meets; left; left &= left - 1) {
    const std::uint32_t i = lowest_bit(left);
    const double most = (1 + kOutwards) * static_cast<double>(out.tile.distance[i]);
    const kernel::RaySearch& search = searches[i];
    if (search.met_count > 1 && std::count_if(search.met, search.met + search.met_count, [most](const auto& leaf) {
                                  return static_cast<double>(leaf.entry) <= most;
                                }) > 1)
      continue;
    out.decided |= 1u << i;
    out.found |= 1u << i;
    out.named |= 1u << i;
    ++run.own.stats.leaf_tests;
  }
  for (std::uint32_t left = out.decided; left; left &= left - 1) count_search(run, searches[lowest_bit(left)]);
}

void FirstTouches::write(const QueryRun& run, std::uint32_t i, std::uint32_t query, QueryHit& to) const {
  const Articulation& articulation = *run.frame.batch(at[i].slot).articulation;
  to.query = query;
  to.batch = {at[i].slot + 1};
  to.instance = at[i].instance;
  to.link = articulation.leaf_link[at[i].leaf];
  to.leaf = static_cast<std::uint16_t>(at[i].leaf);
  to.distance = tile.distance[i];
  for (int c = 0; c < 3; ++c) {
    to.point[c] = tile.point[c][i];
    to.normal[c] = tile.normal[c][i];
  }
  to.inside = tile.inside >> i & 1;
}

}  // namespace cab
