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
  std::uint32_t meets(const kernel::BoundsRow& row, float* entry) const {
    return run_.frame.kernels.ray_bounds(row, lanes_, entry);
  }
  bool skips(float entry) const { return entry > lanes_.end; }
  void test(const PosedInstance& one);
  bool is_done() const { return hits_.is_done(); }

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
