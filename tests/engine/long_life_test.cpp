// One engine over many frames, as a game has it: characters are replaced, rest, come in sizes; batches come and go.
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/engine/counted_memory.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCharacters = 200, kMostBatches = 8, kMostPerBatch = 60;

struct Living {
  BatchId id;
  Member member;
  std::vector<std::uint8_t> moved;
};

class Game {
 public:
  Game() : engine_(make_engine(desc())) {
    for (int r = 0; r < 3; ++r) {
      rigs_.push_back(random_rig(random_, Topology::kTree, 3 + random_.index(6), 2));
      articulations_.push_back(add_rig(*engine_, rigs_.back()));
    }
    // The largest bodies decide what a worker holds, so one batch of each is added once.
    for (std::size_t r = 0; r < rigs_.size(); ++r) add_batch(r, 1);
    REQUIRE(reserve(*engine_, {kMostBatches, kCharacters + kMostPerBatch}) == Status::kOk);
    while (!living_.empty()) remove_any();
    held_at_start_ = memory_.most = memory_.bytes;
  }

  void step() {
    const bool removes = living_.size() == kMostBatches || count() > kCharacters || random_.chance(0.3);
    if (living_.empty() || (random_.chance(0.05) && !removes))
      add_batch(random_.index(3), 1 + random_.index(kMostPerBatch));
    else if (removes && random_.chance(0.05))
      remove_any();
    for (auto& one : living_) replace_some(one.second, random_.chance(0.1) ? 1 : 0.01);
  }

  // Runs a frame, and compares it with one of a fresh engine if asked to. Returns its number of hits.
  std::size_t frame(bool compare) {
    if (random_.chance(0.1)) skips_ = !skips_;
    const std::size_t calls = memory_.calls;
    const std::vector<Hit>& hits = run(*engine_, false, hits_);
    CHECK(memory_.calls == calls);
    if (!compare) return hits.size();
    const EnginePtr fresh = make_engine();
    for (const Rig& rig : rigs_) add_rig(*fresh, rig);
    std::uint32_t slot = 0;
    for (const auto& one : living_) {  // the same slots; those between are of batches without input
      while (++slot < one.first) add_instances(*fresh, {1}, 1);
      add_instances(*fresh, {1 + rig_by_slot_.at(one.first)}, one.second.member.poses.instance_count);
    }
    const std::vector<Hit> all = run(*fresh, true, fresh_hits_);
    CHECK(missing_from(hits, all) == 0);
    // What the frame leaves out are hits of two that rest.
    std::size_t at = 0;
    for (const Hit& hit : all) {
      if (at < hits.size() && link_key(hits[at]) == link_key(hit)) {
        ++at;
        continue;
      }
      const bool rest = skips_ && !living_.at(hit.batch_a.value).moved[hit.instance_a] &&
                        !living_.at(hit.batch_b.value).moved[hit.instance_b];
      CHECK(rest);
    }
    CHECK(at == hits.size());
    return hits.size();
  }

  void end() {
    while (!living_.empty()) remove_any();
    CHECK(memory_.bytes == held_at_start_);
    CHECK(memory_.most <= held_at_start_ + kMostHeld);
  }

 private:
  // 60 bytes per character of at most eight batches, rounded up to whole lines and blocks of an arena.
  static constexpr std::size_t kMostHeld = kMostBatches * 64 * 1024;

  EngineDesc desc() {
    allocator_ = memory_.allocator();
    EngineDesc out;
    out.allocator = &allocator_;
    return out;
  }
  std::uint32_t count() const {
    std::uint32_t sum = 0;
    for (const auto& one : living_) sum += one.second.member.poses.instance_count;
    return sum;
  }
  Poses any_poses(const Rig& rig, std::uint32_t instances) {
    Poses poses = random_poses(random_, rig, instances, PoseFormat::kQuaternionTranslation, {2.5, true, true, {}});
    for (std::uint32_t i = 0; i < instances; ++i)
      poses.scales.push_back(static_cast<float>(random_.uniform(0.8, 1.25)));
    return poses;
  }
  void add_batch(std::size_t rig, std::uint32_t instances) {
    Living one;
    one.id = add_instances(*engine_, articulations_[rig], instances);
    one.member.rig = rigs_[rig];
    one.member.poses = any_poses(rigs_[rig], instances);
    one.moved.assign(instances, 1);
    rig_by_slot_[slot_of(one.id).value] = static_cast<std::uint32_t>(rig);
    living_[slot_of(one.id).value] = std::move(one);
  }
  void remove_any() {
    auto one = living_.begin();
    std::advance(one, random_.index(static_cast<std::uint32_t>(living_.size())));
    REQUIRE(remove_batch(*engine_, one->second.id) == Status::kOk);
    living_.erase(one);
  }
  void replace_some(Living& one, double share) {
    Poses& poses = one.member.poses;
    const Poses next = any_poses(one.member.rig, poses.instance_count);
    const auto copy = [&](const auto& from, auto& to, std::uint32_t i) {
      const auto per = static_cast<std::ptrdiff_t>(from.size() / poses.instance_count);
      std::copy_n(from.begin() + i * per, per, to.begin() + i * per);
    };
    for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
      one.moved[i] = random_.chance(share);
      if (!one.moved[i]) continue;
      copy(next.data, poses.data, i);
      copy(next.origins, poses.origins, i);
      copy(next.orientations, poses.orientations, i);
      copy(next.scales, poses.scales, i);
    }
  }

  const std::vector<Hit>& run(Engine& engine, bool all_moved, std::vector<Hit>& hits) {
    std::vector<BatchInput> inputs;
    std::vector<PairRule> rules;
    for (const auto& one : living_) {
      const BatchId slot = {one.first};  // a bare slot names what is in it
      inputs.push_back(one.second.member.poses.input(slot));
      if (!all_moved) inputs.back().moved = one.second.moved;
      for (const auto& other : living_)
        if (other.first <= one.first)
          rules.push_back({{other.first}, slot, Pairing::kBetween, skips_ ? Resting::kSkipped : Resting::kReported});
    }
    hits.resize(100000);
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.hits = hits;
    REQUIRE(run_frame(engine, job) == Status::kOk);
    hits.resize(job.hit_count);
    return hits;
  }

  Random random_{17};
  CountedMemory memory_;
  Allocator allocator_;
  EnginePtr engine_;
  std::vector<Rig> rigs_;
  std::vector<ArticulationId> articulations_;
  std::map<std::uint32_t, Living> living_;              // by slot
  std::map<std::uint32_t, std::uint32_t> rig_by_slot_;  // the index of the rig
  std::size_t held_at_start_ = 0;
  bool skips_ = false;  // whether two that rest are not tested
  std::vector<Hit> hits_, fresh_hits_;
};

}  // namespace

TEST_CASE("one engine over many frames holds no more memory, and has the hits of a fresh one") {
  Game game;
  const std::uint64_t frames = rounds(1000), between = std::max<std::uint64_t>(10, frames / 1000);
  std::size_t hits = 0;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    CAPTURE(frame);
    game.step();
    hits += game.frame(frame % between == 0);
  }
  game.end();
  CHECK(hits >= least_count(20000, 1000));
}

}  // namespace cab::tests
