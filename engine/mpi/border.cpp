#include "engine/mpi/border.h"

#include "engine/mpi/pose_record.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace cab::mpi {
namespace {

// How many pairs the first list has room for.
constexpr std::size_t kFirstPairs = 4096;

}  // namespace

Border::Border(DistributedEngine& engine, const DistributedJob& job, const OwnPart& own, Traffic& traffic)
    : engine_(engine),
      job_(job),
      own_(own),
      table_(engine.near),
      traffic_(traffic),
      mail_(engine.comm, engine.rank_count, engine.spare),
      exchanges_(static_cast<std::size_t>(engine.rank_count)),
      near_own_(engine.batches.size()),
      near_ghost_(engine.batches.size()) {
  ghost_begins_.reserve(static_cast<std::size_t>(engine.rank_count) + 1);
}

bool Border::receive(int from, MessageKind kind, Bytes& out) noexcept {
  const Receipt receipt = mail_.receive(from, kind, out);
  if (receipt == Receipt::kDropped) attempt([] { return Status::kOutOfMemory; });
  return receipt != Receipt::kEmpty;
}

// Both ranks know all regions, so both know who sends to whom.
bool Border::sends_to(std::int32_t to, std::int32_t from) const {
  if (to == from) return false;
  for (const Region& there : table_.of(to))
    for (const Region& here : table_.of(from))
      if (needs(own_.partners, to, there, from, here)) return true;
  return false;
}

// Per region of this rank that has somebody to send: its index, how many, and of each what its bounds are relative to,
// unless that is the region's middle, its bounds, and its layers.
void Border::compose_bounds(std::int32_t to) {
  const Span<const Region> regions = table_.of(engine_.rank);
  Bytes message;
  for (std::uint32_t r = 0; r < regions.size; ++r) {
    const Region& here = regions[r];
    std::vector<WorldBounds> reached;
    for (const Region& there : table_.of(to))
      if (needs(own_.partners, to, there, engine_.rank, here)) reached.push_back(there.bounds);
    if (reached.empty()) continue;
    const OwnBatch& batch = own_.batches[here.batch - 1];
    const BatchInput& input = batch.given->input;
    const std::optional<Point> middle = middle_of(here);
    Bytes records;
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < batch.count; ++i) {
      if (batch.bounds[i].none()) continue;
      const WorldBounds world = batch.world(i, job_.margin);
      if (size_class(world) != here.size ||
          std::none_of(reached.begin(), reached.end(), [&](const WorldBounds& there) { return meet(world, there); }))
        continue;
      if (!middle) append(records, batch.origin(i), 3);
      append(records, middle ? relative_to(middle->at, batch.origin(i), batch.bounds[i]) : batch.bounds[i]);
      if (!input.layers.empty()) append(records, input.layers[i]);
      if (!input.layer_masks.empty()) append(records, input.layer_masks[i]);
      with(to).sent.push_back({here.batch, i});
      ++count;
    }
    if (count == 0) continue;
    append(message, r);
    append(message, count);
    append(message, records.data(), records.size());
    traffic_.bounds_sent += count;
  }
  mail_.send(std::move(message), to, MessageKind::kBounds, traffic_.bounds);
}

void Border::send_bounds() noexcept {
  for (std::int32_t to = 0; to < engine_.rank_count; ++to) {
    if (!sends_to(to, engine_.rank) || attempt([&] { compose_bounds(to); })) continue;
    with(to).sent.clear();
    mail_.send_nothing(to, MessageKind::kBounds, traffic_.bounds);
  }
}

void Border::read_bounds(std::int32_t from, const Bytes& message) {
  Reader reader(message);
  while (!reader.at_end()) {
    const Region& region = table_.of(from)[reader.read<std::uint32_t>()];
    const auto count = reader.read<std::uint32_t>();
    const std::optional<Point> middle = middle_of(region);
    for (std::uint32_t i = 0; i < count; ++i) {
      const Point about = middle ? *middle : reader.read<Point>();
      Ghost ghost = {{from, region.size}, region.batch, &region, about, reader.read<RelativeBounds>(), ~0u, ~0u};
      if (region.members & kHasLayers) ghost.layers = reader.read<std::uint32_t>();
      if (region.members & kHasMasks) ghost.layer_mask = reader.read<std::uint32_t>();
      const WorldBounds world = in_world(about.at, ghost.bounds, job_.margin);
      if (i == 0)
        groups_.push_back({&region, from, world});
      else
        widen(groups_.back().bounds, world);
      near_ghost_[region.batch - 1].push_back(static_cast<std::uint32_t>(ghosts_.size()));
      ghosts_.push_back(ghost);
    }
  }
}

void Border::receive_bounds() noexcept {
  Bytes message;
  for (std::int32_t from = 0; from < engine_.rank_count; ++from) {
    ghost_begins_.push_back(ghosts_.size());
    if (!sends_to(engine_.rank, from)) continue;
    with(from).heard = receive(from, MessageKind::kBounds, message);
    attempt([&] { read_bounds(from, message); });
  }
  ghost_begins_.push_back(ghosts_.size());
}

Owner Border::owner_of(std::uint32_t batch, std::size_t index) const {
  return {engine_.rank, size_class(own_.batches[batch - 1].world(index, job_.margin))};
}

// This rank's characters that reach into the bounds of a group of ghosts against which it tests them.
void Border::choose_own() {
  for (const Region& here : table_.of(engine_.rank)) {
    std::vector<WorldBounds> reached;
    for (const GhostGroup& group : groups_)
      if (needs(own_.partners, engine_.rank, here, group.rank, *group.region)) reached.push_back(group.bounds);
    if (reached.empty()) continue;
    const OwnBatch& batch = own_.batches[here.batch - 1];
    for (std::uint32_t i = 0; i < batch.count; ++i) {
      if (batch.bounds[i].none()) continue;
      const WorldBounds world = batch.world(i, job_.margin);
      if (size_class(world) == here.size &&
          std::any_of(reached.begin(), reached.end(), [&](const WorldBounds& there) { return meet(world, there); }))
        near_own_[here.batch - 1].push_back(i);
    }
  }
}

std::uint32_t Border::members_of_batch(std::uint32_t batch) const {
  for (const Region& region : table_.regions)
    if (region.batch == batch) return region.members;
  return 0;
}

// The rules between characters of batches that have somebody near the border.
std::vector<PairRule> Border::rules() const {
  const auto takes_part = [&](BatchId id) {
    const std::uint32_t b = slot_of(id).value - 1;
    return !engine_.batches[b].is_static() && !(near_own_[b].empty() && near_ghost_[b].empty());
  };
  std::vector<PairRule> out;
  for (const PairRule& rule : job_.rules)
    if (rule.pairing == Pairing::kBetween && takes_part(rule.a) && takes_part(rule.b))
      out.push_back({{slot_of(rule.a).value}, {slot_of(rule.b).value}, Pairing::kBetween, Resting::kReported});
  return out;
}

void Border::find_pairs() noexcept {
  attempt([&] { return choose_pairs(); });
}

Status Border::choose_pairs() {
  choose_own();
  if (const Status status = refill_slots(border_rooms(engine_)); status != Status::kOk) return status;

  // This rank's characters of a batch come first, then the ghosts, each where its bounds are relative to.
  std::vector<GatheredInput> gathered(engine_.batches.size());
  std::vector<std::vector<float>> bounds(engine_.batches.size());
  std::vector<BatchInput> inputs;
  for (std::uint32_t b = 0; b < engine_.batches.size(); ++b) {
    const std::size_t count = near_own_[b].size() + near_ghost_[b].size();
    if (count == 0) continue;
    const std::uint32_t members = members_of_batch(b + 1);
    GatheredInput& places = gathered[b];
    const auto add = [&](const double* about, const RelativeBounds& relative, std::uint32_t layers,
                         std::uint32_t layer_mask) {
      const RelativeBounds scaled = scaled_for_search(relative);
      for (std::size_t c = 0; c < 3; ++c) places.origins.push_back(double{kSearchScale} * about[c]);
      bounds[b].insert(bounds[b].end(), scaled.lo, scaled.lo + 3);
      bounds[b].insert(bounds[b].end(), scaled.hi, scaled.hi + 3);
      if (members & kHasLayers) places.layers.push_back(layers);
      if (members & kHasMasks) places.layer_masks.push_back(layer_mask);
    };
    for (const std::uint32_t i : near_own_[b]) {
      const OwnBatch& own = own_.batches[b];
      const BatchInput& input = own.given->input;
      add(own.origin(i), own.bounds[i], input.layers.empty() ? ~0u : input.layers[i],
          input.layer_masks.empty() ? ~0u : input.layer_masks[i]);
    }
    for (const std::uint32_t g : near_ghost_[b]) {
      const Ghost& ghost = ghosts_[g];
      add(ghost.about.at, ghost.bounds, ghost.layers, ghost.layer_mask);
    }
    const auto needed = static_cast<std::uint32_t>(std::min<std::size_t>(count, ~0u));
    if (const Status status = make_room(border_rooms(engine_), b + 1, needed); status != Status::kOk) return status;
    BatchInput input = places.input({b + 1}, 0, needed);
    input.bounds = bounds[b];
    inputs.push_back(input);
  }
  const std::vector<PairRule> between = rules();
  FrameJob job;
  job.inputs = inputs;
  job.rules = between;
  job.margin = kSearchScale * job_.margin;
  std::vector<InstancePair> pairs(kFirstPairs);
  CandidateList list;
  list.pairs = pairs;
  Status status = find_candidates(*engine_.border, job, list);
  if (status == Status::kPairsOverflow) {
    pairs.resize(list.pairs_needed);
    list.pairs = pairs;
    status = find_candidates(*engine_.border, job, list);
  }
  if (status != Status::kOk) return status;

  std::vector<std::vector<bool>> meets(engine_.batches.size());
  for (std::size_t b = 0; b < meets.size(); ++b) meets[b].resize(near_own_[b].size());
  for (std::size_t p = 0; p < list.pair_count; ++p) {
    std::uint32_t own_batch = pairs[p].batch_a.value, own = pairs[p].instance_a;
    std::uint32_t other_batch = pairs[p].batch_b.value, other = pairs[p].instance_b;
    if (own >= near_own_[own_batch - 1].size()) {
      std::swap(own_batch, other_batch);
      std::swap(own, other);
    }
    const std::size_t own_count = near_own_[own_batch - 1].size(), first_ghost = near_own_[other_batch - 1].size();
    if (own >= own_count || other < first_ghost) continue;  // two of one sort
    Ghost& ghost = ghosts_[near_ghost_[other_batch - 1][other - first_ghost]];
    if (!tests(owner_of(own_batch, near_own_[own_batch - 1][own]), ghost.owner)) continue;
    meets[own_batch - 1][own] = true;
    ghost.wanted = true;
  }
  for (std::size_t b = 0; b < meets.size(); ++b) {
    std::vector<std::uint32_t> kept;
    for (std::size_t i = 0; i < meets[b].size(); ++i)
      if (meets[b][i]) kept.push_back(near_own_[b][i]);
    near_own_[b] = std::move(kept);
  }
  return Status::kOk;
}

// For each ghost that is wanted its place among those of its rank.
void Border::send_requests() noexcept {
  for (std::int32_t from = 0; from < engine_.rank_count; ++from) {
    Exchange& exchange = with(from);
    if (!exchange.heard) continue;
    const bool sent = attempt([&] {
      const std::size_t begin = ghost_begins_[static_cast<std::size_t>(from)];
      const std::size_t end = ghost_begins_[static_cast<std::size_t>(from) + 1];
      Bytes message;
      for (std::size_t g = begin; g < end; ++g)
        if (ghosts_[g].wanted) append(message, static_cast<std::uint32_t>(g - begin));
      const bool asks = !message.empty();
      mail_.send(std::move(message), from, MessageKind::kRequest, traffic_.requests);
      exchange.asked = asks;
    });
    if (!sent) mail_.send_nothing(from, MessageKind::kRequest, traffic_.requests);
  }
}

// For each character its number and its part of the input.
void Border::answer_requests() noexcept {
  Bytes request;
  for (std::int32_t to = 0; to < engine_.rank_count; ++to) {
    const std::vector<Sent>& sent = with(to).sent;
    if (sent.empty() || !receive(to, MessageKind::kRequest, request)) continue;
    const bool answered = attempt([&] {
      Reader reader(request);
      Bytes message;
      while (!reader.at_end()) {
        const Sent& asked = sent[reader.read<std::uint32_t>()];
        const RankInput& given = *own_.batches[asked.batch - 1].given;
        append(message, given.numbers[asked.index]);
        append_record(message, given.input, asked.index, engine_.batches[asked.batch - 1].link_count);
        ++traffic_.poses_sent;
      }
      mail_.send(std::move(message), to, MessageKind::kPoses, traffic_.poses);
    });
    if (!answered) mail_.send_nothing(to, MessageKind::kPoses, traffic_.poses);
  }
}

void Border::receive_poses() noexcept {
  for (std::int32_t from = 0; from < engine_.rank_count; ++from)
    // An empty answer is that of a rank without memory, which tells so at the end of the frame.
    if (with(from).asked && !receive(from, MessageKind::kPoses, with(from).poses)) is_complete_ = false;
}

}  // namespace cab::mpi
