// The two colliding chains of the paper's Tables 1 and 2: closed-form motion, no state, computed in double.
#include "scenes/chains.h"

#include "scenes/superellipsoid.h"
#include "scenes/vec3d.h"

#include <stdexcept>

namespace cab::scenes {
namespace {

constexpr std::uint32_t kLinkCount = 8;
constexpr double kFramesPerSecond = 60;

// One table: what a link looks like and how the chains move. The numbers were found by a search that fitted the
// counts of the paper, which gives the links but not the motion.
struct Table {
  double half_length;  // of a link; thickness is 1
  double exponent;     // of the superellipsoid
  double d0, d1;       // distance of the bases
  double ac, ar;       // amplitudes of bending: common to both chains, and opposite
  double tilt;         // of the whole scene about (1, 2, .5)
  double lag;          // phase from link to link
  double ao;           // amplitude of the sideways opposite bending
  double shift;        // of the bases along the chains and sideways
};
constexpr double kHalfThickness = .5;
constexpr Table kTable1 = {1.5, .75, 2.223, .229, .022, .146, .868, .872, .106, .006};
constexpr Table kTable2 = {3, .75, 1.459, 0, .097, .036, .706, 1.130, .140, .327};

Vec3 about_x(const Vec3& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {v[0], c * v[1] - s * v[2], s * v[1] + c * v[2]};
}

Vec3 about_y(const Vec3& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * v[0] + s * v[2], v[1], c * v[2] - s * v[0]};
}

// v turned about a unit axis (Rodrigues).
Vec3 about(const Vec3& axis, const Vec3& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return c * v + s * cross(axis, v) + ((1 - c) * dot(axis, v)) * axis;
}

// Writes the 3x4 poses of one chain's links at time t; side is -1 or +1.
void append_poses(const Table& p, double side, double t, std::vector<float>& poses) {
  const Vec3 unscaled = {1, 2, .5};
  const Vec3 tilt_axis = (1 / length(unscaled)) * unscaled;
  const double link_length = 2 * p.half_length;
  const double distance = p.d0 + p.d1 * std::sin(.61 * t);
  Vec3 base = {side * distance / 2, side * p.shift / 2 * std::sin(.29 * t), side * p.shift * link_length / 2};
  for (std::uint32_t i = 0; i < kLinkCount; ++i) {
    const double phase = p.lag * i;
    const double a = p.ac * std::sin(1.13 * t + phase) + side * p.ar * std::sin(.83 * t + 1.7 * phase + .6);
    const double b = .8 * p.ac * std::sin(.71 * t + .8 * phase + 1.1) + side * p.ao * std::sin(1.37 * t + 1.3 * phase);
    std::array<Vec3, 3> frame = {{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}};
    for (Vec3& axis : frame) axis = about_x(about_y(axis, a), b);
    const Vec3 center = about(tilt_axis, base + (link_length / 2) * frame[0], p.tilt);
    base = base + link_length * frame[0];
    for (Vec3& axis : frame) axis = about(tilt_axis, axis, p.tilt);
    for (std::size_t row = 0; row < 3; ++row) {
      for (const Vec3& axis : frame) poses.push_back(static_cast<float>(axis[row]));
      poses.push_back(static_cast<float>(center[row]));
    }
  }
}

Character make_chain(const Table& table, double side, std::uint32_t frame_count) {
  Character chain;
  chain.name = side < 0 ? "chain -" : "chain +";
  chain.pose_format = PoseFormat::kMatrix3x4;
  const std::vector<float> vertices = superellipsoid(table.half_length, kHalfThickness, kHalfThickness, table.exponent);
  for (std::uint32_t i = 0; i < kLinkCount; ++i) {
    chain.link_names.push_back("link " + std::to_string(i));
    chain.link_parents.push_back(static_cast<std::int32_t>(i) - 1);
    chain.link_joints.insert(chain.link_joints.end(), {static_cast<float>(-table.half_length), 0.0f, 0.0f});
    BodyLeaf leaf;
    leaf.link = i;
    leaf.box.half[0] = static_cast<float>(table.half_length);
    leaf.box.half[1] = leaf.box.half[2] = static_cast<float>(kHalfThickness);
    for (int k = 0; k < 3; ++k) leaf.box.axis[k][k] = 1;
    leaf.parts.emplace_back();
    leaf.parts.back().shape.kind = ShapeKind::kConvexHull;
    leaf.parts.back().vertices = vertices;
    chain.leaves.push_back(std::move(leaf));
  }
  chain.poses.reserve(std::size_t{frame_count} * kLinkCount * pose_floats(chain.pose_format));
  for (std::uint32_t f = 0; f < frame_count; ++f) append_poses(table, side, f / kFramesPerSecond, chain.poses);
  return chain;
}

}  // namespace

Scene make_chains(std::uint32_t table, std::uint32_t frame_count) {
  if (table != 1 && table != 2)
    throw std::invalid_argument("make_chains: tables 1 and 2 are chains, " + std::to_string(table) + " is not");
  const Table& parameters = table == 1 ? kTable1 : kTable2;
  Scene scene;
  scene.name = "table " + std::to_string(table);
  scene.frame_seconds = 1 / kFramesPerSecond;
  scene.frame_count = frame_count;
  for (const double side : {-1.0, 1.0}) scene.characters.push_back(make_chain(parameters, side, frame_count));
  return scene;
}

}  // namespace cab::scenes
