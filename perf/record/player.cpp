#include <cab/cab.h>
#include <cab/replay.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "perf/record/attempt.h"

namespace cab::record {
namespace {

// The most hits that a frame finds room for at first.
constexpr std::size_t kFirstRoom = 256;

void require(Status status, const std::string& what) {
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw Failure(what + ": " + to_string(status));
}

}  // namespace

struct Player::Storage {
  std::string path = "replay", error;
  const Recording* recording = nullptr;
  Engine* engine = nullptr;
  std::vector<ArticulationId> articulations;
  std::map<std::uint32_t, BatchId> batches;  // by index in the recording
  std::vector<std::uint32_t> slots;          // of the recording, by slot of the engine less 1
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::size_t hit_count = 0;
  bool has_contacts = false;
  FrameStats stats;

  ~Storage() { destroy_engine(engine); }
  void add_articulations();
  void use(const std::vector<std::uint32_t>& wanted);
  void run(const RecordedFrame& frame, const Policies* policies);
};

void Player::Storage::add_articulations() {
  for (std::uint32_t a = 0; a < recording->articulation_count(); ++a) {
    const RecordedArticulation entry = recording->articulation(a);
    const std::string name = "articulation " + std::to_string(a);
    ArticulationId id;
    if (entry.is_lod) {
      LodDesc lod = entry.lod;
      lod.of = articulations[static_cast<std::size_t>(lod.of.value) - 1];
      require(add_lod(*engine, lod, &id), name);
    } else {
      require(add_articulation(*engine, entry.desc, &id), name);
    }
    articulations.push_back(id);
  }
}

// Makes the batches that a frame needs, and in each slot that it leaves free the last one of the recording. They are
// added in the order of their slots, which is the order of hits.
void Player::Storage::use(const std::vector<std::uint32_t>& wanted) {
  if (std::all_of(wanted.begin(), wanted.end(), [&](std::uint32_t b) { return batches.count(b) > 0; })) return;
  for (const auto& [index, id] : batches) require(remove_batch(*engine, id), "batch " + std::to_string(index));
  batches.clear();
  slots.clear();
  std::map<std::uint32_t, std::uint32_t> by_slot;
  for (std::uint32_t b = 0; b < recording->batch_count(); ++b) by_slot[recording->batch(b).slot] = b;
  for (const std::uint32_t b : wanted) by_slot[recording->batch(b).slot] = b;
  for (const auto& [slot, index] : by_slot) {
    const RecordedBatch entry = recording->batch(index);
    const std::string name = "batch " + std::to_string(index);
    BatchId id;
    if (entry.is_static) {
      require(add_static_batch(*engine, entry.static_desc, &id), name);
    } else {
      BatchDesc desc;
      desc.articulation = articulations[entry.articulation];
      desc.instance_count = entry.instance_count;
      require(add_batch(*engine, desc, &id), name);
    }
    batches[index] = id;
    slots.push_back(slot);
  }
}

void Player::Storage::run(const RecordedFrame& frame, const Policies* policies) {
  const auto index_of = [](BatchId id) { return static_cast<std::uint32_t>(id.value) - 1; };
  std::vector<std::uint32_t> wanted;
  for (const BatchInput& input : frame.job.inputs) wanted.push_back(index_of(input.batch));
  use(wanted);
  std::vector<BatchInput> inputs(frame.job.inputs.begin(), frame.job.inputs.end());
  for (BatchInput& input : inputs) input.batch = batches.at(index_of(input.batch));
  std::vector<PairRule> rules(frame.job.rules.begin(), frame.job.rules.end());
  for (PairRule& rule : rules)
    for (BatchId* const id : {&rule.a, &rule.b}) {
      const auto found = batches.find(index_of(*id));
      if (found == batches.end()) throw Failure("a rule is about a batch that the frame does not have");
      *id = found->second;
    }
  FrameJob job = frame.job;
  job.inputs = inputs;
  job.rules = rules;
  if (policies != nullptr) job.policies = *policies;
  has_contacts = frame.has_contacts && job.policies.exact != Exact::kNone;
  hit_count = 0;
  Status status = Status::kHitsOverflow;
  std::size_t room = std::max(hits.size(), kFirstRoom);
  while (status == Status::kHitsOverflow) {
    hits.resize(room);
    contacts.resize(has_contacts ? room : 0);
    job.hits = hits;
    job.contacts = contacts;
    status = run_frame(*engine, job);
    room = job.hits_needed;
  }
  require(status, "the engine refuses the frame");
  hit_count = job.hit_count;
  stats = job.stats;
  for (std::size_t h = 0; h < hit_count; ++h)
    for (BatchSlot* const slot : {&hits[h].batch_a, &hits[h].batch_b}) slot->value = slots[slot->value - 1];
}

Player::~Player() { delete storage_; }

bool Player::open(const Recording& recording, const EngineDesc& desc) noexcept {
  delete storage_;
  storage_ = nullptr;
  return attempt(storage_, [&](Storage& to) {
    to.recording = &recording;
    require(create_engine(desc, &to.engine), "the engine");
    to.add_articulations();
  });
}

bool Player::run(const RecordedFrame& frame, const Policies* policies) noexcept {
  return attempt(storage_, [&](Storage& to) {
    if (to.engine == nullptr) throw Failure("no recording is open");
    to.run(frame, policies);
  });
}

Span<const Hit> Player::hits() const noexcept {
  return storage_ == nullptr ? Span<const Hit>() : Span<const Hit>{storage_->hits.data(), storage_->hit_count};
}

Span<const Contact> Player::contacts() const noexcept {
  if (storage_ == nullptr || !storage_->has_contacts) return {};
  return {storage_->contacts.data(), storage_->hit_count};
}

FrameStats Player::stats() const noexcept { return storage_ == nullptr ? FrameStats() : storage_->stats; }

const Engine* Player::engine() const noexcept { return storage_ == nullptr ? nullptr : storage_->engine; }

const char* Player::error() const noexcept { return error_of(storage_); }

}  // namespace cab::record
