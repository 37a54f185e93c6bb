// The exact test `fcl`: FCL on the convex parts of two leaves.
#pragma once

#include "engine/exact.h"
#include "layout/articulation.h"

#include <memory>

namespace cab {

struct FclShapesDelete {
  void operator()(FclShapes*) const;
};

// Builds FCL's shapes of every leaf (no parts: of the leaf's box), shared by all instances of the articulation. Any frame
// may ask for them, so they are built whatever the policies. Returns kBadShape and the leaf's index when a hull has no
// volume.
Status make_fcl_shapes(const Articulation& articulation, std::unique_ptr<FclShapes, FclShapesDelete>* out,
                       std::uint32_t* bad_leaf);

// ExactTest::touch and ExactTest::contact. A query that FCL gives up on counts as touching, without a contact.
bool fcl_leaves_touch(const ExactLeaf& a, const ExactLeaf& b, float margin);
Contact fcl_leaf_contact(const ExactLeaf& a, const ExactLeaf& b, float margin);

}  // namespace cab
