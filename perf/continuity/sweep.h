// How far boxes jump if a pose moves a little. Each figure has one pose parameter, which is swept through the values at
// which a refit has to choose its axes. The motion of the inner boxes is measured there.
#pragma once

#include <cab/cab.h>

#include <cstdint>
#include <string>
#include <vector>

namespace cab::perf {

// A link with at most one leaf box (half extents 0: no box). The origin of its frame is at `offset` in the parent's
// frame, or in the instance's for link 0. The frame is rotated about `axis` by `rest` degrees, and by `sway` degrees
// more per degree of the parameter.
struct SweepLink {
  std::int32_t parent;
  double offset[3];
  double axis[3];  // of unit length
  double rest;
  double sway;
  float center[3];
  float half[3];
};

// A figure and the range of its parameter, in degrees.
struct SweepCase {
  std::string name;
  std::string meaning;
  std::vector<SweepLink> links;
  double first, last;
};

// The figures that are measured, in the order of the table.
std::vector<SweepCase> sweep_cases();

// What the inner boxes of one figure did under one policy. Distances of boxes are Hausdorff distances, sizes are
// diagonals, and the motion of a step is the largest distance that any corner of any leaf box moves in it.
struct Continuity {
  double jump = 0;                // largest distance of a box from itself one step before, as a share of its size
  double jump_motion = 0;         // the motion in that step, as a share of the same size
  double closer_jump = 0;         // the same after that step has been halved kHalvings times, the half with the larger
  double closer_motion = 0;       // jump each time: a jump that stays while the motion shrinks is a discontinuity
  double ratio = 0;               // largest distance in a step over the motion in it: the observed Lipschitz constant
  double volume_change = 0;       // largest change of a box's volume in a step, as a share of the larger volume
  double area_change = 0;         // the same for a box's surface
  std::uint32_t steps_above = 0;  // steps in which a box moved by more than kJump of its size
};
inline constexpr int kHalvings = 5;
inline constexpr double kJump = 0.01;

// Hausdorff distance of two boxes taken as sets: the largest distance of a corner of one to the other.
double box_change(const Box& a, const Box& b);

// Sweeps a figure in equal steps through its range by each of the policies. Throws std::runtime_error with the engine's
// reason.
std::vector<Continuity> measure_continuity(const SweepCase& figure, const std::vector<Policies>& policies,
                                           std::uint32_t step_count, Isa isa);

}  // namespace cab::perf
