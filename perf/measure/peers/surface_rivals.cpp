#include "perf/measure/peers/surface_rivals.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/AABB.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "kernels/surface/test_surfaces.h"
#include "perf/base/engine_call.h"

namespace cab::perf {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();

using Bounds = SkinnedWorld::Bounds;
constexpr Bounds kNothing = {{kInfinite, kInfinite, kInfinite}, {-kInfinite, -kInfinite, -kInfinite}};

void add(Bounds& to, const Bounds& other) {
  for (int c = 0; c < 3; ++c) {
    to.lo[c] = std::min(to.lo[c], other.lo[c]);
    to.hi[c] = std::max(to.hi[c], other.hi[c]);
  }
}

bool overlap(const Bounds& a, const Bounds& b) {
  bool out = true;
  for (int c = 0; c < 3; ++c) out = out & (a.lo[c] <= b.hi[c]) & (b.lo[c] <= a.hi[c]);
  return out;
}

// The bounds of the first lanes of a tile, moved.
Bounds bounds_of(const AabbTile& tile, std::uint32_t lanes, const oracle::Vec3<double>& by) {
  Bounds out = kNothing;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::uint32_t lane = 0; lane < lanes; ++lane) {
      out.lo[c] = std::min(out.lo[c], tile.lo[c][lane]);
      out.hi[c] = std::max(out.hi[c], tile.hi[c][lane]);
    }
    out.lo[c] += static_cast<float>(by[c]);
    out.hi[c] += static_cast<float>(by[c]);
  }
  return out;
}

Bounds bounds_of(const kernel::SkinnedLeaf& leaf, std::uint32_t patches, const oracle::Vec3<double>& by) {
  Bounds out = kNothing;
  for (std::uint32_t first = 0; first < patches; first += kLanes)
    add(out, bounds_of(leaf.bounds[patches + first / kLanes], std::min(kLanes, patches - first), by));
  return out;
}

}  // namespace

SkinnedWorld::SkinnedWorld(const SurfaceWorld& world, Isa isa)
    : world_(world), kernels_(*kernel::find_kernels(isa)), arena_(default_allocator()) {
  std::uint32_t most_bones = 0;
  for (const SurfaceActor& actor : world.actors) {
    Actor& made = *actors_.emplace_back(std::make_unique<Actor>());
    const scenes::ArticulationStorage storage(actor.surface);
    require(build_articulation(storage.desc(), arena_, &made.articulation, nullptr), "a surface");
    most_bones = std::max(most_bones, made.articulation.surface.most_bones);
    for (const scenes::BodyLeaf& leaf : actor.surface.leaves) {
      made.first.push_back(static_cast<std::uint32_t>(made.corners.size() / 3));
      made.corners.insert(made.corners.end(), leaf.triangles.begin(), leaf.triangles.end());
    }
  }
  for (const SurfaceInstance& of : world.instances) {
    const Actor& actor = *actors_[of.actor];
    Instance& instance = instances_.emplace_back();
    instance.surface = &actor.articulation.surface;
    instance.corners = &actor.corners;
    instance.first = &actor.first;
    for (const SurfaceLeaf& leaf : instance.surface->leaves) {
      kernel::SkinnedLeaf& out = instance.leaves.emplace_back();
      out.vertices = arena_.allocate<float>(std::size_t{4} * kLanes, leaf.block_count).data;
      out.bounds = arena_.allocate<AabbTile>(kernel::bounds_tiles(leaf.patch_count)).data;
    }
  }
  bones_.resize(std::size_t{kernel::kBoneFloats} * most_bones);
  poses_.resize(most_bones);
}

void SkinnedWorld::skin(std::uint32_t frame) {
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    Instance& instance = instances_[i];
    const float* const poses = world_.poses(i, frame);
    instance.origin = world_.origin(i, frame);
    instance.bounds = kNothing;
    for (std::size_t n = 0; n < instance.leaves.size(); ++n) {
      const SurfaceLeaf& leaf = instance.surface->leaves[n];
      for (std::uint32_t b = 0; b < leaf.bone_count; ++b)
        poses_[b] = poses + std::size_t{7} * instance.surface->bones[leaf.bone_begin + b].link;
      kernels_.skin_leaf({instance.surface, &leaf, {}, poses_.data(), nullptr, 1, bones_.data(), &instance.leaves[n]});
      add(instance.bounds, bounds_of(instance.leaves[n], leaf.patch_count, instance.origin));
    }
  }
}

void SkinnedWorld::write_vertices(std::size_t instance, std::vector<float>& out) const {
  const Instance& of = instances_[instance];
  out.resize(of.surface->vertices.size);
  for (std::size_t n = 0; n < of.leaves.size(); ++n) {
    const SurfaceLeaf& leaf = of.surface->leaves[n];
    for (std::uint32_t b = 0; b < leaf.block_count; ++b) {
      const VertexBlock& block = of.surface->blocks[leaf.block_begin + b];
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        for (std::size_t c = 0; c < 3; ++c)
          out[3 * std::size_t{block.vertex[lane]} + c] =
              of.leaves[n].vertices[std::size_t{4} * (kLanes * b + lane) + c] + static_cast<float>(of.origin[c]);
    }
  }
}

bool SkinnedWorld::are_near(std::size_t a, std::size_t b) const { return overlap(bounds(a), bounds(b)); }

// ------------------------------------------------------------------------------------------------- pairs of triangles

TrianglePairs::TrianglePairs(const kernel::KernelTable& kernels) : kernels_(kernels), bounds_(2) {
  patch_.count = kLanes;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    patch_.triangle[lane] = lane;
    for (std::uint32_t k = 0; k < 3; ++k) patch_.corner[k][lane] = 3 * lane + k;
    for (std::size_t c = 0; c < 3; ++c) {
      bounds_[0].lo[c][lane] = bounds_[0].hi[c][lane] = static_cast<float>(lane);
      bounds_[1].lo[c][lane] = lane == 0 ? 0 : kInfinite;
      bounds_[1].hi[c][lane] = lane == 0 ? static_cast<float>(kLanes) : -kInfinite;
    }
  }
  for (std::vector<float>& vertices : vertices_) vertices.resize(std::size_t{12} * kLanes);
}

void TrianglePairs::add(const float* const (&a)[3], const float* const (&b)[3], const InstanceTriangles& names,
                        std::vector<InstanceTriangles>& out) {
  for (std::size_t k = 0; k < 3; ++k) {
    std::copy_n(a[k], 3, vertices_[0].data() + 4 * (3 * std::size_t{count_} + k));
    std::copy_n(b[k], 3, vertices_[1].data() + 4 * (3 * std::size_t{count_} + k));
  }
  names_[count_] = names;
  if (++count_ == kLanes) finish(out);
}

void TrianglePairs::finish(std::vector<InstanceTriangles>& out) {
  struct Taker {
    const TrianglePairs& pairs;
    std::vector<InstanceTriangles>& out;
  } taker = {*this, out};
  const kernel::SurfacePair job = {{vertices_[0].data(), bounds_.data()},
                                   {vertices_[1].data(), bounds_.data()},
                                   &patch_,
                                   &patch_,
                                   1,
                                   1,
                                   {},
                                   0,
                                   0,
                                   0};
  kernels_.test_surfaces(job, &taker, [](void* to, const kernel::TrianglePairs& tested) {
    const Taker& of = *static_cast<Taker*>(to);
    for (std::uint32_t lane = 0; lane < tested.count; ++lane)
      if ((tested.touching | tested.undecided) >> lane & 1 && tested.a[lane] < of.pairs.count_)
        of.out.push_back(of.pairs.names_[tested.a[lane]]);
    return true;
  });
  count_ = 0;
}

// ------------------------------------------------------------------------------------------------------ the own tree

namespace {

// A binary tree over the leaves of a character, by their places in the first frame. Children come after their parent.
struct LeafTree {
  struct Node {
    std::uint32_t left = 0, right = 0, leaf = 0;  // left 0: it is of one leaf
  };
  std::vector<Node> nodes;

  LeafTree(const SkinnedWorld& skinned, std::size_t instance) {
    std::vector<std::pair<std::uint32_t, Bounds>> leaves;
    const SurfaceLeaves& surface = skinned.surface(instance);
    for (std::uint32_t n = 0; n < surface.leaves.size; ++n)
      leaves.emplace_back(n, bounds_of(skinned.leaf(instance, n), surface.leaves[n].patch_count, {}));
    split(leaves.data(), leaves.data() + leaves.size());
  }

 private:
  using Entry = std::pair<std::uint32_t, Bounds>;
  std::uint32_t split(Entry* begin, Entry* end) {
    const auto node = static_cast<std::uint32_t>(nodes.size());
    nodes.push_back({0, 0, begin->first});
    if (end - begin == 1) return node;
    Bounds all = kNothing;
    for (const Entry* e = begin; e != end; ++e) add(all, e->second);
    int axis = 0;
    for (int c = 1; c < 3; ++c)
      if (all.hi[c] - all.lo[c] > all.hi[axis] - all.lo[axis]) axis = c;
    Entry* const middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, [axis](const Entry& a, const Entry& b) {
      return a.second.lo[axis] + a.second.hi[axis] < b.second.lo[axis] + b.second.hi[axis];
    });
    const std::uint32_t left = split(begin, middle), right = split(middle, end);
    nodes[node].left = left;
    nodes[node].right = right;
    return node;
  }
};

class OwnTree {
 public:
  OwnTree(const SurfaceWorld& world, Isa isa) : skinned_(world, isa) {
    skinned_.skin(0);
    for (std::size_t i = 0; i < skinned_.count(); ++i) {
      trees_.emplace_back(skinned_, i);
      boxes_.emplace_back(trees_[i].nodes.size());
    }
  }

  void run(std::uint32_t frame, std::vector<InstanceTriangles>& out) {
    out_ = &out;
    skinned_.skin(frame);
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      const SurfaceLeaves& surface = skinned_.surface(i);
      for (std::size_t n = trees_[i].nodes.size(); n-- > 0;) {
        const LeafTree::Node& node = trees_[i].nodes[n];
        if (node.left == 0) {
          boxes_[i][n] =
              bounds_of(skinned_.leaf(i, node.leaf), surface.leaves[node.leaf].patch_count, skinned_.origin(i));
        } else {
          boxes_[i][n] = boxes_[i][node.left];
          add(boxes_[i][n], boxes_[i][node.right]);
        }
      }
    }
    for (std::uint32_t a = 0; a < trees_.size(); ++a)
      for (std::uint32_t b = a + 1; b < trees_.size(); ++b) descend(a, 0, b, 0);
  }

 private:
  void descend(std::uint32_t a, std::uint32_t x, std::uint32_t b, std::uint32_t y) {
    const Bounds &of_x = boxes_[a][x], &of_y = boxes_[b][y];
    if (!overlap(of_x, of_y)) return;
    const LeafTree::Node &node_x = trees_[a].nodes[x], &node_y = trees_[b].nodes[y];
    if (node_x.left == 0 && node_y.left == 0) return test(a, node_x.leaf, b, node_y.leaf);
    const auto size = [](const Bounds& of) { return of.hi[0] - of.lo[0] + of.hi[1] - of.lo[1] + of.hi[2] - of.lo[2]; };
    if (node_y.left == 0 || (node_x.left != 0 && size(of_x) > size(of_y))) {
      descend(a, node_x.left, b, y);
      descend(a, node_x.right, b, y);
    } else {
      descend(a, x, b, node_y.left);
      descend(a, x, b, node_y.right);
    }
  }

  void test(std::uint32_t a, std::uint32_t leaf_a, std::uint32_t b, std::uint32_t leaf_b) {
    const SurfaceLeaves &surface_a = skinned_.surface(a), &surface_b = skinned_.surface(b);
    const SurfaceLeaf &of_a = surface_a.leaves[leaf_a], &of_b = surface_b.leaves[leaf_b];
    kernel::SurfacePair pair = {skinned_.leaf(a, leaf_a),
                                skinned_.leaf(b, leaf_b),
                                surface_a.patches.data + of_a.patch_begin,
                                surface_b.patches.data + of_b.patch_begin,
                                of_a.patch_count,
                                of_b.patch_count,
                                {},
                                0,
                                0,
                                0};
    for (std::size_t c = 0; c < 3; ++c)
      pair.shift[c] = static_cast<float>(skinned_.origin(b)[c] - skinned_.origin(a)[c]);
    taker_ = {this, &pair, a, leaf_a, b, leaf_b};
    skinned_.kernels().test_surfaces(pair, &taker_, take);
  }

  // What floats leave undecided is taken for touching.
  static bool take(void* taker, const kernel::TrianglePairs& pairs) {
    const Taker& of = *static_cast<Taker*>(taker);
    const auto number = [&](std::uint32_t instance, std::uint32_t leaf, const TrianglePatch* patches,
                            std::uint32_t triangle) {
      return of.tree->skinned_.first_triangle(instance, leaf) + patches[triangle / kLanes].triangle[triangle % kLanes];
    };
    for (std::uint32_t lane = 0; lane < pairs.count; ++lane)
      if ((pairs.touching | pairs.undecided) >> lane & 1)
        of.tree->out_->push_back({of.a, number(of.a, of.leaf_a, of.pair->patches_a, pairs.a[lane]), of.b,
                                  number(of.b, of.leaf_b, of.pair->patches_b, pairs.b[lane])});
    return true;
  }

  struct Taker {
    OwnTree* tree;
    const kernel::SurfacePair* pair;
    std::uint32_t a, leaf_a, b, leaf_b;
  };

  SkinnedWorld skinned_;
  std::vector<LeafTree> trees_;
  std::vector<std::vector<Bounds>> boxes_;  // by instance and node
  Taker taker_ = {};
  std::vector<InstanceTriangles>* out_ = nullptr;
};

// ----------------------------------------------------------------------------------------------------------------- FCL

class FclTrees {
 public:
  FclTrees(const SurfaceWorld& world, Isa isa) : skinned_(world, isa) {
    skinned_.skin(0);
    for (std::size_t i = 0; i < skinned_.count(); ++i) {
      read_vertices(i);
      std::vector<fcl::Triangle> triangles;
      const std::vector<std::uint32_t>& corners = skinned_.corners(i);
      for (std::size_t t = 0; t < corners.size(); t += 3)
        triangles.emplace_back(corners[t], corners[t + 1], corners[t + 2]);
      meshes_.push_back(std::make_unique<Mesh>());
      meshes_[i]->beginModel();
      meshes_[i]->addSubModel(points_, triangles);
      meshes_[i]->endModel();
    }
  }

  void run(std::uint32_t frame, std::vector<InstanceTriangles>& out) {
    skinned_.skin(frame);
    for (std::size_t i = 0; i < meshes_.size(); ++i) {
      read_vertices(i);
      meshes_[i]->beginUpdateModel();
      meshes_[i]->updateSubModel(points_);
      meshes_[i]->endUpdateModel(true, true);
    }
    fcl::CollisionRequestd request(std::numeric_limits<int>::max(), true);
    for (std::uint32_t a = 0; a < meshes_.size(); ++a)
      for (std::uint32_t b = a + 1; b < meshes_.size(); ++b) {
        if (!skinned_.are_near(a, b)) continue;
        fcl::CollisionResultd result;
        fcl::collide(meshes_[a].get(), fcl::Transform3d::Identity(), meshes_[b].get(), fcl::Transform3d::Identity(),
                     request, result);
        for (std::size_t c = 0; c < result.numContacts(); ++c) {
          const fcl::Contactd& contact = result.getContact(c);
          out.push_back({a, static_cast<std::uint32_t>(contact.b1), b, static_cast<std::uint32_t>(contact.b2)});
        }
      }
    // Two triangles may have several points of contact.
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
  }

 private:
  using Mesh = fcl::BVHModel<fcl::AABBd>;

  void read_vertices(std::size_t instance) {
    skinned_.write_vertices(instance, vertices_);
    points_.resize(vertices_.size() / 3);
    for (std::size_t v = 0; v < points_.size(); ++v)
      points_[v] = fcl::Vector3d(vertices_[3 * v], vertices_[3 * v + 1], vertices_[3 * v + 2]);
  }

  SkinnedWorld skinned_;
  std::vector<std::unique_ptr<Mesh>> meshes_;
  std::vector<float> vertices_;
  std::vector<fcl::Vector3d> points_;
};

template <class Way>
SurfaceRival rival(const std::string& name, const std::string& meaning, const SurfaceWorld& world, Isa isa) {
  const auto way = std::make_shared<Way>(world, isa);
  return {name, meaning, [way](std::uint32_t frame, std::vector<InstanceTriangles>& out) { way->run(frame, out); }};
}

}  // namespace

SurfaceRival own_tree(const SurfaceWorld& world, Isa isa) {
  return rival<OwnTree>(
      "own tree", "all skinned by this engine's kernel, a refitted tree of leaves, its triangle kernel", world, isa);
}

SurfaceRival fcl_trees(const SurfaceWorld& world, Isa isa) {
  return rival<FclTrees>("fcl", "all skinned likewise, refitted trees of boxes along the axes, all contacts, in double",
                         world, isa);
}

}  // namespace cab::perf
