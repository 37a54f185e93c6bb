#include "engine/session/static_bodies.h"

#include "kernels/pose_leaves.h"
#include "layout/fit_box.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab {
namespace {

constexpr float kUnturned[4] = {0, 0, 0, 1};

// A triangle as a body: its vertices are relative to a point near it, so that their boxes have little padding.
struct TriangleBody {
  double origin[3];
  float vertices[9];  // x y z of each vertex less the origin, exact
};

bool valid_vertices(const StaticDesc& desc) {
  if (desc.triangles.size == 0) return true;
  return desc.triangles.data && desc.vertices.data && desc.vertices.size % 3 == 0 &&
         std::all_of(desc.vertices.begin(), desc.vertices.end(),
                     [](float value) { return std::fabs(value) <= kMaxCoordinate; }) &&
         std::all_of(desc.origin, desc.origin + 3, [](double value) { return std::isfinite(value); });
}

// Along each axis the origin is at the first vertex, if the differences to the others are floats, and else at that of
// the mesh: then the triangle is about as large as it is far away.
TriangleBody triangle_body(const StaticDesc& desc, const std::uint32_t* corner) {
  TriangleBody out;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto at = [&](std::size_t i) { return desc.vertices[3 * std::size_t{corner[i]} + c]; };
    bool exact = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const double difference = static_cast<double>(at(i)) - static_cast<double>(at(0));
      out.vertices[3 * i + c] = static_cast<float>(difference);
      exact = exact && static_cast<double>(out.vertices[3 * i + c]) == difference;
    }
    out.origin[c] = exact ? desc.origin[c] + static_cast<double>(at(0)) : desc.origin[c];
    if (!exact)
      for (std::size_t i = 0; i < 3; ++i) out.vertices[3 * i + c] = at(i);
  }
  return out;
}

Status bad_triangle(std::size_t body, std::uint32_t* bad_element) {
  if (bad_element) *bad_element = static_cast<std::uint32_t>(body);
  return Status::kBadTriangles;
}

// The leaves of bodies and triangles, before they are checked, and where they are placed.
struct LeafList {
  std::vector<Leaf> leaves;
  std::vector<ConvexPart> hulls;        // of the triangles
  std::vector<TriangleBody> triangles;  // whose vertices `hulls` name

  // Returns the status of the first triangle that has no box.
  Status add_triangles(const StaticDesc& desc, std::uint32_t* bad_element) {
    const std::size_t count = desc.triangles.size / 3;
    hulls.resize(count);
    triangles.reserve(count);
    for (std::size_t t = 0; t < count; ++t) {
      const std::uint32_t* const corner = desc.triangles.data + 3 * t;
      const bool in_mesh =
          std::all_of(corner, corner + 3, [&desc](std::uint32_t v) { return v < desc.vertices.size / 3; });
      if (in_mesh) triangles.push_back(triangle_body(desc, corner));
      Leaf leaf;
      if (!in_mesh || fit_box_to_vertices({triangles.back().vertices, 9}, &leaf.box) != Status::kOk)
        return bad_triangle(desc.bodies.size + t, bad_element);
      hulls[t].kind = ShapeKind::kConvexHull;
      hulls[t].vertices = {triangles.back().vertices, 9};
      leaf.parts = {&hulls[t], 1};
      leaves.push_back(leaf);
    }
    return Status::kOk;
  }
};

// Copies where body i is. Returns whether its origin is finite.
bool place(const double* origin, const float* rotation, std::size_t i, StaticBodies& out) {
  std::copy_n(rotation, 4, out.poses.data + 7 * i);
  std::copy_n(origin, 3, out.origins.data + 3 * i);
  return std::all_of(origin, origin + 3, [](double value) { return std::isfinite(value); });
}

// Poses up to sixteen bodies from `first` on, and stores their bounds. Returns how many of them take part: those up to
// the first whose rotation or box is refused.
std::uint32_t bound_tile(const kernel::KernelTable& kernels, std::uint32_t first, StaticBodies& bodies) {
  const std::uint32_t count = std::min(kLanes, bodies.leaves.leaf_count - first);
  std::uint8_t flags[kLanes];
  BoxTile own, box;
  PointTile joint;
  kernel::PoseTile pose;
  pose.articulation = &bodies.one;
  pose.coding = coding_of({PoseFormat::kQuaternionTranslation, bodies.poses.data});
  pose.link_stride = 7;
  kernel::point_lanes(bodies.poses.data + 7 * std::size_t{first}, 7, count, pose.poses);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    pose.orientations[lane] = nullptr;
    pose.scales[lane] = 1;
    pose.margins[lane] = 0;
    set_lane(bodies.leaves.leaf_box[first + std::min(lane, count - 1)], lane, own);
  }
  pose.leaves = &box;
  pose.joints = &joint;
  pose.motions = nullptr;
  pose.flags = flags;
  pose.own_boxes = &own;
  kernels.pose_leaves(pose);
  AabbTile bounds;
  kernels.bound_boxes(&box, 1, &bounds);
  for (std::uint32_t lane = 0; lane < count; ++lane) {
    if (flags[lane] != kInstanceOk) return lane;
    for (std::size_t c = 0; c < 3; ++c) {
      bodies.bounds[6 * std::size_t{first + lane} + c] = bounds.lo[c][lane];
      bodies.bounds[6 * std::size_t{first + lane} + 3 + c] = bounds.hi[c][lane];
    }
  }
  return count;
}

// Places all bodies. Returns the index of the first that is refused, or their number.
std::size_t place_all(const StaticDesc& desc, const LeafList& list, const kernel::KernelTable& kernels,
                      StaticBodies& out) {
  const std::size_t count = list.leaves.size();
  out.allocate_per_body(count);
  std::size_t placed = 0;
  for (const StaticBody& body : desc.bodies) {
    if (!place(body.origin, body.rotation, placed, out)) return placed;
    ++placed;
  }
  for (const TriangleBody& triangle : list.triangles) {
    if (!place(triangle.origin, kUnturned, placed, out)) return placed;
    ++placed;
  }
  for (std::uint32_t first = 0; first < count; first += kLanes) {
    const std::uint32_t here = bound_tile(kernels, first, out);
    if (first + here < std::min<std::size_t>(count, first + kLanes)) return first + here;
  }
  return count;
}

}  // namespace

StaticBodiesPtr make_static_bodies(const Allocator& allocator) { return StaticBodiesPtr(new StaticBodies(allocator)); }

void StaticBodiesDelete::operator()(StaticBodies* bodies) const { delete bodies; }

BatchInput StaticBodies::complete(const BatchInput& given, bool by_bounds) const {
  BatchInput out = given;
  out.poses = {PoseFormat::kQuaternionTranslation, poses.data};
  out.origins = {origins.data, origins.size};
  out.moved = {moved.data, moved.size};
  if (by_bounds) out.bounds = {bounds.data, bounds.size};
  return out;
}

void StaticBodies::allocate_per_body(std::size_t count) {
  poses = arena.allocate<float>(7 * count);
  origins = arena.allocate<double>(3 * count);
  moved = arena.allocate<std::uint8_t>(count);
  bounds = arena.allocate<float>(6 * count);
  last_layers_ = arena.allocate<std::uint32_t>(count);
  last_masks_ = arena.allocate<std::uint32_t>(count);
  for (const Span<std::uint32_t> words : {last_layers_, last_masks_}) std::fill(words.begin(), words.end(), ~0u);
}

void StaticBodies::note_layers(const InstanceBatch& batch) {
  const Span<const std::uint32_t> layers = batch.input->layers, masks = batch.input->layer_masks;
  const bool given = !layers.empty() || !masks.empty();
  if (!given && !has_layers_) return;
  has_layers_ = given;
  for (std::uint32_t place = 0; place < active_count(batch); ++place) {
    const std::uint32_t body = active_instance(batch, place);
    const std::uint32_t layer = layers.empty() ? ~0u : layers[body], mask = masks.empty() ? ~0u : masks[body];
    moved[body] = layer != last_layers_[body] || mask != last_masks_[body];
    last_layers_[body] = layer;
    last_masks_[body] = mask;
    has_layers_ = has_layers_ || moved[body];
  }
  if (has_layers_) return;
  // Bodies that this frame does not give count as moved when they come back.
  std::fill(moved.begin(), moved.end(), std::uint8_t{0});
  for (const Span<std::uint32_t> words : {last_layers_, last_masks_}) std::fill(words.begin(), words.end(), ~0u);
}

Status build_static_bodies(const StaticDesc& desc, const kernel::KernelTable& kernels, StaticBodies* out,
                           std::uint32_t* bad_element) {
  const std::size_t count = desc.bodies.size + desc.triangles.size / 3;
  if (desc.bodies.size == 0 && desc.triangles.size == 0) return Status::kNoInstances;
  if (count > kMaxInstances) return Status::kTooManyInstances;
  if (desc.bodies.size && !desc.bodies.data) return Status::kBadStaticBody;
  if (desc.triangles.size % 3 != 0 || !valid_vertices(desc)) return bad_triangle(desc.bodies.size, bad_element);

  LeafList list;
  list.leaves.reserve(count);
  for (const StaticBody& body : desc.bodies) list.leaves.push_back({0, body.box, body.parts});
  if (const Status status = list.add_triangles(desc, bad_element); status != Status::kOk) return status;
  if (const Status status = build_leaves({list.leaves.data(), count}, out->arena, &out->leaves, bad_element);
      status != Status::kOk)
    return status;

  const std::int32_t root[] = {-1};
  const Leaf any = {0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}, {}};
  ArticulationDesc one;
  one.link_parents = {root, 1};
  one.leaves = {&any, 1};
  if (const Status status = build_articulation(one, out->arena, &out->one, nullptr); status != Status::kOk)
    return status;
  build_link_bounds(out->one, out->arena, &out->link_bounds);

  if (const std::size_t placed = place_all(desc, list, kernels, *out); placed < count) {
    if (bad_element) *bad_element = static_cast<std::uint32_t>(placed);
    return Status::kBadStaticBody;
  }
  out->convex_shapes = make_convex_shapes(out->leaves, out->arena);
  out->fcl_shapes = make_fcl_shapes(out->leaves);
  return Status::kOk;
}

}  // namespace cab
