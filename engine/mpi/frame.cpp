// One frame of all ranks.
#include "engine/mpi/agreement.h"
#include "engine/mpi/border.h"

#include <cstddef>
#include <new>
#include <utility>
#include <vector>

namespace cab::mpi {
namespace {

// The first rank whose input of a batch is not made as that of the first rank which has one.
Answer compare_members(const RegionTable& table, std::size_t batch_count) {
  std::vector<const Region*> first(batch_count, nullptr);
  for (std::int32_t r = 0; static_cast<std::size_t>(r) + 1 < table.begins.size(); ++r)
    for (const Region& region : table.of(r)) {
      const Region*& before = first[region.batch - 1];
      if (!before) before = &region;
      if (region.members != before->members) return {Status::kOk, Difference::kMembers, r};
    }
  return {};
}

// Gives hits of a rank's own frame the numbers of whole batches.
void number_hits(const OwnPart& part, LocalHits& out) {
  const auto number = [&part](BatchSlot slot, std::uint32_t& instance) {
    if (const OwnBatch& own = part.batches[slot.value - 1]; own.given) instance = own.given->numbers[instance];
  };
  for (Hit& hit : out.hits) {
    number(hit.batch_a, hit.instance_a);
    number(hit.batch_b, hit.instance_b);
  }
}

// All ranks agree at the beginning and at the end, and tell each other twice how many regions there are, and which.
void count_regions(const DistributedEngine& engine, std::size_t regions, MessageCount& count) {
  const auto others = static_cast<std::uint64_t>(engine.rank_count - 1);
  count.messages = 6 * others;
  count.bytes = others * (2 * kAgreementBytes + 2 * sizeof(int) + regions * sizeof(Region));
}

}  // namespace

Answer run_frame(DistributedEngine& engine, DistributedJob& job) noexcept {
  OwnPart part;
  Status status;
  try {
    status = make_own_part(engine, job, part);
  } catch (const std::bad_alloc&) { status = Status::kOutOfMemory; }
  if (const Answer answer = agree(engine.comm, status, digest_of(job), Difference::kJob); !answer.ok()) return answer;
  const RegionTable reached = gather_regions(engine.comm, part.regions);
  if (const Answer answer = compare_members(reached, engine.batches.size()); !answer.ok()) return answer;

  // A call that fails does not keep this rank from answering the others. All learn of it at the end.
  const std::size_t reached_regions = part.regions.size();
  const Status bound = bound_near(engine, job, reached, part);
  const RegionTable table = gather_regions(engine.comm, part.regions);
  job.traffic = {};
  count_regions(engine, reached_regions + part.regions.size(), job.traffic.regions);
  Border border(engine, job, part, table, job.traffic);
  border.send_bounds();
  LocalHits own, across;
  own.hits = std::move(engine.hits);
  own.contacts = std::move(engine.contacts);
  FrameJob frame = own_job(job, part);
  status = run_local(*engine.own, frame, job.contacts, own);
  job.own_stats = frame.stats;
  job.border_stats = {};
  border.receive_bounds();
  Status near = border.find_pairs();
  border.send_requests();
  border.answer_requests();
  border.receive_poses();
  if (near == Status::kOk) near = border.test(across, job.border_stats);
  border.end();
  if (status == Status::kOk) status = bound != Status::kOk ? bound : near;

  number_hits(part, own);
  merge_hits(own, across);
  engine.hits = std::move(own.hits);
  engine.contacts = std::move(own.contacts);
  job.hit_list = engine.hits;
  job.contact_list = engine.contacts;
  return agree(engine.comm, status, border.has_twice() ? 1 + static_cast<std::uint64_t>(engine.rank) : 0,
               Difference::kNumbers);
}

}  // namespace cab::mpi
