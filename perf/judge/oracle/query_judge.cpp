// The judge of queries.
#include "perf/judge/oracle/query_judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace cab::oracle {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

// Added to every tolerance, for what underflows in float.
constexpr Real kTiny = 0x1p-120L;

// A query that is farther from an instance than this many of a leaf's lengths is too far for Real to tell what it must
// find, unless it does so by this share of the distance.
constexpr Real kFar = 0x1p36L;
constexpr Real kFarShare = 0x1p-58L;

// A body that grows by this many times its reach is as good as a ball.
constexpr Real kNoDetail = 1024;

// A plane that parts a point from a shape is at most this share of distance and size short of it (Contact).
constexpr Real kPlaneShare = 1e-5L;

// Boxes without parts are asked for with axes that are orthonormal, where the caller's may be off by this share.
constexpr Real kAxesShare = 0x1p-21L;

// The judge of convex shapes measures depths to this share of the sizes.
constexpr Real kDepthRounding = 1e-9L;

// A query relative to an instance's origin, in the world's axes.
struct Asked {
  const Query& query;
  Point at;
  Point direction{};  // kRay
  Point along{};      // kCapsule: half its segment
  Real own = 0;       // the sum of its own lengths, which rounding depends on
  QueryBody body{};   // kSphere, kBox, kCapsule
};

bool has_body(QueryKind kind) {
  return kind == QueryKind::kSphere || kind == QueryKind::kBox || kind == QueryKind::kCapsule;
}
bool has_depth(const Query& query) { return has_body(query.kind) && query.with_depth; }

// Whether distances are other than 0.
bool has_distance(const Query& query) {
  return query.kind == QueryKind::kRay || query.kind == QueryKind::kPoint || has_depth(query);
}

Asked ask(const Query& query, const Point& origin) {
  Asked out{query, {}};
  out.at = Point{{query.position[0], query.position[1], query.position[2]}} - origin;
  const Real half[3] = {query.half[0], query.half[1], query.half[2]}, radius = query.radius;
  if (query.kind == QueryKind::kRay) {
    const Point d = {{query.direction[0], query.direction[1], query.direction[2]}};
    if (length_of(d) > 0) out.direction = 1 / length_of(d) * d;
    out.own = radius;
  }
  if (!has_body(query.kind)) return out;
  Real column[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Real q[4] = {query.orientation[0], query.orientation[1], query.orientation[2], query.orientation[3]};
  if (query.kind != QueryKind::kSphere) quaternion_matrix(q, column);
  QueryBody& body = out.body;
  if (query.kind == QueryKind::kBox) {
    out.own = half[0] + half[1] + half[2];
    body.kind = JudgeKind::kBox;
    store(out.at, body.box.center);
    for (std::size_t k = 0; k < 3; ++k) store(to_vec3(column[k]), body.box.axis[k]);
    for (std::size_t k = 0; k < 3; ++k) body.box.half[k] = half[k];
  } else {
    const bool is_sphere = query.kind == QueryKind::kSphere;
    out.own = is_sphere ? radius : radius + half[2];
    body.kind = is_sphere ? JudgeKind::kSphere : JudgeKind::kCapsule;
    body.size[0] = radius;
    body.size[1] = is_sphere ? 0 : half[2];
    body.at = out.at;
    for (std::size_t k = 0; k < 3; ++k) store(to_vec3(column[k]), body.column[k]);
    out.along = body.size[1] * to_vec3(column[2]);
  }
  complete(body);
  return out;
}

// What is allowed about one leaf and one query.
struct Allowed {
  Real grow;       // how much the leaf grows
  Real in_double;  // what is rounded in double
  Real shrink;     // above 0: what a query must be met by to be sure of it
  bool by_shapes;  // whether the exact test decides
};

Allowed allowed(const QueryLeaf& leaf, const Asked& asked, Exact exact, const QueryTolerance& tolerance) {
  Allowed out{};
  const Real away = norm_1(asked.at), times = exact == Exact::kNone ? 1 : tolerance.shapes;
  out.in_double = tolerance.apart * away + kTiny;
  out.grow = times * (tolerance.leaf * leaf.lengths + tolerance.query * asked.own) + out.in_double;
  out.by_shapes = exact != Exact::kNone;
  out.shrink = away > kFar * leaf.lengths ? kFarShare * away : 0;
  return out;
}

// A leaf, or a part, that a query meets at a distance; the same whether it has grown or not.
struct Met {
  Real distance = 0;
  bool inside = false;  // kRay, kPoint: it begins inside, or on the surface
};

std::optional<Met> meet_region(const QueryBody& box, const Asked& asked, Span<const QueryPlane> planes, Real slack) {
  const Query& query = asked.query;
  for (std::uint32_t i = 0; i < query.plane_count; ++i) {
    const QueryPlane& plane = planes[query.first_plane + i];
    const Point normal = {{plane.normal[0], plane.normal[1], plane.normal[2]}};
    const Real size = length_of(normal), offset = plane.offset / size;
    const Point out = 1 / size * normal;
    const Real nearest = -support_of(box, Real{-1} * out) - dot(out, asked.at);
    if (nearest > offset + slack + (slack > 0 ? 0x1p-50L * std::fabs(offset) : 0)) return std::nullopt;
  }
  return Met{};
}

// The gap of two bodies is at most `reach`.
bool bodies_within(const QueryBody& a, const QueryBody& b, Real reach) {
  const JudgeShape one = shape_of(a), other = shape_of(b);
  const Verdict first = judge(one, other, Effort::kDecide);
  if (first.gap_at_most <= reach) return true;
  if (first.gap_at_least > reach) return false;
  return judge(one, other, Effort::kMeasure).gap_at_least <= reach;
}

// Whether the query meets a body that has grown. A box grows by its half extents, all else by a ball. slack: what the
// query's lengths may be longer, or what it must be met by if it is below 0.
std::optional<Met> meet(const QueryBody& given, const Asked& asked, Real grow, Real slack) {
  const Query& query = asked.query;
  const bool is_box = given.kind == JudgeKind::kBox, is_ray = query.kind == QueryKind::kRay;
  if (given.kind == JudgeKind::kHull && given.vertices.empty()) return std::nullopt;
  const Real shrink = std::fmin(slack, 0);
  const QueryBody body = grown(given, grow + (is_ray ? shrink : 0));
  const Real ball = (is_box ? 0 : grow) + (is_box && is_ray ? 0 : shrink);
  if (is_box)
    for (const Real half : body.box.half)
      if (half < 0) return std::nullopt;
  const Real apart = length_of(asked.at - body.middle) - body.reach;  // a bound of how far the query's centre is
  const auto is_far = [&](Real reach) { return apart > reach * (1 + 1e-9L) + std::fabs(ball); };
  switch (query.kind) {
    case QueryKind::kRay: {
      const Real along = dot(body.middle - asked.at, asked.direction), most = query.length + slack;
      const Real reach = (body.reach + query.radius + std::fabs(ball)) * (1 + 1e-9L) + 0x1p-50L * norm_1(asked.at);
      if (most < 0) return std::nullopt;
      const Point off = body.middle - (asked.at + std::clamp(along, Real{0}, most) * asked.direction);
      if (length_of(off) > reach) return std::nullopt;
      // So far away no Real tells where on the grown body the ray is.
      if (2 * slack > grow && slack > kNoDetail * given.reach) {
        const Real least = along - 2 * (grow + body.reach + query.radius);
        return Met{larger(Real{0}, least), least <= 0};
      }
      const std::optional<Real> entry = first_contact(body, asked.at, asked.direction, most, query.radius + ball);
      if (!entry) return std::nullopt;
      return Met{*entry, distance_of_point(body, asked.at) <= query.radius + ball};
    }
    case QueryKind::kPoint: {
      if (is_far(query.length + slack)) return std::nullopt;
      const Real distance = larger(Real{0}, distance_of_point(body, asked.at) - (is_box ? 0 : grow));
      if (distance > query.length + slack) return std::nullopt;
      return Met{distance, distance == 0};
    }
    case QueryKind::kSphere:
      if (is_far(query.radius) || distance_of_point(body, asked.at) > query.radius + ball) return std::nullopt;
      return Met{};
    case QueryKind::kCapsule:
      if (is_far(asked.body.reach)) return std::nullopt;
      if (distance_of_segment(body, asked.at, asked.along) > query.radius + ball) return std::nullopt;
      return Met{};
    case QueryKind::kBox: {
      if (is_far(asked.body.reach)) return std::nullopt;
      const QueryBody own = grown(asked.body, shrink);
      for (const Real half : own.box.half)
        if (half < 0) return std::nullopt;
      const bool meets =
          is_box ? exactly_overlap(own.box, body.box, body.middle - asked.at) : bodies_within(own, body, grow);
      if (!meets) return std::nullopt;
      return Met{};
    }
    case QueryKind::kRegion: break;
  }
  return std::nullopt;
}

// The least depth of the query in a body, by which it would have to be moved out; 0 if they are apart.
Real least_depth(const QueryBody& body, const Asked& asked) {
  return larger(Real{0}, -judge(shape_of(body), shape_of(asked.body), Effort::kMeasure).gap_at_least);
}

// Whether a ray or a point begins so deep in a body that no growth matters: an octahedron about it is inside, which
// holds a ball as large as the growth.
bool is_deep_inside(const QueryBody& body, const Asked& asked, Real grow) {
  const Real radius = asked.query.kind == QueryKind::kRay ? asked.query.radius : 0;
  for (std::size_t c = 0; c < 3; ++c)
    for (const Real by : {-1.7320509L * grow, 1.7320509L * grow}) {
      Point at = asked.at;
      at[c] += by;
      if (distance_of_point(body, at) > radius) return false;
    }
  return true;
}

// Sets `most` and `must` by what is met as given, `least` by what is met once it has grown.
void take(const std::optional<Met>& given, const std::optional<Met>& wide, JudgedHit& out) {
  if (given) {
    out.must = true;
    out.most = given->distance;
  }
  out.may_inside = wide->inside || (given && given->inside);
  out.least = given ? std::fmin(given->distance, wide->distance) : wide->distance;
}

// One body of a leaf: its box, or one of its parts.
std::optional<JudgedHit> judge_body(const QueryLeaf& leaf, const QueryBody& body, const Asked& asked,
                                    const Allowed& slack, Exact exact) {
  JudgedHit out;
  out.most = kInfinity;
  std::optional<Met> wide = meet(body, asked, slack.grow, slack.in_double);
  if (!wide) return std::nullopt;
  const bool is_half_space = body.kind == JudgeKind::kHalfSpace;
  const QueryBody given = is_half_space ? clipped(leaf.box.box, body) : body;
  if (is_half_space && !meet(leaf.box, asked, slack.grow, slack.in_double)) return std::nullopt;
  const bool is_turned = slack.by_shapes && leaf.parts.empty();  // its axes are made orthonormal
  take(meet(is_turned ? grown(given, -kAxesShare * leaf.lengths) : given, asked, 0, -slack.shrink), wide, out);
  out.must_inside =
      out.must && out.most == 0 && !has_body(asked.query.kind) && is_deep_inside(given, asked, slack.grow);
  if (!has_depth(asked.query)) return out;
  const bool is_least = exact == Exact::kNone && asked.query.kind != QueryKind::kCapsule;
  if (out.must) out.most = -least_depth(given, asked);
  out.least = is_least ? -least_depth(grown(body, slack.grow), asked) : -kInfinity;
  return out;
}

void merge(const JudgedHit& from, bool is_first, JudgedHit& into) {
  if (is_first) {
    into.must = into.must_inside = into.may_inside = false;
    into.least = into.most = kInfinity;
  }
  into.must |= from.must;
  into.must_inside |= from.must_inside;
  into.may_inside |= from.may_inside;
  into.least = std::fmin(into.least, from.least);
  into.most = std::fmin(into.most, from.must ? from.most : kInfinity);
}

// What an exact test looks at; a region asks for boxes.
std::vector<const QueryBody*> bodies_of(const QueryLeaf& leaf, const Query& query, Exact exact) {
  if (exact == Exact::kNone || query.kind == QueryKind::kRegion || leaf.parts.empty()) return {&leaf.box};
  std::vector<const QueryBody*> out;
  for (const QueryBody& part : leaf.parts) out.push_back(&part);
  return out;
}

std::optional<JudgedLeaf> judge_leaf(const QueryLeaf& leaf, const Asked& asked, Span<const QueryPlane> planes,
                                     Exact exact, const QueryTolerance& tolerance) {
  const Allowed slack = allowed(leaf, asked, exact, tolerance);
  JudgedLeaf out;
  out.leaf = &leaf;
  if (asked.query.kind == QueryKind::kRegion) {
    const QueryBody wide_box = grown(leaf.box, slack.grow);
    const std::optional<Met> wide = meet_region(wide_box, asked, planes, slack.in_double);
    if (!wide) return std::nullopt;
    out.most = kInfinity;
    take(meet_region(leaf.box, asked, planes, -slack.shrink), wide, out);
    return out;
  }
  bool is_any = false;
  for (const QueryBody* const body : bodies_of(leaf, asked.query, exact)) {
    const std::optional<JudgedHit> judged = judge_body(leaf, *body, asked, slack, exact);
    if (!judged) continue;
    merge(*judged, !is_any, out);
    is_any = true;
  }
  if (!is_any) return std::nullopt;
  return out;
}

bool is_looked_at(const QueryInstance& instance, const Query& query) {
  if ((instance.layers & query.layer_mask) == 0) return false;
  for (std::size_t c = 0; c < 3; ++c)
    if (std::fabs(instance.origin[c] - query.position[c]) > static_cast<Real>(kMaxQueryCoordinate)) return false;
  return slot_of(query.ignored_batch).value != instance.batch.value || query.ignored_instance != instance.instance;
}

// ------------------------------------------------------------------------------------------------- answered jobs

std::string text(Real v) {
  return std::to_string(static_cast<double>(v)) + " (" + [v] {
    char out[40];
    std::snprintf(out, sizeof out, "%.9Lg", v);
    return std::string(out);
  }() + ")";
}

std::string name_of(std::size_t query, BatchSlot batch, std::uint32_t instance, std::uint32_t link) {
  return "query " + std::to_string(query) + ", batch " + std::to_string(batch.value) + ", instance " +
         std::to_string(instance) + ", link " + std::to_string(link) + ": ";
}
std::string name_of(const QueryHit& hit) { return name_of(hit.query, hit.batch, hit.instance, hit.link); }

auto key_of(const QueryHit& hit) { return std::make_tuple(hit.batch.value, hit.instance, hit.link); }
auto key_of(const JudgedLink& link) {
  return std::make_tuple(link.instance->batch.value, link.instance->instance, link.link);
}

bool is_zero(const float (&v)[3]) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }
Point real(const float (&v)[3]) { return {{v[0], v[1], v[2]}}; }

// How far the points of a contact with a body may be from where its normal and depth have them (docs/limits.md).
Real points_apart(const QueryBody& body) { return body.kind == JudgeKind::kCylinder ? 0.1L * body.reach : 0; }

// What is wrong about the point and the normal of a hit, if it is of this body; empty if nothing is.
std::string geometry_fault(const QueryHit& hit, const QueryBody& body, const Asked& asked, const Allowed& slack,
                           const QueryTolerance& tolerance) {
  const Query& query = asked.query;
  const Point point = real(hit.point), normal = real(hit.normal), at = asked.at + point;
  const Real distance = hit.distance, radius = query.radius;
  const bool is_box = body.kind == JudgeKind::kBox;
  const Real off = tolerance.written * (norm_1(point) + std::fabs(distance) + asked.own) + slack.in_double;
  const Real loose = slack.grow + off;
  if (hit.inside && is_zero(hit.point)) return {};
  if (const Real beyond = distance_of_point(body, at); beyond > (is_box ? 1.7320509L : 1) * slack.grow + off)
    return "its point is off the link by " + text(beyond);
  if (hit.inside) {
    if (length_of(point) > radius + loose) return "it begins inside, but its point is away";
    return {};
  }
  // How far the normal may be turned: it is the direction between two rounded points, or that of a curved surface.
  Real tilt = tolerance.normal;
  const auto blur = [&](Real arm) { tilt = std::fmin(2, arm > 0 ? tilt + 2 * loose / arm : 2); };
  switch (query.kind) {
    case QueryKind::kRay: {
      const Point center = distance * asked.direction;
      if (radius > 0) {
        const Point arm = center - point;
        if (std::fabs(length_of(arm) - radius) > loose) return "its point is not on the moved sphere";
        if (length_of(arm - radius * normal) > loose + tilt * radius) return "its normal is not that of the sphere";
        blur(radius);
      } else if (norm_max(center - point) > off) {
        return "its point is not at its distance along the ray";
      }
      if (body.bluntness > 0) blur(body.bluntness);
      if (dot(normal, asked.direction) > tilt) return "the ray leaves along its normal";
      break;
    }
    case QueryKind::kPoint:
      if (std::fabs(length_of(point) - distance) >
          (slack.by_shapes ? loose + kPlaneShare * std::fabs(distance) + points_apart(body) : off))
        return "its point is not at its distance";
      if (length_of(point + distance * normal) > loose + tilt * distance) return "its normal is not towards the point";
      blur(distance);
      break;
    default: {  // with depth
      const Real depth = -distance;
      const Real reach = support_of(body, normal) + support_of(asked.body, Real{-1} * normal);
      const Real sizes = asked.own + (body.reach < kInfinity ? body.reach : 0);
      const Real rest = loose + 4 * tolerance.normal * sizes + kDepthRounding * sizes;
      if (!(reach - depth <= rest)) {
        const Verdict moved = judge(shape_of(body), shape_of(asked.body, depth * normal), Effort::kMeasure);
        if (moved.gap_at_least < -rest)
          return "moved by its depth the shape is still " + text(-moved.gap_at_least) + " in";
      }
      if (depth - reach > 1.7320509L * slack.grow + off + 4 * tolerance.normal * sizes)
        return "it is deeper than along its normal, by " + text(depth - reach);
      if (body.bluntness > 0) blur(body.bluntness);
      if (query.kind != QueryKind::kBox && radius - depth > -loose)
        blur(radius - depth);  // from the link to its middle
      if (body.kind != JudgeKind::kBox && body.kind != JudgeKind::kHull) tilt = std::fmin(2, tilt + 1e-3L);
      break;
    }
  }
  const Real extent = body.reach < kInfinity ? 2 * body.reach : 0;
  if (const Real below = support_of(body, normal) - dot(normal, at); !(below <= loose + tilt * extent))
    return "its link is beyond its plane by " + text(below);
  return {};
}

// What is wrong about one hit, given what its link may be.
std::string hit_fault(const QueryHit& hit, const JudgedLink& link, const Asked& asked, Exact exact,
                      const QueryTolerance& tolerance) {
  const Query& query = asked.query;
  const auto found = std::find_if(link.leaves.begin(), link.leaves.end(),
                                  [&](const JudgedLeaf& leaf) { return leaf.leaf->leaf == hit.leaf; });
  if (found == link.leaves.end()) return "its leaf " + std::to_string(hit.leaf) + " is not met, or not of its link";
  const Real distance = hit.distance;
  const Allowed slack = allowed(*found->leaf, asked, exact, tolerance);
  const Real off = tolerance.written * std::fabs(distance) + slack.in_double +
                   (exact == Exact::kNone ? 0 : slack.grow) +
                   (has_depth(query) ? slack.grow / 8 + kDepthRounding * (asked.own + found->leaf->lengths) : 0);
  if (distance > link.most + off) return "distance " + text(distance) + " is more than " + text(link.most);
  if (distance > found->most + off)
    return "distance " + text(distance) + " is more than its leaf's " + text(found->most);
  // The distance of a point from shapes is that of planes that part them, and a little less.
  const Real less = exact != Exact::kNone && query.kind == QueryKind::kPoint
                        ? kPlaneShare * (std::fabs(distance) + found->leaf->lengths)
                        : 0;
  if (distance < found->least - off - less) return "distance " + text(distance) + " is less than " + text(found->least);
  for (const JudgedLeaf& lower : link.leaves) {
    if (lower.leaf->leaf >= hit.leaf) break;
    if (lower.must && (!has_distance(query) || (lower.must_inside && distance == 0)))
      return "leaf " + std::to_string(lower.leaf->leaf) + " is as near as its leaf, and lower";
  }
  if (!has_distance(query)) {
    if (distance != 0 || !is_zero(hit.point) || !is_zero(hit.normal) || hit.inside)
      return "it has a distance, a point or a normal";
    return {};
  }
  if (query.kind == QueryKind::kRay || query.kind == QueryKind::kPoint) {
    if (distance < 0) return "its distance is below 0";
    if (distance > query.length * (1 + tolerance.written)) return "it is beyond the query's length";
  } else if (distance > 0) {
    return "its depth is below 0";
  }
  if (has_body(query.kind) && hit.inside) return "a shape begins inside";
  if (hit.inside) {
    if (!found->may_inside) return "it is said to begin inside";
    if (distance != 0 || !is_zero(hit.normal)) return "it begins inside, but has a distance or a normal";
  } else {
    if (found->must_inside) return "it is said not to begin inside";
    if (std::fabs(length_of(real(hit.normal)) - 1) > tolerance.normal)
      return "its normal has the length " + text(length_of(real(hit.normal)));
  }
  std::string fault;
  for (const QueryBody* const body : bodies_of(*found->leaf, query, exact)) {
    fault = geometry_fault(hit, *body, asked, slack, tolerance);
    if (fault.empty()) break;
    if (body->kind != JudgeKind::kHalfSpace) continue;
    const QueryBody within = clipped(found->leaf->box.box, *body);
    if (!within.vertices.empty()) fault = geometry_fault(hit, within, asked, slack, tolerance);
    if (!fault.empty()) fault = geometry_fault(hit, found->leaf->box, asked, slack, tolerance);
    if (fault.empty()) break;
  }
  return fault;
}

bool is_before(const QueryHit& a, const QueryHit& b) {
  if (a.query != b.query) return a.query < b.query;
  if (a.distance != b.distance) return a.distance < b.distance;
  return key_of(a) < key_of(b);
}

// What is wrong with hits whatever was asked.
std::string list_fault(const QueryJob& done, Span<const QueryHit> hits) {
  for (std::size_t i = 0; i < hits.size; ++i) {
    const QueryHit& hit = hits[i];
    if (hit.query >= done.queries.size) return "hit " + std::to_string(i) + " is of no query";
    for (const float v :
         {hit.distance, hit.point[0], hit.point[1], hit.point[2], hit.normal[0], hit.normal[1], hit.normal[2]})
      if (!std::isfinite(v)) return name_of(hit) + "a number is not finite";
    if (i > 0 && !is_before(hits[i - 1], hit)) return name_of(hit) + "it is not behind the hit before it";
  }
  return {};
}

// Is said about a link that the last hit should have made way for.
constexpr const char* kLeftOut = "it is nearer than the last hit, but left out; its distance is at most ";

// What is wrong with the hits of one query, which are in order.
std::string query_fault(const std::vector<JudgedLink>& links, const QueryJob& done, std::size_t index,
                        Span<const QueryHit> hits, const QueryTolerance& tolerance) {
  const Query& query = done.queries[index];
  const std::string words = "query " + std::to_string(index) + ": ";
  const bool must_any = std::any_of(links.begin(), links.end(), [](const JudgedLink& link) { return link.must; });
  if (!done.found.empty()) {
    const std::uint8_t found = done.found[index];
    if (found > 1) return words + "its byte is " + std::to_string(found);
    if (found == 0 && must_any) return words + "it is said to find nothing";
    if (found == 1 && links.empty()) return words + "it is said to find something";
    if (query.want != QueryWant::kAny && (found == 1) != !hits.empty()) return words + "its byte and hits differ";
  }
  if (query.want == QueryWant::kAny) return hits.empty() ? "" : words + "it has hits, but does not want any";
  const std::size_t most = query.want == QueryWant::kClosest ? 1 : query.max_hits;
  if (hits.size > most) return words + "it has " + std::to_string(hits.size) + " hits";
  std::vector<bool> is_found(links.size());
  for (const QueryHit& hit : hits) {
    const auto link = std::lower_bound(links.begin(), links.end(), key_of(hit),
                                       [](const JudgedLink& a, const auto& key) { return key_of(a) < key; });
    if (link == links.end() || key_of(*link) != key_of(hit)) return name_of(hit) + "it is not met";
    const std::size_t at = static_cast<std::size_t>(link - links.begin());
    if (is_found[at]) return name_of(hit) + "it is there twice";
    is_found[at] = true;
    const std::string fault = hit_fault(hit, *link, ask(query, link->instance->origin), done.exact, tolerance);
    if (!fault.empty()) return name_of(hit) + fault;
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    const JudgedLink& link = links[i];
    if (is_found[i] || !link.must) continue;
    const std::string name = name_of(index, link.instance->batch, link.instance->instance, link.link);
    if (hits.size < most) return name + "it is lost; its distance is at most " + text(link.most);
    const QueryHit& last = hits[hits.size - 1];
    const bool is_level = last.distance == 0 && (!has_distance(query) || link.must_inside);
    const Asked asked = ask(query, link.instance->origin);
    Real off = tolerance.written * std::fabs(Real{last.distance});
    for (const JudgedLeaf& leaf : link.leaves) {
      const Allowed slack = allowed(*leaf.leaf, asked, done.exact, tolerance);
      off =
          larger(off, tolerance.written * std::fabs(Real{last.distance}) + slack.in_double +
                          (has_depth(query) ? slack.grow / 8 + kDepthRounding * (asked.own + leaf.leaf->lengths) : 0));
    }
    if (is_level ? key_of(link) < key_of(last) : link.most < last.distance - off)
      return name + kLeftOut + text(link.most);
  }
  return {};
}

// What QueryCounts::off says about a hit of a link.
double off_of(const QueryHit& hit, const JudgedLink& link, const Query& query, Exact exact,
              const QueryTolerance& tolerance) {
  const auto leaf = std::find_if(link.leaves.begin(), link.leaves.end(),
                                 [&](const JudgedLeaf& judged) { return judged.leaf->leaf == hit.leaf; });
  if (leaf == link.leaves.end() || hit.inside) return 0;
  const Asked asked = ask(query, link.instance->origin);
  Real off = kInfinity;
  for (const QueryBody* const body : bodies_of(*leaf->leaf, query, exact)) {
    off = std::fmin(off, distance_of_point(*body, asked.at + real(hit.point)));
    if (body->kind == JudgeKind::kHalfSpace)  // or the hit is that of the box
      off = std::fmin(off, distance_of_point(leaf->leaf->box, asked.at + real(hit.point)));
  }
  if (query.kind == QueryKind::kPoint && exact == Exact::kNone && leaf->must)
    off = larger(off, std::fabs(Real{hit.distance} - leaf->most));
  const Real written = tolerance.written * (norm_1(real(hit.point)) + std::fabs(Real{hit.distance}));
  off -= written + allowed(*leaf->leaf, asked, exact, tolerance).in_double;
  return larger(0.0, static_cast<double>(off / (leaf->leaf->lengths + asked.own + kTiny) * 0x1p24L));
}

}  // namespace

QueryInstance query_instance(BatchSlot batch, const Rig& rig, const Poses& poses, std::uint32_t index,
                             std::uint32_t layers) {
  QueryInstance out{batch, index, layers, exact_origin(poses, index), {}};
  const std::vector<ExactBox> boxes = exact_leaf_boxes(rig, poses, index);
  for (std::size_t i = 0; i < rig.leaves.size(); ++i) {
    const Leaf& leaf = rig.leaves[i];
    const ExactPose pose = exact_pose(poses, index, leaf.link);
    QueryLeaf posed{static_cast<std::uint16_t>(leaf.link), static_cast<std::uint16_t>(i), 0, {}, {}};
    posed.box.box = boxes[i];
    complete(posed.box);
    posed.lengths = half_sum(boxes[i]) + pose.scale * norm_1(convert<Real>(to_vec3(leaf.box.center))) + norm_1(pose.at);
    for (const ConvexPart& part : leaf.parts) {
      QueryBody body;
      switch (part.kind) {
        case ShapeKind::kBox: body.kind = JudgeKind::kBox; break;
        case ShapeKind::kEllipsoid: body.kind = JudgeKind::kEllipsoid; break;
        case ShapeKind::kCapsule: body.kind = JudgeKind::kCapsule; break;
        case ShapeKind::kSphere: body.kind = JudgeKind::kSphere; break;
        case ShapeKind::kCylinder: body.kind = JudgeKind::kCylinder; break;
        case ShapeKind::kHalfSpace: body.kind = JudgeKind::kHalfSpace; break;
        case ShapeKind::kConvexHull: body.kind = JudgeKind::kHull; break;
      }
      const Real q[4] = {part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]};
      quaternion_matrix(q, body.column);
      for (auto& column : body.column) store(rotated(pose.column, to_vec3(column)), column);
      body.at = pose.at + rotated(pose.column, pose.scale * convert<Real>(to_vec3(part.position)));
      for (std::size_t k = 0; k < 3; ++k) body.size[k] = pose.scale * part.size[k];
      for (std::size_t v = 0; v + 2 < part.vertices.size; v += 3)
        body.vertices.push_back(
            rotated(body.column, pose.scale * Point{{part.vertices[v], part.vertices[v + 1], part.vertices[v + 2]}}));
      if (body.kind == JudgeKind::kBox) {
        store(body.at, body.box.center);
        for (std::size_t k = 0; k < 3; ++k) store(to_vec3(body.column[k]), body.box.axis[k]);
        for (std::size_t k = 0; k < 3; ++k) body.box.half[k] = body.size[k];
      }
      complete(body);
      posed.parts.push_back(std::move(body));
    }
    out.leaves.push_back(std::move(posed));
  }
  return out;
}

std::vector<JudgedLink> judge_query(const QueryScene& scene, const Query& query, Span<const QueryPlane> planes,
                                    Exact exact, const QueryTolerance& tolerance) {
  std::vector<JudgedLink> out;
  for (const QueryInstance& instance : scene) {
    if (!is_looked_at(instance, query)) continue;
    const Asked asked = ask(query, instance.origin);
    const std::size_t first = out.size();
    for (const QueryLeaf& leaf : instance.leaves) {
      const std::optional<JudgedLeaf> judged = judge_leaf(leaf, asked, planes, exact, tolerance);
      if (!judged) continue;
      const auto link = std::find_if(out.begin() + static_cast<std::ptrdiff_t>(first), out.end(),
                                     [&](const JudgedLink& known) { return known.link == leaf.link; });
      JudgedLink& into = link != out.end() ? *link : out.emplace_back();
      merge(*judged, into.leaves.empty(), into);
      into.instance = &instance;
      into.link = leaf.link;
      into.leaves.push_back(*judged);
    }
  }
  std::sort(out.begin(), out.end(), [](const JudgedLink& a, const JudgedLink& b) { return key_of(a) < key_of(b); });
  return out;
}

std::string fault_of(const QueryScene& scene, const QueryJob& done, const QueryTolerance& tolerance) {
  if (done.hit_count != done.hits_needed) return "hit_count and hits_needed differ";
  if (done.hit_count > done.hits.size) return "there are more hits than room";
  const Span<const QueryHit> hits = {done.hits.data, done.hit_count};
  if (const std::string fault = list_fault(done, hits); !fault.empty()) return fault;
  std::size_t begin = 0;
  for (std::size_t q = 0; q < done.queries.size; ++q) {
    std::size_t end = begin;
    while (end < hits.size && hits[end].query == q) ++end;
    const std::vector<JudgedLink> links = judge_query(scene, done.queries[q], done.planes, done.exact, tolerance);
    const std::string fault = query_fault(links, done, q, {hits.data + begin, end - begin}, tolerance);
    if (!fault.empty()) return fault;
    begin = end;
  }
  return {};
}

QueryCounts count_query(const QueryScene& scene, const QueryJob& done, std::size_t index, Span<const QueryHit> hits,
                        const QueryTolerance& tolerance) {
  const Query& query = done.queries[index];
  const std::vector<JudgedLink> links = judge_query(scene, query, done.planes, done.exact, tolerance);
  QueryCounts out;
  out.hits = hits.size;
  out.fault = list_fault(done, hits);
  if (out.fault.empty()) out.fault = query_fault(links, done, index, hits, tolerance);
  for (const JudgedLink& link : links) out.must += link.must;
  const bool has_distances = query.kind == QueryKind::kRay || query.kind == QueryKind::kPoint;
  std::uint64_t must_found = 0;
  for (const QueryHit& hit : hits) {
    const auto link = std::lower_bound(links.begin(), links.end(), key_of(hit),
                                       [](const JudgedLink& a, const auto& key) { return key_of(a) < key; });
    const bool may = link != links.end() && key_of(*link) == key_of(hit);
    out.extra += !may;
    must_found += may && link->must;
    if (may && has_distances) out.off = larger(out.off, off_of(hit, *link, query, done.exact, tolerance));
  }
  if (query.want == QueryWant::kAny) {
    const bool found = !done.found.empty() && done.found[index] != 0;
    out.lost = !found && out.must > 0;
    out.extra = found && links.empty();
  } else {
    // Where hits have taken all the room, those that are left out are farther, or there is a fault.
    const std::size_t most = query.want == QueryWant::kClosest ? 1 : query.max_hits;
    if (hits.size < most) out.lost = out.must - must_found;
    if (out.lost == 0 && out.fault.find(kLeftOut) != std::string::npos) out.lost = 1;
  }
  return out;
}

double needed_growth(const QueryScene& scene, const QueryJob& done) {
  if (!fault_of(scene, done).empty()) return HUGE_VAL;
  const QueryTolerance usual;
  double growth = static_cast<double>(usual.leaf) * 0x1p24;
  while (growth >= 1) {
    QueryTolerance less;
    less.leaf = less.query = static_cast<Real>(growth) * 0x1p-25L;
    if (!fault_of(scene, done, less).empty()) return growth;
    growth /= 2;
  }
  return 0;
}

}  // namespace cab::oracle
