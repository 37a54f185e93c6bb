// The edges of boxes for a debug draw.
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "engine/step/box_of.h"
#include "engine/step/update.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>
#include <vector>

namespace cab {
namespace {

constexpr std::uint32_t kMaxNodes = 2 * kMaxLeaves;
using NodeBits = std::bitset<kMaxNodes>;

// The links of one batch that are in hits, as instance << 16 | link, ascending.
std::vector<std::uint64_t> links_in(Span<const Hit> hits, BatchSlot batch) {
  std::vector<std::uint64_t> out;
  for (const Hit& hit : hits) {
    if (hit.batch_a.value == batch.value) out.push_back(std::uint64_t{hit.instance_a} << 16 | hit.link_a);
    if (hit.batch_b.value == batch.value) out.push_back(std::uint64_t{hit.instance_b} << 16 | hit.link_b);
  }
  std::sort(out.begin(), out.end());
  return out;
}

// The nodes that a level shows: those that are `level` merges below the root, and leaves that are fewer.
NodeBits shown_at(const Articulation& articulation, std::uint32_t level) {
  NodeBits out;
  const std::uint32_t leaves = articulation.leaf_count;
  std::uint16_t below[kMaxNodes] = {};  // by node: how many merges it is below the root
  for (std::uint32_t node = articulation.node_count; node-- > leaves;) {
    const MergeStep& step = articulation.program.steps[node - leaves];
    below[step.left] = below[step.right] = static_cast<std::uint16_t>(below[node] + 1);
  }
  for (std::uint32_t node = 0; node < articulation.node_count; ++node)
    out[node] = below[node] == level || (node < leaves && below[node] < level);
  return out;
}

// The nodes that stand for links of an instance in hits. from, to: these links.
NodeBits hit_nodes(const Articulation& articulation, const std::uint64_t* from, const std::uint64_t* to) {
  NodeBits out;
  const std::uint32_t leaves = articulation.leaf_count;
  for (std::uint32_t leaf = 0; leaf < leaves; ++leaf)
    out[leaf] = std::any_of(from, to, [&articulation, leaf](std::uint64_t hit) {
      return static_cast<std::uint16_t>(hit) == articulation.leaf_link[leaf];
    });
  for (std::uint32_t node = leaves; node < articulation.node_count; ++node) {
    const MergeStep& step = articulation.program.steps[node - leaves];
    out[node] = out[step.left] || out[step.right];
  }
  return out;
}

// Writes the twelve edges of a box. at: the instance's origin, relative to that of the lines. line: what all have.
void write_edges(const Box& box, const double (&at)[3], BoxLine line, BoxLine* out) {
  const auto corner = [&](int signs, float(&to)[3]) {
    for (int c = 0; c < 3; ++c) {
      double value = at[c] + double{box.center[c]};
      for (int k = 0; k < 3; ++k) value += (signs >> k & 1 ? 1.0 : -1.0) * double{box.axis[k][c]} * double{box.half[k]};
      constexpr double kLargest = std::numeric_limits<float>::max();
      to[c] = static_cast<float>(std::clamp(value, -kLargest, kLargest));
    }
  };
  for (int k = 0; k < 3; ++k)
    for (int signs = 0; signs < 8; ++signs) {
      if (signs >> k & 1) continue;
      corner(signs, line.from);
      corner(signs | 1 << k, line.to);
      *out++ = line;
    }
}

Status write_lines(Call& call, const BatchInput& input, BoxLinesJob& job) {
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (!std::all_of(job.origin, job.origin + 3, is_finite)) return Status::kBadOrigins;
  if (job.hits.size && !job.hits.data) return Status::kBadPairs;
  if (job.lines.size && !job.lines.data) return Status::kBadOutput;
  InstanceBatch& batch = call.batch(input.batch);
  batch.margins = {};
  const Articulation& articulation = *batch.articulation;
  const std::vector<std::uint64_t> hits = links_in(job.hits, slot_of(input.batch));
  const NodeBits shown = shown_at(articulation, job.level);
  const FrameContext frame = call.context(job.policies, 0);
  Worker& worker = (*call.reader().pool)[0];
  PoseScratch& posing = worker.pose;
  std::size_t needed = 0;
  for (std::uint32_t tile = 0; tile < tile_count(active_count(batch)); ++tile) {
    const TileInstances instances = instances_of(batch, tile);
    const std::uint32_t live = update_and_flag_tile(
        frame, {&batch, instances, RefitScope::kAllNodes, posing.boxes.data, posing.bounds.data}, posing, worker.stats);
    for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
      if (!(live >> lane & 1)) continue;
      const std::uint32_t instance = instances.instance[lane];
      const auto from = std::lower_bound(hits.begin(), hits.end(), std::uint64_t{instance} << 16);
      const auto to = std::lower_bound(from, hits.end(), (std::uint64_t{instance} + 1) << 16);
      const NodeBits hit =
          hit_nodes(articulation, hits.data() + (from - hits.begin()), hits.data() + (to - hits.begin()));
      double at[3];
      for (std::uint32_t c = 0; c < 3; ++c) at[c] = origin_of(batch, instance, c) - job.origin[c];
      for (std::uint32_t node = 0; node < articulation.node_count; ++node) {
        if (!shown[node]) continue;
        needed += 12;
        if (needed > job.lines.size) continue;
        const Box box = box_of(posing, job.policies.refit, node, lane);
        const std::uint16_t link = node < articulation.leaf_count ? articulation.leaf_link[node] : kNoLink;
        write_edges(box, at, {{}, {}, instance, static_cast<std::uint16_t>(node), link, hit[node]},
                    job.lines.data + needed - 12);
      }
    }
  }
  job.lines_needed = needed;
  job.line_count = needed > job.lines.size ? 0 : needed;
  return needed > job.lines.size ? Status::kLinesOverflow : Status::kOk;
}

}  // namespace

Status box_lines(Engine& engine, const BatchInput& input, BoxLinesJob& job) noexcept {
  return guarded([&] {
    Call call(engine, Access::kReadsOnOneThread);
    if (!call.admitted()) return Status::kBusy;
    const kernel::FloatMode mode;
    if (const Status status = validate_policies(job.policies); status != Status::kOk) return status;
    if (const Status status = bind_inputs(engine, call, {&input, 1}); status != Status::kOk) return status;
    return write_lines(call, input, job);
  });
}

}  // namespace cab
