// Static bodies: what the engine knows of them from when they are added, and what it gives frames instead of the
// caller's poses. Everything else treats them as characters of one leaf that always rest.
#pragma once

#include "engine/exact/fcl.h"
#include "engine/step/instance_batch.h"
#include "engine/step/stored_batch.h"
#include "kernels/kernel_table.h"
#include "layout/arena.h"
#include "layout/convex_shapes.h"
#include "layout/link_bounds.h"

#include <memory>

namespace cab {

struct StaticBodies {
  explicit StaticBodies(const Allocator& allocator) : arena(allocator) {}

  // What the caller gives for one call, with what is known: poses, origins, that no body has moved, and, if by_bounds,
  // bounds.
  BatchInput complete(const BatchInput& given, bool by_bounds) const;

  // Says in `moved` which of the bodies that a frame gives are on other layers, or have another mask, than in the last
  // frame that gave them. Called once in every frame with these bodies.
  void note_layers(const InstanceBatch& batch);

  // Makes room for `count` bodies, on all layers.
  void allocate_per_body(std::size_t count);

  Arena arena;               // owns all arrays below
  Articulation one;          // one link with one leaf, whose box and shape stand for those of any body
  LinkBounds link_bounds;    // of `one`
  Articulation leaves;       // every body as a leaf, as build_leaves makes them
  Span<float> poses;         // per body, PoseFormat::kQuaternionTranslation
  Span<double> origins;      // per body x y z
  Span<std::uint8_t> moved;  // per body whether its layers have changed: nothing else can
  Span<float> bounds;        // per body, as BatchInput::bounds
  ConvexShapes convex_shapes;
  std::unique_ptr<FclShapes, FclShapesDelete> fcl_shapes;

 private:
  Span<std::uint32_t> last_layers_, last_masks_;  // per body, in the last frame that gave it
  bool has_layers_ = false;                       // whether these may be others than all bits, or a body has moved
};

// No bodies yet. Throws std::bad_alloc.
StaticBodiesPtr make_static_bodies(const Allocator& allocator);

// Checks desc and builds *out from it. On an error *bad_element (if not null) receives the index of the body at fault.
// Throws std::bad_alloc.
Status build_static_bodies(const StaticDesc& desc, const kernel::KernelTable& kernels, StaticBodies* out,
                           std::uint32_t* bad_element);

}  // namespace cab
