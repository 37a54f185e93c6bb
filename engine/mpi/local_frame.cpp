#include "engine/mpi/local_frame.h"

#include <algorithm>
#include <cstddef>
#include <tuple>

namespace cab::mpi {
namespace {

// How many hits the first buffer has room for.
constexpr std::size_t kFirstHits = 4096;

auto key(const Hit& hit) {
  return std::make_tuple(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a, hit.link_b);
}

}  // namespace

Status run_local(Engine& engine, FrameJob& job, bool contacts, LocalHits& out) {
  out.hits.resize(std::max(out.hits.capacity(), kFirstHits));
  Status status;
  for (;;) {
    out.contacts.resize(contacts ? out.hits.size() : 0);
    job.hits = out.hits;
    job.contacts = out.contacts;
    status = cab::run_frame(engine, job);
    if (status != Status::kHitsOverflow) break;
    out.hits.resize(job.hits_needed);
  }
  const std::size_t count = status == Status::kOk ? job.hit_count : 0;
  out.hits.resize(count);
  out.contacts.resize(contacts ? count : 0);
  return status;
}

// From the back, so that the first list is merged where it is.
void merge_hits(LocalHits& into, const LocalHits& other) {
  std::size_t a = into.hits.size(), b = other.hits.size();
  const bool contacts = !into.contacts.empty() || !other.contacts.empty();
  into.hits.resize(a + b);
  if (contacts) into.contacts.resize(a + b);
  while (b > 0) {
    const bool is_first = a > 0 && key(other.hits[b - 1]) < key(into.hits[a - 1]);
    const LocalHits& from = is_first ? into : other;
    const std::size_t to = a + b - 1, at = is_first ? --a : --b;
    into.hits[to] = from.hits[at];
    if (contacts) into.contacts[to] = from.contacts[at];
  }
}

}  // namespace cab::mpi
