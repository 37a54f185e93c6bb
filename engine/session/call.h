// A call in progress: it locks the engine, and binds the caller's inputs to their batches.
#pragma once

#include "engine/session/engine.h"

#include <exception>
#include <utility>

namespace cab {

// How a call reads the engine beside other reads.
enum class Access {
  kReads,             // with the engine's threads unless another one has them
  kReadsOnOneThread,  // leaving these threads to others if it can
};

// Holds the engine for the duration of one call. The destructor lets go of it and clears the bindings, so that no
// pointer to the caller's memory outlives the call.
class Call {
 public:
  // A call that changes the engine, and so is the only one that runs.
  explicit Call(Engine& engine);
  // A call that reads. Throws std::bad_alloc, since beside others there may be no reader for it yet.
  Call(Engine& engine, Access access);
  ~Call();
  Call(Call&& other) noexcept
      : engine_(other.engine_), reader_(other.reader_), admitted_(std::exchange(other.admitted_, false)) {}
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
  // False if another call holds the engine; then the engine must not be used.
  bool admitted() const { return admitted_; }

  // Of a call that reads.
  Reader& reader() const { return *reader_; }

  // All batches of the engine. For a read, its reader's copies: only those are valid that it has bound or copied.
  StoredBatches batches() const { return reader_ ? StoredBatches(reader_->batches) : engine_.stored_batches(); }
  InstanceBatch& batch(BatchId id) const { return batches()[slot_of(id).value - 1]->batch; }

  // Returns what the steps of a read read. They do not read the strategy.
  FrameContext context(const Policies& policies, float margin) const {
    return {*engine_.kernels, batches(), engine_.paired, policies, margin, Report::kHits};
  }

  // Binds a batch to its input, which must be valid, and computes the strides that the input leaves at 0. by_bounds:
  // whether the call reads bounds instead of poses.
  void bind(const BatchInput& input, bool by_bounds = false);

  // Copies a batch for a read that looks at what is stored of it without binding it.
  void copy_stored(std::size_t index);

  // Stores the bounds of a batch as the last frame had them, if the crowd has them still (store_crowd_bounds).
  void store_last_bounds(std::size_t index);

  // Lets go of all bindings, as the end of the call does.
  void unbind();

 private:
  Engine& engine_;
  Reader* reader_ = nullptr;
  bool admitted_ = false;
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
