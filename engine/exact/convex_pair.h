// Two convex shapes in double, from the caller's poses and shapes as they were given: in the frame of a's shape, and
// scaled by a power of two so that their size is about 1.
#pragma once

#include "kernels/convex/convex_block.h"
#include "kernels/pose_leaves.h"
#include "kernels/vec3.h"

namespace cab {

using Double3 = kernel::Vec3<double>;
inline Double3 double3(const float* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// An axis of a convex shape, in the frame of its link.
inline Double3 axis_of(const ConvexShape& shape, std::size_t k) {
  return {shape.axis[k][0], shape.axis[k][1], shape.axis[k][2]};
}

// A shape, and the pose of its link.
struct PlacedShape {
  const ConvexShape* shape;
  StoredPose at;
};

// The pose of a link in its instance's frame, rotated by the instance's orientation. T: float or double.
template <class T>
kernel::RigidLanes<T> placed_pose(const StoredPose& from, kernel::LaneChecks<T>& checks) {
  kernel::RawPoses poses, orientations;
  for (std::uint32_t f = 0; f < pose_floats(from.coding.format); ++f) poses.raw[f][0] = from.pose[f];
  for (std::uint32_t f = 0; f < 4 && from.orientation; ++f) orientations.raw[f][0] = from.orientation[f];
  return kernel::placed_pose<T>(poses, {from.coding, from.orientation ? &orientations : nullptr, &from.scale}, 0,
                                checks);
}

// Whether a pose and its instance's orientation are finite, in range and rigid.
inline bool is_valid(const StoredPose& from) {
  kernel::LaneChecks<float> checks = {true, true, true};
  const kernel::RigidLanes<float> posed = placed_pose<float>(from, checks);
  return checks.finite && checks.rigid && kernel::in_range(posed.translation);
}

// placed_pose in double, of a pose that was checked when its instance was bounded.
kernel::RigidLanes<double> pose_in_double(const StoredPose& from);

class ConvexPair {
 public:
  // shift: the origin of b's instance less that of a's instance.
  ConvexPair(const PlacedShape& a, const PlacedShape& b, const double (&shift)[3]);

  // The point of each shape, and of the difference a - b, farthest along a direction, without the balls about round
  // shapes. Of several vertices of a hull the one that comes first by x, then y, then z. None of the shapes may be a
  // half space.
  Double3 farthest_of_a(const Double3& d) const { return farthest_of(a_, d); }
  Double3 farthest_of_b(const Double3& d) const;
  Double3 farthest(const Double3& d) const { return farthest_of_a(d) - farthest_of_b({-d.x, -d.y, -d.z}); }

  // How many of the two shapes are half spaces.
  int half_spaces() const;

  // How high the other shape, without its ball, begins above the plane of the one half space.
  double height_above_plane() const;

  // The radii of a side that is an ellipsoid; null if it is none.
  const Double3* radii_of_a() const { return a_.kind == ConvexKind::kEllipsoid ? &a_.size : nullptr; }
  const Double3* radii_of_b() const { return b_.kind == ConvexKind::kEllipsoid ? &b_.size : nullptr; }

  double scale() const { return scale_; }
  const Double3 (&axis_of_b() const)[3] { return axis_; }
  const Double3& t() const { return t_; }                  // the centre of b's shape
  double radius() const { return a_.radius + b_.radius; }  // of both balls
  double slack() const { return slack_; }                  // more than how far rounding may move a point of b against a
  double rounding() const { return rounding_; }            // of a product of three edges of the difference

 private:
  struct Shape {
    ConvexKind kind;
    Double3 column[3], center;  // relative to the origin of its instance, in world axes
    Double3 size;
    Span<const float> vertices;  // of a hull, relative to `center`, before it is scaled
    double scale;                // of the link
    double radius;               // of the ball about a round shape's segment
    double reach, away;          // away: how far the centre is from the origins of its link and its instance
  };
  static Shape local_shape(const ConvexShape& from);
  static Shape posed_shape(const PlacedShape& from);
  Double3 farthest_of(const Shape& shape, const Double3& d) const;  // in the shape's frame

  Shape a_, b_;
  Double3 axis_[3], t_;  // of b
  double scale_, slack_, rounding_;
};

}  // namespace cab
