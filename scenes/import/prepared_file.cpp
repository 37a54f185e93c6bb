// Files that assimp reads, but for what it would read wrong.
#include "scenes/import/prepared_file.h"

#include "scenes/import/collada_file.h"
#include "scenes/import/fbx_names.h"
#include "scenes/import/gltf_file.h"
#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

namespace cab::scenes {
namespace {

constexpr std::size_t kHeadBytes = 16;  // by which a GLB is told

// The files below a glTF file's folder, and that file, which is in memory. assimp names the others by the folder and a
// URI, whose percent-encoding it does not decode.
class FilesAndBytes : public Assimp::DefaultIOSystem {
 public:
  // `bytes` must outlive this object.
  FilesAndBytes(std::string path, const std::string& bytes)
      : path_(std::move(path)), folder_(path_.substr(0, path_.rfind('/') + 1)), bytes_(bytes) {}

  bool Exists(const char* file) const override {
    return file == path_ || DefaultIOSystem::Exists(decoded(file).c_str());
  }

  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (file != path_) return DefaultIOSystem::Open(decoded(file).c_str(), mode);
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(bytes_.data()), bytes_.size());
  }

 private:
  // The path of a file that assimp names. Empty, which no file has, if it is not below the folder.
  std::string decoded(const std::string& file) const {
    if (file.rfind(folder_, 0) != 0) return {};
    const std::optional<std::filesystem::path> below = path_of_uri(file.substr(folder_.size()));
    return below ? folder_ + below->string() : std::string();
  }

  std::string path_, folder_;
  const std::string& bytes_;
};

// assimp gets the checked bytes, under a name that says what they are, in the folder of the file, where it looks for
// the buffers that a file of version 1 names.
const aiScene* read_gltf(Assimp::Importer& importer, const std::string& path, const std::string& name,
                         FileFacts& facts) {
  const std::string bytes = read_text(path, name), extension = lower_extension(path);
  GltfForAssimp prepared = prepare_gltf(bytes, path, name);
  facts.notes.insert(facts.notes.end(), prepared.notes.begin(), prepared.notes.end());
  facts.named_bones = prepared.bones;
  if (prepared.is_binary ? extension == ".gltf" : extension != ".gltf")
    facts.notes.push_back(std::string("the file is ") + (prepared.is_binary ? "a GLB" : "glTF text") +
                          ", though its name ends in " + printable(extension));
  if (!prepared.glb.empty()) return importer.ReadFileFromMemory(prepared.glb.data(), prepared.glb.size(), 0, "glb");
  const std::string as_checked = path + (prepared.is_binary ? ".glb" : ".gltf");
  importer.SetIOHandler(new FilesAndBytes(as_checked, bytes));  // the importer deletes it
  const aiScene* const scene = importer.ReadFile(as_checked, 0);
  importer.SetIOHandler(new Assimp::DefaultIOSystem);  // deletes the other, which has the bytes
  return scene;
}

}  // namespace

const aiScene* read_prepared(Assimp::Importer& importer, const std::string& path, const std::string& name,
                             FileFacts& facts) {
  const std::size_t size = check_file(path, name);
  const std::string extension = lower_extension(path);
  if (is_gltf(extension, read_bytes(path, name, std::min(size, kHeadBytes))))
    return read_gltf(importer, path, name, facts);
  if (extension == ".dae") {
    const std::optional<std::string> text = collada_for_assimp(read_bytes(path, name, size), facts.notes);
    if (text) return importer.ReadFileFromMemory(text->data(), text->size(), 0, "dae");
  }
  if (extension == ".fbx") facts.repeated_names = repeated_fbx_names(read_bytes(path, name, size));
  return importer.ReadFile(path, 0);
}

}  // namespace cab::scenes
