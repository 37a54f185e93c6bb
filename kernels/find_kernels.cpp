#include "kernels/find_kernels.h"

#include "kernels/isa_list.h"
#include "kernels/simd.h"

#include <cab/policy.h>

#include <type_traits>

namespace cab::kernel {

// The files of kernels/isa define these kernels once per instruction set. This file is compiled without the flags of
// any instruction set, so it only declares them. A kernel that none of them defines fails to link.
template <bool UseSum>
struct CabRule;
struct CovarianceRule;
struct Best3Rule;
struct ChildrenExtents;
struct LeavesExtents;

template <class V>
void pose_leaves(const PoseTile& args);
template <class V>
void pose_link_leaves(const PoseLink& args);
template <class V>
void bound_bulge(BulgeTile& tile);
template <class V, class Rule, class Extents>
void refit_boxes(const RefitTile& tile);
template <class V>
void refit_aabb(const MergeProgram& program, AabbTile* nodes);
template <class V>
void refit_aabb_leaves(const MergeProgram& program, AabbTile* nodes);
template <class V>
void fit_vertices(const VertexTile& tile);
template <class V>
void bound_boxes(const BoxTile* boxes, std::uint32_t count, AabbTile* bounds);
template <class V>
void bound_together(const AabbTile* bounds, std::uint32_t count, AabbTile* all);
template <class V>
void bounds_to_soa(const AabbTile* bounds, std::uint32_t leaves, std::uint32_t live, float* soa);
template <class V>
void filter_rows(const RowFilter& filter);
template <class V>
void boxes_to_aos(const BoxTile* nodes, std::uint32_t count, std::uint32_t live, BoxAos* boxes,
                  std::size_t instance_stride);
template <class V>
void aabbs_to_aos(const AabbTile* nodes, std::uint32_t count, std::uint32_t live, AabbAos* boxes,
                  std::size_t instance_stride);
template <class V, class Tile, Sat kSat>
void descend_tiles(TileDescent<Tile>& job);
template <class V, class Tile, Sat kSat>
void brute_tiles(TileDescent<Tile>& job);
template <class V, Sat kSat>
std::uint32_t overlap_boxes(const BoxPairs<BoxAos>& pairs);
template <class V>
std::uint32_t overlap_aabbs(const BoxPairs<AabbAos>& pairs);
template <class V>
ConvexAnswer test_convex_pairs(const ConvexBlock& block);
template <class V>
void contact_pairs(const ConvexBlock& block, ConvexContacts& out);
template <class V>
void boxes_by_leaf(const BoxTile* boxes, std::uint32_t leaves, std::uint32_t live, BoxTile* out);
template <class V>
std::uint32_t ray_boxes(const BoxTile& boxes, const BoxRay& ray, float* entry);
template <class V>
std::uint32_t ray_in_boxes(const BoxTile& boxes, const BoxRay& ray, float* entry);
template <class V>
std::uint32_t near_leaves(const NearLeaves& args, std::uint16_t* out);
template <class V>
void meet_past_leaves(PastLeaves& tile);
template <class V>
void point_boxes(const BoxTile& boxes, const float (&point)[3], float* distance_sq);
template <class V>
bool walk_ray(const IndexNodes& index, const RayLanes& ray, IndexWalk& walk, MetBounds* out);
template <class V>
void enter_rays(RayTile& tile);
template <class V>
void cast_boxes(CastTile& tile);
template <class V>
void search_rays(const SearchedIndex& index, RaySearch* const* rays, std::uint32_t count);
template <class V>
void search_points(const SearchedIndex& index, PointSearch* const* points, std::uint32_t count);
template <class V>
std::uint32_t meet_nodes(const IndexNodes& index, const PointLanes& point, MetNode* out, std::uint64_t& opened);
template <class V>
SearchStop search_sphere(const SearchedIndex& index, SphereSearch& sphere);
template <class V>
bool walk_point(const IndexNodes& index, const PointLanes& point, IndexWalk& walk, MetBounds* out);
template <class V>
std::uint32_t overlap_bounds(const BoundsRow& row, const float (&lo)[3], const float (&hi)[3]);
template <class V>
std::uint32_t plane_bounds(const BoundsRow& row, const float (&normal)[3], float offset);
template <class V>
void bound_rigid_leaves(RigidTile& tile);
template <class V>
void make_leaf_words(const RigidTile& tile, LeafWords* const (&rows)[kLanes]);
template <class V>
void place_tile(const PlaceTile& tile, CrowdSurvey& survey);
template <class V>
bool search_strip(StripSearch& job);
template <class V>
std::uint32_t overlapping_words(const WordEntries& entries, PairSlots& slots, std::uint32_t* to, std::uint32_t* used);
template <class V>
std::uint32_t overlap_rigid_leaves(const RigidPairs& job);
template <class V>
void pose_states(const StateTile& tile);
template <class V>
bool pose_round(const RoundPoses& args);
template <class V>
void test_round_body(RoundTest& job);
template <class V>
void skin_leaf(const SkinLeaf& args);
template <class V>
std::uint32_t near_triangles(const SkinnedLeaf& leaf, std::uint32_t patch_count, const float (&lo)[3],
                             const float (&hi)[3], std::uint32_t* out);
template <class V>
std::uint32_t ray_triangles(const SurfaceRay& ray, MetTriangle* out);
template <class V>
bool test_part(const SurfacePart& part, std::uint32_t* triangles, std::uint32_t* count);
template <class V>
bool test_surfaces(const SurfacePair& job, void* taker, bool (*take)(void* taker, const TrianglePairs& pairs));

namespace {

template <class V>
constexpr KernelTable table_of(Isa isa) {
  return {isa,
          pose_leaves<V>,
          pose_link_leaves<V>,
          bound_bulge<V>,
          {{refit_boxes<V, CabRule<false>, ChildrenExtents>, refit_boxes<V, CabRule<false>, LeavesExtents>},
           {refit_boxes<V, Best3Rule, ChildrenExtents>, refit_boxes<V, Best3Rule, LeavesExtents>},
           {refit_boxes<V, CabRule<true>, ChildrenExtents>, refit_boxes<V, CabRule<true>, LeavesExtents>},
           {refit_boxes<V, CovarianceRule, ChildrenExtents>, refit_boxes<V, CovarianceRule, LeavesExtents>}},
          {refit_aabb<V>, refit_aabb_leaves<V>},
          fit_vertices<V>,
          bound_boxes<V>,
          bound_together<V>,
          bounds_to_soa<V>,
          filter_rows<V>,
          boxes_to_aos<V>,
          aabbs_to_aos<V>,
          {descend_tiles<V, BoxTile, Sat::kAll15>, descend_tiles<V, BoxTile, Sat::kFaces6>},
          descend_tiles<V, AabbTile, Sat::kAll15>,
          {brute_tiles<V, BoxTile, Sat::kAll15>, brute_tiles<V, BoxTile, Sat::kFaces6>},
          brute_tiles<V, AabbTile, Sat::kAll15>,
          {overlap_boxes<V, Sat::kAll15>, overlap_boxes<V, Sat::kFaces6>},
          overlap_aabbs<V>,
          test_convex_pairs<V>,
          contact_pairs<V>,
          boxes_by_leaf<V>,
          ray_boxes<V>,
          ray_in_boxes<V>,
          near_leaves<V>,
          meet_past_leaves<V>,
          point_boxes<V>,
          walk_ray<V>,
          enter_rays<V>,
          cast_boxes<V>,
          search_rays<V>,
          search_points<V>,
          meet_nodes<V>,
          search_sphere<V>,
          walk_point<V>,
          overlap_bounds<V>,
          plane_bounds<V>,
          bound_rigid_leaves<V>,
          make_leaf_words<V>,
          place_tile<V>,
          search_strip<V>,
          overlapping_words<V>,
          overlap_rigid_leaves<V>,
          pose_states<V>,
          pose_round<V>,
          test_round_body<V>,
          skin_leaf<V>,
          near_triangles<V>,
          ray_triangles<V>,
          test_part<V>,
          test_surfaces<V>};
}

struct BuiltIsa {
  KernelTable table;
  bool (*cpu_runs)();
};

#define CAB_BUILT_ISA(enumerator, name, V, runs) {table_of<V>(Isa::enumerator), []() -> bool { return runs; }},
constexpr BuiltIsa kBuiltIsas[] = {CAB_BUILT_ISAS(CAB_BUILT_ISA)};
#undef CAB_BUILT_ISA

// Whether a member of the table has a kernel for each value of the policies that it is indexed by.
template <class Member>
constexpr bool is_full(const Member& member) {
  if constexpr (std::is_array_v<Member>) {
    for (const auto& entry : member)
      if (!is_full(entry)) return false;
    return true;
  } else {
    return member != nullptr;
  }
}
constexpr KernelTable kAnyTable = kBuiltIsas[0].table;
static_assert(is_full(kAnyTable.refit_boxes) && is_full(kAnyTable.refit_aabbs));
static_assert(is_full(kAnyTable.descend_boxes) && is_full(kAnyTable.brute_boxes) && is_full(kAnyTable.overlap_boxes));

}  // namespace

const KernelTable* find_kernels(Isa isa) {
  const KernelTable* found = nullptr;
  for (const BuiltIsa& built : kBuiltIsas)
    if ((isa == Isa::kAuto || isa == built.table.isa) && built.cpu_runs()) found = &built.table;
  return found;
}

}  // namespace cab::kernel
