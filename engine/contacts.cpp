#include "engine/contacts.h"

#include "engine/convex_pair.h"
#include "engine/in_contact.h"
#include "engine/timed.h"
#include "engine/worker.h"
#include "kernels/pose_leaves.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace cab {
namespace {

// Calls body(begin, end, worker) for all hits in runs of up to kContactsPerTask.
template <class Body>
void for_each_run(std::size_t count, WorkerPool& pool, Body&& body) {
  const auto tasks = static_cast<std::uint32_t>((count + kContactsPerTask - 1) / kContactsPerTask);
  pool.tasks->for_each(tasks, [&](std::uint32_t task, std::uint32_t w) {
    const std::size_t begin = std::size_t{task} * kContactsPerTask;
    body(begin, std::min(begin + kContactsPerTask, count), pool[w]);
  });
}

// Whether two hits are of the same two instances.
bool same_instances(const Hit& x, const Hit& y) {
  return std::tie(x.batch_a.value, x.instance_a, x.batch_b.value, x.instance_b) ==
         std::tie(y.batch_a.value, y.instance_a, y.batch_b.value, y.instance_b);
}

// A dropped hit has the id of no batch.
void drop(Hit& hit) { hit.batch_a = {}; }
bool is_dropped(const Hit& hit) { return hit.batch_a.value == 0; }

// Keeps of each run of hits of the same two instances the deepest, of equally deep ones the first.
void keep_deepest(FrameJob& job) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < job.hit_count; ++i) {
    if (is_dropped(job.hits[i])) continue;
    if (is_dropped(job.hits[best]) || !same_instances(job.hits[best], job.hits[i])) {
      best = i;
    } else if (job.contacts[i].depth > job.contacts[best].depth) {
      drop(job.hits[best]);
      best = i;
    } else {
      drop(job.hits[i]);
    }
  }
}

// Moves the hits that are left, with their contacts, to the front.
void close_gaps(FrameJob& job) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < job.hit_count; ++i) {
    if (is_dropped(job.hits[i])) continue;
    job.hits[kept] = job.hits[i];
    if (!job.contacts.empty()) job.contacts[kept] = job.contacts[i];
    ++kept;
  }
  job.hit_count = kept;
}

// Sets the in_contact bytes to what the hits that are left say.
void mark_in_contact(const FrameContext& frame, const FrameJob& job) {
  clear_in_contact(job.inputs);
  for (std::size_t i = 0; i < job.hit_count; ++i) {
    set_in_contact(frame, job.hits[i].batch_a.value - 1, job.hits[i].instance_a);
    set_in_contact(frame, job.hits[i].batch_b.value - 1, job.hits[i].instance_b);
  }
}

}  // namespace

bool needs_contacts(const FrameJob& job) { return !job.contacts.empty() || job.min_depth > 0; }

void add_contacts(const FrameContext& frame, WorkerPool& pool, FrameJob& job) {
  const ExactTest& test = *find_exact_test(frame.policies.exact);
  for_each_run(job.hit_count, pool, [&](std::size_t begin, std::size_t end, Worker& worker) {
    const Timed query(worker.stats.seconds_query), timed(worker.stats.seconds_contact);
    Contact own[kContactsPerTask];
    Contact* const contacts = job.contacts.empty() ? own : job.contacts.data + begin;
    test.contacts(frame, {job.hits.data + begin, end - begin}, contacts, worker);
    for (std::size_t i = begin; i < end && job.min_depth > 0; ++i)
      if (contacts[i - begin].depth < job.min_depth) drop(job.hits[i]);
  });
  if (frame.report == Report::kDistances) keep_deepest(job);
  if (job.min_depth == 0 && frame.report != Report::kDistances) return;
  close_gaps(job);
  mark_in_contact(frame, job);
}

bool is_valid_pose(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link) {
  kernel::LaneChecks<float> checks = {true, true, true};
  const kernel::RigidLanes<float> posed = placed_pose<float>(stored_pose(batch, instance, link), checks);
  return checks.finite && checks.rigid && kernel::in_range(posed.translation);
}

void measure_pairs(const FrameContext& frame, WorkerPool& pool, Span<const Hit> pairs, Contact* contacts) {
  const ExactTest& test = *find_exact_test(frame.policies.exact);
  for_each_run(pairs.size, pool, [&](std::size_t begin, std::size_t end, Worker& worker) {
    test.contacts(frame, {pairs.data + begin, end - begin}, contacts + begin, worker);
    for (std::size_t i = begin; i < end; ++i) {
      const Hit& pair = pairs[i];
      if (is_valid_pose(frame.batch(pair.batch_a.value - 1), pair.instance_a, pair.link_a) &&
          is_valid_pose(frame.batch(pair.batch_b.value - 1), pair.instance_b, pair.link_b))
        continue;
      contacts[i] = {};
      contacts[i].depth = -std::numeric_limits<float>::infinity();
    }
  });
}

}  // namespace cab
