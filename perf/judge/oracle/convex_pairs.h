// Random pairs of convex parts, by regimes that are hard for an exact test in float.
#pragma once

#include "perf/judge/oracle/convex_certificate.h"
#include "perf/judge/oracle/random.h"

#include <cab/types.h>

#include <vector>

namespace cab::oracle {

// The regimes. Sizes are about 0.2 unless a regime says otherwise. Of all but kRegular and kUnits a tenth (of kNeedles
// and kPlates four tenths, since few of them touch by chance) are near:
// their gap is small, of either sign.
enum class ConvexRegime {
  kRegular,     // sizes that differ by up to six times, any pose
  kThin,        // needles and plates with aspects of up to 1e3
  kUnequal,     // one shape 10 to 1e3 times as large as the other
  kNear,        // gaps of 1e-2 to 1e-8 of the size; of half of the pairs, as far as double origins go, to 1e-13
  kConcentric,  // centres that coincide, or nearly so; the same shape twice
  kAligned,     // axes that are parallel, to 0 to 1e-3 rad
  kFar,         // links 20 to 1e5 sizes from the origin of their instance, instances 1e6 from the origin of the world
  kUnits,       // lengths of 1e-24 to 1e12
  kNeedles,     // two of three sizes 1e2 to 1e5 times smaller
  kPlates,      // one of three sizes 1e2 to 1e5 times smaller
  kNested,      // one shape 3 to 30 times as large as the other, which is often wholly inside
  kEqual,       // shapes of the same sizes; of one kind, the same shape, often with the same rotation
};
inline constexpr unsigned kConvexRegimeCount = 12;

// A part, its link's pose as a quaternion and a translation, and the vertices that the part refers to.
struct PosedPart {
  ConvexPart part;
  std::vector<float> vertices;
  float pose[7];
};

// One pair to test. shift: the origin of b's instance less that of a's instance.
struct ConvexCase {
  PosedPart a, b;
  double shift[3];
};

// The kinds of parts that cases have.
inline constexpr ShapeKind kCaseKinds[] = {ShapeKind::kBox,        ShapeKind::kEllipsoid, ShapeKind::kCapsule,
                                           ShapeKind::kConvexHull, ShapeKind::kSphere,    ShapeKind::kCylinder,
                                           ShapeKind::kHalfSpace};

// How the judge calls a kind of part.
JudgeKind judge_kind(ShapeKind kind);

// A random case of a regime, its parts of the given kinds. Every sixth hull is flat. The judge says nothing about two
// half spaces, so a case of two is near in no regime. A part's vertices belong to the case, so a copy must call
// bind_vertices.
ConvexCase make_convex_case(Random& random, ConvexRegime regime, ShapeKind kind_a, ShapeKind kind_b);

// Points the parts of a case at its own vertices.
void bind_vertices(ConvexCase& made);

// The shapes of a case as the judge takes them, relative to the origin of a's instance.
class JudgedShapes {
 public:
  explicit JudgedShapes(const ConvexCase& made);
  JudgedShapes(const JudgedShapes&) = delete;
  JudgedShapes& operator=(const JudgedShapes&) = delete;

 private:
  std::vector<Point> vertices_a_, vertices_b_;

 public:
  JudgeShape a, b;
};

// The judge's answer for a case, and the size that gaps are compared with: how far both shapes reach, and the distance
// of their centres.
struct JudgedCase {
  Verdict verdict;
  Real size;
};
JudgedCase judge_case(const ConvexCase& made, Effort effort);

}  // namespace cab::oracle
