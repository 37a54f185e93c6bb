// The golden hashes of the paper's scenes from kernels alone, for builds without the engine, such as the one that runs
// under an emulator.
#include "kernels/descend_tiles.h"
#include "kernels/pose_leaves.h"
#include "kernels/refit_tree.h"
#include "layout/arena.h"
#include "scenes/paper/registry.h"
#include "tests/kernels/isas.h"
#include "tests/scenes/golden_hashes.h"

#include <doctest/doctest.h>

#include <deque>

namespace cab::tests {
namespace {

using scenes::Scene;

// One character's articulation, and the memory for a tile of its frames.
struct Body {
  explicit Body(const scenes::Character& of) : character(&of), arena(default_allocator()) {
    const scenes::ArticulationStorage storage(of);
    REQUIRE(build_articulation(storage.desc(), arena, &articulation, nullptr) == Status::kOk);
    nodes = arena.allocate<BoxTile>(articulation.node_count).data;
    joints = arena.allocate<PointTile>(articulation.link_count).data;
  }

  // The boxes of frames first to first + live - 1. A static character has its one frame in every lane.
  void update(const kernel::KernelTable& kernels, const Policies& policies, std::uint32_t first, std::uint32_t live) {
    std::uint8_t flags[kLanes];
    kernel::PoseTile pose = {};
    pose.articulation = &articulation;
    pose.coding.format = character->pose_format;
    pose.link_stride = pose_floats(pose.coding.format);
    if (character->is_static) first = 0, live = 1;
    const std::size_t floats = articulation.link_count * pose.link_stride;
    kernel::point_lanes(character->poses.data() + first * floats, floats, live, pose.poses);
    pose.leaves = nodes;
    pose.joints = joints;
    pose.flags = flags;
    kernels.pose_leaves(pose);
    for (const std::uint8_t flag : flags) REQUIRE(flag == kInstanceOk);
    kernels.refit_boxes[static_cast<std::size_t>(policies.refit)][static_cast<std::size_t>(policies.extents)](
        {&articulation.program, joints, nodes});
  }

  const scenes::Character* character;
  Arena arena;
  Articulation articulation;
  BoxTile* nodes;
  PointTile* joints;
};

// The pairs of links that touch in a tile of frames.
void append_touches(const kernel::KernelTable& kernels, const Policies& policies, std::deque<Body>& bodies,
                    const scenes::CharacterPair& pair, std::uint32_t first, std::uint32_t live,
                    std::vector<GoldenTouch>& touches) {
  const Articulation &a = bodies[pair.a].articulation, &b = bodies[pair.b].articulation;
  std::vector<TilePair> stack(a.program.depth + b.program.depth + 2), found(a.leaf_count * b.leaf_count);
  kernel::TileDescent<BoxTile> job = {};
  job.articulation_a = &a;
  job.articulation_b = &b;
  job.nodes_a = bodies[pair.a].nodes;
  job.nodes_b = bodies[pair.b].nodes;
  job.lanes = (2u << (live - 1)) - 1;
  job.stack = {stack.data(), static_cast<std::uint32_t>(stack.size()), 0};
  job.found = {found.data(), static_cast<std::uint32_t>(found.size()), 0};
  (policies.strategy == Strategy::kTree ? kernels.descend_boxes
                                        : kernels.brute_boxes)[static_cast<std::size_t>(policies.sat)](job);
  for (const TilePair& leaves : job.found)
    for (std::uint32_t lane = 0; lane < live; ++lane)
      if (leaves.lanes >> lane & 1)
        touches.push_back({first + lane, pair.a, a.leaf_link[leaves.a], pair.b, b.leaf_link[leaves.b]});
}

GoldenBits bits_of(const Scene& scene, const kernel::KernelTable& kernels, const Policies& policies) {
  std::deque<Body> bodies;
  for (const scenes::Character& character : scene.characters) bodies.emplace_back(character);
  cab::BitHash boxes;
  std::vector<GoldenTouch> touches;
  for (std::uint32_t first = 0; first < kGoldenFrames; first += kLanes) {
    const std::uint32_t live = std::min(kLanes, kGoldenFrames - first);
    for (Body& body : bodies) body.update(kernels, policies, first, live);
    for (std::uint32_t lane = 0; lane < live; ++lane) {
      for (const Body& body : bodies) {
        for (std::uint32_t node = 0; node < body.articulation.node_count; ++node) {
          const oracle::OracleBox<float> box = get(body.nodes[node], lane);
          Box out;
          static_assert(sizeof(out) == sizeof(box));
          std::memcpy(static_cast<void*>(&out), &box, sizeof(out));
          boxes.add(out);
        }
      }
    }
    for (const scenes::CharacterPair& pair : scene.pairs)
      append_touches(kernels, policies, bodies, pair, first, live, touches);
  }
  return {boxes.value(), hash_touches(std::move(touches))};
}

}  // namespace

TEST_CASE("kernels alone give the golden hashes of every paper scene on every instruction set") {
  for (const GoldenScene& golden : kGoldenScenes) {
    CAPTURE(golden.table);
    const Scene scene = scenes::make_paper_scene(golden.table, kGoldenFrames);
    const std::string reason = other_scene(scene, golden);
    if (!reason.empty()) MESSAGE("skipped: " << reason << ", but with scalar code");
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(name_of(*kernels));
      for (std::size_t m = 0; m < kGoldenOriented; ++m) {
        CAPTURE(m);
        const GoldenBits expected =
            reason.empty() ? golden.bits[m] : bits_of(scene, *available_kernels()[0], kGoldenPolicies[m]);
        const GoldenBits found = bits_of(scene, *kernels, kGoldenPolicies[m]);
        CHECK(found.boxes == expected.boxes);
        CHECK(found.hits == expected.hits);
      }
    }
  }
}

}  // namespace cab::tests
