// A skeleton in plain arrays becomes bodies of human size. A hand without a bone touches a chest.
#include <cab/rig.h>
#include <cab/world.h>

#include <cstdio>

int main() {
  const std::int32_t parents[] = {-1, 0, 1, 1, 3, 4, 0, 6};
  const char* const names[] = {"hips", "spine", "head", "upperarm_l", "lowerarm_l", "hand_l", "thigh_l", "calf_l"};
  const float places[8][2] = {{0, .9f},    {0, 1.4f},    {0, 1.5f},  {.2f, 1.4f},
                              {.5f, 1.4f}, {.75f, 1.4f}, {.1f, .9f}, {.1f, .5f}};  // x and y in metres
  float poses[2][8][7] = {};  // [person][joint] to model: a quaternion x y z w, then the place
  for (int i = 0; i < 2 * 8; ++i) {
    float* const pose = poses[i / 8][i % 8];
    pose[3] = 1, pose[4] = places[i % 8][0], pose[5] = places[i % 8][1];
  }
  // quote
  const cab::PoseView rest = {cab::PoseFormat::kQuaternionTranslation, poses[0][0], 0, 0};
  const cab::rig::SkeletonDesc skeleton = {{parents, 8}, {names, 8}, rest, 1};
  cab::rig::Bodies bodies;  // owns all that bodies.desc() points to
  if (bodies_from_skeleton(skeleton, {}, &bodies) != cab::rig::Status::kOk) return 1;
  cab::World world;
  cab::BatchId people;
  cab::exit_on_error(world.add_batch(bodies.desc(), 2, &people));
  // end quote
  cab::exit_on_error(world.add_rule({people, people}));
  const double origins[] = {0, 0, 0, .95, 0, 0};
  world.input(people)->poses.data = poses[0][0];
  world.input(people)->origins = origins;
  cab::exit_on_error(world.run());
  if (world.hits().empty()) return 1;
  const cab::Hit& first = world.hits()[0];
  std::printf("%s touches %s\n", names[first.link_a], names[first.link_b]);
  return first.link_a == 5 ? 0 : 1;
}
