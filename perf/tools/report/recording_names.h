// What the links of a recording are called.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "perf/tools/report/contact_intervals.h"

namespace cab::perf {

struct BatchNames {
  std::string name;                    // empty: the recording has none
  std::vector<std::string> instances;  // empty, or one per instance
  std::uint32_t instance_count = 1;
  std::uint32_t slot = 0;  // what hits call the batch
  bool is_static = false;
  std::uint32_t articulation = 0;  // index; unused for static bodies
};

struct RecordingNames {
  std::vector<BatchNames> batches;
  std::vector<std::vector<std::string>> link_names;  // by articulation; those without names have none

  // As hit_names.h has them.
  std::string character(const LinkPlace& place) const;
  std::string link(const LinkPlace& place) const;
};

}  // namespace cab::perf
