// The exact test of two leaves, by FCL on their convex parts.
#pragma once

#include "layout/articulation.h"
#include "layout/instance_batch.h"

#include <memory>

namespace cab {

// FCL's shapes of an articulation's leaves, shared by all instances.
class ExactShapes;
struct ExactShapesDelete {
  void operator()(ExactShapes*) const;
};

// Builds the shapes of every leaf (no parts: the leaf box). Returns kBadShape and the leaf's index when a hull has
// no volume.
Status make_exact_shapes(const Articulation& articulation, std::unique_ptr<ExactShapes, ExactShapesDelete>* out,
                         std::uint32_t* bad_leaf);

// One leaf of one instance, as a frame has bound it.
struct ExactLeaf {
  const ExactShapes* shapes;
  const InstanceBatch* batch;
  std::uint32_t instance;
  std::uint32_t leaf;
};

// True when some part of a touches some part of b, or, with a margin above 0, unless every part of a is shown to be
// farther than that from every part of b. A query that FCL gives up on counts as touching.
bool leaves_touch(const ExactLeaf& a, const ExactLeaf& b, float margin);

// The deepest contact between the parts of a and of b, with a margin above 0 else their least gap; all 0 when FCL gives
// none.
Contact leaf_contact(const ExactLeaf& a, const ExactLeaf& b, float margin);

}  // namespace cab
