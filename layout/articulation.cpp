#include "layout/articulation.h"

#include "layout/arena.h"
#include "layout/error_bounds.h"
#include "layout/find_parts.h"
#include "layout/fit_skin.h"
#include "layout/list_surface.h"
#include "layout/shape_sizes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace cab {
namespace {

// The squared length of a convex part's quaternion may differ from 1 by this much.
constexpr double kUnitTolerance = 1e-3;

bool finite(const float* values, std::size_t count, float limit) {
  for (std::size_t i = 0; i < count; ++i)
    if (!(std::fabs(values[i]) <= limit)) return false;
  return true;
}

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Returns max |R^T R - I| of three axes, or infinity if they are left-handed.
double axes_error(const Box& box) {
  double r[3][3];
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) r[k][c] = static_cast<double>(box.axis[k][c]);
  double error = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) error = std::max(error, std::fabs(dot(r[i], r[j]) - (i == j ? 1.0 : 0.0)));
  const double determinant = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) -
                             r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                             r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
  return determinant > 0 ? error : std::numeric_limits<double>::infinity();
}

// Makes the axes orthonormal by Gram-Schmidt in double. Half extents grow by the distance that a corner can move.
void make_orthonormal(Box& box, double error) {
  double r[3][3];
  for (int k = 0; k < 3; ++k) {
    for (int c = 0; c < 3; ++c) r[k][c] = static_cast<double>(box.axis[k][c]);
    for (int j = 0; j < k; ++j) {
      const double along = dot(r[k], r[j]);
      for (int c = 0; c < 3; ++c) r[k][c] -= along * r[j][c];
    }
    const double length = std::sqrt(dot(r[k], r[k]));
    for (int c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(r[k][c] /= length);
  }
  const double sum =
      static_cast<double>(box.half[0]) + static_cast<double>(box.half[1]) + static_cast<double>(box.half[2]);
  for (float& half : box.half) half = static_cast<float>(static_cast<double>(half) + 4 * error * sum);
}

// Whether vertices (x y z each, at least one) are not all on one line, to kThinHull of their extent. The line goes
// through the first vertex and the one farthest from it.
bool have_area(Span<const float> vertices) {
  const auto from_first = [&vertices](std::size_t v, double* out) {
    for (std::size_t c = 0; c < 3; ++c)
      out[c] = static_cast<double>(vertices[v + c]) - static_cast<double>(vertices[c]);
    return std::sqrt(dot(out, out));
  };
  double offset[3], axis[3] = {}, extent = 0, widest = 0;
  for (std::size_t v = 3; v < vertices.size; v += 3) {
    const double distance = from_first(v, offset);
    if (distance <= extent) continue;
    extent = distance;
    std::copy(offset, offset + 3, axis);
  }
  if (!(extent > 0)) return false;
  for (double& c : axis) c /= extent;
  for (std::size_t v = 3; v < vertices.size; v += 3) {
    from_first(v, offset);
    const double along = dot(offset, axis);
    for (int c = 0; c < 3; ++c) offset[c] -= along * axis[c];
    widest = std::max(widest, std::sqrt(dot(offset, offset)));
  }
  return widest > kThinHull * extent;
}

bool valid_sizes(const ConvexPart& part) {
  if (!finite(part.position, 3, kMaxCoordinate) || !finite(part.rotation, 4, 2)) return false;
  const int sizes = size_count(part.kind);
  for (int i = 0; i < sizes; ++i)
    if (!(part.size[i] > 0 && part.size[i] <= kMaxCoordinate)) return false;
  if (part.kind != ShapeKind::kConvexHull) return sizes >= 0;
  return part.vertices.data && part.vertices.size >= 9 && part.vertices.size % 3 == 0 &&
         finite(part.vertices.data, part.vertices.size, kMaxCoordinate) && have_area(part.vertices);
}

// The interval that a part, or the position of a half space, covers along a direction, measured from the link's origin.
// n: the direction in the link's frame.
void part_interval(const ConvexPart& part, const double columns[3][3], const double* n, double* lo, double* hi) {
  double local[3];
  for (int k = 0; k < 3; ++k) local[k] = dot(columns[k], n);
  const double at[3] = {static_cast<double>(part.position[0]), static_cast<double>(part.position[1]),
                        static_cast<double>(part.position[2])};
  const double middle = dot(at, n);
  const double size[3] = {static_cast<double>(part.size[0]), static_cast<double>(part.size[1]),
                          static_cast<double>(part.size[2])};
  if (part.kind == ShapeKind::kConvexHull) {
    *lo = std::numeric_limits<double>::infinity();
    *hi = -*lo;
    for (std::size_t v = 0; v < part.vertices.size; v += 3) {
      const double vertex[3] = {static_cast<double>(part.vertices[v]), static_cast<double>(part.vertices[v + 1]),
                                static_cast<double>(part.vertices[v + 2])};
      *lo = std::min(*lo, middle + dot(vertex, local));
      *hi = std::max(*hi, middle + dot(vertex, local));
    }
    return;
  }
  double reach = 0;
  switch (part.kind) {
    case ShapeKind::kBox:
      for (int k = 0; k < 3; ++k) reach += size[k] * std::fabs(local[k]);
      break;
    case ShapeKind::kEllipsoid:
      reach = std::sqrt(size[0] * size[0] * local[0] * local[0] + size[1] * size[1] * local[1] * local[1] +
                        size[2] * size[2] * local[2] * local[2]);
      break;
    case ShapeKind::kCapsule: reach = size[0] + size[1] * std::fabs(local[2]); break;
    case ShapeKind::kCylinder:
      reach = size[0] * std::sqrt(local[0] * local[0] + local[1] * local[1]) + size[1] * std::fabs(local[2]);
      break;
    case ShapeKind::kSphere: reach = size[0]; break;
    case ShapeKind::kConvexHull:
    case ShapeKind::kHalfSpace: break;
  }
  *lo = middle - reach;
  *hi = middle + reach;
}

bool part_inside(const ConvexPart& part, const double columns[3][3], const Box& box) {
  double sum = 0;
  for (const float half : box.half) sum += static_cast<double>(half);
  const double center[3] = {static_cast<double>(box.center[0]), static_cast<double>(box.center[1]),
                            static_cast<double>(box.center[2])};
  for (int k = 0; k < 3; ++k) {
    const double n[3] = {static_cast<double>(box.axis[k][0]), static_cast<double>(box.axis[k][1]),
                         static_cast<double>(box.axis[k][2])};
    double lo, hi;
    part_interval(part, columns, n, &lo, &hi);
    const double allowed = static_cast<double>(box.half[k]) + kShapeTolerance * sum;
    if (hi - dot(center, n) > allowed || dot(center, n) - lo > allowed) return false;
  }
  return true;
}

// The result of a check: kOk, or a status and the element at fault.
struct Fault {
  Status status = Status::kOk;
  std::size_t element = 0;
};

Fault check_links(const ArticulationDesc& desc) {
  if (desc.link_parents.size == 0 || !desc.link_parents.data) return {Status::kNoLinks, 0};
  if (desc.link_parents.size > kMaxLinks) return {Status::kTooManyLinks, kMaxLinks};
  for (std::size_t link = 0; link < desc.link_parents.size; ++link) {
    const std::int32_t parent = desc.link_parents[link];
    if (parent < -1 || parent >= static_cast<std::int32_t>(link)) return {Status::kBadParent, link};
  }
  if (desc.link_joints.size == 0) return {};
  if (desc.link_joints.size != 3 * desc.link_parents.size || !desc.link_joints.data) return {Status::kBadJoint, 0};
  for (std::size_t link = 0; link < desc.link_parents.size; ++link)
    if (!finite(desc.link_joints.data + 3 * link, 3, kMaxCoordinate)) return {Status::kBadJoint, link};
  return {};
}

Fault check_leaf(const Leaf& leaf, std::size_t index, std::size_t link_count, std::size_t vertex_count, Box* box) {
  if (leaf.link >= link_count) return {Status::kBadLeafLink, index};
  if (leaf.triangles.size > 0) {
    const auto exists = [&](std::uint32_t vertex) { return vertex < vertex_count; };
    if (!leaf.triangles.data || leaf.triangles.size % 3 != 0 || leaf.parts.size > 0 ||
        !std::all_of(leaf.triangles.begin(), leaf.triangles.end(), exists))
      return {Status::kBadLeafTriangles, index};
    return {};
  }
  *box = leaf.box;
  if (!finite(box->center, 3, kMaxCoordinate) || !finite(box->half, 3, kMaxCoordinate))
    return {Status::kBadLeafBox, index};
  for (float& half : box->half) {
    if (half < 0) return {Status::kBadLeafBox, index};
    half = std::fabs(half);
  }
  const double error = axes_error(*box);
  if (!(error <= kAxesTolerance)) return {Status::kBadLeafAxes, index};
  if (error > kAxesExact) make_orthonormal(*box, error);
  if (leaf.parts.size > 0 && !leaf.parts.data) return {Status::kBadShape, index};
  for (const ConvexPart& part : leaf.parts) {
    double columns[3][3];
    if (!valid_sizes(part) || !rotation_columns(part.rotation, columns)) return {Status::kBadShape, index};
    if (!part_inside(part, columns, *box)) return {Status::kShapeOutsideLeafBox, index};
  }
  return {};
}

// Groups leaves by link and lists the links that a frame must pose.
void plan_posing(Articulation& articulation, Arena& arena) {
  std::vector<bool> needs_joint(articulation.link_count, false);
  for (const MergeStep& step : articulation.program.steps)
    if (step.joint_link != kNoJoint) needs_joint[step.joint_link] = true;
  std::vector<bool> is_relative(articulation.link_count, false);
  for (const std::uint16_t link : articulation.skin.relatives) is_relative[link] = true;
  std::vector<std::vector<std::uint16_t>> leaves_of(articulation.link_count);
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf)
    leaves_of[articulation.leaf_link[leaf]].push_back(static_cast<std::uint16_t>(leaf));
  auto order = arena.allocate<std::uint16_t>(articulation.leaf_count);
  std::vector<PosedLink> posed;
  std::uint16_t at = 0;
  for (std::uint32_t link = 0; link < articulation.link_count; ++link) {
    if (leaves_of[link].empty() && !needs_joint[link] && !is_relative[link]) continue;
    const std::uint16_t begin = at;
    for (const std::uint16_t leaf : leaves_of[link]) order[at++] = leaf;
    posed.push_back({static_cast<std::uint16_t>(link), begin, at, needs_joint[link]});
  }
  articulation.leaf_order = constant(order);
  articulation.leaves_by_link = std::adjacent_find(articulation.leaf_link.begin(), articulation.leaf_link.end(),
                                                   std::greater_equal<>()) == articulation.leaf_link.end();
  std::vector<bool> has_child(articulation.link_count, false);
  articulation.is_chain = true;
  for (std::size_t link = 1; link < articulation.link_count; ++link) {
    const std::int32_t parent = articulation.link_parent[link];
    articulation.is_chain = articulation.is_chain && parent >= 0 && !has_child[static_cast<std::size_t>(parent)];
    if (parent >= 0) has_child[static_cast<std::size_t>(parent)] = true;
  }
  articulation.posed_links = constant(arena.copy(Span<const PosedLink>(posed)));
}

void append_ignored(Span<const LinkPair> pairs, IgnoredReason reason, std::vector<IgnoredPair>& out) {
  for (const LinkPair& pair : pairs)
    if (pair.a != pair.b)
      out.push_back({static_cast<std::uint16_t>(std::min(pair.a, pair.b)),
                     static_cast<std::uint16_t>(std::max(pair.a, pair.b)), reason});
}

// Appends every pair of links that are at most most_hops joints apart. Links of two trees are endlessly far apart.
void append_within_hops(Span<const std::int32_t> parents, std::uint32_t most_hops, std::vector<IgnoredPair>& out) {
  constexpr std::uint32_t kEndless = 0xffffffff;
  if (most_hops == 0) return;
  const std::size_t count = parents.size;
  std::vector<std::uint32_t> hops(count * count, 0);
  for (std::size_t b = 1; b < count; ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      // Every link below b has a higher index than b, so the path up from a ends at b's parent.
      std::uint32_t apart = kEndless;
      if (parents[b] >= 0) apart = hops[a * count + static_cast<std::size_t>(parents[b])];
      if (apart != kEndless) ++apart;
      hops[a * count + b] = hops[b * count + a] = apart;
      if (apart != kEndless && apart <= most_hops)
        out.push_back({static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b), kIgnoredByHops});
    }
  }
}

// Sets the ignored pairs of an articulation: as a sorted list that has each pair once, with all its reasons, and as
// bits.
void set_ignored(std::vector<IgnoredPair>& pairs, Arena& arena, Articulation& articulation) {
  std::sort(pairs.begin(), pairs.end(), [](const IgnoredPair& left, const IgnoredPair& right) {
    return left.a != right.a ? left.a < right.a : left.b < right.b;
  });
  std::size_t kept = 0;
  for (const IgnoredPair& pair : pairs) {
    if (kept > 0 && pairs[kept - 1].a == pair.a && pairs[kept - 1].b == pair.b)
      pairs[kept - 1].reasons |= pair.reasons;
    else
      pairs[kept++] = pair;
  }
  pairs.resize(kept);
  articulation.ignored_pairs = constant(arena.copy(Span<const IgnoredPair>(pairs)));

  const std::size_t link_count = articulation.link_count;
  auto bits = arena.allocate<std::uint64_t>((link_count * link_count + 63) / 64);
  const auto set = [&](std::size_t a, std::size_t b) {
    bits[(a * link_count + b) >> 6] |= std::uint64_t{1} << ((a * link_count + b) & 63);
  };
  for (std::size_t link = 0; link < link_count; ++link) set(link, link);
  for (const IgnoredPair& pair : pairs) {
    set(pair.a, pair.b);
    set(pair.b, pair.a);
  }
  articulation.ignored_bits = constant(bits);
}

void copy_parts(Span<const Leaf> leaves, Articulation& articulation, Arena& arena) {
  std::size_t part_count = 0;
  for (const Leaf& leaf : leaves) part_count += leaf.parts.size;
  auto parts = arena.allocate<ConvexPart>(part_count);
  auto begin = arena.allocate<std::uint32_t>(leaves.size + 1);
  std::uint32_t at = 0;
  for (std::size_t leaf = 0; leaf < leaves.size; ++leaf) {
    begin[leaf] = at;
    for (const ConvexPart& part : leaves[leaf].parts) {
      parts[at] = part;
      parts[at++].vertices =
          part.kind == ShapeKind::kConvexHull ? constant(arena.copy(part.vertices)) : Span<const float>{};
    }
  }
  begin[leaves.size] = at;
  articulation.parts = constant(parts);
  articulation.leaf_part_begin = constant(begin);
}

// Checks leaves and copies them, with their parts. boxes: receives their boxes, but for leaves with triangles of a skin
// of so many vertices.
Fault copy_leaves(Span<const Leaf> leaves, std::size_t link_count, std::size_t vertex_count, Arena& arena,
                  Articulation& articulation, Span<Box>& boxes) {
  boxes = arena.allocate<Box>(leaves.size);
  auto links = arena.allocate<std::uint16_t>(leaves.size);
  for (std::size_t leaf = 0; leaf < leaves.size; ++leaf) {
    const Fault fault = check_leaf(leaves[leaf], leaf, link_count, vertex_count, &boxes[leaf]);
    if (fault.status != Status::kOk) return fault;
    links[leaf] = static_cast<std::uint16_t>(leaves[leaf].link);
  }
  articulation.leaf_count = static_cast<std::uint32_t>(leaves.size);
  articulation.leaf_link = constant(links);
  articulation.leaf_box = constant(boxes);
  copy_parts(leaves, articulation, arena);
  return {};
}

// Returns the status of a fault. *bad_element, if not null, receives the element.
Status report(const Fault& fault, std::uint32_t* bad_element) {
  if (fault.status != Status::kOk && bad_element) *bad_element = static_cast<std::uint32_t>(fault.element);
  return fault.status;
}

// Appends the point center + sum of size[k] axes[k]. If bit k of i is clear, size[k] is negated.
void append_corner(const double* center, const double axes[3][3], const double* size, unsigned i,
                   std::vector<float>& vertices) {
  for (int c = 0; c < 3; ++c) {
    double at = center[c];
    for (unsigned k = 0; k < 3; ++k) at += (i >> k & 1 ? size[k] : -size[k]) * axes[k][c];
    vertices.push_back(static_cast<float>(at));
  }
}

void append_box(const Box& box, std::vector<float>& vertices) {
  double center[3], axes[3][3], half[3];
  for (int k = 0; k < 3; ++k) {
    center[k] = static_cast<double>(box.center[k]);
    half[k] = static_cast<double>(box.half[k]);
    for (int c = 0; c < 3; ++c) axes[k][c] = static_cast<double>(box.axis[k][c]);
  }
  for (unsigned i = 0; i < 8; ++i) append_corner(center, axes, half, i, vertices);
}

// box: of the part's leaf.
void append_part(const ConvexPart& part, const Box& box, std::vector<float>& vertices) {
  if (part.kind == ShapeKind::kHalfSpace) {
    append_box(box, vertices);
    return;
  }
  double columns[3][3];
  rotation_columns(part.rotation, columns);
  double at[3], size[3];
  for (int c = 0; c < 3; ++c) at[c] = static_cast<double>(part.position[c]);
  if (part.kind == ShapeKind::kConvexHull) {
    for (std::size_t v = 0; v < part.vertices.size; v += 3) {
      for (int c = 0; c < 3; ++c) size[c] = static_cast<double>(part.vertices[v + static_cast<std::size_t>(c)]);
      append_corner(at, columns, size, 7, vertices);
    }
    return;
  }
  for (int c = 0; c < 3; ++c) size[c] = static_cast<double>(part.size[c]);
  switch (part.kind) {
    case ShapeKind::kCapsule: size[2] = size[0] + size[1]; break;
    case ShapeKind::kCylinder: size[2] = size[1]; break;
    case ShapeKind::kSphere: size[2] = size[0]; break;
    case ShapeKind::kBox:
    case ShapeKind::kEllipsoid:
    case ShapeKind::kConvexHull:
    case ShapeKind::kHalfSpace: break;
  }
  if (size_count(part.kind) < 3) size[1] = size[0];
  for (unsigned i = 0; i < 8; ++i) append_corner(at, columns, size, i, vertices);
}

// Lists the vertices of every leaf's exact shape.
void list_vertices(Articulation& articulation, Arena& arena) {
  std::vector<float> vertices;
  auto begin = arena.allocate<std::uint32_t>(articulation.leaf_count + 1);
  auto reach = arena.allocate<float>(articulation.leaf_count);
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
    const std::uint32_t first_part = articulation.leaf_part_begin[leaf], end = articulation.leaf_part_begin[leaf + 1];
    for (std::uint32_t part = first_part; part < end; ++part)
      append_part(articulation.parts[part], articulation.leaf_box[leaf], vertices);
    if (first_part == end) append_box(articulation.leaf_box[leaf], vertices);
    begin[leaf + 1] = static_cast<std::uint32_t>(vertices.size() / 3);
    for (std::size_t v = 3 * begin[leaf]; v < vertices.size(); v += 3)
      reach[leaf] =
          std::max(reach[leaf], std::fabs(vertices[v]) + std::fabs(vertices[v + 1]) + std::fabs(vertices[v + 2]));
  }
  articulation.vertices = constant(arena.copy(Span<const float>(vertices)));
  articulation.leaf_vertex_begin = constant(begin);
  articulation.leaf_vertex_reach = constant(reach);
}

Fault build(const ArticulationDesc& desc, Arena& arena, Articulation& articulation) {
  if (const Fault fault = check_links(desc); fault.status != Status::kOk) return fault;
  if (desc.leaves.size == 0 || !desc.leaves.data) return {Status::kNoLeaves, 0};
  if (desc.leaves.size > kMaxLeaves) return {Status::kTooManyLeaves, kMaxLeaves};
  Span<Box> boxes;
  if (const Fault fault =
          copy_leaves(desc.leaves, desc.link_parents.size, desc.skin.vertices.size / 3, arena, articulation, boxes);
      fault.status != Status::kOk)
    return fault;
  std::size_t bad_element = 0;
  const Status status = fit_skin(desc, arena, boxes, articulation.skin, bad_element);
  if (status != Status::kOk) return {status, bad_element};
  list_surface(desc, arena, articulation.surface);
  find_parts(desc, articulation.surface, arena, articulation.surface_parts);
  if (desc.ignored_pairs.size > 0 && !desc.ignored_pairs.data) return {Status::kBadIgnoredPair, 0};
  for (std::size_t pair = 0; pair < desc.ignored_pairs.size; ++pair)
    if (desc.ignored_pairs[pair].a >= desc.link_parents.size || desc.ignored_pairs[pair].b >= desc.link_parents.size)
      return {Status::kBadIgnoredPair, pair};

  articulation.link_count = static_cast<std::uint32_t>(desc.link_parents.size);
  articulation.node_count = 2 * articulation.leaf_count - 1;
  articulation.link_parent = constant(arena.copy(desc.link_parents));
  articulation.link_joint = constant(desc.link_joints.size ? arena.copy(desc.link_joints)
                                                           : arena.allocate<float>(3 * desc.link_parents.size));
  std::vector<IgnoredPair> ignored;
  append_ignored(desc.ignored_pairs, kIgnoredExplicitly, ignored);
  append_within_hops(desc.link_parents, desc.ignored_hops, ignored);
  set_ignored(ignored, arena, articulation);
  list_vertices(articulation, arena);
  articulation.program = build_merge_program(articulation.link_parent, articulation.leaf_link, arena);
  plan_posing(articulation, arena);
  return {};
}

}  // namespace

std::uint64_t count_leaf_pairs_within(const Articulation& articulation) {
  std::uint64_t out = 0;
  for (std::uint32_t a = 0; a < articulation.leaf_count; ++a)
    for (std::uint32_t b = a + 1; b < articulation.leaf_count; ++b)
      out += !is_ignored(articulation, articulation.leaf_link[a], articulation.leaf_link[b]);
  return out;
}

Span<const std::uint16_t> leaves_of(const Articulation& articulation, std::uint32_t link) {
  const Span<const PosedLink> posed = articulation.posed_links;
  const PosedLink* const found = std::lower_bound(
      posed.begin(), posed.end(), link, [](const PosedLink& one, std::uint32_t value) { return one.link < value; });
  if (found == posed.end() || found->link != link) return {};
  return {articulation.leaf_order.data + found->leaf_begin,
          static_cast<std::size_t>(found->leaf_end - found->leaf_begin)};
}

Status build_articulation(const ArticulationDesc& desc, Arena& arena, Articulation* out, std::uint32_t* bad_element) {
  Articulation articulation;
  const Fault fault = build(desc, arena, articulation);
  if (fault.status == Status::kOk) *out = articulation;
  return report(fault, bad_element);
}

Status build_leaves(Span<const Leaf> leaves, Arena& arena, Articulation* out, std::uint32_t* bad_leaf) {
  Articulation articulation;
  articulation.link_count = 1;
  Span<Box> boxes;
  const Fault fault = copy_leaves(leaves, 1, 0, arena, articulation, boxes);
  if (fault.status == Status::kOk) *out = articulation;
  return report(fault, bad_leaf);
}

bool rotation_columns(const float* q, double columns[3][3]) {
  const double x = static_cast<double>(q[0]), y = static_cast<double>(q[1]), z = static_cast<double>(q[2]),
               w = static_cast<double>(q[3]);
  const double n = x * x + y * y + z * z + w * w;
  if (!(std::fabs(n - 1) <= kUnitTolerance)) return false;
  const double s = 2 / n;
  const double m[3][3] = {{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)},
                          {s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)},
                          {s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}};
  for (int k = 0; k < 3; ++k) std::copy(m[k], m[k] + 3, columns[k]);
  return true;
}

void ignore_pairs(Span<const LinkPair> pairs, Arena& arena, Articulation& articulation) {
  std::vector<IgnoredPair> ignored;
  append_ignored(pairs, kIgnoredExplicitly, ignored);
  set_ignored(ignored, arena, articulation);
}

void ignore_at_rest(Span<const LinkPair> touching, Arena& arena, Articulation& articulation) {
  std::vector<IgnoredPair> pairs(articulation.ignored_pairs.begin(), articulation.ignored_pairs.end());
  append_ignored(touching, kIgnoredAtRest, pairs);
  set_ignored(pairs, arena, articulation);
}

}  // namespace cab
