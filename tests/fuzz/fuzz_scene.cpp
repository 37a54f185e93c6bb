// Turns bytes into a scene, valid or not, such as assimp may make of any format. It goes to skeleton, links, world and
// engine.
#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/scene_file.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/taken_by_engine.h"

#include <assimp/scene.h>

#include <memory>

namespace {

using namespace cab;

aiString name_of(fuzz::Bytes& bytes) {
  aiString name(std::string(1, static_cast<char>('a' + bytes.below(12))));
  if (bytes.rarely()) name.data[0] = bytes.raw<char>();
  return name;
}

aiVector3D vector_of(fuzz::Bytes& bytes) {
  const float x = bytes.number(), y = bytes.number(), z = bytes.number();
  return {x, y, z};
}

aiNode* node_of(fuzz::Bytes& bytes, std::uint32_t depth) {
  auto* const node = new aiNode(name_of(bytes).C_Str());
  aiMatrix4x4& m = node->mTransformation;
  const aiVector3D at = vector_of(bytes);
  m.a4 = at.x, m.b4 = at.y, m.c4 = at.z;
  if (bytes.rarely())
    for (unsigned e = 0; e < 12; ++e) m[e / 4][e % 4] = bytes.number();
  node->mNumChildren = depth == 0 ? 0 : bytes.below(4);
  if (node->mNumChildren > 0) node->mChildren = new aiNode*[node->mNumChildren];
  for (unsigned c = 0; c < node->mNumChildren; ++c) (node->mChildren[c] = node_of(bytes, depth - 1))->mParent = node;
  return node;
}

// 0 to 3 keys, mostly in the order of time.
template <class Key>
void make_keys(fuzz::Bytes& bytes, unsigned& count, Key*& keys) {
  count = bytes.below(4);
  keys = count > 0 ? new Key[count] : nullptr;
  double time = 0;
  for (unsigned k = 0; k < count; ++k) {
    keys[k].mTime = bytes.rarely() ? bytes.raw<double>() : time;
    time += bytes.below(9);
    const aiVector3D v = vector_of(bytes);
    keys[k].mValue.x = v.x, keys[k].mValue.y = v.y, keys[k].mValue.z = v.z;
    if constexpr (std::is_same_v<Key, aiQuatKey>) keys[k].mValue.w = bytes.number();
  }
}

void make_animation(fuzz::Bytes& bytes, aiScene& scene) {
  auto* const animation = new aiAnimation;
  scene.mAnimations = new aiAnimation* [1] { animation };
  scene.mNumAnimations = 1;
  animation->mTicksPerSecond = bytes.rarely() ? bytes.raw<double>() : bytes.below(30);
  const std::uint32_t count = 1 + bytes.below(8);
  animation->mChannels = new aiNodeAnim*[count];
  for (; animation->mNumChannels < count; ++animation->mNumChannels) {
    auto* const track = animation->mChannels[animation->mNumChannels] = new aiNodeAnim;
    track->mNodeName = name_of(bytes);
    make_keys(bytes, track->mNumPositionKeys, track->mPositionKeys);
    make_keys(bytes, track->mNumRotationKeys, track->mRotationKeys);
    make_keys(bytes, track->mNumScalingKeys, track->mScalingKeys);
  }
}

void make_bones(fuzz::Bytes& bytes, aiScene& scene) {
  auto* const mesh = new aiMesh;
  scene.mMeshes = new aiMesh* [1] { mesh };
  scene.mNumMeshes = 1;
  const std::uint32_t count = 1 + bytes.below(8);
  mesh->mBones = new aiBone*[count];
  for (; mesh->mNumBones < count; ++mesh->mNumBones)
    (mesh->mBones[mesh->mNumBones] = new aiBone)->mName = name_of(bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const auto scene = std::make_shared<aiScene>();
  scene->mRootNode = node_of(bytes, 5);
  if (bytes.below(4) > 0) make_animation(bytes, *scene);
  if (bytes.below(4) == 0) make_bones(bytes, *scene);
  try {
    const scenes::Motion motion = scenes::motion_of_scene(scene, "clip", "");
    const scenes::Skeleton skeleton = scenes::skeleton_of_scene(*scene, "clip", motion, {});
    FUZZ_CHECK(skeleton.frame_seconds > 0 && skeleton.frame_seconds <= scenes::kMaxFrameSeconds);
    fuzz::taken_by_engine(scenes::make_world({scenes::make_clip(skeleton, "clip", {})}));
  } catch (const scenes::ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind("clip: ", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
