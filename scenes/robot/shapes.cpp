// Collision shapes of a robot's links as leaves.
#include "scenes/robot/shapes.h"

#include "layout/shape_sizes.h"
#include "scenes/import/limits.h"

#include <cab/cab.h>

#include <algorithm>
#include <cmath>

namespace cab::scenes {
namespace {

// More than the rounding of a part's rotation and of a box's axes to float can move a point, as a share of the size.
constexpr double kBoxMargin = 0x1p-20;

// Half extents of a shape along its own axes.
Vec3 half_extents(const RobotShape& shape) {
  const double radius = shape.size[0];
  switch (shape.kind) {
    case ShapeKind::kSphere: return {radius, radius, radius};
    case ShapeKind::kCapsule: return {radius, radius, shape.size[1] + radius};
    case ShapeKind::kCylinder: return {radius, radius, shape.size[1]};
    case ShapeKind::kBox:
    case ShapeKind::kEllipsoid:
    case ShapeKind::kConvexHull:
    case ShapeKind::kHalfSpace: break;
  }
  return shape.size;
}

// A box about a shape that is not a hull, along the shape's axes.
Box box_about(const RobotShape& shape, const ConvexPart& part) {
  Box box = {};
  const Quat rotation = normalized({part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]});
  const Vec3 half = half_extents(shape);
  const double margin = kBoxMargin * (half[0] + half[1] + half[2]);
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 unit = {0, 0, 0};
    unit[k] = 1;
    const Vec3 axis = rotate(rotation, unit);
    for (std::size_t c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axis[c]);
    box.center[k] = part.position[k];
    box.half[k] = static_cast<float>(half[k] + margin);
  }
  return box;
}

bool is_in_range(double x) { return std::fabs(x) <= kMaxImportValue; }

}  // namespace

bool in_range(const Vec3& vector) { return std::all_of(vector.begin(), vector.end(), is_in_range); }

bool in_range(const RigidMotion& motion) {
  return in_range(motion.translation) && std::all_of(motion.rotation.begin(), motion.rotation.end(), is_in_range);
}

void leave_out_empty(Robot& robot, const std::string& source) {
  ++robot.left_out.shapes;
  robot.notes.push_back(source + ": left out, since a size of it is 0");
}

void add_shape(Robot& robot, std::uint32_t link, const RobotShape& shape, const std::string& source) {
  if (!in_range(shape.place)) throw ImportError(source + ": its place is not a number or out of range");
  bool is_empty = false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(size_count(shape.kind)); ++k) {
    if (!(shape.size[k] >= 0 && shape.size[k] <= kMaxImportValue))
      throw ImportError(source + ": its size must be from 0 to 1e9 m");
    is_empty = is_empty || static_cast<float>(shape.size[k]) == 0;
  }
  if (is_empty) return leave_out_empty(robot, source);
  BodyLeaf leaf;
  leaf.link = link;
  ShapePart part;
  part.shape.kind = shape.kind;
  if (shape.kind == ShapeKind::kConvexHull) {
    for (const Vec3& vertex : shape.vertices) {
      const Vec3 point = rotate(shape.place.rotation, vertex) + shape.place.translation;
      if (!in_range(point)) throw ImportError(source + ": a vertex is not a number or out of range");
      for (const double component : point) part.vertices.push_back(static_cast<float>(component));
    }
    const Status status = fit_box(part.vertices, &leaf.box);
    if (status != Status::kOk) throw ImportError(source + ": " + to_string(status));
  } else {
    for (std::size_t k = 0; k < 3; ++k) {
      part.shape.position[k] = static_cast<float>(shape.place.translation[k]);
      part.shape.size[k] = static_cast<float>(shape.size[k]);
    }
    for (std::size_t k = 0; k < 4; ++k) part.shape.rotation[k] = static_cast<float>(shape.place.rotation[k]);
    leaf.box = box_about(shape, part.shape);
  }
  leaf.parts.push_back(std::move(part));
  robot.body.leaves.push_back(std::move(leaf));
  robot.leaf_sources.push_back(source);
}

void add_triangles(const RobotShape& shape, LeafTriangles* triangles) {
  if (triangles == nullptr) return;
  std::vector<float>& out = triangles->emplace_back();
  for (const Vec3& corner : shape.corners)
    for (const double x : rotate(shape.place.rotation, corner) + shape.place.translation)
      out.push_back(static_cast<float>(x));
}

}  // namespace cab::scenes
