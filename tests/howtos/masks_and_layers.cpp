// Which links may touch, and which fighters: masks within one fighter, layers between fighters.
#include <cab/cab.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

static void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", cab::to_string(status));
  std::exit(1);
}

enum Link : std::uint32_t { kTorso, kUpperArm, kForearm, kSheath, kLinkCount };

static cab::Leaf leaf(Link link, float y, float z, float half_x, float half_y, float half_z) {
  return {link, {{0, y, z}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half_x, half_y, half_z}}, {}};
}

int main() {
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));

  // Per link a quaternion x y z w and a translation. At rest the upper arm hangs beside the torso and touches the
  // sheath behind it; the forearm points forwards. Later one forearm lies across the belly, its elbow at the sheath.
  const float rest[kLinkCount][7] = {
      {0, 0, 0, 1, 0, 1, 0}, {0, 0, 0, 1, .34f, 1.4f, 0}, {0, 0, 0, 1, .34f, 1, 0}, {0, 0, 0, 1, .3f, .7f, -.1f}};
  const float across[7] = {0, -.7071068f, 0, .7071068f, .34f, 1, 0};

  const std::int32_t parents[kLinkCount] = {-1, kTorso, kUpperArm, kTorso};
  const cab::Leaf leaves[] = {leaf(kTorso, 0, 0, .25f, .4f, .15f), leaf(kUpperArm, -.2f, 0, .1f, .25f, .1f),
                              leaf(kForearm, 0, .25f, .08f, .08f, .25f), leaf(kSheath, 0, 0, .05f, .3f, .05f)};
  const cab::LinkPair drawing = {kForearm, kSheath};
  cab::ArticulationDesc desc;
  desc.link_parents = {parents, kLinkCount};
  desc.leaves = {leaves, kLinkCount};
  desc.ignored_pairs = {&drawing, 1};  // a hand that draws the sword touches the sheath
  desc.ignored_hops = 1;               // parent and child always touch
  desc.rest_pose.data = &rest[0][0];   // links that touch at rest may always touch
  cab::ArticulationId fighter;
  check(cab::add_articulation(*engine, desc, &fighter));
  cab::IgnoredPair ignored[5];  // of six pairs of links; torso and forearm are left
  check(cab::ignored_pairs(*engine, fighter, {ignored, 5}));
  bool right = ignored[3].a == kUpperArm && ignored[3].b == kSheath && ignored[3].reasons == cab::kIgnoredAtRest &&
               ignored[4].a == kForearm && ignored[4].b == kSheath && ignored[4].reasons == cab::kIgnoredExplicitly;

  // Two red fighters, two blue ones and a ghost stand in each other's way. Two fighters are a pair only if
  // the layer of each is in the mask of the other.
  constexpr std::uint32_t kRed = 1, kBlue = 2, kGhost = 0;
  const std::uint32_t layers[] = {kRed, kRed, kBlue, kBlue, kGhost};
  const std::uint32_t layer_masks[] = {kBlue, kBlue, kRed, kRed, kRed | kBlue};
  const double origins[5 * 3] = {0, 0, 0, .1, 0, 0, .2, 0, 0, .3, 0, 0, .4, 0, 0};
  float poses[5][kLinkCount][7];
  for (auto& pose : poses) std::memcpy(pose, rest, sizeof(rest));
  std::memcpy(poses[0][kForearm], across, sizeof(across));
  cab::BatchId fighters;
  check(cab::add_batch(*engine, {fighter, 5, cab::BatchKind::kCharacters}, &fighters));
  const cab::PairRule rules[] = {{fighters, fighters, cab::Pairing::kBetween},
                                 {fighters, fighters, cab::Pairing::kWithin}};
  cab::BatchInput input;
  input.batch = fighters;
  input.poses.data = &poses[0][0][0];
  input.origins = {origins, 15};
  input.layers = {layers, 5};
  input.layer_masks = {layer_masks, 5};
  cab::Hit hits[100];
  cab::FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {rules, 2};
  job.hits = {hits, 100};
  check(cab::run_frame(*engine, job));

  int within = 0, opponents = 0;
  for (std::size_t i = 0; i < job.hit_count; ++i) {
    const cab::Hit& hit = hits[i];
    const bool same = hit.instance_a == hit.instance_b;
    within += same;
    opponents += !same && hit.link_a == kTorso && hit.link_b == kTorso;
    right = right && (same ? hit.instance_a == 0 && hit.link_a == kTorso && hit.link_b == kForearm
                           : hit.instance_a < 2 && (hit.instance_b == 2 || hit.instance_b == 3));
  }
  std::printf("%d hit within a fighter, %d pairs of opponents torso to torso\n", within, opponents);
  cab::destroy_engine(engine);
  return right && within == 1 && opponents == 4 ? 0 : 1;
}
