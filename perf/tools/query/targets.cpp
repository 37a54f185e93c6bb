#include "perf/tools/query/targets.h"

#include <algorithm>

#include "perf/base/crowd_session.h"
#include "perf/base/engine_call.h"

namespace cab::perf {
namespace {

void make_room(Engine& engine, std::uint32_t query_room) {
  ReserveDesc room;
  room.queries = query_room;
  require(reserve(engine, room), "queries");
}

}  // namespace

Targets::Targets(const scenes::Scene& scene, const EngineDesc& desc, std::uint32_t query_room)
    : engine_(make_engine(desc)), scene_(&scene) {
  for (const scenes::Character& character : scene.characters) add(character.name, character, 1);
  make_room(*engine_, query_room);
}

Targets::Targets(const scenes::Crowd& crowd, const EngineDesc& desc, std::uint32_t query_room)
    : engine_(make_engine(desc)), crowd_(&crowd) {
  for (const scenes::CrowdGroup& group : crowd.groups) add(group.figure.name, group.figure, group.count);
  if (crowd.level.count() > 0) {
    groups_.push_back({"level", nullptr, crowd.level.count()});
    require(add_static_batch(*engine_, crowd.level.desc(), &inputs_.emplace_back().batch), "level");
  }
  make_room(*engine_, query_room);
}

void Targets::add(const std::string& name, const scenes::Character& figure, std::uint32_t count) {
  require(add_batch(*engine_, {add_character(*engine_, figure), count}, &inputs_.emplace_back().batch), name);
  groups_.push_back({name, &figure, count});
}

void Targets::pose(std::uint32_t frame) {
  if (crowd_) scenes::pose_crowd(*crowd_, frame / kCrowdFramesPerSecond, posed_);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (!groups_[g].figure) continue;
    const BatchId batch = inputs_[g].batch;
    inputs_[g] = crowd_ ? input_of(posed_[g], batch) : input_of(scene_->characters[g], batch, {frame, frame + 1});
  }
}

std::size_t Targets::group_of(BatchSlot slot) const {
  const auto same = [slot](const BatchInput& input) { return slot_of(input.batch).value == slot.value; };
  return static_cast<std::size_t>(std::find_if(inputs_.begin(), inputs_.end(), same) - inputs_.begin());
}

std::uint64_t Targets::count() const {
  std::uint64_t count = 0;
  for (const TargetGroup& group : groups_) count += group.count;
  return count;
}

}  // namespace cab::perf
