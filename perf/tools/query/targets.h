// What queries are asked of: the characters of files or of a crowd, posed at one frame after the other.
#pragma once

#include <cab/cab.h>

#include <cstdint>
#include <string>
#include <vector>

#include "perf/harness/engine_ptr.h"
#include "scenes/crowd/crowd.h"
#include "scenes/scene.h"

namespace cab::perf {

// The instances of one batch.
struct TargetGroup {
  std::string name;
  const scenes::Character* figure = nullptr;  // null: static bodies, which have no links
  std::uint32_t count = 0;
};

class Targets {
 public:
  // One batch per character of the files, or per group of the crowd, whose level is the last batch. The scene, or the
  // crowd, must outlive this. query_room: how many queries are worked on at a time. Throws std::runtime_error that
  // names the character and the engine's reason.
  Targets(const scenes::Scene& scene, const EngineDesc& desc, std::uint32_t query_room);
  Targets(const scenes::Crowd& crowd, const EngineDesc& desc, std::uint32_t query_room);

  // Poses all targets as they are in a frame. Frame f of a crowd is at f / kCrowdFramesPerSecond seconds.
  void pose(std::uint32_t frame);

  // The targets as posed last. Input g is of group g.
  Span<const BatchInput> inputs() const { return inputs_; }
  const std::vector<TargetGroup>& groups() const { return groups_; }
  std::size_t group_of(BatchSlot slot) const;
  std::uint64_t count() const;

  Engine& engine() { return *engine_; }
  const Engine& engine() const { return *engine_; }

 private:
  void add(const std::string& name, const scenes::Character& figure, std::uint32_t count);

  oracle::EnginePtr engine_;
  const scenes::Scene* scene_ = nullptr;
  const scenes::Crowd* crowd_ = nullptr;  // if there is no scene
  std::vector<TargetGroup> groups_;
  std::vector<BatchInput> inputs_;
  std::vector<scenes::PosedGroup> posed_;  // of the crowd
};

}  // namespace cab::perf
