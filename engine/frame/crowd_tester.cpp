#include "engine/frame/crowd_tester.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/broad_phase/crowd_scratch.h"
#include "engine/frame/posed_tester.h"
#include "engine/hits/hit_store.h"
#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/timed.h"
#include "engine/step/update.h"
#include "layout/compiler.h"

#include <algorithm>
#include <utility>

namespace cab {
namespace {

// Whether the place of every pose, in floats from the first, has 32 bits.
bool has_short_pose_offsets(const InstanceBatch& batch) {
  return std::uint64_t{batch.instance_count} * batch.instance_stride / sizeof(float) <= 0xffffffffu;
}

// Writes where the slots in use find their leaves and poses, and asks for the poses. candidate_of_entry: the number of
// the candidate of each entry, which becomes that of its slot. Returns how many candidates they are of.
std::uint32_t point_slots(const FrameContext& frame, const Candidate* candidates,
                          const std::uint32_t* candidate_of_entry, std::uint32_t used, kernel::PairSlots& slots) {
  // What the slots of one batch have in common.
  struct Side {
    std::uint32_t batch = 0xffffffff;
    const RigidShape* shape = nullptr;
    const float* poses = nullptr;
    std::size_t stride = 0, bytes = 0;

    void turn_to(const FrameContext& frame, std::uint32_t index) {
      if (index == batch) return;
      const StoredBatch& stored = *frame.batches[index];
      batch = index;
      shape = &stored.crowd.shape;
      poses = stored.batch.input->poses.data;
      stride = stored.batch.instance_stride / sizeof(float);
      bytes = prefetched_bytes(stored.batch);
    }
  };
  Side a, b;
  std::uint32_t out = 0;
  for (std::uint32_t k = 0; k < used; ++k) {
    const std::uint32_t number = candidate_of_entry[slots.entry[k]];
    const Candidate& candidate = candidates[number];
    a.turn_to(frame, candidate.batch_a);
    b.turn_to(frame, candidate.batch_b);
    const bool is_new = k == 0 || slots.entry[k - 1] != number;
    const std::size_t at_a = a.stride * candidate.instance_a, at_b = b.stride * candidate.instance_b;
    slots.entry[k] = number;
    slots.shape_a[k] = a.shape;
    slots.shape_b[k] = b.shape;
    slots.pose_a[k] = a.poses + at_a;
    slots.pose_b[k] = b.poses + at_b;
    slots.at_a[k] = static_cast<std::uint32_t>(at_a);
    slots.at_b[k] = static_cast<std::uint32_t>(at_b);
    if (!is_new) continue;
    prefetch_line(&frame.batch(candidate.batch_a).hit_chains.data[candidate.instance_a]);
    prefetch_bytes(a.poses + at_a, a.bytes);
    prefetch_bytes(b.poses + at_b, b.bytes);
    ++out;
  }
  return out;
}

}  // namespace

CrowdTester::CrowdTester(const FrameContext& frame, const Crowd& crowd, Worker& worker, HitSink& sink)
    : StripSearcher(frame, crowd, worker.crowd[0]), worker_(worker), sink_(sink) {}

void CrowdTester::test() {
  if (frame_.report == Report::kInContact) drop_reported();
  if (scratch_.count == 0) return;
  worker_.stats.candidates += scratch_.count;
  for (std::uint32_t begin = 0; begin < scratch_.count;) begin = test_from(begin);
  scratch_.count = 0;
}

// Drops the candidates that can change nothing.
void CrowdTester::drop_reported() {
  std::uint32_t kept = 0;
  for (std::uint32_t n = 0; n < scratch_.count; ++n) {
    CrowdRow a, b;
    if (is_already_reported(frame_, candidate_of(n, a, b))) continue;
    scratch_.a[kept] = scratch_.a[n];
    scratch_.b[kept++] = scratch_.b[n];
  }
  scratch_.count = kept;
}

// The candidate of two sorted rows.
Candidate CrowdTester::candidate_of(std::uint32_t n, CrowdRow& a, CrowdRow& b) const {
  a = crowd_.sorted_row(scratch_.a[n]);
  b = crowd_.sorted_row(scratch_.b[n]);
  if (instance_key(b.batch, b.instance) < instance_key(a.batch, a.instance)) std::swap(a, b);
  return {a.batch, a.instance, b.batch, b.instance};
}

// Entries of the candidates that are tested together, and what they have in common.
struct CrowdTester::Entries {
  const LeafWords *a[kernel::kMostPairEntries], *b[kernel::kMostPairEntries];
  std::uint32_t head[kernel::kMostPairEntries], candidate[kernel::kMostPairEntries];
  std::uint32_t count = 0;
  float size = 0;
  bool one_block = true;                         // every candidate has one entry
  bool one_pair = true;                          // all are of the same two batches
  kernel::RigidAs as = kernel::RigidAs::kPlain;  // the most that an instance's shape needs
  bool is_direct = true;                         // leaf pairs are link pairs
};

// Makes the entries of all candidates of a crowd whose instances are of one batch and have one block each.
void CrowdTester::make_plain_entries(Entries& entries) {
  Candidate* const candidates = scratch_.candidates;
  const LeafWords* const words = crowd_.words.data;
  for (std::uint32_t n = 0; n < scratch_.count; ++n) {
    const CrowdRow &x = crowd_.sorted_row(scratch_.a[n]), &y = crowd_.sorted_row(scratch_.b[n]);
    const bool in_order = x.instance < y.instance;
    const CrowdRow &a = in_order ? x : y, &b = in_order ? y : x;
    candidates[n] = {a.batch, a.instance, b.batch, b.instance};
    entries.a[n] = words + a.words;
    entries.b[n] = words + b.words;
    entries.head[n] = 0;
    entries.candidate[n] = n;
  }
  entries.count = scratch_.count;
  const CrowdBatch& own = batch_of(candidates[0].batch_a);
  entries.as = kernel::rigid_as(own.shape);
  entries.is_direct = own.is_direct;
  entries.size = 2 * own.size;
}

namespace {

// The bounds of all leaves of a block about the origin of `from`, and the unit of its words.
struct BlockBounds {
  double lo[3], hi[3], unit;
};
BlockBounds bounds_of(const LeafWords& words, const LeafWords& from) {
  BlockBounds out;
  out.unit = kernel::double_power_of_two(words.exponent);
  for (int c = 0; c < 3; ++c) {
    const double by = words.origin[c] - from.origin[c];
    out.lo[c] = by + out.unit * static_cast<std::int16_t>(words.all[c] & 0xffff);
    out.hi[c] = by - out.unit * static_cast<std::int16_t>(words.all[c] >> 16);
  }
  return out;
}

// Whether the words of no two leaves of two blocks can meet. One unit stands for the rounding above (docs/proof.md,
// step 14.3).
bool are_apart(const BlockBounds& a, const BlockBounds& b) {
  const double unit = std::max(a.unit, b.unit);
  bool out = false;
  for (int c = 0; c < 3; ++c) out = out || a.lo[c] - b.hi[c] > unit || b.lo[c] - a.hi[c] > unit;
  return out;
}

// Calls take(i, j) for the blocks i of a and j of b that may meet, in ascending order.
template <class Take>
void for_each_near_block(const LeafWords* a, std::uint32_t count_a, const LeafWords* b, std::uint32_t count_b,
                         Take&& take) {
  BlockBounds of_b[kCrowdLeaves / kLanes];
  for (std::uint32_t j = 0; j < count_b; ++j) of_b[j] = bounds_of(b[j], *a);
  for (std::uint32_t i = 0; i < count_a; ++i) {
    const BlockBounds of_a = bounds_of(a[i], *a);
    for (std::uint32_t j = 0; j < count_b; ++j)
      if (!are_apart(of_a, of_b[j])) take(i, j);
  }
}

}  // namespace

// Makes the entries of candidates from `begin` on, as many as there is room for. Returns the end of these candidates.
std::uint32_t CrowdTester::make_entries(std::uint32_t begin, Entries& entries) {
  Candidate* const candidates = scratch_.candidates;
  if (crowd_.one_batch && batch_of(crowd_.sorted_row(scratch_.a[0]).batch).blocks == 1) {
    make_plain_entries(entries);
    return scratch_.count;
  }
  const CrowdBatch *own_a = nullptr, *own_b = nullptr;
  std::uint32_t batch_a = 0, batch_b = 0, end = begin;
  for (CrowdRow a, b; end < scratch_.count; ++end) {
    candidates[end] = candidate_of(end, a, b);
    if (!own_a || a.batch != batch_a || b.batch != batch_b) {
      entries.one_pair = entries.one_pair && !own_a;
      own_a = &batch_of(a.batch);
      own_b = &batch_of(b.batch);
      batch_a = a.batch;
      batch_b = b.batch;
      entries.one_block = entries.one_block && own_a->blocks * own_b->blocks == 1;
      entries.as = std::max({entries.as, kernel::rigid_as(own_a->shape), kernel::rigid_as(own_b->shape)});
      entries.is_direct = entries.is_direct && own_a->is_direct && own_b->is_direct;
      entries.size = std::max(entries.size, own_a->size + own_b->size);
    }
    if (entries.count + own_a->blocks * own_b->blocks > kernel::kMostPairEntries) break;
    const auto add = [&](std::uint32_t i, std::uint32_t j) {
      entries.a[entries.count] = &crowd_.words[a.words + i];
      entries.b[entries.count] = &crowd_.words[b.words + j];
      entries.head[entries.count] = i * kLanes << 8 | j * kLanes;
      entries.candidate[entries.count++] = end;
    };
    if (own_a->blocks * own_b->blocks == 1)
      add(0, 0);
    else
      for_each_near_block(&crowd_.words[a.words], own_a->blocks, &crowd_.words[b.words], own_b->blocks, add);
  }
  return end;
}

// Writes how the instances of the slots in use are placed besides their origins, and what is unsure then
// (docs/proof.md, step 14.11).
void CrowdTester::place_slots(const Entries& entries, std::uint32_t used) {
  kernel::PairSlots& slots = scratch_.slots;
  // Returns the largest S + |c|_1 of the instance's leaves, with its margin.
  const auto place = [&](int side, std::uint32_t k, std::uint32_t batch, std::uint32_t instance) {
    const InstanceBatch& of = frame_.batch(batch);
    const CrowdBatch& own = batch_of(batch);
    const float* const turn = turn_of(of, instance);
    const float margin = grown_by(of, instance, frame_.margin), grown = own.shape.placed ? margin : 0;
    for (int i = 0; i < 4; ++i) slots.turn[side][i][k] = turn[i];
    slots.scale[side][k] = scale_of(of, instance);
    slots.grown[side][k] = grown;
    slots.margin[side][k] = margin;
    slots.rotated[side][k] = !of.input->orientations.empty();
    return own.size * slots.scale[side][k] + 3 * grown;
  };
  for (std::uint32_t k = 0; k < used; ++k) {
    const std::uint32_t entry = slots.entry[k];
    const Candidate& candidate = scratch_.candidates[entries.candidate[entry]];
    const float size =
        place(0, k, candidate.batch_a, candidate.instance_a) + place(1, k, candidate.batch_b, candidate.instance_b);
    const auto reach = [](const LeafWords& words) { return kernel::power_of_two(words.exponent + kWordBits); };
    const float unsure = (kPlacedUnsureSize * (1 + kRigidSizeRounding)) * size +
                         kPlacedUnsureCenter * (reach(*entries.a[entry]) + reach(*entries.b[entry]));
    slots.unsure[k] = unsure + kOverlapTiny;
  }
}

// Tests candidates from `begin` on. Returns the end of those that were tested.
std::uint32_t CrowdTester::test_from(std::uint32_t begin) {
  Entries entries;
  std::uint32_t end = begin;
  const Candidate* const candidates = scratch_.candidates;
  kernel::PairSlots& slots = scratch_.slots;
  std::uint32_t* const pairs = scratch_.pairs.data;
  std::uint32_t* const out = pairs + scratch_.pairs.size / 2;
  std::uint32_t used = 0, count = 0;
  {
    const Timed timed(worker_.stats.seconds_test);
    {
      const Timed filtered(worker_.stats.seconds_filter);
      end = make_entries(begin, entries);
      count = frame_.kernels.overlapping_words({entries.a, entries.b, entries.head, entries.count, entries.size}, slots,
                                               pairs, &used);
    }
    const Candidate& first = candidates[begin];
    kernel::RigidPairs job = {&slots,  pairs,   count,   out,        nullptr,
                              nullptr, nullptr, nullptr, entries.as, frame_.policies.sat};
    const InstanceBatch &batch_a = frame_.batch(first.batch_a), &batch_b = frame_.batch(first.batch_b);
    if (entries.one_pair && entries.one_block && has_short_pose_offsets(batch_a) && has_short_pose_offsets(batch_b)) {
      job.block_a = batch_of(first.batch_a).block.data;
      job.block_b = batch_of(first.batch_b).block.data;
      job.base_a = batch_a.input->poses.data;
      job.base_b = batch_b.input->poses.data;
    }
    if (entries.as == kernel::RigidAs::kPlaced) place_slots(entries, used);
    worker_.stats.candidates_apart += (end - begin) - point_slots(frame_, candidates, entries.candidate, used, slots);
    worker_.stats.box_tests += count;
    count = frame_.kernels.overlap_rigid_leaves(job);
  }
  if (entries.is_direct && frame_.policies.exact == Exact::kNone && frame_.report != Report::kInContact)
    report_direct(out, count, entries.one_block);
  else
    report(out, count, begin, end);
  return end;
}

// Runs the exact test on the leaf pairs that overlap, of the candidates `begin` to `end` - 1, and stores hits. They may
// have triangles, and so an inside: of leaves that their own links alone move.
void CrowdTester::report(const std::uint32_t* pairs, std::uint32_t count, std::uint32_t begin, std::uint32_t end) {
  const std::uint32_t* const entry = scratch_.slots.entry;
  const Timed timed(worker_.stats.seconds_query);
  LeafPair* const found = worker_.pairs.found.data;
  for (std::uint32_t i = 0; i < count; ++i)
    found[i] = {entry[kernel::slot_of(pairs[i])], static_cast<std::uint16_t>(kernel::leaf_a_of(pairs[i])),
                static_cast<std::uint16_t>(kernel::leaf_b_of(pairs[i]))};
  worker_.pairs.found.size = count;
  report_leaves(frame_, scratch_.candidates, begin, end, worker_, sink_);
}

namespace {

// Sorts the pairs of one candidate by leaves. They come by blocks of a, within these by blocks of b, and for two blocks
// by leaves.
void sort_by_leaves(std::uint32_t* begin, const std::uint32_t* end) {
  std::uint32_t sorted[kLanes * kCrowdLeaves];
  while (begin != end) {
    const std::uint32_t block = kernel::leaf_a_of(*begin) / kLanes;
    std::uint32_t place[kLanes + 1] = {}, *last = begin;
    for (; last != end && kernel::leaf_a_of(*last) / kLanes == block; ++last)
      ++place[kernel::leaf_a_of(*last) % kLanes + 1];
    for (std::uint32_t leaf = 0; leaf < kLanes; ++leaf) place[leaf + 1] += place[leaf];
    for (const std::uint32_t* at = begin; at != last; ++at) sorted[place[kernel::leaf_a_of(*at) % kLanes]++] = *at;
    begin = std::copy(sorted, sorted + (last - begin), begin);
  }
}

}  // namespace

// The same where leaf pairs are link pairs, and no exact test follows. in_order: each candidate has one slot.
void CrowdTester::report_direct(std::uint32_t* pairs, std::uint32_t count, bool in_order) {
  const std::uint32_t* const entry = scratch_.slots.entry;
  const Timed timed(worker_.stats.seconds_query);
  for (std::uint32_t i = 0; !in_order && i < count;) {
    const std::uint32_t first = i, slot = kernel::slot_of(pairs[i]);
    while (i < count && entry[kernel::slot_of(pairs[i])] == entry[slot]) ++i;
    if (kernel::slot_of(pairs[i - 1]) == slot) continue;
    for (std::uint32_t k = first; k < i; ++k) pairs[k] = slot << 16 | (pairs[k] & 0xffff);
    sort_by_leaves(pairs + first, pairs + i);
  }
  add_groups_of_leaves(frame_, scratch_.candidates, entry, {pairs, count}, worker_.hits.block, worker_.stats, sink_);
}

}  // namespace cab
