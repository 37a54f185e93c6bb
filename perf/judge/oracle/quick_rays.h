// The judge of rays against boxes, quickly: in double with bounds of its errors. Pairs of a ray and a leaf that are
// closer than these bounds go to the judge in long double (query_judge.h), which decides as it always does.
//
// It judges which links are met, and how far away, but neither points nor normals.
#pragma once

#include "perf/judge/oracle/query_judge.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::oracle {

// What is known about a ray and a leaf, as JudgedHit says it. certain: by doubles alone.
struct QuickTouch {
  bool certain = false;
  bool may = false, must = false, may_inside = false;
  double least = 0, most = 0;  // if it may be met: bounds of the distance; `most` is infinite unless it must be met
};

// What is counted about one ray.
struct RayCounts {
  std::uint64_t pairs = 0;                      // leaves that were judged, of instances that the ray looks at
  std::uint64_t uncertain = 0;                  // of those the ones that went to the judge in long double
  std::uint64_t must = 0, lost = 0, extra = 0;  // as in QueryCounts
  std::string fault;
};

// The direction of a ray, of length 1; 0 for a ray without one.
std::array<double, 3> quick_direction(const Query& ray);

class QuickRays {
 public:
  // scene: must outlive the judge, without shapes in mind: its parts are not read.
  explicit QuickRays(const QueryScene& scene, const QueryTolerance& tolerance = {});

  // Judges the hits of a ray without a radius, which are in order, in a job by boxes.
  RayCounts count(const QueryJob& done, std::size_t query, Span<const QueryHit> hits) const;

  // What doubles say about a ray and a leaf of the scene. direction: that of the ray, of length 1, or 0. leaf: counted
  // over all instances.
  QuickTouch touch(const Query& ray, const std::array<double, 3>& direction, std::size_t leaf) const;
  // What the judge in long double says.
  QuickTouch exact_touch(const Query& ray, std::size_t leaf) const;

  std::size_t leaf_count() const { return boxes_.size(); }

 private:
  // A box as its leaf has it, relative to the origin of its instance. A point has the coordinates dot(dual[k], p -
  // center) along its axes, which are within half[k] if it is inside.
  struct QuickBox {
    double center[3], dual[3][3], half[3];
    double origin[3];  // of the instance
    double lengths;    // as QueryLeaf::lengths, rounded up
    double away;       // |center|_1
    double reach;      // of the box: the sum of its half extents, and a little more
    bool is_sound;     // the axes are about orthonormal, so that the bounds of errors hold
    std::uint32_t instance;
    std::uint16_t link, leaf;
  };

  const QueryScene& scene_;
  QueryTolerance tolerance_;
  std::vector<QuickBox> boxes_;     // by instance, then by leaf
  std::vector<QueryScene> alone_;   // by box: its instance with this leaf alone, for the judge in long double
  std::vector<std::size_t> begin_;  // by instance: its first box; then the end
};

}  // namespace cab::oracle
