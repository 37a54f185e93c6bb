#include "perf/base/signals.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>

namespace cab::perf {
namespace {

// A command has few outputs at once.
constexpr std::size_t kMostFilesAside = 8;
std::array<std::atomic<const char*>, kMostFilesAside> files_aside = {};
std::atomic<bool> line_is_shown = false;
constexpr char kClearLine[] = "\r\033[K";

// Calls only what a signal handler may call.
extern "C" void clean_up(int signal) {
  for (const std::atomic<const char*>& file : files_aside)
    if (const char* const path = file.load()) unlink(path);
  if (line_is_shown.load()) {
    [[maybe_unused]] const ssize_t ignored = write(STDERR_FILENO, kClearLine, sizeof kClearLine - 1);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

void clean_up_at_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT, SIGXCPU})
    if (std::signal(signal, clean_up) == SIG_IGN) std::signal(signal, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

void remove_at_signals(const std::string& path) {
  for (std::atomic<const char*>& file : files_aside) {
    const char* none = nullptr;
    if (file.compare_exchange_strong(none, path.c_str())) return;
  }
}

void keep_at_signals(const std::string& path) {
  for (std::atomic<const char*>& file : files_aside) {
    const char* expected = path.c_str();
    if (file.compare_exchange_strong(expected, nullptr)) return;
  }
}

void clear_line_at_signals(bool is_shown) { line_is_shown = is_shown; }

}  // namespace cab::perf
