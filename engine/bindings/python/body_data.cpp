#include "engine/bindings/python/body_data.h"

#include "engine/bindings/python/arrays.h"
#include "engine/bindings/python/dtypes.h"
#include "engine/bindings/python/errors.h"

#include <cab/cab.h>
#include <cab/rig.h>
#include <cab/skin.h>

#include <pybind11/stl.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

namespace cab::python {
namespace {

std::size_t pose_bytes(PoseFormat format) {
  switch (format) {
    case PoseFormat::kQuaternionTranslation: return 28;
    case PoseFormat::kMatrix3x4Rows: return 48;
    case PoseFormat::kMatrix4x4Columns: return 64;
  }
  return 0;
}

// A description whose arrays are those of Python; it is copied at once. Poses of the rest pose have one instance.
std::unique_ptr<BodyData> from_boxes(const py::object& parents, const py::object& joints, const py::object& links,
                                     const py::object& boxes, const py::sequence& parts,
                                     const py::object& ignored_pairs, std::uint32_t ignored_hops,
                                     const py::object& rest_pose, bool column) {
  ArticulationDesc desc;
  desc.link_parents = span_of<const std::int32_t>(parents, {"parents", {-1}, "(links,)"});
  const auto link_count = static_cast<py::ssize_t>(desc.link_parents.size);
  if (!joints.is_none()) desc.link_joints = span_of<const float>(joints, {"joints", {link_count, 3}, "(links, 3)"});
  const auto leaf_links = span_of<const std::uint32_t>(links, {"links", {-1}, "(boxes,)"});
  const py::array box_array =
      checked(boxes, box_dtype(), {"boxes", {static_cast<py::ssize_t>(leaf_links.size)}, "(boxes,)"});
  const Box* const box_data = static_cast<const Box*>(box_array.data());
  const PartList part_list(parts, leaf_links.size);
  std::vector<Leaf> leaves(leaf_links.size);
  for (std::size_t k = 0; k < leaves.size(); ++k) leaves[k] = {leaf_links[k], box_data[k], part_list.of_leaf(k)};
  desc.leaves = leaves;
  std::vector<LinkPair> pairs;
  const auto numbers = span_of<const std::uint32_t>(ignored_pairs, {"ignored_pairs", {-1, 2}, "(pairs, 2)"});
  for (std::size_t k = 0; k + 1 < numbers.size; k += 2) pairs.push_back({numbers[k], numbers[k + 1]});
  desc.ignored_pairs = pairs;
  desc.ignored_hops = ignored_hops;
  if (!rest_pose.is_none()) {
    const PoseArray pose = poses_of(rest_pose, "rest_pose", column, false);
    refuse_other_order(pose, "rest_pose");
    if (pose.instances != 1 || pose.links != desc.link_parents.size)
      throw py::value_error("rest_pose: one pose of " + std::to_string(link_count) + " links is wanted, and " +
                            std::to_string(pose.instances) + " of " + std::to_string(pose.links) + " are given");
    desc.rest_pose = pose.view;
  }
  return std::make_unique<BodyData>(desc);
}

template <class LibraryStatus>
void require_rig(LibraryStatus status, const char* call) {
  if (status == LibraryStatus::kOk) return;
  if (status == LibraryStatus::kOutOfMemory) raise_status(Status::kOutOfMemory, call);
  throw py::value_error(std::string(call) + ": " + rig::to_string(status));
}

std::unique_ptr<BodyData> from_skeleton(const py::object& parents, const std::vector<std::string>& names,
                                        const py::object& poses, bool column, float stature, float thickness) {
  rig::SkeletonDesc skeleton;
  skeleton.parents = span_of<const std::int32_t>(parents, {"parents", {-1}, "(joints,)"});
  std::vector<const char*> name_data;
  for (const std::string& name : names) name_data.push_back(name.c_str());
  skeleton.names = name_data;
  const PoseArray pose_array = poses_of(poses, "poses", column, false);
  refuse_other_order(pose_array, "poses");
  if (pose_array.links != skeleton.parents.size)
    throw py::value_error("poses: " + std::to_string(skeleton.parents.size) + " joints are wanted, and " +
                          std::to_string(pose_array.links) + " are given");
  skeleton.poses = pose_array.view;
  skeleton.pose_count = static_cast<std::uint32_t>(pose_array.instances);
  rig::SkeletonOptions options;
  options.stature = stature;
  options.thickness = thickness;
  rig::Bodies bodies;
  rig::Status status = rig::Status::kOk;
  {
    const py::gil_scoped_release release;
    status = rig::bodies_from_skeleton(skeleton, options, &bodies);
  }
  require_rig(status, "from_skeleton");
  return std::make_unique<BodyData>(bodies.desc());
}

// What a skin is made of, as keyword arguments; spans point into the arrays.
rig::Skin skin_of(const py::kwargs& arrays) {
  rig::Skin skin;
  skin.joint_parents = span_of<const std::int32_t>(arrays["parents"], {"parents", {-1}, "(joints,)"});
  const auto joints = static_cast<py::ssize_t>(skin.joint_parents.size);
  skin.poses = span_of<const float>(arrays["poses"], {"poses", {-1, joints, 4, 4}, "(poses, joints, 4, 4)"});
  skin.vertices = span_of<const float>(arrays["vertices"], {"vertices", {-1, 3}, "(n, 3)"});
  skin.triangles = span_of<const std::uint32_t>(arrays["triangles"], {"triangles", {-1, 3}, "(m, 3)"});
  const auto vertices = static_cast<py::ssize_t>(skin.vertices.size / 3);
  skin.influence_bones = span_of<const std::uint32_t>(arrays["bones"], {"bones", {vertices, -1}, "(n, influences)"});
  const auto influences =
      vertices > 0 ? static_cast<py::ssize_t>(skin.influence_bones.size) / vertices : py::ssize_t{0};
  skin.influence_count = static_cast<std::uint32_t>(influences);
  skin.influence_weights =
      span_of<const float>(arrays["weights"], {"weights", {vertices, influences}, "(n, influences)"});
  skin.inverse_bind = span_of<const float>(arrays["inverse_bind"], {"inverse_bind", {-1, 4, 4}, "(bones, 4, 4)"});
  skin.bone_joints = span_of<const std::uint32_t>(
      arrays["bone_joints"], {"bone_joints", {static_cast<py::ssize_t>(skin.inverse_bind.size / 16)}, "(bones,)"});
  return skin;
}

// Bodies of a skin, which stay for `link_poses`.
struct SkinData {
  rig::SkinBodies bodies;
  std::size_t joint_count = 0;
};

// What `make(skin, bodies)` makes of a skin, without the interpreter's lock.
template <class Make>
std::unique_ptr<SkinData> made_of(const rig::Skin& skin, const char* call, Make&& make) {
  auto made = std::make_unique<SkinData>();
  made->joint_count = skin.joint_parents.size;
  rig::SkinStatus status = rig::SkinStatus::kOk;
  {
    const py::gil_scoped_release release;
    status = make(skin, made->bodies);
  }
  require_rig(status, call);
  return made;
}

std::unique_ptr<SkinData> from_skin(std::uint32_t kinds, std::uint32_t max_hull_vertices, std::uint32_t leaves_per_link,
                                    bool inflate, float least_reach, const py::object& kept_joints,
                                    const py::kwargs& arrays) {
  rig::BodyRules rules;
  rules.kinds = kinds;
  rules.max_hull_vertices = max_hull_vertices;
  rules.leaves_per_link = leaves_per_link;
  rules.inflate = inflate;
  rules.least_reach = least_reach;
  rules.kept_joints = span_of<const std::uint32_t>(kept_joints, {"kept_joints", {-1}, "(k,)"});
  return made_of(skin_of(arrays), "from_skin", [&rules](const rig::Skin& skin, rig::SkinBodies& bodies) {
    return rig::bodies_from_skin(skin, rules, &bodies);
  });
}

std::unique_ptr<SkinData> from_surface(std::uint32_t most_triangles, const py::kwargs& arrays) {
  rig::SurfaceRules rules;
  rules.most_triangles = most_triangles;
  return made_of(skin_of(arrays), "from_surface", [&rules](const rig::Skin& skin, rig::SkinBodies& bodies) {
    return rig::surface_from_skin(skin, rules, &bodies);
  });
}

// The same body with more pairs of links ignored.
std::unique_ptr<BodyData> ignoring(const BodyData& body, const py::object& pairs, std::uint32_t hops) {
  ArticulationDesc desc = body.desc();
  std::vector<LinkPair> all(desc.ignored_pairs.begin(), desc.ignored_pairs.end());
  const auto numbers = span_of<const std::uint32_t>(pairs, {"pairs", {-1, 2}, "(n, 2)"});
  for (std::size_t k = 0; k + 1 < numbers.size; k += 2) all.push_back({numbers[k], numbers[k + 1]});
  desc.ignored_pairs = all;
  desc.ignored_hops = std::max(desc.ignored_hops, hops);
  return std::make_unique<BodyData>(desc);
}

// (frames, joints, 4, 4) by columns to (frames, links, 7).
py::array skin_link_poses(const SkinData& skin, const py::object& matrices) {
  const auto joints = static_cast<py::ssize_t>(skin.joint_count);
  const auto numbers =
      span_of<const float>(matrices, {"matrices", {-1, joints, 4, 4}, "(frames, joints, 4, 4) by columns"});
  const py::ssize_t frames = matrices.cast<py::array>().shape(0);
  const std::size_t links = skin.bodies.joints().size;
  py::array_t<float> poses({frames, static_cast<py::ssize_t>(links), py::ssize_t{7}});
  for (std::size_t f = 0; f < static_cast<std::size_t>(frames); ++f)
    require_rig(rig::link_poses(skin.bodies, {numbers.data + f * 16 * skin.joint_count, 16 * skin.joint_count},
                                {poses.mutable_data() + f * 7 * links, 7 * links}),
                "link_poses");
  return std::move(poses);
}

// The parts of all leaves, as PartList takes them.
py::list parts_of(const BodyData& body) {
  py::list list;
  const Span<const Leaf> leaves = body.desc().leaves;
  for (std::size_t k = 0; k < leaves.size; ++k)
    for (const ConvexPart& part : leaves[k].parts) {
      py::object vertices = py::none();
      if (part.vertices.size > 0)
        vertices =
            py::array_t<float>({static_cast<py::ssize_t>(part.vertices.size / 3), py::ssize_t{3}}, part.vertices.data);
      list.append(py::make_tuple(k, static_cast<int>(part.kind),
                                 py::make_tuple(part.position[0], part.position[1], part.position[2]),
                                 py::make_tuple(part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]),
                                 py::make_tuple(part.size[0], part.size[1], part.size[2]), vertices));
    }
  return list;
}

template <class T>
py::array copy_of(Span<const T> values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size), values.data);
}

py::array boxes_of(const BodyData& body) {
  const Span<const Leaf> leaves = body.desc().leaves;
  py::array boxes = empty_array(box_dtype(), leaves.size);
  for (std::size_t k = 0; k < leaves.size; ++k) static_cast<Box*>(boxes.mutable_data())[k] = leaves[k].box;
  return boxes;
}

// As `from_boxes` takes it, by rows: (1, links, ...), or None.
py::object rest_pose_of(const BodyData& body) {
  const PoseView& pose = body.desc().rest_pose;
  if (!pose.data) return py::none();
  const std::size_t links = body.desc().link_parents.size;
  const py::object numbers = copy_of(Span<const float>(pose.data, links * pose_bytes(pose.format) / sizeof(float)));
  switch (pose.format) {
    case PoseFormat::kQuaternionTranslation: return numbers.attr("reshape")(1, -1, 7);
    case PoseFormat::kMatrix3x4Rows: return numbers.attr("reshape")(1, -1, 3, 4);
    case PoseFormat::kMatrix4x4Columns: return numbers.attr("reshape")(1, -1, 4, 4).attr("swapaxes")(2, 3);
  }
  return py::none();
}

// The numbers of an array of a pickle.
template <class T>
Span<const T> span_in(const py::object& array) {
  return span_of<const T>(array, {"a pickled body", {-1}, "(n,)"});
}

// All that `from_state` makes the same body of.
py::tuple state_of(const BodyData& body) {
  const ArticulationDesc& desc = body.desc();
  const std::size_t links = desc.link_parents.size;
  py::list leaf_links, triangles, pairs;
  for (const Leaf& leaf : desc.leaves) {
    leaf_links.append(leaf.link);
    triangles.append(copy_of(leaf.triangles));
  }
  for (const LinkPair& pair : desc.ignored_pairs) pairs.append(py::make_tuple(pair.a, pair.b));
  py::object pose = py::none();
  if (desc.rest_pose.data) {
    const std::size_t floats = links * pose_bytes(desc.rest_pose.format) / sizeof(float);
    pose = py::make_tuple(static_cast<int>(desc.rest_pose.format), desc.rest_pose.has_scale,
                          copy_of(Span<const float>(desc.rest_pose.data, floats)));
  }
  return py::make_tuple(copy_of(desc.link_parents), copy_of(desc.link_joints), leaf_links, boxes_of(body),
                        parts_of(body), triangles, pairs, desc.ignored_hops, pose, desc.skin.influence_count,
                        copy_of(desc.skin.vertices), copy_of(desc.skin.influence_links),
                        copy_of(desc.skin.influence_weights), copy_of(desc.skin.inverse_bind));
}

std::unique_ptr<BodyData> from_state(const py::tuple& state) {
  ArticulationDesc desc;
  desc.link_parents = span_in<std::int32_t>(state[0]);
  desc.link_joints = span_in<float>(state[1]);
  const auto leaf_links = state[2].cast<std::vector<std::uint32_t>>();
  const auto leaf_count = static_cast<py::ssize_t>(leaf_links.size());
  const py::array boxes = checked(state[3], box_dtype(), {"a pickled body", {leaf_count}, "(boxes,)"});
  const PartList parts(state[4], leaf_links.size());
  const py::list triangles = state[5];
  std::vector<Leaf> leaves(leaf_links.size());
  for (std::size_t k = 0; k < leaves.size(); ++k)
    leaves[k] = {leaf_links[k], static_cast<const Box*>(boxes.data())[k], parts.of_leaf(k),
                 span_in<std::uint32_t>(triangles[k])};
  desc.leaves = leaves;
  std::vector<LinkPair> pairs;
  for (const auto& [a, b] : state[6].cast<std::vector<std::pair<std::uint32_t, std::uint32_t>>>())
    pairs.push_back({a, b});
  desc.ignored_pairs = pairs;
  desc.ignored_hops = state[7].cast<std::uint32_t>();
  if (!state[8].is_none()) {
    const py::tuple pose = state[8];
    desc.rest_pose.format = static_cast<PoseFormat>(pose[0].cast<int>());
    desc.rest_pose.has_scale = pose[1].cast<bool>();
    const Span<const float> numbers = span_in<float>(pose[2]);
    if (numbers.size * sizeof(float) != desc.link_parents.size * pose_bytes(desc.rest_pose.format))
      throw py::value_error("a pickled body: its rest pose has another number of links");
    desc.rest_pose.data = numbers.data;
  }
  desc.skin = {span_in<float>(state[10]), state[9].cast<std::uint32_t>(), span_in<std::uint32_t>(state[11]),
               span_in<float>(state[12]), span_in<float>(state[13])};
  return std::make_unique<BodyData>(desc);
}

py::array fitted_box(const py::object& vertices) {
  const auto numbers = span_of<const float>(vertices, {"vertices", {-1, 3}, "(n, 3)"});
  py::array boxes = empty_array(box_dtype(), 1);
  Box* const box = static_cast<Box*>(boxes.mutable_data());
  Status status = Status::kOk;
  {
    const py::gil_scoped_release release;
    status = fit_box(numbers, box);
  }
  require(status);
  return boxes;
}

}  // namespace

BodyData::BodyData(const ArticulationDesc& desc) : desc_(desc) {
  parents_.assign(desc.link_parents.begin(), desc.link_parents.end());
  joints_.assign(desc.link_joints.begin(), desc.link_joints.end());
  leaves_.assign(desc.leaves.begin(), desc.leaves.end());
  ignored_.assign(desc.ignored_pairs.begin(), desc.ignored_pairs.end());
  std::size_t part_count = 0;
  std::size_t number_count = 0;
  for (const Leaf& leaf : leaves_) {
    part_count += leaf.parts.size;
    for (const ConvexPart& part : leaf.parts) number_count += part.vertices.size;
  }
  parts_.reserve(part_count);  // so that pointers into them stay
  vertices_.reserve(number_count);
  for (Leaf& leaf : leaves_) {
    const Span<const ConvexPart> given = leaf.parts;
    leaf.parts = {parts_.data() + parts_.size(), given.size};
    for (ConvexPart part : given) {
      const Span<const float> points = part.vertices;
      part.vertices = {vertices_.data() + vertices_.size(), points.size};
      vertices_.insert(vertices_.end(), points.begin(), points.end());
      parts_.push_back(part);
    }
  }
  if (desc.rest_pose.data) {
    const std::size_t bytes = pose_bytes(desc.rest_pose.format);
    const std::size_t stride = desc.rest_pose.link_stride ? desc.rest_pose.link_stride : bytes;
    rest_pose_.resize(parents_.size() * bytes / sizeof(float));
    for (std::size_t l = 0; l < parents_.size(); ++l)
      std::memcpy(rest_pose_.data() + l * bytes / sizeof(float),
                  reinterpret_cast<const char*>(desc.rest_pose.data) + l * stride, bytes);
    desc_.rest_pose.data = rest_pose_.data();
    desc_.rest_pose.link_stride = 0;
    desc_.rest_pose.instance_stride = 0;
  }
  std::size_t corner_count = 0;
  for (const Leaf& leaf : leaves_) corner_count += leaf.triangles.size;
  triangles_.reserve(corner_count);
  for (Leaf& leaf : leaves_) {
    const Span<const std::uint32_t> given = leaf.triangles;
    leaf.triangles = {triangles_.data() + triangles_.size(), given.size};
    triangles_.insert(triangles_.end(), given.begin(), given.end());
  }
  skin_vertices_.assign(desc.skin.vertices.begin(), desc.skin.vertices.end());
  skin_links_.assign(desc.skin.influence_links.begin(), desc.skin.influence_links.end());
  skin_weights_.assign(desc.skin.influence_weights.begin(), desc.skin.influence_weights.end());
  skin_binds_.assign(desc.skin.inverse_bind.begin(), desc.skin.inverse_bind.end());
  desc_.skin = {skin_vertices_, desc.skin.influence_count, skin_links_, skin_weights_, skin_binds_};
  desc_.link_parents = parents_;
  desc_.link_joints = joints_;
  desc_.leaves = leaves_;
  desc_.ignored_pairs = ignored_;
}

PartList::PartList(const py::sequence& parts, std::size_t leaf_count) : parts_(leaf_count) {
  for (const py::handle item : parts) {
    const auto fields = py::reinterpret_borrow<py::tuple>(item);
    const auto leaf = fields[0].cast<std::size_t>();
    if (leaf >= leaf_count) throw py::value_error("shapes: there is no box " + std::to_string(leaf));
    ConvexPart part;
    part.kind = static_cast<ShapeKind>(fields[1].cast<int>());
    for (std::size_t c = 0; c < 3; ++c) part.position[c] = fields[2].cast<py::tuple>()[c].cast<float>();
    for (std::size_t c = 0; c < 4; ++c) part.rotation[c] = fields[3].cast<py::tuple>()[c].cast<float>();
    for (std::size_t c = 0; c < 3; ++c) part.size[c] = fields[4].cast<py::tuple>()[c].cast<float>();
    const py::object vertices = fields[5];
    if (!vertices.is_none()) part.vertices = span_of<const float>(vertices, {"vertices", {-1, 3}, "(n, 3)"});
    parts_[leaf].push_back(part);
  }
}

void bind_body_data(py::module_& module) {
  py::class_<BodyData>(module, "BodyData")
      .def_property_readonly("parents", [](const BodyData& body) { return copy_of(body.desc().link_parents); })
      .def_property_readonly("joints",
                             [](const BodyData& body) -> py::object {
                               const Span<const float> joints = body.desc().link_joints;
                               if (joints.empty()) return py::none();
                               return copy_of(joints).attr("reshape")(-1, 3);
                             })
      .def_property_readonly("links",
                             [](const BodyData& body) {
                               std::vector<std::uint32_t> links;
                               for (const Leaf& leaf : body.desc().leaves) links.push_back(leaf.link);
                               return copy_of(Span<const std::uint32_t>(links));
                             })
      .def_property_readonly("boxes", &boxes_of)
      .def_property_readonly("parts", &parts_of)
      .def_property_readonly("ignored_pairs",
                             [](const BodyData& body) {
                               std::vector<std::uint32_t> numbers;
                               for (const LinkPair& pair : body.desc().ignored_pairs) {
                                 numbers.push_back(pair.a);
                                 numbers.push_back(pair.b);
                               }
                               return copy_of(Span<const std::uint32_t>(numbers)).attr("reshape")(-1, 2);
                             })
      .def_property_readonly("triangles",
                             [](const BodyData& body) {
                               py::list out;
                               for (const Leaf& leaf : body.desc().leaves)
                                 out.append(copy_of(leaf.triangles).attr("reshape")(-1, 3));
                               return out;
                             })
      .def_property_readonly("skin",
                             [](const BodyData& body) {
                               const SkinDesc& skin = body.desc().skin;
                               return py::make_tuple(copy_of(skin.vertices), copy_of(skin.influence_links),
                                                     copy_of(skin.influence_weights), copy_of(skin.inverse_bind));
                             })
      .def(py::pickle(&state_of, &from_state))
      .def("ignoring", &ignoring)
      .def_property_readonly("rest_pose", &rest_pose_of)
      .def_property_readonly("ignored_hops", [](const BodyData& body) { return body.desc().ignored_hops; });
  module.def("from_boxes", &from_boxes);
  module.def("from_skeleton", &from_skeleton);
  py::class_<SkinData>(module, "SkinData")
      .def_property_readonly("body",
                             [](const SkinData& skin) { return std::make_unique<BodyData>(skin.bodies.desc()); })
      .def_property_readonly("joints", [](const SkinData& skin) { return copy_of(skin.bodies.joints()); })
      .def_property_readonly("source_triangles",
                             [](const SkinData& skin) { return copy_of(skin.bodies.source_triangles()); })
      .def("link_poses", &skin_link_poses);
  module.def("from_skin", &from_skin);
  module.def("from_surface", &from_surface);
  module.def("fit_box", &fitted_box);
  module.def("require_last_rows", &require_last_rows);
}

}  // namespace cab::python
