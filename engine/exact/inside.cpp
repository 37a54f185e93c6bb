#include "engine/exact/inside.h"

#include "engine/exact/convex.h"
#include "engine/step/candidate.h"
#include "engine/step/in_contact.h"
#include "layout/convex_shapes.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace cab {
namespace {

// Much more than what rounding in double moves, as a share of the numbers on the way.
constexpr auto kRoom = static_cast<double>(kSurfaceError);

// The axes of a ray: across it, twice, and along it.
struct RayAxes {
  Double3 axis[3];

  explicit RayAxes(std::uint32_t ray) {
    axis[2] = kernel::normalized(Double3{kInsideRays[ray][0], kInsideRays[ray][1], kInsideRays[ray][2]});
    axis[0] = across(axis[2]);
    axis[1] = kernel::cross(axis[2], axis[0]);
  }
  Double3 seen(const Double3& at) const {
    return {kernel::dot(axis[0], at), kernel::dot(axis[1], at), kernel::dot(axis[2], at)};
  }
};

enum class Crossing : std::uint8_t { kNone, kUndecided, kOnTheWayOut, kOnTheWayIn };

// Whether the ray along z from the origin crosses a triangle, whose corners are off by at most `error` in each
// coordinate (docs/proof.md, step 21.8). *at: where, if it does.
Crossing cross_triangle(const Double3 (&corner)[3], double error, double* at) {
  const Double3 lo = kernel::min(kernel::min(corner[0], corner[1]), corner[2]),
                hi = kernel::max(kernel::max(corner[0], corner[1]), corner[2]);
  if (lo.x > error || hi.x < -error || lo.y > error || hi.y < -error || hi.z < -error) return Crossing::kNone;
  double side[3], room = 0;
  bool left = false, right = false, unsure = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const Double3 &from = corner[(i + 1) % 3], &to = corner[(i + 2) % 3];
    const Double3 size = kernel::abs(from) + kernel::abs(to);
    const double within = 2 * error * ((size.x + size.y) + error);
    side[i] = from.x * to.y - from.y * to.x;
    left = left || side[i] > within;
    right = right || side[i] < -within;
    unsure = unsure || !(std::fabs(side[i]) > within);
    room += within;
  }
  if (left && right) return Crossing::kNone;
  if (unsure) return Crossing::kUndecided;
  const double area = (side[0] + side[1]) + side[2];
  *at = ((side[0] * corner[0].z + side[1] * corner[1].z) + side[2] * corner[2].z) / area;
  const double height_error = 2 * error + room / (std::fabs(area) - room) * ((hi.z - lo.z) + 2 * error);
  if (lo.z <= error && !(std::fabs(*at) > height_error)) return Crossing::kUndecided;
  if (lo.z <= error && *at < 0) return Crossing::kNone;
  return left ? Crossing::kOnTheWayOut : Crossing::kOnTheWayIn;
}

// Something that may be inside the other instance, by one of its points about the origin of its own.
struct Inner {
  Double3 at;
  double size;                      // no number on the way to `at` is larger
  std::uint16_t leaf;               // that has the point
  Span<const std::uint16_t> links;  // of all of it, ascending
};

// The links that all closed parts have: those after the last part's.
Span<const std::uint16_t> common_links(const SurfaceParts& of) {
  const SurfacePart& last = of.parts[of.parts.size - 1];
  const std::size_t end = std::size_t{last.link_begin} + last.link_count;
  return {of.links.data + end, of.links.size - end};
}

auto order(const LeafPair& pair) { return std::make_tuple(pair.candidate, pair.a, pair.b); }

// Sorts leaf pairs from a place on, by candidates, then by leaves, and leaves one of equal ones.
void remove_doubles(FixedList<LeafPair>& found, std::uint32_t from) {
  const auto before = [](const LeafPair& x, const LeafPair& y) { return order(x) < order(y); };
  const auto same = [](const LeafPair& x, const LeafPair& y) { return order(x) == order(y); };
  std::sort(found.begin() + from, found.end(), before);
  found.size = static_cast<std::uint32_t>(std::unique(found.begin() + from, found.end(), same) - found.begin());
}

// Searches a candidate's instance a for closed parts about what instance b has, or b for what a has.
class InsideSearch {
 public:
  // outer_is_a: whether it is a that has closed parts.
  InsideSearch(const FrameContext& frame, const Candidate& candidate, std::uint32_t index, bool outer_is_a,
               FixedList<LeafPair>& found, std::uint32_t first_added, ExactScratch& scratch, FrameStats& stats)
      : frame_(frame),
        outer_(outer_is_a ? exact_leaf(frame, candidate.batch_a, candidate.instance_a, 0)
                          : exact_leaf(frame, candidate.batch_b, candidate.instance_b, 0)),
        inner_(outer_is_a ? exact_leaf(frame, candidate.batch_b, candidate.instance_b, 0)
                          : exact_leaf(frame, candidate.batch_a, candidate.instance_a, 0)),
        parts_(outer_.batch->articulation->surface_parts),
        common_(common_links(parts_)),
        index_(index),
        outer_is_a_(outer_is_a),
        found_(found),
        first_added_(first_added),
        scratch_(scratch),
        own_(scratch.inside),
        at_(outer_is_a ? own_.a : own_.b),
        stats_(stats) {
    origin_difference(outer_, inner_, shift_);
  }

  // touching: the leaf pairs of the candidate that touch.
  void run(Span<const LeafPair> touching) {
    touching_ = touching;
    mark_touching();
    try_parts();
    try_shapes();
  }

 private:
  // Where the middle of a ball is, and how far it reaches, with room for rounding.
  Double3 place(const LinkBall& ball, double* reach) const {
    const kernel::RigidLanes<double>& pose = at_.poses[ball.link];
    const Double3 own = pose.scale * double3(ball.center);
    const double size = kernel::sum(kernel::abs(pose.translation)) + kernel::sum(kernel::abs(own));
    *reach = pose.scale * static_cast<double>(ball.reach);
    *reach += kRoom * (*reach + size);
    return pose.translation + kernel::rotate(pose.column, own);
  }

  // Notes which links of the inner one touch a link of every closed part already.
  void mark_touching() {
    if (touching_.empty() || common_.empty()) return;
    std::fill_n(own_.touching.begin(), inner_.batch->articulation->link_count, std::uint8_t{0});
    for (const LeafPair& pair : touching_)
      if (std::binary_search(common_.begin(), common_.end(), outer_link(pair))) own_.touching[inner_link(pair)] = 1;
  }

  // Whether one of some links of the inner one touches a link of every closed part already: then a ray adds nothing.
  bool touches_all(Span<const std::uint16_t> links) const {
    return !touching_.empty() && !common_.empty() &&
           std::any_of(links.begin(), links.end(), [this](std::uint16_t link) { return own_.touching[link] != 0; });
  }

  // Bounds all closed parts, unless the last search of this instance did.
  void bound() {
    if (at_.batch == outer_.batch_index + 1 && at_.instance == outer_.instance) return;
    at_.batch = outer_.batch_index + 1;
    at_.instance = outer_.instance;
    at_.bounded_along = 0;
    constexpr double kFar = std::numeric_limits<double>::infinity();
    at_.lo = {kFar, kFar, kFar};
    at_.hi = {-kFar, -kFar, -kFar};
    for (const LinkBall& ball : parts_.all) {
      at_.poses[ball.link] = pose_in_double(stored_pose(*outer_.batch, outer_.instance, ball.link));
      double reach;
      const Double3 center = place(ball, &reach);
      at_.lo = kernel::min(at_.lo, center - Double3{reach, reach, reach});
      at_.hi = kernel::max(at_.hi, center + Double3{reach, reach, reach});
    }
  }

  // The same for each leaf, as seen along a ray.
  void bound_leaves(std::uint32_t ray, const RayAxes& axes) {
    if (at_.bounded_along == ray + 1) return;
    at_.bounded_along = ray + 1;
    for (std::size_t i = 0; i < parts_.leaves.size; ++i) {
      constexpr double kFar = std::numeric_limits<double>::infinity();
      RayBounds& out = at_.leaves[i];
      out = {{kFar, kFar}, {-kFar, -kFar}, -kFar};
      const ClosedLeaf& leaf = parts_.leaves[i];
      for (std::uint32_t b = leaf.ball_begin; b < leaf.ball_begin + leaf.ball_count; ++b) {
        double reach;
        const Double3 center = axes.seen(place(parts_.balls[b], &reach));
        out.lo[0] = std::min(out.lo[0], center.x - reach);
        out.lo[1] = std::min(out.lo[1], center.y - reach);
        out.hi[0] = std::max(out.hi[0], center.x + reach);
        out.hi[1] = std::max(out.hi[1], center.y + reach);
        out.end = std::max(out.end, center.z + reach);
      }
    }
  }

  // A point of the inner instance, about the origin of the outer one.
  Double3 about_outer(const Double3& at) const { return at + Double3{shift_[0], shift_[1], shift_[2]}; }

  bool is_in_bounds(const Double3& at, double size) const {
    const double room = kRoom * size;
    return at.x >= at_.lo.x - room && at.y >= at_.lo.y - room && at.z >= at_.lo.z - room && at.x <= at_.hi.x + room &&
           at.y <= at_.hi.y + room && at.z <= at_.hi.z + room;
  }

  double size_with_shift(double size) const {
    return size + ((std::fabs(shift_[0]) + std::fabs(shift_[1])) + std::fabs(shift_[2]));
  }

  // Whether a vertex of the inner skin is in the bounds of the closed parts.
  bool is_in_bounds(std::uint32_t vertex, LinkPoses& poses) const {
    double size = 0;
    const Double3 at = about_outer(skinned_vertex(inner_, vertex, poses, size));
    return is_in_bounds(at, size_with_shift(size));
  }

  void try_parts() {
    const SurfaceParts& of = inner_.batch->articulation->surface_parts;
    LinkPoses poses(inner_);
    for (const SurfacePart& part : of.parts) {
      Inner inner = {{}, 0, static_cast<std::uint16_t>(part.leaf), {of.links.data + part.link_begin, part.link_count}};
      if (touches_all(inner.links)) continue;
      bound();
      inner.at = skinned_vertex(inner_, part.middle, poses, inner.size);
      if (!is_in_bounds(about_outer(inner.at), size_with_shift(inner.size))) continue;
      if (std::all_of(part.ends, part.ends + 6, [&](std::uint32_t vertex) { return is_in_bounds(vertex, poses); }))
        try_point(inner);
    }
  }

  void try_shapes() {
    const Articulation& articulation = *inner_.batch->articulation;
    for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
      const ExactLeaf at = exact_leaf(frame_, inner_.batch_index, inner_.instance, leaf);
      if (has_triangles(at)) continue;
      const std::uint16_t* const link = &articulation.leaf_link[leaf];
      if (touches_all({link, 1})) continue;
      bound();
      const ConvexShapes& all = *at.convex_shapes;
      for (std::uint32_t s = all.leaf_begin[at.shape]; s < all.leaf_begin[at.shape + 1]; ++s) {
        const ConvexShape& shape = all.shapes[s];
        if (shape.kind == ConvexKind::kHalfSpace) continue;
        Inner inner = {{}, 0, static_cast<std::uint16_t>(leaf), {link, 1}};
        inner.at = middle_of(shape, stored_pose(*inner_.batch, inner_.instance, *link), &inner.size);
        if (is_in_bounds(about_outer(inner.at), size_with_shift(inner.size))) try_point(inner);
      }
    }
  }

  // A point of a shape: its centre, of a hull the mean of its vertices.
  static Double3 middle_of(const ConvexShape& shape, const StoredPose& at, double* size) {
    Double3 own = double3(shape.position);
    if (shape.kind == ConvexKind::kHull) {
      const Span<const float> vertices = shape.part->vertices;
      Double3 sum = {0, 0, 0};
      for (std::size_t v = 0; v < vertices.size; v += 3) sum = sum + double3(vertices.data + v);
      const Double3 mean = (3 / static_cast<double>(vertices.size)) * sum;
      own = double3(shape.part->position);
      own = own + mean.x * axis_of(shape, 0);
      own = own + mean.y * axis_of(shape, 1);
      own = own + mean.z * axis_of(shape, 2);
    }
    const kernel::RigidLanes<double> pose = pose_in_double(at);
    own = pose.scale * own;
    *size = kernel::sum(kernel::abs(pose.translation)) + kernel::sum(kernel::abs(own)) +
            pose.scale * static_cast<double>(shape.reach);
    return pose.translation + kernel::rotate(pose.column, own);
  }

  // Adds a pair for each closed part that a point is inside of. About parts that a ray leaves undecided the next one is
  // asked, and about no others.
  void try_point(const Inner& inner) {
    for (std::uint32_t ray = 0; ray < kInsideRayCount && (ray == 0 || !own_.crossed.empty()); ++ray) {
      cast(inner, ray);
      const bool is_last = ray + 1 == kInsideRayCount;
      std::uint32_t asked = 0;
      for (const std::uint32_t part : own_.crossed) {
        PartCrossings& crossings = own_.crossings[part];
        const bool may_be_inside = is_inside(crossings, parts_.parts[part]) && !touches(inner, parts_.parts[part]);
        const bool is_asked = may_be_inside && crossings.is_undecided && !is_last;
        if (may_be_inside && !is_asked) add(inner.leaf, crossings.leaf);
        crossings = {};
        crossings.is_asked = is_asked;
        if (is_asked) own_.crossed.data[asked++] = part;
      }
      own_.crossed.size = asked;
    }
  }

  // Whether a point is inside a part by what a ray crosses, or may be.
  static bool is_inside(const PartCrossings& crossings, const SurfacePart& part) {
    return crossings.is_undecided || (part.turns_one_way ? crossings.turns != 0 : crossings.turns % 2 != 0);
  }

  // Casts a ray from a point: the first at all closed parts, others at those that it is asked about.
  void cast(const Inner& inner, std::uint32_t number) {
    const RayAxes axes(number);
    bound_leaves(number, axes);
    const Double3 at = about_outer(inner.at), seen = axes.seen(at);
    const double size = size_with_shift(inner.size), room = kRoom * size;
    const LocalRay ray = {
        at, axes.axis[2], 0, std::numeric_limits<double>::infinity(), 0, 2 * kSurfaceErrorDouble * size};
    for (std::size_t i = 0; i < parts_.leaves.size; ++i) {
      const RayBounds& bounds = at_.leaves[i];
      if (seen.x < bounds.lo[0] - room || seen.x > bounds.hi[0] + room || seen.y < bounds.lo[1] - room ||
          seen.y > bounds.hi[1] + room || seen.z > bounds.end + room)
        continue;
      cast_at_leaf(parts_.leaves[i].leaf, ray, axes, size, number == 0);
    }
  }

  void cast_at_leaf(std::uint32_t leaf, const LocalRay& ray, const RayAxes& axes, double size, bool is_first) {
    ExactLeaf of = outer_;
    of.leaf = of.shape = leaf;
    const kernel::SkinnedLeaf& skin =
        skinned(frame_, of, nullptr, scratch_.skins, {stats_.leaves_skinned, stats_.leaves_replaced});
    const std::uint32_t count = frame_.kernels.ray_triangles(surface_ray(of, skin, ray), own_.met.data);
    const std::uint32_t* const part_of =
        parts_.closed_part.data + std::size_t{kLanes} * outer_.batch->articulation->surface.leaves[leaf].patch_begin;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t triangle = own_.met[i].triangle, part = part_of[triangle];
      if (part == kNoPart || !(is_first || own_.crossings[part].is_asked)) continue;
      const PlacedTriangle placed = triangle_in_double(of, triangle, {-ray.at.x, -ray.at.y, -ray.at.z});
      const auto& at = placed.at.corner;
      double crossed_at = std::numeric_limits<double>::infinity();
      const Crossing crossing = cross_triangle({axes.seen(at[0]), axes.seen(at[1]), axes.seen(at[2])},
                                               2 * kSurfaceErrorDouble * (placed.size + size), &crossed_at);
      if (crossing == Crossing::kNone) continue;
      PartCrossings& crossings = own_.crossings[part];
      if (is_first && !crossings.is_crossed) own_.crossed.push(part);
      if (!crossings.is_crossed || crossed_at < crossings.first) {
        crossings.first = crossed_at;
        crossings.leaf = static_cast<std::uint16_t>(leaf);
      }
      crossings.is_crossed = true;
      crossings.turns += crossing == Crossing::kOnTheWayOut ? 1 : crossing == Crossing::kOnTheWayIn ? -1 : 0;
      crossings.is_undecided = crossings.is_undecided || crossing == Crossing::kUndecided;
    }
  }

  std::uint16_t inner_link(const LeafPair& pair) const {
    return inner_.batch->articulation->leaf_link[outer_is_a_ ? pair.b : pair.a];
  }
  std::uint16_t outer_link(const LeafPair& pair) const {
    return outer_.batch->articulation->leaf_link[outer_is_a_ ? pair.a : pair.b];
  }

  // Whether a link of the inner one touches a link of a closed part already.
  bool touches(const Inner& inner, const SurfacePart& part) const {
    const Span<const std::uint16_t> links = {parts_.links.data + part.link_begin, part.link_count};
    return std::any_of(touching_.begin(), touching_.end(), [&](const LeafPair& pair) {
      return std::binary_search(inner.links.begin(), inner.links.end(), inner_link(pair)) &&
             std::binary_search(links.begin(), links.end(), outer_link(pair));
    });
  }

  void add(std::uint16_t inner_leaf, std::uint16_t outer_leaf) {
    // Parts of one leaf may be inside parts of another. What has no room is there already.
    if (found_.size == found_.capacity) remove_doubles(found_, first_added_);
    if (found_.size == found_.capacity) return;
    found_.push(outer_is_a_ ? LeafPair{index_, outer_leaf, inner_leaf} : LeafPair{index_, inner_leaf, outer_leaf});
  }

  const FrameContext& frame_;
  const ExactLeaf outer_, inner_;  // any leaf of each
  const SurfaceParts& parts_;      // of the outer one
  const Span<const std::uint16_t> common_;
  std::uint32_t index_;
  bool outer_is_a_;
  FixedList<LeafPair>& found_;
  std::uint32_t first_added_;
  ExactScratch& scratch_;
  InsideScratch& own_;
  ClosedBounds& at_;  // of the outer one
  FrameStats& stats_;
  double shift_[3];  // the origin of the inner one less that of the outer one
  Span<const LeafPair> touching_;
};

}  // namespace

void size_inside(const InsideNeeds& needs, Arena& arena, InsideScratch& out) {
  out = {};
  if (needs.leaves == 0) return;
  for (ClosedBounds* const bounds : {&out.a, &out.b}) {
    bounds->poses = arena.allocate<kernel::RigidLanes<double>>(needs.links);
    bounds->leaves = arena.allocate<RayBounds>(needs.leaves);
  }
  out.touching = arena.allocate<std::uint8_t>(needs.links);
  out.crossings = arena.allocate<PartCrossings>(needs.parts);
  const Span<std::uint32_t> crossed = arena.allocate<std::uint32_t>(needs.parts);
  out.crossed = {crossed.data, static_cast<std::uint32_t>(crossed.size), 0};
  out.met = arena.allocate<kernel::MetTriangle>(kLanes, needs.patches);
}

bool searches_inside(const FrameContext& frame, const Candidate& candidate) {
  return frame.finds_inside() && !is_within(candidate) &&
         (has_closed_parts(*frame.batch(candidate.batch_a).articulation) ||
          has_closed_parts(*frame.batch(candidate.batch_b).articulation));
}

void add_inside(const FrameContext& frame, const Candidate* candidates, std::uint32_t begin, std::uint32_t end,
                FixedList<LeafPair>& found, ExactScratch& scratch, FrameStats& stats) {
  if (!frame.finds_inside()) return;
  const std::uint32_t touching = found.size;
  std::uint32_t first = 0;
  for (std::uint32_t i = begin; i < end; ++i) {
    std::uint32_t last = first;
    while (last < touching && found.data[last].candidate == i) ++last;
    const Span<const LeafPair> own = {found.data + first, last - first};
    first = last;
    const Candidate& candidate = candidates[i];
    if (!searches_inside(frame, candidate)) continue;
    if (frame.report == Report::kInContact && (!own.empty() || is_already_reported(frame, candidate))) continue;
    for (const bool outer_is_a : {true, false}) {
      const std::uint32_t outer = outer_is_a ? candidate.batch_a : candidate.batch_b;
      if (has_closed_parts(*frame.batch(outer).articulation))
        InsideSearch(frame, candidate, i, outer_is_a, found, touching, scratch, stats).run(own);
    }
  }
  if (found.size == touching) return;
  remove_doubles(found, touching);
  std::sort(found.begin(), found.end(), [](const LeafPair& x, const LeafPair& y) { return order(x) < order(y); });
}

}  // namespace cab
