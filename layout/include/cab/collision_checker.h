// CollisionChecker: which states of a robot's joints collide, with the robot itself and with what stands around it.
//
//   cab::CollisionChecker checker;
//   status = checker.set_robot(body, kinematics);       // such as desc() and kinematics() of cab::files::Robot, or of
//                                                       // cab::AttachedObject: a robot that holds something
//   status = checker.set_padding(body, lengths);        // if its links are to keep off what stands around
//   status = checker.add_fixed(table, table_poses);     // as often as there are things around it
//   status = checker.check(states, answers);            // any number of states, in one call
//
// A World of sequences with forward kinematics before it; its conventions on errors, threads and memory hold. Shapes
// are tested exactly: by Exact::kConvex, and by Exact::kSurface once something has leaves of triangles. These have no
// depths and no distances. world().job() has the policies, and the margin that links keep at least.
#pragma once

#include <cab/distance_gradient.h>
#include <cab/motion_bound.h>
#include <cab/padded_leaves.h>
#include <cab/world.h>

#include <limits>

namespace cab {

// What is known of a state.
enum class StateAnswer : std::uint8_t {
  kFree,       // no tested pair of links touches
  kColliding,  // at least one does
  kNotTested,  // one of its numbers is not finite, or moves a link beyond 1e18
};

// What is known of a motion.
enum class MotionAnswer : std::uint8_t {
  kFree,       // no tested pair of links touches at any moment: this is proven, not sampled
  kColliding,  // at least one does, at some moment
  kTooClose,   // neither: somewhere links come so near to each other that the resolution decides nothing
  kNotTested,  // a number is not finite, or it and the margin move links by more than 5e17
};

// How check_motions goes about it.
struct MotionSearch {
  // A length in the robot's unit, above 0 and at most 1e18. Part of a motion in which no link moves farther against
  // another is not divided further.
  double resolution = 1e-3;

  // One number per motion: of kColliding and kTooClose the first moment, 0 to 1, at which links touch or, to the
  // resolution, may touch. Before it the motion is proven free. Not written of others. Empty (default): a motion is
  // done at any moment at which links touch.
  Span<double> first_moments;

  // Output: how many tests of a state there were.
  std::uint64_t state_count = 0;
};

// The two links of a state that are nearest to each other, or deepest in each other.
struct NearestLinks {
  float distance = 0;        // in the robot's unit; below 0: less the depth. Infinity: none are as near as was asked
                             // for. NaN: the state was not tested, as by StateAnswer::kNotTested
  std::int32_t fixed = -1;   // what link_b is of, as CollisionChecker::fixed_of; -1: the robot
  std::uint32_t link_a = 0;  // a link of the robot
  std::uint32_t link_b = 0;  // a link, or of points the number of one
  float normal[3] = {};      // of length 1, from a to b, in the robot's frame
  float point_a[3] = {};     // the nearest or deepest point of a, in the robot's frame
  float point_b[3] = {};     // the same of b
};

// One robot, its joints, and fixed bodies.
class CollisionChecker {
 public:
  // Makes the engine, as create_engine does. If that fails there is none, and status() says why.
  explicit CollisionChecker(const EngineDesc& desc = {}) noexcept : world_(desc) {
    world_.job().policies.exact = Exact::kConvex;
  }

  // kOk if there is an engine, else why there is none.
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

  // Grows the links of the robot by lengths: against all that add_fixed and add_points add, not against each other, as
  // MoveIt does. Once, after the robot and before all else. desc: that of set_robot. padding: one length for each link,
  // 0 to kMaxCoordinate, in the robot's unit, beside the margin. What shapes become: PaddedLeaves. Hits, depths,
  // distances and motions are those of the grown links. If desc is refused, *bad_leaf (may be null) says which leaf.
  // Cost: the robot is posed twice for each state.
  // Statuses: kUnknownBatch (there is no robot), kBatchGivenTwice (there is padding, or something around), kBadMargin
  // (padding is not one such length for each link), kBadJoint (desc is not that of the robot), those of
  // PaddedLeaves::set (kSkinNotTaken: a leaf has triangles), add_articulation and add_batch.
  [[nodiscard]] Status set_padding(const ArticulationDesc& desc, Span<const float> padding,
                                   std::uint32_t* bad_leaf = nullptr) noexcept;

  // Adds a body that stands still in the robot's frame, after the robot. poses: 7 numbers per link of it
  // (PoseFormat::kQuaternionTranslation), borrowed as `kinematics` is.
  // Statuses: kUnknownBatch (there is no robot), kBadPoses (poses is too short, or no pose), those of add_articulation
  // and add_batch.
  [[nodiscard]] Status add_fixed(const ArticulationDesc& desc, Span<const float> poses,
                                 std::uint32_t* bad_leaf = nullptr) noexcept;

  // Adds points that stand still in the robot's frame, such as those of a depth camera, after the robot, each as a
  // ball. points: x y z for each; not read after the call. A hit with one has fixed_of() of these points, and the
  // number of the point as instance_b. The fewer points, the faster are frames. If a point is not finite, *bad_point
  // (may be null) says which.
  // Cost: 0.2 microseconds per point; then a frame 7 ns per point, and a state 3 to 90 microseconds, by their number.
  // Statuses: kUnknownBatch (there is no robot), kBadStaticBody (points is not three finite numbers for each),
  // kBadShape (the radius is not above 0, or above 5e17), kNoInstances (there are no points), kTooManyInstances, those
  // of add_static_batch and add_batch.
  [[nodiscard]] Status add_points(Span<const float> points, float radius, std::uint32_t* bad_point = nullptr) noexcept;

  // Answers for each state whether it collides. states: kinematics.variable_count numbers for each answer. A state is
  // done at its first touching pair.
  // Statuses: kUnknownBatch (there is no robot), kBadOutput (the sizes do not fit), those of run_frame.
  [[nodiscard]] Status check(Span<const double> states, Span<StateAnswer> answers) noexcept;

  // Finds the touching links of `count` states, at most chunk(). world().hits() has them: instance_a is the number of a
  // state. Those of links with padding and those with points come after all others, each sorted by states. After
  // world().want_contacts() there are contacts too.
  // Statuses: kUnknownBatch (there is no robot), kBadCount (count is above chunk()), kBadOutput (states is not
  // variable_count numbers for each), those of run_frame (kSkinNotTaken: contacts of triangles).
  [[nodiscard]] Status find_hits(Span<const double> states, std::uint32_t count) noexcept;

  // Answers for each motion whether links touch on the way: every variable goes linearly from its value in `from` to
  // that in `to`, each variable_count numbers per motion. The motion is divided into sixteen intervals. In the middle
  // of each a state is tested with a margin of what links can move against each other until its ends. If none is within
  // it, the interval is free, else it is divided into four. The margin of world().job() is kept besides. If the status
  // is not kOk the answers are not to be read.
  // Cost: 18 states for a motion in the open. Where links slide along each other all the way, some four times the
  // length that they move divided by the resolution.
  // Memory: 6 bytes per pair of links, and 80 kB at first use.
  // Statuses: kUnknownBatch (there is no robot), kBadOutput (sizes do not fit), kBadResolution, kBadShape (the robot
  // has a half space), kSkinNotTaken (triangles of a leaf are moved by other links), those of run_frame.
  [[nodiscard]] Status check_motions(Span<const double> from, Span<const double> to, Span<MotionAnswer> answers,
                                     MotionSearch& search) noexcept;

  // Finds the nearest two tested links of each state, among those that are at most `most` apart. Distances are those of
  // the shapes themselves; world().job().margin plays no part. states: kinematics.variable_count numbers for each of
  // `nearest`. gradients (may be empty): as many numbers, how the distance changes with each variable while the nearest
  // points stay where they are on their links; 0 where the distance is infinite or NaN.
  // Cost: some times that of find_hits, the less the nearer links are.
  // Statuses: kUnknownBatch (there is no robot), kBadOutput (sizes do not fit), kBadMargin (`most` is below 0, above
  // 1e18 or NaN), those of run_frame (kSkinNotTaken: a leaf has triangles).
  [[nodiscard]] Status find_nearest(Span<const double> states, Span<NearestLinks> nearest, float most,
                                    Span<double> gradients = {}) noexcept;

  // Which fixed body, or set of points, a hit is with, in the order of add_fixed and add_points; -1: both links are the
  // robot's.
  std::int32_t fixed_of(const Hit& hit) noexcept {
    const auto number = static_cast<std::int32_t>(world_.input(hit.batch_b) - world_.inputs().data);
    return number == 0 ? -1 : number - (number > among_points_ ? 2 : 1) - (padded_.batch.value ? 1 : 0);
  }

  // How many states are tested at a time: 64 to 1024.
  std::uint32_t chunk() const noexcept { return chunk_; }

  // One InstanceFlag per state of the last find_hits: kInstanceOk, or why it was not tested. Empty after other calls.
  Span<const std::uint8_t> flags() const noexcept { return {flags_.get(), flag_count_}; }

 private:
  void test_triangles_of(const ArticulationDesc& desc) noexcept;
  Status read_bound(const ArticulationDesc& desc) noexcept;
  Status run(Span<const double> states, std::uint32_t count, Report report, Span<std::uint8_t> in_contact) noexcept;

  // Part of a motion that is not known to be free.
  struct Interval {
    std::size_t motion;
    double begin, end;        // moments
    double length, rounding;  // detail::MotionBound's of the whole motion
  };
  // How many states of motions are tested at a time, how small, as a power of two, parts of a motion may become, and
  // how many may wait.
  static constexpr std::uint32_t kMotionStates = 64, kMostDivisions = 50, kMostIntervals = 2048;
  // Into how many parts a motion is divided at first, and an interval that is not known to be free: more than two,
  // since the lanes of a tile are there even for one motion.
  static constexpr std::uint32_t kFirstParts = 16, kParts = 4;

  struct Motions;
  Status begin_motions(Motions& motions) noexcept;
  void push_parts(const Interval& interval, std::uint32_t parts, std::uint32_t count, Motions& motions) noexcept;
  Status divide(Motions& motions) noexcept;
  static double margin_of(const Interval& interval) noexcept;
  Status test_states(Span<const double> states, std::uint32_t count, double margin) noexcept;
  Status find_nearest_of(Span<const double> states, Span<NearestLinks> nearest, float most, double* gradients) noexcept;
  void read_nearest(const double* states, const std::uint32_t* state_of, NearestLinks* nearest,
                    double* gradients) noexcept;

  // The most states of a chunk, and the most links of all its states: their poses stay in a core's cache.
  static constexpr std::size_t kMostStates = 1024, kMostLinks = 16384;

  World world_;
  BatchId robot_;
  KinematicsDesc kinematics_;
  std::uint32_t chunk_ = 0;
  std::unique_ptr<float[]> poses_;         // of a chunk
  std::unique_ptr<std::uint8_t[]> flags_;  // of a chunk
  std::size_t flag_count_ = 0;

  detail::MotionBound bound_;
  Status has_bound_ = Status::kUnknownBatch;  // kOk: motions can be tested; else why not
  bool has_fixed_ = false;

  // The robot once more, with the same poses.
  struct Twin {
    BatchId batch;
    std::unique_ptr<std::uint8_t[]> touches, flags;  // of a chunk
  };
  Status prepare(Twin& twin) noexcept;
  // What fixed bodies and points are tested against: the robot with padding if it has some.
  BatchId tested_around() const noexcept { return padded_.batch.value ? padded_.batch : robot_; }
  static std::uint64_t mark_of(const ArticulationDesc& desc) noexcept;
  std::uint64_t mark_ = 0;   // of the robot's desc
  Twin padded_;              // with padding, for what is fixed; made by set_padding
  Twin robot_among_points_;  // as characters, which points are tested against; made by the first add_points
  std::int32_t among_points_ = std::numeric_limits<std::int32_t>::max();  // its place among the inputs
  // Made by the first check_motions.
  std::unique_ptr<Interval[]> intervals_;
  std::unique_ptr<double[]> motion_states_;
  std::uint8_t touches_[kMotionStates] = {};
  // Made by the first find_nearest: the states of a chunk that are still open.
  std::unique_ptr<double[]> open_states_;
  std::unique_ptr<std::uint32_t[]> open_;
};

inline Status CollisionChecker::set_robot(const ArticulationDesc& desc, const KinematicsDesc& kinematics,
                                          std::uint32_t* bad_leaf) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (robot_.value) return Status::kBatchGivenTwice;
  if (const Status status = compute_link_poses(kinematics, {}, Isa::kAuto, {}); status != Status::kOk) return status;
  const std::size_t links = kinematics.link_parents.size;
  if (links != desc.link_parents.size) return Status::kBadJoint;
  // Whole tiles of sixteen.
  const std::size_t chunk = std::max<std::size_t>(std::min(kMostStates, kMostLinks / links) / 16 * 16, kMotionStates);
  poses_.reset(new (std::nothrow) float[7 * links * chunk]);
  flags_.reset(new (std::nothrow) std::uint8_t[chunk]);
  if (!poses_ || !flags_) return Status::kOutOfMemory;
  BatchId robot;
  const auto count = static_cast<std::uint32_t>(chunk);
  Status status = world_.add_batch(desc, count, &robot, bad_leaf, BatchKind::kSequence);
  if (status != Status::kOk) return status;
  status = world_.add_rule({robot, robot, Pairing::kWithin});
  if (status != Status::kOk) {
    (void)world_.remove_batch(robot);
    return status;
  }
  robot_ = robot;
  kinematics_ = kinematics;
  chunk_ = count;
  world_.input(robot)->poses.data = poses_.get();
  test_triangles_of(desc);
  mark_ = mark_of(desc);
  has_bound_ = read_bound(desc);
  return Status::kOk;
}

// Tests triangles from now on if a body has some, unless the caller chose another test than that of solids.
inline void CollisionChecker::test_triangles_of(const ArticulationDesc& desc) noexcept {
  Exact& exact = world_.job().policies.exact;
  for (const Leaf& leaf : desc.leaves)
    if (leaf.triangles.size && exact == Exact::kConvex) exact = Exact::kSurface;
}

// Reads what motions of the robot are bounded by.
inline Status CollisionChecker::read_bound(const ArticulationDesc& desc) noexcept {
  BatchInfo batch;
  ArticulationInfo info;
  Status status = batch_info(world_.engine(), robot_, &batch);
  if (status == Status::kOk) status = articulation_info(world_.engine(), batch.articulation, &info);
  if (status != Status::kOk) return status;
  const std::unique_ptr<IgnoredPair[]> ignored(new (std::nothrow) IgnoredPair[info.ignored_pair_count + 1]);
  if (!ignored) return Status::kOutOfMemory;
  const Span<IgnoredPair> pairs = {ignored.get(), info.ignored_pair_count};
  status = ignored_pairs(world_.engine(), batch.articulation, pairs);
  return status == Status::kOk ? bound_.set(desc, kinematics_, {pairs.data, pairs.size}) : status;
}

// A hash of what is padded of a body: its tree and its leaves, but no triangles, which set_padding refuses before.
inline std::uint64_t CollisionChecker::mark_of(const ArticulationDesc& desc) noexcept {
  std::uint64_t mark = 14695981039346656037u;  // FNV-1a
  const auto add = [&mark](const auto* values, std::size_t count) {
    const auto* const bytes = reinterpret_cast<const unsigned char*>(values);
    for (std::size_t i = 0; i < count * sizeof *values; ++i) mark = (mark ^ bytes[i]) * 1099511628211u;
  };
  add(desc.link_parents.data, desc.link_parents.size);
  for (const Leaf& leaf : desc.leaves) {
    add(&leaf.link, 1);
    add(leaf.box.center, 3);
    add(leaf.box.axis[0], 9);
    add(leaf.box.half, 3);
    for (const ConvexPart& part : leaf.parts) {
      add(&part.kind, 1);
      add(part.position, 3);
      add(part.rotation, 4);
      add(part.size, 3);
      add(part.vertices.data, part.vertices.size);
    }
  }
  return mark;
}

// Makes room for what a frame writes about a twin of the robot.
inline Status CollisionChecker::prepare(Twin& twin) noexcept {
  twin.touches.reset(new (std::nothrow) std::uint8_t[chunk_]);
  twin.flags.reset(new (std::nothrow) std::uint8_t[chunk_]);
  return twin.touches && twin.flags ? Status::kOk : Status::kOutOfMemory;
}

inline Status CollisionChecker::set_padding(const ArticulationDesc& desc, Span<const float> padding,
                                            std::uint32_t* bad_leaf) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  if (world_.inputs().size > 1) return Status::kBatchGivenTwice;
  if (desc.link_parents.size != kinematics_.link_parents.size) return Status::kBadJoint;
  if (padding.size != desc.link_parents.size || !padding.data) return Status::kBadMargin;
  PaddedLeaves padded;
  Status status = padded.set(desc.leaves, padding);
  if (status != Status::kOk) return status;
  if (mark_of(desc) != mark_) return Status::kBadJoint;
  status = prepare(padded_);
  if (status != Status::kOk) return status;
  const ArticulationDesc grown = {desc.link_parents, desc.link_joints, padded.leaves(), {}};
  status = world_.add_batch(grown, chunk_, &padded_.batch, bad_leaf, BatchKind::kSequence);
  if (status != Status::kOk) return status;
  BatchInput& input = *world_.input(padded_.batch);
  input.poses.data = poses_.get();
  input.count = 0;
  has_bound_ = read_bound(grown);
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
  if (status == Status::kOk) status = world_.add_rule({tested_around(), body});
  if (status != Status::kOk) {
    (void)world_.remove_batch(body);
    return status;
  }
  test_triangles_of(desc);
  has_fixed_ = true;
  return Status::kOk;
}

inline Status CollisionChecker::add_points(Span<const float> points, float radius, std::uint32_t* bad_point) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  const std::size_t count = points.size / 3;
  if (points.size % 3 != 0 || !points.data) return Status::kBadStaticBody;
  if (count > kMaxInstances) return Status::kTooManyInstances;
  // A box reaches at most 1e18.
  if (!(radius > 0 && radius <= kMaxCoordinate / 2)) return Status::kBadShape;
  const std::unique_ptr<StaticBody[]> bodies(new (std::nothrow) StaticBody[count + 1]);
  if (!bodies) return Status::kOutOfMemory;
  ConvexPart ball;
  ball.kind = ShapeKind::kSphere;
  ball.size[0] = radius;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      bodies[i].origin[c] = static_cast<double>(points[3 * i + c]);
      bodies[i].box.half[c] = radius;
    }
    bodies[i].parts = {&ball, 1};
  }
  Status status = Status::kOk;
  if (!robot_among_points_.batch.value) {
    BatchInfo batch;
    status = prepare(robot_among_points_);
    if (status == Status::kOk) status = batch_info(world_.engine(), tested_around(), &batch);
    if (status == Status::kOk)
      status = world_.add_batch({batch.articulation, chunk_, BatchKind::kCharacters}, &robot_among_points_.batch);
    if (status != Status::kOk) return status;
    BatchInput& input = *world_.input(robot_among_points_.batch);
    input.poses.data = poses_.get();
    input.count = 0;
    among_points_ = static_cast<std::int32_t>(&input - world_.inputs().data);
  }
  BatchId cloud;
  status = world_.add_static_batch({{bodies.get(), count}, {}, {}}, &cloud, bad_point);
  if (status != Status::kOk) return status;
  status = world_.add_rule({robot_among_points_.batch, cloud});
  if (status != Status::kOk) (void)world_.remove_batch(cloud);
  has_fixed_ = has_fixed_ || status == Status::kOk;
  return status;
}

// Poses and tests at most a chunk of states.
inline Status CollisionChecker::run(Span<const double> states, std::uint32_t count, Report report,
                                    Span<std::uint8_t> in_contact) noexcept {
  flag_count_ = 0;
  BatchInput& input = *world_.input(robot_);
  input.count = count;
  Status status = Status::kOk;
  if (padded_.batch.value || robot_among_points_.batch.value) {
    // Other batches have the same poses.
    status = compute_link_poses(kinematics_, states, engine_isa(world_.engine()),
                                {poses_.get(), 7 * kinematics_.link_parents.size * count});
    if (status != Status::kOk) return status;
  } else {
    input.states = {&kinematics_, states, poses_.get()};
  }
  input.flags = {flags_.get(), count};
  input.in_contact = in_contact;
  for (Twin* const twin : {&padded_, &robot_among_points_}) {
    if (!twin->batch.value) continue;
    BatchInput& of = *world_.input(twin->batch);
    of.count = count;
    of.flags = {twin->flags.get(), count};
    of.in_contact = in_contact.empty() ? Span<std::uint8_t>() : Span<std::uint8_t>(twin->touches.get(), count);
  }
  world_.job().report = report;
  status = world_.run();
  input.in_contact = {};
  input.states = {};
  world_.job().report = Report::kHits;
  for (const Twin* const twin : {&padded_, &robot_among_points_}) {
    if (!twin->batch.value || status != Status::kOk) continue;
    for (std::size_t i = 0; i < in_contact.size; ++i) in_contact[i] |= twin->touches[i];
    for (std::size_t i = 0; i < count; ++i)
      if (flags_[i] == kInstanceOk) flags_[i] = twin->flags[i];
  }
  if (status == Status::kOk) flag_count_ = count;
  return status;
}

inline Status CollisionChecker::find_hits(Span<const double> states, std::uint32_t count) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  if (count > chunk_) return Status::kBadCount;
  if (states.size != std::size_t{count} * kinematics_.variable_count || (states.size && !states.data))
    return Status::kBadOutput;
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
  flag_count_ = 0;
  return Status::kOk;
}

// Keeps of the pairs of the last frame the nearest of each state. state_of: which state an instance is of.
inline void CollisionChecker::read_nearest(const double* states, const std::uint32_t* state_of, NearestLinks* nearest,
                                           double* gradients) noexcept {
  const Span<const Hit> hits = world_.hits();
  const std::size_t links = kinematics_.link_parents.size, variables = kinematics_.variable_count;
  for (std::size_t h = 0; h < hits.size; ++h) {
    const Hit& hit = hits[h];
    const Contact& contact = world_.contacts()[h];
    NearestLinks& to = nearest[state_of[hit.instance_a]];
    if (!(-contact.depth < to.distance)) continue;
    to.distance = -contact.depth;
    to.fixed = fixed_of(hit);
    to.link_a = hit.link_a;
    to.link_b = hit.batch_a == slot_of(robot_among_points_.batch) ? hit.instance_b : hit.link_b;
    std::copy_n(contact.normal, 3, to.normal);
    std::copy_n(contact.point_a, 3, to.point_a);
    std::copy_n(contact.point_b, 3, to.point_b);
    if (!gradients) continue;
    double* const gradient = gradients + state_of[hit.instance_a] * variables;
    const float* const poses = poses_.get() + 7 * links * hit.instance_a;
    const double* const state = states + hit.instance_a * variables;
    std::fill_n(gradient, variables, 0.0);
    detail::add_gradient(kinematics_, state, poses, to.link_a, to.point_a, to.normal, -1, gradient);
    if (to.fixed < 0) detail::add_gradient(kinematics_, state, poses, to.link_b, to.point_b, to.normal, 1, gradient);
  }
}

// find_nearest of at most a chunk of states. Margins grow from a sixty-fourth of `most`, and states that have a pair
// within one are done.
inline Status CollisionChecker::find_nearest_of(Span<const double> states, Span<NearestLinks> nearest, float most,
                                                double* gradients) noexcept {
  const std::size_t variables = kinematics_.variable_count;
  auto count = static_cast<std::uint32_t>(nearest.size);
  for (std::uint32_t i = 0; i < count; ++i) {
    nearest[i] = {};
    nearest[i].distance = std::numeric_limits<float>::infinity();
    open_[i] = i;
  }
  if (gradients) std::fill_n(gradients, count * variables, 0.0);
  std::copy_n(states.data, states.size, open_states_.get());
  for (float within = most / 64; count > 0; within = within > 0 && 3 * within < most ? 3 * within : most) {
    world_.job().margin = within;
    const Status status = run({open_states_.get(), count * variables}, count, Report::kDistances, {});
    if (status != Status::kOk) return status;
    read_nearest(open_states_.get(), open_.get(), nearest.data, gradients);
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (flags_[i] != kInstanceOk) {
        nearest[open_[i]] = {};
        nearest[open_[i]].distance = std::numeric_limits<float>::quiet_NaN();
        if (gradients) std::fill_n(gradients + open_[i] * variables, variables, 0.0);
        continue;
      }
      if (nearest[open_[i]].distance <= within || !(within < most)) continue;
      std::copy_n(open_states_.get() + i * variables, variables, open_states_.get() + kept * variables);
      open_[kept++] = open_[i];
    }
    count = kept;
  }
  return Status::kOk;
}

inline Status CollisionChecker::find_nearest(Span<const double> states, Span<NearestLinks> nearest, float most,
                                             Span<double> gradients) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  const std::size_t variables = kinematics_.variable_count, count = nearest.size;
  if (states.size != count * variables || (states.size && !states.data) || (count && !nearest.data) ||
      (!gradients.empty() && (gradients.size != states.size || !gradients.data)))
    return Status::kBadOutput;
  if (!(most >= 0 && most <= kMaxCoordinate)) return Status::kBadMargin;
  if (!open_states_) open_states_.reset(new (std::nothrow) double[chunk_ * (variables + 1)]);
  if (!open_) open_.reset(new (std::nothrow) std::uint32_t[chunk_]);
  if (!open_states_ || !open_) return Status::kOutOfMemory;
  const float own = world_.job().margin;
  Status status = Status::kOk;
  for (std::size_t first = 0; first < count && status == Status::kOk; first += chunk_) {
    const std::size_t size = std::min<std::size_t>(chunk_, count - first);
    status = find_nearest_of({states.data + first * variables, size * variables}, {nearest.data + first, size}, most,
                             gradients.empty() ? nullptr : gradients.data + first * variables);
  }
  world_.job().margin = own;
  flag_count_ = 0;
  return status;
}

// A search in progress. Intervals are a stack: the last one comes first, and of the parts of one the earliest.
struct CollisionChecker::Motions {
  const double* from;          // the caller's
  const double* to;            // the caller's
  Span<MotionAnswer> answers;  // the caller's
  MotionSearch& search;        // the caller's
  std::size_t begun = 0;       // how many motions were begun
  std::size_t size = 0;        // of the stack

  // That of the motion of an interval.
  double& first_moment(const Interval& interval) const noexcept { return search.first_moments[interval.motion]; }
  // Whether the caller asks for first moments.
  bool wants_first() const noexcept { return !search.first_moments.empty(); }

  // Whether nothing more is to be found in an interval.
  bool is_done(const Interval& interval) const noexcept {
    const MotionAnswer answer = answers[interval.motion];
    if (answer == MotionAnswer::kNotTested) return true;
    return answer == MotionAnswer::kColliding && (!wants_first() || interval.begin >= first_moment(interval));
  }
  // Notes what was found at a moment of an interval.
  void find(const Interval& interval, double moment, MotionAnswer found) const noexcept {
    MotionAnswer& answer = answers[interval.motion];
    if (wants_first() && (answer == MotionAnswer::kFree || moment < first_moment(interval)))
      first_moment(interval) = moment;
    if (answer != MotionAnswer::kColliding) answer = found;
  }
};

// Tests states with a margin more than the caller's, and leaves in touches_ which collide.
inline Status CollisionChecker::test_states(Span<const double> states, std::uint32_t count, double margin) noexcept {
  const float own = world_.job().margin;
  if (margin > 0) world_.job().margin = static_cast<float>((static_cast<double>(own) + margin) * (1 + 1e-6));
  const Status status = run(states, count, Report::kInContact, {touches_, count});
  world_.job().margin = own;
  return status;
}

// Begins some motions: tests where they begin and end, and puts the others on the stack.
inline Status CollisionChecker::begin_motions(Motions& motions) noexcept {
  const std::size_t variables = kinematics_.variable_count;
  const auto count =
      static_cast<std::uint32_t>(std::min<std::size_t>(kMotionStates / 2, motions.answers.size - motions.begun));
  double* to = motion_states_.get();
  for (std::size_t m = motions.begun; m < motions.begun + count; ++m)
    for (const double* const end : {motions.from, motions.to}) {
      std::copy(end + m * variables, end + (m + 1) * variables, to);
      to += variables;
    }
  const Status status = test_states({motion_states_.get(), 2 * count * variables}, 2 * count, 0);
  if (status != Status::kOk) return status;
  motions.search.state_count += 2 * count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t m = motions.begun + i;
    motions.answers[m] = MotionAnswer::kFree;
    Interval interval = {m, 0, 1, 0, 0};
    interval.length = bound_.length(motions.from + m * variables, motions.to + m * variables, has_fixed_);
    interval.rounding = bound_.rounding();
    // A margin, too, is at most 1e18.
    const double most = static_cast<double>(world_.job().margin) + interval.length + interval.rounding;
    if (flags_[2 * i] != kInstanceOk || flags_[2 * i + 1] != kInstanceOk || !(most <= 5e17))
      motions.answers[m] = MotionAnswer::kNotTested;
    else
      for (std::uint32_t end = 0; end < 2; ++end)
        if (touches_[2 * i + end]) motions.find(interval, end, MotionAnswer::kColliding);
    if (!motions.is_done(interval)) push_parts(interval, kFirstParts, kFirstParts, motions);
  }
  motions.begun += count;
  return Status::kOk;
}

// The margin that an interval is tested with: its own, rounded up to one of four steps between powers of two. A frame
// has one margin, so intervals with the same step are tested together, and no answer depends on which others they are.
inline double CollisionChecker::margin_of(const Interval& interval) noexcept {
  const double own = interval.length * (interval.end - interval.begin) / 2 + interval.rounding;
  if (!(own > 0)) return 0;
  int exponent = 0;
  const double share = std::frexp(own, &exponent);
  for (const double step : {0.5, 0.59460355750136054, 0.70710678118654757, 0.84089641525371461})
    if (share <= step) return std::ldexp(step, exponent);
  return std::ldexp(1.0, exponent);
}

// Puts the first `count` of equal parts of an interval on the stack.
inline void CollisionChecker::push_parts(const Interval& interval, std::uint32_t parts, std::uint32_t count,
                                         Motions& motions) noexcept {
  const double part = (interval.end - interval.begin) / parts;
  for (std::uint32_t p = count; p-- > 0;)
    intervals_[motions.size++] = {interval.motion, interval.begin + p * part, interval.begin + (p + 1) * part,
                                  interval.length, interval.rounding};
}

// Tests the middle of intervals of the stack, the last one first, and puts back the parts of those that are not known
// to be free.
inline Status CollisionChecker::divide(Motions& motions) noexcept {
  const std::size_t variables = kinematics_.variable_count;
  // One interval at a time adds no more to the stack than kParts for each time that it is divided.
  const std::size_t room = kMostIntervals - motions.size;
  const std::size_t most = room < kParts * (kMotionStates + kMostDivisions) ? 1 : kMotionStates;
  Interval taken[kMotionStates];
  std::uint32_t count = 0;
  double margin = -1;
  std::size_t next = motions.size, kept = motions.size;  // intervals from `kept` on were looked at, and stay
  while (next > 0 && count < most) {
    const Interval interval = intervals_[--next];
    if (motions.is_done(interval)) continue;
    const double own = margin_of(interval);
    if (margin < 0) margin = own;
    if (own <= margin && own >= margin)  // equal, but compilers warn of == between doubles
      taken[count++] = interval;
    else
      intervals_[--kept] = interval;
  }
  Interval* const stack = intervals_.get();
  std::copy(stack + kept, stack + motions.size, stack + next);
  motions.size = next + (motions.size - kept);
  const auto middle = [](const Interval& interval) { return interval.begin + (interval.end - interval.begin) / 2; };
  const auto write_state = [&](const Interval& interval, double* to) {
    const double *const a = motions.from + interval.motion * variables, *const b =
                                                                            motions.to + interval.motion * variables;
    for (std::size_t v = 0; v < variables; ++v) to[v] = a[v] + middle(interval) * (b[v] - a[v]);
  };
  const auto test = [&](double by) {
    for (std::uint32_t i = 0; i < count; ++i) write_state(taken[i], motion_states_.get() + i * variables);
    motions.search.state_count += count;
    return test_states({motion_states_.get(), count * variables}, count, by);
  };
  if (count == 0) return Status::kOk;
  if (const Status status = test(margin); status != Status::kOk) return status;
  std::uint32_t near = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (flags_[i] != kInstanceOk)
      motions.answers[taken[i].motion] = MotionAnswer::kNotTested;
    else if (touches_[i])
      taken[near++] = taken[i];
  }
  count = near;
  if (count == 0) return Status::kOk;
  if (const Status status = test(0); status != Status::kOk) return status;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Interval& interval = taken[i];
    const double at = middle(interval);
    if (touches_[i]) motions.find(interval, at, MotionAnswer::kColliding);
    // Below the rounding of poses dividing makes no margin smaller.
    if (interval.length * (interval.end - interval.begin) <= std::max(motions.search.resolution, interval.rounding) ||
        interval.end - interval.begin < std::ldexp(1.0, -static_cast<int>(kMostDivisions))) {
      motions.find(interval, interval.begin, MotionAnswer::kTooClose);
      continue;
    }
    push_parts(interval, kParts, touches_[i] ? kParts / 2 : kParts, motions);
  }
  return Status::kOk;
}

inline Status CollisionChecker::check_motions(Span<const double> from, Span<const double> to,
                                              Span<MotionAnswer> answers, MotionSearch& search) noexcept {
  if (world_.status() != Status::kOk) return world_.status();
  if (!robot_.value) return Status::kUnknownBatch;
  if (has_bound_ != Status::kOk) return has_bound_;
  const std::size_t variables = kinematics_.variable_count, numbers = answers.size * variables;
  if (from.size != numbers || to.size != numbers || (numbers && !(from.data && to.data)) ||
      (answers.size && !answers.data) ||
      (!search.first_moments.empty() && (search.first_moments.size != answers.size || !search.first_moments.data)))
    return Status::kBadOutput;
  if (!(search.resolution > 0 && search.resolution <= double{kMaxCoordinate})) return Status::kBadResolution;
  if (!intervals_) intervals_.reset(new (std::nothrow) Interval[kMostIntervals]);
  if (!motion_states_) motion_states_.reset(new (std::nothrow) double[kMotionStates * (variables + 1)]);
  if (!intervals_ || !motion_states_) return Status::kOutOfMemory;
  search.state_count = 0;
  Motions motions = {from.data, to.data, answers, search};
  while (motions.size > 0 || motions.begun < answers.size) {
    const bool begins = motions.size < kMotionStates && motions.begun < answers.size;
    if (const Status status = begins ? begin_motions(motions) : divide(motions); status != Status::kOk) return status;
  }
  flag_count_ = 0;
  return Status::kOk;
}

}  // namespace cab
