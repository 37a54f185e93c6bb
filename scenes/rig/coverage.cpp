// How well bodies cover a skin: what is outside in any pose, and volumes on a grid.
#include <cab/skin.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "scenes/rig/posed_skin.h"

namespace cab::scenes {
namespace {

using rig::Coverage;
using rig::SkinStatus;

constexpr double kCellsAlongLongest = 96;

// Cells of one size about a mesh and bodies. Lines along z run through the middles of the cells.
struct Grid {
  Vec3 low = {0, 0, 0};
  double cell = 0;
  std::array<std::size_t, 3> count = {0, 0, 0};

  double middle(std::size_t axis, std::size_t index) const {
    return low[axis] + (static_cast<double>(index) + .5) * cell;
  }
  // The cells whose middles are from one coordinate to another: first, and one past the last.
  std::array<std::size_t, 2> range(std::size_t axis, double from, double to) const {
    const auto bound = [&](double at) {
      const double index = std::ceil((at - low[axis]) / cell - .5);
      return static_cast<std::size_t>(std::clamp(index, 0.0, static_cast<double>(count[axis])));
    };
    return {bound(from), bound(std::nextafter(to, std::numeric_limits<double>::infinity()))};
  }
  double volume() const { return cell * cell * cell; }
};

Grid grid_about(const std::vector<Vec3>& vertices, const std::vector<LinkSolid>& solids,
                const std::vector<Vec3>& centres) {
  const double infinity = std::numeric_limits<double>::infinity();
  Vec3 low = {infinity, infinity, infinity}, high = {-infinity, -infinity, -infinity};
  const auto see = [&](const Vec3& point, double radius) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point[k] - radius);
      high[k] = std::max(high[k], point[k] + radius);
    }
  };
  for (const Vec3& vertex : vertices) see(vertex, 0);
  for (std::size_t n = 0; n < solids.size(); ++n) see(centres[n], solids[n].solid.radius);
  Grid grid;
  const Vec3 extent = high - low;
  grid.cell = *std::max_element(extent.begin(), extent.end()) / kCellsAlongLongest;
  if (!(grid.cell > 0)) return grid;
  // Lines that miss the round coordinates that modellers give to vertices.
  for (std::size_t k = 0; k < 3; ++k) {
    grid.low[k] = low[k] - (.31 + .17 * static_cast<double>(k)) * grid.cell;
    grid.count[k] = static_cast<std::size_t>(extent[k] / grid.cell) + 2;
  }
  return grid;
}

// Where a line along z goes through a triangle, and which way: +1 out of its front.
struct Crossing {
  double height;
  int side;
};

// The number of cells whose middles are in the mesh.
std::size_t cells_in_mesh(const Grid& grid, const std::vector<Triangle>& triangles, const std::vector<Vec3>& vertices) {
  std::vector<std::vector<Crossing>> lines(grid.count[0] * grid.count[1]);
  for (const auto& [i, j, k] : triangles) {
    const Vec3 &a = vertices[i], &b = vertices[j], &c = vertices[k];
    const Vec3 normal = cross(b - a, c - a);
    if (normal[2] == 0) continue;
    const auto [x0, x1] = grid.range(0, std::min({a[0], b[0], c[0]}), std::max({a[0], b[0], c[0]}));
    const auto [y0, y1] = grid.range(1, std::min({a[1], b[1], c[1]}), std::max({a[1], b[1], c[1]}));
    const int side = normal[2] > 0 ? 1 : -1;
    for (std::size_t x = x0; x < x1; ++x) {
      for (std::size_t y = y0; y < y1; ++y) {
        const double px = grid.middle(0, x), py = grid.middle(1, y);
        const auto is_left = [&](const Vec3& from, const Vec3& to) {
          return side * ((to[0] - from[0]) * (py - from[1]) - (to[1] - from[1]) * (px - from[0])) >= 0;
        };
        if (!is_left(a, b) || !is_left(b, c) || !is_left(c, a)) continue;
        const double height = a[2] - (normal[0] * (px - a[0]) + normal[1] * (py - a[1])) / normal[2];
        lines[x * grid.count[1] + y].push_back({height, side});
      }
    }
  }
  std::size_t inside = 0;
  for (std::vector<Crossing>& line : lines) {
    std::sort(line.begin(), line.end(), [](const Crossing& a, const Crossing& b) { return a.height < b.height; });
    int above = 0, below = 0;
    for (const Crossing& crossing : line) above += crossing.side;
    for (std::size_t n = 0; n + 1 < line.size(); ++n) {
      below += line[n].side;
      above -= line[n].side;
      // Where the mesh has a hole, one of the two does not end at 0.
      if (below == 0 || above == 0) continue;
      const auto [first, end] = grid.range(2, line[n].height, line[n + 1].height);
      inside += end - first;
    }
  }
  return inside;
}

std::size_t cells_in_bodies(const Grid& grid, const std::vector<LinkSolid>& solids, const std::vector<Vec3>& centres,
                            const PosedBodies& bodies) {
  std::vector<bool> inside(grid.count[0] * grid.count[1] * grid.count[2], false);
  for (std::size_t n = 0; n < solids.size(); ++n) {
    const double radius = solids[n].solid.radius;
    std::array<std::array<std::size_t, 2>, 3> range;
    for (std::size_t k = 0; k < 3; ++k) range[k] = grid.range(k, centres[n][k] - radius, centres[n][k] + radius);
    for (std::size_t x = range[0][0]; x < range[0][1]; ++x) {
      for (std::size_t y = range[1][0]; y < range[1][1]; ++y) {
        for (std::size_t z = range[2][0]; z < range[2][1]; ++z) {
          const std::size_t index = (x * grid.count[1] + y) * grid.count[2] + z;
          if (inside[index]) continue;
          const Vec3 point = {grid.middle(0, x), grid.middle(1, y), grid.middle(2, z)};
          inside[index] = is_inside(solids[n].solid, bodies.frame(solids[n].link).in(point));
        }
      }
    }
  }
  return static_cast<std::size_t>(std::count(inside.begin(), inside.end(), true));
}

void measure_volumes(const CheckedSkin& skin, bool has_triangles, const rig::SkinBodyStorage& storage,
                     Coverage& coverage) {
  const std::vector<Affine> pose = skin.joints(0);
  const std::vector<Vec3> vertices = skin.vertices(pose);
  const PosedBodies bodies(storage.solids, storage.joints, pose);
  std::vector<Vec3> centres;
  for (const LinkSolid& body : storage.solids) centres.push_back(bodies.frame(body.link).out(body.solid.centre));
  // Vertices without weight are in no triangle and stay at 0.
  std::vector<Vec3> used;
  for (const Triangle& triangle : skin.triangles())
    for (const std::uint32_t v : triangle) used.push_back(vertices[v]);
  const Grid grid = grid_about(used, storage.solids, centres);
  if (!(grid.cell > 0)) return;
  coverage.bodies_volume = grid.volume() * static_cast<double>(cells_in_bodies(grid, storage.solids, centres, bodies));
  if (has_triangles)
    coverage.mesh_volume = grid.volume() * static_cast<double>(cells_in_mesh(grid, skin.triangles(), vertices));
}

void measure_surface(const CheckedSkin& skin, bool has_triangles, const rig::SkinBodyStorage& storage,
                     Coverage& coverage) {
  double all = 0, inside = 0;
  for (std::size_t p = 0; p < skin.pose_count(); ++p) {
    const std::vector<Affine> pose = skin.joints(p);
    const std::vector<Vec3> vertices = skin.vertices(pose);
    const PosedBodies bodies(storage.solids, storage.joints, pose);
    for (std::size_t t = 0; t < skin.triangles().size(); ++t) {
      const auto& [a, b, c] = skin.triangles()[t];
      const std::array<Vec3, 7> points = samples({vertices[a], vertices[b], vertices[c]});
      const double quarter =
          has_triangles ? length(cross(vertices[b] - vertices[a], vertices[c] - vertices[a])) / 8 : .25;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const bool is_inside = bodies.is_inside(points[k], storage.owners[t]);
        if (k >= 3) {
          all += quarter;
          inside += is_inside ? quarter : 0;
        }
        if (is_inside) continue;
        const double out = bodies.distance_above(points[k], storage.owners[t], coverage.worst_protrusion);
        if (out > coverage.worst_protrusion) {
          coverage.worst_protrusion = out;
          coverage.worst_pose = static_cast<std::uint32_t>(p);
          coverage.worst_joint = storage.joints[storage.owners[t]];
        }
      }
    }
  }
  coverage.share_inside = all > 0 ? inside / all : 1;
}

void measure_boxes(const rig::SkinBodyStorage& storage, Coverage& coverage) {
  std::vector<double> ratios;
  for (const LinkSolid& body : storage.solids) {
    if (body.solid.volume > 0)
      ratios.push_back(body.solid.box_volume / body.solid.volume);
    else
      ++coverage.flat_count;
  }
  if (ratios.empty()) return;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  coverage.median_box_ratio = *middle;
}

}  // namespace
}  // namespace cab::scenes

namespace cab::rig {

SkinStatus measure_coverage(const Skin& skin, const SkinBodies& bodies, Coverage* out) noexcept {
  if (out == nullptr) return SkinStatus::kBadOutput;
  const SkinBodyStorage* const storage = SkinBodiesAccess::get(bodies);
  if (storage == nullptr) return SkinStatus::kBadBodies;
  try {
    scenes::CheckedSkin checked;
    const SkinStatus status = checked.check(skin);
    if (status != SkinStatus::kOk) return status;
    if (storage->joint_count != checked.joint_count() || storage->owners.size() != checked.triangles().size())
      return SkinStatus::kBadBodies;
    Coverage coverage = {};
    scenes::measure_surface(checked, !skin.triangles.empty(), *storage, coverage);
    scenes::measure_volumes(checked, !skin.triangles.empty(), *storage, coverage);
    scenes::measure_boxes(*storage, coverage);
    *out = coverage;
    return SkinStatus::kOk;
  } catch (const std::bad_alloc&) { return SkinStatus::kOutOfMemory; }
}

}  // namespace cab::rig
