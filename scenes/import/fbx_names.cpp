// Finds the names of models in an FBX file without parsing it.
#include "scenes/import/fbx_names.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>

namespace cab::scenes {
namespace {

using Counts = std::map<std::string, std::size_t, std::less<>>;

// In a binary file the name of a model is a property: 'S', the length as u32, and NAME\0\1Model.
void count_binary(std::string_view bytes, Counts& counts) {
  constexpr std::string_view kKind("\0\1Model", 7);
  constexpr std::size_t kMostName = 1024, kHead = 5;  // 'S' and the length
  for (std::size_t at = bytes.find(kKind); at != std::string_view::npos; at = bytes.find(kKind, at + 1)) {
    for (std::size_t size = 0; size <= kMostName && at >= size + kHead; ++size) {
      const std::size_t begin = at - size - kHead;
      std::uint32_t length = 0;
      for (std::size_t k = 4; k-- > 0;) length = length << 8 | static_cast<unsigned char>(bytes[begin + 1 + k]);
      if (bytes[begin] != 'S' || length != size + kKind.size()) continue;
      ++counts[std::string(bytes.substr(at - size, size))];
      break;
    }
  }
}

// In a text the line of a model begins: Model: NUMBER, "Model::NAME".
void count_text(std::string_view bytes, Counts& counts) {
  constexpr std::string_view kLine = "Model: ", kName = "\"Model::";
  for (std::size_t at = bytes.find(kLine); at != std::string_view::npos; at = bytes.find(kLine, at + 1)) {
    std::size_t before = at;
    while (before > 0 && (bytes[before - 1] == ' ' || bytes[before - 1] == '\t')) --before;
    if (before > 0 && bytes[before - 1] != '\n') continue;
    const std::string_view line = bytes.substr(at, bytes.find('\n', at) - at);
    const std::size_t name = line.find(kName);
    if (name == std::string_view::npos) continue;
    const std::string_view rest = line.substr(name + kName.size());
    ++counts[std::string(rest.substr(0, rest.find('"')))];
  }
}

}  // namespace

std::vector<std::string> repeated_fbx_names(const std::string& bytes) {
  Counts counts;
  if (bytes.rfind("Kaydara FBX Binary", 0) == 0)
    count_binary(bytes, counts);
  else
    count_text(bytes, counts);
  std::vector<std::string> names;
  for (const auto& [name, count] : counts)
    if (count > 1) names.push_back(name);
  return names;
}

}  // namespace cab::scenes
