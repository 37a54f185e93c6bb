// Spheres that ask which links they overlap.
#include "engine/queries/sphere_query.h"

#include "engine/queries/box_point.h"

#include <algorithm>

namespace cab {
namespace {

// The bits of leaves at a sphere's surface that it overlaps.
std::uint32_t overlapped(const QueryRun& run, const Query& query, const kernel::MetLeaves& at) {
  const PosedInstance one = instance_at(run, query, at.node, at.lane);
  const Double3 local = {-one.apart[0], -one.apart[1], -one.apart[2]};
  const double radius = static_cast<double>(query.radius);
  const double size = kernel::sum(kernel::abs(local)) + static_cast<double>(one.reach);
  const double most = radius + kQueryRounding * (size + 3 * radius);
  std::uint32_t out = 0;
  for (std::uint32_t left = at.surface; left; left &= left - 1) {
    const std::uint32_t lane = lowest_bit(left);
    const BoxAos box = one.box(at.tile * kLanes + lane);
    if (BoxPoint(box, local).is_within(most)) out |= 1u << lane;
  }
  return out;
}

}  // namespace

Span<const kernel::MetLeaves> find_overlapped(const QueryRun& run, const Query& query) {
  const kernel::KernelTable& kernels = run.frame.kernels;
  QueryStats& stats = run.own.stats;
  kernel::SphereSearch search;
  search.filter = filter_of(query);
  search.radius = static_cast<double>(query.radius);
  search.any = query.want == QueryWant::kAny;
  search.nodes = run.own.met_nodes.data;
  search.count =
      kernels.meet_nodes(run.index.view(), point_in_index(run.index, query, search.radius), search.nodes, stats.nodes);
  search.next = 0;
  search.out = run.own.met_leaves.data;
  search.out_count = 0;
  search.tested = 0;
  while (kernels.search_sphere(searched_index(run), search) == kernel::SearchStop::kPose)
    pose_cluster(run, search.nodes[search.next].node);
  stats.instances += search.tested;
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < search.out_count; ++i) {
    kernel::MetLeaves at = search.out[i];
    stats.leaf_tests += count_bits(at.inside | at.surface);
    if (at.surface) at.inside |= static_cast<std::uint16_t>(overlapped(run, query, at));
    if (at.inside) search.out[count++] = at;
  }
  std::sort(search.out, search.out + count, [](const kernel::MetLeaves& x, const kernel::MetLeaves& y) {
    return x.key != y.key ? x.key < y.key : x.tile < y.tile;
  });
  return {search.out, count};
}

}  // namespace cab
