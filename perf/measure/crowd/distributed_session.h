// A crowd in an engine of all ranks.
#pragma once

#include <cab/cab.h>
#include <cab/mpi.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/measure/crowd/options.h"
#include "perf/measure/crowd/rank_share.h"
#include "perf/measure/crowd/ranks.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

// Every rank gets the same answer, so all throw.
inline void require(const mpi::Answer& answer, const std::string& what) {
  if (answer.ok()) return;
  const char* const reason = answer.status == Status::kOutOfMemory ? "out of memory: its share of the crowd needs more"
                             : answer.status != Status::kOk        ? to_string(answer.status)
                                                                   : to_string(answer.difference);
  throw AgreedFailure(what + ": rank " + std::to_string(answer.rank) + ": " + reason);
}

// One batch per group, all characters paired, and then the level, as CrowdSession has it.
class DistributedSession {
 public:
  DistributedSession(const scenes::Crowd& crowd, const CrowdOptions& options, const std::string& program) {
    mpi::DistributedDesc desc;
    desc.engine.isa = options.isa;
    desc.engine.thread_count = options.thread_count;
    desc.program = program.c_str();
    mpi::DistributedEngine* engine = nullptr;
    require(mpi::create(MPI_COMM_WORLD, desc, &engine), "start");
    engine_.reset(engine);
    for (const scenes::CrowdGroup& group : crowd.groups) {
      const scenes::ArticulationStorage storage(group.figure);
      BatchDesc batch;
      batch.instance_count = group.count;
      require(mpi::add_articulation(*engine_, storage.desc(), &batch.articulation), group.figure.name);
      require(mpi::add_batch(*engine_, batch, &batches_.emplace_back()), group.figure.name);
      for (const BatchId other : batches_) rules_.push_back({other, batches_.back(), Pairing::kBetween});
    }
    if (crowd.level.count() == 0) return;
    require(mpi::add_static_batch(*engine_, crowd.level.desc(), &level_.emplace()), "level");
    for (const BatchId other : batches_) rules_.push_back({other, *level_, Pairing::kBetween});
  }

  // One frame. The hits in the job stay until the next one.
  mpi::DistributedJob run(const RankShare& share, const Policies& policies) {
    std::vector<mpi::RankInput> inputs;
    for (std::size_t g = 0; g < batches_.size(); ++g) {
      mpi::RankInput& one = inputs.emplace_back();
      one.numbers = share.numbers(g);
      one.input = input_of(share.posed(g), batches_[g]);
    }
    if (level_) inputs.emplace_back().input.batch = *level_;
    mpi::DistributedJob job;
    job.inputs = inputs;
    job.rules = rules_;
    job.policies = policies;
    require(mpi::run_frame(*engine_, job), "frame");
    job.inputs = {};
    return job;
  }

 private:
  struct Destroy {
    void operator()(mpi::DistributedEngine* engine) const { mpi::destroy(engine); }
  };
  std::unique_ptr<mpi::DistributedEngine, Destroy> engine_;
  std::vector<BatchId> batches_;
  std::optional<BatchId> level_;
  std::vector<PairRule> rules_;
};

}  // namespace cab::perf
