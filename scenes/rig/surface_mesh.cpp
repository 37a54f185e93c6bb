// The mesh of a skin as an articulation takes it: links instead of bones, and vertices welded.
#include "scenes/rig/surface_mesh.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>
#include <utility>

#include "scenes/rig/disjoint_sets.h"

namespace cab::scenes {
namespace {

// A vertex with its place and its weights of links, as the library gets them.
struct WeldedVertex {
  std::array<float, 3> place;
  std::vector<std::pair<std::uint32_t, float>> influences;  // by links

  bool operator<(const WeldedVertex& other) const {
    return std::tie(place, influences) < std::tie(other.place, other.influences);
  }
};

WeldedVertex welded(const CheckedSkin& skin, const LinkMap& map, const LinkBinds& binds, std::uint32_t v) {
  WeldedVertex out;
  const std::optional<Affine>& move = binds.moves[binds.move_of_bone[skin.influences(v)[0].bone]];
  const Vec3 place = move ? transform(*move, skin.vertex(v)) : skin.vertex(v);
  for (std::size_t k = 0; k < 3; ++k) out.place[k] = static_cast<float>(place[k]) + 0.0f;  // -0 is 0
  std::map<std::uint32_t, double> weights;
  for (const auto& [bone, weight] : skin.influences(v)) weights[map.link_of_joint[skin.joint_of(bone)]] += weight;
  // The strongest weight is what the others leave, so that rounding does not move the vertex.
  const std::uint32_t strongest = owner_of(weights);
  double left = 1;
  for (const auto& [link, weight] : weights) {
    out.influences.push_back({link, static_cast<float>(weight)});
    if (link != strongest) left -= static_cast<double>(out.influences.back().second);
  }
  for (auto& [link, weight] : out.influences)
    if (link == strongest) weight = static_cast<float>(left);
  return out;
}

}  // namespace

SurfaceMesh make_surface_mesh(const CheckedSkin& skin, const LinkMap& map, const LinkBinds& binds,
                              std::size_t triangle_count) {
  SurfaceMesh mesh;
  std::map<WeldedVertex, std::uint32_t> indices;
  std::vector<const WeldedVertex*> vertices;
  std::vector<std::uint32_t>& index_of = mesh.index_of;
  index_of.assign(skin.vertex_count(), kNoVertex);
  std::size_t most = 1;
  for (std::size_t t = 0; t < skin.triangles().size(); ++t) {
    const Triangle& triangle = skin.triangles()[t];
    Triangle corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& index = index_of[triangle[k]];
      if (index == kNoVertex) {
        const auto [at, is_first] =
            indices.try_emplace(welded(skin, map, binds, triangle[k]), static_cast<std::uint32_t>(vertices.size()));
        if (is_first)
          vertices.push_back(&at->first);
        else
          ++mesh.welded_count;
        index = at->second;
        most = std::max(most, at->first.influences.size());
      }
      corners[k] = index;
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    mesh.triangles.push_back(corners);
    mesh.sources.push_back(skin.sources()[t]);
  }
  mesh.left_out_count = static_cast<std::uint32_t>(triangle_count - mesh.triangles.size());
  mesh.skin.influence_count = static_cast<std::uint32_t>(most);
  for (const WeldedVertex* const vertex : vertices) {
    mesh.skin.vertices.insert(mesh.skin.vertices.end(), vertex->place.begin(), vertex->place.end());
    for (std::size_t i = 0; i < most; ++i) {
      const bool is_used = i < vertex->influences.size();
      mesh.skin.influence_links.push_back(is_used ? vertex->influences[i].first : 0);
      mesh.skin.influence_weights.push_back(is_used ? vertex->influences[i].second : 0);
    }
  }
  for (const Affine& bind : binds.of_link) {
    for (std::size_t k = 0; k < 4; ++k) {
      for (const double x : k < 3 ? bind.columns[k] : bind.translation)
        mesh.skin.inverse_bind.push_back(static_cast<float>(x));
      mesh.skin.inverse_bind.push_back(k == 3 ? 1.0f : 0.0f);
    }
  }
  return mesh;
}

Vec3 place_of(const SurfaceMesh& mesh, std::uint32_t vertex) {
  const float* const p = mesh.skin.vertices.data() + 3 * std::size_t{vertex};
  return {p[0], p[1], p[2]};
}

std::vector<Affine> link_bones(const SurfaceMesh& mesh, const std::vector<RigidFrame>& poses) {
  std::vector<Affine> bones;
  const std::size_t link_count = mesh.skin.inverse_bind.size() / 16;
  for (std::size_t n = 0; n < poses.size(); ++n) {
    const float* const m = mesh.skin.inverse_bind.data() + 16 * (n % link_count);
    bones.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      bones.back().columns[k] = rotate(poses[n].rotation, {m[4 * k], m[4 * k + 1], m[4 * k + 2]});
    bones.back().translation = poses[n].out({m[12], m[13], m[14]});
  }
  return bones;
}

Vec3 posed_vertex(const SurfaceMesh& mesh, const Affine* bones, std::uint32_t vertex) {
  const Vec3 place = place_of(mesh, vertex);
  Vec3 at = {0, 0, 0};
  const std::size_t count = mesh.skin.influence_count;
  for (std::size_t i = vertex * count; i < (vertex + 1) * count; ++i)
    if (const auto weight = static_cast<double>(mesh.skin.influence_weights[i]); weight > 0)
      at = at + weight * transform(bones[mesh.skin.influence_links[i]], place);
  return at;
}

MeshParts parts_of(const SurfaceMesh& mesh) {
  DisjointSets parts(mesh.skin.vertices.size() / 3);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> edges;  // how many triangles have one
  for (const Triangle& triangle : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
      parts.join(a, b);
      ++edges[{std::min(a, b), std::max(a, b)}];
    }
  MeshParts out;
  std::map<std::uint32_t, bool> is_open;  // by the first vertex of a part
  for (const auto& [edge, count] : edges) {
    bool& open = is_open[parts.find(edge.first)];
    open = open || count % 2 != 0;
    out.open_edge_count += count % 2;
  }
  out.count = static_cast<std::uint32_t>(is_open.size());
  for (const auto& part : is_open) out.open_count += part.second;
  return out;
}

}  // namespace cab::scenes
