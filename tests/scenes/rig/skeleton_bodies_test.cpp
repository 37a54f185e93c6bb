// Which segments of a skeleton are bodies, what covers its ends, and the box about the bodies of a link.
#include "scenes/rig/skeleton_bodies.h"

#include "scenes/rig/body_changes.h"
#include "scenes/rig/leaf_box.h"
#include "tests/scenes/rig/stick_figure.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace cab::tests {
namespace {

using namespace cab::scenes;

const SkeletonBody* body_of(const Clip& clip, const Skeleton& s, const std::string& joint, BodyReason reason) {
  for (const SkeletonBody& body : clip.bodies.bodies)
    if (s.joint_names[body.joint] == joint && body.reason == reason) return &body;
  return nullptr;
}

bool has_link(const Clip& clip, const std::string& name) {
  const std::vector<std::string>& names = clip.character.link_names;
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string all_notes(const Clip& clip) {
  std::string text;
  for (const std::string& note : clip.notes) text += note + "\n";
  return text;
}

// The joints and first frame of a skeleton in some more frames, each moved by the function.
template <class Move>
Skeleton with_frames(Skeleton s, std::uint32_t frame_count, Move move) {
  const std::vector<double> positions = s.positions, rotations = s.rotations;
  s.positions.clear();
  s.rotations.clear();
  s.frame_count = frame_count;
  for (std::uint32_t f = 0; f < frame_count; ++f) {
    for (std::size_t j = 0; j < s.joint_names.size(); ++j) {
      const Vec3 place = move(f, j, Vec3{positions[3 * j], positions[3 * j + 1], positions[3 * j + 2]});
      s.positions.insert(s.positions.end(), place.begin(), place.end());
    }
    s.rotations.insert(s.rotations.end(), rotations.begin(), rotations.end());
  }
  return s;
}

// A hand of three fingers of three bones each, 0.16 m long, with the tips named or not.
Skeleton hand_alone() {
  Skeleton s;
  s.frame_seconds = s.frame_count = 1;
  add_joint(s, "RightHand", -1, {0, 0, 0});
  for (const std::string finger : {"Index", "Middle", "Ring"}) {
    const auto first = static_cast<std::int32_t>(s.joint_names.size());
    const double side = finger == "Index" ? .02 : finger == "Ring" ? -.02 : 0;
    add_joint(s, "RightHand" + finger + "1", 0, {side, .08, 0});
    add_joint(s, "RightHand" + finger + "2", first, {0, .04, 0});
    add_joint(s, "RightHand" + finger + "3", first + 1, {0, .025, 0});
  }
  return s;
}

// Balls in a row between the axes x and y, all but one of them turned along x.
std::vector<ConvexPart> row_of_balls(std::size_t count, std::size_t along_row) {
  std::vector<ConvexPart> parts(count);
  for (std::size_t p = 0; p < count; ++p) {
    parts[p].kind = ShapeKind::kSphere;
    parts[p].size[0] = .01f;
    parts[p].position[0] = parts[p].position[1] = static_cast<float>(p) / static_cast<float>(count);
    parts[p].rotation[2] = p == along_row ? std::sqrt(.5f - std::sqrt(.125f)) : 0;
    parts[p].rotation[3] = p == along_row ? std::sqrt(.5f + std::sqrt(.125f)) : 1;
  }
  return parts;
}

bool contains_balls(const Box& box, const std::vector<ConvexPart>& balls) {
  return std::all_of(balls.begin(), balls.end(), [&](const ConvexPart& ball) {
    for (std::size_t k = 0; k < 3; ++k) {
      double along = 0;
      for (std::size_t c = 0; c < 3; ++c)
        along += double{box.axis[k][c]} * (static_cast<double>(ball.position[c]) - static_cast<double>(box.center[c]));
      if (std::fabs(along) + static_cast<double>(ball.size[0]) > static_cast<double>(box.half[k])) return false;
    }
    return true;
  });
}

}  // namespace

TEST_CASE("a still root above hips that travel is no body, in a file as exporters write it") {
  std::string motion = "Frames: 30\nFrame Time: .03\n";
  for (int f = 0; f < 30; ++f)
    motion += "0 0 0 0 0 0 " + std::to_string(.1 * f) + " .95 " + std::to_string(2 - .05 * f) + " 0 0 0 0 0 0\n";
  const TemporaryFile file(
      "phantom.bvh",
      "HIERARCHY\nROOT Base { OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
      "JOINT Pivot { OFFSET 0 .95 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
      "JOINT Trunk { OFFSET 0 .3 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 .4 0 } } } "
      "}\nMOTION\n" +
          motion);
  const Clip clip = import_clip(file.path(), {});
  CHECK(clip.character.link_names == std::vector<std::string>{"Pivot", "Trunk"});
  for (const BodyLeaf& leaf : clip.character.leaves)
    for (const float half : leaf.box.half) CHECK(half < .3f);
  // The travel is in the origins, as with a root that moves.
  CHECK(clip.character.origins[0] == doctest::Approx(0));
  CHECK(clip.character.origins[3 * 29] == doctest::Approx(2.9));
  CHECK(all_notes(clip).find("1 segment is no bone, since its far end moves: Base to Pivot (1.6") != std::string::npos);
  CHECK(clip.bodies.segments.height == doctest::Approx(.7));
}

TEST_CASE(
    "a joint that moves by a few percent of the height ends a bone at its mean place, one that moves more does not") {
  for (const double way : {.01, .2}) {
    const Skeleton s = with_frames(stick_figure(), 21, [way](std::uint32_t f, std::size_t j, Vec3 place) {
      if (j >= 2 && j <= 3) place[1] += way * (f / 20. - .5);  // neck and head
      place[0] += .1 * f;
      return place;
    });
    const Clip clip = make_clip(s, "person", {});
    CHECK((body_of(clip, s, "Spine", BodyReason::kTravels) != nullptr) == (way > .1));
    const std::string moving = "moving in the parent's frame, its segment fixed at the mean: Neck";
    CHECK((all_notes(clip).find(moving) != std::string::npos) == (way < .1));
  }
}

TEST_CASE("a root under the feet is no body, though nothing moves") {
  Skeleton s;
  s.frame_seconds = s.frame_count = 1;
  add_joint(s, "root", -1, {0, 0, 0});
  const Skeleton person = stick_figure();
  for (std::size_t j = 0; j < person.joint_names.size(); ++j)
    add_joint(s, person.joint_names[j], person.joint_parents[j] + 1,
              {person.rest_offsets[3 * j], person.rest_offsets[3 * j + 1], person.rest_offsets[3 * j + 2]});
  const Clip clip = make_clip(s, "person", {});
  CHECK(!has_link(clip, "root"));
  CHECK(clip.character.link_names.front() == "Hips");
  CHECK(all_notes(clip).find("1 segment is no bone of the body: root to Hips (0.93 m)") != std::string::npos);
  CHECK(clip.bodies.stature.value == doctest::Approx(kStature).epsilon(.01));
}

TEST_CASE("head, hands and feet without a bone have caps of human size, which point where they should") {
  const Skeleton s = stick_figure();
  const Clip clip = make_clip(s, "person", {});
  CHECK(clip.bodies.stature.source == StatureSource::kLegsAndSpine);
  CHECK(clip.bodies.stature.value == doctest::Approx(kStature).epsilon(1e-3));
  struct Expected {
    const char* joint;
    double length, radius;  // metres
    Vec3 direction;
  };
  // By the tables for 1.75 m: a head of 23 cm and 17 cm across, a hand of 19 cm, a foot of 20 cm ahead of the ankle.
  for (const Expected& expected :
       {Expected{"Head", .2275, .086, {0, 1, 0}}, Expected{"LeftHand", .189, .030, {1, 0, 0}},
        Expected{"RightHand", .189, .030, {-1, 0, 0}}, Expected{"LeftFoot", .1995, .040, {0, 0, 1}},
        Expected{"RightFoot", .1995, .040, {0, 0, 1}}}) {
    CAPTURE(expected.joint);
    const SkeletonBody* const cap = body_of(clip, s, expected.joint, BodyReason::kCap);
    REQUIRE(cap != nullptr);
    CHECK(length(cap->direction - expected.direction) < 1e-6);
    CHECK(2 * length(cap->center) == doctest::Approx(expected.length).epsilon(.01));
    CHECK(cap->half[1] == doctest::Approx(expected.radius).epsilon(.03));
    CHECK(has_link(clip, expected.joint));
  }
}

TEST_CASE("zero end sites lose no head and no hand") {
  const TemporaryFile file(
      "ends.bvh",
      "HIERARCHY\nROOT Hips { OFFSET 0 1 0 CHANNELS 3 Zrotation Xrotation Yrotation\n"
      "JOINT Neck { OFFSET 0 .5 0 CHANNELS 3 Zrotation Xrotation Yrotation\n"
      "JOINT Head { OFFSET 0 .1 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 0 0 } } }\n"
      "JOINT LeftArm { OFFSET .2 .45 0 CHANNELS 3 Zrotation Xrotation Yrotation\n"
      "JOINT LeftForeArm { OFFSET .3 0 0 CHANNELS 3 Zrotation Xrotation Yrotation\n"
      "JOINT LeftHand { OFFSET .25 0 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 0 0 } } } } }\n"
      "MOTION\nFrames: 1\nFrame Time: 1\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n");
  const Clip clip = import_clip(file.path(), {});
  CHECK(has_link(clip, "Head"));
  CHECK(has_link(clip, "LeftHand"));
  CHECK(all_notes(clip).find("2 joints at ends have caps of the usual size: Head, LeftHand") != std::string::npos);
  // A head and its neck meet, as do a hand and its forearm.
  CHECK(clip.character.ignored_pairs.size() >= 4);
}

TEST_CASE("a head whose bones lead to its eyes alone is a head, and eyes and tips have no caps") {
  Skeleton s = stick_figure();
  add_joint(s, "LeftEye", 3, {.03, .06, .08});
  add_joint(s, "RightEye", 3, {-.03, .06, .08});
  add_joint(s, "LeftHand_End", 6, {.15, 0, 0});
  const Clip clip = make_clip(s, "person", {});
  const SkeletonBody* const head = body_of(clip, s, "Head", BodyReason::kCap);
  REQUIRE(head != nullptr);
  CHECK(length(head->direction - Vec3{0, 1, 0}) < 1e-6);
  CHECK(!has_link(clip, "LeftEye"));
  CHECK(!has_link(clip, "LeftHand_End"));
  CHECK(body_of(clip, s, "LeftHand", BodyReason::kCap) == nullptr);
  CHECK(body_of(clip, s, "RightHand", BodyReason::kCap) != nullptr);
}

TEST_CASE("each of many heads has a cap, unless its bones reach far or a head ends below it") {
  Skeleton s = stick_figure();
  std::set<std::size_t> expected = {3};
  const auto add = [&s](const std::string& name, std::size_t parent, double y, double x = 0) {
    add_joint(s, name, static_cast<std::int32_t>(parent), {x, y, 0});
    return s.joint_names.size() - 1;
  };
  for (int n = 0; n < 50; ++n) {
    const double x = .001 * n;
    // Three quarters of a head of this stature are .171 m.
    const std::size_t short_bones = add("Head", 2, .07, x);
    add("b", add("a", short_bones, .08), .08);
    expected.insert(short_bones);
    add("b", add("a", add("Head", 2, .07, x), .09), .09);
    expected.insert(add("Head", add("a", add("Head", 2, .07, x), .03), .03));
    const std::size_t first_of_two = add("Head", 2, .07, x);
    add("LeftEye", add("Head", first_of_two, .03), .03);
    expected.insert(first_of_two);
  }
  const Clip clip = make_clip(s, "heads", {});
  CHECK(clip.bodies.stature.value == doctest::Approx(kStature).epsilon(1e-3));
  std::set<std::size_t> caps;
  for (const SkeletonBody& body : clip.bodies.bodies)
    if (body.reason == BodyReason::kCap && body.part == BodyPart::kHead) caps.insert(body.joint);
  CHECK(caps == expected);
}

TEST_CASE("feet point ahead in every frame of a figure that turns") {
  Skeleton s = with_frames(stick_figure(), 2, [](std::uint32_t f, std::size_t, Vec3 place) {
    return f == 0 ? place : Vec3{-place[0], place[1], -place[2]};
  });
  const std::size_t joints = s.joint_names.size();
  for (std::size_t j = joints; j < 2 * joints; ++j) {
    s.rotations[4 * j + 1] = 1;
    s.rotations[4 * j + 3] = 0;
  }
  const Clip clip = make_clip(s, "turning", {});
  for (const char* const foot : {"LeftFoot", "RightFoot"}) {
    const SkeletonBody* const cap = body_of(clip, s, foot, BodyReason::kCap);
    REQUIRE(cap != nullptr);
    CHECK(length(cap->direction - Vec3{0, 0, 1}) < 1e-6);
  }
}

TEST_CASE("a hand alone has fingers of human thickness, and fingertips") {
  const Skeleton s = hand_alone();
  const Clip clip = make_clip(s, "hand", {});
  CHECK(clip.bodies.stature.source == StatureSource::kHand);
  CHECK(clip.bodies.stature.value > 1.2);
  CHECK(clip.bodies.stature.value < 2);
  for (const SkeletonBody& body : clip.bodies.bodies)
    if (body.part == BodyPart::kFinger) CHECK(body.half[1] > .006);
  for (const std::string tip : {"RightHandIndex3", "RightHandMiddle3", "RightHandRing3"}) {
    const SkeletonBody* const cap = body_of(clip, s, tip, BodyReason::kCap);
    REQUIRE(cap != nullptr);
    CHECK(length(cap->direction - Vec3{0, 1, 0}) < 1e-6);
    CHECK(2 * length(cap->center) == doctest::Approx(.014 * clip.bodies.stature.value));
  }
  ImportOptions options;
  options.bodies.stature = 1.8;
  CHECK(make_clip(s, "hand", options).bodies.stature.source == StatureSource::kGiven);
  // Fingers that have tips tell the length of one that has none. A fourth joint of a finger is its tip.
  Skeleton tips = hand_alone();
  add_joint(tips, "RightHandIndex4", 3, {0, .02, 0});
  add_joint(tips, "RightHandMiddle3_End", 6, {0, .02, 0});
  const Clip with_tips = make_clip(tips, "hand", {});
  CHECK(body_of(with_tips, tips, "RightHandIndex4", BodyReason::kCap) == nullptr);
  const SkeletonBody* const ring = body_of(with_tips, tips, "RightHandRing3", BodyReason::kCap);
  REQUIRE(ring != nullptr);
  CHECK(2 * length(ring->center) == doctest::Approx(.02));
}

TEST_CASE("a tail without a name goes on for half of its last bone, or as far as its siblings") {
  Skeleton s;
  s.frame_seconds = s.frame_count = 1;
  add_joint(s, "a", -1, {0, 0, 0});
  add_joint(s, "b", 0, {0, 1, 0});
  add_joint(s, "c", 1, {0, .4, 0});
  const Clip clip = make_clip(s, "tail", {});
  const SkeletonBody* const tail = body_of(clip, s, "c", BodyReason::kCap);
  REQUIRE(tail != nullptr);
  CHECK(2 * length(tail->center) == doctest::Approx(.2));
  add_joint(s, "d", 1, {.4, .1, 0});
  add_joint(s, "d_end", 3, {.3, 0, 0});
  const Clip two = make_clip(s, "tail", {});
  CHECK(2 * length(body_of(two, s, "c", BodyReason::kCap)->center) == doctest::Approx(.3));
}

TEST_CASE("feet that their own tracks move are balls, and targets of inverse kinematics are no bodies") {
  Skeleton s;
  s.frame_seconds = s.frame_count = 1;
  add_joint(s, "Bone", -1, {0, 0, 0});
  add_joint(s, "Hips", 0, {0, .9, 0});
  add_joint(s, "Chest", 1, {0, .5, 0});
  add_joint(s, "LeftUpLeg", 1, {.1, 0, 0});
  add_joint(s, "LeftLeg", 3, {0, -.4, 0});
  add_joint(s, "Foot.L", 0, {.1, .1, 0});
  add_joint(s, "Pole_Target.L", 0, {.1, .5, 1});
  const Clip clip = make_clip(s, "ik", {});
  CHECK(clip.character.link_names == std::vector<std::string>{"Bone", "Hips", "LeftUpLeg", "LeftLeg", "Foot.L"});
  const SkeletonBody* const foot = body_of(clip, s, "Foot.L", BodyReason::kCap);
  REQUIRE(foot != nullptr);
  CHECK(length(foot->center) == 0);
  CHECK(foot->half[0] > .02);
  CHECK(foot->half[0] < .06);
  // "Bone" stands above them all and has no body.
  CHECK(clip.character.leaves.size() == 4);
  CHECK(clip.character.leaves.front().link == 1);
}

TEST_CASE("thickness is a factor of all radii and of no length of a bone") {
  ImportOptions options;
  options.bodies.thickness = 2;
  const Clip thin = make_clip(stick_figure(), "thin", {}), thick = make_clip(stick_figure(), "thick", options);
  REQUIRE(thin.bodies.bodies.size() == thick.bodies.bodies.size());
  for (std::size_t b = 0; b < thin.bodies.bodies.size(); ++b) {
    CHECK(thick.bodies.bodies[b].half[1] == doctest::Approx(2 * thin.bodies.bodies[b].half[1]));
    CHECK(thick.bodies.bodies[b].center == thin.bodies.bodies[b].center);
  }
}

TEST_CASE("a leaf box contains all parts, and of many of them the orientations of 256 are tried") {
  const auto volume = [](const Box& box) { return box.half[0] * box.half[1] * box.half[2]; };
  struct Case {
    std::size_t count, along_row;
    bool is_tried;
  };
  for (const Case& entry : {Case{2, 1, true}, Case{256, 255, true}, Case{257, 256, false}, Case{1000, 500, true},
                            Case{1000, 501, false}, Case{4096, 4080, true}, Case{4096, 4095, false}}) {
    CAPTURE(entry.count);
    CAPTURE(entry.along_row);
    const std::vector<ConvexPart> balls = row_of_balls(entry.count, entry.along_row);
    const Box box = leaf_box(balls);
    CHECK(contains_balls(box, balls));
    CHECK((volume(box) < .001f) == entry.is_tried);
  }
}

TEST_CASE("bodies are changed by the names of their joints, and every kind of shape is in its leaf box") {
  const Skeleton s = stick_figure();
  for (const ShapeKind kind :
       {ShapeKind::kBox, ShapeKind::kEllipsoid, ShapeKind::kCapsule, ShapeKind::kSphere, ShapeKind::kCylinder}) {
    ImportOptions options;
    BodyChange arm;
    arm.link = "LeftArm";
    arm.to = "LeftForeArm";
    arm.kind = kind;
    arm.half = {.2, .05, .04};
    BodyChange head;
    head.link = "Head";
    head.to = kNoEnd;
    head.is_solid = false;
    options.body_changes = {arm, head};
    const Clip clip = make_clip(s, "person", options);
    CHECK(!has_link(clip, "Head"));
    const auto at = std::find(clip.character.link_names.begin(), clip.character.link_names.end(), "LeftArm");
    REQUIRE(at != clip.character.link_names.end());
    const auto link = static_cast<std::uint32_t>(at - clip.character.link_names.begin());
    for (const BodyLeaf& leaf : clip.character.leaves) {
      if (leaf.link != link) continue;
      REQUIRE(leaf.parts.size() == 1);
      CHECK(leaf.parts[0].shape.kind == kind);
      // The arm lies along x. A sphere has the radius alone.
      std::array<double, 3> extent = {0, 0, 0};
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k)
          extent[c] += static_cast<double>(std::fabs(leaf.box.axis[k][c]) * leaf.box.half[k]);
      CHECK(extent[0] == doctest::Approx(kind == ShapeKind::kSphere ? .05 : .2).epsilon(1e-5));
      CHECK(extent[1] == doctest::Approx(.05).epsilon(1e-5));
      const bool has_depth = kind == ShapeKind::kBox || kind == ShapeKind::kEllipsoid;
      CHECK(extent[2] == doctest::Approx(has_depth ? .04 : .05).epsilon(1e-5));
    }
  }
  ImportOptions options;
  BodyChange unknown;
  unknown.link = "Tail";
  unknown.to = kNoEnd;
  options.body_changes = {unknown};
  CHECK_THROWS_WITH_AS(make_clip(s, "person", options), doctest::Contains("a body from Tail to - is asked for"),
                       ImportError);
}

}  // namespace cab::tests
