// Output for people and files: text tables, a progress bar, number formats, CSV and JSON files.
#pragma once

#include <cab/types.h>

#include <chrono>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "perf/base/output_file.h"
#include "perf/base/statistics.h"

namespace cab::perf {

// Writes a line "KIND: TEXT" to standard error. The text may have names of files and of what is in them: characters
// that a terminal would obey are replaced.
void tell(const char* kind, std::string_view text);

// Rows of text in columns. The first column is aligned left, the others right. Characters that a terminal would obey
// are replaced.
class TextTable {
 public:
  void add_row(std::vector<std::string> cells);
  void print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

// How long a run still takes if it goes on as fast as on average, in words such as "about 3 min left". Empty if it is
// too early to tell, or if nothing is left. What is longer than 99 hours is "over 99 h left".
std::string time_left(std::uint64_t done, std::uint64_t total, double seconds_passed);

// One line on standard error that says how far a run is, and how long it still takes. It is removed at the end. If
// standard error is not a terminal, nothing is written.
class ProgressBar {
 public:
  ProgressBar(std::string label, std::uint64_t total);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void advance(std::uint64_t count);

  // Shows the line before a step that takes long, though nothing may be done yet.
  void begin_long_step();

 private:
  void draw(bool long_step_is_next);
  double seconds_passed() const;
  std::string label_;
  std::uint64_t total_;
  std::uint64_t done_ = 0;
  std::chrono::steady_clock::time_point start_;
  std::optional<double> drawn_at_;  // seconds after the start
  bool on_;
};

// JSON text, indented by two spaces, with a newline at the end. Bytes that are not UTF-8 are replaced.
std::string to_text(const nlohmann::ordered_json& json);

// Adds the figures of a spread: KEY_median, KEY_least and KEY_most.
void add_spread(nlohmann::ordered_json& json, const std::string& key, const Spread& spread);

// The names of all policies with those of their values, in the order of policy_table().
nlohmann::ordered_json policies_json(const Policies& policies);

// Writes and closes a file. Does nothing if the file is none.
void write_json(OutputFile& file, const nlohmann::ordered_json& json);
void write_json(const std::string& path, const nlohmann::ordered_json& json);

// Writes a line of keys, then one line per row, and closes the file. All rows have the same keys in the same order.
// Null is an empty field. Does nothing if the file is none.
void write_csv(OutputFile& file, const std::vector<nlohmann::ordered_json>& rows);

// A text as a field of a CSV file, quoted where RFC 4180 asks for it. One that begins with = + - @ ', a tab or the end
// of a line gets a ' before it, so that no spreadsheet takes it for a formula. A plain number stays as it is. The cells
// of cab scan (perf/tools/scan/cab_scan/printable.py) have the same rule.
std::string csv_field(std::string_view text);

// A number as text: with a fixed number of decimals; as the shortest text that reads back as the same number; as 16
// hexadecimal digits.
std::string fixed(double value, int decimals);
std::string shortest(float value);
std::string shortest(double value);
std::string hex(std::uint64_t value);

}  // namespace cab::perf
