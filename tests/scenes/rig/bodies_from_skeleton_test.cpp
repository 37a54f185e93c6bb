// Bodies from skeletons in plain arrays: an engine takes them, bad input is refused, and imported clips agree.
#include "tests/scenes/rig/stick_figure.h"

#include <cab/cab.h>
#include <cab/rig.h>
#include <doctest/doctest.h>

#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace cab::tests {
namespace {

using rig::Bodies;
using rig::bodies_from_skeleton;

// A person of plain arrays in one pose.
struct Person {
  Person() {
    for (const std::string& name : figure.joint_names) names.push_back(name.c_str());
    for (std::size_t j = 0; j < names.size(); ++j) {
      poses.insert(poses.end(), {0, 0, 0, 1});
      for (std::size_t k = 0; k < 3; ++k) poses.push_back(static_cast<float>(figure.positions[3 * j + k]));
    }
    desc.parents = figure.joint_parents;
    desc.names = names;
    desc.poses.data = poses.data();
  }

  scenes::Skeleton figure = stick_figure();
  std::vector<const char*> names;
  std::vector<float> poses;
  rig::SkeletonDesc desc;
};

}  // namespace

TEST_CASE("an engine takes the bodies of plain arrays, and every joint is a link") {
  const Person person;
  Bodies bodies;
  REQUIRE(bodies_from_skeleton(person.desc, {}, &bodies) == rig::Status::kOk);
  CHECK(bodies.desc().link_parents.size == person.names.size());
  Engine* engine = nullptr;
  REQUIRE(create_engine({}, &engine) == Status::kOk);
  ArticulationId id;
  CHECK(add_articulation(*engine, bodies.desc(), &id) == Status::kOk);
  destroy_engine(engine);

  Bodies moved = std::move(bodies);
  CHECK(moved.desc().leaves.size > 10);
  CHECK(bodies.desc().leaves.size == 0);
}

TEST_CASE("plain arrays and an imported clip of the same figure give the same bodies") {
  const Person person;
  Bodies bodies;
  REQUIRE(bodies_from_skeleton(person.desc, {}, &bodies) == rig::Status::kOk);
  const scenes::Character figure = scenes::make_clip(person.figure, "person", {}).character;
  const ArticulationDesc desc = bodies.desc();
  REQUIRE(desc.leaves.size == figure.leaves.size());
  for (std::size_t l = 0; l < desc.leaves.size; ++l) {
    const Leaf& leaf = desc.leaves[l];
    const scenes::BodyLeaf& other = figure.leaves[l];
    CHECK(person.figure.joint_names[leaf.link] == figure.link_names[other.link]);
    REQUIRE(leaf.parts.size == other.parts.size());
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(leaf.box.half[k] == doctest::Approx(static_cast<double>(other.box.half[k])).epsilon(1e-5));
  }
  std::set<std::pair<std::string, std::string>> pairs, others;
  for (const LinkPair& pair : desc.ignored_pairs)
    pairs.emplace(person.figure.joint_names[pair.a], person.figure.joint_names[pair.b]);
  for (const LinkPair& pair : figure.ignored_pairs)
    others.emplace(figure.link_names[pair.a], figure.link_names[pair.b]);
  CHECK(pairs == others);
}

TEST_CASE("the format and the strides of the poses do not matter") {
  const Person person;
  Bodies bodies;
  REQUIRE(bodies_from_skeleton(person.desc, {}, &bodies) == rig::Status::kOk);
  std::vector<float> rows, columns;
  for (std::size_t j = 0; j < person.names.size(); ++j) {
    const float* const p = person.poses.data() + 7 * j + 4;
    rows.insert(rows.end(), {1, 0, 0, p[0], 0, 1, 0, p[1], 0, 0, 1, p[2], 99});
    columns.insert(columns.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, p[0], p[1], p[2], 1});
  }
  for (const PoseView& poses : {PoseView{PoseFormat::kMatrix3x4Rows, rows.data(), 13 * sizeof(float), 0},
                                PoseView{PoseFormat::kMatrix4x4Columns, columns.data(), 0, 0}}) {
    rig::SkeletonDesc desc = person.desc;
    desc.poses = poses;
    Bodies same;
    REQUIRE(bodies_from_skeleton(desc, {}, &same) == rig::Status::kOk);
    REQUIRE(same.desc().leaves.size == bodies.desc().leaves.size);
    for (std::size_t l = 0; l < same.desc().leaves.size; ++l)
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(same.desc().leaves[l].box.half[k] == bodies.desc().leaves[l].box.half[k]);
  }
}

TEST_CASE("several roots are taken, and nothing joins them") {
  const std::int32_t parents[] = {-1, 0, -1, 2};
  const float poses[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 9, 0, 0, 0, 0, 0, 1, 9, 1, 0};
  rig::SkeletonDesc desc;
  desc.parents = {parents, 4};
  desc.poses.data = poses;
  Bodies bodies;
  REQUIRE(bodies_from_skeleton(desc, {}, &bodies) == rig::Status::kOk);
  CHECK(bodies.desc().link_parents[2] == 0);
  for (const Leaf& leaf : bodies.desc().leaves)
    for (std::size_t k = 0; k < 3; ++k) CHECK(leaf.box.half[k] < 1);
}

TEST_CASE("bad skeletons are refused, and bodies stay as they were") {
  const Person person;
  const auto status = [](const rig::SkeletonDesc& desc, const rig::SkeletonOptions& options = {}) {
    Bodies bodies;
    const rig::Status answer = bodies_from_skeleton(desc, options, &bodies);
    CHECK(bodies.desc().leaves.size == 0);
    return answer;
  };
  rig::SkeletonDesc desc = person.desc;
  desc.parents = {};
  CHECK(status(desc) == rig::Status::kBadJoints);
  const std::vector<std::int32_t> many(kMaxLinks + 1, -1);
  desc.parents = many;
  CHECK(status(desc) == rig::Status::kBadJoints);
  for (const auto& [joint, parent] : {std::pair(0, 0), std::pair(1, 1), std::pair(2, -2)}) {
    std::vector<std::int32_t> parents = person.figure.joint_parents;
    parents[static_cast<std::size_t>(joint)] = parent;
    desc.parents = parents;
    CHECK(status(desc) == rig::Status::kBadParents);
  }
  desc = person.desc;
  desc.names.size -= 1;
  CHECK(status(desc) == rig::Status::kBadNames);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<float> poses = person.poses;
    poses.back() = bad;
    desc = person.desc;
    desc.poses.data = poses.data();
    CHECK(status(desc) == rig::Status::kBadPoses);
  }
  desc = person.desc;
  desc.poses.format = static_cast<PoseFormat>(7);
  CHECK(status(desc) == rig::Status::kBadPoses);
  desc = person.desc;
  desc.poses.link_stride = 8;
  CHECK(status(desc) == rig::Status::kBadPoses);
  desc = person.desc;
  desc.poses.data = nullptr;
  CHECK(status(desc) == rig::Status::kBadPoses);
  desc = person.desc;
  desc.pose_count = 0;
  CHECK(status(desc) == rig::Status::kBadPoses);
  std::vector<float> mirrored(12 * person.names.size(), 0);
  for (std::size_t j = 0; j < person.names.size(); ++j) {
    mirrored[12 * j] = -1;
    mirrored[12 * j + 5] = mirrored[12 * j + 10] = 1;
  }
  desc = person.desc;
  desc.poses = {PoseFormat::kMatrix3x4Rows, mirrored.data(), 0, 0};
  CHECK(status(desc) == rig::Status::kBadPoses);
  CHECK(status(person.desc, {-1, 1}) == rig::Status::kBadSize);
  CHECK(status(person.desc, {0, 0}) == rig::Status::kBadSize);
  const std::vector<float> one_place(7 * person.names.size(), 1);
  desc = person.desc;
  desc.poses.data = one_place.data();
  CHECK(status(desc) == rig::Status::kNothingToCover);
}

TEST_CASE("null arrays, a null output and strides beyond all memory are refused") {
  const std::int32_t parents[] = {-1, 0, 1};
  const float poses[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0};
  rig::SkeletonDesc good;
  good.parents = parents;
  good.poses.data = poses;
  Bodies bodies;
  const auto status = [&](const rig::SkeletonDesc& desc) { return bodies_from_skeleton(desc, {}, &bodies); };
  CHECK(bodies_from_skeleton(good, {}, nullptr) == rig::Status::kBadOutput);
  rig::SkeletonDesc desc = good;
  desc.parents.data = nullptr;
  CHECK(status(desc) == rig::Status::kBadParents);
  desc = good;
  desc.names.size = 3;
  CHECK(status(desc) == rig::Status::kBadNames);
  desc = good;
  // Twice this stride is 0 in std::size_t.
  desc.poses.link_stride = std::numeric_limits<std::size_t>::max() / 2 + 1;
  CHECK(status(desc) == rig::Status::kBadPoses);
  desc.poses.instance_stride = 28;
  CHECK(status(desc) == rig::Status::kBadPoses);
  desc = good;
  desc.poses.instance_stride = 80;
  CHECK(status(desc) == rig::Status::kBadPoses);
  CHECK(status(good) == rig::Status::kOk);
}

TEST_CASE("quaternions with a scale are refused, as frames refuse them") {
  const Person person;
  rig::SkeletonDesc desc = person.desc;
  desc.poses.has_scale = true;
  Bodies bodies;
  CHECK(bodies_from_skeleton(desc, {}, &bodies) == rig::Status::kBadPoses);
}

TEST_CASE("an engine takes all bodies of any size, and sizes that it does not take are refused") {
  Engine* engine = nullptr;
  REQUIRE(create_engine({}, &engine) == Status::kOk);
  int made = 0, refused = 0;
  for (const float unit : {1e-40f, 1e-25f, 1e-10f, 1.0f, 1e10f, 1e17f}) {
    Person person;
    for (std::size_t j = 0; j < person.names.size(); ++j)
      for (std::size_t k = 4; k < 7; ++k) person.poses[7 * j + k] *= unit / 2;  // the figure is 1.8 high
    for (const float stature : {0.0f, 1e-30f, 1.0f, 1e30f}) {
      for (const float thickness : {1e-40f, 1e-30f, 1e-6f, 1.0f, 1e6f, 1e30f}) {
        CAPTURE(unit);
        CAPTURE(stature);
        CAPTURE(thickness);
        Bodies bodies;
        const rig::Status status = bodies_from_skeleton(person.desc, {stature, thickness}, &bodies);
        if (status == rig::Status::kOk) {
          ArticulationId id;
          CHECK(add_articulation(*engine, bodies.desc(), &id) == Status::kOk);
          ++made;
        } else {
          CHECK(status == rig::Status::kBadSize);
          ++refused;
        }
        const bool is_plain = stature == 0 && thickness == 1;
        if (is_plain) CHECK(status == rig::Status::kOk);
      }
    }
  }
  CHECK(made > 40);
  CHECK(refused > 40);
  destroy_engine(engine);
}

TEST_CASE("bodies that were moved elsewhere are empty") {
  const Person person;
  Bodies bodies, other;
  REQUIRE(bodies_from_skeleton(person.desc, {}, &bodies) == rig::Status::kOk);
  REQUIRE(bodies_from_skeleton(person.desc, {}, &other) == rig::Status::kOk);
  bodies = std::move(other);
  CHECK(bodies.desc().leaves.size > 10);
  CHECK(other.desc().leaves.size == 0);
  Bodies& same = bodies;
  bodies = std::move(same);
  CHECK(bodies.desc().leaves.size > 10);
}

}  // namespace cab::tests
