// Rays, and spheres that are moved along them.
#pragma once

#include "engine/queries/ray_cast.h"
#include "engine/queries/search.h"
#include "kernels/cast_box.h"
#include "kernels/enter_rays.h"
#include "kernels/search_ray.h"

namespace cab {

class RayQuery {
 public:
  RayQuery(const QueryRun& run, const Query& query, LinkHits& hits);

  // Finds the links that are wanted of the job's inputs, by what is left of a search.
  void finish(kernel::RaySearch& search);

  // Finds the first link of the job's histories among the leaves that a search has met.
  void finish(PastRay& ray);

  // Where on the triangles of a leaf a hit of this query is, by another cast at them. No other hit may be known.
  SurfacePoint surface_point(const PosedInstance& one, std::uint32_t leaf);

  // A probe of histories.
  bool enter();
  bool next(kernel::IndexWalk& walk, kernel::MetBounds* met) const {
    return run_.frame.kernels.walk_ray(run_.index.view(), lanes_, walk, met);
  }
  bool skips(float entry) const { return entry > lanes_.end; }
  void test(const PosedInstance& one);
  bool is_done() const { return hits_.is_done(); }

 private:
  // The ray next to an instance.
  struct Local {
    Double3 to;      // the instance's origin, relative to where the ray begins
    double nearest;  // the parameter at which the ray is nearest to that, from which the parameter of `ray` counts
    LocalRay ray;
  };

  void shorten();
  Local at_instance(const PosedInstance& one) const;
  void set_end(Local& local) const;
  bool cast(const PosedInstance& one, const LocalRay& ray, std::uint32_t leaf, const BoxAos& box, RayTouch* out) const;
  void test_leaf(const PosedInstance& one, Local& local, std::uint32_t leaf, const BoxAos& box);

  const QueryRun& run_;
  const Query& query_;
  LinkHits& hits_;
  Double3 direction_;  // of length 1
  double length_;
  double entered_ = 0;  // the parameter at which it enters the index, in the index's scale
  kernel::RayLanes lanes_;
};

// Begins the searches for rays, one to sixteen, each in an index of its own. indexes, searches: as many as numbers,
// which are those of the queries.
void begin_searches(const QueryRun& run, Span<const std::uint32_t> numbers, const QueryIndex* const* indexes,
                    kernel::RaySearch* const* searches);

// Searches for rays, one to sixteen, by turns, until each search has ended or has met leaves that have to be tested
// before it goes on. numbers: of the queries. searches: as many, which are begun.
void search_together(const QueryRun& run, Span<const std::uint32_t> numbers, kernel::RaySearch* searches);

// What some rays touch first, whose searches have ended.
struct FirstTouches {
  // Bits by ray: for which that is known, which meet a leaf, and of these which want it by name.
  std::uint32_t decided, found, named;
  struct {
    std::uint32_t slot, instance, leaf;  // slot: index of the batch
  } at[kLanes];
  kernel::CastTile tile = {};

  // Writes the hit of a ray that wants it by name.
  void write(const QueryRun& run, std::uint32_t i, std::uint32_t query, QueryHit& to) const;
};

// Casts rays that want the nearest leaf against the one that their search has met first. It is not known where another
// may be as near, where exact shapes decide, or where a sphere is moved.
void cast_first(const QueryRun& run, Span<const std::uint32_t> numbers, const kernel::RaySearch* searches,
                FirstTouches& out);

}  // namespace cab
