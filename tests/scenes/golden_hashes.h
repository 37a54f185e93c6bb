// The bits that the paper's scenes must give on every machine, as hashes of their first 300 frames. A change of a hash
// is a change of results and belongs into CHANGELOG. Where a row differs, the tests print the row that they find.
#pragma once

#include "layout/bit_hash.h"
#include "scenes/paper/registry.h"

#include <cab/types.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iomanip>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

namespace cab::tests {

inline constexpr std::uint32_t kGoldenFrames = 300;

// The methods in the columns of the table. The oriented ones come first; their boxes are what kernels write.
inline constexpr std::array<Policies, 10> kGoldenPolicies = {{
    {Refit::kCab, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kCab, Strategy::kTree, Exact::kNone, Extents::kLeaves},
    {Refit::kCabSum, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kCovariance, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kBest3, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kBest3, Strategy::kTree, Exact::kNone, Extents::kLeaves},
    {Refit::kCab, Strategy::kTree, Exact::kNone, Extents::kChildren, Sat::kFaces6},
    {Refit::kCab, Strategy::kBrute, Exact::kNone, Extents::kChildren, Sat::kFaces6},
    {Refit::kAabbHull, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kAabbVertices, Strategy::kTree, Exact::kNone, Extents::kChildren},
}};
inline constexpr std::size_t kGoldenOriented = 8;

// Hashes of all boxes of all frames and of all hits of boxes, as `cab paper --frames 300` prints them.
struct GoldenBits {
  std::uint64_t boxes;
  std::uint64_t hits;
};

// poses and shapes are hashes of what the scene itself computes with the C library's sin, cos and pow.
struct GoldenScene {
  std::uint32_t table;
  std::uint64_t poses;
  std::uint64_t shapes;
  std::array<GoldenBits, kGoldenPolicies.size()> bits;
};

inline constexpr std::array<GoldenScene, 5> kGoldenScenes = {{
    {1,
     0x3a8662e80a3da16f,
     0xa515e2d97ddb9c45,
     {{{0xce5e69081b0481a4, 0x01c680caaf4ad89f},
       {0x5220a8a8c1bba81d, 0x01c680caaf4ad89f},
       {0xce5e69081b0481a4, 0x01c680caaf4ad89f},
       {0x6411a3f582b4c15a, 0x01c680caaf4ad89f},
       {0x2f8a05204083d4d0, 0x01c680caaf4ad89f},
       {0xa52f3f4664373536, 0x01c680caaf4ad89f},
       {0xce5e69081b0481a4, 0x1bcaeafc1b752b58},
       {0xce5e69081b0481a4, 0x1bcaeafc1b752b58},
       {0xdc705c36ea263c17, 0x76f84ce1f1a361ad},
       {0x21f19be3f68bd743, 0xfb5d8bab14e95fff}}}},
    {2,
     0x7179d7f5310169f9,
     0x93caa37ace0ea765,
     {{{0xed6645d733d2d089, 0x8c82324248f41ca9},
       {0xe75386e757b18e6d, 0x8c82324248f41ca9},
       {0xed6645d733d2d089, 0x8c82324248f41ca9},
       {0xcca5d29bd522df37, 0x8c82324248f41ca9},
       {0xe2c4aab6dbbd4c23, 0x8c82324248f41ca9},
       {0xefcbb9c174f327ac, 0x8c82324248f41ca9},
       {0xed6645d733d2d089, 0x48fb41ca9fc86416},
       {0xed6645d733d2d089, 0xb885de9073c023f9},
       {0xfced7912358495bf, 0xf237cccb834d1c87},
       {0xb9b66eb4c232f42d, 0xa9b25c458c04fa8f}}}},
    {3,
     0x7179d7f5310169f9,
     0x2de915711b331e95,
     {{{0xa0a4ee6893a1b3a7, 0x8d9d7f047b8b2b45},
       {0x0a12a7920ca40443, 0x8d9d7f047b8b2b45},
       {0xa0a4ee6893a1b3a7, 0x8d9d7f047b8b2b45},
       {0x15dde735779bcefc, 0x8d9d7f047b8b2b45},
       {0xc66100726bed0de2, 0x8d9d7f047b8b2b45},
       {0xd576b5af3deb32db, 0x8d9d7f047b8b2b45},
       {0xa0a4ee6893a1b3a7, 0xc37530a325b60011},
       {0xa0a4ee6893a1b3a7, 0x3f8eebddb5863b91},
       {0x663c75016eed9d61, 0x4aef46d1c0a7254a},
       {0xe49b6c202387cfae, 0x8a6cdcc3f7634f09}}}},
    {4,
     0xeae26cae287ec0b6,
     0xd53df5f4bc4d2e45,
     {{{0x015d94c17d510181, 0x89389d83edc7a9ce},
       {0xaed3a4b70cad67aa, 0x89389d83edc7a9ce},
       {0x015d94c17d510181, 0x89389d83edc7a9ce},
       {0x0c0be6a5711ea52e, 0x89389d83edc7a9ce},
       {0xd54d5755865a10a2, 0x89389d83edc7a9ce},
       {0x9e667ac7af3a0b78, 0x89389d83edc7a9ce},
       {0x015d94c17d510181, 0xb9073b22547b84f6},
       {0x015d94c17d510181, 0x1286e66ecedec97d},
       {0xd8df6abde439efe6, 0x9c49f3dd378ad192},
       {0x3b85447da4b2c47e, 0xec01009d70cc4879}}}},
    {5,
     0x20f7d36ca46d49eb,
     0x785d2a33cbaaef4e,
     {{{0x16a7f4e97b5ed58a, 0x81618555a1b758f9},
       {0x9b4a5fd9680abfc3, 0x81618555a1b758f9},
       {0x102a3e0d763251e1, 0x81618555a1b758f9},
       {0x22d9566321067c8a, 0x81618555a1b758f9},
       {0x44b7d97c454407f4, 0x81618555a1b758f9},
       {0x479a6f8842c9f91e, 0x81618555a1b758f9},
       {0x16a7f4e97b5ed58a, 0xca8fc29eec95deeb},
       {0x16a7f4e97b5ed58a, 0xca8fc29eec95deeb},
       {0xca388b471f4d0c95, 0xf621b5043b94209f},
       {0x13e324454a1fab2f, 0x7a250f05a7564f06}}}},
}};

// One touching pair of links in one frame, by indices in the scene.
struct GoldenTouch {
  std::uint32_t frame, character_a, link_a, character_b, link_b;

  auto key() const { return std::tie(frame, character_a, link_a, character_b, link_b); }
};

// The hash of hits in the order of frames, each pair of links once.
inline std::uint64_t hash_touches(std::vector<GoldenTouch> touches) {
  std::sort(touches.begin(), touches.end(),
            [](const GoldenTouch& a, const GoldenTouch& b) { return a.key() < b.key(); });
  cab::BitHash hash;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (i > 0 && touches[i].key() == touches[i - 1].key()) continue;
    const GoldenTouch& touch = touches[i];
    for (const std::uint32_t number : {touch.frame, touch.character_a, touch.link_a, touch.character_b, touch.link_b})
      hash.add(number);
  }
  return hash.value();
}

// Says why a scene's boxes and hits cannot be compared with the table, or is empty. The reason is that the scene's own
// numbers differ, which another C library is free to cause.
inline std::string other_scene(const scenes::Scene& scene, const GoldenScene& golden) {
  std::ostringstream out;
  out << std::hex;
  if (scenes::pose_hash(scene) != golden.poses)
    out << "poses of " << scene.name << " hash to " << scenes::pose_hash(scene) << ", not " << golden.poses << "; ";
  if (scenes::shape_hash(scene) != golden.shapes)
    out << "shapes of " << scene.name << " hash to " << scenes::shape_hash(scene) << ", not " << golden.shapes << "; ";
  if (!out.str().empty()) out << "another C library, so its boxes and hits are not compared with the table";
  return out.str();
}

// A row as text, in the form of the table.
inline std::string golden_row(const GoldenScene& row) {
  std::ostringstream out;
  const auto hex = [&out](std::uint64_t value) {
    out << "0x" << std::hex << std::setw(16) << std::setfill('0') << value << std::dec;
  };
  out << "{" << row.table << ", ";
  hex(row.poses);
  out << ", ";
  hex(row.shapes);
  out << ", {{";
  for (const GoldenBits& bits : row.bits) {
    out << (&bits == row.bits.data() ? "{" : ", {");
    hex(bits.boxes);
    out << ", ";
    hex(bits.hits);
    out << "}";
  }
  out << "}}},";
  return out.str();
}

}  // namespace cab::tests
