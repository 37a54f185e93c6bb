// Malformed files. Each gives one clear line, and no file makes import crash, hang or allocate without bound.
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "tests/scenes/temporary_file.h"

#include <sys/stat.h>

#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <cstring>

namespace {

using namespace cab::scenes;
using cab::tests::TemporaryFile;

// The complaint of import about a file, empty if it reads the file.
std::string complaint(const std::string& path) {
  try {
    import_clip(path, {});
  } catch (const ImportError& error) { return error.what(); }
  return {};
}

// The complaint about a file of these bytes. Checks that it is one line that names the file.
std::string complaint_about(const std::string& bytes, const std::string& name = "clip.bvh") {
  const TemporaryFile file(name, bytes);
  const std::string text = complaint(file.path());
  REQUIRE(!text.empty());
  CHECK(text.find('\n') == std::string::npos);
  CHECK(text.rfind(file.path() + ": ", 0) == 0);
  return text.substr(file.path().size() + 2);
}

const std::string kHierarchy =
    "HIERARCHY\n"
    "ROOT hips\n"
    "{\n"
    "  OFFSET 0 0 0\n"
    "  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
    "  JOINT leg\n"
    "  {\n"
    "    OFFSET 0 -1 0\n"
    "    CHANNELS 3 Zrotation Yrotation Xrotation\n"
    "    End Site\n"
    "    {\n"
    "      OFFSET 0 -1 0\n"
    "    }\n"
    "  }\n"
    "}\n";
const std::string kFrame = "1 2 3 10 20 30 40 50 60\n";

// A file that is good except for the three given parts of its motion, lines 17, 18, and 19 and following.
std::string with_motion(const std::string& frames, const std::string& frame_time, const std::string& values) {
  return kHierarchy + "MOTION\nFrames: " + frames + "\nFrame Time: " + frame_time + "\n" + values;
}

std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

// One step of splitmix64, for the same garbage on every machine.
std::uint64_t next_random(std::uint64_t& state) {
  std::uint64_t z = state += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

// A glTF 2 file of three nodes in a row. Two position keys with these values move the middle node.
std::string gltf(const std::array<float, 2>& times, const std::array<float, 6>& positions) {
  std::array<unsigned char, 32> bytes;
  std::memcpy(bytes.data(), times.data(), 8);
  std::memcpy(bytes.data() + 8, positions.data(), 24);
  const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string base64;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = (group << 8) | (i + k < bytes.size() ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) base64 += i + k > bytes.size() ? '=' : digits[(group >> (18 - 6 * k)) & 63];
  }
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
         R"("nodes":[{"name":"a","children":[1]},{"name":"b","translation":[0,1,0],"children":[2]},)"
         R"({"name":"c","translation":[0,1,0]}],)"
         R"("animations":[{"name":"walk","channels":[{"sampler":0,"target":{"node":1,"path":"translation"}},)"
         R"({"sampler":0,"target":{"node":0,"path":"translation"}}],)"
         R"("samplers":[{"input":0,"output":1}]}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR"},)"
         R"({"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"}],)"
         R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":8},{"buffer":0,"byteOffset":8,"byteLength":24}],)"
         R"("buffers":[{"byteLength":32,"uri":"data:application/octet-stream;base64,)" +
         base64 + R"("}]})";
}

}  // namespace

TEST_CASE("the file from which the malformed files are made is good") {
  const TemporaryFile file("clip.bvh", with_motion("2", ".01", kFrame + kFrame));
  CHECK(complaint(file.path()).empty());
}

TEST_CASE("a missing file, a directory, a pipe and an empty file are named as such") {
  const TemporaryFile file("empty.bvh", "");
  CHECK(complaint(file.path()) == file.path() + ": the file is empty");
  CHECK(complaint(file.path() + "x") == file.path() + "x: no such file");
  CHECK(complaint(file.path() + "/x").rfind(file.path() + "/x: ", 0) == 0);
  CHECK(complaint("") == ": no such file");
  const std::string directory = file.directory().string();
  CHECK(complaint(directory) == directory + ": is a directory, not a file");
  const std::string pipe = directory + "/pipe.bvh";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(complaint(pipe) == pipe + ": is not a regular file");
}

TEST_CASE("a file larger than the limit is refused before it is read") {
  const TemporaryFile file("clip.bvh", "HIERARCHY\n");
  std::filesystem::resize_file(file.path(), (std::uintmax_t{256} << 20) + 1);  // sparse
  CHECK(complaint(file.path()).find("larger than 256 MiB") != std::string::npos);
}

TEST_CASE("a frame count that is not a count, or that the file cannot hold, is refused") {
  CHECK(complaint_about(with_motion("0", ".01", kFrame)) ==
        "line 17: the frame count must be a whole number of at least 1");
  CHECK(complaint_about(with_motion("-5", ".01", kFrame)) ==
        "line 17: the frame count must be a whole number of at least 1");
  CHECK(complaint_about(with_motion("1.5", ".01", kFrame)) ==
        "line 17: the frame count must be a whole number of at least 1");
  for (const char* count : {"4000000000", "4294967297", "1e15", "1000"}) {
    CHECK(
        complaint_about(with_motion(count, ".01", kFrame)).find("line 17: the file is too short for its frame count") ==
        0);
  }
  CHECK(complaint_about(with_motion("1e300", ".01", kFrame)) == "line 17: frame count \"1e300\" is out of range");
  CHECK(complaint_about(with_motion("nan", ".01", kFrame)) == "line 17: frame count \"nan\" is not finite");
  CHECK(complaint_about(with_motion("two", ".01", kFrame)) == "line 17: frame count \"two\" is not a number");
  CHECK(complaint_about(with_motion("3", ".01", kFrame + kFrame)) == "line 21: the file ends in frame 3 of 3");
}

TEST_CASE("a frame time that is not finite and above zero is refused") {
  CHECK(complaint_about(with_motion("1", "0", kFrame)) == "line 18: the frame time must be above 0");
  CHECK(complaint_about(with_motion("1", "-0.01", kFrame)) == "line 18: the frame time must be above 0");
  CHECK(complaint_about(with_motion("1", "1e-30", kFrame)) ==
        "line 18: the frame time must be between a microsecond and an hour");
  CHECK(complaint_about(with_motion("1", "inf", kFrame)) == "line 18: frame time \"inf\" is not finite");
  CHECK(complaint_about(with_motion("1", "NaN", kFrame)) == "line 18: frame time \"NaN\" is not finite");
  CHECK(complaint_about(with_motion("1", "1e999", kFrame)) == "line 18: frame time \"1e999\" is out of range");
  CHECK(complaint_about(with_motion("1", ".01s", kFrame)) == "line 18: frame time \".01s\" is not a number");
}

TEST_CASE("values that are not finite, out of range or not numbers are refused with their line") {
  CHECK(complaint_about(with_motion("2", ".01", kFrame + "1 2 3 nan 20 30 40 50 60\n")) ==
        "line 20: motion value \"nan\" is not finite");
  CHECK(complaint_about(with_motion("1", ".01", "1 2 3 -inf 20 30 40 50 60\n")) ==
        "line 19: motion value \"-inf\" is not finite");
  CHECK(complaint_about(with_motion("1", ".01", "1e300 2 3 10 20 30 40 50 60\n")) ==
        "line 19: motion value \"1e300\" is out of range");
  CHECK(complaint_about(with_motion("1", ".01", "1e400 2 3 10 20 30 40 50 60\n")) ==
        "line 19: motion value \"1e400\" is out of range");
  CHECK(complaint_about(with_motion("1", ".01", "1,5 2 3 10 20 30 40 50 60\n")) ==
        "line 19: motion value \"1,5\" is not a number");
  CHECK(complaint_about(with_motion("1", ".01", "0x10 2 3 10 20 30 40 50 60\n")) ==
        "line 19: motion value \"0x10\" is not a number");
  CHECK(complaint_about(with_motion("1", ".01", "+-1 2 3 10 20 30 40 50 60\n")) ==
        "line 19: motion value \"+-1\" is not a number");
  // assimp would read this 1 as 0.
  CHECK(complaint_about(with_motion("1", ".01", "10000000000000000000000e-22 2 3 10 20 30 40 50 60\n"))
            .find("has too many digits") != std::string::npos);
  const std::string good = with_motion("1", ".01", kFrame);
  CHECK(complaint_about(with_replaced(good, "-1 0", "1e300 0")) == "line 8: OFFSET value \"1e300\" is out of range");
  CHECK(complaint_about(with_replaced(good, "-1 0", "nan 0")) == "line 8: OFFSET value \"nan\" is not finite");
}

TEST_CASE("a hierarchy that breaks the grammar is refused with its line") {
  const std::string good = with_motion("1", ".01", kFrame);
  const auto broken = [&good](const std::string& from, const std::string& to) {
    return complaint_about(with_replaced(good, from, to));
  };
  CHECK(broken("HIERARCHY", "HIERARCHYX").find("line 1: expected \"HIERARCHY\", found \"HIERARCHYX\"") == 0);
  CHECK(broken("ROOT hips", "ROOT") == "line 2: expected the name of a joint");
  CHECK(broken("ROOT hips", "ROOT {") == "line 2: expected the name of a joint");
  CHECK(broken("ROOT hips\n{\n", "ROOT hips\n") == "line 3: expected \"{\" after hips, found \"OFFSET\"");
  CHECK(broken("JOINT", "JOIN") ==
        "line 6: expected OFFSET, CHANNELS, JOINT, End Site or \"}\", found \"JOIN\"; hips, which began at line 2, is "
        "open");
  CHECK(broken("End Site", "End Sites") == "line 10: expected \"Site\", found \"Sites\"");
  CHECK(broken("    OFFSET 0 -1 0\n", "") == "line 13: leg has no OFFSET");
  CHECK(broken("    OFFSET 0 -1 0\n", "    OFFSET 0 -1\n") == "line 9: OFFSET value \"CHANNELS\" is not a number");
  CHECK(broken("CHANNELS 3", "CHANNELS 4") == "line 10: expected a channel such as Xrotation, found \"End\"");
  CHECK(broken("CHANNELS 3", "CHANNELS -3") == "line 9: a joint has 0 to 6 channels");
  CHECK(broken("CHANNELS 3", "CHANNELS 4e9").find("line 9: channel count \"4e9\" is out of range") == 0);
  CHECK(broken("Yposition", "Xposition") == "line 5: the channel \"Xposition\" is given twice");
  CHECK(broken("Xposition", "Wposition") == "line 5: expected a channel such as Xrotation, found \"Wposition\"");
  CHECK(broken("Xposition", "Xrotation") == "line 5: a joint has at most three rotation channels");
  CHECK(broken("MOTION", "}") == "line 16: expected \"MOTION\", found \"}\"");
  CHECK(broken("    CHANNELS 3 Zrotation Yrotation Xrotation\n    End Site\n    {\n      OFFSET 0 -1 0\n    }\n",
               "    End Site\n    {\n      OFFSET 0 -1 0\n    }\n    CHANNELS 3 Zrotation Yrotation Xrotation\n") ==
        "line 13: CHANNELS of leg after a child joint");
  CHECK(
      complaint_about("HIERARCHY ROOT a { OFFSET 0 0 0 End Site { OFFSET 0 1 0 } } MOTION Frames: 1 Frame Time: 1\n") ==
      "line 1: no joint has channels: there is no motion");
}

TEST_CASE("a missing brace names the open joint, where it began, and the braces that do not line up") {
  const std::string good = with_motion("1", ".01", kFrame);
  const std::string expected = "expected OFFSET, CHANNELS, JOINT, End Site or \"}\", found ";
  const std::string open = expected + "\"MOTION\"; hips, which began at line 2, is open";
  CHECK(complaint_about(with_replaced(good, "  }\n}\n", "  }\n")) == "line 15: " + open);
  CHECK(complaint_about(with_replaced(good, "  }\n}\n", "}\n")) ==
        "line 15: " + open + "; the braces of leg, which began at line 6, do not line up at line 14");
  CHECK(complaint_about(with_replaced(good, "    }\n  }\n", "  }\n")) ==
        "line 15: " + open + "; the braces of leg/End, which began at line 10, do not line up at line 13");
  CHECK(complaint_about("HIERARCHY\nROOT a {\n OFFSET 0 0 0\n") ==
        "line 4: " + expected + "the end of the file; a, which began at line 2, is open");
  CHECK(complaint_about("HIERARCHY\nROOT a {\n OFFSET 0 0 0 End Site {\n JOINT b") ==
        "line 4: expected OFFSET or \"}\" in an end site, found \"JOINT\"; a/End, which began at line 3, is open");
}

TEST_CASE("a value too many or too few in a row is refused with the line of that row") {
  const std::string row = "1 2 3 10 20 30 40 50 60\n", more = "1 2 3 10 20 30 40 50 60 7\n",
                    fewer = "1 2 3 10 20 30 40 50\n";
  const auto rows = [](const std::string& frames, std::initializer_list<std::string> lines) {
    std::string values;
    for (const std::string& line : lines) values += line;
    return complaint_about(with_motion(frames, ".01", values));
  };
  // The rows begin at line 19.
  CHECK(rows("4", {row, more, row, row}) == "line 20: 10 values, a frame has 9");
  CHECK(rows("4", {row, row, fewer, row}) == "line 21: 8 values, a frame has 9");
  CHECK(rows("4", {more, row, row, row}) == "line 19: 10 values, a frame has 9");
  CHECK(rows("4", {row, row, row, fewer}) == "line 22: 8 values, a frame has 9");
  CHECK(rows("4", {row, row, row, more}) == "line 22: 10 values, a frame has 9");
  CHECK(rows("4", {row, more, fewer, row}) == "line 20: 10 values, a frame has 9");
  CHECK(rows("4", {fewer, row, row, more}) == "line 19: 8 values, a frame has 9");
  CHECK(rows("2", {more, fewer}) == "line 19: 10 values, a frame has 9");
  CHECK(rows("1", {more}) == "line 19: 10 values, a frame has 9");
  CHECK(rows("3", {fewer, fewer, fewer}) == "line 19: 8 values, a frame has 9");
  // A row between two frames, and rows behind the last frame.
  CHECK(rows("2", {row, "# a comment\n", fewer, row}) == "line 21: 8 values, a frame has 9");
  CHECK(rows("12", {more, more, more, more, more, more, more, more, more, more, more, more}) ==
        "line 19: 10 values, a frame has 9, and there are more values than in 12 frames");
  // Frames of two lines.
  const std::string half = "1 2 3 10 20\n", rest = "30 40 50 60\n";
  CHECK(rows("3", {half, rest, half, "30 40 50 60 7\n", half, rest}) ==
        "line 21: the frame that begins here does not end where a line ends, as those before it do");
  CHECK(rows("3", {half, rest, half, "30 40 50\n", half, rest}) ==
        "line 21: the frame that begins here does not end where a line ends, as those before it do");
  CHECK(rows("3", {half, rest, half, rest, half, "30 40 50\n"}) == "line 25: the file ends in frame 3 of 3");
}

TEST_CASE("a skeleton without length is refused") {
  CHECK(complaint_about("HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Zrotation } MOTION Frames: 1 Frame Time: 1\n0\n")
            .find("nothing to make links of") != std::string::npos);
}

TEST_CASE("types of file that cannot hold a skeleton and that crash assimp never reach it") {
  CHECK(complaint_about("OFF\n99999999 99999999 0\n", "mesh.OFF") == "no skeleton: files of this type cannot hold one");
  CHECK(complaint_about("0 0 0 0 0 0 0 0 0\n", "mesh.raw") == "no skeleton: files of this type cannot hold one");
}

TEST_CASE("a file cut off after any byte is refused, unless only the last line end is missing") {
  const std::string good = with_motion("2", ".01", kFrame + kFrame);
  // Without its last byte the file ends in "60". Without its last two bytes it still reads, as "6".
  for (std::size_t size = 1; size < good.size() - 2; ++size) complaint_about(good.substr(0, size));
}

TEST_CASE("deep nesting and too many joints are refused without recursion") {
  std::string deep = "HIERARCHY\nROOT a\n{ OFFSET 0 1 0 CHANNELS 1 Zrotation\n";
  for (int i = 0; i < 200000; ++i) deep += "JOINT a { OFFSET 0 1 0 CHANNELS 1 Zrotation\n";
  CHECK(complaint_about(deep).find("nested more than 1024 deep") != std::string::npos);
  std::string wide = "HIERARCHY\nROOT a\n{ OFFSET 0 1 0 CHANNELS 1 Zrotation\n";
  for (int i = 0; i < 200000; ++i) wide += "JOINT a { OFFSET 0 1 0 }\n";
  CHECK(complaint_about(wide).find("more than 8192 joints") != std::string::npos);
  // Joints without channels take no bytes per frame in the file.
  std::string hollow = "HIERARCHY\nROOT a\n{ OFFSET 0 1 0 CHANNELS 1 Zrotation\n";
  for (int i = 0; i < 8000; ++i) hollow += "JOINT a { OFFSET 0 1 0 }\n";
  hollow += "}\nMOTION\nFrames: 100000\nFrame Time: 1\n";
  for (int i = 0; i < 100000; ++i) hollow += "0\n";
  CHECK(complaint_about(hollow).find("frames x joints is more than") != std::string::npos);
}

TEST_CASE("garbage is refused with a printable message under any file name") {
  std::uint64_t state = 1;
  for (const char* name : {"clip.bvh", "clip.glb", "clip.gltf", "clip.fbx", "clip.dae", "clip.x", "clip.obj",
                           "clip.md5anim", "clip.xyz", "clip"}) {
    CAPTURE(name);
    for (const std::size_t size : {1u, 7u, 100u, 5000u}) {
      std::string bytes;
      while (bytes.size() < size) bytes += static_cast<char>(next_random(state));
      const std::string text = complaint_about(bytes, name);
      CHECK(printable(text) == text);
    }
  }
  CHECK(complaint_about("\x01\xff\xc3\x28HIER", "clip.bvh") == "line 1: expected \"HIERARCHY\", found \"?\?\?(HIER\"");
}

TEST_CASE("a BVH file with any byte changed is read or refused") {
  const std::string good = with_motion("2", ".01", kFrame + kFrame);
  std::uint64_t state = 2;
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = good;
    for (int change = 0; change <= round % 3; ++change) {
      const std::string replacements = "\n\t {}-.e0149nX\xff";
      bytes[next_random(state) % bytes.size()] = replacements[next_random(state) % replacements.size()];
    }
    const TemporaryFile file("clip.bvh", bytes);
    CAPTURE(round);
    const std::string text = complaint(file.path());
    CHECK((text.empty() || text.rfind(file.path() + ": ", 0) == 0));
    CHECK(printable(text) == text);
  }
}

TEST_CASE("a glTF animation with keys that are not finite or out of range is refused, and names the key") {
  const TemporaryFile good("walk.gltf", gltf({0, 1}, {0, 1, 0, 0, 1, 0}));
  CHECK(complaint(good.path()).empty());
  const float nan = std::nanf("");
  CHECK(complaint_about(gltf({0, 1}, {0, 1, 0, nan, 1, 0}), "walk.gltf").find(": position key 1 is not finite") !=
        std::string::npos);
  CHECK(complaint_about(gltf({0, 1}, {1e30f, 1, 0, 0, 1, 0}), "walk.gltf").find(": position key 0 is out of range") !=
        std::string::npos);
  CHECK(complaint_about(gltf({0, nan}, {0, 1, 0, 0, 1, 0}), "walk.gltf").find("time") != std::string::npos);
  CHECK(complaint_about(gltf({1, 0}, {0, 1, 0, 0, 1, 0}), "walk.gltf").find("is earlier than the one before it") !=
        std::string::npos);
  CHECK(complaint_about(with_replaced(gltf({0, 1}, {0, 1, 0, 0, 1, 0}), "\"animations\"", "\"nothing\""), "walk.gltf")
            .find("no skeleton") != std::string::npos);
}

TEST_CASE("printable text keeps well-formed UTF-8 and replaces all other bytes") {
  CHECK(printable("h\xc3\xbc"
                  "fte") ==
        "h\xc3\xbc"
        "fte");
  CHECK(printable("a\nb\x7f\xc3") == "a?b?\?");
  CHECK(printable("\xed\xa0\x80\xc0\xaf\xf5") == "?\?\?\?\?\?");
}

TEST_CASE(
    "printable text has nothing that a terminal obeys, that turns the direction of writing or that has no width") {
  const auto utf8 = [](unsigned c) {
    std::string text;
    if (c < 0x80) return text + static_cast<char>(c);
    if (c >= 0x800) text += static_cast<char>(0xe0 | c >> 12);
    text += static_cast<char>(c < 0x800 ? 0xc0 | c >> 6 : 0x80 | (c >> 6 & 0x3f));
    return text + static_cast<char>(0x80 | (c & 0x3f));
  };
  CHECK(printable("bad\xc2\x9b"
                  "31mX") == "bad?31mX");
  CHECK(printable("gepj\xe2\x80\xae.bvh") == "gepj?.bvh");
  std::size_t replaced = 0;
  for (unsigned c = 1; c < 0xd800; ++c) {
    const std::string one = utf8(c), text = printable("a" + one + "b");
    if (text == "a?b" && c != '?')
      ++replaced;
    else
      CHECK(text == "a" + one + "b");
  }
  // C0, DEL and C1; ends of lines and paragraphs; Default_Ignorable_Code_Point.
  CHECK(replaced == 31 + 1 + 32 + 2 + 39);
  CHECK(printable("a\xef\xbb\xbf"
                  "b\xf3\xa0\x81\x81") == "a?b?");
}
