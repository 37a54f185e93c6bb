// Regions: the links whose boxes are not wholly outside of any of several planes.
#pragma once

#include "engine/exact/convex_pair.h"
#include "engine/queries/search.h"

namespace cab {

class RegionQuery {
 public:
  RegionQuery(const QueryRun& run, const Query& query, LinkHits& hits) : run_(run), query_(query), hits_(hits) {}

  // A probe of search_index.
  bool enter() { return true; }
  bool next(kernel::IndexWalk& walk, kernel::MetBounds* met) const;
  bool skips(float) const { return false; }
  void test(const PosedInstance& one);
  bool is_done() const { return hits_.is_done(); }
  bool is_in_order() const { return query_.want != QueryWant::kAny; }
  bool has_all_wanted() const { return hits_.has_all_wanted(); }

 private:
  Span<const QueryPlane> planes() const { return {run_.job.planes.data + query_.first_plane, query_.plane_count}; }
  std::uint32_t meets(const kernel::BoundsRow& row, const Double3& position, double scale, double reach) const;

  const QueryRun& run_;
  const Query& query_;
  LinkHits& hits_;
};

}  // namespace cab
