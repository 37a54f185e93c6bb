// The checks of queries, before any is answered.
#include "engine/queries/validate_queries.h"

#include "engine/session/engine.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

bool is_length(float value) { return value >= 0 && value <= kMaxCoordinate; }

bool is_rotation(const float (&q)[4]) {
  const float length_sq = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return length_sq >= kQuaternionSqMin && length_sq <= kQuaternionSqMax;
}

bool has_direction(const Query& query) {
  const float* const d = query.direction;
  const bool is_finite = std::isfinite(d[0]) && std::isfinite(d[1]) && std::isfinite(d[2]);
  return is_finite && (query.length == 0 || d[0] != 0 || d[1] != 0 || d[2] != 0);
}

bool are_planes(Span<const QueryPlane> planes) {
  return std::all_of(planes.begin(), planes.end(), [](const QueryPlane& plane) {
    const float* const n = plane.normal;
    return std::isfinite(n[0]) && std::isfinite(n[1]) && std::isfinite(n[2]) && std::isfinite(plane.offset) &&
           (n[0] != 0 || n[1] != 0 || n[2] != 0);
  });
}

bool is_valid(const Query& query, Span<const QueryPlane> planes) {
  if (query.want > QueryWant::kAll || (query.want == QueryWant::kAll && query.max_hits == 0)) return false;
  if (query.time != kNow && !std::isfinite(query.time)) return false;
  for (const double x : query.position)
    if (!(std::fabs(x) <= kMaxQueryCoordinate)) return false;
  switch (query.kind) {
    case QueryKind::kRay: return query.length >= 0 && is_length(query.radius) && has_direction(query);
    case QueryKind::kSphere: return is_length(query.radius);
    case QueryKind::kBox:
      return is_rotation(query.orientation) && is_length(query.half[0]) && is_length(query.half[1]) &&
             is_length(query.half[2]);
    case QueryKind::kCapsule:
      return is_rotation(query.orientation) && is_length(query.radius) && is_length(query.half[2]);
    case QueryKind::kPoint: return query.length >= 0;
    case QueryKind::kRegion:
      return query.first_plane <= planes.size && query.plane_count <= planes.size - query.first_plane &&
             (query.plane_count == 0 || planes.data) &&
             are_planes({planes.data + query.first_plane, query.plane_count});
  }
  return false;
}

}  // namespace

BadQuery first_bad_query(const Engine& engine, const QueryJob& job) {
  for (std::size_t i = 0; i < job.queries.size; ++i) {
    const Query& query = job.queries[i];
    if (!is_valid(query, job.planes)) return {Status::kBadQuery, i};
    if (query.ignored_batch.value != 0 && !has_batch(engine, query.ignored_batch)) return {Status::kUnknownBatch, i};
  }
  return {};
}

}  // namespace cab
