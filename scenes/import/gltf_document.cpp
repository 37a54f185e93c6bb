// The checks of a glTF file's JSON.
#include "scenes/import/gltf_document.h"

#include "scenes/import/gltf_file.h"
#include "scenes/import/import.h"
#include "scenes/import/input_file.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>
#include <vector>

namespace cab::scenes {
namespace {

using Json = GltfDocument::Json;

constexpr std::size_t kMaxNodeDepth = 1024;  // as of joints in a BVH file; assimp calls itself for each level
constexpr std::uint64_t kMaxNumber = std::uint64_t{1} << 32;
constexpr std::uint64_t kMaxStride = 1 << 16;
// Bytes of a message, besides the file: texts of the file may be of any length.
constexpr std::size_t kMostPlace = 80, kMostReason = 170;

// Extensions that store all of a mesh or a motion in their own way.
constexpr std::pair<std::string_view, const char*> kCompression[] = {
    {"KHR_draco_mesh_compression", "Draco compression"},
    {"EXT_meshopt_compression", "meshopt compression"},
    {"KHR_meshopt_compression", "meshopt compression"},
};

// What a file may require: it is read, or it says nothing about where things are. A name that ends in _ stands for all
// that begin with it.
constexpr std::string_view kKnown[] = {
    "KHR_mesh_quantization",
    "KHR_binary_glTF",
    "KHR_techniques_webgl",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "EXT_materials_",
    "EXT_mesh_features",
    "EXT_instance_features",
    "EXT_structural_metadata",
    "MSFT_texture_",
    "MSFT_packing_",
    "MSFT_lod",
    "ADOBE_materials_",
    "AGI_stk_metadata",
    "CESIUM_primitive_outline",
    "VRM",
    "VRMC_",
};

bool is_known(const std::string& extension) {
  return std::any_of(std::begin(kKnown), std::end(kKnown), [&](std::string_view known) {
    return known.back() == '_' ? extension.rfind(known, 0) == 0 : extension == known;
  });
}

// At most the first bytes of a text, whole characters of UTF-8.
std::string shortened(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

// The text with every %XX as the byte that it means; nothing if a % is followed by anything else, or by 00.
std::optional<std::string> percent_decoded(const std::string& uri) {
  const auto digit = [&uri](std::size_t at) {
    constexpr std::string_view kDigits = "0123456789abcdef0123456789ABCDEF";
    const std::size_t found = at < uri.size() ? kDigits.find(uri[at]) : std::string_view::npos;
    return found == std::string_view::npos ? -1 : static_cast<int>(found % 16);
  };
  std::string text;
  for (std::size_t at = 0; at < uri.size(); ++at) {
    if (uri[at] != '%') {
      text += uri[at];
      continue;
    }
    const int high = digit(at + 1), low = digit(at + 2);
    if (high < 0 || low < 0 || high + low == 0) return {};
    text += static_cast<char>(16 * high + low);
    at += 2;
  }
  return text;
}

// The base64 of a data URI; nothing if it is none. Fillers at the end are left out.
std::optional<std::string_view> base64_of(std::string_view uri) {
  constexpr std::string_view kMark = ";base64";
  const std::size_t comma = std::min(uri.find(','), uri.size());
  const std::string_view head = uri.substr(0, comma);
  if (head.size() < kMark.size() || head.substr(head.size() - kMark.size()) != kMark || comma == uri.size()) return {};
  std::string_view digits = uri.substr(comma + 1);
  while (!digits.empty() && digits.back() == '=') digits.remove_suffix(1);
  return digits;
}

std::size_t base64_bytes(std::string_view digits) { return digits.size() / 4 * 3 + digits.size() % 4 * 3 / 4; }

// Nothing if a character is no digit.
std::optional<std::string> base64_decoded(std::string_view digits) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  static const std::array<std::uint8_t, 256> kValues = [&] {
    std::array<std::uint8_t, 256> values;
    values.fill(0xff);
    for (std::size_t v = 0; v < kDigits.size(); ++v)
      values[static_cast<unsigned char>(kDigits[v])] = static_cast<std::uint8_t>(v);
    return values;
  }();
  std::string bytes;
  bytes.reserve(base64_bytes(digits));
  std::uint32_t bits = 0;
  int bit_count = 0;
  for (const char digit : digits) {
    const std::uint8_t value = kValues[static_cast<unsigned char>(digit)];
    if (value == 0xff) return {};
    bits = bits << 6 | value;
    bit_count += 6;
    if (bit_count < 8) continue;
    bit_count -= 8;
    bytes += static_cast<char>(bits >> bit_count & 0xff);
  }
  return bytes;
}

}  // namespace

std::optional<std::filesystem::path> path_of_uri(const std::string& uri) {
  const std::optional<std::string> text = percent_decoded(uri);
  if (!text || text->empty() || text->find("://") != std::string::npos) return {};
  std::filesystem::path path = std::filesystem::path(*text).lexically_normal();
  if (path.is_absolute() || *path.begin() == "..") return {};
  return path;
}

GltfDocument::GltfDocument(Json json, std::optional<std::string_view> bin, std::filesystem::path folder,
                           std::string name)
    : json_(std::move(json)), bin_(bin), folder_(std::move(folder)), name_(std::move(name)) {}

void GltfDocument::check() {
  check_version();
  check_extensions();
  check_buffers();
  for_each("bufferViews", [this](const Json& view, const std::string& where) { check_view(view, where); });
  for_each("accessors", [this](const Json& accessor, const std::string& where) { check_accessor(accessor, where); });
  check_nodes();
  for_each("meshes", [](const Json&, const std::string&) {});
  for_each("scenes", [this](const Json& scene, const std::string& where) { check_scene(scene, where); });
  if (is_version_1_) return;  // it names the joints and samplers of skins and animations; assimp looks them up
  for_each("skins", [this](const Json& skin, const std::string& where) { check_skin(skin, where); });
  for_each("animations",
           [this](const Json& animation, const std::string& where) { check_animation(animation, where); });
}

void GltfDocument::fail(const std::string& where, const std::string& reason) const {
  throw ImportError(name_ + ": " + shortened(printable(where), kMostPlace) + " " +
                    shortened(printable(reason), kMostReason));
}

const Json& GltfDocument::collection(const char* key) const {
  static const Json kNone = Json::array();
  const auto found = json_.find(key);
  if (found == json_.end()) return kNone;
  if (!found->is_array() && !(is_version_1_ && found->is_object())) fail(key, "must be an array");
  return *found;
}

template <class Check>
void GltfDocument::for_each(const char* key, Check check) const {
  const Json& items = collection(key);
  for (auto item = items.begin(); item != items.end(); ++item) {
    const std::string where =
        items.is_array() ? place(key, static_cast<std::size_t>(item - items.begin())) : key + ("." + item.key());
    if (!item->is_object()) fail(where, "must be an object");
    check(*item, where);
  }
}

std::string GltfDocument::place(const std::string& key, std::size_t index) {
  return key + "[" + std::to_string(index) + "]";
}

std::uint64_t GltfDocument::whole(const Json& value, const std::string& where) const {
  if (!value.is_number_unsigned()) fail(where, "must be a whole number that is not negative");
  if (value.get<std::uint64_t>() > kMaxNumber) fail(where, "is out of range");
  return value.get<std::uint64_t>();
}

std::uint64_t GltfDocument::number(const Json& item, const char* key, const std::string& where) const {
  const auto found = item.find(key);
  if (found == item.end()) fail(where, "has no " + std::string(key));
  return whole(*found, where + "." + key);
}

std::uint64_t GltfDocument::number_or(const Json& item, const char* key, const std::string& where,
                                      std::uint64_t otherwise) const {
  return item.contains(key) ? number(item, key, where) : otherwise;
}

std::string GltfDocument::text(const Json& item, const char* key) const {
  const auto found = item.find(key);
  return found != item.end() && found->is_string() ? found->get<std::string>() : std::string();
}

bool GltfDocument::has_extension(const Json& item, const char* extension) {
  const auto extensions = item.find("extensions");
  return extensions != item.end() && extensions->is_object() && extensions->contains(extension);
}

std::size_t GltfDocument::index(const Json& value, const char* key, const std::string& where) const {
  const Json& items = collection(key);
  const std::uint64_t index = whole(value, where);
  if (index >= items.size())
    fail(where, "is " + std::to_string(index) + ", but there are " + std::to_string(items.size()) + " " + key);
  return static_cast<std::size_t>(index);
}

std::size_t GltfDocument::index_by(const Json& item, const char* field, const char* key,
                                   const std::string& where) const {
  const auto found = item.find(field);
  if (found == item.end()) fail(where, "has no " + std::string(field));
  return index(*found, key, where + "." + field);
}

const Json& GltfDocument::referenced(const Json& value, const char* key, const std::string& where) const {
  const Json& items = collection(key);
  if (items.is_object()) {
    if (!value.is_string() || !items.contains(value.get_ref<const std::string&>()))
      fail(where, "names nothing in " + std::string(key));
    return items[value.get_ref<const std::string&>()];
  }
  return items[index(value, key, where)];
}

const Json& GltfDocument::referenced_by(const Json& item, const char* field, const char* key,
                                        const std::string& where) const {
  const auto found = item.find(field);
  if (found == item.end()) fail(where, "has no " + std::string(field));
  return referenced(*found, key, where + "." + field);
}

const Json& GltfDocument::array(const Json& item, const char* key, const std::string& where) const {
  static const Json kNone = Json::array();
  const auto found = item.find(key);
  if (found == item.end()) return kNone;
  if (!found->is_array()) fail(where + "." + key, "must be an array");
  return *found;
}

void GltfDocument::check_version() {
  const auto asset = json_.find("asset");
  const std::string version = asset != json_.end() && asset->is_object() ? text(*asset, "version") : std::string();
  // Version 1 need not say so. Its items have names.
  const auto nodes = json_.find("nodes");
  is_version_1_ = version.rfind("1", 0) == 0 || (version.empty() && nodes != json_.end() && nodes->is_object());
  if (!is_version_1_ && version != "2" && version.rfind("2.", 0) != 0)
    fail("asset.version", version.empty() ? "is missing" : "is " + version + ", only 1 and 2 are supported");
}

// 3.12 of the specification: a file that requires an extension that is not supported must not be loaded.
void GltfDocument::check_extensions() const {
  for (const Json& required : array(json_, "extensionsRequired", "the file")) {
    if (!required.is_string()) fail("extensionsRequired", "must be an array of texts");
    const std::string& extension = required.get_ref<const std::string&>();
    for (const auto& [compression, what] : kCompression)
      if (extension == compression) fail(what, "(" + extension + ") is not supported");
    if (!is_known(extension)) fail("the extension " + extension, "is required by the file, but is not supported");
  }
}

// The bytes that there are for a buffer; empty for one that nothing holds.
std::optional<std::uint64_t> GltfDocument::stored_bytes(const Json& buffer, const std::string& where) const {
  const std::string uri = text(buffer, "uri");
  const bool is_first = where == "buffers[0]" || where == "buffers.binary_glTF";
  if (is_first && bin_ && (uri.empty() || is_version_1_)) return bin_->size();
  if (uri.empty()) return {};
  if (uri.rfind("data:", 0) == 0) {
    const std::optional<std::string_view> digits = base64_of(uri);
    if (!digits) fail(where, "has a data URI that is not base64");
    return base64_bytes(*digits);
  }
  const std::optional<std::filesystem::path> relative = path_of_uri(uri);
  if (!relative && !percent_decoded(uri))
    fail(where, "is in \"" + uri + "\", in which a % is not followed by two hexadecimal digits of a character");
  if (!relative) fail(where, "is in \"" + uri + "\", which is not below the file's folder");
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(folder_ / *relative, error);
  if (error) fail(where, "is in \"" + uri + "\": " + error.message());
  return size;
}

void GltfDocument::check_buffers() const {
  std::uint64_t sum = 0;
  for_each("buffers", [&](const Json& buffer, const std::string& where) {
    const std::uint64_t size =
        is_version_1_ ? number_or(buffer, "byteLength", where, 0) : number(buffer, "byteLength", where);
    const std::optional<std::uint64_t> stored = stored_bytes(buffer, where);
    if (stored && size > *stored)
      fail(where, "has " + std::to_string(size) + " bytes, but only " + std::to_string(*stored) + " are there");
    sum += size;
    if (sum > kMaxFileBytes)
      fail(where, "makes the buffers larger than " + std::to_string(kMaxFileBytes >> 20) + " MiB");
  });
}

bool GltfDocument::has_data(std::size_t buffer) const {
  return !text(collection("buffers")[buffer], "uri").empty() || (buffer == 0 && bin_);
}

std::string GltfDocument::load_buffer(std::size_t buffer, const std::string& needed_by) const {
  const std::string where = place("buffers", buffer);
  const Json& item = collection("buffers")[buffer];
  const std::string uri = text(item, "uri");
  const std::size_t size = number(item, "byteLength", where);
  std::string bytes;
  if (!has_data(buffer)) fail(where, "has no data, which " + needed_by + " needs");
  if (uri.empty()) {
    bytes = *bin_;
  } else if (uri.rfind("data:", 0) == 0) {
    std::optional<std::string> decoded = base64_decoded(*base64_of(uri));
    if (!decoded) fail(where, "has a data URI that is not base64");
    bytes = std::move(*decoded);
  } else {
    const std::string path = (folder_ / *path_of_uri(uri)).string();
    check_file(path, name_ + ": " + where);
    bytes = read_bytes(path, name_ + ": " + where, size);
  }
  if (bytes.size() < size) fail(where, "has become shorter than " + std::to_string(size) + " bytes");
  bytes.resize(size);
  return bytes;
}

// Fails unless [offset, offset + size) lies in a view.
void GltfDocument::check_range(const Json& view, std::uint64_t offset, std::uint64_t size,
                               const std::string& where) const {
  const std::uint64_t view_bytes = number_or(view, "byteLength", where, 0);
  if (offset > view_bytes || size > view_bytes - offset)
    fail(where, "ends at byte " + std::to_string(offset + size) + " of a buffer view of " + std::to_string(view_bytes) +
                    " bytes");
}

void GltfDocument::check_view(const Json& view, const std::string& where) const {
  const Json& buffer = referenced_by(view, "buffer", "buffers", where);
  const std::uint64_t offset = number_or(view, "byteOffset", where, 0);
  const std::uint64_t size =
      is_version_1_ ? number_or(view, "byteLength", where, 0) : number(view, "byteLength", where);
  if (number_or(view, "byteStride", where, 0) > kMaxStride) fail(where + ".byteStride", "is out of range");
  const std::uint64_t buffer_bytes = number_or(buffer, "byteLength", where, 0);
  if (offset > buffer_bytes || size > buffer_bytes - offset)
    fail(where, "ends at byte " + std::to_string(offset + size) + " of a buffer of " + std::to_string(buffer_bytes) +
                    " bytes");
}

std::uint64_t GltfDocument::component_bytes(const Json& item, const std::string& where) const {
  switch (const std::uint64_t type = number(item, "componentType", where); type) {
    case kGltfByte:
    case kGltfUnsignedByte: return 1;
    case kGltfShort:
    case kGltfUnsignedShort: return 2;
    case kGltfInt:
    case kGltfUnsignedInt:
    case kGltfFloat: return 4;
    default: fail(where, "has the unknown componentType " + std::to_string(type));
  }
}

std::uint64_t GltfDocument::component_count(const Json& accessor, const std::string& where) const {
  static const std::unordered_map<std::string, std::uint64_t> kCounts = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
  const auto found = kCounts.find(text(accessor, "type"));
  if (found == kCounts.end()) fail(where, "has no known type");
  return found->second;
}

void GltfDocument::check_accessor(const Json& accessor, const std::string& where) const {
  const std::uint64_t item_bytes = component_bytes(accessor, where) * component_count(accessor, where);
  const std::uint64_t count = number(accessor, "count", where);
  const std::uint64_t offset = number_or(accessor, "byteOffset", where, 0);
  if (count * item_bytes > kMaxFileBytes) fail(where, "has " + std::to_string(count) + " items, too many");
  if (accessor.contains("bufferView")) {
    const Json& view = referenced_by(accessor, "bufferView", "bufferViews", where);
    std::uint64_t stride = number_or(is_version_1_ ? accessor : view, "byteStride", where, 0);
    if (stride == 0) stride = item_bytes;
    if (stride < item_bytes || stride > kMaxStride)
      fail(where, "has a stride of " + std::to_string(stride) + " bytes, its items have " + std::to_string(item_bytes));
    if (count > 0) check_range(view, offset, (count - 1) * stride + item_bytes, where);
  }
  const auto sparse = accessor.find("sparse");
  if (sparse == accessor.end()) return;
  const std::string at = where + ".sparse";
  if (!sparse->is_object() || !sparse->contains("indices") || !sparse->contains("values"))
    fail(at, "must have indices and values");
  const std::uint64_t changes = number(*sparse, "count", at);
  if (changes > count) fail(at, "has more items than the accessor");
  for (const char* part : {"indices", "values"}) {
    const std::string part_at = at + "." + part;
    const Json& items = (*sparse)[part];
    if (!items.is_object()) fail(part_at, "must be an object");
    const std::uint64_t bytes = std::string_view(part) == "values" ? item_bytes : component_bytes(items, part_at);
    check_range(referenced_by(items, "bufferView", "bufferViews", part_at), number_or(items, "byteOffset", part_at, 0),
                changes * bytes, part_at);
  }
}

// Nodes must be trees: a node that two nodes have for a child, or that is below itself, would be copied without end.
void GltfDocument::check_nodes() const {
  const Json& nodes = collection("nodes");
  std::unordered_map<const Json*, const Json*> parent_of;
  std::unordered_map<const Json*, std::size_t> depth_of;
  for_each("nodes", [&](const Json& node, const std::string& where) {
    for (const Json& child : array(node, "children", where)) {
      const Json& below = referenced(child, "nodes", where + ".children");
      if (!parent_of.try_emplace(&below, &node).second)
        fail(where, "has the child " + child.dump() + ", which is a child already");
    }
  });
  std::vector<const Json*> way;
  for_each("nodes", [&](const Json& node, const std::string& where) {
    way.clear();
    const Json* above = &node;
    while (depth_of.count(above) == 0) {
      way.push_back(above);
      if (way.size() > nodes.size()) fail(where, "is below itself");
      const auto parent = parent_of.find(above);
      if (parent == parent_of.end()) break;
      above = parent->second;
    }
    std::size_t depth = depth_of.count(above) > 0 ? depth_of[above] : 0;
    for (std::size_t n = way.size(); n-- > 0;) depth_of[way[n]] = ++depth;
    if (depth > kMaxNodeDepth) fail(where, "is nested more than " + std::to_string(kMaxNodeDepth) + " deep");
  });
}

void GltfDocument::check_scene(const Json& scene, const std::string& where) const {
  std::unordered_map<const Json*, bool> seen;
  for (const Json& root : array(scene, "nodes", where)) {
    if (!seen.try_emplace(&referenced(root, "nodes", where + ".nodes"), true).second)
      fail(where, "has the node " + root.dump() + " twice");
  }
}

// Fails unless an accessor has at least `least` items of a type, of floats or, if `floats` is false, of integers of 8
// or 16 bits too.
void GltfDocument::check_type(const Json& accessor, const char* type, std::uint64_t least, bool floats,
                              const std::string& where) const {
  const std::uint64_t component = number(accessor, "componentType", where);
  if (text(accessor, "type") != type || (component != kGltfFloat && (floats || component > kGltfUnsignedShort)))
    fail(where, "must be of " + std::string(type) +
                    (floats ? " in floats" : " in floats or in integers of 8 or 16 bits") +
                    "; other types are not supported");
  if (number(accessor, "count", where) < least)
    fail(where, "has " + std::to_string(number(accessor, "count", where)) + " items, " + std::to_string(least) +
                    " are needed");
}

void GltfDocument::check_skin(const Json& skin, const std::string& where) const {
  const Json& joints = array(skin, "joints", where);
  if (joints.empty()) fail(where, "has no joints");
  for (const Json& joint : joints) referenced(joint, "nodes", where + ".joints");
  if (!skin.contains("inverseBindMatrices")) return;
  check_type(referenced_by(skin, "inverseBindMatrices", "accessors", where), "MAT4", joints.size(), true,
             where + ".inverseBindMatrices");
}

void GltfDocument::check_animation(const Json& animation, const std::string& where) const {
  const Json& samplers = array(animation, "samplers", where);
  const Json& channels = array(animation, "channels", where);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const std::string at = where + "." + place("channels", c);
    if (!channels[c].is_object() || !channels[c].contains("target") || !channels[c]["target"].is_object())
      fail(at, "must have a target");
    const std::uint64_t index = number(channels[c], "sampler", at);
    if (index >= samplers.size() || !samplers[index].is_object()) fail(at, "has no sampler");
    const Json& sampler = samplers[index];
    const std::string sampler_at = where + "." + place("samplers", index);
    const Json& input = referenced_by(sampler, "input", "accessors", sampler_at);
    const Json& output = referenced_by(sampler, "output", "accessors", sampler_at);
    check_type(input, "SCALAR", 1, true, sampler_at + ".input");
    const Json& target = channels[c]["target"];
    if (target.contains("node")) referenced(target["node"], "nodes", at + ".target.node");
    const std::string property = text(target, "path");
    // Morph weights move no joint.
    if (property != "translation" && property != "rotation" && property != "scale") continue;
    const std::string interpolation = text(sampler, "interpolation");
    if (!interpolation.empty() && interpolation != "LINEAR" && interpolation != "STEP" &&
        interpolation != "CUBICSPLINE")
      fail(sampler_at, "has the unknown interpolation " + interpolation);
    // A cubic spline has two tangents for each value.
    const std::uint64_t values = interpolation == "CUBICSPLINE" ? 3 : 1;
    check_type(output, property == "rotation" ? "VEC4" : "VEC3", values * number(input, "count", sampler_at + ".input"),
               false, sampler_at + ".output");
  }
}

}  // namespace cab::scenes
