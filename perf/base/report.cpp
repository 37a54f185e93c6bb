#include "perf/base/report.h"

#include <cab/policy.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "perf/base/option_values.h"
#include "perf/base/progress_line.h"
#include "perf/base/signals.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

template <class... Arguments>
std::string number_text(Arguments... arguments) {
  std::array<char, 400> buffer;  // a double with all its digits before the point has 309
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), arguments...);
  return error == std::errc() ? std::string(buffer.data(), end) : std::string("?");
}

// Whether a text is a number in digits, which may have a sign, a point and an exponent.
bool is_number(std::string_view text) {
  if (!text.empty() && (text[0] == '+' || text[0] == '-')) text.remove_prefix(1);
  if (text.empty() || text[0] < '0' || text[0] > '9') return false;  // such as inf
  double ignored = 0;
  return std::from_chars(text.data(), text.data() + text.size(), ignored).ptr == text.data() + text.size();
}

// The number of characters that a terminal shows. UTF-8 continuation bytes take no place of their own.
std::size_t shown_width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u; }));
}

// A field of a CSV file, quoted where RFC 4180 asks for it.
std::string in_csv(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string field = "\"";
  for (const char c : text) {
    if (c == '"') field += '"';
    field += c;
  }
  return field + '"';
}

}  // namespace

void tell(const char* kind, std::string_view text) { std::cerr << kind << ": " << scenes::printable(text) << '\n'; }

void TextTable::add_row(std::vector<std::string> cells) {
  for (std::string& cell : cells) cell = scenes::printable(cell);
  rows_.push_back(std::move(cells));
}

void TextTable::print(std::ostream& out) const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], shown_width(row[c]));
  }
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string space(widths[c] - shown_width(row[c]), ' ');
      if (c > 0) line += "  ";
      line += c == 0 ? row[c] + space : space + row[c];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << '\n';
  }
}

std::string time_left(std::uint64_t done, std::uint64_t total, double seconds_passed) {
  // Before this much has passed an average says little.
  constexpr double kLeastSeconds = 2, kLeastShare = 0.01;
  if (done >= total || !(seconds_passed >= kLeastSeconds)) return "";
  const double share = static_cast<double>(done) / static_cast<double>(total);
  if (share < kLeastShare) return "";
  constexpr double kMinute = 60, kHour = 3600, kMostHours = 99;
  const double seconds = seconds_passed * (1 - share) / share;
  const auto about = [](double count, const char* unit) { return "about " + fixed(count, 0) + " " + unit + " left"; };
  // Rounded up, to 5 s and to whole minutes and hours: more would not be honest.
  if (seconds <= kMinute - 5) return about(5 * std::max(1.0, std::ceil(seconds / 5)), "s");
  if (seconds <= kHour - kMinute) return about(std::ceil(seconds / kMinute), "min");
  if (seconds <= kMostHours * kHour) return about(std::ceil(seconds / kHour), "h");
  return "over " + fixed(kMostHours, 0) + " h left";
}

ProgressBar::ProgressBar(std::string label, std::uint64_t total)
    : label_(std::move(label)),
      total_(total),
      start_(std::chrono::steady_clock::now()),
      on_(total > 0 && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (!drawn_at_) return;
  std::fputs("\r\033[K", stderr);
  clear_line_at_signals(false);
}

void ProgressBar::advance(std::uint64_t count) {
  const std::uint64_t shown = 100 * done_ / std::max<std::uint64_t>(total_, 1);
  done_ = count < total_ - done_ ? done_ + count : total_;
  if (!on_) return;
  constexpr double kSecondsBetweenDraws = 1;
  if (100 * done_ / total_ != shown || seconds_passed() - drawn_at_.value_or(0) >= kSecondsBetweenDraws) draw(false);
}

void ProgressBar::begin_long_step() {
  if (on_) draw(true);
}

double ProgressBar::seconds_passed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void ProgressBar::draw(bool long_step_is_next) {
  const double seconds = seconds_passed();
  const std::string line = progress_line(label_, done_, total_, seconds, long_step_is_next);
  if (line.empty()) return;
  drawn_at_ = seconds;
  clear_line_at_signals(true);
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
}

std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void add_spread(nlohmann::ordered_json& json, const std::string& key, const Spread& spread) {
  json[key + "_median"] = spread.median;
  json[key + "_least"] = spread.least;
  json[key + "_most"] = spread.most;
}

nlohmann::ordered_json policies_json(const Policies& policies) {
  nlohmann::ordered_json json;
  for (std::uint32_t f = 0; f < policy_table().size; ++f) json[policy_table()[f].name] = policy_value(policies, f);
  return json;
}

void write_json(OutputFile& file, const nlohmann::ordered_json& json) {
  if (!file) return;
  file.stream() << to_text(json);
  file.close();
}

void write_json(const std::string& path, const nlohmann::ordered_json& json) {
  OutputFile file(path);
  write_json(file, json);
}

void write_csv(OutputFile& file, const std::vector<nlohmann::ordered_json>& rows) {
  if (!file) return;
  std::string header;
  for (const auto& [key, value] : rows.front().items()) header += (header.empty() ? "" : ",") + csv_field(key);
  file.stream() << header << '\n';
  for (const nlohmann::ordered_json& row : rows) {
    std::string line;
    for (const auto& [key, value] : row.items()) {
      if (!line.empty()) line += ',';
      if (!value.is_null()) line += value.is_string() ? csv_field(value.get<std::string>()) : in_csv(value.dump());
    }
    file.stream() << line << '\n';
  }
  file.close();
}

std::string csv_field(std::string_view text) {
  const bool may_be_formula = !text.empty() && std::string_view("=+-@\t\r\n'").find(text[0]) != std::string_view::npos;
  return in_csv(may_be_formula && !is_number(text) ? "'" + std::string(text) : std::string(text));
}

std::string fixed(double value, int decimals) { return number_text(value, std::chars_format::fixed, decimals); }
std::string shortest(float value) { return number_text(value); }
std::string shortest(double value) { return number_text(value); }

std::string hex(std::uint64_t value) {
  const std::string digits = number_text(value, 16);
  return std::string(16 - digits.size(), '0') + digits;
}

}  // namespace cab::perf
