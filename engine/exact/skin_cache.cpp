#include "engine/exact/skin_cache.h"

#include <algorithm>

namespace cab {
namespace {

constexpr std::size_t kBytes = std::size_t{1} << 21;
constexpr std::size_t kLeastPlaces = 3, kMostPlaces = 1024;

// A number between 0 and `count` - 1 for a leaf of an instance.
std::size_t place_of(const ExactLeaf& leaf, std::size_t count) {
  std::uint64_t hash = leaf.batch_index;
  hash = (hash * 0x9e3779b97f4a7c15u) ^ leaf.instance;
  hash = (hash * 0x9e3779b97f4a7c15u) ^ leaf.leaf;
  return static_cast<std::size_t>(((hash * 0x9e3779b97f4a7c15u) >> 32) * count >> 32);
}

bool has(const SkinCache::Key& key, const ExactLeaf& leaf) {
  return key.batch == leaf.batch_index + 1 && key.instance == leaf.instance && key.leaf == leaf.leaf;
}

void skin(const FrameContext& frame, const ExactLeaf& leaf, SkinCache& cache, kernel::SkinnedLeaf& out) {
  const InstanceBatch& batch = *leaf.batch;
  const SurfaceLeaves& surface = batch.articulation->surface;
  const SurfaceLeaf& of = surface.leaves[leaf.leaf];
  for (std::uint32_t i = 0; i < of.bone_count; ++i)
    cache.poses[i] = pose_of(batch, leaf.instance, surface.bones[of.bone_begin + i].link);
  frame.kernels.skin_leaf({&surface, &of, coding_of(batch), cache.poses.data, orientation_of(batch, leaf.instance),
                           scale_of(batch, leaf.instance), cache.bones.data, &out});
}

}  // namespace

void size_skin_cache(const SkinNeeds& needs, Arena& arena, SkinCache& out) {
  out = {};
  if (needs.patches == 0) return;
  const std::size_t floats = std::size_t{4} * kLanes * needs.blocks;
  const std::size_t tiles = kernel::bounds_tiles(static_cast<std::uint32_t>(needs.patches));
  const std::size_t each = sizeof(float) * floats + sizeof(AabbTile) * tiles;
  const std::size_t count = std::clamp(kBytes / each, kLeastPlaces, kMostPlaces);
  out.keys = arena.allocate<SkinCache::Key>(count);
  out.leaves = arena.allocate<kernel::SkinnedLeaf>(count);
  const Span<float> vertices = arena.allocate<float>(count, floats);
  const Span<AabbTile> bounds = arena.allocate<AabbTile>(count, tiles);
  for (std::size_t i = 0; i < count; ++i) {
    out.leaves[i].vertices = vertices.data + i * floats;
    out.leaves[i].bounds = bounds.data + i * tiles;
  }
  out.bones = arena.allocate<float>(kernel::kBoneFloats * needs.bones);
  out.poses = arena.allocate<const float*>(needs.bones);
  out.near = arena.allocate<std::uint32_t>(kLanes, needs.patches);
}

void forget_skinned(SkinCache& cache) {
  for (SkinCache::Key& key : cache.keys) key = {};
}

const kernel::SkinnedLeaf& skinned(const FrameContext& frame, const ExactLeaf& leaf, const kernel::SkinnedLeaf* beside,
                                   SkinCache& cache, SkinCounts counts) {
  // The last place is for a leaf whose own is that of `beside`.
  const std::size_t last = cache.keys.size - 1;
  std::size_t place = place_of(leaf, last);
  if (&cache.leaves[place] == beside) place = last;
  SkinCache::Key& key = cache.keys[place];
  if (has(key, leaf)) return cache.leaves[place];
  counts.replaced += key.batch != 0;
  ++counts.skinned;
  key = {leaf.batch_index + 1, leaf.instance, leaf.leaf};
  skin(frame, leaf, cache, cache.leaves[place]);
  return cache.leaves[place];
}

}  // namespace cab
