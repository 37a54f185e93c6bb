// Recordings of frames: a host writes what it gives an engine and what comes back, and the file replays anywhere to the
// same bits. Target cab::record. docs/recording.md has the format. The conventions are those of cab/types.h; nothing
// here is thrown.
#pragma once

#include <cab/types.h>

#include <cstddef>
#include <cstdint>

namespace cab::record {

// Version of the format that this library writes, the only one that it reads.
inline constexpr std::uint32_t kFormatVersion = 1;

// What a recorder writes besides what it is given later. Strings are borrowed for the call.
struct RecorderOptions {
  // What the recording shows, in a few words. Null (default): nothing.
  const char* title = nullptr;

  // Of sequences: the time from one moment to the next. 0 (default): unknown.
  double seconds_per_frame = 0;

  // The length of the caller's unit, for those who look at the recording. 0 (default): unknown.
  double metres_per_unit = 0;

  // The axis that points up: 'x', 'y' or 'z'. 0 (default): unknown.
  char up = 0;

  // The instruction set and the number of threads of the engine that is recorded. Default: unknown.
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 0;

  // Whether chunks are compressed by zstd. Default: they are not, so that a reader can use them where they lie.
  bool compress = false;

  // Above 0: poses are written in 16 bits per number, translations as multiples of this length, at most 32767 of them.
  // It must be a power of two. Only poses that round_poses has rounded are taken, so that the hits of the recording are
  // those of its poses, and poses that are none, for which the engine masks their instance: those that 16 bits do not
  // hold are written as 7 zeros, for which it is masked as well. With kQuaternionTranslation only. 0 (default): poses
  // are written as floats, bit for bit.
  float pose_step = 0;

  // Whether frames are added after those of a file that is there. What is cut off at its end is dropped, and so is the
  // mark of its end, until close writes another; a file that is damaged in the middle is refused. Its options stay as
  // they are, and these must have the same pose_step. Default: the file is made anew.
  bool append = false;
};

// Names for those who look at the recording. Null or empty: none.
struct ArticulationNames {
  const char* name = nullptr;     // of the articulation
  Span<const char* const> links;  // empty, or one per link
};
struct BatchNames {
  const char* name = nullptr;         // of the batch
  Span<const char* const> instances;  // empty, or one per instance
};

// Writes one recording. A chunk is written when its frames fill a megabyte, and by flush. It can be neither moved nor
// copied. Not for use by two threads at the same time.
//
// Every call returns whether it did its work. If not, error() says why, in one line with the path, and the file holds
// what was whole before. After a failed write, and after a failed allocation, nothing more is written.
class Recorder {
 public:
  struct Storage;  // private to the library

  Recorder() noexcept = default;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // As close, but nobody learns of a failure.
  ~Recorder();

  // Opens a file for writing. A recorder that has a file open closes it first.
  [[nodiscard]] bool open(const char* path, const RecorderOptions& options = {}) noexcept;

  // Each call tells the recorder what was added to the engine, with the id that the engine gave. What is added is
  // written with the next frame. An id may be told again once the engine has removed what it named. What the file
  // has already is not written again; to tell that, the recorder keeps a copy of all that was added.
  [[nodiscard]] bool add_articulation(ArticulationId id, const ArticulationDesc& desc,
                                      const ArticulationNames& names = {}) noexcept;
  [[nodiscard]] bool add_lod(ArticulationId id, const LodDesc& desc, const ArticulationNames& names = {}) noexcept;
  [[nodiscard]] bool add_batch(BatchId id, const BatchDesc& desc, const BatchNames& names = {}) noexcept;
  [[nodiscard]] bool add_static_batch(BatchId id, const StaticDesc& desc, const BatchNames& names = {}) noexcept;

  // Writes a frame that run_frame answered with kOk: its inputs, rules, policies, hits and contacts. `time` is in
  // seconds. Instances are masked as BatchInput::flags says of those that are in the frame, where it is given. Of
  // sequences every moment becomes a frame, seconds_per_frame apart, in which each sequence is a character. Refused are
  // Report::kInContact, Resting::kSkipped, whose hits do not say what touches, sequences beside characters, and a time
  // that is not finite.
  [[nodiscard]] bool add_frame(const FrameJob& job, double time) noexcept;

  // Writes the chunk at hand.
  [[nodiscard]] bool flush() noexcept;

  // Writes the chunk at hand and the mark of the end, and closes the file. Whoever reads a file without that mark is
  // told that it was not closed.
  [[nodiscard]] bool close() noexcept;

  // Why the last call failed; empty if it did not, or if there was no memory to say it. Valid until the next call.
  const char* error() const noexcept;

  // How many frames the file has, those before `append` included, and how many bytes were written.
  std::uint32_t frame_count() const noexcept;
  std::uint64_t byte_count() const noexcept;

 private:
  Storage* storage_ = nullptr;
};

// Rounds `pose_count` poses of 7 floats (kQuaternionTranslation, without gaps) in place to what a recording with this
// pose_step holds: unit quaternions to 16 bits per number, translations to multiples of pose_step. Returns whether all
// poses have finite quaternions of a length above 0 and translations within 32767 steps; if not, those that have not
// stay as they are.
bool round_poses(Span<float> poses, float pose_step) noexcept;

}  // namespace cab::record
