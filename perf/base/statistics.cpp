#include "perf/base/statistics.h"

#include <algorithm>
#include <utility>

namespace cab::perf {

Spread spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values[values.size() / 2], values.front(), values.back()};
}

double median(std::vector<double> values) { return spread_of(std::move(values)).median; }

void add_stats(FrameStats& sum, const FrameStats& more) {
  sum.candidates += more.candidates;
  sum.box_tests += more.box_tests;
  sum.leaf_pairs += more.leaf_pairs;
  sum.exact_tests += more.exact_tests;
  sum.false_positives += more.false_positives;
  sum.instances_masked += more.instances_masked;
  sum.seconds_update += more.seconds_update;
  sum.seconds_broad += more.seconds_broad;
  sum.seconds_test += more.seconds_test;
  sum.seconds_query += more.seconds_query;
  sum.seconds_contact += more.seconds_contact;
  sum.seconds_total += more.seconds_total;
}

}  // namespace cab::perf
