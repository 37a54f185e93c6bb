// Query files: what is read, and what is refused in one line that names the file, the line and the column.
#include "perf/tools/query/query_file.h"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "scenes/import/import.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using namespace cab::perf;

std::vector<Query> parse(QueryKind kind, const std::string& text) { return parse_queries(kind, text, "q.csv", 100); }

// What a text is refused for, or nothing.
std::string refusal(QueryKind kind, const std::string& text, std::size_t most = 100) {
  try {
    parse_queries(kind, text, "q.csv", most);
  } catch (const scenes::ImportError& error) { return error.what(); }
  return "";
}

// A text and how its refusal begins.
struct Refused {
  std::string text, told;
};

const std::string kRayNames = "ox,oy,oz,dx,dy,dz,length\n";

}  // namespace

TEST_CASE("each kind of query file gives the members that its columns name") {
  const Query ray = parse(QueryKind::kRay, "ox,oy,oz,dx,dy,dz,length,radius\n1,2,3,4,5,6,7,0.5\n").at(0);
  CHECK(ray.kind == QueryKind::kRay);
  CHECK(ray.position[0] == 1);
  CHECK(ray.position[1] == 2);
  CHECK(ray.position[2] == 3);
  CHECK(ray.direction[0] == 4);
  CHECK(ray.direction[1] == 5);
  CHECK(ray.direction[2] == 6);
  CHECK(ray.length == 7);
  CHECK(ray.radius == 0.5f);
  const Query sphere = parse(QueryKind::kSphere, "x,y,z,radius\n1e30,-2,3,1e18\n").at(0);
  CHECK(sphere.kind == QueryKind::kSphere);
  CHECK(sphere.position[0] == 1e30);
  CHECK(sphere.radius == 1e18f);
  const Query box = parse(QueryKind::kBox, "x,y,z,hx,hy,hz,qx,qy,qz,qw\n1,2,3,4,5,6,.1,.2,.3,.4\n").at(0);
  CHECK(box.kind == QueryKind::kBox);
  CHECK(box.half[0] == 4);
  CHECK(box.half[1] == 5);
  CHECK(box.half[2] == 6);
  CHECK(box.orientation[0] == .1f);
  CHECK(box.orientation[1] == .2f);
  CHECK(box.orientation[2] == .3f);
  CHECK(box.orientation[3] == .4f);
  const Query capsule = parse(QueryKind::kCapsule, "x,y,z,radius,half\n1,2,3,4,5\n").at(0);
  CHECK(capsule.kind == QueryKind::kCapsule);
  CHECK(capsule.radius == 4);
  CHECK(capsule.half[2] == 5);
  CHECK(capsule.orientation[3] == 1);
  const Query point = parse(QueryKind::kPoint, "x,y,z,distance\n1,2,3,inf\n").at(0);
  CHECK(point.kind == QueryKind::kPoint);
  CHECK(std::isinf(point.length));
}

TEST_CASE("columns may come in any order, with blanks, comments, CR LF and a byte order mark") {
  const std::string plain = "x,y,z,radius\n1,2,3,4\n5,6,7,8\n";
  for (const std::string& text :
       {plain, std::string("radius,z,y,x\n4,3,2,1\n8,7,6,5\n"), std::string("x y z radius\n1 2 3 4\n5 6 7 8"),
        std::string("x;y;z;radius\n 1 ; 2;3 ;+4\n5;6;7;8\n"), "\xef\xbb\xbf" + plain,
        std::string("\xef\xbb\xbfx,y,z,radius\r\n1,2,3,4\r\n\r\n5,6,7,8\r\n"),
        "# by hand\n\n" + plain + "\n# the end\n"}) {
    CAPTURE(text);
    const std::vector<Query> queries = parse(QueryKind::kSphere, text);
    REQUIRE(queries.size() == 2);
    CHECK(queries[0].position[0] == 1);
    CHECK(queries[0].position[2] == 3);
    CHECK(queries[0].radius == 4);
    CHECK(queries[1].position[1] == 6);
    CHECK(queries[1].radius == 8);
  }
}

TEST_CASE("what is wrong in a query file is named with its line and column") {
  const std::vector<Refused> bad_rays = {
      {"", "q.csv: no line names the columns ox oy oz dx dy dz length [radius]"},
      {"\xef\xbb\xbf", "q.csv: no line names the columns"},
      {"# nothing\n\n", "q.csv: no line names the columns"},
      {kRayNames, "q.csv: no rays below the line of names"},
      {"1,2,3,4,5,6,7\n", "q.csv:1: rays have no column '1'; theirs are ox oy oz dx dy dz length [radius]"},
      {"ox,oy,oz,dx,dy,dz,length,speed\n", "q.csv:1: rays have no column 'speed'"},
      {"ox,oy,oz,dx,dy,dz\n", "q.csv:1: the column length is missing"},
      {"ox,oy,oz,dx,dy,dz,length,ox\n", "q.csv:1: the column ox is there twice"},
      {kRayNames + "0,0,0,1,0,0,1\n0,0,0,1,0,0\n", "q.csv:3: 6 values for 7 columns"},
      {kRayNames + "0,0,0,1,0,0,1,0\n", "q.csv:2: 8 values for 7 columns"},
      {kRayNames + "0,0,0,1,0,zero,1\n", "q.csv:2: column 6 (dz): 'zero' is not a number"},
      {kRayNames + "0,0,0,1,0,nan,1\n", "q.csv:2: column 6 (dz): 'nan' is not a number"},
      {kRayNames + "0,0,0,1,0,inf,1\n", "q.csv:2: column 6 (dz): 'inf' is not a number"},
      {kRayNames + "0,0,0,1,0,1e39,1\n", "q.csv:2: column 6 (dz): '1e39' is not a number from -3.4e38"},
      {kRayNames + "0,0,0,1,0,,1\n", "q.csv:2: column 6 (dz): '' is not a number"},
      {kRayNames + "0,0,0,1,0,0x1,1\n", "q.csv:2: column 6 (dz): '0x1' is not a number"},
      {kRayNames + "0,0,0,1,0,1 2,1\n", "q.csv:2: column 6 (dz): '1 2' is not a number"},
      {kRayNames + "0,2e30,0,1,0,0,1\n", "q.csv:2: column 2 (oy): '2e30' is not a number from -1e30 to 1e30"},
      {kRayNames + "0,1e999,0,1,0,0,1\n", "q.csv:2: column 2 (oy): '1e999' is not a number"},
      {kRayNames + "0,inf,0,1,0,0,1\n", "q.csv:2: column 2 (oy): 'inf' is not a number"},
      {kRayNames + "0,0,0,1,0,0,-1\n", "q.csv:2: column 7 (length): '-1' is not a number from 0 to 3.4e38, or inf"},
      {kRayNames + "0,0,0,1,0,0,-inf\n", "q.csv:2: column 7 (length): '-inf' is not a number"},
      {kRayNames + "0,0,0,1,0,0,1e39\n", "q.csv:2: column 7 (length): '1e39' is not a number"},
      {kRayNames + "0,0,0,0,0,0,1\n", "q.csv:2: the direction dx dy dz is 0 0 0"},
      {kRayNames + "0,0,0,1e-60,0,0,1\n", "q.csv:2: the direction dx dy dz is 0 0 0"},
      {kRayNames + std::string("0,0,0,1,0,\0,1\n", 14), "q.csv:2: column 6 (dz): '?' is not a number"},
      {kRayNames + std::string(kMaxQueryLine + 1, ','), "q.csv:2: the line is longer than 1024 bytes"},
      {std::string(kMaxQueryLine + 1, 'x'), "q.csv:1: the line is longer than 1024 bytes"},
  };
  for (const Refused& refused : bad_rays) {
    CAPTURE(refused.text);
    CHECK(refusal(QueryKind::kRay, refused.text).rfind(refused.told, 0) == 0);
  }
  const std::string boxes = "x,y,z,hx,hy,hz,qx,qy,qz,qw\n";
  const std::vector<Refused> bad_boxes = {
      {"x,y,z,hx,hy,hz,qx,qy,qz\n", "q.csv:1: the column qw is missing"},
      {boxes + "0,0,0,1,1,1,0,0,0,0\n", "q.csv:2: the length of the quaternion qx qy qz qw is not 1e-3 to 1e3"},
      {boxes + "0,0,0,1,1,1,0,0,0,1e30\n", "q.csv:2: the length of the quaternion"},
      {boxes + "0,0,0,1,1e19,1,0,0,0,1\n", "q.csv:2: column 5 (hy): '1e19' is not a number from 0 to 1e18"},
      {boxes + "0,0,0,1,inf,1,0,0,0,1\n", "q.csv:2: column 5 (hy): 'inf' is not a number"},
  };
  for (const Refused& refused : bad_boxes) {
    CAPTURE(refused.text);
    CHECK(refusal(QueryKind::kBox, refused.text).rfind(refused.told, 0) == 0);
  }
  CHECK(refusal(QueryKind::kSphere, "x,y,z,radius\n0,0,0,inf\n").rfind("q.csv:2: column 4 (radius)", 0) == 0);
}

TEST_CASE("a ray of length 0 needs no direction") {
  CHECK(refusal(QueryKind::kRay, kRayNames + "0,0,0,0,0,0,0\n").empty());
}

TEST_CASE("no more queries are read than there may be") {
  const std::string text = "x,y,z,radius\n0,0,0,1\n0,0,0,1\n0,0,0,1\n";
  CHECK(refusal(QueryKind::kSphere, text, 3).empty());
  CHECK(refusal(QueryKind::kSphere, text, 2).rfind("q.csv:4: there are more than 4194304 queries", 0) == 0);
}

TEST_CASE("a query file that is not there, or is no file, is refused by name") {
  const TemporaryFolder folder;
  write_text(folder / "empty.csv", "");
  write_text(folder / "one.csv", "x,y,z,distance\n1,2,3,4\n");
  const auto refused = [&](const std::string& path) {
    try {
      read_queries(QueryKind::kPoint, path, 100);
    } catch (const scenes::ImportError& error) { return std::string(error.what()); }
    return std::string();
  };
  CHECK(refused(folder / "none.csv") == folder / "none.csv" + std::string(": no such file"));
  CHECK(refused(folder / "empty.csv") == folder / "empty.csv" + std::string(": the file is empty"));
  CHECK(refused(folder / ".").find("is a directory") != std::string::npos);
  CHECK(refused("/dev/zero").find("is not a regular file") != std::string::npos);
  CHECK(read_queries(QueryKind::kPoint, folder / "one.csv", 100).at(0).length == 4);
}

}  // namespace cab::tests
