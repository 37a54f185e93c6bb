#include "perf/measure/peers/robot_geometry.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>

namespace cab::perf {

RobotGeometry mesh_geometry(const std::vector<float>& corners) {
  const auto point = [&](std::size_t at) { return fcl::Vector3d(corners[at], corners[at + 1], corners[at + 2]); };
  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  mesh->beginModel(static_cast<int>(corners.size() / 9));
  for (std::size_t t = 0; t < corners.size(); t += 9) mesh->addTriangle(point(t), point(t + 3), point(t + 6));
  mesh->endModel();
  return mesh;
}

RobotGeometry shape_geometry(const ConvexPart& part) {
  const double x = part.size[0], y = part.size[1], z = part.size[2];
  switch (part.kind) {
    case ShapeKind::kSphere: return std::make_shared<fcl::Sphered>(x);
    case ShapeKind::kCapsule: return std::make_shared<fcl::Capsuled>(x, 2 * y);
    case ShapeKind::kCylinder: return std::make_shared<fcl::Cylinderd>(x, 2 * y);
    case ShapeKind::kEllipsoid: return std::make_shared<fcl::Ellipsoidd>(x, y, z);
    default: return std::make_shared<fcl::Boxd>(2 * x, 2 * y, 2 * z);
  }
}

fcl::Transform3d motion_of(const float* rotation, const float* translation) {
  const fcl::Quaterniond q(rotation[3], rotation[0], rotation[1], rotation[2]);
  fcl::Transform3d out = fcl::Transform3d::Identity();
  out.linear() = q.normalized().toRotationMatrix();
  out.translation() = fcl::Vector3d(translation[0], translation[1], translation[2]);
  return out;
}

fcl::Transform3d place_of(bool is_mesh, const ConvexPart& part, const float* pose) {
  const fcl::Transform3d link = motion_of(pose, pose + 4);
  return is_mesh ? link : fcl::Transform3d(link * motion_of(part.rotation, part.position));
}

}  // namespace cab::perf
