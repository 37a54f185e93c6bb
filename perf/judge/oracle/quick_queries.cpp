// The quick judge of queries against boxes, in double: of rays by slabs along the axes of each box, of spheres and
// points by a point of the box, which bounds the distance from above, and a plane beside it, which bounds it from
// below.
#include "perf/judge/oracle/quick_queries.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace cab::oracle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What rounding in double may move, as a share of all lengths that a coordinate is a sum of. Some fifty roundings of
// 2^-53 each go into one at most, and the axes are orthonormal to 2^-10.
constexpr double kRounding = 0x1p-46;

// A ray counts as parallel to a face if it comes nearer by less than this per length.
constexpr double kParallel = 0x1p-30;

// How far axes may be off orthonormal for the bounds of errors to hold.
constexpr double kSoundAxes = 0x1p-10;

// How often a point of a box is moved along all axes towards another point. After three times what is left is the cube
// of what the axes are off orthonormal; the bounds hold after any number.
constexpr int kSweeps = 3;

// As in query_judge.cpp, for what underflows.
constexpr double kTiny = 0x1p-120;

// The part of a ray between two parameters. Empty if near > far.
struct Range {
  double near, far;

  void cut(double a, double b) {
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  bool is_empty() const { return !(near <= far); }
};

double dot(const double (&a)[3], const double (&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Where a query is, relative to the centre of a box.
struct Place {
  double at[3];
  double apart;      // of the query from the instance's origin, |.|_1
  double in_double;  // what is rounded in double, as of query_judge.cpp
  double grow;       // how much the leaf grows
};

// Whether a point, relative to the box's centre, is inside and farther than `by` from all faces.
bool has_inside(const QuickBox& box, const double (&at)[3], double by) {
  bool out = true;
  for (std::size_t k = 0; k < 3; ++k) out = out && std::fabs(dot(box.dual[k], at)) + by < box.half[k];
  return out;
}

// A range that has the distance of a point from a box whose half extents are `more` larger, but for rounding.
Range distance_of(const QuickBox& box, double more, const double (&at)[3]) {
  double x[3] = {}, rest[3] = {at[0], at[1], at[2]};  // the point less that of the box
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (std::size_t k = 0; k < 3; ++k) {
      const double most = box.half[k] + more, next = std::clamp(x[k] + dot(box.axis[k], rest), -most, most);
      for (std::size_t c = 0; c < 3; ++c) rest[c] -= (next - x[k]) * box.axis[k][c];
      x[k] = next;
    }
  const double size = std::sqrt(dot(rest, rest));
  if (!(size > kTiny)) return {0, size};
  // The plane across the rest that touches the box: no point of the box is nearer than the plane.
  double beyond = dot(rest, at);
  for (std::size_t k = 0; k < 3; ++k) beyond -= (box.half[k] + more) * std::fabs(dot(rest, box.axis[k]));
  return {beyond / size, size};
}

// What doubles say about a sphere, or a point and what is within its length.
QuickTouch touch_ball(const Query& query, const QuickBox& box, const Place& place) {
  QuickTouch out;
  const bool is_sphere = query.kind == QueryKind::kSphere;
  const double reach = static_cast<double>(is_sphere ? query.radius : query.length);
  const double most = reach + (is_sphere ? 0 : place.in_double);
  const double error = kRounding * (place.apart + box.away + box.reach + 4 * place.grow) + kTiny;
  const double ball = most + box.reach + 4 * place.grow + error;
  if (dot(place.at, place.at) > 1.01 * (ball * ball)) {
    out.certain = true;
    return out;
  }
  Range distance = {0, 0};  // from the distance of the grown box to that of the box as given
  if (!has_inside(box, place.at, error))
    distance = {distance_of(box, place.grow, place.at).near - error, distance_of(box, 0, place.at).far + error};
  out.certain = distance.near > most || distance.far <= reach;
  if (!(distance.far <= reach)) return out;
  out.may = out.must = true;
  out.at_zero = is_sphere || has_inside(box, place.at, 2 * place.grow + error);
  if (is_sphere) return out;
  out.may_inside = distance.near <= 0;
  out.least = std::max(0.0, distance.near);
  out.most = distance.far;
  return out;
}

// What doubles say about a ray.
QuickTouch touch_ray(const QuickAsked& asked, const QuickBox& box, const Place& place) {
  QuickTouch out;
  const auto& direction = asked.direction;
  const double grow = place.grow, apart = place.apart;

  // The ray from its point that is nearest to the box's centre.
  double at[3], along = 0;
  for (std::size_t c = 0; c < 3; ++c) along -= place.at[c] * direction[c];
  const double length = static_cast<double>(asked.query.length), start = std::clamp(along, 0.0, length);
  double aside = 0, aside_sq = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    at[c] = place.at[c] + start * direction[c];
    aside += std::fabs(at[c]);
    aside_sq += at[c] * at[c];
  }

  // What rounding may move: the coordinates, and the parameter of a point of the box.
  const double farthest = aside + 2 * (box.reach + 3 * grow);
  const double error = kRounding * (apart + box.away + farthest) + kTiny;

  // A ball about the box that has grown. No point of the ray is nearer to its centre than `at`, but for its rounding
  // and that of `start`, which moves it along the ray.
  const double ball = (box.reach + 4 * grow) + 8 * error;
  if (aside_sq > 1.01 * (ball * ball)) {
    out.certain = true;
    return out;
  }
  if (!(error < box.lengths)) return out;  // too far for doubles
  const double late = 4 * error + kRounding * start;

  // `wide`: where the ray may be in the box that has grown. `sure`: where it is in the box as given.
  Range wide = {-start - late, length - start + late}, sure = {late - start, length - start - late};
  if (start == 0) sure = {0, length};  // nothing is rounded there
  if (start == length) sure.far = 0;
  bool is_sure = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const double from = dot(box.dual[k], at), speed = dot(box.dual[k], direction);
    const double more = box.half[k] + (grow + error), less = box.half[k] - error;
    if (std::fabs(speed) < kParallel) {
      const double drift = farthest * (std::fabs(speed) + kRounding);
      if (std::fabs(from) > more + drift) {
        out.certain = true;
        return out;
      }
      is_sure = is_sure && std::fabs(from) + drift < less;
      continue;
    }
    wide.cut((-more - from) / speed, (more - from) / speed);
    sure.cut((-less - from) / speed, (less - from) / speed);
    is_sure = is_sure && less > 0;
  }
  if (wide.is_empty()) {
    out.certain = true;
    return out;
  }
  if (!is_sure || sure.is_empty()) return out;
  out.certain = out.may = out.must = true;
  out.least = std::max(0.0, start + wide.near - late);
  out.most = std::max(0.0, start + sure.near + late);
  out.may_inside = wide.near <= late - start;
  out.at_zero = has_inside(box, place.at, 2 * grow + error);
  return out;
}

}  // namespace

QuickQueries::QuickQueries(const QueryScene& scene, const QueryTolerance& tolerance)
    : scene_(scene), tolerance_(tolerance) {
  for (std::uint32_t i = 0; i < scene.size(); ++i) {
    const QueryInstance& instance = scene[i];
    begin_.push_back(boxes_.size());
    for (const QueryLeaf& leaf : instance.leaves) {
      const ExactBox& box = leaf.box.box;
      QuickBox& out = boxes_.emplace_back();
      out.instance = i;
      out.link = leaf.link;
      out.leaf = leaf.leaf;
      out.lengths = static_cast<double>(leaf.lengths) * (1 + kRounding);
      const Point axes[3] = {axis_of(box, 0), axis_of(box, 1), axis_of(box, 2)};
      const Real volume = dot(axes[0], cross(axes[1], axes[2]));
      out.is_sound = true;
      out.reach = out.away = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Point dual = 1 / volume * cross(axes[(k + 1) % 3], axes[(k + 2) % 3]);
        for (std::size_t c = 0; c < 3; ++c) {
          out.axis[k][c] = static_cast<double>(axes[k][c]);
          out.dual[k][c] = static_cast<double>(dual[c]);
        }
        for (std::size_t j = 0; j < 3; ++j) {
          const double off = static_cast<double>(dot(axes[k], axes[j])) - (j == k ? 1 : 0);
          out.is_sound = out.is_sound && std::fabs(off) <= kSoundAxes;
        }
        out.half[k] = static_cast<double>(box.half[k]);
        out.center[k] = static_cast<double>(box.center[k]);
        out.origin[k] = static_cast<double>(instance.origin[k]);
        out.reach += 1.01 * out.half[k];
        out.away += std::fabs(out.center[k]);
      }
      QueryInstance alone = instance;
      alone.leaves = {leaf};
      alone_.push_back({std::move(alone)});
    }
  }
  begin_.push_back(boxes_.size());
}

QuickAsked::QuickAsked(const Query& of) : query(of) {
  if (query.kind != QueryKind::kRay) return;
  for (std::size_t c = 0; c < 3; ++c) direction[c] = static_cast<double>(query.direction[c]);
  const double largest = std::max({std::fabs(direction[0]), std::fabs(direction[1]), std::fabs(direction[2])});
  if (!(largest > 0)) return;
  for (double& d : direction) d /= largest;
  const double size = std::sqrt(dot(direction, direction));
  for (double& d : direction) d /= size;
}

QuickTouch QuickQueries::touch(const QuickAsked& asked, std::size_t leaf) const {
  const Query& query = asked.query;
  const QuickBox& box = boxes_[leaf];
  if (!box.is_sound) return {};
  Place place = {};
  for (std::size_t c = 0; c < 3; ++c) {
    const double from_origin = query.position[c] - box.origin[c];
    place.apart += std::fabs(from_origin);
    place.at[c] = from_origin - box.center[c];
  }
  const double own = query.kind == QueryKind::kSphere ? static_cast<double>(query.radius) : 0;
  place.in_double = static_cast<double>(tolerance_.apart) * place.apart + kTiny;
  place.grow = static_cast<double>(tolerance_.leaf) * box.lengths + static_cast<double>(tolerance_.query) * own +
               place.in_double;
  return query.kind == QueryKind::kRay ? touch_ray(asked, box, place) : touch_ball(query, box, place);
}

QuickTouch QuickQueries::exact_touch(const QuickAsked& asked, std::size_t leaf) const {
  const Query& query = asked.query;
  QuickTouch out;
  const std::vector<JudgedLink> links = judge_query(alone_[leaf], query, {}, Exact::kNone, tolerance_);
  if (links.empty()) return out;
  const JudgedLink& link = links[0];
  out.may = true;
  out.must = link.must;
  out.may_inside = query.kind != QueryKind::kSphere && link.may_inside;
  out.at_zero = query.kind == QueryKind::kSphere ? link.must : link.must_inside;
  out.least = static_cast<double>(link.least);
  out.most = link.must ? static_cast<double>(link.most) : kInfinity;
  return out;
}

QuickCounts QuickQueries::count(const QueryJob& done, std::size_t index, Span<const QueryHit> hits) const {
  const Query& query = done.queries[index];
  QuickCounts out;
  using Key = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  // batch, instance, link
  const auto key_of = [](const QueryHit& hit) { return Key{hit.batch.value, hit.instance, hit.link}; };
  const auto fault = [&](const char* what, const Key& key) {
    if (!out.fault.empty()) return;
    out.fault = "query " + std::to_string(index) + ", batch " + std::to_string(std::get<0>(key)) + ", instance " +
                std::to_string(std::get<1>(key)) + ", link " + std::to_string(std::get<2>(key)) + ": " + what;
  };
  const std::size_t wanted = query.want == QueryWant::kAny ? 0 : query.want == QueryWant::kClosest ? 1 : query.max_hits;
  for (std::size_t i = 1; i < hits.size; ++i)
    if (!(std::make_tuple(hits[i - 1].distance, key_of(hits[i - 1])) <
          std::make_tuple(hits[i].distance, key_of(hits[i]))))
      fault("it is not behind the hit before it", key_of(hits[i]));
  if (hits.size > wanted) fault("it has more hits than it wants", key_of(hits[wanted]));
  std::vector<std::size_t> by_key(hits.size);
  std::iota(by_key.begin(), by_key.end(), std::size_t{0});
  std::sort(by_key.begin(), by_key.end(),
            [&](std::size_t a, std::size_t b) { return key_of(hits[a]) < key_of(hits[b]); });

  // A link that may be found, with its hit, if it has one, and what is known of its leaves.
  struct Link {
    Key key;
    std::size_t hit;  // hits.size: none
    bool must = false, at_zero = false;
    std::uint16_t lowest = 0;  // at_zero: the lowest leaf that is
    double most = kInfinity;
  };
  const auto written = static_cast<double>(tolerance_.written);
  const double longest = query.kind == QueryKind::kSphere ? 0 : static_cast<double>(query.length) * (1 + written);
  std::vector<Link> links;
  const QuickAsked asked(query);
  std::vector<bool> is_known(hits.size);
  bool may_any = false;
  for (std::uint32_t i = 0; i < scene_.size(); ++i) {
    const QueryInstance& instance = scene_[i];
    const bool is_ignored =
        slot_of(query.ignored_batch).value == instance.batch.value && query.ignored_instance == instance.instance;
    if (is_ignored || (instance.layers & query.layer_mask) == 0) continue;
    double apart = 0, farthest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double by = std::fabs(query.position[c] - static_cast<double>(instance.origin[c]));
      apart += by;
      farthest = std::max(farthest, by);
    }
    if (farthest > kMaxQueryCoordinate) continue;
    const double in_double = static_cast<double>(tolerance_.apart) * apart + kTiny;
    const auto off_at = [&](double distance) {
      return query.kind == QueryKind::kSphere ? 0 : written * distance + in_double;
    };
    links.clear();
    for (std::size_t b = begin_[i]; b < begin_[i + 1]; ++b) {
      const QuickBox& box = boxes_[b];
      ++out.pairs;
      QuickTouch known = touch(asked, b);
      if (!known.certain) {
        ++out.uncertain;
        known = exact_touch(asked, b);
      }
      if (!known.may) continue;
      may_any = true;
      const Key key = {instance.batch.value, instance.instance, box.link};
      auto link = std::find_if(links.begin(), links.end(), [&](const Link& one) { return one.key == key; });
      if (link == links.end()) {
        const auto at = std::lower_bound(by_key.begin(), by_key.end(), key,
                                         [&](std::size_t hit, const Key& of) { return key_of(hits[hit]) < of; });
        const bool is_found = at != by_key.end() && key_of(hits[*at]) == key;
        link = links.insert(links.end(), {key, is_found ? *at : hits.size});
      }
      link->must |= known.must;
      link->most = std::min(link->most, known.most);
      if (known.at_zero && !link->at_zero) link->lowest = box.leaf;
      link->at_zero |= known.at_zero;
      if (link->hit == hits.size || hits[link->hit].leaf != box.leaf) continue;
      const QueryHit& hit = hits[link->hit];
      is_known[link->hit] = true;
      const double distance = static_cast<double>(hit.distance), off = off_at(distance);
      if (!(distance >= known.least - off && distance <= std::min(known.most + off, longest)))
        fault("its distance is not that of its leaf", key);
      if (hit.inside && (distance != 0 || !known.may_inside)) fault("it is said to begin inside", key);
    }
    for (const Link& link : links) {
      out.must += link.must;
      if (link.hit < hits.size) {
        const QueryHit& hit = hits[link.hit];
        const double distance = static_cast<double>(hit.distance);
        if (distance > link.most + off_at(distance)) fault("another leaf is nearer", link.key);
        if (distance == 0 && link.at_zero && link.lowest < hit.leaf) fault("a lower leaf is as near", link.key);
      }
      if (!link.must || link.hit < hits.size || query.want == QueryWant::kAny) continue;
      if (hits.size >= wanted) {  // those that have taken the room must be ahead
        const QueryHit& last = hits[hits.size - 1];
        const double distance = static_cast<double>(last.distance);
        const bool is_level = distance == 0 && link.at_zero;
        if (!(is_level ? link.key < key_of(last) : link.most < distance - off_at(distance))) continue;
      }
      ++out.lost;
      fault("it is lost", link.key);
    }
  }
  for (std::size_t h = 0; h < hits.size; ++h) {
    if (is_known[h]) continue;
    ++out.extra;
    fault("it is not met, or there twice", key_of(hits[h]));
  }
  if (done.found.empty()) return out;
  const bool found = done.found[index] != 0;
  if (found && !may_any && hits.empty()) {
    ++out.extra;
    fault("it is said to find something", {});
  }
  if (!found && out.must > 0 && out.lost == 0) {
    ++out.lost;
    fault("it is said to find nothing", {});
  }
  return out;
}

}  // namespace cab::oracle
