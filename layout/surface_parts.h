// The connected parts of a skin, and which of them are closed: those have an inside.
#pragma once

#include <cab/types.h>

namespace cab {

// Of a triangle that is in no closed part.
inline constexpr std::uint32_t kNoPart = 0xffffffff;

// Triangles that are connected by vertices that they have in common, in all leaves.
struct SurfacePart {
  std::uint32_t middle;                  // the vertex that is nearest to the middle of the part's bounds in the skin
  std::uint32_t ends[6];                 // the vertices that are farthest along x, y and z in the skin, to both sides
  std::uint32_t leaf;                    // the first that has `middle`, by its link, then by its index
  std::uint32_t link_begin, link_count;  // of SurfaceParts::links: those whose leaves have triangles of the part
  bool turns_one_way;                    // a closed part: each edge has as many triangles on one side as on the other
};

// A ball about vertices that one link moves, about a point in the frame of that link.
struct LinkBall {
  std::uint32_t link;
  float center[3];
  float reach;
};

// A leaf that has triangles of closed parts: balls about their vertices, one for each link that moves some of them.
struct ClosedLeaf {
  std::uint32_t leaf;
  std::uint32_t ball_begin, ball_count;  // of SurfaceParts::balls
};

// What an articulation has of its parts, or nothing without triangles.
struct SurfaceParts {
  Span<const SurfacePart> parts;          // ascending by their first vertices
  Span<const std::uint16_t> links;        // of each part ascending; then those that all closed parts have, ascending
  Span<const std::uint32_t> closed_part;  // by patch kLanes of them, by lane: the part of the triangle, or kNoPart
  Span<const ClosedLeaf> leaves;          // none if no part is closed
  Span<const LinkBall> balls;             // of leaves
  Span<const LinkBall> all;               // about the vertices of all closed parts
};

}  // namespace cab
