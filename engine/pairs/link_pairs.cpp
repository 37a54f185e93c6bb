// Leaf pairs by strategy `links`: poses the leaves of overlapping links and tests their pairs.
#include "engine/pairs/link_pairs.h"

#include "engine/pairs/pair_block.h"
#include "engine/pairs/pair_scratch.h"
#include "engine/step/generation.h"
#include "engine/step/in_contact.h"
#include "kernels/pose_link.h"

#include <algorithm>

namespace cab {
namespace {

// One link, or one leaf, of one instance in a worker's set.
struct LinkSide {
  const InstanceBatch* batch;
  const LinkLeaves* leaves;  // which leaves the link has; null for a leaf
  std::uint32_t slot;        // of the instance
  std::uint16_t box;         // index of the active leaf

  std::uint32_t leaf_count() const { return leaves ? leaves->leaf_count : 1; }
  // The number of leaves, padded to whole tiles.
  std::uint32_t width() const { return leaf_bounds_width(leaf_count()); }
  // The index in the articulation of the i-th leaf.
  std::uint16_t leaf(std::uint32_t i) const {
    return leaves ? batch->articulation->leaf_order[leaves->first_leaf + i] : box;
  }
};

LinkSide side_of(const FrameContext& frame, std::uint32_t batch, std::uint32_t slot, std::uint16_t box) {
  const InstanceBatch& owner = frame.batch(batch);
  return {&owner, owner.strategy == Strategy::kLinks ? &owner.link_bounds->leaves[box] : nullptr, slot, box};
}

// The leaf bounds of the instance at a slot.
const float* leaf_bounds_at(const PosedSet& set, const LinkSide& side) {
  return set.tile_of(side.slot).leaf_bounds + side.slot % kLanes * leaf_bounds_floats(side.batch->active->leaf_count);
}

// Copies the box and the bounds of a leaf to the end of the set.
void copy_leaf(const LinkSide& side, PairScratch& scratch) {
  PosedLinkSet& set = scratch.posed_links;
  const float* const bounds = leaf_bounds_at(scratch.posed, side);
  const std::uint32_t width = leaf_bounds_width(side.batch->active->leaf_count);
  *set.boxes.end() = boxes_at<BoxAos>(scratch.posed, side.slot)[side.box];
  for (std::uint32_t bound = 0; bound < 6; ++bound)
    std::fill_n(set.leaf_bounds.end() + bound * side.width(), side.width(), bounds[bound * width + side.box]);
}

// Poses the leaves of a link to the end of the set.
void pose_leaves_of_link(const FrameContext& frame, const LinkSide& side, PairScratch& scratch) {
  PosedLinkSet& set = scratch.posed_links;
  const std::uint32_t instance = scratch.posed.tile_of(side.slot).instances.instance[side.slot % kLanes];
  kernel::PoseLink pose;
  pose.at = stored_pose(*side.batch, instance, side.leaves->link);
  pose.local = side.batch->link_bounds->tiles.data + side.leaves->first_tile;
  pose.leaf_count = side.leaves->leaf_count;
  pose.margin = kMarginShare * margin_of(*side.batch, instance, frame.margin);
  pose.boxes = set.boxes.end();
  pose.leaf_bounds = set.leaf_bounds.end();
  frame.kernels.pose_link_leaves(pose);
}

// Returns the index in PosedLinkSet::boxes of the first leaf of a link. Poses the leaves if the set does not have them
// yet; then there must be room for them.
std::uint32_t posed_leaves(const FrameContext& frame, const LinkSide& side, PairScratch& scratch) {
  const PosedTile& tile = scratch.posed.tile_of(side.slot);
  const std::uint32_t lane = side.slot % kLanes;
  PosedLinkSet& set = scratch.posed_links;
  PosedLinkEntry& entry =
      set.entries[static_cast<std::size_t>(tile.boxes - scratch.posed.boxes.data) + lane * tile.nodes + side.box];
  if (entry.generation == set.generation) return entry.first;
  entry = {set.generation, set.boxes.size};
  if (side.leaves)
    pose_leaves_of_link(frame, side, scratch);
  else
    copy_leaf(side, scratch);
  set.boxes.size += side.width();
  set.leaf_bounds.size += 6 * side.width();
  return entry.first;
}

// Sets the region of a filter, relative to the origin of a, to the intersection of the bounds of both links. A leaf of
// one link outside of it touches no leaf of the other.
void set_overlap_region(const PosedSet& set, const LinkSide& a, const LinkSide& b, const double (&shift)[3],
                        kernel::RowFilter& filter) {
  const auto bound = [&set](const LinkSide& side, std::uint32_t side_of_bounds) {
    const std::uint32_t width = leaf_bounds_width(side.batch->active->leaf_count);
    return static_cast<double>(leaf_bounds_at(set, side)[side_of_bounds * width + side.box]);
  };
  for (std::uint32_t c = 0; c < 3; ++c) {
    filter.region_lo[c] = float_below(std::max(bound(a, c), bound(b, c) + shift[c]));
    filter.region_hi[c] = float_above(std::min(bound(a, 3 + c), bound(b, 3 + c) + shift[c]));
  }
}

// Tests leaf pairs of one candidate in blocks of sixteen, and keeps those that overlap at the beginning of
// PairScratch::found. The leaf pairs of one link pair come one after the other, in ascending order.
struct LeafPairTester {
  const FrameContext& frame;
  PairScratch& scratch;
  FrameStats& stats;
  bool lowest_only;  // whether the lowest overlapping leaf pair of each link pair suffices
  PairBlock<BoxAos> block;
  std::uint32_t link_pair[kLanes] = {};  // by lane: index of the link pair
  std::uint32_t kept = 0;                // number of kept leaf pairs
  std::uint32_t last_kept = 0xffffffff;  // index of the link pair of the last kept leaf pair

  LeafPairTester(const FrameContext& context, PairScratch& by, FrameStats& of)
      : frame(context), scratch(by), stats(of), lowest_only(context.policies.exact == Exact::kNone) {
    block.boxes.shift = &block.shift;
    block.boxes.leaves = 0xffff;
  }

  // Takes a leaf pair of the link pair `from` into the block, and tests the block if that fills it.
  void take(const NodePair& nodes, const BoxAos& a, const BoxAos& b, const double (&shift)[3], std::uint32_t from) {
    const std::uint32_t lane = block.count++;
    block.pair[lane] = nodes;
    block.boxes.a[lane] = &a;
    block.boxes.b[lane] = &b;
    for (std::uint32_t c = 0; c < 3; ++c) block.shift.by[c][lane] = shift[c];
    link_pair[lane] = from;
    if (block.count == kLanes) test();
  }

  // Tests the block and empties it. With lowest_only, counts the tests that a scalar loop would make: none after the
  // first kept leaf pair of a link pair. How many more of them the block holds depends on when it was last emptied.
  void test() {
    if (block.count == 0) return;
    pad(block);
    const std::uint32_t overlapping = overlap_block(frame.kernels, frame.policies.sat, block.boxes);
    for (std::uint32_t lane = 0; lane < block.count; ++lane) {
      if (is_done(link_pair[lane])) continue;
      ++stats.box_tests;
      if (!(overlapping >> lane & 1)) continue;
      scratch.found.data[kept++] = {block.pair[lane].candidate, block.pair[lane].a, block.pair[lane].b};
      last_kept = link_pair[lane];
    }
    block.count = 0;
  }

  // Whether the remaining leaf pairs of a link pair need no test.
  bool is_done(std::uint32_t pair) const { return lowest_only && last_kept == pair; }
};

}  // namespace

void find_pairs_of_links(const FrameContext& frame, const Candidate& candidate, Span<const LeafPair> links,
                         PairScratch& scratch, FrameStats& stats) {
  const bool within = is_within(candidate);
  PosedLinkSet& set = scratch.posed_links;
  FixedList<LeafPair>& found = scratch.found;
  kernel::RowFilter filter;
  filter.self = false;
  filter.found = &found;
  double shift[3];
  origin_difference(scratch.posed, candidate, shift);
  set_shift(shift, filter);
  LeafPairTester tester(frame, scratch, stats);
  for (std::uint32_t at = 0; at < links.size; ++at) {
    const LinkSide a = side_of(frame, candidate.batch_a, candidate.slot_a, links[at].a),
                   b = side_of(frame, candidate.batch_b, candidate.slot_b, links[at].b);
    if (set.boxes.size + a.width() + b.width() > set.boxes.capacity) {
      tester.test();
      clear_links(set);
    }
    const std::uint32_t first_a = posed_leaves(frame, a, scratch), first_b = posed_leaves(frame, b, scratch);
    filter.a = set.leaf_bounds.data + 6 * std::size_t{first_a};
    filter.b = set.leaf_bounds.data + 6 * std::size_t{first_b};
    filter.leaves_a = a.leaf_count();
    filter.leaves_b = b.leaf_count();
    filter.candidate = links[at].candidate;
    set_overlap_region(scratch.posed, a, b, shift, filter);
    for (filter.begin_a = 0; filter.begin_a < filter.leaves_a && !tester.is_done(at); filter.begin_a += kLanes) {
      filter.end_a = std::min(filter.leaves_a, filter.begin_a + kLanes);
      // The filter writes after the space for the kept pairs and those in the block, so that test() overwrites no pair
      // that is not read yet.
      const std::uint32_t begin = found.size = tester.kept + tester.block.count;
      frame.kernels.filter_rows(filter);
      for (std::uint32_t i = begin; i < found.size && !tester.is_done(at); ++i) {
        const LeafPair pair = found.data[i];
        NodePair nodes = {pair.candidate, a.leaf(pair.a), b.leaf(pair.b)};
        const BoxAos *box_a = set.boxes.data + first_a + pair.a, *box_b = set.boxes.data + first_b + pair.b;
        if (within && nodes.b < nodes.a) {  // the leaf predicate takes the lower leaf as a
          std::swap(nodes.a, nodes.b);
          std::swap(box_a, box_b);
        }
        tester.take(nodes, *box_a, *box_b, shift, at);
      }
    }
    if (!frame.first_only()) continue;
    tester.test();
    if (tester.kept > 0) break;
  }
  tester.test();
  found.size = tester.kept;
  if (frame.first_only() && tester.kept > 0) set_in_contact(frame, candidate);
}

void clear_links(PosedLinkSet& set) {
  set.boxes.clear();
  set.leaf_bounds.clear();
  begin_generation(set.generation, set.entries);
}

}  // namespace cab
