// The braided chains of the paper's Table 4. Two helices share one axis; nodes lie on them, and links are the chords
// between nodes.
#include "scenes/paper/braid.h"

#include "scenes/paper/paper_motion.h"
#include "scenes/paper/superellipsoid.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace cab::scenes {
namespace {

constexpr std::uint32_t kLinkCount = 8;
constexpr double kPi = 3.14159265358979323846;
constexpr Vec3 kHalf = {3, .5, .5};
constexpr double kLinkLength = 2 * kHalf[0];
constexpr double kExponent = .6;  // of the superellipsoid

// A search that fitted the paper's counts found these numbers and the exponent. The paper gives the links but not the
// motion.
constexpr double kRadius = 1.169, kRadiusSwing = .016;  // of the helices
constexpr double kTurn = 1.3, kTurnSwing = .587;        // rad about the axis per link
constexpr double kTilt = .081;                          // of the whole scene
constexpr double kShift = .33;                          // of strand 1 along the axis, in links
constexpr double kWobble = .6;                          // of each strand sideways

// One strand's helix at one time.
struct Helix {
  double radius;
  double turn;    // rad per link
  double height;  // along the axis, per link
  double phase;
  Vec3 offset;

  // The point of the helix after x links, relative to offset.
  Vec3 node(double x) const {
    const double phi = turn * x + phase;
    return {radius * std::cos(phi), radius * std::sin(phi), height * x};
  }
};

Helix helix_at(std::uint32_t strand, double t) {
  Helix helix;
  helix.radius = kRadius + kRadiusSwing * std::sin(.53 * t);
  helix.turn = kTurn + kTurnSwing * std::sin(.37 * t);
  // With this height the chord between two nodes is as long as a link.
  const double across = 2 * helix.radius * std::sin(helix.turn / 2);
  helix.height = std::sqrt(std::max(0.0, kLinkLength * kLinkLength - across * across));
  helix.phase = strand * kPi + .21 * t;
  helix.offset = {kWobble * std::sin(.77 * t + 2.0 * strand), kWobble * std::cos(.59 * t + 1.3 * strand), 0};
  return helix;
}

// The link between two nodes relative to the helix's offset: axis 0 along it, axis 1 away from the helix's axis.
BodyPose link_between(const Vec3& start, const Vec3& end, const Vec3& offset) {
  const Vec3 along = (1 / length(end - start)) * (end - start);
  const Vec3 middle = .5 * (start + end);
  const Vec3 radial = {middle[0], middle[1], 0};
  const Vec3 square = radial - dot(radial, along) * along;
  const Vec3 outward = (1 / length(square)) * square;
  return {middle + offset, {along, outward, cross(along, outward)}};
}

Character make_strand(std::uint32_t strand, std::uint32_t frame_count) {
  Character character;
  character.name = "strand " + std::to_string(strand);
  character.pose_format = PoseFormat::kMatrix3x4Rows;
  const std::vector<float> vertices = superellipsoid(kHalf[0], kHalf[1], kHalf[2], kExponent);
  for (std::uint32_t i = 0; i < kLinkCount; ++i) {
    add_link(character, "link " + std::to_string(i), static_cast<std::int32_t>(i) - 1, kHalf);
    character.leaves.back().parts.push_back(hull_part(vertices));
  }
  character.poses.reserve(std::size_t{frame_count} * kLinkCount * pose_floats(character.pose_format));
  for (std::uint32_t f = 0; f < frame_count; ++f) {
    const Helix helix = helix_at(strand, f / kFramesPerSecond);
    for (std::uint32_t i = 0; i < kLinkCount; ++i) {
      const double x = i + strand * kShift;
      append_pose(tilted(link_between(helix.node(x), helix.node(x + 1), helix.offset), kTilt), character.poses);
    }
  }
  return character;
}

}  // namespace

Scene make_braid(std::uint32_t frame_count) {
  Scene scene;
  scene.name = "braid";
  scene.frame_seconds = 1 / kFramesPerSecond;
  scene.frame_count = frame_count;
  for (const std::uint32_t strand : {0u, 1u}) scene.characters.push_back(make_strand(strand, frame_count));
  scene.pairs = {{0, 1}};
  return scene;
}

}  // namespace cab::scenes
