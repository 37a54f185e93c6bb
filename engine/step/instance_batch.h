// A batch: storage for the instances of one articulation, and the input that the current call has bound to it.
#pragma once

#include "layout/error_bounds.h"
#include "layout/link_bounds.h"
#include "layout/pose_coding.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>

namespace cab {

// Bounds of an instance's leaf boxes in the world, in double.
struct InstanceBounds {
  double lo[3];
  double hi[3];
};

// Where an instance is in the world.
struct Placement {
  InstanceBounds bounds;
  double origin[3];
};

// An instance's hits in the engine's store, until they are written in order. They are a chain of groups, one group for
// each candidate whose first instance it is.
struct HitChain {
  static constexpr std::uint32_t kEnd = 0xffffffff;
  std::uint32_t head = kEnd;  // where the last added group begins
  std::uint32_t count = 0;    // of hits
};

// Bits of InstanceBatch::rest.
enum RestBit : std::uint8_t {
  kRests = 1,  // nothing of the instance has changed since the last frame
  kKept = 2,   // it is in the strips that are kept between frames
};

// What is stored of a batch.
struct StoredInstances {
  const Articulation* articulation = nullptr;
  const LinkBounds* link_bounds = nullptr;
  BatchKind kind = BatchKind::kCharacters;
  Span<const Box> own_boxes;   // static bodies: the leaf box of each instance; else empty
  std::uint32_t capacity = 0;  // BatchDesc::instance_count

  // Characters: all that is stored per instance. Boxes are made where they are tested.
  Span<InstanceBounds> bounds;
  Span<std::uint16_t> live;  // one word per tile, one bit per instance: set if it is not masked
  Span<HitChain> hit_chains;
  Span<std::size_t> stored_before;  // per task that writes hits: how many hits come before its own
  Span<std::uint8_t> rest;          // RestBits per instance, of the current frame; between frames of the last one
  bool has_rest = false;            // whether a rest bit may be set
  Span<std::uint64_t> checksums;    // checked builds: of what must not change while an instance rests
  std::uint64_t bounded_by = 0;     // number of the frame that `bounds` and `live` are of; 0: of none
  std::uint64_t rest_epoch = 0;     // RestState::epoch of the last frame with this batch; 0: none
  bool was_rotated = false;         // whether instances had orientations in that frame, and larger padding for them

  // Characters with a skin that one tile holds: room for their posed leaf boxes, and bounds of these.
  Span<BoxTile> leaf_boxes;
  Span<AabbTile> leaf_bounds;

  // Sequences: where this batch's hierarchy of one tile begins in a worker's memory.
  std::uint32_t worker_nodes = 0;
};

// What a call binds to a batch for as long as it runs. strategy: how characters are paired, never kAuto. active: the
// articulation whose leaves are bounded and compared first, which is that of its link boxes with kLinks, else the
// batch's own.
struct BoundInput {
  std::uint32_t instance_count = 0;  // BatchInput::count; between calls the capacity
  Strategy strategy = Strategy::kRows;
  const Articulation* active = nullptr;
  bool by_words = false;         // its leaves are paired by compact words (engine/frame/characters.h)
  bool is_round = false;         // a sequence whose links are paired as balls and capsules (engine/frame/sequences.h)
  bool by_states = false;        // a sequence whose poses are made with each tile, of BatchInput::states
  bool pairs_between = false;    // a rule tests its instances against others
  bool pairs_within = false;     // a rule tests the links of each instance against each other
  bool skips_within = false;     // not those of an instance that rests
  bool may_rest = false;         // its instances rest where BatchInput::moved says so
  bool keeps_boxes = false;      // the step `bound` leaves `leaf_boxes` for tests, by place among the given instances
  std::uint32_t first_task = 0;  // index of its first task in the current step
  const BatchInput* input = nullptr;
  Span<const float> margins;        // those of the input, or none where a call does not read them
  std::size_t link_stride = 0;      // bytes
  std::size_t instance_stride = 0;  // bytes
};

struct InstanceBatch : StoredInstances, BoundInput {};

// Whether the instances of a batch are static bodies.
inline bool is_static(const InstanceBatch& batch) { return !batch.own_boxes.empty(); }

// The box of a posed leaf of an instance, in its link's frame.
inline const Box& leaf_box_of(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t leaf) {
  return is_static(batch) ? batch.own_boxes[instance] : posed_articulation(*batch.articulation).leaf_box[leaf];
}

// How many instances are given in the current call.
inline std::uint32_t active_count(const InstanceBatch& batch) {
  const std::size_t listed = batch.input->instances.size;
  return listed ? static_cast<std::uint32_t>(listed) : batch.instance_count;
}

// The number of the instance that is given in the given place.
inline std::uint32_t active_instance(const InstanceBatch& batch, std::uint32_t place) {
  return batch.input->instances.empty() ? place : batch.input->instances[place];
}

// Whether nothing of an instance has changed since the last frame.
inline bool rests(const InstanceBatch& batch, std::uint32_t instance) { return batch.rest[instance] & kRests; }

// Whether an instance is given in the current call.
inline bool is_active(const InstanceBatch& batch, std::uint32_t instance) {
  const Span<const std::uint32_t> listed = batch.input->instances;
  return instance < batch.instance_count &&
         (listed.empty() || std::binary_search(listed.begin(), listed.end(), instance));
}

// Whether a refit makes axis-aligned boxes instead of oriented ones.
inline bool is_axis_aligned(Refit refit) { return refit == Refit::kAabbHull || refit == Refit::kAabbVertices; }

// The pose of a link of an instance, in the caller's layout.
inline const float* pose_of(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link = 0) {
  return batch.input->poses.data + instance * (batch.instance_stride / sizeof(float)) +
         link * (batch.link_stride / sizeof(float));
}

// The orientation of an instance in the world: null if the caller gave none.
inline const float* orientation_of(const InstanceBatch& batch, std::uint32_t instance) {
  const Span<const float> all = batch.input->orientations;
  return all.empty() ? nullptr : all.data + 4 * std::size_t{instance};
}

// How the poses of a batch are stored and scaled.
inline PoseCoding coding_of(const InstanceBatch& batch) {
  PoseCoding out = coding_of(batch.input->poses);
  if (!batch.input->scales.empty()) out.scaling = Scaling::kPerInstance;
  return out;
}

// The factor of an instance: 1 if the caller gave none.
inline float scale_of(const InstanceBatch& batch, std::uint32_t instance) {
  return batch.input->scales.empty() ? 1.0f : batch.input->scales[instance];
}

// An instance's own margin: 0 if the caller gave none.
inline double own_margin(const InstanceBatch& batch, std::uint32_t instance) {
  return batch.margins.empty() ? 0.0 : static_cast<double>(batch.margins[instance]);
}

// The margin of two instances: the frame's and their own.
inline float margin_between(const InstanceBatch& a, std::uint32_t instance_a, const InstanceBatch& b,
                            std::uint32_t instance_b, float frame_margin) {
  return rounded_up(static_cast<double>(frame_margin) + own_margin(a, instance_a) + own_margin(b, instance_b));
}

// The margin that the boxes of an instance are posed with: that of two instances like it, of which each has half
// (docs/proof.md, step 2.9).
inline float margin_of(const InstanceBatch& batch, std::uint32_t instance, float frame_margin) {
  return margin_between(batch, instance, batch, instance, frame_margin);
}

// By how much the half extents of an instance's boxes grow for margins.
inline float grown_by(const InstanceBatch& batch, std::uint32_t instance, float frame_margin) {
  return kMarginShare * (batch.margins.empty() ? frame_margin : margin_of(batch, instance, frame_margin));
}

inline StoredPose stored_pose(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link) {
  return {coding_of(batch), pose_of(batch, instance, link), orientation_of(batch, instance), scale_of(batch, instance)};
}

// One component of the origin of an instance in the world: 0 if the caller gave no origins.
inline double origin_of(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t component) {
  return batch.input->origins.empty() ? 0.0 : batch.input->origins[3 * static_cast<std::size_t>(instance) + component];
}

inline Placement placement_of(const InstanceBatch& batch, std::uint32_t instance) {
  return {batch.bounds[instance],
          {origin_of(batch, instance, 0), origin_of(batch, instance, 1), origin_of(batch, instance, 2)}};
}

// Whether the layers of two instances match: the layer of each is in the other's mask.
inline bool layers_match(const InstanceBatch& a, std::uint32_t instance_a, const InstanceBatch& b,
                         std::uint32_t instance_b) {
  const auto word = [](Span<const std::uint32_t> words, std::uint32_t at) { return words.empty() ? ~0u : words[at]; };
  return (word(a.input->layers, instance_a) & word(b.input->layer_masks, instance_b)) != 0 &&
         (word(b.input->layers, instance_b) & word(a.input->layer_masks, instance_a)) != 0;
}

}  // namespace cab
