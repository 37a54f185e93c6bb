// What the reading of files altered, in a few lines.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "scenes/import/import_report.h"
#include "scenes/scene.h"

namespace cab::perf {

// Pairs of links of one character that are not tested against each other.
struct MaskedPairs {
  std::size_t masked = 0;
  std::size_t all = 0;
};

// Prints warnings and, unless `quiet`, notes: first those of guessed units and of cut clips, then what nothing counts.
void print_notes(const scenes::Scene& scene, const scenes::ImportReport& report, bool quiet, std::ostream& out);

// One line for each kind of alteration with its counts over all files, such as "guessed: 2 length units".
std::vector<std::string> alteration_lines(const scenes::ImportReport& report);

// Both, the lines as notes.
void print_import(const scenes::Scene& scene, const scenes::ImportReport& report, bool quiet, std::ostream& out);

// The counts: an object of what was altered for each kind. Pairs are left out if there are none.
nlohmann::ordered_json import_json(const scenes::ImportReport& report, const MaskedPairs& pairs);

// The last word where sizes are doubtful: whether anything touches says little then. Nothing if they are not.
void print_size_doubts(const scenes::ImportReport& report, std::ostream& out);

}  // namespace cab::perf
