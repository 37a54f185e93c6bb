// What an engine stores of its batches, and which of them a frame pairs.
#pragma once

#include "engine/step/instance_batch.h"
#include "layout/arena.h"
#include "layout/rigid_shape.h"

#include <cstddef>
#include <memory>

namespace cab {

class FclShapes;
struct ConvexShapes;

// Static bodies, which session/static_bodies.h defines.
struct StaticBodies;
struct StaticBodiesDelete {
  void operator()(StaticBodies* bodies) const;
};
using StaticBodiesPtr = std::unique_ptr<StaticBodies, StaticBodiesDelete>;

// A leaf and its link in a number: leaf_name(link_a, a) | leaf_name(link_b, b) << 16 is the last four members of a hit
// from the lowest bits on.
constexpr std::uint64_t leaf_name(std::uint64_t link, std::uint64_t leaf) { return link | leaf << 32; }

// Most leaves of an instance that has words. More are for the strategies `links` and `tree`, or are posed for `rows`.
inline constexpr std::uint32_t kCrowdLeaves = 128;

// Of a batch of characters. shape: its leaf boxes as the kernels read them, made anew whenever the margin, the stride
// of poses or whether instances are placed changes. order: its instances as the last frame sorted them, all of them or
// none; it is the order in which the next frame bounds them, and changes no result.
struct CrowdBatch {
  bool is_rigid = false;   // whether the kernels take the articulation
  bool is_direct = false;  // whether its leaf pairs are link pairs in the same order
  std::uint32_t blocks = 0;
  Span<RigidBlock> block;
  Span<RigidLeaf> leaf;
  Span<BoxAos> exact;
  Span<std::uint32_t> offset;
  Span<std::uint32_t> bare;
  Span<std::uint16_t> bare_link;
  Span<std::uint64_t> leaf_name;  // by leaf: cab::leaf_name
  RigidShape shape;
  float size = 0;  // the largest S + |c|_1 of a leaf, with the margin
  float margin = -1;
  std::size_t stride = 0;
  Span<std::uint32_t> order;
  bool ordered = false;
  bool has_sides = false;  // whether the bounds of its last frame are sides of rows, and not in InstanceBatch::bounds
  // Of the current frame: the batch's index, where its rows and its words begin; whether rows are by place (else by
  // instance), and put into strips in `order`; whether it will have an order, and how many instances that has so far.
  std::uint32_t index = 0, first_row = 0, row_count = 0, first_words = 0;
  bool is_by_place = false;
  bool visits_by_order = false;
  bool has_words = false;         // whether the words of all its live instances are there, from the last frame
  std::uint64_t laid_out_in = 0;  // Crowd::frames of the frame in which its rows were written in the order of instances
  bool orders = false;
  std::uint32_t in_order = 0;
};

// How many LeafWords an instance has, if a crowd takes its articulation.
inline std::size_t crowd_blocks(const Articulation& articulation) {
  return articulation.leaf_count > kCrowdLeaves ? 0 : (articulation.leaf_count + kLanes - 1) / kLanes;
}

// A batch of the engine, with the exact shapes of its articulation or of its static bodies.
struct StoredBatch {
  explicit StoredBatch(const Allocator& allocator) : arena(allocator) {}

  // Whether the slot holds a batch. If not, it has no instances.
  bool in_use() const { return batch.articulation != nullptr; }

  std::uint32_t serial = 0;  // of the id
  Arena arena;               // owns the arrays of `batch`
  InstanceBatch batch;
  CrowdBatch crowd;                             // its arrays are in `arena`
  StaticBodiesPtr statics;                      // null unless the instances are static bodies
  BatchInput completed;                         // of static bodies: the call's input, with what is known of them
  const FclShapes* fcl_shapes = nullptr;        // owned by the articulation or by `statics`
  const ConvexShapes* convex_shapes = nullptr;  // likewise
};

// The batches of an engine, by slot - 1.
using StoredBatches = Span<const std::unique_ptr<StoredBatch>>;

// Which batches of characters are paired in a frame, by index.
struct PairedBatches {
  Span<std::uint64_t> bits;      // bit a * count + b: whether a rule pairs batches a and b
  Span<std::uint64_t> skipped;   // the same: whether not those instances of which both rest
  std::size_t count = 0;         // of batches
  bool reports_resting = false;  // whether a rule reports the hits of two instances that both may rest

  static bool has_bit(Span<std::uint64_t> of, std::size_t bit) { return of[bit >> 6] >> (bit & 63) & 1; }
  bool paired(std::uint32_t a, std::uint32_t b) const { return has_bit(bits, a * count + b); }
  bool skips_resting(std::uint32_t a, std::uint32_t b) const { return has_bit(skipped, a * count + b); }
};

}  // namespace cab
