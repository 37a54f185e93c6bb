// A game's frame: characters of several sizes come, pass one who stands, and go. What began to touch, and what ended?
#include <cab/cab.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

static void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", cab::to_string(status));
  std::exit(1);
}

// A model-space matrix, as ozz-animation makes it. It holds the scale of the root; side is -1 for a mirrored joint.
static void set_matrix(float* m, float scale, float side, float x, float y) {
  const float columns[16] = {side * scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, scale * x, scale * y, 0, 1};
  for (int i = 0; i < 16; ++i) m[i] = columns[i];
}

int main() {
  constexpr std::uint32_t kSlots = 8, kLinks = 2, kWalkers = 7;
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));
  const std::int32_t parents[] = {-1, 0};
  const cab::Box torso = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.3f, .8f, .2f}};
  const cab::Box hand = {{.1f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.1f, .1f, .1f}};
  const cab::Leaf leaves[] = {{0, torso, {}}, {1, hand, {}}};
  cab::ArticulationId body;
  check(cab::add_articulation(*engine, {{parents, kLinks}, {}, {leaves, 2}, {}}, &body));
  cab::BatchId crowd;
  check(cab::add_batch(*engine, {body, kSlots, cab::BatchKind::kCharacters}, &crowd));
  std::vector<float> matrices(16 * kLinks * kSlots);
  std::vector<double> origins(3 * kSlots);
  const std::vector<std::uint8_t> moved = {0, 1, 1, 1, 1, 1, 1, 1};  // slot 0 rests
  std::vector<std::uint32_t> alive;
  std::vector<cab::Hit> hits(1), last, began(16), ended(16);
  const cab::PairRule rule = {crowd, crowd, cab::Pairing::kBetween};
  std::size_t begun = 0, over = 0;
  for (std::uint32_t frame = 0; frame < 420; ++frame) {
    // The game: slot 0 stands. A walker comes every 40 frames and goes after 160; slots 1 to 4 are reused.
    alive = {0};
    for (std::uint32_t slot = 1; slot <= 4; ++slot)
      for (std::uint32_t walker = slot - 1; walker < kWalkers; walker += 4)
        if (frame >= 40 * walker && frame < 40 * walker + 160) {
          alive.push_back(slot);
          origins[3 * slot] = -4 + .05 * (frame - 40 * walker);
        }
    for (const std::uint32_t slot : alive) {
      const float scale = .9f + .05f * static_cast<float>(slot);
      float* const of_slot = matrices.data() + 16 * kLinks * slot;
      set_matrix(of_slot, scale, 1, 0, .9f);
      set_matrix(of_slot + 16, scale, -1, -.35f, 1);  // a right hand, mirrored
    }
    // The frame: only slots that are alive, and once more if there was too little room.
    cab::BatchInput input;
    input.batch = crowd;
    input.poses = {cab::PoseFormat::kMatrix4x4, matrices.data(), 0, 0, true};  // true: matrices hold a scale
    input.origins = {origins.data(), origins.size()};
    input.instances = {alive.data(), alive.size()};
    input.moved = {moved.data(), moved.size()};
    cab::FrameJob job;
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    cab::Status status = cab::Status::kHitsOverflow;
    for (hits.resize(hits.capacity()); status == cab::Status::kHitsOverflow; hits.resize(job.hits_needed)) {
      job.hits = {hits.data(), hits.size()};
      status = cab::run_frame(*engine, job);
    }
    check(status);
    cab::MaskReason reason;
    if (job.stats.instances_masked) check(cab::why_masked(*engine, input, alive[0], &reason));  // log it: it is a bug
    cab::HitChanges changes = {{began.data(), began.size()}, {ended.data(), ended.size()}};
    check(cab::diff_hits({last.data(), last.size()}, {hits.data(), hits.size()}, changes));
    begun += changes.began_count, over += changes.ended_count;
    last = hits;
  }
  std::printf("%zu pairs of links began to touch, %zu ended\n", begun, over);
  cab::destroy_engine(engine);
  return begun == 4 * kWalkers && over == begun ? 0 : 1;  // torso and hand of each with torso and hand of slot 0
}
