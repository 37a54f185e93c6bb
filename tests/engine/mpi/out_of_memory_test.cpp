// One rank runs out of memory, at each place where it allocates: all ranks answer alike, and the engine goes on.
#include "perf/harness/random_world.h"
#include "tests/engine/mpi/short_of_memory.h"

#include <cab/mpi.h>

#include <doctest/doctest.h>

#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

namespace {

using cab::tests::allocations;

void* take(std::size_t bytes, std::size_t alignment = alignof(std::max_align_t)) noexcept {
  if (allocations.left == 0) {
    allocations.has_failed = true;
    if (!allocations.lasts) allocations.left = -1;
    return nullptr;
  }
  if (allocations.left > 0) --allocations.left;
  return std::aligned_alloc(alignment, (bytes + alignment) / alignment * alignment);
}

void* take_or_throw(std::size_t bytes, std::size_t alignment = alignof(std::max_align_t)) {
  void* const memory = take(bytes, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

// Not inlined: GCC 12 would take an inlined free for a mismatch with new.
[[gnu::noinline]] void give_back(void* memory) noexcept { std::free(memory); }

std::size_t bytes_of(std::align_val_t alignment) { return static_cast<std::size_t>(alignment); }

}  // namespace

void* operator new(std::size_t bytes) { return take_or_throw(bytes); }
void* operator new[](std::size_t bytes) { return take_or_throw(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return take(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return take(bytes); }
void* operator new(std::size_t bytes, std::align_val_t alignment) { return take_or_throw(bytes, bytes_of(alignment)); }
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return take(bytes, bytes_of(alignment));
}
void operator delete(void* memory) noexcept { give_back(memory); }
void operator delete[](void* memory) noexcept { give_back(memory); }
void operator delete(void* memory, std::size_t) noexcept { give_back(memory); }
void operator delete[](void* memory, std::size_t) noexcept { give_back(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { give_back(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { give_back(memory); }

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCount = 24;  // characters of a batch

struct Deleter {
  void operator()(mpi::DistributedEngine* engine) const { mpi::destroy(engine); }
};
using EngineOfRanks = std::unique_ptr<mpi::DistributedEngine, Deleter>;

// Two batches of different bodies in one crowd, of which each rank has every `ranks`th character.
struct Crowd : Ranks {
  std::vector<Member> members;
  std::vector<std::uint32_t> numbers;
  std::vector<PairRule> rules;

  Crowd() {
    for (auto i = static_cast<std::uint32_t>(rank); i < kCount; i += static_cast<std::uint32_t>(ranks))
      numbers.push_back(i);
    for (std::uint32_t b = 1; b <= 2; ++b) {
      Random random(10 * b + static_cast<std::uint64_t>(rank));
      Random same(b);
      Member& member = members.emplace_back();
      member.rig = random_rig(same, Topology::kTree, 4 + 3 * b, 1);
      member.poses = random_poses(random, member.rig, static_cast<std::uint32_t>(numbers.size()),
                                  PoseFormat::kQuaternionTranslation, {.1, true, true, {}});
      for (std::uint32_t a = 1; a <= b; ++a) rules.push_back({{a}, {b}, Pairing::kBetween});
    }
  }

  // The engine of all ranks, with all batches; and the answer of the last call.
  mpi::Answer make(EngineOfRanks& engine) const {
    mpi::DistributedEngine* made = nullptr;
    mpi::Answer answer = mpi::create(MPI_COMM_WORLD, {}, &made);
    engine.reset(made);
    for (const Member& member : members) {
      BatchDesc batch;
      batch.instance_count = kCount;
      BatchId id;
      if (answer.ok()) answer = mpi::add_articulation(*engine, member.rig.desc(), &batch.articulation);
      if (answer.ok()) answer = mpi::add_batch(*engine, batch, &id);
    }
    return answer;
  }

  // inputs: room for those of the job.
  mpi::Answer run(mpi::DistributedEngine& engine, std::vector<mpi::RankInput>& inputs, mpi::DistributedJob& job) const {
    for (std::uint32_t b = 0; b < inputs.size(); ++b) inputs[b] = {members[b].poses.input({b + 1}), numbers};
    job.inputs = inputs;
    job.rules = rules;
    return mpi::run_frame(engine, job);
  }
};

std::vector<Hit> hits_of(const mpi::DistributedJob& job) { return {job.hit_list.begin(), job.hit_list.end()}; }

// Checks what all ranks answer after one was short of memory.
void check_answer(const Crowd& crowd, const mpi::Answer& answer, bool failed) {
  if (answer.ok()) return;
  CHECK(failed);
  CHECK(answer.status == Status::kOutOfMemory);
  CHECK(answer.rank == crowd.victim());
}

}  // namespace

TEST_CASE("if an allocation of one rank fails in a frame, all ranks answer so, and the next frame has all hits") {
  const Crowd crowd;
  std::vector<mpi::RankInput> inputs(crowd.members.size());
  std::vector<Hit> expected;
  {
    EngineOfRanks engine;
    mpi::DistributedJob job;
    REQUIRE(crowd.make(engine).ok());
    REQUIRE(crowd.run(*engine, inputs, job).ok());
    expected = hits_of(job);
    // So many hits that a list of them grows; and characters that travel.
    if (crowd.ranks == 1) CHECK(expected.size() > 4096);
    if (crowd.ranks > 1) CHECK(job.traffic.poses_sent > 0);
  }
  // More processes than cores are slow: there every few places.
  const long step = crowd.ranks > 3 ? 2 * crowd.ranks - 1 : 1;
  for (const bool all_after : {false, true}) {
    CAPTURE(all_after);
    bool failed = true;
    long nth = 0, refused = 0;
    for (; failed && nth < 10000; nth += step) {
      CAPTURE(nth);
      EngineOfRanks engine;
      mpi::DistributedJob job;
      mpi::Answer answer;
      REQUIRE(crowd.make(engine).ok());
      failed = run_short_of_memory(crowd, nth, all_after, [&] { answer = crowd.run(*engine, inputs, job); });
      check_answer(crowd, answer, failed);
      if (answer.ok()) CHECK(same_hits(hits_of(job), expected));
      if (!answer.ok()) ++refused;
      REQUIRE(crowd.run(*engine, inputs, job).ok());
      CHECK(same_hits(hits_of(job), expected));
    }
    CHECK_FALSE(failed);  // there was a run without a failure
    CHECK(refused > 20 / step);
    if (crowd.rank == 0) MESSAGE("places ", nth / step, ", of which refused ", refused, ", all after ", all_after);
  }
}

TEST_CASE("if an allocation of one rank fails while an engine is made, all ranks answer so") {
  const Crowd crowd;
  constexpr long kStep = 31;  // there are some 1400 places
  bool failed = true;
  long refused = 0;
  for (long nth = 0; failed && nth < 100000; nth += kStep) {
    CAPTURE(nth);
    EngineOfRanks engine;
    mpi::Answer answer;
    failed = run_short_of_memory(crowd, nth, false, [&] { answer = crowd.make(engine); });
    check_answer(crowd, answer, failed);
    if (!answer.ok()) ++refused;
  }
  CHECK_FALSE(failed);
  CHECK(refused > 10);
}

}  // namespace cab::tests
