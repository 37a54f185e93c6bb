// A call in progress: it locks the engine, and binds the caller's inputs to their batches.
#pragma once

#include "engine/session/engine.h"

#include <exception>
#include <utility>

namespace cab {

// Locks the engine for the duration of one call. The destructor unlocks it and clears the bindings, so that no pointer
// to the caller's memory outlives the call.
class Call {
 public:
  explicit Call(Engine& engine);
  ~Call();
  Call(Call&& other) noexcept : engine_(other.engine_), admitted_(std::exchange(other.admitted_, false)) {}
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
  // False if another call on the engine is running; then the engine must not be used.
  bool admitted() const { return admitted_; }

  // Binds a batch to its input, which must be valid, and computes the strides that the input leaves at 0. by_bounds:
  // whether the call reads bounds instead of poses.
  void bind(const BatchInput& input, bool by_bounds = false);

  // Lets go of all bindings, as the end of the call does.
  void unbind();

 private:
  Engine& engine_;
  bool admitted_;
};

// What a call answers for an exception. Called where it was caught.
Status status_of_exception() noexcept;

// Calls body(), which may allocate, and turns an exception into a status.
template <class Body>
Status guarded(Body&& body) noexcept {
  try {
    return body();
  } catch (const std::exception&) { return status_of_exception(); }
}

}  // namespace cab
