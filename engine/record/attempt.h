// How calls of the public API, which throw nothing, run code that does.
#pragma once

#include <exception>
#include <new>
#include <stdexcept>
#include <string>

namespace cab::record {

// Why a call fails, in one line.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Calls work(storage), with a new storage if there is none. False if it throws; storage->error then says why, after the
// storage's path, unless there is no memory for that.
template <class Storage, class Work>
bool attempt(Storage*& storage, Work work) noexcept {
  if (storage == nullptr) storage = new (std::nothrow) Storage;
  if (storage == nullptr) return false;
  try {
    storage->error.clear();
    try {
      work(*storage);
      return true;
    } catch (const std::bad_alloc&) {
      storage->error = storage->path + ": an allocation failed";
    } catch (const std::exception& failure) { storage->error = storage->path + ": " + failure.what(); }
  } catch (...) {}  // no memory for the words
  return false;
}

template <class Storage>
const char* error_of(const Storage* storage) noexcept {
  return storage == nullptr ? "" : storage->error.c_str();
}

}  // namespace cab::record
