// The plain data of debug aids: the edges of boxes for a debug draw. The calls are in cab/cab.h. The conventions of
// cab/types.h hold here too.
#pragma once

#include <cab/types.h>

namespace cab {

// The value of BoxLinesJob::level for the leaves of all instances.
inline constexpr std::uint32_t kLeafLevel = 0xffffffff;

// The value of BoxLine::link for a box that is not on one link alone.
inline constexpr std::uint16_t kNoLink = 0xffff;

// An edge of a box or of a shape, or a contact.
struct BoxLine {
  float from[3];           // x y z of one end, relative to BoxLinesJob::origin, in the world's axes
  float to[3];             // x y z of the other end, likewise
  std::uint32_t instance;  // index of the instance that the box is of
  std::uint16_t node;      // index of the box in the hierarchy, as in compute_boxes; a leaf's for its shapes
  std::uint16_t link;      // index of the link that a leaf is on, or kNoLink for an inner box
  bool is_hit;             // whether a link that the box stands for is in one of BoxLinesJob::hits
};

// What box_lines draws. If `lines` is too small, box_lines answers kLinesOverflow. Then lines_needed is right,
// line_count is 0, and the contents of lines are unspecified.
struct BoxLinesJob {
  // How boxes are made: `refit` and `extents`. Default: the preset `balanced`.
  Policies policies;

  // Which boxes of an instance are drawn: those that are `level` merges below the root, and leaves that are fewer
  // merges below it. 0 is the root. kLeafLevel (default): the leaves.
  std::uint32_t level = kLeafLevel;

  // Whether leaves are drawn as their exact shapes: edges of boxes and hulls, circles of sixteen lines of what is
  // round. Half spaces, hulls of more than 256 vertices and leaves with triangles stay boxes. Default: all are boxes.
  bool shapes = false;

  // Hits of a frame with the same input, in any order. Empty (default): no box is hit.
  Span<const Hit> hits;

  // The contacts of these hits, one each. For a hit whose instance a is one of `input` a line goes from point_a to
  // point_b, with its link and leaf of a. Empty (default): no contact is drawn.
  Span<const Contact> contacts;

  // x y z in the world that lines are relative to, such as a camera's position. Must be finite. Default: 0.
  double origin[3] = {0, 0, 0};

  // Output: room for the lines, twelve per box. The boxes are in the order of instances, then of nodes; contacts come
  // last. Of each box four lines go along each of its axes, first the axis 0. Masked instances have no lines. Empty
  // (default): room for no line.
  Span<BoxLine> lines;

  // Output: how many lines were written.
  std::size_t line_count = 0;

  // Output: how many lines there are, whether `lines` has room for them or not.
  std::size_t lines_needed = 0;
};

}  // namespace cab
