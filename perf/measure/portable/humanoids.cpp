// The time of a crowd's frame, by a program that needs no package: for builds that the cab command is not in, such as
// WebAssembly. usage: humanoids ISA [CHARACTERS [FRAMES]]
#include <cab/cab.h>

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

void check(Status status) {
  if (status == Status::kOk) return;
  std::fprintf(stderr, "humanoids: %s\n", to_string(status));
  std::exit(1);
}

Isa isa_of(const char* name) {
  std::uint32_t isa = 0;
  while (isa < kIsaCount && std::strcmp(to_string(static_cast<Isa>(isa)), name) != 0) ++isa;
  return static_cast<Isa>(isa);
}

// The frame's hits. Makes room and runs it again if there is too little.
std::size_t run(Engine& engine, FrameJob& job, std::vector<Hit>& hits) {
  job.hits = hits;
  Status status = run_frame(engine, job);
  if (status == Status::kHitsOverflow) {
    hits.resize(2 * job.hits_needed);
    job.hits = hits;
    status = run_frame(engine, job);
  }
  check(status);
  return job.hit_count;
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

  Engine* engine = nullptr;
  check(create_engine(desc, &engine));
  const scenes::Character figure = scenes::make_humanoid();
  ArticulationDesc body;
  body.link_parents = figure.link_parents;
  body.link_joints = figure.link_joints;
  std::vector<Leaf> leaves;
  for (const scenes::BodyLeaf& leaf : figure.leaves) leaves.push_back({leaf.link, leaf.box, {}});
  body.leaves = leaves;
  BatchDesc batch;
  batch.instance_count = count;
  check(add_articulation(*engine, body, &batch.articulation));
  BatchInput input;
  check(add_batch(*engine, batch, &input.batch));
  const PairRule rule = {input.batch, input.batch, Pairing::kBetween};
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};

  std::vector<Hit> hits;
  std::vector<double> milliseconds;
  std::size_t hits_of_all = 0;
  for (std::size_t frame = 0; frame < kPoses + frames; ++frame) {
    input.poses.data = poses[frame % kPoses].data();
    input.origins = origins[frame % kPoses];
    const auto begin = std::chrono::steady_clock::now();
    const std::size_t found = run(*engine, job, hits);
    const auto end = std::chrono::steady_clock::now();
    if (frame < kPoses)  // these warm up
      hits_of_all += found;
    else
      milliseconds.push_back(std::chrono::duration<double, std::milli>(end - begin).count());
  }
  if (milliseconds.empty()) milliseconds.push_back(0);
  const auto middle = milliseconds.begin() + static_cast<std::ptrdiff_t>(milliseconds.size() / 2);
  std::nth_element(milliseconds.begin(), middle, milliseconds.end());
  std::printf("%s %.3f ms, %zu characters, %.1f hits per frame\n", to_string(engine_isa(*engine)), *middle,
              std::size_t{count}, static_cast<double>(hits_of_all) / static_cast<double>(kPoses));
  destroy_engine(engine);
}
