#include "engine/mpi/mail.h"

#include <algorithm>
#include <new>
#include <utility>

namespace cab::mpi {

Mail::Mail(MPI_Comm comm, std::int32_t rank_count, Bytes& spare) : comm_(comm), spare_(spare) {
  empty_requests_.reserve(kMessageKinds * static_cast<std::size_t>(rank_count));
}

void Mail::send(Bytes bytes, int to, MessageKind kind, MessageCount& count) {
  // All memory comes first.
  requests_.reserve(requests_.size() + bytes.size() / kPartBytes + 1);
  sent_.push_back(std::move(bytes));
  const Bytes& kept = sent_.back();
  for (std::size_t at = 0;; at += kPartBytes) {
    const std::size_t size = std::min(kPartBytes, kept.size() - at);
    MPI_Isend(kept.data() + at, static_cast<int>(size), MPI_BYTE, to, static_cast<int>(kind), comm_,
              &requests_.emplace_back());
    ++count.messages;
    count.bytes += size;
    if (size < kPartBytes) return;
  }
}

void Mail::send_nothing(int to, MessageKind kind, MessageCount& count) noexcept {
  MPI_Isend(nullptr, 0, MPI_BYTE, to, static_cast<int>(kind), comm_, &empty_requests_.emplace_back());
  ++count.messages;
}

Receipt Mail::receive(int from, MessageKind kind, Bytes& out) noexcept {
  out.clear();
  Receipt receipt = Receipt::kEmpty;
  for (;;) {
    MPI_Message message;
    MPI_Status status;
    int count = 0;
    MPI_Mprobe(from, static_cast<int>(kind), comm_, &message, &status);
    MPI_Get_count(&status, MPI_BYTE, &count);
    const auto size = static_cast<std::size_t>(count);
    const std::size_t at = out.size();
    if (receipt == Receipt::kEmpty && size > 0) receipt = Receipt::kWhole;
    if (receipt == Receipt::kWhole) {
      try {
        out.resize(at + size);
      } catch (const std::bad_alloc&) {
        receipt = Receipt::kDropped;
        out.clear();
      }
    }
    MPI_Mrecv(receipt == Receipt::kDropped ? spare_.data() : out.data() + at, count, MPI_BYTE, &message,
              MPI_STATUS_IGNORE);
    if (size < kPartBytes) return receipt;
  }
}

void Mail::wait_for_sent() noexcept {
  for (std::vector<MPI_Request>* const requests : {&requests_, &empty_requests_}) {
    MPI_Waitall(static_cast<int>(requests->size()), requests->data(), MPI_STATUSES_IGNORE);
    requests->clear();
  }
  sent_.clear();
}

}  // namespace cab::mpi
