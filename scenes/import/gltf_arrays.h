// The values of accessors of a glTF file of version 2.
#pragma once

#include "scenes/import/gltf_document.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace cab::scenes {

// Reads accessors of a checked file, which must outlive this object. A buffer is loaded when it is first needed. Throws
// ImportError.
class GltfArrays {
 public:
  explicit GltfArrays(const GltfDocument& file) : file_(file) {}

  // All components as floats. Integers are normalized (3.11 of the specification) if the accessor says so, or if
  // `normalized`. The component type must be float or an integer of 8 or 16 bits.
  std::vector<float> floats(std::size_t accessor, bool normalized);

  // All components as whole numbers. The component type must be an unsigned integer.
  std::vector<std::uint32_t> whole_numbers(std::size_t accessor);

 private:
  std::string items(std::size_t accessor);
  std::string_view view(std::size_t view, const std::string& where);

  const GltfDocument& file_;
  std::map<std::size_t, std::string> buffers_;
};

}  // namespace cab::scenes
