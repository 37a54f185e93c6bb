#include "scenes/crowd/level.h"

#include "scenes/crowd/crowd.h"
#include "scenes/scene_list.h"

#include <doctest/doctest.h>

#include <cab/cab.h>

#include <algorithm>
#include <cstring>

namespace cab::tests {

using scenes::Level;
using scenes::LevelKind;

TEST_CASE("a level has about as many bodies as asked for, all on its square") {
  for (const std::uint32_t count : {1u, 2u, 50u, 10000u}) {
    const Level boxes = scenes::level_of(LevelKind::kBoxes, count, 100);
    CHECK(boxes.count() == count);
    for (const StaticBody& body : boxes.bodies) {
      CHECK((body.origin[0] >= 0 && body.origin[0] <= 100 && body.origin[1] >= 0 && body.origin[1] <= 100));
      CHECK(body.origin[2] == static_cast<double>(body.box.half[2]));  // it stands on the ground
    }
    const Level ground = scenes::level_of(LevelKind::kTriangles, count, 100);
    CHECK(ground.count() >= count);
    CHECK(ground.count() <= count + 300);
    for (std::size_t v = 0; v < ground.vertices.size(); v += 3) {
      CHECK((ground.vertices[v] >= 0 && ground.vertices[v] <= 100.001f));
      CHECK((ground.vertices[v + 2] >= -.3f && ground.vertices[v + 2] <= .05f));
    }
    for (const std::uint32_t corner : ground.triangles) CHECK(corner < ground.vertices.size() / 3);
  }
}

TEST_CASE("the ground's triangles cover its square once, and face upwards") {
  const Level ground = scenes::level_of(LevelKind::kTriangles, 72, 6);
  double area = 0;
  for (std::size_t t = 0; t < ground.triangles.size(); t += 3) {
    const auto at = [&](std::size_t i, std::size_t c) {
      return static_cast<double>(ground.vertices[3 * ground.triangles[t + i] + c]);
    };
    const double twice = (at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(1, 1) - at(0, 1)) * (at(2, 0) - at(0, 0));
    CHECK(twice > 0);
    area += twice / 2;
  }
  CHECK(area == doctest::Approx(36));
}

TEST_CASE("a level is the same whenever it is made, and an engine takes it") {
  for (const LevelKind kind : {LevelKind::kBoxes, LevelKind::kTriangles}) {
    const Level one = scenes::level_of(kind, 300, 17), two = scenes::level_of(kind, 300, 17);
    CHECK(one.vertices == two.vertices);
    CHECK(one.triangles == two.triangles);
    REQUIRE(one.bodies.size() == two.bodies.size());
    for (std::size_t i = 0; i < one.bodies.size(); ++i) {
      CHECK(std::memcmp(&one.bodies[i].box, &two.bodies[i].box, sizeof(Box)) == 0);
      CHECK(std::equal(one.bodies[i].origin, one.bodies[i].origin + 3, two.bodies[i].origin));
    }
    Engine* engine = nullptr;
    REQUIRE(create_engine({}, &engine) == Status::kOk);
    BatchId id;
    CHECK(add_static_batch(*engine, one.desc(), &id) == Status::kOk);
    destroy_engine(engine);
  }
}

TEST_CASE("scene `level` is the crowd of `uniform`, and a level") {
  scenes::CrowdSources sources;
  sources.level = LevelKind::kTriangles;
  const scenes::Crowd level = scenes::make_crowd("level", 50, sources), uniform = scenes::make_crowd("uniform", 50, {});
  CHECK(level.count() == 50);
  CHECK(level.level.count() >= 50);
  CHECK(uniform.level.count() == 0);
  std::vector<scenes::PosedGroup> of_level, of_uniform;
  scenes::pose_crowd(level, .5, of_level);
  scenes::pose_crowd(uniform, .5, of_uniform);
  CHECK(scenes::pose_hash(of_level) == scenes::pose_hash(of_uniform));
}

}  // namespace cab::tests
