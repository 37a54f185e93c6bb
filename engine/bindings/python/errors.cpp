#include "engine/bindings/python/errors.h"

#include <pybind11/pybind11.h>

#include <cab/cab.h>

namespace cab::python {
namespace py = pybind11;

void raise_message(Status status, const std::string& message) {
  const py::object error = py::module_::import("cab._errors").attr("make_error")(static_cast<int>(status), message);
  PyErr_SetObject(py::type::handle_of(error).ptr(), error.ptr());
  throw py::error_already_set();
}

void raise_status(Status status, const std::string& detail) {
  raise_message(status, detail.empty() ? to_string(status) : detail + ": " + to_string(status));
}

std::string element(const char* what, std::size_t index) { return std::string(what) + " " + std::to_string(index); }

}  // namespace cab::python
