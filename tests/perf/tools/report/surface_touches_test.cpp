// perf/tools/report/surface_touches.h: triangles are those of the engine, and meet where long double has them.
#include "perf/tools/report/surface_touches.h"

#include <cab/cab.h>
#include <cab/record.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "perf/harness/world.h"
#include "perf/judge/oracle/random_surfaces.h"
#include "tests/perf/cli/spawn.h"
#include "tests/rounds.h"

namespace cab::tests {
namespace {

using namespace cab::oracle;
using perf::SurfaceTouch;

// How far a place may be from the planes of two triangles, in sizes of their numbers; worst measured: 1.7e-8, since
// matrices of poses are rotations to the rounding of float alone.
constexpr Real kNear = 1e-6L;

// A recording of three instances of a random skin, in which the triangles of the first frame touch.
struct RecordedSkin {
  SkinRig rig;
  Poses poses;

  RecordedSkin(Random& random, const std::string& path)
      : rig(random_skin(random, static_cast<SkinRegime>(random.index(kSkinRegimeCount)))),
        poses(random_surface_poses(random, rig, static_cast<PoseFormat>(random.index(3)), 1)) {
    for (double& x : poses.origins) x = random.uniform(-0.3, 0.3) * rig.size;
    const EnginePtr engine = make_engine({});
    ArticulationId articulation;
    require(add_articulation(*engine, rig.desc(), &articulation));
    const BatchId batch = add_instances(*engine, articulation, 3, BatchKind::kCharacters);
    const BatchInput input = poses.input(batch);
    const PairRule rules[] = {{batch, batch, Pairing::kBetween}, {batch, batch, Pairing::kWithin}};
    std::vector<Hit> hits(10000);
    FrameJob job;
    job.inputs = {&input, 1};
    job.rules = rules;
    job.policies.exact = Exact::kSurface;
    job.hits = hits;
    require(run_frame(*engine, job));
    record::Recorder recorder;
    const auto must = [&](bool ok) {
      INFO(recorder.error());
      REQUIRE(ok);
    };
    must(recorder.open(path.c_str()));
    must(recorder.add_articulation(articulation, rig.desc()));
    must(recorder.add_batch(batch, {articulation, 3, BatchKind::kCharacters}));
    must(recorder.add_frame(job, 0));
    job.policies.exact = Exact::kNone;
    must(recorder.add_frame(job, 1));
    must(recorder.close());
  }

  std::array<Point, 3> corners(std::uint32_t instance, std::uint32_t leaf, std::uint32_t triangle) const {
    const std::vector<ExactPose> exact = exact_poses(poses, instance);
    std::array<Point, 3> out;
    for (std::size_t k = 0; k < 3; ++k) {
      out[k] = skinned_vertex(rig.desc().skin, exact, rig.triangles[leaf][3 * triangle + k]);
      for (std::size_t c = 0; c < 3; ++c) out[k][c] += poses.origins[3 * std::size_t{instance} + c];
    }
    return out;
  }
};

// How far a point is from the plane of a triangle.
Real plane_distance(const std::array<Point, 3>& triangle, const Point& point) {
  const Point normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const Real length = std::sqrt(dot(normal, normal));
  return length > 0 ? std::fabs(dot(point - triangle[0], normal)) / length : 0;
}

TEST_CASE("triangles of hits are counted as the engine finds them, and lie where they meet") {
  const TemporaryFolder folder;
  const std::string path = folder / "skins.cab";
  Random random(741);
  std::size_t counted = 0, alone = 0;
  const std::uint64_t count = rounds(800);
  for (std::uint64_t round = 0; round < count; ++round) {
    CAPTURE(round);
    const RecordedSkin skin(random, path);
    record::Recording recording;
    REQUIRE(recording.open(path.c_str()));
    record::RecordedFrame frame;
    REQUIRE(recording.read_frame(0, &frame));
    record::Player player;
    REQUIRE(player.open(recording));
    REQUIRE(player.find_triangles(frame, frame.hits));
    perf::SurfaceTouches surfaces(recording);
    const std::vector<SurfaceTouch>& touches = surfaces.of(frame);
    CHECK(surfaces.error().empty());
    REQUIRE(touches.size() == frame.hits.size);
    std::vector<std::uint32_t> expected(touches.size(), 0);
    for (const TouchingTriangles& found : player.triangles()) ++expected[found.pair];
    Real size = 0;
    for (const double x : skin.poses.origins) size = std::max(size, std::fabs(Real{x}));
    for (const TouchingTriangles& found : player.triangles()) {
      const Hit& hit = frame.hits[found.pair];
      const SurfaceTouch& touch = touches[found.pair];
      REQUIRE(touch.triangles == expected[found.pair]);
      ++counted;
      if (touch.triangles > 1) continue;
      const auto a = skin.corners(hit.instance_a, found.leaf_a, found.triangle_a);
      const auto b = skin.corners(hit.instance_b, found.leaf_b, found.triangle_b);
      const Point line = cross(cross(a[1] - a[0], a[2] - a[0]), cross(b[1] - b[0], b[2] - b[0]));
      Real largest = size, side = 0;
      for (const auto* const triangle : {&a, &b})
        for (std::size_t k = 0; k < 3; ++k) {
          largest = std::max(largest, norm_1((*triangle)[k]));
          side = std::max(side, norm_1((*triangle)[k] - (*triangle)[(k + 1) % 3]));
        }
      const Real areas = side * side * side * side;
      if (norm_1(line) < 1e-3L * areas) continue;  // almost in one plane, or of almost no area
      const Point place = {{touch.place[0], touch.place[1], touch.place[2]}};
      CHECK(plane_distance(a, place) <= kNear * largest);
      CHECK(plane_distance(b, place) <= kNear * largest);
      ++alone;
    }
    REQUIRE(recording.read_frame(1, &frame));
    CHECK(surfaces.of(frame).empty());  // boxes decided
  }
  CHECK(counted >= least_count(2000, 800));
  CHECK(alone >= least_count(40, 800));
}

TEST_CASE("triangles are not looked for where a recording has a hit twice") {
  const TemporaryFolder folder;
  const std::string path = folder / "twice.cab";
  Random random(742);
  record::Recording recording;
  record::RecordedFrame frame;
  while (frame.hits.empty()) {
    const RecordedSkin skin(random, path);
    REQUIRE(recording.open(path.c_str()));
    REQUIRE(recording.read_frame(0, &frame));
  }
  std::vector<Hit> hits(frame.hits.begin(), frame.hits.end());
  hits.push_back(hits[0]);
  frame.hits = hits;
  perf::SurfaceTouches surfaces(recording);
  CHECK(surfaces.of(frame).empty());
  CHECK(surfaces.error() == "a frame has two hits of the same links");
}

TEST_CASE("triangles meet in the middle of the line that they have in common") {
  using scenes::Vec3;
  const auto near = [](const Vec3& a, const Vec3& b) {
    return std::fabs(a[0] - b[0]) + std::fabs(a[1] - b[1]) + std::fabs(a[2] - b[2]) < 1e-12;
  };
  const Vec3 flat[3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const Vec3 through[3] = {{1, 1, -1}, {1, 1, 1}, {1, 9, 0}};  // its line in the plane: from y = 1 on, to y = 3
  CHECK(near(perf::meeting_place(flat, through), {1, 2, 0}));
  CHECK(near(perf::meeting_place(through, flat), {1, 2, 0}));
  const Vec3 beside[3] = {{4, 0, 0}, {8, 0, 0}, {4, 4, 0}};  // in one plane
  CHECK(near(perf::meeting_place(flat, beside), {20.0 / 6, 8.0 / 6, 0}));
}

}  // namespace
}  // namespace cab::tests
