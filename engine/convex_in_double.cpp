#include "engine/convex_in_double.h"

#include "engine/convex_pair.h"
#include "kernels/convex/gjk.h"

namespace cab {

bool touch_in_double(const kernel::ConvexBlock& block, std::uint32_t lane) {
  const auto placed = [lane](const kernel::ConvexSide& side) {
    return PlacedShape{side.shape[lane], side.format, side.pose[lane], side.orientation[lane]};
  };
  const auto& by = block.shift.by;
  const ConvexPair pair(placed(block.a), placed(block.b), {by[0][lane], by[1][lane], by[2][lane]});
  const double radius = pair.radius() + pair.scale() * static_cast<double>(block.margin);
  if (pair.half_spaces() > 0) return pair.half_spaces() == 2 || !(pair.height_above_plane() > radius + pair.slack());
  const auto support = [&pair](const Double3& d, std::uint32_t) { return pair.farthest(d); };
  const kernel::GjkPair<double> lengths = {pair.t(), radius, pair.slack(), pair.rounding()};
  return kernel::gjk(lengths, kernel::kGjkInDouble, 1, support).apart == 0;
}

}  // namespace cab
