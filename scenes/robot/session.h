// One robot and its joints in an engine: which of its states collide, and how far links are apart.
#pragma once

#include "scenes/robot/kinematics.h"

#include <cab/collision_checker.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace cab::scenes {

// The exact test that a robot's shapes want.
Exact exact_test_of(const Robot& robot);

// Joint states in order: `fill` writes the state of an index below `count`.
struct StateSource {
  std::uint64_t count = 0;
  std::function<void(std::uint64_t, double*)> fill;
};

// What one chunk of states found.
struct StateChunk {
  std::uint64_t first = 0;
  std::uint32_t count = 0;
  Span<const Hit> hits;          // instance_a counts states from `first`; sorted by it
  Span<const Contact> contacts;  // [state][pair] of the named pairs
};

struct RobotSessionOptions {
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  Policies policies;
  float margin = 0;          // metres
  Span<const Robot> around;  // what stands around, each at rest
  // One length per link, in metres, by which it grows against what stands around (CollisionChecker::set_padding).
  // Empty: none.
  Span<const float> padding = {};
};

// States run in chunks, so memory stays bounded however many there are.
class RobotSession {
 public:
  // Links of ignored pairs are not tested. The robot must outlive the session. Throws std::runtime_error that names the
  // robot's shape and the engine's reason.
  RobotSession(const Robot& robot, Span<const LinkPair> ignored, const RobotSessionOptions& options);

  // The body of options.around that a hit is with, by its index; -1: both links are the robot's.
  std::int32_t around_of(const Hit& hit) { return checker_.fixed_of(hit); }

  Isa isa() const { return engine_isa(checker_.world().engine()); }
  std::uint32_t thread_count() const { return engine_thread_count(checker_.world().engine()); }

  // Tests all states and calls on_chunk for each chunk in order. `pairs` are the links whose contacts are computed;
  // both have a shape. Returns the sum of the stats of all frames.
  FrameStats run(const StateSource& states, const std::vector<LinkPair>& pairs,
                 const std::function<void(const StateChunk&)>& on_chunk);

 private:
  void require(Status status, const std::string& what) const;

  const Robot& robot_;
  Kinematics kinematics_;
  std::vector<std::vector<float>> around_poses_;
  CollisionChecker checker_;
};

}  // namespace cab::scenes
