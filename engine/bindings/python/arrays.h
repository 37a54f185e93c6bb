// Arrays of NumPy as spans and poses. Nothing is copied: an array of another dtype, shape or layout is refused.
#pragma once

#include <pybind11/numpy.h>

#include <cab/types.h>

#include <cstddef>
#include <string>
#include <vector>

namespace cab::python {

namespace py = pybind11;

// What a call wants of an array.
struct Wanted {
  const char* name;                // of the argument
  std::vector<py::ssize_t> shape;  // -1: any length
  const char* words;               // the shape in words, such as "(n, 3)"
};

// Checks that `value` is an array of `dtype` with that shape, without gaps in memory. Raises TypeError or ValueError.
py::array checked(const py::object& value, const py::dtype& dtype, const Wanted& wanted);

// The values of such an array. `value` must outlive the span.
template <class T>
Span<T> span_of(const py::object& value, const Wanted& wanted) {
  const py::array array = checked(value, py::dtype::of<std::remove_const_t<T>>(), wanted);
  if constexpr (std::is_const_v<T>)
    return {static_cast<T*>(array.data()), static_cast<std::size_t>(array.size())};
  else
    return {static_cast<T*>(const_cast<py::array&>(array).mutable_data()), static_cast<std::size_t>(array.size())};
}

// The poses in an array, which must outlive them.
struct PoseArray {
  PoseView view;
  std::size_t instances = 0;
  std::size_t links = 0;
  bool has_last_row = false;  // whether they are 4x4
  bool column = false;        // whether a matrix is indexed by column, then row
};

// Poses of shape (instances, links, 7), (instances, links, 3, 4) or (instances, links, 4, 4), float32. `column` says
// that a matrix is indexed by column, then row. Any strides are taken that the engine can walk: numbers of a pose as
// they stand in memory by rows or by columns, instances and links any positive multiple of 4 bytes apart.
PoseArray poses_of(const py::object& value, const char* name, bool column, bool has_scale);

// Raises ValueError if 4x4 matrices are in the other order, which a last row tells that is not 0 0 0 1. Looks at those
// of `instances`, or at all if there are none, until one has a translation. A matrix that the engine masks tells
// nothing.
void refuse_other_order(const PoseArray& poses, const char* name, Span<const std::uint32_t> instances = {});

// Raises ValueError unless each matrix of a skin, (bones, 4, 4) or (poses, joints, 4, 4), has a last row of 0 0 0 1. Of
// one that is not a number it says nothing.
void require_last_rows(const py::array_t<float, py::array::c_style>& matrices, const char* name, bool column);

// A new array of `count` values whose bytes are not set.
py::array empty_array(const py::dtype& dtype, std::size_t count);

}  // namespace cab::python
