// Joint states from a file.
#include "scenes/robot/state_file.h"

#include "scenes/import/in_child.h"
#include "scenes/import/input_file.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/robot/kinematics.h"
#include "scenes/robot/robot_payload.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace cab::scenes {
namespace {

constexpr std::size_t kMaxStateValues = std::size_t{1} << 24;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

class StateReader {
 public:
  StateReader(const std::string& path, const Robot& robot)
      : robot_(robot), name_(printable(path)), rest_(rest_state(robot)) {}

  JointStates read(std::string_view text) {
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      ++line_;
      const std::string_view line = trimmed(text.substr(begin, end - begin));
      begin = end + 1;
      if (line.empty() || line.front() == '#') continue;
      if (columns_.empty()) {
        read_names(line);
      } else {
        read_values(line);
      }
    }
    if (columns_.empty()) throw ImportError(name_ + ": no line with the names of joints");
    if (states_.count == 0) throw ImportError(name_ + ": no joint state below the line of names");
    if (beyond_ > 0)
      states_.notes.push_back(name_ + ": " + std::to_string(beyond_) +
                              " values are beyond a joint's limit, the first in " + first_beyond_);
    return std::move(states_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw ImportError(name_ + ": line " + std::to_string(line_) + ": " + reason);
  }

  void read_names(std::string_view line) {
    std::vector<bool> given(robot_.variables.size());
    for (const std::string_view field : fields_of(line)) {
      const auto same = [&](const auto& named) { return named.name == field; };
      const auto variable = std::find_if(robot_.variables.begin(), robot_.variables.end(), same);
      const auto index = static_cast<std::size_t>(variable - robot_.variables.begin());
      columns_.emplace_back();
      if (index < given.size()) {
        if (given[index]) fail("the joint " + printable(field) + " has two columns");
        given[index] = true;
        columns_.back() = index;
      } else if (std::any_of(robot_.joints.begin(), robot_.joints.end(), same)) {
        states_.notes.push_back(name_ + ": the column of " + printable(field) +
                                " is not used: it follows another joint");
      } else {
        fail("the robot has no joint '" + printable(field) + "' that moves");
      }
    }
    const auto missing = std::count(given.begin(), given.end(), false);
    if (missing > 0)
      states_.notes.push_back(name_ + ": " + std::to_string(missing) + " joints without a column stay at rest");
  }

  void read_values(std::string_view line) {
    const std::vector<std::string_view> fields = fields_of(line);
    if (fields.size() != columns_.size())
      fail(std::to_string(fields.size()) + " values for " + std::to_string(columns_.size()) + " columns");
    if (states_.values.size() + rest_.size() > kMaxStateValues)
      fail("more than " + std::to_string(kMaxStateValues) + " values in the file's states");
    states_.values.insert(states_.values.end(), rest_.begin(), rest_.end());
    double* const state = states_.values.data() + states_.values.size() - rest_.size();
    for (std::size_t c = 0; c < fields.size(); ++c) {
      double value = 0;
      const char* const end = fields[c].data() + fields[c].size();
      const auto result = std::from_chars(fields[c].data(), end, value);
      if (result.ec != std::errc() || result.ptr != end || !(std::fabs(value) <= kMaxImportValue))
        fail("'" + printable(fields[c]) + "' is not a number from -1e9 to 1e9");
      if (!columns_[c]) continue;
      const RobotVariable& variable = robot_.variables[*columns_[c]];
      if (is_beyond_limits(variable, value) && beyond_++ == 0)
        first_beyond_ = "line " + std::to_string(line_) + ", joint " + variable.name;
      state[*columns_[c]] = value;
    }
    ++states_.count;
  }

  const Robot& robot_;
  const std::string name_;
  const std::vector<double> rest_;
  std::size_t line_ = 0;
  std::vector<std::optional<std::size_t>> columns_;  // the variable of each column
  std::size_t beyond_ = 0;
  std::string first_beyond_;
  JointStates states_;
};

JointStates read_here(const std::string& path, const Robot& robot) {
  return StateReader(path, robot).read(read_text(path, printable(path)));
}

}  // namespace

JointStates read_joint_states(const std::string& path, const Robot& robot,
                              const std::optional<SandboxLimits>& sandbox) {
  if (!sandbox) return read_here(path, robot);
  return from_child(
      path, *sandbox, [&] { return joint_states_payload(read_here(path, robot)); },
      [&](const std::string& bytes) { return read_joint_states_payload(bytes, robot); });
}

}  // namespace cab::scenes
