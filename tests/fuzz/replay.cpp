// Runs a fuzzer's entry point once on every named file, and on every file of a named folder. `--corpus ARCHIVE COUNT`
// before them stands for the files in an archive, which have to be so many. libFuzzer has a main() of its own for files
// and folders; with it, only a command line that begins with --corpus comes here.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/fuzz/archive.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Inputs = std::vector<cab::fuzz::ArchiveFile>;

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(file), {});
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  return bytes;
}

Inputs read_corpus(const std::string& archive, const std::string& count) {
  Inputs inputs = cab::fuzz::files_of_archive(archive, read(archive));
  const std::string found = std::to_string(inputs.size());
  if (found != count) throw std::runtime_error(archive + ": has " + found + " inputs, not " + count);
  for (auto& input : inputs) input.name = archive + ": " + input.name;
  return inputs;
}

Inputs read_inputs(const std::vector<std::string>& arguments) {
  Inputs inputs;
  std::size_t next = 0;
  if (arguments.size() >= 3 && arguments[0] == "--corpus") {
    inputs = read_corpus(arguments[1], arguments[2]);
    next = 3;
  }
  for (; next < arguments.size(); ++next) {
    std::vector<std::filesystem::path> paths = {arguments[next]};
    if (std::filesystem::is_directory(paths[0]))
      paths.assign(std::filesystem::directory_iterator(arguments[next]), std::filesystem::directory_iterator());
    for (const std::filesystem::path& path : paths) inputs.push_back({path.string(), read(path)});
  }
  return inputs;
}

int replay(const std::vector<std::string>& arguments) {
  Inputs inputs;
  try {
    inputs = read_inputs(arguments);
  } catch (const std::runtime_error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  for (const auto& [name, bytes] : inputs) {
    std::printf("%s, %zu bytes\n", name.c_str(), bytes.size());
    std::fflush(stdout);  // if an input stops the program, the last line names it
    const std::vector<std::uint8_t> data(bytes.begin(), bytes.end());  // AddressSanitizer knows where it ends
    LLVMFuzzerTestOneInput(data.data(), data.size());
  }
  std::printf("%zu inputs\n", inputs.size());
  return inputs.empty() ? 1 : 0;
}

}  // namespace

#ifdef CAB_FUZZ
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const std::vector<std::string> arguments(*argv + 1, *argv + *argc);
  if (!arguments.empty() && arguments[0] == "--corpus") std::exit(replay(arguments));
  return 0;
}
#else
int main(int argc, char** argv) { return replay({argv + 1, argv + argc}); }
#endif
