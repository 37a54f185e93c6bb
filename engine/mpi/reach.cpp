#include "engine/mpi/reach.h"

#include "engine/mpi/part_of.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cab::mpi {
namespace {

// For padding and rounding of boxes, and for matrices that are off a rotation by up to 1e-3.
constexpr double kSlack = 1.01;

// A box about points in a ball, along whatever axes, is in a ball that is so much larger.
constexpr double kBoxInBall = 1.7320508075688774;

// The same for the grown box of a leaf that several links move, whose vertices are in balls about these, with its
// padding and rounding (docs/proof.md, step 19.6).
constexpr double kGrownInBall = 2.1;

// What double rounds, here and where boxes are made, as a share of the numbers on the way: more than kGrowDoubles has
// (layout/error_bounds.h).
constexpr double kDoubles = 2e-9;

using Vector = std::array<double, 3>;

double length(const Vector& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// A matrix and a translation.
struct Affine {
  double row[3][3];
  Vector at;
};

Vector apply(const Affine& affine, const Vector& v) {
  Vector out = affine.at;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) out[r] += affine.row[r][c] * v[c];
  return out;
}

// The largest that numbers can be on the way of points whose coordinates are at most `most` in magnitude.
Vector sizes(const Affine& affine, const Vector& most) {
  Vector out;
  for (std::size_t r = 0; r < 3; ++r) {
    out[r] = std::fabs(affine.at[r]);
    for (std::size_t c = 0; c < 3; ++c) out[r] += std::fabs(affine.row[r][c]) * most[c];
  }
  return out;
}

double rounding(const Affine& affine, const Vector& most) {
  const Vector size = sizes(affine, most);
  return kDoubles * (size[0] + size[1] + size[2]);
}

Affine inverse(const Affine& of) {
  const auto cofactor = [&of](std::size_t r, std::size_t c) {
    const std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
    return of.row[r1][c1] * of.row[r2][c2] - of.row[r1][c2] * of.row[r2][c1];
  };
  const double determinant =
      of.row[0][0] * cofactor(0, 0) + of.row[0][1] * cofactor(0, 1) + of.row[0][2] * cofactor(0, 2);
  Affine out = {};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) out.row[r][c] = cofactor(c, r) / determinant;
  const Vector back = apply(out, of.at);
  out.at = {-back[0], -back[1], -back[2]};
  return out;
}

// How much longer the product of two matrices makes a vector at most: the root of a bound of the product with its
// transpose, which for a rotation is 1.
double stretch(const Affine& a, const Affine& b) {
  double product[3][3] = {};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) product[r][c] += a.row[r][k] * b.row[k][c];
  double most = 0;
  for (std::size_t r = 0; r < 3; ++r) {
    double sum = 0;
    for (std::size_t s = 0; s < 3; ++s) {
      double dot = 0;
      for (std::size_t c = 0; c < 3; ++c) dot += product[r][c] * product[s][c];
      sum += std::fabs(dot);
    }
    most = std::max(most, sum);
  }
  return std::sqrt(most);
}

// Takes points of a skin to a link.
Affine bind_of(const SkinDesc& skin, std::uint32_t link) {
  Affine out = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}};
  if (skin.inverse_bind.empty()) return out;
  const float* const columns = skin.inverse_bind.data + std::size_t{16} * link;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) out.row[r][c] = static_cast<double>(columns[4 * c + r]);
    out.at[r] = static_cast<double>(columns[12 + r]);
  }
  return out;
}

void add_reach(std::uint32_t link, double radius, double factor, std::vector<LinkReach>& out) {
  const auto at = std::find_if(out.begin(), out.end(),
                               [&](const LinkReach& one) { return one.link == link && one.factor == factor; });
  if (at == out.end())
    out.push_back({link, radius, factor});
  else
    at->radius = std::max(at->radius, radius);
}

// The vertices of a leaf with triangles, each once, and the links that move them besides its own.
struct SkinnedLeaf {
  std::vector<std::uint32_t> vertices, others;

  SkinnedLeaf(const SkinDesc& skin, const Leaf& leaf) : vertices(leaf.triangles.begin(), leaf.triangles.end()) {
    keep_each_once(vertices);
    for (const std::uint32_t v : vertices)
      for (std::size_t i = std::size_t{v} * skin.influence_count; i < (std::size_t{v} + 1) * skin.influence_count; ++i)
        if (skin.influence_weights[i] > 0 && skin.influence_links[i] != leaf.link)
          others.push_back(skin.influence_links[i]);
    keep_each_once(others);
  }

 private:
  static void keep_each_once(std::vector<std::uint32_t>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
};

struct Ball {
  Vector middle;
  double radius;
};

Ball ball_about(const std::vector<Vector>& points) {
  Vector lo = points[0], hi = points[0];
  for (const Vector& point : points)
    for (std::size_t c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], point[c]);
      hi[c] = std::max(hi[c], point[c]);
    }
  Ball out = {{(lo[0] + hi[0]) / 2, (lo[1] + hi[1]) / 2, (lo[2] + hi[2]) / 2}, 0};
  for (const Vector& point : points)
    out.radius =
        std::max(out.radius, length({point[0] - out.middle[0], point[1] - out.middle[1], point[2] - out.middle[2]}));
  return out;
}

// The box of a leaf with triangles is in a ball about its vertices in the frame of its link, and each link that moves
// the leaf moves that ball.
void add_skinned(const SkinDesc& skin, const Leaf& leaf, std::vector<LinkReach>& out) {
  const SkinnedLeaf skinned(skin, leaf);
  const Affine bind = bind_of(skin, leaf.link);
  std::vector<Vector> points;
  Vector most = {};
  for (const std::uint32_t v : skinned.vertices) {
    Vector at;
    for (std::size_t c = 0; c < 3; ++c) {
      at[c] = static_cast<double>(skin.vertices[std::size_t{3} * v + c]);
      most[c] = std::max(most[c], std::fabs(at[c]));
    }
    points.push_back(apply(bind, at));
  }
  const Ball ball = ball_about(points);
  const double box = kBoxInBall * ball.radius, factor = skinned.others.empty() ? 1 : kGrownInBall;
  add_reach(leaf.link, length(ball.middle) + box + rounding(bind, most), factor, out);
  if (skinned.others.empty()) return;
  const Affine unbind = inverse(bind);
  for (int i = 0; i < 2; ++i) most = sizes(unbind, sizes(bind, most));  // with the condition of the matrix
  for (const std::uint32_t other : skinned.others) {
    const Affine to = bind_of(skin, other);
    const double middle = length(apply(to, apply(unbind, ball.middle)));
    add_reach(other, middle + stretch(to, unbind) * box + rounding(to, most), factor, out);
  }
}

double length(const float* vector, std::size_t stride) {
  const auto x = static_cast<double>(vector[0]), y = static_cast<double>(vector[stride]),
             z = static_cast<double>(vector[2 * stride]);
  return std::sqrt(x * x + y * y + z * z);
}

double reach_of_link(const LinkReach& link, const PoseView& view, const float* pose) {
  switch (view.format) {
    case PoseFormat::kQuaternionTranslation: return length(pose + 4, 1) + link.radius;
    case PoseFormat::kMatrix3x4Rows: return length(pose + 3, 4) + link.radius * (view.has_scale ? length(pose, 4) : 1);
    case PoseFormat::kMatrix4x4Columns: break;
  }
  return length(pose + 12, 1) + link.radius * (view.has_scale ? length(pose, 1) : 1);
}

}  // namespace

std::vector<LinkReach> link_reaches(const ArticulationDesc& desc) {
  std::vector<LinkReach> out;
  for (const Leaf& leaf : desc.leaves)
    if (leaf.triangles.empty())
      add_reach(leaf.link, length(leaf.box.center, 1) + length(leaf.box.half, 1), 1, out);
    else
      add_skinned(desc.skin, leaf, out);
  return out;
}

RelativeBounds reach_of(const std::vector<LinkReach>& links, std::uint32_t link_count, const BatchInput& input,
                        std::size_t i) {
  double reach = 0;
  for (const LinkReach& link : links) {
    const double one = link.factor * reach_of_link(link, input.poses, pose_at(input.poses, link_count, i, link.link));
    if (!std::isfinite(one)) return kNoBounds;
    reach = std::max(reach, one);
  }
  if (!input.scales.empty()) reach *= static_cast<double>(input.scales[i]);
  reach *= kSlack;
  if (!input.margins.empty()) reach += kOwnMarginReach * static_cast<double>(input.margins[i]);
  const auto side = static_cast<float>(reach);
  if (!std::isfinite(side)) return kNoBounds;
  const float up = std::nextafter(side, std::numeric_limits<float>::infinity());
  return {{-up, -up, -up}, {up, up, up}};
}

}  // namespace cab::mpi
