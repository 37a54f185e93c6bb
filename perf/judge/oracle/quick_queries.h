// The judge of queries of all kinds against boxes, quickly: in double with bounds of its errors. Pairs of a query
// and a leaf that are closer than these bounds go to the judge in long double (query_judge.h), which decides as it
// always does.
//
// It judges which links are met, and how far away, but neither points nor normals.
#pragma once

#include "perf/judge/oracle/overlap_exact.h"
#include "perf/judge/oracle/query_judge.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cab::oracle {

// What is known about a query and a leaf, as JudgedHit says it. certain: by doubles alone.
struct QuickTouch {
  bool certain = false;
  bool may = false, must = false, may_inside = false;
  bool at_zero = false;        // it must be met, and its distance is 0 however the leaf grows
  double least = 0, most = 0;  // if it may be met: bounds of the distance; `most` is infinite unless it must be met
};

// What is counted about one query.
struct QuickCounts {
  std::uint64_t pairs = 0;                      // leaves that were judged, of instances that the query looks at
  std::uint64_t uncertain = 0;                  // of those the ones that went to the judge in long double
  std::uint64_t must = 0, lost = 0, extra = 0;  // as in QueryCounts
  std::string fault;
};

// A plane of a region, relative to the query's position: dot(normal, p) = offset.
struct QuickPlane {
  double normal[3];  // of length 1
  double offset;
};

// A query, and what all leaves ask of it, in double.
struct QuickAsked {
  const Query& query;
  Span<const QueryPlane> planes;   // of the job
  double direction[3] = {};        // kRay: of length 1, or 0
  OracleBox<double> box = {};      // kBox: about the query's position
  double along[3] = {};            // kCapsule: half its segment
  double own = 0;                  // the sum of its own lengths, which rounding depends on
  double reach = 0;                // kBox, kCapsule: half the diagonal, half the segment
  std::vector<QuickPlane> region;  // kRegion

  // query, planes: must outlive this.
  explicit QuickAsked(const Query& query, Span<const QueryPlane> planes = {});
};

// A leaf's box as the judge keeps it, relative to the origin of its instance. A point p has the coordinates
// dot(dual[k], p - center) along its axes, which are within half[k] if it is inside.
struct QuickBox {
  OracleBox<double> posed;
  double dual[3][3];
  double origin[3];  // of the instance
  double lengths;    // as QueryLeaf::lengths, rounded up
  double away;       // |center|_1
  double reach;      // of the box: the sum of its half extents, and a little more
  bool is_sound;     // the axes are about orthonormal, so that the bounds of errors hold
  std::uint32_t instance;
  std::uint16_t link, leaf;
};

class QuickQueries {
 public:
  // scene: must outlive the judge, without shapes in mind: its parts are not read.
  explicit QuickQueries(const QueryScene& scene, const QueryTolerance& tolerance = {});

  // Judges the hits of one query of a job by boxes: a ray without a radius, a shape without depth, a point or a region.
  QuickCounts count(const QueryJob& done, std::size_t query, Span<const QueryHit> hits) const;

  // What doubles say about such a query and a leaf of the scene. leaf: counted over all instances.
  QuickTouch touch(const QuickAsked& asked, std::size_t leaf) const;
  // What the judge in long double says.
  QuickTouch exact_touch(const QuickAsked& asked, std::size_t leaf) const;

  std::size_t leaf_count() const { return boxes_.size(); }

 private:
  const QueryScene& scene_;
  QueryTolerance tolerance_;
  std::vector<QuickBox> boxes_;     // by instance, then by leaf
  std::vector<QueryScene> alone_;   // by box: its instance with this leaf alone, for the judge in long double
  std::vector<std::size_t> begin_;  // by instance: its first box; then the end
};

}  // namespace cab::oracle
