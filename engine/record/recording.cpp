#include <cab/policy.h>
#include <cab/replay.h>

#include <recording_generated.h>
#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/record/attempt.h"
#include "engine/record/budget.h"
#include "engine/record/chunk.h"
#include "engine/record/definitions.h"
#include "engine/record/file_bytes.h"
#include "engine/record/rounded_poses.h"
#include "engine/record/scan.h"
#include "engine/record/words.h"
#include "layout/pose_coding.h"

namespace cab::record {
namespace {

namespace fb = flatbuffers;

[[noreturn]] void refuse(const std::string& reason) { throw Failure(reason); }

// The numbers of a list where they lie. FlatBuffers' verifier does not look at how they are aligned.
template <class T>
Span<const T> span_of(const fb::Vector<T>* vector) {
  if (vector == nullptr || vector->size() == 0) return {};
  if (reinterpret_cast<std::uintptr_t>(vector->Data()) % alignof(T) != 0) refuse("a list is not aligned");
  return {reinterpret_cast<const T*>(vector->Data()), vector->size()};
}

const char* text_of(const fb::String* text) { return text == nullptr ? "" : text->c_str(); }

// The name of a policy for a reason. What no such name has is '?', and a long one is cut off.
constexpr std::size_t kShownCharacters = 40;
std::string shown(const char* name) {
  std::string out;
  for (; *name != '\0' && out.size() < kShownCharacters; ++name) {
    const bool is_known = (*name >= 'a' && *name <= 'z') || (*name >= '0' && *name <= '9') || *name == '_';
    out += is_known ? *name : '?';
  }
  return *name == '\0' ? out : out + "...";
}

// Whether a span is empty, or has `each` values for each of `count` instances.
template <class T>
bool fits(Span<const T> span, std::size_t count, std::size_t each) {
  return span.empty() || span.size == count * each;
}

// The tables that say what a batch was given, some of them in an earlier frame of the chunk.
struct Source {
  const format::Input* arrays = nullptr;
  const format::Poses* poses = nullptr;
};

// One chunk, decoded, and where each of its frames takes what from.
struct DecodedChunk {
  std::size_t index = 0;
  std::vector<std::uint8_t> stored, plain;  // the payload as it is in a file, and decompressed
  const format::Chunk* table = nullptr;
  std::vector<std::vector<Source>> sources;  // by frame, then by input
};

}  // namespace

struct Recording::Storage {
  std::string path, error;
  FileBytes bytes;
  Scan scan;
  std::vector<const char*> problem_texts;

  std::string library, title, isa;
  RecordingInfo info;
  std::vector<std::unique_ptr<ReadArticulation>> articulations;
  std::vector<std::unique_ptr<ReadBatch>> batches;

  std::optional<DecodedChunk> decoded;
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;
  std::vector<std::vector<float>> poses;  // of the frame at hand, where they are rounded
  std::vector<std::uint32_t> masked;
  std::uint64_t rounded = 0;  // numbers of poses of the frame at hand that were rounded

  void read_all();
  void read_header(const format::Header* header);
  const std::uint8_t* read_payload(const ChunkPlace& chunk, std::vector<std::uint8_t>& to);
  void read_definitions(const format::Chunk& chunk, std::uint64_t payload_bytes);
  const format::Chunk& decode_chunk(std::size_t index, DecodedChunk& to);
  void find_sources(DecodedChunk& chunk) const;
  void read_input(const format::Input& input, const Source& source, std::size_t place);
  void read_settings(const format::Settings& settings, RecordedFrame& frame);
  void check_hits(Span<const Hit> hits) const;
  std::size_t chunk_of(std::uint32_t index) const;
  void read(std::uint32_t index, RecordedFrame& frame);
};

// The payload of a chunk as it is stored. That of a file is copied and checked: the file may have changed since.
const std::uint8_t* Recording::Storage::read_payload(const ChunkPlace& chunk, std::vector<std::uint8_t>& to) {
  const std::uint64_t at = chunk.at + kChunkHeaderBytes;
  const auto size = static_cast<std::size_t>(chunk.header.stored_bytes);
  // FlatBuffers are read where they lie, which must be at a multiple of 8.
  if (bytes.is_memory()) {
    const std::uint8_t* const lies = bytes.from(at, size).data;
    if (chunk.header.codec != Codec::kStored || reinterpret_cast<std::uintptr_t>(lies) % 8 == 0) return lies;
  }
  to.resize(size);
  bytes.copy(at, size, to.data());
  if (crc32(to.data(), size) != chunk.header.payload_crc) refuse("the file has changed since it was opened");
  return to.data();
}

const format::Chunk& Recording::Storage::decode_chunk(std::size_t index, DecodedChunk& to) {
  const ChunkPlace& chunk = scan.chunks[index];
  if (!chunk.damage.empty()) refuse(chunk.damage);
  const std::uint8_t* payload = read_payload(chunk, to.stored);
  if (chunk.header.codec == Codec::kZstd) {
    std::string reason;
    if (!decode(chunk.header, payload, to.plain, reason)) refuse(reason);
    payload = to.plain.data();
  }
  // A table has 4 bytes at least, but frames share their settings.
  constexpr fb::uoffset_t kMaxDepth = 16;
  fb::Verifier verifier(payload, static_cast<std::size_t>(chunk.header.plain_bytes), kMaxDepth,
                        static_cast<fb::uoffset_t>(chunk.header.plain_bytes / 4));
  if (!format::VerifySizePrefixedChunkBuffer(verifier)) refuse("its payload is no chunk of a recording");
  to.index = index;
  to.table = format::GetSizePrefixedChunk(payload);
  const auto* const frames = to.table->frames();
  if ((frames == nullptr ? 0 : frames->size()) != chunk.header.frame_count)
    refuse("it has another number of frames than its header says");
  return *to.table;
}

void Recording::Storage::read_header(const format::Header* header) {
  if (header == nullptr) refuse("it has no header");
  library = text_of(header->library());
  title = text_of(header->title());
  isa = text_of(header->isa());
  info = {library.c_str(),
          title.c_str(),
          header->seconds_per_frame(),
          header->metres_per_unit(),
          static_cast<char>(header->up()),
          isa.c_str(),
          header->threads(),
          header->pose_step()};
  if (!is_step(info.pose_step)) refuse("its pose_step is no power of two");
  const auto is_length = [](double number) { return number >= 0 && number <= std::numeric_limits<double>::max(); };
  if (!is_length(info.seconds_per_frame) || !is_length(info.metres_per_unit)) refuse("its header has no numbers");
  if (info.up != 0 && (info.up < 'x' || info.up > 'z')) refuse("its up is not x, y or z");
}

void Recording::Storage::read_definitions(const format::Chunk& chunk, std::uint64_t payload_bytes) {
  std::uint64_t expanded = 0;
  const auto spend = [&](std::uint64_t more) {
    expanded += more;
    if (expanded > most_expanded_bytes(payload_bytes)) refuse("its definitions name the same lists too often");
  };
  if (chunk.articulations() != nullptr)
    for (const format::Articulation* const table : *chunk.articulations()) {
      spend(expanded_bytes(*table));
      auto entry = std::make_unique<ReadArticulation>();
      const std::string wrong = entry->read(*table, articulations);
      if (!wrong.empty()) refuse("articulation " + std::to_string(articulations.size()) + ": " + wrong);
      articulations.push_back(std::move(entry));
    }
  if (chunk.batches() != nullptr)
    for (const format::Batch* const table : *chunk.batches()) {
      spend(expanded_bytes(*table));
      auto entry = std::make_unique<ReadBatch>();
      const std::string wrong = entry->read(*table, articulations);
      if (!wrong.empty()) refuse("batch " + std::to_string(batches.size()) + ": " + wrong);
      batches.push_back(std::move(entry));
    }
}

// Definitions are read at once. Behind definitions that cannot be read no others are.
void Recording::Storage::read_all() {
  const auto header_bytes = static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), kFileHeaderBytes));
  if (const std::string wrong = check_file_header(bytes.from(0, header_bytes).data, header_bytes); !wrong.empty())
    refuse(wrong);
  scan = scan_chunks(bytes);
  if (scan.chunks.empty())
    refuse(scan.problems.empty() ? "it has no chunk" : "it has no whole chunk: " + scan.problems.front());
  bool is_lost = false;
  const auto lose = [&](ChunkPlace& place, const std::string& why) {
    place.damage = why;
    scan.is_damaged = is_lost = true;
    scan.problems.push_back("the chunk at byte " + std::to_string(place.at) + " " + frames_in_words(place.header) +
                            " has definitions that cannot be read: " + why);
  };
  for (std::size_t c = 0; c < scan.chunks.size(); ++c) {
    ChunkPlace& place = scan.chunks[c];
    if (c == 0 && (place.at != kFileHeaderBytes || !place.header.has_definitions))
      refuse("its first chunk, which has its header, is damaged");
    if (!place.header.has_definitions || (c > 0 && !place.damage.empty())) continue;
    if (is_lost) {
      lose(place, "definitions before it are lost");
      continue;
    }
    try {
      DecodedChunk decoded_chunk;
      const format::Chunk& chunk = decode_chunk(c, decoded_chunk);
      if (c == 0) read_header(chunk.header());
      read_definitions(chunk, place.header.plain_bytes);
    } catch (const Failure& failure) {
      if (c == 0) refuse("its first chunk cannot be read: " + std::string(failure.what()));
      lose(place, failure.what());
    }
  }
  for (const std::string& problem : scan.problems) problem_texts.push_back(problem.c_str());
}

// Follows each batch through the frames of a chunk.
void Recording::Storage::find_sources(DecodedChunk& chunk) const {
  std::map<std::uint32_t, Source> last;
  for (const format::Frame* const frame : *chunk.table->frames()) {
    std::vector<Source>& sources = chunk.sources.emplace_back();
    if (frame->settings() == nullptr) refuse("a frame has no settings");
    if (frame->inputs() == nullptr) continue;
    std::set<std::uint32_t> seen;
    for (const format::Input* const input : *frame->inputs()) {
      if (!seen.insert(input->batch()).second)
        refuse("a frame has two inputs of batch " + std::to_string(input->batch()));
      if (input->batch() >= batches.size())
        refuse("a frame has an input of batch " + std::to_string(input->batch()) + ", which is not defined");
      Source& source = last[input->batch()];
      if (!input->same_as_before()) {
        source.arrays = input;
        if (input->poses() != nullptr) source.poses = input->poses();
      } else if (source.arrays == nullptr) {
        refuse("an input is that of an earlier frame of its chunk, and there is none");
      }
      if (source.poses == nullptr && !batches[input->batch()]->view().is_static) refuse("a frame has no poses");
      sources.push_back(source);
    }
  }
}

void Recording::Storage::read_input(const format::Input& table, const Source& source, std::size_t place) {
  const RecordedBatch& batch = batches[table.batch()]->view();
  const format::Input& arrays = *source.arrays;
  BatchInput input;
  input.batch = {std::uint64_t{table.batch()} + 1};
  input.count = std::min(arrays.count(), batch.instance_count);
  const std::size_t count = input.count;
  input.layers = span_of(arrays.layers());
  input.layer_masks = span_of(arrays.layer_masks());
  input.instances = span_of(arrays.instances());
  bool is_sound = fits(input.layers, count, 1) && fits(input.layer_masks, count, 1);
  for (std::size_t k = 0; k < input.instances.size; ++k)
    is_sound = is_sound && input.instances[k] < count && (k == 0 || input.instances[k] > input.instances[k - 1]);
  if (!batch.is_static) {
    const format::Poses& from = *source.poses;
    if (from.format() > static_cast<std::uint8_t>(PoseFormat::kMatrix4x4Columns)) refuse("poses have no known format");
    input.poses.format = static_cast<PoseFormat>(from.format());
    input.poses.has_scale = from.has_scale();
    Span<const float> values = span_of(from.values());
    if (info.pose_step > 0) {
      rounded += span_of(from.rounded()).size;
      if (rounded > scan.chunks[decoded->index].header.plain_bytes) refuse("inputs share their poses");
      from_steps(span_of(from.rounded()), info.pose_step, poses[place]);
      values = poses[place];
    }
    const std::uint64_t links = articulations[batch.articulation]->view().link_count;
    if (values.size != count * links * pose_floats(input.poses.format))
      refuse("poses of batch " + std::to_string(table.batch()) + " are of another number of links or instances");
    input.poses.data = values.data;
    input.origins = span_of(arrays.origins());
    input.orientations = span_of(arrays.orientations());
    input.scales = span_of(arrays.scales());
    input.margins = span_of(arrays.margins());
    is_sound = is_sound && fits(input.origins, count, 3) && fits(input.orientations, count, 4) &&
               fits(input.scales, count, 1) && fits(input.margins, count, 1);
  }
  if (!is_sound) refuse("arrays of batch " + std::to_string(table.batch()) + " are of another number of instances");
  inputs[place] = input;
  for (const std::uint32_t instance : span_of(table.masked())) {
    if (instance >= count)
      refuse("an instance is masked that batch " + std::to_string(table.batch()) + " does not have");
    masked.push_back(table.batch());
    masked.push_back(instance);
  }
}

void Recording::Storage::read_settings(const format::Settings& settings, RecordedFrame& frame) {
  FrameJob& job = frame.job;
  const Span<const PolicyField> fields = policy_table();
  if (settings.policies() != nullptr)
    for (const format::PolicyChoice* const choice : *settings.policies()) {
      const char *const name = text_of(choice->field()), *const value = text_of(choice->value());
      if (std::strcmp(name, "depth") == 0) continue;  // a policy of older recordings, which changed depths alone
      std::uint32_t field = 0;
      while (field < fields.size && std::strcmp(fields[field].name, name) != 0) ++field;
      if (!policy_set(job.policies, field, value))
        refuse("a frame has " + shown(name) + " = '" + shown(value) + "', which this library does not know");
    }
  job.margin = settings.margin();
  job.min_depth = settings.min_depth();
  job.containment = !settings.without_containment();
  if (settings.report() != static_cast<std::uint8_t>(Report::kHits) &&
      settings.report() != static_cast<std::uint8_t>(Report::kDistances))
    refuse("a frame reports something unknown");
  job.report = static_cast<Report>(settings.report());
  frame.has_contacts = settings.contacts();
  if (settings.rules() == nullptr) return;
  for (const format::Rule* const rule : *settings.rules()) {
    if (rule->a() >= batches.size() || rule->b() >= batches.size())
      refuse("a rule is about a batch without definition");
    if (rule->pairing() > static_cast<std::uint32_t>(Pairing::kWithin)) refuse("a rule pairs in an unknown way");
    PairRule entry;
    entry.a = {std::uint64_t{rule->a()} + 1};
    entry.b = {std::uint64_t{rule->b()} + 1};
    entry.pairing = static_cast<Pairing>(rule->pairing());
    rules.push_back(entry);
  }
}

// Whoever looks hits up finds what they name.
void Recording::Storage::check_hits(Span<const Hit> hits) const {
  struct Named {
    std::uint32_t instances = 0, links = 0;
  };
  std::map<std::uint32_t, Named> by_slot;
  for (const BatchInput& input : inputs) {
    const RecordedBatch& batch = batches[static_cast<std::size_t>(input.batch.value) - 1]->view();
    by_slot[batch.slot] = {input.count, batch.is_static ? 1 : articulations[batch.articulation]->view().link_count};
  }
  const auto check = [&](BatchSlot slot, std::uint32_t instance, std::uint32_t link) {
    const auto found = by_slot.find(slot.value);
    if (found == by_slot.end() || instance >= found->second.instances || link >= found->second.links)
      refuse("a hit names what the frame does not have");
  };
  for (const Hit& hit : hits) {
    check(hit.batch_a, hit.instance_a, hit.link_a);
    check(hit.batch_b, hit.instance_b, hit.link_b);
  }
}

// The chunk of a frame below the count, or the place of frames that are lost.
std::size_t Recording::Storage::chunk_of(std::uint32_t index) const {
  // Chunks without frames begin where the next one does, so the last chunk that begins at or before a frame has it.
  const auto after = std::upper_bound(
      scan.chunks.begin(), scan.chunks.end(), index,
      [](std::uint32_t frame_index, const ChunkPlace& chunk) { return frame_index < chunk.header.first_frame; });
  return static_cast<std::size_t>(after - scan.chunks.begin()) - 1;
}

void Recording::Storage::read(std::uint32_t index, RecordedFrame& frame) {
  if (index >= scan.frame_count)
    refuse("there is no frame " + std::to_string(index) + " among " + std::to_string(scan.frame_count));
  const std::size_t c = chunk_of(index);
  ChunkPlace& place = scan.chunks[c];
  try {
    if (!decoded || decoded->index != c) {
      decoded.reset();
      try {
        DecodedChunk chunk;
        decode_chunk(c, chunk);
        find_sources(chunk);
        decoded = std::move(chunk);
      } catch (const Failure& failure) {
        place.damage = failure.what();  // so that none of its frames is tried again
        throw;
      }
    }
    const std::uint32_t in_chunk = index - place.header.first_frame;
    const format::Frame& table = *decoded->table->frames()->Get(in_chunk);
    const std::vector<Source>& sources = decoded->sources[in_chunk];
    frame = {};
    frame.time = table.time();
    inputs.assign(sources.size(), {});
    poses.resize(std::max(poses.size(), sources.size()));
    rules.clear();
    masked.clear();
    rounded = 0;
    for (std::size_t k = 0; k < sources.size(); ++k)
      read_input(*table.inputs()->Get(static_cast<fb::uoffset_t>(k)), sources[k], k);
    read_settings(*table.settings(), frame);
    frame.job.inputs = inputs;
    frame.job.rules = rules;
    frame.masked = masked;
    const Span<const std::uint32_t> hits = span_of(table.hits()), contacts = span_of(table.contacts());
    if (hits.size % kHitWords != 0) refuse("hits are incomplete");
    frame.hits = {reinterpret_cast<const Hit*>(hits.data), hits.size / kHitWords};
    check_hits(frame.hits);
    if (!contacts.empty() && contacts.size != frame.hits.size * kContactWords) refuse("contacts are not one per hit");
    frame.contacts = {reinterpret_cast<const Contact*>(contacts.data), contacts.size / kContactWords};
    frame.job.hit_count = frame.hits.size;
    frame.hash = table.hash();
    if (const format::Stats* const stats = table.stats(); stats != nullptr) {
      frame.stats.candidates = stats->candidates();
      frame.stats.box_tests = stats->box_tests();
      frame.stats.leaf_pairs = stats->leaf_pairs();
      frame.stats.exact_tests = stats->exact_tests();
      frame.stats.false_positives = stats->false_positives();
      frame.stats.instances_masked = stats->instances_masked();
      frame.stats.seconds_total = stats->seconds_total();
    }
  } catch (const Failure& failure) {
    refuse("frame " + std::to_string(index) + " of the chunk at byte " + std::to_string(place.at) + ": " +
           failure.what());
  }
}

// -------------------------------------------------------------------------------------------------------------- calls

Recording::~Recording() { delete storage_; }

bool Recording::open(const char* path) noexcept {
  delete storage_;
  storage_ = nullptr;
  return attempt(storage_, [&](Storage& to) {
    to.path = path == nullptr ? "" : path;
    to.bytes.open(to.path);
    to.read_all();
  });
}

bool Recording::open_bytes(Span<const std::uint8_t> bytes, const char* name) noexcept {
  delete storage_;
  storage_ = nullptr;
  return attempt(storage_, [&](Storage& to) {
    to.path = name == nullptr ? "" : name;
    to.bytes.open(bytes);
    to.read_all();
  });
}

const char* Recording::error() const noexcept { return error_of(storage_); }

Span<const char* const> Recording::problems() const noexcept {
  return storage_ == nullptr ? Span<const char* const>() : Span<const char* const>(storage_->problem_texts);
}

bool Recording::is_damaged() const noexcept { return storage_ != nullptr && storage_->scan.is_damaged; }

bool Recording::is_closed() const noexcept { return storage_ != nullptr && storage_->scan.is_closed; }

std::uint64_t Recording::whole_bytes() const noexcept { return storage_ == nullptr ? 0 : storage_->scan.whole; }

RecordingInfo Recording::info() const noexcept { return storage_ == nullptr ? RecordingInfo() : storage_->info; }

std::uint32_t Recording::articulation_count() const noexcept {
  return storage_ == nullptr ? 0 : static_cast<std::uint32_t>(storage_->articulations.size());
}

std::uint32_t Recording::batch_count() const noexcept {
  return storage_ == nullptr ? 0 : static_cast<std::uint32_t>(storage_->batches.size());
}

std::uint32_t Recording::frame_count() const noexcept { return storage_ == nullptr ? 0 : storage_->scan.frame_count; }

RecordedArticulation Recording::articulation(std::uint32_t index) const noexcept {
  return storage_->articulations[index]->view();
}

RecordedBatch Recording::batch(std::uint32_t index) const noexcept { return storage_->batches[index]->view(); }

bool Recording::read_frame(std::uint32_t index, RecordedFrame* frame) noexcept {
  return attempt(storage_, [&](Storage& to) {
    if (frame == nullptr) refuse("read_frame needs a place for the frame");
    to.read(index, *frame);
  });
}

std::uint32_t Recording::next_frame(std::uint32_t index) const noexcept {
  if (index >= frame_count()) return frame_count();
  const ChunkPlace& place = storage_->scan.chunks[storage_->chunk_of(index)];
  return place.damage.empty() ? index + 1 : place.header.first_frame + place.header.frame_count;
}

}  // namespace cab::record
