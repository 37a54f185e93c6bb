// The bytes around payloads: checksums, headers, codecs.
#include "engine/record/chunk.h"

#include <doctest/doctest.h>

#include <string>

#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

namespace cab::tests {
namespace {

using namespace cab::record;

// Bit by bit, as the standard has it.
std::uint32_t slow_crc32(const std::vector<std::uint8_t>& bytes) {
  std::uint32_t rest = ~0u;
  for (const std::uint8_t byte : bytes)
    for (int bit = 0; bit < 8; ++bit) {
      const bool odd = ((rest ^ (static_cast<std::uint32_t>(byte) >> bit)) & 1) != 0;
      rest = (rest >> 1) ^ (odd ? 0xedb88320u : 0);
    }
  return ~rest;
}

TEST_CASE("the checksum is that of zlib") {
  const std::string digits = "123456789";
  CHECK(crc32(reinterpret_cast<const std::uint8_t*>(digits.data()), digits.size()) == 0xcbf43926u);
  CHECK(crc32(nullptr, 0) == 0);
  const std::uint32_t half = crc32(reinterpret_cast<const std::uint8_t*>(digits.data()), 4);
  CHECK(crc32(reinterpret_cast<const std::uint8_t*>(digits.data()) + 4, 5, half) == 0xcbf43926u);
  oracle::Random random(721);
  for (std::uint64_t round = 0; round < rounds(200); ++round) {
    std::vector<std::uint8_t> bytes(random.index(80));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
    CHECK(crc32(bytes.data(), bytes.size()) == slow_crc32(bytes));
  }
}

TEST_CASE("a header is read as it was written, and no changed bit goes unseen") {
  ChunkHeader header;
  header.codec = Codec::kZstd;
  header.has_definitions = true;
  header.stored_bytes = 0x12345678u;
  header.plain_bytes = 0xabcdef0u;
  header.first_frame = 0xfedcba98u;
  header.frame_count = 77;
  header.payload_crc = 0x01020304u;
  auto bytes = to_bytes(header);
  ChunkHeader read;
  REQUIRE(read_header(bytes.data(), read));
  CHECK(read.codec == header.codec);
  CHECK(read.has_definitions);
  CHECK(read.stored_bytes == header.stored_bytes);
  CHECK(read.plain_bytes == header.plain_bytes);
  CHECK(read.first_frame == header.first_frame);
  CHECK(read.frame_count == header.frame_count);
  CHECK(read.payload_crc == header.payload_crc);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << bit % 8));
    CHECK_FALSE(read_header(bytes.data(), read));
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << bit % 8));
  }
}

TEST_CASE("a mark of the end is read, and has no payload, frames or definitions") {
  const auto is_read = [](const ChunkHeader& header) {
    const auto bytes = to_bytes(header);
    ChunkHeader read;
    return read_header(bytes.data(), read) && read.is_end && read.first_frame == header.first_frame;
  };
  ChunkHeader end;
  end.is_end = true;
  end.first_frame = 41;
  CHECK(is_read(end));
  ChunkHeader wrong = end;
  wrong.has_definitions = true;
  CHECK_FALSE(is_read(wrong));
  wrong = end;
  wrong.stored_bytes = wrong.plain_bytes = 24;
  CHECK_FALSE(is_read(wrong));
  wrong.frame_count = 1;
  CHECK_FALSE(is_read(wrong));
  wrong = end;
  wrong.codec = Codec::kZstd;
  CHECK_FALSE(is_read(wrong));
}

TEST_CASE("sizes that no chunk has are refused") {
  const auto is_read = [](Codec codec, std::uint64_t stored, std::uint64_t plain) {
    ChunkHeader header, read;
    header.codec = codec;
    header.stored_bytes = stored;
    header.plain_bytes = plain;
    const auto bytes = to_bytes(header);
    return read_header(bytes.data(), read);
  };
  CHECK(is_read(Codec::kStored, 100, 100));
  CHECK_FALSE(is_read(Codec::kStored, 100, 101));
  CHECK_FALSE(is_read(Codec::kStored, ~std::uint64_t{0}, ~std::uint64_t{0}));
  CHECK(is_read(Codec::kZstd, 10000, kMostDecodedBytes));
  CHECK_FALSE(is_read(Codec::kZstd, 10000, kMostDecodedBytes + 1));
  CHECK(is_read(Codec::kZstd, 100, 100 << 15));
  CHECK_FALSE(is_read(Codec::kZstd, 100, (100 << 15) + 1));
}

TEST_CASE("the header of what packs best is read") {
  for (const std::size_t size : {std::size_t{1} << 17, std::size_t{1} << 20, std::size_t{1} << 24}) {
    std::vector<std::uint8_t> payload(size);
    const ChunkHeader header = encode(payload, true);
    if (header.codec == Codec::kZstd) CHECK(payload.size() < size / 1000);
    const auto bytes = to_bytes(header);
    ChunkHeader read;
    CHECK(read_header(bytes.data(), read));
  }
}

TEST_CASE("a payload decodes to what was encoded") {
  oracle::Random random(722);
  for (const bool compress : {false, true})
    for (const std::size_t size : {std::size_t{8}, std::size_t{1000}, std::size_t{100000}}) {
      std::vector<std::uint8_t> given(size);
      for (std::uint8_t& byte : given) byte = static_cast<std::uint8_t>(random.index(4));
      std::vector<std::uint8_t> payload = given;
      const ChunkHeader header = encode(payload, compress);
      CHECK(header.plain_bytes == size);
      CHECK(header.stored_bytes == payload.size());
      CHECK(header.payload_crc == slow_crc32(payload));
      if (header.codec == Codec::kStored) {
        CHECK(payload == given);
        continue;
      }
      CHECK(payload.size() < size);
      std::vector<std::uint8_t> plain;
      std::string reason;
      CHECK(decode(header, payload.data(), plain, reason));
      CHECK(plain == given);
      ChunkHeader shorter = header;
      --shorter.plain_bytes;
      CHECK_FALSE(decode(shorter, payload.data(), plain, reason));
      CHECK(reason == "its zstd data is damaged");
    }
}

}  // namespace
}  // namespace cab::tests
