// A game's frame: characters of several sizes pass one who stands, those far away at a coarser level. Who touches?
#include <cab/cab.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

static void check(cab::Status status) {
  if (status != cab::Status::kOk) throw std::runtime_error(cab::to_string(status));
}

// Model-space matrices of a torso and a right hand, as ozz-animation makes them: with a scale, and a mirrored joint.
static void set_pose(float* m, float s) {
  const float pose[] = {s,  0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, 0,         .9f * s, 0, 1,
                        -s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, -.35f * s, s,       0, 1};
  for (int i = 0; i < 32; ++i) m[i] = pose[i];
}

int main() {
  constexpr std::uint32_t kSlots = 8;
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));
  const std::int32_t parents[] = {-1, 0};
  const cab::Box torso = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.3f, .8f, .2f}};
  const cab::Box hand = {{.1f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.1f, .1f, .1f}};
  const cab::Leaf leaves[] = {{0, torso, {}}, {1, hand, {}}};
  cab::ArticulationId body, coarse;
  check(cab::add_articulation(*engine, {{parents, 2}, {}, {leaves, 2}, {}}, &body));
  std::vector<float> matrices(32 * kSlots);
  set_pose(matrices.data(), 1);
  cab::LodDesc lod;  // one box for all links, wherever the hand may turn
  lod.of = body;
  lod.rest_poses = {cab::PoseFormat::kMatrix4x4Columns, matrices.data()};
  check(cab::add_lod(*engine, lod, &coarse));
  cab::BatchId near_crowd, far_crowd;
  check(cab::add_batch(*engine, {body, kSlots, cab::BatchKind::kCharacters}, &near_crowd));
  check(cab::add_batch(*engine, {coarse, kSlots, cab::BatchKind::kCharacters}, &far_crowd));
  const cab::PairRule rules[] = {{near_crowd, near_crowd}, {near_crowd, far_crowd}};
  std::vector<double> origins(3 * kSlots);
  const std::vector<std::uint8_t> moved = {0, 1, 1, 1, 1, 1, 1, 1};  // slot 0 rests
  std::vector<cab::Hit> hits(1), last, began(16), ended(16);
  std::size_t begun = 0, over = 0;
  for (std::uint32_t frame = 0; frame < 480; ++frame) {
    // The game: slot 0 stands and the others walk past, at the coarser level beyond 2 m. Beyond 4 m they are not there.
    std::vector<std::uint32_t> near_slots, far_slots;
    for (std::uint32_t slot = 0; slot < kSlots; ++slot) {
      set_pose(matrices.data() + 32 * slot, .9f + .02f * static_cast<float>(slot));
      const double x = origins[3 * slot] = slot ? std::fmod(.05 * frame + 3 * slot + 1.5, 24) - 12 : 0;
      if (std::fabs(x) < 4) (std::fabs(x) < 2 ? near_slots : far_slots).push_back(slot);
    }
    cab::BatchInput inputs[2];
    inputs[0].batch = near_crowd;
    inputs[0].poses = {cab::PoseFormat::kMatrix4x4Columns, matrices.data(), 0, 0, true};  // true: matrices hold a scale
    inputs[0].origins = origins;
    inputs[0].instances = near_slots;
    inputs[0].moved = moved;
    inputs[1] = inputs[0];
    inputs[1].batch = far_crowd;
    inputs[1].instances = far_slots;
    inputs[1].count = far_slots.empty() ? 0 : kSlots;
    cab::FrameJob job;
    job.inputs = {inputs, 2};
    job.rules = {rules, 2};
    cab::Status status = cab::Status::kHitsOverflow;
    for (hits.resize(hits.capacity()); status == cab::Status::kHitsOverflow; hits.resize(job.hits_needed)) {
      job.hits = hits;
      status = cab::run_frame(*engine, job);  // once more if there was too little room
    }
    check(status);
    if (job.stats.instances_masked) return 1;  // a bug: why_masked says which link, and what is wrong
    cab::HitChanges changes = {began, ended};
    check(cab::diff_hits(last, hits, changes));
    begun += changes.began_count, over += changes.ended_count;
    last = hits;
  }
  std::printf("%zu pairs of links began to touch, %zu ended\n", begun, over);
  cab::destroy_engine(engine);
  return begun == 4 * (kSlots - 1) && over == begun ? 0 : 1;  // torso and hand of each with those of slot 0
}
