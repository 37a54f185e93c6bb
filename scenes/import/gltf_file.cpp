// The check of a glTF file before assimp sees it. "The specification" is Khronos glTF 2.0; 1.0 has objects of named
// items where 2.0 has arrays.
#include "scenes/import/gltf_file.h"

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace cab::scenes {
namespace {

using Json = nlohmann::json;

constexpr const char* kMagic = "glTF";
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004e4942;   // "BIN"
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;
constexpr std::size_t kVersion1HeaderBytes = 20;
constexpr int kMaxJsonDepth = 256;           // assimp's parser calls itself for each level
constexpr std::size_t kMaxNodeDepth = 1024;  // as of joints in a BVH file; assimp calls itself for each level
constexpr std::uint64_t kMaxNumber = std::uint64_t{1} << 32;
constexpr std::uint64_t kMaxStride = 1 << 16;
constexpr std::uint64_t kFloat = 5126;

// Extensions without which a file cannot be read, and which assimp 5.2.5 does not read.
constexpr std::pair<std::string_view, const char*> kUnsupported[] = {
    {"KHR_draco_mesh_compression", "Draco compression"},
    {"EXT_meshopt_compression", "meshopt compression"},
    {"KHR_meshopt_compression", "meshopt compression"},
};

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

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 4; k-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

// Where the parts of a file are. A glTF that is no GLB is JSON only.
struct Parts {
  std::string_view json;
  std::optional<std::size_t> bin_bytes;
};

Parts glb_parts(const std::string& bytes, const std::string& name) {
  const auto fail = [&name](const std::string& reason) { throw ImportError(name + ": " + reason); };
  if (bytes.size() < kHeaderBytes) fail("the file ends in the header of the GLB");
  const std::uint32_t version = word(bytes, 4), length = word(bytes, 8);
  if (version != 1 && version != 2) fail("GLB version " + std::to_string(version) + ", only 1 and 2 are supported");
  if (length > bytes.size())
    fail("the header of the GLB says " + std::to_string(length) + " bytes, the file has " +
         std::to_string(bytes.size()));
  Parts parts;
  if (version == 1) {
    if (length < kVersion1HeaderBytes) fail("the file ends in the header of the GLB");
    const std::uint32_t json_bytes = word(bytes, 12);
    if (word(bytes, 16) != 0) fail("the content of the GLB is not JSON");
    if (json_bytes > length - kVersion1HeaderBytes)
      fail("the JSON of the GLB has " + std::to_string(json_bytes) + " bytes, more than the file");
    parts.json = std::string_view(bytes).substr(kVersion1HeaderBytes, json_bytes);
    parts.bin_bytes = length - kVersion1HeaderBytes - json_bytes;
    return parts;
  }
  std::size_t at = kHeaderBytes;
  for (std::size_t chunk = 0; at < length; ++chunk) {
    const std::string which = "chunk " + std::to_string(chunk) + " of the GLB ";
    if (length - at < kChunkHeaderBytes) fail(which + "ends in its header");
    const std::uint32_t chunk_bytes = word(bytes, at), type = word(bytes, at + 4);
    at += kChunkHeaderBytes;
    if (chunk_bytes > length - at)
      fail(which + "has " + std::to_string(chunk_bytes) + " bytes, but only " + std::to_string(length - at) +
           " are left");
    if (chunk == 0 && type != kJsonChunk) fail(which + "is not JSON");
    if (chunk == 0) parts.json = std::string_view(bytes).substr(at, chunk_bytes);
    if (chunk == 1 && type == kBinChunk) parts.bin_bytes = chunk_bytes;
    at += std::min<std::size_t>((chunk_bytes + std::size_t{3}) / 4 * 4, length - at);
  }
  if (parts.json.empty()) fail("the GLB has no JSON");
  return parts;
}

bool is_glb(const std::string& bytes) { return bytes.rfind(kMagic, 0) == 0; }

Parts parts_of(const std::string& bytes, const std::string& name) {
  return is_glb(bytes) ? glb_parts(bytes, name) : Parts{bytes, {}};
}

// How deep arrays and objects are nested in a text, also if it is not JSON to its end.
int nesting(std::string_view text) {
  int depth = 0, deepest = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (in_string && c == '\\') ++at;
    if (c == '"') in_string = !in_string;
    if (in_string) continue;
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if (c == ']' || c == '}') --depth;
  }
  return deepest;
}

Json parse_json(std::string_view text, const std::string& name) {
  // Some writers fill the JSON of a GLB up with zeros, not with blanks.
  while (!text.empty() && text.back() == '\0') text.remove_suffix(1);
  if (nesting(text) > kMaxJsonDepth)
    throw ImportError(name + ": its JSON is nested more than " + std::to_string(kMaxJsonDepth) + " deep");
  try {
    Json json = Json::parse(text.begin(), text.end());
    if (json.is_object()) return json;
  } catch (const Json::parse_error& error) {
    throw ImportError(name + ": its JSON is broken at byte " + std::to_string(error.byte));
  } catch (const Json::exception&) { throw ImportError(name + ": its JSON has a number that is out of range"); }
  throw ImportError(name + ": its JSON is not an object");
}

// The checks of one document. Each throws ImportError.
class Document {
 public:
  Document(Json json, const Parts& parts, std::filesystem::path folder, const std::string& name)
      : json_(std::move(json)), bin_bytes_(parts.bin_bytes), folder_(std::move(folder)), name_(name) {}

  void check() {
    check_version();
    check_extensions();
    check_buffers();
    for_each("bufferViews", [this](const Json& view, const std::string& where) { check_view(view, where); });
    for_each("accessors", [this](const Json& accessor, const std::string& where) { check_accessor(accessor, where); });
    check_nodes();
    for_each("scenes", [this](const Json& scene, const std::string& where) { check_scene(scene, where); });
    if (is_version_1_) return;  // it names the joints and samplers of skins and animations; assimp looks them up
    for_each("skins", [this](const Json& skin, const std::string& where) { check_skin(skin, where); });
    for_each("animations",
             [this](const Json& animation, const std::string& where) { check_animation(animation, where); });
  }

 private:
  [[noreturn]] void fail(const std::string& where, const std::string& reason) const {
    throw ImportError(name_ + ": " + printable(where) + " " + printable(reason));
  }

  // A collection of items, empty if it is not there.
  const Json& collection(const char* key) const {
    static const Json kNone = Json::array();
    const auto found = json_.find(key);
    if (found == json_.end()) return kNone;
    if (!found->is_array() && !(is_version_1_ && found->is_object())) fail(key, "must be an array");
    return *found;
  }

  template <class Check>
  void for_each(const char* key, Check check) const {
    const Json& items = collection(key);
    for (auto item = items.begin(); item != items.end(); ++item) {
      const std::string where =
          items.is_array() ? place(key, static_cast<std::size_t>(item - items.begin())) : key + ("." + item.key());
      if (!item->is_object()) fail(where, "must be an object");
      check(*item, where);
    }
  }

  static std::string place(const std::string& key, std::size_t index) {
    return key + "[" + std::to_string(index) + "]";
  }

  std::uint64_t whole(const Json& value, const std::string& where, std::uint64_t most = kMaxNumber) const {
    if (!value.is_number_unsigned()) fail(where, "must be a whole number that is not negative");
    if (value.get<std::uint64_t>() > most) fail(where, "is out of range");
    return value.get<std::uint64_t>();
  }

  std::uint64_t number(const Json& item, const char* key, const std::string& where) const {
    const auto found = item.find(key);
    if (found == item.end()) fail(where, "has no " + std::string(key));
    return whole(*found, where + "." + key);
  }

  std::uint64_t number_or(const Json& item, const char* key, const std::string& where, std::uint64_t otherwise) const {
    return item.contains(key) ? number(item, key, where) : otherwise;
  }

  std::string text(const Json& item, const char* key) const {
    const auto found = item.find(key);
    return found != item.end() && found->is_string() ? found->get<std::string>() : std::string();
  }

  // The item of a collection that a value names: by its index, or in version 1 by its key.
  const Json& referenced(const Json& value, const char* key, const std::string& where) const {
    const Json& items = collection(key);
    if (items.is_object()) {
      if (!value.is_string() || !items.contains(value.get_ref<const std::string&>()))
        fail(where, "names nothing in " + std::string(key));
      return items[value.get_ref<const std::string&>()];
    }
    const std::uint64_t index = whole(value, where);
    if (index >= items.size())
      fail(where, "is " + std::to_string(index) + ", but there are " + std::to_string(items.size()) + " " + key);
    return items[index];
  }

  const Json& referenced_by(const Json& item, const char* field, const char* key, const std::string& where) const {
    const auto found = item.find(field);
    if (found == item.end()) fail(where, "has no " + std::string(field));
    return referenced(*found, key, where + "." + field);
  }

  // An array of an item, empty if it is not there.
  const Json& array(const Json& item, const char* key, const std::string& where) const {
    static const Json kNone = Json::array();
    const auto found = item.find(key);
    if (found == item.end()) return kNone;
    if (!found->is_array()) fail(where + "." + key, "must be an array");
    return *found;
  }

  void check_version() {
    const auto asset = json_.find("asset");
    const std::string version = asset != json_.end() && asset->is_object() ? text(*asset, "version") : std::string();
    // Version 1 need not say so. Its items have names.
    const auto nodes = json_.find("nodes");
    is_version_1_ = version.rfind("1", 0) == 0 || (version.empty() && nodes != json_.end() && nodes->is_object());
    if (!is_version_1_ && version != "2" && version.rfind("2.", 0) != 0)
      fail("asset.version", version.empty() ? "is missing" : "is " + version + ", only 1 and 2 are supported");
  }

  void check_extensions() const {
    for (const Json& required : array(json_, "extensionsRequired", "the file")) {
      for (const auto& [extension, what] : kUnsupported) {
        if (required == std::string(extension)) fail(what, "(" + std::string(extension) + ") is not supported");
      }
    }
  }

  // The bytes that there are for a buffer; empty for one that nothing holds.
  std::optional<std::uint64_t> stored_bytes(const Json& buffer, const std::string& where) const {
    const std::string uri = text(buffer, "uri");
    const bool is_first = where == "buffers[0]" || where == "buffers.binary_glTF";
    if (is_first && bin_bytes_ && (uri.empty() || is_version_1_)) return bin_bytes_;
    if (uri.empty()) return {};
    if (uri.rfind("data:", 0) == 0) {
      const std::size_t comma = uri.find(',');
      if (comma == std::string::npos) fail(where, "has a data URI without data");
      std::string_view data = std::string_view(uri).substr(comma + 1);
      const std::string_view head = std::string_view(uri).substr(0, comma);
      constexpr std::string_view kBase64 = ";base64";
      if (head.size() < kBase64.size() || head.substr(head.size() - kBase64.size()) != kBase64) return data.size();
      while (!data.empty() && data.back() == '=') data.remove_suffix(1);
      return data.size() / 4 * 3 + data.size() % 4 * 3 / 4;
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

  void check_buffers() {
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

  // Fails unless [offset, offset + size) lies in a view.
  void check_range(const Json& view, std::uint64_t offset, std::uint64_t size, const std::string& where) const {
    const std::uint64_t view_bytes = number_or(view, "byteLength", where, 0);
    if (offset > view_bytes || size > view_bytes - offset)
      fail(where, "ends at byte " + std::to_string(offset + size) + " of a buffer view of " +
                      std::to_string(view_bytes) + " bytes");
  }

  void check_view(const Json& view, const std::string& where) const {
    const Json& buffer = referenced_by(view, "buffer", "buffers", where);
    const std::uint64_t offset = number_or(view, "byteOffset", where, 0);
    const std::uint64_t size =
        is_version_1_ ? number_or(view, "byteLength", where, 0) : number(view, "byteLength", where);
    if (view.contains("byteStride")) whole(view["byteStride"], where + ".byteStride", kMaxStride);
    const std::uint64_t buffer_bytes = number_or(buffer, "byteLength", where, 0);
    if (offset > buffer_bytes || size > buffer_bytes - offset)
      fail(where, "ends at byte " + std::to_string(offset + size) + " of a buffer of " + std::to_string(buffer_bytes) +
                      " bytes");
  }

  std::uint64_t component_bytes(const Json& item, const std::string& where) const {
    switch (const std::uint64_t type = number(item, "componentType", where); type) {
      case 5120:
      case 5121: return 1;
      case 5122:
      case 5123: return 2;
      case 5124:
      case 5125:
      case kFloat: return 4;
      default: fail(where, "has the unknown componentType " + std::to_string(type));
    }
  }

  std::uint64_t component_count(const Json& accessor, const std::string& where) const {
    static const std::unordered_map<std::string, std::uint64_t> kCounts = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
    const auto found = kCounts.find(text(accessor, "type"));
    if (found == kCounts.end()) fail(where, "has no known type");
    return found->second;
  }

  void check_accessor(const Json& accessor, const std::string& where) const {
    const std::uint64_t item_bytes = component_bytes(accessor, where) * component_count(accessor, where);
    const std::uint64_t count = number(accessor, "count", where);
    const std::uint64_t offset = number_or(accessor, "byteOffset", where, 0);
    if (count * item_bytes > kMaxFileBytes) fail(where, "has " + std::to_string(count) + " items, too many");
    if (accessor.contains("bufferView")) {
      const Json& view = referenced_by(accessor, "bufferView", "bufferViews", where);
      std::uint64_t stride = number_or(is_version_1_ ? accessor : view, "byteStride", where, 0);
      if (stride == 0) stride = item_bytes;
      if (stride < item_bytes || stride > kMaxStride)
        fail(where,
             "has a stride of " + std::to_string(stride) + " bytes, its items have " + std::to_string(item_bytes));
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
      check_range(referenced_by(items, "bufferView", "bufferViews", part_at),
                  number_or(items, "byteOffset", part_at, 0), changes * bytes, part_at);
    }
  }

  // Nodes must be trees: a node that two nodes have for a child, or that is below itself, would be copied without end.
  void check_nodes() const {
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

  void check_scene(const Json& scene, const std::string& where) const {
    std::unordered_map<const Json*, bool> seen;
    for (const Json& root : array(scene, "nodes", where)) {
      if (!seen.try_emplace(&referenced(root, "nodes", where + ".nodes"), true).second)
        fail(where, "has the node " + root.dump() + " twice");
    }
  }

  // Fails unless an accessor has at least `least` items of a type, of floats.
  void check_floats(const Json& accessor, const char* type, std::uint64_t least, const std::string& where) const {
    if (text(accessor, "type") != type || number(accessor, "componentType", where) != kFloat)
      fail(where, "must be of " + std::string(type) + " in floats; other types are not supported");
    if (number(accessor, "count", where) < least)
      fail(where, "has " + std::to_string(number(accessor, "count", where)) + " items, " + std::to_string(least) +
                      " are needed");
  }

  void check_skin(const Json& skin, const std::string& where) const {
    const Json& joints = array(skin, "joints", where);
    for (const Json& joint : joints) referenced(joint, "nodes", where + ".joints");
    if (!skin.contains("inverseBindMatrices")) return;
    check_floats(referenced_by(skin, "inverseBindMatrices", "accessors", where), "MAT4", joints.size(),
                 where + ".inverseBindMatrices");
  }

  void check_animation(const Json& animation, const std::string& where) const {
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
      check_floats(input, "SCALAR", 1, sampler_at + ".input");
      const Json& target = channels[c]["target"];
      if (target.contains("node")) referenced(target["node"], "nodes", at + ".target.node");
      const std::string property = text(target, "path");
      // Morph weights move no joint.
      if (property != "translation" && property != "rotation" && property != "scale") continue;
      // A cubic spline has two tangents for each value.
      const std::uint64_t values = text(sampler, "interpolation") == "CUBICSPLINE" ? 3 : 1;
      check_floats(output, property == "rotation" ? "VEC4" : "VEC3",
                   values * number(input, "count", sampler_at + ".input"), sampler_at + ".output");
    }
  }

  Json json_;
  std::optional<std::size_t> bin_bytes_;
  std::filesystem::path folder_;
  const std::string& name_;
  bool is_version_1_ = false;
};

}  // namespace

bool is_gltf(const std::string& extension, const std::string& first_bytes) {
  return extension == ".gltf" || extension == ".glb" || extension == ".vrm" || first_bytes.rfind(kMagic, 0) == 0;
}

std::optional<std::filesystem::path> path_of_uri(const std::string& uri) {
  const std::optional<std::string> text = percent_decoded(uri);
  if (!text || text->empty() || text->find("://") != std::string::npos) return {};
  std::filesystem::path path = std::filesystem::path(*text).lexically_normal();
  if (path.is_absolute() || *path.begin() == "..") return {};
  return path;
}

std::vector<std::filesystem::path> gltf_buffer_files(const std::string& bytes, const std::string& name) {
  const Json json = parse_json(parts_of(bytes, name).json, name);
  const auto buffers = json.find("buffers");
  std::vector<std::filesystem::path> files;
  if (buffers == json.end()) return files;
  for (const Json& buffer : *buffers) {
    const auto uri = buffer.is_object() ? buffer.find("uri") : buffer.end();
    if (uri == buffer.end() || !uri->is_string()) continue;
    const std::string& text = uri->get_ref<const std::string&>();
    const std::optional<std::filesystem::path> file = text.rfind("data:", 0) == 0 ? std::nullopt : path_of_uri(text);
    if (file && std::find(files.begin(), files.end(), *file) == files.end()) files.push_back(*file);
  }
  return files;
}

bool check_gltf(const std::string& bytes, const std::string& path, const std::string& name) {
  const bool is_binary = is_glb(bytes);
  const Parts parts = parts_of(bytes, name);
  Document(parse_json(parts.json, name), parts, std::filesystem::path(path).parent_path(), name).check();
  return is_binary;
}

}  // namespace cab::scenes
