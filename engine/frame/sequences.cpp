// The step `sequences` of a frame, tile by tile. A sequence with one instance is a table: it takes part in every tile.
#include "engine/frame/sequences.h"

#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/joint_states.h"
#include "engine/step/timed.h"
#include "engine/step/update.h"
#include "kernels/descend_tiles.h"
#include "kernels/round_leaves.h"
#include "layout/compiler.h"

#include <algorithm>

namespace cab {
namespace {

// The tile of a sequence that takes part in task `tile`. A table takes part with its only tile.
std::uint32_t tile_of(const InstanceBatch& batch, std::uint32_t tile) { return batch.instance_count == 1 ? 0 : tile; }

// One rule at one tile: the two sequences, and the instances in its lanes.
struct PairedTiles {
  std::uint32_t index_a, index_b;  // indices of the batches, index_a <= index_b
  const InstanceBatch& a;
  const InstanceBatch& b;
  std::uint32_t tile;
  bool within;  // Pairing::kWithin

  // The instance of a sequence in a lane.
  std::uint32_t instance_of(const InstanceBatch& batch, std::uint32_t lane) const {
    return batch.instance_count == 1 ? 0 : tile * kLanes + lane;
  }
  // The same, with the last instance in all lanes after it.
  std::uint32_t instance_or_last(const InstanceBatch& batch, std::uint32_t lane) const {
    return std::min(instance_of(batch, lane), batch.instance_count - 1);
  }
  Candidate candidate(std::uint32_t lane) const {
    return {index_a, instance_of(a, lane), index_b, instance_of(b, lane)};
  }
  // The number of instances of the longer sequence; the other may be a table. 0 if one of them has none in this call.
  std::uint32_t instance_count() const {
    return a.instance_count && b.instance_count ? std::max(a.instance_count, b.instance_count) : 0;
  }
};

// The rule with the lower batch first, as hits have it.
PairedTiles tiles_of(const FrameContext& frame, const PairRule& rule, std::uint32_t tile) {
  const std::uint32_t slot_a = slot_of(rule.a).value, slot_b = slot_of(rule.b).value;
  const std::uint32_t a = std::min(slot_a, slot_b) - 1, b = std::max(slot_a, slot_b) - 1;
  return {a, b, frame.batch(a), frame.batch(b), tile, rule.pairing == Pairing::kWithin};
}

// Writes the origin of b less the origin of a for each lane. Returns false if all differences are zero.
bool shift_of(const PairedTiles& tiles, ShiftTile* out) {
  const InstanceBatch &a = tiles.a, &b = tiles.b;
  if (a.input->origins.empty() && b.input->origins.empty()) return false;
  bool any = false;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    for (std::uint32_t c = 0; c < 3; ++c) {
      out->by[c][lane] =
          origin_of(b, tiles.instance_or_last(b, lane), c) - origin_of(a, tiles.instance_or_last(a, lane), c);
      any = any || out->by[c][lane] != 0;
    }
  return any;
}

// Returns the bits of the lanes whose two instances have matching layers.
std::uint32_t lanes_with_matching_layers(const PairedTiles& tiles) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    out |= std::uint32_t{layers_match(tiles.a, tiles.instance_or_last(tiles.a, lane), tiles.b,
                                      tiles.instance_or_last(tiles.b, lane))}
           << lane;
  return out;
}

// Returns the bits of the lanes to test: both instances are valid and have matching layers. With Report::kInContact,
// lanes whose two instances are already reported are left out.
std::uint32_t lanes_to_test(const FrameContext& frame, const PairedTiles& tiles, const Worker& worker) {
  const std::uint32_t instances = tiles.instance_count();
  const std::uint32_t in_tile = (2u << (std::min(kLanes, instances - tiles.tile * kLanes) - 1)) - 1;
  const auto live = [&](const InstanceBatch& batch, std::uint32_t index) {
    const bool is_table = batch.instance_count == 1 && instances > 1;
    return is_table ? (worker.pairs.live[index] & 1 ? 0xffffu : 0u) : worker.pairs.live[index];
  };
  std::uint32_t lanes = in_tile & live(tiles.a, tiles.index_a) & live(tiles.b, tiles.index_b);
  if (!tiles.within) lanes &= lanes_with_matching_layers(tiles);
  if (frame.report == Report::kInContact)
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      if ((lanes >> lane & 1) && is_already_reported(frame, tiles.candidate(lane))) lanes &= ~(1u << lane);
  return lanes;
}

// One rule and one tile with boxes: the kernel tests the nodes of both sequences and leaves the overlapping leaf pairs
// in worker.pairs.tile_found.
template <class Tile>
void descend(const PairedTiles& tiles, std::uint32_t lanes, const Tile* nodes,
             void (*kernel)(kernel::TileDescent<Tile>&), Worker& worker) {
  ShiftTile shift;
  kernel::TileDescent<Tile> descent;
  descent.articulation_a = tiles.a.articulation;
  descent.articulation_b = tiles.b.articulation;
  descent.nodes_a = nodes + tiles.a.worker_nodes;
  descent.nodes_b = nodes + tiles.b.worker_nodes;
  descent.shift = !tiles.within && shift_of(tiles, &shift) ? &shift : nullptr;
  descent.lanes = lanes;
  descent.self = tiles.within;
  descent.stack = worker.pairs.tile_stack;
  descent.found = worker.pairs.tile_found;
  descent.found.clear();
  descent.box_tests = 0;
  kernel(descent);
  worker.pairs.tile_found.size = descent.found.size;
  worker.stats.box_tests += descent.box_tests;
}

// One rule and one tile, by the frame's strategy: leaves the overlapping leaf pairs in worker.pairs.tile_found.
void find_tile_pairs(const FrameContext& frame, const PairedTiles& tiles, std::uint32_t lanes, Worker& worker) {
  const kernel::KernelTable& kernels = frame.kernels;
  const bool brute = frame.policies.strategy != Strategy::kTree;
  const auto sat = static_cast<std::size_t>(frame.policies.sat);
  if (is_axis_aligned(frame.policies.refit))
    descend(tiles, lanes, worker.pose.bounds.data, brute ? kernels.brute_aabbs : kernels.descend_aabbs, worker);
  else
    descend(tiles, lanes, worker.pose.boxes.data, (brute ? kernels.brute_boxes : kernels.descend_boxes)[sat], worker);
}

// Pairing::kWithin of a sequence that is posed as balls and capsules: leaves in worker.pairs.tile_found what touches
// and, for the exact test, what may.
void find_round_pairs(const FrameContext& frame, const PairedTiles& tiles, std::uint32_t lanes, Worker& worker) {
  const RoundBody& body = frame.batches[tiles.index_a]->convex_shapes->round;
  kernel::RoundTest test;
  test.articulation = tiles.a.articulation;
  test.body = &body;
  test.tiles = worker.pose.round.data + tiles.a.worker_nodes;
  test.lanes = lanes;
  test.margin = frame.margin;
  test.first_only = frame.report == Report::kInContact;
  test.found = worker.pairs.tile_found;
  test.found.clear();
  test.ball_tests = test.leaf_tests = 0;
  frame.kernels.test_round_body(test);
  worker.pairs.tile_found.size = test.found.size;
  worker.stats.box_tests += test.ball_tests;
  // What is left is counted by the exact test.
  for (const TilePair& pair : worker.pairs.tile_found) test.leaf_tests -= count_bits(pair.lanes & 0xffff);
  worker.stats.leaf_pairs += test.leaf_tests;
  worker.stats.exact_tests += test.leaf_tests;
  worker.stats.false_positives += test.leaf_tests;
}

// Tests and reports one rule and one tile.
void test_sequences(const FrameContext& frame, const PairRule& rule, std::uint32_t tile, Worker& worker,
                    HitSink& sink) {
  const PairedTiles tiles = tiles_of(frame, rule, tile);
  if (tile >= tile_count(tiles.instance_count())) return;
  const std::uint32_t lanes = lanes_to_test(frame, tiles, worker);
  if (!lanes) return;
  {
    const Timed timed(worker.stats.seconds_test);
    if (worker.pairs.live[tiles.index_a] & kPosedRound)
      find_round_pairs(frame, tiles, lanes, worker);
    else
      find_tile_pairs(frame, tiles, lanes, worker);
  }
  const bool searches = searches_inside(frame, tiles.candidate(0));
  if (worker.pairs.tile_found.empty() && !searches) return;
  const Timed timed(worker.stats.seconds_query);
  Candidate candidates[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) candidates[lane] = tiles.candidate(lane);
  if (tests_lists(frame.policies.exact))
    keep_touching_lanes(frame, candidates, worker.pairs.tile_found, worker.exact, worker.stats);
  std::uint32_t touching = searches ? lanes : 0;
  for (const TilePair& pair : worker.pairs.tile_found) touching |= pair.lanes & 0xffff;
  for (; touching; touching &= touching - 1) {
    const std::uint32_t lane = lowest_bit(touching);
    FixedList<LeafPair>& found = worker.pairs.found;
    found.clear();
    for (const TilePair& pair : worker.pairs.tile_found)
      if (pair.lanes >> lane & 1) found.push({lane, pair.a, pair.b});
    add_inside(frame, candidates, lane, lane + 1, found, worker.exact, worker.stats);
    if (!found.empty())
      report_candidate(frame, candidates[lane], {found.data, found.size}, worker.hits, worker.stats, sink);
  }
}

// Poses a tile of a sequence as balls and capsules. Returns its live lanes with kPosedRound, or 0 if boxes have to say
// which of its instances are masked.
std::uint32_t pose_round_tile(const FrameContext& frame, const StoredBatch& stored, std::uint32_t tile,
                              PoseScratch& scratch) {
  const InstanceBatch& batch = stored.batch;
  const TileInstances instances = instances_of(batch, tile);
  kernel::RoundPoses args;
  args.articulation = batch.articulation;
  args.body = &stored.convex_shapes->round;
  kernel::point_lanes(pose_of(batch, instances.instance[0]), batch.instance_stride / sizeof(float), instances.count,
                      args.poses);
  args.link_stride = batch.link_stride / sizeof(float);
  args.links = batch.by_states ? scratch.links.data : nullptr;
  args.tiles = scratch.round.data + batch.worker_nodes;
  if (!frame.kernels.pose_round(args)) return 0;
  const Span<std::uint8_t> flags = batch.input->flags;
  if (!flags.empty()) std::fill_n(flags.data + instances.instance[0], instances.count, std::uint8_t{kInstanceOk});
  return ((1u << instances.count) - 1) | kPosedRound;
}

// Poses and refits one tile of every sequence. A table is posed again for every tile, but reports its flags only with
// the first.
void update_sequences(const FrameContext& frame, Span<const BatchInput> inputs, std::uint32_t tile, Worker& worker) {
  for (const BatchInput& input : inputs) {
    const std::uint32_t index = slot_of(input.batch).value - 1;
    const InstanceBatch& batch = frame.batch(index);
    const std::uint32_t own_tile = tile_of(batch, tile);
    if (batch.kind != BatchKind::kSequence || own_tile >= tile_count(batch.instance_count)) continue;
    if (batch.is_round && tile != own_tile) continue;  // it is paired with itself alone
    const Timed timed(worker.stats.seconds_update);
    if (batch.by_states) pose_states(frame, batch, own_tile, worker.pose);
    if (batch.is_round)
      if (const std::uint32_t live = pose_round_tile(frame, *frame.batches[index], own_tile, worker.pose); live != 0) {
        worker.pairs.live[index] = live;
        continue;
      }
    const RefitScope scope = refit_scope(frame.policies.strategy, *batch.articulation);
    const TileUpdate update = {&batch, instances_of(batch, own_tile), scope,
                               worker.pose.boxes.data + batch.worker_nodes,
                               worker.pose.bounds.data + batch.worker_nodes};
    worker.pairs.live[index] = tile == own_tile ? update_and_flag_tile(frame, update, worker.pose, worker.stats)
                                                : update_tile(frame, update, worker.pose);
  }
}

// Whether a sequence is posed and tested as balls and capsules: its leaves are, it is paired with itself alone, and its
// poses and the policies ask for nothing that the kernel does not know.
bool is_tested_round(const FrameJob& job, const FrameContext& frame, const BatchInput& input) {
  const StoredBatch& stored = *frame.batches[slot_of(input.batch).value - 1];
  const Policies& policies = job.policies;
  if (!tests_lists(policies.exact) || policies.strategy != Strategy::kAuto || job.margin > kMostRoundLength)
    return false;
  if (stored.convex_shapes->round.leaves.empty() || input.poses.format != PoseFormat::kQuaternionTranslation ||
      !input.orientations.empty() || !input.scales.empty())
    return false;
  return std::none_of(job.rules.begin(), job.rules.end(), [&](const PairRule& rule) {
    return rule.pairing == Pairing::kBetween &&
           (slot_of(rule.a) == slot_of(input.batch) || slot_of(rule.b) == slot_of(input.batch));
  });
}

}  // namespace

std::uint32_t begin_sequences(FrameRun& run) {
  std::uint32_t tiles = 0;
  for (const BatchInput& input : run.job.inputs)
    if (InstanceBatch& batch = run.engine.batch(input.batch); batch.kind == BatchKind::kSequence) {
      tiles = std::max(tiles, tile_count(batch.instance_count));
      batch.is_round = is_tested_round(run.job, *run.sequences, input);
      batch.by_states = input.states.kinematics && batch.instance_count > 1;
      // All tiles read a table.
      if (input.states.kinematics && batch.instance_count == 1)
        pose_states(*run.sequences, batch, 0, run.worker(0).pose);
    }
  if (tiles == 0) return 0;
  run.sink.sorted = false;
  return tiles;
}

void run_sequence_tile(FrameRun& run, std::uint32_t tile, std::uint32_t w) {
  Worker& worker = run.worker(w);
  update_sequences(*run.sequences, run.job.inputs, tile, worker);
  for (const PairRule& rule : run.job.rules)
    if (run.engine.batch(rule.a).kind == BatchKind::kSequence)
      test_sequences(*run.sequences, rule, tile, worker, run.sink);
  append_hits(worker.hits.hits, run.sink);
}

}  // namespace cab
