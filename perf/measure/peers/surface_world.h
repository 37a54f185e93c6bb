// Characters with a skin that `cab peers --surfaces` puts together, and their triangles before the judge.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/judge/oracle/touching_triangles.h"
#include "scenes/import/import.h"
#include "scenes/scene.h"

namespace cab::perf {

// A character by its surface and by hulls, of the same links.
struct SurfaceActor {
  scenes::Character surface;  // with the poses of all frames
  scenes::Character hulls;    // without poses
  std::uint32_t frame_count = 0;
};

// Reads a motion file with a skin as --body surface and --body skin do, or a file NAME.skin of arrays (docs/peers.md).
// Throws ImportError.
SurfaceActor load_surface_actor(const std::string& path, const std::optional<scenes::SandboxLimits>& sandbox);

// A character in the world: `phase` frames ahead of the others, and moved.
struct SurfaceInstance {
  std::uint32_t actor = 0, phase = 0;
  double offset[3] = {0, 0, 0};
};

struct SurfaceWorld {
  std::vector<SurfaceActor> actors;
  std::vector<SurfaceInstance> instances;

  std::uint32_t frame_count() const { return actors[0].frame_count; }
  const scenes::Character& surface(std::size_t instance) const { return actors[instances[instance].actor].surface; }

  // 7 numbers for each link of an instance in a frame, and where the instance is.
  const float* poses(std::size_t instance, std::uint32_t frame) const;
  oracle::Vec3<double> origin(std::size_t instance, std::uint32_t frame) const;

  // The vertices of an instance's skin in a frame, by the definition of a linear blend in double.
  std::vector<oracle::Vec3<double>> vertices(std::size_t instance, std::uint32_t frame) const;
};

// One character at each place of a square grid, `apart` times its width from the next, each eleven frames ahead of the
// one before. Width is the middle one of the extents of its first frame; the grid is along that and the least.
SurfaceWorld make_surface_grid(SurfaceActor actor, std::uint32_t count, double apart);

// Two links of two instances, the first with the lower index.
struct InstanceLinks {
  std::uint32_t instance_a, link_a, instance_b, link_b;
  auto operator<=>(const InstanceLinks&) const = default;
};

// Two triangles of two instances, the first with the lower index. Triangles are counted through the leaves.
struct InstanceTriangles {
  std::uint32_t instance_a, triangle_a, instance_b, triangle_b;
  auto operator<=>(const InstanceTriangles&) const = default;
};

// The link of each triangle of a character.
std::vector<std::uint32_t> links_of_triangles(const scenes::Character& surface);

// What is true of a frame, by brute force in double; sorted.
struct JudgedSurfaces {
  std::vector<InstanceTriangles> touching;
  std::vector<InstanceTriangles> near;  // and those that are so little apart that docs/exact.md allows to report them
};
JudgedSurfaces judge_surfaces(const SurfaceWorld& world, std::uint32_t frame);

}  // namespace cab::perf
