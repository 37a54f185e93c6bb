// Statuses as exceptions of Python.
#pragma once

#include <cab/types.h>

#include <string>

namespace cab::python {

// Raises the exception of cab/_errors.py for a status: its words, then `detail` if it is not empty.
[[noreturn]] void raise_status(Status status, const std::string& detail = {});

// Raises the exception of a status with another message than its words.
[[noreturn]] void raise_message(Status status, const std::string& message);

// Raises unless the status is kOk.
inline void require(Status status, const std::string& detail = {}) {
  if (status != Status::kOk) raise_status(status, detail);
}

// "<what> <index>", for a status that has to do with one element.
std::string element(const char* what, std::size_t index);

}  // namespace cab::python
