// Records what an engine is given and what comes back, frame by frame, and runs the recording again.
#include <cab/record.h>
#include <cab/replay.h>
#include <cab/world.h>

#include <cstdio>

namespace {

// Ends the program with what went wrong.
int fail(const char* what) {
  std::fprintf(stderr, "%s\n", what);
  return 1;
}

}  // namespace

int main() {
  // Two arms of two links each. The recorder is told what the engine is given.
  const std::int32_t parents[] = {-1, 0};
  const cab::Box bone = cab::axis_aligned_box({0.5f, 0, 0}, {0.5f, 0.1f, 0.1f});
  const cab::Leaf leaves[] = {{0, bone, {}}, {1, bone, {}}};
  cab::ArticulationDesc arm;
  arm.link_parents = parents;
  arm.leaves = leaves;
  cab::World world;
  cab::ArticulationId articulation;
  cab::exit_on_error(cab::add_articulation(world.engine(), arm, &articulation));
  const cab::BatchDesc desc = {articulation, 2};
  cab::BatchId arms;
  cab::exit_on_error(world.add_batch(desc, &arms));
  cab::exit_on_error(world.add_rule({arms, arms}));

  // quote
  cab::record::Recorder recorder;
  cab::record::RecorderOptions options;
  options.title = "two arms";
  options.isa = cab::engine_isa(world.engine());
  const char* const links[] = {"upper", "lower"};
  if (!recorder.open("two_arms.cab", options) || !recorder.add_articulation(articulation, arm, {"arm", links}) ||
      !recorder.add_batch(arms, desc, {"arms", {}}))
    return fail(recorder.error());
  // end quote

  // Frames as always. Each is recorded once it has run.
  for (int frame = 0; frame < 60; ++frame) {
    const float y = 0.5f - 0.01f * static_cast<float>(frame);
    const float poses[2][2][7] = {{{0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 1, 1, 0, 0}},
                                  {{0, 0, 0, 1, 0.5f, y, 0}, {0, 0, 0, 1, 1.5f, y, 0}}};
    world.input(arms)->poses.data = poses[0][0];
    // quote
    cab::exit_on_error(world.run());
    if (!recorder.add_frame(world.job(), frame / 60.0)) return fail(recorder.error());
    // end quote
  }
  if (!recorder.close()) return fail(recorder.error());

  // quote
  // The same frames again, here without SIMD.
  cab::record::Recording recording;
  if (!recording.open("two_arms.cab")) return fail(recording.error());
  for (const char* const problem : recording.problems()) std::printf("%s\n", problem);
  cab::EngineDesc without_simd;
  without_simd.isa = cab::Isa::kScalar;
  cab::record::Player player;
  if (!player.open(recording, without_simd)) return fail(player.error());
  std::uint32_t same = 0, in_contact = 0;
  for (std::uint32_t f = 0; f < recording.frame_count(); ++f) {
    cab::record::RecordedFrame frame;
    if (!recording.read_frame(f, &frame)) return fail(recording.error());
    if (!player.run(frame)) return fail(player.error());
    if (cab::record::hash_hits(player.hits(), player.contacts()) == frame.hash) ++same;
    if (!frame.hits.empty()) ++in_contact;
  }
  // end quote
  std::printf("%u of %u frames have the same bits, %u have hits\n", same, recording.frame_count(), in_contact);
  return same == recording.frame_count() && in_contact > 0 && in_contact < same ? 0 : 1;
}
