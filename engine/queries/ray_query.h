// Rays, and spheres that are moved along them.
#pragma once

#include "engine/queries/ray_cast.h"
#include "engine/queries/search.h"

namespace cab {

class RayQuery {
 public:
  RayQuery(const QueryRun& run, const Query& query, LinkHits& hits);

  // A probe of search_index.
  bool enter();
  bool next(kernel::IndexWalk& walk, kernel::MetBounds* met) const {
    return run_.frame.kernels.walk_ray(run_.index.view(), lanes_, walk, met);
  }
  bool skips(float entry) const { return entry > lanes_.end; }
  void test(const PosedInstance& one);
  bool is_done() const { return hits_.is_done(); }
  bool is_in_order() const { return false; }
  bool has_all_wanted() const { return hits_.has_all_wanted(); }

 private:
  bool enter_index();
  void shorten();
  bool cast(const PosedInstance& one, const LocalRay& ray, std::uint32_t leaf, RayTouch* out) const;

  const QueryRun& run_;
  const Query& query_;
  LinkHits& hits_;
  Double3 direction_;
  double length_;
  double inverse_[3];   // one over each component of the direction, none of which counts as 0
  double entered_ = 0;  // the parameter at which it enters the index, in the index's scale
  kernel::RayLanes lanes_;
};

}  // namespace cab
