// What the engine keeps of a frame's hits for the next one: stories of many frames, each of which is compared with a
// frame that knows nothing of those before. CAB_TEST_SEED=N tells the story of that seed alone.
#include "engine/hits/hit_store.h"

#include "engine/hits/report.h"
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "tests/engine/small_store.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <limits>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// A batch of characters, and what is said of it in the frame at hand.
struct Troop {
  Rig rig;
  Poses poses;
  std::vector<float> margins;
  std::vector<std::uint32_t> layers, masks, listed;
  std::vector<std::uint8_t> moved;
  std::uint32_t count = kAllInstances;
  bool present = true;  // whether it has input

  std::uint32_t size() const { return poses.instance_count; }
};

// What a frame answered. Bytes are by batch, of the level last.
struct Answer {
  Status status = Status::kOk;
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::vector<std::vector<std::uint8_t>> flags, in_contact;
  FrameStats stats;
};

// Which story is told.
struct Plot {
  std::uint32_t most = 70;  // instances of a batch
  bool level = true;        // whether there may be static bodies
  bool skips = true;        // whether rules may skip what rests
  bool exact = true;        // whether there may be an exact test
  bool words = false;       // whether all instances can be compared by words
  bool troubles = true;     // whether calls fail in between, settings change, and batches come and go
  double spread = 2;        // how far from the middle instances stand
};

using RunFrame = decltype(&run_frame);

// Runs a frame's tasks in descending order on alternating workers.
Status run_backwards(Engine& engine, FrameJob& job) noexcept {
  Status status = begin_frame(engine, job);
  if (status != Status::kOk) return status;
  std::uint32_t count = 0;
  while ((status = next_tasks(engine, &count)) == Status::kOk && count > 0)
    for (std::uint32_t t = count; t-- > 0;)
      if (run_task(engine, t, t % engine_thread_count(engine)) != Status::kOk) return Status::kBadTask;
  return status == Status::kOk ? end_frame(engine) : status;
}

// Begins a frame and gives it up after one or two steps.
Status give_up(Engine& engine, FrameJob& job) noexcept {
  Status status = begin_frame(engine, job);
  if (status != Status::kOk) return status;
  std::uint32_t count = 0;
  const int steps = 1 + static_cast<int>(job.inputs.size + job.rules.size) % 2;
  for (int step = 0; step < steps && next_tasks(engine, &count) == Status::kOk; ++step)
    for (std::uint32_t t = 0; t < count; ++t)
      if (run_task(engine, t, 0) != Status::kOk) return Status::kBadTask;
  status = end_frame(engine);
  return status == Status::kTasksLeft ? Status::kOk : status;
}

class Story {
 public:
  Story(std::uint64_t seed, const Plot& plot, const EngineDesc& desc) : random_(seed), plot_(plot) {
    const std::uint32_t troops = 1 + random_.index(3);
    const bool layers = random_.chance(0.4), margins = random_.chance(0.3), scales = random_.chance(0.5);
    for (std::uint32_t t = 0; t < troops; ++t) {
      Troop troop;
      troop.rig = random_rig(random_, static_cast<Topology>(random_.index(3)), 2 + random_.index(6), 2);
      const std::uint32_t count = 1 + random_.index(plot.most);
      troop.poses = any_poses(troop.rig, count);
      if (scales) troop.poses.scales.assign(count, 1);
      if (margins) troop.margins.assign(count, 0);
      if (layers) troop.layers.assign(count, 1), troop.masks.assign(count, 7);
      troop.moved.assign(count, 1);
      troops_.push_back(std::move(troop));
    }
    const bool level = plot.level && random_.chance(0.6);
    for (std::uint32_t b = 0; level && b < 40; ++b) {
      StaticBody body;
      body.box = random_box(random_, 0.1 * random_.unit_vector(), 0.05, 0.5);
      for (double& at : body.origin) at = random_.uniform(-plot.spread, plot.spread);
      bodies_.push_back(body);
    }
    if (level && layers) layers_.assign(bodies_.size(), 1), masks_.assign(bodies_.size(), 7);
    make_rules();
    choose_settings();
    engine_ = make(desc);
    plain_ = make({});
  }

  // Goes on: some move, and some of what a caller may do happens. Then runs a frame and compares it.
  void frame() {
    if (frames_++ > 0) {
      move();
      if (plot_.troubles) trouble();
    }
    const RunFrame way = random_.chance(0.3) ? run_backwards : run_frame;
    if (plot_.troubles && random_.chance(0.06)) shrink_store(*engine_);
    const Answer found = tell(*engine_, true, kRoom, way);
    REQUIRE(found.status == Status::kOk);
    compare(found);
  }

  std::size_t hits = 0, kept = 0, resting = 0, contacts = 0;

 private:
  static constexpr std::size_t kRoom = 60000;

  BatchId level_id() const { return {troops_.size() + 1}; }

  Poses any_poses(const Rig& rig, std::uint32_t count) {
    return random_poses(random_, rig, count, PoseFormat::kQuaternionTranslation,
                        {plot_.spread, !plot_.words, true, {}});
  }

  EnginePtr make(const EngineDesc& desc) const {
    EnginePtr engine = make_engine(desc);
    for (const Troop& troop : troops_) add_instances(*engine, add_rig(*engine, troop.rig), troop.size());
    if (bodies_.empty()) return engine;
    StaticDesc level;
    level.bodies = bodies_;
    BatchId id;
    require(add_static_batch(*engine, level, &id));
    return engine;
  }

  void make_rules() {
    const auto count = static_cast<std::uint32_t>(troops_.size());
    const bool mixed = plot_.skips && random_.chance(0.4);
    const auto any = [&] { return mixed && random_.chance(0.4) ? Resting::kSkipped : Resting::kReported; };
    for (std::uint32_t a = 1; a <= count; ++a) {
      for (std::uint32_t b = a; b <= count; ++b)
        if (random_.chance(0.8)) rules_.push_back({{b}, {a}, Pairing::kBetween, any()});
      if (random_.chance(0.6)) rules_.push_back({{a}, {a}, Pairing::kWithin, any()});
      if (!bodies_.empty()) rules_.push_back({{a}, level_id(), Pairing::kBetween, any()});
    }
  }

  void choose_settings() {
    policies_ = {};
    policies_.strategy = static_cast<Strategy>(random_.index(policy_table()[1].value_count));
    if (random_.chance(0.3)) policies_.refit = Refit::kAabbHull;
    if (plot_.words) policies_.strategy = Strategy::kRows, policies_.refit = Refit::kCab;
    const bool exact = plot_.exact && random_.chance(0.4);
    if (exact) policies_.exact = Exact::kConvex;
    margin_ = random_.chance(0.3) ? 0.1f : 0;
    min_depth_ = exact && random_.chance(0.3) ? 0.03f : 0;
    contacts_ = exact && random_.chance(0.6);
    report_ = contacts_ && random_.chance(0.4) ? Report::kDistances : Report::kHits;
    if (!exact && plot_.troubles && random_.chance(0.1)) report_ = Report::kInContact;
  }

  // Gives an instance another place, and all else that it may not change at rest.
  void replace(Troop& troop, const Poses& next, std::uint32_t i) {
    const auto copy = [i, &troop](const auto& from, auto& to) {
      const auto per = static_cast<std::ptrdiff_t>(from.size() / troop.size());
      std::copy_n(from.begin() + i * per, per, to.begin() + i * per);
    };
    copy(next.data, troop.poses.data);
    copy(next.origins, troop.poses.origins);
    copy(next.orientations, troop.poses.orientations);
    if (!troop.poses.scales.empty()) troop.poses.scales[i] = static_cast<float>(random_.uniform(0.7, 1.4));
    if (!troop.margins.empty()) troop.margins[i] = random_.chance(0.3) ? 0.2f : 0;
    if (!troop.layers.empty()) troop.layers[i] = 1u << random_.index(3), troop.masks[i] = 1 + random_.index(7);
    if (random_.chance(0.02)) troop.poses.data[i * (troop.poses.data.size() / troop.size())] = std::nanf("");
  }

  void move() {
    const double shares[] = {0, 0, 0.03, 0.1, 0.1, 0.3, 0.6, 1};
    const double share = shares[random_.index(8)];
    for (Troop& troop : troops_) {
      // What a batch says is about its own last frame, so nobody moves in one without it.
      troop.present = !plot_.troubles || !random_.chance(0.04);
      if (!troop.present) continue;
      const Poses next = any_poses(troop.rig, troop.size());
      for (std::uint32_t i = 0; i < troop.size(); ++i) {
        troop.moved[i] = random_.chance(share);
        if (troop.moved[i]) replace(troop, next, i);
      }
      troop.listed.clear();
      troop.count = kAllInstances;
      if (!plot_.troubles) continue;
      if (random_.chance(0.1)) troop.count = random_.index(troop.size() + 1);
      const std::uint32_t given = std::min(troop.count, troop.size());
      if (!random_.chance(0.2)) continue;
      for (std::uint32_t i = 0; i < given; ++i)
        if (random_.chance(0.9)) troop.listed.push_back(i);
    }
    for (std::size_t b = 0; b < layers_.size(); ++b)
      if (random_.chance(0.02)) layers_[b] = 1u << random_.index(3), masks_[b] = 1 + random_.index(7);
    if (!bodies_.empty() && !layers_.empty() && random_.chance(0.05)) gives_layers_ = !gives_layers_;
  }

  void trouble() {
    if (random_.chance(0.05)) choose_settings();
    if (random_.chance(0.05)) {
      const Answer found = tell(*engine_, true, 1, run_frame);
      CHECK((found.status == Status::kHitsOverflow || found.status == Status::kOk));
      if (found.status == Status::kOk) some_come_to_rest();
    }
    if (random_.chance(0.04)) CHECK(tell(*engine_, true, kRoom, give_up).status == Status::kOk);
    if (random_.chance(0.03)) {
      margin_ = -margin_ - 1;
      CHECK(tell(*engine_, true, kRoom, run_frame).status == Status::kBadMargin);
      margin_ = -(margin_ + 1);
    }
    if (random_.chance(0.03)) {
      BatchId id;
      require(add_batch(*engine_, {{1}, 5}, &id));
      if (random_.chance(0.5)) require(reserve(*engine_, {4000, 12}));
      require(remove_batch(*engine_, id));
    }
    if (random_.chance(0.03)) {  // another batch in the same slot
      const std::uint32_t t = random_.index(static_cast<std::uint32_t>(troops_.size()));
      require(remove_batch(*engine_, {t + 1}));
      BatchId id;
      require(add_batch(*engine_, {{t + 1}, troops_[t].size()}, &id));
      REQUIRE(slot_of(id).value == t + 1);
    }
    if (random_.chance(0.03)) {  // nobody says anything
      const Answer found = tell(*engine_, false, kRoom, run_frame);
      REQUIRE(found.status == Status::kOk);
      compare(found);
    }
  }

  // After a frame that was answered, those who moved before it may rest.
  void some_come_to_rest() {
    for (Troop& troop : troops_)
      if (troop.present && random_.chance(0.5)) std::fill(troop.moved.begin(), troop.moved.end(), std::uint8_t{0});
  }

  bool is_present(BatchId id) const { return id.value > troops_.size() || troops_[id.value - 1].present; }

  Answer tell(Engine& engine, bool says_who_moves, std::size_t room, RunFrame way) const {
    Answer out;
    std::vector<BatchInput> inputs;
    for (const Troop& troop : troops_) {
      out.flags.emplace_back(troop.size(), std::uint8_t{0xee});
      out.in_contact.emplace_back(troop.size(), std::uint8_t{0xee});
    }
    out.flags.emplace_back(bodies_.size(), std::uint8_t{0xee});
    out.in_contact.emplace_back(bodies_.size(), std::uint8_t{0xee});
    for (std::size_t t = 0; t < troops_.size(); ++t) {
      const Troop& troop = troops_[t];
      if (!troop.present) continue;
      BatchInput input = troop.poses.input({t + 1});
      input.margins = troop.margins;
      input.layers = troop.layers;
      input.layer_masks = troop.masks;
      input.instances = troop.listed;
      input.count = troop.count;
      if (says_who_moves) input.moved = troop.moved;
      inputs.push_back(input);
    }
    if (!bodies_.empty()) {
      inputs.emplace_back();
      inputs.back().batch = level_id();
      if (gives_layers_) inputs.back().layers = layers_;
      if (gives_layers_) inputs.back().layer_masks = masks_;
    }
    for (BatchInput& input : inputs) {
      const std::size_t b = input.batch.value - 1;
      input.flags = out.flags[b];
      input.in_contact = out.in_contact[b];
    }
    std::vector<PairRule> rules;
    for (const PairRule& rule : rules_)
      if (is_present(rule.a) && is_present(rule.b)) rules.push_back(rule);
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.policies = policies_;
    job.margin = margin_;
    job.min_depth = min_depth_;
    job.report = report_;
    out.hits.resize(room);
    if (contacts_) out.contacts.resize(room);
    job.hits = out.hits;
    job.contacts = out.contacts;
    out.status = way(engine, job);
    out.hits.resize(out.status == Status::kOk ? job.hit_count : 0);
    if (contacts_) out.contacts.resize(out.hits.size());
    out.stats = job.stats;
    return out;
  }

  // Whether the frame was not to report a hit: both instances rested, and their rule skips such.
  bool is_skipped(const Hit& hit) const {
    const auto rests_in_engine = [this](BatchSlot slot, std::uint32_t instance) {
      return (engine_->batches[slot.value - 1]->batch.rest[instance] & kRests) != 0;
    };
    if (!rests_in_engine(hit.batch_a, hit.instance_a) || !rests_in_engine(hit.batch_b, hit.instance_b)) return false;
    const bool same = hit.batch_a.value == hit.batch_b.value && hit.instance_a == hit.instance_b;
    const std::uint32_t a = hit.batch_a.value, b = hit.batch_b.value;
    return std::any_of(rules_.begin(), rules_.end(), [&](const PairRule& rule) {
      const bool names = (slot_of(rule.a).value == a && slot_of(rule.b).value == b) ||
                         (slot_of(rule.a).value == b && slot_of(rule.b).value == a);
      return names && (rule.pairing == Pairing::kWithin) == same && rule.resting == Resting::kSkipped;
    });
  }

  void compare(const Answer& found) {
    const Report asked = report_;
    if (report_ == Report::kInContact) report_ = Report::kHits;
    Answer expected = tell(*plain_, false, kRoom, run_frame);
    report_ = asked;
    REQUIRE(expected.status == Status::kOk);
    std::size_t left = 0;
    for (std::size_t i = 0; i < expected.hits.size(); ++i) {
      if (is_skipped(expected.hits[i])) continue;
      expected.hits[left] = expected.hits[i];
      if (contacts_) expected.contacts[left] = expected.contacts[i];
      ++left;
    }
    expected.hits.resize(left);
    if (contacts_) expected.contacts.resize(left);
    for (std::size_t b = 0; b < expected.in_contact.size(); ++b)
      if (is_present({b + 1})) std::fill(expected.in_contact[b].begin(), expected.in_contact[b].end(), std::uint8_t{0});
    for (const Hit& hit : expected.hits)
      expected.in_contact[hit.batch_a.value - 1][hit.instance_a] =
          expected.in_contact[hit.batch_b.value - 1][hit.instance_b] = 1;
    if (asked == Report::kInContact)
      CHECK(found.hits.empty());
    else
      CHECK(same_hits(found.hits, expected.hits));
    CHECK(found.in_contact == expected.in_contact);
    CHECK(found.flags == expected.flags);
    REQUIRE(found.contacts.size() == expected.contacts.size());
    static_assert(sizeof(Contact) == 44, "no padding to compare");
    if (!found.contacts.empty())
      CHECK(std::memcmp(found.contacts.data(), expected.contacts.data(), found.contacts.size() * sizeof(Contact)) == 0);
    hits += found.hits.size();
    contacts += found.contacts.size();
    kept += found.stats.hits_kept;
    resting += found.stats.instances_resting;
  }

  Random random_;
  Plot plot_;
  std::vector<Troop> troops_;
  std::vector<StaticBody> bodies_;
  std::vector<std::uint32_t> layers_, masks_;  // of the bodies
  bool gives_layers_ = true;
  std::vector<PairRule> rules_;
  Policies policies_;
  float margin_ = 0, min_depth_ = 0;
  bool contacts_ = false;
  Report report_ = Report::kHits;
  EnginePtr engine_, plain_;  // the second is never told who moves
  std::uint64_t frames_ = 0;
};

}  // namespace

TEST_CASE("hits are kept while the store holds those of the last frame") {
  Random random(3);
  World world;
  for (int m = 0; m < 2; ++m) {
    Member member;
    member.rig = random_rig(random, Topology::kTree, 4, 2);
    member.poses = random_poses(random, member.rig, 150, PoseFormat::kQuaternionTranslation, {2, true, true, {}});
    world.members.push_back(std::move(member));
  }
  pair_all(world, 1, 2);
  const EnginePtr engine = make_engine_for(world);
  const std::vector<Hit> expected = run_world(world).hits;
  REQUIRE(expected.size() > 500);
  std::vector<std::uint8_t> moved(150, 0);
  const auto frame = [&](Report report = Report::kHits) {
    std::vector<BatchInput> inputs;
    std::vector<std::uint8_t> touching(150, 0xee);
    for (std::uint32_t m = 0; m < 2; ++m) {
      inputs.push_back(world.members[m].poses.input({m + 1}));
      inputs[m].moved = moved;
    }
    inputs[0].in_contact = touching;
    std::vector<Hit> hits(expected.size());
    FrameJob job;
    job.inputs = inputs;
    job.rules = world.rules;
    job.report = report;
    job.hits = hits;
    REQUIRE(run_frame(*engine, job) == Status::kOk);
    if (report == Report::kHits) CHECK(same_hits(hits, expected));
    CHECK(touching == in_contact_by(world, expected)[0]);
    return job.stats;
  };
  const auto all_are_tested = [&] {
    const FrameStats stats = frame();
    CHECK(stats.hits_kept == 0);
    CHECK(stats.candidates > 0);
  };
  const auto all_are_kept = [&] {
    const FrameStats stats = frame();
    CHECK(stats.hits_kept == expected.size());
    CHECK(stats.candidates == 0);
    CHECK(stats.box_tests == 0);
    CHECK(stats.instances_posed == 0);
    CHECK(stats.instances_resting == 300);
  };
  const auto used = [&engine] {
    std::uint32_t words = 0;
    for (std::uint32_t block = 0; block < engine->hit_store.claimed; ++block) words += *engine->hit_store.block(block);
    return words;
  };
  all_are_tested();
  const std::uint32_t words = used();
  for (int times = 0; times < 3; ++times) {
    all_are_kept();
    CHECK(used() == words);
  }
  // Gaps close: frame after frame in which a few move, the store holds no more than the hits take.
  for (std::uint32_t i = 0; i < 150; i += 7) {
    moved[i] = 1;
    const FrameStats stats = frame();
    CHECK(stats.hits_kept > 0);
    CHECK(stats.hits_kept < expected.size());
    CHECK(used() == words);
    moved[i] = 0;
  }
  all_are_kept();
  // A frame that stores no hits.
  CHECK(frame(Report::kInContact).hits_kept == 0);
  CHECK(frame(Report::kInContact).hits_kept == 0);
  all_are_tested();
  all_are_kept();
}

TEST_CASE("more hits than 32 bits count are counted") {
  Hit room[4];
  FrameJob job;
  job.hits = room;
  HitStore store;
  HitSink sink = {&job, &store};
  sink.stored_hits = 0xffffffff;
  CHECK(begin_writing_hits({}, 2, sink) == 0);
  finish_hits(sink);
  CHECK(job.hits_needed == std::min<std::uint64_t>(0x100000001, std::numeric_limits<std::size_t>::max()));
  CHECK(job.hit_count == 0);
}

TEST_CASE("whoever rests and whatever happens in between, frames have the hits of frames that keep nothing") {
  ThreadPool pool(4);
  const Scheduler scheduler = pool.scheduler();
  std::size_t hits = 0, kept = 0, resting = 0, contacts = 0;
  const std::uint64_t alone = number_from_environment("CAB_TEST_SEED", 0);
  for (std::uint64_t seed = alone ? alone : 1; seed <= (alone ? alone : rounds(40)); ++seed) {
    CAPTURE(seed);
    Plot plot;
    plot.troubles = seed % 3 != 0;
    plot.words = seed % 4 < 2;
    plot.most = seed % 10 == 0 ? 400 : 70;
    if (plot.most > 100) plot.spread = 4;
    EngineDesc desc;
    if (seed % 2) desc.scheduler = &scheduler;
    Story story(seed, plot, desc);
    for (int frame = 0; frame < 25; ++frame) {
      CAPTURE(frame);
      story.frame();
    }
    hits += story.hits;
    kept += story.kept;
    resting += story.resting;
    contacts += story.contacts;
  }
  if (alone) return;
  CHECK(hits >= least_count(133400, 40));
  CHECK(kept >= least_count(50000, 40));
  CHECK(contacts >= least_count(20000, 40));
  CHECK(resting >= least_count(33400, 40));
}

}  // namespace cab::tests
