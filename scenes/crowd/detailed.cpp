#include "scenes/crowd/detailed.h"

#include "scenes/random.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cab::scenes {
namespace {

constexpr std::uint64_t kTurnSeed = 5;

constexpr double kBarrel = .6;        // share of its squared width that a link loses at its ends
constexpr double kOverlap = 1.15;     // size of a box over that of its cell
constexpr double kMostTurn = .2;      // rad, of a cube
constexpr double kInside = 1 - 1e-5;  // share of the room to the link's faces; rounding to float stays within it

// Cells along each axis of a box. The longest edge of the cells is halved until there are enough cells.
std::array<std::uint32_t, 3> split(const float* half, std::uint32_t count) {
  std::array<std::uint32_t, 3> cells = {1, 1, 1};
  for (std::uint32_t made = 1; made < count; made *= 2) {
    std::size_t longest = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (half[k] / static_cast<float>(cells[k]) > half[longest] / static_cast<float>(cells[longest])) longest = k;
    cells[longest] *= 2;
  }
  return cells;
}

// A box in the frame of the link's box.
struct Piece {
  Vec3 center;
  std::array<Vec3, 3> axes;
  Vec3 half;
};

Piece make_piece(const Vec3& cell_center, const Vec3& cell_half, const Vec3& link_half, Random& random) {
  Piece piece = {cell_center, {}, kOverlap * cell_half};
  const auto [thinnest, longest] = std::minmax_element(cell_half.begin(), cell_half.end());
  const double most_turn = kMostTurn * *thinnest / *longest;
  const Vec3 about = random.unit_vector();
  const double angle = random.uniform(-most_turn, most_turn), s = std::sin(angle / 2);
  const Quat turn = {s * about[0], s * about[1], s * about[2], std::cos(angle / 2)};
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 axis = {0, 0, 0};
    axis[k] = 1;
    piece.axes[k] = rotate(turn, axis);
  }
  // Axis c of the piece lies nearly along axis c of the box, so its half extent shrinks by the length that sticks out.
  for (std::size_t c = 0; c < 3; ++c) {
    double reach = 0;
    for (std::size_t k = 0; k < 3; ++k) reach += piece.half[k] * std::fabs(piece.axes[k][c]);
    const double room = (link_half[c] - std::fabs(cell_center[c])) * kInside;
    if (reach > room) piece.half[c] -= (reach - room) / std::fabs(piece.axes[c][c]);
  }
  return piece;
}

// The piece as a leaf of the link from whose box it is cut.
BodyLeaf to_leaf(const Piece& piece, const BodyLeaf& whole) {
  const auto to_link = [&whole](const Vec3& v, std::size_t c) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += v[k] * static_cast<double>(whole.box.axis[k][c]);
    return sum;
  };
  BodyLeaf leaf;
  leaf.link = whole.link;
  for (std::size_t c = 0; c < 3; ++c) {
    leaf.box.center[c] = static_cast<float>(static_cast<double>(whole.box.center[c]) + to_link(piece.center, c));
    leaf.box.half[c] = static_cast<float>(piece.half[c]);
    for (std::size_t k = 0; k < 3; ++k) leaf.box.axis[k][c] = static_cast<float>(to_link(piece.axes[k], c));
  }
  return leaf;
}

void add_pieces(const BodyLeaf& whole, std::uint32_t count, Random& random, std::vector<BodyLeaf>& leaves) {
  const float* const box_half = whole.box.half;
  const std::array<std::uint32_t, 3> cells = split(box_half, count);
  const Vec3 half = {box_half[0], box_half[1], box_half[2]};
  const auto longest = static_cast<std::size_t>(std::max_element(half.begin(), half.end()) - half.begin());
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::array<std::uint32_t, 3> at = {i % cells[0], i / cells[0] % cells[1], i / (cells[0] * cells[1])};
    Vec3 center, cell_half;
    for (std::size_t k = 0; k < 3; ++k) {
      center[k] = (2.0 * at[k] + 1) / cells[k] - 1;  // of the half extent
      cell_half[k] = half[k] / cells[k];
    }
    const double width = std::sqrt(1 - kBarrel * center[longest] * center[longest]);
    for (std::size_t k = 0; k < 3; ++k) {
      const double w = k == longest ? 1 : width;
      center[k] *= w * half[k];
      cell_half[k] *= w;
    }
    leaves.push_back(to_leaf(make_piece(center, cell_half, half, random), whole));
  }
}

}  // namespace

Character with_detail(Character character, std::uint32_t count) {
  if (std::find(kBoxesPerLink.begin(), kBoxesPerLink.end(), count) == kBoxesPerLink.end())
    throw std::invalid_argument("with_detail: no link is made of " + std::to_string(count) + " boxes");
  if (character.leaves.size() * count > kMaxLeaves)
    throw std::invalid_argument(character.name + ": " + std::to_string(count) + " boxes for each of its " +
                                std::to_string(character.leaves.size()) + " links are more than the " +
                                std::to_string(kMaxLeaves) + " that a character may have");
  if (count == 1) return character;
  Random random(kTurnSeed);
  std::vector<BodyLeaf> leaves;
  for (const BodyLeaf& whole : character.leaves) add_pieces(whole, count, random, leaves);
  character.leaves = std::move(leaves);
  return character;
}

}  // namespace cab::scenes
