// Exact tests: what confirms that two leaves touch once their boxes overlap. Each has a file of its own.
#pragma once

#include "layout/instance_batch.h"

namespace cab {

class FclShapes;

// One leaf of one instance, as a frame has bound it.
struct ExactLeaf {
  const FclShapes* fcl_shapes;
  const InstanceBatch* batch;
  std::uint32_t instance;
  std::uint32_t leaf;
};

// The functions of one exact test.
struct ExactTest {
  // True when some part of a touches some part of b, or, with a margin above 0, unless every part of a is shown to be
  // farther than that from every part of b. What the test cannot decide counts as touching.
  bool (*touch)(const ExactLeaf& a, const ExactLeaf& b, float margin);

  // The deepest contact between the parts of a and of b. With a margin above 0, and parts that are apart, their least
  // gap. All 0 when the test finds neither.
  Contact (*contact)(const ExactLeaf& a, const ExactLeaf& b, float margin);
};

// The test that a policy names; null for Exact::kNone, where overlapping boxes are the answer.
const ExactTest* find_exact_test(Exact exact);

}  // namespace cab
