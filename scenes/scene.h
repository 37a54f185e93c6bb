// A scene: characters, their poses over time, and the pairs of characters that are tested. It is plain data that owns
// its memory; tests and the commands of perf hand it to the engine.
#pragma once

#include <cab/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "layout/pose_coding.h"

namespace cab::scenes {

// A convex part that owns its vertices.
struct ShapePart {
  ConvexPart shape;             // shape.vertices is set by ArticulationStorage, not here
  std::vector<float> vertices;  // x y z per vertex
};

// A leaf that owns its parts or triangles.
struct BodyLeaf {
  std::uint32_t link = 0;
  Box box = {};
  std::vector<ShapePart> parts;
  std::vector<std::uint32_t> triangles = {};  // three vertices of the character's skin each
};

// A skin that owns its arrays: those of SkinDesc.
struct BodySkin {
  std::vector<float> vertices;
  std::uint32_t influence_count = 0;
  std::vector<std::uint32_t> influence_links;
  std::vector<float> influence_weights;
  std::vector<float> inverse_bind;
};
BodySkin copied(const SkinDesc& skin);

// Leaves that own their memory.
std::vector<BodyLeaf> copied(Span<const Leaf> leaves);

// One character: topology, leaves, and its poses for every frame of the scene.
struct Character {
  std::string name;
  std::vector<std::string> link_names;
  std::vector<std::int32_t> link_parents;
  std::vector<float> link_joints;  // empty, or x y z per link in the link's frame
  std::vector<BodyLeaf> leaves;
  BodySkin skin;  // of leaves with triangles
  std::vector<LinkPair> ignored_pairs;
  std::uint32_t ignored_hops = 0;           // as in ArticulationDesc
  std::optional<std::uint32_t> rest_frame;  // links that touch in this frame are ignored pairs as well

  PoseFormat pose_format = PoseFormat::kQuaternionTranslation;
  std::vector<float> poses;     // [frame][link][floats of pose_format], link to instance
  std::vector<double> origins;  // [frame][3] in the world; empty: all zero
  bool is_static = false;       // poses and origins hold one frame, which is that of all frames (a table)
};

// Two characters by their indices in the scene, a < b.
struct CharacterPair {
  std::uint32_t a;
  std::uint32_t b;
};

// Characters on one clock in one world.
struct Scene {
  std::string name;
  double frame_seconds = 0;
  std::uint32_t frame_count = 0;
  std::vector<Character> characters;
  std::vector<CharacterPair> pairs;  // the pairs to test; empty: all but those of two static characters
  std::vector<std::string> notes;    // what the importer merged, dropped or doubts
  char up = 0;                       // 'x', 'y' or 'z', or 0: unknown
};

// Makes the ArticulationDesc of a Character and owns the arrays that the desc points to. The desc also borrows from the
// character, which must outlive this.
class ArticulationStorage {
 public:
  explicit ArticulationStorage(const Character& character);
  ArticulationStorage(const ArticulationStorage&) = delete;
  ArticulationStorage& operator=(const ArticulationStorage&) = delete;
  const ArticulationDesc& desc() const { return desc_; }

 private:
  std::vector<std::vector<ConvexPart>> parts_;
  std::vector<Leaf> leaves_;
  ArticulationDesc desc_;
};

// FNV-1a hash of the bits of every pose and origin. It tells whether a difference arose before the engine.
std::uint64_t pose_hash(const Scene& scene);

// FNV-1a hash of the bits of every joint, leaf box, vertex and skin.
std::uint64_t shape_hash(const Scene& scene);

}  // namespace cab::scenes
