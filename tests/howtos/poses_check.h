// What the tests of docs/poses.md share: a body in a crowd, and points posed one by one in double.
#pragma once

#include <cab/world.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <utility>
#include <vector>

namespace poses_check {

constexpr std::uint32_t kLinks = 4, kCharacters = 40;
constexpr std::array<std::int32_t, kLinks> kParents = {-1, 0, 1, 0};

// How far off a corner may be, as a part of the largest coordinate. Boxes are padded: 8e-6 is the worst that was
// measured.
constexpr double kTolerance = 2e-5;

using Point = std::array<double, 3>;

// A transform in double: a point is scaled, rotated, translated. `rotation` is x y z w, of length 1.
struct Transform {
  Point translation{};
  std::array<double, 4> rotation{0, 0, 0, 1};
  double scale = 1;
};

inline Point operator+(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Point operator*(double s, const Point& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Point rotated(const std::array<double, 4>& q, const Point& p) {
  const Point axis = {q[0], q[1], q[2]};
  const Point turn = 2 * cross(axis, p);
  return p + q[3] * turn + cross(axis, turn);
}
inline Point moved(const Transform& t, const Point& p) { return rotated(t.rotation, t.scale * p) + t.translation; }

// A quaternion of length 1.
inline std::array<double, 4> unit(const std::array<double, 4>& q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

// The same numbers on every machine: a multiple of 2^-15 in -1 to 1.
class Numbers {
 public:
  double next() {
    state_ = state_ * 1664525u + 1013904223u;
    return (static_cast<double>(state_ >> 16) - 32768) / 32768;
  }
  Point point() { return {next(), next(), next()}; }

 private:
  std::uint32_t state_ = 1;
};

// A crowd in double: where each character stands, and how each link is posed in the frame of its parent.
struct Crowd {
  std::vector<Transform> places;                     // character to world
  std::vector<std::array<Transform, kLinks>> links;  // link to parent

  // A point of a link, in the frame of its character, whose scale is not applied.
  Point in_character(std::uint32_t character, std::uint32_t link, Point p) const {
    for (auto l = static_cast<std::int32_t>(link); l >= 0; l = kParents[static_cast<std::size_t>(l)])
      p = moved(links[character][static_cast<std::size_t>(l)], p);
    return p;
  }

  // The same along the world's axes, with the character's scale.
  Point along_world(std::uint32_t character, std::uint32_t link, const Point& p) const {
    return rotated(places[character].rotation, places[character].scale * in_character(character, link, p));
  }
};

// unit_length: of a metre. scaled_links: whether links have scales of their own, as characters always have.
inline Crowd crowd_of(double unit_length, bool scaled_links) {
  Numbers numbers;
  Crowd crowd;
  for (std::uint32_t i = 0; i < kCharacters; ++i) {
    const auto any = [&](double reach, double scale_range, bool scaled) {
      Transform t;
      t.translation = reach * unit_length * numbers.point();
      t.rotation = unit({numbers.next(), numbers.next(), numbers.next(), 1.5 * numbers.next()});
      t.scale = scaled ? 1 + scale_range * numbers.next() : 1;
      return t;
    };
    crowd.places.push_back(any(1.5, .2, true));
    const auto link = [&](double reach) { return any(reach, .1, scaled_links); };
    crowd.links.push_back({link(.1), link(.5), link(.5), link(.5)});
  }
  return crowd;
}

// One box per link, off the link's origin and of three different sizes, so that no wrong turn or mirror looks right.
inline std::vector<cab::Leaf> leaves_of(double unit_length) {
  Numbers numbers;
  std::vector<cab::Leaf> leaves(kLinks);
  for (std::uint32_t l = 0; l < kLinks; ++l) {
    leaves[l].link = l;
    cab::Box& box = leaves[l].box;
    for (int k = 0; k < 3; ++k) {
      box.center[k] = static_cast<float>(.2 * unit_length * numbers.next());
      box.half[k] = static_cast<float>((.1 + .06 * k + .02 * l) * unit_length);
    }
  }
  return leaves;
}

inline std::array<Point, 8> corners_of(const cab::Box& box) {
  std::array<Point, 8> corners;
  for (unsigned c = 0; c < 8; ++c) {
    corners[c] = {box.center[0], box.center[1], box.center[2]};
    for (unsigned k = 0; k < 3; ++k)
      corners[c] =
          corners[c] + ((c >> k & 1) ? 1. : -1.) * box.half[k] * Point{box.axis[k][0], box.axis[k][1], box.axis[k][2]};
  }
  return corners;
}

// A world with one batch of kCharacters bodies.
class World {
 public:
  World(cab::Span<const std::int32_t> parents, const std::vector<cab::Leaf>& leaves) : leaves_(leaves) {
    cab::exit_on_error(world_.add_batch({parents, {}, leaves_, {}}, kCharacters, &batch_));
    cab::exit_on_error(world_.add_rule({batch_, batch_, cab::Pairing::kBetween}));
    cab::exit_on_error(world_.add_rule({batch_, batch_, cab::Pairing::kWithin}));
  }
  explicit World(const std::vector<cab::Leaf>& leaves) : World(kParents, leaves) {}

  cab::BatchId batch() const { return batch_; }

  // All links that touch, those of one character too.
  std::vector<cab::Hit> hits(const cab::BatchInput& input) {
    *world_.input(batch_) = input;
    cab::exit_on_error(world_.run());
    if (world_.job().stats.instances_masked != 0) throw std::runtime_error("a character is masked");
    return {world_.hits().begin(), world_.hits().end()};
  }

  // The largest distance of a corner of the engine's boxes from where `posed` has it, as a part of the largest number.
  // posed(character, link, p): where the point p of the link is, relative to the character's origin.
  template <class Posed>
  double error(const cab::BatchInput& input, Posed posed) {
    std::vector<cab::Box> boxes(kCharacters * (2 * leaves_.size() - 1));
    cab::exit_on_error(cab::compute_boxes(world_.engine(), input, {}, boxes));
    double worst = 0, size = 0;
    for (std::uint32_t i = 0; i < kCharacters; ++i) {
      for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) {
        const std::array<Point, 8> found = corners_of(boxes[i * (2 * leaves_.size() - 1) + leaf]);
        for (const Point& corner : corners_of(leaves_[leaf].box)) {
          const Point expected = posed(i, leaves_[leaf].link, corner);
          double nearest = HUGE_VAL;
          for (const Point& point : found) {
            const Point d = point + -1. * expected;
            nearest = std::min(nearest, std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
          }
          worst = std::max(worst, nearest);
          for (const double x : expected) size = std::max(size, std::fabs(x));
        }
      }
    }
    return worst / size;
  }

 private:
  cab::World world_;
  cab::BatchId batch_;
  std::vector<cab::Leaf> leaves_;
};

inline bool same(const std::vector<cab::Hit>& a, const std::vector<cab::Hit>& b) {
  const auto equal = [](const cab::Hit& x, const cab::Hit& y) {
    return x.instance_a == y.instance_a && x.instance_b == y.instance_b && x.link_a == y.link_a && x.link_b == y.link_b;
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), equal);
}

// What the characters' places are to the engine: an origin, an orientation and a scale for each.
struct Places {
  explicit Places(const Crowd& crowd) {
    for (const Transform& place : crowd.places) {
      origins.insert(origins.end(), place.translation.begin(), place.translation.end());
      for (const double x : place.rotation) orientations.push_back(static_cast<float>(x));
      scales.push_back(static_cast<float>(place.scale));
    }
  }
  std::vector<double> origins;
  std::vector<float> orientations, scales;
};

// The input of one batch.
inline cab::BatchInput input_of(cab::BatchId batch, const cab::PoseView& poses, const Places& places) {
  cab::BatchInput input;
  input.batch = batch;
  input.poses = poses;
  input.origins = places.origins;
  input.orientations = places.orientations;
  return input;
}

// Prints one line of a test, and returns whether it holds.
inline bool line(const char* what, double error, std::size_t hits, bool same_hits) {
  const bool right = error <= kTolerance && hits > 100 && same_hits;
  std::printf("%s: corners off by %.1e, %zu hits%s%s\n", what, error, hits, same_hits ? "" : ", not the same",
              right ? "" : ": WRONG");
  return right;
}

}  // namespace poses_check
