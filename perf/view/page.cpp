#include "perf/view/page.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

constexpr std::string_view kDataLine = "<!--CAB-DATA-->";

// A multiple of 3, so that only the last part of a file is padded.
constexpr std::size_t kPartBytes = std::size_t{3} << 14;

bool is_standard_output(const std::string& path) {
  struct stat named = {}, open = {};
  return stat(path.c_str(), &named) == 0 && fstat(STDOUT_FILENO, &open) == 0 && named.st_dev == open.st_dev &&
         named.st_ino == open.st_ino;
}

std::ifstream open_to_read(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw std::runtime_error("cannot read " + path.string() + ": it is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string() + ": " + std::strerror(errno));
  return file;
}

std::string_view trimmed(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return line.substr(first, line.find_last_not_of(" \t\r") - first + 1);
}

// No text of JSON ends its script: `<` stands in strings alone, where it may be written as a number.
void write_json_in_script(std::ostream& out, std::string_view json) {
  for (std::size_t begin = 0; begin < json.size();) {
    const std::size_t end = std::min(json.find('<', begin), json.size());
    out << json.substr(begin, end - begin);
    if (end < json.size()) out << "\\u003c";
    begin = end + 1;
  }
}

std::string html_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      default: escaped += c;
    }
  return escaped;
}

// Base64 (RFC 4648). Padded at the end.
void append_base64(std::string& text, std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : std::uint32_t{0});
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
}

void write_recording(std::ostream& out, const PageRecording& recording,
                     const std::function<void(std::uint64_t)>& advance) {
  std::ifstream file = open_to_read(recording.path);
  out << "<script type=\"application/octet-stream\" class=\"cab-recording\" data-name=\""
      << html_escaped(scenes::printable(recording.name)) << "\">";
  std::string bytes(kPartBytes, '\0'), text;
  do {
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (file.bad()) throw std::runtime_error("cannot read all of " + recording.path + ": " + std::strerror(errno));
    const std::size_t count = static_cast<std::size_t>(file.gcount());
    text.clear();
    append_base64(text, std::string_view(bytes).substr(0, count));
    out << text;
    if (advance) advance(count);
  } while (file);
  out << "</script>\n";
}

}  // namespace

PageAlone::PageAlone(const std::string& page) {
  if (is_standard_output(page)) buffer_ = std::cout.rdbuf(std::cerr.rdbuf());
}

PageAlone::~PageAlone() {
  if (buffer_) std::cout.rdbuf(buffer_);
}

std::filesystem::path find_page(const std::filesystem::path& command) {
  const std::filesystem::path folder = command.parent_path();
  for (const char* const place : {"../share/cab/cab_view.html", "../../view/cab_view.html"}) {
    std::filesystem::path page = (folder / place).lexically_normal();
    std::error_code ignored;
    if (std::filesystem::is_regular_file(page, ignored)) return page;
  }
  return {};
}

std::filesystem::path find_page() {
  std::error_code error;
  const std::filesystem::path command = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? std::filesystem::path() : find_page(command);
}

std::string how_to_get_page() {
  return "the page of the viewer, cab_view.html, is not beside this command; `./dev view` in the sources makes it in "
         "build/view, and --page FILE says where it is";
}

Page read_page(const std::filesystem::path& path) {
  std::ifstream file = open_to_read(path);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  Page page;
  std::size_t found = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    if (trimmed(std::string_view(text).substr(begin, end - begin)) == kDataLine) {
      ++found;
      page = {text.substr(0, begin), text.substr(std::min(end + 1, text.size()))};
    }
    begin = end + 1;
  }
  if (found != 1)
    throw std::runtime_error(path.string() + " is no page of the viewer: it has " + std::to_string(found) + " lines " +
                             std::string(kDataLine) + ", not 1");
  return page;
}

void write_page(std::ostream& out, const Page& page, std::string_view report,
                const std::vector<PageRecording>& recordings, const std::function<void(std::uint64_t)>& advance) {
  out << page.before;
  if (!report.empty()) {
    out << "<script type=\"application/json\" id=\"cab-report\">";
    write_json_in_script(out, report);
    out << "</script>\n";
  }
  for (const PageRecording& recording : recordings) write_recording(out, recording, advance);
  out << page.after;
}

}  // namespace cab::perf
