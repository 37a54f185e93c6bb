#include "perf/tools/run/obj.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <vector>

#include "perf/base/report.h"
#include "scenes/import/skin_clip.h"
#include "scenes/rig/hull.h"
#include "scenes/rig/posed_skin.h"
#include "scenes/vec3d.h"

namespace cab::perf {
namespace {

using scenes::operator*;
using scenes::operator+;
using scenes::Quat;
using scenes::Vec3;

constexpr int kRings = 12;  // of a round body, pole to pole; a ring has twice as many points

// OBJ counts vertices from 1 through the whole file.
struct ObjWriter {
  std::ostream& out;
  std::size_t vertex_count = 0;

  void object(const std::string& name, const std::vector<Vec3>& vertices,
              const std::vector<std::array<std::uint32_t, 3>>& faces) {
    out << "o ";
    for (const char c : name) out << (c == ' ' || c == '\n' || c == '\r' ? '_' : c);
    out << '\n';
    for (const Vec3& v : vertices)
      out << "v " << fixed(v[0], 6) << ' ' << fixed(v[1], 6) << ' ' << fixed(v[2], 6) << '\n';
    for (const auto& [a, b, c] : faces)
      out << "f " << vertex_count + a + 1 << ' ' << vertex_count + b + 1 << ' ' << vertex_count + c + 1 << '\n';
    vertex_count += vertices.size();
  }
};

Vec3 widen(const float* v) { return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])}; }

// Points on a unit sphere.
std::vector<Vec3> sphere_points() {
  std::vector<Vec3> points;
  const double step = std::acos(-1.0) / kRings;
  for (int ring = 0; ring <= kRings; ++ring)
    for (int k = 0; k < 2 * kRings; ++k)
      points.push_back({std::sin(ring * step) * std::cos(k * step), std::sin(ring * step) * std::sin(k * step),
                        std::cos(ring * step)});
  return points;
}

// Points in the part's frame whose hull shows the part.
std::vector<Vec3> outline(const scenes::ShapePart& part) {
  const Vec3 size = widen(part.shape.size);
  std::vector<Vec3> points;
  switch (part.shape.kind) {
    case ShapeKind::kConvexHull:
      for (std::size_t v = 0; v < part.vertices.size(); v += 3) points.push_back(widen(part.vertices.data() + v));
      break;
    case ShapeKind::kEllipsoid:
      for (const Vec3& p : sphere_points()) points.push_back({size[0] * p[0], size[1] * p[1], size[2] * p[2]});
      break;
    case ShapeKind::kSphere:
      for (const Vec3& p : sphere_points()) points.push_back(size[0] * p);
      break;
    case ShapeKind::kCapsule:
      for (const Vec3& p : sphere_points())
        for (const double end : {-size[1], size[1]}) points.push_back(size[0] * p + Vec3{0, 0, end});
      break;
    case ShapeKind::kCylinder:
      for (const Vec3& p : sphere_points())
        for (const double end : {-size[1], size[1]}) points.push_back({size[0] * p[0], size[0] * p[1], end});
      break;
    case ShapeKind::kBox:
      for (int corner = 0; corner < 8; ++corner)
        points.push_back(
            {corner & 1 ? size[0] : -size[0], corner & 2 ? size[1] : -size[1], corner & 4 ? size[2] : -size[2]});
      break;
    case ShapeKind::kHalfSpace: break;
  }
  const float* const q = part.shape.rotation;
  for (Vec3& point : points) point = widen(part.shape.position) + scenes::rotate({q[0], q[1], q[2], q[3]}, point);
  return points;
}

// The corners of a box. Half extents of 0 become a little more, so that a flat box is seen.
std::vector<Vec3> corners(const Box& box) {
  const double least = 1e-4 * scenes::length(widen(box.half));
  std::vector<Vec3> points;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 point = widen(box.center);
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      const double half = std::max(static_cast<double>(box.half[axis]), least);
      point = point + ((corner >> k & 1) != 0 ? half : -half) * widen(box.axis[axis]);
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace

void write_obj(OutputFile& file, const scenes::Skeleton& skeleton, const scenes::Character& character,
               std::uint32_t frame, const std::array<double, 3>& origin) {
  ObjWriter writer = {file.stream()};
  if (!skeleton.skin.triangles.empty()) {
    std::vector<float> matrices;
    const rig::Skin skin = scenes::skin_of(skeleton, matrices);
    scenes::CheckedSkin checked;
    if (checked.check(skin) == rig::SkinStatus::kOk) {
      std::vector<Vec3> vertices = checked.vertices(checked.joints(frame));
      for (Vec3& vertex : vertices) vertex = vertex + origin;
      writer.object("mesh", vertices, checked.triangles());
    }
  }
  for (const scenes::BodyLeaf& leaf : character.leaves) {
    if (!leaf.triangles.empty()) continue;  // they are the mesh
    const float* const pose = character.poses.data() + 7 * (frame * character.link_parents.size() + leaf.link);
    const Quat rotation = scenes::normalized({pose[0], pose[1], pose[2], pose[3]});
    std::vector<std::vector<Vec3>> bodies;
    for (const scenes::ShapePart& part : leaf.parts) bodies.push_back(outline(part));
    if (bodies.empty()) bodies.push_back(corners(leaf.box));
    for (const std::vector<Vec3>& points : bodies) {
      scenes::Hull hull = scenes::convex_hull(points, points.size());
      for (Vec3& vertex : hull.vertices) vertex = origin + widen(pose + 4) + scenes::rotate(rotation, vertex);
      writer.object(character.link_names[leaf.link], hull.vertices, hull.faces);
    }
  }
  file.close();
}

}  // namespace cab::perf
