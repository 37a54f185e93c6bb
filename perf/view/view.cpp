// `cab view`: writes a page that plays recordings, or motion files and robots, which it records first.
#include <cab/replay.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "perf/base/output_file.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/view/options.h"
#include "perf/view/page.h"
#include "scenes/import/companions.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

namespace fs = std::filesystem;

// What a page holds of a recording at most: its base64 is a text of the browser, and Chromium's have 2^29 - 24 bytes.
constexpr std::uint64_t kMostBytes = 400000000;

// Checks that a file is a recording, so that the page is not the first to say it is not. Returns its count of frames.
std::uint32_t check_recording(const std::string& path) {
  record::Recording recording;
  if (!recording.open(path.c_str())) throw std::runtime_error(recording.error());
  for (const char* const problem : recording.problems()) tell("warning", path + ": " + problem);
  return recording.frame_count();
}

// Refuses a recording that a browser would not find in its page. `page` opens it from a file. Returns its bytes.
std::uint64_t check_size(const std::string& path, const std::string& name, const fs::path& page, bool is_made) {
  const std::uint64_t bytes = fs::file_size(path);
  if (bytes > kMostBytes)
    throw std::runtime_error(name + " has " + std::to_string(bytes) +
                             " bytes, and a page holds recordings of at most " + std::to_string(kMostBytes) + "; " +
                             (is_made ? "`cab run` or `cab robot` keeps it with --record, and " : "") + page.string() +
                             " opens it");
  return bytes;
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

// What a page plays.
enum class ViewKind { kRecordings, kMotion, kRobot };

// By its name, and a recording of any name by its first bytes. What is neither recording nor robot is a motion file.
ViewKind kind_of(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* const robot : {".urdf", ".xml", ".mjcf"})
    if (extension == robot) return ViewKind::kRobot;
  constexpr std::string_view kMagic = "CABREC";
  std::string bytes(kMagic.size(), '\0');
  std::ifstream(path, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return extension == ".cab" || bytes == kMagic ? ViewKind::kRecordings : ViewKind::kMotion;
}

// The kind of all files. Throws UsageError for files and options that do not go together.
ViewKind check_kind(const ViewOptions& options) {
  const std::vector<std::string>& files = options.run.world.files;
  const ViewKind kind = kind_of(files.front());
  for (const std::string& file : files)
    if (kind_of(file) != kind || (kind == ViewKind::kRobot && files.size() > 1))
      throw UsageError("FILE: recordings, motion files or one robot make a page, not " + scenes::printable(file) +
                       " beside " + scenes::printable(files.front()));
  if (kind != ViewKind::kMotion && !options.motion_options.empty())
    throw UsageError(options.motion_options.front() + ": it is about motion files");
  if (kind != ViewKind::kRobot && !options.robot_options.empty())
    throw UsageError(options.robot_options.front() + ": it is about a robot");
  return kind;
}

// The folder for a recording that the page alone has: that of the page, where there is room for it.
std::string folder_for_recording(const std::string& page) {
  return is_device(page) ? fs::temp_directory_path().string() : fs::path(place_of(page)).parent_path().string();
}

// Tests motion files or a robot, says what touches, and records that.
void record(const ViewOptions& options, ViewKind kind, const std::string& path) {
  if (kind == ViewKind::kMotion) {
    RunOptions run = options.run;
    run.policies.exact = default_exact(run.world);
    run.recording.path = path;
    run.recording.is_aside = true;
    run_command(run);
  } else {
    RobotCommandOptions robot = options.robot;
    robot.file = options.run.world.files.front();
    robot.recording.path = path;
    robot.recording.is_aside = true;
    robot_command(robot);
  }
}

}  // namespace

int view_command(const ViewOptions& options) {
  const ViewKind kind = check_kind(options);
  std::vector<std::string> files = options.run.world.files;
  const fs::path first = files.front();
  const std::string out_path =
      options.out_path.empty() ? fs::path(first).replace_extension(".html").string() : options.out_path;
  std::vector<std::string> inputs = input_paths(options.run.world);
  inputs.insert(inputs.end(), {options.page_path, options.robot.states_path, options.robot.srdf_path});
  check_outputs({{"--out", out_path}}, inputs, [&](const std::string& file) {
    return kind == ViewKind::kRobot ? scenes::companion_files(file, options.robot.import)
                                    : scenes::companion_files(file, options.run.world.sandbox);
  });
  const fs::path found = options.page_path.empty() ? find_page() : fs::path(options.page_path);
  if (found.empty()) throw std::runtime_error(how_to_get_page());
  const Page page = read_page(found);
  OutputFile out(out_path);
  const PageAlone page_alone(out_path);
  std::optional<TemporaryFile> made;  // a recording that the page alone has
  if (kind != ViewKind::kRecordings) {
    made.emplace(folder_for_recording(out_path));
    record(options, kind, made->path());
    files = {made->path()};
  }
  std::vector<PageRecording> recordings;
  std::uint64_t bytes = 0;
  for (const std::string& file : files) {
    const std::uint32_t frame_count = check_recording(file);
    const fs::path name = made ? first.filename().replace_extension(".cab") : fs::path(file).filename();
    if (recordings.empty() && options.frame > 0 && options.frame >= frame_count)
      throw UsageError("--frame: " + scenes::printable(made ? first.string() : file) + " has " +
                       std::to_string(frame_count) + " frames, counted from 0, not " + std::to_string(options.frame));
    recordings.push_back({name.string(), file});
    bytes += check_size(file, made ? "the recording of " + first.string() : file, found, made.has_value());
  }
  {
    ProgressBar bar("recordings", bytes);
    write_page(out.stream(), page, {}, recordings, [&bar](std::uint64_t read) { bar.advance(read); });
  }
  out.close();
  if (page_alone || is_device(out_path)) return 0;
  std::cout << scenes::printable(out_path) << ": " << fs::file_size(out_path) << " bytes. Open it in a browser:\n  "
            << file_address(out_path) << "#recording=0&frame=" << options.frame << '\n';
  return 0;
}

}  // namespace cab::perf
