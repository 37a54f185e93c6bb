// Regions: the links whose boxes are not wholly outside of any of several planes.
#include "engine/queries/region_query.h"

#include "layout/error_bounds.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

// The normal of a plane, divided by its largest component, and its offset likewise.
struct UnitPlane {
  Double3 normal;
  double offset;

  explicit UnitPlane(const QueryPlane& plane) {
    normal = {static_cast<double>(plane.normal[0]), static_cast<double>(plane.normal[1]),
              static_cast<double>(plane.normal[2])};
    const double by = 1 / kernel::max_component(kernel::abs(normal));
    normal = by * normal;
    offset = by * static_cast<double>(plane.offset);
  }
};

}  // namespace

// The lanes that no plane leaves out. Bounds are relative to a point and multiplied by `scale`; `position` is that of
// the query in their frame, and `reach` at least their largest coordinate.
std::uint32_t RegionQuery::meets(const kernel::BoundsRow& row, const Double3& position, double scale,
                                 double reach) const {
  std::uint32_t out = (1u << kLanes) - 1;
  for (const QueryPlane& given : planes()) {
    const UnitPlane plane(given);
    const double toward = kernel::dot(plane.normal, position), offset = scale * plane.offset;
    const double rounding =
        kQueryLeafPad * reach + kQueryRounding * (kernel::sum(kernel::abs(position)) + std::fabs(offset));
    const float normal[3] = {static_cast<float>(plane.normal.x), static_cast<float>(plane.normal.y),
                             static_cast<float>(plane.normal.z)};
    out &= run_.frame.kernels.plane_bounds(row, normal, float_above((offset + toward) + rounding));
  }
  return out;
}

bool RegionQuery::next(kernel::IndexWalk& walk, kernel::MetBounds* met) const {
  constexpr double kReach = 2;  // more than any coordinate in the index
  const QueryIndex& index = run_.index;
  const double* const at = query_.position;
  const Double3 position = {index.scale * (at[0] - index.center[0]), index.scale * (at[1] - index.center[1]),
                            index.scale * (at[2] - index.center[2])};
  return kernel::walk_on<float>(
      index.view(),
      [&](const kernel::BoundsRow& row, float* entry) {
        std::fill_n(entry, kLanes, 0.0f);
        return meets(row, position, index.scale, kReach);
      },
      [](float) { return false; }, kernel::ReadNothingAhead(), walk, met);
}

void RegionQuery::test(const PosedInstance& one) {
  const Double3 local = {-one.apart[0], -one.apart[1], -one.apart[2]};
  const double reach = static_cast<double>(one.reach);
  // Whether a leaf's box is wholly beyond a plane.
  const auto is_beyond = [&](const BoxAos& box, const UnitPlane& plane) {
    const auto double3 = [](const float* v) {
      return Double3{static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
    };
    double lowest = kernel::dot(plane.normal, double3(box.center) - local);
    for (int k = 0; k < 3; ++k)
      lowest -= static_cast<double>(box.half[k]) * std::fabs(kernel::dot(plane.normal, double3(box.axis + 3 * k)));
    const double rounding = kQueryRounding * (reach + kernel::sum(kernel::abs(local)) + std::fabs(plane.offset));
    return lowest > plane.offset + 3 * rounding;
  };
  for_each_leaf(
      run_, one,
      [&](const BoxTile& boxes, float* entry) {
        std::fill_n(entry, kLanes, 0.0f);
        return meets(BoundsOfBoxes(run_, boxes).row(), local, 1, 3 * reach);
      },
      [](float) { return false; },
      [&](std::uint32_t leaf) {
        const BoxAos box = one.box(leaf);
        const bool is_outside = std::any_of(planes().begin(), planes().end(),
                                            [&](const QueryPlane& plane) { return is_beyond(box, UnitPlane(plane)); });
        if (!is_outside) hits_.add(one, leaf, 0, {0, 0, 0}, {0, 0, 0}, false);
      },
      [&] { return hits_.is_done(); });
  hits_.finish();
}

}  // namespace cab
