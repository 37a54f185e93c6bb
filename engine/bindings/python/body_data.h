// The description of an articulation with the arrays that it points to, for as many worlds as one likes.
#pragma once

#include <pybind11/pybind11.h>

#include <cab/types.h>

#include <cstdint>
#include <vector>

namespace cab::python {

// A copy of a description and all that it points to.
class BodyData {
 public:
  // Copies everything. The spans of `desc` must have data for what they say.
  explicit BodyData(const ArticulationDesc& desc);

  BodyData(const BodyData&) = delete;
  BodyData& operator=(const BodyData&) = delete;

  const ArticulationDesc& desc() const { return desc_; }

 private:
  ArticulationDesc desc_;
  std::vector<std::int32_t> parents_;
  std::vector<float> joints_;
  std::vector<Leaf> leaves_;
  std::vector<ConvexPart> parts_;
  std::vector<float> vertices_;
  std::vector<LinkPair> ignored_;
  // Of a skin, and its triangles leaf by leaf.
  std::vector<std::uint32_t> triangles_, skin_links_;
  std::vector<float> skin_vertices_, skin_weights_, skin_binds_;
  std::vector<float> rest_pose_;
};

// Convex parts of leaves, as tuples of Python hand them over: (leaf, kind, position, rotation, size, vertices).
class PartList {
 public:
  PartList(const pybind11::sequence& parts, std::size_t leaf_count);
  PartList(const PartList&) = delete;
  PartList& operator=(const PartList&) = delete;

  Span<const ConvexPart> of_leaf(std::size_t leaf) const { return parts_[leaf]; }

 private:
  std::vector<std::vector<ConvexPart>> parts_;
};

// Adds the calls that read files, or nothing where the module is built without them.
void bind_files(pybind11::module_& module);

// Adds the class that tests states of robots. Called by bind_files.
void bind_checker(pybind11::module_& module);

// Adds the class BodyData, and the calls that make one of arrays, to the module.
void bind_body_data(pybind11::module_& module);

}  // namespace cab::python
