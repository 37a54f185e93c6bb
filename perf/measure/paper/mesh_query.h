// Exact queries on triangle meshes by FCL. The engine takes a link that is not convex as convex pieces; the mesh is the
// alternative. For comparison only, below the public API, on one thread.
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
  // Throws std::runtime_error if FCL does not accept the mesh.
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

// The exact queries of a scene whose links are all dented links, and their time.
class MeshQueries {
 public:
  // The scene must outlive this. Throws std::runtime_error if it has links that are not dented, not exactly one leaf
  // per link, origins, or poses that are not 3x4 matrices.
  explicit MeshQueries(const scenes::Scene& scene);

  // Returns the pairs that touch, in the same order. pairs: pairs of links, as EngineSession gives them.
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

// Describes hits that are in only one of two lists: which links in which frame, and how deep the pieces overlap. Both
// lists are sorted as EngineSession sorts them. After the first few hits comes the number of further ones.
std::vector<std::string> differing_hits(const scenes::Scene& scene, const std::vector<Touch>& on_pieces,
                                        const std::vector<Touch>& on_meshes);

}  // namespace cab::perf
