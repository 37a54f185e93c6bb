// A crowd of scenes/crowd/crowd.h in an engine: what `cab crowd` and `cab peers` measure.
#pragma once

#include <cab/cab.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "layout/arena.h"
#include "perf/base/engine_session.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

// Of the frames of a crowd.
inline constexpr double kCrowdFramesPerSecond = 30;

// The built-in allocator, with counts of the bytes that an engine holds, and of the most that it has held.
class CountedMemory {
 public:
  Allocator allocator() { return {this, allocate, release}; }
  std::size_t most() const { return most_; }

 private:
  static void* allocate(void* user, std::size_t bytes, std::size_t alignment) {
    auto& self = *static_cast<CountedMemory*>(user);
    void* const memory = self.inner_.allocate(self.inner_.user, bytes, alignment);
    if (memory == nullptr) return nullptr;
    const std::size_t held = self.held_ += bytes;
    std::size_t most = self.most_;
    while (held > most && !self.most_.compare_exchange_weak(most, held)) {}
    return memory;
  }
  static void release(void* user, void* memory, std::size_t bytes, std::size_t alignment) {
    auto& self = *static_cast<CountedMemory*>(user);
    self.held_ -= bytes;
    self.inner_.release(self.inner_.user, memory, bytes, alignment);
  }

  const Allocator inner_ = default_allocator();
  std::atomic<std::size_t> held_{0}, most_{0};
};

// What a session does with characters that the scene leaves at rest.
enum class AtRest : std::uint8_t { kMoved, kReported, kSkipped };

// Which characters are at a coarser level of detail: a share of each group, those farthest from the group's middle.
struct CoarseShare {
  double share = 0;
  LodKind kind = LodKind::kReach;
  std::uint32_t leaves = 1;  // most leaves of a character
};

// The characters of a group as they are posed.
inline BatchInput input_of(const scenes::PosedGroup& posed, BatchId batch) {
  BatchInput out;
  out.batch = batch;
  out.poses.data = posed.poses.data();
  out.origins = posed.origins;
  out.orientations = posed.orientations;
  return out;
}

// A crowd in an engine: one batch per group, all characters paired, and then the level, if there is one.
class CrowdSession {
 public:
  CrowdSession(const scenes::Crowd& crowd, Isa isa, std::uint32_t thread_count, AtRest at_rest = AtRest::kMoved)
      : at_rest_(at_rest), resting_(at_rest == AtRest::kSkipped ? Resting::kSkipped : Resting::kReported) {
    const Allocator allocator = memory_.allocator();
    EngineDesc desc;
    desc.isa = isa;
    desc.thread_count = thread_count;
    desc.allocator = &allocator;
    engine_ = make_engine(desc);
    for (const scenes::CrowdGroup& group : crowd.groups) {
      const BatchDesc batch = {add_character(*engine_, group.figure), group.count};
      BatchId id;
      require(add_batch(*engine_, batch, &id), group.figure.name);
      articulations_.push_back(batch.articulation);
      batches_.push_back(id);
      for (const BatchId other : batches_) rules_.push_back({other, id, Pairing::kBetween, resting_});
    }
    if (crowd.level.count() == 0) return;
    require(add_static_batch(*engine_, crowd.level.desc(), &level_.emplace()), "level");
    for (const BatchId other : batches_) rules_.push_back({other, *level_, Pairing::kBetween, resting_});
  }

  // Puts characters at a coarser level in all later frames. posed: the first frame, which says where joints are and who
  // is far away.
  void use_coarse(const CoarseShare& coarse, const std::vector<scenes::PosedGroup>& posed) {
    std::vector<BatchId> all = batches_;
    for (std::size_t g = 0; g < batches_.size(); ++g) {
      const auto count = static_cast<std::uint32_t>(posed[g].origins.size() / 3);
      LodDesc lod;
      lod.of = articulations_[g];
      lod.kind = coarse.kind;
      lod.max_leaves = coarse.leaves;
      lod.rest_poses.data = posed[g].poses.data();
      BatchDesc batch;
      batch.instance_count = count;
      require(add_lod(*engine_, lod, &batch.articulation), "level of detail");
      BatchId id;
      require(add_batch(*engine_, batch, &id), "level of detail");
      coarse_batches_.push_back(id);
      all.push_back(id);
      for (const BatchId other : all) rules_.push_back({other, id, Pairing::kBetween, resting_});
      if (level_) rules_.push_back({id, *level_, Pairing::kBetween, resting_});
      split(posed[g], static_cast<std::uint32_t>(std::llround(coarse.share * count)));
    }
  }

  // Gives the next frame margins, so that it finds what may have touched since the frame before. Returns the seconds.
  double sweep(const std::vector<scenes::PosedGroup>& last, const std::vector<scenes::PosedGroup>& posed) {
    const auto start = std::chrono::steady_clock::now();
    margins_.resize(posed.size());
    for (std::size_t g = 0; g < posed.size(); ++g) {
      margins_[g].resize(posed[g].origins.size() / 3);
      require(sweep_margins(*engine_, input_of(last[g], batches_[g]), input_of(posed[g], batches_[g]), margins_[g]),
              "sweep");
    }
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  // Runs one frame by a function like run_frame and returns its stats. The hits stay until the next frame. If their
  // buffer is too small, it grows and the frame runs again; the stats are then those of the last run. With
  // only_in_contact there are no hits, but one byte per character.
  FrameStats run(const std::vector<scenes::PosedGroup>& posed, const Policies& policies, bool only_in_contact = false,
                 RunFrame frame = run_frame) {
    std::vector<BatchInput> inputs(posed.size());
    in_contact_.resize(posed.size());
    for (std::size_t g = 0; g < posed.size(); ++g) {
      inputs[g] = input_of(posed[g], batches_[g]);
      if (!margins_.empty()) inputs[g].margins = margins_[g];
      if (at_rest_ != AtRest::kMoved) inputs[g].moved = posed[g].moved;
      if (!only_in_contact) continue;
      in_contact_[g].resize(posed[g].origins.size() / 3);
      inputs[g].in_contact = in_contact_[g];
    }
    for (std::size_t g = 0; g < coarse_batches_.size(); ++g) {
      inputs.push_back(inputs[g]);
      inputs.back().batch = coarse_batches_[g];
      list(far_[g], inputs.back());
      list(near_[g], inputs[g]);
    }
    if (level_) {
      inputs.emplace_back();
      inputs.back().batch = *level_;
    }
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules_;
    job.policies = policies;
    if (only_in_contact) job.report = Report::kInContact;
    require(run_with_room(job, hits_, nullptr, [&] { return frame(*engine_, job); }), "frame");
    hit_count_ = job.hit_count;
    return job.stats;
  }

  // Makes room for queries, as many at a time. See ReserveDesc::queries.
  void reserve_queries(std::uint32_t queries) {
    ReserveDesc room;
    room.queries = queries;
    require(reserve(*engine_, room), "room for queries");
  }

  // Answers queries, all characters taking part. The hits stay until the next call; their buffer grows as that of run.
  // reuse_bounds: the poses are those of the last frame.
  QueryStats answer(const std::vector<scenes::PosedGroup>& posed, Span<const Query> queries, bool reuse_bounds) {
    return answer(posed, queries, reuse_bounds, query_hits_, query_hit_count_);
  }

  // The same with a short list of hits.
  QueryStats answer_by_links(const std::vector<scenes::PosedGroup>& posed, Span<const Query> queries,
                             bool reuse_bounds) {
    return answer(posed, queries, reuse_bounds, query_links_, query_link_count_);
  }

  Span<const QueryHit> query_hits() const { return {query_hits_.data(), query_hit_count_}; }
  Span<const QueryLink> query_links() const { return {query_links_.data(), query_link_count_}; }

  // The boxes of a group: those of all nodes of each character, leaves first.
  std::uint32_t pose_boxes(const std::vector<scenes::PosedGroup>& posed, std::size_t group, std::vector<Box>& boxes) {
    ArticulationInfo info;
    require(articulation_info(*engine_, articulations_[group], &info), "articulation");
    boxes.resize(posed[group].origins.size() / 3 * info.node_count);
    require(compute_boxes(*engine_, input_of(posed[group], batches_[group]), {}, boxes), "boxes");
    return info.node_count;
  }

  // The characters of a group so that neighbours in the list are near each other in the last frame.
  std::vector<std::uint32_t> spatial_order(std::size_t group, std::size_t count) {
    std::vector<std::uint32_t> order(count);
    require(cab::spatial_order(*engine_, batches_[group], order), "spatial order");
    return order;
  }

  // The group whose characters a batch has, at whichever level; the number of groups for the level's static bodies.
  std::uint32_t group_of(BatchSlot slot) const {
    for (std::uint32_t g = 0; g < batches_.size(); ++g)
      if (slot_of(batches_[g]).value == slot.value ||
          (!coarse_batches_.empty() && slot_of(coarse_batches_[g]).value == slot.value))
        return g;
    return static_cast<std::uint32_t>(batches_.size());
  }

  const std::vector<std::vector<std::uint8_t>>& in_contact() const { return in_contact_; }
  Span<const Hit> hits() const { return {hits_.data(), hit_count_}; }
  std::size_t engine_bytes() const { return memory_.most(); }
  Isa isa() const { return engine_isa(*engine_); }
  std::uint32_t thread_count() const { return engine_thread_count(*engine_); }

 private:
  template <class Hit>
  QueryStats answer(const std::vector<scenes::PosedGroup>& posed, Span<const Query> queries, bool reuse_bounds,
                    std::vector<Hit>& hits, std::size_t& count) {
    std::vector<BatchInput> inputs(posed.size());
    for (std::size_t g = 0; g < posed.size(); ++g) inputs[g] = input_of(posed[g], batches_[g]);
    QueryJob job;
    job.inputs = inputs;
    job.queries = queries;
    job.reuse_bounds = reuse_bounds;
    require(run_with_room(job, hits, nullptr, [&] { return run_queries(*engine_, job); }), "queries");
    count = job.hit_count;
    return job.stats;
  }

  // Lists the `far_count` characters of a group that are farthest from its middle, and the others.
  void split(const scenes::PosedGroup& posed, std::uint32_t far_count) {
    const std::size_t count = posed.origins.size() / 3;
    double middle[3] = {0, 0, 0};
    for (std::size_t i = 0; i < posed.origins.size(); ++i)
      middle[i % 3] += posed.origins[i] / static_cast<double>(count);
    std::vector<std::pair<double, std::uint32_t>> away;
    for (std::uint32_t i = 0; i < count; ++i) {
      double square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double from_middle = posed.origins[3 * std::size_t{i} + c] - middle[c];
        square += from_middle * from_middle;
      }
      away.emplace_back(square, i);
    }
    std::sort(away.begin(), away.end());
    std::vector<std::uint32_t> near, far;
    for (std::size_t i = 0; i < count; ++i) (i < count - far_count ? near : far).push_back(away[i].second);
    std::sort(near.begin(), near.end());
    std::sort(far.begin(), far.end());
    near_.push_back(std::move(near));
    far_.push_back(std::move(far));
  }

  static void list(const std::vector<std::uint32_t>& instances, BatchInput& input) {
    input.instances = instances;
    if (instances.empty()) input.count = 0;
  }

  CountedMemory memory_;  // outlives the engine
  AtRest at_rest_;
  Resting resting_;
  oracle::EnginePtr engine_;
  std::vector<ArticulationId> articulations_;           // by group
  std::vector<BatchId> batches_;                        // by group
  std::vector<BatchId> coarse_batches_;                 // by group, if some are at a coarser level
  std::vector<std::vector<std::uint32_t>> near_, far_;  // by group, likewise: who is in which batch
  std::optional<BatchId> level_;
  std::vector<PairRule> rules_;
  std::vector<std::vector<float>> margins_;  // of each group, if frames are swept
  std::vector<Hit> hits_;
  std::size_t hit_count_ = 0;
  std::vector<QueryHit> query_hits_;
  std::vector<QueryLink> query_links_;
  std::size_t query_hit_count_ = 0, query_link_count_ = 0;
  std::vector<std::vector<std::uint8_t>> in_contact_;  // of each group, if asked for
};

}  // namespace cab::perf
