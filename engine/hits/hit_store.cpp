// The layout of the hit store, and the merge sort of its chains.
#include "engine/hits/hit_store.h"

#include "engine/exact/touching_links.h"
#include "engine/hits/report.h"
#include "engine/step/batch_tasks.h"
#include "engine/step/in_contact.h"
#include "engine/step/timed.h"
#include "kernels/rigid_leaves.h"
#include "layout/atomic_words.h"
#include "layout/compiler.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <utility>

namespace cab {
namespace {

// The words of a group, which holds hits of one candidate. kNext is where the next group of the chain begins, and kHits
// is the number of hits. A candidate with more hits than fit into a block has several groups, numbered by the upper
// bits of kHits. The words from kGroupHead on are the hits: leaf a in the upper half, leaf b in the lower; or, where
// kHits has the bit kAsPairs, as kernel::RigidPairs has them.
enum GroupWord : std::uint32_t { kNext, kBatchA, kInstanceA, kBatchB, kInstanceB, kHits, kGroupHead };
constexpr std::uint32_t kMostHits = kBlockWords - kGroupHead - 1, kPart = 1u << kBlockBits, kAsPairs = 1u << 31;

std::uint32_t hits_of(const std::uint32_t* group) { return group[kHits] % kPart; }
std::uint32_t size_of(const std::uint32_t* group) { return kGroupHead + hits_of(group); }

// Adds blocks to the store until it has `number`. Returns false if there is no memory for them.
bool grow(HitStore& store, std::uint32_t number) {
  const std::lock_guard<std::mutex> lock(store.growing);
  for (std::uint32_t blocks; (blocks = store.blocks.load(std::memory_order_relaxed)) <= number;) {
    const std::uint32_t more = std::min(blocks, HitStore::kMostBlocks - blocks);
    if (more == 0 || store.segment_count == HitStore::kMostSegments) return false;
    try {
      store.segments[store.segment_count] = {blocks, more,
                                             store.grown->allocate<std::uint32_t>(kBlockWords, more).data};
    } catch (const std::bad_alloc&) { return false; }
    ++store.segment_count;
    store.blocks.store(blocks + more, std::memory_order_release);
  }
  return true;
}

// Gives a worker the next block. If the caller's buffer has no room for the hits that are stored already, or if there
// is no memory, the worker writes over the block that it has: then hits are counted alone.
void claim_block(HitBlock& own, HitSink& sink) {
  HitStore& store = *sink.store;
  const std::uint64_t stored = sink.stored_hits.fetch_add(own.hits, std::memory_order_relaxed) + own.hits;
  own.used = 1;
  own.hits = 0;
  if (sink.out_of_memory || (own.words && stored > sink.job->hits.size)) return;
  const std::uint32_t number = store.claimed.fetch_add(1, std::memory_order_relaxed);
  if (number < store.blocks.load(std::memory_order_acquire) || grow(store, number)) {
    own.number = number;
    own.words = store.block(number);
  } else {
    sink.out_of_memory = true;
  }
}

// Room for a group of so many hits, at most kMostHits. Null if there is no memory.
std::uint32_t* room_for(std::uint32_t hits, HitBlock& own, HitSink& sink) {
  if (!own.words || own.used + kGroupHead + hits > kBlockWords) claim_block(own, sink);
  return own.words ? own.words + own.used : nullptr;
}

// Makes the group at the end of a worker's block the first of its chain. Its words are there, but for kNext.
void end_group(const FrameContext& frame, std::uint32_t* group, HitBlock& own, const HitSink& sink) {
  const std::uint32_t at = (own.number << kBlockBits) + own.used, hits = hits_of(group);
  HitChain& chain = frame.batch(group[kBatchA]).hit_chains[group[kInstanceA]];
  own.words[0] = own.used += kGroupHead + hits;
  own.hits += hits;
  if (sink.alone) {
    group[kNext] = std::exchange(chain.head, at);
    chain.count += hits;
  } else {
    group[kNext] = relaxed_exchange(chain.head, at);
    relaxed_add(chain.count, hits);
  }
}

// Writes all of a group but its hits and kNext.
void set_head(const Candidate& candidate, std::uint32_t hits, std::uint32_t part, std::uint32_t* group) {
  group[kBatchA] = candidate.batch_a;
  group[kInstanceA] = candidate.instance_a;
  group[kBatchB] = candidate.batch_b;
  group[kInstanceB] = candidate.instance_b;
  group[kHits] = part * kPart + hits;
}

// Whether group x comes before group y of the same chain.
bool is_before(const std::uint32_t* x, const std::uint32_t* y) {
  const std::uint64_t key_x = instance_key(x[kBatchB], x[kInstanceB]), key_y = instance_key(y[kBatchB], y[kInstanceB]);
  return key_x < key_y || (key_x == key_y && x[kHits] < y[kHits]);
}

// Merges two sorted chains. Returns where the merged chain begins.
std::uint32_t merge_chains(const HitStore& store, std::uint32_t x, std::uint32_t y) {
  std::uint32_t first, *link = &first;
  while (x != HitChain::kEnd && y != HitChain::kEnd) {
    std::uint32_t& lower = is_before(store.word(x), store.word(y)) ? x : y;
    *link = lower;
    link = &store.word(lower)[kNext];
    lower = *link;
  }
  *link = x != HitChain::kEnd ? x : y;
  return first;
}

// Sorts a chain of groups by the key of instance b, bottom up: chain[k] is empty or a sorted chain of 2^k groups.
// Returns where the sorted chain begins.
std::uint32_t sort_chain(const HitStore& store, std::uint32_t head) {
  if (head == HitChain::kEnd || store.word(head)[kNext] == HitChain::kEnd) return head;
  constexpr std::uint32_t kChains = 32;
  std::uint32_t chain[kChains], chains = 0;
  while (head != HitChain::kEnd) {
    std::uint32_t carried = head;
    head = std::exchange(store.word(carried)[kNext], HitChain::kEnd);
    std::uint32_t k = 0;
    for (; k < chains && chain[k] != HitChain::kEnd; ++k) {
      carried = merge_chains(store, chain[k], carried);
      chain[k] = HitChain::kEnd;
    }
    if (k == chains) ++chains;
    chain[k] = carried;
  }
  std::uint32_t sorted = HitChain::kEnd;
  for (std::uint32_t k = 0; k < chains; ++k) sorted = merge_chains(store, chain[k], sorted);
  return sorted;
}

// Writes a hit. a, b: an instance's batch, and its index in the upper half. names: of both leaves. In three words, each
// out of a register: a wider load would wait for narrow stores.
void write_hit(std::uint64_t a, std::uint64_t b, std::uint64_t names, Hit* out) {
  static_assert(sizeof(Hit) == 24 && offsetof(Hit, batch_b) == 8 && offsetof(Hit, link_a) == 16 &&
                offsetof(Hit, link_b) == 18 && offsetof(Hit, leaf_a) == 20 && offsetof(Hit, leaf_b) == 22);
  if constexpr (kLittleEndian) {
    std::memcpy(static_cast<void*>(out), &a, sizeof a);
    std::memcpy(static_cast<void*>(&out->batch_b), &b, sizeof b);
    std::memcpy(&out->link_a, &names, sizeof names);
  } else {
    *out = {{static_cast<std::uint32_t>(a)},         static_cast<std::uint32_t>(a >> 32),
            {static_cast<std::uint32_t>(b)},         static_cast<std::uint32_t>(b >> 32),
            static_cast<std::uint16_t>(names),       static_cast<std::uint16_t>(names >> 16),
            static_cast<std::uint16_t>(names >> 32), static_cast<std::uint16_t>(names >> 48)};
  }
}

// Writes the hits whose instance a is the given one, sorted by instance b.
void write_chain(const FrameContext& frame, std::uint32_t index, std::uint32_t instance, const HitStore& store,
                 Hit* out) {
  const StoredBatch& stored_a = *frame.batches[index];
  const Span<const std::uint16_t> link_a = stored_a.batch.articulation->leaf_link;
  const std::uint64_t of_a = (index + 1) | std::uint64_t{instance} << 32;
  for (std::uint32_t at = sort_chain(store, stored_a.batch.hit_chains[instance].head); at != HitChain::kEnd;) {
    const std::uint32_t* from = store.word(at);
    const std::uint32_t hits = hits_of(from);
    const bool as_pairs = from[kHits] & kAsPairs;
    const StoredBatch& stored_b = *frame.batches[from[kBatchB]];
    const std::uint64_t of_b = (from[kBatchB] + 1) | std::uint64_t{from[kInstanceB]} << 32;
    at = from[kNext];
    from += kGroupHead;
    if (as_pairs) {
      const std::uint64_t *const names_a = stored_a.crowd.leaf_name.data, *const names_b =
                                                                              stored_b.crowd.leaf_name.data;
      for (std::uint32_t i = 0; i < hits; ++i)
        write_hit(of_a, of_b, names_a[kernel::leaf_a_of(from[i])] | names_b[kernel::leaf_b_of(from[i])] << 16, out++);
    } else {
      const Span<const std::uint16_t> link_b = stored_b.batch.articulation->leaf_link;
      for (std::uint32_t i = 0; i < hits; ++i) {
        const std::uint32_t a = from[i] >> 16, b = from[i] & 0xffff;
        write_hit(of_a, of_b, leaf_name(link_a.data[a], a) | leaf_name(link_b.data[b], b) << 16, out++);
      }
    }
  }
}

// Whether the hits of two instances, or of one within itself, are those of the last frame, and are reported again.
bool goes_on(const FrameContext& frame, const Candidate& candidate) {
  const InstanceBatch &a = frame.batch(candidate.batch_a), &b = frame.batch(candidate.batch_b);
  if (!rests(a, candidate.instance_a) || !rests(b, candidate.instance_b)) return false;
  return is_within(candidate) ? !a.skips_within : !frame.paired.skips_resting(candidate.batch_a, candidate.batch_b);
}

// Lays out the tasks that count or write hits.
std::uint32_t lay_out_writing(StoredBatches batches) {
  return lay_out_tasks(batches, [](const InstanceBatch& batch) {
    const bool has_hits = batch.pairs_between || batch.pairs_within;
    return has_hits ? (batch.instance_count + kWrittenPerTask - 1) / kWrittenPerTask : 0;
  });
}

// The instances whose hits one task counts or writes.
struct InstanceRun {
  InstanceBatch& batch;
  std::uint32_t index, run;  // of the batch; of the task among those of the batch
  std::uint32_t begin, end;
};

InstanceRun instance_run(StoredBatches batches, std::uint32_t task) {
  const BatchTask of = batch_task(batches, task);
  InstanceBatch& batch = batches[of.batch]->batch;
  return {batch, of.batch, of.run, of.run * kWrittenPerTask,
          std::min(batch.instance_count, (of.run + 1) * kWrittenPerTask)};
}

}  // namespace

void HitStore::reset(Span<std::uint32_t> words, std::unique_ptr<Arena> for_more) noexcept {
  const auto count = static_cast<std::uint32_t>(words.size / kBlockWords);
  grown = std::move(for_more);
  segments[0] = {0, count, words.data};
  segment_count = 1;
  blocks = count;
  claimed = 0;
  holds_last = false;
}

void add_group(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, HitBlock& block,
               FrameStats& stats, HitSink& sink) {
  std::uint32_t part = 0, hits = 0, most = 0, *group = nullptr;
  const auto end = [&] {
    if (hits == 0) return;
    set_head(candidate, hits, part++, group);
    end_group(frame, group, block, sink);
  };
  for_each_touching(frame, candidate, pairs, stats, [&](const LinkedPair& pair) {
    if (hits == most) {
      end();
      hits = 0;
      most = static_cast<std::uint32_t>(std::min<std::size_t>(pairs.size - part * std::size_t{kMostHits}, kMostHits));
      group = room_for(most, block, sink);
    }
    if (group) group[kGroupHead + hits] = std::uint32_t{pair.leaf_a} << 16 | pair.leaf_b;
    hits += group != nullptr;
  });
  end();
}

void add_groups_of_leaves(const FrameContext& frame, const Candidate* candidates, const std::uint32_t* candidate_of,
                          Span<const std::uint32_t> pairs, HitBlock& block, FrameStats& stats, HitSink& sink) {
  stats.leaf_pairs += pairs.size;
  for (std::size_t i = 0, begin = 0, end; i < pairs.size; i = end) {
    const std::uint32_t number = candidate_of[kernel::slot_of(pairs[i])];
    for (end = i + 1; end < pairs.size && end - i < kMostHits; ++end)
      if (candidate_of[kernel::slot_of(pairs[end])] != number) break;
    if (i > 0 && candidate_of[kernel::slot_of(pairs[i - 1])] != number) begin = i;
    const auto hits = static_cast<std::uint32_t>(end - i);
    std::uint32_t* const group = room_for(hits, block, sink);
    if (!group) return;
    set_head(candidates[number], hits, static_cast<std::uint32_t>((i - begin) / kMostHits), group);
    group[kHits] |= kAsPairs;
    std::memcpy(group + kGroupHead, pairs.data + i, hits * sizeof *group);
    end_group(frame, group, block, sink);
    set_in_contact(frame, candidates[number]);
  }
}

std::uint32_t begin_storing(HitSink& sink) {
  sink.stored_hits = 0;
  sink.out_of_memory = false;
  return sink.store->claimed.exchange(0, std::memory_order_relaxed);
}

namespace {

// Walks through the groups of the last frame. A block is read only as far as its first word said when the walk came to
// it: the word is written over then.
struct GroupCursor {
  const HitStore& store;
  std::uint32_t blocks, number = 0, at = 0, end = 0;
  std::uint32_t* words = nullptr;

  // Goes on to the next block until there is a group. Returns null after the last one.
  std::uint32_t* group() {
    while (at >= end) {
      if (number == blocks) return nullptr;
      words = store.block(number++);
      at = 1;
      end = words[0];
    }
    return words + at;
  }
};

}  // namespace

// Groups only move down: with gaps closed, groups never begin in a later block, nor later in the same one. So blocks
// are read and written from the first to the last. What groups say of instances is all over memory, and is prefetched.
void keep_hits(const FrameContext& frame, std::uint32_t last_blocks, HitBlock& block, FrameStats& stats,
               HitSink& sink) {
  const Timed timed(stats.seconds_query);
  GroupCursor ahead = {*sink.store, last_blocks}, from = ahead;
  const auto prefetch_next = [&] {
    const std::uint32_t* const group = ahead.group();
    if (!group) return;
    const InstanceBatch& a = frame.batch(group[kBatchA]);
    prefetch_line(&a.rest[group[kInstanceA]]);
    prefetch_line(&frame.batch(group[kBatchB]).rest[group[kInstanceB]]);
    prefetch_line(&a.hit_chains[group[kInstanceA]]);
    ahead.at += size_of(group);
  };
  for (int group = 0; group < 16; ++group) prefetch_next();
  while (const std::uint32_t* const group = from.group()) {
    prefetch_next();
    const std::uint32_t size = size_of(group), hits = hits_of(group);
    from.at += size;
    const Candidate kept = {group[kBatchA], group[kInstanceA], group[kBatchB], group[kInstanceB]};
    if (!goes_on(frame, kept)) continue;
    stats.hits_kept += hits;
    std::uint32_t* const to = room_for(hits, block, sink);
    std::memmove(to, group, size * sizeof *to);
    end_group(frame, to, block, sink);
    set_in_contact(frame, kept);
  }
}

std::uint32_t begin_counting_hits(StoredBatches batches) { return lay_out_writing(batches); }

void count_hits(StoredBatches batches, std::uint32_t task) {
  const InstanceRun of = instance_run(batches, task);
  std::uint32_t count = 0;
  for (std::uint32_t i = of.begin; i < of.end; ++i) count += of.batch.hit_chains[i].count;
  of.batch.stored_before[of.run] = count;
}

std::uint32_t begin_writing_hits(StoredBatches batches, std::uint64_t in_open_blocks, HitSink& sink) {
  // A chain's 32 bits hold all hits that are stored, since each takes a word. Those that are counted alone may be more.
  const std::uint64_t before = sink.found;
  sink.found += sink.stored_hits + in_open_blocks;
  if (sink.found > sink.job->hits.size || sink.out_of_memory) return 0;
  const std::uint32_t tasks = lay_out_writing(batches);
  auto at = static_cast<std::size_t>(before);
  for (std::uint32_t task = 0; task < tasks; ++task) {
    const InstanceRun of = instance_run(batches, task);
    at += std::exchange(of.batch.stored_before[of.run], at);
  }
  return tasks;
}

void write_hits(const FrameContext& frame, std::uint32_t task, FrameStats& stats, const HitSink& sink) {
  constexpr std::uint32_t kPrefetched = 8;  // how many chains ahead the first group is prefetched
  const Timed timed(stats.seconds_query), written(stats.seconds_write);
  const HitStore& store = *sink.store;
  const InstanceRun of = instance_run(frame.batches, task);
  const HitChain* const chains = of.batch.hit_chains.data;
  std::uint32_t with_hits[kWrittenPerTask + kPrefetched], count = 0;
  for (std::uint32_t i = of.begin; i < of.end; ++i) {
    with_hits[count] = i;
    count += chains[i].count > 0;
  }
  if (count == 0) return;
  std::fill_n(with_hits + count, kPrefetched, with_hits[count - 1]);
  Hit* out = sink.job->hits.data + of.batch.stored_before[of.run];
  for (std::uint32_t n = 0; n < count; ++n) {
    prefetch_bytes(store.word(chains[with_hits[n + kPrefetched]].head), 128);
    write_chain(frame, of.index, with_hits[n], store, out);
    out += chains[with_hits[n]].count;
  }
}

}  // namespace cab
