// Reads bytes as a recording, or as the payloads of one whose checksums are right, and runs the frames that are there.
#include <cab/replay.h>

#include <string>
#include <vector>

#include "engine/record/chunk.h"
#include "tests/fuzz/bytes.h"

namespace {

using namespace cab;

// The most instances of all batches, and leaves of one articulation, that frames run with here.
constexpr std::uint64_t kMostInstances = 256;
constexpr std::size_t kMostLeaves = 64;
constexpr std::uint32_t kMostFrames = 8;

void append(std::vector<std::uint8_t>& file, const std::uint8_t* bytes, std::size_t size) {
  file.insert(file.end(), bytes, bytes + size);
}

// The bytes cut into chunks, each as a recorder writes it. The first byte of a chunk says how long it is and what its
// header claims; 0 is the mark of the end.
std::vector<std::uint8_t> with_checksums(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> file;
  const auto begin = record::file_header();
  append(file, begin.data(), begin.size());
  std::uint32_t frames = 0;
  while (size > 0) {
    const std::uint8_t how = *data++;
    --size;
    const std::size_t length = how >= 128 ? size : std::min<std::size_t>(size, std::size_t{how} * 16);
    std::vector<std::uint8_t> payload(data, data + length);
    record::ChunkHeader header = record::encode(payload, how % 2 == 1);
    header.has_definitions = how > 0;
    header.is_end = how == 0;
    header.frame_count = how / 2 % 4;
    header.first_frame = header.frame_count > 0 || header.is_end ? frames : how;  // or any number, without frames
    frames += header.frame_count;
    const auto bytes = record::to_bytes(header);
    append(file, bytes.data(), bytes.size());
    payload.resize(static_cast<std::size_t>(record::padded(payload.size())));
    append(file, payload.data(), payload.size());
    data += length;
    size -= length;
  }
  return file;
}

bool is_small(const record::Recording& recording) {
  std::uint64_t instances = 0;
  for (std::uint32_t b = 0; b < recording.batch_count(); ++b) instances += recording.batch(b).instance_count;
  for (std::uint32_t a = 0; a < recording.articulation_count(); ++a)
    if (recording.articulation(a).desc.leaves.size > kMostLeaves) return false;
  return instances <= kMostInstances;
}

void check_line(const char* text) {
  const std::string line = text;
  FUZZ_CHECK(!line.empty() && line.find('\n') == std::string::npos);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::vector<std::uint8_t> file =
      *data % 4 == 0 ? std::vector<std::uint8_t>(data + 1, data + size) : with_checksums(data + 1, size - 1);
  record::Recording recording;
  if (!recording.open_bytes(file, "fuzz.cab")) {
    check_line(recording.error());
    return 0;
  }
  for (const char* const problem : recording.problems()) check_line(problem);
  FUZZ_CHECK(recording.whole_bytes() <= file.size());
  record::Player player;
  const bool plays = is_small(recording) && player.open(recording);
  for (std::uint32_t f = 0; f < std::min(recording.frame_count(), kMostFrames); ++f) {
    record::RecordedFrame frame;
    if (!recording.read_frame(f, &frame)) {
      check_line(recording.error());
      continue;
    }
    FUZZ_CHECK(frame.contacts.empty() || frame.contacts.size == frame.hits.size);
    if (plays && !player.run(frame)) check_line(player.error());
    if (plays && !player.find_triangles(frame, frame.hits)) check_line(player.error());
    if (plays) record::hash_hits(player.hits(), player.contacts());
  }
  return 0;
}
