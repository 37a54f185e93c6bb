// Results as bytes, from a child process to its parent on the same machine. A new type of payload needs two functions:
// one that writes its fields with a PayloadWriter, and one that reads them in the same order with a PayloadReader. See
// scenes/import/import_payload.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace cab::scenes {

// Bytes that are no payload of the type that is read.
class PayloadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline void require_payload(bool holds, const char* reason) {
  if (!holds) throw PayloadError(reason);
}

class PayloadWriter {
 public:
  // A number, an enumerator or a bool.
  template <class T>
  void value(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    append(&value, sizeof value);
  }

  void text(const std::string& text) {
    value(std::uint64_t{text.size()});
    append(text.data(), text.size());
  }

  template <class T>
  void array(const std::vector<T>& values) {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    value(std::uint64_t{values.size()});
    append(values.data(), values.size() * sizeof(T));
  }

  void texts(const std::vector<std::string>& all) {
    value(std::uint64_t{all.size()});
    for (const std::string& one : all) text(one);
  }

  std::string take() { return std::move(bytes_); }

 private:
  void append(const void* data, std::size_t size) {
    if (size > 0) bytes_.append(static_cast<const char*>(data), size);
  }

  std::string bytes_;
};

// Reads what a PayloadWriter wrote, from bytes that may be anything: each count is checked against the bytes that are
// left before memory is allocated for it. Every function throws PayloadError. The bytes must outlive the reader.
class PayloadReader {
 public:
  explicit PayloadReader(const std::string& bytes) : next_(bytes.data()), left_(bytes.size()) {}

  template <class T>
  T value() {
    static_assert(std::is_arithmetic_v<T>);
    static_assert(!std::is_same_v<T, bool>, "a bool has bytes that are no bool: read a std::uint8_t");
    T value;
    copy(&value, take(1, sizeof value));
    return value;
  }

  std::string text() {
    const std::size_t size = count(1);
    const char* const first = next_;
    take(size, 1);
    return {first, size};
  }

  template <class T>
  std::vector<T> array() {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    std::vector<T> values(count(sizeof(T)));
    copy(values.data(), take(values.size(), sizeof(T)));
    return values;
  }

  std::vector<std::string> texts() {
    std::vector<std::string> all(count(sizeof(std::uint64_t)));
    for (std::string& one : all) one = text();
    return all;
  }

  // The number of the items that follow, each of which takes at least least_bytes.
  std::size_t count(std::size_t least_bytes) {
    const auto items = value<std::uint64_t>();
    require_payload(items <= left_ / least_bytes, "a count is larger than the bytes that are left");
    return static_cast<std::size_t>(items);
  }

  // Nothing may be left at the end.
  void finish() const { require_payload(left_ == 0, "bytes are left over"); }

 private:
  struct Bytes {
    const char* first;
    std::size_t size;
  };

  Bytes take(std::size_t items, std::size_t item_bytes) {
    require_payload(items <= left_ / item_bytes, "the bytes end too early");
    const Bytes taken = {next_, items * item_bytes};
    next_ += taken.size;
    left_ -= taken.size;
    return taken;
  }

  static void copy(void* to, const Bytes& from) {
    if (from.size > 0) std::memcpy(to, from.first, from.size);
  }

  const char* next_;
  std::size_t left_;
};

}  // namespace cab::scenes
