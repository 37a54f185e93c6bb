// The CAB merge (paper, section 3.2): the axes of a parent box from the major axes of two jointed children.
#pragma once

#include "kernels/enclose.h"

namespace cab::kernel {

// A child's major axis, which points away from the joint, and the half extents by which the merge decides.
template <class V>
struct MajorAxis {
  Vec3<V> unit;  // u_i
  V longest;     // the largest half extent, l_i
  V second;      // the second largest half extent
  V least;       // the smallest half extent
};

// The major axis of a child. outward: from the joint to the child's centre. If the axis is normal to it, the axis keeps
// its stored sign.
template <class V>
CAB_INLINE MajorAxis<V> major_axis(const BoxLanes<V>& box, Vec3<V> outward) {
  const Vec3<V> h = box.half;
  const Mask<V> first = both(h.x >= h.y, h.x >= h.z);
  const Vec3<V> axis = choose<V>(first, box.axis[0], choose<V>(h.y >= h.z, box.axis[1], box.axis[2]));
  const V sign = select(dot(axis, outward) < V(0.0f), V(-1.0f), V(1.0f));
  return {sign * axis, max_component(h), max(min(h.x, h.y), min(max(h.x, h.y), h.z)), min(min(h.x, h.y), h.z)};
}

// Lanes in which the merge, if it copies a child's axes, copies those of the second child. It copies the child with the
// larger second half extent. If these are equal, it copies the child with the larger longest half extent, else the
// first.
template <class V>
CAB_INLINE Mask<V> copies_second(const MajorAxis<V>& major_1, const MajorAxis<V>& major_2) {
  return either(major_2.second > major_1.second,
                both(major_2.second >= major_1.second, major_2.longest > major_1.longest));
}

// Lanes in which the directions of both children matter. A child's direction does not matter if its longest half extent
// is at most the other child's smallest. Without this rule a star of links would grow at every merge.
template <class V>
CAB_INLINE Mask<V> both_matter(const MajorAxis<V>& major_1, const MajorAxis<V>& major_2) {
  return both(major_1.longest > major_2.least, major_2.longest > major_1.least);
}

// Axes A1, A2, A3 of the parent (Eqs. 1-3). If the children's major axes are parallel, or the direction of a child does
// not matter, the axes are copied from one child.
//
// UseSum selects the footnote's variant: if E is the shortest of a_1, a_2 and E, the main axis is a_1 + a_2.
template <class V, bool UseSum>
CAB_INLINE void cab_axes(const BoxLanes<V>& first, const BoxLanes<V>& second, Vec3<V> outward_1, Vec3<V> outward_2,
                         Vec3<V> (&axes)[3]) {
  const MajorAxis<V> major_1 = major_axis(first, outward_1);
  const MajorAxis<V> major_2 = major_axis(second, outward_2);

  // a_i, scaled by the larger length so that nothing under- or overflows. E = a_1 - a_2.
  const V scale = divide(V(1.0f), max(major_1.longest, major_2.longest));
  const Vec3<V> a1 = (major_1.longest * scale) * major_1.unit;
  const Vec3<V> a2 = (major_2.longest * scale) * major_2.unit;
  const Vec3<V> e = a1 - a2;
  const V a1_sq = dot(a1, a1), a2_sq = dot(a2, a2), e_sq = dot(e, e);
  Vec3<V> m = choose<V>(both(e_sq >= a1_sq, e_sq >= a2_sq), e, choose<V>(a1_sq >= a2_sq, a1, a2));
  if (UseSum) m = choose<V>(both(e_sq < a1_sq, e_sq < a2_sq), a1 + a2, m);
  const Vec3<V> normal = cross(major_1.unit, major_2.unit);

  const V limit = V(kParallel) * (dot(major_1.unit, major_1.unit) * dot(major_2.unit, major_2.unit));
  const Mask<V> not_parallel = both(dot(normal, normal) > limit, both_matter(major_1, major_2));
  const Mask<V> copy_2 = copies_second(major_1, major_2);
  const Vec3<V> main = choose<V>(not_parallel, m, choose<V>(copy_2, second.axis[0], first.axis[0]));
  const Vec3<V> minor = choose<V>(not_parallel, normal, choose<V>(copy_2, second.axis[1], first.axis[1]));

  // Gram-Schmidt with the unnormalised main axis, so that neither square root waits for the other.
  const V main_sq = dot(main, main);
  axes[0] = divide(V(1.0f), sqrt(main_sq)) * main;
  axes[1] = normalized(minor - divide(dot(minor, main), main_sq) * main);
  axes[2] = cross(axes[0], axes[1]);
}

// Axes of the parent of two children. joint: the point where they meet, in the frame of their centres. It is null if
// they share no joint. Then each child's major axis points away from the other child's centre.
template <class V, bool UseSum>
CAB_INLINE void cab_axes(const BoxLanes<V>& first, const BoxLanes<V>& second, const Vec3<V>* joint,
                         Vec3<V> (&axes)[3]) {
  const Vec3<V> outward_1 = first.center - (joint ? *joint : second.center);
  const Vec3<V> outward_2 = second.center - (joint ? *joint : first.center);
  cab_axes<V, UseSum>(first, second, outward_1, outward_2, axes);
}

}  // namespace cab::kernel
