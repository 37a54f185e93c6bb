#include <cab/policy.h>
#include <cab/record.h>
#include <cab/replay.h>
#include <cab/version.h>

#include <cab/cab.h>

#include <recording_generated.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "engine/record/attempt.h"
#include "engine/record/chunk.h"
#include "engine/record/definitions.h"
#include "engine/record/file_bytes.h"
#include "engine/record/rounded_poses.h"
#include "engine/record/scan.h"
#include "layout/pose_coding.h"

namespace cab::record {
namespace {

namespace fb = flatbuffers;

// A chunk is written once its frames take this much.
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

// The most frames of a chunk, so that a reader finds one among short frames fast.
constexpr std::size_t kChunkFrames = 1024;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

[[noreturn]] void fail(const std::string& reason) { throw Failure(reason); }
[[noreturn]] void fail_with_errno(const std::string& what) { fail(what + ": " + std::strerror(errno)); }

[[noreturn]] void fail_damaged(const std::string& problem) {
  fail("append: the recording is damaged, and may have more than is whole: " + problem);
}

// What is known of an articulation or a batch of the engine that is recorded.
struct KnownArticulation {
  std::uint32_t index = 0, link_count = 0;
};
struct KnownBatch {
  std::uint32_t index = 0, slot = 0, link_count = 0, instance_count = 0;
  bool is_sequence = false, is_static = false;
};

// The arrays of one batch in one frame, without gaps.
struct Arrays {
  PoseFormat format = PoseFormat::kQuaternionTranslation;
  bool has_scale = false;
  std::vector<float> poses;
  std::vector<std::int16_t> rounded;  // instead of poses, with a pose_step
  std::vector<double> origins;
  std::vector<float> orientations, scales, margins;
  std::vector<std::uint32_t> layers, layer_masks, instances;
  std::uint32_t count = kAllInstances;

  bool has_poses_of(const Arrays& other) const {
    return format == other.format && has_scale == other.has_scale && same_bytes(poses, other.poses) &&
           rounded == other.rounded;
  }
  bool has_rest_of(const Arrays& other) const {
    return count == other.count && same_bytes(origins, other.origins) && same_bytes(orientations, other.orientations) &&
           same_bytes(scales, other.scales) && same_bytes(margins, other.margins) && layers == other.layers &&
           layer_masks == other.layer_masks && instances == other.instances;
  }

 private:
  template <class T>
  static bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
  }
};

// The first `count` entries of a span that has `each` values per instance.
template <class T>
std::vector<T> first_of(Span<const T> span, std::size_t count, std::size_t each) {
  return std::vector<T>(span.data, span.data + std::min(span.size, count * each));
}

// The instances of an input that take part and are masked. The flags of others are those of earlier frames.
std::vector<std::uint32_t> masked_of(const BatchInput& input, std::uint32_t count) {
  std::vector<std::uint32_t> masked;
  const auto look_at = [&](std::uint32_t instance) {
    if (instance < input.flags.size && input.flags[instance] != 0) masked.push_back(instance);
  };
  for (const std::uint32_t instance : input.instances) look_at(instance);
  if (input.instances.empty())
    for (std::uint32_t instance = 0; instance < count; ++instance) look_at(instance);
  return masked;
}

template <class T>
fb::Offset<fb::Vector<T>> vector_of(fb::FlatBufferBuilder& builder, const std::vector<T>& values) {
  return values.empty() ? fb::Offset<fb::Vector<T>>() : builder.CreateVector(values);
}

// The table as bytes that tell equal tables.
template <class Table, class TableT>
std::string bytes_of(const TableT& table) {
  fb::FlatBufferBuilder builder;
  builder.Finish(Table::Pack(builder, &table));
  return std::string(reinterpret_cast<const char*>(builder.GetBufferPointer()), builder.GetSize());
}

// The tables of one kind that a file has, or will have with its next chunk.
template <class Table>
struct Definitions {
  using TableT = typename Table::NativeTableType;

  std::unordered_map<std::string, std::uint32_t> indices;  // by bytes
  std::uint32_t count = 0;
  std::vector<TableT> unwritten;

  // What is defined already keeps its index, so that it is written once, however often it comes and goes.
  std::uint32_t index_of(TableT table) {
    const auto [found, is_new] = indices.emplace(bytes_of<Table>(table), count);
    if (is_new) {
      unwritten.push_back(std::move(table));
      ++count;
    }
    return found->second;
  }

  // A table of a file that was there.
  void know(const TableT& table) { indices.emplace(bytes_of<Table>(table), count++); }

  std::vector<fb::Offset<Table>> pack(fb::FlatBufferBuilder& builder) const {
    std::vector<fb::Offset<Table>> tables;
    for (const TableT& table : unwritten) tables.push_back(Table::Pack(builder, &table));
    return tables;
  }
};

// Structs as words (words.h).
template <class T>
fb::Offset<fb::Vector<std::uint32_t>> words_of(fb::FlatBufferBuilder& builder, Span<const T> structs) {
  if (structs.empty()) return 0;
  std::uint32_t* words = nullptr;
  const auto vector = builder.CreateUninitializedVector(structs.size * sizeof(T) / sizeof *words, &words);
  std::memcpy(words, structs.data, structs.size * sizeof(T));
  return vector;
}

// What a chunk has no room for is refused, since a reader would not find it.
void check_size(std::uint64_t bytes, const char* what) {
  if (bytes > kMostPayloadBytes)
    fail(std::string(what) + " of " + std::to_string(bytes) + " bytes is too large: chunks have 2 GB");
}

void check_names(Span<const char* const> names, std::size_t count, const char* what) {
  if (!names.empty() && names.size != count) fail(std::string(what) + " have names, but not each one");
}

}  // namespace

struct Recorder::Storage {
  std::string path, error;
  File file;
  RecorderOptions options;
  std::string title;
  bool wants_header = false;
  bool is_broken = false;  // a write failed

  std::map<std::uint64_t, KnownArticulation> articulations;
  std::map<std::uint64_t, KnownBatch> batches;
  Definitions<format::Articulation> defined_articulations;
  Definitions<format::Batch> defined_batches;

  std::unique_ptr<fb::FlatBufferBuilder> builder;
  std::vector<fb::Offset<format::Frame>> frames;
  std::string settings_key;
  fb::Offset<format::Settings> settings;
  std::map<std::uint32_t, Arrays> before;   // by index of batch: the last frame of this chunk
  std::map<std::uint32_t, Arrays> at_hand;  // of the frame that is being written
  std::uint32_t frame_count = 0;            // frames at hand included
  std::uint64_t byte_count = 0;

  void begin_chunk();
  void write_chunk();
  void write_end();
  void write_bytes(const void* bytes, std::size_t size);
  void flush_file();
  void open_new();
  void open_behind();
  bool is_barely_begun() const;
  void know(const Recording& recording);

  const KnownBatch& known(BatchId id) const;

  void check(const FrameJob& job) const;
  void check(const BatchInput& input) const;
  Arrays gather(const BatchInput& input) const;
  void round(Arrays& arrays) const;
  fb::Offset<format::Poses> poses_of(const Arrays& arrays);
  fb::Offset<format::Input> input_of(const BatchInput& input, Arrays arrays);
  fb::Offset<format::Settings> settings_of(const FrameJob& job, bool has_contacts);
  std::uint64_t frame_bytes(const FrameJob& job) const;
  void write_frame(const FrameJob& job, bool has_contacts, double time);
  void write_moments(const FrameJob& job, bool has_contacts, double time);
  using MomentCounts = std::map<std::uint32_t, std::uint32_t>;  // by slot: how many moments a sequence has
  struct Moment {
    std::vector<BatchInput> inputs;
    std::vector<PairRule> rules;
  };
  Moment moment_of(const FrameJob& job, std::size_t m, const MomentCounts& counts) const;
};

// ------------------------------------------------------------------------------------------------------------ chunks

void Recorder::Storage::begin_chunk() {
  builder = std::make_unique<fb::FlatBufferBuilder>(kChunkBytes);
  frames.clear();
  settings_key.clear();
  before.clear();
}

void Recorder::Storage::write_bytes(const void* bytes, std::size_t size) {
  if (std::fwrite(bytes, 1, size, file.get()) != size) {
    is_broken = true;
    fail_with_errno("cannot write");
  }
  byte_count += size;
}

// What the system has survives this process.
void Recorder::Storage::flush_file() {
  if (std::fflush(file.get()) == 0) return;
  is_broken = true;
  fail_with_errno("cannot write");
}

void Recorder::Storage::write_chunk() {
  const bool has_definitions =
      wants_header || !defined_articulations.unwritten.empty() || !defined_batches.unwritten.empty();
  if (frames.empty() && !has_definitions) return;
  fb::Offset<format::Header> header;
  if (wants_header)
    header =
        format::CreateHeader(*builder, builder->CreateString(CAB_VERSION_STRING), builder->CreateString(title),
                             options.seconds_per_frame, options.metres_per_unit, static_cast<std::uint8_t>(options.up),
                             builder->CreateString(options.isa == Isa::kAuto ? "" : to_string(options.isa)),
                             options.thread_count, options.pose_step);
  const auto articulation_tables = defined_articulations.pack(*builder);
  const auto batch_tables = defined_batches.pack(*builder);
  const auto chunk = format::CreateChunk(*builder, header, vector_of(*builder, articulation_tables),
                                         vector_of(*builder, batch_tables), vector_of(*builder, frames));
  format::FinishSizePrefixedChunkBuffer(*builder, chunk);
  if (builder->GetSize() > kMostPayloadBytes) is_broken = true;
  check_size(builder->GetSize(), "a chunk");

  const std::uint8_t* const first = builder->GetBufferPointer();
  std::vector<std::uint8_t> payload(first, first + builder->GetSize());
  ChunkHeader bytes_around = encode(payload, options.compress);
  bytes_around.has_definitions = has_definitions;
  bytes_around.frame_count = static_cast<std::uint32_t>(frames.size());
  bytes_around.first_frame = frame_count - bytes_around.frame_count;
  payload.resize(static_cast<std::size_t>(padded(payload.size())));
  const auto chunk_header = to_bytes(bytes_around);
  write_bytes(chunk_header.data(), chunk_header.size());
  write_bytes(payload.data(), payload.size());
  flush_file();
  wants_header = false;
  defined_articulations.unwritten.clear();
  defined_batches.unwritten.clear();
  begin_chunk();
}

// Says that nothing is missing. A reader of a file without this mark tells that it was not closed.
void Recorder::Storage::write_end() {
  ChunkHeader end;
  end.is_end = true;
  end.first_frame = frame_count;
  const auto bytes = to_bytes(end);
  write_bytes(bytes.data(), bytes.size());
}

// A file that was there is not changed, since a reader may have it open, unless it is empty.
void Recorder::Storage::open_new() {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored) && std::filesystem::file_size(path, ignored) > 0)
    std::filesystem::remove(path, ignored);
  file.reset(std::fopen(path.c_str(), "wb"));
  if (file == nullptr) fail_with_errno("cannot be opened for writing");
  const auto bytes = file_header();
  write_bytes(bytes.data(), bytes.size());
  flush_file();
  wants_header = true;
}

// Whether a file is the beginning of a recording without a whole chunk, as a crash soon after open_new leaves it.
bool Recorder::Storage::is_barely_begun() const {
  FileBytes there;
  there.open(path);
  const auto header = file_header();
  const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(there.size(), header.size()));
  if (!std::equal(header.begin(), header.begin() + size, there.from(0, size).data)) return false;
  if (size < header.size()) return true;
  const Scan scan = scan_chunks(there);
  if (scan.is_damaged) fail_damaged(scan.problems[0]);
  return scan.chunks.empty();
}

// Continues after the last whole chunk of a file that is there. What it has defined keeps its index.
void Recorder::Storage::open_behind() {
  std::uint64_t end = 0;
  {
    Recording recording;
    if (!recording.open(path.c_str())) {
      if (!is_barely_begun()) fail(std::string(recording.error()).substr(path.size() + 2));
      open_new();
      return;
    }
    if (recording.is_damaged()) fail_damaged(recording.problems()[0]);
    if (recording.info().pose_step != options.pose_step) fail("append: the recording has another pose_step");
    options.seconds_per_frame = recording.info().seconds_per_frame;
    end = padded(recording.whole_bytes());
    if (recording.is_closed()) end -= kChunkHeaderBytes;  // until close the mark of the end is not true
    frame_count = recording.frame_count();
    know(recording);
  }
  // A file that cannot be opened keeps the mark of its end.
  file.reset(std::fopen(path.c_str(), "ab"));
  if (file == nullptr) fail_with_errno("cannot be opened for writing");
  std::error_code wrong;
  std::filesystem::resize_file(path, end, wrong);
  if (wrong) fail("what is cut off at its end cannot be dropped: " + wrong.message());
}

// What a recording has defined, by the tables that define the same.
void Recorder::Storage::know(const Recording& recording) {
  for (std::uint32_t a = 0; a < recording.articulation_count(); ++a) {
    const RecordedArticulation entry = recording.articulation(a);
    const ArticulationNames names = {entry.name, entry.link_names};
    const auto of = static_cast<std::uint32_t>(entry.lod.of.value - 1);  // of a level alone
    defined_articulations.know(entry.is_lod ? lod_table(entry.lod, of, entry.link_count, names)
                                            : articulation_table(entry.desc, names));
  }
  for (std::uint32_t b = 0; b < recording.batch_count(); ++b) {
    const RecordedBatch entry = recording.batch(b);
    const BatchNames names = {entry.name, entry.instance_names};
    defined_batches.know(entry.is_static ? static_batch_table(entry.slot, entry.static_desc, names)
                                         : batch_table(entry.slot, entry.articulation, entry.instance_count, names));
  }
}

// ------------------------------------------------------------------------------------------------------------ frames

const KnownBatch& Recorder::Storage::known(BatchId id) const {
  const auto found = batches.find(id.value);
  if (found == batches.end()) fail("a batch was not told by add_batch or add_static_batch");
  return found->second;
}

void Recorder::Storage::check(const FrameJob& job) const {
  if (job.report != Report::kHits && job.report != Report::kDistances)
    fail("a frame that reports in_contact alone has no hits to record");
  for (const PairRule& rule : job.rules)
    if (rule.resting == Resting::kSkipped)
      fail("a rule skips the hits of what rests, so the frame does not say what touches");
  if (!job.contacts.empty() && job.contacts.size < job.hit_count) fail("contacts are fewer than hits");
  if (job.hits.size < job.hit_count) fail("hit_count is above the number of hits");
}

void Recorder::Storage::check(const BatchInput& input) const {
  const KnownBatch& batch = known(input.batch);
  const std::size_t count = std::min(input.count, batch.instance_count);
  if (!input.instances.empty() && input.instances[input.instances.size - 1] >= count)
    fail("an instance is listed that the batch, as it was told, does not have");
  if (!batch.is_static && input.poses.data == nullptr && count > 0) fail("a batch has no poses");
}

Arrays Recorder::Storage::gather(const BatchInput& input) const {
  check(input);
  const KnownBatch& batch = known(input.batch);
  Arrays arrays;
  arrays.count = std::min(input.count, batch.instance_count);
  const std::size_t count = arrays.count;
  arrays.layers = first_of(input.layers, count, 1);
  arrays.layer_masks = first_of(input.layer_masks, count, 1);
  arrays.instances.assign(input.instances.begin(), input.instances.end());
  if (batch.is_static) return arrays;
  arrays.format = input.poses.format;
  arrays.has_scale = input.poses.has_scale;
  gather_poses(input.poses, batch.link_count, count, input.instances, arrays.poses);
  if (options.pose_step > 0) round(arrays);
  arrays.origins = first_of(input.origins, count, 3);
  arrays.orientations = first_of(input.orientations, count, 4);
  arrays.scales = first_of(input.scales, count, 1);
  arrays.margins = first_of(input.margins, count, 1);
  return arrays;
}

void Recorder::Storage::round(Arrays& arrays) const {
  if (arrays.format != PoseFormat::kQuaternionTranslation)
    fail("with a pose_step poses must be quaternions and translations");
  if (!to_steps(arrays.poses, options.pose_step, arrays.rounded))
    fail("with a pose_step poses must be those of round_poses, and be given to run_frame so");
  arrays.poses = {};
}

fb::Offset<format::Poses> Recorder::Storage::poses_of(const Arrays& arrays) {
  const auto pose_format = static_cast<std::uint8_t>(arrays.format);
  if (options.pose_step == 0)
    return format::CreatePoses(*builder, pose_format, arrays.has_scale, builder->CreateVector(arrays.poses));
  return format::CreatePoses(*builder, pose_format, arrays.has_scale, 0, builder->CreateVector(arrays.rounded));
}

fb::Offset<format::Input> Recorder::Storage::input_of(const BatchInput& input, Arrays arrays) {
  const KnownBatch& batch = known(input.batch);
  const std::vector<std::uint32_t> masked = masked_of(input, arrays.count);
  const auto last = before.find(batch.index);
  const bool same_poses = last != before.end() && arrays.has_poses_of(last->second);
  const bool same_rest = last != before.end() && arrays.has_rest_of(last->second);
  if (same_poses && same_rest) {
    const auto masked_vector = vector_of(*builder, masked);
    format::InputBuilder out(*builder);
    out.add_batch(batch.index);
    out.add_masked(masked_vector);
    out.add_same_as_before(true);
    return out.Finish();
  }
  const auto poses = same_poses || batch.is_static ? fb::Offset<format::Poses>() : poses_of(arrays);
  const auto table = format::CreateInput(*builder, batch.index, poses, vector_of(*builder, arrays.origins),
                                         vector_of(*builder, arrays.orientations), vector_of(*builder, arrays.scales),
                                         vector_of(*builder, arrays.layers), vector_of(*builder, arrays.layer_masks),
                                         vector_of(*builder, arrays.margins), arrays.count,
                                         vector_of(*builder, arrays.instances), vector_of(*builder, masked));
  at_hand[batch.index] = std::move(arrays);
  return table;
}

fb::Offset<format::Settings> Recorder::Storage::settings_of(const FrameJob& job, bool has_contacts) {
  std::vector<format::Rule> rules;
  for (const PairRule& rule : job.rules)
    rules.emplace_back(known(rule.a).index, known(rule.b).index, static_cast<std::uint32_t>(rule.pairing));
  std::string key(reinterpret_cast<const char*>(rules.data()), rules.size() * sizeof(format::Rule));
  const float lengths[] = {job.margin, job.min_depth};
  key.append(reinterpret_cast<const char*>(lengths), sizeof lengths);
  key.push_back(static_cast<char>(job.report));
  key.push_back(has_contacts ? 1 : 0);
  key.push_back(job.containment ? 1 : 0);
  const Span<const PolicyField> fields = policy_table();
  for (std::uint32_t f = 0; f < fields.size; ++f) key.push_back(static_cast<char>(policy_get(job.policies, f)));
  if (key == settings_key) return settings;

  std::vector<fb::Offset<format::PolicyChoice>> choices;
  for (std::uint32_t f = 0; f < fields.size; ++f)
    choices.push_back(
        format::CreatePolicyChoice(*builder, builder->CreateSharedString(fields[f].name),
                                   builder->CreateSharedString(fields[f].values[policy_get(job.policies, f)].name)));
  settings = format::CreateSettings(*builder, builder->CreateVector(choices), job.margin, job.min_depth,
                                    static_cast<std::uint8_t>(job.report), has_contacts,
                                    builder->CreateVectorOfStructs(rules), !job.containment);
  settings_key = std::move(key);
  return settings;
}

// What a frame may take, at most.
std::uint64_t Recorder::Storage::frame_bytes(const FrameJob& job) const {
  constexpr std::uint64_t kPerInput = 512, kPerFrame = 65536, kArraysPerInstance = 64;
  std::uint64_t bytes = kPerFrame + job.hits.size * sizeof(Hit) + job.contacts.size * sizeof(Contact) +
                        job.rules.size * sizeof(format::Rule);
  for (const BatchInput& input : job.inputs) {
    const KnownBatch& batch = known(input.batch);
    const std::uint64_t poses = std::uint64_t{batch.link_count} * pose_floats(input.poses.format) * sizeof(float);
    bytes += kPerInput + std::min(input.count, batch.instance_count) * (poses + kArraysPerInstance);
  }
  return bytes;
}

// hits and contacts are those that were written. has_contacts: whether contacts were asked for.
void Recorder::Storage::write_frame(const FrameJob& job, bool has_contacts, double time) {
  const std::uint64_t bytes = frame_bytes(job);
  check_size(bytes, "a frame");
  // The builder keeps what it was given until a chunk is written, so nothing is refused from here on.
  std::vector<Arrays> gathered;
  for (const BatchInput& input : job.inputs) gathered.push_back(gather(input));
  if (builder->GetSize() + bytes > kMostPayloadBytes) write_chunk();
  at_hand.clear();
  std::vector<fb::Offset<format::Input>> inputs;
  for (std::size_t k = 0; k < gathered.size(); ++k) inputs.push_back(input_of(job.inputs[k], std::move(gathered[k])));
  const FrameStats& stats = job.stats;
  const format::Stats counts(stats.candidates, stats.box_tests, stats.leaf_pairs, stats.exact_tests,
                             stats.false_positives, stats.instances_masked, stats.seconds_total);
  const auto shared = settings_of(job, has_contacts);
  const auto input_tables = builder->CreateVector(inputs);
  const auto hits = words_of<Hit>(*builder, job.hits);
  const auto contacts = words_of<Contact>(*builder, job.contacts);
  frames.push_back(format::CreateFrame(*builder, time, shared, input_tables, hits, contacts,
                                       hash_hits(job.hits, job.contacts), &counts));
  for (auto& [batch, arrays] : at_hand) before[batch] = std::move(arrays);
  ++frame_count;
  if (builder->GetSize() >= kChunkBytes || frames.size() >= kChunkFrames) write_chunk();
}

// Sequences: instance m of each is a character of the frame of moment m, and the one of a fixed object is in all.
void Recorder::Storage::write_moments(const FrameJob& job, bool has_contacts, double time) {
  MomentCounts counts;
  std::uint32_t moments = 1;
  for (const BatchInput& input : job.inputs) {
    const KnownBatch& batch = known(input.batch);
    const std::uint32_t count = counts[batch.slot] = std::min(input.count, batch.instance_count);
    moments = std::max(moments, count);
  }
  const auto moves = [&](BatchSlot slot) { return moments == 1 || counts[slot.value] > 1; };
  std::vector<std::vector<Hit>> hits(moments);
  std::vector<std::vector<Contact>> contacts(moments);
  for (std::size_t h = 0; h < job.hits.size; ++h) {
    Hit hit = job.hits[h];
    // What fixed objects touch alone, they touch at every moment.
    const bool is_fixed = !moves(hit.batch_a) && !moves(hit.batch_b);
    const std::size_t only = std::max(hit.instance_a, hit.instance_b);
    hit.instance_a = hit.instance_b = 0;
    for (std::size_t m = is_fixed ? 0 : only; m < (is_fixed ? moments : only + 1); ++m) {
      hits[m].push_back(hit);
      if (has_contacts) contacts[m].push_back(job.contacts[h]);
    }
  }
  // What is refused leaves no moment behind.
  for (const BatchInput& input : job.inputs) {
    check(input);
    if (options.pose_step > 0) static_cast<void>(gather(input));
  }
  for (std::size_t m = 0; m < moments; ++m) {
    const Moment moment = moment_of(job, m, counts);
    FrameJob frame = job;
    frame.inputs = moment.inputs;
    frame.rules = moment.rules;
    frame.hits = hits[m];
    frame.contacts = contacts[m];
    frame.stats = {};
    write_frame(frame, has_contacts, time + static_cast<double>(m) * options.seconds_per_frame);
  }
}

// A sequence that has ended takes no part any more.
Recorder::Storage::Moment Recorder::Storage::moment_of(const FrameJob& job, std::size_t m,
                                                       const MomentCounts& counts) const {
  const auto is_there = [&](BatchId id) {
    const std::uint32_t count = counts.at(known(id).slot);
    return count == 1 || m < count;
  };
  Moment moment;
  for (BatchInput input : job.inputs) {
    if (!is_there(input.batch)) continue;
    const KnownBatch& batch = known(input.batch);
    const std::size_t i = counts.at(batch.slot) > 1 ? m : 0;
    const auto one_of = [i](auto& span, std::size_t each) {
      if (span.size > 0) span = {span.data + i * each, each};
    };
    input.poses.data += i * instance_bytes(input.poses, batch.link_count) / sizeof(float);
    one_of(input.origins, 3);
    one_of(input.orientations, 4);
    one_of(input.scales, 1);
    one_of(input.layers, 1);
    one_of(input.layer_masks, 1);
    one_of(input.flags, 1);
    input.count = 1;
    moment.inputs.push_back(input);
  }
  for (const PairRule& rule : job.rules)
    if (is_there(rule.a) && is_there(rule.b)) moment.rules.push_back(rule);
  return moment;
}

// -------------------------------------------------------------------------------------------------------------- calls

Recorder::~Recorder() {
  if (storage_ != nullptr && storage_->file != nullptr) static_cast<void>(close());
  delete storage_;
}

bool Recorder::open(const char* path, const RecorderOptions& options) noexcept {
  if (storage_ != nullptr && storage_->file != nullptr && !close()) return false;
  delete storage_;
  storage_ = nullptr;
  return attempt(storage_, [&](Storage& to) {
    to.path = path == nullptr ? "" : path;
    to.options = options;
    to.title = options.title == nullptr ? "" : options.title;
    if (to.path.empty()) fail("a recording needs a path");
    if (options.up != 0 && (options.up < 'x' || options.up > 'z')) fail("up is x, y or z");
    for (const double number : {options.seconds_per_frame, options.metres_per_unit})
      if (!(number >= 0) || !std::isfinite(number))
        fail("seconds_per_frame and metres_per_unit are finite, and 0 or more");
    if (!is_step(options.pose_step)) fail("pose_step must be 0 or a power of two from 2^-60 to 2^60");
    to.begin_chunk();
    try {
      if (options.append && std::filesystem::exists(to.path))
        to.open_behind();
      else
        to.open_new();
    } catch (...) {
      to.file.reset();
      throw;
    }
  });
}

namespace {

// Calls work(storage) if a file is open. Whatever else than a Failure comes out of it, such as a failed allocation, may
// have left the chunk at hand half made.
template <class Storage, class Work>
bool with_file(Storage*& storage, Work work) noexcept {
  return attempt(storage, [&](auto& to) {
    if (to.file == nullptr) throw Failure("no recording is open");
    if (to.is_broken) throw Failure("nothing more is written after a failure");
    try {
      work(to);
    } catch (const Failure&) { throw; } catch (...) {
      to.is_broken = true;
      throw;
    }
  });
}

}  // namespace

bool Recorder::add_articulation(ArticulationId id, const ArticulationDesc& desc,
                                const ArticulationNames& names) noexcept {
  return with_file(storage_, [&](Storage& to) {
    check_names(names.links, desc.link_parents.size, "links");
    const std::uint32_t index = to.defined_articulations.index_of(articulation_table(desc, names));
    to.articulations[id.value] = {index, static_cast<std::uint32_t>(desc.link_parents.size)};
  });
}

bool Recorder::add_lod(ArticulationId id, const LodDesc& desc, const ArticulationNames& names) noexcept {
  return with_file(storage_, [&](Storage& to) {
    const auto of = to.articulations.find(desc.of.value);
    if (of == to.articulations.end()) fail("a level is of an articulation that was not told by add_articulation");
    const auto [of_index, links] = of->second;
    check_names(names.links, links, "links");
    to.articulations[id.value] = {to.defined_articulations.index_of(lod_table(desc, of_index, links, names)), links};
  });
}

bool Recorder::add_batch(BatchId id, const BatchDesc& desc, const BatchNames& names) noexcept {
  return with_file(storage_, [&](Storage& to) {
    const auto articulation = to.articulations.find(desc.articulation.value);
    if (articulation == to.articulations.end())
      fail("a batch is of an articulation that was not told by add_articulation or add_lod");
    const bool is_sequence = desc.kind == BatchKind::kSequence;
    const std::uint32_t recorded_count = is_sequence ? 1 : desc.instance_count;
    check_names(names.instances, recorded_count, "instances");
    format::BatchT table = batch_table(slot_of(id).value, articulation->second.index, recorded_count, names);
    to.batches[id.value] = {to.defined_batches.index_of(std::move(table)),
                            slot_of(id).value,
                            articulation->second.link_count,
                            desc.instance_count,
                            is_sequence,
                            false};
  });
}

bool Recorder::add_static_batch(BatchId id, const StaticDesc& desc, const BatchNames& names) noexcept {
  return with_file(storage_, [&](Storage& to) {
    format::BatchT table = static_batch_table(slot_of(id).value, desc, names);
    const std::uint32_t count = table.instance_count;
    check_names(names.instances, count, "instances");
    to.batches[id.value] = {to.defined_batches.index_of(std::move(table)), slot_of(id).value, 1, count, false, true};
  });
}

bool Recorder::add_frame(const FrameJob& job, double time) noexcept {
  return with_file(storage_, [&](Storage& to) {
    to.check(job);
    if (!std::isfinite(time)) fail("the time of a frame must be finite");
    std::size_t sequences = 0;
    for (const BatchInput& input : job.inputs) sequences += to.known(input.batch).is_sequence ? 1 : 0;
    for (const PairRule& rule : job.rules)
      for (const BatchId id : {rule.a, rule.b}) static_cast<void>(to.known(id));
    if (sequences > 0 && sequences < job.inputs.size)
      fail("sequences beside characters are not recorded: give each a frame of its own");
    const bool has_contacts = !job.contacts.empty();
    FrameJob found = job;
    found.hits.size = job.hit_count;
    found.contacts.size = has_contacts ? job.hit_count : 0;
    if (sequences > 0)
      to.write_moments(found, has_contacts, time);
    else
      to.write_frame(found, has_contacts, time);
  });
}

bool Recorder::flush() noexcept {
  return with_file(storage_, [](Storage& to) { to.write_chunk(); });
}

bool Recorder::close() noexcept {
  const bool written = with_file(storage_, [](Storage& to) {
    to.write_chunk();
    to.write_end();
  });
  if (storage_ == nullptr || storage_->file == nullptr) return written;
  std::FILE* const file = storage_->file.release();
  if (std::fclose(file) == 0 || !written) return written;
  return attempt(storage_, [](Storage&) { fail_with_errno("cannot write"); });
}

const char* Recorder::error() const noexcept { return error_of(storage_); }
std::uint32_t Recorder::frame_count() const noexcept { return storage_ == nullptr ? 0 : storage_->frame_count; }
std::uint64_t Recorder::byte_count() const noexcept { return storage_ == nullptr ? 0 : storage_->byte_count; }

}  // namespace cab::record
