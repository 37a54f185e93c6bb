// The module without the scenes, which read files.
#include "engine/bindings/python/body_data.h"

namespace cab::python {

void bind_files(pybind11::module_& module) {
  module.attr("reads_files") = false;
  module.attr("max_file_bytes") = 0;
}

}  // namespace cab::python
