// Code that users of the peers write themselves for queries: rays, spheres and points against oriented boxes in float,
// one box at a time, and sixteen boxes or several rays at a time in loops that compilers turn into SIMD.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "perf/measure/peers/query_world.h"

// Functions that are compiled anew for each instruction set of their callers.
#define CAB_PEER_INLINE inline __attribute__((always_inline))

namespace cab::perf {

// The lesser and the greater, as one instruction each; the second operand if one is NaN.
CAB_PEER_INLINE float least_of(float a, float b) { return a < b ? a : b; }
CAB_PEER_INLINE float most_of(float a, float b) { return a > b ? a : b; }

// Narrows near .. far to where a ray is between two planes: at distance `from` from the middle plane, whose distance
// changes by `by` along the ray.
CAB_PEER_INLINE void narrow(float from, float by, float half, float& near, float& far) {
  constexpr float kLevel = 1e-20f;  // instead of 0, so that no product is NaN
  const float inverse = 1 / (std::fabs(by) < kLevel ? kLevel : by);
  const float middle = -from * inverse, reach = half * std::fabs(inverse);
  near = most_of(near, middle - reach);
  far = least_of(far, middle + reach);
}

// Where a ray enters a box, 0 if it begins inside, kNoHit if it does not meet it before `most`.
CAB_PEER_INLINE float ray_meets(const WorldBox<float>& box, const float (&at)[3], const float (&along)[3], float most) {
  const float x = at[0] - box.center[0], y = at[1] - box.center[1], z = at[2] - box.center[2];
  float near = 0, far = most;
  for (std::size_t k = 0; k < 3; ++k) {
    const float(&axis)[3] = box.axis[k];
    narrow(axis[0] * x + axis[1] * y + axis[2] * z, axis[0] * along[0] + axis[1] * along[1] + axis[2] * along[2],
           box.half[k], near, far);
    if (near > far) return kNoHit;
  }
  return near;
}

// The square of a point's distance from a box, 0 inside.
CAB_PEER_INLINE float square_distance(const WorldBox<float>& box, const float (&at)[3]) {
  const float x = at[0] - box.center[0], y = at[1] - box.center[1], z = at[2] - box.center[2];
  float sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const float(&axis)[3] = box.axis[k];
    const float out = most_of(std::fabs(axis[0] * x + axis[1] * y + axis[2] * z) - box.half[k], 0);
    sum += out * out;
  }
  return sum;
}

// Sixteen boxes of one character, component by component. Slots without a box are never met.
struct BoxBlock {
  static constexpr std::uint32_t kBoxes = 16;
  alignas(64) float center[3][kBoxes];
  alignas(64) float axis[3][3][kBoxes];
  alignas(64) float half[3][kBoxes];
};

// Where a ray enters each of sixteen boxes, as ray_meets.
CAB_PEER_INLINE void ray_meets_block(const BoxBlock& block, const float (&at)[3], const float (&along)[3], float most,
                                     float (&out)[BoxBlock::kBoxes]) {
  for (std::uint32_t i = 0; i < BoxBlock::kBoxes; ++i) {
    const float x = at[0] - block.center[0][i], y = at[1] - block.center[1][i], z = at[2] - block.center[2][i];
    float near = 0, far = most;
    for (std::size_t k = 0; k < 3; ++k) {
      const float a = block.axis[k][0][i], b = block.axis[k][1][i], c = block.axis[k][2][i];
      narrow(a * x + b * y + c * z, a * along[0] + b * along[1] + c * along[2], block.half[k][i], near, far);
    }
    out[i] = near > far ? kNoHit : near;
  }
}

// The squares of a point's distances from sixteen boxes.
CAB_PEER_INLINE void square_distances(const BoxBlock& block, const float (&at)[3], float (&out)[BoxBlock::kBoxes]) {
  for (std::uint32_t i = 0; i < BoxBlock::kBoxes; ++i) {
    const float x = at[0] - block.center[0][i], y = at[1] - block.center[1][i], z = at[2] - block.center[2][i];
    float sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const float a = block.axis[k][0][i], b = block.axis[k][1][i], c = block.axis[k][2][i];
      const float distance = std::fabs(a * x + b * y + c * z) - block.half[k][i];
      const float out_of_slab = most_of(distance, 0);
      sum += out_of_slab * out_of_slab;
    }
    out[i] = sum;
  }
}

// The blocks of all characters.
class BoxBlocks {
 public:
  void set(const PosedBoxes& posed) {
    blocks_.clear();
    firsts_.clear();
    for (std::uint32_t character = 0; character < posed.leaves.character_count(); ++character) {
      const std::uint32_t end = posed.leaves.end_leaf(character);
      firsts_.push_back(static_cast<std::uint32_t>(blocks_.size()));
      for (std::uint32_t first = posed.leaves.character(character).first_leaf; first < end; first += BoxBlock::kBoxes)
        add(posed, first, end);
    }
    firsts_.push_back(static_cast<std::uint32_t>(blocks_.size()));
  }
  std::uint32_t begin(std::uint32_t character) const { return firsts_[character]; }
  std::uint32_t end(std::uint32_t character) const { return firsts_[character + 1]; }
  const BoxBlock& operator[](std::uint32_t block) const { return blocks_[block]; }

 private:
  void add(const PosedBoxes& posed, std::uint32_t first, std::uint32_t end) {
    constexpr float kNowhere = 1e15f;
    BoxBlock& block = blocks_.emplace_back();
    for (std::uint32_t i = 0; i < BoxBlock::kBoxes; ++i) {
      const bool is_box = first + i < end;
      const WorldBox<float>& box = posed.boxes[is_box ? first + i : first];
      for (std::size_t c = 0; c < 3; ++c) {
        block.center[c][i] = is_box ? box.center[c] : kNowhere;
        block.half[c][i] = is_box ? box.half[c] : -1;
        for (std::size_t k = 0; k < 3; ++k) block.axis[k][c][i] = box.axis[k][c];
      }
    }
  }

  std::vector<BoxBlock> blocks_;
  std::vector<std::uint32_t> firsts_;  // by character, and the end
};

// The bounds of all leaves and, with characters, of all characters.
struct BoxBounds {
  std::vector<WorldBounds> leaves, characters;

  void set(const PosedBoxes& posed, bool with_characters) {
    leaves.resize(posed.boxes.size());
    for (std::size_t n = 0; n < leaves.size(); ++n) leaves[n] = bounds_of(posed.boxes[n]);
    if (!with_characters) return;
    characters.resize(posed.leaves.character_count());
    for (std::uint32_t i = 0; i < characters.size(); ++i) {
      const std::uint32_t first = posed.leaves.character(i).first_leaf;
      characters[i] = leaves[first];
      for (std::uint32_t n = first + 1; n < posed.leaves.end_leaf(i); ++n) grow(characters[i], leaves[n]);
    }
  }
};

}  // namespace cab::perf
