// Measures the segments of a skeleton over all poses.
#include "scenes/rig/skeleton_segments.h"

#include "scenes/rig/body_parts.h"

#include <algorithm>
#include <cmath>

namespace cab::scenes {
namespace {

// Share of the figure's height. Segments no longer than this count as zero. It is below 1 / kMaxLinks, so that a rope
// of equal links keeps its links.
constexpr double kZeroSegment = 1e-4;
// Share of the figure's height. A joint that stays this close to its rest offset has that offset.
constexpr double kRestTolerance = 1e-5;
// Shares of the figure's height. A segment is no bone if its far end moves farther than the first in the joint's frame,
// or farther than the second below a root that stands still.
constexpr double kTravel = .03;
constexpr double kTravelBelowStillRoot = 1e-3;

// The median over all frames of the extent along each axis of the joints that count.
std::array<double, 3> median_extents(const SkeletonView& s, const std::vector<bool>& counts) {
  std::array<double, 3> medians = {};
  std::vector<double> extents(s.frame_count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t f = 0; f < s.frame_count; ++f) {
      bool any = false;
      double low = 0, high = 0;
      for (std::size_t j = 0; j < counts.size(); ++j) {
        if (!counts[j]) continue;
        const double value = position(s, f, j)[axis];
        low = any ? std::min(low, value) : value;
        high = any ? std::max(high, value) : value;
        any = true;
      }
      extents[f] = high - low;
    }
    const auto middle = extents.begin() + static_cast<std::ptrdiff_t>(s.frame_count / 2);
    std::nth_element(extents.begin(), middle, extents.end());
    medians[axis] = *middle;
  }
  return medians;
}

// The offset of each joint, and how far the joint strays from it.
void measure_offsets(const SkeletonView& s, double height, Segments& out) {
  const std::size_t count = s.parents.size();
  out.offset.assign(count, Vec3{0, 0, 0});
  out.strays.assign(count, 0);
  for (std::size_t j = 1; j < count; ++j) {
    const Vec3 rest = {s.rest_offsets[3 * j], s.rest_offsets[3 * j + 1], s.rest_offsets[3 * j + 2]};
    Vec3 mean = {0, 0, 0};
    double from_rest = 0;
    for (std::size_t f = 0; f < s.frame_count; ++f) {
      const Vec3 place = local_offset(s, f, j);
      mean = mean + place;
      from_rest = std::max(from_rest, length(place - rest));
    }
    out.offset[j] = rest;
    if (from_rest <= kRestTolerance * height) continue;
    out.offset[j] = (1.0 / s.frame_count) * mean;
    for (std::size_t f = 0; f < s.frame_count; ++f)
      out.strays[j] = std::max(out.strays[j], length(local_offset(s, f, j) - out.offset[j]));
  }
}

// True if joint 0 has one place and one rotation in all frames, of which there are several.
bool root_stands_still(const SkeletonView& s, double height) {
  for (std::size_t f = 1; f < s.frame_count; ++f) {
    if (length(position(s, f, 0) - position(s, 0, 0)) > kRestTolerance * height) return false;
    const Quat a = rotation(s, 0, 0), b = rotation(s, f, 0);
    const double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    if (std::fabs(cosine) < 1 - kRestTolerance) return false;
  }
  return s.frame_count > 1;
}

void judge_segments(const SkeletonView& s, double height, Segments& out) {
  const std::size_t count = s.parents.size();
  const bool still_root = root_stands_still(s, height);
  const auto is_zero = [&](std::size_t j) { return length(out.offset[j]) <= kZeroSegment * height; };
  std::vector<bool> leads_on(count, false), below_bone(count, false);
  for (std::size_t j = count; j-- > 1;)
    if (leads_on[j] || !is_zero(j)) leads_on[parent_of(s, j)] = true;
  out.kind.assign(count, SegmentKind::kBone);
  out.kind[0] = SegmentKind::kOtherRoot;
  for (std::size_t j = 1; j < count; ++j) {
    const std::size_t parent = parent_of(s, j);
    const double limit = parent == 0 && still_root ? kTravelBelowStillRoot : kTravel;
    if (s.parents[j] < 0)
      out.kind[j] = SegmentKind::kOtherRoot;
    else if (out.strays[j] > limit * height)
      out.kind[j] = SegmentKind::kTravels;
    else if (is_zero(j))
      out.kind[j] = SegmentKind::kZero;
    else if (!below_bone[parent] &&
             is_outside_body({s.names[parent], s.names[j], length(out.offset[j]) / height, leads_on[j]}))
      out.kind[j] = SegmentKind::kOutside;
    below_bone[j] = below_bone[parent] || out.kind[j] == SegmentKind::kBone;
  }
}

// The joints of the figure: all but those that only carry it, which have segments that are no bones below them, and no
// bone of their own.
std::vector<bool> figure_joints(const SkeletonView& s, const Segments& segments) {
  const std::size_t count = s.parents.size();
  std::vector<bool> carries(count, false), has_bone(count, false), counts(count);
  for (std::size_t j = count; j-- > 1;) {
    const std::size_t parent = parent_of(s, j);
    const SegmentKind kind = segments.kind[j];
    if (kind == SegmentKind::kBone) has_bone[parent] = true;
    if (carries[j] || (kind != SegmentKind::kBone && kind != SegmentKind::kZero)) carries[parent] = true;
    if (kind == SegmentKind::kZero && has_bone[j]) has_bone[parent] = true;
  }
  for (std::size_t j = 0; j < count; ++j) counts[j] = !carries[j] || has_bone[j];
  return counts;
}

}  // namespace

Vec3 position(const SkeletonView& s, std::size_t frame, std::size_t joint) {
  const double* const p = s.positions.data() + 3 * (frame * s.parents.size() + joint);
  return {p[0], p[1], p[2]};
}

Quat rotation(const SkeletonView& s, std::size_t frame, std::size_t joint) {
  const double* const q = s.rotations.data() + 4 * (frame * s.parents.size() + joint);
  return {q[0], q[1], q[2], q[3]};
}

std::size_t parent_of(const SkeletonView& s, std::size_t joint) {
  return s.parents[joint] < 0 ? 0 : static_cast<std::size_t>(s.parents[joint]);
}

Vec3 local_offset(const SkeletonView& s, std::size_t frame, std::size_t joint) {
  const std::size_t parent = parent_of(s, joint);
  return rotate(conjugate(rotation(s, frame, parent)), position(s, frame, joint) - position(s, frame, parent));
}

Segments measure_segments(const SkeletonView& skeleton) {
  const std::size_t count = skeleton.parents.size();
  const auto measure = [&](Segments& out, const std::vector<bool>& counts) {
    out.extents = median_extents(skeleton, counts);
    out.height = *std::max_element(out.extents.begin(), out.extents.end());
  };
  Segments out;
  measure(out, std::vector<bool>(count, true));
  measure_offsets(skeleton, out.height, out);
  judge_segments(skeleton, out.height, out);
  // Once more without joints that stand far from the figure.
  measure(out, figure_joints(skeleton, out));
  judge_segments(skeleton, out.height, out);
  out.point.resize(count);
  for (std::size_t j = 0; j < count; ++j)
    out.point[j] = out.kind[j] == SegmentKind::kZero ? out.point[parent_of(skeleton, j)] : j;
  return out;
}

}  // namespace cab::scenes
