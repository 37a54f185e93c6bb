// The vertices of convex hulls by qhull, whose memory and error output do not leave this file.
#include "engine/exact/hull.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace cab {
namespace {

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

// A stream into memory, which needs no file descriptor.
struct MemoryStream {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  MemoryStream() = default;
  ~MemoryStream() {
    if (stream) std::fclose(stream);
    std::free(text);
  }
  MemoryStream(const MemoryStream&) = delete;
  MemoryStream& operator=(const MemoryStream&) = delete;
};

}  // namespace

std::vector<float> hull_vertices(Span<const float> vertices) {
  std::vector<float> all(vertices.begin(), vertices.end());
  if (all.size() <= 9) return all;  // no vertex of a triangle is inside it, and qhull takes some 10 us to refuse it
  // Scaled to about 1 by a power of two, so that the unit of length has no effect on the answer.
  double largest = 0;
  for (const float v : all) largest = std::max(largest, std::fabs(static_cast<double>(v)));
  if (!(largest > 0)) return all;
  std::vector<double> points;
  points.reserve(all.size());
  for (const float v : all) points.push_back(std::ldexp(static_cast<double>(v), -std::ilogb(largest)));

  const MemoryStream errors;  // qhull prints what went wrong, and must have a stream for it
  Qhull qhull;
  qhT* qh = &qhull.state;
  char command[] = "qhull";
  const int count = static_cast<int>(points.size() / 3);
  if (!errors.stream || qh_new_qhull(qh, 3, count, points.data(), false, command, nullptr, errors.stream) != 0)
    return all;

  std::vector<bool> on_hull(points.size() / 3, false);
  vertexT* vertex;
  FORALLvertices { on_hull[static_cast<std::size_t>(qh_pointid(qh, vertex->point))] = true; }
  std::vector<float> out;
  for (std::size_t v = 0; v < on_hull.size(); ++v)
    if (on_hull[v]) out.insert(out.end(), all.data() + 3 * v, all.data() + 3 * v + 3);
  return out;
}

bool has_qhull() { return true; }

}  // namespace cab
