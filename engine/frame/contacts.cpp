#include "engine/frame/contacts.h"

#include "engine/hits/report.h"
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/timed.h"

#include <algorithm>
#include <tuple>

namespace cab {
namespace {

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

std::uint32_t begin_contacts(FrameRun& run) {
  finish_hits(run.sink);
  return needs_contacts(run.job) ? contact_tasks(run.job.hit_count) : 0;
}

void add_contacts(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  const FrameJob& job = run.job;
  const FrameContext& frame = *run.characters;
  Worker& worker = run.worker(w);
  const Timed query(worker.stats.seconds_query), timed(worker.stats.seconds_contact);
  const std::size_t begin = std::size_t{task} * kContactsPerTask,
                    end = std::min(begin + kContactsPerTask, job.hit_count);
  Contact own[kContactsPerTask];
  Contact* const contacts = job.contacts.empty() ? own : job.contacts.data + begin;
  find_exact_test(frame.policies.exact)->contacts(frame, {job.hits.data + begin, end - begin}, contacts, worker.exact);
  for (std::size_t i = begin; i < end && job.min_depth > 0; ++i)
    if (contacts[i - begin].depth < job.min_depth) drop(job.hits[i]);
}

void drop_hits(FrameRun& run) {
  FrameJob& job = run.job;
  if (job.hits_needed > job.hits.size || (job.min_depth == 0 && job.report != Report::kDistances)) return;
  if (job.report == Report::kDistances) keep_deepest(job);
  close_gaps(job);
  mark_in_contact(*run.characters, job);
}

}  // namespace cab
