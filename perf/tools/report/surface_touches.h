// The triangles of skins that touch in the frames of a recording, and where they do.
#pragma once

#include <cab/replay.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scenes/vec3d.h"

namespace cab::perf {

// How two links touch whose leaves have triangles.
struct SurfaceTouch {
  std::uint32_t triangles = 0;  // pairs of triangles that touch
  // The mean over these pairs of the middles of the lines in which they meet; of those that lie in one plane, of their
  // corners. In the world, in the recording's unit. Not read without triangles.
  scenes::Vec3 place = {0, 0, 0};
};

// Finds these for frames with Exact::kSurface. Only corners of triangles that touch are skinned again, in double.
class SurfaceTouches {
 public:
  // The recording must stay open.
  explicit SurfaceTouches(const record::Recording& recording) : recording_(recording) {}

  // One for each hit of a frame. Empty if the frame has none, or if the engine refuses the recording: see error().
  const std::vector<SurfaceTouch>& of(const record::RecordedFrame& frame);

  // Why triangles are not known; empty if they are.
  const std::string& error() const { return error_; }

 private:
  bool has_triangles(const record::RecordedFrame& frame, BatchSlot slot, std::uint32_t link) const;

  const record::Recording& recording_;
  std::optional<record::Player> player_;
  std::string error_;
  std::vector<SurfaceTouch> touches_;
};

// Where the sides of two triangles meet, given by their corners: the middle of all points in which a side of one passes
// through the other; if there are none, the middle of the corners.
scenes::Vec3 meeting_place(const scenes::Vec3 (&a)[3], const scenes::Vec3 (&b)[3]);

}  // namespace cab::perf
