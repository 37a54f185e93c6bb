// What one batch gives to a call, and gets back: arrays of NumPy as a BatchInput.
#pragma once

#include <pybind11/numpy.h>

#include <cab/types.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cab::python {

namespace py = pybind11;

// What a batch is, to check arrays against.
struct BatchRecord {
  BatchId id;
  std::uint32_t instance_count = 0;
  std::uint32_t link_count = 0;
  std::uint32_t node_count = 0;
  BatchKind kind = BatchKind::kCharacters;
  bool is_static = false;
};

// A BatchInput and the arrays that it points to, which it keeps alive.
class FrameInput {
 public:
  // Keyword arguments as in BatchInput; None where there is none. `in_contact` asks for bytes.
  FrameInput(const BatchRecord& batch, const py::object& poses, bool column, bool has_scale,
             const py::kwargs& arguments);

  const BatchInput& input() const { return input_; }

  // How many instances arrays are about.
  std::size_t count() const { return count_; }

  // Where the engine reads poses, and why: a test compares this with the address of the array.
  std::uintptr_t poses_address() const { return reinterpret_cast<std::uintptr_t>(input_.poses.data); }

  py::object flags() const { return flags_; }
  py::object in_contact() const { return in_contact_; }

 private:
  class Arguments;

  template <class T>
  void take(Span<const T>& span, Arguments& rest, const char* name, py::ssize_t per_instance);

  BatchInput input_;
  std::size_t count_ = 0;
  std::vector<py::object> held_;
  py::object flags_ = py::none();
  py::object in_contact_ = py::none();
};

}  // namespace cab::python
