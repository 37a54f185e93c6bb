// Which links may touch, and which fighters: masks within one fighter, layers between fighters.
#include <cab/world.h>

#include <cstdio>
#include <cstring>

enum Link : std::uint32_t { kTorso, kUpperArm, kForearm, kSheath, kLinkCount };

int main() {
  // Per link a quaternion x y z w and a translation. At rest the upper arm hangs beside the torso and touches the
  // sheath behind it; the forearm points forwards. Later one forearm lies across the belly, its elbow at the sheath.
  const float rest[kLinkCount][7] = {
      {0, 0, 0, 1, 0, 1, 0}, {0, 0, 0, 1, .34f, 1.4f, 0}, {0, 0, 0, 1, .34f, 1, 0}, {0, 0, 0, 1, .3f, .7f, -.1f}};
  const float across[7] = {0, -.7071068f, 0, .7071068f, .34f, 1, 0};

  const std::int32_t parents[kLinkCount] = {-1, kTorso, kUpperArm, kTorso};
  const cab::Leaf leaves[] = {{kTorso, cab::axis_aligned_box({0, 0, 0}, {.25f, .4f, .15f}), {}},
                              {kUpperArm, cab::axis_aligned_box({0, -.2f, 0}, {.1f, .25f, .1f}), {}},
                              {kForearm, cab::axis_aligned_box({0, 0, .25f}, {.08f, .08f, .25f}), {}},
                              {kSheath, cab::axis_aligned_box({0, 0, 0}, {.05f, .3f, .05f}), {}}};
  // quote
  const cab::LinkPair drawing = {kForearm, kSheath};
  cab::ArticulationDesc desc;
  desc.link_parents = parents;
  desc.leaves = leaves;
  desc.ignored_pairs = {&drawing, 1};  // a hand that draws the sword touches the sheath
  desc.ignored_hops = 1;               // parent and child always touch
  desc.rest_pose.data = &rest[0][0];   // links that touch at rest may always touch
  // end quote
  cab::World world;
  cab::ArticulationId fighter;
  cab::exit_on_error(cab::add_articulation(world.engine(), desc, &fighter));
  cab::IgnoredPair ignored[5];  // of six pairs of links, sorted; torso and forearm are left
  cab::exit_on_error(cab::ignored_pairs(world.engine(), fighter, ignored));
  const cab::IgnoredPair &child = ignored[0], &hanging = ignored[3], &drawn = ignored[4];
  bool right = child.b == kUpperArm && (child.reasons & cab::kIgnoredByHops) != 0 && hanging.a == kUpperArm &&
               hanging.reasons == cab::kIgnoredAtRest && drawn.a == kForearm &&
               drawn.reasons == cab::kIgnoredExplicitly;

  // quote
  // Two red fighters, two blue ones and a ghost stand in each other's way. Two fighters are a pair only if
  // the layer of each is in the mask of the other.
  constexpr std::uint32_t kRed = 1, kBlue = 2, kGhost = 0;
  const std::uint32_t layers[] = {kRed, kRed, kBlue, kBlue, kGhost};
  const std::uint32_t layer_masks[] = {kBlue, kBlue, kRed, kRed, kRed | kBlue};
  // end quote
  const double origins[5 * 3] = {0, 0, 0, .1, 0, 0, .2, 0, 0, .3, 0, 0, .4, 0, 0};
  float poses[5][kLinkCount][7];
  for (auto& pose : poses) std::memcpy(pose, rest, sizeof(rest));
  std::memcpy(poses[0][kForearm], across, sizeof(across));
  cab::BatchId fighters;
  cab::exit_on_error(world.add_batch({fighter, 5}, &fighters));
  // quote
  cab::exit_on_error(world.add_rule({fighters, fighters, cab::Pairing::kBetween}));
  cab::exit_on_error(world.add_rule({fighters, fighters, cab::Pairing::kWithin}));
  cab::BatchInput& input = *world.input(fighters);
  input.poses.data = &poses[0][0][0];
  input.origins = origins;
  input.layers = layers;
  input.layer_masks = layer_masks;
  // end quote
  cab::exit_on_error(world.run());

  int within = 0, opponents = 0;
  for (const cab::Hit& hit : world.hits()) {
    const bool same = hit.instance_a == hit.instance_b;
    within += same;
    opponents += !same && hit.link_a == kTorso && hit.link_b == kTorso;
    right = right && (same ? hit.instance_a == 0 && hit.link_a == kTorso && hit.link_b == kForearm
                           : hit.instance_a < 2 && (hit.instance_b == 2 || hit.instance_b == 3));
  }
  std::printf("%d hit within a fighter, %d pairs of opponents torso to torso\n", within, opponents);
  return right && within == 1 && opponents == 4 ? 0 : 1;
}
