// One allocation fails at each place where a recorder allocates. What it has acknowledged is in the file.
#include <cstdlib>
#include <new>

#include "tests/engine/record/recorded_world.h"

namespace {

// How many allocations of this thread succeed before one fails; below 0: all do.
thread_local long left = -1;

void* take(std::size_t bytes) noexcept {
  if (left >= 0 && left-- == 0) return nullptr;
  return std::malloc(bytes > 0 ? bytes : 1);
}

void* take_or_throw(std::size_t bytes) {
  void* const memory = take(bytes);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

// Not inlined: GCC 12 would take an inlined free for a mismatch with new.
[[gnu::noinline]] void give_back(void* memory) noexcept { std::free(memory); }

}  // namespace

void* operator new(std::size_t bytes) { return take_or_throw(bytes); }
void* operator new[](std::size_t bytes) { return take_or_throw(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return take(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return take(bytes); }
void operator delete(void* memory) noexcept { give_back(memory); }
void operator delete[](void* memory) noexcept { give_back(memory); }
void operator delete(void* memory, std::size_t) noexcept { give_back(memory); }
void operator delete[](void* memory, std::size_t) noexcept { give_back(memory); }

namespace cab::tests {
namespace {

using namespace cab::oracle;

struct Acknowledged {
  double time = 0;
  std::uint64_t hash = 0;
};

// Records frames, definitions and flushes, and fails at the nth allocation. Sets whether it failed.
std::vector<Acknowledged> record_failing(const char* path, const World& world, Engine& engine, long nth, bool& failed,
                                         bool& is_closed) {
  std::vector<Acknowledged> acknowledged;
  record::Recorder recorder;
  must(recorder, recorder.open(path));
  tell(recorder, world);
  const Outcome outcome = run_on(engine, world, {});
  FrameJob job;
  std::vector<BatchInput> inputs;
  for (std::size_t m = 0; m < world.members.size(); ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
  job.inputs = inputs;
  job.rules = world.rules;
  std::vector<Hit> hits = outcome.hits;
  job.hits = hits;
  job.hit_count = hits.size();
  const std::uint64_t hash = record::hash_hits(outcome.hits, {});
  long remaining = nth;
  const auto call = [&](auto work) {
    left = remaining;
    const bool ok = work();
    remaining = left;
    left = -1;
    return ok;
  };
  ArticulationDesc later = world.members[0].rig.desc();
  later.ignored_hops = 3;
  const BatchDesc batch = {{9}, 2, BatchKind::kCharacters};
  for (int f = 0; f < 8; ++f) {
    // A host that tries again.
    for (int attempt = 0; f == 4 && attempt < 2; ++attempt)
      if (call([&] { return recorder.add_articulation({9}, later) && recorder.add_batch({9}, batch); })) break;
    if (call([&] { return recorder.add_frame(job, f); })) acknowledged.push_back({static_cast<double>(f), hash});
    if (f % 3 == 2) call([&] { return recorder.flush(); });
  }
  is_closed = call([&] { return recorder.close(); });
  failed = remaining < 0;
  return acknowledged;
}

TEST_CASE("after a failed allocation a recording holds what was acknowledged, or says that it does not") {
  Random random(751);
  World world;
  Member member;
  member.rig = random_rig(random, Topology::kChain, 3, 1);
  member.poses = random_poses(random, member.rig, 6, PoseFormat::kQuaternionTranslation, {0.3, false, true, {}});
  world.members.push_back(member);
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  const RecordingFile file("failed_allocation");
  bool failed = true;
  long places = 0, refused = 0;
  for (; failed && places < 5000; ++places) {
    CAPTURE(places);
    bool is_closed = false;
    const std::vector<Acknowledged> acknowledged =
        record_failing(file.path(), world, *engine, places, failed, is_closed);
    if (failed && acknowledged.size() < 8) ++refused;
    if (!is_closed) continue;
    record::Recording recording;
    must(recording, recording.open(file.path()));
    CHECK(recording.problems().empty());
    REQUIRE(recording.frame_count() == acknowledged.size());
    for (std::uint32_t f = 0; f < acknowledged.size(); ++f) {
      record::RecordedFrame frame;
      must(recording, recording.read_frame(f, &frame));
      CHECK(frame.time == acknowledged[f].time);
      CHECK(frame.hash == acknowledged[f].hash);
      CHECK(record::hash_hits(frame.hits, frame.contacts) == frame.hash);
    }
  }
  CHECK_FALSE(failed);  // there was a run without a failure
  CHECK(places > 50);
  CHECK(refused > 10);
}

}  // namespace
}  // namespace cab::tests
