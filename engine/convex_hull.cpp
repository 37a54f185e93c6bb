// Convex hulls by qhull, whose memory and error output do not leave this file.
#include "engine/convex_hull.h"

#include <cstdio>
#include <memory>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace cab {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

// A qhull state that frees its memory.
struct Qhull {
  qhT state{};
  Qhull() { qh_zero(&state, nullptr); }
  ~Qhull() {
    qh_freeqhull(&state, !qh_ALL);
    int long_blocks = 0, long_bytes = 0;
    qh_memfreeshort(&state, &long_blocks, &long_bytes);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;
};

}  // namespace

ConvexHull convex_hull(Span<const float> vertices) {
  ConvexHull out;
  std::vector<double> points(vertices.begin(), vertices.end());
  const int count = static_cast<int>(points.size() / 3);
  // qhull prints errors to a file. The caller learns of them from face_count.
  const std::unique_ptr<std::FILE, CloseFile> nowhere(std::fopen("/dev/null", "w"));
  Qhull qhull;
  qhT* qh = &qhull.state;
  char command[] = "qhull Qt";
  if (!nowhere || qh_new_qhull(qh, 3, count, points.data(), false, command, nullptr, nowhere.get()) != 0) return out;

  std::vector<int> index(points.size() / 3, -1);
  facetT* facet;
  vertexT *vertex, **vertexp;
  FORALLfacets {
    out.faces.push_back(3);
    FOREACHvertex_(facet->vertices) {
      int& at = index[static_cast<std::size_t>(qh_pointid(qh, vertex->point))];
      if (at < 0) {
        at = static_cast<int>(out.vertices.size() / 3);
        out.vertices.insert(out.vertices.end(), vertex->point, vertex->point + 3);
      }
      out.faces.push_back(at);
    }
    ++out.face_count;
  }
  return out;
}

}  // namespace cab
