#include "layout/find_parts.h"

#include "layout/rounded_up.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

namespace cab {
namespace {

using Double3 = std::array<double, 3>;

// Bounds of points.
struct Bounds {
  Double3 lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void add(const Double3& at) {
    for (std::size_t c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], at[c]);
      hi[c] = std::max(hi[c], at[c]);
    }
  }
  Double3 middle() const { return {0.5 * lo[0] + 0.5 * hi[0], 0.5 * lo[1] + 0.5 * hi[1], 0.5 * lo[2] + 0.5 * hi[2]}; }
};

double distance(const Double3& a, const Double3& b) {
  return std::sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

// An edge of a triangle, named by its vertices, of which `low` is the lower.
struct Edge {
  std::uint32_t low, high;
  bool is_ascending;  // the triangle has `low` before `high`
};

// What is known of a part while parts are found.
struct FoundPart {
  SurfacePart part = {};
  Bounds bounds;
  std::vector<std::uint32_t> vertices;
  std::vector<std::uint16_t> links;
  bool is_closed = true;
};

class PartSearch {
 public:
  PartSearch(const ArticulationDesc& desc, const SurfaceLeaves& surface) : desc_(desc), surface_(surface) {}

  void run() {
    connect();
    number_parts();
    look_at_edges();
    choose_vertices();
    list_links();
  }

  void store(Arena& arena, SurfaceParts& out) {
    std::vector<SurfacePart> parts;
    std::vector<std::uint16_t> links;
    for (FoundPart& found : parts_) {
      found.part.link_begin = static_cast<std::uint32_t>(links.size());
      found.part.link_count = static_cast<std::uint32_t>(found.links.size());
      links.insert(links.end(), found.links.begin(), found.links.end());
      parts.push_back(found.part);
    }
    for (const std::uint16_t link : common_links()) links.push_back(link);
    list_balls();
    out.parts = constant(arena.copy(Span<const SurfacePart>(parts)));
    out.links = constant(arena.copy(Span<const std::uint16_t>(links)));
    if (leaves_.empty()) return;
    out.closed_part = constant(arena.copy(Span<const std::uint32_t>(closed_parts())));
    out.leaves = constant(arena.copy(Span<const ClosedLeaf>(leaves_)));
    out.balls = constant(arena.copy(Span<const LinkBall>(balls_)));
    out.all = constant(arena.copy(Span<const LinkBall>(all_)));
  }

 private:
  std::uint32_t root_of(std::uint32_t vertex) {
    while (above_[vertex] != vertex) vertex = above_[vertex] = above_[above_[vertex]];
    return vertex;
  }

  FoundPart& part_of(std::uint32_t vertex) { return parts_[part_of_vertex_[vertex]]; }

  Double3 place_of(std::uint32_t vertex) const {
    const float* const at = desc_.skin.vertices.data + 3 * std::size_t{vertex};
    return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
  }

  // Connects the vertices of each triangle: the root of connected ones is the lowest.
  void connect() {
    above_.resize(desc_.skin.vertices.size / 3);
    std::iota(above_.begin(), above_.end(), 0u);
    for (const Leaf& leaf : desc_.leaves)
      for (std::size_t k = 0; k < leaf.triangles.size; ++k) {
        const std::uint32_t x = root_of(leaf.triangles[k]), y = root_of(leaf.triangles[k / 3 * 3]);
        above_[std::max(x, y)] = std::min(x, y);
      }
  }

  // Parts ascend by their roots, and have their vertices ascending.
  void number_parts() {
    std::vector<bool> used(above_.size(), false);
    for (const Leaf& leaf : desc_.leaves)
      for (const std::uint32_t vertex : leaf.triangles) used[vertex] = true;
    part_of_vertex_.assign(above_.size(), kNoPart);
    for (std::uint32_t vertex = 0; vertex < used.size(); ++vertex) {
      if (!used[vertex]) continue;
      const std::uint32_t root = root_of(vertex);
      if (root == vertex) {
        part_of_vertex_[vertex] = static_cast<std::uint32_t>(parts_.size());
        parts_.emplace_back();
      }
      part_of_vertex_[vertex] = part_of_vertex_[root];
      part_of(vertex).vertices.push_back(vertex);
      part_of(vertex).bounds.add(place_of(vertex));
    }
  }

  // A part is closed if each of its edges has an even number of triangles.
  void look_at_edges() {
    std::vector<Edge> edges;
    for (const Leaf& leaf : desc_.leaves)
      for (std::size_t k = 0; k < leaf.triangles.size; ++k) {
        const std::uint32_t from = leaf.triangles[k], to = leaf.triangles[k / 3 * 3 + (k + 1) % 3];
        if (from != to) edges.push_back({std::min(from, to), std::max(from, to), from < to});
      }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& x, const Edge& y) { return std::tie(x.low, x.high) < std::tie(y.low, y.high); });
    for (FoundPart& found : parts_) found.part.turns_one_way = true;
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
      std::size_t ascending = 0;
      for (; end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high; ++end)
        ascending += edges[end].is_ascending;
      FoundPart& found = part_of(edges[begin].low);
      found.is_closed = found.is_closed && (end - begin) % 2 == 0;
      found.part.turns_one_way = found.part.turns_one_way && 2 * ascending == end - begin;
    }
  }

  void choose_vertices() {
    for (FoundPart& found : parts_) {
      const Double3 middle = found.bounds.middle();
      double nearest = HUGE_VAL;
      Double3 lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
      for (const std::uint32_t vertex : found.vertices) {
        const Double3 at = place_of(vertex);
        if (const double away = distance(at, middle); away < nearest) {
          nearest = away;
          found.part.middle = vertex;
        }
        for (std::size_t c = 0; c < 3; ++c) {
          if (at[c] < lo[c]) {
            lo[c] = at[c];
            found.part.ends[2 * c] = vertex;
          }
          if (at[c] > hi[c]) {
            hi[c] = at[c];
            found.part.ends[2 * c + 1] = vertex;
          }
        }
      }
    }
  }

  void list_links() {
    std::vector<std::uint32_t> leaves(desc_.leaves.size);
    std::iota(leaves.begin(), leaves.end(), 0u);
    std::stable_sort(leaves.begin(), leaves.end(),
                     [this](std::uint32_t x, std::uint32_t y) { return desc_.leaves[x].link < desc_.leaves[y].link; });
    for (FoundPart& found : parts_) found.part.leaf = kNoPart;
    for (const std::uint32_t leaf : leaves)
      for (const std::uint32_t vertex : desc_.leaves[leaf].triangles) {
        FoundPart& found = part_of(vertex);
        const auto link = static_cast<std::uint16_t>(desc_.leaves[leaf].link);
        if (found.links.empty() || found.links.back() != link) found.links.push_back(link);
        if (found.part.leaf == kNoPart && found.part.middle == vertex) found.part.leaf = leaf;
      }
  }

  // Calls take(link, point) with a vertex where each link moves it, in the frame of that link.
  template <class Take>
  void for_each_place(std::uint32_t vertex, Take&& take) const {
    const SkinDesc& skin = desc_.skin;
    const Double3 at = place_of(vertex);
    for (std::size_t i = 0; i < skin.influence_count; ++i) {
      const std::size_t influence = std::size_t{vertex} * skin.influence_count + i;
      if (!(skin.influence_weights[influence] > 0)) continue;
      const std::uint32_t link = skin.influence_links[influence];
      Double3 bound = at;
      if (!skin.inverse_bind.empty()) {
        const float* const bind = skin.inverse_bind.data + 16 * std::size_t{link};
        for (std::size_t c = 0; c < 3; ++c) {
          bound[c] = static_cast<double>(bind[12 + c]);
          for (std::size_t k = 0; k < 3; ++k) bound[c] += static_cast<double>(bind[4 * k + c]) * at[k];
        }
      }
      take(link, bound);
    }
  }

  // Adds balls about vertices, one for each link that moves some of them: about the middle of their bounds, then as far
  // as they reach from there. Points are made twice and not stored, since each of many leaves may have all of them.
  void add_balls(const std::vector<std::uint32_t>& vertices, std::vector<LinkBall>& out) const {
    struct Points {
      Bounds bounds;
      Double3 center = {};
      double reach = 0;
    };
    std::map<std::uint32_t, Points> by_link;
    for (const std::uint32_t vertex : vertices)
      for_each_place(vertex, [&](std::uint32_t link, const Double3& at) { by_link[link].bounds.add(at); });
    for (auto& [link, points] : by_link) {
      points.center = points.bounds.middle();
      for (double& x : points.center) x = static_cast<double>(static_cast<float>(x));
    }
    for (const std::uint32_t vertex : vertices)
      for_each_place(vertex, [&](std::uint32_t link, const Double3& at) {
        Points& points = by_link[link];
        points.reach = std::max(points.reach, distance(at, points.center));
      });
    for (const auto& [link, points] : by_link) {
      LinkBall ball = {link, {}, rounded_up(points.reach)};
      for (std::size_t c = 0; c < 3; ++c) ball.center[c] = static_cast<float>(points.center[c]);
      out.push_back(ball);
    }
  }

  // Balls about the vertices of closed parts: of each leaf, and of all.
  void list_balls() {
    for (std::uint32_t leaf = 0; leaf < desc_.leaves.size; ++leaf) {
      std::vector<std::uint32_t> vertices;
      for (const std::uint32_t vertex : desc_.leaves[leaf].triangles)
        if (part_of(vertex).is_closed) vertices.push_back(vertex);
      if (vertices.empty()) continue;
      std::sort(vertices.begin(), vertices.end());
      vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
      const auto begin = static_cast<std::uint32_t>(balls_.size());
      add_balls(vertices, balls_);
      leaves_.push_back({leaf, begin, static_cast<std::uint32_t>(balls_.size()) - begin});
    }
    std::vector<std::uint32_t> all;
    for (const FoundPart& found : parts_)
      if (found.is_closed) all.insert(all.end(), found.vertices.begin(), found.vertices.end());
    add_balls(all, all_);
  }

  // The links that all closed parts have; none without closed parts.
  std::vector<std::uint16_t> common_links() const {
    std::vector<std::uint16_t> out;
    bool is_first = true;
    for (const FoundPart& found : parts_) {
      if (!found.is_closed) continue;
      if (std::exchange(is_first, false)) out = found.links;
      const auto is_missing = [&found](std::uint16_t link) {
        return !std::binary_search(found.links.begin(), found.links.end(), link);
      };
      out.erase(std::remove_if(out.begin(), out.end(), is_missing), out.end());
    }
    return out;
  }

  std::vector<std::uint32_t> closed_parts() {
    std::vector<std::uint32_t> out(kLanes * surface_.patches.size, kNoPart);
    for (std::size_t leaf = 0; leaf < surface_.leaves.size; ++leaf) {
      const SurfaceLeaf& of = surface_.leaves[leaf];
      for (std::uint32_t p = of.patch_begin; p < of.patch_begin + of.patch_count; ++p)
        for (std::uint32_t lane = 0; lane < surface_.patches[p].count; ++lane) {
          const std::uint32_t vertex =
              desc_.leaves[leaf].triangles[3 * std::size_t{surface_.patches[p].triangle[lane]}];
          if (part_of(vertex).is_closed) out[std::size_t{kLanes} * p + lane] = part_of_vertex_[vertex];
        }
    }
    return out;
  }

  const ArticulationDesc& desc_;
  const SurfaceLeaves& surface_;
  std::vector<std::uint32_t> above_;           // by vertex: itself, or one of its part that is lower
  std::vector<std::uint32_t> part_of_vertex_;  // by vertex
  std::vector<FoundPart> parts_;
  std::vector<ClosedLeaf> leaves_;
  std::vector<LinkBall> balls_, all_;
};

}  // namespace

void find_parts(const ArticulationDesc& desc, const SurfaceLeaves& surface, Arena& arena, SurfaceParts& out) {
  if (surface.leaves.empty()) return;
  PartSearch search(desc, surface);
  search.run();
  search.store(arena, out);
}

}  // namespace cab
