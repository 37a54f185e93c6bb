// The hash that names the bits of poses and of results.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace cab::scenes {

// FNV-1a over the bits of numbers, lowest byte first on every machine.
class BitHash {
 public:
  void add(std::uint32_t value) { add_bits<std::uint32_t>(value); }
  void add(float value) { add_bits<std::uint32_t>(value); }
  void add(double value) { add_bits<std::uint64_t>(value); }
  std::uint64_t value() const { return value_; }

 private:
  template <class Bits, class Value>
  void add_bits(Value value) {
    static_assert(sizeof(Bits) == sizeof(Value));
    Bits bits;
    std::memcpy(&bits, &value, sizeof bits);
    for (std::size_t byte = 0; byte < sizeof bits; ++byte) {
      value_ ^= static_cast<std::uint64_t>((bits >> (8 * byte)) & 0xff);
      value_ *= 0x100000001b3u;  // FNV's 64-bit prime
    }
  }

  std::uint64_t value_ = 0xcbf29ce484222325u;  // FNV's 64-bit offset basis
};

}  // namespace cab::scenes
