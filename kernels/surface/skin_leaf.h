// Where the triangles of one leaf are: its skinned vertices, and bounds of its triangles.
#pragma once

#include "kernels/pose_leaves.h"
#include "kernels/transpose.h"
#include "layout/surface_leaves.h"

#include <limits>

namespace cab::kernel {

// The triangles of one leaf of one instance, in world axes about the instance's origin.
struct SkinnedLeaf {
  float* vertices;   // x y z 0 of each, in the order of its blocks
  AabbTile* bounds;  // of triangles, by patch; then of patches, sixteen to a tile. Unused lanes are empty boxes.
  float size;        // no number on the way to a vertex is larger
};

// A leaf to skin.
struct SkinLeaf {
  const SurfaceLeaves* surface;
  const SurfaceLeaf* leaf;
  PoseCoding coding;
  const float* const* poses;  // by bone
  const float* orientation;   // of the instance, or null
  float scale;                // likewise, with Scaling::kPerInstance
  float* bones;               // scratch: kBoneFloats for each bone
  SkinnedLeaf* out;           // vertices and bounds have room
};

inline constexpr std::uint32_t kBoneFloats = 12;

// How many tiles SkinnedLeaf::bounds has.
inline std::uint32_t bounds_tiles(std::uint32_t patches) { return patches + tile_count(patches); }

// Writes the columns of the matrix that takes vertices where a link moves them, and its translation. Returns how large
// numbers may be on the way.
CAB_INLINE float place_bone(const SkinLeaf& args, const SurfaceBone& bone, const float* pose, float* to) {
  LaneChecks<float> checks = {true, true, true};  // not read: pose_leaves checked the pose when it was bounded
  RawPoses raw, rotations;
  for (std::uint32_t f = 0; f < pose_floats(args.coding.format); ++f) raw.raw[f][0] = pose[f];
  for (std::uint32_t f = 0; f < 4 && args.orientation; ++f) rotations.raw[f][0] = args.orientation[f];
  const RigidLanes<float> at =
      placed_pose<float>(raw, {args.coding, args.orientation ? &rotations : nullptr, &args.scale}, 0, checks);
  for (std::uint32_t k = 0; k < 4; ++k) {
    const Vec3<float> column = {at.scale * bone.bind[k][0], at.scale * bone.bind[k][1], at.scale * bone.bind[k][2]};
    Vec3<float> moved = rotate(at.column, column);
    if (k == 3) moved = at.translation + moved;
    to[3 * k] = moved.x;
    to[3 * k + 1] = moved.y;
    to[3 * k + 2] = moved.z;
  }
  return at.scale * bone.reach + sum(abs(at.translation));
}

// Points where a matrix of kBoneFloats takes them.
template <class V>
CAB_INLINE Vec3<V> moved_by(const float* matrix, const Vec3<V>& point) {
  const auto row = [&](std::uint32_t c) {
    return (V(matrix[c]) * point.x + V(matrix[3 + c]) * point.y) + (V(matrix[6 + c]) * point.z + V(matrix[9 + c]));
  };
  return {row(0), row(1), row(2)};
}

// The vertices of one block, in the lanes that V covers.
template <class V>
CAB_INLINE Vec3<V> skin_block(const VertexBlock& block, const BlockInfluence* influences, const float* bones,
                              std::uint32_t lane) {
  const Vec3<V> place = load3<V>(block.place, lane);
  const V zero(0.0f);
  Vec3<V> out = {zero, zero, zero};
  for (std::uint32_t i = 0; i < block.influence_count; ++i) {
    const V weight = Lanes<V>::load(influences[i].weight + lane);
    out = out + weight * moved_by(bones + kBoneFloats * influences[i].bone, place);
  }
  return out;
}

// The lowest or highest number of the first `count` lanes of a row.
CAB_INLINE float lowest_of(const float (&row)[kLanes], std::uint32_t count) {
  float out = row[0];
  for (std::uint32_t lane = 1; lane < count; ++lane) out = min(out, row[lane]);
  return out;
}
CAB_INLINE float highest_of(const float (&row)[kLanes], std::uint32_t count) {
  float out = row[0];
  for (std::uint32_t lane = 1; lane < count; ++lane) out = max(out, row[lane]);
  return out;
}

// Empties the boxes of all lanes from `count` on.
CAB_INLINE void empty_lanes(AabbTile& tile, std::uint32_t count) {
  for (std::uint32_t lane = count; lane < kLanes; ++lane)
    for (int c = 0; c < 3; ++c) {
      tile.lo[c][lane] = std::numeric_limits<float>::infinity();
      tile.hi[c][lane] = -std::numeric_limits<float>::infinity();
    }
}

// The corners of triangles in lanes: of the sixteen triangles of a patch, or of any sixteen. corners[i][lane] is where
// SkinnedLeaf::vertices has corner i of the triangle of a lane.
struct alignas(64) CornerTile {
  float at[3][4][kLanes];  // x y z 0 of each corner
};

template <class V>
CAB_INLINE void load_corners(const float* const (&corners)[3][kLanes], CornerTile& out) {
  for (std::uint32_t i = 0; i < 3; ++i)
    for (std::uint32_t lane = 0; lane < kLanes; lane += kQuadRows<V>)
      transpose_quads<V>(corners[i] + lane,
                         {out.at[i][0] + lane, out.at[i][1] + lane, out.at[i][2] + lane, out.at[i][3] + lane});
}

template <class V>
CAB_INLINE void store_bounds(const Vec3<V>& lo, const Vec3<V>& hi, std::uint32_t lane, AabbTile& out) {
  const V least[3] = {lo.x, lo.y, lo.z}, most[3] = {hi.x, hi.y, hi.z};
  for (std::uint32_t c = 0; c < 3; ++c) {
    Lanes<V>::store(out.lo[c] + lane, least[c]);
    Lanes<V>::store(out.hi[c] + lane, most[c]);
  }
}

// Bounds of the triangles of one patch, in a frame to which a matrix takes the vertices, or, if it is null, in theirs.
template <class V>
CAB_INLINE void bound_patch(const TrianglePatch& patch, const float* vertices, const float* matrix, AabbTile& out) {
  const float* corners[3][kLanes];
  for (std::uint32_t i = 0; i < 3; ++i)
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      corners[i][lane] = vertices + std::size_t{4} * patch.corner[i][lane];
  CornerTile tile;
  load_corners<V>(corners, tile);
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    Vec3<V> at[3];
    for (std::uint32_t i = 0; i < 3; ++i) {
      at[i] = {Lanes<V>::load(tile.at[i][0] + lane), Lanes<V>::load(tile.at[i][1] + lane),
               Lanes<V>::load(tile.at[i][2] + lane)};
      if (matrix) at[i] = moved_by(matrix, at[i]);
    }
    store_bounds(min(min(at[0], at[1]), at[2]), max(max(at[0], at[1]), at[2]), lane, out);
  }
}

// Skins the vertices of a leaf, and bounds its triangles and its patches.
template <class V>
void skin_leaf(const SkinLeaf& args) {
  const SurfaceLeaves& surface = *args.surface;
  const SurfaceLeaf& leaf = *args.leaf;
  SkinnedLeaf& out = *args.out;
  out.size = 0;
  for (std::uint32_t i = 0; i < leaf.bone_count; ++i)
    out.size = max(out.size, place_bone(args, surface.bones[leaf.bone_begin + i], args.poses[i],
                                        args.bones + std::size_t{kBoneFloats} * i));
  for (std::uint32_t b = 0; b < leaf.block_count; ++b) {
    const VertexBlock& block = surface.blocks[leaf.block_begin + b];
    alignas(64) float at[4][kLanes] = {};
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      const Vec3<V> v = skin_block<V>(block, surface.influences.data + block.influence_begin, args.bones, lane);
      Lanes<V>::store(at[0] + lane, v.x);
      Lanes<V>::store(at[1] + lane, v.y);
      Lanes<V>::store(at[2] + lane, v.z);
    }
    for (std::uint32_t lane = 0; lane < kLanes; lane += kQuadRows<V>)
      scatter_quads<V>({at[0] + lane, at[1] + lane, at[2] + lane, at[3] + lane}, 4,
                       out.vertices + std::size_t{4} * (kLanes * b + lane));
  }
  for (std::uint32_t p = 0; p < leaf.patch_count; ++p) {
    const TrianglePatch& patch = surface.patches[leaf.patch_begin + p];
    AabbTile& bounds = out.bounds[p];
    bound_patch<V>(patch, out.vertices, nullptr, bounds);
    AabbTile& all = out.bounds[leaf.patch_count + p / kLanes];
    for (std::uint32_t c = 0; c < 3; ++c) {
      all.lo[c][p % kLanes] = lowest_of(bounds.lo[c], patch.count);
      all.hi[c][p % kLanes] = highest_of(bounds.hi[c], patch.count);
    }
    empty_lanes(bounds, patch.count);
  }
  if (leaf.patch_count % kLanes != 0)
    empty_lanes(out.bounds[leaf.patch_count + leaf.patch_count / kLanes], leaf.patch_count % kLanes);
}

}  // namespace cab::kernel
