// Random queries about a scene, by regimes that are hard, and random shapes and sizes for worlds to ask about.
#pragma once

#include "perf/judge/oracle/query_judge.h"
#include "perf/judge/oracle/random.h"

#include <list>
#include <vector>

namespace cab::oracle {

// What makes a query hard. Lengths are in sizes of a leaf that is chosen at random, which about half of all queries
// meet.
enum class QueryRegime : std::uint8_t {
  kAimed,     // begins 0.1 to 10 sizes away
  kGrazing,   // at a face, an edge or a corner, within 300 u of touching; all that it has is along or across the axes
  kParallel,  // a ray along an axis of the box, a shape and planes with its axes, beside a face or on it
  kInside,    // begins inside, in the middle, or on a face
  kShort,     // a length of 0 or near it, sometimes without a direction; no radius, no half extents, one of them 0
  kFar,       // begins 1e3 to 1e9 sizes away
  kHuge,      // radii and half extents of 1e2 to 1e6 sizes
  kTiny,      // of 1e-6 to 1e-2 sizes
  kThin,      // half extents that differ by 1e2 to 1e6: needles and plates
  kNowhere,   // anywhere within 1e30 of the world's origin, with numbers of any size
};
inline constexpr unsigned kQueryRegimeCount = 10;

// Queries, and the planes of their regions.
struct RandomQueries {
  std::vector<Query> queries;
  std::vector<QueryPlane> planes;
};

// Adds a query of a regime about a scene with at least one leaf. All of its numbers are valid.
void add_query(Random& random, const QueryScene& scene, QueryRegime regime, QueryKind kind, RandomQueries& out);

// Adds queries of all regimes and kinds.
void add_queries(Random& random, const QueryScene& scene, std::uint32_t count, RandomQueries& out);

// The lists of parts of rigs, and the vertices of hulls, which must outlive the rigs.
struct KeptParts {
  std::list<std::vector<ConvexPart>> parts;
  std::list<std::vector<float>> vertices;
};

// Gives most leaves of a rig, whose half extents are above 0, one to three convex parts of any kind within their boxes.
void add_parts(Random& random, Rig& rig, KeptParts& kept);

// Makes some leaves plates, segments or points.
void flatten_leaves(Random& random, Rig& rig);

// Multiplies all lengths of a rig and its poses, but for has_scale and scales, by a factor.
void resize(double factor, Rig& rig, Poses& poses);

// Turns the third column of the matrices of some links round.
void mirror_links(Random& random, Poses& poses);

}  // namespace cab::oracle
