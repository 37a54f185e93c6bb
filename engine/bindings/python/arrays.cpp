#include "engine/bindings/python/arrays.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>

namespace cab::python {
namespace {

std::string shape_words(const py::array& array) {
  std::string words = "(";
  for (py::ssize_t k = 0; k < array.ndim(); ++k) {
    if (k > 0) words += ", ";
    words += std::to_string(array.shape(k));
  }
  return words + (array.ndim() == 1 ? ",)" : ")");
}

std::string dtype_words(const py::dtype& dtype) {
  return dtype.has_fields() ? "fields" : py::str(static_cast<const py::handle&>(dtype)).cast<std::string>();
}

// "poses: float32 of shape (n, links, 7) is wanted, and"
std::string wanted_words(const char* name, const py::dtype& dtype, const char* shape) {
  return std::string(name) + ": an array of " + dtype_words(dtype) + " of shape " + shape + " is wanted, and ";
}

// What addresses of structures must be a multiple of: NumPy calls structures without padding aligned anywhere.
std::size_t alignment_of(const py::dtype& dtype) {
  std::size_t most = 1;
  if (!dtype.has_fields()) return most;
  for (const py::handle field : dtype.attr("fields").attr("values")())
    most = std::max(most, field[py::int_(0)].attr("base").attr("alignment").cast<std::size_t>());
  return most;
}

// Whether an array has a mask, which a call would not see.
bool is_masked_array(const py::object& value) {
  if (Py_TYPE(value.ptr()) == py::detail::npy_api::get().PyArray_Type_) return false;
  return py::isinstance(value, py::module_::import("numpy.ma").attr("MaskedArray"));
}

// Raises TypeError unless `value` is an array of the dtype in the machine's byte order.
py::array typed(const py::object& value, const py::dtype& dtype, const char* name, const char* shape) {
  if (!py::isinstance<py::array>(value))
    throw py::type_error(wanted_words(name, dtype, shape) + std::string(Py_TYPE(value.ptr())->tp_name) + " is given");
  if (is_masked_array(value))
    throw py::type_error(std::string(name) + ": a masked array is given, whose mask would be lost; " + name +
                         ".filled() makes an array without one");
  py::array array = py::reinterpret_borrow<py::array>(value);
  if (!py::detail::npy_api::get().PyArray_EquivTypes_(array.dtype().ptr(), dtype.ptr())) {
    if (dtype.has_fields())
      throw py::type_error(std::string(name) + ": an array of one of cab's structured dtypes is wanted, with its " +
                           "fields at their places, and " + dtype_words(array.dtype()) + " are given");
    throw py::type_error(wanted_words(name, dtype, shape) + dtype_words(array.dtype()) + " is given; " + name +
                         ".astype(numpy." + dtype_words(dtype) + ") makes such an array");
  }
  const bool aligned = (array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) != 0;
  if (!aligned || reinterpret_cast<std::uintptr_t>(array.data()) % alignment_of(dtype) != 0)
    throw py::value_error(std::string(name) +
                          ": the array does not lie at a multiple of its number's size in memory; " + name +
                          ".copy() makes one that does");
  return array;
}

// What a number of the last row may be off 0 0 0 1. Inverse bind matrices of exporters are off by 1e-6.
constexpr float kLastRowTolerance = 1e-5f;

// How far a matrix may be from a rotation with a factor and still count as one. The engine masks what is 1e-3 off.
constexpr float kTurnTolerance = 1e-2f;

// The 16 floats of a matrix where they lie. `down` is how far apart rows are: 4 by rows, 1 by columns.
struct Matrix {
  const float* floats;
  int down;

  float at(int row, int column) const { return floats[row * down + column * (5 - down)]; }
};

bool is_moved(const Matrix& m, float tolerance) {
  return std::abs(m.at(0, 3)) > tolerance || std::abs(m.at(1, 3)) > tolerance || std::abs(m.at(2, 3)) > tolerance;
}

// Whether the last row is 0 0 0 1, or not a number.
bool has_last_row(const Matrix& m, float tolerance = kLastRowTolerance) {
  for (int k = 0; k < 3; ++k)
    if (std::abs(m.at(3, k)) > tolerance) return false;
  return !(std::abs(m.at(3, 3) - 1) > kLastRowTolerance);
}

// Whether the part for directions is a rotation with a factor, mirrored or not. By rows and by columns it is the same.
bool turns(const Matrix& m) {
  const auto dot = [&m](int a, int b) {
    return m.at(a, 0) * m.at(b, 0) + m.at(a, 1) * m.at(b, 1) + m.at(a, 2) * m.at(b, 2);
  };
  const float size = dot(0, 0), most = kTurnTolerance * size;
  return size > 0 && std::abs(dot(1, 1) - size) <= most && std::abs(dot(2, 2) - size) <= most &&
         std::abs(dot(0, 1)) <= most && std::abs(dot(0, 2)) <= most && std::abs(dot(1, 2)) <= most;
}

[[noreturn]] void raise_last_row(const Matrix& m, const std::string& name, const std::string& which, bool column) {
  std::ostringstream words;
  words << name << ": the last " << (column ? "column" : "row") << " of the matrix of " << which
        << " must be 0 0 0 1, and it is " << m.at(3, 0) << " " << m.at(3, 1) << " " << m.at(3, 2) << " " << m.at(3, 3);
  if (column)
    words << "; order=\"column\" says that matrices are indexed by column, then row: leave it out if they are not";
  else
    words << "; say order=\"column\" if matrices are indexed by column, then row, or hand over " << name
          << ".swapaxes(-1, -2)";
  throw py::value_error(words.str());
}

}  // namespace

py::array checked(const py::object& value, const py::dtype& dtype, const Wanted& wanted) {
  py::array array = typed(value, dtype, wanted.name, wanted.words);
  bool fits = array.ndim() == static_cast<py::ssize_t>(wanted.shape.size());
  for (py::ssize_t k = 0; fits && k < array.ndim(); ++k) {
    const py::ssize_t length = wanted.shape[static_cast<std::size_t>(k)];
    fits = length < 0 || array.shape(k) == length;
  }
  if (!fits) {
    std::string numbers = "(";
    for (std::size_t k = 0; k < wanted.shape.size(); ++k) {
      if (k > 0) numbers += ", ";
      numbers += wanted.shape[k] < 0 ? "any" : std::to_string(wanted.shape[k]);
    }
    numbers += wanted.shape.size() == 1 ? ",)" : ")";
    throw py::value_error(wanted_words(wanted.name, dtype, wanted.words) + "the shape " + shape_words(array) +
                          " is given; here it must be " + numbers);
  }
  if (!(array.flags() & py::array::c_style))
    throw py::value_error(std::string(wanted.name) + ": the array has gaps or another order in memory; numpy." +
                          "ascontiguousarray(" + wanted.name + ") makes one without");
  return array;
}

PoseArray poses_of(const py::object& value, const char* name, bool column, bool has_scale) {
  constexpr const char* kRows = "(n, links, 7), (n, links, 3, 4) or (n, links, 4, 4)";
  constexpr const char* kColumns = "(n, links, 4, 4), by columns,";
  const char* const words = column ? kColumns : kRows;
  const py::dtype dtype = py::dtype::of<float>();
  const py::array array = typed(value, dtype, name, words);
  const py::ssize_t dims = array.ndim();
  const bool quaternions = !column && dims == 3 && array.shape(2) == 7;
  const bool short_matrices = !column && dims == 4 && array.shape(2) == 3 && array.shape(3) == 4;
  const bool matrices = dims == 4 && array.shape(2) == 4 && array.shape(3) == 4;
  if ((!quaternions && !short_matrices && !matrices) || array.shape(1) == 0)
    throw py::value_error(wanted_words(name, dtype, words) + "the shape " + shape_words(array) + " is given");
  if (quaternions && has_scale) throw py::value_error(std::string(name) + ": only matrices can hold a scale");

  PoseArray poses;
  poses.instances = static_cast<std::size_t>(array.shape(0));
  poses.links = static_cast<std::size_t>(array.shape(1));
  poses.view.data = static_cast<const float*>(array.data());
  poses.view.has_scale = has_scale;

  // How the numbers of one pose lie in memory decides the format.
  std::size_t pose_bytes = 0;
  bool in_order = false;
  if (quaternions) {
    in_order = array.strides(2) == 4;
    poses.view.format = PoseFormat::kQuaternionTranslation;
    pose_bytes = 28;
  } else if (array.strides(2) == 16 && array.strides(3) == 4) {
    in_order = true;
    poses.view.format = column ? PoseFormat::kMatrix4x4Columns : PoseFormat::kMatrix3x4Rows;
    pose_bytes = short_matrices ? 48 : 64;
  } else if (matrices && array.strides(2) == 4 && array.strides(3) == 16) {
    in_order = true;
    poses.view.format = column ? PoseFormat::kMatrix3x4Rows : PoseFormat::kMatrix4x4Columns;
    pose_bytes = 64;
  }
  if (!in_order)
    throw py::value_error(std::string(name) + ": the numbers of a pose must lie side by side in memory; numpy." +
                          "ascontiguousarray(" + name + ") makes such an array");

  // NumPy gives an axis of length 1 any stride.
  const auto stride_of = [&](py::ssize_t axis, std::size_t least, const char* words_of) -> std::size_t {
    if (array.shape(axis) <= 1) return least;
    const py::ssize_t stride = array.strides(axis);
    if (stride < static_cast<py::ssize_t>(least) || stride % 4 != 0)
      throw py::value_error(std::string(name) + ": " + words_of + " are " + std::to_string(stride) +
                            " bytes apart; at least " + std::to_string(least) +
                            " are wanted, and a multiple of 4; numpy.ascontiguousarray(" + name +
                            ") makes such an array");
    return static_cast<std::size_t>(stride);
  };
  poses.view.link_stride = stride_of(1, pose_bytes, "links");
  poses.view.instance_stride = stride_of(0, (poses.links - 1) * poses.view.link_stride + pose_bytes, "instances");

  poses.has_last_row = matrices;
  poses.column = column;
  return poses;
}

void refuse_other_order(const PoseArray& poses, const char* name, Span<const std::uint32_t> instances) {
  if (!poses.has_last_row) return;
  const std::size_t count = instances.empty() ? poses.instances : instances.size;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = instances.empty() ? k : instances[k];
    if (i >= poses.instances) return;
    const char* const first = reinterpret_cast<const char*>(poses.view.data) + i * poses.view.instance_stride;
    for (std::size_t l = 0; l < poses.links; ++l) {
      const Matrix m = {reinterpret_cast<const float*>(first + l * poses.view.link_stride),
                        poses.view.format == PoseFormat::kMatrix3x4Rows ? 4 : 1};
      // In the wrong order it is the translation, and the last column is 0 0 0: then no rounding is let pass.
      if (has_last_row(m, is_moved(m, 0) ? kLastRowTolerance : 0)) {
        if (is_moved(m, kLastRowTolerance)) return;
      } else if (turns(m)) {
        raise_last_row(m, name, "pose " + std::to_string(i) + ", link " + std::to_string(l), poses.column);
      }
    }
  }
}

void require_last_rows(const py::array_t<float, py::array::c_style>& matrices, const char* name, bool column) {
  const bool bones = matrices.ndim() == 3;
  for (py::ssize_t k = 0; k < matrices.size() / 16; ++k) {
    const Matrix m = {matrices.data() + 16 * k, column ? 1 : 4};
    if (has_last_row(m)) continue;
    const py::ssize_t joints = bones ? 1 : matrices.shape(1);
    raise_last_row(m, name,
                   bones ? "bone " + std::to_string(k)
                         : "pose " + std::to_string(k / joints) + ", joint " + std::to_string(k % joints),
                   column);
  }
}

py::array empty_array(const py::dtype& dtype, std::size_t count) {
  return py::array(dtype, static_cast<py::ssize_t>(count));
}

}  // namespace cab::python
