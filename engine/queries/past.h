// Queries at times of their own: which instances of the histories they meet, posed as they were.
#pragma once

#include "engine/queries/ray_query.h"
#include "engine/queries/region_query.h"
#include "engine/queries/shape_query.h"

namespace cab {

// Up to sixteen instances of one articulation as they were, for the posing kernel. Which of them have orientations and
// scales is the same for all.
struct PastTile {
  std::uint32_t count = 0;
  bool is_between = false;  // whether one of them is between two moments
  kernel::PoseTile pose;
  kernel::LaterPoses later;

  void add(const HistoryMoment& moment, std::uint32_t instance);
};

// Poses the leaf boxes into the worker's. Returns the bits of the lanes whose pose is valid.
std::uint32_t pose_past_tile(const kernel::KernelTable& kernels, const Articulation& articulation, PastTile& tile,
                             PoseScratch& posing);

// Forgets all candidates of a worker.
void clear_candidates(PastWorker& own);

// Poses all candidates of a worker.
void pose_candidates(const QueryRun& run);

// Calls visit(probe) with the query as a probe of the run's index.
template <class Visit>
void with_probe(const QueryRun& run, const Query& query, LinkHits& hits, Visit&& visit) {
  const auto enter = [&](auto&& probe) {
    if (probe.enter()) visit(probe);
  };
  switch (query.kind) {
    case QueryKind::kRay: return enter(RayQuery(run, query, hits));
    case QueryKind::kRegion: return enter(RegionQuery(run, query, hits));
    case QueryKind::kSphere:
    case QueryKind::kBox:
    case QueryKind::kCapsule:
    case QueryKind::kPoint: return enter(ShapeQuery(run, query, hits));
  }
}

// Adds the instances of the histories that a query meets to the worker's candidates. Returns false, and adds none, if
// there is no room for all of them.
bool collect_candidates(const QueryRun& run, std::uint32_t number);

// Tests the candidates from `begin` on that are of a query, which are posed. Returns the index after the last of them.
std::uint32_t test_candidates(const QueryRun& run, std::uint32_t number, std::uint32_t begin, LinkHits& hits);

// Where on the triangles of its leaf a hit of a ray about the past is.
SurfacePoint past_surface_point(const QueryRun& run, const QueryHit& hit);

// Answers a query whose candidates are too many, or whose candidates are not there any more.
void answer_alone(const QueryRun& run, std::uint32_t number, LinkHits& hits);

}  // namespace cab
