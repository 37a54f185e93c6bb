#include "engine/bindings/python/dtypes.h"

#include <cab/query.h>
#include <cab/types.h>

#include <cstddef>

namespace cab::python {
namespace {

// Members one after the other: name, dtype as NumPy writes it, place.
class Members {
 public:
  void add(const char* name, const char* format, std::size_t offset) {
    names_.append(name);
    formats_.append(format);
    offsets_.append(offset);
  }
  py::dtype dtype(std::size_t size) const {
    py::dict description;
    description["names"] = names_;
    description["formats"] = formats_;
    description["offsets"] = offsets_;
    description["itemsize"] = size;
    return py::dtype::from_args(description);
  }

 private:
  py::list names_;
  py::list formats_;
  py::list offsets_;
};

// What a hit of a query begins with, in full and in a short list.
template <class Hit>
void add_query_link(Members& members) {
  members.add("query", "u4", offsetof(Hit, query));
  members.add("batch", "u4", offsetof(Hit, batch));
  members.add("instance", "u4", offsetof(Hit, instance));
  members.add("link", "u2", offsetof(Hit, link));
  members.add("leaf", "u2", offsetof(Hit, leaf));
}

}  // namespace

py::dtype hit_dtype() {
  Members members;
  members.add("batch_a", "u4", offsetof(Hit, batch_a));
  members.add("instance_a", "u4", offsetof(Hit, instance_a));
  members.add("batch_b", "u4", offsetof(Hit, batch_b));
  members.add("instance_b", "u4", offsetof(Hit, instance_b));
  members.add("link_a", "u2", offsetof(Hit, link_a));
  members.add("link_b", "u2", offsetof(Hit, link_b));
  members.add("leaf_a", "u2", offsetof(Hit, leaf_a));
  members.add("leaf_b", "u2", offsetof(Hit, leaf_b));
  return members.dtype(sizeof(Hit));
}

py::dtype contact_dtype() {
  Members members;
  members.add("normal", "3f4", offsetof(Contact, normal));
  members.add("depth", "f4", offsetof(Contact, depth));
  members.add("point_a", "3f4", offsetof(Contact, point_a));
  members.add("point_b", "3f4", offsetof(Contact, point_b));
  members.add("leaf_a", "u2", offsetof(Contact, leaf_a));
  members.add("leaf_b", "u2", offsetof(Contact, leaf_b));
  return members.dtype(sizeof(Contact));
}

py::dtype touching_triangles_dtype() {
  Members members;
  members.add("pair", "u4", offsetof(TouchingTriangles, pair));
  members.add("leaf_a", "u2", offsetof(TouchingTriangles, leaf_a));
  members.add("leaf_b", "u2", offsetof(TouchingTriangles, leaf_b));
  members.add("triangle_a", "u4", offsetof(TouchingTriangles, triangle_a));
  members.add("triangle_b", "u4", offsetof(TouchingTriangles, triangle_b));
  return members.dtype(sizeof(TouchingTriangles));
}

py::dtype surface_point_dtype() {
  Members members;
  members.add("triangle", "u4", offsetof(SurfacePoint, triangle));
  members.add("weights", "3f4", offsetof(SurfacePoint, weights));
  return members.dtype(sizeof(SurfacePoint));
}

py::dtype query_dtype() {
  Members members;
  members.add("kind", "u1", offsetof(Query, kind));
  members.add("want", "u1", offsetof(Query, want));
  members.add("with_depth", "?", offsetof(Query, with_depth));
  members.add("max_hits", "u4", offsetof(Query, max_hits));
  members.add("layer_mask", "u4", offsetof(Query, layer_mask));
  members.add("ignored_batch", "u8", offsetof(Query, ignored_batch));
  members.add("ignored_instance", "u4", offsetof(Query, ignored_instance));
  members.add("time", "f8", offsetof(Query, time));
  members.add("position", "3f8", offsetof(Query, position));
  members.add("orientation", "4f4", offsetof(Query, orientation));
  members.add("direction", "3f4", offsetof(Query, direction));
  members.add("length", "f4", offsetof(Query, length));
  members.add("radius", "f4", offsetof(Query, radius));
  members.add("half", "3f4", offsetof(Query, half));
  members.add("first_plane", "u4", offsetof(Query, first_plane));
  members.add("plane_count", "u4", offsetof(Query, plane_count));
  return members.dtype(sizeof(Query));
}

py::dtype query_plane_dtype() {
  Members members;
  members.add("normal", "3f4", offsetof(QueryPlane, normal));
  members.add("offset", "f4", offsetof(QueryPlane, offset));
  return members.dtype(sizeof(QueryPlane));
}

py::dtype query_hit_dtype() {
  Members members;
  add_query_link<QueryHit>(members);
  members.add("distance", "f4", offsetof(QueryHit, distance));
  members.add("point", "3f4", offsetof(QueryHit, point));
  members.add("normal", "3f4", offsetof(QueryHit, normal));
  members.add("inside", "?", offsetof(QueryHit, inside));
  return members.dtype(sizeof(QueryHit));
}

py::dtype query_link_dtype() {
  Members members;
  add_query_link<QueryLink>(members);
  return members.dtype(sizeof(QueryLink));
}

py::dtype box_dtype() {
  Members members;
  members.add("center", "3f4", offsetof(Box, center));
  members.add("axis", "(3,3)f4", offsetof(Box, axis));
  members.add("half", "3f4", offsetof(Box, half));
  return members.dtype(sizeof(Box));
}

py::dtype ignored_pair_dtype() {
  Members members;
  members.add("a", "u2", offsetof(IgnoredPair, a));
  members.add("b", "u2", offsetof(IgnoredPair, b));
  members.add("reasons", "u1", offsetof(IgnoredPair, reasons));
  return members.dtype(sizeof(IgnoredPair));
}

}  // namespace cab::python
