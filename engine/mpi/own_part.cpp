#include "engine/mpi/own_part.h"

#include "engine/mpi/digest.h"

#include <algorithm>
#include <map>
#include <utility>

namespace cab::mpi {
namespace {

std::uint32_t slot(BatchId id) { return slot_of(id).value; }

bool ascend_below(Span<const std::uint32_t> numbers, std::uint32_t end) {
  for (std::size_t i = 0; i < numbers.size; ++i)
    if (numbers[i] >= end || (i > 0 && numbers[i] <= numbers[i - 1])) return false;
  return true;
}

// Checks what the engine cannot know, and takes the input of one batch.
Status take(DistributedEngine& engine, const RankInput& given, OwnPart& part) {
  const std::uint32_t at = slot(given.input.batch);
  if (at == 0 || at > engine.batches.size()) return Status::kUnknownBatch;
  const Batch& batch = engine.batches[at - 1];
  part.inputs.push_back(given.input);
  part.inputs.back().batch = {at};
  if (batch.is_static()) return given.numbers.empty() ? Status::kOk : Status::kBadInstances;
  const BatchInput& input = given.input;
  if (input.count != kAllInstances || !input.instances.empty()) return Status::kBadInstances;
  if (!input.bounds.empty()) return Status::kBadBounds;
  if (!input.moved.empty()) return Status::kBadMoved;
  if (!input.in_contact.empty()) return Status::kBadInContact;
  if (given.numbers.size > kMaxInstances) return Status::kTooManyInstances;
  if (!ascend_below(given.numbers, batch.instance_count)) return Status::kBadInstances;
  OwnBatch& own = part.batches[at - 1];
  if (own.given) return Status::kBatchGivenTwice;
  own.given = &given;
  own.count = static_cast<std::uint32_t>(given.numbers.size);
  if (own.count == 0) {
    part.inputs.pop_back();
    return Status::kOk;
  }
  part.inputs.back().count = own.count;
  return make_room(own_rooms(engine), at, own.count);
}

void add_regions(const OwnBatch& own, std::uint32_t batch, float margin, std::vector<Region>& regions) {
  std::map<std::int32_t, Region> by_size;
  const std::uint32_t members = members_of(own.given->input);
  for (std::uint32_t i = 0; i < own.count; ++i) {
    if (own.bounds[i].none()) continue;
    const WorldBounds world = own.world(i, margin);
    const std::int32_t size = size_class(world);
    const auto [at, is_new] = by_size.try_emplace(size, Region{batch, members, size, 0, world});
    ++at->second.count;
    widen(at->second.bounds, world);
  }
  for (const auto& [size, region] : by_size) regions.push_back(region);
}

// The regions of other ranks that meet one of a batch of this rank.
std::vector<WorldBounds> reaching(const RegionTable& table, std::int32_t rank, std::uint32_t batch,
                                  const Partners& partners) {
  std::vector<WorldBounds> out;
  const auto meets_own = [&](const Region& there) {
    const Span<const Region> own = table.of(rank);
    return std::any_of(own.begin(), own.end(),
                       [&](const Region& here) { return here.batch == batch && meet(here.bounds, there.bounds); });
  };
  for (std::size_t r = 0; r + 1 < table.begins.size(); ++r) {
    if (r == static_cast<std::size_t>(rank)) continue;
    for (const Region& there : table.of(static_cast<std::int32_t>(r)))
      if (partners.has(batch, there.batch) && meets_own(there)) out.push_back(there.bounds);
  }
  return out;
}

}  // namespace

const double* OwnBatch::origin(std::size_t i) const {
  static constexpr double kWorldOrigin[3] = {0, 0, 0};
  return given->input.origins.empty() ? kWorldOrigin : given->input.origins.data + 3 * i;
}

FrameJob own_job(const DistributedJob& job, const OwnPart& part) {
  FrameJob out;
  out.inputs = part.inputs;
  out.rules = job.rules;
  out.policies = job.policies;
  out.margin = job.margin;
  out.min_depth = job.min_depth;
  out.containment = job.containment;
  out.report = job.report;
  return out;
}

Status make_own_part(DistributedEngine& engine, const DistributedJob& job, OwnPart& part) {
  if (job.report == Report::kInContact) return Status::kBadReport;
  part.batches.resize(engine.batches.size());
  part.first_regions.resize(engine.batches.size());
  if (const Status status = refill_slots(own_rooms(engine)); status != Status::kOk) return status;
  for (const RankInput& given : job.inputs)
    if (const Status status = take(engine, given, part); status != Status::kOk) return status;

  // A rule of a batch of which this rank has nobody still needs an input.
  for (const RankInput& given : job.inputs) {
    const std::uint32_t at = slot(given.input.batch);
    if (engine.batches[at - 1].is_static() || part.batches[at - 1].count > 0) continue;
    BatchInput& none = part.inputs.emplace_back();
    none.batch = {at};
    none.count = 0;
  }
  for (const PairRule& rule : job.rules) {
    const std::uint32_t a = slot(rule.a), b = slot(rule.b);
    if (a == 0 || b == 0 || a > engine.batches.size() || b > engine.batches.size()) return Status::kBadPairRule;
    if (rule.pairing == Pairing::kBetween && !engine.batches[a - 1].is_static() && !engine.batches[b - 1].is_static())
      part.partners.add(a, b);
  }

  // A frame that begins has been checked. It is given up, and run once the messages are on their way.
  FrameJob check = own_job(job, part);
  Hit hit;
  Contact contact;
  check.hits = {&hit, 1};
  if (job.contacts) check.contacts = {&contact, 1};
  if (const Status status = begin_frame(*engine.own, check); status != Status::kOk) return status;
  static_cast<void>(end_frame(*engine.own));

  for (std::uint32_t b = 1; b <= part.batches.size(); ++b) {
    OwnBatch& own = part.batches[b - 1];
    if (own.count == 0) continue;
    const Batch& batch = engine.batches[b - 1];
    const std::vector<LinkReach>& reaches = engine.reaches[batch.articulation.value - 1];
    own.bounds.reserve(own.count);
    for (std::uint32_t i = 0; i < own.count; ++i)
      own.bounds.push_back(reach_of(reaches, batch.link_count, own.given->input, i));
    add_regions(own, b, job.margin, part.regions);
  }
  return Status::kOk;
}

Status bound_near(DistributedEngine& engine, const DistributedJob& job, const RegionTable& table, OwnPart& part) {
  part.regions.clear();
  Status status = Status::kOk;
  for (std::uint32_t b = 1; b <= part.batches.size(); ++b) {
    OwnBatch& own = part.batches[b - 1];
    if (own.count == 0) continue;
    const std::vector<WorldBounds> others = reaching(table, engine.rank, b, part.partners);
    std::vector<std::uint32_t> near;
    for (std::uint32_t i = 0; i < own.count; ++i) {
      if (own.bounds[i].none()) continue;
      const WorldBounds world = own.world(i, job.margin);
      if (std::any_of(others.begin(), others.end(), [&](const WorldBounds& there) { return meet(world, there); }))
        near.push_back(i);
    }
    own.bounds.assign(own.count, kNoBounds);
    const auto articulation = static_cast<std::uint32_t>(engine.batches[b - 1].articulation.value);
    const Status bound = bound_characters(*engine.bounds, {articulation}, engine.slices[articulation - 1],
                                          own.given->input, near, job.policies, own.bounds);
    if (status == Status::kOk) status = bound;
    add_regions(own, b, job.margin, part.regions);
  }
  return status;
}

std::uint64_t digest_of(const DistributedJob& job) {
  Digest digest;
  digest.add(job.rules.size);
  for (const PairRule& rule : job.rules) {
    digest.add(rule.a.value);
    digest.add(rule.b.value);
    digest.add(rule.pairing);
  }
  for (std::uint32_t field = 0; field < policy_table().size; ++field) digest.add(policy_get(job.policies, field));
  digest.add(job.margin);
  digest.add(job.min_depth);
  digest.add(job.containment);
  digest.add(job.report);
  digest.add(job.contacts);
  digest.add(job.inputs.size);
  for (const RankInput& given : job.inputs) digest.add(slot(given.input.batch));
  return digest.value();
}

}  // namespace cab::mpi
