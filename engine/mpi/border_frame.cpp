// The frame of characters near other ranks, with those that were received, in the order of their numbers. A hit's bits
// depend on which of two instances is the first, so the order must be that of one engine.
#include "engine/mpi/border.h"
#include "engine/mpi/pose_record.h"

#include <algorithm>
#include <utility>

namespace cab::mpi {

void Border::test(LocalHits& out, FrameStats& stats) noexcept {
  if (is_complete_) attempt([&] { return test_pairs(out, stats); });
}

Status Border::test_pairs(LocalHits& out, FrameStats& stats) {
  std::vector<std::vector<Entry>> entries(engine_.batches.size());
  std::vector<GatheredInput> received(engine_.batches.size());
  for (std::vector<std::uint32_t>& ghosts : near_ghost_) ghosts.clear();
  for (std::uint32_t b = 0; b < entries.size(); ++b)
    for (const std::uint32_t i : near_own_[b])
      entries[b].push_back({own_.batches[b].given->numbers[i], i, nullptr, owner_of(b + 1, i)});
  for (std::size_t r = 0; r + 1 < ghost_begins_.size(); ++r) {
    Reader reader(exchanges_[r].poses);
    for (std::size_t g = ghost_begins_[r]; g < ghost_begins_[r + 1]; ++g) {
      Ghost& ghost = ghosts_[g];
      if (!ghost.wanted) continue;
      ghost.number = reader.read<std::uint32_t>();
      const std::size_t b = ghost.batch - 1;
      entries[b].push_back({ghost.number, static_cast<std::uint32_t>(near_ghost_[b].size()), &ghost, ghost.owner});
      near_ghost_[b].push_back(static_cast<std::uint32_t>(g));
      received[b].add(reader, ghost.region->members, engine_.batches[b].link_count, ghost.layers, ghost.layer_mask);
    }
  }
  std::vector<GatheredInput> gathered(engine_.batches.size());
  std::vector<BatchInput> inputs;
  for (std::uint32_t b = 0; b < entries.size(); ++b) {
    if (entries[b].empty()) continue;
    std::sort(entries[b].begin(), entries[b].end(), [](const Entry& x, const Entry& y) { return x.number < y.number; });
    for (std::size_t i = 1; i < entries[b].size(); ++i) has_twice_ |= entries[b][i].number == entries[b][i - 1].number;
    const std::uint32_t members = members_of_batch(b + 1);
    const BatchInput ghosts = received[b].input({b + 1}, members, kAllInstances);
    const std::uint32_t links = engine_.batches[b].link_count;
    for (const Entry& entry : entries[b])
      gathered[b].add(entry.ghost ? ghosts : own_.batches[b].given->input, entry.index, links);
    inputs.push_back(gathered[b].input({b + 1}, members, static_cast<std::uint32_t>(entries[b].size())));
  }
  out.hits.clear();
  out.contacts.clear();
  if (inputs.empty()) return Status::kOk;
  const std::vector<PairRule> between = rules();
  FrameJob job = own_job(job_, own_);
  job.inputs = inputs;
  job.rules = between;
  const Status status = run_local(*engine_.border, job, job_.contacts, out);
  stats = job.stats;
  if (status == Status::kOk) keep_pairs(entries, out);
  return status;
}

// Keeps the hits of this rank's characters with others' that it is to test, by their numbers in whole batches.
void Border::keep_pairs(const std::vector<std::vector<Entry>>& entries, LocalHits& out) const {
  std::size_t kept = 0;
  for (std::size_t h = 0; h < out.hits.size(); ++h) {
    Hit hit = out.hits[h];
    const Entry& a = entries[hit.batch_a.value - 1][hit.instance_a];
    const Entry& b = entries[hit.batch_b.value - 1][hit.instance_b];
    if ((a.ghost == nullptr) == (b.ghost == nullptr)) continue;
    if (!(a.ghost ? tests(b.owner, a.owner) : tests(a.owner, b.owner))) continue;
    hit.instance_a = a.number;
    hit.instance_b = b.number;
    out.hits[kept] = hit;
    if (!out.contacts.empty()) out.contacts[kept] = out.contacts[h];
    ++kept;
  }
  out.hits.resize(kept);
  if (!out.contacts.empty()) out.contacts.resize(kept);
}

}  // namespace cab::mpi
