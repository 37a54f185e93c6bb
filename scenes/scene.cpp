// A scene handed to the engine: descriptions that borrow from it, and the hash of its poses.
#include "scenes/scene.h"

#include <cstring>

namespace cab::scenes {
namespace {

// Feeds the bits of a value to FNV-1a, lowest byte first on every machine.
template <class Bits, class Value>
std::uint64_t hash_bits(std::uint64_t hash, Value value) {
  static_assert(sizeof(Bits) == sizeof(Value));
  Bits bits;
  std::memcpy(&bits, &value, sizeof bits);
  for (std::size_t byte = 0; byte < sizeof bits; ++byte) {
    hash ^= static_cast<std::uint64_t>((bits >> (8 * byte)) & 0xff);
    hash *= 0x100000001b3u;  // FNV's 64-bit prime
  }
  return hash;
}

}  // namespace

std::uint32_t pose_floats(PoseFormat format) {
  switch (format) {
    case PoseFormat::kQuaternionTranslation: return 7;
    case PoseFormat::kMatrix3x4: return 12;
    case PoseFormat::kMatrix4x4: return 16;
  }
  return 0;
}

ArticulationStorage::ArticulationStorage(const Character& character)
    : parts_(character.leaves.size()), leaves_(character.leaves.size()) {
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    const BodyLeaf& body = character.leaves[l];
    parts_[l].reserve(body.parts.size());
    for (const Part& part : body.parts) {
      parts_[l].push_back(part.shape);
      parts_[l].back().vertices = {part.vertices.data(), part.vertices.size()};
    }
    leaves_[l].link = body.link;
    leaves_[l].box = body.box;
    leaves_[l].parts = {parts_[l].data(), parts_[l].size()};
  }
  desc_.link_parents = {character.link_parents.data(), character.link_parents.size()};
  desc_.link_joints = {character.link_joints.data(), character.link_joints.size()};
  desc_.leaves = {leaves_.data(), leaves_.size()};
  desc_.ignored_pairs = {character.ignored_pairs.data(), character.ignored_pairs.size()};
}

std::uint64_t pose_hash(const Scene& scene) {
  std::uint64_t hash = 0xcbf29ce484222325u;  // FNV's 64-bit offset basis
  for (const Character& character : scene.characters) {
    for (const float value : character.poses) hash = hash_bits<std::uint32_t>(hash, value);
    for (const double value : character.origins) hash = hash_bits<std::uint64_t>(hash, value);
  }
  return hash;
}

}  // namespace cab::scenes
