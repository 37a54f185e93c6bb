// Files that somebody made to do harm: small ones that would become large, and frames that name what is not there.
#include "engine/record/budget.h"

#include <limits>

#include "engine/record/chunk.h"
#include "tests/engine/record/recorded_world.h"
#include "tests/rounds.h"

namespace cab::tests {
namespace {

namespace fb = flatbuffers;
namespace format = record::format;

constexpr const char* kLibrary = "1";

// What a test changes about a recording of one articulation of one link, two batches of it, and one frame.
struct Made {
  std::uint32_t instance_count = 2, count = 2;
  std::vector<std::uint32_t> hits, masked;
  std::uint8_t up = 'y';
  double metres_per_unit = 1;
  std::uint32_t shared_parts = 1, inputs_of_first_batch = 1, name_count = 1;
  std::size_t shared_numbers = 9;
  std::uint32_t claimed_frames = 1;
  std::string policy = "refit", value = "cab";
  // A skin, whose triangles a leaf has in the place of a box.
  bool has_skin = false;
  std::uint32_t influence_count = 1, shared_leaves = 1;
  std::vector<std::uint32_t> influence_links = {0, 0, 0};
  std::vector<float> influence_weights = {1, 1, 1};
  std::size_t numbers_of_vertices = 9, matrix_numbers = 16;
  std::vector<std::uint32_t> triangles = {0, 1, 2};
};

// The skin of three vertices, or of as many as are wanted.
fb::Offset<format::Skin> skin_of(fb::FlatBufferBuilder& builder, const Made& made) {
  std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  vertices.resize(made.numbers_of_vertices, 1);
  std::vector<float> matrices(made.matrix_numbers, 0);
  for (std::size_t k = 0; k < matrices.size(); k += 5) matrices[k] = 1;
  return format::CreateSkin(builder, builder.CreateVector(vertices), made.influence_count,
                            builder.CreateVector(made.influence_links), builder.CreateVector(made.influence_weights),
                            builder.CreateVector(matrices));
}

std::vector<std::uint8_t> bytes_of(const Made& made) {
  fb::FlatBufferBuilder builder;
  const auto header = format::CreateHeader(builder, builder.CreateString(kLibrary), builder.CreateString(""), 0,
                                           made.metres_per_unit, made.up, builder.CreateString(""));
  const auto numbers = builder.CreateVector(std::vector<float>(made.shared_numbers, 0.25f));
  const auto place = builder.CreateVector(std::vector<float>{0, 0, 0, 0, 0, 0, 1, .1f, .1f, .1f});
  std::vector<fb::Offset<format::Part>> parts;
  for (std::uint32_t p = 0; p < made.shared_parts; ++p)
    parts.push_back(format::CreatePart(builder, static_cast<std::uint8_t>(ShapeKind::kBox), place, numbers));
  const auto box = builder.CreateVector(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, .1f, .1f, .1f});
  const auto leaf = made.has_skin ? format::CreateLeaf(builder, 0, 0, 0, builder.CreateVector(made.triangles))
                                  : format::CreateLeaf(builder, 0, box, builder.CreateVector(parts));
  const auto leaves = builder.CreateVector(std::vector<fb::Offset<format::Leaf>>(made.shared_leaves, leaf));
  const auto skin = made.has_skin ? skin_of(builder, made) : fb::Offset<format::Skin>();
  const auto name = builder.CreateString(std::string(made.name_count > 1 ? 5000 : 5, 'n'));
  const auto names = builder.CreateVector(std::vector<fb::Offset<fb::String>>(made.name_count, name));
  const auto parents = builder.CreateVector(std::vector<std::int16_t>{-1});
  const auto articulation =
      format::CreateArticulation(builder, 0, made.name_count > 1 ? names : 0, parents, 0, leaves, 0, 0, 0, 0, skin);
  std::vector<fb::Offset<format::Batch>> batches;
  for (const std::uint32_t slot : {1u, 2u})
    batches.push_back(format::CreateBatch(builder, slot, 0, made.instance_count));

  std::vector<float> pose;
  for (std::uint32_t i = 0; i < made.count; ++i) pose.insert(pose.end(), {0, 0, 0, 1, 0, 0, 0});
  const auto poses = format::CreatePoses(builder, 0, false, builder.CreateVector(pose));
  std::vector<fb::Offset<format::Input>> inputs;
  const auto masked = builder.CreateVector(made.masked);
  for (std::uint32_t i = 0; i < made.inputs_of_first_batch + 1; ++i)
    inputs.push_back(format::CreateInput(builder, i < made.inputs_of_first_batch ? 0 : 1, poses, 0, 0, 0, 0, 0, 0,
                                         made.count, 0, masked));
  const auto choice =
      format::CreatePolicyChoice(builder, builder.CreateString(made.policy), builder.CreateString(made.value));
  const auto settings =
      format::CreateSettings(builder, builder.CreateVector(std::vector<fb::Offset<format::PolicyChoice>>{choice}));
  const auto frame =
      format::CreateFrame(builder, 0, settings, builder.CreateVector(inputs), builder.CreateVector(made.hits));
  const auto chunk = format::CreateChunk(
      builder, header, builder.CreateVector(std::vector<fb::Offset<format::Articulation>>{articulation}),
      builder.CreateVector(batches), builder.CreateVector(std::vector<fb::Offset<format::Frame>>{frame}));
  format::FinishSizePrefixedChunkBuffer(builder, chunk);
  std::vector<std::uint8_t> payload(builder.GetBufferPointer(), builder.GetBufferPointer() + builder.GetSize());
  record::ChunkHeader around = record::encode(payload, false);
  around.has_definitions = true;
  around.frame_count = made.claimed_frames;
  const auto begin = record::file_header();
  const auto bytes = record::to_bytes(around);
  std::vector<std::uint8_t> file(begin.begin(), begin.end());
  file.insert(file.end(), bytes.begin(), bytes.end());
  file.insert(file.end(), payload.begin(), payload.end());
  return file;
}

// Reads the frame of a file. Returns why it cannot be read; empty if it can.
std::string reading(const Made& made) {
  const std::vector<std::uint8_t> file = bytes_of(made);
  record::Recording recording;
  if (!recording.open_bytes(file, "made.cab")) return recording.error();
  record::RecordedFrame frame;
  if (!recording.read_frame(0, &frame)) return recording.error();
  record::Player player;
  if (!player.open(recording) || !player.run(frame)) return player.error();
  return {};
}

bool says(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST_CASE("a made recording is read and run as it is") {
  CHECK(reading({}).empty());
  Made made;
  made.hits = {1, 0, 2, 1, 0, 0};
  made.masked = {1};
  CHECK(reading(made).empty());
}

TEST_CASE("what a frame names and does not have is refused") {
  Made made;
  for (const std::vector<std::uint32_t>& hit :
       {std::vector<std::uint32_t>{99, 0, 2, 1, 0, 0}, {1, 2, 2, 1, 0, 0}, {1, 0, 2, 7, 0, 0}, {1, 0, 2, 1, 1, 0}}) {
    made.hits = hit;
    CHECK(says(reading(made), "a hit names what the frame does not have"));
  }
  made = {};
  made.masked = {2};
  CHECK(says(reading(made), "an instance is masked that batch 0 does not have"));
  made = {};
  made.inputs_of_first_batch = 2;
  CHECK(says(reading(made), "two inputs of batch 0"));
  made = {};
  made.up = 'Q';
  CHECK(says(reading(made), "its up is not x, y or z"));
  made = {};
  made.metres_per_unit = -1;
  CHECK(says(reading(made), "its header has no numbers"));
}

TEST_CASE("a skin is read as it is, and one that names what it does not have is refused") {
  Made made;
  made.has_skin = true;
  made.value = "cab";
  CHECK(reading(made).empty());
  const auto refused = [&](const Made& one, const std::string& words) { CHECK(says(reading(one), words)); };
  Made other = made;
  for (const std::vector<std::uint32_t>& triangles :
       {std::vector<std::uint32_t>{0, 1, 3}, {0, 1}, {0, 1, 0xffffffff}}) {
    other.triangles = triangles;
    refused(other, "the triangles of a leaf are incomplete, or have vertices that its skin does not have");
  }
  other = made;
  other.triangles = {};
  refused(other, "a leaf has neither a box nor triangles");
  other = made;
  other.influence_links = {0, 0, 1};
  refused(other, "its skin is moved by a link that it does not have");
  // A weight of 0 has no effect, for the engine neither: no vertex is moved by its link.
  other.influence_weights = {1, 1, 0};
  CHECK(says(reading(other), to_string(Status::kBadSkin)));
  other.influence_count = 2;
  other.influence_links = {0, 7, 0xffffffff, 0, 0, 1};
  other.influence_weights = {1, 0, 0, 1, 1, -0.0f};
  CHECK(reading(other).empty());
  for (const float weight : {1e-30f, -1.0f, std::numeric_limits<float>::quiet_NaN()}) {
    other.influence_weights[1] = weight;
    refused(other, "its skin is moved by a link that it does not have");
  }
  other = made;
  other.numbers_of_vertices = 10;
  refused(other, "the vertices of its skin are not x y z");
  other.numbers_of_vertices = 12;
  refused(other, "influences of another number of vertices");
  other = made;
  for (const std::uint32_t count : {0u, 2u, 0xffffffffu}) {
    other.influence_count = count;
    refused(other, "influences of another number of vertices");
  }
  other = made;
  other.matrix_numbers = 32;
  refused(other, "its skin has matrices for another number of links");
  other = made;
  other.matrix_numbers = 0;
  CHECK(reading(other).empty());
  other = made;
  other.triangles.assign(30000, 0);
  other.shared_leaves = 1000;
  CHECK(bytes_of(other).size() < 200000);
  refused(other, "its definitions name the same lists too often");
}

TEST_CASE("a policy that is not in the table is refused by its name, and no text of a file is shown as it is") {
  Made made;
  made.value = "best3";
  CHECK(reading(made).empty());
  for (const auto& [refit, named] : {std::pair<std::string, std::string>{"covariance_leaves", "covariance_leaves"},
                                     {"", ""},
                                     {"\33[2J", "??2?"},
                                     {std::string(5000, 'n'), std::string(40, 'n') + "..."}}) {
    made.value = refit;
    CHECK(says(reading(made), "a frame has refit = '" + named + "', which this library does not know"));
  }
}

TEST_CASE("a recording that was made when depth was a policy is read") {
  Made made;
  made.policy = "depth";
  made.value = "fewer_starts";
  CHECK(reading(made).empty());
}

TEST_CASE("lists that a small file names again and again are not unpacked") {
  Made made;
  made.shared_parts = 3000;
  made.shared_numbers = 9000;
  CHECK(bytes_of(made).size() < 200000);
  CHECK(says(reading(made), "its definitions name the same lists too often"));
  made = {};
  made.name_count = 2000;
  CHECK(bytes_of(made).size() < 20000);
  CHECK(says(reading(made), "its definitions name the same lists too often"));
}

TEST_CASE("a header claims no more frames than its payload could have") {
  Made made;
  made.claimed_frames = 2;
  CHECK(says(reading(made), "it has another number of frames than its header says"));
  made.claimed_frames = 0xffffffffu;
  CHECK(says(reading(made), "it has no whole chunk"));
}

// The engine gets room for the instances that frames have, not for those that a batch claims.
TEST_CASE("a batch that claims millions of instances takes memory for those of its frames") {
  Made made;
  made.instance_count = kMaxInstances;
  const std::vector<std::uint8_t> file = bytes_of(made);
  record::Recording recording;
  must(recording, recording.open_bytes(file, "made.cab"));
  record::RecordedFrame frame;
  must(recording, recording.read_frame(0, &frame));
  record::Player player;
  must(player, player.open(recording));
  must(player, player.run(frame));
  EngineMemory memory;
  oracle::require(engine_memory(*player.engine(), &memory));
  CHECK(memory.batches < 100000);
}

// A leaf may name one triangle often, so that a small file has many pairs of triangles.
TEST_CASE("a player finds no more triangles than there is room for") {
  if (runs_fewer_rounds()) {
    MESSAGE("skipped with one in several rounds: 16 million pairs of triangles take minutes in an emulator");
    return;
  }
  Made made;
  made.has_skin = true;
  made.triangles.clear();
  for (std::uint32_t i = 0; i < 4097; ++i) made.triangles.insert(made.triangles.end(), {0, 1, 2});
  made.hits = {1, 0, 2, 0, 0, 0};
  const std::vector<std::uint8_t> file = bytes_of(made);
  CHECK(file.size() < 100000);
  record::Recording recording;
  must(recording, recording.open_bytes(file, "made.cab"));
  record::RecordedFrame frame;
  must(recording, recording.read_frame(0, &frame));
  record::Player player;
  must(player, player.open(recording));
  CHECK_FALSE(player.find_triangles(frame, frame.hits));
  CHECK(says(player.error(), "16785409 pairs of triangles touch, and 16777216 are the most"));
  CHECK(player.triangles().empty());
}

TEST_CASE("what expands is counted as often as it is named") {
  fb::FlatBufferBuilder builder;
  const auto expanded = [&](const auto& object) {
    using Table = typename std::decay_t<decltype(object)>::TableType;
    builder.Clear();
    builder.Finish(Table::Pack(builder, &object));
    return record::expanded_bytes(*fb::GetRoot<Table>(builder.GetBufferPointer()));
  };
  format::BatchT batch;
  batch.name = "0123456789";
  const std::uint64_t with_name = expanded(batch);
  CHECK(with_name >= 10);
  batch.instance_names.assign(100, "0123456789");
  CHECK(expanded(batch) >= with_name + 1000);
  batch.static_bodies = std::make_unique<format::StaticBodiesT>();
  batch.static_bodies->vertices.assign(300, 1);
  CHECK(expanded(batch) >= with_name + 1000 + 1200);

  format::ArticulationT body;
  body.leaves.push_back(std::make_unique<format::LeafT>());
  auto& parts = body.leaves[0]->parts;
  parts.push_back(std::make_unique<format::PartT>());
  parts[0]->place.assign(10, 1);
  const std::uint64_t with_part = expanded(body);
  parts[0]->vertices.assign(300, 1);
  const std::uint64_t more = expanded(body) - with_part;
  CHECK(more >= 1200);
  CHECK(more < 2000);
}

}  // namespace
}  // namespace cab::tests
