// The page of the viewer, one HTML file that perf/view builds: where it is, and how reports and recordings get into it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>
#include <vector>

namespace cab::perf {

// The two halves of a page, around the one line that data replaces.
struct Page {
  std::string before;
  std::string after;
};

// A recording that a page holds.
struct PageRecording {
  std::string name;  // what the page calls it
  std::string path;
};

// While it lives, what the command says goes to standard error if a page goes to standard output, where it is alone.
class PageAlone {
 public:
  explicit PageAlone(const std::string& page);
  ~PageAlone();
  PageAlone(const PageAlone&) = delete;
  PageAlone& operator=(const PageAlone&) = delete;
  explicit operator bool() const { return buffer_ != nullptr; }

 private:
  std::streambuf* buffer_ = nullptr;
};

// The page beside a command: in share/cab of where it is installed, or in the build tree. Empty if there is none.
std::filesystem::path find_page(const std::filesystem::path& command);

// The same, beside the command that runs.
std::filesystem::path find_page();

// What to do if there is no page, as a sentence without its full stop.
std::string how_to_get_page();

// Throws std::runtime_error if the file cannot be read, or if it is no page of the viewer.
Page read_page(const std::filesystem::path& path);

// Writes a page with the text of a report as JSON (empty: none) and with recordings, a part at a time. `advance` is
// told how many bytes of recordings were read since it was last told; it may be empty. Throws std::runtime_error if a
// recording cannot be read.
void write_page(std::ostream& out, const Page& page, std::string_view report,
                const std::vector<PageRecording>& recordings, const std::function<void(std::uint64_t)>& advance = {});

}  // namespace cab::perf
