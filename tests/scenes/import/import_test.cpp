// Import of motion: forward kinematics against references, links from skeletons, and clips on one clock.
#include "scenes/import/import.h"

#include "scenes/rig/body_parts.h"
#include "scenes/vec3d.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

namespace {

using namespace cab::scenes;
using cab::tests::TemporaryFile;

// Share of the figure's height. Worst measured 1.2e-5, which is the rounding of the reference to six digits.
constexpr double kPositionTolerance = 1e-4;
// Share of twice the distance from the root to its farthest joint, for the rounding of poses to float. Worst measured
// 3e-8.
constexpr double kPoseTolerance = 1e-6;

const char* const kAssimpClips = "/usr/share/assimp/models/BVH";

std::string data_dir() {
  const char* const dir = std::getenv("CAB_DATA_DIR");
  if (dir != nullptr && std::filesystem::exists(std::string(dir) + "/reference_fk.json")) return dir;
  return {};
}

// All BVH files on the machine: those of the shared data and those of assimp-testmodels, where present.
std::vector<std::string> all_bvh_files() {
  std::vector<std::string> files;
  for (const std::string& dir : {data_dir(), std::string(kAssimpClips)}) {
    if (dir.empty() || !std::filesystem::exists(dir)) {
      MESSAGE("skipped: no BVH files at "
              << (dir.empty() ? "CAB_DATA_DIR (not set or without reference_fk.json)" : dir));
      continue;
    }
    for (const auto& entry : std::filesystem::recursive_directory_iterator(dir)) {
      if (entry.path().extension() == ".bvh") files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

Vec3 position(const Skeleton& s, std::size_t frame, std::size_t joint) {
  const double* const p = s.positions.data() + 3 * (frame * s.joint_names.size() + joint);
  return {p[0], p[1], p[2]};
}

std::size_t index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  REQUIRE(found != names.end());
  return static_cast<std::size_t>(found - names.begin());
}

void check_place(const Vec3& actual, const Vec3& expected) {
  CHECK(actual[0] == doctest::Approx(expected[0]).epsilon(1e-6));
  CHECK(actual[1] == doctest::Approx(expected[1]).epsilon(1e-6));
  CHECK(actual[2] == doctest::Approx(expected[2]).epsilon(1e-6));
}

std::string all_notes(const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& note : notes) text += note + "\n";
  return text;
}

std::string bvh(const std::string& hierarchy, const std::string& motion) {
  return "HIERARCHY\n" + hierarchy + "MOTION\n" + motion;
}

// A limb: a root that moves, an upper joint, a lower joint, an end site.
const char* const kLimb =
    "ROOT hips\n{\n OFFSET 5 6 7\n CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
    " JOINT upper\n {\n  OFFSET 0 1 0\n  CHANNELS 3 Xrotation Yrotation Zrotation\n"
    "  JOINT lower\n  {\n   OFFSET 2 0 0\n   CHANNELS 3 Yrotation Zrotation Xrotation\n"
    "   End Site\n   {\n    OFFSET 0 0 3\n   }\n  }\n }\n}\n";

Skeleton skeleton_of(const std::string& text) {
  const TemporaryFile file("clip.bvh", text);
  return import_skeleton(file.path(), {});
}

Clip clip_of(const std::string& text, const ImportOptions& options = {}) {
  const TemporaryFile file("clip.bvh", text);
  return import_clip(file.path(), options);
}

bool has_note(const std::vector<std::string>& notes, const std::string& note) {
  return std::find(notes.begin(), notes.end(), note) != notes.end();
}

}  // namespace

TEST_CASE("rotations apply in the order a joint lists them, and position channels replace the offset") {
  // By hand: the vector from each joint to the next. The root is at (10, 20, 30), not at its offset, and rotated by
  // Rz(90). upper: Rz(90) (0,1,0) = (-1,0,0); then rotated by Rx(90) Ry(90). lower: (2,0,0) -> Ry(90): (0,0,-2) ->
  // Rx(90): (0,2,0) -> Rz(90): (-2,0,0); then rotated by Ry(90) Rz(90). end: (0,0,3) -> Rz(90): itself -> Ry(90):
  // (3,0,0) -> Ry(90): (0,0,-3) -> Rx(90): (0,3,0) -> Rz(90): (-3,0,0).
  const Skeleton s = skeleton_of(bvh(kLimb, "Frames: 1\nFrame Time: .01\n10 20 30 90 0 0 90 90 0 90 90 0\n"));
  REQUIRE(s.joint_names == std::vector<std::string>{"hips", "upper", "lower", "lower/End"});
  CHECK(s.joint_parents == std::vector<std::int32_t>{-1, 0, 1, 2});
  CHECK(s.is_end_site == std::vector<bool>{false, false, false, true});
  CHECK(s.frame_seconds == .01);
  check_place(position(s, 0, 0), {10, 20, 30});
  check_place(position(s, 0, 1), {9, 20, 30});
  check_place(position(s, 0, 2), {7, 20, 30});
  check_place(position(s, 0, 3), {4, 20, 30});
}

TEST_CASE("a file of one frame is a pose that holds in all frames, with a note, and its frame time is nobody's clock") {
  const std::string pose = "10 20 30 90 0 0 90 90 0 90 90 0\n";
  const std::string note = "no motion: the pose of the file holds for all frames";
  const Skeleton one = skeleton_of(bvh(kLimb, "Frames: 1\nFrame Time: .001\n" + pose));
  CHECK(one.is_static);
  CHECK(has_note(one.notes, note));
  const Skeleton two = skeleton_of(bvh(kLimb, "Frames: 2\nFrame Time: .01\n" + pose + pose));
  CHECK_FALSE(two.is_static);
  CHECK_FALSE(has_note(two.notes, note));

  const Clip still = make_clip(one, "still", {}), moving = make_clip(two, "moving", {});
  for (const std::vector<Clip>& clips : {std::vector{still, moving}, {moving, still, still}}) {
    ImportReport report;
    const Scene scene = make_world(clips, &report);
    CHECK(scene.frame_count == 2);
    CHECK(scene.frame_seconds == .01);
    for (const Character& character : scene.characters)
      CHECK(character.origins.size() == (character.is_static ? 3 : 6));
    for (const Alteration& alteration : report.alterations) CHECK(alteration.what != kCutFrames);
  }
  CHECK(make_world({still, still}).frame_count == 1);
}

TEST_CASE("position channels replace the offset of any joint, however many channels it has") {
  // assimp keeps position channels only of joints with exactly six.
  const Skeleton s =
      skeleton_of(bvh("ROOT a { OFFSET 9 9 9 CHANNELS 3 Xposition Yposition Zposition\n"
                      "JOINT b { OFFSET 1 2 3 CHANNELS 2 Yposition Zrotation\n"
                      "JOINT c { OFFSET 1 0 0 CHANNELS 6 Zposition Yposition Xposition Xrotation Yrotation Zrotation\n"
                      "JOINT d { OFFSET 4 0 0 CHANNELS 0 End Site { OFFSET 0 1 0 } } } } }\n",
                      "Frames: 2\nFrame Time: 1\n1 1 1 20 90 7 8 9 0 0 0\n2 2 2 0 0 1 2 3 0 0 0\n"));
  check_place(position(s, 0, 0), {1, 1, 1});
  check_place(position(s, 0, 1), {2, 21, 4});             // (1, 20, 3) away
  check_place(position(s, 0, 2), {2 - 8., 21 + 9., 11});  // Rz(90) (9, 8, 7) away
  check_place(position(s, 0, 3), {-6, 34, 11});           // Rz(90) (4, 0, 0) away
  check_place(position(s, 1, 2), {2 + 1 + 3., 2 + 0 + 2., 2 + 3 + 1.});
}

TEST_CASE("line endings, tabs, a byte order mark, keyword case, long frames and names with blanks change nothing") {
  const std::string motion = "Frames: 1\nFrame Time: .01\n10 20 30 90 10 20 30 40 50 60 70 80\n";
  const Skeleton plain = skeleton_of(bvh(kLimb, motion));
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
    return text;
  };
  const std::string text = bvh(kLimb, motion);
  for (const std::string& variant :
       {replaced(text, "\n", "\r\n"), replaced(replaced(text, "{\n", "{\r\n"), " ", "\t"), "\xef\xbb\xbf" + text,
        replaced(replaced(text, "rotation", "ROTATION"), "End Site", "end site"), replaced(text, " 30 ", "\n30\n"),
        text.substr(0, text.size() - 1), replaced(text, "upper", "the upper\tjoint"), text + "\n \r\n"}) {
    const Skeleton s = skeleton_of(variant);
    CHECK(s.positions == plain.positions);
    CHECK(s.rotations == plain.rotations);
  }
  CHECK(skeleton_of(replaced(text, "upper", "the upper")).joint_names[1] == "the upper");
  CHECK(skeleton_of(replaced(text, "upper", "up#1//2")).joint_names[1] == "up#1//2");
  CHECK(skeleton_of(replaced(text, "upper", "#1")).joint_names[1] == "#1");
  CHECK(all_notes(skeleton_of(text + "1 2 3\n").notes).find("line 25") != std::string::npos);
}

TEST_CASE("named end sites, colons with and without blanks, braces behind names and comments change nothing") {
  const std::string motion =
      "Frames: 2\nFrame Time: .01\n10 20 30 90 10 20 30 40 50 60 70 80\n1 2 3 4 5 6 7 8 9 1 2 3\n";
  const std::string text = bvh(kLimb, motion);
  const Skeleton plain = skeleton_of(text);
  const auto replaced = [](std::string changed, const std::string& from, const std::string& to) {
    REQUIRE(changed.find(from) != std::string::npos);
    for (std::size_t at = changed.find(from); at != std::string::npos; at = changed.find(from, at + to.size()))
      changed.replace(at, from.size(), to);
    return changed;
  };
  for (const std::string& variant :
       {replaced(text, "End Site\n", "End Site fingertip of the limb\n"),
        replaced(text, "End Site\n   {", "End Site tip{"), replaced(text, "End Site\n   {", "End Site{"),
        replaced(text, "0 0 3\n   }", "0 0 3}"), replaced(text, "upper\n {", "upper{"),
        replaced(text, "hips\n{", "hips{"), replaced(text, "Frames: 2", "Frames:2"),
        replaced(text, "Frames: 2", "frames : 2"), replaced(text, "Frames: 2", "Frames\t:2"),
        replaced(text, "Frame Time: .01", "Frame Time:.01"), replaced(text, "Frame Time: .01", "Frame time : .01"),
        "# a comment\n// and another\n" + text, replaced(text, "MOTION\n", "# {\nMOTION // }\n"),
        replaced(text, "80\n", "80\n# between frames 1 2 3\n"), replaced(text, "OFFSET 2 0 0", "OFFSET 2 0 0 # metres"),
        replaced(text, "upper\n {", "upper // from shoulder to elbow\n {"),
        replaced(text, "upper\n {", "upper # was {old}\n {"), replaced(text, "End Site\n", "End Site # {\n")}) {
    CAPTURE(variant);
    const Skeleton s = skeleton_of(variant);
    CHECK(s.joint_names == plain.joint_names);
    CHECK(s.frame_seconds == plain.frame_seconds);
    CHECK(s.positions == plain.positions);
    CHECK(s.rotations == plain.rotations);
    CHECK(all_notes(s.notes).empty());
  }
}

TEST_CASE("frames may be wrapped over lines, in whole frames or not") {
  const std::string values = "10 20 30 90 10 20 30 40 50 60 70 80 1 2 3 4 5 6 7 8 9 1 2 3 5 5 5 6 6 6 7 7 7 8 8 8";
  const Skeleton plain = skeleton_of(bvh(kLimb, "Frames: 3\nFrame Time: .01\n" + values + "\n"));
  // How many values the lines have, again and again: 12 are a frame.
  const std::vector<std::vector<int>> widths = {{12},     {6},  {5, 5, 2}, {1},           {7, 5},
                                                {24, 12}, {10}, {8, 9},    {12, 6, 6, 12}};
  for (const std::vector<int>& width : widths) {
    std::string lines;
    std::size_t line = 0;
    int left = width[0];
    for (const char c : values) {
      lines += c == ' ' && --left == 0 ? '\n' : c;
      if (lines.back() == '\n') left = width[++line % width.size()];
    }
    CAPTURE(lines);
    CHECK(skeleton_of(bvh(kLimb, "Frames: 3\nFrame Time: .01\n" + lines + "\n")).positions == plain.positions);
  }
}

TEST_CASE("joints with equal names are one note, which counts them") {
  std::string joints, motion = "0";
  for (int j = 0; j < 18; ++j) joints += "JOINT finger { OFFSET 1 0 0 CHANNELS 1 Zrotation }\n";
  for (int j = 0; j < 18; ++j) motion += " 0";
  const Skeleton s = skeleton_of(bvh("ROOT a { OFFSET 0 0 0 CHANNELS 1 Zrotation\n" + joints + "}\n",
                                     "Frames: 2\nFrame Time: 1\n" + motion + "\n" + motion + "\n"));
  CHECK(all_notes(s.notes) == "joints with the same name: finger (18 times)\n");
}

TEST_CASE("the first word makes a file without the extension BVH, and joints with equal names stay apart") {
  const TemporaryFile file("clip",
                           bvh("ROOT a { OFFSET 0 0 0 CHANNELS 1 Zrotation JOINT a { OFFSET 1 0 0 CHANNELS 1 Zrotation "
                               "End Site { OFFSET 1 0 0 } } }\n",
                               "Frames: 1\nFrame Time: 1\n90 90\n"));
  const Skeleton s = import_skeleton(file.path(), {});
  check_place(position(s, 0, 2), {-1, 1, 0});
  CHECK(all_notes(s.notes).find("joints with the same name: a (2 times)") != std::string::npos);
}

TEST_CASE("the joint positions of every shared clip are those of the reference") {
  const std::string dir = data_dir();
  if (dir.empty()) {
    MESSAGE("skipped: CAB_DATA_DIR is not set or has no reference_fk.json");
    return;
  }
  nlohmann::json reference;
  std::ifstream(dir + "/reference_fk.json") >> reference;
  CHECK(reference.size() >= 12);
  for (const auto& entry : reference.items()) {
    const std::string& file = entry.key();
    const nlohmann::json& facts = entry.value();
    CAPTURE(file);
    const Skeleton s = import_skeleton(dir + "/" + file, {});
    CHECK(s.joint_names == facts["names"].get<std::vector<std::string>>());
    CHECK(s.joint_parents == facts["parents"].get<std::vector<std::int32_t>>());
    CHECK(s.frame_count == facts["frames"].get<std::uint32_t>());
    CHECK(s.frame_seconds == facts["frame_time"].get<double>());
    const auto extents = facts["median_extent_xyz"].get<std::vector<double>>();
    const double height = *std::max_element(extents.begin(), extents.end());
    double worst = 0;
    for (const auto& [frame, places] : facts["world_positions"].items()) {
      REQUIRE(places.size() == s.joint_names.size());
      for (std::size_t j = 0; j < places.size(); ++j) {
        worst = std::max(worst, length(position(s, std::stoul(frame), j) - places[j].get<Vec3>()));
      }
    }
    CHECK(worst < kPositionTolerance * height);
  }
}

TEST_CASE(
    "each joint with a segment or a cap makes one link, which has its name, comes after its parent and follows the "
    "joint") {
  for (const std::string& file : all_bvh_files()) {
    CAPTURE(file);
    ImportOptions options;
    options.offset = {100, -200, 300};
    const Skeleton s = import_skeleton(file, options);
    const Clip clip = make_clip(s, file, options);
    const Character& c = clip.character;
    REQUIRE(clip.frame_count == s.frame_count);
    REQUIRE(c.origins.size() == 3 * s.frame_count);

    // In these files a segment is exactly zero or longer than a ten-thousandth of the figure's height.
    std::vector<std::string> expected;
    std::set<std::size_t> with_segment;
    for (std::size_t j = 1; j < s.joint_names.size(); ++j) {
      const Vec3 offset = {s.rest_offsets[3 * j], s.rest_offsets[3 * j + 1], s.rest_offsets[3 * j + 2]};
      if (length(offset) > 0) with_segment.insert(static_cast<std::size_t>(s.joint_parents[j]));
    }
    const bool has_ball = all_notes(clip.notes).find("its link is a ball") != std::string::npos;
    if (has_ball) CHECK(with_segment.insert(0).second);
    for (const SkeletonBody& body : clip.bodies.bodies)
      if (body.reason == BodyReason::kCap) with_segment.insert(body.joint);
    std::vector<std::size_t> joint_of;
    for (const std::size_t j : with_segment) {
      expected.push_back(s.joint_names[j]);
      joint_of.push_back(j);
    }
    REQUIRE(c.link_names == expected);
    REQUIRE(c.leaves.size() == c.link_names.size());

    for (std::size_t l = 0; l < c.link_names.size(); ++l) {
      CHECK(c.leaves[l].link == l);
      REQUIRE(c.link_parents[l] < static_cast<int>(l));
      CHECK((c.link_parents[l] == -1) == (l == 0));
      if (l == 0) continue;
      // No joint between a link and its parent has a link.
      auto above = static_cast<std::size_t>(s.joint_parents[joint_of[l]]);
      while (with_segment.count(above) == 0) above = static_cast<std::size_t>(s.joint_parents[above]);
      CHECK(c.link_names[static_cast<std::size_t>(c.link_parents[l])] == s.joint_names[above]);
    }
    for (const std::size_t f : {std::size_t{0}, std::size_t{s.frame_count / 2}, std::size_t{s.frame_count - 1}}) {
      const Vec3 origin = {c.origins[3 * f], c.origins[3 * f + 1], c.origins[3 * f + 2]};
      CHECK(length(origin - position(s, f, 0) - Vec3{100, -200, 300}) < 1e-12);
      double size = 0;
      for (std::size_t j = 0; j < s.joint_names.size(); ++j)
        size = std::max(size, 2 * length(position(s, f, j) - position(s, f, 0)));
      for (std::size_t l = 0; l < joint_of.size(); ++l) {
        const float* const pose = c.poses.data() + 7 * (f * joint_of.size() + l);
        CHECK(std::fabs(pose[0] * pose[0] + pose[1] * pose[1] + pose[2] * pose[2] + pose[3] * pose[3] - 1) < 1e-6f);
        const Vec3 place = Vec3{pose[4], pose[5], pose[6]} + position(s, f, 0);
        CHECK(length(place - position(s, f, joint_of[l])) < kPoseTolerance * size);
        // The pose carries the far end of each segment of the link to the place of the child joint.
        for (std::size_t j = 1; j < s.joint_names.size(); ++j) {
          if (static_cast<std::size_t>(s.joint_parents[j]) != joint_of[l]) continue;
          const Vec3 end = rotate({pose[0], pose[1], pose[2], pose[3]},
                                  {s.rest_offsets[3 * j], s.rest_offsets[3 * j + 1], s.rest_offsets[3 * j + 2]});
          CHECK(length(place + end - position(s, f, j)) < kPoseTolerance * size);
        }
      }
    }
  }
}

TEST_CASE("every leaf box contains its ellipsoids, and with one ellipsoid it is aligned with the bone") {
  for (const std::string& file : all_bvh_files()) {
    CAPTURE(file);
    const Clip clip = import_clip(file, {});
    for (const BodyLeaf& leaf : clip.character.leaves) {
      REQUIRE(!leaf.parts.empty());
      for (const ShapePart& part : leaf.parts) {
        REQUIRE(part.shape.kind == cab::ShapeKind::kEllipsoid);
        const Quat q = normalized(
            {part.shape.rotation[0], part.shape.rotation[1], part.shape.rotation[2], part.shape.rotation[3]});
        for (std::size_t k = 0; k < 3; ++k) {
          // The farthest points of the ellipsoid along the box's axis, in both directions.
          const Vec3 axis = {leaf.box.axis[k][0], leaf.box.axis[k][1], leaf.box.axis[k][2]};
          double reach_sq = 0, off = 0;
          for (std::size_t m = 0; m < 3; ++m) {
            Vec3 unit = {0, 0, 0};
            unit[m] = part.shape.size[m];
            reach_sq += std::pow(dot(axis, rotate(q, unit)), 2);
            off += axis[m] * (static_cast<double>(part.shape.position[m]) - leaf.box.center[m]);
            REQUIRE(part.shape.size[m] > 0);
          }
          CHECK(std::fabs(off) + std::sqrt(reach_sq) <= leaf.box.half[k]);
          if (leaf.parts.size() == 1) CHECK(leaf.box.half[k] == doctest::Approx(part.shape.size[k]).epsilon(1e-5));
        }
      }
    }
  }
}

TEST_CASE(
    "a skeleton whose hips fan out at zero length gets a ball at the root, and links that meet there are ignored "
    "pairs") {
  // As in the CMU clips, three children lie at the root. left and right have segments. spine has no segment of its own
  // and continues through a zero joint.
  const Clip clip = clip_of(
      bvh("ROOT Hips { OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
          "JOINT Left { OFFSET 0 0 0 CHANNELS 3 Zrotation Yrotation Xrotation JOINT LeftLeg_End { OFFSET 0 -.8 0 "
          "CHANNELS 3 Zrotation Yrotation Xrotation End Site { OFFSET 0 0 0 } } }\n"
          "JOINT Right { OFFSET 0 0 0 CHANNELS 3 Zrotation Yrotation Xrotation End Site { OFFSET .1 -.8 0 } }\n"
          "JOINT Pivot { OFFSET 0 0 0 CHANNELS 3 Zrotation Yrotation Xrotation JOINT Spine { OFFSET 0 0 0 "
          "CHANNELS 3 Zrotation Yrotation Xrotation End Site { OFFSET 0 .6 0 } } } }\n",
          "Frames: 1\nFrame Time: 1\n0 1 0 0 0 0 0 0 0 0 0 0 0 0 0 90 0 0 0 0 90\n"));
  const Character& c = clip.character;
  REQUIRE(c.link_names == std::vector<std::string>{"Hips", "Left", "Right", "Spine"});
  CHECK(c.link_parents == std::vector<std::int32_t>{-1, 0, 0, 0});
  REQUIRE(c.leaves[0].parts.size() == 1);
  const float* const ball = c.leaves[0].parts[0].shape.size;
  CHECK(ball[0] == ball[1]);
  CHECK(ball[1] == ball[2]);
  float thickest = 0;
  for (std::size_t l = 1; l < 4; ++l) thickest = std::max(thickest, c.leaves[l].parts[0].shape.size[1]);
  CHECK(ball[0] == thickest);
  CHECK(c.ignored_pairs.size() == 6);
  const std::string notes = all_notes(clip.notes);
  CHECK(notes.find("meet at Hips: its link is a ball") != std::string::npos);
  CHECK(notes.find("4 joints merged with the place of the parent") != std::string::npos);
  CHECK(notes.find("2 joints dropped (no body moves with them): LeftLeg_End, Pivot") != std::string::npos);
  CHECK(notes.find("1 end site of zero length dropped") != std::string::npos);
  // Spine rotates with the dropped Pivot: Rz(90) Rx(90) (0, .6, 0) = Rz(90) (0, 0, .6) = (0, 0, .6).
  const float* const pose = c.poses.data() + 7 * 3;
  check_place(rotate({pose[0], pose[1], pose[2], pose[3]}, {1, 0, 0}), {0, 1, 0});
  const Vec3 end = rotate({pose[0], pose[1], pose[2], pose[3]}, {0, .6, 0});
  CHECK(length(end - Vec3{0, 0, .6}) < 1e-6);
}

TEST_CASE("adjacent links are ignored pairs, others are not") {
  const Clip clip =
      clip_of(bvh("ROOT a { OFFSET 0 0 0 CHANNELS 3 Zrotation Yrotation Xrotation\n"
                  "JOINT b { OFFSET 0 1 0 CHANNELS 0 JOINT d { OFFSET 0 1 0 CHANNELS 0 End Site { OFFSET 0 1 0 } } }\n"
                  "JOINT c { OFFSET 1 0 0 CHANNELS 0 End Site { OFFSET 0 1 0 } } }\n",
                  "Frames: 1\nFrame Time: 1\n0 0 0\n"));
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const cab::LinkPair& pair : clip.character.ignored_pairs) pairs.insert({pair.a, pair.b});
  REQUIRE(clip.character.link_names == std::vector<std::string>{"a", "b", "d", "c"});
  CHECK(pairs == std::set<std::pair<std::uint32_t, std::uint32_t>>{{0, 1}, {0, 3}, {1, 2}});
}

TEST_CASE("a joint that moves in its parent's frame gets the mean place for its segment, and a note") {
  const Clip clip =
      clip_of(bvh("ROOT a { OFFSET 0 0 0 CHANNELS 3 Zrotation Yrotation Xrotation\n"
                  "JOINT b { OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition End Site { OFFSET 0 1 0 } } }\n",
                  "Frames: 2\nFrame Time: 1\n0 0 0 1.99 0 0\n90 0 0 2.01 0 0\n"));
  REQUIRE(clip.character.link_names == std::vector<std::string>{"a", "b"});
  CHECK(clip.character.leaves[0].parts[0].shape.position[0] == doctest::Approx(1));
  CHECK(all_notes(clip.notes).find("moving in the parent's frame, its segment fixed at the mean: b") !=
        std::string::npos);
}

TEST_CASE("a rope of a thousand links is imported") {
  std::string hierarchy, ends, values;
  for (int i = 0; i < 1023; ++i) {
    hierarchy += (i == 0 ? "ROOT j" : "JOINT j") + std::to_string(i) + " { OFFSET .01 0 0 CHANNELS 1 Zrotation\n";
    ends += "}";
    values += "0 ";
  }
  const Clip clip = clip_of(
      bvh(hierarchy + "End Site { OFFSET .01 0 0 }" + ends + "\n", "Frames: 1\nFrame Time: 1\n" + values + "\n"));
  REQUIRE(clip.character.link_names.size() == 1023);
  CHECK(clip.character.link_parents.back() == 1021);
  CHECK(clip.character.poses[7 * 1022 + 4] == doctest::Approx(10.22));
}

// As many as a file may have. Their link is made outside of the child process and its limits.
TEST_CASE("a star of thousands of end sites is one link, and its box contains them") {
  constexpr int kEnds = 8190;
  std::string hierarchy = "ROOT a { OFFSET 0 0 0 CHANNELS 1 Zrotation\n";
  for (int k = 0; k < kEnds; ++k) {
    const double z = 1 - 2 * (k + .5) / kEnds, s = std::sqrt(1 - z * z), angle = k * 2.399963;
    hierarchy += "End Site { OFFSET " + std::to_string(s * std::cos(angle)) + " " +
                 std::to_string(s * std::sin(angle)) + " " + std::to_string(z) + " }\n";
  }
  const Clip clip = clip_of(bvh(hierarchy + "}\n", "Frames: 1\nFrame Time: 1\n0\n"));
  REQUIRE(clip.character.leaves.size() == 1);
  const BodyLeaf& leaf = clip.character.leaves[0];
  CHECK(leaf.parts.size() == kEnds);
  double least = 1;  // from the middle of a body to the sides of the box
  for (const ShapePart& part : leaf.parts)
    for (std::size_t k = 0; k < 3; ++k) {
      double along = 0;
      for (std::size_t c = 0; c < 3; ++c)
        along += static_cast<double>(leaf.box.axis[k][c] * (part.shape.position[c] - leaf.box.center[c]));
      least = std::min(least, static_cast<double>(leaf.box.half[k]) - std::fabs(along));
    }
  CHECK(least > 0);
}

TEST_CASE("more links than an articulation can have are refused") {
  std::string hierarchy = "ROOT a { OFFSET 0 0 0 CHANNELS 1 Zrotation\n", values = "0";
  for (int i = 0; i < 1024; ++i) {
    hierarchy += "JOINT j" + std::to_string(i) + " { OFFSET 1 0 0 CHANNELS 1 Zrotation End Site { OFFSET 0 1 0 } }\n";
    values += " 0";
  }
  CHECK_THROWS_WITH_AS(clip_of(bvh(hierarchy + "}\n", "Frames: 1\nFrame Time: 1\n" + values + "\n")),
                       doctest::Contains("1025 links"), ImportError);
}

TEST_CASE("units scale only lengths, and a note doubts a figure that does not have the size of a person") {
  const std::string text = bvh(kLimb, "Frames: 1\nFrame Time: .01\n10 20 30 90 10 20 30 40 50 60 70 80\n");
  const TemporaryFile file("clip.bvh", text);
  ImportOptions half;
  half.metres_per_unit = .5;
  const Skeleton a = import_skeleton(file.path(), {}), b = import_skeleton(file.path(), half);
  CHECK(a.rotations == b.rotations);
  for (std::size_t i = 0; i < a.positions.size(); ++i) CHECK(b.positions[i] == doctest::Approx(.5 * a.positions[i]));
  for (std::size_t i = 0; i < a.rest_offsets.size(); ++i) CHECK(b.rest_offsets[i] == .5 * a.rest_offsets[i]);

  // 3 units along y, 0 along z.
  const std::string pole = bvh("ROOT a { OFFSET 0 0 0 CHANNELS 1 Zrotation End Site { OFFSET 0 3.5 0 } }\n",
                               "Frames: 1\nFrame Time: 1\n0\n");
  CHECK(all_notes(clip_of(pole).notes).find("3.5 m tall") != std::string::npos);
  CHECK(all_notes(clip_of(pole, half).notes).find("tall") == std::string::npos);
  half.up = 'z';
  CHECK(all_notes(clip_of(pole, half).notes).find("0 m tall") != std::string::npos);
  for (const double bad : {0.0, -1.0, std::nan(""), 1e300}) {
    half.metres_per_unit = bad;
    CHECK_THROWS_WITH_AS(import_skeleton(file.path(), half), doctest::Contains("metres per unit"), ImportError);
  }
}

TEST_CASE("the CMU clips of assimp-testmodels have the size of a person at 0.0564 m per unit") {
  for (const char* name : {"/01_01.bvh", "/01_03.bvh"}) {
    const std::string path = std::string(kAssimpClips) + name;
    if (!std::filesystem::exists(path)) {
      MESSAGE("skipped: " << path << " is not there (package assimp-testmodels)");
      continue;
    }
    ImportOptions options;
    options.metres_per_unit = .0564;
    const Clip clip = import_clip(path, options);
    CHECK(all_notes(clip.notes).find("tall") == std::string::npos);
    CHECK(clip.character.link_names.size() == 30);
    // Thighs and shins have a plausible thickness, metres.
    const auto radius = [&clip](const char* link) {
      return clip.character.leaves[index_of(clip.character.link_names, link)].parts[0].shape.size[1];
    };
    CHECK(radius("LeftUpLeg") == doctest::Approx(.075).epsilon(.2));
    CHECK(radius("LeftLeg") == doctest::Approx(.05).epsilon(.2));
    CHECK(radius("LeftForeArm") == doctest::Approx(.04).epsilon(.2));
  }
}

TEST_CASE("the names of both ends of a segment tell the body part, in the words of different exporters") {
  CHECK(body_part("LeftShoulder", "LeftArm") == BodyPart::kGirdle);
  CHECK(body_part("LeftShoulder", "LeftElbow") == BodyPart::kUpperArm);
  CHECK(body_part("mixamorig:LeftForeArm", "mixamorig:LeftHand") == BodyPart::kForearm);
  CHECK(body_part("rShldr", "rForeArm") == BodyPart::kUpperArm);
  CHECK(body_part("hip", "abdomen") == BodyPart::kTrunk);
  CHECK(body_part("hip", "lButtock") == BodyPart::kPelvis);
  CHECK(body_part("LeftHip", "LeftKnee") == BodyPart::kThigh);
  CHECK(body_part("LHipJoint", "LeftHip") == BodyPart::kPelvis);
  CHECK(body_part("Upper_Leg.L", "Lower_Leg.L") == BodyPart::kThigh);
  CHECK(body_part("LeftLeg", "LeftFoot") == BodyPart::kShank);
  CHECK(body_part("LeftLeg", "LeftShin") == BodyPart::kThigh);
  CHECK(body_part("Hips", "LeftUpLeg") == BodyPart::kPelvis);
  CHECK(body_part("Chest", "LeftCollar") == BodyPart::kGirdle);
  CHECK(body_part("LeftHandIndex1", "LeftHandIndex1/End") == BodyPart::kFinger);
  CHECK(body_part("Neck", "Head") == BodyPart::kHead);
  CHECK(body_part("Head", "Head/End") == BodyPart::kHead);
  CHECK(body_part("nodes[7]", "nodes[8]") == BodyPart::kUnknown);
  // The trunk of Kinect, of OpenXR and of a common BVH template: words of fingers and arms beside those of a trunk.
  for (const char* name : {"SpineMid", "SpineShoulder", "SPINE_MIDDLE", "MiddleSpine", "spine_middle", "MiddleChest"}) {
    CAPTURE(name);
    CHECK(body_part(name, "Neck") == BodyPart::kTrunk);
    CHECK(body_part("SpineBase", name) == BodyPart::kTrunk);
  }
  CHECK(body_part("SpineShoulder", "ShoulderLeft") == BodyPart::kGirdle);
  CHECK(body_part("ShoulderLeft", "ElbowLeft") == BodyPart::kUpperArm);
  CHECK(body_part("l_middle_01", "l_middle_02") == BodyPart::kFinger);
  CHECK(body_part("HandRing1_L", "HandRing2_L") == BodyPart::kFinger);
  for (const char* name : {"HairSpring1", "Earring_L", "BowString"}) {
    CAPTURE(name);
    CHECK(body_part(name, "tip") == BodyPart::kUnknown);
  }
}

TEST_CASE("the thickness of a part gives the volume of its mass for any number of segments") {
  // A thigh by hand: 10 % of 22 x 1.75^2 = 67.375 kg at 1.05 kg/l are 6.4167 l; its length is .245 x 1.75 m.
  const double stature = 1.75, thigh = .245 * stature;
  const double radius = segment_radius(BodyPart::kThigh, thigh, stature, 1);
  CHECK(4.0 / 3 * 3.14159265 * (thigh / 2) * radius * radius == doctest::Approx(.0064167).epsilon(1e-4));
  CHECK(segment_radius(BodyPart::kThigh, thigh / 2, stature, 1) == radius);
  // Tiny and huge segments keep within the limits.
  CHECK(segment_radius(BodyPart::kThigh, .01, stature, 1) == doctest::Approx(.005));
  CHECK(segment_radius(BodyPart::kFinger, .5, stature, 1) == doctest::Approx(.04));
}

TEST_CASE(
    "a world has the smallest frame time of its clips, shows nearest earlier frames, and ends with the shortest clip") {
  const auto clip = [](const std::string& name, double frame_seconds, std::uint32_t frame_count) {
    Clip c;
    c.character.name = name;
    c.frame_seconds = frame_seconds;
    c.frame_count = frame_count;
    for (std::uint32_t f = 0; f < frame_count; ++f) {
      for (int k = 0; k < 7; ++k) c.character.poses.push_back(static_cast<float>(f));
      for (int k = 0; k < 3; ++k) c.character.origins.push_back(f);
    }
    c.notes.push_back("of " + name);
    return c;
  };
  Clip table = clip("table", 1, 1);
  table.character.is_static = true;
  // slow has frames at 0, .025 and .05 s and ends at .075 s. fast has frames every .01 s until 1 s.
  const Scene scene = make_world({clip("slow", .025, 3), clip("fast", .01, 100), table});
  CHECK(scene.frame_seconds == .01);
  REQUIRE(scene.frame_count == 8);
  std::vector<double> shown;
  for (std::uint32_t f = 0; f < 8; ++f) shown.push_back(scene.characters[0].origins[3 * f]);
  CHECK(shown == std::vector<double>{0, 0, 0, 1, 1, 2, 2, 2});
  CHECK(scene.characters[0].poses[7 * 5] == 2);
  CHECK(scene.characters[1].origins.size() == 3 * 8);
  CHECK(scene.characters[1].origins[3 * 7] == 7);
  CHECK(scene.characters[2].origins.size() == 3);
  CHECK(scene.notes == std::vector<std::string>{"slow: of slow", "fast: of fast",
                                                "fast: 92 of 100 frames are not tested: slow ends first",
                                                "table: of table"});

  // On one clock every frame is there once, in spite of rounding.
  const Scene same = make_world({clip("a", 1.0 / 120, 5000), clip("b", 1.0 / 120, 4000)});
  CHECK(same.frame_count == 4000);
  CHECK(same.characters[0].origins[3 * 3999] == 3999);
  const Scene twice = make_world({clip("a", 1.0 / 60, 1000), clip("b", 1.0 / 120, 4000)});
  CHECK(twice.frame_count == 2000);
  for (std::uint32_t f = 0; f < 2000; ++f) REQUIRE(twice.characters[0].origins[3 * f] == f / 2);
  CHECK(make_world({table}).frame_count == 1);
  CHECK_THROWS_AS(make_world({}), std::invalid_argument);

  // What is cut off is counted in each clip's own frames.
  const auto cuts = [](const std::vector<Clip>& clips) {
    ImportReport report;
    std::vector<std::string> told;
    const Scene world = make_world(clips, &report);
    for (const Alteration& alteration : report.alterations) {
      if (alteration.what != kCutFrames) continue;
      CHECK(alteration.kind == AlterationKind::kDropped);
      CHECK(has_note(world.notes, alteration.note));
      told.push_back(std::to_string(alteration.count) + " " + alteration.note);
    }
    return told;
  };
  CHECK(cuts({clip("a", .01, 60), table, clip("b", .01, 10), clip("c", .02, 6)}) ==
        std::vector<std::string>{"50 a: 50 of 60 frames are not tested: b ends first",
                                 "1 c: 1 of 6 frames is not tested: b ends first"});
  CHECK(cuts({clip("a", .01, 60), clip("b", .02, 30), table}).empty());
  CHECK(cuts({clip("a", .01, 60)}).empty());
}

TEST_CASE("people of whom one is long along another axis are doubted, and what may have outstretched arms is not") {
  const auto person = [](const std::string& name, const std::string& leg, const std::string& trunk,
                         const ImportOptions& options = {}) {
    const std::string thigh = " { OFFSET " + leg + " CHANNELS 0 JOINT ", end = " { OFFSET " + leg + " CHANNELS 0 ";
    Clip clip =
        clip_of(bvh("ROOT Hips { OFFSET 0 0 0 CHANNELS 1 Zrotation JOINT LeftUpLeg { OFFSET .1 .1 .1 CHANNELS 0 "
                    "JOINT LeftLeg" +
                        thigh + "LeftFoot" + end + "} } } JOINT Neck { OFFSET " + trunk + " CHANNELS 0 } }\n",
                    "Frames: 1\nFrame Time: 1\n0\n"),
                options);
    clip.character.name = name;
    return clip;
  };
  const Clip along_y = person("y", "0 -.4 0", "0 .6 0"), along_z = person("z", "0 0 -.4", "0 0 .6");
  const Clip wide = person("wide", "0 -.4 0", "1 .6 0");
  const auto doubts = [](const std::vector<Clip>& clips) {
    std::vector<std::string> found;
    for (const std::string& note : make_world(clips).notes)
      if (note.find("longest along") != std::string::npos) found.push_back(note);
    return found;
  };
  CHECK(doubts({along_y, along_z, along_y, along_z}) ==
        std::vector<std::string>(
            2, "z: warning: the figure is longest along z, and y along y: cab turns neither, so one may lie"));
  CHECK(doubts({along_y, along_y, wide}).empty());
  CHECK(doubts({wide, along_z}).empty());
  ImportOptions given;
  given.up = 'z';
  CHECK(doubts({along_y, person("given", "0 0 -.4", "0 0 .6", given)}).empty());
}

TEST_CASE("a scene that would not fit in memory is refused before it is made") {
  Clip slow, fast;
  slow.frame_seconds = 1000;
  slow.frame_count = 1;
  slow.character.poses.assign(7 * 1000, 0);
  slow.character.origins.assign(3, 0);
  fast.frame_seconds = 1e-5;
  fast.frame_count = 1000000;
  fast.character.poses.assign(7000000, 0);
  fast.character.origins.assign(3000000, 0);
  CHECK_THROWS_AS(make_world({slow, fast}), ImportError);
  slow.character.is_static = true;  // who makes a moving character of it has its pose in every frame
  CHECK_THROWS_AS(make_world({slow, fast}), ImportError);
}

TEST_CASE("skinned glTF characters keep their bone lengths in every frame, static ones are marked") {
  const std::string dir = data_dir();
  if (dir.empty()) {
    MESSAGE("skipped: CAB_DATA_DIR is not set or has no reference_fk.json");
    return;
  }
  const Clip man = import_clip(dir + "/gltf/cesium_man.gltf", {});
  CHECK(man.frame_count == 49);
  CHECK(man.frame_seconds == doctest::Approx(2.0 / 48));
  CHECK(all_notes(man.notes).find("tall") == std::string::npos);
  const Skeleton s = import_skeleton(dir + "/gltf/cesium_man.gltf", {});
  CHECK(s.joint_names.size() == 19);
  for (std::size_t j = 1; j < s.joint_names.size(); ++j) {
    const auto parent = static_cast<std::size_t>(s.joint_parents[j]);
    const double rest = length(position(s, 0, j) - position(s, 0, parent));
    // Worst measured 3e-7 m, from the floats of the file.
    for (std::size_t f = 0; f < s.frame_count; ++f)
      CHECK(std::fabs(length(position(s, f, j) - position(s, f, parent)) - rest) < 1e-5);
  }
  const Clip hand = import_clip(dir + "/gltf/generic-hand-left.glb", {});
  CHECK(hand.character.is_static);
  CHECK(hand.frame_count == 1);
  CHECK(import_clip(dir + "/gltf/robot.glb", {}).frame_count == 81);
  CHECK_THROWS_WITH_AS(import_clip(dir + "/gltf/greenman_sword.glb", {}), doctest::Contains("no skeleton"),
                       ImportError);
}
