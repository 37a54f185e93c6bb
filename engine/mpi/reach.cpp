#include "engine/mpi/reach.h"

#include "engine/mpi/part_of.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab::mpi {
namespace {

// For padding and rounding of boxes, and for matrices that are off a rotation by up to 1e-3.
constexpr double kSlack = 1.01;

double length(const float* vector, std::size_t stride) {
  const auto x = static_cast<double>(vector[0]), y = static_cast<double>(vector[stride]),
             z = static_cast<double>(vector[2 * stride]);
  return std::sqrt(x * x + y * y + z * z);
}

double reach_of_link(const LinkReach& link, const PoseView& view, const float* pose) {
  switch (view.format) {
    case PoseFormat::kQuaternionTranslation: return length(pose + 4, 1) + link.radius;
    case PoseFormat::kMatrix3x4Rows: return length(pose + 3, 4) + link.radius * (view.has_scale ? length(pose, 4) : 1);
    case PoseFormat::kMatrix4x4Columns: break;
  }
  return length(pose + 12, 1) + link.radius * (view.has_scale ? length(pose, 1) : 1);
}

}  // namespace

std::vector<LinkReach> link_reaches(Span<const Leaf> leaves) {
  std::vector<LinkReach> out;
  for (const Leaf& leaf : leaves) {
    const double radius = length(leaf.box.center, 1) + length(leaf.box.half, 1);
    const auto at = std::find_if(out.begin(), out.end(), [&](const LinkReach& one) { return one.link == leaf.link; });
    if (at == out.end())
      out.push_back({leaf.link, radius});
    else
      at->radius = std::max(at->radius, radius);
  }
  return out;
}

RelativeBounds reach_of(const std::vector<LinkReach>& links, std::uint32_t link_count, const BatchInput& input,
                        std::size_t i) {
  double reach = 0;
  for (const LinkReach& link : links) {
    const double one = reach_of_link(link, input.poses, pose_at(input.poses, link_count, i, link.link));
    if (!std::isfinite(one)) return kNoBounds;
    reach = std::max(reach, one);
  }
  if (!input.scales.empty()) reach *= static_cast<double>(input.scales[i]);
  reach *= kSlack;
  if (!input.margins.empty()) reach += kOwnMarginReach * static_cast<double>(input.margins[i]);
  const auto side = static_cast<float>(reach);
  if (!std::isfinite(side)) return kNoBounds;
  const float up = std::nextafter(side, std::numeric_limits<float>::infinity());
  return {{-up, -up, -up}, {up, up, up}};
}

}  // namespace cab::mpi
