#include "engine/bindings/python/frame_input.h"

#include "engine/bindings/python/arrays.h"

#include <string>

namespace cab::python {

template <class T>
void FrameInput::take(Span<const T>& span, const py::kwargs& rest, const char* name, py::ssize_t per_instance) {
  if (!rest.contains(name) || rest[name].is_none()) return;
  const py::object value = rest[name];
  const auto n = static_cast<py::ssize_t>(count_);
  if (per_instance == 1) {
    span = span_of<const T>(value, {name, {n}, "(n,)"});
  } else {
    const std::string words = "(n, " + std::to_string(per_instance) + ")";
    span = span_of<const T>(value, {name, {n, per_instance}, words.c_str()});
  }
  held_.push_back(value);
}

FrameInput::FrameInput(const BatchRecord& batch, const py::object& poses, bool column, bool has_scale,
                       const py::kwargs& rest) {
  input_.batch = batch.id;
  count_ = batch.instance_count;
  if (!batch.is_static) {
    const PoseArray array = poses_of(poses, "poses", column, has_scale);
    if (array.links != batch.link_count)
      throw py::value_error("poses: the body has " + std::to_string(batch.link_count) + " links, and poses of " +
                            std::to_string(array.links) + " are given");
    if (array.instances > batch.instance_count)
      throw py::value_error("poses: there is room for " + std::to_string(batch.instance_count) +
                            " characters, and poses of " + std::to_string(array.instances) +
                            " are given; grow() makes room");
    if (batch.kind == BatchKind::kSequence && array.instances != batch.instance_count)
      throw py::value_error("poses: the sequence has " + std::to_string(batch.instance_count) +
                            " frames, and poses of " + std::to_string(array.instances) + " are given");
    count_ = array.instances;
    input_.poses = array.view;
    if (count_ != batch.instance_count) input_.count = static_cast<std::uint32_t>(count_);
    held_.push_back(poses);
  }
  take(input_.origins, rest, "origins", 3);
  take(input_.orientations, rest, "orientations", 4);
  take(input_.scales, rest, "scales", 1);
  take(input_.layers, rest, "layers", 1);
  take(input_.layer_masks, rest, "layer_masks", 1);
  take(input_.margins, rest, "margins", 1);
  if (rest.contains("bounds") && !rest["bounds"].is_none()) {
    const py::object bounds = rest["bounds"];
    input_.bounds = span_of<const float>(bounds, {"bounds", {static_cast<py::ssize_t>(count_), 2, 3}, "(n, 2, 3)"});
    held_.push_back(bounds);
  }
  if (rest.contains("moved") && !rest["moved"].is_none()) {
    const py::object moved = rest["moved"];
    const Span<const bool> bytes = span_of<const bool>(moved, {"moved", {static_cast<py::ssize_t>(count_)}, "(n,)"});
    input_.moved = {reinterpret_cast<const std::uint8_t*>(bytes.data), bytes.size};
    held_.push_back(moved);
  }
  if (rest.contains("instances") && !rest["instances"].is_none()) {
    const py::object instances = rest["instances"];
    input_.instances = span_of<const std::uint32_t>(instances, {"instances", {-1}, "(k,)"});
    if (input_.instances.empty()) input_.count = 0;  // an empty list means all to the engine
    held_.push_back(instances);
  }
  // Zeros, since flags of instances that are not listed are not written.
  const py::object zeros = py::module_::import("numpy").attr("zeros");
  if (!batch.is_static) {
    flags_ = zeros(count_, py::dtype::of<std::uint8_t>());
    input_.flags = {static_cast<std::uint8_t*>(py::array(flags_).mutable_data()), count_};
  }
  if (rest.contains("in_contact") && rest["in_contact"].cast<bool>()) {
    in_contact_ = zeros(count_, py::dtype::of<bool>());
    input_.in_contact = {static_cast<std::uint8_t*>(py::array(in_contact_).mutable_data()), count_};
  }
}

}  // namespace cab::python
