#include "perf/base/progress_line.h"

#include "perf/base/report.h"

namespace cab::perf {

std::string progress_line(const std::string& label, std::uint64_t done, std::uint64_t total, double seconds_passed,
                          bool long_step_is_next) {
  constexpr double kLeastSeconds = 0.25;
  constexpr std::uint64_t kBarWidth = 30;
  if (!long_step_is_next && !(seconds_passed >= kLeastSeconds)) return "";
  const std::uint64_t filled = kBarWidth * done / total;
  const std::string left = time_left(done, total, seconds_passed);
  return label + " [" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + "] " +
         std::to_string(100 * done / total) + " %" + (left.empty() ? "" : ", " + left);
}

}  // namespace cab::perf
