// The plain data of queries: rays, shapes, points and regions that ask which links they meet. The call is run_queries
// in cab/cab.h. The conventions of cab/types.h hold here too.
#pragma once

#include <cab/types.h>

#include <limits>

namespace cab {

// ------------------------------------------------------------------------------------------------------- histories

// The poses that a batch had at its last moments, for queries about the past. The id is made like a BatchId.
struct HistoryId {
  std::uint64_t value = 0;  // 0: no history
};

// Parameters of add_history.
struct HistoryDesc {
  // A batch of characters of the same engine, neither static bodies nor a level of nodes. Required.
  BatchId batch;

  // How many moments are kept, the last ones that were recorded: 1 to kMaxTicks.
  std::uint32_t ticks = 0;
};

// The most moments that a history keeps.
inline constexpr std::uint32_t kMaxTicks = 65536;

// The moments that a history has.
struct HistorySpan {
  std::uint32_t ticks = 0;  // how many; with 0 the times have no meaning
  double first = 0;         // the time of the earliest one that is kept
  double last = 0;          // and of the latest
};

// The time of a query that asks the job's inputs: infinity.
inline constexpr double kNow = std::numeric_limits<double>::infinity();

// --------------------------------------------------------------------------------------------------------- queries

// What a query is, and what it finds. "Link" stands for the leaf boxes of the link, or for its exact shapes if
// QueryJob::exact asks for them.
enum class QueryKind : std::uint8_t {
  kRay,      // links that a ray meets, or a sphere that is moved along it
  kSphere,   // links that overlap a sphere
  kBox,      // links that overlap an oriented box
  kCapsule,  // links that overlap a capsule
  kPoint,    // links within a distance of a point, nearest first
  kRegion,   // links whose boxes are not wholly outside of any of several planes, such as those of a frustum
};

// How many values QueryKind has.
inline constexpr std::uint32_t kQueryKindCount = 6;

// Which hits a query returns.
enum class QueryWant : std::uint8_t {
  kAny,      // whether there is any link: QueryJob::found; names no link, and is the fastest
  kClosest,  // the first link in the order of QueryHit
  kAll,      // all links, or the first Query::max_hits of them
};

// How many values QueryWant has.
inline constexpr std::uint32_t kQueryWantCount = 3;

// One query. Members that its kind does not name are not read.
struct Query {
  QueryKind kind = QueryKind::kRay;      // what is asked
  QueryWant want = QueryWant::kClosest;  // which of the links that meet it are written

  // kSphere, kBox, kCapsule: whether hits say how deep the link is in the shape. Without it their distance is 0, and
  // their points and normals are 0. Default: they do not.
  bool with_depth = false;

  // kAll: the most hits that are written, 1 or more. Default: all of them.
  std::uint32_t max_hits = 0xffffffff;

  // An instance is looked at if one of these bits is in its layer (BatchInput::layers). An instance of a batch without
  // layers has all bits. Default: all bits.
  std::uint32_t layer_mask = 0xffffffff;

  // An instance that is left out, such as the shooter. A batch of id 0 (default): none is. Any other must be a batch of
  // the engine, which need not have input.
  BatchId ignored_batch;
  std::uint32_t ignored_instance = 0;

  // When it is asked. kNow (default): of the job's inputs. A finite time: of the job's histories as they were then, and
  // of the static bodies among the inputs, but of no other input. A time before the first moment of a history counts
  // as its first, one after the last as its last (QueryStats::clamped).
  double time = kNow;

  // x y z in the world, each finite and at most kMaxQueryCoordinate. kRay: where the ray begins. kSphere, kBox,
  // kCapsule: the centre. kPoint: the point. kRegion: what its planes are relative to.
  double position[3] = {0, 0, 0};

  // kBox, kCapsule: quaternion x y z w that rotates from the shape's frame to the world's axes. Its length is divided
  // out, and must be at least 1e-3 and at most 1e3.
  float orientation[4] = {0, 0, 0, 1};

  // kRay: x y z of its direction in the world's axes. Its length is divided out; it must not be 0 unless `length` is.
  float direction[3] = {0, 0, 0};

  // kRay: how far it goes, in the caller's unit: 0 or more, or infinity. kPoint: the largest distance, 0 or more, or
  // infinity.
  float length = 0;

  // Lengths in the caller's unit, 0 or more, at most kMaxCoordinate. kRay: the radius of the sphere that is moved, 0
  // for a ray. kSphere: the radius. kCapsule: the radius. kBox: not read.
  float radius = 0;

  // Likewise. kBox: half extents along the shape's x y z. kCapsule: [2] is half the length of its segment, along z.
  float half[3] = {0, 0, 0};

  // kRegion: its planes, from QueryJob::planes[first_plane] on. With none, it is the whole world.
  std::uint32_t first_plane = 0;
  std::uint32_t plane_count = 0;
};

// The largest magnitude of a coordinate of a query, and how far apart along an axis a query's position and the origin
// of an instance may be that it finds, in the caller's unit.
inline constexpr double kMaxQueryCoordinate = 1e30;

// One side of a region: the points p of the world with dot(normal, p - position) <= offset, where `position` is that of
// the query.
struct QueryPlane {
  float normal[3] = {0, 0, 0};  // in the world's axes, finite, of any length but 0
  float offset = 0;             // finite; in the caller's unit, times the length of `normal`
};

// A link that a query found. A half space is within its leaf's box: where the box is farther than the plane, the hit is
// that of the box. Hits are in the order of query, distance, batch, instance, link. There is one per query
// and link, for the link's nearest leaf; of equally near ones the lowest.
struct QueryHit {
  std::uint32_t query;     // index of the query
  BatchSlot batch;         // batch of the instance
  std::uint32_t instance;  // instance of the link
  std::uint16_t link;      // index of the link
  std::uint16_t leaf;      // the leaf that the rest is of
  float distance;          // kRay: along the ray, 0 where it begins inside. kPoint: from the point, 0 inside. kSphere,
                           // kBox, kCapsule: with depth minus the depth, which is 0 or more; else 0. kRegion: 0
  float point[3];   // relative to Query::position, in the world's axes. kRay: where the ray, or the sphere, first
                    // touches the link. kPoint: the link's nearest point. With depth: the link's deepest point
  float normal[3];  // of length 1, out of the link: kRay: where the ray enters. kPoint: towards the point. With
                    // depth: along which the shape leaves the link. 0 0 0 where a ray or point begins inside
  bool inside;      // kRay, kPoint: whether the ray begins, or the point is, inside the link, or on its surface
};

// A link that a query found, without where it was met: the first members of its QueryHit, in a third of the memory.
struct QueryLink {
  std::uint32_t query;     // index of the query
  BatchSlot batch;         // batch of the instance
  std::uint32_t instance;  // instance of the link
  std::uint16_t link;      // index of the link
  std::uint16_t leaf;      // its nearest leaf, as in QueryHit
};

// Where on the triangles of a skin a hit is.
struct SurfacePoint {
  std::uint32_t triangle = 0xffffffff;  // index of its first corner in Leaf::triangles, over 3; of hits that are not on
                                        // triangles 0xffffffff
  float weights[3] = {0, 0, 0};  // of the three corners, in their order: 0 to 1, and they add to 1 but for rounding
};

// What a call did. Counts depend neither on the instruction set nor on threads, but for those that say so. With
// reuse_bounds those of the search depend on which calls came before. Seconds are sums over threads, except
// seconds_total.
struct QueryStats {
  std::uint64_t nodes = 0;            // nodes of the index that were compared with a query, sixteen bounds at a time
  std::uint64_t instances = 0;        // instances whose bounds a query met
  std::uint64_t leaf_tests = 0;       // leaves that a query may meet, by their boxes or bounds in float
  std::uint64_t exact_tests = 0;      // of those the ones whose exact shapes were tested
  std::uint64_t leaves_skinned = 0;   // how often a leaf's triangles were skinned; depends on the threads
  std::uint64_t leaves_replaced = 0;  // of these, in the place of another leaf that had been skinned; likewise
  std::uint64_t instances_posed = 0;  // how often instances were posed for tests; depends on the threads
  // Instances of inputs that took no part (InstanceFlag says why). 0 with reuse_bounds, and if no query asks for
  // inputs.
  std::uint64_t instances_masked = 0;
  std::uint64_t clamped = 0;  // how often a query's time was before or after all that a history has
  double seconds_bound = 0;   // posing instances for their bounds
  double seconds_index = 0;   // making the index
  double seconds_search = 0;  // everything that is done per query
  double seconds_total = 0;   // wall time of the call
};

// Many queries at once.
//
// A job takes its hits in full (`hits`), as a short list (`links`), or counts them (`counts` alone). If the list is too
// small, run_queries answers kHitsOverflow. Then hits_needed is the size that a second call needs, hit_count is 0, and
// the contents of the list are unspecified. counts, found and stats are complete.
struct QueryJob {
  // Whose links are asked for: as in FrameJob. Margins, bounds and `moved` are not read, and flags and in_contact not
  // written. Characters only. Empty (default): nothing is found by queries of kNow.
  Span<const BatchInput> inputs;

  // Whose links are asked for by queries with a time of their own: each history once, and no two of one batch. Their
  // batches need no input. Empty (default): such queries find static bodies alone.
  Span<const HistoryId> histories;

  // The queries, of any kinds in any order. Empty (default): none.
  Span<const Query> queries;

  // The planes of regions.
  Span<const QueryPlane> planes;

  // Whether shapes decide, or boxes alone: kNone, kConvex or kSurface. With kSurface rays meet the triangles of a skin,
  // and shapes as with kConvex; if an input has a skin, only rays and regions are answered, and about the past of one
  // only rays. A region always asks for boxes. Default: boxes, those that compute_boxes gives.
  Exact exact = Exact::kNone;

  // States that inputs are those of the last frame that answered kOk: same batches, counts, instances, poses, origins,
  // orientations and scales. Then instances are not posed for their bounds, unless that frame made none for them, and
  // further calls with reuse_bounds use the index and the boxes of calls before. Default: nothing is stated.
  bool reuse_bounds = false;

  // Output: room for the hits of all queries that want kClosest or kAll. Empty (default): room for no hit.
  Span<QueryHit> hits;

  // Output: of each hit where on the triangles of a skin it is; as many as `hits` has room for. Empty
  // (default): not written.
  Span<SurfacePoint> surface_points;

  // Output: the same hits in the same order, as a short list. If it has room for any, `hits` must have none.
  // Empty (default): not written.
  Span<QueryLink> links;

  // Output: one number per query, how many hits it has. If there is room for no hit but for counts, the call answers
  // kOk without writing any hit. Empty (default): not written.
  Span<std::uint32_t> counts;

  // Output: one byte per query, 1 if it found a link, else 0. Empty (default): not written.
  Span<std::uint8_t> found;

  // Output: how many hits were written, in full or as a short list.
  std::size_t hit_count = 0;

  // Output: how many hits there are, whether there is room for them or not.
  std::size_t hits_needed = 0;

  // Output: after kBadQuery, after kUnknownBatch for its ignored_batch, and after kSkinNotTaken for a query of a kind
  // that is not answered: the index of the query at fault.
  std::size_t bad_query = 0;

  // Output: counts and times of this call.
  QueryStats stats;
};

}  // namespace cab

// ------------------------------------------------------------------------------------------ ids in containers, for C++

namespace cab {

// Whether two ids have the same value; and an order, which has no other meaning.
constexpr bool operator==(HistoryId a, HistoryId b) noexcept { return a.value == b.value; }
constexpr bool operator!=(HistoryId a, HistoryId b) noexcept { return a.value != b.value; }
constexpr bool operator<(HistoryId a, HistoryId b) noexcept { return a.value < b.value; }

}  // namespace cab

namespace std {

// The hash of a history's id.
template <>
struct hash<cab::HistoryId> {
  // Of its value.
  size_t operator()(cab::HistoryId id) const noexcept { return static_cast<size_t>(id.value ^ id.value >> 32); }
};

}  // namespace std
