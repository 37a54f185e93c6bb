// Bodies of a thigh and a shin: from their joints alone, and from a skin of one triangle each.
#include <cab/cab.h>
#include <cab/rig.h>
#include <cab/skin.h>

#include <cstdio>

int main() {
  const std::int32_t parents[] = {-1, 0, 1};
  const char* const names[] = {"thigh_l", "calf_l", "foot_l"};
  float poses[3][7] = {};
  float matrices[3][16] = {}, inverse_bind[3][16] = {};
  for (int j = 0; j < 3; ++j) {
    poses[j][3] = 1;
    for (int k = 0; k < 4; ++k) matrices[j][5 * k] = inverse_bind[j][5 * k] = 1;
    poses[j][5] = matrices[j][13] = static_cast<float>(-j);
    inverse_bind[j][13] = static_cast<float>(j);
  }
  const cab::rig::SkeletonDesc skeleton = {
      {parents, 3}, {names, 3}, {cab::PoseFormat::kQuaternionTranslation, poses[0], 0, 0}, 1};
  cab::rig::Bodies of_joints;
  if (bodies_from_skeleton(skeleton, {}, &of_joints) != cab::rig::Status::kOk) return 1;

  const float vertices[] = {0, 0, 0, 1, 0, 0, 0, -1, 0, 0, -1, 0, 1, -1, 0, 0, -2, 0};
  const std::uint32_t triangles[] = {0, 1, 2, 3, 4, 5}, bones[] = {0, 0, 0, 1, 1, 1};
  const float weights[] = {1, 1, 1, 1, 1, 1};
  cab::rig::Skin skin;
  skin.joint_parents = {parents, 2};
  skin.poses = {matrices[0], 32};
  skin.vertices = {vertices, 18};
  skin.triangles = {triangles, 6};
  skin.influence_count = 1;
  skin.influence_bones = {bones, 6};
  skin.influence_weights = {weights, 6};
  skin.inverse_bind = {inverse_bind[0], 32};
  cab::rig::SkinBodies of_skin;
  if (bodies_from_skin(skin, {}, &of_skin) != cab::rig::SkinStatus::kOk) return 1;

  cab::Engine* engine = nullptr;
  if (create_engine({}, &engine) != cab::Status::kOk) return 1;
  const cab::ArticulationDesc descs[] = {of_joints.desc(), of_skin.desc()};
  for (const cab::ArticulationDesc& desc : descs) {
    cab::ArticulationId id;
    if (add_articulation(*engine, desc, &id) != cab::Status::kOk) return 1;
    std::printf("%d links, %d leaves\n", static_cast<int>(desc.link_parents.size), static_cast<int>(desc.leaves.size));
  }
  destroy_engine(engine);
}
