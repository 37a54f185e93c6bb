#include "engine/record/scan.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace cab::record {
namespace {

constexpr std::uint32_t kMostFrames = std::numeric_limits<std::uint32_t>::max();

// The most frames that damage is taken to cost between the chunks of a file, in all places together. Whoever asks for
// every frame is told of each.
constexpr std::uint32_t kMostLostFrames = 1u << 24;

class Scanner {
 public:
  explicit Scanner(FileBytes& file) : file_(file) {}

  Scan run() {
    at_ = scan_.whole = kFileHeaderBytes;
    while (at_ < file_.size()) {
      const std::uint64_t left = file_.size() - at_;
      if (left < kChunkHeaderBytes) {
        cut_off("is cut off in its header: " + std::to_string(left) + " of " + std::to_string(kChunkHeaderBytes) +
                " bytes are there");
        return std::move(scan_);
      }
      ChunkHeader header;
      if (!has_header(at_, header)) {
        if (!skip_to_next_header()) return std::move(scan_);
        continue;
      }
      const std::uint64_t there = left - kChunkHeaderBytes;
      if (header.stored_bytes > there) {
        cut_off(frames_in_words(header) + " is cut off: " + std::to_string(there) + " of " +
                std::to_string(header.stored_bytes) + " bytes are there");
        return std::move(scan_);
      }
      has_end_ = header.is_end;
      scan_.is_closed = false;  // what is appended stands after an earlier mark
      take(header);
      at_ = std::min<std::uint64_t>(at_ + kChunkHeaderBytes + padded(header.stored_bytes), file_.size());
      scan_.whole = at_;
      ++number_;
    }
    if (!has_end_ && number_ > 0)
      scan_.problems.push_back("it is not closed: its recorder ended before its end, or still writes; frames from " +
                               std::to_string(scan_.frame_count) + " on may be missing");
    return std::move(scan_);
  }

 private:
  bool has_header(std::uint64_t at, ChunkHeader& header) {
    return read_header(file_.from(at, kChunkHeaderBytes).data, header);
  }

  std::uint32_t payload_crc(const ChunkHeader& header) {
    std::uint32_t crc = 0;
    std::uint64_t at = at_ + kChunkHeaderBytes;
    for (std::uint64_t left = header.stored_bytes; left > 0;) {
      const Span<const std::uint8_t> part = file_.from(at, 1);
      const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(part.size, left));
      crc = crc32(part.data, size, crc);
      at += size;
      left -= size;
    }
    return crc;
  }

  std::string place() const { return "chunk " + std::to_string(number_) + " at byte " + std::to_string(at_) + " "; }

  void cut_off(const std::string& what) {
    scan_.is_closed = false;
    scan_.problems.push_back(place() + what + "; it is left out, with what follows");
  }

  void damaged(const std::string& what) {
    scan_.is_damaged = true;
    scan_.problems.push_back(place() + what);
  }

  // How many frames a chunk had whose header is damaged, and whether it had definitions, nobody knows.
  bool skip_to_next_header() {
    ChunkHeader header;
    std::uint64_t next = at_ + 8;
    while (next + kChunkHeaderBytes <= file_.size() && !has_header(next, header)) next += 8;
    const bool found = next + kChunkHeaderBytes <= file_.size();
    damaged(found ? "has a damaged header; the next chunk that can be read begins at byte " + std::to_string(next)
                  : "has a damaged header, and no chunk follows");
    is_gap_ = is_definition_lost_ = true;
    at_ = next;
    ++number_;
    return found;
  }

  void take(const ChunkHeader& header) {
    ChunkPlace chunk = {header, at_, {}};
    if (header.frame_count > 0 || header.is_end) {
      const bool is_next = header.first_frame == scan_.frame_count;
      const bool may_follow = is_gap_ && header.first_frame > scan_.frame_count &&
                              header.first_frame - scan_.frame_count <= kMostLostFrames - lost_count_;
      if (!is_next && !may_follow) {
        damaged(frames_in_words(header) + " is out of order: frame " + std::to_string(scan_.frame_count) + " is next");
        is_definition_lost_ = is_definition_lost_ || header.has_definitions;
        return;
      }
      if (header.frame_count > kMostFrames - header.first_frame) {
        damaged("has too many frames");
        return;
      }
      if (!is_next) lose_frames(header.first_frame - scan_.frame_count);
      is_gap_ = false;
    }
    if (header.is_end) {
      scan_.is_closed = true;
      return;
    }
    chunk.header.first_frame = scan_.frame_count;  // another number is possible where there are no frames
    if (payload_crc(header) != header.payload_crc)
      chunk.damage = "its checksum differs";
    else if (header.has_definitions && is_definition_lost_)
      chunk.damage = "definitions before it are lost";
    if (!chunk.damage.empty()) {
      damaged(frames_in_words(header) + " is damaged: " + chunk.damage);
      is_definition_lost_ = is_definition_lost_ || header.has_definitions;
    }
    scan_.frame_count += header.frame_count;
    scan_.chunks.push_back(std::move(chunk));
  }

  void lose_frames(std::uint32_t count) {
    ChunkPlace lost;
    lost.at = at_;
    lost.header.first_frame = scan_.frame_count;
    lost.header.frame_count = count;
    lost.damage = "it is lost by the damage before";
    scan_.problems.push_back("chunks " + frames_in_words(lost.header) + " before byte " + std::to_string(at_) +
                             " are lost");
    scan_.frame_count += count;
    lost_count_ += count;
    scan_.chunks.push_back(std::move(lost));
  }

  FileBytes& file_;
  Scan scan_;
  std::uint64_t at_ = 0;
  std::uint32_t number_ = 0;         // of the chunk at hand, damaged ones included
  std::uint32_t lost_count_ = 0;     // frames that no chunk has
  bool is_gap_ = false;              // frames may be missing before the next chunk that has any
  bool has_end_ = false;             // the last chunk is a mark of the end, though perhaps of another recording
  bool is_definition_lost_ = false;  // what later definitions are counted from is unknown
};

}  // namespace

std::string frames_in_words(const ChunkHeader& header) {
  if (header.is_end) return "with the end of " + std::to_string(header.first_frame) + " frames";
  if (header.frame_count == 0) return "without frames";
  if (header.frame_count == 1) return "with frame " + std::to_string(header.first_frame);
  return "with frames " + std::to_string(header.first_frame) + " to " +
         std::to_string(std::uint64_t{header.first_frame} + header.frame_count - 1);
}

Scan scan_chunks(FileBytes& file) { return Scanner(file).run(); }

}  // namespace cab::record
