#include <cab/cab.h>
#include <cab/replay.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "engine/record/attempt.h"

namespace cab::record {
namespace {

// The most hits, and triangles, that a frame finds room for at first.
constexpr std::size_t kFirstRoom = 256;

// The most pairs of triangles that there is room for: 256 MiB. Each of a file's few triangles may touch each other.
constexpr std::size_t kMostTriangles = std::size_t{1} << 24;

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
  std::vector<std::uint32_t> slots;         // of the recording, by slot of the engine less 1: ascending
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::size_t hit_count = 0;
  bool has_contacts = false;
  std::vector<Hit> pairs;  // with the engine's slots
  std::vector<TouchingTriangles> triangles;
  std::size_t triangle_count = 0;
  FrameStats stats;

  ~Storage() { destroy_engine(engine); }
  void add_articulations();
  void make_batches(Span<const BatchInput> inputs);
  std::vector<BatchInput> use(Span<const BatchInput> inputs);
  void run(const RecordedFrame& frame, const Policies* policies);
  void find_triangles(const RecordedFrame& frame, Span<const Hit> of);
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

// The inputs of a frame, of batches of the engine.
std::vector<BatchInput> Player::Storage::use(Span<const BatchInput> inputs) {
  make_batches(inputs);
  std::vector<BatchInput> used(inputs.begin(), inputs.end());
  for (BatchInput& input : used) input.batch = batches.at(index_of(input.batch)).id;
  return used;
}

// Makes the batches that a frame needs, if they are not there, and keeps those of other slots. They are added in the
// order of their slots, which is the order of hits.
void Player::Storage::make_batches(Span<const BatchInput> inputs) {
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
  const std::vector<BatchInput> inputs = use(frame.job.inputs);
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

void Player::Storage::find_triangles(const RecordedFrame& frame, Span<const Hit> of) {
  triangle_count = 0;
  const std::vector<BatchInput> inputs = use(frame.job.inputs);
  pairs.assign(of.begin(), of.end());
  for (Hit& pair : pairs)
    for (BatchSlot* const slot : {&pair.batch_a, &pair.batch_b}) {
      const auto found = std::lower_bound(slots.begin(), slots.end(), slot->value);
      if (found == slots.end() || *found != slot->value)
        throw Failure("a hit is of a batch that the frame does not have");
      slot->value = static_cast<std::uint32_t>(found - slots.begin()) + 1;
    }
  std::size_t needed = std::max(triangles.size(), kFirstRoom);
  Status status = Status::kHitsOverflow;
  while (status == Status::kHitsOverflow) {
    if (needed > kMostTriangles)
      throw Failure(std::to_string(needed) + " pairs of triangles touch, and " + std::to_string(kMostTriangles) +
                    " are the most");
    triangles.resize(needed);
    status = find_touching_triangles(*engine, inputs, pairs, triangles, &needed);
  }
  require(status, "the engine refuses the hits");
  triangle_count = needed;
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

bool Player::find_triangles(const RecordedFrame& frame, Span<const Hit> pairs) noexcept {
  return attempt(storage_, [&](Storage& to) {
    if (to.engine == nullptr) throw Failure("no recording is open");
    to.find_triangles(frame, pairs);
  });
}

Span<const TouchingTriangles> Player::triangles() const noexcept {
  if (storage_ == nullptr) return {};
  return {storage_->triangles.data(), storage_->triangle_count};
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
