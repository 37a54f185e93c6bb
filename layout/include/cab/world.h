// World: an engine, with what every program keeps beside it: the inputs of its batches, the rules, buffers for hits.
//
//   cab::World world;
//   cab::BatchId crowd;
//   status = world.add_batch(body, 100, &crowd);    // once: 100 characters of one articulation
//   status = world.add_rule({crowd, crowd});        // any two of them may touch
//   world.input(crowd)->poses.data = poses;         // every frame: arrays stay the caller's
//   status = world.run();
//   for (const cab::Hit& hit : world.hits()) ...
//
// Everything here is inline and made of the calls of cab/cab.h, whose conventions hold. What has no function here is
// called on engine(), with job() or inputs().
//
// Errors      Nothing is thrown; a program may be compiled without exceptions. A call that fails says why by its Status
//             and changes nothing, except that run() and run_queries() leave no hits. Besides the statuses of its
//             comment, each answers kOutOfMemory if the world's own arrays cannot grow, and status() if there is no
//             engine.
// Threads     Worlds are independent of each other. A world serves one call at a time, from any thread. Unlike an
//             engine's, its calls must not start while another one runs.
// Memory      The arrays of inputs, rules and hits come from operator new, grow when they must, and stay as large. A
//             frame that needs no more than those before it allocates nothing of its own.
#pragma once

#include <cab/cab.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>

namespace cab {

// Ends an engine that a std::unique_ptr owns.
struct EngineDeleter {
  // Null is allowed and does nothing.
  void operator()(Engine* engine) const noexcept { destroy_engine(engine); }
};

// A box along the axes of its frame. center: x y z; half: half extents along x, y and z, 0 or more. Both are in the
// caller's unit.
constexpr Box axis_aligned_box(const float (&center)[3], const float (&half)[3]) noexcept {
  Box box;
  for (int k = 0; k < 3; ++k) {
    box.center[k] = center[k];
    box.half[k] = half[k];
  }
  return box;
}

// Prints the words of a status to stderr and ends the program with exit code 1, unless the status is kOk. For examples
// and tools, which can do nothing else about it.
inline void exit_on_error(Status status) noexcept {
  if (status == Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", to_string(status));
  std::exit(1);
}

// An engine, its batches with their inputs, the rules between them, and buffers for what frames find.
class World {
 public:
  // Makes the engine, as create_engine does. If that fails there is no engine, and status() says why.
  explicit World(const EngineDesc& desc = {}) noexcept;

  // A world may be moved, not copied. Ids, arrays and spans of hits stay valid. The world that is moved from has no
  // engine: its status() is kNullArgument.
  World(World&&) noexcept = default;
  World& operator=(World&&) noexcept = default;

  // kOk if there is an engine, else why there is none.
  Status status() const noexcept { return engine_ ? Status::kOk : no_engine_; }

  // The engine, for every call of cab/cab.h. There must be one (status). Batches that are added or removed by such
  // calls are not those of this world.
  Engine& engine() noexcept { return *engine_; }
  const Engine& engine() const noexcept { return *engine_; }

  // Adds an articulation and a batch of `count` instances of it, and writes the batch's id to *out, which must not be
  // null. The articulation goes with its last batch, or with the world if a level of detail was added to it. If desc is
  // refused, *bad_element (may be null) says which element is at fault, as in cab::add_articulation. Statuses: those of
  // cab::add_articulation and cab::add_batch.
  [[nodiscard]] Status add_batch(const ArticulationDesc& desc, std::uint32_t count, BatchId* out,
                                 std::uint32_t* bad_element = nullptr,
                                 BatchKind kind = BatchKind::kCharacters) noexcept;

  // Adds a batch as cab::add_batch does, of an articulation or a level of detail that the caller has added to engine(),
  // and removes. Its input() begins without poses, which run() refuses with kBadPoses unless its count is 0. Statuses:
  // those of cab::add_batch.
  [[nodiscard]] Status add_batch(const BatchDesc& desc, BatchId* out) noexcept;

  // Adds a batch of static bodies as cab::add_static_batch does. Its input() needs nothing more. Statuses: those of
  // cab::add_static_batch.
  [[nodiscard]] Status add_static_batch(const StaticDesc& desc, BatchId* out,
                                        std::uint32_t* bad_element = nullptr) noexcept;

  // Removes a batch, its input and all rules that name it. Statuses: kBusy, kUnknownBatch.
  [[nodiscard]] Status remove_batch(BatchId id) noexcept;

  // Makes room beforehand, as cab::reserve does, and in the buffers for desc.hits hits. Statuses: those of
  // cab::reserve.
  [[nodiscard]] Status reserve(const ReserveDesc& desc) noexcept;

  // The input of a batch of this world, or null for any other. It begins with its defaults, and what is set stays until
  // it is set anew. To leave a batch out of frames, set its count to 0. Do not change its `batch`. Valid until a batch
  // is added or removed. Cost: logarithmic in the number of batches.
  BatchInput* input(BatchId id) noexcept;

  // The same for the batch that a hit names.
  BatchInput* input(BatchSlot slot) noexcept;

  // The inputs of all batches, by slot. Valid until a batch is added or removed.
  Span<BatchInput> inputs() noexcept { return inputs_.span(); }

  // Adds a rule, such as {crowd, crowd}. Without rules a frame has no hits. What the two batches cannot have is refused
  // by run(). Statuses: kBusy, kUnknownBatch.
  [[nodiscard]] Status add_rule(const PairRule& rule) noexcept;

  // All rules, in the order in which they were added. Valid until one is added or a batch is removed.
  Span<PairRule> rules() noexcept { return rules_.span(); }

  // Removes all rules.
  void clear_rules() noexcept { rules_.size = 0; }

  // Whether frames from now on compute a contact for each hit. They need an exact test then. Report::kDistances
  // computes contacts in any case. Default: they do not.
  void want_contacts(bool wanted = true) noexcept { wants_contacts_ = wanted; }

  // What run() hands to run_frame, for two uses. Set policies, margin, min_depth and report in it, which stay as they
  // are set, and read stats after a frame. Or hand it to a call on engine() that takes a FrameJob, such as
  // find_candidates, explain_job and begin_frame: its inputs, rules, hits and contacts are set anew by each call of
  // this function.
  FrameJob& job() noexcept;

  // Runs one frame of all batches. If the buffers are too small they grow, with a quarter to spare, and the frame runs
  // again. A run without room for its hits counts as one that was not kOk, so in the next all instances count as moved
  // (BatchInput::moved): with Resting::kSkipped that one has more hits, and a third may follow. Statuses: those of
  // run_frame without kHitsOverflow.
  [[nodiscard]] Status run() noexcept;

  // The hits of the last run(), in their order; none if it was not kOk. Valid until the next one, or until reserve().
  Span<const Hit> hits() const noexcept { return {hits_.data.get(), hits_.size}; }

  // The contact of each of these hits, if contacts were computed, else empty. Valid as long as the hits.
  Span<const Contact> contacts() const noexcept { return {contacts_.data.get(), contacts_.size}; }

  // Whether queries from now on compute where on a skin's triangles each hit is. Default: they do not.
  void want_surface_points(bool wanted = true) noexcept { wants_surface_points_ = wanted; }

  // Answers queries about the world's inputs, as cab::run_queries does. Sets `inputs`, `hits`, `surface_points` and
  // `links` of the job. Makes room for 256 queries at a time, unless some was reserved, and for all hits. Statuses:
  // those of cab::run_queries without kHitsOverflow and kNoQueryMemory.
  [[nodiscard]] Status run_queries(QueryJob& job) noexcept;

  // The hits of the last run_queries(), in their order; none if it was not kOk. Valid until the next one.
  Span<const QueryHit> query_hits() const noexcept { return {query_hits_.data.get(), query_hits_.size}; }

  // The place of each of these hits, if places were computed, else empty. Valid as long as the hits.
  Span<const SurfacePoint> surface_points() const noexcept {
    return {surface_points_.data.get(), surface_points_.size};
  }

 private:
  // An array that grows without exceptions. Beyond `size` its values are unspecified. T is trivially copyable.
  template <class T>
  struct Array {
    std::unique_ptr<T[]> data;
    std::size_t size = 0, capacity = 0;

    Array() = default;
    Array(Array&& other) noexcept { *this = std::move(other); }
    Array& operator=(Array&& other) noexcept {
      data = std::move(other.data);
      size = std::exchange(other.size, 0);
      capacity = std::exchange(other.capacity, 0);
      return *this;
    }
    Span<T> span() noexcept { return {data.get(), size}; }
    T* begin() noexcept { return data.get(); }
    T* end() noexcept { return data.get() + size; }

    // An empty array with room for `wanted` values, or twice as many as this one has room for; for none if there is no
    // memory.
    Array larger(std::size_t wanted) const noexcept {
      Array out;
      wanted = std::max(wanted, 2 * capacity);
      out.data.reset(new (std::nothrow) T[wanted]);
      if (out.data) out.capacity = wanted;
      return out;
    }

    // Moves the values to an array that has more room.
    void move_to(Array&& other) noexcept {
      std::copy(begin(), end(), other.begin());
      other.size = size;
      *this = std::move(other);
    }

    // Makes room for `wanted` values. False if there is no memory.
    bool reserve(std::size_t wanted) noexcept {
      if (wanted <= capacity) return true;
      Array other = larger(wanted);
      if (other.capacity == 0) return false;
      move_to(std::move(other));
      return true;
    }

    // Inserts a value, for which there must be room.
    void insert(T* at, const T& value) noexcept {
      std::copy_backward(at, end(), end() + 1);
      *at = value;
      ++size;
    }
  };

  BatchInput* first_from(BatchSlot slot) noexcept;
  bool computes_contacts() const noexcept { return wants_contacts_ || job_.report == Report::kDistances; }
  bool reserve_hits(std::size_t count) noexcept;
  bool reserve_query_hits(std::size_t count) noexcept;
  // Whether the engine refuses changes, even that of removing nothing: a frame is in progress, or another thread reads.
  bool is_busy() noexcept { return remove_articulation(*engine_, {}) == Status::kBusy; }
  template <class Add>
  Status add(BatchId* out, Add add) noexcept;

  static constexpr std::size_t kFirstHits = 256;  // the buffers' first size

  std::unique_ptr<Engine, EngineDeleter> engine_;
  Status no_engine_ = Status::kNullArgument;
  Array<BatchInput> inputs_;  // by slot
  Array<PairRule> rules_;
  Array<ArticulationId> own_;  // articulations that go with their last batch
  FrameJob job_;
  bool wants_contacts_ = false;
  Array<Hit> hits_;
  Array<Contact> contacts_;
  bool wants_surface_points_ = false;
  Array<QueryHit> query_hits_;
  Array<SurfacePoint> surface_points_;
};

inline World::World(const EngineDesc& desc) noexcept {
  Engine* engine = nullptr;
  const Status status = create_engine(desc, &engine);
  engine_.reset(engine);
  if (status != Status::kOk) no_engine_ = status;
}

// The first input whose batch has this slot or a later one.
inline BatchInput* World::first_from(BatchSlot slot) noexcept {
  return std::lower_bound(inputs_.begin(), inputs_.end(), slot,
                          [](const BatchInput& input, BatchSlot other) { return slot_of(input.batch) < other; });
}

inline BatchInput* World::input(BatchSlot slot) noexcept {
  BatchInput* const found = first_from(slot);
  return found != inputs_.end() && slot_of(found->batch) == slot ? found : nullptr;
}

inline BatchInput* World::input(BatchId id) noexcept {
  BatchInput* const found = input(slot_of(id));
  const bool is_bare_slot = id.value == slot_of(id).value;
  return found && (is_bare_slot || found->batch == id) ? found : nullptr;
}

// Adds a batch by add(id), with its input.
template <class Add>
Status World::add(BatchId* out, Add add) noexcept {
  if (!engine_) return no_engine_;
  if (!out) return Status::kBadOutput;
  // A frame in progress reads the inputs, so they move once the engine has taken the batch.
  const bool is_full = inputs_.size == inputs_.capacity;
  Array<BatchInput> larger;
  if (is_full) larger = inputs_.larger(inputs_.size + 1);
  if (is_full && larger.capacity == 0) return Status::kOutOfMemory;
  BatchInput input;
  if (const Status status = add(&input.batch); status != Status::kOk) return status;
  if (is_full) inputs_.move_to(std::move(larger));
  inputs_.insert(first_from(slot_of(input.batch)), input);
  *out = input.batch;
  return Status::kOk;
}

inline Status World::add_batch(const BatchDesc& desc, BatchId* out) noexcept {
  return add(out, [&](BatchId* id) { return cab::add_batch(*engine_, desc, id); });
}

inline Status World::add_static_batch(const StaticDesc& desc, BatchId* out, std::uint32_t* bad_element) noexcept {
  return add(out, [&](BatchId* id) { return cab::add_static_batch(*engine_, desc, id, bad_element); });
}

inline Status World::add_batch(const ArticulationDesc& desc, std::uint32_t count, BatchId* out,
                               std::uint32_t* bad_element, BatchKind kind) noexcept {
  return add(out, [&](BatchId* id) {
    if (!own_.reserve(own_.size + 1)) return Status::kOutOfMemory;
    ArticulationId articulation;
    Status status = add_articulation(*engine_, desc, &articulation, bad_element);
    if (status != Status::kOk) return status;
    status = cab::add_batch(*engine_, {articulation, count, kind}, id);
    if (status == Status::kOk)
      own_.insert(own_.end(), articulation);
    else
      (void)remove_articulation(*engine_, articulation);
    return status;
  });
}

inline Status World::remove_batch(BatchId id) noexcept {
  if (!engine_) return no_engine_;
  BatchInput* const found = input(id);
  if (!found) return Status::kUnknownBatch;
  id = found->batch;
  BatchInfo info;
  Status status = batch_info(*engine_, id, &info);
  if (status == Status::kOk) status = cab::remove_batch(*engine_, id);
  if (status != Status::kOk) return status;
  std::copy(found + 1, inputs_.end(), found);
  --inputs_.size;
  const auto names = [id](const PairRule& rule) { return rule.a == id || rule.b == id; };
  rules_.size = static_cast<std::size_t>(std::remove_if(rules_.begin(), rules_.end(), names) - rules_.begin());
  ArticulationId* const own = std::find(own_.begin(), own_.end(), info.articulation);
  if (own != own_.end() && remove_articulation(*engine_, *own) == Status::kOk) {
    std::copy(own + 1, own_.end(), own);
    --own_.size;
  }
  return Status::kOk;
}

inline Status World::add_rule(const PairRule& rule) noexcept {
  if (!engine_) return no_engine_;
  const BatchInput *const a = input(rule.a), *const b = input(rule.b);
  if (!a || !b) return Status::kUnknownBatch;
  if (is_busy()) return Status::kBusy;  // a frame in progress reads the rules
  if (!rules_.reserve(rules_.size + 1)) return Status::kOutOfMemory;
  rules_.insert(rules_.end(), {a->batch, b->batch, rule.pairing, rule.resting});
  return Status::kOk;
}

inline Status World::reserve(const ReserveDesc& desc) noexcept {
  if (!engine_) return no_engine_;
  if (const Status status = cab::reserve(*engine_, desc); status != Status::kOk) return status;
  return reserve_hits(desc.hits) ? Status::kOk : Status::kOutOfMemory;
}

inline bool World::reserve_hits(std::size_t count) noexcept {
  return hits_.reserve(count) && (!computes_contacts() || contacts_.reserve(hits_.capacity));
}

inline FrameJob& World::job() noexcept {
  job_.inputs = inputs_.span();
  job_.rules = rules_.span();
  job_.hits = {hits_.data.get(), hits_.capacity};
  job_.contacts = {};
  if (computes_contacts()) {
    job_.hits.size = std::min(hits_.capacity, contacts_.capacity);
    job_.contacts = {contacts_.data.get(), job_.hits.size};
  }
  return job_;
}

inline Status World::run() noexcept {
  if (!engine_) return no_engine_;
  hits_.size = contacts_.size = 0;
  if (is_busy()) return Status::kBusy;  // a frame in progress writes to the buffers
  if (!reserve_hits(kFirstHits)) return Status::kOutOfMemory;
  Status status = run_frame(*engine_, job());
  while (status == Status::kHitsOverflow) {
    if (!reserve_hits(job_.hits_needed + job_.hits_needed / 4)) return Status::kOutOfMemory;
    status = run_frame(*engine_, job());
  }
  if (status == Status::kOk) {
    hits_.size = job_.hit_count;
    contacts_.size = job_.contacts.empty() ? 0 : job_.hit_count;
  }
  return status;
}

inline bool World::reserve_query_hits(std::size_t count) noexcept {
  return query_hits_.reserve(count) && (!wants_surface_points_ || surface_points_.reserve(query_hits_.capacity));
}

inline Status World::run_queries(QueryJob& job) noexcept {
  if (!engine_) return no_engine_;
  query_hits_.size = surface_points_.size = 0;
  if (!reserve_query_hits(kFirstHits)) return Status::kOutOfMemory;
  job.inputs = inputs_.span();
  job.links = {};
  const auto run = [&] {
    job.hits = {query_hits_.data.get(), query_hits_.capacity};
    job.surface_points = {};
    if (wants_surface_points_) {
      job.hits.size = std::min(query_hits_.capacity, surface_points_.capacity);
      job.surface_points = {surface_points_.data.get(), job.hits.size};
    }
    return cab::run_queries(*engine_, job);
  };
  Status status = run();
  if (status == Status::kNoQueryMemory) {
    ReserveDesc room;
    room.queries = 256;
    status = cab::reserve(*engine_, room);
    if (status == Status::kOk) status = run();
  }
  if (status == Status::kHitsOverflow) {
    if (!reserve_query_hits(job.hits_needed + job.hits_needed / 4)) return Status::kOutOfMemory;
    status = run();
  }
  if (status == Status::kOk) {
    query_hits_.size = job.hit_count;
    surface_points_.size = job.surface_points.empty() ? 0 : job.hit_count;
  }
  return status;
}

}  // namespace cab
