// A number by which ranks compare what they were given: FNV-1a over the bytes of what is added.
#pragma once

#include <cab/types.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace cab::mpi {

class Digest {
 public:
  void add_bytes(const void* data, std::size_t size) {
    const auto* const bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
  }
  // For numbers and structs of equal numbers, which have no padding.
  template <class T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(&value, sizeof value);
  }
  template <class T>
  void add_all(Span<const T> values) {
    add(values.size);
    if (values.data) add_bytes(values.data, values.size * sizeof(T));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace cab::mpi
