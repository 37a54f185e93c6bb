#include "scenes/robot/session.h"

#include "layout/frame_stats.h"

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string>

namespace cab::scenes {
namespace {

EngineDesc engine_desc(const RobotSessionOptions& options) {
  EngineDesc desc;
  desc.isa = options.isa;
  desc.thread_count = options.thread_count;
  return desc;
}

// What a refused leaf of a robot is called.
const std::string& source_of(const Robot& robot, std::uint32_t leaf) {
  return leaf < robot.leaf_sources.size() ? robot.leaf_sources[leaf] : robot.body.name;
}

}  // namespace

Exact exact_test_of(const Robot& robot) { return robot.body.skin.vertices.empty() ? Exact::kConvex : Exact::kSurface; }

RobotSession::RobotSession(const Robot& robot, Span<const LinkPair> ignored, const RobotSessionOptions& options)
    : robot_(robot), kinematics_(robot), checker_(engine_desc(options)) {
  require(checker_.status(), robot.body.name);
  const ArticulationStorage storage(robot.body);
  ArticulationDesc articulation = storage.desc();
  articulation.ignored_pairs = ignored;
  auto bad_leaf = static_cast<std::uint32_t>(robot.leaf_sources.size());
  const Status status = checker_.set_robot(articulation, kinematics_.desc(), &bad_leaf);
  require(status, source_of(robot, bad_leaf));
  if (!options.padding.empty()) {
    const Status padded = checker_.set_padding(articulation, options.padding, &bad_leaf);
    require(padded, source_of(robot, bad_leaf));
  }
  for (const Robot& body : options.around) {
    const ArticulationStorage fixed(body.body);
    const Kinematics joints(body);
    std::vector<float>& poses = around_poses_.emplace_back(joints.pose_floats());
    joints.write_poses(rest_state(body), poses);
    bad_leaf = static_cast<std::uint32_t>(body.leaf_sources.size());
    const Status added = checker_.add_fixed(fixed.desc(), poses, &bad_leaf);
    require(added, source_of(body, bad_leaf));
  }
  checker_.world().job().policies = options.policies;
  checker_.world().job().margin = options.margin;
}

void RobotSession::require(Status status, const std::string& what) const {
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw std::runtime_error(what + ": " + to_string(status));
}

FrameStats RobotSession::run(const StateSource& states, const std::vector<LinkPair>& pairs,
                             const std::function<void(const StateChunk&)>& on_chunk) {
  FrameStats sum;
  World& world = checker_.world();
  std::vector<double> values;
  std::vector<Hit> hits, named;
  std::vector<Contact> contacts;
  const std::size_t variables = robot_.variables.size();
  for (std::uint64_t first = 0; first < states.count; first += checker_.chunk()) {
    const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(checker_.chunk(), states.count - first));
    values.resize(count * variables);
    for (std::uint32_t s = 0; s < count; ++s) states.fill(first + s, values.data() + s * variables);
    require(checker_.find_hits(values, count), robot_.body.name);
    add_stats(sum, world.job().stats);

    named.clear();
    const BatchSlot slot = slot_of(world.inputs()[0].batch);
    for (std::uint32_t s = 0; s < count; ++s)
      for (const LinkPair& pair : pairs)
        named.push_back(
            {slot, s, slot, s, static_cast<std::uint16_t>(pair.a), static_cast<std::uint16_t>(pair.b), 0, 0});
    contacts.resize(named.size());
    if (!named.empty()) require(compute_contacts(world.engine(), world.inputs(), named, contacts), robot_.body.name);
    // Those of links with padding come after all others.
    hits.assign(world.hits().begin(), world.hits().end());
    std::stable_sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.instance_a < b.instance_a; });
    on_chunk({first, count, hits, contacts});
  }
  return sum;
}

}  // namespace cab::scenes
