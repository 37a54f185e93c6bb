#include "layout/list_surface.h"

#include "layout/rounded_up.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace cab {
namespace {

struct Weight {
  std::uint32_t link;
  double weight;
};

// A vertex of a leaf: its index in the skin, and the links that move it, ascending.
struct MovedVertex {
  std::uint32_t vertex;
  std::vector<Weight> weights;
};

// The links that move a vertex, each once and ascending, with weights that add to 1.
std::vector<Weight> weights_of(const SkinDesc& skin, std::uint32_t vertex) {
  std::map<std::uint32_t, double> by_link;
  double sum = 0;
  for (std::size_t i = 0; i < skin.influence_count; ++i) {
    const std::size_t at = std::size_t{vertex} * skin.influence_count + i;
    if (!(skin.influence_weights[at] > 0)) continue;
    const auto weight = static_cast<double>(skin.influence_weights[at]);
    by_link[skin.influence_links[at]] += weight;
    sum += weight;
  }
  std::vector<Weight> out;
  for (const auto& [link, weight] : by_link) out.push_back({link, weight / sum});
  return out;
}

// The columns of a link's inverse bind matrix.
void set_bind(const SkinDesc& skin, SurfaceBone& bone) {
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      bone.bind[k][c] =
          skin.inverse_bind.empty() ? (k == c ? 1.0f : 0.0f) : skin.inverse_bind[16 * bone.link + 4 * k + c];
}

// Whether the matrix of a bone is the identity.
bool binds_nothing(const SurfaceBone& bone) {
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      if (bone.bind[k][c] != (k == c ? 1.0f : 0.0f)) return false;
  return true;
}

// The largest number on the way of a vertex to a link's frame: the sum over rows of |B| |v| + |b|.
double reach_of(const SurfaceBone& bone, const float* v) {
  double out = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    out += std::fabs(static_cast<double>(bone.bind[3][c]));
    for (std::size_t k = 0; k < 3; ++k)
      out += std::fabs(static_cast<double>(bone.bind[k][c])) * std::fabs(static_cast<double>(v[k]));
  }
  return out;
}

// How far a vertex is from the origin of a link that moves it.
double radius_of(const SurfaceBone& bone, const float* v) {
  double square = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    double at = static_cast<double>(bone.bind[3][c]);
    for (std::size_t k = 0; k < 3; ++k) at += static_cast<double>(bone.bind[k][c]) * static_cast<double>(v[k]);
    square += at * at;
  }
  return std::sqrt(square);
}

// Lists what leaves have, one after the other.
class SurfaceList {
 public:
  explicit SurfaceList(const ArticulationDesc& desc) : skin_(desc.skin), leaves_(desc.leaves) {}

  void list(std::size_t leaf) {
    SurfaceLeaf out = {};
    out.bone_begin = static_cast<std::uint32_t>(bones_.size());
    out.block_begin = static_cast<std::uint32_t>(blocks_.size());
    out.patch_begin = static_cast<std::uint32_t>(patches_.size());
    out.bounds_begin = static_cast<std::uint32_t>(bounds_.size());
    if (leaves_[leaf].triangles.size > 0) {
      list_vertices(leaves_[leaf]);
      list_bones(out.bone_begin);
      list_blocks();
      list_patches(leaves_[leaf]);
    }
    out.bone_count = static_cast<std::uint32_t>(bones_.size()) - out.bone_begin;
    out.block_count = static_cast<std::uint32_t>(blocks_.size()) - out.block_begin;
    out.patch_count = static_cast<std::uint32_t>(patches_.size()) - out.patch_begin;
    if (out.bone_count == 1 && binds_nothing(bones_.back())) list_bounds(out);
    out.bounds_count = static_cast<std::uint32_t>(bounds_.size()) - out.bounds_begin;
    listed_.push_back(out);
  }

  void store(Arena& arena, SurfaceLeaves& out) const {
    out.leaves = constant(arena.copy(Span<const SurfaceLeaf>(listed_)));
    out.bones = constant(arena.copy(Span<const SurfaceBone>(bones_)));
    out.blocks = constant(arena.copy(Span<const VertexBlock>(blocks_)));
    out.influences = constant(arena.copy(Span<const BlockInfluence>(influences_)));
    out.patches = constant(arena.copy(Span<const TrianglePatch>(patches_)));
    out.bounds = constant(arena.copy(Span<const AabbTile>(bounds_)));
    out.places = constant(arena.copy(Span<const float>(places_)));
    for (const SurfaceLeaf& leaf : listed_) {
      out.most_bones = std::max(out.most_bones, leaf.bone_count);
      out.most_blocks = std::max(out.most_blocks, leaf.block_count);
      out.most_patches = std::max(out.most_patches, leaf.patch_count);
    }
    out.vertices = constant(arena.copy(skin_.vertices));
    out.influence_count = skin_.influence_count;
    out.influence_links = constant(arena.copy(skin_.influence_links));
    out.influence_weights = constant(arena.copy(skin_.influence_weights));
    out.inverse_bind = constant(arena.copy(skin_.inverse_bind));
  }

 private:
  // The vertices of a leaf, those that the same links move one after the other.
  void list_vertices(const Leaf& leaf) {
    std::vector<std::uint32_t> used(leaf.triangles.begin(), leaf.triangles.end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    vertices_.clear();
    for (const std::uint32_t vertex : used) vertices_.push_back({vertex, weights_of(skin_, vertex)});
    const auto by_links = [](const MovedVertex& x, const MovedVertex& y) {
      return std::lexicographical_compare(x.weights.begin(), x.weights.end(), y.weights.begin(), y.weights.end(),
                                          [](const Weight& a, const Weight& b) { return a.link < b.link; });
    };
    std::stable_sort(vertices_.begin(), vertices_.end(), by_links);
    place_of_.clear();
    for (std::size_t v = 0; v < vertices_.size(); ++v) place_of_[vertices_[v].vertex] = static_cast<std::uint32_t>(v);
  }

  void list_bones(std::uint32_t begin) {
    struct Sizes {
      double reach = 0, radius = 0;
    };
    std::map<std::uint32_t, Sizes> sizes;
    SurfaceBone bone = {};
    for (const MovedVertex& moved : vertices_)
      for (const Weight& by : moved.weights) {
        bone.link = by.link;
        set_bind(skin_, bone);
        const float* const v = skin_.vertices.data + 3 * std::size_t{moved.vertex};
        Sizes& of = sizes[by.link];
        of.reach = std::max(of.reach, reach_of(bone, v));
        of.radius = std::max(of.radius, radius_of(bone, v));
      }
    bone_of_.clear();
    for (const auto& [link, of] : sizes) {
      bone_of_[link] = static_cast<std::uint32_t>(bones_.size()) - begin;
      bone.link = link;
      set_bind(skin_, bone);
      bone.reach = rounded_up(of.reach);
      bone.radius = rounded_up(of.radius);
      bones_.push_back(bone);
    }
  }

  void list_blocks() {
    for (std::size_t first = 0; first < vertices_.size(); first += kLanes) {
      VertexBlock block = {};
      block.influence_begin = static_cast<std::uint32_t>(influences_.size());
      std::map<std::uint32_t, BlockInfluence> by_bone;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        const MovedVertex& moved = vertices_[std::min(first + lane, vertices_.size() - 1)];
        block.vertex[lane] = moved.vertex;
        for (std::size_t c = 0; c < 3; ++c) block.place[c][lane] = skin_.vertices[3 * std::size_t{moved.vertex} + c];
        for (const Weight& by : moved.weights) {
          BlockInfluence& influence = by_bone[bone_of_[by.link]];
          influence.bone = bone_of_[by.link];
          influence.weight[lane] = static_cast<float>(by.weight);
        }
      }
      for (const auto& [bone, influence] : by_bone) influences_.push_back(influence);
      block.influence_count = static_cast<std::uint32_t>(by_bone.size());
      blocks_.push_back(block);
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        for (std::size_t c = 0; c < 4; ++c) places_.push_back(c < 3 ? block.place[c][lane] : 0);
    }
  }

  // Bounds of the triangles of a leaf where its vertices are given, and of its patches.
  void list_bounds(const SurfaceLeaf& leaf) {
    constexpr float kNone = std::numeric_limits<float>::infinity();
    AabbTile none;
    for (std::size_t c = 0; c < 3; ++c) {
      std::fill_n(none.lo[c], kLanes, kNone);
      std::fill_n(none.hi[c], kLanes, -kNone);
    }
    const std::size_t begin = bounds_.size(), tiles = tile_count(leaf.patch_count);
    bounds_.resize(begin + leaf.patch_count + tiles, none);
    for (std::uint32_t p = 0; p < leaf.patch_count; ++p) {
      const TrianglePatch& patch = patches_[leaf.patch_begin + p];
      AabbTile &bounds = bounds_[begin + p], &all = bounds_[begin + leaf.patch_count + p / kLanes];
      for (std::size_t lane = 0; lane < patch.count; ++lane)
        for (const auto& corner : patch.corner) {
          const VertexBlock& block = blocks_[leaf.block_begin + corner[lane] / kLanes];
          for (std::size_t c = 0; c < 3; ++c) {
            const float at = block.place[c][corner[lane] % kLanes];
            bounds.lo[c][lane] = std::min(bounds.lo[c][lane], at);
            bounds.hi[c][lane] = std::max(bounds.hi[c][lane], at);
            all.lo[c][p % kLanes] = std::min(all.lo[c][p % kLanes], at);
            all.hi[c][p % kLanes] = std::max(all.hi[c][p % kLanes], at);
          }
        }
    }
  }

  // Three times the middle of a triangle, where the skin is.
  std::array<double, 3> middle_of(const Leaf& leaf, std::uint32_t triangle) const {
    std::array<double, 3> out = {};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        out[c] += static_cast<double>(skin_.vertices[3 * std::size_t{leaf.triangles[3 * triangle + i]} + c]);
    return out;
  }

  // Halves the triangles along the longest side of their middles' box, until there are at most sixteen.
  void halve(const Leaf& leaf, std::uint32_t* begin, std::uint32_t* end) {
    const auto count = static_cast<std::size_t>(end - begin);
    if (count <= kLanes) {
      std::sort(begin, end);
      add_patch(leaf, begin, count);
      return;
    }
    std::array<double, 3> lo = middle_of(leaf, *begin), hi = lo;
    for (const std::uint32_t* t = begin; t != end; ++t) {
      const std::array<double, 3> at = middle_of(leaf, *t);
      for (std::size_t c = 0; c < 3; ++c) {
        lo[c] = std::min(lo[c], at[c]);
        hi[c] = std::max(hi[c], at[c]);
      }
    }
    std::size_t axis = 0;
    for (std::size_t c = 1; c < 3; ++c)
      if (hi[c] - lo[c] > hi[axis] - lo[axis]) axis = c;
    const std::size_t patches = (count + kLanes - 1) / kLanes;
    std::uint32_t* const middle = begin + patches / 2 * kLanes;
    std::nth_element(begin, middle, end, [&](std::uint32_t x, std::uint32_t y) {
      const double at_x = middle_of(leaf, x)[axis], at_y = middle_of(leaf, y)[axis];
      return at_x < at_y || (at_x == at_y && x < y);
    });
    halve(leaf, begin, middle);
    halve(leaf, middle, end);
  }

  void add_patch(const Leaf& leaf, const std::uint32_t* triangles, std::size_t count) {
    TrianglePatch patch = {};
    patch.count = static_cast<std::uint32_t>(count);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      patch.triangle[lane] = triangles[std::min(lane, count - 1)];
      for (std::size_t i = 0; i < 3; ++i)
        patch.corner[i][lane] = place_of_[leaf.triangles[3 * std::size_t{patch.triangle[lane]} + i]];
    }
    patches_.push_back(patch);
  }

  void list_patches(const Leaf& leaf) {
    std::vector<std::uint32_t> triangles(leaf.triangles.size / 3);
    for (std::size_t t = 0; t < triangles.size(); ++t) triangles[t] = static_cast<std::uint32_t>(t);
    halve(leaf, triangles.data(), triangles.data() + triangles.size());
  }

  const SkinDesc& skin_;
  Span<const Leaf> leaves_;
  std::vector<SurfaceLeaf> listed_;
  std::vector<SurfaceBone> bones_;
  std::vector<VertexBlock> blocks_;
  std::vector<BlockInfluence> influences_;
  std::vector<TrianglePatch> patches_;
  std::vector<AabbTile> bounds_;
  std::vector<float> places_;
  // Of the leaf that is listed.
  std::vector<MovedVertex> vertices_;
  std::map<std::uint32_t, std::uint32_t> place_of_;  // by vertex of the skin
  std::map<std::uint32_t, std::uint32_t> bone_of_;   // by link
};

}  // namespace

void list_surface(const ArticulationDesc& desc, Arena& arena, SurfaceLeaves& out) {
  const auto has_triangles = [](const Leaf& leaf) { return leaf.triangles.size > 0; };
  if (std::none_of(desc.leaves.begin(), desc.leaves.end(), has_triangles)) return;
  SurfaceList list(desc);
  for (std::size_t leaf = 0; leaf < desc.leaves.size; ++leaf) list.list(leaf);
  list.store(arena, out);
}

}  // namespace cab
