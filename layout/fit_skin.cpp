#include "layout/fit_skin.h"

#include "layout/error_bounds.h"
#include "layout/fit_box.h"
#include "layout/rounded_up.h"

#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numeric>
#include <vector>

namespace cab {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;  // three numbers each: Eigen uses no SIMD on them, so bits are the same anywhere

// What doubles round here, as a share of numbers up to some ones.
constexpr double kDoubles = 1e-12;

// The largest slope of a weight along a leaf's box. Steeper ones would do more for what rounds than for the box.
constexpr double kMostSlope = 2;

// The least volume that the columns of an inverse bind matrix span, as a share of the product of their lengths.
constexpr double kLeastBindVolume = 1e-9;

// The range of weights: the largest, and the least sum of those of a vertex.
constexpr float kMostWeight = 1e6f;
constexpr float kLeastWeights = 1e-6f;

// Small against the count of vertices: keeps slopes small along axes in which there is nothing to fit.
constexpr double kRidge = 1e-4;

// A skin as it is bound to links. binds: 12 numbers per link, the rows of B_i.
struct BoundSkin {
  Span<const double> vertices;  // x y z of each
  std::uint32_t influence_count = 0;
  Span<const std::uint32_t> links;  // influence_count per vertex
  Span<const double> weights;       // likewise, 0 or more; those of a vertex are divided by their sum, which is above 0
  Span<const double> binds;
};

// What is known of one leaf.
struct LeafFit {
  Box box;
  OwnVertices own;
  std::vector<LeafInfluence> influences;  // without `relative`, which numbers links: see `links`
  std::vector<std::uint16_t> links;       // of each influence, ascending
};

struct Range {
  double lo = HUGE_VAL, hi = -HUGE_VAL;

  void add(double x) {
    lo = std::min(lo, x);
    hi = std::max(hi, x);
  }
  // Writes the middle as a float and half the length about it, rounded up.
  void store(double rounding, float& center, float& half) const {
    center = static_cast<float>((lo + hi) / 2);
    half = rounded_up(std::max(hi - static_cast<double>(center), static_cast<double>(center) - lo) + rounding);
  }
};

// A box with its axes as columns, and the inverse of these.
struct Frame {
  Vector3d center, half;
  Matrix3d axes, inverse;

  explicit Frame(const Box& box) {
    for (int k = 0; k < 3; ++k) {
      center[k] = static_cast<double>(box.center[k]);
      half[k] = static_cast<double>(box.half[k]);
      for (int c = 0; c < 3; ++c) axes(c, k) = static_cast<double>(box.axis[k][c]);
    }
    inverse = axes.inverse();
  }
};

// Fits a box about points: that of fit_box about the points as floats, with half extents that hold the points as they
// are. Returns false if they are out of range.
bool fit_box_about(const Points& points, Box& box) {
  std::vector<float> floats;
  floats.reserve(3 * points.size());
  for (const Vector3d& p : points)
    for (int c = 0; c < 3; ++c) floats.push_back(static_cast<float>(p[c]));
  if (fit_box_to_vertices(floats, &box) != Status::kOk) return false;
  const Frame frame(box);
  for (const Vector3d& p : points) {
    const Vector3d y = frame.inverse * (p - frame.center);
    for (int k = 0; k < 3; ++k) box.half[k] = std::max(box.half[k], rounded_up(std::fabs(y[k]) * (1 + kDoubles)));
  }
  return true;
}

// The coordinates of points in a box: along its axes about its centre, in half extents.
Points coordinates_in(const Frame& frame, const Points& points) {
  Points out;
  out.reserve(points.size());
  for (const Vector3d& p : points) {
    Vector3d y = frame.inverse * (p - frame.center);
    for (int k = 0; k < 3; ++k) y[k] = frame.half[k] > 0 ? y[k] / frame.half[k] : 0;
    out.push_back(y);
  }
  return out;
}

// Writes the slope of the linear function that comes closest to weights at coordinates, by least squares.
void fit_slope(const Points& at, const std::vector<double>& weights, LeafInfluence& out) {
  const auto count = static_cast<double>(at.size());
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& y : at) middle += y / count;
  Matrix3d sums = kRidge * count * Matrix3d::Identity();
  Vector3d right = Vector3d::Zero();
  for (std::size_t v = 0; v < at.size(); ++v) {
    const Vector3d away = at[v] - middle;
    sums += away * away.transpose();
    right += weights[v] * away;
  }
  const Vector3d slope = sums.inverse() * right;
  for (int k = 0; k < 3; ++k) out.slope[k] = static_cast<float>(std::clamp(slope[k], -kMostSlope, kMostSlope));
}

// The sum of magnitudes of three floats, in double.
double sum_of(const float (&v)[3]) {
  double out = 0;
  for (const float c : v) out += std::fabs(static_cast<double>(c));
  return out;
}

// What a link with such weights does to the vertices of a box with these coordinates.
LeafInfluence influence_of(const Points& at, const std::vector<double>& weights) {
  LeafInfluence out = {};
  fit_slope(at, weights, out);
  Range rest, bent[3], moved[3];
  const auto slope = [&](const Vector3d& y) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += static_cast<double>(out.slope[k]) * y[k];
    return sum;
  };
  for (std::size_t v = 0; v < at.size(); ++v) rest.add(weights[v] - slope(at[v]));
  rest.store(kDoubles, out.weight, out.slack);
  for (std::size_t v = 0; v < at.size(); ++v)
    for (int k = 0; k < 3; ++k) {
      bent[k].add((weights[v] - static_cast<double>(out.weight)) * at[v][k]);
      if (weights[v] > 0) moved[k].add(at[v][k]);
    }
  double most_bent = 0;
  for (int k = 0; k < 3; ++k) {
    bent[k].store(kDoubles, out.bent_center[k], out.bent_half[k]);
    moved[k].store(kDoubles, out.moved_center[k], out.moved_half[k]);
    most_bent =
        std::max(most_bent, std::fabs(static_cast<double>(out.bent_center[k])) + static_cast<double>(out.bent_half[k]));
  }
  const double weight = std::fabs(static_cast<double>(out.weight));
  const double gain = 2 * weight + sum_of(out.slope) + static_cast<double>(out.slack) + most_bent;
  out.gain = rounded_up(static_cast<double>(kGrowPad) * std::max(1.0, gain));
  return out;
}

bool are_in_range(const float* values, std::size_t count) {
  return std::all_of(values, values + count, [](float value) { return std::fabs(value) <= kMaxCoordinate; });
}

bool is_in_range(const LeafFit& fit) {
  return are_in_range(fit.box.center, 3) && are_in_range(fit.box.half, 3) &&
         std::all_of(fit.influences.begin(), fit.influences.end(),
                     [](const LeafInfluence& by) { return by.size <= kMaxCoordinate; });
}

// A matrix and a translation.
struct Affine {
  Matrix3d linear;
  Vector3d at;

  Vector3d operator*(const Vector3d& p) const { return linear * p + at; }
  // The largest that numbers can be on the way of points whose coordinates are at most `most` in magnitude.
  Vector3d sizes(const Vector3d& most) const { return linear.cwiseAbs() * most + at.cwiseAbs(); }
};

// B_i of a link.
Affine bind_of(const BoundSkin& skin, std::uint32_t link) {
  const double* row = skin.binds.data + std::size_t{12} * link;
  Affine out;
  for (int r = 0; r < 3; ++r, row += 4) {
    for (int c = 0; c < 3; ++c) out.linear(r, c) = row[c];
    out.at[r] = row[3];
  }
  return out;
}

Affine inverse(const Affine& of) {
  const Matrix3d back = of.linear.inverse();
  return {back, -(back * of.at)};
}

// The weight that a link has of a vertex, out of all that the vertex has.
double weight_of(const BoundSkin& skin, std::size_t vertex, std::uint32_t link) {
  double own = 0, all = 0;
  for (std::uint32_t i = 0; i < skin.influence_count; ++i) {
    const double w = skin.weights[vertex * skin.influence_count + i];
    all += w;
    if (skin.links[vertex * skin.influence_count + i] == link) own += w;
  }
  return own / all;
}

// Fits a box to vertices in the frame of a link, and how other links move them. vertices: at least one, each once.
// Statuses: kTooManyInfluences, kBadLeafBox. Throws std::bad_alloc.
Status fit_skinned_leaf(const BoundSkin& skin, Span<const std::uint32_t> vertices, std::uint32_t link, LeafFit& out) {
  const Affine bind = bind_of(skin, link), unbind = inverse(bind);
  Points points;
  Vector3d most = Vector3d::Zero();
  std::vector<std::uint32_t> links;
  for (const std::uint32_t vertex : vertices) {
    const Vector3d v = Eigen::Map<const Vector3d>(skin.vertices.data + 3 * std::size_t{vertex});
    points.push_back(bind * v);
    most = most.cwiseMax(v.cwiseAbs());
    for (std::uint32_t i = 0; i < skin.influence_count; ++i)
      if (skin.weights[std::size_t{vertex} * skin.influence_count + i] > 0)
        links.push_back(skin.links[std::size_t{vertex} * skin.influence_count + i]);
  }
  std::sort(links.begin(), links.end());
  links.erase(std::unique(links.begin(), links.end()), links.end());
  if (links.size() - std::binary_search(links.begin(), links.end(), link) > kMaxInfluences)
    return Status::kTooManyInfluences;
  out = {};
  if (!fit_box_about(points, out.box)) return Status::kBadLeafBox;
  const Frame frame(out.box);
  const Points at = coordinates_in(frame, points);

  // How large numbers are on the way from the skin to the link and back, with the condition of its matrix.
  most = unbind.sizes(bind.sizes(unbind.sizes(bind.sizes(most))));
  Range own[3];
  std::vector<double> weights(at.size());
  for (const std::uint32_t other : links) {
    for (std::size_t v = 0; v < at.size(); ++v) weights[v] = weight_of(skin, vertices[v], other);
    if (other == link) {
      for (std::size_t v = 0; v < at.size(); ++v)
        for (int k = 0; k < 3 && weights[v] > 0; ++k) own[k].add(at[v][k] * frame.half[k]);
      continue;
    }
    LeafInfluence influence = influence_of(at, weights);
    const Affine bind_other = bind_of(skin, other);
    const Vector3d center = bind_other * (unbind * frame.center);
    double size = 0;
    for (int c = 0; c < 3; ++c) {
      influence.center[c] = static_cast<float>(center[c]);
      size += std::fabs(static_cast<double>(influence.center[c]));
    }
    for (int k = 0; k < 3; ++k) {
      const Vector3d edge = bind_other.linear * (unbind.linear * (frame.half[k] * frame.axes.col(k)));
      for (int c = 0; c < 3; ++c) {
        influence.edge[k][c] = static_cast<float>(edge[c]);
        size += std::fabs(static_cast<double>(influence.edge[k][c]));
      }
    }
    influence.size = rounded_up(size + kGrowDoubles * bind_other.sizes(most).sum());
    out.influences.push_back(influence);
    out.links.push_back(static_cast<std::uint16_t>(other));
  }
  // Without a vertex of its own the link adds nothing to the hull: a box that is empty everywhere.
  for (int k = 0; k < 3; ++k) {
    if (own[k].lo <= own[k].hi)
      own[k].store(kDoubles * frame.half[k], out.own.center[k], out.own.half[k]);
    else
      out.own.half[k] = -kMaxCoordinate;
  }
  return is_in_range(out) ? Status::kOk : Status::kBadLeafBox;
}

// The links and weights of a skin, and its matrices, in double. Throws std::bad_alloc.
struct SkinInDouble {
  std::vector<double> vertices, weights, binds;
  BoundSkin bound;

  SkinInDouble(const SkinDesc& desc, std::size_t link_count) {
    for (const float x : desc.vertices) vertices.push_back(static_cast<double>(x));
    for (const float w : desc.influence_weights) weights.push_back(static_cast<double>(w));
    for (std::size_t link = 0; link < link_count; ++link)
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 4; ++c)
          binds.push_back(desc.inverse_bind.size == 0 ? static_cast<double>(r == c)
                                                      : static_cast<double>(desc.inverse_bind[16 * link + 4 * c + r]));
    bound = {vertices, desc.influence_count, desc.influence_links, weights, binds};
  }
};

// Whether an inverse bind matrix is finite and has an inverse.
bool is_valid_bind(const float* m) {
  Matrix3d columns;
  for (int k = 0; k < 4; ++k) {
    if (!are_in_range(m + 4 * k, 3)) return false;
    for (int c = 0; c < 3 && k < 3; ++c) columns(c, k) = static_cast<double>(m[4 * k + c]);
  }
  return std::fabs(columns.colwise().normalized().determinant()) > kLeastBindVolume;
}

bool has_valid_sizes(const SkinDesc& skin, std::size_t link_count) {
  const std::size_t count = skin.vertices.size / 3, influences = skin.influence_links.size;
  const auto has_data = [](const auto& span) { return span.size == 0 || span.data; };
  return skin.vertices.size % 3 == 0 && skin.influence_count > 0 && skin.influence_count <= kMaxLinks &&
         influences % skin.influence_count == 0 && influences / skin.influence_count == count &&
         skin.influence_weights.size == influences &&
         (skin.inverse_bind.size == 0 || skin.inverse_bind.size == 16 * link_count) && has_data(skin.vertices) &&
         has_data(skin.influence_links) && has_data(skin.influence_weights) && has_data(skin.inverse_bind);
}

// Returns whether a skin is valid, or writes the vertex or link at fault.
bool is_valid(const SkinDesc& skin, std::size_t link_count, std::size_t& bad_element) {
  bad_element = 0;
  if (!has_valid_sizes(skin, link_count)) return false;
  for (std::size_t v = 0; 3 * v < skin.vertices.size; ++v) {
    bad_element = v;
    if (!are_in_range(skin.vertices.data + 3 * v, 3)) return false;
    float sum = 0;
    for (std::size_t i = v * skin.influence_count; i < (v + 1) * skin.influence_count; ++i) {
      const float weight = skin.influence_weights[i];
      if (!(weight >= 0 && weight <= kMostWeight) || (weight > 0 && skin.influence_links[i] >= link_count))
        return false;
      sum += weight;
    }
    if (!(sum > kLeastWeights)) return false;
  }
  for (std::size_t link = 0; 16 * link < skin.inverse_bind.size; ++link) {
    bad_element = link;
    if (!is_valid_bind(skin.inverse_bind.data + 16 * link)) return false;
  }
  return true;
}

// Copies what is known of all leaves. relatives: by link, those of its leaves, each once and ascending.
void store(const ArticulationDesc& desc, const std::vector<LeafFit>& fits,
           const std::vector<std::vector<std::uint16_t>>& relatives, Arena& arena, SkinnedLeaves& out) {
  std::vector<std::uint16_t> all;
  const auto relative_begin = arena.allocate<std::uint32_t>(relatives.size() + 1);
  for (std::size_t link = 0; link < relatives.size(); ++link) {
    all.insert(all.end(), relatives[link].begin(), relatives[link].end());
    relative_begin[link + 1] = static_cast<std::uint32_t>(all.size());
    out.most_relatives = std::max(out.most_relatives, static_cast<std::uint32_t>(relatives[link].size()));
  }
  std::vector<LeafInfluence> influences;
  const auto influence_begin = arena.allocate<std::uint32_t>(fits.size() + 1);
  const auto own = arena.allocate<OwnVertices>(fits.size());
  for (std::size_t leaf = 0; leaf < fits.size(); ++leaf) {
    const std::vector<std::uint16_t>& near = relatives[desc.leaves[leaf].link];
    for (std::size_t i = 0; i < fits[leaf].links.size(); ++i) {
      influences.push_back(fits[leaf].influences[i]);
      influences.back().relative =
          static_cast<std::uint32_t>(std::lower_bound(near.begin(), near.end(), fits[leaf].links[i]) - near.begin());
    }
    influence_begin[leaf + 1] = static_cast<std::uint32_t>(influences.size());
    own[leaf] = fits[leaf].own;
  }
  const auto from = arena.allocate<std::uint16_t>(all.size());
  for (std::size_t link = 0; link < relatives.size(); ++link)
    std::fill(from.data + relative_begin[link], from.data + relative_begin[link + 1], static_cast<std::uint16_t>(link));
  out.relatives = constant(arena.copy(Span<const std::uint16_t>(all)));
  out.relative_from = constant(from);
  out.relative_begin = constant(relative_begin);
  out.influences = constant(arena.copy(Span<const LeafInfluence>(influences)));
  out.influence_begin = constant(influence_begin);
  out.own = constant(own);
}

// Writes one leaf to a lane of a block, and its influences to that lane of the block's rounds.
void write_lane(const Box& box, std::uint32_t link, std::uint16_t leaf, std::uint32_t lane, const SkinnedLeaves& skin,
                LeafLanes& block, InfluenceLanes* rounds) {
  block.leaf[lane] = leaf;
  block.link[lane] = static_cast<std::uint16_t>(link);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < 3; ++k) block.axis[k][c][lane] = box.axis[k][c];
    block.center[c][lane] = box.center[c];
    block.half[c][lane] = box.half[c];
    block.own_center[c][lane] = skin.own[leaf].center[c];
    block.own_half[c][lane] = skin.own[leaf].half[c];
  }
  const std::uint32_t begin = skin.influence_begin[leaf], count = skin.influence_begin[leaf + 1u] - begin;
  for (std::uint32_t i = 0; i < count; ++i) {
    float values[sizeof(LeafInfluence) / sizeof(float)];
    std::memcpy(values, &skin.influences[begin + i], sizeof(values));
    for (std::size_t f = 1; f < std::size(values); ++f) rounds[i].value[f][lane] = values[f];
    rounds[i].is_there[lane] = 1;
    rounds[i].relative[lane] = skin.relative_begin[link] + skin.influences[begin + i].relative;
  }
}

// Lists the leaves as lanes, if any has influences.
void list_lanes(const ArticulationDesc& desc, Span<const Box> boxes, Arena& arena, SkinnedLeaves& out) {
  const auto count_of = [&out](std::uint16_t leaf) {
    return out.influence_begin[leaf + 1u] - out.influence_begin[leaf];
  };
  if (out.empty()) return;
  std::vector<std::uint16_t> leaves(desc.leaves.size);
  std::iota(leaves.begin(), leaves.end(), std::uint16_t{0});
  std::stable_sort(leaves.begin(), leaves.end(),
                   [&](std::uint16_t x, std::uint16_t y) { return count_of(x) > count_of(y); });
  std::uint32_t round_count = 0;
  for (std::size_t first = 0; first < leaves.size(); first += kLanes) round_count += count_of(leaves[first]);
  const auto lanes = arena.allocate<LeafLanes>((leaves.size() + kLanes - 1) / kLanes);
  const auto rounds = arena.allocate<InfluenceLanes>(round_count);
  std::uint32_t next = 0;
  for (std::size_t block = 0; block < lanes.size; ++block) {
    lanes[block].first_round = next;
    lanes[block].rounds = count_of(leaves[block * kLanes]);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const std::uint16_t leaf = leaves[std::min(block * kLanes + lane, leaves.size() - 1)];
      write_lane(boxes[leaf], desc.leaves[leaf].link, leaf, lane, out, lanes[block], rounds.data + next);
    }
    next += lanes[block].rounds;
  }
  out.lanes = constant(lanes);
  out.rounds = constant(rounds);
}

}  // namespace

Status fit_skin(const ArticulationDesc& desc, Arena& arena, Span<Box> boxes, SkinnedLeaves& out,
                std::size_t& bad_element) {
  const auto is_of_skin = [](const Leaf& leaf) { return leaf.triangles.size > 0; };
  const bool has_leaves = std::any_of(desc.leaves.begin(), desc.leaves.end(), is_of_skin);
  if (desc.skin.vertices.size == 0 && !has_leaves) return Status::kOk;
  const std::size_t link_count = desc.link_parents.size;
  if (!is_valid(desc.skin, link_count, bad_element)) return Status::kBadSkin;
  if (!has_leaves) return Status::kOk;
  const SkinInDouble skin(desc.skin, link_count);
  std::vector<LeafFit> fits(desc.leaves.size);
  std::vector<std::vector<std::uint16_t>> relatives(link_count);
  std::vector<std::uint32_t> vertices;
  for (std::size_t leaf = 0; leaf < desc.leaves.size; ++leaf) {
    const Leaf& one = desc.leaves[leaf];
    if (!is_of_skin(one)) continue;
    bad_element = leaf;
    vertices.assign(one.triangles.begin(), one.triangles.end());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    LeafFit& fit = fits[leaf];
    if (const Status status = fit_skinned_leaf(skin.bound, vertices, one.link, fit); status != Status::kOk)
      return status;
    boxes[leaf] = fit.box;
    relatives[one.link].insert(relatives[one.link].end(), fit.links.begin(), fit.links.end());
  }
  for (std::vector<std::uint16_t>& links : relatives) {
    std::sort(links.begin(), links.end());
    links.erase(std::unique(links.begin(), links.end()), links.end());
  }
  store(desc, fits, relatives, arena, out);
  list_lanes(desc, boxes, arena, out);
  return Status::kOk;
}

}  // namespace cab
