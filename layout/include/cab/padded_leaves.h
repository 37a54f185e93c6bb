// PaddedLeaves: the leaves of a body, each grown by a length of its link. CollisionChecker::set_padding tests them
// against what stands around a robot.
//
// The shape of a leaf with the padding p has every point within p of the leaf's own shape (docs/proof.md, part 18), and
// is of the same kind. A ball or a capsule has no other points. No point is farther from the leaf's own shape than
// 1.73 p for a box, 1.42 p for a cylinder, and 1.26 p and 1.3e-6 of its largest coordinate for a hull; for an ellipsoid
// (r^.5 + r^-.5) / 2 times p, where the longest radius is r times the shortest.
#pragma once

#include <cab/types.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

namespace cab {

// Leaves that are grown, and what they point to.
class PaddedLeaves {
 public:
  // Makes the leaves. leaves: those that add_articulation takes. They and what they point to stay as long as leaves()
  // is read. padding: one length for each link, 0 to kMaxCoordinate, in the leaves' unit. Leaves of a link with 0 keep
  // their bits.
  // Cost: for a hull of n vertices some part of 12 n^2 comparisons: for when a robot is loaded.
  // Statuses: kBadLeafLink (a leaf is on a link without a length), kBadMargin (a length is below 0, above 1e18 or NaN),
  // kBadShape (a span has a size and no data, or a number is not finite), kSkinNotTaken (a leaf has triangles),
  // kOutOfMemory.
  [[nodiscard]] Status set(Span<const Leaf> leaves, Span<const float> padding) noexcept;

  // As many as were given, in their order. They point into this object.
  Span<const Leaf> leaves() const noexcept { return {leaves_.get(), count_}; }

 private:
  // As a share of lengths, more than sums of floats are off (step 18.2).
  static constexpr double kRounding = 1e-6;

  static float above(double x) noexcept { return std::nextafter(static_cast<float>(x), HUGE_VALF); }
  static void read_axes(const ConvexPart& part, double (&axis)[3][3]) noexcept;
  void grow(Leaf& leaf, double by) noexcept;
  double grow_part(ConvexPart& part, double by) noexcept;
  double grow_hull(ConvexPart& part, double by) noexcept;

  std::unique_ptr<Leaf[]> leaves_;
  std::size_t count_ = 0;
  std::unique_ptr<ConvexPart[]> parts_;
  std::unique_ptr<float[]> vertices_;
  std::unique_ptr<std::uint32_t[]> order_;  // vertices of a hull
  ConvexPart* next_part_ = nullptr;
  float* next_vertex_ = nullptr;
};

inline Status PaddedLeaves::set(Span<const Leaf> leaves, Span<const float> padding) noexcept {
  count_ = 0;
  std::size_t parts = 0, numbers = 0, most = 0;
  for (const float by : padding)
    if (!(by >= 0 && by <= kMaxCoordinate)) return Status::kBadMargin;
  if (leaves.size && !leaves.data) return Status::kBadShape;
  for (const Leaf& leaf : leaves) {
    if (leaf.link >= padding.size) return Status::kBadLeafLink;
    if (leaf.parts.size && !leaf.parts.data) return Status::kBadShape;
    if (leaf.triangles.size) return Status::kSkinNotTaken;
    if (!(padding[leaf.link] > 0)) continue;
    parts += leaf.parts.size;
    for (const ConvexPart& part : leaf.parts) {
      if ((part.vertices.size && !part.vertices.data) || part.vertices.size % 3 != 0) return Status::kBadShape;
      for (const float x : part.vertices)
        if (!std::isfinite(x)) return Status::kBadShape;
      numbers += part.vertices.size;
      most = std::max(most, part.vertices.size);
    }
  }
  leaves_.reset(new (std::nothrow) Leaf[leaves.size + 1]);
  parts_.reset(new (std::nothrow) ConvexPart[parts + 1]);
  vertices_.reset(new (std::nothrow) float[12 * numbers + 1]);
  order_.reset(new (std::nothrow) std::uint32_t[most + 1]);
  if (!leaves_ || !parts_ || !vertices_ || !order_) return Status::kOutOfMemory;
  next_part_ = parts_.get();
  next_vertex_ = vertices_.get();
  for (const Leaf& leaf : leaves) {
    Leaf& to = leaves_[count_++] = leaf;
    if (padding[leaf.link] > 0) grow(to, static_cast<double>(padding[leaf.link]));
  }
  return Status::kOk;
}

// The axes of a part, in the frame of its link.
inline void PaddedLeaves::read_axes(const ConvexPart& part, double (&axis)[3][3]) noexcept {
  const double x = static_cast<double>(part.rotation[0]), y = static_cast<double>(part.rotation[1]),
               z = static_cast<double>(part.rotation[2]), w = static_cast<double>(part.rotation[3]);
  const double rows[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)},
                             {2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)},
                             {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z}};
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) axis[k][c] = rows[k][c] / (x * x + y * y + z * z + w * w);
}

inline void PaddedLeaves::grow(Leaf& leaf, double by) noexcept {
  double growth[3] = {0, 0, 0};  // of the box, along its axes
  if (leaf.parts.empty()) std::fill_n(growth, 3, by);
  ConvexPart* const first = next_part_;
  for (const ConvexPart& part : leaf.parts) {
    ConvexPart& to = *next_part_++ = part;
    const double farthest = grow_part(to, by);
    const bool has_corners = part.kind == ShapeKind::kBox || part.kind == ShapeKind::kCylinder;
    // What is added to a part with corners is a box along the part's axes.
    double axis[3][3];
    read_axes(part, axis);
    for (int k = 0; k < 3; ++k) {
      double along = 0;
      for (const auto& of : axis) {
        double cosine = 0;
        for (int c = 0; c < 3; ++c) cosine += of[c] * static_cast<double>(leaf.box.axis[k][c]);
        along += std::fabs(cosine);
      }
      growth[k] = std::max(growth[k], has_corners ? along * by : farthest);
    }
  }
  leaf.parts = {first, leaf.parts.size};
  // Axes are of length 1, and square, to 1e-5; sizes are rounded up to float.
  double size = 0;
  for (int k = 0; k < 3; ++k) size += static_cast<double>(leaf.box.half[k]) + growth[k];
  for (int k = 0; k < 3; ++k)
    leaf.box.half[k] = above(static_cast<double>(leaf.box.half[k]) + growth[k] * (1 + 1e-4) + kRounding * size);
}

// Grows a part, and returns how much farther it reaches than before, in any direction.
inline double PaddedLeaves::grow_part(ConvexPart& part, double by) noexcept {
  const auto add = [&](int s) { part.size[s] = above(static_cast<double>(part.size[s]) + by); };
  switch (part.kind) {
    case ShapeKind::kConvexHull: return grow_hull(part, by);
    case ShapeKind::kSphere:
    case ShapeKind::kCapsule: add(0); break;
    case ShapeKind::kCylinder:
      add(0);
      add(1);
      break;
    case ShapeKind::kBox:
      for (int s = 0; s < 3; ++s) add(s);
      break;
    case ShapeKind::kEllipsoid: {
      const double a[3] = {static_cast<double>(part.size[0]), static_cast<double>(part.size[1]),
                           static_cast<double>(part.size[2])};
      // Step 18.3; the middle of the radii wastes least where p is small.
      const double middle = std::sqrt(*std::min_element(a, a + 3) * *std::max_element(a, a + 3));
      double most = 0;
      for (int s = 0; s < 3; ++s) {
        part.size[s] = above(std::sqrt(a[s] * a[s] * (1 + by / middle) + by * by + by * middle));
        most = std::max(most, static_cast<double>(part.size[s]) - a[s]);
      }
      return most;
    }
    case ShapeKind::kHalfSpace: {
      // Along the plane's normal, z of the part, in the link's frame.
      double axis[3][3], largest = 0;
      read_axes(part, axis);
      for (const float c : part.position) largest = std::max(largest, std::fabs(static_cast<double>(c)));
      const double outer = by + kRounding * (by + largest);
      for (int c = 0; c < 3; ++c)
        part.position[c] = static_cast<float>(static_cast<double>(part.position[c]) + outer * axis[2][c]);
      return outer + kRounding * (by + largest);
    }
  }
  return by * (1 + kRounding);
}

// Makes a hull that of the sums of its vertices and those of an icosahedron about a ball. Sums inside are left out: for
// a vertex q of the icosahedron, those of which another vertex is at least as far along all directions along which q is
// the farthest, which are the sums of the five normals about q (step 18.2).
inline double PaddedLeaves::grow_hull(ConvexPart& part, double by) noexcept {
  const double golden = (1 + std::sqrt(5.0)) / 2, near = std::sqrt(3.0) / (golden * golden), far = near * golden;
  const std::size_t count = part.vertices.size / 3;
  const auto at = [&](std::size_t v, std::size_t c) { return static_cast<double>(part.vertices[3 * v + c]); };
  double largest = 0;
  for (const float c : part.vertices) largest = std::max(largest, std::fabs(static_cast<double>(c)));
  const double outer = by + kRounding * (by + largest);
  float* const first = next_vertex_;
  for (std::size_t corner = 0; corner < 12; ++corner) {
    // The corner has 0, s near and t far along three axes in turn.
    const std::size_t axis[3] = {corner / 4, (corner / 4 + 1) % 3, (corner / 4 + 2) % 3};
    const double s = corner % 2 ? 1 : -1, t = corner / 2 % 2 ? 1 : -1;
    const auto height = [&](std::size_t v) { return s * at(v, axis[1]) + t * golden * at(v, axis[2]); };
    const auto is_as_far = [&](std::size_t v, std::size_t other) {
      const double a = std::fabs(at(other, axis[0]) - at(v, axis[0])), b = s * (at(other, axis[1]) - at(v, axis[1])),
                   c = t * (at(other, axis[2]) - at(v, axis[2]));
      return b + c >= a && golden * golden * c >= a && golden * golden * b + c >= 0;
    };
    std::uint32_t* const order = order_.get();
    for (std::size_t v = 0; v < count; ++v) order[v] = static_cast<std::uint32_t>(v);
    std::sort(order, order + count, [&](std::uint32_t v, std::uint32_t w) {
      const double of_v = height(v), of_w = height(w);
      return of_v > of_w || (!(of_w > of_v) && v < w);
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t v = order[i];
      if (std::any_of(order, order + kept, [&](std::uint32_t other) { return is_as_far(v, other); })) continue;
      order[kept++] = order[i];
      float* const to = next_vertex_;
      next_vertex_ += 3;
      to[axis[0]] = static_cast<float>(at(v, axis[0]));
      to[axis[1]] = static_cast<float>(at(v, axis[1]) + outer * s * near);
      to[axis[2]] = static_cast<float>(at(v, axis[2]) + outer * t * far);
    }
  }
  part.vertices = {first, static_cast<std::size_t>(next_vertex_ - first)};
  return outer * std::sqrt(near * near + far * far) + kRounding * (by + largest);
}

}  // namespace cab
