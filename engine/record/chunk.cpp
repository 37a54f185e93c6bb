#include "engine/record/chunk.h"

#include <algorithm>

#include <cab/record.h>

#ifdef CAB_WITH_ZSTD
#include <zstd.h>
#endif

namespace cab::record {
namespace {

constexpr std::array<std::uint8_t, 8> kFileMagic = {'C', 'A', 'B', 'R', 'E', 'C', '\r', '\n'};
constexpr std::array<std::uint8_t, 4> kChunkMagic = {'C', 'H', 'N', 'K'};
constexpr std::uint16_t kHasDefinitions = 1, kIsEnd = 2;
constexpr std::size_t kCrcAt = 44;

// An offset, a table and its vtable.
constexpr std::uint64_t kLeastFrameBytes = 12;

// A block of zstd has at least 4 bytes, and decodes to at most 128 KiB (RFC 8878, 3.1.1.2).
constexpr std::uint64_t kMostDecodedPerByte = std::uint64_t{1} << 15;

template <class Number>
void put(std::uint8_t* at, Number number) {
  for (std::size_t k = 0; k < sizeof number; ++k)
    at[k] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(number) >> (8 * k));
}

template <class Number>
Number get(const std::uint8_t* at) {
  std::uint64_t number = 0;
  for (std::size_t k = 0; k < sizeof(Number); ++k) number |= std::uint64_t{at[k]} << (8 * k);
  return static_cast<Number>(number);
}

// tables[0][b]: the remainder of byte b; tables[k][b]: of byte b and k zero bytes after it.
using CrcTables = std::array<std::array<std::uint32_t, 256>, 8>;

constexpr CrcTables make_crc_tables() {
  CrcTables tables = {};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t rest = byte;
    for (int bit = 0; bit < 8; ++bit) rest = (rest >> 1) ^ ((rest & 1) != 0 ? 0xedb88320u : 0u);
    tables[0][byte] = rest;
  }
  for (std::size_t k = 1; k < tables.size(); ++k)
    for (std::size_t byte = 0; byte < 256; ++byte)
      tables[k][byte] = (tables[k - 1][byte] >> 8) ^ tables[0][tables[k - 1][byte] & 0xff];
  return tables;
}

constexpr CrcTables kCrcTables = make_crc_tables();

}  // namespace

std::uint32_t crc32(const std::uint8_t* bytes, std::size_t size, std::uint32_t before) {
  std::uint32_t rest = ~before;
  for (; size >= 8; bytes += 8, size -= 8) {
    const std::uint32_t low = rest ^ get<std::uint32_t>(bytes), high = get<std::uint32_t>(bytes + 4);
    rest = 0;
    for (std::size_t k = 0; k < 4; ++k)
      rest ^= kCrcTables[7 - k][(low >> (8 * k)) & 0xff] ^ kCrcTables[3 - k][(high >> (8 * k)) & 0xff];
  }
  for (; size > 0; ++bytes, --size) rest = (rest >> 8) ^ kCrcTables[0][(rest ^ *bytes) & 0xff];
  return ~rest;
}

std::array<std::uint8_t, kFileHeaderBytes> file_header() {
  std::array<std::uint8_t, kFileHeaderBytes> bytes = {};
  std::copy(kFileMagic.begin(), kFileMagic.end(), bytes.begin());
  put(bytes.data() + 8, kFormatVersion);
  return bytes;
}

std::string check_file_header(const std::uint8_t* bytes, std::uint64_t size) {
  if (size < kFileHeaderBytes || !std::equal(kFileMagic.begin(), kFileMagic.end(), bytes))
    return "it is not a recording of cab: it does not begin with CABREC";
  const auto version = get<std::uint32_t>(bytes + 8);
  if (version != kFormatVersion)
    return "it is a recording of format " + std::to_string(version) + ", and this library reads format " +
           std::to_string(kFormatVersion);
  return {};
}

std::array<std::uint8_t, kChunkHeaderBytes> to_bytes(const ChunkHeader& header) {
  std::array<std::uint8_t, kChunkHeaderBytes> bytes = {};
  std::uint8_t* const at = bytes.data();
  std::copy(kChunkMagic.begin(), kChunkMagic.end(), bytes.begin());
  put(at + 4, static_cast<std::uint16_t>(header.codec));
  put(at + 6,
      static_cast<std::uint16_t>((header.has_definitions ? kHasDefinitions : 0) | (header.is_end ? kIsEnd : 0)));
  put(at + 8, header.stored_bytes);
  put(at + 16, header.plain_bytes);
  put(at + 24, header.first_frame);
  put(at + 28, header.frame_count);
  put(at + 32, header.payload_crc);
  put(at + kCrcAt, crc32(at, kCrcAt));
  return bytes;
}

bool read_header(const std::uint8_t* bytes, ChunkHeader& header) {
  if (!std::equal(kChunkMagic.begin(), kChunkMagic.end(), bytes) ||
      get<std::uint32_t>(bytes + kCrcAt) != crc32(bytes, kCrcAt))
    return false;
  const auto codec = get<std::uint16_t>(bytes + 4);
  if (codec > static_cast<std::uint16_t>(Codec::kZstd)) return false;
  header.codec = static_cast<Codec>(codec);
  header.has_definitions = (get<std::uint16_t>(bytes + 6) & kHasDefinitions) != 0;
  header.is_end = (get<std::uint16_t>(bytes + 6) & kIsEnd) != 0;
  header.stored_bytes = get<std::uint64_t>(bytes + 8);
  header.plain_bytes = get<std::uint64_t>(bytes + 16);
  header.first_frame = get<std::uint32_t>(bytes + 24);
  header.frame_count = get<std::uint32_t>(bytes + 28);
  header.payload_crc = get<std::uint32_t>(bytes + 32);
  if (header.stored_bytes > kMostPayloadBytes || header.frame_count > header.plain_bytes / kLeastFrameBytes)
    return false;
  if (header.is_end && (header.has_definitions || header.plain_bytes > 0 || header.codec != Codec::kStored))
    return false;
  return header.codec == Codec::kStored ? header.stored_bytes == header.plain_bytes
                                        : header.plain_bytes <= kMostDecodedBytes &&
                                              header.plain_bytes <= header.stored_bytes * kMostDecodedPerByte;
}

ChunkHeader encode(std::vector<std::uint8_t>& payload, [[maybe_unused]] bool compress) {
  ChunkHeader header;
  header.plain_bytes = payload.size();
#ifdef CAB_WITH_ZSTD
  if (compress && payload.size() <= kMostDecodedBytes) {
    constexpr int kLevel = 3;
    std::vector<std::uint8_t> packed(ZSTD_compressBound(payload.size()));
    const std::size_t bytes = ZSTD_compress(packed.data(), packed.size(), payload.data(), payload.size(), kLevel);
    if (ZSTD_isError(bytes) == 0 && bytes < payload.size()) {
      packed.resize(bytes);
      payload = std::move(packed);
      header.codec = Codec::kZstd;
    }
  }
#endif
  header.stored_bytes = payload.size();
  header.payload_crc = crc32(payload.data(), payload.size());
  return header;
}

#ifdef CAB_WITH_ZSTD
bool decode(const ChunkHeader& header, const std::uint8_t* stored, std::vector<std::uint8_t>& plain,
            std::string& reason) {
  plain.resize(static_cast<std::size_t>(header.plain_bytes));
  const std::size_t bytes =
      ZSTD_decompress(plain.data(), plain.size(), stored, static_cast<std::size_t>(header.stored_bytes));
  if (ZSTD_isError(bytes) == 0 && bytes == plain.size()) return true;
  reason = "its zstd data is damaged";
  return false;
}
#else
bool decode(const ChunkHeader&, const std::uint8_t*, std::vector<std::uint8_t>&, std::string& reason) {
  reason = "it is compressed, and this build of the library has no zstd";
  return false;
}
#endif

}  // namespace cab::record
