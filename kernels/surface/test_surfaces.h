// The triangles of two leaves against each other.
#pragma once

#include "kernels/surface/near_triangles.h"
#include "kernels/surface/test_triangles.h"

namespace cab::kernel {

// The vertices and bounds of a leaf, as SkinnedLeaf has them.
struct PlacedSurface {
  PlacedSurface(const SkinnedLeaf& leaf) : vertices(leaf.vertices), bounds(leaf.bounds) {}
  PlacedSurface(const float* its_vertices, const AabbTile* its_bounds) : vertices(its_vertices), bounds(its_bounds) {}

  const float* vertices;
  const AabbTile* bounds;
};

// Of two leaves that one link each moves, and that are given in the frames of these links.
struct RigidSurfaces {
  float place[2][kBoneFloats];  // takes vertices of a, and of b, where place_bone does
  float turn[2][kBoneFloats];   // takes points of b's frame to a's, and of a's frame to b's
  float reach[2];               // the margin and all rounding, in the frame of a and of b
};

// Two leaves, both skinned or both rigid.
struct SurfacePair {
  PlacedSurface a, b;
  const TrianglePatch *patches_a, *patches_b;
  std::uint32_t patch_count_a, patch_count_b;
  float shift[3];  // the origin of b less that of a
  float error;     // how far a coordinate of a vertex of b less one of a may be from the truth
  float margin;
  float reach;                           // margin + error, rounded up; not read of rigid ones
  const RigidSurfaces* rigid = nullptr;  // null: both are skinned
};

// Up to sixteen pairs of triangles, each named by kLanes times its patch, and its lane. With masks of those that touch,
// and of those that are undecided.
struct TrianglePairs {
  std::uint32_t a[kLanes], b[kLanes];
  std::uint32_t count = 0;
  std::uint32_t touching = 0, undecided = 0;
};

// Takes pairs of triangles that touch or are undecided. Returns whether to go on.
using TakeTriangles = bool (*)(void* taker, const TrianglePairs& pairs);

// Pairs of triangles whose bounds overlap, until sixteen of them are tested.
template <class V>
class TriangleQueue {
 public:
  CAB_INLINE TriangleQueue(const SurfacePair& job, void* taker, TakeTriangles take)
      : job_(job), taker_(taker), take_(take) {}

  // Returns false once the taker wants no more.
  CAB_INLINE bool add(std::uint32_t a, std::uint32_t b) {
    pairs_.a[pairs_.count] = a;
    pairs_.b[pairs_.count] = b;
    return ++pairs_.count < kLanes || test();
  }

  // Tests the pairs that wait. Not inlined: it is called where pairs are added and at the end.
  bool test();

  CAB_INLINE bool empty() const { return pairs_.count == 0; }

 private:
  const SurfacePair& job_;
  void* taker_;
  TakeTriangles take_;
  TrianglePairs pairs_;
};

// The corners of the triangles of one side of the pairs. Unused lanes repeat the first.
template <class V>
CAB_INLINE void corners_of(const TrianglePairs& pairs, const std::uint32_t (&triangles)[kLanes],
                           const TrianglePatch* patches, const float* vertices, CornerTile& out) {
  const float* corners[3][kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t triangle = triangles[lane < pairs.count ? lane : 0];
    const TrianglePatch& patch = patches[triangle / kLanes];
    for (std::uint32_t i = 0; i < 3; ++i)
      corners[i][lane] = vertices + std::size_t{4} * patch.corner[i][triangle % kLanes];
  }
  load_corners<V>(corners, out);
}

template <class V>
CAB_INLINE TriangleLanes<V> triangle_lanes(const CornerTile& tile, std::uint32_t lane) {
  TriangleLanes<V> out;
  for (std::uint32_t i = 0; i < 3; ++i)
    out.corner[i] = {Lanes<V>::load(tile.at[i][0] + lane), Lanes<V>::load(tile.at[i][1] + lane),
                     Lanes<V>::load(tile.at[i][2] + lane)};
  return out;
}

template <class V>
CAB_NOINLINE bool TriangleQueue<V>::test() {
  CornerTile tile_a, tile_b;
  corners_of<V>(pairs_, pairs_.a, job_.patches_a, job_.a.vertices, tile_a);
  corners_of<V>(pairs_, pairs_.b, job_.patches_b, job_.b.vertices, tile_b);
  const Vec3<V> shift = {V(job_.shift[0]), V(job_.shift[1]), V(job_.shift[2])};
  const std::uint32_t used = pairs_.count == kLanes ? 0xffffu : (1u << pairs_.count) - 1;
  std::uint32_t apart = 0;
  pairs_.touching = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const std::uint32_t active = used >> lane & ((1u << kWidth<V>)-1);
    if (!active) break;
    TriangleLanes<V> a = triangle_lanes<V>(tile_a, lane), b = triangle_lanes<V>(tile_b, lane);
    if (job_.rigid)
      for (std::uint32_t i = 0; i < 3; ++i) {
        a.corner[i] = moved_by(job_.rigid->place[0], a.corner[i]);
        b.corner[i] = moved_by(job_.rigid->place[1], b.corner[i]);
      }
    for (Vec3<V>& corner : b.corner) corner = corner + shift;
    const ConvexAnswer answer = test_triangles(a, b, V(job_.error), V(job_.margin), active);
    apart |= answer.apart << lane;
    pairs_.touching |= answer.touching << lane;
  }
  pairs_.undecided = used & ~(apart | pairs_.touching);
  const bool goes_on = !(pairs_.touching | pairs_.undecided) || take_(taker_, pairs_);
  pairs_.count = 0;
  return goes_on;
}

// The box of one lane, moved to the origin of the other side and grown by how near that may be.
CAB_INLINE void grown_box(const AabbTile& tile, std::uint32_t lane, const float (&shift)[3], float reach,
                          float (&lo)[3], float (&hi)[3]) {
  for (std::uint32_t c = 0; c < 3; ++c) {
    lo[c] = (tile.lo[c][lane] + shift[c]) - reach;
    hi[c] = (tile.hi[c][lane] + shift[c]) + reach;
  }
}

// Boxes about the boxes of a tile in another frame. Empty ones become NaNs, which are nowhere.
template <class V>
CAB_INLINE void turn_boxes(const AabbTile& tile, const float* matrix, AabbTile& out) {
  const V half(0.5f);
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const Vec3<V> lo = load3<V>(tile.lo, lane), hi = load3<V>(tile.hi, lane);
    const Vec3<V> middle = moved_by(matrix, half * (lo + hi)), size = half * (hi - lo);
    const auto row = [&](std::uint32_t c) {
      return (abs(V(matrix[c])) * size.x + abs(V(matrix[3 + c])) * size.y) + abs(V(matrix[6 + c])) * size.z;
    };
    const Vec3<V> turned = {row(0), row(1), row(2)};
    store_bounds(middle - turned, middle + turned, lane, out);
  }
}

// A box of b in the frames of a and of b, grown by how near a may be.
struct BoxInFrames {
  float lo[2][3], hi[2][3];
};

CAB_INLINE BoxInFrames grown_in_frames(const AabbTile& in_a, const AabbTile& in_b, std::uint32_t lane,
                                       const RigidSurfaces& rigid) {
  constexpr float kNoShift[3] = {};
  BoxInFrames out;
  grown_box(in_a, lane, kNoShift, rigid.reach[0], out.lo[0], out.hi[0]);
  grown_box(in_b, lane, kNoShift, rigid.reach[1], out.lo[1], out.hi[1]);
  return out;
}

// The lanes of tiles of the same boxes in both frames that overlap a box in both.
template <class V>
CAB_INLINE std::uint32_t lanes_near(const AabbTile& in_a, const AabbTile& in_b, const BoxInFrames& box) {
  const std::uint32_t near = lanes_near<V>(in_a, box.lo[0], box.hi[0]);
  return near ? near & lanes_near<V>(in_b, box.lo[1], box.hi[1]) : 0;
}

// The triangles of up to sixteen patches of a in b's frame, where they are needed.
template <class V>
class TurnedPatches {
 public:
  CAB_INLINE const AabbTile& at(const SurfacePair& job, std::uint32_t patch) {
    AabbTile& tile = tiles_[patch % kLanes];
    if (!(known_ >> patch % kLanes & 1)) bound_patch<V>(job.patches_a[patch], job.a.vertices, job.rigid->turn[1], tile);
    known_ |= 1u << patch % kLanes;
    return tile;
  }

 private:
  std::uint32_t known_ = 0;
  AabbTile tiles_[kLanes];
};

// test_surfaces for rigid leaves. Patches are compared, then triangles, each in the frames of both links: along axes of
// its own frame a long triangle has a thin box. What is not near the other leaf is neither moved nor bounded.
template <class V>
bool test_rigid_surfaces(const SurfacePair& job, void* taker, TakeTriangles take) {
  TriangleQueue<V> queue(job, taker, take);
  const RigidSurfaces& rigid = *job.rigid;
  for (std::uint32_t first_a = 0; first_a < job.patch_count_a; first_a += kLanes) {
    const AabbTile& all_a = job.a.bounds[job.patch_count_a + first_a / kLanes];
    AabbTile all_a_in_b, all_b_in_a;
    turn_boxes<V>(all_a, rigid.turn[1], all_a_in_b);
    TurnedPatches<V> turned;
    for (std::uint32_t patch_b = 0; patch_b < job.patch_count_b; ++patch_b) {
      const AabbTile& all_b = job.b.bounds[job.patch_count_b + patch_b / kLanes];
      if (patch_b % kLanes == 0) turn_boxes<V>(all_b, rigid.turn[0], all_b_in_a);
      std::uint32_t near_a =
          lanes_near<V>(all_a, all_a_in_b, grown_in_frames(all_b_in_a, all_b, patch_b % kLanes, rigid));
      if (!near_a) continue;
      const AabbTile& in_b = job.b.bounds[patch_b];
      AabbTile in_a;
      bound_patch<V>(job.patches_b[patch_b], job.b.vertices, rigid.turn[0], in_a);
      for (; near_a; near_a &= near_a - 1) {
        const std::uint32_t lane_a = lowest_bit(near_a), patch_a = first_a + lane_a;
        const AabbTile& of_a_in_b = turned.at(job, patch_a);
        std::uint32_t near_b = lanes_near<V>(in_a, in_b, grown_in_frames(all_a, all_a_in_b, lane_a, rigid));
        for (; near_b; near_b &= near_b - 1) {
          const std::uint32_t lane_b = lowest_bit(near_b);
          std::uint32_t pairs =
              lanes_near<V>(job.a.bounds[patch_a], of_a_in_b, grown_in_frames(in_a, in_b, lane_b, rigid));
          for (; pairs; pairs &= pairs - 1)
            if (!queue.add(kLanes * patch_a + lowest_bit(pairs), kLanes * patch_b + lane_b)) return false;
        }
      }
    }
  }
  return queue.empty() || queue.test();
}

// Finds the pairs of triangles of two leaves that touch or are undecided, and gives them to the taker, up to sixteen at
// a time and in no certain order. Returns whether the taker has let it come to the end.
template <class V>
bool test_surfaces(const SurfacePair& job, void* taker, TakeTriangles take) {
  if (job.rigid) return test_rigid_surfaces<V>(job, taker, take);
  TriangleQueue<V> queue(job, taker, take);
  const AabbTile* const all_a = job.a.bounds + job.patch_count_a;
  const AabbTile* const all_b = job.b.bounds + job.patch_count_b;
  for (std::uint32_t patch_b = 0; patch_b < job.patch_count_b; ++patch_b) {
    float lo[3], hi[3];
    grown_box(all_b[patch_b / kLanes], patch_b % kLanes, job.shift, job.reach, lo, hi);
    for (std::uint32_t first_a = 0; first_a < job.patch_count_a; first_a += kLanes)
      for (std::uint32_t near_a = lanes_near<V>(all_a[first_a / kLanes], lo, hi); near_a; near_a &= near_a - 1) {
        const std::uint32_t patch_a = first_a + lowest_bit(near_a);
        // The triangles of b that come near the patch of a, and for each of them those of a.
        float lo_a[3], hi_a[3];
        const float back[3] = {-job.shift[0], -job.shift[1], -job.shift[2]};
        grown_box(all_a[patch_a / kLanes], patch_a % kLanes, back, job.reach, lo_a, hi_a);
        for (std::uint32_t near_b = lanes_near<V>(job.b.bounds[patch_b], lo_a, hi_a); near_b; near_b &= near_b - 1) {
          const std::uint32_t lane_b = lowest_bit(near_b);
          float lo_b[3], hi_b[3];
          grown_box(job.b.bounds[patch_b], lane_b, job.shift, job.reach, lo_b, hi_b);
          for (std::uint32_t pairs = lanes_near<V>(job.a.bounds[patch_a], lo_b, hi_b); pairs; pairs &= pairs - 1)
            if (!queue.add(kLanes * patch_a + lowest_bit(pairs), kLanes * patch_b + lane_b)) return false;
        }
      }
  }
  return queue.empty() || queue.test();
}

}  // namespace cab::kernel
