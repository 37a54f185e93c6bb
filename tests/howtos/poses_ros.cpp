// Transforms as tf has them and boxes as URDF has them, handed over as in docs/poses.md, against points that are posed
// one by one.
#include "tests/howtos/poses_ros.h"

#include "tests/howtos/poses_check.h"

namespace {

using namespace poses_check;

// One rotation about a fixed axis: x, y or z.
Point turned(std::size_t axis, double angle, Point p) {
  const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
  const Point before = p;
  p[a] = std::cos(angle) * before[a] - std::sin(angle) * before[b];
  p[b] = std::sin(angle) * before[a] + std::cos(angle) * before[b];
  return p;
}

// The rotation of a link in its base, link by link upwards.
std::array<double, 4> rotation_of(const Crowd& crowd, std::size_t character, std::size_t link) {
  std::array<double, 4> q = {0, 0, 0, 1};
  for (auto l = static_cast<std::int32_t>(link); l >= 0; l = kParents[static_cast<std::size_t>(l)]) {
    const std::array<double, 4>& by = crowd.links[character][static_cast<std::size_t>(l)].rotation;
    const Point u = {by[0], by[1], by[2]}, v = {q[0], q[1], q[2]};
    const Point w = by[3] * v + q[3] * u + cross(u, v);
    q = {w[0], w[1], w[2], by[3] * q[3] - u[0] * v[0] - u[1] * v[1] - u[2] * v[2]};
  }
  return q;
}

as_in_ros::Transform transform(const Point& at, const std::array<double, 4>& q) {
  return {{at[0], at[1], at[2]}, {q[0], q[1], q[2], q[3]}};
}

}  // namespace

int main() {
  const Crowd crowd = crowd_of(1, false);
  const double xyz[3] = {.1, -.05, .2}, rpy[3] = {.4, -1.1, 2.3}, size[3] = {.2, .3, .5};
  std::vector<cab::Leaf> leaves(kLinks);
  for (std::uint32_t l = 0; l < kLinks; ++l) leaves[l].link = l, leaves[l].box = as_in_ros::box_of(xyz, rpy, size);

  std::vector<float> poses, orientations;
  std::vector<double> origins;
  for (std::uint32_t i = 0; i < kCharacters; ++i) {
    as_in_ros::append_place(transform(crowd.places[i].translation, crowd.places[i].rotation), &origins, &orientations);
    for (std::uint32_t l = 0; l < kLinks; ++l)
      as_in_ros::append_pose(transform(crowd.in_character(i, l, {0, 0, 0}), rotation_of(crowd, i, l)), &poses);
  }
  World world(leaves);
  cab::BatchInput input;
  input.batch = world.batch();
  input.poses.data = poses.data();
  input.origins = origins;
  input.orientations = orientations;

  const auto posed = [&](std::uint32_t i, std::uint32_t link, const Point& p) {
    return rotated(crowd.places[i].rotation, crowd.in_character(i, link, p));
  };
  const std::vector<cab::Hit> hits = world.hits(input);
  bool right = line("transforms", world.error(input, posed), hits.size(), true);

  std::vector<float> rows;  // where axes and origin go, as columns of a matrix that is stored by rows
  for (std::uint32_t i = 0; i < kCharacters; ++i)
    for (std::uint32_t l = 0; l < kLinks; ++l) {
      const Point origin = crowd.in_character(i, l, {0, 0, 0});
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          Point unit_point{};
          unit_point[axis] = 1;
          rows.push_back(static_cast<float>(crowd.in_character(i, l, unit_point)[row] - origin[row]));
        }
        rows.push_back(static_cast<float>(origin[row]));
      }
      rows.insert(rows.end(), {0, 0, 0, 1});
    }
  cab::BatchInput by_rows = input;
  by_rows.poses = as_in_ros::poses_of_rows(rows.data());
  right &= line("matrices by rows", world.error(by_rows, posed), hits.size(), same(world.hits(by_rows), hits));

  // The box of URDF by its own words: corners of its size, rolled, pitched, yawed, moved.
  double off = 0;
  for (const Point& corner : corners_of(leaves[0].box)) {
    double nearest = HUGE_VAL;
    for (unsigned c = 0; c < 8; ++c) {
      Point p = {(c & 1 ? .5 : -.5) * size[0], (c & 2 ? .5 : -.5) * size[1], (c & 4 ? .5 : -.5) * size[2]};
      for (std::size_t axis = 0; axis < 3; ++axis) p = turned(axis, rpy[axis], p);
      const Point d = corner + -1. * (p + Point{xyz[0], xyz[1], xyz[2]});
      nearest = std::fmin(nearest, std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
    }
    off = std::fmax(off, nearest);
  }
  std::printf("a box of URDF: corners off by %.1e\n", off);
  return right && off < kTolerance ? 0 : 1;
}
