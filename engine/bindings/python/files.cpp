// Motion files and robots, as bodies and arrays.
#include <cab/files.h>

#include <pybind11/stl.h>

#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/bindings/python/arrays.h"
#include "engine/bindings/python/body_data.h"
#include "engine/bindings/python/errors.h"

namespace cab::python {
namespace {

std::vector<std::string> strings_of(Span<const char* const> strings) { return {strings.begin(), strings.end()}; }

// A text of any bytes: what is no UTF-8 is shown as a replacement character.
py::str decoded(const char* words) {
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeUTF8(words, static_cast<py::ssize_t>(std::strlen(words)), "replace"));
}

// Raises cab.FileError.
[[noreturn]] void raise_file(const char* words, bool is_machine) {
  const py::object error = py::module_::import("cab._errors").attr("FileError")(decoded(words), is_machine);
  PyErr_SetObject(py::type::handle_of(error).ptr(), error.ptr());
  throw py::error_already_set();
}

// A text for a call that reads it up to its first zero. Raises ValueError if it continues after one.
const char* text_of(const char* name, const std::string& text) {
  if (text.find('\0') != std::string::npos)
    throw py::value_error(std::string(name) + ": there is a null character in it");
  return text.c_str();
}

const char* text_of(const char* name, const std::optional<std::string>& text) {
  return text ? text_of(name, *text) : nullptr;
}

py::list list_of(Span<const LinkPair> pairs) {
  py::list list;
  for (const LinkPair& pair : pairs) list.append(py::make_tuple(pair.a, pair.b));
  return list;
}

// The paths of the files that a motion file is read with.
py::list companion_files(const std::string& path) {
  const char* const file_path = text_of("path", path);
  files::Companions companions;
  bool loaded = false;
  {
    const py::gil_scoped_release release;
    loaded = companions.load(file_path);
  }
  if (!loaded) raise_file(companions.error(), companions.is_machine());
  py::list list;
  for (const char* const file : companions.paths()) list.append(py::bytes(file));
  return list;
}

// (body, names, poses, origins, seconds per frame, notes)
py::tuple load_motion(const std::string& path, double metres_per_unit, bool guess_unit,
                      const std::optional<std::string>& motion_path, double motion_metres_per_unit,
                      const std::optional<std::string>& animation, double frames_per_second, int body, double stature,
                      double thickness) {
  files::MotionOptions options;
  options.metres_per_unit = metres_per_unit;
  options.guess_unit = guess_unit;
  options.motion_path = text_of("motion", motion_path);
  options.motion_metres_per_unit = motion_metres_per_unit;
  options.animation = text_of("animation", animation);
  options.frames_per_second = frames_per_second;
  options.body = static_cast<files::MotionBody>(body);
  options.stature = stature;
  options.thickness = thickness;
  files::Motion motion;
  const char* const file = text_of("path", path);
  bool loaded = false;
  {
    const py::gil_scoped_release release;
    loaded = motion.load(file, options);
  }
  if (!loaded) raise_file(motion.error(), motion.is_machine());
  const auto frames = static_cast<py::ssize_t>(motion.frame_count());
  const auto links = static_cast<py::ssize_t>(motion.link_names().size);
  return py::make_tuple(std::make_unique<BodyData>(motion.desc()), strings_of(motion.link_names()),
                        py::array_t<float>({frames, links, py::ssize_t{7}}, motion.poses().data),
                        py::array_t<double>({frames, py::ssize_t{3}}, motion.origins().data), motion.frame_seconds(),
                        strings_of(motion.notes()));
}

// A robot that stays loaded, for its kinematics.
std::unique_ptr<files::Robot> load_robot(const std::string& path,
                                         const std::vector<std::pair<std::string, std::string>>& packages,
                                         const std::optional<std::string>& srdf_path, bool leave_out_missing_meshes,
                                         bool surface, std::uint32_t leaves_per_link) {
  std::vector<const char*> names;
  std::vector<const char*> folders;
  for (const auto& [name, folder] : packages) {
    names.push_back(text_of("packages", name));
    folders.push_back(text_of("packages", folder));
  }
  files::RobotOptions options;
  options.package_names = names;
  options.package_folders = folders;
  options.srdf_path = text_of("srdf", srdf_path);
  options.leave_out_missing_meshes = leave_out_missing_meshes;
  options.surface = surface;
  options.leaves_per_link = leaves_per_link;
  auto robot = std::make_unique<files::Robot>();
  const char* const file = text_of("path", path);
  bool loaded = false;
  {
    const py::gil_scoped_release release;
    loaded = robot->load(file, options);
  }
  if (!loaded) raise_file(robot->error(), robot->is_machine());
  return robot;
}

// [(link, link, reason, samples in which they touch)]
py::list disabled_pairs(files::Robot& robot, std::uint32_t samples, std::uint64_t seed, std::uint32_t threads,
                        float margin) {
  if (!(margin >= 0 && margin <= kMaxCoordinate)) require(Status::kBadMargin);
  bool found = false;
  {
    const py::gil_scoped_release release;
    found = robot.find_disabled_pairs(samples, seed, threads, margin);
  }
  if (!found) raise_file(robot.error(), false);
  py::list list;
  for (const files::DisabledPair& pair : robot.disabled_pairs())
    list.append(py::make_tuple(pair.links.a, pair.links.b, to_string(pair.reason), pair.touching_samples));
  return list;
}

py::array robot_poses(const files::Robot& robot, const py::object& states) {
  const auto variables = static_cast<py::ssize_t>(robot.variables().size);
  const auto links = static_cast<py::ssize_t>(robot.link_names().size);
  const Span<const double> values = span_of<const double>(states, {"states", {-1, variables}, "(n, variables)"});
  const py::ssize_t count = states.cast<py::array>().shape(0);
  py::array_t<float> poses({count, links, py::ssize_t{7}});
  const Span<float> pose_values(poses.mutable_data(), static_cast<std::size_t>(poses.size()));
  bool written = false;
  {
    const py::gil_scoped_release release;
    written = robot.write_poses(values, pose_values);
  }
  if (!written) throw std::bad_alloc();
  return std::move(poses);
}

py::array random_states(const files::Robot& robot, std::size_t count, std::uint64_t seed, std::uint64_t first) {
  py::array_t<double> states({static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(robot.variables().size)});
  robot.write_random_states(seed, first, {states.mutable_data(), static_cast<std::size_t>(states.size())});
  return std::move(states);
}

}  // namespace

void bind_files(py::module_& module) {
  module.attr("reads_files") = true;
  module.attr("max_file_bytes") = files::max_file_bytes();
  module.def("companion_files", &companion_files);
  module.def("load_motion", &load_motion);
  py::class_<files::Robot>(module, "RobotData")
      .def_property_readonly("body", [](const files::Robot& robot) { return std::make_unique<BodyData>(robot.desc()); })
      .def_property_readonly("names", [](const files::Robot& robot) { return strings_of(robot.link_names()); })
      .def_property_readonly("notes", [](const files::Robot& robot) { return strings_of(robot.notes()); })
      .def_property_readonly(
          "variables",
          [](const files::Robot& robot) {
            py::list list;
            for (const files::RobotVariable& variable : robot.variables())
              list.append(py::make_tuple(variable.name, variable.lower, variable.upper, variable.rest));
            return list;
          })
      .def_property_readonly("adjacent_pairs",
                             [](const files::Robot& robot) { return list_of(robot.adjacent_pairs()); })
      .def_property_readonly("welded_pairs", [](const files::Robot& robot) { return list_of(robot.welded_pairs()); })
      .def_property_readonly("listed_pairs", [](const files::Robot& robot) { return list_of(robot.listed_pairs()); })
      .def("disabled_pairs", &disabled_pairs)
      .def("poses", &robot_poses)
      .def("random_states", &random_states);
  module.def("load_robot", &load_robot);
  bind_checker(module);
}

}  // namespace cab::python
