#include "perf/tools/scan/package.h"

#include <system_error>

namespace cab::perf {
namespace {

bool has(const std::filesystem::path& place, const char* package) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(place / package / "__init__.py", ignored);
}

}  // namespace

std::vector<std::filesystem::path> find_scan_package(const std::filesystem::path& command) {
  const std::filesystem::path folder = command.parent_path();
  const std::filesystem::path installed = (folder / "../share/cab/scan").lexically_normal();
  if (has(installed, "cab_scan")) return {installed};
  const std::filesystem::path built = folder / "scan";
  if (!has(built, "cab_scan")) return {};
  std::vector<std::filesystem::path> places = {built};
  const std::filesystem::path module = (folder / "../engine/bindings/python").lexically_normal();
  if (has(module, "cab")) places.push_back(module);
  return places;
}

std::filesystem::path find_installed_module(const std::filesystem::path& command) {
  const std::filesystem::path folder = (command.parent_path() / ".." / CAB_PYTHON_DIR).lexically_normal();
  return has(folder, "cab") ? folder : std::filesystem::path();
}

}  // namespace cab::perf
