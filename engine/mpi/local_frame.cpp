#include "engine/mpi/local_frame.h"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <utility>

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

void merge_hits(LocalHits& into, const LocalHits& other) {
  if (other.hits.empty()) return;
  LocalHits out;
  out.hits.reserve(into.hits.size() + other.hits.size());
  const auto take = [&out](const LocalHits& from, std::size_t i) {
    out.hits.push_back(from.hits[i]);
    if (!from.contacts.empty()) out.contacts.push_back(from.contacts[i]);
  };
  std::size_t a = 0, b = 0;
  while (a < into.hits.size() || b < other.hits.size())
    if (b == other.hits.size() || (a < into.hits.size() && key(into.hits[a]) < key(other.hits[b])))
      take(into, a++);
    else
      take(other, b++);
  into = std::move(out);
}

}  // namespace cab::mpi
