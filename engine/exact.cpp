// Step 5 of a frame: the exact test of each value of Exact.
#include "engine/exact.h"

#include "engine/exact_fcl.h"

namespace cab {

const ExactTest* find_exact_test(Exact exact) {
  static constexpr ExactTest kFcl = {fcl_leaves_touch, fcl_leaf_contact};
  static constexpr ExactTest kConvex = {nullptr, fcl_leaf_contact};
  switch (exact) {
    case Exact::kNone: return nullptr;
    case Exact::kFcl: return &kFcl;
    case Exact::kConvex: return &kConvex;
  }
  return nullptr;
}

}  // namespace cab
