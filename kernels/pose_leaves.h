// Posing: from link poses in the caller's layout to the leaf boxes and joints of one tile.
#pragma once

#include "kernels/box.h"
#include "kernels/grow_leaves.h"
#include "kernels/pose_between.h"
#include "kernels/transpose.h"
#include "layout/articulation.h"
#include "layout/error_bounds.h"
#include "layout/pose_coding.h"

#include <algorithm>
#include <type_traits>

namespace cab::kernel {

// One tile to pose: any sixteen instances. Unused lanes repeat a used one. Posing writes the leaf boxes, the joints
// that merges need (indexed by link), the motions, and why each lane is masked (InstanceFlag bits).
struct PoseTile {
  const Articulation* articulation;
  PoseCoding coding;
  const float* poses[kLanes];         // the pose of each instance's first link
  std::size_t link_stride;            // floats from one link's pose to the next
  const RawPoses* links = nullptr;    // the poses in lanes already, by link; else null
  const float* orientations[kLanes];  // 4 floats per instance, or all null
  alignas(64) float scales[kLanes];   // with Scaling::kPerInstance
  BoxTile* leaves;
  PointTile* joints;
  MotionTile* motions;                // by link, or null if the caller needs no motions
  std::uint8_t* flags;                // 16
  alignas(64) float margins[kLanes];  // how much leaf boxes grow in addition to their padding
  // For boxes of links: `pads` is a factor of the padding and of `margins`, `range` the largest allowed number.
  float pads = 1;
  float range = kMaxCoordinate;
  // Static bodies: the box of each instance's only leaf, in the frame of its link. Else null: the articulation's.
  const BoxTile* own_boxes = nullptr;
  // Poses between two moments, of quaternions: the later one. Else null.
  const LaterPoses* later = nullptr;
  // Of an articulation with a skin: room for skin_tiles(*articulation); and to pose few instances by lanes of leaves,
  // for skin_rows(*articulation) and for a tile per leaf, or null.
  MotionTile* skin = nullptr;
  float* skin_rows = nullptr;
  GrownTile* grown = nullptr;
  std::uint32_t count = kLanes;  // of instances: later lanes repeat the last one
  // Few instances with a skin: `leaves` are tiles of leaves as lanes (kFewInstances).
  bool leaves_are_lanes = false;

  // Whether the boxes of a skin grow by lanes of leaves, one instance after the other, since lanes of instances would
  // be empty.
  bool grows_alone() const { return grown && count <= kFewInstances; }
};

// How many numbers a box has.
inline constexpr std::uint32_t kBoxFloats = sizeof(BoxTile) / (kLanes * sizeof(float));

// Makes lanes point at `live` instances that follow each other, `stride` floats apart. The remaining lanes repeat the
// last instance.
inline void point_lanes(const float* first, std::size_t stride, std::uint32_t live, const float* (&lanes)[kLanes]) {
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) lanes[lane] = first + (lane < live ? lane : live - 1) * stride;
}

inline bool is_rotated(const PoseTile& tile) { return tile.orientations[0] != nullptr; }

// Reads four floats of every instance, from float `skip + at` on, into raw[at] to raw[at + 3].
template <class V>
CAB_INLINE void read_quad(const float* const* from, std::size_t skip, std::uint32_t at, RawPoses& out) {
  for (std::uint32_t lane = 0; lane < kLanes; lane += kQuadRows<V>) {
    const float* rows[kQuadRows<V>];
    for (std::uint32_t i = 0; i < kQuadRows<V>; ++i) rows[i] = from[lane + i] + skip + at;
    float* const to[4] = {out.raw[at] + lane, out.raw[at + 1] + lane, out.raw[at + 2] + lane, out.raw[at + 3] + lane};
    transpose_quads<V>(rows, to);
  }
}

// Reads the `floats` floats of a pose. The seven floats of a quaternion and a translation are read as two quads that
// share one float.
template <class V>
CAB_INLINE void read_raw(const float* const* from, std::size_t skip, std::uint32_t floats, RawPoses& out) {
  for (std::uint32_t at = 0; at + 4 <= floats; at += 4) read_quad<V>(from, skip, at, out);
  if (floats % 4 != 0) read_quad<V>(from, skip, floats - 4, out);
}

// Columns of the rotation of a quaternion of any length. They are orthonormal to rounding, and need no square root.
template <class V>
CAB_INLINE void quaternion_columns(V x, V y, V z, V w, V length_sq, Vec3<V> (&column)[3]) {
  const V s = divide(V(2.0f), length_sq);
  const V sx = s * x, sy = s * y, sz = s * z;
  const V one(1.0f);
  column[0] = {one - (sy * y + sz * z), sx * y + sz * w, sx * z - sy * w};
  column[1] = {sx * y - sz * w, one - (sx * x + sz * z), sy * z + sx * w};
  column[2] = {sx * z + sy * w, sy * z - sx * w, one - (sx * x + sy * y)};
}

template <class V>
CAB_INLINE Vec3<V> rotate(const Vec3<V> (&column)[3], Vec3<V> p) {
  return p.x * column[0] + p.y * column[1] + p.z * column[2];
}

// One Newton step to unit length and one Gram-Schmidt step. If the axes are within 1e-3 of orthonormal, they are
// orthonormal to rounding after two calls; if they are within 1e-6, after one call. In double four calls suffice.
template <class V>
CAB_INLINE void polish(Vec3<V> (&axis)[3]) {
  const V c(1.5f), h(0.5f);
  axis[0] = (c - h * dot(axis[0], axis[0])) * axis[0];
  axis[1] = axis[1] - dot(axis[1], axis[0]) * axis[0];
  axis[1] = (c - h * dot(axis[1], axis[1])) * axis[1];
  axis[2] = cross(axis[0], axis[1]);
}

// True lanes hold a rotation, mirrored or not, within kRigidTolerance.
template <class V>
CAB_INLINE Mask<V> is_rigid(const Vec3<V> (&c)[3]) {
  const V tolerance(kRigidTolerance), one(1.0f);
  Mask<V> ok = abs(dot(c[0], c[0]) - one) <= tolerance;
  for (int k = 1; k < 3; ++k) ok = both(ok, abs(dot(c[k], c[k]) - one) <= tolerance);
  return both(ok, both(both(abs(dot(c[0], c[1])) <= tolerance, abs(dot(c[0], c[2])) <= tolerance),
                       abs(dot(c[1], c[2])) <= tolerance));
}

// A leaf box of one link in the instance's frame, right-handed even if the link is mirrored. local: the box in the
// link's frame. body: the padding without the part that depends on the link's translation.
// translation: the padding per unit of that translation.
template <class V, class T>
CAB_INLINE BoxLanes<V> pose_box(const RigidLanes<V>& pose, const BoxLanes<V>& local, V body, T translation) {
  BoxLanes<V> box;
  for (int k = 0; k < 3; ++k) box.axis[k] = rotate(pose.column, local.axis[k]);
  polish(box.axis);
  box.center = pose.translation + rotate(pose.column, local.center);
  const V pad = body + V(translation) * max_component(abs(pose.translation));
  box.half = {local.half.x + pad, local.half.y + pad, local.half.z + pad};
  return box;
}

// A posed leaf box, padded so that it contains the exactly posed box and every point within the margin of it.
template <class V>
CAB_INLINE BoxLanes<V> pose_box(const RigidLanes<V>& pose, const Box& local, PosePad by, V margin) {
  const float size = local.half[0] + local.half[1] + local.half[2];
  const float out = std::fabs(local.center[0]) + std::fabs(local.center[1]) + std::fabs(local.center[2]);
  return pose_box<V>(pose, spread_box<V>(local), V(by.body * (size + out) + kMergePadTiny) + margin, by.translation);
}

// PosePad of every lane.
template <class V>
struct PosePads {
  V body, translation;
};

// The same with a different local box in every lane. by: PosePad or PosePads.
template <class V, class Pads>
CAB_INLINE BoxLanes<V> pose_boxes(const RigidLanes<V>& pose, const BoxLanes<V>& local, Pads by, V margin) {
  const Vec3<V> away = abs(local.center);
  const V size = local.half.x + local.half.y + local.half.z, out = away.x + away.y + away.z;
  return pose_box<V>(pose, local, (V(by.body) * (size + out) + V(kMergePadTiny)) + margin, by.translation);
}

// The same with lengths of the local boxes multiplied by the scale of the pose.
template <class V, class Pads>
CAB_INLINE BoxLanes<V> pose_scaled_boxes(const RigidLanes<V>& pose, BoxLanes<V> local, Pads by, V margin) {
  local.center = pose.scale * local.center;
  local.half = pose.scale * local.half;
  return pose_boxes(pose, local, by, margin);
}

// True lanes have every number within a limit (kMaxCoordinate unless `most` says otherwise), so no NaN and no infinity.
template <class V>
CAB_INLINE Mask<V> number_in_range(V v) {
  return abs(v) <= V(kMaxCoordinate);
}
template <class V>
CAB_INLINE Mask<V> in_range(Vec3<V> p, V most = V(kMaxCoordinate)) {
  return both(both(abs(p.x) <= most, abs(p.y) <= most), abs(p.z) <= most);
}

// The checks that lanes have passed so far. finite: every number read was finite and in range. rigid: every rotation
// was rigid. in_range: every number computed was in range.
template <class V>
struct LaneChecks {
  Mask<V> finite, rigid, in_range;
};

// Rotation columns of a quaternion, from raw floats.
template <class V>
CAB_INLINE void read_quaternion(const RawPoses& poses, std::uint32_t lane, LaneChecks<V>& checks,
                                Vec3<V> (&column)[3]) {
  const V x = Lanes<V>::load(poses.raw[0] + lane), y = Lanes<V>::load(poses.raw[1] + lane);
  const V z = Lanes<V>::load(poses.raw[2] + lane), w = Lanes<V>::load(poses.raw[3] + lane);
  const V length_sq = (x * x + y * y) + (z * z + w * w);
  checks.finite = both(
      checks.finite, both(both(number_in_range(x), number_in_range(y)), both(number_in_range(z), number_in_range(w))));
  checks.rigid = both(checks.rigid, both(length_sq >= V(kQuaternionSqMin), length_sq <= V(kQuaternionSqMax)));
  quaternion_columns(x, y, z, w, length_sq, column);
}

// Takes a scale that is out of range, or a NaN, for a rotation that is not rigid.
template <class V>
CAB_INLINE void check_scale(V scale, LaneChecks<V>& checks) {
  checks.rigid = both(checks.rigid, both(scale >= V(kMinScale), scale <= V(kMaxScale)));
}

// Makes a rotation, a translation and a scale from the raw floats of one link. The scale is 1 unless matrices hold it.
template <class V>
CAB_INLINE RigidLanes<V> link_pose(const RawPoses& poses, PoseCoding coding, std::uint32_t lane,
                                   LaneChecks<V>& checks) {
  const auto at = [&](int f) { return Lanes<V>::load(poses.raw[f] + lane); };
  const PoseFormat format = coding.format;
  RigidLanes<V> out;
  out.scale = V(1.0f);
  if (format == PoseFormat::kQuaternionTranslation) {
    read_quaternion(poses, lane, checks, out.column);
    out.translation = {at(4), at(5), at(6)};
  } else {
    const int step = format == PoseFormat::kMatrix3x4Rows ? 1 : 4;  // floats from one column to the next
    const int down = format == PoseFormat::kMatrix3x4Rows ? 4 : 1;  // floats from one row to the next
    for (int k = 0; k < 3; ++k) out.column[k] = {at(k * step), at(k * step + down), at(k * step + 2 * down)};
    out.translation = {at(3 * step), at(3 * step + down), at(3 * step + 2 * down)};
    checks.finite =
        both(checks.finite, both(in_range(out.column[0]), both(in_range(out.column[1]), in_range(out.column[2]))));
    if (coding.scaling == Scaling::kInMatrices) {
      out.scale = sqrt(dot(out.column[0], out.column[0]));
      check_scale(out.scale, checks);
      const V by = divide(V(1.0f), out.scale);
      for (Vec3<V>& column : out.column) column = by * column;
    }
    checks.rigid = both(checks.rigid, is_rigid(out.column));
    const V hand = select(dot(cross(out.column[0], out.column[1]), out.column[2]) < V(0.0f), V(-1.0f), V(1.0f));
    for (int i = 0; i < (kIsDouble<V> ? 4 : 2); ++i) polish(out.column);
    out.column[2] = hand * out.column[2];  // polish leaves a right-handed frame
  }
  checks.finite = both(checks.finite, in_range(out.translation));
  return out;
}

// Replaces masked lanes by a box of size 0 at the instance's origin, so that none of their numbers reaches another
// lane.
template <class V>
CAB_INLINE void clear_lanes(BoxTile& tile, std::uint32_t lane, Mask<V> keep) {
  const V zero(0.0f), one(1.0f);
  const Vec3<V> none = {zero, zero, zero};
  BoxLanes<V> box = load_box<V>(tile, lane);
  box.center = choose<V>(keep, box.center, none);
  box.half = choose<V>(keep, box.half, none);
  box.axis[0] = choose<V>(keep, box.axis[0], {one, zero, zero});
  box.axis[1] = choose<V>(keep, box.axis[1], {zero, one, zero});
  box.axis[2] = choose<V>(keep, box.axis[2], {zero, zero, one});
  store_box(tile, lane, box);
}

// The same for few instances with leaves as lanes. keep: bits of the instances from the first on that are not masked.
template <class V>
CAB_INLINE void clear_alone(const PoseTile& args, std::uint32_t first, std::uint32_t keep) {
  const std::uint32_t tiles = tile_count(args.articulation->leaf_count);
  for (std::uint32_t i = first; i < args.count && i < first + kWidth<V>; ++i)
    for (std::uint32_t tile = i * tiles; !(keep >> (i - first) & 1) && tile < (i + 1) * tiles; ++tile)
      for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
        clear_lanes<V>(args.leaves[tile], lane, MaskFromBits<V>::get(0));
}

// What places sixteen instances besides the poses of their links.
struct Placing {
  PoseCoding coding;
  const RawPoses* rotations;  // the orientations, or null if instances have none
  const float* scales;        // by lane, with Scaling::kPerInstance
};

// Scales a link's pose with its instance, and rotates it by the instance's orientation.
template <class V>
CAB_INLINE RigidLanes<V> place(RigidLanes<V> pose, const Placing& placing, std::uint32_t lane, LaneChecks<V>& checks) {
  if (placing.coding.scaling == Scaling::kPerInstance) {
    pose.scale = Lanes<V>::load(placing.scales + lane);
    check_scale(pose.scale, checks);
    pose.translation = pose.scale * pose.translation;
  }
  const RawPoses* const rotations = placing.rotations;
  if (rotations) {
    Vec3<V> turn[3];
    read_quaternion(*rotations, lane, checks, turn);
    for (int k = 0; k < 3; ++k) pose.column[k] = rotate(turn, pose.column[k]);
    pose.translation = rotate(turn, pose.translation);
  }
  return pose;
}

// A link's pose in the instance's frame, scaled, and rotated by the instance's orientation.
template <class V>
CAB_INLINE RigidLanes<V> placed_pose(const RawPoses& raw, const Placing& placing, std::uint32_t lane,
                                     LaneChecks<V>& checks) {
  return place(link_pose(raw, placing.coding, lane, checks), placing, lane, checks);
}

// The padding of posed leaf boxes. rotated: whether instances have orientations. pads: PoseTile::pads.
CAB_INLINE PosePad pad_of(bool rotated, float pads) {
  const float body = rotated ? kPosePadRotated.body : kPosePad.body;
  const float translation = rotated ? kPosePadRotated.translation : kPosePad.translation;
  return {body * pads, translation * pads};
}

// How the leaf boxes of a tile are posed: those of the articulation, these scaled, these grown with the skin and
// scaled, or PoseTile::own_boxes.
enum class PosedAs : std::uint8_t { kGiven, kScaled, kSkinned, kOwn };

// Writes where the links that move a link's leaves are, seen from that link.
template <class V>
CAB_INLINE void look_at_relatives(const PoseTile& args, std::uint32_t link, std::uint32_t lane) {
  const Articulation& articulation = *args.articulation;
  const SkinnedLeaves& skin = articulation.skin;
  const RigidLanes<V> base = load_motion<V>(args.skin[link], lane);
  const std::uint32_t begin = skin.relative_begin[link], end = skin.relative_begin[link + 1];
  for (std::uint32_t r = begin; r < end; ++r)
    store_motion(args.skin[articulation.link_count + r - begin], lane,
                 relative_pose(base, load_motion<V>(args.skin[skin.relatives[r]], lane)));
}

// A leaf's box in its link's frame, with room for what other links do to its vertices.
template <class V>
CAB_INLINE BoxLanes<V> grown_leaf(const PoseTile& args, std::uint32_t leaf, std::uint32_t lane) {
  const SkinnedLeaves& skin = args.articulation->skin;
  const std::uint32_t begin = skin.influence_begin[leaf], end = skin.influence_begin[leaf + 1];
  const Box& local = args.articulation->leaf_box[leaf];
  BoxLanes<V> out = spread_box<V>(local);
  if (begin == end) return out;
  if (args.grows_alone()) {
    out.center = load3<V>(args.grown[leaf].center, lane);
    out.half = load3<V>(args.grown[leaf].half, lane);
    return out;
  }
  const MotionTile* const relatives = args.skin + args.articulation->link_count;
  const GrownLanes<V> grown =
      grow_box<V>(local, {skin.influences.data + begin, end - begin}, skin.own[leaf],
                  [&](std::uint32_t relative) { return load_motion<V>(relatives[relative], lane); });
  out.center = grown.center;
  out.half = grown.half;
  return out;
}

// Grows the boxes of few instances. The last one comes first, since its boxes go to the lanes after it too.
template <class V>
CAB_INLINE void grow_few(const PoseTile& args) {
  const Articulation& articulation = *args.articulation;
  float* const relatives = args.skin_rows + std::size_t{kRowFloats} * articulation.link_count;
  for (std::uint32_t left = args.count; left > 0; --left) {
    const std::uint32_t lane = left - 1;
    for (const PosedLink& posed : articulation.posed_links)
      write_row(args.skin[posed.link], lane, args.skin_rows + std::size_t{kRowFloats} * posed.link);
    write_relatives<V>(articulation.skin, args.skin_rows, relatives);
    grow_lane<V>(articulation.skin, relatives, lane, left == args.count, args.grown);
  }
}

// Poses the leaves of one of few instances, leaves as lanes, to the same bits. The poses of its links were checked.
// Returns whether all its boxes are in range.
template <class V>
CAB_INLINE bool pose_alone(const PoseTile& args, const RawPoses& rotations, std::uint32_t instance) {
  const Articulation& articulation = *args.articulation;
  const Placing placing = {args.coding, is_rotated(args) ? &rotations : nullptr, args.scales};
  float* const relatives = args.skin_rows + std::size_t{kRowFloats} * articulation.link_count;
  const auto row_of = [&args](std::uint32_t link) { return args.skin_rows + std::size_t{kRowFloats} * link; };
  for (const PosedLink& posed : articulation.posed_links)
    write_row(args.skin[posed.link], instance, row_of(posed.link));
  write_relatives<V>(articulation.skin, args.skin_rows, relatives);
  LaneChecks<float> checks = {true, true, true};  // not read
  for (const PosedLink& posed : articulation.posed_links) {
    float* const row = row_of(posed.link);
    store_rows(place(load_motion<float>(args.skin[posed.link], instance), placing, instance, checks), &row);
  }
  BoxTile* const tiles = args.leaves + std::size_t{instance} * tile_count(articulation.leaf_count);
  const PosePad pad = pad_of(is_rotated(args), args.pads);
  const V margin = V(args.margins[instance]) * V(args.pads), range(args.range);
  bool all_in_range = true;
  grow_alone<V>(articulation.skin, relatives, [&](const LeavesFrom<V>& leaves, const GrownLanes<V>& grown) {
    const LeafLanes& block = leaves.block;
    const float* rows[kWidth<V>];
    for (std::uint32_t i = 0; i < kWidth<V>; ++i) rows[i] = row_of(block.link[leaves.lane + i]);
    BoxLanes<V> box = {grown.center, {}, grown.half};
    for (int k = 0; k < 3; ++k) box.axis[k] = {leaves.axis(k, 0), leaves.axis(k, 1), leaves.axis(k, 2)};
    box = pose_scaled_boxes(load_rows<V>(rows), box, pad, margin);
    all_in_range =
        all_in_range && bits(both(in_range(box.center, range), in_range(box.half, range))) == (1u << kWidth<V>)-1;
    const V each[kBoxFloats] = {box.center.x,  box.center.y,  box.center.z,  box.axis[0].x, box.axis[0].y,
                                box.axis[0].z, box.axis[1].x, box.axis[1].y, box.axis[1].z, box.axis[2].x,
                                box.axis[2].y, box.axis[2].z, box.half.x,    box.half.y,    box.half.z};
    alignas(64) float numbers[kBoxFloats][kWidth<V>];
    for (std::uint32_t f = 0; f < kBoxFloats; ++f) Lanes<V>::store(numbers[f], each[f]);
    for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
      const std::uint32_t leaf = block.leaf[leaves.lane + i];
      float* const to = reinterpret_cast<float*>(tiles + leaf / kLanes) + leaf % kLanes;
      for (std::uint32_t f = 0; f < kBoxFloats; ++f) to[f * kLanes] = numbers[f][i];
    }
  });
  const std::uint32_t last = articulation.leaf_count - 1;
  float* const end = reinterpret_cast<float*>(tiles + last / kLanes);
  for (std::uint32_t f = 0; f < kBoxFloats; ++f)
    std::fill(end + f * kLanes + last % kLanes, end + (f + 1) * kLanes, end[f * kLanes + last % kLanes]);
  return all_in_range;
}

// Poses one link and its leaves in the lanes that V covers. raw: its pose; with a skin args.skin has it already.
template <PosedAs kAs, class V>
CAB_INLINE void pose_link(const PoseTile& args, const PosedLink& posed, const RawPoses& raw, const RawPoses& rotations,
                          std::uint32_t lane, LaneChecks<V>& checks) {
  const Articulation& articulation = *args.articulation;
  constexpr bool kSkinned = kAs == PosedAs::kSkinned, kScaled = kAs == PosedAs::kScaled || kSkinned;
  const PoseCoding coding = {args.coding.format, kScaled ? args.coding.scaling : Scaling::kNone};
  const Placing placing = {coding, is_rotated(args) ? &rotations : nullptr, args.scales};
  RigidLanes<V> pose;
  if constexpr (kSkinned) {
    pose = place(load_motion<V>(args.skin[posed.link], lane), placing, lane, checks);
    if (!args.grows_alone()) look_at_relatives<V>(args, posed.link, lane);
  } else {
    pose = placed_pose(raw, placing, lane, checks);
  }
  if (args.motions) store_motion(args.motions[posed.link], lane, pose);
  if (posed.needs_joint) {
    const float* joint = articulation.link_joint.data + 3 * posed.link;
    Vec3<V> own = {V(joint[0]), V(joint[1]), V(joint[2])};
    if (kScaled) own = pose.scale * own;
    const Vec3<V> at = pose.translation + rotate<V>(pose.column, own);
    checks.in_range = both(checks.in_range, in_range(at));
    store3(args.joints[posed.link].at, lane, at);
  }
  if (kSkinned && args.leaves_are_lanes) return;
  const PosePad pad = pad_of(is_rotated(args), args.pads);
  const V margin = Lanes<V>::load(args.margins + lane) * V(args.pads);
  for (std::uint32_t i = posed.leaf_begin; i < posed.leaf_end; ++i) {
    const std::uint32_t leaf = articulation.leaf_order[i];
    const Box& local = articulation.leaf_box[leaf];
    BoxLanes<V> box;
    if constexpr (kAs == PosedAs::kGiven)
      box = pose_box(pose, local, pad, margin);
    else if constexpr (kSkinned)
      box = pose_scaled_boxes(pose, grown_leaf<V>(args, leaf, lane), pad, margin);
    else if constexpr (kScaled)
      box = pose_scaled_boxes(pose, spread_box<V>(local), pad, margin);
    else
      box = pose_boxes(pose, load_box<V>(*args.own_boxes, lane), pad, margin);
    checks.in_range =
        both(checks.in_range, both(in_range(box.center, V(args.range)), in_range(box.half, V(args.range))));
    store_box(args.leaves[leaf], lane, box);
  }
}

// Writes the flags of the lanes that V covers. Returns whether all of these lanes take part.
template <class V>
CAB_INLINE bool write_flags(const LaneChecks<V>& checks, std::uint8_t* flags) {
  const std::uint32_t finite = bits(checks.finite), rigid = bits(checks.rigid), in_range = bits(checks.in_range);
  bool all_ok = true;
  for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
    const bool not_rigid = (finite >> i & 1) && !(rigid >> i & 1);
    const bool ok = finite >> i & rigid >> i & in_range >> i & 1;
    flags[i] = ok ? kInstanceOk : not_rigid ? kInstanceNotRigid : kInstanceNotFinite;
    all_ok = all_ok && ok;
  }
  return all_ok;
}

// Replaces masked lanes of joints by 0 and of motions by the identity, as clear_lanes does for boxes.
template <class V>
CAB_INLINE void clear_links(const PoseTile& args, std::uint32_t lane, Mask<V> keep) {
  const V zero(0.0f), one(1.0f);
  const Vec3<V> none = {zero, zero, zero};
  const Vec3<V> world[3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
  for (const PosedLink& posed : args.articulation->posed_links) {
    auto& joint = args.joints[posed.link].at;
    if (posed.needs_joint) store3(joint, lane, choose<V>(keep, load3<V>(joint, lane), none));
    if (!args.motions) continue;
    MotionTile& motion = args.motions[posed.link];
    store3(motion.translation, lane, choose<V>(keep, load3<V>(motion.translation, lane), none));
    Lanes<V>::store(motion.scale + lane, select(keep, Lanes<V>::load(motion.scale + lane), one));
    for (int c = 0; c < 3; ++c)
      store3(motion.column[c], lane, choose<V>(keep, load3<V>(motion.column[c], lane), world[c]));
  }
}

// Returns the poses of one link. raw: room for them.
template <class V>
CAB_INLINE const RawPoses& read_link(const PoseTile& args, std::uint32_t link, RawPoses& raw) {
  if (args.links) return args.links[link];
  const std::uint32_t floats = pose_floats(args.coding.format);
  read_raw<V>(args.poses, link * args.link_stride, floats, raw);
  if (!args.later) return raw;
  RawPoses later;
  read_raw<V>(args.later->poses, link * args.link_stride, floats, later);
  blend_poses<V>(later, args.later->part, floats, raw);
  return raw;
}

// Reads the orientations of the instances.
template <class V>
CAB_INLINE void read_orientations(const PoseTile& args, RawPoses& rotations) {
  constexpr std::uint32_t kFloats = 4;
  read_raw<V>(args.orientations, 0, kFloats, rotations);
  if (!args.later) return;
  RawPoses later;
  read_raw<V>(args.later->orientations, 0, kFloats, later);
  blend_poses<V>(later, args.later->part, kFloats, rotations);
}

template <PosedAs kAs, class V>
void pose_tile(const PoseTile& args) {
  const Articulation& articulation = *args.articulation;
  const Mask<V> yes = V(0.0f) <= V(0.0f);
  LaneChecks<V> checks[kLanes / kWidth<V>];
  for (auto& check : checks) check = {yes, yes, yes};
  RawPoses raw, rotations;
  if (is_rotated(args)) read_orientations<V>(args, rotations);

  constexpr bool kSkinned = kAs == PosedAs::kSkinned;
  for (std::size_t i = 0; kSkinned && i < articulation.posed_links.size; ++i) {
    const std::uint32_t link = articulation.posed_links[i].link;
    const RawPoses& poses = read_link<V>(args, link, raw);
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
      store_motion(args.skin[link], lane, link_pose(poses, args.coding, lane, checks[lane / kWidth<V>]));
  }
  const bool alone = kSkinned && args.leaves_are_lanes;
  if (kSkinned && !alone && args.grows_alone()) grow_few<V>(args);
  for (const PosedLink& posed : articulation.posed_links) {
    const RawPoses& link = kSkinned ? raw : read_link<V>(args, posed.link, raw);
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
      pose_link<kAs>(args, posed, link, rotations, lane, checks[lane / kWidth<V>]);
  }
  for (std::uint32_t i = 0; alone && i < args.count; ++i)
    if (!pose_alone<V>(args, rotations, i)) {
      Mask<V>& in_range = checks[i / kWidth<V>].in_range;
      in_range = both(in_range, MaskFromBits<V>::get(~(1u << i % kWidth<V>)));
    }

  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const LaneChecks<V>& check = checks[lane / kWidth<V>];
    if (write_flags(check, args.flags + lane)) continue;
    const Mask<V> keep = both(check.finite, both(check.rigid, check.in_range));
    if (alone)
      clear_alone<V>(args, lane, bits(keep));
    else
      for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf)
        clear_lanes<V>(args.leaves[leaf], lane, keep);
    clear_links<V>(args, lane, keep);
  }
}

template <class V>
void pose_leaves(const PoseTile& args) {
  if (args.own_boxes)
    pose_tile<PosedAs::kOwn, V>(args);
  else if (!args.articulation->skin.empty())
    pose_tile<PosedAs::kSkinned, V>(args);
  else if (args.coding.scaling == Scaling::kNone)
    pose_tile<PosedAs::kGiven, V>(args);
  else
    pose_tile<PosedAs::kScaled, V>(args);
}

}  // namespace cab::kernel
