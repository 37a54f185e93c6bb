// The two colliding chains of the paper's Tables 1 to 3. Their motion is a closed formula without state, computed in
// double.
#include "scenes/paper/chains.h"

#include "scenes/paper/dented_link.h"
#include "scenes/paper/paper_motion.h"
#include "scenes/paper/superellipsoid.h"

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace cab::scenes {
namespace {

constexpr std::uint32_t kLinkCount = 8;
constexpr double kExponent = .75;  // of the superellipsoids

// The shape of a link and the motion of the chains in one table. A search that fitted the paper's counts found the
// numbers of the motion, because the paper gives the links but not the motion.
struct Table {
  const char* name;
  Vec3 half;  // of a link's leaf box
  bool is_dented;
  double d0, d1;  // distance between the bases
  double ac, ar;  // amplitudes of the bending that both chains share, and of the opposite bending
  double tilt;    // of the whole scene, rad
  double lag;     // phase from link to link
  double ao;      // amplitude of the sideways opposite bending
  double shift;   // of the bases along the chains and sideways
};
constexpr std::array<Table, 3> kTables = {{
    {"chains3", {1.5, .5, .5}, false, 2.223, .229, .022, .146, .868, .872, .106, .006},
    {"chains6", {3, .5, .5}, false, 1.459, 0, .097, .036, .706, 1.130, .140, .327},
    {"dented", kDentedHalf, true, 1.459, 0, .097, .036, .706, 1.130, .140, .327},
}};

Vec3 about_x(const Vec3& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {v[0], c * v[1] - s * v[2], s * v[1] + c * v[2]};
}

Vec3 about_y(const Vec3& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * v[0] + s * v[2], v[1], c * v[2] - s * v[0]};
}

// Writes the 3x4 poses of the links of one chain at time t. side is -1 or +1.
void append_poses(const Table& p, double side, double t, std::vector<float>& poses) {
  const double link_length = 2 * p.half[0];
  const double distance = p.d0 + p.d1 * std::sin(.61 * t);
  Vec3 base = {side * distance / 2, side * p.shift / 2 * std::sin(.29 * t), side * p.shift * link_length / 2};
  for (std::uint32_t i = 0; i < kLinkCount; ++i) {
    const double phase = p.lag * i;
    const double a = p.ac * std::sin(1.13 * t + phase) + side * p.ar * std::sin(.83 * t + 1.7 * phase + .6);
    const double b = .8 * p.ac * std::sin(.71 * t + .8 * phase + 1.1) + side * p.ao * std::sin(1.37 * t + 1.3 * phase);
    std::array<Vec3, 3> frame = {{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}};
    for (Vec3& axis : frame) axis = about_x(about_y(axis, a), b);
    append_pose(tilted({base + (link_length / 2) * frame[0], frame}, p.tilt), poses);
    base = base + link_length * frame[0];
  }
}

std::vector<ShapePart> link_parts(const Table& table) {
  std::vector<ShapePart> parts;
  if (table.is_dented) {
    for (std::vector<float>& piece : dented_link_pieces()) parts.push_back(hull_part(std::move(piece)));
  } else {
    parts.push_back(hull_part(superellipsoid(table.half[0], table.half[1], table.half[2], kExponent)));
  }
  return parts;
}

Character make_chain(const Table& table, double side, std::uint32_t frame_count) {
  Character chain;
  chain.name = side < 0 ? "chain -" : "chain +";
  chain.pose_format = PoseFormat::kMatrix3x4Rows;
  const std::vector<ShapePart> parts = link_parts(table);
  for (std::uint32_t i = 0; i < kLinkCount; ++i) {
    add_link(chain, "link " + std::to_string(i), static_cast<std::int32_t>(i) - 1, table.half);
    chain.leaves.back().parts = parts;
  }
  chain.poses.reserve(std::size_t{frame_count} * kLinkCount * pose_floats(chain.pose_format));
  for (std::uint32_t f = 0; f < frame_count; ++f) append_poses(table, side, f / kFramesPerSecond, chain.poses);
  return chain;
}

}  // namespace

Scene make_chains(std::uint32_t table, std::uint32_t frame_count) {
  if (table < 1 || table > kTables.size())
    throw std::invalid_argument("make_chains: tables 1 to 3 are chains, " + std::to_string(table) + " is not");
  const Table& parameters = kTables[table - 1];
  Scene scene;
  scene.name = parameters.name;
  scene.frame_seconds = 1 / kFramesPerSecond;
  scene.frame_count = frame_count;
  for (const double side : {-1.0, 1.0}) scene.characters.push_back(make_chain(parameters, side, frame_count));
  scene.pairs = {{0, 1}};
  return scene;
}

}  // namespace cab::scenes
