// The connected parts of skins: how many, which are closed, which vertices and links they have, and balls about them.
#include "layout/surface_parts.h"

#include "layout/arena.h"
#include "layout/articulation.h"
#include "tests/layout/closed_skin.h"

#include <doctest/doctest.h>

#include <cstring>
#include <iterator>
#include <set>

namespace cab::tests {
namespace {

struct Built {
  Arena arena{default_allocator()};
  Articulation articulation;

  explicit Built(const SkinRig& rig) {
    REQUIRE(build_articulation(rig.desc(), arena, &articulation, nullptr) == Status::kOk);
  }
  const SurfaceParts& parts() const { return articulation.surface_parts; }
};

// For every triangle of every leaf the part that it is in, or kNoPart: by leaf, then by its place in Leaf::triangles.
std::vector<std::vector<std::uint32_t>> parts_of_triangles(const Articulation& articulation, const SkinRig& rig) {
  std::vector<std::vector<std::uint32_t>> out;
  const SurfaceLeaves& surface = articulation.surface;
  for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) {
    out.emplace_back(rig.triangles[leaf].size() / 3, kNoPart);
    if (articulation.surface_parts.closed_part.empty()) continue;
    const SurfaceLeaf& of = surface.leaves[leaf];
    for (std::uint32_t p = of.patch_begin; p < of.patch_begin + of.patch_count; ++p)
      for (std::uint32_t lane = 0; lane < surface.patches[p].count; ++lane)
        out.back()[surface.patches[p].triangle[lane]] =
            articulation.surface_parts.closed_part[std::size_t{kLanes} * p + lane];
  }
  return out;
}

Mesh scaled_ball(unsigned times, double radius) {
  Mesh out = ball_mesh(times);
  for (Vec3<double>& v : out.vertices) v = radius * v;
  return out;
}

Mesh moved(Mesh mesh, const Vec3<double>& by) {
  for (Vec3<double>& v : mesh.vertices) v = v + by;
  return mesh;
}

}  // namespace

TEST_CASE("parts are what vertices in common connect, across leaves, and closed where edges are even") {
  Random random(421);
  Mesh mesh = moved(ball_mesh(2), {{0, 0, 0}});
  mesh.add(moved(ball_mesh(1), {{3, 0, 0}}));
  Mesh open = moved(ball_mesh(1), {{6, 0, 0}});
  open.triangles.pop_back();
  mesh.add(open);
  Mesh turned = moved(ball_mesh(0), {{9, 0, 0}});
  std::swap(turned.triangles[0][1], turned.triangles[0][2]);
  mesh.add(turned);
  const SkinRig rig = rig_of(mesh, 5, 2.5, 13, &random);
  const Built built(rig);
  const SurfaceParts& parts = built.parts();
  REQUIRE(parts.parts.size == 4);
  CHECK(parts.parts[0].turns_one_way);
  CHECK(parts.parts[1].turns_one_way);
  CHECK_FALSE(parts.parts[3].turns_one_way);
  // Each triangle is in the part of its place along x, or in none if that is open.
  const std::vector<std::vector<std::uint32_t>> of = parts_of_triangles(built.articulation, rig);
  std::set<std::uint32_t> links[4];
  for (std::size_t leaf = 0; leaf < of.size(); ++leaf)
    for (std::size_t t = 0; t < of[leaf].size(); ++t) {
      const double x = mesh.vertices[rig.triangles[leaf][3 * t]][0];
      const auto part = static_cast<std::uint32_t>(std::lround(x / 3));
      CHECK(of[leaf][t] == (part == 2 ? kNoPart : part));
      links[part].insert(rig.leaves[leaf].link);
    }
  for (std::size_t part = 0; part < 4; ++part) {
    const SurfacePart& one = parts.parts[part];
    REQUIRE(one.link_count == links[part].size());
    std::size_t at = 0;
    for (const std::uint32_t link : links[part]) CHECK(parts.links[one.link_begin + at++] == link);
    // Its vertices are those that are farthest along the axes, and one of the nearest to its middle.
    const double middle = 3 * static_cast<double>(part);
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 2; ++k) {
        const double reach = mesh.vertices[one.ends[2 * c + k]][c] - (c == 0 ? middle : 0);
        CHECK(reach == doctest::Approx(k == 0 ? -1 : 1));
      }
    const std::vector<std::uint32_t>& corners = rig.triangles[one.leaf];
    CHECK(std::count(corners.begin(), corners.end(), one.middle) > 0);
    for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf)
      if (std::count(rig.triangles[leaf].begin(), rig.triangles[leaf].end(), one.middle) > 0)
        CHECK(std::make_pair(rig.leaves[one.leaf].link, std::size_t{one.leaf}) <=
              std::make_pair(rig.leaves[leaf].link, leaf));
  }
}

TEST_CASE("balls hold every vertex of closed parts where each link moves it") {
  Random random(422);
  for (int round = 0; round < 20; ++round) {
    const Mesh mesh = lump_mesh(random, 2, {{3, 1, 1}}, {{2, 0, 0}});
    const SkinRig rig = rig_of(mesh, 4, 1.5, 30, round % 2 ? &random : nullptr);
    const Built built(rig);
    const SurfaceParts& parts = built.parts();
    REQUIRE(parts.leaves.size == rig.leaves.size());
    std::size_t held = 0;
    for (const ClosedLeaf& leaf : parts.leaves)
      for (const std::uint32_t vertex : rig.triangles[leaf.leaf])
        for (std::size_t i = 0; i < rig.influence_count; ++i) {
          const std::size_t influence = std::size_t{vertex} * rig.influence_count + i;
          if (rig.weights[influence] == 0) continue;
          const std::uint32_t link = rig.links[influence];
          const double at[3] = {static_cast<double>(rig.vertices[3 * vertex]) - 1.5 * link,
                                static_cast<double>(rig.vertices[3 * vertex + 1]),
                                static_cast<double>(rig.vertices[3 * vertex + 2])};
          const auto holds = [&](const LinkBall& ball) {
            double square = 0;
            for (std::size_t c = 0; c < 3; ++c) {
              const double away = at[c] - static_cast<double>(ball.center[c]);
              square += away * away;
            }
            return ball.link == link && std::sqrt(square) <= static_cast<double>(ball.reach) * (1 + 1e-12);
          };
          const LinkBall* const first = parts.balls.data + leaf.ball_begin;
          CHECK(std::any_of(first, first + leaf.ball_count, holds));
          CHECK(std::any_of(parts.all.begin(), parts.all.end(), holds));
          ++held;
        }
    CHECK(held > 300);
    // Influences of a link that are given apart, and triangles that leaves have twice, change no ball.
    SkinRig twice = rig;
    twice.influence_count = 2 * rig.influence_count;
    twice.links.clear();
    twice.weights.clear();
    for (std::size_t i = 0; i < rig.links.size(); ++i)
      for (const float share : {0.25f, 0.75f}) {
        twice.links.push_back(rig.links[i]);
        twice.weights.push_back(share * rig.weights[i]);
      }
    for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) {
      std::vector<std::uint32_t>& corners = twice.triangles[leaf];
      corners.insert(corners.end(), rig.triangles[leaf].begin(), rig.triangles[leaf].end());
      twice.leaves[leaf].triangles = corners;
    }
    const Built again(twice);
    for (const auto list : {&SurfaceParts::balls, &SurfaceParts::all}) {
      const Span<const LinkBall> a = parts.*list, b = again.parts().*list;
      REQUIRE(a.size == b.size);
      CHECK(std::memcmp(a.data, b.data, a.size * sizeof(LinkBall)) == 0);
    }
  }
}

TEST_CASE("the links that all closed parts have are listed, however open parts are") {
  // Two closed parts along the first two links, and an open one far along.
  Mesh mesh = scaled_ball(2, 1);
  mesh.add(moved(scaled_ball(1, 0.5), {{0.7, 3, 0}}));
  Mesh open = moved(ball_mesh(1), {{6, 0, 0}});
  open.triangles.pop_back();
  mesh.add(open);
  const Built built(rig_of(mesh, 5, 0.5, 5));
  const SurfaceParts& parts = built.parts();
  REQUIRE(parts.parts.size == 3);
  const auto links_of = [&parts](const SurfacePart& part) {
    const std::uint16_t* const first = parts.links.data + part.link_begin;
    return std::set<std::uint16_t>(first, first + part.link_count);
  };
  const SurfacePart& last = parts.parts[2];
  const std::uint16_t* const common = parts.links.data + last.link_begin + last.link_count;
  const std::set<std::uint16_t> a = links_of(parts.parts[0]), b = links_of(parts.parts[1]);
  std::vector<std::uint16_t> both;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  CHECK(both.size() >= 2);
  CHECK(both.size() < a.size());
  CHECK(std::equal(common, parts.links.end(), both.begin(), both.end()));
}

TEST_CASE("a ball reaches to the farthest vertex that its link moves, and no further") {
  Random random(423);
  const SkinRig rig = rig_of(lump_mesh(random, 2, {{3, 1, 1}}, {{2, 0, 0}}), 4, 1.5, 30);
  const Built built(rig);
  const SurfaceParts& parts = built.parts();
  REQUIRE(!parts.all.empty());
  for (const LinkBall& ball : parts.all) {
    double farthest = 0;
    for (std::size_t i = 0; i < rig.links.size(); ++i) {
      if (rig.links[i] != ball.link || rig.weights[i] == 0) continue;
      double square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double at = static_cast<double>(rig.vertices[i / 2 * 3 + c]) - (c == 0 ? 1.5 * ball.link : 0);
        square += (at - static_cast<double>(ball.center[c])) * (at - static_cast<double>(ball.center[c]));
      }
      farthest = std::max(farthest, std::sqrt(square));
    }
    CHECK(static_cast<double>(ball.reach) == doctest::Approx(farthest).epsilon(1e-6));
  }
}

TEST_CASE("a skin without closed parts keeps no lists for them") {
  Mesh open = ball_mesh(1);
  open.triangles.pop_back();
  const Built built(rig_of(open, 2, 1, 10));
  CHECK(built.parts().parts.size == 1);
  CHECK(built.parts().leaves.empty());
  CHECK(built.parts().closed_part.empty());
  CHECK(built.parts().balls.empty());
}

}  // namespace cab::tests
