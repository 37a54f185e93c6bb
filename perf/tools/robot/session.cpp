#include "perf/tools/robot/session.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "layout/frame_stats.h"
#include "perf/base/engine_call.h"
#include "scenes/robot/kinematics.h"

namespace cab::perf {
namespace {

// The limits of a chunk: of its states, of their links and named pairs, and of the hits that it may have at most.
// Together they take some 150 MB for the largest robots, and a few for most.
constexpr std::uint32_t kMaxChunkStates = 4096;
constexpr std::uint32_t kMinChunkStates = 16;  // a tile
constexpr std::size_t kMaxChunkPoses = std::size_t{1} << 20;
constexpr std::size_t kMaxChunkHits = std::size_t{1} << 22;

std::uint32_t chunk_states(std::size_t link_count) {
  const std::size_t link_pairs = std::max<std::size_t>(link_count * (link_count - 1) / 2, 1);
  const std::size_t states = std::min(kMaxChunkPoses / link_count, kMaxChunkHits / link_pairs);
  return static_cast<std::uint32_t>(std::clamp<std::size_t>(states, kMinChunkStates, kMaxChunkStates));
}

}  // namespace

RobotSession::RobotSession(const scenes::Robot& robot, std::vector<LinkPair> ignored,
                           const RobotSessionOptions& options)
    : robot_(robot), kinematics_(robot), policies_(options.policies), chunk_(chunk_states(robot.links.size())) {
  EngineDesc desc;
  desc.isa = options.isa;
  desc.thread_count = options.thread_count;
  engine_ = make_engine(desc);
  const scenes::ArticulationStorage storage(robot.body);
  ArticulationDesc articulation = storage.desc();
  articulation.ignored_pairs = ignored;
  std::uint32_t bad_leaf = 0;
  BatchDesc batch;
  const Status status = add_articulation(*engine_, articulation, &batch.articulation, &bad_leaf);
  if (status != Status::kOk)
    require(status, bad_leaf < robot.leaf_sources.size() ? robot.leaf_sources[bad_leaf] : robot.body.name);
  batch.instance_count = chunk_;
  batch.kind = BatchKind::kSequence;
  require(add_batch(*engine_, batch, &batch_), robot.body.name);
}

// Tests one chunk.
std::size_t RobotSession::run_hits(const BatchInput& input, FrameStats& sum) {
  const PairRule rule = {input.batch, input.batch, Pairing::kWithin};
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};
  job.policies = policies_;
  require(run_with_room(job, hits_, nullptr, [&] { return run_frame(*engine_, job); }), robot_.body.name);
  add_stats(sum, job.stats);
  return job.hit_count;
}

FrameStats RobotSession::run(const StateSource& states, const std::vector<LinkPair>& pairs,
                             const std::function<void(const StateChunk&)>& on_chunk) {
  FrameStats sum;
  std::vector<double> values;
  std::vector<float> poses;
  std::vector<Hit> named;
  std::vector<Contact> contacts;
  for (std::uint64_t first = 0; first < states.count; first += chunk_) {
    const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(chunk_, states.count - first));
    values.resize(count * robot_.variables.size());
    poses.resize(count * kinematics_.pose_floats());
    for (std::uint32_t s = 0; s < count; ++s) states.fill(first + s, values.data() + s * robot_.variables.size());
    kinematics_.write_poses(values, poses, isa());
    BatchInput input;
    input.batch = batch_;
    input.count = count;
    input.poses.data = poses.data();
    const std::size_t hit_count = run_hits(input, sum);

    named.clear();
    for (std::uint32_t s = 0; s < count; ++s)
      for (const LinkPair& pair : pairs)
        named.push_back({slot_of(input.batch), s, slot_of(input.batch), s, static_cast<std::uint16_t>(pair.a),
                         static_cast<std::uint16_t>(pair.b), 0, 0});
    contacts.resize(named.size());
    if (!named.empty())
      require(compute_contacts(*engine_, {&input, 1}, policies_.depth, named, contacts), robot_.body.name);
    on_chunk({first, count, {hits_.data(), hit_count}, contacts});
  }
  return sum;
}

}  // namespace cab::perf
