// The bits that the paper's scenes must give on every machine: hashes of their first 300 frames. A change of any of them
// is a change of results and goes into CHANGELOG. The tests print the rows they find where they differ.
#pragma once

#include "scenes/bit_hash.h"
#include "scenes/registry.h"

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

// Methods in the columns of the table; the oriented ones, whose boxes are what kernels write, come first.
inline constexpr std::array<Policies, 7> kGoldenPolicies = {{
    {Refit::kCab, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kCab, Strategy::kTree, Exact::kNone, Extents::kLeaves},
    {Refit::kCabSum, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kCovariance, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kCovarianceLeaves, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kAabbHull, Strategy::kTree, Exact::kNone, Extents::kChildren},
    {Refit::kAabbVertices, Strategy::kTree, Exact::kNone, Extents::kChildren},
}};
inline constexpr std::size_t kGoldenOriented = 5;

// All boxes of all frames, and all box-level hits, as `cab paper --frames 300` hashes them.
struct GoldenBits {
  std::uint64_t boxes;
  std::uint64_t hits;
};

// poses and shapes: what the scene itself computed, with the C library's sin, cos and pow.
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
     {{{0x88560bf130cdfd8c, 0x4337726e69a046a9},
       {0x661ad7a481b110db, 0x4337726e69a046a9},
       {0x88560bf130cdfd8c, 0x4337726e69a046a9},
       {0x780db9ca7905632e, 0x4337726e69a046a9},
       {0xfa82d04e879bee47, 0x4337726e69a046a9},
       {0xf1e17d35a317a5cb, 0x76f84ce1f1a361ad},
       {0x25abe75f5dcd5fb6, 0xfb5d8bab14e95fff}}}},
    {2,
     0x7179d7f5310169f9,
     0x93caa37ace0ea765,
     {{{0xb28b8daf57cbdae1, 0x9003668fba570b1e},
       {0xee05388d4912ba29, 0x9003668fba570b1e},
       {0xb28b8daf57cbdae1, 0x9003668fba570b1e},
       {0x733b4bb1b4bd66fe, 0x9003668fba570b1e},
       {0x4936eec6cb4a9a3d, 0x9003668fba570b1e},
       {0xcfee878608946a39, 0xf237cccb834d1c87},
       {0x89e6e0f5da41734e, 0xa9b25c458c04fa8f}}}},
    {3,
     0x7179d7f5310169f9,
     0x2de915711b331e95,
     {{{0xe0c8958eb1584f3f, 0x8d9d7f047b8b2b45},
       {0x2494ff2932385c85, 0x8d9d7f047b8b2b45},
       {0xe0c8958eb1584f3f, 0x8d9d7f047b8b2b45},
       {0x8b9c79f77e2deb4c, 0x8d9d7f047b8b2b45},
       {0x025e574504799fdf, 0x8d9d7f047b8b2b45},
       {0x8155ad11c205f920, 0x4aef46d1c0a7254a},
       {0xe98b855b189930cf, 0x8a6cdcc3f7634f09}}}},
    {4,
     0xeae26cae287ec0b6,
     0xd53df5f4bc4d2e45,
     {{{0xc7550a96991e0a30, 0x89389d83edc7a9ce},
       {0x293eaca4e9d25e37, 0x89389d83edc7a9ce},
       {0xc7550a96991e0a30, 0x89389d83edc7a9ce},
       {0xd43fa83527dd0783, 0x89389d83edc7a9ce},
       {0xd0bc5816684cfe03, 0x89389d83edc7a9ce},
       {0x9536097f2c7736aa, 0x9c49f3dd378ad192},
       {0x2a3c8971e6d3fc78, 0xec01009d70cc4879}}}},
    {5,
     0x20f7d36ca46d49eb,
     0x785d2a33cbaaef4e,
     {{{0x71bf6ad266ab4dd0, 0x81618555a1b758f9},
       {0x4a7adc612c8531ae, 0x81618555a1b758f9},
       {0x69444b2a63b87bc7, 0x81618555a1b758f9},
       {0x31a24f98a073c7b7, 0x81618555a1b758f9},
       {0xeabccac3e372b111, 0x81618555a1b758f9},
       {0xea30d265cd0bbcb2, 0xf621b5043b94209f},
       {0xd031c0393e26f64f, 0x7a250f05a7564f06}}}},
}};

// One touching pair of links in one frame, by indices of the scene.
struct GoldenTouch {
  std::uint32_t frame, character_a, link_a, character_b, link_b;

  auto key() const { return std::tie(frame, character_a, link_a, character_b, link_b); }
};

// The hash of hits in the order of frames, each pair of links once.
inline std::uint64_t hash_touches(std::vector<GoldenTouch> touches) {
  std::sort(touches.begin(), touches.end(),
            [](const GoldenTouch& a, const GoldenTouch& b) { return a.key() < b.key(); });
  scenes::BitHash hash;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (i > 0 && touches[i].key() == touches[i - 1].key()) continue;
    const GoldenTouch& touch = touches[i];
    for (const std::uint32_t number : {touch.frame, touch.character_a, touch.link_a, touch.character_b, touch.link_b})
      hash.add(number);
  }
  return hash.value();
}

// Why a scene's boxes and hits cannot be compared with the table, or nothing: its own numbers differ, which another C
// library is free to do.
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

// A row in the form of the table.
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
