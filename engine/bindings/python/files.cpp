// Motion files and robots, as bodies and arrays.
#include <cab/files.h>

#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/bindings/python/arrays.h"
#include "engine/bindings/python/body_data.h"

namespace cab::python {
namespace {

std::vector<std::string> strings_of(Span<const char* const> strings) { return {strings.begin(), strings.end()}; }

// Raises cab.FileError.
[[noreturn]] void raise_file(const char* words) {
  const py::object type = py::module_::import("cab._errors").attr("FileError");
  PyErr_SetString(type.ptr(), words);
  throw py::error_already_set();
}

const char* or_null(const std::optional<std::string>& text) { return text ? text->c_str() : nullptr; }

// (body, names, poses, origins, seconds per frame, notes)
py::tuple load_motion(const std::string& path, double metres_per_unit, bool guess_unit,
                      const std::optional<std::string>& motion_path, double motion_metres_per_unit,
                      const std::optional<std::string>& animation, double frames_per_second, bool skin, double stature,
                      double thickness) {
  files::MotionOptions options;
  options.metres_per_unit = metres_per_unit;
  options.guess_unit = guess_unit;
  options.motion_path = or_null(motion_path);
  options.motion_metres_per_unit = motion_metres_per_unit;
  options.animation = or_null(animation);
  options.frames_per_second = frames_per_second;
  options.skin = skin;
  options.stature = stature;
  options.thickness = thickness;
  files::Motion motion;
  bool loaded = false;
  {
    const py::gil_scoped_release release;
    loaded = motion.load(path.c_str(), options);
  }
  if (!loaded) raise_file(motion.error());
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
                                         const std::optional<std::string>& srdf_path, bool leave_out_missing_meshes) {
  std::vector<const char*> names;
  std::vector<const char*> folders;
  for (const auto& [name, folder] : packages) {
    names.push_back(name.c_str());
    folders.push_back(folder.c_str());
  }
  files::RobotOptions options;
  options.package_names = names;
  options.package_folders = folders;
  options.srdf_path = or_null(srdf_path);
  options.leave_out_missing_meshes = leave_out_missing_meshes;
  auto robot = std::make_unique<files::Robot>();
  bool loaded = false;
  {
    const py::gil_scoped_release release;
    loaded = robot->load(path.c_str(), options);
  }
  if (!loaded) raise_file(robot->error());
  return robot;
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
                             [](const files::Robot& robot) {
                               py::list list;
                               for (const LinkPair& pair : robot.adjacent_pairs())
                                 list.append(py::make_tuple(pair.a, pair.b));
                               return list;
                             })
      .def("poses", &robot_poses)
      .def("random_states", &random_states);
  module.def("load_robot", &load_robot);
}

}  // namespace cab::python
