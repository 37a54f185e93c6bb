// Where a ray enters a box, in double: one box, or sixteen as lanes.
#pragma once

#include "kernels/vec3.h"
#include "layout/error_bounds.h"
#include "layout/tile.h"

#include <limits>

namespace cab::kernel {

// The part of a ray in which the sphere that is moved along it may touch a shape. Points are from + s along, relative
// to the shape's centre.
template <class D>
struct RayChord {
  Vec3<D> from, along;
  D shift;        // the ray's parameter where s is 0
  D first, last;  // the range of s
  D radius, slack;
  Vec3<D> normal;   // of the plane that `first` is on; 0 before there is one
  Mask<D> is_left;  // whether anything is
};

// Begins a chord, near a ball about the centre. to_ray: where the ray's parameter is 0, relative to the centre. begin,
// end: the range of the parameter. reach: the ball's radius.
template <class D>
CAB_INLINE void begin_chord(const Vec3<D>& to_ray, const Vec3<D>& direction, const D& begin, const D& end,
                            const D& reach, RayChord<D>& out) {
  const D zero(0.0), t = zero - dot(to_ray, direction);
  out.from = to_ray + t * direction;
  out.along = direction;
  const D near = (reach + out.radius) + out.slack, beyond = D(2.0) * near + D(8.0) * out.slack;
  out.first = max(zero - beyond, begin - t);
  out.last = min(beyond, end - t);
  out.normal = {zero, zero, zero};
  out.shift = t;
  out.is_left = without(out.last >= out.first, dot(out.from, out.from) > near * near);
}

// The planes of a box's faces: a normal of length 1 each, and how far from the centre it is, for axes that may be a
// little skew.
template <class D>
struct BoxFaces {
  Vec3<D> normal[3];
  D face[3];
};
template <class D>
CAB_INLINE void set_faces(const Vec3<D> (&axis)[3], const D (&half)[3], BoxFaces<D>& out) {
  for (int k = 0; k < 3; ++k) {
    const Vec3<D> n = cross(axis[(k + 1) % 3], axis[(k + 2) % 3]);
    out.normal[k] = divide(D(1.0), sqrt(dot(n, n))) * n;
    out.face[k] = half[k] * abs(dot(out.normal[k], axis[k]));
  }
}

// Takes away what the planes of both faces across each normal keep apart.
template <class D>
CAB_INLINE void cut_at_faces(const BoxFaces<D>& box, RayChord<D>& chord) {
  const D zero(0.0);
  for (int k = 0; k < 3; ++k) {
    const Vec3<D>& n = box.normal[k];
    const D way = dot(n, chord.from), fall = zero - dot(n, chord.along);
    const D height = box.face[k] + chord.radius + chord.slack;
    const D gap = way - height, gap_behind = (zero - way) - height;
    const Mask<D> is_front = fall > zero, is_across = abs(fall) > zero;
    const D speed = select(is_across, abs(fall), D(1.0));
    const D enter = divide(select(is_front, gap, gap_behind), speed);
    const D leave = divide(select(is_front, gap_behind, gap), zero - speed);
    const Mask<D> is_later = both(is_across, enter > chord.first);
    const D side = select(is_front, D(1.0), D(-1.0));
    chord.first = select(is_later, enter, chord.first);
    chord.normal = choose(is_later, side * n, chord.normal);
    chord.last = select(both(is_across, leave < chord.last), leave, chord.last);
    chord.is_left = without(both(chord.is_left, chord.last >= chord.first),
                            without(either(gap > zero, gap_behind > zero), is_across));
  }
}

// Sixteen rays, a posed leaf box for each. The parameter of a ray is its length from where it begins.
struct CastTile {
  alignas(64) double apart[3][kLanes];  // the instance's origin less where the ray begins
  alignas(64) double along[3][kLanes], length[kLanes];
  alignas(64) float center[3][kLanes], axis[3][3][kLanes], half[3][kLanes];

  // Receive what a hit has: the length at which the ray enters, where that is, and the normal there; and which rays
  // meet their boxes, and which begin inside.
  alignas(64) float distance[kLanes], point[3][kLanes], normal[3][kLanes];
  std::uint32_t meets, inside;
};

template <class V>
void cast_boxes(CastTile& tile) {
  using D = DoubleOf<V>;
  using L = Lanes<D>;
  const D zero(0.0);
  const auto load = [](const auto(&from)[3][kLanes], std::uint32_t lane) {
    return Vec3<D>{L::load(from[0] + lane), L::load(from[1] + lane), L::load(from[2] + lane)};
  };
  tile.meets = tile.inside = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<D>) {
    const Vec3<D> to = load(tile.apart, lane), direction = load(tile.along, lane), center = load(tile.center, lane);
    const Vec3<D> axis[3] = {load(tile.axis[0], lane), load(tile.axis[1], lane), load(tile.axis[2], lane)};
    const D half[3] = {L::load(tile.half[0] + lane), L::load(tile.half[1] + lane), L::load(tile.half[2] + lane)};
    const D length = L::load(tile.length + lane);
    const D nearest = min(length, max(zero, dot(to, direction)));
    const Vec3<D> at = nearest * direction - to, to_ray = at - center;
    const D error = D(kQueryRounding) * (sum(abs(to)) + nearest);
    const D begin = zero - nearest, end = length - nearest;
    const D reach = D(kBoxReach) * (half[0] + half[1] + half[2]);
    RayChord<D> chord;
    BoxFaces<D> faces;
    chord.radius = zero;
    chord.slack = D(kConvexSlackDouble) * reach + D(kConvexPoseSlackDouble) * sum(abs(to_ray)) + error;
    set_faces(axis, half, faces);
    begin_chord(to_ray, direction, begin, end, reach, chord);
    cut_at_faces(faces, chord);
    const Mask<D> inside = chord.first <= begin - chord.shift;
    const D touch = min(end, max(begin, chord.shift + chord.first));
    // Without a plane all lengths are 0, and the ray passes through the box, which is a point.
    const Vec3<D> back = divide(D(-1.0), sqrt(dot(direction, direction))) * direction;
    const Vec3<D> normal = choose(dot(chord.normal, chord.normal) > zero, chord.normal, back);
    const Vec3<D> first = chord.from + chord.first * chord.along;
    const Vec3<D> point = (center + (first - chord.radius * normal)) + to, none = {zero, zero, zero};
    const auto store = [lane](const Vec3<D>& v, float(&out)[3][kLanes]) {
      L::store(out[0] + lane, v.x);
      L::store(out[1] + lane, v.y);
      L::store(out[2] + lane, v.z);
    };
    L::store(tile.distance + lane, max(zero, nearest + select(inside, begin, touch)));
    store(choose(inside, none, point), tile.point);
    store(choose(inside, none, normal), tile.normal);
    tile.meets |= bits(chord.is_left) << lane;
    tile.inside |= bits(inside) << lane;
  }
}

}  // namespace cab::kernel
