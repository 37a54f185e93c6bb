#include "engine/broad_phase/crowd_batch.h"

#include "engine/broad_phase/crowd_scratch.h"
#include "engine/step/live_instances.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cab {
namespace {

// Leaves, joints and margins up to this size leave room for their poses within kMaxCoordinate.
constexpr double kMostRigid = static_cast<double>(kernel::kRigidRange);

// Writes the unit quaternion of a box's axes, which are right-handed.
void quaternion_of(const Box& box, double (&q)[4]) {
  double m[3][3];  // column k is axis k
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) m[c][k] = static_cast<double>(box.axis[k][c]);
  // Four times the square of each component; the largest is far from zero.
  const double squares[4] = {1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2],
                             1 - m[0][0] - m[1][1] + m[2][2], 1 + m[0][0] + m[1][1] + m[2][2]};
  const auto i = static_cast<int>(std::max_element(squares, squares + 4) - squares);
  const double root = std::sqrt(squares[i]), part = 0.5 / root;
  q[i] = 0.5 * root;
  if (i == 3) {
    q[0] = (m[2][1] - m[1][2]) * part, q[1] = (m[0][2] - m[2][0]) * part, q[2] = (m[1][0] - m[0][1]) * part;
  } else {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    q[j] = (m[j][i] + m[i][j]) * part, q[k] = (m[k][i] + m[i][k]) * part, q[3] = (m[k][j] - m[j][k]) * part;
  }
}

bool has_axes_of_link(const Box& box) {
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c)
      if (box.axis[k][c] != (k == c ? 1.0f : 0.0f)) return false;
  return true;
}

double sum_of(const float (&v)[3]) {
  double out = 0;
  for (const float c : v) out += std::fabs(static_cast<double>(c));
  return out;
}

}  // namespace

void make_shape(StoredBatch& stored, float margin) {
  const Articulation& articulation = *stored.batch.articulation;
  const std::size_t stride = stored.batch.link_stride / sizeof(float);
  const bool placed = is_placed(stored.batch);
  CrowdBatch& crowd = stored.crowd;
  if (crowd.margin == margin && crowd.stride == stride && crowd.shape.placed == placed) return;
  crowd.margin = margin;
  crowd.stride = stride;
  crowd.shape.placed = placed;
  crowd.size = 0;
  const float half_margin = kMarginShare * margin, grown = placed ? 0.0f : half_margin;
  for (std::uint32_t n = 0; n < articulation.leaf_count; ++n) {
    const Box& box = articulation.leaf_box[n];
    RigidLeaf& leaf = crowd.leaf[n];
    BoxAos& exact = crowd.exact[n];
    RigidBlock& block = crowd.block[n / kLanes];
    const std::uint32_t at = n % kLanes;
    for (int c = 0; c < 3; ++c) exact.half[c] = box.half[c], leaf.half[c] = box.half[c] + grown;
    // As pose_box does, operation by operation.
    const float size = box.half[0] + box.half[1] + box.half[2];
    const float out = std::fabs(box.center[0]) + std::fabs(box.center[1]) + std::fabs(box.center[2]);
    exact.unused = (kPosePad.body * (size + out) + kMergePadTiny) + half_margin;
    const auto all = static_cast<float>(sum_of(leaf.half) + sum_of(box.center)) * (1 + kRigidSizeRounding);
    crowd.size = std::max(crowd.size, all);
    block.reach[at] = placed ? kPlacedBoundsSize * all : kRigidBoundsSize * all + kOverlapTiny;
    for (int c = 0; c < 3; ++c) block.half[c][at] = leaf.half[c];
    block.offset[at] = crowd.offset[n] = static_cast<std::uint32_t>(articulation.leaf_link[n] * stride);
  }
  for (std::uint32_t n = 0; n < crowd.bare.size; ++n)
    crowd.bare[n] = static_cast<std::uint32_t>(crowd.bare_link[n] * stride);
}

void make_crowd_batch(StoredBatch& stored) {
  const Articulation& articulation = *stored.batch.articulation;
  CrowdBatch& crowd = stored.crowd;
  crowd = {};
  crowd.order = stored.arena.allocate<std::uint32_t>(stored.batch.capacity);
  if (articulation.leaf_count > kCrowdLeaves || articulation.lod.posed || is_reach_lod(articulation) ||
      is_static(stored.batch) || !articulation.skin.empty())
    return;
  double extent = 0;
  for (std::uint32_t n = 0; n < articulation.leaf_count; ++n)
    extent = std::max(extent, sum_of(articulation.leaf_box[n].half) + sum_of(articulation.leaf_box[n].center));
  std::size_t bare = 0;
  for (const PosedLink& posed : articulation.posed_links) {
    bare += posed.leaf_begin == posed.leaf_end;
    const float* const joint = articulation.link_joint.data + 3 * posed.link;
    if (posed.needs_joint) extent = std::max(extent, sum_of({joint[0], joint[1], joint[2]}));
  }
  if (!(extent < kMostRigid)) return;
  Arena& arena = stored.arena;
  crowd.blocks = static_cast<std::uint32_t>(crowd_blocks(articulation));
  crowd.block = arena.allocate<RigidBlock>(crowd.blocks);
  crowd.leaf = arena.allocate<RigidLeaf>(articulation.leaf_count);
  crowd.exact = arena.allocate<BoxAos>(articulation.leaf_count);
  crowd.offset = arena.allocate<std::uint32_t>(articulation.leaf_count);
  crowd.bare = arena.allocate<std::uint32_t>(bare);
  crowd.bare_link = arena.allocate<std::uint16_t>(bare);
  crowd.leaf_name = arena.allocate<std::uint64_t>(articulation.leaf_count);
  for (const PosedLink& posed : articulation.posed_links)
    if (posed.leaf_begin == posed.leaf_end) crowd.bare_link[crowd.bare_link.size - bare--] = posed.link;
  crowd.shape.block = crowd.block.data;
  crowd.shape.leaf = crowd.leaf.data;
  crowd.shape.exact = crowd.exact.data;
  crowd.shape.offset = crowd.offset.data;
  crowd.shape.bare = crowd.bare.data;
  crowd.shape.bare_count = static_cast<std::uint32_t>(crowd.bare.size);
  for (std::uint32_t n = 0; n < articulation.leaf_count; ++n) {
    const Box& box = articulation.leaf_box[n];
    RigidBlock& block = crowd.block[n / kLanes];
    RigidLeaf& leaf = crowd.leaf[n];
    const std::uint32_t at = n % kLanes;
    block.leaves = at + 1;
    crowd.leaf_name[n] = leaf_name(articulation.leaf_link[n], n);
    double turn[4];
    quaternion_of(box, turn);
    crowd.shape.turned = crowd.shape.turned || !has_axes_of_link(box);
    for (int k = 0; k < 4; ++k) block.turn[k][at] = leaf.turn[k] = static_cast<float>(turn[k]);
    for (int k = 0; k < 3; ++k) {
      double along = 0;
      for (int c = 0; c < 3; ++c) along += static_cast<double>(box.axis[k][c]) * static_cast<double>(box.center[c]);
      block.middle[k][at] = leaf.middle[k] = static_cast<float>(along);
    }
    for (int c = 0; c < 3; ++c) {
      crowd.exact[n].center[c] = box.center[c];
      for (int k = 0; k < 3; ++k) crowd.exact[n].axis[3 * k + c] = box.axis[k][c];
    }
  }
  crowd.shape.extent = static_cast<float>(extent) * (1 + kRigidSizeRounding);
  crowd.is_rigid = true;
  crowd.is_direct = articulation.leaves_by_link;
}

void size_crowd(std::size_t tiles, std::size_t words, Arena& arena, Crowd& crowd) {
  crowd = {};
  if (tiles == 0) return;
  const std::size_t rows = tiles * kLanes;
  crowd.capacity = rows;
  crowd.sorted_capacity = sorted_capacity(rows);
  crowd.words = arena.allocate<LeafWords>(words);
  crowd.sides = arena.allocate<float>(6 * rows);
  crowd.rows = arena.allocate<CrowdRow>(rows);
  crowd.strip_of = arena.allocate<std::uint32_t>(rows);
  crowd.keys = arena.allocate<std::uint64_t>(crowd.sorted_capacity);
  crowd.sorted_sides = arena.allocate<float>(6 * (crowd.sorted_capacity + kLanes));
  // One per row and two per class at most. Strays are rows a second time, and so are rows that have left the kept ones.
  const std::size_t strips = rows + std::max(rows / kStraysShare, spare_rows(rows)) + 4 * kCrowdClasses;
  crowd.strip_begin = arena.allocate<std::uint32_t>(strips);
  crowd.strip_end = arena.allocate<std::uint32_t>(strips);
  crowd.strip_first = arena.allocate<std::uint32_t>(rows + 3);
  crowd.strays = arena.allocate<std::uint32_t>(rows / kStraysShare);
}

void size_crowd_scratch(std::size_t leaf_pairs, Arena& arena, CrowdScratch& scratch) {
  // Entries have the leaves of at most one block each.
  const std::size_t pairs = std::min<std::size_t>(leaf_pairs, kLanes * kLanes) * kernel::kMostPairEntries + 2 * kLanes;
  scratch.pairs = arena.allocate<std::uint32_t>(2 * pairs);
}

std::size_t bytes_of(const Crowd& crowd) {
  return crowd.words.size * sizeof(LeafWords) + (crowd.sides.size + crowd.sorted_sides.size) * sizeof(float) +
         crowd.rows.size * sizeof(CrowdRow) + crowd.keys.size * sizeof(std::uint64_t) +
         (crowd.strip_of.size + 2 * crowd.strip_begin.size + crowd.strip_first.size + crowd.strays.size) *
             sizeof(std::uint32_t);
}

void lay_out_rows(StoredBatches stored_batches, Crowd& crowd) {
  for (const auto& stored : stored_batches) {
    if (!stored->batch.input)
      store_crowd_bounds(crowd, *stored);  // before the rows are others
    else
      stored->crowd.has_sides = false;
  }
  std::uint32_t row = 0, words = 0, batches = 0;
  ++crowd.frames;
  bool layers = false, only_words = crowd.kept.count == 0;
  for (std::size_t i = 0; i < stored_batches.size; ++i) stored_batches[i]->crowd.index = static_cast<std::uint32_t>(i);
  for_each_crowd_batch(stored_batches, [&](StoredBatch& stored) {
    const InstanceBatch& batch = stored.batch;
    CrowdBatch& own = stored.crowd;
    const std::uint32_t row_before = own.first_row, words_before = own.first_words, count_before = own.row_count;
    own.row_count = own.is_by_place ? active_count(batch) : batch.pairs_between ? batch.instance_count : 0;
    own.first_row = row;
    own.first_words = words;
    row += tile_count(own.row_count) * kLanes;
    words += batch.by_words ? own.row_count * own.blocks : 0;
    ++batches;
    crowd.last_batch = own.index;
    layers = layers || !batch.input->layers.empty() || !batch.input->layer_masks.empty();
    if (!batch.input->instances.empty() || own.order.size != own.row_count) own.ordered = false;
    own.visits_by_order = !own.is_by_place && own.ordered && !batch.may_rest;
    only_words = only_words && batch.by_words && !batch.pairs_within && !batch.may_rest;
    if (own.is_by_place) return;
    std::fill_n(crowd.side(0) + own.first_row, own.row_count, kernel::kNowhere);
    const bool are_laid_out = own.laid_out_in + 1 == crowd.frames && row_before == own.first_row &&
                              words_before == own.first_words && count_before == own.row_count;
    own.laid_out_in = crowd.frames;
    own.has_words = own.has_words && batch.by_words && are_laid_out;
    if (!are_laid_out && crowd.kept.count > 0) crowd.kept_is_stale = true;
    for (std::uint32_t i = 0; !are_laid_out && i < own.row_count; ++i)
      crowd.rows[own.first_row + i] = {own.index, i, own.first_words + i * own.blocks};
  });
  crowd.row_count = row;
  crowd.one_batch = batches == 1;
  crowd.takes_all = batches == 1 && !layers && crowd.kept.count == 0;
  crowd.only_words = only_words;
}

InstanceBounds bounds_of_sides(const float (&sides)[6], const LeafWords* words, std::uint32_t blocks) {
  InstanceBounds out;
  bool is_far = false;
  for (std::uint32_t c = 0; c < 3; ++c) {
    is_far = is_far || sides[c] <= -kernel::kMostSide || sides[3 + c] >= kernel::kMostSide;
    out.lo[c] = static_cast<double>(sides[c]);
    out.hi[c] = static_cast<double>(sides[3 + c]);
  }
  for (std::uint32_t c = 0; c < 3 && is_far; ++c) {
    out.lo[c] = HUGE_VAL;
    out.hi[c] = -HUGE_VAL;
    for (std::uint32_t b = 0; b < blocks; ++b) {
      const double unit = kernel::double_power_of_two(words[b].exponent), origin = words[b].origin[c];
      const double lo = unit * static_cast<std::int16_t>(words[b].all[c] & 0xffff),
                   hi = -unit * static_cast<std::int16_t>(words[b].all[c] >> 16);
      const double pad = kWorldPad * (std::fabs(origin) + std::max(std::fabs(lo), std::fabs(hi)));
      out.lo[c] = std::min(out.lo[c], origin + lo - pad);
      out.hi[c] = std::max(out.hi[c], origin + hi + pad);
    }
  }
  return out;
}

void store_bounds(const Crowd& crowd, StoredBatch& stored, std::uint32_t first, std::uint32_t end) {
  for (std::uint32_t row = stored.crowd.first_row + first; row < stored.crowd.first_row + end; ++row) {
    const CrowdRow& of = crowd.rows[row];
    float sides[6];
    for (std::uint32_t s = 0; s < 6; ++s) sides[s] = crowd.side(s)[row];
    stored.batch.bounds[of.instance] = bounds_of_sides(sides, &crowd.words[of.words], stored.crowd.blocks);
  }
}

void store_crowd_bounds(const Crowd& crowd, StoredBatch& stored) {
  if (std::exchange(stored.crowd.has_sides, false)) store_bounds(crowd, stored, 0, stored.crowd.row_count);
}

}  // namespace cab
