// Compiled once per instruction set with CAB_ISA (its name), CAB_ISA_ID and CAB_ISA_TABLE: fills its table of kernels.
#include "kernels/kernel_table.h"

#include "kernels/descend_tiles.h"
#include "kernels/filter_rows.h"
#include "kernels/gather_pairs.h"
#include "kernels/overlapping_entries.h"
#include "kernels/pose_leaves.h"
#include "kernels/pose_link.h"
#include "kernels/refit_tree.h"

namespace cab::kernel {
namespace {

namespace isa_type {
using scalar = float;
#if XSIMD_WITH_SSE2
using sse2 = Batch<xsimd::sse2>;
#endif
#if XSIMD_WITH_AVX2
using avx2 = Batch<xsimd::avx2>;
#endif
#if XSIMD_WITH_AVX512F
using avx512 = Batch<xsimd::avx512bw>;
#endif
#if XSIMD_WITH_NEON64
using neon64 = Batch<xsimd::neon64>;
#endif
}  // namespace isa_type

using V = isa_type::CAB_ISA;

}  // namespace

extern const KernelTable CAB_ISA_TABLE;
const KernelTable CAB_ISA_TABLE = {
    Isa::CAB_ISA_ID,
    pose_leaves<V>,
    pose_link_leaves<V>,
    {{refit_boxes<V, CabRule<false>, ChildrenExtents>, refit_boxes<V, CabRule<false>, LeavesExtents>},
     {refit_boxes<V, CabRule<true>, ChildrenExtents>, refit_boxes<V, CabRule<true>, LeavesExtents>},
     {refit_boxes<V, CovarianceRule, ChildrenExtents>, refit_boxes<V, CovarianceRule, LeavesExtents>},
     {refit_boxes<V, CovarianceLeavesRule, ChildrenExtents>, refit_boxes<V, CovarianceLeavesRule, LeavesExtents>},
     {refit_boxes<V, Best3Rule, ChildrenExtents>, refit_boxes<V, Best3Rule, LeavesExtents>}},
    {refit_aabb<V>, refit_aabb_leaves<V>},
    fit_vertices<V>,
    bound_boxes<V>,
    bound_together<V>,
    bounds_to_soa<V>,
    filter_rows<V>,
    overlapping_entries<V>,
    boxes_to_aos<V>,
    aabbs_to_aos<V>,
    {descend_tiles<V, BoxTile, Sat::kAll15>, descend_tiles<V, BoxTile, Sat::kFaces6>},
    descend_tiles<V, AabbTile>,
    {brute_tiles<V, BoxTile, Sat::kAll15>, brute_tiles<V, BoxTile, Sat::kFaces6>},
    brute_tiles<V, AabbTile>,
    {overlap_boxes<V, Sat::kAll15>, overlap_boxes<V, Sat::kFaces6>},
    overlap_aabbs<V>};

}  // namespace cab::kernel
