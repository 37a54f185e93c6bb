// The table of kernels of one instruction set. The files of kernels/isa define the kernels; find_kernels.h chooses.
#pragma once

#include "layout/box_aos.h"
#include "layout/leaf_words.h"
#include "layout/merge_program.h"
#include "layout/tile.h"

#include <cab/types.h>

namespace cab::kernel {

struct PoseTile;
struct PoseLink;
struct BulgeTile;
struct RefitTile;
struct VertexTile;
struct RowFilter;
struct BoundsRow;
struct RayLanes;
struct PointLanes;
struct BoxRay;
struct NearLeaves;
struct PastLeaves;
struct IndexNodes;
struct IndexWalk;
struct MetBounds;
struct RayTile;
struct CastTile;
struct SearchedIndex;
struct RaySearch;
struct PointSearch;
struct SphereSearch;
struct MetNode;
enum class SearchStop : std::uint8_t;
struct ConvexBlock;
struct ConvexAnswer;
struct ConvexContacts;
struct RigidTile;
struct RigidPairs;
struct WordEntries;
struct PairSlots;
struct PlaceTile;
struct CrowdSurvey;
struct StripSearch;
struct StateTile;
struct RoundPoses;
struct RoundTest;
struct SkinLeaf;
struct SkinnedLeaf;
struct MetTriangle;
struct SurfacePair;
struct SurfacePart;
struct SurfaceRay;
struct TrianglePairs;
template <class Tile>
struct TileDescent;
template <class AosBox>
struct BoxPairs;

// The refits that make oriented boxes are those before kAabbHull.
inline constexpr std::uint32_t kOrientedRefitCount = static_cast<std::uint32_t>(Refit::kAabbHull);

// One function per kind of work. One call handles one tile or one chunk of pairs. The comment of the kernel says what
// it reads and writes; find_kernels.cpp pairs members with kernels.
struct KernelTable {
  Isa isa;
  void (*pose_leaves)(const PoseTile&);
  void (*pose_link_leaves)(const PoseLink&);
  void (*bound_bulge)(BulgeTile&);
  void (*refit_boxes[kOrientedRefitCount][kExtentsCount])(const RefitTile&);  // by Refit (oriented ones) and Extents
  void (*refit_aabbs[kExtentsCount])(const MergeProgram&, AabbTile* nodes);   // by Extents
  void (*fit_vertices)(const VertexTile&);
  void (*bound_boxes)(const BoxTile* boxes, std::uint32_t count, AabbTile* bounds);
  void (*bound_together)(const AabbTile* bounds, std::uint32_t count, AabbTile* all);
  void (*bounds_to_soa)(const AabbTile* bounds, std::uint32_t leaves, std::uint32_t live, float* soa);
  void (*filter_rows)(const RowFilter&);
  void (*boxes_to_aos)(const BoxTile* nodes, std::uint32_t count, std::uint32_t live, BoxAos* boxes,
                       std::size_t instance_stride);
  void (*aabbs_to_aos)(const AabbTile* nodes, std::uint32_t count, std::uint32_t live, AabbAos* boxes,
                       std::size_t instance_stride);
  void (*descend_boxes[kSatCount])(TileDescent<BoxTile>&);  // by Sat
  void (*descend_aabbs)(TileDescent<AabbTile>&);
  void (*brute_boxes[kSatCount])(TileDescent<BoxTile>&);  // by Sat
  void (*brute_aabbs)(TileDescent<AabbTile>&);
  std::uint32_t (*overlap_boxes[kSatCount])(const BoxPairs<BoxAos>&);  // by Sat
  std::uint32_t (*overlap_aabbs)(const BoxPairs<AabbAos>&);
  ConvexAnswer (*test_convex_pairs)(const ConvexBlock&);
  void (*contact_pairs)(const ConvexBlock&, ConvexContacts&);
  void (*boxes_by_leaf)(const BoxTile* boxes, std::uint32_t leaves, std::uint32_t live, BoxTile* out);
  std::uint32_t (*ray_boxes)(const BoxTile& boxes, const BoxRay&, float* entry);
  std::uint32_t (*ray_in_boxes)(const BoxTile& boxes, const BoxRay&, float* entry);
  std::uint32_t (*near_leaves)(const NearLeaves&, std::uint16_t* out);
  void (*meet_past_leaves)(PastLeaves&);
  void (*point_boxes)(const BoxTile& boxes, const float (&point)[3], float* distance_sq);
  bool (*walk_ray)(const IndexNodes&, const RayLanes&, IndexWalk&, MetBounds* out);
  void (*enter_rays)(RayTile&);
  void (*cast_boxes)(CastTile&);
  void (*search_rays)(const SearchedIndex&, RaySearch* const* rays, std::uint32_t count);
  void (*search_points)(const SearchedIndex&, PointSearch* const* points, std::uint32_t count);
  std::uint32_t (*meet_nodes)(const IndexNodes&, const PointLanes&, MetNode* out, std::uint64_t& opened);
  SearchStop (*search_sphere)(const SearchedIndex&, SphereSearch&);
  bool (*walk_point)(const IndexNodes&, const PointLanes&, IndexWalk&, MetBounds* out);
  std::uint32_t (*overlap_bounds)(const BoundsRow&, const float (&lo)[3], const float (&hi)[3]);
  std::uint32_t (*plane_bounds)(const BoundsRow&, const float (&normal)[3], float offset);
  void (*bound_rigid_leaves)(RigidTile&);
  void (*make_leaf_words)(const RigidTile&, LeafWords* const (&rows)[kLanes]);
  void (*place_tile)(const PlaceTile&, CrowdSurvey&);
  bool (*search_strip)(StripSearch&);
  std::uint32_t (*overlapping_words)(const WordEntries&, PairSlots&, std::uint32_t* to, std::uint32_t* used);
  std::uint32_t (*overlap_rigid_leaves)(const RigidPairs&);
  void (*pose_states)(const StateTile&);
  bool (*pose_round)(const RoundPoses&);
  void (*test_round_body)(RoundTest&);
  void (*skin_leaf)(const SkinLeaf&);
  std::uint32_t (*near_triangles)(const SkinnedLeaf&, std::uint32_t patch_count, const float (&lo)[3],
                                  const float (&hi)[3], std::uint32_t* out);
  std::uint32_t (*ray_triangles)(const SurfaceRay&, MetTriangle* out);
  bool (*test_part)(const SurfacePart&, std::uint32_t* triangles, std::uint32_t* count);
  bool (*test_surfaces)(const SurfacePair&, void* taker, bool (*take)(void* taker, const TrianglePairs&));
};

}  // namespace cab::kernel
