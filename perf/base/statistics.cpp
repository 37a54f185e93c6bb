#include "perf/base/statistics.h"

#include <algorithm>
#include <utility>

namespace cab::perf {

Spread spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values[values.size() / 2], values.front(), values.back()};
}

double median(std::vector<double> values) { return spread_of(std::move(values)).median; }

Spread ratio_of(const std::vector<double>& one, const std::vector<double>& other) {
  std::vector<double> ratios;
  for (std::size_t r = 0; r < std::min(one.size(), other.size()); ++r) ratios.push_back(one[r] / other[r]);
  return spread_of(std::move(ratios));
}

}  // namespace cab::perf
