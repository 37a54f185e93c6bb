#include "engine/bindings/python/errors.h"

#include <pybind11/pybind11.h>

#include <cab/cab.h>

namespace cab::python {
namespace py = pybind11;

void raise_status(Status status, const std::string& detail) {
  const py::object error =
      py::module_::import("cab._errors").attr("make_error")(static_cast<int>(status), to_string(status), detail);
  PyErr_SetObject(py::type::handle_of(error).ptr(), error.ptr());
  throw py::error_already_set();
}

std::string element(const char* what, std::size_t index) { return std::string(what) + " " + std::to_string(index); }

}  // namespace cab::python
