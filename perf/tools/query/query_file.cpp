#include "perf/tools/query/query_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "layout/error_bounds.h"
#include "scenes/import/import.h"
#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"
#include "scenes/import/words.h"

namespace cab::perf {
namespace {

// Which numbers a column may hold.
enum class Range : std::uint8_t {
  kPosition,  // within kMaxQueryCoordinate
  kFloat,     // any that float holds
  kLength,    // 0 to kMaxCoordinate
  kReach,     // 0 or more, or infinity
};

struct Column {
  const char* name;
  Range range;
  bool is_optional;
  void (*set)(Query& query, double value);
};

constexpr void set_float(float& to, double value) { to = static_cast<float>(value); }

constexpr Column position(const char* name, void (*set)(Query&, double)) {
  return {name, Range::kPosition, false, set};
}
constexpr Column size(const char* name, void (*set)(Query&, double)) { return {name, Range::kLength, false, set}; }

constexpr auto kSetX = [](Query& q, double v) { q.position[0] = v; };
constexpr auto kSetY = [](Query& q, double v) { q.position[1] = v; };
constexpr auto kSetZ = [](Query& q, double v) { q.position[2] = v; };
constexpr auto kSetRadius = [](Query& q, double v) { set_float(q.radius, v); };
constexpr auto kSetReach = [](Query& q, double v) { set_float(q.length, v); };
constexpr Column kX = position("x", kSetX), kY = position("y", kSetY), kZ = position("z", kSetZ);
constexpr Column kRadius = size("radius", kSetRadius);
constexpr Column kQx = {"qx", Range::kFloat, true, [](Query& q, double v) { set_float(q.orientation[0], v); }};
constexpr Column kQy = {"qy", Range::kFloat, true, [](Query& q, double v) { set_float(q.orientation[1], v); }};
constexpr Column kQz = {"qz", Range::kFloat, true, [](Query& q, double v) { set_float(q.orientation[2], v); }};
constexpr Column kQw = {"qw", Range::kFloat, true, [](Query& q, double v) { set_float(q.orientation[3], v); }};

constexpr Column kRayColumns[] = {
    position("ox", kSetX),
    position("oy", kSetY),
    position("oz", kSetZ),
    {"dx", Range::kFloat, false, [](Query& q, double v) { set_float(q.direction[0], v); }},
    {"dy", Range::kFloat, false, [](Query& q, double v) { set_float(q.direction[1], v); }},
    {"dz", Range::kFloat, false, [](Query& q, double v) { set_float(q.direction[2], v); }},
    {"length", Range::kReach, false, kSetReach},
    {"radius", Range::kLength, true, kSetRadius},
};
constexpr Column kSphereColumns[] = {kX, kY, kZ, kRadius};
constexpr Column kBoxColumns[] = {
    kX,
    kY,
    kZ,
    size("hx", [](Query& q, double v) { set_float(q.half[0], v); }),
    size("hy", [](Query& q, double v) { set_float(q.half[1], v); }),
    size("hz", [](Query& q, double v) { set_float(q.half[2], v); }),
    kQx,
    kQy,
    kQz,
    kQw,
};
constexpr Column kCapsuleColumns[] = {
    kX, kY, kZ, kRadius, size("half", [](Query& q, double v) { set_float(q.half[2], v); }), kQx, kQy, kQz, kQw,
};
constexpr Column kPointColumns[] = {kX, kY, kZ, {"distance", Range::kReach, false, kSetReach}};

template <std::size_t kCount>
constexpr Span<const Column> span_of(const Column (&columns)[kCount]) {
  return {columns, kCount};
}

Span<const Column> columns_of(QueryKind kind) {
  switch (kind) {
    case QueryKind::kRay: return span_of(kRayColumns);
    case QueryKind::kSphere: return span_of(kSphereColumns);
    case QueryKind::kBox: return span_of(kBoxColumns);
    case QueryKind::kCapsule: return span_of(kCapsuleColumns);
    case QueryKind::kPoint: return span_of(kPointColumns);
    case QueryKind::kRegion: break;
  }
  throw std::logic_error("no files have regions");
}

bool is_within(Range range, double value) {
  constexpr double kMaxFloat = std::numeric_limits<float>::max();
  switch (range) {
    case Range::kPosition: return std::fabs(value) <= kMaxQueryCoordinate;
    case Range::kFloat: return std::fabs(value) <= kMaxFloat;
    case Range::kLength: return value >= 0 && value <= kMaxFloat && static_cast<float>(value) <= kMaxCoordinate;
    case Range::kReach: return value >= 0 && (value <= kMaxFloat || std::isinf(value));
  }
  return false;
}

const char* wanted(Range range) {
  switch (range) {
    case Range::kPosition: return "a number from -1e30 to 1e30";
    case Range::kFloat: return "a number from -3.4e38 to 3.4e38";
    case Range::kLength: return "a number from 0 to 1e18";
    case Range::kReach: return "a number from 0 to 3.4e38, or inf";
  }
  return "a number";
}

// Reads a file line by line.
class Reader {
 public:
  Reader(QueryKind kind, const std::string& name, std::size_t most)
      : kind_(kind), columns_(columns_of(kind)), name_(name), most_(most) {}

  std::vector<Query> read(std::string_view text) {
    if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      ++line_;
      if (end > kMaxQueryLine) fail("the line is longer than " + std::to_string(kMaxQueryLine) + " bytes");
      read_line(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    if (given_.empty()) throw scenes::ImportError(name_ + ": no line names the columns " + column_names(kind_));
    if (queries_.empty()) throw scenes::ImportError(name_ + ": no " + kind_name(kind_) + " below the line of names");
    return std::move(queries_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw scenes::ImportError(name_ + ":" + std::to_string(line_) + ": " + reason);
  }

  void read_line(std::string_view line) {
    scenes::split_line(line, words_);
    if (words_.empty() || words_[0].substr(0, 1) == "#") return;
    if (given_.empty())
      read_names();
    else
      read_row();
  }

  bool has(const char* name) const {
    for (const Column* column : given_)
      if (column->name == std::string_view(name)) return true;
    return false;
  }

  void read_names() {
    for (const std::string_view word : words_) {
      const Column* found = nullptr;
      for (const Column& column : columns_)
        if (word == column.name) found = &column;
      if (found == nullptr)
        fail(std::string(kind_name(kind_)) + " have no column '" + scenes::printable(word) + "'; theirs are " +
             column_names(kind_));
      if (has(found->name)) fail("the column " + std::string(found->name) + " is there twice");
      given_.push_back(found);
    }
    const bool has_rotation = has("qx") || has("qy") || has("qz") || has("qw");
    for (const Column& column : columns_)
      if (!has(column.name) && (!column.is_optional || (column.name[0] == 'q' && has_rotation)))
        fail("the column " + std::string(column.name) + " is missing; " + kind_name(kind_) + " have " +
             column_names(kind_));
  }

  void read_row() {
    if (words_.size() != given_.size())
      fail(std::to_string(words_.size()) + " values for " + std::to_string(given_.size()) + " columns");
    if (queries_.size() >= most_)
      fail("there are more than " + std::to_string(kMaxQueries) + " queries; give fewer at a time");
    Query query;
    query.kind = kind_;
    for (std::size_t c = 0; c < given_.size(); ++c) {
      double value = 0;
      if (!scenes::read_number(words_[c], value) || !is_within(given_[c]->range, value))
        fail("column " + std::to_string(c + 1) + " (" + given_[c]->name + "): '" + scenes::printable(words_[c]) +
             "' is not " + wanted(given_[c]->range));
      given_[c]->set(query, value);
    }
    check(query);
    queries_.push_back(query);
  }

  // What several columns must have together.
  void check(const Query& query) const {
    const float* const d = query.direction;
    if (kind_ == QueryKind::kRay && query.length != 0 && d[0] == 0 && d[1] == 0 && d[2] == 0)
      fail("the direction dx dy dz is 0 0 0, which only a ray of length 0 may have");
    const float* const q = query.orientation;
    const float length_sq = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(length_sq >= kQuaternionSqMin && length_sq <= kQuaternionSqMax))
      fail("the length of the quaternion qx qy qz qw is not 1e-3 to 1e3");
  }

  const QueryKind kind_;
  const Span<const Column> columns_;
  const std::string& name_;
  const std::size_t most_;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
  std::vector<const Column*> given_;  // the columns of the file, in its order
  std::vector<Query> queries_;
};

}  // namespace

const char* kind_name(QueryKind kind) {
  switch (kind) {
    case QueryKind::kRay: return "rays";
    case QueryKind::kSphere: return "spheres";
    case QueryKind::kBox: return "boxes";
    case QueryKind::kCapsule: return "capsules";
    case QueryKind::kPoint: return "points";
    case QueryKind::kRegion: break;
  }
  return "regions";
}

std::string column_names(QueryKind kind) {
  std::string names;
  bool in_brackets = false;
  for (const Column& column : columns_of(kind)) {
    names += names.empty() ? "" : " ";
    if (column.is_optional && !in_brackets) names += '[';
    in_brackets = column.is_optional;
    names += column.name;
  }
  return in_brackets ? names + ']' : names;
}

std::vector<Query> parse_queries(QueryKind kind, std::string_view text, const std::string& name, std::size_t most) {
  return Reader(kind, name, most).read(text);
}

std::vector<Query> read_queries(QueryKind kind, const std::string& path, std::size_t most) {
  const std::string name = scenes::printable(path);
  return parse_queries(kind, scenes::read_bytes(path, name, scenes::check_file(path, name)), name, most);
}

}  // namespace cab::perf
