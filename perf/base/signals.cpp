#include "perf/base/signals.h"

#include <unistd.h>

#include <atomic>
#include <csignal>

namespace cab::perf {
namespace {

// A list that only grows, so that a signal handler can go through it at any moment. Free places are used again.
struct Place {
  std::atomic<const char*> file;
  Place* next;
};
std::atomic<Place*> first_place = nullptr;
std::atomic<bool> line_is_shown = false;
constexpr char kClearLine[] = "\r\033[K";

// Calls only what a signal handler may call.
extern "C" void clean_up(int signal) {
  for (const Place* place = first_place.load(); place != nullptr; place = place->next)
    if (const char* const path = place->file.load()) unlink(path);
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
  for (Place* place = first_place.load(); place != nullptr; place = place->next) {
    const char* none = nullptr;
    if (place->file.compare_exchange_strong(none, path.c_str())) return;
  }
  auto* const place = new Place{path.c_str(), first_place.load()};
  while (!first_place.compare_exchange_weak(place->next, place)) {}
}

void keep_at_signals(const std::string& path) {
  for (Place* place = first_place.load(); place != nullptr; place = place->next) {
    const char* expected = path.c_str();
    if (place->file.compare_exchange_strong(expected, nullptr)) return;
  }
}

void clear_line_at_signals(bool is_shown) { line_is_shown = is_shown; }

}  // namespace cab::perf
