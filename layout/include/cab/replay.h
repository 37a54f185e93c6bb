// Reads recordings (cab/record.h), and runs their frames again. Target cab::record. The conventions are those of
// cab/types.h; nothing here is thrown.
#pragma once

#include <cab/record.h>
#include <cab/types.h>

#include <cstddef>
#include <cstdint>

namespace cab {
struct Engine;
}

namespace cab::record {

// What is true of a whole recording. Strings live as long as the recording is open.
struct RecordingInfo {
  const char* library = "";        // version of the library that wrote it
  const char* title = "";          // what it shows; may be empty
  double seconds_per_frame = 0;    // 0: unknown
  double metres_per_unit = 0;      // 0: unknown
  char up = 0;                     // 'x', 'y', 'z', or 0: unknown
  const char* isa = "";            // what it was run with; empty: unknown
  std::uint32_t thread_count = 0;  // likewise; 0: unknown
  float pose_step = 0;             // 0: poses are floats
};

// An articulation of a recording.
struct RecordedArticulation {
  const char* name = "";               // may be empty
  Span<const char* const> link_names;  // one per link, or empty
  std::uint32_t link_count = 0;        // of a level that of its articulation
  bool is_lod = false;                 // whether it is a level of detail
  ArticulationDesc desc;               // of one that is no level of detail
  LodDesc lod;  // of a level; its `of` is the slot of an articulation of the recording: index + 1
};

// A batch of a recording.
struct RecordedBatch {
  const char* name = "";                   // may be empty
  Span<const char* const> instance_names;  // one per instance, or empty
  std::uint32_t slot = 0;                  // what hits call it
  std::uint32_t articulation = 0;          // index; unused for static bodies
  std::uint32_t instance_count = 0;        // as the batch was told; frames may have fewer
  bool is_static = false;                  // whether it is of static bodies
  StaticDesc static_desc;                  // of static bodies
};

// A frame of a recording, as it was given and as it came back. Spans live until another frame is read.
struct RecordedFrame {
  double time = 0;  // seconds

  // Inputs, rules, policies, margin, min_depth and report. A batch is named by its index + 1 in place of an id. hits,
  // contacts and stats are empty; hit_count is their number.
  FrameJob job;

  Span<const Hit> hits;              // batches by the slots of RecordedBatch
  Span<const Contact> contacts;      // one per hit, or empty
  bool has_contacts = false;         // whether contacts were asked for
  std::uint64_t hash = 0;            // of hits and contacts, as hash_hits gives it
  FrameStats stats;                  // the members that docs/recording.md names
  Span<const std::uint32_t> masked;  // one after the other: index of a batch, instance
};

// FNV-1a, 64 bits, of the bytes of hits and then of contacts, little-endian.
std::uint64_t hash_hits(Span<const Hit> hits, Span<const Contact> contacts) noexcept;

// A recording that is read from its file, a chunk at a time. Frames of a file that changes while it is open are read as
// they were, or refused. A Recorder that appends changes nothing of what is there but the mark of the end, and one that
// makes the file anew leaves the old one to its readers. It can be neither moved nor copied. What is read is checked:
// hits and masked instances name what their frame has.
class Recording {
 public:
  struct Storage;  // private to the library

  Recording() noexcept = default;
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  ~Recording();

  // Opens a recording. Returns whether there is one that has a whole first chunk; if not, error() says why. What is
  // cut off or damaged after it is told by problems(). A file may be cut off anywhere.
  [[nodiscard]] bool open(const char* path) noexcept;

  // The same from memory, which must stay as it is while the recording is open. `name` is for messages.
  [[nodiscard]] bool open_bytes(Span<const std::uint8_t> bytes, const char* name) noexcept;

  // Why the last call failed; empty if it did not.
  const char* error() const noexcept;

  // What cannot be read, one line each: which chunk, at which byte, which frames; and whether the recording was not
  // closed, so that frames may be missing at its end. Empty if nothing is missing.
  Span<const char* const> problems() const noexcept;

  // Whether something is damaged, which is more than that the file is cut off at its end.
  bool is_damaged() const noexcept;

  // Whether it ends with the mark that Recorder::close writes. If not, its recorder ended before that, still writes, or
  // is from a library that knew no mark yet.
  bool is_closed() const noexcept;

  // Bytes from the beginning of the file to the end of its last whole chunk, which may be that mark.
  std::uint64_t whole_bytes() const noexcept;

  // What is true of the whole recording.
  RecordingInfo info() const noexcept;

  // How many articulations, levels of detail among them, and batches are defined, and how many frames there are, lost
  // ones among them. 0 if none is open.
  std::uint32_t articulation_count() const noexcept;
  std::uint32_t batch_count() const noexcept;  // likewise
  std::uint32_t frame_count() const noexcept;  // likewise

  // By index below the count.
  RecordedArticulation articulation(std::uint32_t index) const noexcept;
  RecordedBatch batch(std::uint32_t index) const noexcept;

  // Reads a frame. False if there is none, or if its chunk is damaged; error() says so.
  [[nodiscard]] bool read_frame(std::uint32_t index, RecordedFrame* frame) noexcept;

  // The frame to read after `index`, for whoever reads all and has called read_frame(index): index + 1, or if that was
  // refused since its chunk is damaged or lost, the first frame after that chunk. A small file can claim millions of
  // frames that are lost together. At most frame_count().
  std::uint32_t next_frame(std::uint32_t index) const noexcept;

 private:
  Storage* storage_ = nullptr;
};

// Runs frames of a recording in an engine of its own. It can be neither moved nor copied.
class Player {
 public:
  struct Storage;  // private to the library

  Player() noexcept = default;
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  ~Player();

  // Makes an engine. The recording must stay open, and what `desc` points to must stay. False if the engine refuses;
  // error() says why.
  [[nodiscard]] bool open(const Recording& recording, const EngineDesc& desc = {}) noexcept;

  // Runs a frame with other policies than it was recorded with, if `policies` is not null. The result has the slots of
  // the recording, and lives until the next call. False if the engine refuses; error() says why.
  [[nodiscard]] bool run(const RecordedFrame& frame, const Policies* policies = nullptr) noexcept;

  // The hits of the last run, in the order of run_frame.
  Span<const Hit> hits() const noexcept;
  Span<const Contact> contacts() const noexcept;  // one per hit, if the frame has_contacts and there is an exact test

  // Finds the triangles of skins that touch in a frame's poses, of each two links of `pairs`: hits of the recording or
  // of this player. False if the engine refuses, or if more than 2^24 pairs of triangles touch; error() says why.
  [[nodiscard]] bool find_triangles(const RecordedFrame& frame, Span<const Hit> pairs) noexcept;

  // What the last find_triangles found, in the order of find_touching_triangles. Valid until its next call.
  Span<const TouchingTriangles> triangles() const noexcept;

  // What the last run did.
  FrameStats stats() const noexcept;

  // The engine, for questions such as engine_isa. Null before open.
  const Engine* engine() const noexcept;

  // Why the last call failed; empty if it did not.
  const char* error() const noexcept;

 private:
  Storage* storage_ = nullptr;
};

}  // namespace cab::record
