// Random worlds of characters and of sequences.
#pragma once

#include "perf/harness/world.h"

namespace cab::oracle {

// Numbers of instances near multiples of a tile.
inline constexpr std::uint32_t kInstanceCounts[] = {1, 2, 15, 16, 17, 33};

inline Rig any_rig(Random& random, unsigned most_links) {
  const auto topology = static_cast<Topology>(random.index(3));
  const auto links = static_cast<unsigned>(random.log_uniform(2, most_links + 0.999));
  return random_rig(random, topology, links, 1 + random.index(3));
}

// A range for the members of one world, all about one point: near the world's origin, or far from it.
inline PoseRange any_pose_range(Random& random, bool far, const Vec3<double>& about, double spread) {
  PoseRange range;
  range.spread = spread;
  range.orientations = random.chance(0.5);
  range.origins = far || random.chance(0.5);
  range.about = about;
  return range;
}

inline Member any_member(Random& random, std::uint32_t instances, BatchKind kind, const PoseRange& range,
                         unsigned most_links) {
  Member member;
  member.rig = any_rig(random, most_links);
  const auto format = static_cast<PoseFormat>(random.index(3));
  member.poses = random_poses(random, member.rig, instances, format, range);
  member.kind = kind;
  return member;
}

// Adds rules for each pair of batches, for every batch of characters with itself, and for every batch within its
// instances.
inline void pair_all(World& world, std::uint32_t first, std::uint32_t count) {
  for (std::uint32_t a = first; a < first + count; ++a) {
    const bool characters = world.members[a - 1].kind == BatchKind::kCharacters;
    for (std::uint32_t b = characters ? a : a + 1; b < first + count; ++b) {
      const bool swapped = (a + b) % 2 == 1;
      world.rules.push_back({{swapped ? b : a}, {swapped ? a : b}, Pairing::kBetween});
    }
    world.rules.push_back({{a}, {a}, Pairing::kWithin});
  }
}

// Gives some members layers and masks of few bits, so that many pairs match and many do not.
inline void add_layers(Random& random, World& world) {
  const auto few_bits = [&] {
    return (1u << random.index(4)) | (random.chance(0.6) ? 1u << (28 + random.index(4)) : 0);
  };
  for (Member& member : world.members) {
    const std::uint32_t count = member.poses.instance_count;
    if (random.chance(0.7))
      for (std::uint32_t i = 0; i < count; ++i) member.layers.push_back(random.chance(0.05) ? 0 : few_bits());
    if (random.chance(0.7))
      for (std::uint32_t i = 0; i < count; ++i)
        member.layer_masks.push_back(random.chance(0.2) ? ~0u : few_bits() | few_bits());
  }
}

// Adds one to three batches of characters, crowded enough that many touch.
inline void add_characters(Random& random, World& world, unsigned most_links = 64) {
  const auto first = static_cast<std::uint32_t>(world.members.size() + 1);
  const std::uint32_t count = 1 + random.index(3);
  const bool far = random.chance(0.5);
  const double out = far ? random.log_uniform(1e6, 1e9) : 0;
  const Vec3<double> about = out * random.unit_vector();
  const double spread = random.uniform(0.5, 4);
  for (std::uint32_t m = 0; m < count; ++m) {
    const std::uint32_t instances = kInstanceCounts[random.index(6)];
    const PoseRange range = any_pose_range(random, far, about, spread);
    world.members.push_back(any_member(random, instances, BatchKind::kCharacters, range, most_links));
  }
  pair_all(world, first, count);
}

// Adds two to four sequences with equal numbers of frames. Some have one frame, which is paired with all frames.
inline void add_frames(Random& random, World& world, unsigned most_links = 64) {
  const auto first = static_cast<std::uint32_t>(world.members.size() + 1);
  const std::uint32_t count = 2 + random.index(3);
  const std::uint32_t frames = kInstanceCounts[random.index(6)];
  const bool far = random.chance(0.5);
  const double out = far ? random.log_uniform(1e6, 1e9) : 0;
  const Vec3<double> about = out * random.unit_vector();
  for (std::uint32_t m = 0; m < count; ++m) {
    const std::uint32_t instances = random.chance(0.25) ? 1 : frames;
    const PoseRange range = any_pose_range(random, far, about, 0.5);
    world.members.push_back(any_member(random, instances, BatchKind::kSequence, range, most_links));
  }
  pair_all(world, first, count);
}

}  // namespace cab::oracle
