// Exact::kFcl: FCL on the convex parts of two leaves. A library without FCL is built with fcl_absent.cpp instead of
// fcl.cpp.
#pragma once

#include "engine/exact/exact.h"
#include "layout/articulation.h"

#include <memory>

namespace cab {

// Deletes FclShapes, which only fcl.cpp defines.
struct FclShapesDelete {
  void operator()(FclShapes*) const;
};

// Builds the shapes of every leaf of an articulation; all instances share them. The shape of a leaf without parts is
// its box. Any frame may use the exact test, so shapes are built for every articulation. Null without FCL.
std::unique_ptr<FclShapes, FclShapesDelete> make_fcl_shapes(const Articulation& articulation);

// Returns the exact test by FCL. Two parts on which FCL gives up count as touching and have no contact. Null without
// FCL.
const ExactTest* fcl_test();

}  // namespace cab
