// The interface of exact tests, which confirm that two leaves with overlapping boxes touch. Each test has a file of its
// own.
#pragma once

#include "engine/step/frame_context.h"

namespace cab {

// The largest number of contacts that one call of an exact test writes.
inline constexpr std::uint32_t kContactsPerTask = 256;

// One leaf of one instance whose batch is bound to an input.
struct ExactLeaf {
  const FclShapes* fcl_shapes;        // of the batch's articulation, or of all its static bodies
  const ConvexShapes* convex_shapes;  // likewise
  const InstanceBatch* batch;
  std::uint32_t batch_index;
  std::uint32_t instance;  // index in the batch
  std::uint32_t leaf;      // index in the articulation
  std::uint32_t shape;     // index of its shapes: the leaf, or of a static body the instance
};

// One leaf of one instance of a frame.
inline ExactLeaf exact_leaf(const FrameContext& frame, std::uint32_t batch, std::uint32_t instance,
                            std::uint32_t leaf) {
  const StoredBatch& stored = *frame.batches[batch];
  return {stored.fcl_shapes,
          stored.convex_shapes,
          &stored.batch,
          batch,
          instance,
          leaf,
          is_static(stored.batch) ? instance : leaf};
}

// Writes the origin of b's instance less that of a's instance.
inline void origin_difference(const ExactLeaf& a, const ExactLeaf& b, double (&shift)[3]) {
  for (std::uint32_t c = 0; c < 3; ++c)
    shift[c] = origin_of(*b.batch, b.instance, c) - origin_of(*a.batch, a.instance, c);
}

// The margin of the instances of two leaves.
inline float margin_between(const ExactLeaf& a, const ExactLeaf& b, float frame_margin) {
  return margin_between(*a.batch, a.instance, *b.batch, b.instance, frame_margin);
}

struct ExactScratch;

// The functions of one exact test.
struct ExactTest {
  // Whether a part of a and a part of b touch. With a margin above 0: false only if the test shows that every part of a
  // is farther than the margin from every part of b. What the test cannot decide counts as touching. Null if pairs that
  // are reported have been tested already, many at a time (engine/exact/convex.h).
  bool (*touch)(const ExactLeaf& a, const ExactLeaf& b, float margin);

  // Writes contacts[i] for hits[i], up to kContactsPerTask of them: the deepest contact of all parts on the first link
  // with all parts on the second. If no two parts touch, it is the smallest gap, as a negative depth; FCL looks for it
  // only with a margin. Of equally deep contacts the one of the lowest leaves, then of the first parts. All fields but
  // the leaves are 0 if the test finds nothing. Reads of hits only their instances and links.
  void (*contacts)(const FrameContext& frame, Span<const Hit> hits, Contact* contacts, ExactScratch& scratch);
};

// Whether leaf pairs are tested in lists, many at a time (engine/exact/convex.h), and not one by one.
inline bool tests_lists(Exact exact) { return exact == Exact::kConvex || exact == Exact::kSurface; }

// Returns the test that a policy value names. Null for Exact::kNone, with which all leaves with overlapping boxes
// touch, and for a test that the library was built without.
const ExactTest* find_exact_test(Exact exact);

}  // namespace cab
