// The quick judge of rays against boxes: slabs in double along the axes of each box.
#include "perf/judge/oracle/quick_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace cab::oracle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What rounding in double may move, as a share of all lengths that a coordinate is a sum of. Some twenty roundings of
// 2^-53 each go into one, and the axes are orthonormal to 2^-10.
constexpr double kRounding = 0x1p-46;

// A ray counts as parallel to a face if it comes nearer by less than this per length.
constexpr double kParallel = 0x1p-30;

// How far axes may be off orthonormal for the bounds of errors to hold.
constexpr double kSoundAxes = 0x1p-10;

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

}  // namespace

QuickRays::QuickRays(const QueryScene& scene, const QueryTolerance& tolerance) : scene_(scene), tolerance_(tolerance) {
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
        for (std::size_t c = 0; c < 3; ++c) out.dual[k][c] = static_cast<double>(dual[c]);
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

std::array<double, 3> quick_direction(const Query& ray) {
  std::array<double, 3> direction = {static_cast<double>(ray.direction[0]), static_cast<double>(ray.direction[1]),
                                     static_cast<double>(ray.direction[2])};
  const double largest = std::max({std::fabs(direction[0]), std::fabs(direction[1]), std::fabs(direction[2])});
  if (largest > 0) {
    for (double& d : direction) d /= largest;
    const double size =
        std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    for (double& d : direction) d /= size;
  }
  return direction;
}

QuickTouch QuickRays::touch(const Query& ray, const std::array<double, 3>& direction, std::size_t leaf) const {
  const QuickBox& box = boxes_[leaf];
  QuickTouch out;
  if (!box.is_sound) return out;

  // The ray from its point that is nearest to the box's centre.
  double at[3], apart = 0, along = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double from_origin = ray.position[c] - box.origin[c];
    apart += std::fabs(from_origin);
    at[c] = from_origin - box.center[c];
    along -= at[c] * direction[c];
  }
  const double length = static_cast<double>(ray.length), start = std::clamp(along, 0.0, length);
  double aside = 0, aside_sq = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    at[c] += start * direction[c];
    aside += std::fabs(at[c]);
    aside_sq += at[c] * at[c];
  }

  // How much the leaf grows, and what rounding may move: the coordinates, and the parameter of a point of the box.
  const double grow =
      static_cast<double>(tolerance_.leaf) * box.lengths + static_cast<double>(tolerance_.apart) * apart + kTiny;
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
    const double from = box.dual[k][0] * at[0] + box.dual[k][1] * at[1] + box.dual[k][2] * at[2];
    const double speed = box.dual[k][0] * direction[0] + box.dual[k][1] * direction[1] + box.dual[k][2] * direction[2];
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
  return out;
}

QuickTouch QuickRays::exact_touch(const Query& ray, std::size_t leaf) const {
  QuickTouch out;
  const std::vector<JudgedLink> links = judge_query(alone_[leaf], ray, {}, Exact::kNone, tolerance_);
  if (links.empty()) return out;
  const JudgedLink& link = links[0];
  out.may = true;
  out.must = link.must;
  out.may_inside = link.may_inside;
  out.least = static_cast<double>(link.least);
  out.most = link.must ? static_cast<double>(link.most) : kInfinity;
  return out;
}

RayCounts QuickRays::count(const QueryJob& done, std::size_t query, Span<const QueryHit> hits) const {
  const Query& ray = done.queries[query];
  RayCounts out;
  const auto fault = [&](const char* what, std::uint32_t batch, std::uint32_t instance, std::uint32_t link) {
    if (!out.fault.empty()) return;
    out.fault = "query " + std::to_string(query) + ", batch " + std::to_string(batch) + ", instance " +
                std::to_string(instance) + ", link " + std::to_string(link) + ": " + what;
  };
  const auto fault_at = [&](const char* what, const QueryHit& hit) {
    fault(what, hit.batch.value, hit.instance, hit.link);
  };
  const auto key_of = [](const QueryHit& hit) { return std::make_tuple(hit.batch.value, hit.instance, hit.link); };
  const std::size_t wanted = ray.want == QueryWant::kAny ? 0 : ray.want == QueryWant::kClosest ? 1 : ray.max_hits;
  for (std::size_t i = 1; i < hits.size; ++i)
    if (!(std::make_tuple(hits[i - 1].distance, key_of(hits[i - 1])) <
          std::make_tuple(hits[i].distance, key_of(hits[i]))))
      fault_at("it is not behind the hit before it", hits[i]);
  if (hits.size > wanted && hits.size > 0) fault_at("it has more hits than it wants", hits[wanted]);

  // A link that may be found, with what is known of its leaves.
  struct Link {
    std::uint16_t link;
    bool must, is_found;
    double most;
  };
  const auto written = static_cast<double>(tolerance_.written);
  std::vector<Link> links;
  const std::array<double, 3> direction = quick_direction(ray);
  std::vector<bool> is_known(hits.size);
  bool may_any = false;
  for (std::uint32_t i = 0; i < scene_.size(); ++i) {
    const QueryInstance& instance = scene_[i];
    const bool is_ignored =
        slot_of(ray.ignored_batch).value == instance.batch.value && ray.ignored_instance == instance.instance;
    if (is_ignored || (instance.layers & ray.layer_mask) == 0) continue;
    double apart = 0, farthest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double by = std::fabs(ray.position[c] - static_cast<double>(instance.origin[c]));
      apart += by;
      farthest = std::max(farthest, by);
    }
    if (farthest > kMaxQueryCoordinate) continue;
    const double in_double = static_cast<double>(tolerance_.apart) * apart + kTiny;
    const auto off_at = [&](double distance) { return written * distance + in_double; };
    links.clear();
    for (std::size_t b = begin_[i]; b < begin_[i + 1]; ++b) {
      const QuickBox& box = boxes_[b];
      ++out.pairs;
      QuickTouch known = touch(ray, direction, b);
      if (!known.certain) {
        ++out.uncertain;
        known = exact_touch(ray, b);
      }
      if (!known.may) continue;
      may_any = true;
      auto link = std::find_if(links.begin(), links.end(), [&](const Link& one) { return one.link == box.link; });
      if (link == links.end()) link = links.insert(links.end(), {box.link, false, false, kInfinity});
      link->must |= known.must;
      link->most = std::min(link->most, known.most);
      for (std::size_t h = 0; h < hits.size; ++h) {
        const QueryHit& hit = hits[h];
        if (hit.batch.value != instance.batch.value || hit.instance != instance.instance || hit.link != box.link)
          continue;
        link->is_found = true;
        if (hit.leaf != box.leaf) continue;
        is_known[h] = true;
        const double distance = static_cast<double>(hit.distance);
        const double off = off_at(distance);
        if (!(distance >= known.least - off && distance <= known.most + off))
          fault_at("its distance is not that of its leaf", hit);
        if (hit.inside && (distance != 0 || !known.may_inside)) fault_at("it is said to begin inside", hit);
      }
    }
    for (const Link& link : links) {
      out.must += link.must;
      for (const QueryHit& hit : hits)
        if (hit.batch.value == instance.batch.value && hit.instance == instance.instance && hit.link == link.link &&
            static_cast<double>(hit.distance) > link.most + off_at(static_cast<double>(hit.distance)))
          fault_at("another leaf is nearer", hit);
      if (!link.must || link.is_found || ray.want == QueryWant::kAny) continue;
      const bool has_room = hits.size < wanted;
      const double last = hits.empty() ? kInfinity : static_cast<double>(hits[hits.size - 1].distance);
      if (!has_room && !(link.most < last - off_at(last))) continue;
      ++out.lost;
      fault("it is lost", instance.batch.value, instance.instance, link.link);
    }
  }
  for (std::size_t h = 0; h < hits.size; ++h) {
    if (is_known[h]) continue;
    ++out.extra;
    fault_at("it is not met", hits[h]);
  }
  if (done.found.empty()) return out;
  const bool found = done.found[query] != 0;
  if (found && !may_any && hits.empty()) {
    ++out.extra;
    fault("it is said to find something", 0, 0, 0);
  }
  if (!found && out.must > 0 && out.lost == 0) {
    ++out.lost;
    fault("it is said to find nothing", 0, 0, 0);
  }
  return out;
}

}  // namespace cab::oracle
