// An FNV-1a hash of bits, the same on every machine. Different poses, boxes or hits give different hashes, except by
// rare coincidence.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <cstring>

namespace cab {

// Hashes the bits of numbers, lowest byte first, so that -0 and 0 differ.
class BitHash {
 public:
  void add(std::uint32_t number) { add_bytes(number, 4); }
  void add(std::uint64_t number) { add_bytes(number, 8); }
  void add(float number) { add(bits<std::uint32_t>(number)); }
  void add(double number) { add(bits<std::uint64_t>(number)); }
  void add(const Box& box) {
    for (const float x : box.center) add(x);
    for (const auto& axis : box.axis)
      for (const float x : axis) add(x);
    for (const float x : box.half) add(x);
  }
  std::uint64_t value() const { return value_; }

 private:
  void add_bytes(std::uint64_t number, int count) {
    for (int byte = 0; byte < count; ++byte) value_ = (value_ ^ ((number >> (8 * byte)) & 0xffu)) * 0x100000001b3u;
  }

  template <class Bits, class Value>
  static Bits bits(Value value) {
    static_assert(sizeof(Bits) == sizeof(Value));
    Bits out;
    std::memcpy(&out, &value, sizeof out);
    return out;
  }

  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace cab
