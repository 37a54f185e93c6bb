// The bytes around the payloads of a recording. docs/recording.md has them as a table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::record {

inline constexpr std::size_t kFileHeaderBytes = 16;
inline constexpr std::size_t kChunkHeaderBytes = 48;

enum class Codec : std::uint16_t { kStored = 0, kZstd = 1 };

struct ChunkHeader {
  Codec codec = Codec::kStored;
  bool has_definitions = false;
  bool is_end = false;             // it marks the end of a recording of first_frame frames, and has no payload
  std::uint64_t stored_bytes = 0;  // of the payload in the file, without the zeros after it
  std::uint64_t plain_bytes = 0;   // of the payload when decoded
  std::uint32_t first_frame = 0;
  std::uint32_t frame_count = 0;
  std::uint32_t payload_crc = 0;
};

// Bytes of a payload and the zeros after it. Offsets of chunks are multiples of 8.
inline std::uint64_t padded(std::uint64_t bytes) { return (bytes + 7) & ~std::uint64_t{7}; }

// Payloads that decode to more than this are stored as they are, so a small file never decodes to a large one.
inline constexpr std::uint64_t kMostDecodedBytes = std::uint64_t{1} << 28;

// The most bytes of a payload: a FlatBuffer's offsets have 31 bits.
inline constexpr std::uint64_t kMostPayloadBytes = (std::uint64_t{1} << 31) - 64;

std::array<std::uint8_t, kFileHeaderBytes> file_header();
std::array<std::uint8_t, kChunkHeaderBytes> to_bytes(const ChunkHeader& header);

// Why the first bytes of a file are not those of a recording that this library reads; empty if they are.
std::string check_file_header(const std::uint8_t* bytes, std::uint64_t size);

// Whether 48 bytes are a header, unharmed. Its sizes need not fit the file.
bool read_header(const std::uint8_t* bytes, ChunkHeader& header);

// The payload as the file has it: compressed if that is wanted, possible and smaller.
ChunkHeader encode(std::vector<std::uint8_t>& payload, bool compress);

// Decodes a payload of kZstd. False if it is damaged, or if this build has no zstd; `reason` says which.
bool decode(const ChunkHeader& header, const std::uint8_t* stored, std::vector<std::uint8_t>& plain,
            std::string& reason);

// CRC-32 as zlib, gzip and PNG have it, of bytes that follow those whose CRC-32 is `before`.
std::uint32_t crc32(const std::uint8_t* bytes, std::size_t size, std::uint32_t before = 0);

}  // namespace cab::record
