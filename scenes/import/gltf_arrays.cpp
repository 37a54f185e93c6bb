// The values of accessors of a glTF file of version 2.
#include "scenes/import/gltf_arrays.h"

#include <algorithm>
#include <cstring>

namespace cab::scenes {
namespace {

using Json = GltfDocument::Json;

template <class T>
T value_at(std::string_view bytes, std::size_t index) {
  T value;
  std::memcpy(&value, bytes.data() + index * sizeof(T), sizeof(T));
  return value;
}

template <class T, class Out, class Convert>
std::vector<Out> converted(std::string_view bytes, Convert convert) {
  std::vector<Out> values(bytes.size() / sizeof(T));
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = convert(value_at<T>(bytes, k));
  return values;
}

// Integers as floats. A signed one has two values for -1.
template <class T>
std::vector<float> as_floats(std::string_view bytes, bool normalized) {
  constexpr auto kMost = static_cast<float>(std::numeric_limits<T>::max());
  return converted<T, float>(bytes, [normalized](T value) {
    const auto number = static_cast<float>(value);
    return normalized ? std::max(number / kMost, -1.0f) : number;
  });
}

template <class T>
std::vector<std::uint32_t> as_whole(std::string_view bytes) {
  return converted<T, std::uint32_t>(bytes, [](T value) { return std::uint32_t{value}; });
}

}  // namespace

std::string_view GltfArrays::view(std::size_t view, const std::string& where) {
  const std::string at = GltfDocument::place("bufferViews", view);
  const Json& item = file_.collection("bufferViews")[view];
  const std::size_t buffer = file_.index_by(item, "buffer", "buffers", at);
  if (buffers_.count(buffer) == 0) {
    for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
      if (GltfDocument::has_extension(item, extension) && !file_.has_data(buffer))
        file_.fail("meshopt compression", "(" + std::string(extension) + ") is not supported");
    buffers_[buffer] = file_.load_buffer(buffer, where);
  }
  return std::string_view(buffers_[buffer])
      .substr(file_.number_or(item, "byteOffset", at, 0), file_.number(item, "byteLength", at));
}

// The items of an accessor without gaps between them, with its sparse values in their places.
std::string GltfArrays::items(std::size_t accessor) {
  const std::string where = GltfDocument::place("accessors", accessor);
  const Json& item = file_.collection("accessors")[accessor];
  const std::size_t item_bytes = file_.component_bytes(item, where) * file_.component_count(item, where);
  const std::size_t count = file_.number(item, "count", where);
  std::string items(count * item_bytes, '\0');
  if (item.contains("bufferView") && count > 0) {
    const std::size_t index = file_.index_by(item, "bufferView", "bufferViews", where);
    const std::string_view bytes = view(index, where).substr(file_.number_or(item, "byteOffset", where, 0));
    std::size_t stride = file_.number_or(file_.collection("bufferViews")[index], "byteStride", where, 0);
    if (stride == 0) stride = item_bytes;
    for (std::size_t k = 0; k < count; ++k)
      std::memcpy(items.data() + k * item_bytes, bytes.data() + k * stride, item_bytes);
  }
  const auto sparse = item.find("sparse");
  if (sparse == item.end()) return items;
  const std::string at = where + ".sparse";
  const auto part = [&](const char* name) {
    const Json& values = (*sparse)[name];
    const std::string part_at = at + "." + name;
    return view(file_.index_by(values, "bufferView", "bufferViews", part_at), part_at)
        .substr(file_.number_or(values, "byteOffset", part_at, 0));
  };
  const std::string_view indices = part("indices"), values = part("values");
  const std::size_t index_bytes = file_.component_bytes((*sparse)["indices"], at + ".indices");
  const std::size_t changes = file_.number(*sparse, "count", at);
  for (std::size_t k = 0; k < changes; ++k) {
    std::size_t index = 0;
    for (std::size_t b = index_bytes; b-- > 0;)
      index = index << 8 | static_cast<unsigned char>(indices[k * index_bytes + b]);
    if (index >= count)
      file_.fail(at, "has a value for item " + std::to_string(index) + " of " + std::to_string(count));
    std::memcpy(items.data() + index * item_bytes, values.data() + k * item_bytes, item_bytes);
  }
  return items;
}

std::vector<float> GltfArrays::floats(std::size_t accessor, bool normalized) {
  const std::string where = GltfDocument::place("accessors", accessor);
  const Json& item = file_.collection("accessors")[accessor];
  const auto flag = item.find("normalized");
  normalized = normalized || (flag != item.end() && *flag == true);
  const std::string bytes = items(accessor);
  switch (file_.number(item, "componentType", where)) {
    case kGltfByte: return as_floats<std::int8_t>(bytes, normalized);
    case kGltfUnsignedByte: return as_floats<std::uint8_t>(bytes, normalized);
    case kGltfShort: return as_floats<std::int16_t>(bytes, normalized);
    case kGltfUnsignedShort: return as_floats<std::uint16_t>(bytes, normalized);
    case kGltfFloat: return converted<float, float>(bytes, [](float value) { return value; });
    default: file_.fail(where, "must have floats, or integers of 8 or 16 bits");
  }
}

std::vector<std::uint32_t> GltfArrays::whole_numbers(std::size_t accessor) {
  const std::string where = GltfDocument::place("accessors", accessor);
  const std::string bytes = items(accessor);
  switch (file_.number(file_.collection("accessors")[accessor], "componentType", where)) {
    case kGltfUnsignedByte: return as_whole<std::uint8_t>(bytes);
    case kGltfUnsignedShort: return as_whole<std::uint16_t>(bytes);
    case kGltfUnsignedInt: return as_whole<std::uint32_t>(bytes);
    default: file_.fail(where, "must have unsigned integers");
  }
}

}  // namespace cab::scenes
