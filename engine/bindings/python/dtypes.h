// What calls write and read, as structured dtypes of NumPy: the members of the C++ structs at their places.
#pragma once

#include <pybind11/numpy.h>

namespace cab::python {

namespace py = pybind11;

py::dtype hit_dtype();                 // Hit
py::dtype contact_dtype();             // Contact
py::dtype touching_triangles_dtype();  // TouchingTriangles
py::dtype surface_point_dtype();       // SurfacePoint
py::dtype query_dtype();               // Query
py::dtype query_plane_dtype();         // QueryPlane
py::dtype query_hit_dtype();           // QueryHit
py::dtype query_link_dtype();          // QueryLink
py::dtype box_dtype();                 // Box
py::dtype ignored_pair_dtype();        // IgnoredPair

}  // namespace cab::python
