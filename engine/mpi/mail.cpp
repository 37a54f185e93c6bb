#include "engine/mpi/mail.h"

#include <algorithm>
#include <utility>

namespace cab::mpi {
namespace {

// MPI counts bytes by int. A message that is longer goes in parts of this length; a shorter part, which may be empty,
// is the last one.
constexpr std::size_t kPart = std::size_t{1} << 30;

}  // namespace

void Mail::send(Bytes bytes, int to, MessageKind kind, MessageCount& count) {
  sent_.push_back(std::move(bytes));
  const Bytes& kept = sent_.back();
  for (std::size_t at = 0;; at += kPart) {
    const std::size_t size = std::min(kPart, kept.size() - at);
    MPI_Isend(kept.data() + at, static_cast<int>(size), MPI_BYTE, to, static_cast<int>(kind), comm_,
              &requests_.emplace_back());
    ++count.messages;
    count.bytes += size;
    if (size < kPart) return;
  }
}

Bytes Mail::receive(int from, MessageKind kind) const {
  Bytes out;
  for (;;) {
    MPI_Message message;
    MPI_Status status;
    int size = 0;
    MPI_Mprobe(from, static_cast<int>(kind), comm_, &message, &status);
    MPI_Get_count(&status, MPI_BYTE, &size);
    const std::size_t at = out.size();
    out.resize(at + static_cast<std::size_t>(size));
    MPI_Mrecv(out.data() + at, size, MPI_BYTE, &message, MPI_STATUS_IGNORE);
    if (static_cast<std::size_t>(size) < kPart) return out;
  }
}

void Mail::wait_for_sent() {
  MPI_Waitall(static_cast<int>(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
  requests_.clear();
  sent_.clear();
}

Bytes gather_all(MPI_Comm comm, const Bytes& own, std::vector<std::size_t>& begins) {
  int ranks = 0;
  MPI_Comm_size(comm, &ranks);
  std::vector<int> sizes(static_cast<std::size_t>(ranks)), offsets;
  const int size = static_cast<int>(own.size());
  MPI_Allgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, comm);
  int sum = 0;
  begins.clear();
  for (const int one : sizes) {
    offsets.push_back(sum);
    begins.push_back(static_cast<std::size_t>(sum));
    sum += one;
  }
  begins.push_back(static_cast<std::size_t>(sum));
  Bytes out(static_cast<std::size_t>(sum));
  MPI_Allgatherv(own.data(), size, MPI_BYTE, out.data(), sizes.data(), offsets.data(), MPI_BYTE, comm);
  return out;
}

}  // namespace cab::mpi
