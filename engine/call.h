// A call's binding of inputs to batches, shared by run_frame and compute_boxes.
#pragma once

#include "engine/engine.h"

namespace cab {

// Holds the engine for one call: refuses a second call, and forgets the caller's pointers at the end.
class Call {
 public:
  explicit Call(Engine& engine);
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
  bool admitted() const { return admitted_; }

  // Points a batch at a valid input until the call ends.
  void bind(const BatchInput& input);

 private:
  Engine& engine_;
  bool admitted_;
};

}  // namespace cab
