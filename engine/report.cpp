#include "engine/report.h"

#include "engine/broad_phase.h"
#include "engine/in_contact.h"
#include "engine/timed.h"

#include <algorithm>
#include <thread>
#include <tuple>

namespace cab {
namespace {

// A leaf pair with the links that its leaves ride on; within one instance the lower link comes first.
struct LinkedPair {
  std::uint16_t link_a, link_b;
  std::uint16_t leaf_a, leaf_b;
};

LinkedPair linked(const Articulation& a, const Articulation& b, const LeafPair& pair, bool within) {
  const LinkedPair out = {a.leaf_link[pair.a], b.leaf_link[pair.b], pair.a, pair.b};
  if (within && out.link_b < out.link_a) return {out.link_b, out.link_a, out.leaf_b, out.leaf_a};
  return out;
}

auto order(const LinkedPair& pair) { return std::tie(pair.link_a, pair.link_b, pair.leaf_a, pair.leaf_b); }

auto order(const Hit& hit) {
  return std::tie(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a, hit.link_b);
}

ExactLeaf exact_leaf(const Engine& engine, std::uint32_t batch_index, std::uint32_t instance, std::uint32_t leaf) {
  const InstanceBatch& batch = engine.batches[batch_index]->batch;
  return {engine.articulations[batch.articulation_index]->shapes.get(), &batch, instance, leaf};
}

void wait_for_turn(std::uint32_t task, const HitSink& sink) {
  while (sink.turn.load(std::memory_order_acquire) != task) std::this_thread::yield();
}

// Copies a worker's hits into the caller's buffer; only the task whose turn it is may.
void hand_over(Worker& worker, HitSink& sink) {
  const std::size_t at = sink.found.load(std::memory_order_relaxed);
  const std::size_t room = at < sink.job->hits.size ? sink.job->hits.size - at : 0;
  std::copy(worker.hits.begin(), worker.hits.begin() + std::min<std::size_t>(room, worker.hits.size),
            sink.job->hits.data + (room ? at : 0));
  sink.found.store(at + worker.hits.size, std::memory_order_relaxed);
  worker.hits.clear();
}

// A group in the store: the hits of one candidate. Words: where the next group of its first instance begins, its two
// instances, how many hits there are, then both leaves of each in one word.
enum GroupWord : std::uint32_t { kNext, kBatchA, kInstanceA, kBatchB, kInstanceB, kHits, kGroupHead };

// Puts the groups of a worker into the store, each before the others of its first instance.
void store_groups(Engine& engine, Worker& worker, HitSink& sink) {
  const FixedList<std::uint32_t>& words = worker.words;
  const std::uint64_t at = sink.stored_words.fetch_add(words.size, std::memory_order_relaxed);
  if (at + words.size > engine.store.size) {
    sink.store_full = true;
    return;
  }
  std::uint32_t* const to = engine.store.data + at;
  std::copy(words.begin(), words.end(), to);
  for (std::uint32_t group = 0; group < words.size; group += kGroupHead + to[group + kHits]) {
    StoredHits& stored = engine.batches[to[group + kBatchA]]->batch.stored[to[group + kInstanceA]];
    to[group + kNext] = __atomic_exchange_n(&stored.head, static_cast<std::uint32_t>(at + group), __ATOMIC_RELAXED);
    __atomic_fetch_add(&stored.count, to[group + kHits], __ATOMIC_RELAXED);
  }
}

// Whether a worker's groups have room for one more of up to `hits`, after they are stored if need be.
bool has_room_for(Engine& engine, Worker& worker, std::size_t hits, HitSink& sink) {
  FixedList<std::uint32_t>& words = worker.words;
  if (words.size + kGroupHead + hits <= words.capacity) return true;
  store_hits(engine, worker, sink);
  if (kGroupHead + hits <= words.capacity) return true;
  sink.store_full = true;
  return false;
}

// One chain of two, in the order of the instances that its groups touch.
std::uint32_t merge_chains(std::uint32_t* store, std::uint32_t x, std::uint32_t y) {
  std::uint32_t first, *link = &first;
  const auto key = [store](std::uint32_t group) {
    return instance_key(store[group + kBatchB], store[group + kInstanceB]);
  };
  while (x != StoredHits::kNone && y != StoredHits::kNone) {
    std::uint32_t& lower = key(x) < key(y) ? x : y;
    *link = lower;
    link = &store[lower + kNext];
    lower = *link;
  }
  *link = x != StoredHits::kNone ? x : y;
  return first;
}

// Sorts a chain of groups by merging: chain[k], if there is one, holds 2^k of them.
std::uint32_t sort_chain(std::uint32_t* store, std::uint32_t head) {
  constexpr std::uint32_t kChains = 32;
  std::uint32_t chain[kChains], chains = 0;
  while (head != StoredHits::kNone) {
    std::uint32_t carried = head;
    head = store[carried + kNext];
    store[carried + kNext] = StoredHits::kNone;
    std::uint32_t k = 0;
    for (; k < chains && chain[k] != StoredHits::kNone; ++k) {
      carried = merge_chains(store, chain[k], carried);
      chain[k] = StoredHits::kNone;
    }
    if (k == chains) ++chains;
    chain[k] = carried;
  }
  std::uint32_t sorted = StoredHits::kNone;
  for (std::uint32_t k = 0; k < chains; ++k) sorted = merge_chains(store, chain[k], sorted);
  return sorted;
}

// Writes one instance's hits, as far as there is room.
void write_hits(Engine& engine, std::uint32_t index, std::uint32_t instance, Span<Hit> room) {
  const InstanceBatch& a = engine.batches[index]->batch;
  std::size_t at = 0;
  for (std::uint32_t group = sort_chain(engine.store.data, a.stored[instance].head); at < room.size;
       group = engine.store[group + kNext]) {
    const std::uint32_t* from = engine.store.data + group;
    const std::uint32_t batch_b = from[kBatchB], instance_b = from[kInstanceB], count = from[kHits];
    from += kGroupHead;
    const Span<const std::uint16_t> link_a = a.articulation->leaf_link;
    const Span<const std::uint16_t> link_b = engine.batches[batch_b]->batch.articulation->leaf_link;
    for (std::uint32_t i = 0; i < count && at < room.size; ++i) {
      const std::uint16_t leaf_a = static_cast<std::uint16_t>(from[i] >> 16),
                          leaf_b = static_cast<std::uint16_t>(from[i]);
      room[at++] = {{index + 1}, instance, {batch_b + 1}, instance_b, link_a[leaf_a], link_b[leaf_b], leaf_a, leaf_b};
    }
  }
}

void push_hit(HitSink& sink, const Candidate& candidate, const LinkedPair& pair, std::uint32_t task, Worker& worker) {
  if (worker.hits.size == worker.hits.capacity) {
    wait_for_turn(task, sink);
    hand_over(worker, sink);
  }
  worker.hits.push({{candidate.batch_a + 1},
                    candidate.instance_a,
                    {candidate.batch_b + 1},
                    candidate.instance_b,
                    pair.link_a,
                    pair.link_b,
                    pair.leaf_a,
                    pair.leaf_b});
}

// Asks the exact test about two leaves whose boxes overlap, if the frame has one.
bool confirm(const Engine& engine, const Candidate& candidate, const FrameJob& job, std::uint32_t leaf_a,
             std::uint32_t leaf_b, Worker& worker) {
  if (job.policies.exact == Exact::kNone) return true;
  ++worker.stats.exact_tests;
  if (leaves_touch(exact_leaf(engine, candidate.batch_a, candidate.instance_a, leaf_a),
                   exact_leaf(engine, candidate.batch_b, candidate.instance_b, leaf_b), job.margin))
    return true;
  ++worker.stats.false_positives;
  return false;
}

// Sorts the leaf pairs of one candidate by links, then leaves. What is found by rows stands sorted where leaves do.
void sort_by_links(const Articulation& a, const Articulation& b, bool within, Span<LeafPair> pairs) {
  const auto by_leaves = [](const LeafPair& x, const LeafPair& y) {
    return (std::uint32_t{x.a} << 16 | x.b) < (std::uint32_t{y.a} << 16 | y.b);
  };
  if (a.leaves_by_link && b.leaves_by_link && !within && std::is_sorted(pairs.begin(), pairs.end(), by_leaves)) return;
  std::sort(pairs.begin(), pairs.end(), [&](const LeafPair& x, const LeafPair& y) {
    const LinkedPair lx = linked(a, b, x, within), ly = linked(a, b, y, within);
    return order(lx) < order(ly);
  });
}

// Calls take(pair) for one touching leaf pair of each two links, the first.
template <class Take>
void for_each_touching(const Engine& engine, const Candidate& candidate, const Articulation& a, const Articulation& b,
                       Span<LeafPair> pairs, const FrameJob& job, Worker& worker, Take&& take) {
  const bool within = is_within(candidate), confirmed = job.policies.exact == Exact::kNone;
  std::uint16_t link_a = 0xffff, link_b = 0xffff;
  bool any = false;
  for (const LeafPair& pair : pairs) {
    const LinkedPair at = linked(a, b, pair, within);
    if ((at.link_a == link_a && at.link_b == link_b) ||
        (!confirmed && !confirm(engine, candidate, job, at.leaf_a, at.leaf_b, worker)))
      continue;
    take(at);
    link_a = at.link_a;
    link_b = at.link_b;
    any = true;
  }
  if (any) set_in_contact(engine, candidate);
}

// Adds the hits of one candidate to the worker's groups.
void add_group(Engine& engine, const Candidate& candidate, const Articulation& a, const Articulation& b,
               Span<LeafPair> pairs, Worker& worker, HitSink& sink) {
  if (!has_room_for(engine, worker, pairs.size, sink)) return;
  std::uint32_t* const head = worker.words.end();
  std::uint32_t* end = head + kGroupHead;
  for_each_touching(engine, candidate, a, b, pairs, *sink.job, worker,
                    [&end](const LinkedPair& pair) { *end++ = std::uint32_t{pair.leaf_a} << 16 | pair.leaf_b; });
  const auto hits = static_cast<std::uint32_t>(end - head) - kGroupHead;
  if (hits == 0) return;
  head[kNext] = StoredHits::kNone;
  head[kBatchA] = candidate.batch_a;
  head[kInstanceA] = candidate.instance_a;
  head[kBatchB] = candidate.batch_b;
  head[kInstanceB] = candidate.instance_b;
  head[kHits] = hits;
  worker.words.size += kGroupHead + hits;
}

}  // namespace

void report_candidate(Engine& engine, const Candidate& candidate, Span<LeafPair> pairs, std::uint32_t task,
                      Worker& worker, HitSink& sink) {
  const Articulation& a = *engine.batches[candidate.batch_a]->batch.articulation;
  const Articulation& b = *engine.batches[candidate.batch_b]->batch.articulation;
  const bool within = is_within(candidate);
  worker.stats.leaf_pairs += pairs.size;
  if (sink.job->report == Report::kInContact) {
    if (is_already_reported(engine, candidate)) return;
    const auto touch = [&](const LeafPair& pair) {
      const LinkedPair at =
          linked(a, b, pair, within);  // the order of operands that hits have: FCL's answer may differ
      return confirm(engine, candidate, *sink.job, at.leaf_a, at.leaf_b, worker);
    };
    if (std::any_of(pairs.begin(), pairs.end(), touch)) set_in_contact(engine, candidate);
    return;
  }
  sort_by_links(a, b, within, pairs);
  if (sink.in_spatial_order)
    add_group(engine, candidate, a, b, pairs, worker, sink);
  else
    for_each_touching(engine, candidate, a, b, pairs, *sink.job, worker,
                      [&](const LinkedPair& pair) { push_hit(sink, candidate, pair, task, worker); });
}

void finish_task(std::uint32_t task, Worker& worker, HitSink& sink) {
  wait_for_turn(task, sink);
  hand_over(worker, sink);
  sink.turn.store(task + 1, std::memory_order_release);
}

void store_hits(Engine& engine, Worker& worker, HitSink& sink) {
  store_groups(engine, worker, sink);
  worker.words.clear();
}

void write_stored_hits(Engine& engine, HitSink& sink) {
  constexpr std::uint32_t kPrefetched = 16;  // instances ahead, whose hits lie anywhere
  FrameJob& job = *sink.job;
  std::size_t found = sink.found;
  for (std::uint32_t index = 0; index < engine.batches.size(); ++index) {
    const InstanceBatch& batch = engine.batches[index]->batch;
    if (!batch.pairs_between && !batch.pairs_within) continue;
    const std::uint32_t tasks = (batch.instance_count + kStoredPerTask - 1) / kStoredPerTask;
    const auto run = [&](std::uint32_t task, auto&& each) {
      const std::uint32_t end = std::min(batch.instance_count, (task + 1) * kStoredPerTask);
      for (std::uint32_t i = task * kStoredPerTask; i < end; ++i) each(i);
    };
    engine.tasks->for_each(tasks, [&](std::uint32_t task, std::uint32_t) {
      std::uint32_t count = 0;
      run(task, [&](std::uint32_t i) { count += batch.stored[i].count; });
      batch.stored_before[task] = count;
    });
    for (std::uint32_t task = 0; task < tasks; ++task) {
      const std::size_t count = batch.stored_before[task];
      batch.stored_before[task] = found;
      found += count;
    }
    engine.tasks->for_each(tasks, [&](std::uint32_t task, std::uint32_t w) {
      const Timed timed(engine.workers[w]->stats.seconds_query);
      std::size_t at = batch.stored_before[task];
      run(task, [&](std::uint32_t i) {
        const std::uint32_t ahead = std::min(i + kPrefetched, batch.instance_count - 1);
        if (const StoredHits& next = batch.stored[ahead]; next.count) __builtin_prefetch(engine.store.data + next.head);
        const std::size_t count = batch.stored[i].count;
        if (at < job.hits.size) write_hits(engine, index, i, {job.hits.data + at, std::min(count, job.hits.size - at)});
        at += count;
      });
    });
  }
  sink.found = found;
}

Status finish_hits(const Engine& engine, HitSink& sink) {
  FrameJob& job = *sink.job;
  job.hits_needed = sink.found.load();
  job.hit_count = 0;
  if (job.hits_needed > job.hits.size) return Status::kHitsOverflow;
  job.hit_count = job.hits_needed;
  if (!sink.sorted)
    std::sort(job.hits.data, job.hits.data + job.hit_count,
              [](const Hit& x, const Hit& y) { return order(x) < order(y); });
  if (job.contacts.empty()) return Status::kOk;
  engine.tasks->for_each(static_cast<std::uint32_t>(job.hit_count), [&](std::uint32_t i, std::uint32_t w) {
    FrameStats& stats = engine.workers[w]->stats;
    const Timed query(stats.seconds_query), contact(stats.seconds_contact);
    const Hit& hit = job.hits[i];
    job.contacts[i] = leaf_contact(exact_leaf(engine, hit.batch_a.value - 1, hit.instance_a, hit.leaf_a),
                                   exact_leaf(engine, hit.batch_b.value - 1, hit.instance_b, hit.leaf_b), job.margin);
  });
  return Status::kOk;
}

}  // namespace cab
