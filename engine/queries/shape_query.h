// Spheres, boxes and capsules that overlap links, and points that are near them.
#pragma once

#include "engine/exact/convex_queues.h"
#include "engine/queries/search.h"
#include "kernels/search_round.h"

namespace cab {

class ShapeQuery {
 public:
  ShapeQuery(const QueryRun& run, const Query& query, LinkHits& hits);

  // Finds the link of the job's inputs that is nearest to a point, by what is left of a search.
  void finish(kernel::PointSearch& search);

  // A probe of search_index and of histories.
  bool enter();
  bool next(kernel::IndexWalk& walk, kernel::MetBounds* met) const;
  bool skips(float entry) const { return is_round() && entry > point_.most_sq; }
  void test(const PosedInstance& one);
  bool is_done() const { return hits_.is_done(); }
  bool is_in_order() const {
    return !query_.with_depth && query_.kind != QueryKind::kPoint && query_.want != QueryWant::kAny;
  }
  bool has_all_wanted() const { return hits_.has_all_wanted(); }

 private:
  // The bounds of the query's shape in some frame, unless it is round.
  struct Bounds {
    float lo[3], hi[3];
  };
  // The query next to an instance.
  struct Local {
    Double3 at;    // its position relative to the instance's origin
    double error;  // how far rounding may have moved it
    double pad;    // the same for floats, and for the bounds of leaves
    Bounds bounds;
    float point[3];  // `at` as floats
    double off;      // what distances of boxes in float may be off
    float most_sq;   // of distances of boxes that are wanted
  };
  struct Run;

  Local at_instance(const PosedInstance& one) const;
  bool is_round() const { return query_.kind == QueryKind::kSphere || query_.kind == QueryKind::kPoint; }
  double most() const;
  void set_bounds(const Double3& at, double pad, double scale, Bounds& bounds) const;
  std::uint32_t meets(const kernel::BoundsRow& row, const Bounds& bounds, float* entry) const;  // if it is not round
  bool meets_box(const PosedInstance& one, const Local& local, std::uint32_t leaf) const;
  std::uint32_t meets_boxes(const BoxTile& boxes, const Local& local, float* distance_sq) const;
  void test_box(const PosedInstance& one, const Local& local, std::uint32_t leaf);
  void test_boxes(const PosedInstance& one, Local& local);
  void test_shapes(const PosedInstance& one, const Local& local);

  const QueryRun& run_;
  const Query& query_;
  LinkHits& hits_;
  ConvexShape shape_;
  float pose_[7];             // of the shape: the query's orientation alone
  double half_[3];            // of the shape's bounds, along the world's axes
  kernel::PointLanes point_;  // in the index, if it is round
  Bounds bounds_;             // likewise, if it is not
};

// Whether the job's inputs are searched for a query by search_together: a point that wants the nearest link, without
// shapes.
inline bool wants_nearest(const QueryRun& run, const Query& query) {
  return query.kind == QueryKind::kPoint && query.want != QueryWant::kAll && run.job.exact == Exact::kNone;
}

// Searches for such points, one to sixteen, until each search has ended or has met leaves that have to be tested before
// it goes on. numbers: of the queries. searches: as many, which are begun.
void search_together(const QueryRun& run, Span<const std::uint32_t> numbers, kernel::PointSearch* searches);

}  // namespace cab
