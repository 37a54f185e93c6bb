// The extension module cab._cab: the engine for the Python files of the package `cab`, which are its public face.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cab/cab.h>
#include <cab/cab_c.h>

#include <string>
#include <vector>

#include "engine/bindings/python/body_data.h"
#include "engine/bindings/python/dtypes.h"
#include "engine/bindings/python/engine_handle.h"

namespace cab::python {
namespace {

// [(field, meaning, [(value, meaning)])] in the order of policy_table().
py::list policy_rows() {
  py::list rows;
  for (const PolicyField& field : policy_table()) {
    py::list values;
    for (std::uint32_t v = 0; v < field.value_count; ++v)
      values.append(py::make_tuple(field.values[v].name, field.values[v].meaning));
    rows.append(py::make_tuple(field.name, field.meaning, values));
  }
  return rows;
}

// [(name, meaning, [name of each field's value])] in the order of preset_table().
py::list preset_rows() {
  py::list rows;
  const Span<const PolicyField> fields = policy_table();
  for (const PolicyPreset& preset : preset_table()) {
    py::list values;
    for (std::uint32_t f = 0; f < fields.size; ++f)
      values.append(fields[f].values[policy_get(preset.policies, f)].name);
    rows.append(py::make_tuple(preset.name, preset.meaning, values));
  }
  return rows;
}

// The instruction sets that run here.
std::vector<std::string> available_isas() {
  std::vector<std::string> names;
  for (std::uint32_t value = 1; value < kIsaCount; ++value)
    if (isa_available(static_cast<Isa>(value))) names.emplace_back(to_string(static_cast<Isa>(value)));
  return names;
}

// pybind11 before 2.12 reads the dtypes of NumPy 2 wrongly.
constexpr bool kKnowsNumPy2 = PYBIND11_VERSION_HEX >= 0x020C0000;

// Raises ImportError for a NumPy that this module does not know.
void require_known_numpy() {
  const auto numpy = py::module_::import("numpy").attr("__version__").cast<std::string>();
  if (kKnowsNumPy2 || std::stoi(numpy) < 2) return;
  throw py::import_error("cab was built with pybind11 " + std::to_string(PYBIND11_VERSION_MAJOR) + "." +
                         std::to_string(PYBIND11_VERSION_MINOR) + ", which does not know NumPy " + numpy +
                         ": install numpy<2, or build cab with pybind11 2.12 or newer");
}

}  // namespace

PYBIND11_MODULE(_cab, module) {
  require_known_numpy();
  module.doc() = "The engine of cab. Use the package cab, not this module.";
  module.attr("knows_numpy_2") = kKnowsNumPy2;
  module.attr("hit_dtype") = hit_dtype();
  module.attr("contact_dtype") = contact_dtype();
  module.attr("touching_triangles_dtype") = touching_triangles_dtype();
  module.attr("surface_point_dtype") = surface_point_dtype();
  module.attr("query_dtype") = query_dtype();
  module.attr("query_plane_dtype") = query_plane_dtype();
  module.attr("query_hit_dtype") = query_hit_dtype();
  module.attr("query_link_dtype") = query_link_dtype();
  module.attr("box_dtype") = box_dtype();
  module.def("version", [] { return std::string(version().text); });
  module.def("abi_version", [] { return CAB_ABI_VERSION; });
  module.def("build_info", [] {
    const BuildInfo info = build_info();
    return py::make_tuple(info.fcl, info.qhull, info.tbb);
  });
  module.def("policy_table", &policy_rows);
  module.def("preset_table", &preset_rows);
  module.def("available_isas", &available_isas);
  module.def("status_words", [](int status) { return std::string(to_string(static_cast<Status>(status))); });
  bind_body_data(module);
  bind_engine(module);
  bind_files(module);
}

}  // namespace cab::python
