// Queries, as `cab peers --queries` asks a peer: worlds that are updated from posed boxes, and then answer.
#pragma once

#include <cab/query.h>

#include <compare>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "perf/measure/peers/crowd_leaves.h"
#include "perf/measure/peers/leaf_boxes.h"

namespace cab::perf {

// The leaf boxes of a crowd in the world, by the numbers of leaves. All peers are given the same; posing is not timed.
struct PosedBoxes {
  explicit PosedBoxes(const scenes::Crowd& crowd) : leaves(crowd), boxes(leaves.leaf_count()) {}
  CrowdLeaves leaves;
  std::vector<WorldBox<float>> boxes;
};

// A ray, a sphere or a point, as peers take it: in float.
struct PeerQuery {
  float at[3];
  float direction[3];  // of a ray, of length 1
  float reach;         // the length of a ray, the radius of a sphere
};

// Queries of one kind: closest hits of rays, all leaves that overlap spheres, or the leaves that are nearest to points.
struct QuestionSet {
  QueryKind kind;
  std::vector<Query> ours;       // as cab takes them
  std::vector<PeerQuery> peers;  // the same
};

// A query and a leaf that it meets.
struct Overlap {
  std::uint32_t query;
  std::uint32_t leaf;
  auto operator<=>(const Overlap&) const = default;
};

inline constexpr float kNoHit = std::numeric_limits<float>::infinity();

// What a world answered. Rays and points: of each query the distance, kNoHit if there is none, and the leaf. Spheres:
// all overlaps, in any order.
struct Answers {
  std::vector<float> distances;
  std::vector<std::uint32_t> leaves;
  std::vector<Overlap> overlaps;

  // Parts of the time of the call, in processor seconds: sorting the queries; for cab, posing and making the index.
  double sort_seconds = 0, update_seconds = 0;

  void clear(std::size_t queries) {
    distances.assign(queries, kNoHit);
    leaves.assign(queries, 0);
    overlaps.clear();
    sort_seconds = update_seconds = 0;
  }
};

// One way to ask a world.
struct QueryMode {
  QueryKind kind;
  std::string name;  // empty: the set-up has no other for this kind
  std::string meaning;
  bool candidates = false;  // it gives leaves whose bounds meet the sphere's, so false hits are expected
};

class CrowdQueries {
 public:
  virtual ~CrowdQueries() = default;
  virtual void update(const PosedBoxes& posed) = 0;  // timed
  virtual void prepare(std::size_t mode);            // not timed: what comes before a call of answer
  // Timed. `out` is cleared for the queries.
  virtual void answer(std::size_t mode, const QuestionSet& asked, Answers& out) = 0;

 protected:
  // Clears `out`, and returns the indices of the queries as they come or, sorted, as neighbours in a Morton curve
  // through their places and, in one place, by the octant of a ray's direction. The sort is timed.
  const std::vector<std::uint32_t>& begin(const QuestionSet& asked, bool is_sorted, Answers& out);

 private:
  std::vector<std::uint32_t> order_;
};
inline void CrowdQueries::prepare(std::size_t) {}

// A set-up of a peer for queries. alone: the library answers by its own tests of boxes.
struct QuerySetup {
  std::string name;
  bool alone;
  std::string meaning;
  std::vector<QueryMode> modes;
  std::function<std::unique_ptr<CrowdQueries>(const PosedBoxes&)> make;
};

}  // namespace cab::perf
