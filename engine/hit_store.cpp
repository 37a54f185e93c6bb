// Step 6 of a frame for characters in spatial order: the layout of the hit store, and the merge sort of its chains.
#include "engine/hit_store.h"

#include "engine/batch_tasks.h"
#include "engine/characters.h"
#include "engine/frame_run.h"
#include "engine/in_contact.h"
#include "engine/touching_links.h"
#include "engine/worker.h"
#include "kernels/rigid_leaves.h"
#include "layout/atomic_words.h"
#include "layout/compiler.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

namespace cab {
namespace {

// The words of a group, which holds the hits of one candidate. kNext is where the next group of the chain begins, and
// kHits is the number of hits. The words from kGroupHead on are the hits: leaf a in the upper half, leaf b in the
// lower.
enum GroupWord : std::uint32_t { kNext, kBatchA, kInstanceA, kBatchB, kInstanceB, kHits, kGroupHead };

// Makes room in worker.words for one more group of up to `hits` hits: if there is none, stores the groups that are
// there. If the group does not fit into empty words either, sets HitSink::store_full and returns false.
bool make_room_for(const FrameContext& frame, std::size_t hits, Worker& worker, HitSink& sink) {
  FixedList<std::uint32_t>& words = worker.words;
  if (words.size + kGroupHead + hits <= words.capacity) return true;
  store_groups(frame, worker, sink);
  if (kGroupHead + hits <= words.capacity) return true;
  sink.store_full = true;
  return false;
}

// Completes a group whose hits are behind worker.words and the room for its head.
void end_group(const Candidate& candidate, std::uint32_t hits, Worker& worker) {
  if (hits == 0) return;
  std::uint32_t* const head = worker.words.end();
  head[kNext] = HitChain::kEnd;
  head[kBatchA] = candidate.batch_a;
  head[kInstanceA] = candidate.instance_a;
  head[kBatchB] = candidate.batch_b;
  head[kInstanceB] = candidate.instance_b;
  head[kHits] = hits;
  worker.words.size += kGroupHead + hits;
}

// Merges two chains that are sorted by the key of instance b. Returns where the merged chain begins.
std::uint32_t merge_chains(std::uint32_t* store, std::uint32_t x, std::uint32_t y) {
  std::uint32_t first, *link = &first;
  const auto key = [store](std::uint32_t group) {
    return instance_key(store[group + kBatchB], store[group + kInstanceB]);
  };
  while (x != HitChain::kEnd && y != HitChain::kEnd) {
    std::uint32_t& lower = key(x) < key(y) ? x : y;
    *link = lower;
    link = &store[lower + kNext];
    lower = *link;
  }
  *link = x != HitChain::kEnd ? x : y;
  return first;
}

// Sorts a chain of groups by the key of instance b, bottom up: chain[k] is empty or a sorted chain of 2^k groups.
// Returns where the sorted chain begins.
std::uint32_t sort_chain(std::uint32_t* store, std::uint32_t head) {
  if (head == HitChain::kEnd || store[head + kNext] == HitChain::kEnd) return head;
  constexpr std::uint32_t kChains = 32;
  std::uint32_t chain[kChains], chains = 0;
  while (head != HitChain::kEnd) {
    std::uint32_t carried = head;
    head = store[carried + kNext];
    store[carried + kNext] = HitChain::kEnd;
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

// Writes a hit of the instances of `head`. leaves: as in a group. In three words, since eight numbers take longer.
void write_hit(const Hit& head, std::uint16_t link_a, std::uint16_t link_b, std::uint32_t leaves, Hit* out) {
  static_assert(sizeof(Hit) == 24 && offsetof(Hit, link_a) == 16 && offsetof(Hit, leaf_b) == 22);
  if constexpr (kLittleEndian) {
    const std::uint64_t rest =
        link_a | std::uint64_t{link_b} << 16 | std::uint64_t{leaves >> 16} << 32 | std::uint64_t{leaves & 0xffff} << 48;
    std::memcpy(static_cast<void*>(out), &head, 16);
    std::memcpy(&out->link_a, &rest, sizeof rest);
  } else {
    *out = {head.batch_a,
            head.instance_a,
            head.batch_b,
            head.instance_b,
            link_a,
            link_b,
            static_cast<std::uint16_t>(leaves >> 16),
            static_cast<std::uint16_t>(leaves)};
  }
}

// Writes the hits whose instance a is the given one, sorted by instance b, until `room` is full.
void write_chain(const FrameContext& frame, std::uint32_t index, std::uint32_t instance, Span<std::uint32_t> store,
                 Span<Hit> room) {
  const InstanceBatch& a = frame.batch(index);
  std::size_t at = 0;
  for (std::uint32_t group = sort_chain(store.data, a.hit_chains[instance].head); at < room.size;
       group = store[group + kNext]) {
    const std::uint32_t* from = store.data + group;
    const std::uint32_t batch_b = from[kBatchB], instance_b = from[kInstanceB], count = from[kHits];
    from += kGroupHead;
    const Span<const std::uint16_t> link_a = a.articulation->leaf_link;
    const Span<const std::uint16_t> link_b = frame.batch(batch_b).articulation->leaf_link;
    const Hit head = {{index + 1}, instance, {batch_b + 1}, instance_b, 0, 0, 0, 0};
    const auto hits = static_cast<std::uint32_t>(std::min<std::size_t>(count, room.size - at));
    for (std::uint32_t i = 0; i < hits; ++i)
      write_hit(head, link_a.data[from[i] >> 16], link_b.data[from[i] & 0xffff], from[i], room.data + at + i);
    at += hits;
  }
}

// Whether the hits of two instances, or of one within itself, are those of the last frame, and are reported again.
bool goes_on(const FrameContext& frame, const Candidate& candidate) {
  const InstanceBatch &a = frame.batch(candidate.batch_a), &b = frame.batch(candidate.batch_b);
  if (!rests(a, candidate.instance_a) || !rests(b, candidate.instance_b)) return false;
  return is_within(candidate) ? !a.skips_within
                              : !frame.broad_phase.skips_resting(candidate.batch_a, candidate.batch_b);
}

// Lays out the tasks that count or write hits.
std::uint32_t lay_out_writing(const FrameRun& run) {
  return lay_out_tasks(run.engine.stored_batches(), [](const InstanceBatch& batch) {
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

InstanceRun instance_run(const FrameRun& run, std::uint32_t task) {
  const BatchTask of = batch_task(run.engine.stored_batches(), task);
  InstanceBatch& batch = run.engine.batches[of.batch]->batch;
  return {batch, of.batch, of.run, of.run * kWrittenPerTask,
          std::min(batch.instance_count, (of.run + 1) * kWrittenPerTask)};
}

}  // namespace

void add_group(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, Worker& worker,
               HitSink& sink) {
  if (!make_room_for(frame, pairs.size, worker, sink)) return;
  std::uint32_t* const head = worker.words.end();
  std::uint32_t* end = head + kGroupHead;
  for_each_touching(frame, candidate, pairs, worker.stats,
                    [&end](const LinkedPair& pair) { *end++ = std::uint32_t{pair.leaf_a} << 16 | pair.leaf_b; });
  end_group(candidate, static_cast<std::uint32_t>(end - head) - kGroupHead, worker);
}

void add_groups_of_leaves(const FrameContext& frame, const Candidate* candidates, const std::uint32_t* candidate_of,
                          Span<const std::uint32_t> pairs, Worker& worker, HitSink& sink) {
  worker.stats.leaf_pairs += pairs.size;
  for (std::size_t i = 0; i < pairs.size;) {
    const std::uint32_t number = candidate_of[kernel::slot_of(pairs[i])];
    std::size_t end = i + 1;
    while (end < pairs.size && candidate_of[kernel::slot_of(pairs[end])] == number) ++end;
    if (!make_room_for(frame, end - i, worker, sink)) return;
    std::uint32_t* hit = worker.words.end() + kGroupHead;
    const auto hits = static_cast<std::uint32_t>(end - i);
    for (; i < end; ++i) *hit++ = kernel::leaf_a_of(pairs.data[i]) << 16 | kernel::leaf_b_of(pairs.data[i]);
    end_group(candidates[number], hits, worker);
    set_in_contact(frame, candidates[number]);
  }
}

// Each group becomes the first of its chain.
void store_groups(const FrameContext& frame, Worker& worker, HitSink& sink) {
  FixedList<std::uint32_t>& words = worker.words;
  const std::uint64_t at = sink.stored_words.fetch_add(words.size, std::memory_order_relaxed);
  if (at + words.size > sink.store->words.size) {
    sink.store_full = true;
    words.clear();
    return;
  }
  std::uint32_t* const to = sink.store->words.data + at;
  std::copy(words.begin(), words.end(), to);
  for (std::uint32_t group = 0; group < words.size; group += kGroupHead + to[group + kHits]) {
    HitChain& chain = frame.batch(to[group + kBatchA]).hit_chains[to[group + kInstanceA]];
    if (sink.alone) {
      to[group + kNext] = std::exchange(chain.head, static_cast<std::uint32_t>(at + group));
      chain.count += to[group + kHits];
    } else {
      to[group + kNext] = relaxed_exchange(chain.head, static_cast<std::uint32_t>(at + group));
      relaxed_add(chain.count, to[group + kHits]);
    }
  }
  words.clear();
}

// Groups only move down, so the store is read and written from its beginning to its end. What it says of instances is
// all over memory, and is prefetched.
void keep_hits(FrameRun& run) {
  const FrameContext& frame = *run.characters;
  FrameStats& stats = run.worker(0).stats;
  const Timed timed(stats.seconds_query);
  std::uint32_t* const store = run.sink.store->words.data;
  const std::uint32_t used = run.sink.store->used;
  std::uint32_t to = 0, ahead = 0;
  const auto prefetch_next = [&] {
    if (ahead == used) return;
    const std::uint32_t* const group = store + ahead;
    const InstanceBatch& a = frame.batch(group[kBatchA]);
    prefetch_line(&a.rest[group[kInstanceA]]);
    prefetch_line(&frame.batch(group[kBatchB]).rest[group[kInstanceB]]);
    prefetch_line(&a.hit_chains[group[kInstanceA]]);
    ahead += kGroupHead + group[kHits];
  };
  for (int group = 0; group < 16; ++group) prefetch_next();
  for (std::uint32_t from = 0, size; from < used; from += size) {
    prefetch_next();
    const std::uint32_t* const group = store + from;
    const Candidate kept = {group[kBatchA], group[kInstanceA], group[kBatchB], group[kInstanceB]};
    size = kGroupHead + group[kHits];
    if (!goes_on(frame, kept)) continue;
    stats.hits_kept += group[kHits];
    if (to != from) std::copy(group, group + size, store + to);
    HitChain& chain = frame.batch(kept.batch_a).hit_chains[kept.instance_a];
    store[to + kNext] = std::exchange(chain.head, to);
    chain.count += store[to + kHits];
    set_in_contact(frame, kept);
    to += size;
  }
  run.sink.stored_words = to;
}

void hold_hits(FrameRun& run) {
  HitStore& store = *run.sink.store;
  store.holds_last = !run.in_key_order && run.job.report != Report::kInContact;
  store.used = static_cast<std::uint32_t>(run.sink.stored_words.load());
}

std::uint32_t begin_counting_hits(FrameRun& run) {
  if (!run.in_key_order) end_spatial_order(run);
  if (run.in_key_order) return 0;
  return lay_out_writing(run);
}

void count_hits(FrameRun& run, std::uint32_t task, std::uint32_t) {
  const InstanceRun of = instance_run(run, task);
  std::uint32_t count = 0;
  for (std::uint32_t i = of.begin; i < of.end; ++i) count += of.batch.hit_chains[i].count;
  of.batch.stored_before[of.run] = count;
}

std::uint32_t begin_writing_hits(FrameRun& run) {
  if (run.in_key_order) return 0;
  const std::uint32_t tasks = lay_out_writing(run);
  std::size_t found = run.sink.found;
  for (std::uint32_t task = 0; task < tasks; ++task) {
    const InstanceRun of = instance_run(run, task);
    const std::size_t count = of.batch.stored_before[of.run];
    of.batch.stored_before[of.run] = found;
    found += count;
  }
  run.sink.found = found;
  return tasks;
}

void write_hits(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  constexpr std::uint32_t kPrefetched = 16;  // how many instances ahead the first group is prefetched
  FrameStats& stats = run.worker(w).stats;
  const Timed timed(stats.seconds_query), written(stats.seconds_write);
  const FrameJob& job = run.job;
  const Span<std::uint32_t> store = run.sink.store->words;
  const InstanceRun of = instance_run(run, task);
  std::size_t at = of.batch.stored_before[of.run];
  for (std::uint32_t i = of.begin; i < of.end; ++i) {
    const std::uint32_t ahead = std::min(i + kPrefetched, of.batch.instance_count - 1);
    if (const HitChain& next = of.batch.hit_chains[ahead]; next.count) prefetch_line(store.data + next.head);
    const std::size_t count = of.batch.hit_chains[i].count;
    if (at < job.hits.size)
      write_chain(*run.characters, of.index, i, store, {job.hits.data + at, std::min(count, job.hits.size - at)});
    at += count;
  }
}

}  // namespace cab
