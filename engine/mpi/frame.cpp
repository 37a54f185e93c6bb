// One frame of all ranks.
#include "engine/mpi/agreement.h"
#include "engine/mpi/border.h"
#include "engine/mpi/out_of_memory.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace cab::mpi {
namespace {

// The first rank whose input of a batch is not made as that of the first rank which has one.
Answer compare_members(const RegionTable& table, std::vector<const Region*>& first) {
  std::fill(first.begin(), first.end(), nullptr);
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

// All memory is taken inside or_out_of_memory, and no rank leaves the frame before the others know that it does: it
// tells its status where all ranks gather or agree, and in between it sends empty messages and takes those of others.
Answer run_frame(DistributedEngine& engine, DistributedJob& job) noexcept {
  job.hit_list = {};
  job.contact_list = {};
  OwnPart part;
  Status status = or_out_of_memory([&] { return make_own_part(engine, job, part); });
  if (const Answer answer = agree(engine.comm, status, digest_of(job), Difference::kJob); !answer.ok()) return answer;
  if (const Answer answer = gather_regions(engine.comm, Status::kOk, part.regions, engine.reached); !answer.ok())
    return answer;
  if (const Answer answer = compare_members(engine.reached, part.first_regions); !answer.ok()) return answer;

  const std::size_t reached_regions = part.regions.size();
  job.traffic = {};
  std::optional<Border> border;
  status = or_out_of_memory([&] {
    border.emplace(engine, job, part, job.traffic);
    return bound_near(engine, job, engine.reached, part);
  });
  if (const Answer answer = gather_regions(engine.comm, status, part.regions, engine.near); !answer.ok()) return answer;
  count_regions(engine, reached_regions + part.regions.size(), job.traffic.regions);
  border->send_bounds();
  LocalHits own, across;
  own.hits = std::move(engine.hits);
  own.contacts = std::move(engine.contacts);
  FrameJob frame = own_job(job, part);
  status = or_out_of_memory([&] { return run_local(*engine.own, frame, job.contacts, own); });
  job.own_stats = frame.stats;
  job.border_stats = {};
  border->receive_bounds();
  border->find_pairs();
  border->send_requests();
  border->answer_requests();
  border->receive_poses();
  border->test(across, job.border_stats);
  border->end();
  if (status == Status::kOk) status = border->status();
  if (status == Status::kOk)
    status = or_out_of_memory([&] {
      number_hits(part, own);
      merge_hits(own, across);
    });
  engine.hits = std::move(own.hits);
  engine.contacts = std::move(own.contacts);
  const Answer answer = agree(
      engine.comm, status, border->has_twice() ? 1 + static_cast<std::uint64_t>(engine.rank) : 0, Difference::kNumbers);
  if (!answer.ok()) return answer;
  job.hit_list = engine.hits;
  job.contact_list = engine.contacts;
  return answer;
}

}  // namespace cab::mpi
