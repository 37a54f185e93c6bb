// The exact test of each value of Exact.
#include "engine/exact/exact.h"

#include "engine/exact/convex.h"
#include "engine/exact/fcl.h"

namespace cab {

const ExactTest* find_exact_test(Exact exact) {
  static constexpr ExactTest kConvex = {nullptr, convex_contacts};
  switch (exact) {
    case Exact::kNone: return nullptr;
    case Exact::kFcl: return fcl_test();
    case Exact::kConvex:
    case Exact::kSurface: return &kConvex;
  }
  return nullptr;
}

}  // namespace cab
