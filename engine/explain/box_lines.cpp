// The edges of boxes and shapes, and contacts, for a debug draw.
#include "engine/exact/convex_queues.h"
#include "engine/exact/surface.h"
#include "engine/explain/shape_edges.h"
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

// Lines of one instance, written as far as there is room, and counted.
class LineWriter {
 public:
  explicit LineWriter(Span<BoxLine> lines) : lines_(lines) {}

  std::size_t needed() const { return needed_; }

  // at: the instance's origin, relative to that of the lines.
  void set_origin(const double (&at)[3]) { at_ = {at[0], at[1], at[2]}; }

  // from, to: relative to the instance's origin. line: what lines of one box have in common.
  void add(const Double3& from, const Double3& to, BoxLine line) {
    if (needed_++ >= lines_.size) return;
    write(at_ + from, line.from);
    write(at_ + to, line.to);
    lines_[needed_ - 1] = line;
  }

  // The twelve edges.
  void add_box(const Box& box, const BoxLine& line) {
    const auto corner = [&box](int signs) {
      Double3 out = double3(box.center);
      for (int k = 0; k < 3; ++k)
        out = out + ((signs >> k & 1 ? 1.0 : -1.0) * double{box.half[k]}) * double3(box.axis[k]);
      return out;
    };
    for (int k = 0; k < 3; ++k)
      for (int signs = 0; signs < 8; ++signs)
        if (!(signs >> k & 1)) add(corner(signs), corner(signs | 1 << k), line);
  }

 private:
  static void write(const Double3& from, float (&to)[3]) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const double values[3] = {from.x, from.y, from.z};
    for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(std::clamp(values[c], -kLargest, kLargest));
  }

  Span<BoxLine> lines_;
  Double3 at_ = {};
  std::size_t needed_ = 0;
};

// The lines of the shapes of a leaf about its instance's origin. Empty if its box is to be drawn.
void find_edges(const ExactLeaf& leaf, std::vector<Segment>& out) {
  out.clear();
  if (has_triangles(leaf)) return;
  const LeafShapes shapes = shapes_of(leaf);
  const auto append = [&out](const ConvexShape& shape) { return append_edges(shape, out); };
  if (!std::all_of(shapes.shapes.begin(), shapes.shapes.end(), append)) out.clear();
  if (out.empty()) return;
  const kernel::RigidLanes<double> pose = pose_in_double(shapes.at);
  for (Segment& edge : out)
    for (Double3* const point : {&edge.from, &edge.to})
      *point = pose.translation + kernel::rotate(pose.column, pose.scale * *point);
}

// From the contact's point of a to that of b, of hits whose instance a is one of the batch.
void add_contacts(const BoxLinesJob& job, const InstanceBatch& batch, BatchSlot slot, LineWriter& writer) {
  for (std::size_t i = 0; i < job.contacts.size; ++i) {
    const Hit& hit = job.hits[i];
    if (hit.batch_a.value != slot.value || hit.instance_a >= batch.instance_count) continue;
    double at[3];
    for (std::uint32_t c = 0; c < 3; ++c) at[c] = origin_of(batch, hit.instance_a, c) - job.origin[c];
    writer.set_origin(at);
    const Contact& contact = job.contacts[i];
    writer.add(double3(contact.point_a), double3(contact.point_b),
               {{}, {}, hit.instance_a, contact.leaf_a, hit.link_a, true});
  }
}

Status write_lines(Call& call, const BatchInput& input, BoxLinesJob& job) {
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (!std::all_of(job.origin, job.origin + 3, is_finite)) return Status::kBadOrigins;
  if (job.hits.size && !job.hits.data) return Status::kBadPairs;
  if (job.contacts.size && (!job.contacts.data || job.contacts.size != job.hits.size)) return Status::kBadPairs;
  if (job.lines.size && !job.lines.data) return Status::kBadOutput;
  InstanceBatch& batch = call.batch(input.batch);
  batch.margins = {};
  const Articulation& articulation = *batch.articulation;
  const std::vector<std::uint64_t> hits = links_in(job.hits, slot_of(input.batch));
  const NodeBits shown = shown_at(articulation, job.level);
  const FrameContext frame = call.context(job.policies, 0);
  Worker& worker = (*call.reader().pool)[0];
  PoseScratch& posing = worker.pose;
  LineWriter writer(job.lines);
  std::vector<Segment> edges;
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
      writer.set_origin(at);
      for (std::uint32_t node = 0; node < articulation.node_count; ++node) {
        if (!shown[node]) continue;
        const bool is_leaf = node < articulation.leaf_count;
        const BoxLine line = {
            {},       {}, instance, static_cast<std::uint16_t>(node), is_leaf ? articulation.leaf_link[node] : kNoLink,
            hit[node]};
        if (is_leaf && job.shapes)
          find_edges(exact_leaf(frame, slot_of(input.batch).value - 1, instance, node), edges);
        else
          edges.clear();
        for (const Segment& edge : edges) writer.add(edge.from, edge.to, line);
        if (edges.empty()) writer.add_box(box_of(posing, job.policies.refit, node, lane), line);
      }
    }
  }
  add_contacts(job, batch, slot_of(input.batch), writer);
  const std::size_t needed = writer.needed();
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
