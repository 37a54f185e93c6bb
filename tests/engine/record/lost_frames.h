// What a small file may claim: more frames than anybody has time for, none of which can be read.
#pragma once

#include <cstdint>
#include <string>

#include "engine/record/chunk.h"

namespace cab::tests {

inline constexpr std::uint32_t kClaimedByGap = 1u << 24;

// A chunk of zeros, which is none, with a header that is sound.
inline std::string chunk_of_zeros(record::ChunkHeader header) {
  const std::string payload(static_cast<std::size_t>(header.stored_bytes), '\0');
  header.payload_crc = record::crc32(reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size());
  const auto bytes = record::to_bytes(header);
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()) + payload;
}

// What is appended to a recording of some frames to claim 2^24 more in each of 255 places: a damaged header, and a
// chunk of one frame behind them. That makes 22 kB.
inline std::string claimed_gaps(std::uint32_t frame_count) {
  std::string bytes;
  record::ChunkHeader header;
  header.stored_bytes = header.plain_bytes = 16;
  header.first_frame = frame_count;
  header.frame_count = 1;
  for (int gap = 0; gap < 255; ++gap) {
    header.first_frame += kClaimedByGap;
    bytes += std::string(8, '\0') + chunk_of_zeros(header);
    ++header.first_frame;
  }
  return bytes;
}

}  // namespace cab::tests
