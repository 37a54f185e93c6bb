// Acclaim's skeleton and motion files: forward kinematics against answers by hand and by rotation matrices, and files
// with mistakes.
#include "scenes/import/asf_amc.h"

#include "scenes/import/printable.h"
#include "scenes/vec3d.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace {

using namespace cab::scenes;
using cab::tests::TemporaryFile;

// Two bones in a row: upper along y, lower along x. The axes of upper are turned by 90 degrees about z, so that its own
// x is the world's y.
const std::string kAsf =
    ":version 1.10\n"
    ":name arm\n"
    ":units\n"
    "  mass 1.0\n"
    "  length 1.0\n"
    "  angle deg\n"
    ":documentation\n"
    "  begin of the text, name it\n"
    ":root\n"
    "  order TX TY TZ RX RY RZ\n"
    "  axis XYZ\n"
    "  position 0 0 0\n"
    "  orientation 0 0 0\n"
    ":bonedata\n"
    "  begin\n"
    "    id 1\n"
    "    name upper\n"
    "    direction 0 1 0\n"
    "    length 2\n"
    "    axis 0 0 90 XYZ\n"
    "    dof rx rz\n"
    "    limits (-160.0 20.0)\n"
    "           (-60.0 70.0)\n"
    "  end\n"
    "  begin\n"
    "    id 2\n"
    "    name lower\n"
    "    direction 1 0 0\n"
    "    length 3\n"
    "    axis 0 0 0 XYZ\n"
    "    dof ry\n"
    "  end\n"
    ":hierarchy\n"
    "  begin\n"
    "    root upper\n"
    "    upper lower\n"
    "  end\n";
const std::string kAmc =
    "#!OML:ASF a comment\n"
    ":FULLY-SPECIFIED\n"
    ":DEGREES\n"
    "1\n"
    "root 1 2 3 0 0 90\n"
    "upper 90 0\n"
    "lower 9.0e+01\n"
    "2\n"
    "root 1 2 3 0 0 0\n"
    "upper 90 90\n"
    "lower 0\n";

std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

Skeleton skeleton_of(const std::string& asf, const std::string& amc, const ImportOptions& options = {}) {
  return read_asf_amc({"arm.asf", asf}, {"arm.amc", amc}, options);
}

Vec3 position(const Skeleton& s, std::size_t frame, const std::string& name) {
  const auto found = std::find(s.joint_names.begin(), s.joint_names.end(), name);
  REQUIRE(found != s.joint_names.end());
  const auto joint = static_cast<std::size_t>(found - s.joint_names.begin());
  const double* const p = s.positions.data() + 3 * (frame * s.joint_names.size() + joint);
  return {p[0], p[1], p[2]};
}

void check_place(const Vec3& actual, const Vec3& expected, double tolerance = 1e-12) {
  for (std::size_t k = 0; k < 3; ++k) CHECK(std::fabs(actual[k] - expected[k]) <= tolerance);
}

std::string complaint(const std::string& asf, const std::string& amc) {
  try {
    skeleton_of(asf, amc);
  } catch (const ImportError& error) { return error.what(); }
  return {};
}

}  // namespace

TEST_CASE("the bones of an ASF file rotate about their own axes, in the order of their dof") {
  // Frame 0: the root turns by Rz(90). upper turns by 90 about its own x, the world's y: (0,2,0) stays, and the root
  // takes it to (-2,0,0). lower turns by Ry(90) Ry(90): (3,0,0) -> (-3,0,0), and the root takes it to (0,-3,0).
  // Frame 1: upper turns about y, then about z: (0,2,0) -> (-2,0,0), and for lower (3,0,0) -> (0,0,-3).
  const Skeleton s = skeleton_of(kAsf, kAmc);
  REQUIRE(s.joint_names == std::vector<std::string>{"root", "upper", "lower", "lower/End"});
  CHECK(s.joint_parents == std::vector<std::int32_t>{-1, 0, 1, 2});
  CHECK(s.is_end_site == std::vector<bool>{false, false, false, true});
  CHECK(s.rest_offsets == std::vector<double>{0, 0, 0, 0, 0, 0, 0, 2, 0, 3, 0, 0});
  REQUIRE(s.frame_count == 2);
  CHECK(s.frame_seconds == 1 / 120.);
  check_place(position(s, 0, "upper"), {1, 2, 3});
  check_place(position(s, 0, "lower"), {-1, 2, 3});
  check_place(position(s, 0, "lower/End"), {-1, -1, 3});
  check_place(position(s, 1, "lower"), {-1, 2, 3});
  check_place(position(s, 1, "lower/End"), {-1, 2, 0});
}

TEST_CASE("units, clock, radians, the root's orientation and the order of lines are those of the files") {
  const Skeleton plain = skeleton_of(kAsf, kAmc);
  ImportOptions options;
  options.metres_per_unit = .5;
  options.frames_per_second = 60;
  const Skeleton half = skeleton_of(kAsf, kAmc, options);
  CHECK(half.frame_seconds == 1 / 60.);
  CHECK(half.notes.empty());
  for (std::size_t i = 0; i < plain.positions.size(); ++i) CHECK(half.positions[i] == .5 * plain.positions[i]);

  REQUIRE(plain.notes.size() == 1);
  CHECK(plain.notes[0].find("no frame rate: 120 frames a second") != std::string::npos);
  const std::vector<std::string> notes = skeleton_of(with_replaced(kAsf, "length 1.0", "length 0.45"), kAmc).notes;
  REQUIRE(notes.size() == 2);
  CHECK(notes[0].find("--units 0.0564") != std::string::npos);

  const std::string radians = with_replaced(
      with_replaced(with_replaced(with_replaced(kAmc, ":DEGREES", ":RADIANS"), "0 0 90", "0 0 1.5707963267948966"),
                    "upper 90 0", "upper 1.5707963267948966 0"),
      "9.0e+01", "1.5707963267948966");
  check_place(position(skeleton_of(kAsf, radians), 0, "lower/End"), {-1, -1, 3});
  const std::string asf_radians =
      with_replaced(with_replaced(kAsf, "angle deg", "angle rad"), "0 0 90 XYZ", "0 0 1.5707963267948966 XYZ");
  check_place(position(skeleton_of(asf_radians, kAmc), 0, "lower/End"), {-1, -1, 3});

  // With its own axes turned by 90 degrees about z, a turn of the root about its x is one about the world's y.
  const std::string turned = with_replaced(kAsf, "orientation 0 0 0", "orientation 0 0 90");
  const std::string about_x = with_replaced(with_replaced(kAmc, "0 0 90", "90 0 0"), "upper 90 0", "upper 0 0");
  check_place(position(skeleton_of(turned, with_replaced(about_x, "9.0e+01", "0")), 0, "lower/End"), {1, 4, 0});

  const std::string swapped = with_replaced(with_replaced(kAmc, "upper 90 0\nlower 9.0e+01", "lower 90\nupper 90 0"),
                                            "upper 90 90\nlower 0", "lower 0\r\n\r\nupper 90 90");
  CHECK(skeleton_of(kAsf, swapped).positions == plain.positions);
}

TEST_CASE("an ASF file alone is a figure in its own pose") {
  const Skeleton s = read_asf({"arm.asf", with_replaced(kAsf, "position 0 0 0", "position 5 6 7")}, {});
  CHECK(s.frame_count == 1);
  check_place(position(s, 0, "upper"), {5, 6, 7});
  check_place(position(s, 0, "lower"), {5, 8, 7});
  check_place(position(s, 0, "lower/End"), {8, 8, 7});
}

TEST_CASE("a motion of one frame and an ASF file alone are poses that hold in all frames, with a note") {
  const std::string one_frame = kAmc.substr(0, kAmc.find("2\nroot"));
  for (const auto& [text, is_still] : {std::pair{kAmc, false}, {one_frame, true}}) {
    const TemporaryFile amc("arm.amc", text);
    const std::string asf = (amc.directory() / "arm.asf").string();
    std::ofstream(asf, std::ios::binary) << kAsf;
    for (const std::string& file : {amc.path(), asf}) {
      const Skeleton s = import_skeleton(file, {});
      CHECK(s.is_static == (is_still || file == asf));
      CHECK(std::count(s.notes.begin(), s.notes.end(), "no motion: the pose of the file holds for all frames") ==
            (s.is_static ? 1 : 0));
    }
  }
}

TEST_CASE("the skeleton of a motion is found by its name, or because it is the only one") {
  const TemporaryFile amc("11_01.amc", kAmc);
  const std::string folder = amc.directory().string() + "/";
  const auto joint_count = [&amc] { return import_skeleton(amc.path(), {}).joint_names.size(); };
  const auto notes_of = [&amc] { return import_skeleton(amc.path(), {}).notes.back(); };
  const auto write = [&folder](const std::string& name, const std::string& text) {
    std::ofstream(folder + name, std::ios::binary) << text;
  };
  CHECK_THROWS_WITH_AS(joint_count(), (amc.path() + ": no skeleton for it: put 11_01.asf or 11.asf beside it").c_str(),
                       ImportError);
  write("other.ASF", kAsf);
  CHECK(joint_count() == 4);
  CHECK(notes_of() == "the skeleton is other.ASF, the only one in the folder");
  write("12.asf", kAsf);
  CHECK_THROWS_AS(joint_count(), ImportError);
  write("11.asf", kAsf);
  CHECK(joint_count() == 4);
  CHECK(notes_of().find("skeleton") == std::string::npos);
  write("11_01.asf", "no skeleton\n");
  CHECK_THROWS_WITH_AS(joint_count(), (folder + "11_01.asf: no skeleton: it has no bones").c_str(), ImportError);
  CHECK(import_skeleton(folder + "11.asf", {}).is_static);
  CHECK(import_clip(folder + "11.asf", {}).character.link_parents.size() == 2);
}

TEST_CASE("a byte order mark before the text of an ASF or AMC file is passed over") {
  const std::string mark = "\xef\xbb\xbf";
  const TemporaryFile amc("arm.amc", mark + kAmc.substr(kAmc.find('\n') + 1));
  std::ofstream((amc.directory() / "arm.asf").string()) << mark << kAsf;
  CHECK(import_skeleton(amc.path(), {}).positions == skeleton_of(kAsf, kAmc).positions);
}

TEST_CASE("mistakes in ASF and AMC files are refused with file and line") {
  CHECK(complaint(kAsf, kAmc).empty());
  const auto asf = [](const std::string& from, const std::string& to) {
    return complaint(with_replaced(kAsf, from, to), kAmc);
  };
  CHECK(complaint("", kAmc) == "arm.asf: no skeleton: it has no bones");
  CHECK(asf("direction 0 1 0", "direction 0 1") == "arm.asf: line 18: a number is missing after '1'");
  CHECK(asf("direction 0 1 0", "direction 0 0 0") == "arm.asf: line 24: the direction of upper is 0");
  CHECK(asf("length 2", "length two") == "arm.asf: line 19: 'two' is not a number");
  CHECK(asf("length 2", "length nan") == "arm.asf: line 19: 'nan' is not finite or out of range");
  CHECK(asf("length 2", "length 2e9") == "arm.asf: line 19: '2e9' is not finite or out of range");
  CHECK(asf("90 XYZ", "90 XYX") == "arm.asf: line 20: 'XYX' is not an order of axes such as XYZ");
  CHECK(asf("dof rx rz", "dof rx l") == "arm.asf: line 21: 'l' is none of rx, ry, rz");
  CHECK(asf("dof rx rz", "dof rx rx") == "arm.asf: line 21: 'rx' is given twice");
  CHECK(asf("TX TY TZ", "TX TY TT") == "arm.asf: line 10: 'TT' is none of tx, ty, tz, rx, ry, rz");
  CHECK(asf("    name upper\n", "") == "arm.asf: line 23: a bone has no name");
  CHECK(asf("name lower", "name upper") == "arm.asf: line 32: more than one bone is named upper");
  CHECK(asf("    dof ry\n  end\n", "    dof ry\n") == "arm.asf: line 32: a bone has no end: lower");
  CHECK(asf("upper lower", "upper elbow") == "arm.asf: line 36: there is no bone 'elbow'");
  CHECK(asf("upper lower", "upper upper") == "arm.asf: line 36: upper has two parents");
  CHECK(asf("upper lower", "upper root") == "arm.asf: line 36: the root has a parent");
  CHECK(asf("    upper lower\n", "") == "arm.asf: bone lower is not in the hierarchy");
  CHECK(asf("root upper\n    upper lower", "lower upper\n    upper lower") == "arm.asf: the hierarchy has a loop");

  const auto amc = [](const std::string& from, const std::string& to) {
    return complaint(kAsf, with_replaced(kAmc, from, to));
  };
  CHECK(complaint(kAsf, "") == "arm.amc: no motion: it has no frames");
  CHECK(amc("1\nroot", "root") == "arm.amc: line 4: expected the number of a frame, found 'root'");
  CHECK(amc("lower 0\n", "lower 0 0\n") == "arm.amc: line 11: lower has 2 values, its dof are 1");
  CHECK(amc("upper 90 0\n", "upper 90\n") == "arm.amc: line 6: upper has 1 values, its dof are 2");
  CHECK(amc("upper 90 0\n", "") == "arm.amc: line 7: frame 1, which ends here, has no upper");
  CHECK(amc("lower 0\n", "") == "arm.amc: line 10: frame 2, which ends here, has no lower");
  CHECK(amc("upper 90 0\n", "elbow 90 0\n") == "arm.amc: line 6: the skeleton has no bone 'elbow'");
  CHECK(amc("lower 0\n", "upper 0 0\n") == "arm.amc: line 11: upper is twice in frame 2");
  CHECK(amc("2\nroot", "3\nroot") == "arm.amc: line 8: frame 3 follows frame 1");
  CHECK(amc("9.0e+01", "inf") == "arm.amc: line 7: 'inf' is not finite or out of range");
}

TEST_CASE("ASF and AMC files cut anywhere or with a byte changed are read or refused in one line") {
  for (std::size_t size = 0; size < kAsf.size(); ++size) complaint(kAsf.substr(0, size), kAmc);
  for (std::size_t size = 0; size < kAmc.size(); ++size) complaint(kAsf, kAmc.substr(0, size));
  std::uint32_t state = 1;
  const auto random = [&state] { return (state = state * 1664525u + 1013904223u) >> 8; };
  const std::string signs = "\n\t 90-.e:#x\xff,";
  for (int round = 0; round < 5000; ++round) {
    std::string asf = kAsf, amc = kAmc;
    std::string& changed = round % 2 == 0 ? asf : amc;
    changed[random() % changed.size()] = signs[random() % signs.size()];
    const std::string told = complaint(asf, amc);
    CAPTURE(round);
    CHECK(printable(told) == told);
    CHECK((told.empty() || told.rfind("arm.a", 0) == 0));
  }
}

TEST_CASE("the CMU clip 11_01 has the joints that rotation matrices give, and keeps its segments' lengths") {
  const char* const data = std::getenv("CAB_DATA_DIR");
  if (data == nullptr) {
    MESSAGE("skipped: CAB_DATA_DIR is not set");
    return;
  }
  const Skeleton s = import_skeleton(std::string(data) + "/asfamc/11_01.amc", {});
  REQUIRE(s.frame_count == 597);
  CHECK(s.joint_names.size() == 38);
  // Ends of bones by a program of its own, with 3 x 3 matrices and without normalizing the directions of the file,
  // which have six digits.
  struct Place {
    std::size_t frame;
    const char* joint;
    Vec3 place;
  };
  const Place places[] = {
      {0, "head/End", {11.893551, 28.986505, -39.099764}},
      {0, "lfingers/End", {15.497808, 12.952690, -36.801175}},
      {0, "rthumb/End", {8.301036, 13.981797, -40.803572}},
      {0, "ltoes/End", {11.446578, 1.119799, -37.939827}},
      {0, "rtoes/End", {6.974596, 1.322186, -38.127886}},
      {300, "head/End", {8.701870, 28.026834, -21.438910}},
      {300, "lfingers/End", {13.570986, 12.426537, -20.376064}},
      {300, "rthumb/End", {5.489599, 13.876254, -28.077452}},
      {300, "ltoes/End", {11.031912, 1.297460, -26.543599}},
      {300, "rtoes/End", {7.297313, 1.309050, -27.380136}},
      {596, "head/End", {8.057617, 28.557298, 17.447269}},
      {596, "lfingers/End", {12.242628, 17.900541, 6.154612}},
      {596, "rthumb/End", {6.698405, 14.971803, 20.424204}},
      {596, "ltoes/End", {5.494164, 0.843137, 12.199110}},
      {596, "rtoes/End", {9.811008, 0.807163, 17.817862}},
  };
  constexpr double kTolerance = 1e-5;  // of a figure 30 units tall; worst measured 4.6e-6
  for (const Place& expected : places)
    check_place(position(s, expected.frame, expected.joint), expected.place, kTolerance);
  const std::size_t joints = s.joint_names.size();
  double worst = 0;
  for (std::size_t f = 0; f < s.frame_count; ++f)
    for (std::size_t j = 1; j < joints; ++j) {
      const double* const p = s.positions.data() + 3 * (f * joints + j);
      const double* const q = s.positions.data() + 3 * (f * joints + static_cast<std::size_t>(s.joint_parents[j]));
      const double* const rest = s.rest_offsets.data() + 3 * j;
      worst = std::max(worst, std::fabs(length(Vec3{p[0], p[1], p[2]} - Vec3{q[0], q[1], q[2]}) -
                                        length(Vec3{rest[0], rest[1], rest[2]})));
    }
  CHECK(worst < 1e-12);
}
