// Messages between ranks: sent without waiting, counted, and received from ranks that are known to send. A rank that
// runs out of memory still sends, though nothing, and still takes what is sent to it, so that no other waits for it.
#pragma once

#include <cab/mpi.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <list>
#include <type_traits>
#include <vector>

namespace cab::mpi {

using Bytes = std::vector<unsigned char>;

template <class T>
void append(Bytes& bytes, const T* values, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  const std::size_t at = bytes.size();
  bytes.resize(at + count * sizeof(T));
  if (count > 0) std::memcpy(bytes.data() + at, values, count * sizeof(T));
}
template <class T>
void append(Bytes& bytes, const T& value) {
  append(bytes, &value, 1);
}

// Reads what `append` wrote, from the front.
class Reader {
 public:
  explicit Reader(const Bytes& bytes) : at_(bytes.data()), end_(bytes.data() + bytes.size()) {}
  template <class T>
  void read(T* values, std::size_t count) {
    if (count > 0) std::memcpy(values, at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  template <class T>
  T read() {
    T value;
    read(&value, 1);
    return value;
  }
  bool at_end() const { return at_ == end_; }

 private:
  const unsigned char* at_;
  const unsigned char* end_;
};

// The kinds of messages between two ranks. The values are tags.
enum class MessageKind : int { kBounds = 1, kRequest = 2, kPoses = 3 };
inline constexpr std::size_t kMessageKinds = 3;

// A longer message goes in parts of this length; a shorter part, which may be empty, is the last one.
inline constexpr std::size_t kPartBytes = std::size_t{1} << 20;

enum class Receipt : std::uint8_t {
  kEmpty,    // a message without bytes
  kWhole,    // the bytes of a message
  kDropped,  // there was no memory for the bytes of a message
};

// The messages of one frame. Each rank sends at most one message of each kind to another rank.
class Mail {
 public:
  // spare: kPartBytes of memory, for messages that are dropped. Throws std::bad_alloc.
  Mail(MPI_Comm comm, std::int32_t rank_count, Bytes& spare);
  Mail(const Mail&) = delete;
  Mail& operator=(const Mail&) = delete;

  // Begins to send; the bytes are kept until wait_for_sent. Throws std::bad_alloc before anything is sent.
  void send(Bytes bytes, int to, MessageKind kind, MessageCount& count);
  // Begins to send a message without bytes. Allocates nothing.
  void send_nothing(int to, MessageKind kind, MessageCount& count) noexcept;
  // Takes a message. `out` is empty unless the receipt is kWhole.
  Receipt receive(int from, MessageKind kind, Bytes& out) noexcept;
  void wait_for_sent() noexcept;

 private:
  MPI_Comm comm_;
  Bytes& spare_;
  std::list<Bytes> sent_;
  std::vector<MPI_Request> requests_;        // of messages with bytes
  std::vector<MPI_Request> empty_requests_;  // of those without; never grows
};

}  // namespace cab::mpi
