// Leaf pairs of posed candidates: traversal of node pairs (`tree`, `brute`) and comparison of leaf bounds (`rows`, and
// `links` for the boxes of links).
#include "engine/pairs/traverse.h"

#include "engine/pairs/pair_block.h"
#include "engine/pairs/pair_scratch.h"
#include "engine/step/in_contact.h"
#include "engine/step/timed.h"
#include "kernels/filter_rows.h"
#include "kernels/gather_pairs.h"
#include "layout/compiler.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

// The node pairs that a traversal starts from. Where both instances have strategy `tree`, these are the two roots of a
// candidate, or the two children of every inner node of a candidate within one instance. With `brute` they
// are all leaf pairs. next() hands out one pair at a time, so that they need no memory.
class Seeds {
 public:
  Seeds(const FrameContext& frame, const PairScratch& scratch, std::uint32_t begin, std::uint32_t end)
      : frame_(frame),
        scratch_(scratch),
        brute_(frame.policies.strategy == Strategy::kBrute),
        candidate_(begin),
        end_(end) {}

  // Writes the next pair; false after the last one.
  bool next(NodePair* out) {
    while (candidate_ < end_) {
      const Candidate& candidate = scratch_.candidates.data[candidate_];
      const Articulation& a = *frame_.batch(candidate.batch_a).articulation;
      const Articulation& b = *frame_.batch(candidate.batch_b).articulation;
      const bool within = is_within(candidate);
      if (brute_                               ? next_leaves(a, b, within, out)
          : !descends_trees(frame_, candidate) ? false
          : within                             ? next_children(a, out)
                                               : next_roots(a, b, out)) {
        out->candidate = candidate_;
        return true;
      }
      ++candidate_;
      i_ = j_ = 0;
    }
    return false;
  }

 private:
  bool next_roots(const Articulation& a, const Articulation& b, NodePair* out) {
    if (i_++ > 0) return false;
    out->a = static_cast<std::uint16_t>(a.node_count - 1);
    out->b = static_cast<std::uint16_t>(b.node_count - 1);
    return true;
  }
  bool next_children(const Articulation& a, NodePair* out) {
    if (i_ == a.program.steps.size) return false;
    out->a = a.program.steps[i_].left;
    out->b = a.program.steps[i_].right;
    ++i_;
    return true;
  }
  bool next_leaves(const Articulation& a, const Articulation& b, bool within, NodePair* out) {
    if (within && j_ <= i_) j_ = i_ + 1;
    if (j_ >= b.leaf_count) {
      ++i_;
      j_ = within ? i_ + 1 : 0;
    }
    if (i_ >= a.leaf_count || j_ >= b.leaf_count) return false;
    out->a = static_cast<std::uint16_t>(i_);
    out->b = static_cast<std::uint16_t>(j_++);
    return true;
  }

  const FrameContext& frame_;
  const PairScratch& scratch_;
  bool brute_;
  std::uint32_t candidate_, end_;
  std::uint32_t i_ = 0, j_ = 0;
};

// The articulations and boxes of the two instances of a candidate.
template <class AosBox>
struct Sides {
  const Articulation* a;
  const Articulation* b;
  const AosBox* boxes_a;
  const AosBox* boxes_b;
};

template <class AosBox>
Sides<AosBox> sides_of(const FrameContext& frame, const PairScratch& scratch, const Candidate& candidate) {
  return {frame.batch(candidate.batch_a).articulation, frame.batch(candidate.batch_b).articulation,
          boxes_at<AosBox>(scratch.posed, candidate.slot_a), boxes_at<AosBox>(scratch.posed, candidate.slot_b)};
}

// Takes a node pair into the block, but leaves out a leaf pair whose links are ignored.
template <class AosBox>
void take(const FrameContext& frame, const PairScratch& scratch, NodePair pair, PairBlock<AosBox>& block) {
  const Candidate& candidate = scratch.candidates.data[pair.candidate];
  const bool within = is_within(candidate);
  const Sides<AosBox> sides = sides_of<AosBox>(frame, scratch, candidate);
  const bool leaves = pair.a < sides.a->leaf_count && pair.b < sides.b->leaf_count;
  if (leaves && within) {
    if (is_ignored(*sides.a, sides.a->leaf_link[pair.a], sides.a->leaf_link[pair.b])) return;
    if (pair.b < pair.a) pair = {pair.candidate, pair.b, pair.a};
  }
  const std::uint32_t lane = block.count++;
  block.pair[lane] = pair;
  block.boxes.a[lane] = sides.boxes_a + pair.a;
  block.boxes.b[lane] = sides.boxes_b + pair.b;
  if (leaves) block.boxes.leaves |= 1u << lane;
  double shift[3];
  origin_difference(scratch.posed, candidate, shift);
  for (std::uint32_t c = 0; c < 3; ++c) block.shift.by[c][lane] = shift[c];
}

// Pushes the two pairs that replace an overlapping inner pair: the children of the node with more leaves (a if equal),
// each with the other node. A descent of tiles (kernels/descend_tiles.h) opens the same nodes.
template <class AosBox>
void open(const FrameContext& frame, PairScratch& scratch, const NodePair& pair) {
  const Sides<AosBox> sides = sides_of<AosBox>(frame, scratch, scratch.candidates.data[pair.candidate]);
  const MergeProgram& a = sides.a->program;
  const MergeProgram& b = sides.b->program;
  if (a.node_leaf_count[pair.a] >= b.node_leaf_count[pair.b]) {
    const MergeStep& step = a.steps[pair.a - sides.a->leaf_count];
    scratch.stack.push({pair.candidate, step.right, pair.b});
    scratch.stack.push({pair.candidate, step.left, pair.b});
  } else {
    const MergeStep& step = b.steps[pair.b - sides.b->leaf_count];
    scratch.stack.push({pair.candidate, pair.a, step.right});
    scratch.stack.push({pair.candidate, pair.a, step.left});
  }
}

// Traverses the node pairs of candidates with a stack and appends overlapping leaf pairs to PairScratch::found. Each
// round tests a block of up to sixteen pairs from the top of the stack, or from the seeds once the stack is empty, and
// opens the inner pairs that overlap. The level of a pair is the number of opens since its seed. Levels never decrease
// from the bottom of the stack to its top. A round that opens a pair takes all pairs above it off the stack too, at
// most fifteen. So no level ever has more than 32 pairs (kStackPairsPerLevel).
template <class AosBox>
void traverse(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, PairScratch& scratch,
              FrameStats& stats) {
  Seeds seeds(frame, scratch, begin, end);
  const bool first_only = frame.first_only();
  scratch.stack.clear();
  const auto is_open = [&](const NodePair& pair) {
    return !first_only || !is_already_reported(frame, scratch.candidates.data[pair.candidate]);
  };
  for (;;) {
    PairBlock<AosBox> block;
    block.boxes.leaves = 0;
    block.boxes.shift = &block.shift;
    const std::uint32_t popped = scratch.stack.size < kLanes ? scratch.stack.size : kLanes;
    scratch.stack.size -= popped;
    for (std::uint32_t i = 0; i < popped; ++i) {
      const NodePair& from = scratch.stack.data[scratch.stack.size + i];
      if (is_open(from)) take(frame, scratch, from, block);
    }
    const std::uint32_t from_stack = block.count;
    NodePair pair;
    while (block.count < kLanes && scratch.stack.empty() && seeds.next(&pair))
      if (is_open(pair)) take(frame, scratch, pair, block);
    if (block.count == 0) {
      if (scratch.stack.empty()) return;
      continue;
    }
    pad(block);
    stats.box_tests += block.count;
    const std::uint32_t overlapping =
        ((1u << block.count) - 1) & overlap_block(frame.kernels, frame.policies.sat, block.boxes);
    for (std::uint32_t i = 0; i < block.count; ++i) {
      const std::uint32_t lane = (from_stack + i) % block.count;  // seeds first: their level is the lowest
      if (!(overlapping >> lane & 1)) continue;
      const NodePair& tested = block.pair[lane];
      if (!(block.boxes.leaves >> lane & 1)) {
        open<AosBox>(frame, scratch, tested);
        continue;
      }
      scratch.found.push({tested.candidate, tested.a, tested.b});
      if (first_only) set_in_contact(frame, scratch.candidates.data[tested.candidate]);
    }
  }
}

// ------------------------------------------------------------------------------------------------------- rows

// Tests the block and empties it. Writes the overlapping pairs to `found` from index `kept` on, and advances
// `kept`. untested: the bits of the lanes that overlap whatever the test says.
template <class AosBox>
void test_block(const FrameContext& frame, std::uint32_t untested, PairBlock<AosBox>& block, FixedList<LeafPair>& found,
                FrameStats& stats, std::uint32_t& kept) {
  pad(block);
  stats.box_tests += block.count - count_bits(untested);
  const std::uint32_t overlapping = overlap_block(frame.kernels, frame.policies.sat, block.boxes) | untested;
  for (std::uint32_t lane = 0; lane < block.count; ++lane) {
    found.data[kept] = {block.pair[lane].candidate, block.pair[lane].a, block.pair[lane].b};
    kept += overlapping >> lane & 1;
  }
  block.count = 0;
}

// The boxes of the two instances of a candidate, and the origin of b less the origin of a.
template <class AosBox>
struct CandidateBoxes {
  const AosBox* a;
  const AosBox* b;
  double shift[3];
  const Articulation* within;  // the active articulation of a candidate within one instance, else null
  bool untested;               // links_meet_leaves
};

// Appends to PairScratch::found the leaf pairs of one candidate whose bounds overlap. Returns what the test of their
// boxes needs.
template <class AosBox>
CandidateBoxes<AosBox> filter_candidate(const FrameContext& frame, std::uint32_t index, PairScratch& scratch) {
  const Candidate& candidate = scratch.candidates.data[index];
  const InstanceBatch& a = frame.batch(candidate.batch_a);
  const InstanceBatch& b = frame.batch(candidate.batch_b);
  const PosedSet& set = scratch.posed;
  const Placement &placement_a = set.placement(candidate.slot_a), &placement_b = set.placement(candidate.slot_b);
  CandidateBoxes<AosBox> sides = {boxes_at<AosBox>(scratch.posed, candidate.slot_a),
                                  boxes_at<AosBox>(scratch.posed, candidate.slot_b),
                                  {},
                                  nullptr,
                                  links_meet_leaves(frame, candidate)};
  if (is_within(candidate)) sides.within = a.active;
  kernel::RowFilter filter;
  filter.leaves_a = filter.end_a = a.active->leaf_count;
  filter.begin_a = 0;
  filter.leaves_b = b.active->leaf_count;
  filter.a =
      set.tile_of(candidate.slot_a).leaf_bounds + candidate.slot_a % kLanes * leaf_bounds_floats(filter.leaves_a);
  filter.b =
      set.tile_of(candidate.slot_b).leaf_bounds + candidate.slot_b % kLanes * leaf_bounds_floats(filter.leaves_b);
  const InstanceBounds &bounds_a = placement_a.bounds, &bounds_b = placement_b.bounds;
  origin_difference(set, candidate, sides.shift);
  set_shift(sides.shift, filter);
  const bool within_bounds = !a.active->lod.posed && !b.active->lod.posed;  // nodes extend beyond the leaves below them
  for (std::uint32_t c = 0; c < 3; ++c) {
    const double origin = placement_a.origin[c];
    filter.region_lo[c] = within_bounds ? float_below(std::max(bounds_a.lo[c], bounds_b.lo[c]) - origin) : -HUGE_VALF;
    filter.region_hi[c] = within_bounds ? float_above(std::min(bounds_a.hi[c], bounds_b.hi[c]) - origin) : HUGE_VALF;
  }
  filter.candidate = index;
  filter.self = sides.within;
  filter.found = &scratch.found;
  frame.kernels.filter_rows(filter);
  return sides;
}

// Tests the candidates that are not for trees by their leaf bounds: lists all leaf pairs whose bounds overlap, then
// tests the boxes of these pairs in blocks of sixteen. PairScratch::found must be empty.
template <class AosBox>
void test_rows(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, PairScratch& scratch,
               FrameStats& stats) {
  CandidateBoxes<AosBox> sides[kChunkCandidates];
  {
    const Timed timed(stats.seconds_filter);
    for (std::uint32_t at = begin; at < end; ++at) {
      if (descends_trees(frame, scratch.candidates.data[at])) continue;
      const std::uint32_t before = scratch.found.size;
      sides[at] = filter_candidate<AosBox>(frame, at, scratch);
      stats.candidates_apart += scratch.found.size == before;
    }
  }
  PairBlock<AosBox> block;
  block.boxes.shift = &block.shift;
  block.boxes.leaves = 0xffff;
  std::uint32_t kept = 0, untested = 0;
  const auto test = [&] {
    const std::uint32_t before = kept;
    test_block(frame, untested, block, scratch.found, stats, kept);
    untested = 0;
    if (!frame.first_only()) return;
    for (std::uint32_t i = before; i < kept; ++i)
      if (const Candidate& candidate = scratch.candidates.data[scratch.found.data[i].candidate];
          !opens_links(frame, candidate))
        set_in_contact(frame, candidate);
  };
  for (const LeafPair& pair : scratch.found) {
    if (frame.first_only() && is_already_reported(frame, scratch.candidates.data[pair.candidate])) continue;
    const CandidateBoxes<AosBox>& side = sides[pair.candidate];
    if (side.within && is_ignored(*side.within, side.within->leaf_link[pair.a], side.within->leaf_link[pair.b]))
      continue;
    const std::uint32_t lane = block.count++;
    untested |= std::uint32_t{side.untested} << lane;
    block.pair[lane] = {pair.candidate, pair.a, pair.b};
    block.boxes.a[lane] = side.a + pair.a;
    block.boxes.b[lane] = side.b + pair.b;
    for (std::uint32_t c = 0; c < 3; ++c) block.shift.by[c][lane] = side.shift[c];
    if (block.count == kLanes) test();
  }
  if (block.count) test();
  scratch.found.size = kept;
}

// Tests candidates by the frame's strategy. AosBox is AabbAos with an axis-aligned refit, else BoxAos.
template <class AosBox>
void find_by(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, PairScratch& scratch,
             FrameStats& stats) {
  const Strategy strategy = frame.policies.strategy;
  scratch.found.clear();
  if (compares_leaf_bounds(strategy)) test_rows<AosBox>(frame, begin, end, scratch, stats);
  if (strategy == Strategy::kRows || strategy == Strategy::kLinks) return;
  traverse<AosBox>(frame, begin, end, scratch, stats);
  std::sort(scratch.found.begin(), scratch.found.end(),
            [](const LeafPair& x, const LeafPair& y) { return x.candidate < y.candidate; });
}

}  // namespace

void find_leaf_pairs(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, PairScratch& scratch,
                     FrameStats& stats) {
  if (is_axis_aligned(frame.policies.refit))
    find_by<AabbAos>(frame, begin, end, scratch, stats);
  else
    find_by<BoxAos>(frame, begin, end, scratch, stats);
}

}  // namespace cab
