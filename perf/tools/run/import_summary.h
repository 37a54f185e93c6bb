// What the reading of files altered, in a few lines.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <ostream>

#include "scenes/import/import_report.h"
#include "scenes/scene.h"

namespace cab::perf {

// Pairs of links of one character that are not tested against each other.
struct MaskedPairs {
  std::size_t masked = 0;
  std::size_t all = 0;
};

// Prints doubts about sizes, notes that nothing counts, and one line for each kind of alteration with its counts over
// all files. Pairs are left out if there are none.
void print_import(const scenes::Scene& scene, const scenes::ImportReport& report, const MaskedPairs& pairs,
                  std::ostream& out);

// The counts: an object of what was altered for each kind.
nlohmann::ordered_json import_json(const scenes::ImportReport& report, const MaskedPairs& pairs);

// The last word where sizes are doubtful: whether anything touches says little then. Nothing if they are not.
void print_size_doubts(const scenes::ImportReport& report, std::ostream& out);

}  // namespace cab::perf
