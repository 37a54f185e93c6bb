// A glTF file of version 2, written anew for assimp.
#include "scenes/import/gltf_rewrite.h"

#include "scenes/import/gltf_arrays.h"
#include "scenes/import/gltf_document.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/vrm_bones.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace cab::scenes {
namespace {

using Json = GltfDocument::Json;

constexpr std::size_t kMostNameBytes = 250;                // assimp cuts names off at 1023
constexpr std::size_t kMostJoints = std::size_t{1} << 16;  // of a skin: numbers of joints have 16 bits
constexpr std::size_t kMostSets = 10;                      // of four joints each: assimp wants their names in order
constexpr std::size_t kNoSkin = static_cast<std::size_t>(-1);
constexpr std::array<std::size_t, 7> kLeastCorners = {1, 2, 2, 2, 3, 3, 3};  // [mode] of one point, line or triangle

// Extensions that may be left out, and what import then does not see.
constexpr std::pair<const char*, const char*> kLeftOut[] = {
    {"EXT_mesh_gpu_instancing", "a mesh with many instances is read once"},
    {"KHR_node_visibility", "hidden nodes are read too"},
    {"MSFT_lod", "the first level of detail is read"},
    {"KHR_animation_pointer", "its animations are left out"},
    {"VRMC_node_constraint", "constraints between nodes are not applied"},
};

// A name that fits into assimp and into one line.
std::string fitting(const std::string& name) {
  std::string line = printable(name);
  if (line.size() <= kMostNameBytes) return line;
  std::size_t end = kMostNameBytes;
  while ((static_cast<unsigned char>(line[end]) & 0xc0) == 0x80) --end;
  return line.substr(0, end);
}

// Gives every name once.
class UniqueNames {
 public:
  // The name, or if it is taken the name with the first number from 2 that is not.
  std::string take(const std::string& name) {
    std::string unique = name;
    for (std::size_t& number = last_.try_emplace(name, 1).first->second; !taken_.insert(unique).second;)
      unique = name + " (" + std::to_string(++number) + ")";
    return unique;
  }

 private:
  std::unordered_set<std::string> taken_;
  std::unordered_map<std::string, std::size_t> last_;
};

// The arrays of the new file, one after another.
class NewArrays {
 public:
  explicit NewArrays(const GltfDocument& file) : file_(file) {}

  // Adds an array and returns the index of its accessor. `type` has `width` components.
  template <class T>
  std::size_t add(const std::vector<T>& values, const char* type, std::size_t width) {
    const std::size_t bytes = values.size() * sizeof(T);
    count(bytes);
    const std::uint64_t component = std::is_same_v<T, float>           ? kGltfFloat
                                    : std::is_same_v<T, std::uint32_t> ? kGltfUnsignedInt
                                                                       : kGltfUnsignedShort;
    const std::size_t index = accessors_.size();
    views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}});
    accessors_.push_back(
        {{"bufferView", index}, {"componentType", component}, {"count", values.size() / width}, {"type", type}});
    if (bytes > 0) bytes_.append(reinterpret_cast<const char*>(values.data()), bytes);
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    return index;
  }

  // Counts bytes that assimp will need. It copies what several meshes share.
  void count(std::size_t bytes) {
    if (bytes > kMaxFileBytes - std::min(counted_, kMaxFileBytes))
      file_.fail("its meshes and animations", "take more than " + std::to_string(kMaxFileBytes >> 20) + " MiB");
    counted_ += bytes;
  }

  // Moves all into the JSON of a file and returns the bytes.
  std::string give(Json& json) {
    if (bytes_.empty()) return {};
    json["accessors"] = std::move(accessors_);
    json["bufferViews"] = std::move(views_);
    json["buffers"].push_back({{"byteLength", bytes_.size()}});
    return std::move(bytes_);
  }

 private:
  const GltfDocument& file_;
  std::string bytes_;
  std::size_t counted_ = 0;
  Json accessors_ = Json::array(), views_ = Json::array();
};

class Rewriter {
 public:
  Rewriter(const GltfDocument& file, std::vector<std::string>& notes, std::vector<std::string>& bones)
      : file_(file), notes_(notes), bones_(bones), nodes_(file.collection("nodes")), arrays_(file), new_arrays_(file) {}

  std::string glb() {
    list_nodes();
    name_nodes();
    add_nodes();
    add_animations();
    add_notes();
    new_["asset"]["version"] = "2.0";
    const std::string bin = new_arrays_.give(new_);
    return packed(new_.dump(), bin);
  }

 private:
  static std::string place(const char* key, std::size_t index) { return GltfDocument::place(key, index); }

  // Finds the roots of the scene, and all nodes of it in pre-order. Without scenes all nodes are of one.
  void list_nodes() {
    std::vector<bool> is_child(nodes_.size(), false);
    for (std::size_t n = 0; n < nodes_.size(); ++n)
      for (const std::size_t child : children(n)) is_child[child] = true;
    const Json& scenes = file_.collection("scenes");
    if (scenes.empty()) {
      for (std::size_t n = 0; n < nodes_.size(); ++n)
        if (!is_child[n]) roots_.push_back(n);
    } else {
      const std::size_t scene =
          file_.json().contains("scene") ? file_.index(file_.json()["scene"], "scenes", "scene") : 0;
      const std::string where = place("scenes", scene);
      for (const Json& root : file_.array(scenes[scene], "nodes", where)) {
        roots_.push_back(file_.index(root, "nodes", where + ".nodes"));
        if (is_child[roots_.back()]) file_.fail(where, "has " + place("nodes", roots_.back()) + ", which is a child");
      }
    }
    in_scene_.resize(nodes_.size(), false);
    std::vector<std::size_t> open(roots_.rbegin(), roots_.rend());
    while (!open.empty()) {
      const std::size_t node = open.back();
      open.pop_back();
      in_scene_[node] = true;
      scene_nodes_.push_back(node);
      const std::vector<std::size_t> below = children(node);
      open.insert(open.end(), below.rbegin(), below.rend());
    }
  }

  std::vector<std::size_t> children(std::size_t node) const {
    std::vector<std::size_t> indices;
    const std::string where = place("nodes", node);
    for (const Json& child : file_.array(nodes_[node], "children", where))
      indices.push_back(file_.index(child, "nodes", where + ".children"));
    return indices;
  }

  // Calls see(item, where) for every item of an array of every item of a collection.
  template <class See>
  void for_each_of(const char* key, const char* array, See see) const {
    const Json& items = file_.collection(key);
    for (std::size_t i = 0; i < items.size(); ++i)
      for (const Json& part : file_.array(items[i], array, place(key, i))) see(part, place(key, i) + "." + array);
  }

  void name_nodes() {
    std::vector<bool> is_moved(nodes_.size(), false);
    for_each_of("skins", "joints", [&](const Json& joint, const std::string& where) {
      is_moved[file_.index(joint, "nodes", where)] = true;
    });
    for_each_of("animations", "channels", [&](const Json& channel, const std::string& where) {
      const Json& target = channel["target"];
      if (target.contains("node")) is_moved[file_.index(target["node"], "nodes", where)] = true;
    });
    const std::vector<std::size_t> bones = vrm_bones(file_.json());
    for (const std::size_t bone : bones) is_moved[bone] = true;
    // Those that matter most choose first.
    UniqueNames unique;
    names_.resize(nodes_.size());
    const auto own_name = [&](std::size_t node) {
      const std::string own = fitting(file_.text(nodes_[node], "name"));
      return own.empty() ? place("nodes", node) : own;
    };
    for (const bool moved : {true, false})
      for (const bool has_mesh : {false, true})
        for (const std::size_t node : scene_nodes_)
          if (is_moved[node] == moved && nodes_[node].contains("mesh") == has_mesh)
            names_[node] = unique.take(own_name(node));
    root_name_ = unique.take("ROOT");  // what assimp calls it
    for (const std::size_t bone : bones)
      if (in_scene_[bone]) bones_.push_back(names_[bone]);
    std::vector<std::string> renamed;
    for (const std::size_t node : scene_nodes_) {
      // A mesh that nothing moves is no joint: its name is not shown.
      if (names_[node] != own_name(node) && (is_moved[node] || !nodes_[node].contains("mesh")))
        renamed.push_back(names_[node]);
    }
    if (renamed.empty()) return;
    notes_.push_back(std::to_string(renamed.size()) + (renamed.size() == 1 ? " node has" : " nodes have") +
                     " the name of another, and " + (renamed.size() == 1 ? "is" : "are") + " called " +
                     listed(renamed));
  }

  void add_nodes() {
    // Where the nodes of the scene are in the new file.
    const std::size_t above = roots_.size() > 1 ? 1 : 0;
    new_index_.resize(nodes_.size(), 0);
    for (std::size_t n = 0; n < scene_nodes_.size(); ++n) new_index_[scene_nodes_[n]] = above + n;
    Json roots = Json::array(), nodes = Json::array();
    for (const std::size_t root : roots_) roots.push_back(new_index_[root]);
    if (above > 0) {
      nodes.push_back({{"name", root_name_}, {"children", std::move(roots)}});
      roots = Json::array({0});
    }
    for (const std::size_t node : scene_nodes_) nodes.push_back(new_node(node));
    new_["nodes"] = std::move(nodes);
    new_["scenes"].push_back({{"nodes", std::move(roots)}});
    new_["scene"] = 0;
  }

  Json new_node(std::size_t node) {
    const Json& item = nodes_[node];
    const std::string where = place("nodes", node);
    Json made = {{"name", names_[node]}};
    for (const std::size_t child : children(node)) made["children"].push_back(new_index_[child]);
    constexpr std::pair<const char*, std::size_t> kTransforms[] = {
        {"matrix", 16}, {"translation", 3}, {"rotation", 4}, {"scale", 3}};
    for (const auto& [key, count] : kTransforms) {
      const auto numbers = item.find(key);
      if (numbers == item.end()) continue;
      const auto is_number = [](const Json& number) { return number.is_number(); };
      if (!numbers->is_array() || numbers->size() != count || !std::all_of(numbers->begin(), numbers->end(), is_number))
        file_.fail(where + "." + key, "must be " + std::to_string(count) + " numbers");
      made[key] = *numbers;
    }
    add_devices(item, made);
    if (!item.contains("mesh")) return made;
    const std::size_t mesh = file_.index_by(item, "mesh", "meshes", where);
    const std::size_t skin = item.contains("skin") ? file_.index_by(item, "skin", "skins", where) : kNoSkin;
    see_morph_weights(item);
    made["mesh"] = new_mesh(mesh, skin);
    if (skin != kNoSkin) made["skin"] = new_skin(skin);
    return made;
  }

  // A camera and a light for each node that has one: such nodes are no joints, and assimp names them by it.
  void add_devices(const Json& item, Json& made) {
    constexpr const char* kLights = "KHR_lights_punctual";
    if (item.contains("camera")) {
      made["camera"] = new_["cameras"].size();
      new_["cameras"].push_back({{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}});
    }
    if (!GltfDocument::has_extension(item, kLights)) return;
    Json& lights = new_["extensions"][kLights]["lights"];
    made["extensions"][kLights]["light"] = lights.size();
    lights.push_back({{"type", "point"}});
    if (lights.size() == 1) new_["extensionsUsed"].push_back(kLights);
  }

  void see_morph_weights(const Json& item) {
    const auto weights = item.find("weights");
    if (weights == item.end() || !weights->is_array()) return;
    for (const Json& weight : *weights) has_morph_weights_ = has_morph_weights_ || (weight.is_number() && weight != 0);
  }

  // The index of a skin in the new file.
  std::size_t new_skin(std::size_t skin) {
    const auto [known, is_new] = new_skins_.try_emplace(skin, new_skins_.size());
    if (!is_new) return known->second;
    const Json& item = file_.collection("skins")[skin];
    const std::string where = place("skins", skin);
    Json joints = Json::array();
    for (const Json& joint : file_.array(item, "joints", where)) {
      const std::size_t node = file_.index(joint, "nodes", where + ".joints");
      if (!in_scene_[node]) file_.fail(where, "has the joint " + place("nodes", node) + ", which is not in the scene");
      joints.push_back(new_index_[node]);
    }
    std::vector<float> matrices;
    if (item.contains("inverseBindMatrices")) {
      matrices = arrays_.floats(file_.index_by(item, "inverseBindMatrices", "accessors", where), false);
    } else {
      // 3.7.3.1: each is the identity then.
      for (std::size_t k = 0; k < 16 * joints.size(); ++k) matrices.push_back(k % 16 % 5 == 0 ? 1.0f : 0.0f);
      notes_.push_back(where + " has no inverse bind matrices: its mesh is where the joints' own frames are");
    }
    new_["skins"].push_back(
        {{"joints", std::move(joints)}, {"inverseBindMatrices", new_arrays_.add(matrices, "MAT4", 16)}});
    return known->second;
  }

  // The index of a mesh, moved by a skin or by none, in the new file. assimp gives a mesh to one skin alone.
  std::size_t new_mesh(std::size_t mesh, std::size_t skin) {
    const auto [known, is_new] = new_meshes_.try_emplace({mesh, skin}, new_meshes_.size());
    if (!is_new) return known->second;
    const Json& item = file_.collection("meshes")[mesh];
    const std::string where = place("meshes", mesh), name = fitting(file_.text(item, "name"));
    see_morph_weights(item);
    Json primitives = Json::array();
    const Json& parts = file_.array(item, "primitives", where);
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const std::string at = where + "." + place("primitives", p);
      if (!parts[p].is_object() || !parts[p].contains("attributes") || !parts[p]["attributes"].is_object())
        file_.fail(at, "must have attributes");
      std::optional<Json> primitive = new_primitive(parts[p], skin, at);
      if (primitive) primitives.push_back(std::move(*primitive));
    }
    new_["meshes"].push_back({{"name", name.empty() ? where : name}, {"primitives", std::move(primitives)}});
    return known->second;
  }

  // Nothing if a primitive has not one point, line or triangle.
  std::optional<Json> new_primitive(const Json& item, std::size_t skin, const std::string& where) {
    const Json& attributes = item["attributes"];
    const std::uint64_t mode = file_.number_or(item, "mode", where, 4);
    if (mode >= kLeastCorners.size()) file_.fail(where, "has the unknown mode " + std::to_string(mode));
    if (!attributes.contains("POSITION")) return {};  // 3.7.2.1: such primitives are skipped
    const std::size_t position = file_.index_by(attributes, "POSITION", "accessors", where);
    const Json& positions = file_.collection("accessors")[position];
    if (GltfDocument::has_extension(item, "KHR_draco_mesh_compression") && !positions.contains("bufferView"))
      file_.fail("Draco compression", "(KHR_draco_mesh_compression) is not supported");
    const std::size_t vertices = file_.number(positions, "count", where);
    const bool has_indices = item.contains("indices");
    const std::size_t indices = has_indices ? file_.index_by(item, "indices", "accessors", where) : 0;
    const std::size_t corners =
        has_indices ? file_.number(file_.collection("accessors")[indices], "count", where) : vertices;
    if (corners < kLeastCorners[mode]) return {};
    Json made = {{"mode", mode}};
    if (has_indices) made["indices"] = new_indices(indices, vertices, where + ".indices");
    note_integers(position, "positions");
    made["attributes"]["POSITION"] = new_floats(position, "VEC3", 3, false, vertices, where + ".POSITION");
    if (skin != kNoSkin) add_influences(attributes, skin, vertices, where, made["attributes"]);
    return made;
  }

  // The index of a new array. An array of one form is there once, but counts as often as it is used. make() adds it.
  template <class Make>
  std::size_t shared(std::size_t accessor, char form, std::size_t bytes, Make make) {
    const auto known = new_accessors_.find({accessor, form});
    if (known != new_accessors_.end()) {
      new_arrays_.count(bytes);
      return known->second;
    }
    return new_accessors_[{accessor, form}] = make();
  }

  // Fails unless an accessor has a type and, where `count` is given, that many items. Returns the number of its items.
  std::size_t check_type(std::size_t accessor, const char* type, std::optional<std::size_t> count,
                         const std::string& where) const {
    const Json& item = file_.collection("accessors")[accessor];
    if (file_.text(item, "type") != type) file_.fail(where, "must be of " + std::string(type));
    const std::size_t items = file_.number(item, "count", where);
    if (count && items != *count)
      file_.fail(where,
                 "has " + std::to_string(items) + " items, but there are " + std::to_string(*count) + " vertices");
    return items;
  }

  void note_integers(std::size_t accessor, const char* what) {
    const Json& item = file_.collection("accessors")[accessor];
    if (file_.number(item, "componentType", place("accessors", accessor)) != kGltfFloat) integers_.insert(what);
  }

  std::size_t new_floats(std::size_t accessor, const char* type, std::size_t width, bool normalized,
                         std::optional<std::size_t> count, const std::string& where) {
    const std::size_t items = check_type(accessor, type, count, where);
    return shared(accessor, normalized ? 'n' : 'f', items * width * sizeof(float),
                  [&] { return new_arrays_.add(arrays_.floats(accessor, normalized), type, width); });
  }

  std::size_t new_indices(std::size_t accessor, std::size_t vertices, const std::string& where) {
    const std::size_t items = check_type(accessor, "SCALAR", {}, where);
    const std::size_t made = shared(accessor, 'i', items * sizeof(std::uint32_t), [&] {
      const std::vector<std::uint32_t> indices = arrays_.whole_numbers(accessor);
      const auto largest = std::max_element(indices.begin(), indices.end());
      largest_index_[accessor] = largest == indices.end() ? 0 : *largest;
      return new_arrays_.add(indices, "SCALAR", 1);
    });
    if (items > 0 && largest_index_[accessor] >= vertices)
      file_.fail(where, "has the index " + std::to_string(largest_index_[accessor]) + ", but there are " +
                            std::to_string(vertices) + " vertices");
    return made;
  }

  // JOINTS_n and WEIGHTS_n, of any n, as assimp wants them: from 0 without gaps.
  void add_influences(const Json& attributes, std::size_t skin, std::size_t vertices, const std::string& where,
                      Json& made) {
    const std::size_t joint_count = file_.array(file_.collection("skins")[skin], "joints", place("skins", skin)).size();
    if (joint_count > kMostJoints)
      file_.fail(place("skins", skin), "has more than " + std::to_string(kMostJoints) + " joints");
    std::size_t set = 0;
    for (const auto& [name, accessor] : attributes.items()) {
      constexpr std::string_view kJoints = "JOINTS_", kWeights = "WEIGHTS_";
      if (name.rfind(kWeights, 0) == 0 && !attributes.contains("JOINTS_" + name.substr(kWeights.size())))
        file_.fail(where, "has " + name + " without its joints");
      if (name.rfind(kJoints, 0) != 0) continue;
      const std::string of_weights = "WEIGHTS_" + name.substr(kJoints.size());
      if (!attributes.contains(of_weights)) file_.fail(where, "has " + name + " without its weights");
      const std::size_t joints = file_.index(accessor, "accessors", where + "." + name);
      const std::size_t weights = file_.index_by(attributes, of_weights.c_str(), "accessors", where);
      if (set == kMostSets) file_.fail(where, "has more than " + std::to_string(kMostSets) + " sets of joints");
      check_type(joints, "VEC4", vertices, where + "." + name);
      check_type(weights, "VEC4", vertices, where + "." + of_weights);
      note_integers(weights, "weights");
      const std::vector<float> shares = arrays_.floats(weights, true);
      const std::vector<std::uint32_t> numbers = arrays_.whole_numbers(joints);
      for (std::size_t k = 0; k < numbers.size(); ++k) {
        if (!std::isfinite(shares[k]))
          file_.fail(where + "." + of_weights, "has a weight that is not finite at vertex " + std::to_string(k / 4));
        if (shares[k] < 0)
          file_.fail(where + "." + of_weights, "has a weight that is negative at vertex " + std::to_string(k / 4));
        if (shares[k] > 0 && numbers[k] >= joint_count)
          file_.fail(where + "." + name, "has joint " + std::to_string(numbers[k]) + " at vertex " +
                                             std::to_string(k / 4) + ", but " + place("skins", skin) + " has " +
                                             std::to_string(joint_count));
      }
      const std::string number = std::to_string(set);
      ++set;
      made["JOINTS_" + number] = shared(joints, 'j', numbers.size() * sizeof(std::uint16_t), [&] {
        std::vector<std::uint16_t> short_numbers;
        for (const std::uint32_t joint : numbers) short_numbers.push_back(static_cast<std::uint16_t>(joint));
        return new_arrays_.add(short_numbers, "VEC4", 4);
      });
      made["WEIGHTS_" + number] =
          shared(weights, 'n', shares.size() * sizeof(float), [&] { return new_arrays_.add(shares, "VEC4", 4); });
    }
  }

  void add_animations() {
    const Json& animations = file_.collection("animations");
    for (std::size_t a = 0; a < animations.size(); ++a) {
      const std::string where = place("animations", a);
      Json made = {{"samplers", Json::array()}, {"channels", Json::array()}};
      if (const std::string name = file_.text(animations[a], "name"); !name.empty()) made["name"] = name;
      for (const Json& channel : file_.array(animations[a], "channels", where)) {
        const Json& target = channel["target"];
        const std::string path = file_.text(target, "path");
        has_morph_weights_ = has_morph_weights_ || path == "weights";
        if (path != "translation" && path != "rotation" && path != "scale") continue;
        if (!target.contains("node")) continue;  // 3.11: such channels are ignored
        const std::size_t node = file_.index(target["node"], "nodes", where);
        if (!in_scene_[node]) continue;
        if (nodes_[node].contains("matrix"))
          file_.fail(where, "moves " + place("nodes", node) +
                                ", which has a matrix: it must have translation, rotation and scale");
        made["channels"].push_back(
            {{"sampler", made["samplers"].size()}, {"target", {{"node", new_index_[node]}, {"path", path}}}});
        made["samplers"].push_back(new_sampler(
            file_.array(animations[a], "samplers", where)[file_.number(channel, "sampler", where)], path, where));
      }
      new_["animations"].push_back(std::move(made));
    }
  }

  // Of any interpolation the keys: cab goes from key to key in straight lines.
  Json new_sampler(const Json& sampler, const std::string& path, const std::string& where) {
    const std::size_t input = file_.index_by(sampler, "input", "accessors", where);
    const std::size_t output = file_.index_by(sampler, "output", "accessors", where);
    const bool is_rotation = path == "rotation";
    const char* const type = is_rotation ? "VEC4" : "VEC3";
    const std::size_t width = is_rotation ? 4 : 3;
    note_integers(output, "keys");
    const std::string interpolation = file_.text(sampler, "interpolation");
    if (interpolation == "STEP" || interpolation == "CUBICSPLINE") ++interpolations_[interpolation];
    Json made = {{"input", new_floats(input, "SCALAR", 1, false, {}, where)}};
    const bool is_spline = interpolation == "CUBICSPLINE";
    const std::size_t items = file_.number(file_.collection("accessors")[output], "count", where);
    const std::size_t keys = is_spline ? items / 3 : items;
    made["output"] = shared(output,
                            is_spline     ? 's'
                            : is_rotation ? 'n'
                                          : 'f',
                            keys * width * sizeof(float), [&] {
                              const std::vector<float> values = arrays_.floats(output, is_rotation);
                              if (!is_spline) return new_arrays_.add(values, type, width);
                              std::vector<float> kept;
                              for (std::size_t k = 0; k < keys; ++k) {
                                // In-tangent, value, out-tangent.
                                const auto value = values.begin() + static_cast<std::ptrdiff_t>(width * (3 * k + 1));
                                kept.insert(kept.end(), value, value + static_cast<std::ptrdiff_t>(width));
                              }
                              return new_arrays_.add(kept, type, width);
                            });
    return made;
  }

  void add_notes() {
    if (!integers_.empty())
      notes_.push_back("integers are read as floats: " + listed({integers_.begin(), integers_.end()}));
    for (const auto& [interpolation, count] : interpolations_)
      notes_.push_back(std::to_string(count) + (count == 1 ? " track is " : " tracks are ") +
                       (interpolation == "STEP" ? "steps" : "cubic splines") +
                       ": between their keys, motion is in straight lines");
    if (has_morph_weights_) notes_.push_back("morph targets are left out: meshes keep their basic shape");
    const Json& used = file_.array(file_.json(), "extensionsUsed", "the file");
    for (const auto& [extension, what] : kLeftOut)
      if (std::find(used.begin(), used.end(), extension) != used.end())
        notes_.push_back(std::string(extension) + ": " + what);
  }

  // A GLB.
  std::string packed(std::string json, const std::string& bin) const {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::size_t bin_bytes = bin.empty() ? 0 : 8 + bin.size();
    std::string glb = "glTF";
    const auto word = [&glb](std::size_t number) {
      for (int k = 0; k < 4; ++k) glb += static_cast<char>(number >> (8 * k) & 0xff);
    };
    glb.reserve(12 + 8 + json.size() + bin_bytes);
    word(2);
    word(12 + 8 + json.size() + bin_bytes);
    word(json.size());
    glb += "JSON" + json;
    if (bin.empty()) return glb;
    word(bin.size());
    glb += std::string("BIN\0", 4) + bin;
    return glb;
  }

  const GltfDocument& file_;
  std::vector<std::string>& notes_;
  std::vector<std::string>& bones_;
  const Json& nodes_;
  GltfArrays arrays_;
  NewArrays new_arrays_;
  Json new_;
  std::vector<std::size_t> roots_, scene_nodes_;  // scene_nodes_: in pre-order
  std::vector<bool> in_scene_;                    // [node]
  std::vector<std::string> names_;                // [node]
  std::string root_name_;
  std::vector<std::size_t> new_index_;  // [node]
  std::map<std::size_t, std::size_t> new_skins_;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> new_meshes_;  // of mesh and skin
  std::map<std::pair<std::size_t, char>, std::size_t> new_accessors_;
  std::map<std::size_t, std::uint32_t> largest_index_;  // of accessors of indices
  std::set<std::string> integers_;                      // what has some
  std::map<std::string, std::size_t> interpolations_;   // of tracks that are not linear
  bool has_morph_weights_ = false;
};

}  // namespace

std::string rewrite_gltf(const GltfDocument& file, std::vector<std::string>& notes, std::vector<std::string>& bones) {
  return Rewriter(file, notes, bones).glb();
}

}  // namespace cab::scenes
