// cab: which links of many articulated characters touch. The public C++ API; its data types are in cab/types.h.
//
// An Engine owns articulations (shapes that do not change) and batches (room for instances of one articulation). In
// every frame the caller hands in poses and rules, and gets back the sorted list of links that touch:
//
//   create_engine, add_articulation, add_batch     in this order; add_static_batch for what never moves
//   run_frame                                      every frame
//   remove_batch, remove_articulation              when something goes
//   destroy_engine                                 at the end
//
// Errors      No call throws. A call that fails says why by its Status and changes nothing (Status names the
//             exceptions). The comment of each call lists every status that it can answer besides kOk, but for kBadTask
//             and kTasksLeft of calls whose tasks a caller's scheduler has not run as it must (Scheduler), and
//             kOutOfMemory of a read beside others (Memory).
// Threads     Engines are independent of each other. There is no global state but a list of TBB's arenas that no engine
//             has, which are kept for the next ones. Any thread may call. Reads run beside each other on one engine:
//             run_queries, compute_boxes, compute_contacts, find_touching_moments, sweep_margins, spatial_order,
//             why_masked and box_lines. The first of those that run uses the engine's threads, each further one its
//             calling thread. Any other call with an `Engine&`, such as a frame, runs alone: while it runs, all others
//             answer kBusy and do nothing; while a read runs, it answers kBusy itself. Calls with a `const Engine&`
//             may run at any time but while something is added or removed. Calls that run at a time must not write the
//             same arrays, such as `flags`. No call on an engine may run while it is destroyed.
// Memory      The caller's allocator, if there is one, serves articulations, batches and workers. The engine itself,
//             FCL's shapes and temporary lists of calls come from operator new. A read beside others that finds no
//             memory for itself allocates what a worker needs, which the engine keeps for the next: as much as reads
//             have ever run at the same time, until a call that adds, or reserve, replaces the engine's own memory.
#pragma once

#include <cab/debug.h>
#include <cab/kinematics.h>
#include <cab/query.h>
#include <cab/types.h>
#include <cab/version.h>

namespace cab {

// Owns articulations, batches and the memory of workers. Its contents are private to the library.
struct Engine;

// Makes an engine without articulations and batches, and writes its address to *out, which must not be null. The caller
// owns the engine and frees it with destroy_engine. The structs that desc points to are copied.
// Cost: a few small allocations from operator new; with thread_count other than 1 also an arena of TBB, if that is
// built in.
// Statuses: kBadOutput (out is null), kIsaNotAvailable, kBadAllocator, kBadScheduler, kBadProfiler, kOutOfMemory.
// Thread: any.
[[nodiscard]] CAB_API Status create_engine(const EngineDesc& desc, Engine** out) noexcept;

// Frees an engine and everything that it owns. Its ids are invalid afterwards. Null is allowed and does nothing.
// Cost: gives every block back to the allocator.
// Thread: any, while no other call on this engine runs.
CAB_API void destroy_engine(Engine* engine) noexcept;

// Adds an articulation, and writes its id to *out, which must not be null. All of desc is checked and copied. If desc
// is refused, *bad_element (may be null) receives the index of the bad element: of the link for kBadParent and
// kBadJoint, of the leaf for kBadLeafLink, kBadLeafBox, kBadLeafAxes, kBadShape, kShapeOutsideLeafBox,
// kBadLeafTriangles and kTooManyInfluences, of the vertex or the link for kBadSkin, and of the entry of ignored_pairs
// for kBadIgnoredPair. With other statuses *bad_element has no meaning.
// Cost: too high for every frame. Memory: one bit per ordered pair of links, and memory in proportion to leaves, parts
// and vertices. While the call runs, ignored_hops takes two bytes per ordered pair of links, and rest_pose about eight
// bytes per pair of leaves.
// Statuses: kBusy, kBadOutput (out is null), kNoLinks, kTooManyLinks, kBadParent, kBadJoint, kNoLeaves, kTooManyLeaves,
// kBadLeafLink, kBadLeafBox, kBadLeafAxes, kBadShape, kShapeOutsideLeafBox, kBadSkin, kBadLeafTriangles,
// kTooManyInfluences, kBadIgnoredPair, kBadRestPose, kOutOfMemory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status add_articulation(Engine& engine, const ArticulationDesc& desc, ArticulationId* out,
                                              std::uint32_t* bad_element = nullptr) noexcept;

// Fits an oriented box about the vertices of a mesh, for Leaf::box. `vertices` holds x y z of each vertex in the link's
// frame. The box is written to *out, which must not be null. In exact arithmetic, every vertex is inside the box. The
// axes come from the covariance of the extreme vertices, then are rotated while that shrinks the surface. They are
// ordered to match the link's axes, and ties prefer the link's own axes. The order of vertices, repeated vertices and
// inner vertices have no effect. The last bits of the box may differ between builds: the box is input, so the promise
// of same bits begins after it.
// Cost: too high for every frame. About 370 dot products per vertex, and temporary memory from operator new; of up to
// three vertices far less, without a search.
// Statuses: kBadOutput (out is null), kBadVertices, kOutOfMemory.
// Thread: any, at any time; no engine is involved.
[[nodiscard]] CAB_API Status fit_box(Span<const float> vertices, Box* out) noexcept;

// Writes the poses of joint states: poses[state][link] as PoseFormat::kQuaternionTranslation, in the body's frame.
// states: desc.variable_count numbers per state. The work is in double, states as lanes, and rounded once: a pose is
// off by half a unit of a float's last place, and by some 1e-15 of the lengths of its chain. It has the same bits on
// every instruction set and platform. An angle beyond 2^20 counts as its remainder in the division by 4 pi in double
// (std::fmod). A link that a NaN or an infinity moves has NaN in its pose, so that a frame masks the state.
// Cost: some nanoseconds per link and state; allocates 896 bytes per link.
// Statuses: kIsaNotAvailable, kNoLinks, kTooManyLinks, kBadParent, kBadJoint (links is not as long as link_parents, the
// joint counts do not add up to the joints, an unknown kind, a variable out of range, a number that is not finite, or
// an axis or rotation that is not of length 1 to 1e-6), kBadOutput (poses or states has no data, or poses is not 7
// floats per link and state), kOutOfMemory.
// Thread: any, at any time; no engine is involved.
[[nodiscard]] CAB_API Status compute_link_poses(const KinematicsDesc& desc, Span<const double> states, Isa isa,
                                                Span<float> poses) noexcept;

// Adds a coarser level of an articulation (LodDesc), and writes its id to *out, which must not be null. All of desc is
// checked and copied. If a leaf that the caller made is refused, *bad_leaf (may be null) receives its index. A level
// has the links of its articulation, so its batches take the same poses; a level of boxes on links reads only those of
// links that carry a box, and of joints between them, and an instance is masked for what is wrong with these alone. It
// works with all policies; a level of nodes without exact tests, contacts and find_touching_moments.
// Cost: as add_articulation, and with kReach up to 0.1 s for 1024 links; some seconds if most of them have one parent
// and hundreds of leaves are asked for.
// Statuses: kBusy, kBadOutput (out is null), kUnknownArticulation, kBadLod (also for a link with leaves in no leaf of
// the level or in two, for two leaves on one link, and for a leaf whose links are not in its link's tree),
// kBadRestPose, kTooFewLeaves, kTooManyLeaves, kBadLeafLink, kBadLeafBox (also for a reach beyond 1e18), kBadLeafAxes,
// kLodLeafTooSmall, kSkinNotTaken (kReach), kOutOfMemory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status add_lod(Engine& engine, const LodDesc& desc, ArticulationId* out,
                                     std::uint32_t* bad_leaf = nullptr) noexcept;

// Writes for each link of a level the index of the leaf that stands for it, or kNoLeaf if the link has no leaves in the
// level's articulation. `leaf_of_link` must have room for all links. Hits of a level name its leaves: Hit::leaf_a is
// the leaf, and Hit::link_a the link that carries its box, or for a node the lowest link below it.
// Cost: a copy; allocates nothing.
// Statuses: kUnknownArticulation, kBadLod (the articulation is no level), kBadOutput.
// Thread: any, but not while an articulation or batch is added or removed.
[[nodiscard]] CAB_API Status lod_leaves(const Engine& engine, ArticulationId level,
                                        Span<std::uint16_t> leaf_of_link) noexcept;

// Adds a batch, and writes its id to *out, which must not be null. The call allocates memory for the instances. If the
// total exceeds both the largest so far and what is reserved, per-worker memory is reallocated. run_frame and
// compute_boxes allocate nothing for it.
// Cost: about 305 bytes per character and nothing per instance of a sequence. Each worker takes 0.4 to 35 MB, which
// depends on the largest articulation (docs/layout.md). All memory is zeroed. The workers' old memory is freed after
// the new memory is made.
// Statuses: kBusy, kBadOutput (out is null), kUnknownArticulation, kBadBatchKind, kNoInstances, kTooManyInstances,
// kOutOfMemory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status add_batch(Engine& engine, const BatchDesc& desc, BatchId* out) noexcept;

// Adds a batch of static bodies, such as the boxes and triangles of a level, and writes its id to *out, which must not
// be null. All of desc is checked and copied. If desc is refused, *bad_element (may be null) receives the number of the
// instance at fault. In frames the bodies are characters that rest: they cost little as long as nothing else of the
// frame changes that BatchInput::moved names. A body whose layers or mask change counts as moved in that frame. With
// Refit::kAabbVertices the bounds are those of their boxes.
// Cost: some microseconds per triangle, and about 800 bytes per body besides those of a character.
// Statuses: kBusy, kBadOutput (out is null), kNoInstances, kTooManyInstances, kBadStaticBody (also for bodies without
// data), kBadTriangles, kBadLeafBox, kBadLeafAxes, kBadShape (also for a triangle without an area),
// kShapeOutsideLeafBox, kOutOfMemory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status add_static_batch(Engine& engine, const StaticDesc& desc, BatchId* out,
                                              std::uint32_t* bad_element = nullptr) noexcept;

// Makes room for as many batches and characters as `desc` says, of any articulations that the engine has. add_batch
// then allocates only what its own instances take, about 60 bytes per character, as long as there are no more.
// Sequences still may need more memory of the workers. What the engine has is never made smaller.
// Cost: as that of add_batch for the largest batch.
// Statuses: kBusy, kTooManyInstances, kOutOfMemory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status reserve(Engine& engine, const ReserveDesc& desc) noexcept;

// Removes a batch and gives back what its instances took. Workers keep their memory. The id becomes invalid, and the
// next add_batch takes the slot.
// Cost: frees a few blocks.
// Statuses: kBusy, kUnknownBatch.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status remove_batch(Engine& engine, BatchId id) noexcept;

// Removes an articulation that no batch uses, and gives back its memory. The id becomes invalid.
// Cost: frees a few blocks; looks at all batches.
// Statuses: kBusy, kUnknownArticulation, kArticulationInUse.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status remove_articulation(Engine& engine, ArticulationId id) noexcept;

// Runs one frame: poses every batch with input, finds the instances whose bounds overlap, tests their boxes, applies
// the exact test if there is one, and writes the hits. FrameJob says what is read and written. Without
// BatchInput::moved no answer depends on earlier frames, so frames may come in any order. Inner boxes are made only for
// strategies that descend them.
// Cost: time grows with the number of instances, and with the number of pairs whose bounds overlap; docs/performance.md
// has figures. The engine allocates nothing. With TBB its tasks may allocate, and with Exact::kFcl FCL does, both by
// their own means.
// Statuses: kBusy, the input statuses, kMovedAtRest, kBadPairRule, kPairRuleGivenTwice, kBadPolicy, kExactNotBuilt,
// kBadReport, kBadMargin, kBadMinDepth, kBadHitBuffer, kContactsNeedExact, kLodWithoutShapes, kSkinNotTaken (with an
// exact test), kHitsOverflow, kOutOfMemory (TBB had no memory for its tasks, or the hits needed more than there is).
// Thread: any, alone on its engine. It returns when all tasks have ended.
[[nodiscard]] CAB_API Status run_frame(Engine& engine, FrameJob& job) noexcept;

// Begins a frame whose tasks the caller runs, for engines with a task graph of their own: no thread waits for another
// between the steps of a frame. `job`, and all that it names, must stay as it is until end_frame. Every other call on
// the engine answers kBusy until then, reads too.
//
//   begin_frame(engine, job);
//   while (next_tasks(engine, &count) == Status::kOk && count > 0)
//     run_task(engine, t, worker);    // for every t < count, in any order, on any threads
//   status = end_frame(engine);       // what run_frame answers
//
// Hits and counts are those of run_frame. Small frames have as many steps as large ones.
// Cost: that of the checks of run_frame.
// Statuses: those of run_frame without kHitsOverflow and kOutOfMemory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status begin_frame(Engine& engine, FrameJob& job) noexcept;

// Advances to the frame's next step once every task of the last one has ended, and writes its number of tasks to
// *count: 0 when the frame has no more. There are about seven steps with tasks; one of over 65 536 comes in several
// chunks.
// Cost: the work between two steps, such as laying out strips.
// Statuses: kNoFrame, kBadOutput (count is null), kTasksLeft.
// Thread: any, one at a time, after run_task has returned for all tasks.
[[nodiscard]] CAB_API Status next_tasks(Engine& engine, std::uint32_t* count) noexcept;

// Runs one task of the step, each number below the count once. worker: below engine_thread_count; calls that run at the
// same time must have different workers. A call that breaks this runs nothing and answers kBadTask. No task waits for
// another.
// Cost: some 10 to 100 microseconds.
// Statuses: kNoFrame, kBadTask.
// Thread: any, at the same time as other tasks.
[[nodiscard]] CAB_API Status run_task(Engine& engine, std::uint32_t task, std::uint32_t worker) noexcept;

// Ends the frame: fills in `job` and releases the engine. If tasks are left, the frame is given up: `hits`, `contacts`,
// flags and in_contact are unspecified, and the engine is ready for another frame.
// Cost: little.
// Statuses: kNoFrame, kTasksLeft, kHitsOverflow, kOutOfMemory (the hits needed more memory than there is).
// Thread: any, after all tasks have returned.
[[nodiscard]] CAB_API Status end_frame(Engine& engine) noexcept;

// Finds the instances that run_frame would have to test against each other, from BatchInput::bounds alone: no pose is
// read. A caller then samples only instances that are in a pair, lists them in BatchInput::instances, and has the hits
// of a frame of all. Uses the job's inputs, its rules between characters, layers and margin, and sets their in_contact,
// if given, to 1 for instances that are in a pair. An instance that is paired within itself is in no pair by that.
// Writes the pairs in order, and their number, to `out`. After kPairsOverflow its pairs are unspecified, and
// pairs_needed is right.
// Cost: strips and their search, as in a frame; allocates nothing.
// Statuses: those of run_frame, without kBadPoses, kMovedAtRest and kHitsOverflow; kBadBounds (also without bounds),
// kBadOutput (pairs has a size and no data), kPairsOverflow.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status find_candidates(Engine& engine, const FrameJob& job, CandidateList& out) noexcept;

// Answers many queries: which links rays meet, shapes overlap, points are near, regions contain. The job says what is
// asked, and receives the hits, sorted by query, distance, batch, instance and link. Every link is found that a query
// meets in exact arithmetic, by its leaf boxes as given or by its shapes; docs/queries.md says how far off a distance
// may be. No answer depends on the other queries of the call. The call changes nothing that frames keep: characters go
// on resting. A query may have a time of its own (Query::time): then it asks histories. At a moment that a history has,
// the answer is that for the poses that it keeps. Between two moments quaternions go over along a straight line between
// those of length 1, the shorter way round, and translations, origins and scales along straight lines, rounded to
// float, origins to double; layers are those of the earlier one. An instance that one of the two lacks is absent.
// Cost: posing every instance once for its bounds and an index of them, some 250 ns per instance, or with reuse_bounds
// only the index, some 150 ns, once a frame; then some 0.1 to 10 microseconds per query. Allocates nothing; `reserve`
// makes room.
// Statuses: kBusy, kNoQueryMemory, the input statuses, kBadBatchKind (a sequence), kBadQuery, kExactNotBuilt (exact is
// kFcl), kLodWithoutShapes, kSkinNotTaken (with kConvex; with kSurface a query that is neither a ray nor a region; of
// the past of a skin all but rays with kSurface), kUnknownHistory, kHistoryGivenTwice, kBadHitBuffer, kBadOutput (found
// or counts is neither empty nor as long as queries, or surface_points neither empty nor as long as hits),
// kHitsOverflow, kOutOfMemory (TBB had no memory for its tasks); and kUnknownBatch for a history whose batch was
// removed, and for an ignored_batch that is not one of this engine.
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status run_queries(Engine& engine, QueryJob& job) noexcept;

// Adds a history: room for the poses that a batch of characters has at its last desc.ticks moments. Writes its id to
// *out, which must not be null. This call makes all the room; record_tick and run_queries allocate nothing for it. The
// batch must stay: the calls below answer kUnknownBatch once it is removed, but for remove_history.
// Cost: 28 bytes per link, character and moment, and about 140 bytes per character and moment; 200 bytes more per
// character. Each worker takes 0.1 to 1.5 MB for the history with the largest articulation.
// Statuses: kBusy, kBadOutput (out is null), kUnknownBatch, kBadBatchKind (a sequence, static bodies, a level of
// nodes), kBadTicks, kTooManyInstances (4096 histories), kOutOfMemory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status add_history(Engine& engine, const HistoryDesc& desc, HistoryId* out) noexcept;

// Removes a history, and gives back its memory. The id becomes invalid.
// Cost: frees a few blocks.
// Statuses: kBusy, kUnknownHistory.
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status remove_history(Engine& engine, HistoryId id) noexcept;

// Copies the poses of a batch at a moment, in seconds or whatever the caller counts in, in place of the earliest moment
// of the history once that is full. Of `input` the poses, origins, orientations, scales and layers are kept, and which
// instances are given. Those that are masked count as not given. Quaternions keep their bits; matrices become
// quaternions, by rounding. No link may be mirrored, and no matrix hold a scale. On failure the history is unchanged.
// Cost: some 0.3 to 1 microseconds per instance of twenty links, on all threads; allocates nothing.
// Statuses: kBusy, kUnknownHistory, the input statuses but kStaticInput (kUnknownBatch also for an input of another
// batch), kBadTime (not finite, or not above that of the last moment), kBadHistoryPoses, kOutOfMemory (TBB had no
// memory for its tasks).
// Thread: any, alone on its engine.
[[nodiscard]] CAB_API Status record_tick(Engine& engine, HistoryId id, const BatchInput& input, double time) noexcept;

// Writes which moments a history has to *out, which must not be null.
// Cost: constant time; allocates nothing.
// Statuses: kUnknownHistory, kBadOutput (out is null).
// Thread: any, while no other call changes this engine.
[[nodiscard]] CAB_API Status history_span(const Engine& engine, HistoryId id, HistorySpan* out) noexcept;

// Writes a margin for each given instance of `input`, so that a frame with BatchInput::margins finds all links that may
// have touched since `last`, the same batch in an earlier frame: how far any point of its leaf boxes can have been from
// where it is now. That holds if every link moves along a straight line, or on an arc of at most half a turn, and turns
// about one axis by at most half a turn; shapes in between are not compared, so the frame reports pairs that have
// passed each other at a distance too. Instances that `last` does not have, or that are masked in one of the two, get
// 0. `margins` must have room for all instances. Reads no layers and no margins, and writes no flags.
// Cost: poses every instance twice, on all threads; allocates nothing.
// Statuses: kBusy, the input statuses, kBadBatchKind (the two are not one batch of characters), kSkinNotTaken,
// kBadOutput (margins is too small), kOutOfMemory (TBB had no memory for its tasks).
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status sweep_margins(Engine& engine, const BatchInput& last, const BatchInput& input,
                                           Span<float> margins) noexcept;

// Writes for each pair of links the first moment between two frames, 0 to 1, at which their shapes touch, by
// Exact::kConvex, or kNeverTouch: which of the hits that a frame with sweep_margins reports are real. Both answers are
// proven, not sampled: before the moment, or never, no point of one is in the other. At the moment they are nearer than
// `resolution` and what rounding poses to float moves them, so a pair that passes closer than that without touching
// may have a moment too.
// `last` and `inputs` hold the poses of all batches that are named, in the earlier frame and in this one. In between,
// the origins of instances and of links move along straight lines, links turn about one axis, the shorter way round,
// and scales go over evenly. Rotations go along the straight line between two quaternions: faster half way than at the
// ends, which is up to 0.03 degrees off an even turn of 30 degrees, 0.9 of 90 and 8 of 180. A link that is not valid in
// `last`, that is mirrored in one frame alone, or whose instance `last` does not have, is where it is now at all
// moments; one that is not valid now never touches. Of each Hit only batches, instances and links are read. resolution:
// a length in the caller's unit, above 0, at most 1e18. Moments are no finer than 2^-20.
// Cost: sixteen exact tests per pair of parts in the open. Where links slide along each other all the way, as many as
// they move resolutions, and at most 2^20. On all threads; some memory from operator new while it runs. Bits do not
// depend on instruction set or threads.
// Statuses: kBusy, the input statuses, kBadResolution, kBadPairs (a pair that compute_contacts refuses, or a batch that
// `last` lacks), kSkinNotTaken, kBadOutput (moments is shorter than pairs), kOutOfMemory.
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status find_touching_moments(Engine& engine, Span<const BatchInput> last,
                                                   Span<const BatchInput> inputs, float resolution,
                                                   Span<const Hit> pairs, Span<float> moments) noexcept;

// Writes every box of every given instance of one batch, relative to the instance's origin in the world's axes. Node n
// of instance i goes to boxes[i * node_count + n], leaves first, the root last. `boxes` must have room for all of them.
// They have the bits that run_frame tests without a margin. With a refit of axis-aligned boxes, each Box lies along the
// world's axes and contains the stored bounds. The boxes of masked instances have half extents 0, and input.flags says
// which instances are masked. Layers, strategy, exact test and in_contact have no effect here, but must be valid.
// Cost: poses and refits all instances on the calling thread; writes 60 bytes per node. Allocates nothing.
// Statuses: kBusy, kBadPolicy, kExactNotBuilt, the input statuses, kBadOutput (boxes is too small).
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status compute_boxes(Engine& engine, const BatchInput& input, const Policies& policies,
                                           Span<Box> boxes) noexcept;

// Writes contacts[i] for pairs[i], two links that the caller names: how deep they touch, or how far they are apart at
// any distance (beyond float's range the largest float), as Exact::kConvex measures it. Of each Hit only batches,
// instances and links are read; the leaves that the contact is of are written to the contact. The two links must
// differ, and may be of one instance. inputs holds the poses of all batches that are named; layers, flags and
// in_contact have no effect. A link whose pose is not finite or not rigid has depth minus infinity and all else 0.
// Cost: one exact contact per pair of leaves of the two links, on all threads; allocates nothing. Bits do not depend on
// instruction set, threads or other pairs.
// Statuses: kBusy, the input statuses, kSkinNotTaken, kBadPairs (also for links of a level of nodes: they have boxes
// alone), kBadOutput (contacts is shorter than pairs), kOutOfMemory (TBB had no memory for its tasks).
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status compute_contacts(Engine& engine, Span<const BatchInput> inputs, Span<const Hit> pairs,
                                              Span<Contact> contacts) noexcept;

// Writes the triangles of skins (Leaf::triangles) that touch, of each two links of `pairs`, such as the hits of a frame
// with Exact::kSurface. Of each Hit only batches, instances and links are read. The two links must differ, and may be
// of one instance, whose triangles with a vertex in common do not count. Leaves without triangles have none, and those
// that a link moves whose pose is not finite or not rigid. `out` is sorted by its members in their order; *found, which
// must not be null, receives how many there are. inputs holds the poses of all batches that are named; layers, flags
// and in_contact have no effect.
// Cost: skins leaves that several links move, and tests triangles near each other, on all threads; allocates nothing.
// Bits do not depend on instruction set, threads or other pairs.
// Statuses: kBusy, the input statuses, kBadPairs, kBadOutput, kHitsOverflow (`out` is too small: *found is the size
// that a second call needs, and the contents of `out` are unspecified), kOutOfMemory (TBB had no memory for its tasks).
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status find_touching_triangles(Engine& engine, Span<const BatchInput> inputs,
                                                     Span<const Hit> pairs, Span<TouchingTriangles> out,
                                                     std::size_t* found) noexcept;

// Writes to *out, which must not be null, why one instance of a batch is masked: which link, which number, and how far
// off. With MaskCause::kNone the instance takes part. A margin, which may take a box that is at the limit out of range,
// is not considered.
// Cost: up to the price of posing the instance; allocates nothing.
// Statuses: kBusy, the input statuses, kBadInstance, kBadOutput (out is null).
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status why_masked(Engine& engine, const BatchInput& input, std::uint32_t instance,
                                        MaskReason* out) noexcept;

// Writes in words what is wrong with a job: the first thing that run_frame would refuse it for (but for kMovedAtRest),
// with member, index and value, and the words of the status. For a job that run_frame would take, it says what may not
// be meant: no inputs, no rules, more hits in its last frame than `hits` has room for, inputs that are in no rule or of
// a level that saves no time, instances that are masked, and why. One remark per line, without a newline at the end.
// Returns the number of characters of the whole text, without the 0 at its end. `text` receives as much of it as fits,
// with a 0 at the end unless its size is 0.
// Cost: poses every instance with input once. Writes no output of the job; allocates nothing. If another call on the
// engine is running, the text says so.
// Thread: any, alone on its engine.
CAB_API std::size_t explain_job(Engine& engine, const FrameJob& job, Span<char> text) noexcept;

// Writes in words why an instance is masked, as why_masked has found it, such as "the quaternion of link 3 has the
// length 0, below 0.001". Text and result as in explain_job.
// Cost: little; allocates nothing.
// Thread: any.
CAB_API std::size_t explain_mask(const MaskReason& reason, Span<char> text) noexcept;

// Writes the statistics of a frame as one line of text: milliseconds in all and by phase, then counts. Text and result
// as in explain_job.
// Cost: little; allocates nothing.
// Thread: any.
CAB_API std::size_t stats_line(const FrameStats& stats, Span<char> text) noexcept;

// Writes lines for a debug draw: the edges of boxes, of the leaves or of one level of the hierarchies, with the boxes
// that stand for links in hits marked; on request the exact shapes of leaves instead, and contacts. `job` says what is
// drawn, and receives the lines. The boxes are those of compute_boxes. Layers, strategy, exact test and in_contact have
// no effect here, but must be valid.
// Cost: poses and refits all instances on the calling thread; operator new: 16 bytes a hit, 48 a line of leaf shapes.
// Statuses: kBusy, kBadPolicy, kExactNotBuilt, the input statuses (kBadOrigins also for an origin of the job),
// kBadPairs (hits or contacts have a size and no data, or contacts are neither none nor one per hit), kBadOutput (lines
// has a size and no data), kLinesOverflow, kOutOfMemory (operator new has no memory for hits or shapes).
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status box_lines(Engine& engine, const BatchInput& input, BoxLinesJob& job) noexcept;

// Compares two lists of hits, such as those of two frames: which began and which ended. Hits are the same if their
// batches, instances and links are; leaves may differ. Both lists must be in the order of run_frame. Lists that changes
// has no room for are cut off, and the counts are complete.
// Cost: one pass over both lists; allocates nothing.
// Statuses: kUnsortedHits, kBadOutput (a list of `changes` has a size and no data), kHitsOverflow (a list of `changes`
// is too small).
// Thread: any; no engine is involved.
[[nodiscard]] CAB_API Status diff_hits(Span<const Hit> previous, Span<const Hit> current, HitChanges& changes) noexcept;

// Writes the numbers of a batch's instances to `order`, so that instances which are near each other in the world are
// near each other in the list: along a Z-order curve through the lower bounds that the last frame with input for the
// batch gave them. Masked instances come last, in ascending order. Instances without such a frame, and those of a
// sequence, keep their order. Large crowds that are stored in this order have faster frames (docs/crowd.md).
// Cost: a sort on the calling thread, and 16 bytes per instance from operator new while it runs.
// Statuses: kBusy, kUnknownBatch, kBadOutput (order is too small), kOutOfMemory.
// Thread: any, beside other reads.
[[nodiscard]] CAB_API Status spatial_order(Engine& engine, BatchId batch, Span<std::uint32_t> order) noexcept;

// Writes the counts of an articulation to *out, which must not be null.
// Cost: constant time; allocates nothing.
// Statuses: kUnknownArticulation, kBadOutput (out is null).
// Thread: any, while no call adds to or removes from this engine.
[[nodiscard]] CAB_API Status articulation_info(const Engine& engine, ArticulationId id, ArticulationInfo* out) noexcept;

// Writes what a batch is to *out, which must not be null. Also tells whether an id names a batch.
// Cost: a look at all articulations; allocates nothing.
// Statuses: kUnknownBatch, kBadOutput (out is null).
// Thread: any, while no call adds to or removes from this engine.
[[nodiscard]] CAB_API Status batch_info(const Engine& engine, BatchId id, BatchInfo* out) noexcept;

// Writes the merge order of an articulation's hierarchy, which is the same for all its instances and frames. It has
// leaf_count - 1 steps, and `steps` must have room for them.
// Cost: a copy; allocates nothing.
// Statuses: kUnknownArticulation, kBadOutput (steps is too small).
// Thread: any, while no call adds to or removes from this engine.
[[nodiscard]] CAB_API Status merge_steps(const Engine& engine, ArticulationId id, Span<MergeStep> steps) noexcept;

// Writes which links of an articulation are never reported against each other within an instance, and why: each pair
// once, sorted by a, then b. `pairs` must have room for ArticulationInfo::ignored_pair_count entries.
// Cost: a copy; allocates nothing.
// Statuses: kUnknownArticulation, kBadOutput (pairs is too small).
// Thread: any, while no call adds to or removes from this engine.
[[nodiscard]] CAB_API Status ignored_pairs(const Engine& engine, ArticulationId id, Span<IgnoredPair> pairs) noexcept;

// Writes how many bytes the engine holds for what to *out, which must not be null. The engine object itself, and the
// shapes of Exact::kFcl, come from operator new and are not counted.
// Cost: a sum over articulations, batches and workers; allocates nothing.
// Statuses: kBadOutput (out is null).
// Thread: any, while no other call changes this engine.
[[nodiscard]] CAB_API Status engine_memory(const Engine& engine, EngineMemory* out) noexcept;

// Returns how many workers an engine has: the caller's worker_count, or the threads of the built-in scheduler.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API std::uint32_t engine_thread_count(const Engine& engine) noexcept;

// Returns the instruction set that an engine's kernels use, never Isa::kAuto.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API Isa engine_isa(const Engine& engine) noexcept;

// Returns whether this CPU, its operating system and this build can run an instruction set: always true for Isa::kAuto
// and Isa::kScalar, always false for a number that is not an Isa.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API bool isa_available(Isa isa) noexcept;

// Returns the name of an instruction set, such as "avx2". The string lives as long as the program.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API const char* to_string(Isa isa) noexcept;

// Returns a status in words, without a capital at the start or a period at the end. The string lives as long as the
// program.
// Cost: constant time; allocates nothing.
// Thread: any.
CAB_API const char* to_string(Status status) noexcept;

}  // namespace cab
