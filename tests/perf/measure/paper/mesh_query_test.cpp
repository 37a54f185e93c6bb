// Exact queries on triangle meshes: bodies that touch, a body inside another, and Table 3, which has the hits of convex
// pieces.
#include "perf/measure/paper/mesh_query.h"

#include <doctest/doctest.h>

#include <array>
#include <string>
#include <vector>

#include "scenes/paper/registry.h"

namespace cab::tests {
namespace {

using namespace cab::perf;

using Pose = std::array<float, 12>;

Pose moved(float x, float y, float z) { return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}; }

// The dented link, scaled.
scenes::TriangleMesh scaled_link(float scale) {
  scenes::TriangleMesh mesh = scenes::dented_link_mesh();
  for (float& x : mesh.vertices) x *= scale;
  return mesh;
}

scenes::TriangleMesh cube(float half) {
  scenes::TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    for (int c = 0; c < 3; ++c) mesh.vertices.push_back(corner >> c & 1 ? half : -half);
  mesh.triangles = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                    2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return mesh;
}

// Whether two meshes touch. The answer must be the same for both orders.
MeshAnswer query(const MeshBody& a, const Pose& pose_a, const MeshBody& b, const Pose& pose_b) {
  const MeshAnswer answer = a.query(pose_a.data(), b, pose_b.data());
  CHECK(b.query(pose_b.data(), a, pose_a.data()) == answer);
  return answer;
}

Policies cab_policies(Exact exact) {
  Policies policies;
  policies.refit = Refit::kCab;
  policies.strategy = Strategy::kTree;
  policies.exact = exact;
  return policies;
}

struct Hits {
  std::vector<Touch> pieces, meshes;
  std::uint64_t nested_count;
};

// The hits of Table 3 among the leaf pairs of CAB.
Hits hits_of(const scenes::Scene& scene) {
  SessionOptions options;
  options.frames = {0, scene.frame_count};
  EngineSession session(scene, options);
  MeshQueries queries(scene);
  Hits hits;
  session.run(cab_policies(Exact::kFcl), true, [&](const BlockResult& block) {
    hits.pieces.insert(hits.pieces.end(), block.touches.begin(), block.touches.end());
  });
  session.run(cab_policies(Exact::kNone), false, [&](const BlockResult& block) {
    const std::vector<Touch> touching = queries.touching(block.touches);
    hits.meshes.insert(hits.meshes.end(), touching.begin(), touching.end());
  });
  hits.nested_count = queries.nested_count();
  CHECK(queries.seconds() > 0);
  return hits;
}

}  // namespace

TEST_CASE("meshes touch where their surfaces meet, and not a gap away") {
  const MeshBody cube_1(cube(1));
  const Pose rotated = {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0};
  CHECK(query(cube_1, moved(0, 0, 0), cube_1, moved(1.9f, .3f, .2f)) == MeshAnswer::kSurfacesMeet);
  CHECK(query(cube_1, moved(0, 0, 0), cube_1, moved(2.01f, .3f, .2f)) == MeshAnswer::kApart);
  CHECK(query(cube_1, rotated, cube_1, moved(0, 1.9f, 0)) == MeshAnswer::kSurfacesMeet);
  CHECK(query(cube_1, rotated, cube_1, moved(0, 2.01f, 0)) == MeshAnswer::kApart);
}

TEST_CASE("a body wholly inside another touches it, whichever is asked first") {
  const MeshBody link(scenes::dented_link_mesh()), large(cube(10)), small(scaled_link(.01f));
  CHECK(query(link, moved(0, 0, 0), large, moved(1, 2, 3)) == MeshAnswer::kNested);
  CHECK(query(link, moved(0, 0, 0), large, moved(12, 2, 3)) == MeshAnswer::kSurfacesMeet);
  CHECK(query(link, moved(0, 0, 0), large, moved(14, 2, 3)) == MeshAnswer::kApart);
  // The wall of the link below its dent: the surfaces are at z = -.2 and -.1 in the middle.
  CHECK(query(link, moved(0, 0, 0), small, moved(0, 0, -.14f)) == MeshAnswer::kNested);
}

TEST_CASE("a body in the dent is inside the link's hull and does not touch") {
  const MeshBody link(scenes::dented_link_mesh()), small(scaled_link(.01f));
  CHECK(query(link, moved(0, 0, 0), small, moved(0, 0, .1f)) == MeshAnswer::kApart);
  CHECK(query(link, moved(0, 0, 0), small, moved(0, 0, .3f)) == MeshAnswer::kApart);
}

TEST_CASE("Table 3 in full has the same hits on meshes as on convex pieces") {
  const scenes::Scene scene = scenes::make_paper_scene(3, 10000);
  const Hits hits = hits_of(scene);
  CHECK(hits.pieces.size() == 195);
  CHECK(hits.meshes.size() == 195);
  CHECK(hits.nested_count == 0);
  for (const std::string& difference : differing_hits(scene, hits.pieces, hits.meshes)) FAIL_CHECK(difference);
}

TEST_CASE("hits that one list lacks are told by frame, links and depth, the first few of them") {
  const scenes::Scene scene = scenes::make_paper_scene(3, 16);
  std::vector<Touch> pieces, meshes;
  for (std::uint32_t frame = 0; frame < 12; ++frame) pieces.push_back({frame, 0, 2, 1, 3, {}});
  meshes = pieces;
  CHECK(differing_hits(scene, pieces, meshes).empty());
  meshes[4].link_b = 5;
  pieces[4].contact.depth = .25f;
  const std::vector<std::string> two = differing_hits(scene, pieces, meshes);
  REQUIRE(two.size() == 2);
  CHECK(two[0] == "frame 4, chain - link 2 and chain + link 3, on pieces alone, depth 0.25");
  CHECK(two[1] == "frame 4, chain - link 2 and chain + link 5, on meshes alone");
  const std::vector<std::string> many = differing_hits(scene, pieces, {});
  REQUIRE(many.size() == 6);
  CHECK(many.back() == "7 more");
}

TEST_CASE("a scene of other links than dented ones is refused") {
  for (const std::uint32_t table : {1u, 2u, 4u, 5u}) {
    const scenes::Scene scene = scenes::make_paper_scene(table, 16);
    CAPTURE(table);
    CHECK_THROWS_AS(MeshQueries{scene}, std::runtime_error);
  }
}

}  // namespace cab::tests
