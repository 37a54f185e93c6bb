// `cab view`: writes a page that plays recordings.
#include <cab/replay.h>

#include <cstdint>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/view/options.h"
#include "perf/view/page.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

namespace fs = std::filesystem;

// Checks that a file is a recording, so that the page is not the first to say it is not. Returns its count of frames.
std::uint32_t check_recording(const std::string& path) {
  record::Recording recording;
  if (!recording.open(path.c_str())) throw std::runtime_error(recording.error());
  for (const char* const problem : recording.problems()) tell("warning", path + ": " + problem);
  return recording.frame_count();
}

// The address of a file for a browser: letters, digits and a few signs stand for themselves.
std::string file_address(const fs::path& path) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string address = "file://";
  for (const char c : fs::absolute(path).lexically_normal().string()) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                          std::string("/-._~").find(c) != std::string::npos;
    const auto byte = static_cast<unsigned char>(c);
    address += is_plain ? std::string(1, c) : std::string{'%', kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return address;
}

}  // namespace

int view_command(const ViewOptions& options) {
  const std::string out_path =
      options.out_path.empty() ? fs::path(options.files.front()).replace_extension(".html").string() : options.out_path;
  std::vector<std::string> inputs = options.files;
  inputs.push_back(options.page_path);
  check_outputs({{"--out", out_path}}, inputs);
  const fs::path found = options.page_path.empty() ? find_page() : fs::path(options.page_path);
  if (found.empty()) throw std::runtime_error(how_to_get_page());
  const Page page = read_page(found);
  std::vector<PageRecording> recordings;
  std::uint64_t bytes = 0;
  for (const std::string& file : options.files) {
    const std::uint32_t frame_count = check_recording(file);
    if (recordings.empty() && options.frame > 0 && options.frame >= frame_count)
      throw UsageError("--frame: " + scenes::printable(file) + " has " + std::to_string(frame_count) +
                       " frames, counted from 0, not " + std::to_string(options.frame));
    recordings.push_back({fs::path(file).filename().string(), file});
    bytes += fs::file_size(file);
  }
  OutputFile out(out_path);
  {
    ProgressBar bar("recordings", bytes);
    write_page(out.stream(), page, {}, recordings, [&bar](std::uint64_t read) { bar.advance(read); });
  }
  out.close();
  std::cout << scenes::printable(out_path) << ": " << fs::file_size(out_path) << " bytes. Open it in a browser:\n  "
            << file_address(out_path) << "#recording=0&frame=" << options.frame << '\n';
  return 0;
}

}  // namespace cab::perf
