// Other ways to find triangles of `cab peers --surfaces` that touch. Each skins all vertices by this engine's kernel.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "kernels/find_kernels.h"
#include "kernels/surface/skin_leaf.h"
#include "layout/arena.h"
#include "layout/articulation.h"
#include "perf/measure/peers/surface_world.h"

namespace cab::perf {

// A way, and its answer for a frame: triangles that touch, in any order.
struct SurfaceRival {
  std::string name, meaning;
  std::function<void(std::uint32_t frame, std::vector<InstanceTriangles>& out)> run;
};

// Every leaf of all instances of a frame, skinned.
class SkinnedWorld {
 public:
  SkinnedWorld(const SurfaceWorld& world, Isa isa);
  SkinnedWorld(const SkinnedWorld&) = delete;
  SkinnedWorld& operator=(const SkinnedWorld&) = delete;

  // Skins all.
  void skin(std::uint32_t frame);

  const SurfaceWorld& world() const { return world_; }
  const kernel::KernelTable& kernels() const { return kernels_; }
  std::size_t count() const { return instances_.size(); }
  const SurfaceLeaves& surface(std::size_t instance) const { return *instances_[instance].surface; }
  const kernel::SkinnedLeaf& leaf(std::size_t instance, std::size_t leaf) const {
    return instances_[instance].leaves[leaf];
  }
  oracle::Vec3<double> origin(std::size_t instance) const { return instances_[instance].origin; }

  // By triangle of an instance, as InstanceTriangles counts them: three vertices of its skin.
  const std::vector<std::uint32_t>& corners(std::size_t instance) const { return *instances_[instance].corners; }
  // The number of a leaf's first triangle.
  std::uint32_t first_triangle(std::size_t instance, std::size_t leaf) const {
    return (*instances_[instance].first)[leaf];
  }

  // Writes where the vertices of an instance's skin are in the world: x y z of each.
  void write_vertices(std::size_t instance, std::vector<float>& out) const;

  // The bounds of an instance in the world.
  struct Bounds {
    float lo[3], hi[3];
  };
  const Bounds& bounds(std::size_t instance) const { return instances_[instance].bounds; }
  bool are_near(std::size_t a, std::size_t b) const;

 private:
  struct Actor {
    Articulation articulation;
    std::vector<std::uint32_t> corners, first;
  };
  struct Instance {
    const SurfaceLeaves* surface;
    const std::vector<std::uint32_t>*corners, *first;
    std::vector<kernel::SkinnedLeaf> leaves;
    oracle::Vec3<double> origin;
    Bounds bounds;
  };

  const SurfaceWorld& world_;
  const kernel::KernelTable& kernels_;
  Arena arena_;
  std::vector<std::unique_ptr<Actor>> actors_;
  std::vector<Instance> instances_;
  std::vector<float> bones_;
  std::vector<const float*> poses_;
};

// Pairs of triangles that a library hands over, through the triangle kernel of this engine, sixteen at a time.
class TrianglePairs {
 public:
  explicit TrianglePairs(const kernel::KernelTable& kernels);

  // Adds a pair: x y z of each corner, and what is appended to `out` if the two touch.
  void add(const float* const (&a)[3], const float* const (&b)[3], const InstanceTriangles& names,
           std::vector<InstanceTriangles>& out);

  // Tests the pairs that wait.
  void finish(std::vector<InstanceTriangles>& out);

 private:
  const kernel::KernelTable& kernels_;
  std::uint32_t count_ = 0;
  InstanceTriangles names_[kLanes];
  // Two leaves of one patch each. Lane by lane their bounds are far from those of all other lanes.
  TrianglePatch patch_;
  std::vector<AabbTile> bounds_;
  std::vector<float> vertices_[2];
};

// A tree of boxes about each character's leaves, which is refitted, and the triangle kernel of this engine.
SurfaceRival own_tree(const SurfaceWorld& world, Isa isa);

// FCL: trees of boxes about triangles, in double, which are refitted.
SurfaceRival fcl_trees(const SurfaceWorld& world, Isa isa);

// Embree: trees of user primitives, one for each triangle, refitted or built anew; of builds with it alone.
std::vector<SurfaceRival> embree_trees(const SurfaceWorld& world, Isa isa);

}  // namespace cab::perf
