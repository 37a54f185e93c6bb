// A game's frame: characters of several sizes pass one who stands, those far away at a coarser level. Who touches?
#include <cab/world.h>

#include <cmath>
#include <cstdio>
#include <vector>

// Model-space matrices of a torso and a right hand, as ozz-animation makes them: with a scale, and a mirrored joint.
static void set_pose(float* m, float s) {
  const float pose[] = {s,  0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, 0,         .9f * s, 0, 1,
                        -s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, -.35f * s, s,       0, 1};
  for (int i = 0; i < 32; ++i) m[i] = pose[i];
}

int main() {
  constexpr std::uint32_t kSlots = 8;
  const std::int32_t parents[] = {-1, 0};
  const cab::Leaf leaves[] = {{0, cab::axis_aligned_box({0, 0, 0}, {.3f, .8f, .2f}), {}},
                              {1, cab::axis_aligned_box({.1f, 0, 0}, {.1f, .1f, .1f}), {}}};
  cab::World world;
  cab::ArticulationId body, coarse;
  cab::exit_on_error(cab::add_articulation(world.engine(), {parents, {}, leaves, {}}, &body));
  std::vector<float> matrices(32 * kSlots);
  set_pose(matrices.data(), 1);
  // quote
  cab::LodDesc lod;  // one box for all links, wherever the hand may turn
  lod.of = body;
  lod.rest_poses = {cab::PoseFormat::kMatrix4x4Columns, matrices.data()};
  cab::exit_on_error(cab::add_lod(world.engine(), lod, &coarse));
  cab::BatchId near_crowd, far_crowd;
  cab::exit_on_error(world.add_batch({body, kSlots}, &near_crowd));
  cab::exit_on_error(world.add_batch({coarse, kSlots}, &far_crowd));
  cab::exit_on_error(world.add_rule({near_crowd, near_crowd}));
  cab::exit_on_error(world.add_rule({near_crowd, far_crowd}));
  // end quote
  std::vector<double> origins(3 * kSlots);
  const std::vector<std::uint8_t> moved = {0, 1, 1, 1, 1, 1, 1, 1};  // slot 0 rests
  std::vector<cab::Hit> last, began(16), ended(16);
  std::size_t begun = 0, over = 0;
  for (std::uint32_t frame = 0; frame < 480; ++frame) {
    // The game: slot 0 stands and the others walk past, at the coarser level beyond 2 m. Beyond 4 m they are not there.
    std::vector<std::uint32_t> near_slots, far_slots;
    for (std::uint32_t slot = 0; slot < kSlots; ++slot) {
      set_pose(matrices.data() + 32 * slot, .9f + .02f * static_cast<float>(slot));
      const double x = origins[3 * slot] = slot ? std::fmod(.05 * frame + 3 * slot + 1.5, 24) - 12 : 0;
      if (std::fabs(x) < 4) (std::fabs(x) < 2 ? near_slots : far_slots).push_back(slot);
    }
    // quote
    for (cab::BatchInput& input : world.inputs()) {
      const std::vector<std::uint32_t>& slots = input.batch == near_crowd ? near_slots : far_slots;
      input.poses = {cab::PoseFormat::kMatrix4x4Columns, matrices.data(), 0, 0, true};  // true: matrices hold a scale
      input.origins = origins;
      input.instances = slots;
      input.count = slots.empty() ? 0 : kSlots;
      input.moved = moved;
    }
    cab::exit_on_error(world.run());
    if (world.job().stats.instances_masked) return 1;  // a bug: why_masked says which link, and what is wrong
    cab::HitChanges changes = {began, ended};
    cab::exit_on_error(cab::diff_hits(last, world.hits(), changes));
    // end quote
    begun += changes.began_count, over += changes.ended_count;
    last.assign(world.hits().begin(), world.hits().end());
  }
  std::printf("%zu pairs of links began to touch, %zu ended\n", begun, over);
  return begun == 4 * (kSlots - 1) && over == begun ? 0 : 1;  // torso and hand of each with those of slot 0
}
