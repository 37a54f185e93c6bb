// Checks that an engine accepts an imported scene.
#pragma once

#include "perf/harness/world.h"
#include "scenes/scene.h"
#include "tests/fuzz/bytes.h"

namespace cab::fuzz {

// The engine must accept every character of an imported scene as an articulation, with one pose per link in every
// frame. The first frame is posed without a masked instance.
inline void taken_by_engine(const scenes::Scene& scene) {
  const oracle::EnginePtr engine = oracle::make_engine();
  FUZZ_CHECK(scene.frame_count >= 1 && scene.frame_seconds > 0);
  for (const scenes::Character& character : scene.characters) {
    const std::size_t frames = character.is_static ? 1 : scene.frame_count;
    FUZZ_CHECK(character.poses.size() == frames * character.link_parents.size() * pose_floats(character.pose_format));
    FUZZ_CHECK(character.origins.size() == 3 * frames);
    const scenes::ArticulationStorage storage(character);
    ArticulationId articulation;
    FUZZ_CHECK(add_articulation(*engine, storage.desc(), &articulation) == Status::kOk);
    BatchId batch;
    FUZZ_CHECK(add_batch(*engine, {articulation, 1, BatchKind::kSequence}, &batch) == Status::kOk);
    std::uint8_t flags = 0xee;
    BatchInput input;
    input.batch = batch;
    input.poses = {character.pose_format, character.poses.data(), 0, 0};
    input.origins = {character.origins.data(), 3};
    input.flags = {&flags, 1};
    FrameJob job;
    job.inputs = {&input, 1};
    FUZZ_CHECK(run_frame(*engine, job) == Status::kOk && flags == kInstanceOk);
  }
}

}  // namespace cab::fuzz
