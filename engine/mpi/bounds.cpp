#include "engine/mpi/bounds.h"

#include "engine/mpi/part_of.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace cab::mpi {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// find_candidates widens given bounds by kGivenPad of their largest coordinate, by kGivenMargin of the margin, which is
// that of the frame and twice the instance's own, and by kWorldPad for sums in double (layout/error_bounds.h). These
// are larger.
constexpr double kPad = 1.25e-4, kReach = kOwnMarginReach / 2, kSumPad = 4e-15;

float rounded_down(double value) { return std::nextafter(static_cast<float>(value), -kInfinity); }
float rounded_up(double value) { return std::nextafter(static_cast<float>(value), kInfinity); }

double most_of(const RelativeBounds& bounds) {
  double most = 0;
  for (std::size_t c = 0; c < 3; ++c)
    most = std::max({most, std::fabs(static_cast<double>(bounds.lo[c])), std::fabs(static_cast<double>(bounds.hi[c]))});
  return most;
}

RelativeBounds bounds_of(const Box* boxes, std::uint32_t leaf_count, double margin) {
  double lo[3], hi[3];
  for (std::size_t c = 0; c < 3; ++c) {
    lo[c] = std::numeric_limits<double>::infinity();
    hi[c] = -lo[c];
  }
  for (std::uint32_t leaf = 0; leaf < leaf_count; ++leaf) {
    const Box& box = boxes[leaf];
    for (std::size_t c = 0; c < 3; ++c) {
      double reach = kOwnMarginReach * margin;
      for (std::size_t k = 0; k < 3; ++k)
        reach += std::fabs(static_cast<double>(box.axis[k][c])) * static_cast<double>(box.half[k]);
      lo[c] = std::min(lo[c], static_cast<double>(box.center[c]) - reach);
      hi[c] = std::max(hi[c], static_cast<double>(box.center[c]) + reach);
    }
  }
  RelativeBounds out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.lo[c] = rounded_down(lo[c]);
    out.hi[c] = rounded_up(hi[c]);
  }
  return out;
}

}  // namespace

bool meet(const WorldBounds& a, const WorldBounds& b) {
  for (std::size_t c = 0; c < 3; ++c)
    if (a.lo[c] > b.hi[c] || b.lo[c] > a.hi[c]) return false;
  return true;
}

void widen(WorldBounds& bounds, const WorldBounds& other) {
  for (std::size_t c = 0; c < 3; ++c) {
    bounds.lo[c] = std::min(bounds.lo[c], other.lo[c]);
    bounds.hi[c] = std::max(bounds.hi[c], other.hi[c]);
  }
}

WorldBounds in_world(const double* about, const RelativeBounds& bounds, float margin) {
  const double most = most_of(bounds);
  WorldBounds out;
  for (std::size_t c = 0; c < 3; ++c) {
    const double pad = kPad * most + kReach * static_cast<double>(margin) + kSumPad * (std::fabs(about[c]) + most);
    out.lo[c] = about[c] + static_cast<double>(bounds.lo[c]) - pad;
    out.hi[c] = about[c] + static_cast<double>(bounds.hi[c]) + pad;
  }
  return out;
}

RelativeBounds relative_to(const double* point, const double* about, const RelativeBounds& bounds) {
  const double most = most_of(bounds);
  RelativeBounds out;
  for (std::size_t c = 0; c < 3; ++c) {
    const double pad = kSumPad * (std::fabs(about[c]) + std::fabs(point[c]) + most);
    out.lo[c] = rounded_down(about[c] - point[c] + static_cast<double>(bounds.lo[c]) - pad);
    out.hi[c] = rounded_up(about[c] - point[c] + static_cast<double>(bounds.hi[c]) + pad);
  }
  return out;
}

RelativeBounds scaled_for_search(const RelativeBounds& bounds) {
  RelativeBounds out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.lo[c] = rounded_down(double{kSearchScale} * static_cast<double>(bounds.lo[c]));
    out.hi[c] = rounded_up(double{kSearchScale} * static_cast<double>(bounds.hi[c]));
  }
  return out;
}

Status bound_characters(Engine& engine, BatchId batch, std::uint32_t slice, const BatchInput& input,
                        Span<const std::uint32_t> chosen, const Policies& policies, Span<RelativeBounds> bounds) {
  if (chosen.empty()) return Status::kOk;
  BatchInfo batch_of;
  if (const Status status = batch_info(engine, batch, &batch_of); status != Status::kOk) return status;
  ArticulationInfo info;
  if (const Status status = articulation_info(engine, batch_of.articulation, &info); status != Status::kOk)
    return status;
  std::vector<Box> boxes(std::size_t{slice} * info.node_count);
  std::vector<std::uint8_t> flags(slice);
  std::vector<std::uint32_t> instances;
  for (std::size_t at = 0; at < chosen.size;) {
    const std::uint32_t first = chosen[at] / slice * slice;
    instances.clear();
    for (; at < chosen.size && chosen[at] - first < slice; ++at) instances.push_back(chosen[at] - first);
    BatchInput part = part_of(input, first, instances.back() + 1, info.link_count);
    part.batch = batch;
    part.flags = flags;
    part.instances = instances;
    if (const Status status = compute_boxes(engine, part, policies, boxes); status != Status::kOk) return status;
    for (const std::uint32_t i : instances) {
      const double margin = input.margins.empty() ? 0 : static_cast<double>(input.margins[first + i]);
      bounds[first + i] = flags[i] == kInstanceOk
                              ? bounds_of(boxes.data() + std::size_t{i} * info.node_count, info.leaf_count, margin)
                              : kNoBounds;
    }
  }
  return Status::kOk;
}

}  // namespace cab::mpi
