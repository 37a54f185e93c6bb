// The JSON of a glTF file: its checks, and look-ups that name what is wrong. "The specification" is Khronos glTF 2.0;
// 1.0 has objects of named items where 2.0 has arrays.
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace cab::scenes {

// Types of components, by the numbers of the specification.
inline constexpr std::uint64_t kGltfByte = 5120, kGltfUnsignedByte = 5121, kGltfShort = 5122, kGltfUnsignedShort = 5123,
                               kGltfInt = 5124, kGltfUnsignedInt = 5125, kGltfFloat = 5126;

// `where` is the place of an item in the JSON, such as "accessors[3]". What is wrong is thrown as an ImportError.
class GltfDocument {
 public:
  using Json = nlohmann::json;

  // `bin` is the binary chunk of a GLB, which must outlive this object. `folder` is where other files are. `name` is
  // the file in messages.
  GltfDocument(Json json, std::optional<std::string_view> bin, std::filesystem::path folder, std::string name);

  // Checks what scenes/import/gltf_file.h says, and that no extension is required that is not known here.
  void check();

  bool is_version_1() const { return is_version_1_; }
  const Json& json() const { return json_; }
  const std::string& name() const { return name_; }

  [[noreturn]] void fail(const std::string& where, const std::string& reason) const;

  // A collection of items, empty if it is not there.
  const Json& collection(const char* key) const;

  // "nodes[3]" of "nodes" and 3.
  static std::string place(const std::string& key, std::size_t index);

  // Whole numbers that are not negative.
  std::uint64_t whole(const Json& value, const std::string& where) const;
  std::uint64_t number(const Json& item, const char* key, const std::string& where) const;
  std::uint64_t number_or(const Json& item, const char* key, const std::string& where, std::uint64_t otherwise) const;

  // A text, empty if it is not there.
  std::string text(const Json& item, const char* key) const;

  // An array of an item, empty if it is not there.
  const Json& array(const Json& item, const char* key, const std::string& where) const;

  // Whether an item has an extension of a name.
  static bool has_extension(const Json& item, const char* extension);

  // The index of the item of a collection that a value names. Of version 2.
  std::size_t index(const Json& value, const char* key, const std::string& where) const;
  std::size_t index_by(const Json& item, const char* field, const char* key, const std::string& where) const;

  // That item: by its index, or in version 1 by its key.
  const Json& referenced(const Json& value, const char* key, const std::string& where) const;
  const Json& referenced_by(const Json& item, const char* field, const char* key, const std::string& where) const;

  // Of an accessor or of sparse indices.
  std::uint64_t component_bytes(const Json& item, const std::string& where) const;
  // Of an accessor.
  std::uint64_t component_count(const Json& accessor, const std::string& where) const;

  // Whether a buffer of version 2 is in the file or names another one.
  bool has_data(std::size_t buffer) const;

  // The bytes of a buffer of version 2, as many as it says. `needed_by` is the place that needs them.
  std::string load_buffer(std::size_t buffer, const std::string& needed_by) const;

 private:
  template <class Check>
  void for_each(const char* key, Check check) const;

  void check_version();
  void check_extensions() const;
  std::optional<std::uint64_t> stored_bytes(const Json& buffer, const std::string& where) const;
  void check_buffers() const;
  void check_range(const Json& view, std::uint64_t offset, std::uint64_t size, const std::string& where) const;
  void check_view(const Json& view, const std::string& where) const;
  void check_accessor(const Json& accessor, const std::string& where) const;
  void check_nodes() const;
  void check_scene(const Json& scene, const std::string& where) const;
  void check_type(const Json& accessor, const char* type, std::uint64_t least, bool floats,
                  const std::string& where) const;
  void check_skin(const Json& skin, const std::string& where) const;
  void check_animation(const Json& animation, const std::string& where) const;

  Json json_;
  std::optional<std::string_view> bin_;
  std::filesystem::path folder_;
  std::string name_;
  bool is_version_1_ = false;
};

}  // namespace cab::scenes
