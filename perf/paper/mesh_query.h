// Exact queries on triangle meshes by FCL: the alternative to the convex pieces that the engine is given of a link that
// is not convex. For comparison only, below the public API, on one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "scenes/paper/dented_link.h"
#include "scenes/scene.h"

namespace cab::perf {

enum class MeshAnswer : std::uint8_t {
  kApart,
  kSurfacesMeet,
  kNested,  // no triangles overlap, but one body lies wholly inside the other
};

// A closed surface in one piece, with FCL's hierarchy of boxes (OBBRSS) over its triangles.
class MeshBody {
 public:
  // Throws std::runtime_error where FCL does not take the mesh.
  explicit MeshBody(const scenes::TriangleMesh& mesh);
  ~MeshBody();
  MeshBody(const MeshBody&) = delete;
  MeshBody& operator=(const MeshBody&) = delete;

  // This body posed by pose_a against another, or itself, posed by pose_b. A pose is 12 floats, three rows of four,
  // within float rounding of rigid.
  MeshAnswer query(const float* pose_a, const MeshBody& b, const float* pose_b) const;

 private:
  struct Surface;
  std::unique_ptr<Surface> surface_;
};

// The exact queries of a scene whose links are all dented links, and what they took.
class MeshQueries {
 public:
  // The scene must outlive this. Throws std::runtime_error if it has links that are not dented, not exactly one leaf
  // per link, origins, or poses that are not 3x4 matrices.
  explicit MeshQueries(const scenes::Scene& scene);

  // Those of the pairs of links, as EngineSession gives them, that touch; in the same order.
  std::vector<Touch> touching(const std::vector<Touch>& pairs);

  // Sums over all calls.
  double seconds() const { return seconds_; }
  std::uint64_t nested_count() const { return nested_count_; }

 private:
  const scenes::Scene& scene_;
  MeshBody link_;
  double seconds_ = 0;
  std::uint64_t nested_count_ = 0;
};

// Hits that are in only one of two lists, both sorted as EngineSession does: which links in which frame, and how deep
// the pieces overlap. The first few, then how many more.
std::vector<std::string> differing_hits(const scenes::Scene& scene, const std::vector<Touch>& on_pieces,
                                        const std::vector<Touch>& on_meshes);

}  // namespace cab::perf
