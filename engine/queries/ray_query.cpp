// Rays, and spheres that are moved along them. The parameter of a ray is its length from the start.
#include "engine/queries/ray_query.h"

#include "engine/exact/convex.h"
#include "engine/exact/convex_queues.h"
#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <cmath>

namespace cab {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Double3 unit_direction(const float (&direction)[3]) {
  const Double3 d = {direction[0], direction[1], direction[2]};
  const double most = kernel::max_component(kernel::abs(d));
  if (!(most > 0)) return {1, 0, 0};  // a ray of length 0
  return kernel::normalized(Double3{d.x / most, d.y / most, d.z / most});
}

// Sets where a ray begins in some frame. pad: the radius and what rounding may move.
void set_start(const Double3& from, double pad, kernel::RayLanes& lanes) {
  const double at[3] = {from.x, from.y, from.z};
  for (int c = 0; c < 3; ++c) {
    lanes.above[c] = static_cast<float>(at[c] + pad);
    lanes.below[c] = static_cast<float>(at[c] - pad);
  }
}

double sum_of(const Double3& v) { return kernel::sum(kernel::abs(v)); }

}  // namespace

RayQuery::RayQuery(const QueryRun& run, const Query& query, LinkHits& hits)
    : run_(run),
      query_(query),
      hits_(hits),
      direction_(unit_direction(query.direction)),
      length_(static_cast<double>(query.length)) {
  const double along[3] = {direction_.x, direction_.y, direction_.z};
  for (int c = 0; c < 3; ++c) {
    const double least = std::max(std::fabs(along[c]), kQueryLeastDirection);
    inverse_[c] = 1 / (along[c] < 0 ? -least : least);
    lanes_.inverse[c] = static_cast<float>(inverse_[c]);
  }
}

// Moves the start to where the ray enters the cube of the index. Returns false if it passes by (docs/proof.md, step
// 12.2).
bool RayQuery::enter_index() {
  const QueryIndex& index = run_.index;
  const double* const at = query_.position;
  const Double3 from = {index.scale * (at[0] - index.center[0]), index.scale * (at[1] - index.center[1]),
                        index.scale * (at[2] - index.center[2])};
  const double radius = index.scale * static_cast<double>(query_.radius), away = sum_of(from);
  const double half = 1.01 + radius + 4 * kQueryLeastDirection * away;
  const double position[3] = {from.x, from.y, from.z};
  double near = 0, far = index.scale * length_;
  for (int c = 0; c < 3; ++c) {
    const double x = (-half - position[c]) * inverse_[c], y = (half - position[c]) * inverse_[c];
    near = std::max(near, std::min(x, y));
    far = std::min(far, std::max(x, y));
  }
  if (near > far) return false;
  entered_ = near;
  const double rounding = 2 * kQueryRayPad * (1 + radius) + kQueryRounding * (away + near);
  set_start(from + near * direction_, radius + rounding, lanes_);
  lanes_.begin = 0;
  lanes_.end = float_above((far - near) + kQueryPad);
  return true;
}

// Leaves out what is farther than the links that were found.
void RayQuery::shorten() {
  const double most = static_cast<double>(hits_.most());
  if (most == kInfinity) return;
  const double end = (1 + kOutwards) * (run_.index.scale * most) - entered_;
  lanes_.end = std::min(lanes_.end, float_above(end + kQueryPad * (1 + std::fabs(end))));
}

bool RayQuery::enter() {
  if (!enter_index()) return false;
  shorten();
  return true;
}

// Casts the ray against the box of a leaf and then against its shapes, and writes the first touch.
bool RayQuery::cast(const PosedInstance& one, const LocalRay& ray, std::uint32_t leaf, RayTouch* out) const {
  RayTouch box;
  if (!cast_ray(ray, one.box(leaf), &box)) return false;
  *out = box;
  if (run_.job.exact == Exact::kNone) return true;
  ++run_.own.stats.exact_tests;
  const LeafShapes shapes = shapes_of(run_, one, leaf);
  LocalRay in_box = ray;  // half spaces begin where the box does
  in_box.begin = box.at;
  bool touches = false;
  for (const ConvexShape& shape : shapes.shapes) {
    RayTouch touch;
    const bool is_half_space = shape.kind == ConvexKind::kHalfSpace;
    if (!cast_ray(is_half_space ? in_box : ray, shape, shapes.at, &touch)) continue;
    if (is_half_space && touch.inside) touch = box;
    if (!touches || touch.at < out->at) *out = touch;
    touches = true;
  }
  return touches;
}

void RayQuery::test(const PosedInstance& one) {
  const Double3 to = {one.apart[0], one.apart[1], one.apart[2]};
  const double nearest = std::min(std::max(kernel::dot(to, direction_), 0.0), length_);
  LocalRay ray;
  ray.at = nearest * direction_ - to;
  ray.direction = direction_;
  ray.begin = -nearest;
  ray.radius = static_cast<double>(query_.radius);
  ray.error = kQueryRounding * (sum_of(to) + nearest);
  const double size = sum_of(ray.at) + static_cast<double>(one.reach);
  kernel::BoxRay lanes = {
      {static_cast<float>(ray.at.x), static_cast<float>(ray.at.y), static_cast<float>(ray.at.z)},
      {static_cast<float>(direction_.x), static_cast<float>(direction_.y), static_cast<float>(direction_.z)},
      float_above((ray.radius + ray.error) + kQueryBoxPad * (size + ray.radius)) +
          4 * std::numeric_limits<float>::min(),
      0,
      0};
  lanes.begin = float_below(ray.begin);
  const auto set_end = [&] {
    const double most = (1 + kOutwards) * static_cast<double>(hits_.most());
    ray.end = std::min(length_, most) - nearest;
    lanes.end = float_above(ray.end);
  };
  set_end();
  for_each_leaf(
      run_, one, [&](const BoxTile& boxes, float* entry) { return run_.frame.kernels.ray_boxes(boxes, lanes, entry); },
      [&](float entry) { return entry > lanes.end; },
      [&](std::uint32_t leaf) {
        RayTouch touch;
        if (!cast(one, ray, leaf, &touch)) return;
        const Double3 point = touch.inside ? Double3{0, 0, 0} : touch.point + to;
        hits_.add(one, leaf, static_cast<float>(std::max(nearest + touch.at, 0.0)), floats(point), floats(touch.normal),
                  touch.inside);
        set_end();
      },
      [&] { return hits_.is_done(); });
  hits_.finish();
  shorten();
}

}  // namespace cab
