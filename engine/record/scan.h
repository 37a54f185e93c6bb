// Where the chunks of a recording are, by their headers, and what is cut off or damaged.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/record/chunk.h"
#include "engine/record/file_bytes.h"

namespace cab::record {

// A chunk, or frames that are lost by damage before them.
struct ChunkPlace {
  ChunkHeader header;
  std::uint64_t at = 0;  // of the header
  std::string damage;    // why it cannot be read; empty if it can
};

struct Scan {
  std::vector<ChunkPlace> chunks;     // by their first frames; one without frames begins where the next one does
  std::uint32_t frame_count = 0;      // up to the last chunk that has any
  std::vector<std::string> problems;  // one line each
  std::uint64_t whole = 0;            // up to the end of the last whole chunk
  bool is_closed = false;             // the last chunk is the mark of the end
  bool is_damaged = false;            // something else is wrong than that the last chunk is cut off
};

// Finds the chunks. Behind a damaged header it goes on where the next sound one is.
Scan scan_chunks(FileBytes& file);

// "with frames 3 to 5", and so on.
std::string frames_in_words(const ChunkHeader& header);

}  // namespace cab::record
