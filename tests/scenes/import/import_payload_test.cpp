// Skeletons and trajectories as bytes.
#include "scenes/import/import_payload.h"

#include "scenes/sandbox/payload.h"

#include <doctest/doctest.h>

namespace {

using namespace cab::scenes;

Skeleton made_skeleton() {
  Skeleton s;
  s.joint_names = {"hips", "leg"};
  s.joint_parents = {-1, 0};
  s.is_end_site = {false, true};
  s.rest_offsets = {0, 0, 0, 0, -1, 0};
  s.frame_seconds = .01;
  s.frame_count = 2;
  s.rotations = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 0};
  s.positions = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  s.is_static = true;
  s.skin.vertices = {0, 1, 2};
  s.skin.triangles = {0, 0, 0};
  s.skin.influence_count = 2;
  s.skin.influence_bones = {0, 1};
  s.skin.influence_weights = {.25f, .75f};
  s.skin.inverse_bind = {1, 2, 3};
  s.skin.bone_joints = {1, 0};
  s.skin.bone_meshes = {0, 1};
  s.skin.mesh_names = {"coat", "man"};
  s.skin.stretches = std::vector<float>(24, .5f);
  s.unit = {.0254, UnitSource::kGuessed};
  s.notes = {"one", "two"};
  s.alterations = {{AlterationKind::kDropped, "joints", 2, "one"}, {AlterationKind::kGuessed, "caps", 1, ""}};
  return s;
}

}  // namespace

TEST_CASE("a skeleton is the same after its way through bytes") {
  const Skeleton s = made_skeleton(), read = read_skeleton_payload(skeleton_payload(s));
  CHECK(read.joint_names == s.joint_names);
  CHECK(read.joint_parents == s.joint_parents);
  CHECK(read.is_end_site == s.is_end_site);
  CHECK(read.rest_offsets == s.rest_offsets);
  CHECK(read.frame_seconds == s.frame_seconds);
  CHECK(read.frame_count == s.frame_count);
  CHECK(read.rotations == s.rotations);
  CHECK(read.positions == s.positions);
  CHECK(read.is_static == s.is_static);
  CHECK(read.skin.vertices == s.skin.vertices);
  CHECK(read.skin.triangles == s.skin.triangles);
  CHECK(read.skin.influence_count == s.skin.influence_count);
  CHECK(read.skin.influence_bones == s.skin.influence_bones);
  CHECK(read.skin.influence_weights == s.skin.influence_weights);
  CHECK(read.skin.inverse_bind == s.skin.inverse_bind);
  CHECK(read.skin.bone_joints == s.skin.bone_joints);
  CHECK(read.skin.bone_meshes == s.skin.bone_meshes);
  CHECK(read.skin.mesh_names == s.skin.mesh_names);
  CHECK(read.skin.stretches == s.skin.stretches);
  CHECK(read.unit.metres == s.unit.metres);
  CHECK(read.unit.source == s.unit.source);
  CHECK(read.notes == s.notes);
  REQUIRE(read.alterations.size() == s.alterations.size());
  for (std::size_t a = 0; a < s.alterations.size(); ++a) {
    CHECK(read.alterations[a].kind == s.alterations[a].kind);
    CHECK(read.alterations[a].what == s.alterations[a].what);
    CHECK(read.alterations[a].count == s.alterations[a].count);
    CHECK(read.alterations[a].note == s.alterations[a].note);
  }
}

TEST_CASE("a skeleton whose arrays do not fit its joints and frames is refused") {
  const auto refused = [](auto change) {
    Skeleton s = made_skeleton();
    change(s);
    CHECK_THROWS_AS(read_skeleton_payload(skeleton_payload(s)), PayloadError);
  };
  refused([](Skeleton& s) { s = {}; });
  refused([](Skeleton& s) { s.joint_names.pop_back(); });
  refused([](Skeleton& s) { s.joint_parents.pop_back(); });
  refused([](Skeleton& s) { s.is_end_site.pop_back(); });
  refused([](Skeleton& s) { s.rest_offsets.pop_back(); });
  refused([](Skeleton& s) { s.rotations.pop_back(); });
  refused([](Skeleton& s) { s.positions.push_back(0); });
  refused([](Skeleton& s) { s.frame_count = 0; });
  refused([](Skeleton& s) { s.frame_count = 0x80000002u; });  // its products overflow 32 bits to those of 2
  for (const std::int32_t parent : {-2, -1, 1, 2}) refused([&](Skeleton& s) { s.joint_parents[1] = parent; });
  refused([](Skeleton& s) { s.joint_parents[0] = 0; });
  refused([](Skeleton& s) { s.skin.stretches.pop_back(); });
  refused([](Skeleton& s) { s.skin.bone_meshes.pop_back(); });
  refused([](Skeleton& s) { s.skin.bone_meshes[1] = 2; });
  for (const double metres : {0.0, -1.0, std::nan("")}) refused([&](Skeleton& s) { s.unit.metres = metres; });
  refused([](Skeleton& s) { s.unit.source = static_cast<UnitSource>(4); });
  refused([](Skeleton& s) { s.alterations[0].kind = static_cast<AlterationKind>(4); });
}

TEST_CASE("names and notes that a child process sends are printed as one line") {
  Skeleton s = made_skeleton();
  s.joint_names[1] = "leg\n\x1b[2J";
  s.notes[0] = "fine\ncab: all is well";
  const Skeleton read = read_skeleton_payload(skeleton_payload(s));
  CHECK(read.joint_names[1] == "leg??[2J");
  CHECK(read.notes[0] == "fine?cab: all is well");
}

TEST_CASE("trajectories are the same after their way through bytes, and must fit their samples") {
  Trajectories two;
  two.tracks = {{{0, 1}, {1, 2, 3, 4}, {.5, .6}}, {{0, 1, 2}, {1, 2, 3, 4, 5, 6}, {.7, .8, .9}}};
  two.notes = {"one"};
  const Trajectories read = read_trajectories_payload(trajectories_payload(two));
  CHECK(read.notes == two.notes);
  REQUIRE(read.tracks.size() == 2);
  for (std::size_t t = 0; t < 2; ++t) {
    CHECK(read.tracks[t].seconds == two.tracks[t].seconds);
    CHECK(read.tracks[t].places == two.tracks[t].places);
    CHECK(read.tracks[t].headings == two.tracks[t].headings);
  }
  two.tracks[1].places.pop_back();
  CHECK_THROWS_AS(read_trajectories_payload(trajectories_payload(two)), PayloadError);
  two.tracks[1] = {{0}, {1, 2}, {3}};
  CHECK_THROWS_AS(read_trajectories_payload(trajectories_payload(two)), PayloadError);
}
