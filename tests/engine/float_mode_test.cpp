// The caller's floating-point control word changes no bit of a result, and every call restores it.
#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"

#include <doctest/doctest.h>

#if defined(__x86_64__)

#include <xmmintrin.h>

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;

// Bits of the control word (Intel SDM, volume 1, 10.2.3): flags in 0..5, DAZ, masks in 7..12, rounding, FTZ.
constexpr unsigned kDefault = 0x1f80;
constexpr unsigned kDenormalsAreZero = 0x0040;
constexpr unsigned kRoundUp = 0x4000;
constexpr unsigned kRoundToZero = 0x6000;
constexpr unsigned kFlushToZero = 0x8000;
constexpr unsigned kStickyFlags = 0x003f;
constexpr unsigned kMaskInvalid = 0x0080;
constexpr unsigned kMaskDenormal = 0x0100;
constexpr unsigned kMaskDivide = 0x0200;

constexpr unsigned kWords[] = {
    kDefault | kDenormalsAreZero | kFlushToZero,
    kDefault | kRoundUp,
    kDefault | kRoundToZero,
    kDefault | kRoundUp | kFlushToZero | kDenormalsAreZero,
    kDefault & ~(kMaskInvalid | kMaskDivide),  // traps unless the library sets its own mode
    kDefault | 0x0021,                         // sticky flags that the caller set
};

// Sets a control word for a scope, and tells whether it is still set.
class ControlWord {
 public:
  explicit ControlWord(unsigned word) : saved_(_mm_getcsr()), word_(word) { _mm_setcsr(word); }
  ~ControlWord() { _mm_setcsr(saved_); }
  ControlWord(const ControlWord&) = delete;
  ControlWord& operator=(const ControlWord&) = delete;
  bool stands() const {
    return (_mm_getcsr() & ~kStickyFlags) == (word_ & ~kStickyFlags) &&
           (_mm_getcsr() & word_ & kStickyFlags) == (word_ & kStickyFlags);
  }

 private:
  unsigned saved_;
  unsigned word_;
};

// The hits of a frame and the boxes of every batch. The control word is set only during the calls.
struct Bits {
  std::vector<Hit> hits;
  FrameStats stats;
  std::vector<std::vector<Box>> boxes;
};

// 0: leave it.
Bits bits_of(Engine& engine, const World& world, Refit refit, unsigned word) {
  Bits out;
  const Policies policies = {refit, Strategy::kTree, Exact::kNone};
  out.hits.resize(200000);
  std::vector<BatchInput> inputs;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    inputs.push_back(world.members[m].poses.input({m + 1}));
    out.boxes.emplace_back(std::size_t{world.members[m].poses.instance_count} * world.members[m].rig.node_count());
  }
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.policies = policies;
  job.hits = out.hits;
  Status status;
  bool restored = true;
  {
    const ControlWord control(word ? word : kDefault);
    status = run_frame(engine, job);
    restored = restored && control.stands();
  }
  REQUIRE(status == Status::kOk);
  for (std::size_t m = 0; m < inputs.size(); ++m) {
    {
      const ControlWord control(word ? word : kDefault);
      status = compute_boxes(engine, inputs[m], policies, out.boxes[m]);
      restored = restored && control.stands();
    }
    REQUIRE(status == Status::kOk);
  }
  CHECK(restored);
  out.hits.resize(job.hit_count);
  out.stats = job.stats;
  return out;
}

bool same(const Bits& a, const Bits& b) {
  bool same = same_hits(a.hits, b.hits) && same_counts(a.stats, b.stats);
  for (std::size_t m = 0; m < a.boxes.size(); ++m)
    same = same && std::memcmp(a.boxes[m].data(), b.boxes[m].data(), a.boxes[m].size() * sizeof(Box)) == 0;
  return same;
}

// Characters and sequences. Each batch has one instance that is not finite. One rig is so small that its boxes are
// denormal.
World touchy_world(std::uint64_t seed) {
  Random random(seed);
  World world;
  add_characters(random, world, 12);
  add_frames(random, world, 12);
  Member tiny = world.members[0];
  for (Leaf& leaf : tiny.rig.leaves)
    for (int k = 0; k < 3; ++k) {
      leaf.box.half[k] *= 1e-39f;
      leaf.box.center[k] *= 1e-38f;
    }
  for (float& joint : tiny.rig.joints) joint *= 1e-38f;
  Poses& poses = tiny.poses;
  for (std::uint32_t i = 0; i < poses.instance_count; ++i)
    for (std::uint32_t l = 0; l < poses.link_count; ++l)
      for (std::size_t c = 0; c < 3; ++c)
        poses.pose(i, l)[poses.format == PoseFormat::kQuaternionTranslation ? 4 + c
                         : poses.format == PoseFormat::kMatrix3x4Rows       ? 4 * c + 3
                                                                            : 12 + c] *= 1e-38f;
  world.members.push_back(tiny);
  const auto last = static_cast<std::uint32_t>(world.members.size());
  world.rules.push_back({{last}, {last}, Pairing::kWithin});
  for (Member& member : world.members)
    if (member.poses.instance_count > 1) member.poses.pose(1, 0)[0] = std::numeric_limits<float>::quiet_NaN();
  return world;
}

}  // namespace

TEST_CASE("a caller's flush-to-zero, rounding mode and unmasked exceptions change no bit and are restored") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    CAPTURE(seed);
    const World world = touchy_world(seed);
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      EngineDesc desc;
      desc.isa = isa;
      const EnginePtr engine = make_engine_for(world, desc);
      for (std::uint32_t row = 0; row < policy_table()[0].value_count; ++row) {
        const auto refit = static_cast<Refit>(row);
        CAPTURE(row);
        const Bits expected = bits_of(*engine, world, refit, 0);
        CHECK(expected.hits.size() > 0);
        for (const unsigned word : kWords) {
          CAPTURE(word);
          CHECK(same(bits_of(*engine, world, refit, word), expected));
        }
      }
    }
  }
}

TEST_CASE("worker threads of a caller's scheduler that run with another mode change no bit, and keep their mode") {
  const World world = touchy_world(5);
  const Bits expected = bits_of(*make_engine_for(world), world, Refit::kCab, 0);
  for (const unsigned word : kWords) {
    CAPTURE(word);
    std::atomic<int> changed{0};
    ThreadPool pool(
        4, [&] { _mm_setcsr(word); },
        [&] {
          if ((_mm_getcsr() & ~kStickyFlags) != (word & ~kStickyFlags)) ++changed;
          _mm_setcsr(kDefault);
        });
    const Scheduler scheduler = pool.scheduler();
    EngineDesc desc;
    desc.scheduler = &scheduler;
    const EnginePtr engine = make_engine_for(world, desc);
    FrameJob job;
    std::vector<BatchInput> inputs;
    std::vector<Hit> hits(200000);
    for (std::uint32_t m = 0; m < world.members.size(); ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
    job.inputs = inputs;
    job.rules = world.rules;
    job.hits = hits;
    REQUIRE(run_frame(*engine, job) == Status::kOk);
    hits.resize(job.hit_count);
    CHECK(same_hits(hits, expected.hits));
    CHECK(pool.tasks_run() > 0);
    CHECK(changed == 0);
  }
}

TEST_CASE("TBB's threads keep no trace of the calling thread's mode in a result") {
  const World world = touchy_world(6);
  EngineDesc desc;
  desc.thread_count = 2;
  const EnginePtr engine = make_engine_for(world, desc);
  const Bits expected = bits_of(*engine, world, Refit::kCab, 0);
  for (const unsigned word : kWords) {
    CAPTURE(word);
    CHECK(same(bits_of(*engine, world, Refit::kCab, word), expected));
  }
}

TEST_CASE("origins that would trap in the caller's mode are checked in the library's") {
  World world;
  Random random(12);
  world.members.push_back(any_member(random, 3, BatchKind::kCharacters, {1, false, true, {}}, 4));
  const EnginePtr engine = make_engine_for(world);
  const auto statuses = [&](double origin) {
    world.members[0].poses.origins[4] = origin;
    const BatchInput input = world.members[0].poses.input({1});
    std::vector<Box> boxes(3 * world.members[0].rig.node_count());
    FrameJob job;
    job.inputs = {&input, 1};
    Status frame, compute;
    {
      const ControlWord control(kDefault & ~(kMaskInvalid | kMaskDenormal | kMaskDivide));
      frame = run_frame(*engine, job);
      compute = compute_boxes(*engine, input, {}, boxes);
    }
    CHECK(frame == compute);
    return frame;
  };
  CHECK(statuses(1e-310) == Status::kOk);
  for (const std::uint64_t bits : {0x7ff0000000000001u, 0xfff4000000000000u, 0x7ff8000000000000u}) {  // two signal
    double nan;
    std::memcpy(&nan, &bits, sizeof nan);
    CHECK(statuses(nan) == Status::kBadOrigins);
  }
}

TEST_CASE("an articulation added in another mode is the same to the bit") {
  // add_articulation makes axes that drifted orthonormal, and keeps denormal half extents.
  Random random(9);
  World world;
  world.members.push_back(any_member(random, 4, BatchKind::kCharacters, {1, false, false, {}}, 8));
  for (Leaf& leaf : world.members[0].rig.leaves) {
    for (auto& axis : leaf.box.axis)
      for (float& v : axis) v += static_cast<float>(random.uniform(-2e-6, 2e-6));
    leaf.box.half[2] = 1e-41f;
  }
  world.rules = {{{1}, {1}, Pairing::kWithin}};
  const Bits expected = bits_of(*make_engine_for(world), world, Refit::kCab, 0);
  for (const unsigned word : kWords) {
    CAPTURE(word);
    const EnginePtr engine = make_engine();
    ArticulationId id;
    Status status;
    bool restored;
    {
      const ControlWord control(word);
      status = add_articulation(*engine, world.members[0].rig.desc(), &id);
      restored = control.stands();
    }
    REQUIRE(status == Status::kOk);
    CHECK(restored);
    add_instances(*engine, id, 4);
    CHECK(same(bits_of(*engine, world, Refit::kCab, 0), expected));

    Rig broken = world.members[0].rig;  // NaN must be a status, not a trap
    broken.leaves[0].box.half[1] = std::numeric_limits<float>::quiet_NaN();
    {
      const ControlWord control(word);
      status = add_articulation(*engine, broken.desc(), &id);
    }
    CHECK(status == Status::kBadLeafBox);
  }
}

#endif  // __x86_64__
