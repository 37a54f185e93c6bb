#include <cab/cab.h>
#include <cab/replay.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "engine/record/attempt.h"

namespace cab::record {
namespace {

// The most hits that a frame finds room for at first.
constexpr std::size_t kFirstRoom = 256;

void require(Status status, const std::string& what) {
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw Failure(what + ": " + to_string(status));
}

// A batch of the engine, with room for as many instances as frames have had so far.
struct Loaded {
  BatchId id;
  std::uint32_t room = 0;
};

// Of a batch that a recording names.
std::uint32_t index_of(BatchId id) { return static_cast<std::uint32_t>(id.value) - 1; }

}  // namespace

struct Player::Storage {
  std::string path = "replay", error;
  const Recording* recording = nullptr;
  Engine* engine = nullptr;
  std::vector<ArticulationId> articulations;
  std::map<std::uint32_t, Loaded> batches;  // by index in the recording
  std::vector<std::uint32_t> slots;         // of the recording, by slot of the engine less 1
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::size_t hit_count = 0;
  bool has_contacts = false;
  FrameStats stats;

  ~Storage() { destroy_engine(engine); }
  void add_articulations();
  void use(Span<const BatchInput> inputs);
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

// Makes the batches that a frame needs, if they are not there, and keeps those of other slots. They are added in the
// order of their slots, which is the order of hits.
void Player::Storage::use(Span<const BatchInput> inputs) {
  const auto has_room = [&](const BatchInput& input) {
    const auto found = batches.find(index_of(input.batch));
    return found != batches.end() && found->second.room >= input.count;
  };
  if (std::all_of(inputs.begin(), inputs.end(), has_room)) return;
  struct Wanted {
    std::uint32_t index = 0, room = 0;
  };
  std::map<std::uint32_t, Wanted> by_slot;
  for (const auto& [index, loaded] : batches) {
    by_slot[recording->batch(index).slot] = {index, loaded.room};
    require(remove_batch(*engine, loaded.id), "batch " + std::to_string(index));
  }
  batches.clear();
  slots.clear();
  for (const BatchInput& input : inputs) {
    Wanted& wanted = by_slot[recording->batch(index_of(input.batch)).slot];
    const std::uint32_t before = wanted.index == index_of(input.batch) ? wanted.room : 0;
    wanted = {index_of(input.batch), std::max({before, input.count, 1u})};
  }
  for (const auto& [slot, wanted] : by_slot) {
    const RecordedBatch entry = recording->batch(wanted.index);
    const std::string name = "batch " + std::to_string(wanted.index);
    Loaded loaded = {{}, wanted.room};
    if (entry.is_static) {
      require(add_static_batch(*engine, entry.static_desc, &loaded.id), name);
      loaded.room = entry.instance_count;
    } else {
      BatchDesc desc;
      desc.articulation = articulations[entry.articulation];
      desc.instance_count = wanted.room;
      require(add_batch(*engine, desc, &loaded.id), name);
    }
    batches[wanted.index] = loaded;
    slots.push_back(slot);
  }
}

void Player::Storage::run(const RecordedFrame& frame, const Policies* policies) {
  use(frame.job.inputs);
  std::vector<BatchInput> inputs(frame.job.inputs.begin(), frame.job.inputs.end());
  for (BatchInput& input : inputs) input.batch = batches.at(index_of(input.batch)).id;
  std::vector<PairRule> rules(frame.job.rules.begin(), frame.job.rules.end());
  for (PairRule& rule : rules)
    for (BatchId* const id : {&rule.a, &rule.b}) {
      const auto found = batches.find(index_of(*id));
      if (found == batches.end()) throw Failure("a rule is about a batch that the frame does not have");
      *id = found->second.id;
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
