// Recordings that are cut off or damaged: what is whole is read, the rest is told, and nothing else happens.
#include "tests/engine/record/recorded_world.h"

#include <algorithm>
#include <set>

#include "engine/record/chunk.h"
#include "tests/engine/record/lost_frames.h"

namespace cab::tests {
namespace {

using namespace cab::oracle;

// A recording in memory, in some chunks.
struct SmallRecording {
  std::vector<std::uint8_t> bytes;
  std::vector<std::size_t> ends;            // of chunks
  std::vector<std::uint32_t> frames_until;  // frames up to there
  std::vector<std::uint64_t> hashes;        // by frame

  explicit SmallRecording(std::uint64_t seed, bool compressed) {
    Random random(seed);
    const RecordingFile file("damaged_" + std::to_string(seed));
    record::Recorder recorder;
    record::RecorderOptions options;
    options.compress = compressed;
    must(recorder, recorder.open(file.path(), options));
    World world;
    add_characters(random, world, 6);
    const EnginePtr engine = make_engine_for(world);
    tell(recorder, world);
    for (std::uint32_t f = 0; f < 9; ++f) {
      for (Member& member : world.members)
        member.poses = random_poses(random, member.rig, member.poses.instance_count, member.poses.format, {});
      const Outcome outcome = run_recorded(*engine, recorder, world, {}, f);
      hashes.push_back(record::hash_hits(outcome.hits, outcome.contacts));
      if (f % 3 != 2) continue;
      must(recorder, recorder.flush());
      ends.push_back(static_cast<std::size_t>(recorder.byte_count()));
      frames_until.push_back(f + 1);
    }
    must(recorder, recorder.close());
    bytes = file.bytes();
    REQUIRE(bytes.size() == ends.back() + record::kChunkHeaderBytes);  // the mark of the end
  }
};

// The frames that are read of a recording, and those at which a run begins that cannot be.
struct ReadFrames {
  std::vector<std::uint32_t> read, unread;
};

ReadFrames read_all(record::Recording& recording) {
  ReadFrames frames;
  for (std::uint32_t f = 0; f < recording.frame_count(); f = recording.next_frame(f)) {
    record::RecordedFrame frame;
    (recording.read_frame(f, &frame) ? frames.read : frames.unread).push_back(f);
    REQUIRE(frames.unread.size() < 1000);
  }
  return frames;
}

TEST_CASE("a recording that is cut off keeps what is whole, and says what is missing") {
  for (const bool compressed : {false, true}) {
    const SmallRecording whole(711, compressed);
    Random random(712);
    std::set<std::size_t> cuts;
    for (std::size_t cut = 0; cut <= 70; ++cut) cuts.insert(cut);
    for (const std::size_t end : whole.ends)
      for (int by = -9; by <= 60; ++by) {
        const auto cut = static_cast<std::ptrdiff_t>(end) + by;
        if (cut <= static_cast<std::ptrdiff_t>(whole.bytes.size())) cuts.insert(static_cast<std::size_t>(cut));
      }
    for (std::uint64_t n = 0; n < rounds(300); ++n)
      cuts.insert(random.index(static_cast<unsigned>(whole.bytes.size())));
    for (const std::size_t cut : cuts) {
      CAPTURE(cut);
      // The bytes lie alone, so that a sanitizer sees what is read behind them.
      const std::vector<std::uint8_t> bytes(whole.bytes.begin(),
                                            whole.bytes.begin() + static_cast<std::ptrdiff_t>(cut));
      record::Recording recording;
      const bool opened = recording.open_bytes(bytes, "cut.cab");
      // The zeros behind a payload are no part of it.
      std::size_t chunks = 0;
      while (chunks < whole.ends.size() && cut + 7 >= whole.ends[chunks]) ++chunks;
      if (!opened) {
        CHECK(chunks <= 1);
        CHECK(std::string(recording.error()).rfind("cut.cab: ", 0) == 0);
        continue;
      }
      REQUIRE(chunks >= 1);
      const std::uint32_t frames = recording.frame_count();
      const bool counts_padding = frames < whole.frames_until[chunks - 1];
      CHECK(frames ==
            (counts_padding ? (chunks > 1 ? whole.frames_until[chunks - 2] : 0) : whole.frames_until[chunks - 1]));
      CHECK(recording.is_closed() == (cut == whole.bytes.size()));
      REQUIRE(recording.problems().size == (recording.is_closed() ? 0 : 1));
      CHECK_FALSE(recording.is_damaged());
      if (!recording.is_closed() && recording.whole_bytes() == cut)
        CHECK(std::string(recording.problems()[0]) ==
              "it is not closed: its recorder ended before its end, or still writes; frames from " +
                  std::to_string(frames) + " on may be missing");
      for (std::uint32_t f = 0; f < frames; ++f) {
        record::RecordedFrame frame;
        must(recording, recording.read_frame(f, &frame));
        CHECK(frame.hash == whole.hashes[f]);
        CHECK(record::hash_hits(frame.hits, frame.contacts) == whole.hashes[f]);
      }
      record::RecordedFrame frame;
      CHECK_FALSE(recording.read_frame(frames, &frame));
    }
  }
}

TEST_CASE("of a recording that is cut off the chunk, the byte and the frames are named") {
  const SmallRecording whole(713, false);
  std::vector<std::uint8_t> bytes(whole.bytes.begin(),
                                  whole.bytes.begin() + static_cast<std::ptrdiff_t>(whole.ends[1]));
  bytes.resize(whole.ends[1] - 100);
  record::Recording recording;
  must(recording, recording.open_bytes(bytes, "cut.cab"));
  REQUIRE(recording.problems().size == 1);
  const std::string problem = recording.problems()[0];
  CHECK(problem.find("chunk 1 at byte " + std::to_string(whole.ends[0]) + " with frames 3 to 5 is cut off") == 0);
  CHECK(recording.whole_bytes() == whole.ends[0]);
}

TEST_CASE("no changed byte makes another frame of a recording") {
  for (const bool compressed : {false, true}) {
    const SmallRecording whole(714, compressed);
    Random random(715);
    std::size_t unread = 0;
    for (std::uint64_t round = 0; round < rounds(400); ++round) {
      CAPTURE(round);
      std::vector<std::uint8_t> bytes = whole.bytes;
      const unsigned at = random.index(static_cast<unsigned>(bytes.size()));
      bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << random.index(8)));
      record::Recording recording;
      if (!recording.open_bytes(bytes, "changed.cab")) continue;
      for (std::uint32_t f = 0; f < recording.frame_count(); ++f) {
        record::RecordedFrame frame;
        if (recording.read_frame(f, &frame)) {
          CHECK(record::hash_hits(frame.hits, frame.contacts) == whole.hashes[f]);
        } else {
          ++unread;
          CHECK(std::string(recording.error()).find("changed.cab: frame " + std::to_string(f)) == 0);
          CHECK_FALSE(recording.problems().empty());
        }
      }
    }
    CHECK(unread > 0);
  }
}

TEST_CASE("behind a damaged header the frames of later chunks are read, and the lost ones are named") {
  const SmallRecording whole(717, false);
  std::vector<std::uint8_t> bytes = whole.bytes;
  bytes[whole.ends[0] + 20] = static_cast<std::uint8_t>(bytes[whole.ends[0] + 20] ^ 4);
  record::Recording recording;
  must(recording, recording.open_bytes(bytes, "damaged.cab"));
  CHECK(recording.frame_count() == 9);
  for (std::uint32_t f = 0; f < 9; ++f) {
    CAPTURE(f);
    record::RecordedFrame frame;
    const bool is_lost = f >= 3 && f < 6;
    CHECK(recording.read_frame(f, &frame) == !is_lost);
    if (is_lost) CHECK(std::string(recording.error()).find("it is lost by the damage before") != std::string::npos);
    if (!is_lost) CHECK(record::hash_hits(frame.hits, frame.contacts) == whole.hashes[f]);
  }
  REQUIRE(recording.problems().size == 2);
  CHECK(std::string(recording.problems()[0])
            .find("chunk 1 at byte " + std::to_string(whole.ends[0]) +
                  " has a damaged header; the next chunk that can be read begins at "
                  "byte " +
                  std::to_string(whole.ends[1])) == 0);
  CHECK(std::string(recording.problems()[1]).find("with frames 3 to 5 before byte") != std::string::npos);
}

TEST_CASE("a chunk whose frames are out of order is left out") {
  const SmallRecording whole(716, false);
  std::vector<std::uint8_t> bytes(whole.bytes.begin(),
                                  whole.bytes.begin() + static_cast<std::ptrdiff_t>(whole.ends[0]));
  bytes.insert(bytes.end(), whole.bytes.begin() + static_cast<std::ptrdiff_t>(whole.ends[1]), whole.bytes.end());
  record::Recording recording;
  must(recording, recording.open_bytes(bytes, "twice.cab"));
  CHECK(recording.frame_count() == 3);
  REQUIRE(recording.problems().size == 2);
  CHECK(std::string(recording.problems()[0]).find("out of order: frame 3 is next") != std::string::npos);
  // Nor does the mark of the end fit what is left.
  CHECK(std::string(recording.problems()[1]).find("with the end of 9 frames is out of order") != std::string::npos);
  CHECK_FALSE(recording.is_closed());
}

TEST_CASE("a chunk without frames may have any number, and every frame is found") {
  const SmallRecording whole(723, false);
  for (const std::uint32_t number : {0u, 5u, 100u, 0xffffffffu})
    for (const std::size_t chunks : {1u, 2u, 3u, 8u}) {
      CAPTURE(number);
      CAPTURE(chunks);
      record::ChunkHeader header;
      header.first_frame = number;
      const auto empty = record::to_bytes(header);
      std::vector<std::uint8_t> bytes = whole.bytes;
      for (std::size_t k = 0; k < chunks; ++k)
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(whole.ends[0]), empty.begin(), empty.end());
      record::Recording recording;
      must(recording, recording.open_bytes(bytes, "numbered.cab"));
      CHECK(recording.problems().empty());
      CHECK(recording.frame_count() == 9);
      for (std::uint32_t f = 0; f < 9; ++f) {
        record::RecordedFrame frame;
        must(recording, recording.read_frame(f, &frame));
        CHECK(record::hash_hits(frame.hits, frame.contacts) == whole.hashes[f]);
        CHECK(recording.next_frame(f) == f + 1);
      }
    }
}

TEST_CASE("by the mark of the end the frames are named that damage took before it, and no more than can be") {
  const SmallRecording whole(718, false);
  std::vector<std::uint8_t> bytes = whole.bytes;
  bytes[whole.ends[1] + 20] = static_cast<std::uint8_t>(bytes[whole.ends[1] + 20] ^ 4);
  record::Recording recording;
  must(recording, recording.open_bytes(bytes, "damaged.cab"));
  CHECK(recording.frame_count() == 9);
  CHECK(recording.is_closed());
  record::RecordedFrame frame;
  must(recording, recording.read_frame(5, &frame));
  CHECK_FALSE(recording.read_frame(6, &frame));
  REQUIRE(recording.problems().size == 2);
  CHECK(std::string(recording.problems()[1]).find("with frames 6 to 8 before byte") != std::string::npos);

  record::ChunkHeader end;
  end.is_end = true;
  end.first_frame = 0xfffffff0u;
  const auto mark = record::to_bytes(end);
  std::copy(mark.begin(), mark.end(), bytes.end() - static_cast<std::ptrdiff_t>(mark.size()));
  must(recording, recording.open_bytes(bytes, "hostile.cab"));
  CHECK(recording.frame_count() == 6);
  CHECK_FALSE(recording.is_closed());
}

TEST_CASE("all damage of a file together costs no more frames than can be, and they are passed at once") {
  const SmallRecording whole(721, false);
  std::vector<std::uint8_t> bytes = whole.bytes;
  const std::string gaps = claimed_gaps(9);
  CHECK(gaps.size() < 22000);
  bytes.insert(bytes.end(), gaps.begin(), gaps.end());
  record::Recording recording;
  must(recording, recording.open_bytes(bytes, "hostile.cab"));
  // The first gap is as long as one may be, and the chunk behind it is there. All others are left out.
  const std::uint32_t last = 9 + kClaimedByGap;
  CHECK(recording.frame_count() == last + 1);
  std::size_t left_out = 0;
  for (const char* const problem : recording.problems())
    if (std::string(problem).find("out of order: frame 16777226 is next") != std::string::npos) ++left_out;
  CHECK(left_out == 254);
  const ReadFrames frames = read_all(recording);
  CHECK(frames.read.size() == 9);
  CHECK(frames.unread == std::vector<std::uint32_t>{9, last});
  CHECK(recording.next_frame(last) == last + 1);
  CHECK(recording.next_frame(last + 1) == last + 1);
}

TEST_CASE("the frames that a chunk claims and does not have are passed at once") {
  const SmallRecording whole(722, false);
  std::vector<std::uint8_t> bytes = whole.bytes;
  record::ChunkHeader header;
  header.codec = record::Codec::kZstd;
  header.stored_bytes = 24;
  header.plain_bytes = 12 << 16;
  header.frame_count = 1 << 16;
  for (int chunk = 0; chunk < 3; ++chunk) {
    header.first_frame = 9 + (static_cast<std::uint32_t>(chunk) << 16);
    const std::string zeros = chunk_of_zeros(header);
    bytes.insert(bytes.end(), zeros.begin(), zeros.end());
  }
  record::Recording recording;
  must(recording, recording.open_bytes(bytes, "hostile.cab"));
  CHECK(recording.frame_count() == 9 + (3 << 16));
  const ReadFrames frames = read_all(recording);
  CHECK(frames.read.size() == 9);
  CHECK(frames.unread == std::vector<std::uint32_t>{9, 9 + (1 << 16), 9 + (2 << 16)});
}

TEST_CASE("a mark of the end that is no longer last does not close a recording") {
  const SmallRecording whole(719, false);
  std::vector<std::uint8_t> bytes = whole.bytes;
  record::ChunkHeader more;  // as an older library appends
  const auto header = record::to_bytes(more);
  bytes.insert(bytes.end(), header.begin(), header.end());
  record::Recording recording;
  must(recording, recording.open_bytes(bytes, "appended.cab"));
  CHECK_FALSE(recording.is_closed());
  REQUIRE(recording.problems().size == 1);
  CHECK(std::string(recording.problems()[0]).rfind("it is not closed", 0) == 0);
  CHECK(recording.frame_count() == 9);
}

TEST_CASE("of a file that changes while it is open frames are those that were recorded, or refused") {
  for (const bool compressed : {false, true}) {
    const SmallRecording whole(720, compressed);
    const RecordingFile file("changing");
    const auto read = [&](record::Recording& recording, std::uint32_t f) {
      record::RecordedFrame frame;
      if (recording.read_frame(f, &frame)) {
        CHECK(record::hash_hits(frame.hits, frame.contacts) == whole.hashes[f]);
        return std::string();
      }
      return std::string(recording.error());
    };
    file.write(whole.bytes);
    record::Recording recording;
    must(recording, recording.open(file.path()));
    CHECK(read(recording, 0).empty());
    std::fstream changed(file.path(), std::ios::in | std::ios::out | std::ios::binary);
    changed.seekp(static_cast<std::streamoff>(whole.ends[1] + record::kChunkHeaderBytes + 100));
    changed.put(static_cast<char>(~whole.bytes[whole.ends[1] + record::kChunkHeaderBytes + 100]));
    changed.close();
    CHECK(read(recording, 3).empty());
    const std::string changed_frame = read(recording, 6);
#ifdef __unix__
    CHECK(changed_frame.find("the file has changed since it was opened") != std::string::npos);
#else
    CHECK(changed_frame.empty());  // the whole file was read as it was opened
#endif

    file.write(whole.bytes);
    must(recording, recording.open(file.path()));
    std::filesystem::resize_file(file.path(), whole.ends[0] + 8);
    CHECK(read(recording, 0).empty());
#ifdef __unix__
    CHECK(read(recording, 3).find("the file has become shorter since it was opened") != std::string::npos);
#endif
  }
}

TEST_CASE("a recording that was not opened has nothing") {
  const record::Recording recording;
  CHECK(recording.articulation_count() == 0);
  CHECK(recording.batch_count() == 0);
  CHECK(recording.frame_count() == 0);
  CHECK(recording.whole_bytes() == 0);
  CHECK(recording.next_frame(0) == 0);
  CHECK(recording.problems().empty());
  CHECK(!recording.is_closed());
}

TEST_CASE("what is no recording is refused") {
  record::Recording recording;
  CHECK_FALSE(recording.open("/nowhere/at/all.cab"));
  CHECK(std::string(recording.error()).rfind("/nowhere/at/all.cab: ", 0) == 0);
  CHECK_FALSE(recording.open_bytes({}, "empty"));
  const std::vector<std::uint8_t> text = {'H', 'I', 'E', 'R', 'A', 'R', 'C', 'H', 'Y', '\n', 0, 0, 0, 0, 0, 0, 0};
  CHECK_FALSE(recording.open_bytes(text, "clip.bvh"));
  CHECK(std::string(recording.error()).find("it does not begin with CABREC") != std::string::npos);
  const auto header = record::file_header();
  std::vector<std::uint8_t> later(header.begin(), header.end());
  later[8] = 2;
  CHECK_FALSE(recording.open_bytes(later, "later.cab"));
  CHECK(std::string(recording.error()).find("format 2, and this library reads format 1") != std::string::npos);
}

}  // namespace
}  // namespace cab::tests
