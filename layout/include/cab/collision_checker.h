// CollisionChecker: which states of a robot's joints collide, with the robot itself and with what stands around it.
//
//   cab::CollisionChecker checker;
//   status = checker.set_robot(body, kinematics);       // such as desc() and kinematics() of cab::files::Robot
//   status = checker.add_fixed(table, table_poses);     // as often as there are things around it
//   status = checker.check(states, answers);            // any number of states, in one call
//
// A World of sequences with forward kinematics before it; its conventions on errors, threads and memory hold. Shapes
// are tested exactly (Exact::kConvex). world().job() has the policies, and the margin that links keep at least.
#pragma once

#include <cab/world.h>

namespace cab {

// What is known of a state.
enum class StateAnswer : std::uint8_t {
  kFree,       // no tested pair of links touches
  kColliding,  // at least one does
  kNotTested,  // one of its numbers is not finite, or moves a link beyond 1e18
};

// One robot, its joints, and fixed bodies.
class CollisionChecker {
 public:
  // Makes the engine, as create_engine does. If that fails there is none, and status() says why.
  explicit CollisionChecker(const EngineDesc& desc = {}) noexcept : world_(desc) {
    world_.job().policies.exact = Exact::kConvex;
  }

  Status status() const noexcept { return world_.status(); }

  // The world, for policies, margins, contacts (want_contacts) and what has no function here. Its batches, rules,
  // `report` and what its inputs are bound to are those of this class.
  World& world() noexcept { return world_; }
  const World& world() const noexcept { return world_; }

  // Sets the robot, once. desc.ignored_pairs are not tested. `kinematics` has the links of desc, and points into arrays
  // of the caller, which stay as they are as long as this object is used. If desc is refused, *bad_leaf (may be null)
  // says which leaf is at fault.
  // Statuses: kBatchGivenTwice (there is a robot), kBadJoint (kinematics is wrong, or has other links than desc), those
  // of cab::compute_link_poses, add_articulation and add_batch.
  [[nodiscard]] Status set_robot(const ArticulationDesc& desc, const KinematicsDesc& kinematics,
                                 std::uint32_t* bad_leaf = nullptr) noexcept;

  // Adds a body that stands still in the robot's frame, after the robot. poses: 7 numbers per link of it
  // (PoseFormat::kQuaternionTranslation), borrowed as `kinematics` is.
  // Statuses: kUnknownBatch (there is no robot), kBadPoses (poses is too short, or no pose), those of add_articulation
  // and add_batch.
  [[nodiscard]] Status add_fixed(const ArticulationDesc& desc, Span<const float> poses,
                                 std::uint32_t* bad_leaf = nullptr) noexcept;

  // Answers for each state whether it collides. states: kinematics.variable_count numbers for each answer. A state is
  // done at its first touching pair.
  // Statuses: kUnknownBatch (there is no robot), kBadOutput (the sizes do not fit), those of run_frame.
  [[nodiscard]] Status check(Span<const double> states, Span<StateAnswer> answers) noexcept;

  // Finds the touching links of `count` states, at most chunk(). world().hits() has them: instance_a is the number of a
  // state. After world().want_contacts() there are contacts too.
  // Statuses: kUnknownBatch (there is no robot), kBadCount (count is above chunk()), kBadOutput (states is not
  // variable_count numbers for each), those of run_frame.
  [[nodiscard]] Status find_hits(Span<const double> states, std::uint32_t count) noexcept;

  // How many states are tested at a time: 16 to 1024.
  std::uint32_t chunk() const noexcept { return chunk_; }

  // One InstanceFlag per state of the last find_hits: kInstanceOk, or why it was not tested.
  Span<const std::uint8_t> flags() const noexcept { return {flags_.get(), flag_count_}; }

 private:
  Status run(Span<const double> states, std::uint32_t count, Report report, Span<std::uint8_t> in_contact) noexcept;

  // The most states of a chunk, and the most links of all its states: their poses stay in a core's cache.
  static constexpr std::size_t kMostStates = 1024, kMostLinks = 16384;

  World world_;
  BatchId robot_;
  KinematicsDesc kinematics_;
  std::uint32_t chunk_ = 0;
  std::unique_ptr<float[]> poses_;         // of a chunk
  std::unique_ptr<std::uint8_t[]> flags_;  // of a chunk
  std::size_t flag_count_ = 0;
};

inline Status CollisionChecker::set_robot(const ArticulationDesc& desc, const KinematicsDesc& kinematics,
                                          std::uint32_t* bad_leaf) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (robot_.value) return Status::kBatchGivenTwice;
  if (const Status status = compute_link_poses(kinematics, {}, Isa::kAuto, {}); status != Status::kOk) return status;
  const std::size_t links = kinematics.link_parents.size;
  if (links != desc.link_parents.size) return Status::kBadJoint;
  // Whole tiles of sixteen.
  const std::size_t chunk = std::max<std::size_t>(std::min(kMostStates, kMostLinks / links) / 16, 1) * 16;
  poses_.reset(new (std::nothrow) float[7 * links * chunk]);
  flags_.reset(new (std::nothrow) std::uint8_t[chunk]);
  if (!poses_ || !flags_) return Status::kOutOfMemory;
  BatchId robot;
  const auto count = static_cast<std::uint32_t>(chunk);
  Status status = world_.add_batch(desc, count, &robot, bad_leaf, BatchKind::kSequence);
  if (status == Status::kOk) status = world_.add_rule({robot, robot, Pairing::kWithin});
  if (status != Status::kOk) return status;
  robot_ = robot;
  kinematics_ = kinematics;
  chunk_ = count;
  world_.input(robot)->poses.data = poses_.get();
  return Status::kOk;
}

inline Status CollisionChecker::add_fixed(const ArticulationDesc& desc, Span<const float> poses,
                                          std::uint32_t* bad_leaf) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  if (!poses.data || poses.size != 7 * desc.link_parents.size) return Status::kBadPoses;
  BatchId body;
  Status status = world_.add_batch(desc, 1, &body, bad_leaf, BatchKind::kSequence);
  if (status != Status::kOk) return status;
  BatchInput& input = *world_.input(body);
  input.poses.data = poses.data;
  MaskReason reason;
  status = why_masked(world_.engine(), input, 0, &reason);
  if (status == Status::kOk && reason.cause != MaskCause::kNone) status = Status::kBadPoses;
  if (status == Status::kOk) status = world_.add_rule({robot_, body});
  if (status != Status::kOk) (void)world_.remove_batch(body);
  return status;
}

// Poses and tests at most a chunk of states.
inline Status CollisionChecker::run(Span<const double> states, std::uint32_t count, Report report,
                                    Span<std::uint8_t> in_contact) noexcept {
  flag_count_ = 0;
  const Span<float> poses = {poses_.get(), 7 * kinematics_.link_parents.size * count};
  Status status = compute_link_poses(kinematics_, states, engine_isa(world_.engine()), poses);
  if (status != Status::kOk) return status;
  BatchInput& input = *world_.input(robot_);
  input.count = count;
  input.flags = {flags_.get(), count};
  input.in_contact = in_contact;
  world_.job().report = report;
  status = world_.run();
  if (status == Status::kOk) flag_count_ = count;
  return status;
}

inline Status CollisionChecker::find_hits(Span<const double> states, std::uint32_t count) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  if (count > chunk_) return Status::kBadCount;
  return run(states, count, Report::kHits, {});
}

inline Status CollisionChecker::check(Span<const double> states, Span<StateAnswer> answers) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  const std::size_t variables = kinematics_.variable_count, count = answers.size;
  if (states.size != count * variables || (states.size && !states.data) || (count && !answers.data))
    return Status::kBadOutput;
  for (std::size_t first = 0; first < count; first += chunk_) {
    const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(chunk_, count - first));
    StateAnswer* const out = answers.data + first;
    // kFree and kColliding are the values of in_contact.
    const Status status = run({states.data + first * variables, size * variables}, size, Report::kInContact,
                              {reinterpret_cast<std::uint8_t*>(out), size});
    if (status != Status::kOk) return status;
    for (std::size_t i = 0; i < size; ++i)
      if (flags_[i] != kInstanceOk) out[i] = StateAnswer::kNotTested;
  }
  return Status::kOk;
}

}  // namespace cab
