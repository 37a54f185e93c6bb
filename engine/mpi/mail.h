// Messages between ranks: sent without waiting, counted, and received from ranks that are known to send.
#pragma once

#include <cab/mpi.h>

#include <cstddef>
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

class Mail {
 public:
  explicit Mail(MPI_Comm comm) : comm_(comm) {}
  Mail(const Mail&) = delete;
  Mail& operator=(const Mail&) = delete;

  // Begins to send; the bytes are kept until wait_for_sent.
  void send(Bytes bytes, int to, MessageKind kind, MessageCount& count);
  Bytes receive(int from, MessageKind kind) const;
  void wait_for_sent();

 private:
  MPI_Comm comm_;
  std::list<Bytes> sent_;
  std::vector<MPI_Request> requests_;
};

// The bytes of all ranks, one after the other, of which each gives its own. begins[r] is where those of rank r begin.
Bytes gather_all(MPI_Comm comm, const Bytes& own, std::vector<std::size_t>& begins);

}  // namespace cab::mpi
