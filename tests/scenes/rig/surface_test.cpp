// Surfaces of skins as leaves of triangles: on made tubes and boxes, and on the models of the shared data, whose
// vertices the test puts where the file says.
#include <cab/cab.h>
#include <cab/skin.h>

#include "scenes/import/import.h"
#include "scenes/import/skin_clip.h"
#include "scenes/random.h"

#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

namespace {

using namespace cab;
using namespace cab::rig;
using scenes::Vec3;
using scenes::operator+, scenes::operator-, scenes::operator*, scenes::dot, scenes::length;

// How far out of its box a vertex may be, in its numbers: the axes of boxes are floats. Worst measured 0.
constexpr double kAxisTolerance = 1e-6;
// How far a made vertex may be from its place, in floats of about 10. Worst measured 9.6e-7.
constexpr double kPlaceTolerance = 4e-6;

std::vector<float> shift(float x, float y, float z, float scale = 1) {
  return {scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, x, y, z, 1};
}

void append(std::vector<float>& to, const std::vector<float>& from) { to.insert(to.end(), from.begin(), from.end()); }

// A skin that owns its arrays.
struct MadeSkin {
  std::vector<std::int32_t> parents;
  std::vector<float> poses, vertices, weights, inverse_bind;
  std::vector<std::uint32_t> triangles, bones, bone_joints;
  std::uint32_t influence_count = 1;

  Skin skin() const {
    Skin skin;
    skin.joint_parents = parents;
    skin.poses = poses;
    skin.vertices = vertices;
    skin.triangles = triangles;
    skin.influence_count = influence_count;
    skin.influence_bones = bones;
    skin.influence_weights = weights;
    skin.inverse_bind = inverse_bind;
    skin.bone_joints = bone_joints;
    return skin;
  }
};

// A closed tube about z with a joint at every unit, of 16 vertices a ring and 8 rings a unit. Weights go from one joint
// to the next. Its first pose is straight; in the others all joints bend about x.
MadeSkin tube(std::uint32_t joints, std::uint32_t poses) {
  constexpr std::uint32_t kAround = 16, kRings = 8;
  MadeSkin made;
  made.influence_count = 2;
  for (std::uint32_t j = 0; j < joints; ++j) {
    made.parents.push_back(static_cast<std::int32_t>(j) - 1);
    made.bone_joints.push_back(j);
    append(made.inverse_bind, shift(0, 0, -static_cast<float>(j)));
  }
  for (std::uint32_t p = 0; p < poses; ++p) {
    double angle = 0, y = 0, z = 0;
    for (std::uint32_t j = 0; j < joints; ++j) {
      const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
      append(made.poses, {1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, 0, static_cast<float>(y), static_cast<float>(z), 1});
      y -= std::sin(angle);
      z += std::cos(angle);
      angle += .8 * p / poses;
    }
  }
  const std::uint32_t rings = kRings * joints + 1;
  for (std::uint32_t r = 0; r < rings; ++r) {
    const float z = static_cast<float>(r) / kRings;
    const std::uint32_t joint = std::min(r / kRings, joints - 1), next = std::min(joint + 1, joints - 1);
    const float share = joint == next ? 0 : z - static_cast<float>(joint);
    for (std::uint32_t a = 0; a < kAround; ++a) {
      const double angle = 2 * std::acos(-1.0) * a / kAround;
      append(made.vertices, {.3f * static_cast<float>(std::cos(angle)), .3f * static_cast<float>(std::sin(angle)), z});
      made.bones.insert(made.bones.end(), {joint, next});
      append(made.weights, {1 - share, share});
    }
  }
  for (std::uint32_t r = 0; r + 1 < rings; ++r)
    for (std::uint32_t a = 0; a < kAround; ++a) {
      const std::uint32_t low = kAround * r + a, side = kAround * r + (a + 1) % kAround;
      made.triangles.insert(made.triangles.end(), {low, side, low + kAround, side, side + kAround, low + kAround});
    }
  for (const std::uint32_t ring : {0u, rings - 1})
    for (std::uint32_t a = 1; a + 1 < kAround; ++a)
      made.triangles.insert(made.triangles.end(), {kAround * ring, kAround * ring + a, kAround * ring + a + 1});
  return made;
}

// A box 2 x 2 x 2 about the origin for a new bone of a joint.
void add_box(MadeSkin& made, std::uint32_t joint, const std::vector<float>& bind) {
  const auto first = static_cast<std::uint32_t>(made.vertices.size() / 3);
  const auto bone = static_cast<std::uint32_t>(made.bone_joints.size());
  made.bone_joints.push_back(joint);
  append(made.inverse_bind, bind);
  for (int c = 0; c < 8; ++c) {
    append(made.vertices, {c & 1 ? 1.0f : -1.0f, c & 2 ? 1.0f : -1.0f, c & 4 ? 1.0f : -1.0f});
    for (std::uint32_t i = 0; i < made.influence_count; ++i) {
      made.bones.push_back(bone);
      made.weights.push_back(i == 0);
    }
  }
  for (const int corner :
       {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5})
    made.triangles.push_back(first + static_cast<std::uint32_t>(corner));
}

struct MadeSurface {
  SkinBodies bodies;
  SurfaceInfo info;
};

MadeSurface surface_of(const MadeSkin& made, const SurfaceRules& rules = {}) {
  MadeSurface out;
  REQUIRE(surface_from_skin(made.skin(), rules, &out.bodies, &out.info) == SkinStatus::kOk);
  return out;
}

Vec3 wide(const float* v) { return {v[0], v[1], v[2]}; }

// The point that a matrix of floats by columns takes another to.
Vec3 moved(const float* m, const Vec3& p) {
  return p[0] * wide(m) + p[1] * wide(m + 4) + p[2] * wide(m + 8) + wide(m + 12);
}

// Where a vertex of a skin is in a pose of its joints.
Vec3 given_place(const Skin& skin, std::size_t pose, std::size_t v) {
  Vec3 at = {0, 0, 0};
  double sum = 0;
  for (std::size_t i = v * skin.influence_count; i < (v + 1) * skin.influence_count; ++i) {
    const auto weight = static_cast<double>(skin.influence_weights[i]);
    if (weight == 0) continue;
    const std::uint32_t bone = skin.influence_bones[i];
    const float* const joint = skin.poses.data + 16 * (pose * skin.joint_parents.size + skin.bone_joints[bone]);
    at =
        at + weight * moved(joint, moved(skin.inverse_bind.data + 16 * std::size_t{bone}, wide(&skin.vertices[3 * v])));
    sum += weight;
  }
  return (1 / sum) * at;
}

// Where a vertex of an articulation is, by poses of its links.
Vec3 place_of(const SkinDesc& skin, const float* poses, std::size_t v) {
  Vec3 at = {0, 0, 0};
  double sum = 0;
  for (std::size_t i = v * skin.influence_count; i < (v + 1) * skin.influence_count; ++i) {
    const auto weight = static_cast<double>(skin.influence_weights[i]);
    const float* const pose = poses + 7 * skin.influence_links[i];
    const scenes::Quat q = scenes::normalized({pose[0], pose[1], pose[2], pose[3]});
    const Vec3 in_link =
        moved(skin.inverse_bind.data + 16 * std::size_t{skin.influence_links[i]}, wide(&skin.vertices[3 * v]));
    at = at + weight * (wide(pose + 4) + scenes::rotate(q, in_link));
    sum += weight;
  }
  return (1 / sum) * at;
}

// By how much a point is out of a box at most, along its axes; 0 or less if it is in the box.
double outside(const Box& box, const Vec3& p) {
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k)
    most = std::max(most, std::fabs(dot(wide(box.axis[k]), p - wide(box.center))) - static_cast<double>(box.half[k]));
  return most;
}

using Corners = std::array<Vec3, 3>;

// The triangles of a skin's first pose, and those of an articulation's leaves there, each sorted.
std::vector<Corners> sorted(std::vector<Corners> triangles) {
  for (Corners& corners : triangles) {
    for (Vec3& corner : corners)
      for (double& x : corner) x = std::round(1e4 * x);
    std::sort(corners.begin(), corners.end());
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

// Checks that the leaves of a surface have all of a skin's triangles once, in the first pose, and that boxes hold them
// in all of the skin's poses. Returns how many vertices of leaves were looked at.
std::size_t check_surface(const Skin& skin, const SkinBodies& bodies, const SurfaceInfo& info) {
  const ArticulationDesc desc = bodies.desc();
  const std::size_t joints = skin.joint_parents.size, links = desc.link_parents.size,
                    frames = skin.poses.size / 16 / joints;
  std::vector<float> poses(7 * links * frames);
  for (std::size_t f = 0; f < frames; ++f)
    REQUIRE(link_poses(bodies, {skin.poses.data + 16 * joints * f, 16 * joints},
                       {poses.data() + 7 * links * f, 7 * links}) == SkinStatus::kOk);

  std::vector<Corners> given, found;
  for (std::size_t t = 0; t < skin.triangles.size; t += 3)
    given.push_back({given_place(skin, 0, skin.triangles[t]), given_place(skin, 0, skin.triangles[t + 1]),
                     given_place(skin, 0, skin.triangles[t + 2])});
  for (const Leaf& leaf : desc.leaves)
    for (std::size_t t = 0; t < leaf.triangles.size; t += 3)
      found.push_back({place_of(desc.skin, poses.data(), leaf.triangles[t]),
                       place_of(desc.skin, poses.data(), leaf.triangles[t + 1]),
                       place_of(desc.skin, poses.data(), leaf.triangles[t + 2])});
  CHECK(found.size() == info.triangle_count);
  CHECK(found.size() + info.left_out_count == given.size());
  if (info.left_out_count == 0) CHECK((sorted(found) == sorted(given)));

  Engine* engine = nullptr;
  REQUIRE(create_engine({}, &engine) == Status::kOk);
  BatchDesc batch;
  BatchInput input;
  ArticulationInfo made;
  std::uint32_t bad = 0;
  REQUIRE(add_articulation(*engine, desc, &batch.articulation, &bad) == Status::kOk);
  REQUIRE(articulation_info(*engine, batch.articulation, &made) == Status::kOk);
  batch.instance_count = static_cast<std::uint32_t>(frames);
  REQUIRE(add_batch(*engine, batch, &input.batch) == Status::kOk);
  input.poses.data = poses.data();
  std::vector<Box> boxes(frames * made.node_count);
  REQUIRE(compute_boxes(*engine, input, {}, boxes) == Status::kOk);
  destroy_engine(engine);
  std::size_t checked = 0;
  double worst = 0;
  for (std::size_t f = 0; f < frames; ++f) {
    const Box* const of_frame = boxes.data() + f * made.node_count;
    for (std::size_t leaf = 0; leaf < desc.leaves.size; ++leaf)
      for (const std::uint32_t v : desc.leaves[leaf].triangles) {
        const Vec3 at = place_of(desc.skin, poses.data() + 7 * links * f, v);
        worst = std::max(worst, outside(of_frame[leaf], at) / (1 + length(at)));
        ++checked;
      }
    // And the vertices where the file has them: in some leaf.
    for (const std::uint32_t v : skin.triangles) {
      const Vec3 at = given_place(skin, f, v);
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t leaf = 0; leaf < desc.leaves.size && least > 0; ++leaf)
        least = std::min(least, outside(of_frame[leaf], at));
      if (info.left_out_count == 0) REQUIRE(least <= info.worst_distance + kAxisTolerance * (1 + length(at)));
    }
  }
  CHECK(worst <= kAxisTolerance);
  return checked;
}

}  // namespace

TEST_CASE("a surface has every triangle of its skin in one leaf, whose box holds it in every pose") {
  for (const std::uint32_t joints : {1u, 2u, 5u}) {
    CAPTURE(joints);
    const MadeSkin made = tube(joints, 7);
    const auto [bodies, info] = surface_of(made);
    CHECK(info.left_out_count == 0);
    CHECK(info.welded_count == 0);
    CHECK(info.vertex_count == made.vertices.size() / 3);
    CHECK(info.most_triangles <= 128);
    CHECK(info.part_count == 1);
    CHECK(info.open_part_count == 0);
    CHECK(info.open_edge_count == 0);
    CHECK(info.worst_distance <= kPlaceTolerance);
    CHECK(info.most_influences == std::min(joints, 2u));
    CHECK(info.growth >= 1);
    // Without the other links, a leaf's box is straight about its part of the tube.
    for (const Leaf& leaf : bodies.desc().leaves)
      for (const std::uint32_t v : leaf.triangles) {
        const Vec3 in_link =
            wide(&bodies.desc().skin.vertices[3 * std::size_t{v}]) - Vec3{0, 0, static_cast<double>(leaf.link)};
        CHECK(outside(leaf.box, in_link) <= kPlaceTolerance);
      }
    check_surface(made.skin(), bodies, info);
    for (std::size_t j = 1; j < joints; ++j) CHECK(bodies.desc().ignored_pairs.size >= joints - 1);
  }
}

TEST_CASE("leaves are cut where the surface bends, down to the least and up to the most that the rules allow") {
  const MadeSkin made = tube(5, 7);
  SurfaceRules whole;
  whole.most_triangles = 1u << 20;
  whole.most_growth = std::numeric_limits<float>::infinity();
  const MadeSurface one = surface_of(made, whole);
  CHECK(one.bodies.desc().leaves.size == 5);
  SurfaceRules rules = whole;
  rules.most_growth = 1.1f;
  rules.least_triangles = 4;
  const MadeSurface cut = surface_of(made, rules);
  CHECK(cut.bodies.desc().leaves.size > 5);
  CHECK(cut.info.growth < one.info.growth);
  for (const Leaf& leaf : cut.bodies.desc().leaves) CHECK(leaf.triangles.size / 3 >= 4);
  rules.max_leaves = 7;
  CHECK(surface_of(made, rules).bodies.desc().leaves.size == 7);
  // Leaves hold more triangles where there would be too many leaves.
  SurfaceRules small = whole;
  small.most_triangles = 3;
  const std::size_t many = surface_of(made, small).bodies.desc().leaves.size;
  small.max_leaves = 12;
  REQUIRE(many > 24);
  const MadeSurface fitted = surface_of(made, small);
  CHECK(fitted.bodies.desc().leaves.size <= 12);
  CHECK(fitted.bodies.desc().leaves.size > 5);
  CHECK(fitted.info.most_triangles > 6);
  CHECK(fitted.info.triangle_count == one.info.triangle_count);
  rules.max_leaves = 4;
  SkinBodies none;
  CHECK(surface_from_skin(made.skin(), rules, &none) == SkinStatus::kTooManyLeaves);
  CHECK(none.desc().leaves.empty());

  // One pose says nothing about bending, so the skin is bent.
  rules.max_leaves = kMaxLeaves;
  MadeSkin still = made;
  still.poses.resize(16 * 5);
  CHECK(surface_of(still, rules).bodies.desc().leaves.size > 5);
}

TEST_CASE("vertices of equal place and weights are welded, and triangles that have no area then are left out") {
  MadeSkin made = tube(2, 3);
  const MadeSurface plain = surface_of(made);
  // The same vertices for each triangle alone.
  MadeSkin loose = made;
  loose.vertices.clear(), loose.bones.clear(), loose.weights.clear();
  for (std::uint32_t& v : loose.triangles) {
    append(loose.vertices, {made.vertices[3 * v], made.vertices[3 * v + 1], made.vertices[3 * v + 2]});
    // A seam in the other order, with weights that do not add to 1.
    loose.bones.insert(loose.bones.end(), {made.bones[2 * v + 1], made.bones[2 * v]});
    append(loose.weights, {.5f * made.weights[2 * v + 1], .5f * made.weights[2 * v]});
    v = static_cast<std::uint32_t>(loose.vertices.size() / 3 - 1);
  }
  const MadeSurface seams = surface_of(loose);
  CHECK(seams.info.vertex_count == plain.info.vertex_count);
  CHECK(seams.info.welded_count == loose.triangles.size() - plain.info.vertex_count);
  CHECK(seams.info.open_edge_count == 0);
  CHECK(seams.bodies.desc().leaves.size == plain.bodies.desc().leaves.size);
  check_surface(loose.skin(), seams.bodies, seams.info);

  // A corner without weight, two equal corners, and a hole.
  MadeSkin spoilt = made;
  std::fill_n(spoilt.weights.begin(), 2, 0.0f);
  spoilt.triangles.insert(spoilt.triangles.end(), {40, 41, 41});
  const auto has_first = std::count(made.triangles.begin(), made.triangles.end(), 0u);
  const MadeSurface holes = surface_of(spoilt);
  CHECK(holes.info.left_out_count == has_first + 1);
  CHECK(holes.info.part_count == 1);
  CHECK(holes.info.open_part_count == 1);
  CHECK(holes.info.open_edge_count > 0);
}

TEST_CASE("meshes with other inverse bind matrices are moved to one space, or refused with their bone") {
  MadeSkin made = tube(3, 4);
  add_box(made, 1, shift(.5f, 0, 0));     // a rigid mesh on a joint of the tube, from its own space
  add_box(made, 2, shift(0, 2, 0, .5f));  // with a scale
  const MadeSurface moved_boxes = surface_of(made);
  CHECK(moved_boxes.info.part_count == 3);
  CHECK(moved_boxes.info.worst_distance <= kPlaceTolerance);
  check_surface(made.skin(), moved_boxes.bodies, moved_boxes.info);

  // The same tube twice: the second one from a space that is twice as large.
  MadeSkin twice = tube(3, 4);
  const MadeSkin one = twice;
  const auto first = static_cast<std::uint32_t>(one.vertices.size() / 3);
  for (const float x : one.vertices) twice.vertices.push_back(2 * x);
  for (std::uint32_t j = 0; j < 3; ++j) {
    twice.bone_joints.push_back(j);
    append(twice.inverse_bind, shift(0, 0, -static_cast<float>(j), .5f));
  }
  append(twice.weights, one.weights);
  for (const std::uint32_t bone : one.bones) twice.bones.push_back(bone + 3);
  for (const std::uint32_t v : one.triangles) twice.triangles.push_back(v + first);
  const MadeSurface both = surface_of(twice);
  CHECK(both.info.welded_count == first);
  CHECK(both.info.worst_distance <= kPlaceTolerance);
  check_surface(twice.skin(), both.bodies, both.info);

  std::uint32_t bad = 99;
  SkinBodies none;
  MadeSkin other = twice;
  other.inverse_bind[16 * 5 + 12] += 1;  // the last joint alone
  CHECK(surface_from_skin(other.skin(), {}, &none, nullptr, &bad) == SkinStatus::kBindsDiffer);
  CHECK(bad == 5);
  other = twice;
  for (int k = 0; k < 12; ++k) other.inverse_bind[16 * 4 + static_cast<std::size_t>(k)] = 0;
  CHECK(surface_from_skin(other.skin(), {}, &none, nullptr, &bad) == SkinStatus::kNoInverse);
  CHECK(bad == 4);
}

TEST_CASE("scale of joints is that of the first pose, and what another scale does to the surface is told") {
  MadeSkin made = tube(2, 1);
  for (const int k : {0, 5, 10}) made.poses[static_cast<std::size_t>(16 + k)] = 2;  // twice as wide, always
  const std::vector<float> rest = made.poses;
  append(made.poses, rest);
  const MadeSurface constant = surface_of(made);
  CHECK(constant.info.worst_distance <= kPlaceTolerance);
  check_surface(made.skin(), constant.bodies, constant.info);
  made.poses[made.poses.size() - 16 + 10] = 3;  // longer in the second pose: the end by 1
  const MadeSurface longer = surface_of(made);
  CHECK(longer.info.worst_distance == doctest::Approx(1).epsilon(1e-6));
  CHECK(longer.info.worst_pose == 1);
}

TEST_CASE("leaves that too many links move are cut further, and a triangle that they move is refused") {
  // A strip in which every corner is moved by eight joints of forty.
  MadeSkin made;
  made.influence_count = 8;
  for (std::uint32_t j = 0; j < 40; ++j) {
    made.parents.push_back(static_cast<std::int32_t>(j) - 1);
    made.bone_joints.push_back(j);
    append(made.inverse_bind, shift(0, 0, 0));
    append(made.poses, shift(0, 0, 0));
  }
  for (std::uint32_t v = 0; v < 60; ++v) {
    append(made.vertices, {static_cast<float>(v), static_cast<float>(v % 2), 0});
    for (std::uint32_t i = 0; i < 8; ++i) {
      made.bones.push_back((v / 2 + i) % 40);
      made.weights.push_back(i == 0 ? .3f : .1f);
    }
    if (v >= 2) made.triangles.insert(made.triangles.end(), {v - 2, v - 1, v});
  }
  const MadeSurface cut = surface_of(made);
  CHECK(cut.info.most_influences <= 33);
  CHECK(cut.info.most_influences > 8);
  check_surface(made.skin(), cut.bodies, cut.info);
  MadeSkin wild = made;
  wild.influence_count = 40;
  wild.bones.clear(), wild.weights.clear();
  for (std::uint32_t v = 0; v < 60; ++v)
    for (std::uint32_t i = 0; i < 40; ++i) wild.bones.push_back(i), wild.weights.push_back(1);
  SkinBodies none;
  CHECK(surface_from_skin(wild.skin(), {}, &none) == SkinStatus::kTooManyInfluences);
}

TEST_CASE("surface_from_skin refuses a bad skin and bad rules, and leaves its output as it was") {
  const MadeSkin made = tube(2, 2);
  SkinBodies bodies;
  std::uint32_t bad = 7;
  SurfaceInfo info;
  const auto status = [&](auto change) {
    MadeSkin other = made;
    change(other);
    return surface_from_skin(other.skin(), {}, &bodies, &info, &bad);
  };
  CHECK(surface_from_skin(made.skin(), {}, nullptr) == SkinStatus::kBadOutput);
  CHECK(status([](MadeSkin& s) { s.triangles.clear(); }) == SkinStatus::kBadTriangles);
  CHECK(status([](MadeSkin& s) { s.triangles[0] = 9999; }) == SkinStatus::kBadTriangles);
  CHECK(status([](MadeSkin& s) { s.weights[0] = -1; }) == SkinStatus::kBadInfluences);
  CHECK(status([](MadeSkin& s) { std::fill(s.weights.begin(), s.weights.end(), 0.0f); }) == SkinStatus::kNoBodies);
  CHECK(status([](MadeSkin& s) { s.triangles.assign({0, 0, 1, 2, 2, 2}); }) == SkinStatus::kNoBodies);
  CHECK(status([](MadeSkin& s) { s.parents[1] = 1; }) == SkinStatus::kBadJoints);
  CHECK(status([](MadeSkin& s) { s.poses.pop_back(); }) == SkinStatus::kBadPoses);
  CHECK(status([](MadeSkin& s) { s.inverse_bind.pop_back(); }) == SkinStatus::kBadBones);
  CHECK(status([](MadeSkin& s) {
          for (float& x : s.vertices) x *= 1e19f;
        }) == SkinStatus::kBadVertices);
  const auto with = [&](auto change) {
    SurfaceRules rules;
    change(rules);
    return surface_from_skin(made.skin(), rules, &bodies);
  };
  CHECK(with([](SurfaceRules& r) { r.most_triangles = 0; }) == SkinStatus::kBadRules);
  CHECK(with([](SurfaceRules& r) { r.least_triangles = 0; }) == SkinStatus::kBadRules);
  CHECK(with([](SurfaceRules& r) { r.max_leaves = 0; }) == SkinStatus::kBadRules);
  CHECK(with([](SurfaceRules& r) { r.max_leaves = kMaxLeaves + 1; }) == SkinStatus::kBadRules);
  CHECK(with([](SurfaceRules& r) { r.most_growth = .9f; }) == SkinStatus::kBadRules);
  CHECK(with([](SurfaceRules& r) { r.most_growth = std::nanf(""); }) == SkinStatus::kBadRules);
  CHECK(bodies.desc().leaves.empty());
  CHECK(info.triangle_count == 0);
  CHECK(bad == 7);
  const MadeSurface good = surface_of(made);
  Coverage coverage;
  CHECK(measure_coverage(made.skin(), good.bodies, &coverage) == SkinStatus::kBadBodies);
}

TEST_CASE("the models' surfaces are whole, and in boxes in all frames") {
  const char* const dir = std::getenv("CAB_DATA_DIR");
  if (dir == nullptr || !std::filesystem::exists(std::string(dir) + "/gltf")) {
    MESSAGE("skipped: CAB_DATA_DIR is not set or has no folder gltf");
    return;
  }
  for (const char* name :
       {"cesium_man.gltf", "greenman.glb", "generic-hand-left.glb", "generic-hand-right.glb", "robot.glb"}) {
    CAPTURE(name);
    scenes::ImportOptions options;
    options.skin.emplace();
    const scenes::Skeleton skeleton = scenes::import_skeleton(std::string(dir) + "/gltf/" + name, options);
    std::vector<float> matrices;
    const Skin skin = scenes::skin_of(skeleton, matrices);
    MadeSurface made;
    REQUIRE(surface_from_skin(skin, {}, &made.bodies, &made.info) == SkinStatus::kOk);
    CHECK(made.info.most_triangles <= 128);
    CHECK(made.info.worst_distance < 1e-5);
    CHECK(check_surface(skin, made.bodies, made.info) > 1000);
    MESSAGE(std::string(name) << ": " << made.bodies.desc().leaves.size << " leaves, growth " << made.info.growth);
  }
}
