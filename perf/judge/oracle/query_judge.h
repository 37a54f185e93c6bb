// The judge of queries: by brute force in long double, between which bounds the right answer of each query lies, and
// whether an answered job is within them.
//
// A link must be found if a query meets one of its leaves as the caller gave it: its box, or its convex parts where the
// job asks for shapes. It may be found only if the query meets a leaf that has grown a little (QueryTolerance). The
// distance of a hit is at most that of the leaf as given, and at least that of the grown one.
//
// Where the API leaves a choice the judge takes both ways. A half space is met within its leaf's box, or wherever the
// query goes that meets the box. A ball that is moved along a ray begins inside a link if it overlaps the link.
#pragma once

#include "perf/harness/random_rig.h"
#include "perf/judge/oracle/query_shapes.h"

#include <cab/query.h>

#include <cstdint>
#include <string>
#include <vector>

namespace cab::oracle {

// How much leaves grow for what may be found, and how far off written numbers may be. docs/numerics.md pads a posed
// leaf's half extents by up to 56 u of S and |c|_1 and 48 u of t, and its axes and centre are off by as much again.
struct QueryTolerance {
  Real leaf = 0x1p-17L;     // of S + |c|_1 + |t|_1 of the leaf: 128 u
  Real query = 0x1p-17L;    // of the query's own lengths: its radius, the sum of its half extents
  Real apart = 0x1p-48L;    // of the distance of the query from the instance's origin, which is a difference in double
  Real written = 0x1p-22L;  // of a distance or a point that is written: 4 u
  Real normal = 0x1p-20L;   // of what a normal is off: 16 u
  Real shapes = 4;          // leaf and query are this many times as large where shapes are asked for
};

// A leaf where it is posed.
struct QueryLeaf {
  std::uint16_t link, leaf;
  Real lengths;  // S + |c|_1 + |t|_1
  QueryBody box;
  std::vector<QueryBody> parts;  // none: the box
};

struct QueryInstance {
  BatchSlot batch;
  std::uint32_t instance;
  std::uint32_t layers;
  Point origin;
  std::vector<QueryLeaf> leaves;
};

// All instances that a call looks at. Those that are masked, or have no input, are not in it.
using QueryScene = std::vector<QueryInstance>;

// Instance `index` of `poses`, which hits name by `batch` and `index`.
QueryInstance query_instance(BatchSlot batch, const Rig& rig, const Poses& poses, std::uint32_t index,
                             std::uint32_t layers = 0xffffffff);

// What is known about a leaf or a link that a query may find.
struct JudgedHit {
  bool must = false;         // it is met as given
  bool must_inside = false;  // kRay, kPoint: and the query begins inside it, deeper than it may grow
  bool may_inside = false;   // the query begins inside it when it has grown
  Real least = 0, most = 0;  // of its distance; `most` is infinite unless it must be found
};

struct JudgedLeaf : JudgedHit {
  const QueryLeaf* leaf;
};

// A link that may be found.
struct JudgedLink : JudgedHit {
  const QueryInstance* instance;
  std::uint16_t link;
  std::vector<JudgedLeaf> leaves;  // those that may be found, in ascending order
};

// All links that a query may find, in the order of batch, instance and link. Points into the scene.
std::vector<JudgedLink> judge_query(const QueryScene& scene, const Query& query, Span<const QueryPlane> planes,
                                    Exact exact, const QueryTolerance& tolerance = {});

// Whether what run_queries wrote to a job that it answered by kOk is right. Empty if it is, else words that name a
// query, a link, and what is wrong. The job's inputs are not read: the scene stands for them.
std::string fault_of(const QueryScene& scene, const QueryJob& done, const QueryTolerance& tolerance = {});

// What is counted about the answer to one query.
struct QueryCounts {
  std::uint64_t must = 0;   // links that it must find
  std::uint64_t hits = 0;   // links that it has found
  std::uint64_t lost = 0;   // links that it must find and has not, though it wants them; 1 if they are not named
  std::uint64_t extra = 0;  // links that it has found and may not find; 1 if they are not named
  // kRay, kPoint: how far the point of a hit is from its leaf as given, or for a box how far the distance of a point is
  // off, in u of the lengths of leaf and query. What doubles cannot hold of the way there is left out.
  double off = 0;
  std::string fault;  // as of fault_of, which includes what is lost and what is extra
};

// The same for one query of a job. hits: those of the query, in the order of the job.
QueryCounts count_query(const QueryScene& scene, const QueryJob& done, std::size_t query, Span<const QueryHit> hits,
                        const QueryTolerance& tolerance = {});

// The least growth that a right job needs, in u: a power of two, for QueryTolerance::leaf and query alike, by which
// fault_of finds no fault. 0 if it needs none to speak of; infinite if the usual tolerance is not enough.
double needed_growth(const QueryScene& scene, const QueryJob& done);

}  // namespace cab::oracle
