#include "engine/bindings/python/frame_input.h"

#include "engine/bindings/python/arrays.h"

#include <string>

namespace cab::python {

// Arguments by their names. What is asked for is taken out of them.
class FrameInput::Arguments {
 public:
  explicit Arguments(const py::kwargs& arguments)
      : left_(py::reinterpret_steal<py::dict>(PyDict_Copy(arguments.ptr()))) {
    if (!left_) throw py::error_already_set();
  }

  // None if there is none.
  py::object take(const char* name) {
    if (!left_.contains(name)) return py::none();
    return left_.attr("pop")(name);
  }

  void expect_none_left() const {
    if (!left_.empty())
      throw py::type_error("FrameInput has no argument " + py::str(left_.begin()->first).cast<std::string>());
  }

 private:
  py::dict left_;
};

template <class T>
void FrameInput::take(Span<const T>& span, Arguments& rest, const char* name, py::ssize_t per_instance) {
  const py::object value = rest.take(name);
  if (value.is_none()) return;
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
                       const py::kwargs& arguments) {
  Arguments rest(arguments);
  input_.batch = batch.id;
  count_ = batch.instance_count;
  PoseArray array;
  if (!batch.is_static) {
    array = poses_of(poses, "poses", column, has_scale);
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
  if (const py::object bounds = rest.take("bounds"); !bounds.is_none()) {
    input_.bounds = span_of<const float>(bounds, {"bounds", {static_cast<py::ssize_t>(count_), 2, 3}, "(n, 2, 3)"});
    held_.push_back(bounds);
  }
  if (const py::object moved = rest.take("moved"); !moved.is_none()) {
    const Span<const bool> bytes = span_of<const bool>(moved, {"moved", {static_cast<py::ssize_t>(count_)}, "(n,)"});
    input_.moved = {reinterpret_cast<const std::uint8_t*>(bytes.data), bytes.size};
    held_.push_back(moved);
  }
  if (const py::object instances = rest.take("instances"); !instances.is_none()) {
    input_.instances = span_of<const std::uint32_t>(instances, {"instances", {-1}, "(k,)"});
    if (input_.instances.empty()) input_.count = 0;  // an empty list means all to the engine
    held_.push_back(instances);
  }
  if (input_.count != 0) refuse_other_order(array, "poses", input_.instances);
  // Zeros, since flags of instances that are not listed are not written.
  const py::object zeros = py::module_::import("numpy").attr("zeros");
  if (!batch.is_static) {
    flags_ = zeros(count_, py::dtype::of<std::uint8_t>());
    input_.flags = {static_cast<std::uint8_t*>(py::array(flags_).mutable_data()), count_};
  }
  if (const py::object wanted = rest.take("in_contact"); !wanted.is_none() && wanted.cast<bool>()) {
    in_contact_ = zeros(count_, py::dtype::of<bool>());
    input_.in_contact = {static_cast<std::uint8_t*>(py::array(in_contact_).mutable_data()), count_};
  }
  rest.expect_none_left();
}

}  // namespace cab::python
