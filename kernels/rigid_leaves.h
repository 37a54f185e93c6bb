// The crowd's first pass and its box test: bounds of leaves straight from poses, and leaves that are posed only inside
// the test of their boxes. Leaf boxes are rigid: each is placed by one quaternion and one translation of its link.
#pragma once

#include "kernels/gather_pairs.h"
#include "kernels/pose_leaves.h"
#include "kernels/words.h"
#include "layout/leaf_words.h"
#include "layout/rigid_shape.h"

namespace cab::kernel {

// ------------------------------------------------------------------------------------------------ seven floats a pose

// Reads the quaternion and the translation of a pose of every lane, `skip` floats from the addresses on.
template <class V>
CAB_INLINE void read_seven(const float* const* from, std::size_t skip, V (&out)[7]) {
  alignas(64) float raw[7][kQuadRows<V>];
  float* const first[4] = {raw[0], raw[1], raw[2], raw[3]};
  float* const last[4] = {raw[3], raw[4], raw[5], raw[6]};
  const float *rows[kQuadRows<V>], *last_rows[kQuadRows<V>];
  for (std::uint32_t i = 0; i < kQuadRows<V>; ++i) {
    rows[i] = scalar_address(from[i]) + skip;
    last_rows[i] = rows[i] + 3;
  }
  transpose_quads<V>(rows, first);
  transpose_quads<V>(last_rows, last);
  for (int k = 0; k < 7; ++k) out[k] = Lanes<V>::load(raw[k]);
}
template <>
CAB_INLINE void read_seven<float>(const float* const* from, std::size_t skip, float (&out)[7]) {
  for (int k = 0; k < 7; ++k) out[k] = from[0][skip + static_cast<std::size_t>(k)];
}

#if XSIMD_WITH_AVX2
// Two quads that share a float; a register has those of two poses.
template <>
CAB_INLINE void read_seven<Batch<xsimd::avx2>>(const float* const* from, std::size_t skip,
                                               Batch<xsimd::avx2> (&out)[7]) {
  const auto quads = [&](std::size_t more, __m256(&pairs)[4]) {
    __m256 r[4];
    for (int k = 0; k < 4; ++k)
      r[k] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(scalar_address(from[k]) + skip + more)),
                                  _mm_loadu_ps(scalar_address(from[k + 4]) + skip + more), 1);
    pairs[0] = _mm256_unpacklo_ps(r[0], r[1]);
    pairs[1] = _mm256_unpackhi_ps(r[0], r[1]);
    pairs[2] = _mm256_unpacklo_ps(r[2], r[3]);
    pairs[3] = _mm256_unpackhi_ps(r[2], r[3]);
  };
  __m256 a[4], b[4];
  quads(0, a);
  quads(3, b);
  out[0] = _mm256_shuffle_ps(a[0], a[2], 0x44);
  out[1] = _mm256_shuffle_ps(a[0], a[2], 0xee);
  out[2] = _mm256_shuffle_ps(a[1], a[3], 0x44);
  out[3] = _mm256_shuffle_ps(a[1], a[3], 0xee);
  out[4] = _mm256_shuffle_ps(b[0], b[2], 0xee);
  out[5] = _mm256_shuffle_ps(b[1], b[3], 0x44);
  out[6] = _mm256_shuffle_ps(b[1], b[3], 0xee);
}
#endif

#if XSIMD_WITH_AVX512F
// Seven floats of two poses fill the halves of a register. Masked loads read no float beyond the pose. Those of 64
// bytes cross a cache line nearly always, those of 32 bytes at every other pose.
CAB_INLINE __m512 load_two_sevens(const float* lower, const float* upper) {
  const __mmask16 places = 0x7f00;
  __m512 out = _mm512_castps256_ps512(_mm256_maskz_loadu_ps(0x7f, lower));
#if CAB_HAS_MASKED_BROADCAST
  load_upper_seven(upper, places, out);
#else
  out = _mm512_mask_loadu_ps(out, places, upper - 8);
#endif
  return out;
}
template <>
CAB_INLINE void read_seven<Batch<xsimd::avx512bw>>(const float* const* from, std::size_t skip,
                                                   Batch<xsimd::avx512bw> (&out)[7]) {
  __m512 r[8], a[8], b[8];
  for (int k = 0; k < 8; ++k) {
    const int low = k < 4 ? k : k + 4;
    r[k] = load_two_sevens(scalar_address(from[low]) + skip, scalar_address(from[low + 4]) + skip);
  }
  for (int k = 0; k < 8; k += 2) {
    a[k] = _mm512_unpacklo_ps(r[k], r[k + 1]);
    a[k + 1] = _mm512_unpackhi_ps(r[k], r[k + 1]);
  }
  for (int k = 0; k < 8; k += 4) {
    b[k] = _mm512_shuffle_ps(a[k], a[k + 2], 0x44);
    b[k + 1] = _mm512_shuffle_ps(a[k], a[k + 2], 0xee);
    b[k + 2] = _mm512_shuffle_ps(a[k + 1], a[k + 3], 0x44);
    b[k + 3] = _mm512_shuffle_ps(a[k + 1], a[k + 3], 0xee);
  }
  for (int k = 0; k < 4; ++k) out[k] = _mm512_shuffle_f32x4(b[k], b[k + 4], 0x88);
  for (int k = 0; k < 3; ++k) out[4 + k] = _mm512_shuffle_f32x4(b[k], b[k + 4], 0xdd);
}
#endif

// The product of two quaternions x y z w.
template <class V>
CAB_INLINE void multiply(const V* a, const V* b, V* out) {
  const V x = (a[3] * b[0] + a[0] * b[3]) + (a[1] * b[2] - a[2] * b[1]);
  const V y = (a[3] * b[1] + a[1] * b[3]) + (a[2] * b[0] - a[0] * b[2]);
  const V z = (a[3] * b[2] + a[2] * b[3]) + (a[0] * b[1] - a[1] * b[0]);
  out[3] = (a[3] * b[3] - a[0] * b[0]) - (a[1] * b[1] + a[2] * b[2]);
  out[0] = x, out[1] = y, out[2] = z;
}

// Replaces the quaternion in q by its product with p, which comes last or first.
template <class V>
CAB_INLINE void turn_by(const V (&p)[4], V (&q)[7]) {
  multiply<V>(q, p, q);
}
template <class V>
CAB_INLINE void turn_first(const V (&p)[4], V (&q)[7]) {
  multiply<V>(p, q, q);
}

// The rotation of the quaternion x y z w by rows, where s is twice the inverse of its squared length.
template <class V>
CAB_INLINE void rotation_rows(V x, V y, V z, V w, V s, V (&r)[3][3]) {
  const V one(1.0f);
  const V sx = s * x, sy = s * y, sz = s * z;
  const V xx = sx * x, yy = sy * y, zz = sz * z, xy = sx * y, xz = sx * z, yz = sy * z;
  const V xw = sx * w, yw = sy * w, zw = sz * w;
  r[0][0] = one - (yy + zz), r[0][1] = xy - zw, r[0][2] = xz + yw;
  r[1][0] = xy + zw, r[1][1] = one - (xx + zz), r[1][2] = yz - xw;
  r[2][0] = xz - yw, r[2][1] = yz + xw, r[2][2] = one - (xx + yy);
}

// ------------------------------------------------------------------------------------------------------- first pass

// What the poses of a shape's leaves are turned and scaled by.
enum class RigidAs : std::uint8_t {
  kPlain,   // nothing: boxes have the axes of their links
  kTurned,  // their own axes
  kPlaced,  // their own axes, and the orientation, scale and margin of their instance
};
inline RigidAs rigid_as(const RigidShape& shape) {
  return shape.placed ? RigidAs::kPlaced : shape.turned ? RigidAs::kTurned : RigidAs::kPlain;
}

// Sixteen instances of a batch, and sixteen leaves of them at a time. Unused lanes repeat a used one. next: the first
// link's pose of the instances that come after these; their first next_bytes bytes are asked for between the
// arithmetic. lo, hi: the bounds of each leaf about its instance's origin. all: those of all leaves that were bounded
// since it was empty. rigid: bits of the lanes whose poses are rotations within range, so that pose_leaves would not
// mask them; the bounds of other lanes have no meaning. orientations, scales, grown: with RigidShape::placed, the
// quaternion of each instance, its scale, and by how much its half extents grow.
struct RigidTile {
  const RigidShape* shape;
  std::uint32_t block;
  const float* poses[kLanes];
  const float* next[kLanes];
  std::uint32_t next_bytes;
  std::uint32_t rigid;
  const float* orientations[kLanes];
  alignas(64) float scales[kLanes];
  alignas(64) float grown[kLanes];
  alignas(64) float lo[kLanes][3][kLanes];
  alignas(64) float hi[kLanes][3][kLanes];
  AabbTile of_block;
  AabbTile all;
};

// Poses beyond this are left to pose_leaves, which says what becomes of them.
inline constexpr float kRigidRange = kMaxCoordinate / 8;

template <class V>
CAB_INLINE Mask<V> is_unit_range(const V (&q)[7]) {
  const V length_sq = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
  return both(length_sq >= V(kQuaternionSqMin), length_sq <= V(kQuaternionSqMax));
}

// How the instances of a tile are placed, in the lanes that V covers.
template <class V>
struct PlacedLanes {
  V turn[4];     // quaternion
  V rows[3][3];  // its rotation
  V scale, grown;
  Mask<V> ok;  // rotations and scales that pose_leaves takes, of boxes that stay within its range

  CAB_INLINE void read(const RigidTile& tile, std::uint32_t lane) {
    alignas(64) float raw[4][kLanes];
    for (std::uint32_t i = 0; i < kWidth<V>; ++i)
      for (int k = 0; k < 4; ++k) raw[k][i] = tile.orientations[lane + i][k];
    for (int k = 0; k < 4; ++k) turn[k] = Lanes<V>::load(raw[k]);
    scale = Lanes<V>::load(tile.scales + lane);
    grown = Lanes<V>::load(tile.grown + lane);
    const V length_sq = (turn[0] * turn[0] + turn[1] * turn[1]) + (turn[2] * turn[2] + turn[3] * turn[3]);
    rotation_rows<V>(turn[0], turn[1], turn[2], turn[3], divide(V(2.0f), length_sq), rows);
    ok = both(both(length_sq >= V(kQuaternionSqMin), length_sq <= V(kQuaternionSqMax)),
              both(both(scale >= V(kMinScale), scale <= V(kMaxScale)),
                   scale * V(tile.shape->extent) + V(3.0f) * grown <= V(kRigidRange)));
  }

  // Whether pose_leaves takes a translation. What becomes of it is part of the leaf's centre.
  CAB_INLINE Mask<V> takes(const V (&q)[7]) const {
    return max(abs(q[4]), max(abs(q[5]), abs(q[6]))) <= V(kRigidRange);
  }

  // The pose of a link in the instance's frame becomes that in the world's axes.
  CAB_INLINE void place(V (&q)[7]) const {
    V t[3];
    for (int c = 0; c < 3; ++c) t[c] = scale * q[4 + c];
    turn_first<V>(turn, q);
    for (int c = 0; c < 3; ++c) q[4 + c] = (rows[c][0] * t[0] + rows[c][1] * t[1]) + rows[c][2] * t[2];
  }
};

// Checks the links without leaves.
template <class V>
CAB_INLINE std::uint32_t check_bare_links(const RigidTile& tile) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    Mask<V> ok = V(0.0f) <= V(0.0f);
    const V scale = tile.shape->placed ? max(V(1.0f), Lanes<V>::load(tile.scales + lane)) : V(1.0f);
    for (std::uint32_t n = 0; n < tile.shape->bare_count; ++n) {
      V q[7];
      read_seven<V>(tile.poses + lane, tile.shape->bare[n], q);
      ok = both(ok, is_unit_range(q));
      for (int c = 4; c < 7; ++c) ok = both(ok, scale * abs(q[c]) <= V(kRigidRange));
    }
    out |= bits(ok) << lane;
  }
  return out;
}

template <class V, RigidAs kAs>
CAB_INLINE void bound_rigid_block(RigidTile& tile) {
  constexpr bool kPlaced = kAs == RigidAs::kPlaced;
  const RigidBlock& block = tile.shape->block[tile.block];
  const V far(3e38f);
  constexpr std::uint32_t kSteps = kLanes / kWidth<V>;
  constexpr bool kKeepsAll = kSteps == 1;  // registers suffice for the bounds of all leaves
  V all_lo[3] = {far, far, far}, all_hi[3] = {V(0.0f) - far, V(0.0f) - far, V(0.0f) - far};
  Mask<V> ok[kSteps];
  for (Mask<V>& m : ok) m = V(0.0f) <= V(0.0f);
  PlacedLanes<V> placed[kPlaced ? kSteps : 1];
  for (std::uint32_t step = 0; kPlaced && step < kSteps; ++step) {
    placed[step].read(tile, step * kWidth<V>);
    ok[step] = placed[step].ok;
  }
  // Two loops over a few leaves, since one leaf's chain of operations is about as long as a processor looks ahead.
  constexpr std::uint32_t kStage = 4;
  struct alignas(64) Posed {
    V q[7], s;
  } posed[kStage][kSteps];
  std::uint32_t ahead = 0;
  for (std::uint32_t first = 0; first < block.leaves; first += kStage) {
    const std::uint32_t end = first + kStage < block.leaves ? first + kStage : block.leaves;
    for (std::uint32_t leaf = first; leaf < end; ++leaf) {
      const std::uint32_t ahead_end = tile.next_bytes ? (leaf + 1) * kLanes / block.leaves : 0;
      for (; ahead < ahead_end; ++ahead) prefetch_bytes(tile.next[ahead], tile.next_bytes);
      for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
        Posed& out = posed[leaf - first][lane / kWidth<V>];
        read_seven<V>(tile.poses + lane, block.offset[leaf], out.q);
        const V(&q)[7] = out.q;
        V length_sq = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
        Mask<V>& good = ok[lane / kWidth<V>];
        good = both(good, both(length_sq >= V(kQuaternionSqMin), length_sq <= V(kQuaternionSqMax)));
        if constexpr (kPlaced) {
          const PlacedLanes<V>& by = placed[lane / kWidth<V>];
          good = both(good, by.takes(q));
          by.place(out.q);
          length_sq = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
        }
        out.s = divide(V(2.0f), length_sq);
      }
    }
    for (std::uint32_t leaf = first; leaf < end; ++leaf)
      for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
        const Posed& from = posed[leaf - first][lane / kWidth<V>];
        V q[7];
        for (int k = 0; k < 7; ++k) q[k] = from.q[k];
        if constexpr (kAs != RigidAs::kPlain) {
          const V p[4] = {V(block.turn[0][leaf]), V(block.turn[1][leaf]), V(block.turn[2][leaf]),
                          V(block.turn[3][leaf])};
          turn_by<V>(p, q);
        }
        V middle[3], halves[3], reach = V(block.reach[leaf]);
        for (int c = 0; c < 3; ++c) middle[c] = V(block.middle[c][leaf]), halves[c] = V(block.half[c][leaf]);
        if constexpr (kPlaced) {
          const PlacedLanes<V>& by = placed[lane / kWidth<V>];
          for (int c = 0; c < 3; ++c) middle[c] = by.scale * middle[c], halves[c] = by.scale * halves[c] + by.grown;
          reach = (by.scale * reach + V(3 * kPlacedBoundsSize) * by.grown) + V(kOverlapTiny);
        }
        V r[3][3];
        rotation_rows<V>(q[0], q[1], q[2], q[3], from.s, r);
        V center[3];
        for (int c = 0; c < 3; ++c)
          center[c] = q[4 + c] + ((r[c][0] * middle[0] + r[c][1] * middle[1]) + r[c][2] * middle[2]);
        const V away = (abs(center[0]) + abs(center[1])) + abs(center[2]);
        Mask<V>& good = ok[lane / kWidth<V>];
        good = both(good, away <= V(kRigidRange));
        reach = reach + V(kPlaced ? kPlacedBoundsCenter : kRigidBoundsCenter) * away;
        for (int c = 0; c < 3; ++c) {
          const V half = ((abs(r[c][0]) * halves[0] + abs(r[c][1]) * halves[1]) + abs(r[c][2]) * halves[2]) + reach;
          const V lo = center[c] - half, hi = center[c] + half;
          Lanes<V>::store(tile.lo[leaf][c] + lane, lo);
          Lanes<V>::store(tile.hi[leaf][c] + lane, hi);
          if (!kKeepsAll) continue;
          all_lo[c] = min(all_lo[c], lo);
          all_hi[c] = max(all_hi[c], hi);
        }
      }
  }
  std::uint32_t rigid = 0;
  for (std::uint32_t step = 0; step < kSteps; ++step) rigid |= bits(ok[step]) << step * kWidth<V>;
  tile.rigid = tile.block == 0 ? rigid : tile.rigid & rigid;
  for (int c = 0; c < 3; ++c)
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      V lo = all_lo[c], hi = all_hi[c];
      for (std::uint32_t leaf = 0; !kKeepsAll && leaf < block.leaves; ++leaf) {
        lo = min(lo, Lanes<V>::load(tile.lo[leaf][c] + lane));
        hi = max(hi, Lanes<V>::load(tile.hi[leaf][c] + lane));
      }
      Lanes<V>::store(tile.of_block.lo[c] + lane, lo);
      Lanes<V>::store(tile.of_block.hi[c] + lane, hi);
    }
}

// Bounds the leaves of one block in sixteen instances (docs/proof.md, steps 14.1 to 14.3).
template <class V>
void bound_rigid_leaves(RigidTile& tile) {
  switch (rigid_as(*tile.shape)) {
    case RigidAs::kPlain: bound_rigid_block<V, RigidAs::kPlain>(tile); break;
    case RigidAs::kTurned: bound_rigid_block<V, RigidAs::kTurned>(tile); break;
    case RigidAs::kPlaced: bound_rigid_block<V, RigidAs::kPlaced>(tile); break;
  }
  if (tile.block == 0 && tile.shape->bare_count > 0) tile.rigid &= check_bare_links<V>(tile);
}

// --------------------------------------------------------------------------------------------------------- box test

// Entries whose leaf pairs are tested together: so many are collected, and one search may add kLanes more.
inline constexpr std::uint32_t kPairEntries = 128;
inline constexpr std::uint32_t kMostPairEntries = kPairEntries + 2 * kLanes;
inline constexpr std::uint32_t kPairSlots = kMostPairEntries + kLanes;

// Entries: sixteen leaves of one instance and sixteen of another. shift: the origin of b less that of a, as float and
// in double. unsure: step 14.5. shape: where the two find their leaves. pose: of the first link. at: where that is,
// in floats from RigidPairs::base.
struct alignas(64) PairSlots {
  float shift[3][kPairSlots];
  float unsure[kPairSlots];
  double exact_shift[kPairSlots][4];  // the fourth is unused
  const RigidShape* shape_a[kPairSlots];
  const RigidShape* shape_b[kPairSlots];
  const float* pose_a[kPairSlots];
  const float* pose_b[kPairSlots];
  std::uint32_t at_a[kPairSlots];
  std::uint32_t at_b[kPairSlots];
  std::uint32_t entry[kPairSlots];  // which of the entries that were filtered
  // With RigidAs::kPlaced, of a and of b: the orientation, the scale, by how much half extents grow beyond those of the
  // shape and beyond the articulation's, and whether there is an orientation.
  float turn[2][4][kPairSlots];
  float scale[2][kPairSlots];
  float grown[2][kPairSlots];
  float margin[2][kPairSlots];
  bool rotated[2][kPairSlots];
};

// Leaf pairs to test: slot << 16 | leaf of a << 8 | leaf of b. They are sorted by slot, and kLanes more may be read.
// out: where those that overlap go, with room for kLanes more.
// block_a, block_b: the only block of all instances a, and of all b; then base_a and base_b are what PairSlots::at
// counts from. Else null.
struct RigidPairs {
  const PairSlots* slots;
  const std::uint32_t* pairs;
  std::uint32_t count;
  std::uint32_t* out;
  const RigidBlock* block_a;
  const RigidBlock* block_b;
  const float* base_a;
  const float* base_b;
  RigidAs as;
  Sat sat;
};

CAB_INLINE std::uint32_t slot_of(std::uint32_t pair) { return pair >> 16; }
CAB_INLINE std::uint32_t leaf_a_of(std::uint32_t pair) { return pair >> 8 & 0xff; }
CAB_INLINE std::uint32_t leaf_b_of(std::uint32_t pair) { return pair & 0xff; }

// A leaf of every lane.
template <class V>
struct LeafLanes {
  V middle[3], half[3], turn[4];
};

// As many pairs as V has lanes, with what they read. Lanes past the last pair repeat the first one.
// Here leaves are read from their records; the variants with tables are below.
template <class V>
struct RecordGroup {
  static constexpr std::uint32_t kRows = kQuadRows<V>;
  const float* poses_a[kRows];
  const float* poses_b[kRows];
  const float* leaves_a[kRows];
  const float* leaves_b[kRows];
  alignas(64) std::uint32_t pair[kRows];
  std::uint32_t slot[kRows];
  std::uint32_t in;  // bits of the lanes that hold a pair
  std::uint32_t count;

  CAB_INLINE RecordGroup(const RigidPairs& job, std::uint32_t first) {
    const PairSlots& slots = *job.slots;
    count = job.count - first < kWidth<V> ? job.count - first : kWidth<V>;
    in = (1u << count) - 1;
    for (std::uint32_t i = 0; i < kRows; ++i) {
      const std::uint32_t word = job.pairs[first + (i < count ? i : 0)], k = slot_of(word);
      const RigidShape &shape_a = *slots.shape_a[k], &shape_b = *slots.shape_b[k];
      pair[i] = word;
      slot[i] = k;
      poses_a[i] = slots.pose_a[k] + shape_a.offset[leaf_a_of(word)];
      poses_b[i] = slots.pose_b[k] + shape_b.offset[leaf_b_of(word)];
      leaves_a[i] = shape_a.leaf[leaf_a_of(word)].middle;
      leaves_b[i] = shape_b.leaf[leaf_b_of(word)].middle;
    }
  }
  template <bool kTurned>
  CAB_INLINE LeafLanes<V> leaf(const float* const (&from)[kRows]) const {
    LeafLanes<V> out;
    if constexpr (kWidth<V> == 1) {
      const float* const p = from[0];
      out = {{V(p[0]), V(p[1]), V(p[2])}, {V(p[3]), V(p[4]), V(p[5])}, {V(p[8]), V(p[9]), V(p[10]), V(p[11])}};
    } else {
      alignas(64) float raw[12][kRows];
      for (std::uint32_t quad = 0; quad < 12; quad += 4) {
        if (quad == 8 && !kTurned) break;
        const float* rows[kRows];
        for (std::uint32_t i = 0; i < kRows; ++i) rows[i] = from[i] + quad;
        float* const to[4] = {raw[quad], raw[quad + 1], raw[quad + 2], raw[quad + 3]};
        transpose_quads<V>(rows, to);
      }
      for (int c = 0; c < 3; ++c) {
        out.middle[c] = Lanes<V>::load(raw[c]);
        out.half[c] = Lanes<V>::load(raw[3 + c]);
      }
      if constexpr (kTurned)
        for (int k = 0; k < 4; ++k) out.turn[k] = Lanes<V>::load(raw[8 + k]);
    }
    return out;
  }
  template <bool kTurned>
  CAB_INLINE LeafLanes<V> leaf_a(const RigidPairs&) const {
    return leaf<kTurned>(leaves_a);
  }
  template <bool kTurned>
  CAB_INLINE LeafLanes<V> leaf_b(const RigidPairs&) const {
    return leaf<kTurned>(leaves_b);
  }
  CAB_INLINE V of_slot(const float* table) const {
    alignas(64) float out[kRows];
    for (std::uint32_t i = 0; i < kRows; ++i) out[i] = table[slot[i]];
    return Lanes<V>::load(out);
  }
  CAB_INLINE std::uint32_t* append(std::uint32_t* to, std::uint32_t keep) const {
    for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
      *to = pair[i];
      to += keep >> i & 1;
    }
    return to;
  }
};

// Whether V finds a lane's entry of a table of sixteen faster than its record.
template <class V>
inline constexpr bool kHasTables = false;

// The same where all pairs are of one block of a and one of b. A group holds pairs of as many slots that follow each
// other as V has lanes.
template <class V>
struct TableGroup;

#if XSIMD_WITH_AVX2
template <>
inline constexpr bool kHasTables<Batch<xsimd::avx2>> = true;

template <>
struct TableGroup<Batch<xsimd::avx2>> {
  using V = Batch<xsimd::avx2>;
  const float* poses_a[8];
  const float* poses_b[8];
  alignas(32) std::uint32_t pair[8];
  __m256i words, slot;  // slot: of the pair, less `first_slot`
  std::uint32_t first_slot, in, count;

  CAB_INLINE TableGroup(const RigidPairs& job, std::uint32_t first) {
    first_slot = slot_of(job.pairs[first]);
    const std::uint32_t left = job.count - first;
    words = load(job.pairs + first);
    slot = _mm256_sub_epi32(_mm256_srli_epi32(words, 16), _mm256_set1_epi32(static_cast<int>(first_slot)));
    const __m256i lanes = _mm256_set_epi32(7, 6, 5, 4, 3, 2, 1, 0);
    const __m256i inside =
        _mm256_and_si256(_mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(left < 8 ? left : 8)), lanes),
                         _mm256_cmpgt_epi32(_mm256_set1_epi32(8), slot));
    in = static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(inside)));
    count = count_bits(in);
    words = _mm256_blendv_epi8(_mm256_broadcastd_epi32(_mm256_castsi256_si128(words)), words, inside);
    slot = _mm256_and_si256(slot, inside);
    alignas(32) std::uint32_t at_a[8], at_b[8];
    store(at_a, _mm256_add_epi32(_mm256_permutevar8x32_epi32(load(job.slots->at_a + first_slot), slot),
                                 _mm256_castps_si256(pick(job.block_a->offset, leaf_of_a()))));
    store(at_b, _mm256_add_epi32(_mm256_permutevar8x32_epi32(load(job.slots->at_b + first_slot), slot),
                                 _mm256_castps_si256(pick(job.block_b->offset, leaf_of_b()))));
    reload(at_a);
    reload(at_b);
    for (int i = 0; i < 8; ++i) {
      poses_a[i] = job.base_a + at_a[i];
      poses_b[i] = job.base_b + at_b[i];
    }
    store(pair, words);
  }
  template <bool kTurned>
  CAB_INLINE LeafLanes<V> leaf_a(const RigidPairs& job) const {
    return leaf<kTurned>(*job.block_a, leaf_of_a());
  }
  template <bool kTurned>
  CAB_INLINE LeafLanes<V> leaf_b(const RigidPairs& job) const {
    return leaf<kTurned>(*job.block_b, leaf_of_b());
  }
  CAB_INLINE V of_slot(const float* table) const {
    return _mm256_permutevar8x32_ps(_mm256_loadu_ps(table + first_slot), slot);
  }
  CAB_INLINE std::uint32_t* append(std::uint32_t* to, std::uint32_t keep) const {
    const __m128i numbers = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(kBitNumbers.of[keep]));
    store(to, _mm256_permutevar8x32_epi32(words, _mm256_cvtepu8_epi32(numbers)));
    return to + count_bits(keep);
  }

 private:
  static CAB_INLINE __m256i load(const std::uint32_t* at) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(at));
  }
  static CAB_INLINE void store(std::uint32_t* at, __m256i v) { _mm256_storeu_si256(reinterpret_cast<__m256i*>(at), v); }
  // The lowest four bits of a lane are the leaf's number in its block.
  CAB_INLINE __m256i leaf_of_a() const { return _mm256_srli_epi32(words, 8); }
  CAB_INLINE __m256i leaf_of_b() const { return words; }
  template <class T>
  static CAB_INLINE __m256 pick(const T (&table)[kLanes], __m256i leaf) {
    const float* const from = reinterpret_cast<const float*>(table);
    const __m256 upper = _mm256_castsi256_ps(_mm256_slli_epi32(leaf, 28));  // sign: the leaf's number is above 7
    return _mm256_blendv_ps(_mm256_permutevar8x32_ps(_mm256_load_ps(from), leaf),
                            _mm256_permutevar8x32_ps(_mm256_load_ps(from + 8), leaf), upper);
  }
  template <bool kTurned>
  static CAB_INLINE LeafLanes<V> leaf(const RigidBlock& block, __m256i number) {
    LeafLanes<V> out;
    for (int c = 0; c < 3; ++c) {
      out.middle[c] = pick(block.middle[c], number);
      out.half[c] = pick(block.half[c], number);
    }
    if constexpr (kTurned)
      for (int k = 0; k < 4; ++k) out.turn[k] = pick(block.turn[k], number);
    return out;
  }
};
#endif

#if XSIMD_WITH_AVX512F
template <>
inline constexpr bool kHasTables<Batch<xsimd::avx512bw>> = true;

template <>
struct TableGroup<Batch<xsimd::avx512bw>> {
  using V = Batch<xsimd::avx512bw>;
  alignas(64) const float* poses_a[16];
  alignas(64) const float* poses_b[16];
  alignas(64) std::uint32_t pair[16];
  __m512i words, slot;  // slot: of the pair, less `first_slot`
  std::uint32_t first_slot, in, count;

  CAB_INLINE TableGroup(const RigidPairs& job, std::uint32_t first) {
    first_slot = slot_of(job.pairs[first]);
    const std::uint32_t left = job.count - first;
    words = _mm512_loadu_si512(job.pairs + first);
    slot = _mm512_sub_epi32(_mm512_srli_epi32(words, 16), _mm512_set1_epi32(static_cast<int>(first_slot)));
    const __mmask16 there = static_cast<__mmask16>(left < 16 ? (1u << left) - 1 : 0xffffu);
    const __mmask16 inside = _mm512_mask_cmplt_epu32_mask(there, slot, _mm512_set1_epi32(16));
    in = inside;
    count = count_bits(in);
    words = _mm512_mask_mov_epi32(_mm512_broadcastd_epi32(_mm512_castsi512_si128(words)), inside, words);
    slot = _mm512_maskz_mov_epi32(inside, slot);
    addresses(job.base_a, job.slots->at_a, job.block_a->offset, leaf_of_a(), poses_a);
    addresses(job.base_b, job.slots->at_b, job.block_b->offset, leaf_of_b(), poses_b);
    _mm512_store_si512(pair, words);
  }
  template <bool kTurned>
  CAB_INLINE LeafLanes<V> leaf_a(const RigidPairs& job) const {
    return leaf<kTurned>(*job.block_a, leaf_of_a());
  }
  template <bool kTurned>
  CAB_INLINE LeafLanes<V> leaf_b(const RigidPairs& job) const {
    return leaf<kTurned>(*job.block_b, leaf_of_b());
  }
  CAB_INLINE V of_slot(const float* table) const {
    return _mm512_permutexvar_ps(slot, _mm512_loadu_ps(table + first_slot));
  }
  CAB_INLINE std::uint32_t* append(std::uint32_t* to, std::uint32_t keep) const {
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(keep), words));
    return to + count_bits(keep);
  }

 private:
  // Permutations read the lowest four bits of a lane, the leaf's number in its block.
  CAB_INLINE __m512i leaf_of_a() const { return _mm512_srli_epi32(words, 8); }
  CAB_INLINE __m512i leaf_of_b() const { return words; }
  CAB_INLINE void addresses(const float* base, const std::uint32_t* at, const std::uint32_t (&offset)[kLanes],
                            __m512i number, const float** to) const {
    const __m512i floats = _mm512_add_epi32(_mm512_permutexvar_epi32(slot, _mm512_loadu_si512(at + first_slot)),
                                            _mm512_permutexvar_epi32(number, _mm512_load_si512(offset)));
    const __m512i from = _mm512_set1_epi64(static_cast<long long>(reinterpret_cast<std::uintptr_t>(base)));
    const auto bytes = [](__m256i half) { return _mm512_slli_epi64(_mm512_cvtepu32_epi64(half), 2); };
    _mm512_store_si512(to, _mm512_add_epi64(from, bytes(_mm512_castsi512_si256(floats))));
    _mm512_store_si512(to + 8, _mm512_add_epi64(from, bytes(_mm512_extracti64x4_epi64(floats, 1))));
    for (int i = 0; i < 16; ++i) reload(to[i]);
  }
  template <bool kTurned>
  static CAB_INLINE LeafLanes<V> leaf(const RigidBlock& block, __m512i number) {
    const auto pick = [&](const float(&table)[kLanes]) -> V {
      return _mm512_permutexvar_ps(number, _mm512_load_ps(table));
    };
    LeafLanes<V> out;
    for (int c = 0; c < 3; ++c) {
      out.middle[c] = pick(block.middle[c]);
      out.half[c] = pick(block.half[c]);
    }
    if constexpr (kTurned)
      for (int k = 0; k < 4; ++k) out.turn[k] = pick(block.turn[k]);
    return out;
  }
};
#endif

// x y + z, x y - z and z - x y. With AVX2 and AVX-512 they round once, which no bound of docs/proof.md minds: only the
// certificate of the box test uses them, so hits do not depend on it.
template <class V>
CAB_INLINE V fused(V x, V y, V z) {
  return x * y + z;
}
template <class V>
CAB_INLINE V fused_less(V x, V y, V z) {
  return x * y - z;
}
template <class V>
CAB_INLINE V less_fused(V x, V y, V z) {
  return z - x * y;
}
#if XSIMD_WITH_AVX2
template <>
CAB_INLINE Batch<xsimd::avx2> fused(Batch<xsimd::avx2> x, Batch<xsimd::avx2> y, Batch<xsimd::avx2> z) {
  return _mm256_fmadd_ps(x.data, y.data, z.data);
}
template <>
CAB_INLINE Batch<xsimd::avx2> fused_less(Batch<xsimd::avx2> x, Batch<xsimd::avx2> y, Batch<xsimd::avx2> z) {
  return _mm256_fmsub_ps(x.data, y.data, z.data);
}
template <>
CAB_INLINE Batch<xsimd::avx2> less_fused(Batch<xsimd::avx2> x, Batch<xsimd::avx2> y, Batch<xsimd::avx2> z) {
  return _mm256_fnmadd_ps(x.data, y.data, z.data);
}
#endif
#if XSIMD_WITH_AVX512F
template <>
CAB_INLINE Batch<xsimd::avx512bw> fused(Batch<xsimd::avx512bw> x, Batch<xsimd::avx512bw> y, Batch<xsimd::avx512bw> z) {
  return _mm512_fmadd_ps(x.data, y.data, z.data);
}
template <>
CAB_INLINE Batch<xsimd::avx512bw> fused_less(Batch<xsimd::avx512bw> x, Batch<xsimd::avx512bw> y,
                                             Batch<xsimd::avx512bw> z) {
  return _mm512_fmsub_ps(x.data, y.data, z.data);
}
template <>
CAB_INLINE Batch<xsimd::avx512bw> less_fused(Batch<xsimd::avx512bw> x, Batch<xsimd::avx512bw> y,
                                             Batch<xsimd::avx512bw> z) {
  return _mm512_fnmadd_ps(x.data, y.data, z.data);
}
#endif

// Boxes of leaves in instances with more than an origin, as pose_leaves makes them. side: 0 for a, 1 for b. q: poses of
// links.
template <class V>
CAB_INLINE BoxLanes<V> pose_placed_leaves(const PairSlots& slots, int side, const std::uint32_t* pairs, const V (&q)[7],
                                          const BoxAos* const* local) {
  RawPoses raw, rotations;
  alignas(64) float scales[kWidth<V>], margins[kWidth<V>], body[kWidth<V>], translation[kWidth<V>];
  for (int k = 0; k < 7; ++k) Lanes<V>::store(raw.raw[k], q[k]);
  for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
    const std::uint32_t slot = slot_of(pairs[i]);
    const PosePad pad = pad_of(slots.rotated[side][slot], 1);
    for (int k = 0; k < 4; ++k) rotations.raw[k][i] = slots.turn[side][k][slot];
    scales[i] = slots.scale[side][slot];
    margins[i] = slots.margin[side][slot];
    body[i] = pad.body;
    translation[i] = pad.translation;
  }
  const Mask<V> yes = V(0.0f) <= V(0.0f);
  LaneChecks<V> checks = {yes, yes, yes};  // not read: the first pass checked the poses
  const PoseCoding coding = {PoseFormat::kQuaternionTranslation, Scaling::kPerInstance};
  const RigidLanes<V> pose = placed_pose<V>(raw, {coding, &rotations, scales}, 0, checks);
  V unused;
  const PosePads<V> pads = {Lanes<V>::load(body), Lanes<V>::load(translation)};
  return pose_scaled_boxes(pose, gather_boxes<V>(local, unused), pads, Lanes<V>::load(margins));
}

// The leaf predicate of the pairs of a group, with boxes as pose_leaves makes them, bit for bit: bits of those that
// overlap. CAB_NOINLINE, since few groups need it.
template <class V>
CAB_NOINLINE std::uint32_t overlap_posed_leaves(const RigidPairs& job, const std::uint32_t* pairs) {
  const PairSlots& slots = *job.slots;
  const float *poses_a[kQuadRows<V>], *poses_b[kQuadRows<V>];
  const BoxAos *local_a[kWidth<V>], *local_b[kWidth<V>];
  ShiftTile shift;
  for (std::uint32_t i = 0; i < kQuadRows<V>; ++i) {
    const std::uint32_t lane = i < kWidth<V> ? i : 0, slot = slot_of(pairs[lane]);
    const RigidShape &shape_a = *slots.shape_a[slot], &shape_b = *slots.shape_b[slot];
    const std::uint32_t a = leaf_a_of(pairs[lane]), b = leaf_b_of(pairs[lane]);
    poses_a[i] = slots.pose_a[slot] + shape_a.offset[a];
    poses_b[i] = slots.pose_b[slot] + shape_b.offset[b];
    if (i != lane) continue;
    local_a[i] = shape_a.exact + a;
    local_b[i] = shape_b.exact + b;
    for (int c = 0; c < 3; ++c) shift.by[c][i] = slots.exact_shift[slot][c];
  }
  const auto posed = [&](int side, const float* const* poses, const BoxAos* const* local) {
    V q[7];
    read_seven<V>(poses, 0, q);
    if (job.as == RigidAs::kPlaced) return pose_placed_leaves<V>(slots, side, pairs, q, local);
    RigidLanes<V> pose;
    const V length_sq = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
    quaternion_columns(q[0], q[1], q[2], q[3], length_sq, pose.column);
    pose.translation = {q[4], q[5], q[6]};
    V pad;
    const BoxLanes<V> box = gather_boxes<V>(local, pad);
    return pose_box<V>(pose, box, pad, kPosePad.translation);
  };
  const BoxLanes<V> a = posed(0, poses_a, local_a), b = posed(1, poses_b, local_b);
  const Vec3<V> between = between_centers(a, b, &shift, 0);
  const Mask<V> apart =
      job.sat == Sat::kFaces6 ? separated<Sat::kFaces6>(a, b, between) : separated<Sat::kAll15>(a, b, between);
  return ~bits(either(apart, separated_in_world(a, b, between))) & ((1u << kWidth<V>)-1);
}

// Places leaves of a group by the orientations, scales and margins of their instances: their links' poses become those
// in the world's axes. side: 0 for a, 1 for b.
template <class V, class Group>
CAB_INLINE void place_leaves(const Group& group, const PairSlots& slots, int side, V (&q)[7], LeafLanes<V>& leaf) {
  const V scale = group.of_slot(slots.scale[side]), grown = group.of_slot(slots.grown[side]);
  V o[4], t[3];
  for (int k = 0; k < 4; ++k) o[k] = group.of_slot(slots.turn[side][k]);
  for (int c = 0; c < 3; ++c) {
    leaf.middle[c] = scale * leaf.middle[c];
    leaf.half[c] = fused(scale, leaf.half[c], grown);
    t[c] = scale * q[4 + c];
  }
  // With v = (x y z) of o it is t + 2 / |o|^2 (v x (v x t) + w (v x t)).
  const V length = fused(o[0], o[0], o[1] * o[1]) + fused(o[2], o[2], o[3] * o[3]), two = divide(V(2.0f), length);
  const V e[3] = {fused_less(o[1], t[2], o[2] * t[1]), fused_less(o[2], t[0], o[0] * t[2]),
                  fused_less(o[0], t[1], o[1] * t[0])};
  const V f[3] = {fused(o[3], e[0], fused_less(o[1], e[2], o[2] * e[1])),
                  fused(o[3], e[1], fused_less(o[2], e[0], o[0] * e[2])),
                  fused(o[3], e[2], fused_less(o[0], e[1], o[1] * e[0]))};
  turn_first<V>(o, q);
  for (int c = 0; c < 3; ++c) q[4 + c] = fused(two, f[c], t[c]);
}

// Tests groups of pairs: poses of both leaves, b's axes in those of a by one quaternion, and the largest gap over the
// axes. A gap beyond `unsure` decides, for then the leaf predicate decides alike (steps 14.4 to 14.7). The rest goes to
// the leaf predicate itself.
template <class V, class Group, RigidAs kAs>
CAB_INLINE std::uint32_t overlap_rigid_groups(const RigidPairs& job) {
  constexpr bool kTurned = kAs != RigidAs::kPlain;
  std::uint32_t* end = job.out;
  for (std::uint32_t first = 0; first < job.count;) {
    const Group group(job, first);
    first += group.count;
    V a[7], b[7];
    read_seven<V>(group.poses_a, 0, a);
    read_seven<V>(group.poses_b, 0, b);
    LeafLanes<V> leaf_a = group.template leaf_a<kTurned>(job), leaf_b = group.template leaf_b<kTurned>(job);
    if constexpr (kAs == RigidAs::kPlaced) {
      place_leaves<V>(group, *job.slots, 0, a, leaf_a);
      place_leaves<V>(group, *job.slots, 1, b, leaf_b);
    }
    const V between[3] = {(b[4] - a[4]) + group.of_slot(job.slots->shift[0]),
                          (b[5] - a[5]) + group.of_slot(job.slots->shift[1]),
                          (b[6] - a[6]) + group.of_slot(job.slots->shift[2])};
    const V length_a = fused(a[0], a[0], a[1] * a[1]) + fused(a[2], a[2], a[3] * a[3]);
    const V length_b = fused(b[0], b[0], b[1] * b[1]) + fused(b[2], b[2], b[3] * b[3]);
    if constexpr (kTurned) {
      turn_by<V>(leaf_a.turn, a);
      turn_by<V>(leaf_b.turn, b);
    }
    const V two_a = divide(V(2.0f), length_a), s = two_a * divide(V(1.0f), length_b);
    // The conjugate of a times b, and its rotation.
    const V w = fused(a[3], b[3], a[0] * b[0]) + fused(a[1], b[1], a[2] * b[2]);
    const V x = fused_less(a[3], b[0], a[0] * b[3]) + fused_less(a[2], b[1], a[1] * b[2]);
    const V y = fused_less(a[3], b[1], a[1] * b[3]) + fused_less(a[0], b[2], a[2] * b[0]);
    const V z = fused_less(a[3], b[2], a[2] * b[3]) + fused_less(a[1], b[0], a[0] * b[1]);
    const V one(1.0f), sx = s * x, sy = s * y, sz = s * z, xx = sx * x, zz = sz * z;
    const V xy = sx * y, xz = sx * z, yz = sy * z;
    const V r[3][3] = {{one - fused(sy, y, zz), less_fused(sz, w, xy), fused(sy, w, xz)},
                       {fused(sz, w, xy), one - (xx + zz), less_fused(sx, w, yz)},
                       {less_fused(sy, w, xz), fused(sx, w, yz), one - fused(sy, y, xx)}};
    // `between` along a's axes: with u = (x y z) of a, it is d + 2 / |a|^2 (u x (u x d) - w (u x d)).
    const V e[3] = {fused_less(a[1], between[2], a[2] * between[1]), fused_less(a[2], between[0], a[0] * between[2]),
                    fused_less(a[0], between[1], a[1] * between[0])};
    const V f[3] = {less_fused(a[3], e[0], fused_less(a[1], e[2], a[2] * e[1])),
                    less_fused(a[3], e[1], fused_less(a[2], e[0], a[0] * e[2])),
                    less_fused(a[3], e[2], fused_less(a[0], e[1], a[1] * e[0]))};
    V t[3];
    for (int i = 0; i < 3; ++i)
      t[i] = (fused(two_a, f[i], between[i]) - leaf_a.middle[i]) +
             fused(r[i][2], leaf_b.middle[2], fused(r[i][1], leaf_b.middle[1], r[i][0] * leaf_b.middle[0]));
    V r_abs[3][3], gap[3];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) r_abs[i][j] = abs(r[i][j]);
    const V(&ha)[3] = leaf_a.half;
    const V(&hb)[3] = leaf_b.half;
    for (int i = 0; i < 3; ++i)
      gap[i] = (abs(t[i]) - ha[i]) - fused(hb[2], r_abs[i][2], fused(hb[1], r_abs[i][1], hb[0] * r_abs[i][0]));
    for (int j = 0; j < 3; ++j) {
      const V along = fused(r[2][j], t[2], fused(r[1][j], t[1], r[0][j] * t[0]));
      gap[j] =
          max(gap[j], (abs(along) - hb[j]) - fused(ha[2], r_abs[2][j], fused(ha[1], r_abs[1][j], ha[0] * r_abs[0][j])));
    }
    const V of_faces = max(gap[0], max(gap[1], gap[2]));
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
      for (int j = 0; j < 3; ++j) {
        const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        const V along = abs(fused_less(t[i2], r[i1][j], t[i1] * r[i2][j]));
        gap[j] = max(gap[j], (along - fused(ha[i1], r_abs[i2][j], ha[i2] * r_abs[i1][j])) -
                                 fused(hb[j1], r_abs[i][j2], hb[j2] * r_abs[i][j1]));
      }
    }
    const V most = max(gap[0], max(gap[1], gap[2]));
    const V unsure = group.of_slot(job.slots->unsure);
    const V decides = job.sat == Sat::kFaces6 ? of_faces : most;
    const std::uint32_t apart = bits(decides > unsure), overlap = bits(most < V(0.0f) - unsure);
    std::uint32_t keep = overlap & group.in;
    const std::uint32_t open = group.in & ~(apart | overlap);
    if (open) keep |= overlap_posed_leaves<V>(job, group.pair) & open;
    end = group.append(end, keep);
  }
  return static_cast<std::uint32_t>(end - job.out);
}

template <class V, class Group>
CAB_INLINE std::uint32_t overlap_rigid_pairs(const RigidPairs& job) {
  switch (job.as) {
    case RigidAs::kPlain: return overlap_rigid_groups<V, Group, RigidAs::kPlain>(job);
    case RigidAs::kTurned: return overlap_rigid_groups<V, Group, RigidAs::kTurned>(job);
    case RigidAs::kPlaced: return overlap_rigid_groups<V, Group, RigidAs::kPlaced>(job);
  }
  return 0;
}

// Writes the pairs whose leaf boxes pass the leaf predicate to job.out, in their order, and returns their number.
template <class V>
std::uint32_t overlap_rigid_leaves(const RigidPairs& job) {
  if constexpr (kHasTables<V>)
    if (job.block_a) return overlap_rigid_pairs<V, TableGroup<V>>(job);
  return overlap_rigid_pairs<V, RecordGroup<V>>(job);
}

}  // namespace cab::kernel
