// cab: which links of many articulated characters touch. The whole C++ API.
//
// An Engine owns articulations (immutable shapes) and batches (storage for n instances of one). Every frame the
// caller hands in poses and rules, and gets back the sorted list of touching links. No call throws; a call that
// fails says why by its Status and changes nothing. One engine is used by one thread at a time; engines are
// independent of each other. There is no global state.
#pragma once

#include <cab/types.h>
#include <cab/version.h>

namespace cab {

struct Engine;

// Makes an engine. *out is written on kOk only; destroy it with destroy_engine.
[[nodiscard]] CAB_API Status create_engine(const EngineDesc& desc, Engine** out) noexcept;

// Frees an engine and all it owns; null is allowed.
CAB_API void destroy_engine(Engine* engine) noexcept;

// Adds an immutable articulation, copying all of desc. bad_element (optional) receives the index of the link,
// leaf or pair that an error is about.
[[nodiscard]] CAB_API Status add_articulation(Engine& engine, const ArticulationDesc& desc, ArticulationId* out,
                                              std::uint32_t* bad_element = nullptr) noexcept;

// The oriented box about a mesh's vertices (x y z of each, in the link's frame), for Leaf::box; fit it once. Every vertex
// is inside, in exact arithmetic. Axes by covariance of the vertices that are furthest out in some direction, or of less
// area where turning them finds it, in the order nearest to the link's axes, which win ties. Order, repetition and
// inner vertices change nothing. Kept out of the promise of same bits: the box is input, its last bits are the build's.
[[nodiscard]] CAB_API Status fit_box(Span<const float> vertices, Box* out) noexcept;

// Adds storage for a batch and sizes every worker's memory for it: this batch's only allocation.
[[nodiscard]] CAB_API Status add_batch(Engine& engine, const BatchDesc& desc, BatchId* out) noexcept;

// Poses, refits, tests and reports one frame (FrameJob says what is read and written). Inner boxes are made only for the
// strategies that descend them. Allocates nothing with the serial or the caller's scheduler and Exact::kNone; TBB may
// keep its own task memory, FCL allocates.
[[nodiscard]] CAB_API Status run_frame(Engine& engine, FrameJob& job) noexcept;

// Writes every box of every instance of one batch: boxes[i * node_count + node], leaves first, the root last,
// relative to the instance's origin in world axes. The same bits that run_frame tests. An axis-aligned box
// (Refit::kAabbHull) is written as the smallest box about its stored bounds. A masked instance (flags says
// which) has zero boxes.
[[nodiscard]] CAB_API Status compute_boxes(Engine& engine, const BatchInput& input, const Policies& policies,
                                           Span<Box> boxes) noexcept;

// Counts of an articulation.
[[nodiscard]] CAB_API Status articulation_info(const Engine& engine, ArticulationId id, ArticulationInfo* out) noexcept;

// The merge order of an articulation; steps must hold leaf_count - 1 entries.
[[nodiscard]] CAB_API Status merge_steps(const Engine& engine, ArticulationId id, Span<MergeStep> steps) noexcept;

// Which links of an articulation are no pairs, and why: sorted by a, then b. pairs must hold ignored_pair_count entries.
[[nodiscard]] CAB_API Status ignored_pairs(const Engine& engine, ArticulationId id, Span<IgnoredPair> pairs) noexcept;

// How many threads an engine works with, the instruction set that it runs, the names of instruction sets, and what this
// CPU and build can run.
CAB_API std::uint32_t engine_thread_count(const Engine& engine) noexcept;
CAB_API Isa engine_isa(const Engine& engine) noexcept;
CAB_API bool isa_available(Isa isa) noexcept;
CAB_API const char* to_string(Isa isa) noexcept;

// A status in words.
CAB_API const char* to_string(Status status) noexcept;

}  // namespace cab
