// The quick judge of queries against boxes, in double. Rays are judged by slabs along the axes of each box; spheres,
// capsules and points by a point of the box, which bounds the distance from above, and a plane beside it, which bounds
// it from below; boxes by separating axes; regions by the corner of the box that is farthest inside each plane.
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

// Edges of two boxes count as parallel if the sine of their angle is less. Then their cross product is too short for
// rounding to tell on which side of it the boxes are.
constexpr double kParallelEdges = 0x1p-26;

// As in query_judge.cpp: for what underflows, and from where and by which share of the distance a query must be met to
// be sure of it. Both are a little more careful here.
constexpr double kTiny = 0x1p-120;
constexpr double kFar = 0x1p35;
constexpr double kFarShare = 0x1p-57;

// A query and a leaf that are apart; that meet, of a kind of query without a distance; and that meet once the leaf has
// grown, but not before.
constexpr QuickTouch kApart = {.certain = true};
constexpr QuickTouch kMet = {.certain = true, .may = true, .must = true, .at_zero = true};
constexpr QuickTouch kMetGrown = {.certain = true, .may = true, .most = kInfinity};

bool has_distance(QueryKind kind) { return kind == QueryKind::kRay || kind == QueryKind::kPoint; }

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
  double shrink;     // what a query must be met by to be sure of it
};

// A bound of what rounding may move of a query and a box that has grown, both no larger than said.
double rounding_of(const QuickBox& box, const Place& place, double size) {
  return kRounding * (place.apart + box.away + box.reach + 4 * place.grow + size) + kTiny;
}

// Whether a box that has grown is so far away that no ball about it meets one of this radius about the query.
bool is_far(const QuickBox& box, const Place& place, double radius, double error) {
  const double ball = radius + box.reach + 4 * place.grow + error;
  return dot(place.at, place.at) > 1.01 * (ball * ball);
}

// Whether a point, relative to the box's centre, is inside and farther than `by` from all faces.
bool has_inside(const QuickBox& box, const double (&at)[3], double by) {
  bool out = true;
  for (std::size_t k = 0; k < 3; ++k) out = out && std::fabs(dot(box.dual[k], at)) + by < box.posed.half[k];
  return out;
}

// Where in -1 .. 1 the point at + s * along is nearest to a box whose half extents are `more` larger, but for rounding
// and for what its axes are off orthonormal; of a segment that goes through the box, its middle there.
double nearest_along(const QuickBox& box, double more, const double (&at)[3], const double (&along)[3]) {
  double from[3], speed[3], most[3], ends[6];
  Range in = {-1, 1};
  for (std::size_t k = 0; k < 3; ++k) {
    from[k] = dot(box.dual[k], at);
    speed[k] = dot(box.dual[k], along);
    most[k] = box.posed.half[k] + more;
    const bool is_still = speed[k] == 0;
    ends[2 * k] = is_still ? 0 : (-most[k] - from[k]) / speed[k];
    ends[2 * k + 1] = is_still ? 0 : (most[k] - from[k]) / speed[k];
    if (!is_still)
      in.cut(ends[2 * k], ends[2 * k + 1]);
    else if (std::fabs(from[k]) > most[k])
      in.far = -kInfinity;
  }
  if (!in.is_empty()) return (in.near + in.far) / 2;
  // Half the slope of the squared distance, which grows along the segment, and is straight between the ends.
  const auto slope_at = [&](double s) {
    double slope = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = from[k] + s * speed[k];
      slope += speed[k] * (x - std::clamp(x, -most[k], most[k]));
    }
    return slope;
  };
  double low = -1, high = 1, slope_low = slope_at(low), slope_high = slope_at(high);
  if (slope_low >= 0) return low;
  if (slope_high <= 0) return high;
  for (const double end : ends) {
    if (!(end > low && end < high)) continue;
    const double slope = slope_at(end);
    (slope < 0 ? low : high) = end;
    (slope < 0 ? slope_low : slope_high) = slope;
  }
  return low + (high - low) * (slope_low / (slope_low - slope_high));
}

// A range that has the distance of a capsule's segment, or else of the query's position, from a box whose half extents
// are `more` larger.
Range distance_of(const QuickAsked& asked, const QuickBox& box, const Place& place, double more) {
  const auto& along = asked.along;
  const double s = asked.reach > 0 ? nearest_along(box, more, place.at, along) : 0;
  const double error = rounding_of(box, place, 2 * std::fabs(s) * asked.reach);
  double x[3] = {}, rest[3];  // the segment's point, less that of the box
  for (std::size_t c = 0; c < 3; ++c) rest[c] = place.at[c] + s * along[c];
  if (has_inside(box, rest, error - more)) return {0, 0};
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (std::size_t k = 0; k < 3; ++k) {
      const double most = box.posed.half[k] + more, next = std::clamp(x[k] + dot(box.posed.axis[k], rest), -most, most);
      for (std::size_t c = 0; c < 3; ++c) rest[c] -= (next - x[k]) * box.posed.axis[k][c];
      x[k] = next;
    }
  const double far = std::sqrt(dot(rest, rest));
  if (!(far > kTiny)) return {0, far + error};
  // The plane across the rest that touches the box: no point of the box is nearer than the plane. Between the ends of a
  // segment the rest is across it, but for what the axes are off orthonormal, which counts along all of it.
  if (asked.reach > 0 && std::fabs(s) < 1) {
    const double turn = dot(rest, along) / dot(along, along);
    for (std::size_t c = 0; c < 3; ++c) rest[c] -= turn * along[c];
  }
  const double size = std::sqrt(dot(rest, rest));
  if (!(size > far / 2)) return {0, far + error};
  double beyond = dot(rest, place.at) - std::fabs(dot(rest, along));
  for (std::size_t k = 0; k < 3; ++k) beyond -= (box.posed.half[k] + more) * std::fabs(dot(rest, box.posed.axis[k]));
  return {beyond / size - (error + 2 * kRounding * asked.reach), far + error};
}

// What doubles say about a sphere, a capsule, or a point and what is within its length.
QuickTouch touch_round(const QuickAsked& asked, const QuickBox& box, const Place& place) {
  const Query& query = asked.query;
  const bool is_point = query.kind == QueryKind::kPoint;
  const double reach = static_cast<double>(is_point ? query.length : query.radius);
  const double most = reach + (is_point ? place.in_double : 0);
  const double error = rounding_of(box, place, 0);
  if (is_far(box, place, most + asked.reach, error)) return kApart;
  Range given = distance_of(asked, box, place, 0);
  given.far += place.shrink;
  if (!is_point && given.far <= reach) return kMet;
  const Range grown = distance_of(asked, box, place, place.grow);
  if (grown.near > most) return kApart;
  if (!is_point) return given.near > reach && grown.far <= most ? kMetGrown : QuickTouch{};
  QuickTouch out;
  if (!(given.far <= reach)) return out;
  out.certain = out.may = out.must = true;
  out.at_zero = has_inside(box, place.at, 2 * place.grow + error);
  out.may_inside = grown.near <= 0;
  out.least = std::max(0.0, grown.near);
  out.most = given.far;
  return out;
}

// Whether two boxes overlap for sure, by their gaps times lengths on all axes. error: what those may be off, kRounding
// of the boxes' sizes and of how far apart they are.
bool surely_overlap(const OracleBox<double>& a, const OracleBox<double>& b, const AxisGaps& gaps, double error) {
  if (*std::max_element(gaps.begin(), gaps.end()) < -error) return true;
  const AxisGaps lengths = axis_lengths(a, b);
  double turned = 0, largest = -kInfinity;
  for (std::size_t k = 0; k < kSeparatingAxisCount; ++k) {
    const bool is_parallel = k >= 6 && lengths[k] < kParallelEdges;
    if (is_parallel)
      turned += lengths[k] + kRounding / 16;
    else
      largest = std::max(largest, gaps[k]);
  }
  // With edges of b turned to be parallel to those of a, their cross products need not be looked at. Each turn moves
  // points of b by its angle times a half extent, and an axis by 1.5 times that angle at most. The length of a cross
  // product is off by 8 roundings at most.
  return largest + error + 8 * turned * (error / kRounding) < 0;
}

// What doubles say about a box.
QuickTouch touch_box(const QuickAsked& asked, const QuickBox& box, const Place& place) {
  const double error = rounding_of(box, place, asked.own);
  if (is_far(box, place, asked.reach, error)) return kApart;
  const auto largest = [](const AxisGaps& gaps) { return *std::max_element(gaps.begin(), gaps.end()); };
  const Vec3<double> offset = to_vec3(place.at);
  const AxisGaps gaps = axis_numerators(box.posed, asked.box, offset);
  // No axis is longer than 1.01, nor is a box that grows larger along it by more than three times as much.
  if (largest(gaps) > 4 * place.grow + error) return kApart;
  const bool is_sure = *std::min_element(asked.box.half, asked.box.half + 3) >= place.shrink;
  if (is_sure && surely_overlap(box.posed, asked.box, gaps, error)) return kMet;
  OracleBox<double> wide = box.posed;
  for (double& half : wide.half) half += place.grow;
  const AxisGaps wide_gaps = axis_numerators(wide, asked.box, offset);
  if (largest(wide_gaps) > error) return kApart;
  const bool is_grown = largest(gaps) > error && surely_overlap(wide, asked.box, wide_gaps, error);
  return is_grown ? kMetGrown : QuickTouch{};
}

// What doubles say about a region.
QuickTouch touch_region(const QuickAsked& asked, const QuickBox& box, const Place& place) {
  bool is_met = true;
  for (const QuickPlane& plane : asked.region) {
    const double error = rounding_of(box, place, std::fabs(plane.offset));
    double nearest = -dot(plane.normal, place.at), growth = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double across = std::fabs(dot(plane.normal, box.posed.axis[k]));
      nearest -= box.posed.half[k] * across;
      growth += place.grow * across;
    }
    if (nearest - growth > plane.offset + place.in_double + error) return kApart;
    is_met = is_met && nearest < plane.offset - place.shrink - error;
  }
  return is_met ? kMet : QuickTouch{};
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
  if (aside_sq > 1.01 * (ball * ball)) return kApart;
  if (!(error < box.lengths)) return out;  // too far for doubles
  const double late = 4 * error + kRounding * start;

  // `wide`: where the ray may be in the box that has grown. `sure`: where it is in the box as given.
  Range wide = {-start - late, length - start + late}, sure = {late - start, length - start - late};
  if (start == 0) sure = {0, length};  // nothing is rounded there
  if (start == length) sure.far = 0;
  bool is_sure = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const double from = dot(box.dual[k], at), speed = dot(box.dual[k], direction);
    const double more = box.posed.half[k] + (grow + error), less = box.posed.half[k] - error;
    if (std::fabs(speed) < kParallel) {
      const double drift = farthest * (std::fabs(speed) + kRounding);
      if (std::fabs(from) > more + drift) return kApart;
      is_sure = is_sure && std::fabs(from) + drift < less;
      continue;
    }
    wide.cut((-more - from) / speed, (more - from) / speed);
    sure.cut((-less - from) / speed, (less - from) / speed);
    is_sure = is_sure && less > 0;
  }
  if (wide.is_empty()) return kApart;
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
      out.posed = convert<double>(box);
      out.link = leaf.link;
      out.leaf = leaf.leaf;
      out.lengths = static_cast<double>(leaf.lengths) * (1 + kRounding);
      const Point axes[3] = {axis_of(box, 0), axis_of(box, 1), axis_of(box, 2)};
      const Real volume = dot(axes[0], cross(axes[1], axes[2]));
      out.is_sound = true;
      out.reach = out.away = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Point dual = 1 / volume * cross(axes[(k + 1) % 3], axes[(k + 2) % 3]);
        store(convert<double>(dual), out.dual[k]);
        for (std::size_t j = 0; j < 3; ++j) {
          const double off = static_cast<double>(dot(axes[k], axes[j])) - (j == k ? 1 : 0);
          out.is_sound = out.is_sound && std::fabs(off) <= kSoundAxes;
        }
        out.origin[k] = static_cast<double>(instance.origin[k]);
        out.reach += 1.01 * out.posed.half[k];
        out.away += std::fabs(out.posed.center[k]);
      }
      QueryInstance alone = instance;
      alone.leaves = {leaf};
      alone_.push_back({std::move(alone)});
    }
  }
  begin_.push_back(boxes_.size());
}

QuickAsked::QuickAsked(const Query& of, Span<const QueryPlane> of_job) : query(of), planes(of_job) {
  const auto in_double = [](const float(&v)[3], double(&out)[3]) {
    for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<double>(v[c]);
  };
  const auto normalize = [](double(&v)[3]) {
    const double largest = std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])});
    if (!(largest > 0)) return 0.0;
    for (double& d : v) d /= largest;
    const double size = std::sqrt(dot(v, v));
    for (double& d : v) d /= size;
    return largest * size;
  };
  switch (query.kind) {
    case QueryKind::kRay:
      in_double(query.direction, direction);
      normalize(direction);
      break;
    case QueryKind::kSphere: own = static_cast<double>(query.radius); break;
    case QueryKind::kBox:
    case QueryKind::kCapsule: {
      const Real q[4] = {query.orientation[0], query.orientation[1], query.orientation[2], query.orientation[3]};
      Real column[3][3];
      quaternion_matrix(q, column);
      for (std::size_t k = 0; k < 3; ++k) store(convert<double>(to_vec3(column[k])), box.axis[k]);
      in_double(query.half, box.half);
      own = half_sum(box);
      reach = std::sqrt(dot(box.half, box.half)) * (1 + kRounding);
      if (query.kind == QueryKind::kBox) break;
      for (std::size_t c = 0; c < 3; ++c) along[c] = box.half[2] * box.axis[2][c];
      own = static_cast<double>(query.radius) + box.half[2];
      reach = box.half[2] * (1 + kRounding);
      break;
    }
    case QueryKind::kPoint: break;
    case QueryKind::kRegion:
      for (std::uint32_t i = 0; i < query.plane_count; ++i) {
        const QueryPlane& plane = planes[query.first_plane + i];
        QuickPlane& out = region.emplace_back();
        in_double(plane.normal, out.normal);
        out.offset = static_cast<double>(plane.offset) / normalize(out.normal);
      }
      break;
  }
}

QuickTouch QuickQueries::touch(const QuickAsked& asked, std::size_t leaf) const {
  const Query& query = asked.query;
  const QuickBox& box = boxes_[leaf];
  if (!box.is_sound) return {};
  Place place = {};
  for (std::size_t c = 0; c < 3; ++c) {
    const double from_origin = query.position[c] - box.origin[c];
    place.apart += std::fabs(from_origin);
    place.at[c] = from_origin - box.posed.center[c];
  }
  place.in_double = static_cast<double>(tolerance_.apart) * place.apart + kTiny;
  place.grow = static_cast<double>(tolerance_.leaf) * box.lengths + static_cast<double>(tolerance_.query) * asked.own +
               place.in_double;
  place.shrink = place.apart > kFar * box.lengths ? kFarShare * place.apart : 0;
  switch (query.kind) {
    case QueryKind::kRay: return touch_ray(asked, box, place);
    case QueryKind::kSphere:
    case QueryKind::kCapsule:
    case QueryKind::kPoint: return touch_round(asked, box, place);
    case QueryKind::kBox: return touch_box(asked, box, place);
    case QueryKind::kRegion: return touch_region(asked, box, place);
  }
  return {};
}

QuickTouch QuickQueries::exact_touch(const QuickAsked& asked, std::size_t leaf) const {
  const Query& query = asked.query;
  QuickTouch out;
  const std::vector<JudgedLink> links = judge_query(alone_[leaf], query, asked.planes, Exact::kNone, tolerance_);
  if (links.empty()) return out;
  const JudgedLink& link = links[0];
  out.may = true;
  out.must = link.must;
  out.may_inside = link.may_inside;
  out.at_zero = has_distance(query.kind) ? link.must_inside : link.must;
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
  const double longest = has_distance(query.kind) ? static_cast<double>(query.length) * (1 + written) : 0;
  std::vector<Link> links;
  const QuickAsked asked(query, done.planes);
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
    const auto off_at = [&](double distance) { return has_distance(query.kind) ? written * distance + in_double : 0; };
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
