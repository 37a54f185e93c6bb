#include "layout/round_body.h"

#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab {
namespace {

bool is_short(const float* v, std::size_t count) {
  return std::all_of(v, v + count, [](float x) { return std::fabs(x) <= kMostRoundLength; });
}

double norm(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// The sum of all |x|, |y|, |z|.
float size_of(const RoundLeaf& leaf) {
  double out = 0;
  for (int c = 0; c < 3; ++c)
    out += std::fabs(static_cast<double>(leaf.center[c])) + std::fabs(static_cast<double>(leaf.axis[c]));
  return rounded_up(out);
}

RoundLeaf leaf_of(const ConvexShape& shape, std::uint32_t leaf) {
  RoundLeaf out = {};
  for (int c = 0; c < 3; ++c) {
    out.center[c] = shape.position[c];
    out.axis[c] = static_cast<float>(shape.axis[2][c] * static_cast<double>(shape.size[2]));
  }
  out.radius = shape.size[0];
  out.size = size_of(out);
  out.reach = shape.reach;
  out.leaf = static_cast<std::uint16_t>(leaf);
  out.is_ball = shape.size[2] == 0;
  return out;
}

// A ball about leaves: its centre moves towards the farthest of them, each time by less.
RoundLeaf ball_about(const RoundLeaf* leaves, std::size_t count) {
  double center[3] = {};
  for (std::size_t l = 0; l < count; ++l)
    for (int c = 0; c < 3; ++c) center[c] += static_cast<double>(leaves[l].center[c]) / static_cast<double>(count);
  const auto reach = [&](const RoundLeaf& leaf) {
    double from[3];
    for (int c = 0; c < 3; ++c) from[c] = static_cast<double>(leaf.center[c]) - center[c];
    return norm(from) + static_cast<double>(leaf.reach);
  };
  const auto farthest = [&] {
    return std::max_element(leaves, leaves + count,
                            [&](const RoundLeaf& a, const RoundLeaf& b) { return reach(a) < reach(b); });
  };
  for (int step = 2; step < 200; ++step) {
    const RoundLeaf& far = *farthest();
    for (int c = 0; c < 3; ++c) center[c] += (static_cast<double>(far.center[c]) - center[c]) / step;
  }
  RoundLeaf out = {};
  for (int c = 0; c < 3; ++c) out.center[c] = static_cast<float>(center[c]);
  for (int c = 0; c < 3; ++c) center[c] = static_cast<double>(out.center[c]);
  out.radius = out.reach = rounded_up(reach(*farthest()) * (1 + 1e-12));
  out.size = size_of(out);
  out.is_ball = true;
  return out;
}

}  // namespace

RoundBody make_round_body(const Articulation& articulation, const ConvexShapes& shapes, Arena& arena) {
  if (!is_short(articulation.link_joint.data, articulation.link_joint.size)) return {};
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
    const std::uint32_t shape = shapes.leaf_begin[leaf];
    const Box& box = articulation.leaf_box[leaf];
    if (shapes.leaf_begin[leaf + 1] != shape + 1 || shapes.shapes[shape].kind != ConvexKind::kRound) return {};
    if (!is_short(box.center, 3) || !is_short(box.half, 3)) return {};
  }
  std::vector<RoundLeaf> leaves;
  std::vector<RoundLink> links;
  for (const PosedLink& posed : articulation.posed_links) {
    if (posed.leaf_begin == posed.leaf_end) continue;
    RoundLink& link = links.emplace_back();
    link.link = posed.link;
    link.begin = static_cast<std::uint16_t>(leaves.size());
    for (std::uint32_t i = posed.leaf_begin; i < posed.leaf_end; ++i) {
      const std::uint32_t leaf = articulation.leaf_order[i];
      leaves.push_back(leaf_of(shapes.shapes[shapes.leaf_begin[leaf]], leaf));
    }
    link.end = static_cast<std::uint16_t>(leaves.size());
    link.ball = ball_about(leaves.data() + link.begin, leaves.size() - link.begin);
  }
  const bool has_capsules =
      std::any_of(leaves.begin(), leaves.end(), [](const RoundLeaf& leaf) { return !leaf.is_ball; });
  return {constant(arena.copy(Span<const RoundLeaf>(leaves))), constant(arena.copy(Span<const RoundLink>(links))),
          has_capsules};
}

}  // namespace cab
