// What is read of a robot's files as bytes, from a child process. The structured bindings name every field, so that a
// new field does not compile until it is written and read here. Of a robot's body, these are the fields that import
// sets.
#include "scenes/robot/robot_payload.h"

#include "scenes/import/import_payload.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/sandbox/payload.h"

#include <algorithm>
#include <cmath>

namespace cab::scenes {
namespace {

// Numbers of a fixed count.
template <class Array>
void write_each(PayloadWriter& writer, const Array& values) {
  for (const auto value : values) writer.value(value);
}

template <class Number>
void read_finite(PayloadReader& reader, Number& value) {
  value = reader.value<Number>();
  require_payload(std::isfinite(value), "a number is not finite");
}

template <class Array>
void read_each(PayloadReader& reader, Array& values) {
  for (auto& value : values) read_finite(reader, value);
}

// An enumerator from 0 to `last`.
template <class Enum>
Enum read_enum(PayloadReader& reader, Enum last) {
  const auto value = reader.value<std::underlying_type_t<Enum>>();
  require_payload(value <= static_cast<std::underlying_type_t<Enum>>(last), "an enumerator is not one of its type");
  return static_cast<Enum>(value);
}

void write_pairs(PayloadWriter& writer, const std::vector<LinkPair>& pairs) {
  std::vector<std::uint32_t> links;
  for (const auto& [a, b] : pairs) links.insert(links.end(), {a, b});
  writer.array(links);
}

std::vector<LinkPair> read_pairs(PayloadReader& reader, std::size_t link_count) {
  const std::vector<std::uint32_t> links = reader.array<std::uint32_t>();
  require_payload(links.size() % 2 == 0, "half a pair of links");
  std::vector<LinkPair> pairs;
  for (std::size_t p = 0; p < links.size(); p += 2) {
    require_payload(links[p] < link_count && links[p + 1] < link_count, "a pair of links that the robot lacks");
    pairs.push_back({links[p], links[p + 1]});
  }
  return pairs;
}

void write_leaf(PayloadWriter& writer, const BodyLeaf& leaf) {
  const auto& [link, box, parts, not_set] = leaf;
  writer.value(link);
  write_each(writer, box.center);
  for (const auto& axis : box.axis) write_each(writer, axis);
  write_each(writer, box.half);
  writer.value(std::uint64_t{parts.size()});
  for (const auto& [shape, vertices] : parts) {
    const auto& [kind, position, rotation, size, set_later] = shape;
    writer.value(kind);
    write_each(writer, position);
    write_each(writer, rotation);
    write_each(writer, size);
    writer.array(vertices);
  }
}

void read_leaf(PayloadReader& reader, BodyLeaf& leaf) {
  auto& [link, box, parts, not_set] = leaf;
  link = reader.value<std::uint32_t>();
  read_each(reader, box.center);
  for (auto& axis : box.axis) read_each(reader, axis);
  read_each(reader, box.half);
  constexpr std::size_t kLeastPartBytes = sizeof(ShapeKind) + 10 * sizeof(float) + sizeof(std::uint64_t);
  parts.resize(reader.count(kLeastPartBytes));
  for (auto& [shape, vertices] : parts) {
    auto& [kind, position, rotation, size, set_later] = shape;
    kind = read_enum(reader, ShapeKind::kHalfSpace);
    read_each(reader, position);
    read_each(reader, rotation);
    read_each(reader, size);
    vertices = reader.array<float>();
  }
}

void check_robot(const Robot& robot) {
  const std::size_t links = robot.links.size(), joints = robot.joints.size(), variables = robot.variables.size();
  const Character& body = robot.body;
  require_payload(links > 0 && body.link_names.size() == links && body.link_parents.size() == links,
                  "the arrays of links differ in size");
  for (std::size_t l = 0; l < links; ++l) {
    const auto most = static_cast<std::int64_t>(l) - 1;
    require_payload(body.link_parents[l] >= (l == 0 ? -1 : 0) && body.link_parents[l] <= most,
                    "a link comes before its parent");
    const RobotLink& link = robot.links[l];
    require_payload(link.first_joint <= joints && link.joint_count <= joints - link.first_joint,
                    "a link has no such joints");
  }
  for (const RobotJoint& joint : robot.joints) {
    const std::size_t used = joint.kind == JointKind::kBall ? 3 : 1;
    require_payload(joint.variable < variables && used <= variables - joint.variable, "a joint has no such variables");
  }
  require_payload(!body.leaves.empty() && robot.leaf_sources.size() == body.leaves.size(),
                  "the arrays of shapes differ in size");
  for (const BodyLeaf& leaf : body.leaves) require_payload(leaf.link < links, "a shape of a link that the robot lacks");
}

}  // namespace

std::string robot_payload(const Robot& robot) {
  const auto& [body, links, joints, variables, leaf_sources, left_out, notes, mujoco] = robot;
  PayloadWriter writer;
  writer.text(body.name);
  writer.texts(body.link_names);
  writer.array(body.link_parents);
  writer.value(std::uint64_t{body.leaves.size()});
  for (const BodyLeaf& leaf : body.leaves) write_leaf(writer, leaf);
  writer.value(std::uint64_t{links.size()});
  for (const auto& [place, first_joint, joint_count, floats, welded] : links) {
    write_each(writer, place.rotation);
    write_each(writer, place.translation);
    writer.value(first_joint);
    writer.value(joint_count);
    writer.value(floats);
    writer.value(welded);
  }
  write_pairs(writer, body.ignored_pairs);
  writer.value(std::uint64_t{joints.size()});
  for (const auto& [name, kind, axis, anchor, variable, multiplier, offset] : joints) {
    writer.text(name);
    writer.value(kind);
    write_each(writer, axis);
    write_each(writer, anchor);
    writer.value(variable);
    writer.value(multiplier);
    writer.value(offset);
  }
  writer.value(std::uint64_t{variables.size()});
  for (const auto& [name, lower, upper, rest] : variables) {
    writer.text(name);
    writer.value(lower);
    writer.value(upper);
    writer.value(rest);
  }
  writer.texts(leaf_sources);
  const auto& [lost_shapes, held_joints, guesses] = left_out;
  for (const std::uint32_t count : {lost_shapes, held_joints, guesses}) writer.value(count);
  writer.texts(notes);
  writer.value(static_cast<std::uint8_t>(mujoco.has_value()));
  if (mujoco) {
    const auto& [welded, adjacent, listed] = *mujoco;
    for (const auto* pairs : {&welded, &adjacent, &listed}) write_pairs(writer, *pairs);
  }
  return writer.take();
}

Robot read_robot_payload(const std::string& bytes) {
  PayloadReader reader(bytes);
  Robot robot;
  auto& [body, links, joints, variables, leaf_sources, left_out, notes, mujoco] = robot;
  body.name = printable(reader.text());
  body.link_names = printable_texts(reader);
  body.link_parents = reader.array<std::int32_t>();
  constexpr std::size_t kLeastLeafBytes = sizeof(std::uint32_t) + sizeof(Box) + sizeof(std::uint64_t);
  body.leaves.resize(reader.count(kLeastLeafBytes));
  for (BodyLeaf& leaf : body.leaves) read_leaf(reader, leaf);
  constexpr std::size_t kLinkBytes = 7 * sizeof(double) + 2 * sizeof(std::uint32_t) + 2;
  links.resize(reader.count(kLinkBytes));
  for (auto& [place, first_joint, joint_count, floats, welded] : links) {
    read_each(reader, place.rotation);
    read_each(reader, place.translation);
    first_joint = reader.value<std::uint32_t>();
    joint_count = reader.value<std::uint32_t>();
    floats = reader.value<std::uint8_t>() != 0;
    welded = reader.value<std::uint8_t>() != 0;
  }
  body.ignored_pairs = read_pairs(reader, links.size());
  constexpr std::size_t kLeastJointBytes = sizeof(std::uint64_t) + 1 + 8 * sizeof(double) + sizeof(std::uint32_t);
  joints.resize(reader.count(kLeastJointBytes));
  for (auto& [name, kind, axis, anchor, variable, multiplier, offset] : joints) {
    name = printable(reader.text());
    kind = read_enum(reader, JointKind::kBall);
    read_each(reader, axis);
    read_each(reader, anchor);
    variable = reader.value<std::uint32_t>();
    read_finite(reader, multiplier);
    read_finite(reader, offset);
  }
  constexpr std::size_t kLeastVariableBytes = sizeof(std::uint64_t) + 3 * sizeof(double);
  variables.resize(reader.count(kLeastVariableBytes));
  for (auto& [name, lower, upper, rest] : variables) {
    name = printable(reader.text());
    for (double* const value : {&lower, &upper, &rest}) read_finite(reader, *value);
  }
  leaf_sources = printable_texts(reader);
  auto& [lost_shapes, held_joints, guesses] = left_out;
  for (std::uint32_t* const count : {&lost_shapes, &held_joints, &guesses}) *count = reader.value<std::uint32_t>();
  notes = printable_texts(reader);
  if (reader.value<std::uint8_t>() != 0) {
    auto& [welded, adjacent, listed] = mujoco.emplace();
    for (auto* pairs : {&welded, &adjacent, &listed}) *pairs = read_pairs(reader, links.size());
  }
  reader.finish();
  check_robot(robot);
  return robot;
}

std::string triangles_payload(const LeafTriangles& triangles) {
  PayloadWriter writer;
  writer.value(std::uint64_t{triangles.size()});
  for (const std::vector<float>& leaf : triangles) writer.array(leaf);
  return writer.take();
}

LeafTriangles read_triangles_payload(const std::string& bytes) {
  PayloadReader reader(bytes);
  LeafTriangles triangles(reader.count(sizeof(std::uint64_t)));
  for (std::vector<float>& leaf : triangles) {
    leaf = reader.array<float>();
    require_payload(leaf.size() % 9 == 0, "a part of a triangle");
    for (const float x : leaf) require_payload(std::isfinite(x), "a number is not finite");
  }
  reader.finish();
  return triangles;
}

std::string disabled_pairs_payload(const DisabledPairs& disabled) {
  const auto& [pairs, notes] = disabled;
  PayloadWriter writer;
  write_pairs(writer, pairs);
  writer.texts(notes);
  return writer.take();
}

DisabledPairs read_disabled_pairs_payload(const std::string& bytes, const Robot& robot) {
  PayloadReader reader(bytes);
  DisabledPairs disabled;
  auto& [pairs, notes] = disabled;
  pairs = read_pairs(reader, robot.links.size());
  notes = printable_texts(reader);
  reader.finish();
  return disabled;
}

std::string joint_states_payload(const JointStates& states) {
  const auto& [values, count, notes] = states;
  PayloadWriter writer;
  writer.array(values);
  writer.value(std::uint64_t{count});
  writer.texts(notes);
  return writer.take();
}

JointStates read_joint_states_payload(const std::string& bytes, const Robot& robot) {
  PayloadReader reader(bytes);
  JointStates states;
  auto& [values, count, notes] = states;
  values = reader.array<double>();
  count = reader.value<std::uint64_t>();
  notes = printable_texts(reader);
  reader.finish();
  require_payload(count > 0 && count <= kMaxFileBytes && values.size() == count * robot.variables.size(),
                  "there is not one value for each state and variable");
  for (const double value : values) require_payload(std::isfinite(value), "a number is not finite");
  return states;
}

}  // namespace cab::scenes
