// Memory that runs out, as a status: no exception leaves a call of cab::mpi.
#pragma once

#include <cab/types.h>

#include <exception>
#include <type_traits>

namespace cab::mpi {

// Calls work(), which returns a Status or nothing, and turns an exception into kOutOfMemory.
template <class Work>
Status or_out_of_memory(Work&& work) noexcept {
  try {
    if constexpr (std::is_void_v<decltype(work())>) {
      work();
      return Status::kOk;
    } else {
      return work();
    }
  } catch (const std::exception&) { return Status::kOutOfMemory; }
}

}  // namespace cab::mpi
