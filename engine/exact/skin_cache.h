// The leaves that a worker has skinned in a call. A leaf is skinned when a pair asks for it, and waits for the next
// pair that does.
#pragma once

#include "engine/exact/exact.h"
#include "kernels/surface/skin_leaf.h"
#include "layout/arena.h"

namespace cab {

// What the leaves of an engine ask of a cache: those of the largest leaf.
struct SkinNeeds {
  std::size_t blocks = 0, patches = 0, bones = 0;
};

// Places of one size, each for a leaf.
struct SkinCache {
  struct Key {
    std::uint32_t batch;  // its index and 1; 0: nothing is there
    std::uint32_t instance, leaf;
  };
  Span<Key> keys;
  Span<kernel::SkinnedLeaf> leaves;
  Span<float> bones;         // SkinLeaf::bones
  Span<const float*> poses;  // SkinLeaf::poses
  Span<std::uint32_t> near;  // triangles of one leaf
};

// Receives how often leaves were skinned, and how often in the place of another.
struct SkinCounts {
  std::uint64_t &skinned, &replaced;
};

// Makes as many places as fit 2 MiB, at most 1024, and three where leaves are larger. Throws std::bad_alloc.
void size_skin_cache(const SkinNeeds& needs, Arena& arena, SkinCache& out);

// Empties all places.
void forget_skinned(SkinCache& cache);

// Where a leaf's skin is. The answer stays as it is while no leaf but one more is asked for with it as `beside`, which
// keeps its place.
const kernel::SkinnedLeaf& skinned(const FrameContext& frame, const ExactLeaf& leaf, const kernel::SkinnedLeaf* beside,
                                   SkinCache& cache, SkinCounts counts);

}  // namespace cab
