// States of a robot in an engine: which links touch in which state, and how far named links are apart.
#pragma once

#include <cab/cab.h>

#include <cstdint>
#include <functional>
#include <vector>

#include "perf/harness/engine_ptr.h"
#include "scenes/robot/kinematics.h"

namespace cab::perf {

// States 0 .. count - 1. fill(i, state) writes the value of each of the robot's variables in state i.
struct StateSource {
  std::uint64_t count = 0;
  std::function<void(std::uint64_t index, double* state)> fill;
};

// The results for some states that follow each other.
struct StateChunk {
  std::uint64_t first = 0;       // the first state
  std::uint32_t count = 0;       // how many states
  Span<const Hit> hits;          // instance_a counts states from `first`; sorted
  Span<const Contact> contacts;  // [state][pair] of the named pairs
};

struct RobotSessionOptions {
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  Policies policies;
};

// One robot in an engine. States run in chunks, so memory stays bounded however many there are.
class RobotSession {
 public:
  // Links of ignored pairs are not tested. The robot must outlive the session. Throws std::runtime_error that names the
  // robot's shape and the engine's reason.
  RobotSession(const scenes::Robot& robot, std::vector<LinkPair> ignored, const RobotSessionOptions& options);

  Isa isa() const { return engine_isa(*engine_); }
  std::uint32_t thread_count() const { return engine_thread_count(*engine_); }

  // Tests all states and calls on_chunk for each chunk in order. `pairs` are the links whose contacts are computed;
  // both have a shape. Returns the sum of the stats of all frames.
  FrameStats run(const StateSource& states, const std::vector<LinkPair>& pairs,
                 const std::function<void(const StateChunk&)>& on_chunk);

 private:
  std::size_t run_hits(const BatchInput& input, FrameStats& sum);

  const scenes::Robot& robot_;
  scenes::Kinematics kinematics_;
  Policies policies_;
  oracle::EnginePtr engine_;
  std::uint32_t chunk_ = 0;  // states per chunk, and instances of the batch
  BatchId batch_;
  std::vector<Hit> hits_;
};

}  // namespace cab::perf
