// find_touching_triangles: the triangles of links that a caller names.
#include "engine/exact/leaf_pairs.h"
#include "engine/exact/surface.h"
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <atomic>
#include <tuple>

namespace cab {
namespace {

constexpr std::size_t kPairsPerTask = 4;

// The triangles that were found. Those that the caller's buffer has no room for are counted.
struct TriangleSink {
  Span<TouchingTriangles> out;
  std::atomic<std::size_t> found{0};

  void add(const TouchingTriangles& triangles) {
    const std::size_t at = found.fetch_add(1, std::memory_order_relaxed);
    if (at < out.size) out[at] = triangles;
  }
};

// Two leaves of a pair, and where their triangles go.
struct LeafTaker {
  TriangleSink& sink;
  TouchingTriangles of;

  bool take(std::uint32_t a, std::uint32_t b) {
    of.triangle_a = a;
    of.triangle_b = b;
    sink.add(of);
    return true;
  }
};

// Whether the poses of all links that move the triangles of a leaf are valid.
bool is_valid_leaf(const ExactLeaf& leaf) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  const SurfaceLeaf& of = surface.leaves[leaf.leaf];
  const SurfaceBone* const bones = surface.bones.data + of.bone_begin;
  return std::all_of(bones, bones + of.bone_count,
                     [&leaf](const SurfaceBone& bone) { return is_valid_pose(*leaf.batch, leaf.instance, bone.link); });
}

void find_triangles(const FrameContext& frame, Span<const Hit> pairs, std::uint32_t index, ExactScratch& scratch,
                    TriangleSink& sink) {
  const Hit& pair = pairs[index];
  FrameStats stats;
  for_each_leaf_pair(frame, pair, [&](const ExactLeaf& a, const ExactLeaf& b) {
    if (!has_triangles(a) || !has_triangles(b) || !is_valid_leaf(a) || !is_valid_leaf(b)) return;
    LeafTaker taker = {sink, {index, static_cast<std::uint16_t>(a.leaf), static_cast<std::uint16_t>(b.leaf), 0, 0}};
    find_touching_triangles(
        frame, a, b, 0, scratch.skins, stats, &taker,
        [](void* of, std::uint32_t at_a, std::uint32_t at_b) { return static_cast<LeafTaker*>(of)->take(at_a, at_b); });
  });
}

bool before(const TouchingTriangles& x, const TouchingTriangles& y) {
  return std::tie(x.pair, x.leaf_a, x.leaf_b, x.triangle_a, x.triangle_b) <
         std::tie(y.pair, y.leaf_a, y.leaf_b, y.triangle_a, y.triangle_b);
}

}  // namespace

Status find_touching_triangles(Engine& engine, Span<const BatchInput> inputs, Span<const Hit> pairs,
                               Span<TouchingTriangles> out, std::size_t* found) noexcept {
  return guarded([&] {
    if (!found) return Status::kBadOutput;
    Call call(engine, Access::kReads);
    if (!call.admitted()) return Status::kBusy;
    const kernel::FloatMode mode;
    Policies policies;
    policies.exact = Exact::kSurface;
    if (const Status status = bind_inputs(engine, call, inputs); status != Status::kOk) return status;
    if (const Status status = validate_pairs(engine, call, pairs); status != Status::kOk) return status;
    if (out.size && !out.data) return Status::kBadOutput;
    WorkerPool& pool = *call.reader().pool;
    pool.tasks->alone = pairs.size <= kPairsPerTask;
    for (std::uint32_t w = 0; w < pool.workers.size(); ++w) forget_skinned(pool.exact_of(w).skins);
    const FrameContext frame = call.context(policies, 0);
    TriangleSink sink{out};
    const auto tasks = static_cast<std::uint32_t>((pairs.size + kPairsPerTask - 1) / kPairsPerTask);
    pool.tasks->for_each(tasks, [&](std::uint32_t task, std::uint32_t w) {
      const std::size_t begin = task * kPairsPerTask, end = std::min(begin + kPairsPerTask, pairs.size);
      for (std::size_t i = begin; i < end; ++i)
        find_triangles(frame, pairs, static_cast<std::uint32_t>(i), pool.exact_of(w), sink);
    });
    *found = sink.found.load(std::memory_order_relaxed);
    if (*found > out.size) return Status::kHitsOverflow;
    std::sort(out.data, out.data + *found, before);
    return Status::kOk;
  });
}

}  // namespace cab
