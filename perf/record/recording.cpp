#include <cab/policy.h>
#include <cab/replay.h>

#include <recording_generated.h>
#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "perf/record/attempt.h"
#include "perf/record/chunk.h"
#include "perf/record/definitions.h"
#include "perf/record/mapped_file.h"
#include "perf/record/rounded_poses.h"
#include "perf/record/words.h"

namespace cab::record {
namespace {

namespace fb = flatbuffers;

// Where a chunk is, and what its header says.
struct ChunkPlace {
  ChunkHeader header;
  std::uint64_t at = 0;  // of the header
  std::string damage;    // why its frames cannot be read; empty if they can
};

std::string frames_of(const ChunkHeader& header) {
  if (header.frame_count == 0) return "without frames";
  if (header.frame_count == 1) return "with frame " + std::to_string(header.first_frame);
  return "with frames " + std::to_string(header.first_frame) + " to " +
         std::to_string(std::uint64_t{header.first_frame} + header.frame_count - 1);
}

template <class T>
Span<const T> span_of(const fb::Vector<T>* vector) {
  return vector == nullptr ? Span<const T>() : Span<const T>{vector->data(), vector->size()};
}

const char* text_of(const fb::String* text) { return text == nullptr ? "" : text->c_str(); }

// Whether a span is empty, or has `each` values for each of `count` instances.
template <class T>
bool fits(Span<const T> span, std::size_t count, std::size_t each) {
  return span.empty() || span.size == count * each;
}

[[noreturn]] void refuse(const std::string& reason) { throw Failure(reason); }

// The tables that say what a batch was given, some of them in an earlier frame of the chunk.
struct Source {
  const format::Input* arrays = nullptr;
  const format::Poses* poses = nullptr;
};

// One chunk, decoded, and where each of its frames takes what from.
struct DecodedChunk {
  std::size_t index = 0;
  std::vector<std::uint8_t> plain;  // of a compressed chunk
  const format::Chunk* table = nullptr;
  std::vector<std::vector<Source>> sources;  // by frame, then by input
};

}  // namespace

struct Recording::Storage {
  std::string path, error;
  MappedFile file;
  Span<const std::uint8_t> bytes;
  std::uint64_t whole = 0;
  std::vector<ChunkPlace> chunks;
  std::vector<std::uint32_t> first_frames;  // by chunk
  std::uint32_t frame_count = 0;
  std::vector<std::string> problems;
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

  void scan();
  void read_definitions();
  const format::Chunk& decode_chunk(std::size_t index, DecodedChunk& to) const;
  void find_sources(DecodedChunk& chunk) const;
  void read_input(const format::Input& input, const Source& source, std::size_t place);
  void read_settings(const format::Settings& settings, RecordedFrame& frame);
  void read(std::uint32_t index, RecordedFrame& frame);
};

// Finds the chunks by their headers, and checks each payload. What cannot be read becomes a problem.
void Recording::Storage::scan() {
  if (const std::string wrong = check_file_header(bytes.data, bytes.size); !wrong.empty()) refuse(wrong);
  std::uint64_t at = whole = kFileHeaderBytes;
  const auto cut = [&](const std::string& what) {
    problems.push_back("chunk " + std::to_string(chunks.size()) + " at byte " + std::to_string(at) + " " + what +
                       "; it is left out, with what follows");
  };
  while (at < bytes.size) {
    const std::uint64_t left = bytes.size - at;
    ChunkPlace chunk;
    chunk.at = at;
    if (left < kChunkHeaderBytes) {
      cut("is cut off in its header: " + std::to_string(left) + " of " + std::to_string(kChunkHeaderBytes) +
          " bytes are there");
      break;
    }
    if (!read_header(bytes.data + at, chunk.header)) {
      cut("has a damaged header");
      break;
    }
    const std::uint64_t stored = chunk.header.stored_bytes, there = left - kChunkHeaderBytes;
    if (stored > there) {
      cut(frames_of(chunk.header) + " is cut off: " + std::to_string(there) + " of " + std::to_string(stored) +
          " bytes are there");
      break;
    }
    if (chunk.header.frame_count > 0 && chunk.header.first_frame != frame_count) {
      cut(frames_of(chunk.header) + " is out of order: frame " + std::to_string(frame_count) + " is next");
      break;
    }
    if (chunk.header.frame_count > UINT32_MAX - frame_count) {
      cut("has too many frames");
      break;
    }
    if (crc32(bytes.data + at + kChunkHeaderBytes, static_cast<std::size_t>(stored)) != chunk.header.payload_crc)
      chunk.damage = "its checksum differs";
    first_frames.push_back(frame_count);
    frame_count += chunk.header.frame_count;
    chunks.push_back(std::move(chunk));
    at = std::min<std::uint64_t>(at + kChunkHeaderBytes + padded(stored), bytes.size);
    whole = at;
  }
}

const format::Chunk& Recording::Storage::decode_chunk(std::size_t index, DecodedChunk& to) const {
  const ChunkPlace& chunk = chunks[index];
  if (!chunk.damage.empty()) refuse(chunk.damage);
  const std::uint8_t* payload = bytes.data + chunk.at + kChunkHeaderBytes;
  // FlatBuffers are read where they lie, which is at a multiple of 8 in a file that is mapped.
  if (chunk.header.codec == Codec::kStored && reinterpret_cast<std::uintptr_t>(payload) % 8 != 0) {
    to.plain.assign(payload, payload + chunk.header.stored_bytes);
    payload = to.plain.data();
  }
  if (chunk.header.codec == Codec::kZstd) {
    std::string reason;
    if (!decode(chunk.header, payload, to.plain, reason)) refuse(reason);
    payload = to.plain.data();
  }
  constexpr fb::uoffset_t kMaxDepth = 16, kMaxTables = 100000000;
  fb::Verifier verifier(payload, static_cast<std::size_t>(chunk.header.plain_bytes), kMaxDepth, kMaxTables);
  if (!format::VerifySizePrefixedChunkBuffer(verifier)) refuse("its payload is no chunk of a recording");
  to.index = index;
  to.table = format::GetSizePrefixedChunk(payload);
  const auto* const frames = to.table->frames();
  if ((frames == nullptr ? 0 : frames->size()) != chunk.header.frame_count)
    refuse("it has another number of frames than its header says");
  return *to.table;
}

// Definitions are read at once. What follows a chunk whose definitions cannot be read has no meaning.
void Recording::Storage::read_definitions() {
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    if (!chunks[c].header.has_definitions) continue;
    try {
      DecodedChunk decoded_chunk;
      const format::Chunk& chunk = decode_chunk(c, decoded_chunk);
      if (const format::Header* const header = chunk.header(); header != nullptr && c == 0) {
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
      } else if (c == 0) {
        refuse("it has no header");
      }
      if (chunk.articulations() != nullptr)
        for (const format::Articulation* const table : *chunk.articulations()) {
          auto entry = std::make_unique<ReadArticulation>();
          const std::string wrong = entry->read(*table, articulations);
          if (!wrong.empty()) refuse("articulation " + std::to_string(articulations.size()) + ": " + wrong);
          articulations.push_back(std::move(entry));
        }
      if (chunk.batches() != nullptr)
        for (const format::Batch* const table : *chunk.batches()) {
          auto entry = std::make_unique<ReadBatch>();
          const std::string wrong = entry->read(*table, articulations);
          if (!wrong.empty()) refuse("batch " + std::to_string(batches.size()) + ": " + wrong);
          batches.push_back(std::move(entry));
        }
    } catch (const Failure& failure) {
      if (c == 0) refuse("its first chunk cannot be read: " + std::string(failure.what()));
      problems.push_back("chunk " + std::to_string(c) + " at byte " + std::to_string(chunks[c].at) +
                         " has definitions that cannot be read: " + failure.what() +
                         "; it is left out, with what follows");
      whole = chunks[c].at;
      frame_count = first_frames[c];
      chunks.resize(c);
      first_frames.resize(c);
      break;
    }
  }
  for (std::size_t c = 0; c < chunks.size(); ++c)
    if (!chunks[c].damage.empty())
      problems.push_back("chunk " + std::to_string(c) + " at byte " + std::to_string(chunks[c].at) + " " +
                         frames_of(chunks[c].header) + " is damaged: " + chunks[c].damage);
}

// Follows each batch through the frames of a chunk.
void Recording::Storage::find_sources(DecodedChunk& chunk) const {
  std::map<std::uint32_t, Source> last;
  for (const format::Frame* const frame : *chunk.table->frames()) {
    std::vector<Source>& sources = chunk.sources.emplace_back();
    if (frame->settings() == nullptr) refuse("a frame has no settings");
    if (frame->inputs() == nullptr) continue;
    for (const format::Input* const input : *frame->inputs()) {
      if (input->batch() >= batches.size())
        refuse("a frame has an input of batch " + std::to_string(input->batch()) + ", which is not defined");
      Source& source = last[input->batch()];
      if (!input->same_as_before()) {
        source.arrays = input;
        if (input->poses() != nullptr) source.poses = input->poses();
      } else if (source.arrays == nullptr) {
        refuse("a frame's input is that of the frame before, and there is none");
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
      from_steps(span_of(from.rounded()), info.pose_step, poses[place]);
      values = poses[place];
    }
    const std::size_t links = articulations[batch.articulation]->view().link_count;
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
      std::uint32_t field = 0;
      while (field < fields.size && std::strcmp(fields[field].name, name) != 0) ++field;
      if (!policy_set(job.policies, field, value)) refuse("this library knows no policy like one of its frames");
    }
  job.margin = settings.margin();
  job.min_depth = settings.min_depth();
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

void Recording::Storage::read(std::uint32_t index, RecordedFrame& frame) {
  if (index >= frame_count)
    refuse("there is no frame " + std::to_string(index) + " among " + std::to_string(frame_count));
  // Chunks without frames begin where the next one does.
  const auto after = std::upper_bound(first_frames.begin(), first_frames.end(), index);
  const auto c = static_cast<std::size_t>(after - first_frames.begin()) - 1;
  try {
    if (!decoded || decoded->index != c) {
      decoded.reset();
      DecodedChunk chunk;
      decode_chunk(c, chunk);
      find_sources(chunk);
      decoded = std::move(chunk);
    }
    const std::uint32_t in_chunk = index - first_frames[c];
    const format::Frame& table = *decoded->table->frames()->Get(in_chunk);
    const std::vector<Source>& sources = decoded->sources[in_chunk];
    frame = {};
    frame.time = table.time();
    inputs.assign(sources.size(), {});
    poses.resize(std::max(poses.size(), sources.size()));
    rules.clear();
    masked.clear();
    for (std::size_t k = 0; k < sources.size(); ++k)
      read_input(*table.inputs()->Get(static_cast<fb::uoffset_t>(k)), sources[k], k);
    read_settings(*table.settings(), frame);
    frame.job.inputs = inputs;
    frame.job.rules = rules;
    frame.masked = masked;
    const Span<const std::uint32_t> hits = span_of(table.hits()), contacts = span_of(table.contacts());
    if (hits.size % kHitWords != 0) refuse("hits are incomplete");
    frame.hits = {reinterpret_cast<const Hit*>(hits.data), hits.size / kHitWords};
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
    refuse("frame " + std::to_string(index) + " in chunk " + std::to_string(c) + " at byte " +
           std::to_string(chunks[c].at) + ": " + failure.what());
  }
}

// -------------------------------------------------------------------------------------------------------------- calls

namespace {

template <class Storage>
void read_all(Storage& to) {
  to.scan();
  if (to.chunks.empty())
    refuse(to.problems.empty() ? "it has no chunk" : "it has no whole chunk: " + to.problems.front());
  to.read_definitions();
  for (const std::string& problem : to.problems) to.problem_texts.push_back(problem.c_str());
}

}  // namespace

Recording::~Recording() { delete storage_; }

bool Recording::open(const char* path) noexcept {
  delete storage_;
  storage_ = nullptr;
  return attempt(storage_, [&](Storage& to) {
    to.path = path == nullptr ? "" : path;
    to.file.open(to.path);
    to.bytes = {to.file.data(), to.file.size()};
    read_all(to);
  });
}

bool Recording::open_bytes(Span<const std::uint8_t> bytes, const char* name) noexcept {
  delete storage_;
  storage_ = nullptr;
  return attempt(storage_, [&](Storage& to) {
    to.path = name == nullptr ? "" : name;
    to.bytes = bytes;
    read_all(to);
  });
}

const char* Recording::error() const noexcept { return error_of(storage_); }

Span<const char* const> Recording::problems() const noexcept {
  return storage_ == nullptr ? Span<const char* const>() : Span<const char* const>(storage_->problem_texts);
}

std::uint64_t Recording::whole_bytes() const noexcept { return storage_ == nullptr ? 0 : storage_->whole; }

RecordingInfo Recording::info() const noexcept { return storage_ == nullptr ? RecordingInfo() : storage_->info; }

std::uint32_t Recording::articulation_count() const noexcept {
  return storage_ == nullptr ? 0 : static_cast<std::uint32_t>(storage_->articulations.size());
}

std::uint32_t Recording::batch_count() const noexcept {
  return storage_ == nullptr ? 0 : static_cast<std::uint32_t>(storage_->batches.size());
}

std::uint32_t Recording::frame_count() const noexcept { return storage_ == nullptr ? 0 : storage_->frame_count; }

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

}  // namespace cab::record
