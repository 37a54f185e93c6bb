// Step 5 of a frame with Exact::kFcl: FCL on the convex parts of two leaves.
#pragma once

#include "engine/exact.h"
#include "layout/articulation.h"

#include <memory>

namespace cab {

// Deletes FclShapes, which only exact_fcl.cpp defines.
struct FclShapesDelete {
  void operator()(FclShapes*) const;
};

// Builds the shapes of every leaf of an articulation; all instances share them. The shape of a leaf without parts is
// its box. Any frame may use the exact test, so shapes are built for every articulation.
std::unique_ptr<FclShapes, FclShapesDelete> make_fcl_shapes(const Articulation& articulation);

// ExactTest::touch and ExactTest::contact. Two parts on which FCL gives up count as touching and have no contact.
bool fcl_leaves_touch(const ExactLeaf& a, const ExactLeaf& b, float margin);
Contact fcl_leaf_contact(const ExactLeaf& a, const ExactLeaf& b, float margin);

}  // namespace cab
