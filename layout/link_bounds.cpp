#include "layout/link_bounds.h"

#include "layout/arena.h"
#include "layout/error_bounds.h"
#include "layout/fit_box.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cab {
namespace {

double dot(const float* a, const float* b) {
  double out = 0;
  for (int c = 0; c < 3; ++c) out += static_cast<double>(a[c]) * static_cast<double>(b[c]);
  return out;
}

void append_corners(const Box& box, std::vector<float>& out) {
  for (unsigned i = 0; i < 8; ++i)
    for (int c = 0; c < 3; ++c) {
      float at = box.center[c];
      for (unsigned k = 0; k < 3; ++k) at += (i >> k & 1 ? box.half[k] : -box.half[k]) * box.axis[k][c];
      out.push_back(at);
    }
}

// The box about all of these boxes, along the axes of `along`.
Box enclose(const Box& along, const std::vector<Box>& boxes) {
  Box out = along;
  double lo[3], hi[3];
  for (int k = 0; k < 3; ++k) {
    lo[k] = std::numeric_limits<double>::infinity();
    hi[k] = -lo[k];
    for (const Box& box : boxes) {
      const double at = dot(box.center, along.axis[k]);
      double reach = 0;
      for (int j = 0; j < 3; ++j)
        reach += static_cast<double>(box.half[j]) * std::fabs(dot(box.axis[j], along.axis[k]));
      lo[k] = std::min(lo[k], at - reach);
      hi[k] = std::max(hi[k], at + reach);
    }
  }
  double size = kLinkTiny, away = 0;
  for (int c = 0; c < 3; ++c) {
    double center = 0;
    for (int k = 0; k < 3; ++k) center += 0.5 * (lo[k] + hi[k]) * static_cast<double>(along.axis[k][c]);
    out.center[c] = static_cast<float>(center);
    away += std::fabs(center);
    size += 0.5 * (hi[c] - lo[c]);
  }
  const double grow = kLinkGrowSize * size + kLinkGrowTranslation * away;
  for (int k = 0; k < 3; ++k) out.half[k] = static_cast<float>(0.5 * (hi[k] - lo[k]) + grow);
  return out;
}

double area(const Box& box) {
  const auto half = [&box](int k) { return static_cast<double>(box.half[k]); };
  return half(0) * half(1) + half(1) * half(2) + half(2) * half(0);
}

// The box of least area about a link's leaves: along the link's own axes, along those of its first leaf, or along
// fitted ones.
Box box_about(const std::vector<Box>& boxes) {
  const Box own = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
  std::vector<Box> tries = {enclose(own, boxes), enclose(boxes.front(), boxes)};
  if (boxes.size() > 1) {
    std::vector<float> corners;
    for (const Box& box : boxes) append_corners(box, corners);
    Box fitted;
    if (fit_box_to_vertices(corners, &fitted) == Status::kOk) tries.push_back(enclose(fitted, boxes));
  }
  return *std::min_element(tries.begin(), tries.end(), [](const Box& x, const Box& y) { return area(x) < area(y); });
}

}  // namespace

void build_link_bounds(const Articulation& articulation, Arena& arena, LinkBounds* out) {
  std::vector<LinkLeaves> leaves;
  std::vector<PosedLink> posed;
  std::vector<std::uint16_t> links, order;
  std::vector<Box> link_boxes;
  std::vector<BoxTile> tiles;
  for (PosedLink link : articulation.posed_links) {
    const std::uint16_t at = static_cast<std::uint16_t>(links.size());
    const auto count = static_cast<std::uint16_t>(link.leaf_end - link.leaf_begin);
    if (count > 0) {
      leaves.push_back({link.link, count, link.leaf_begin, static_cast<std::uint32_t>(tiles.size())});
      std::vector<Box> boxes;
      for (std::uint32_t i = 0; i < count; ++i)
        boxes.push_back(articulation.leaf_box[articulation.leaf_order[link.leaf_begin + i]]);
      for (std::uint32_t i = 0; i < tile_count(count) * kLanes; ++i) {
        const Box& box = boxes[std::min<std::size_t>(i, boxes.size() - 1)];
        if (i % kLanes == 0) tiles.emplace_back();
        set_lane(box, i % kLanes, tiles.back());
      }
      link_boxes.push_back(box_about(boxes));
      links.push_back(link.link);
      order.push_back(at);
      out->has_several_leaves = out->has_several_leaves || count > 1;
    }
    link.leaf_begin = at;
    link.leaf_end = static_cast<std::uint16_t>(links.size());
    posed.push_back(link);
  }
  const auto keep = [&arena](auto& list) {
    using T = typename std::decay_t<decltype(list)>::value_type;
    return constant(arena.copy(Span<const T>(list)));
  };
  out->links.link_count = articulation.link_count;
  out->links.leaf_count = static_cast<std::uint32_t>(links.size());
  out->links.node_count = 2 * out->links.leaf_count - 1;
  out->links.link_parent = articulation.link_parent;
  out->links.link_joint = articulation.link_joint;
  out->links.leaf_link = keep(links);
  out->links.leaf_box = keep(link_boxes);
  out->links.posed_links = keep(posed);
  out->links.leaf_order = keep(order);
  out->links.leaves_by_link = true;
  out->links.ignored_bits = articulation.ignored_bits;
  out->leaves = keep(leaves);
  out->tiles = keep(tiles);
}

}  // namespace cab
