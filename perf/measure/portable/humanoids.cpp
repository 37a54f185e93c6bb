// The time of a crowd's frame, by a program that needs no package: for builds that the cab command is not in, such as
// WebAssembly. usage: humanoids ISA [CHARACTERS [FRAMES]]
#include <cab/world.h>

#include "scenes/crowd/humanoid.h"
#include "scenes/random.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace {

using namespace cab;

constexpr std::uint64_t kSeed = 1;
constexpr double kFrameSeconds = 1.0 / 30;
constexpr std::size_t kPoses = 16;  // different frames, run in turns

Isa isa_of(const char* name) {
  std::uint32_t isa = 0;
  while (isa < kIsaCount && std::strcmp(to_string(static_cast<Isa>(isa)), name) != 0) ++isa;
  return static_cast<Isa>(isa);
}

}  // namespace

int main(int argument_count, char** arguments) {
  const auto number = [&](int at, unsigned long otherwise) {
    return argument_count > at ? std::strtoul(arguments[at], nullptr, 10) : otherwise;
  };
  EngineDesc desc;
  desc.isa = isa_of(argument_count > 1 ? arguments[1] : "auto");
  const auto count = static_cast<std::uint32_t>(number(2, 2000));
  const std::size_t frames = number(3, 160);

  // One character per square metre, each with a motion of its own.
  const double side = std::sqrt(static_cast<double>(count));
  std::vector<std::vector<float>> poses(kPoses);
  std::vector<std::vector<double>> origins(kPoses);
  for (std::size_t f = 0; f < kPoses; ++f) {
    poses[f].resize(std::size_t{count} * scenes::kHumanoidPoseFloats);
    origins[f].resize(std::size_t{count} * 3);
  }
  scenes::Random random(kSeed);
  for (std::uint32_t i = 0; i < count; ++i) {
    const scenes::HumanoidMotion motion = scenes::draw_humanoid(random);
    const double x = random.uniform(0, side), y = random.uniform(0, side);
    for (std::size_t f = 0; f < kPoses; ++f)
      scenes::pose_humanoid(motion, x, y, kFrameSeconds * static_cast<double>(f),
                            poses[f].data() + std::size_t{i} * scenes::kHumanoidPoseFloats,
                            origins[f].data() + std::size_t{i} * 3);
  }

  const scenes::Character figure = scenes::make_humanoid();
  ArticulationDesc body;
  body.link_parents = figure.link_parents;
  body.link_joints = figure.link_joints;
  std::vector<Leaf> leaves;
  for (const scenes::BodyLeaf& leaf : figure.leaves) leaves.push_back({leaf.link, leaf.box, {}});
  body.leaves = leaves;
  World world(desc);
  BatchId batch;
  exit_on_error(world.add_batch(body, count, &batch));
  exit_on_error(world.add_rule({batch, batch}));
  BatchInput& input = *world.input(batch);

  std::vector<double> milliseconds;
  std::size_t hits_of_all = 0;
  for (std::size_t frame = 0; frame < kPoses + frames; ++frame) {
    input.poses.data = poses[frame % kPoses].data();
    input.origins = origins[frame % kPoses];
    const auto begin = std::chrono::steady_clock::now();
    exit_on_error(world.run());
    const auto end = std::chrono::steady_clock::now();
    if (frame < kPoses)  // these warm up
      hits_of_all += world.hits().size;
    else
      milliseconds.push_back(std::chrono::duration<double, std::milli>(end - begin).count());
  }
  if (milliseconds.empty()) milliseconds.push_back(0);
  const auto middle = milliseconds.begin() + static_cast<std::ptrdiff_t>(milliseconds.size() / 2);
  std::nth_element(milliseconds.begin(), middle, milliseconds.end());
  std::printf("%s %.3f ms, %zu characters, %.1f hits per frame\n", to_string(engine_isa(world.engine())), *middle,
              std::size_t{count}, static_cast<double>(hits_of_all) / static_cast<double>(kPoses));
}
