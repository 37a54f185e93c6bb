#include "perf/measure/paper/partial_update.h"

#include <cab/cab.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "kernels/descend_tiles.h"
#include "kernels/find_kernels.h"
#include "kernels/float_mode.h"
#include "kernels/pose_leaves.h"
#include "kernels/refit_tree.h"
#include "layout/arena.h"

namespace cab::perf {
namespace {

using Clock = std::chrono::steady_clock;

double seconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

// A merge program of one step: the node to refit, and where the leaves below it are, counted from its first child.
struct NodeRefit {
  MergeStep step = {};
  std::array<std::uint16_t, 3> leaf_count = {};
  std::array<std::uint16_t, 3> first_leaf = {};
  std::vector<std::uint16_t> leaves;
  MergeProgram program;
};

// The index of the node of a one-step program, which comes after its two children.
constexpr std::uint32_t kStepNode = 2;

// One character's tree for one tile. Inner nodes lie before the leaves, the root first, so that one inner node can be
// refitted alone by the kernel that refits a tree.
class LazyTree {
 public:
  explicit LazyTree(const scenes::Character& character)
      : character_(character), storage_(character), arena_(default_allocator()) {
    std::uint32_t bad_element = 0;
    const Status status = build_articulation(storage_.desc(), arena_, &articulation_, &bad_element);
    if (status != Status::kOk) throw std::runtime_error(character.name + ": " + to_string(status));
    if (articulation_.leaf_count != articulation_.link_count || !character.origins.empty())
      throw std::runtime_error(character.name + ": a partial update needs one leaf per link and no origins");
    boxes_.resize(articulation_.leaf_count);
    joints_.resize(articulation_.link_count);
    bounds_.resize(kStepNode + articulation_.node_count);
    is_fresh_.resize(articulation_.node_count);
    for (std::uint32_t node = articulation_.leaf_count; node < articulation_.node_count; ++node) add_refit(node);
    find_upper_levels();
  }

  const Articulation& articulation() const { return articulation_; }
  AabbTile& bounds(std::uint32_t node) { return bounds_[place(node)]; }

  // Poses the leaves in frames first .. first + live - 1 and refits the upper levels.
  void begin_tile(const kernel::KernelTable& kernels, std::uint32_t first, std::uint32_t live) {
    const std::size_t floats = pose_floats(character_.pose_format) * std::size_t{articulation_.link_count};
    std::uint8_t flags[kLanes];
    kernel::PoseTile pose = {};
    pose.articulation = &articulation_;
    pose.coding.format = character_.pose_format;
    if (character_.is_static) first = 0, live = 1;
    kernel::point_lanes(character_.poses.data() + first * floats, floats, live, pose.poses);
    pose.link_stride = pose_floats(character_.pose_format);
    pose.leaves = boxes_.data();
    pose.joints = joints_.data();
    pose.flags = flags;
    kernels.pose_leaves(pose);
    for (std::uint32_t lane = 0; lane < live; ++lane)
      if (flags[lane] != kInstanceOk) throw std::runtime_error(character_.name + ": a pose is not rigid");
    kernels.bound_boxes(boxes_.data(), articulation_.leaf_count, &bounds(0));
    std::fill(is_fresh_.begin(), is_fresh_.end(), false);
    std::fill(is_fresh_.begin(), is_fresh_.begin() + articulation_.leaf_count, true);
    for (const std::uint32_t node : upper_) refresh(kernels, node);
  }

  // Refits a node from all leaves below it, the first time in a tile.
  void refresh(const kernel::KernelTable& kernels, std::uint32_t node) {
    if (is_fresh_[node]) return;
    is_fresh_[node] = true;
    const auto leaves = static_cast<std::size_t>(Extents::kLeaves);
    kernels.refit_aabbs[leaves](refits_[node - articulation_.leaf_count]->program, &bounds_[place(node) - kStepNode]);
  }

 private:
  std::uint32_t place(std::uint32_t node) const {
    const std::uint32_t inner_count = articulation_.leaf_count - 1;
    return kStepNode + (node < articulation_.leaf_count ? inner_count + node : articulation_.node_count - 1 - node);
  }

  void add_refit(std::uint32_t node) {
    const MergeProgram& tree = articulation_.program;
    auto refit = std::make_unique<NodeRefit>();
    refit->leaf_count[kStepNode] = tree.node_leaf_count[node];
    for (std::uint32_t i = 0; i < tree.node_leaf_count[node]; ++i) {
      const std::uint32_t leaf = tree.leaf_sequence[tree.node_first_leaf[node] + i];
      refit->leaves.push_back(static_cast<std::uint16_t>(place(leaf) - place(node) + kStepNode));
    }
    refit->program.steps = {&refit->step, 1};
    refit->program.node_leaf_count = refit->leaf_count;
    refit->program.node_first_leaf = refit->first_leaf;
    refit->program.leaf_sequence = refit->leaves;
    refits_.push_back(std::move(refit));
  }

  // The inner nodes at most half the depth below the root.
  void find_upper_levels() {
    const MergeProgram& tree = articulation_.program;
    std::vector<std::uint32_t> level(articulation_.node_count, 0);
    for (std::uint32_t node = articulation_.node_count; node-- > articulation_.leaf_count;) {
      const MergeStep& step = tree.steps[node - articulation_.leaf_count];
      level[step.left] = level[step.right] = level[node] + 1;
      if (level[node] <= tree.depth / 2) upper_.push_back(node);
    }
  }

  const scenes::Character& character_;
  scenes::ArticulationStorage storage_;
  Arena arena_;
  Articulation articulation_;
  std::vector<BoxTile> boxes_;
  std::vector<PointTile> joints_;
  std::vector<AabbTile> bounds_;
  std::vector<bool> is_fresh_;
  std::vector<std::unique_ptr<NodeRefit>> refits_;  // one per inner node
  std::vector<std::uint32_t> upper_;
};

// The box test of the kernels, one pair of nodes at a time: two trees of one leaf.
class PairTest {
 public:
  explicit PairTest(const kernel::KernelTable& kernels) : kernels_(kernels) {
    leaf_.leaf_count = leaf_.node_count = 1;
    job_.articulation_a = job_.articulation_b = &leaf_;
    job_.shift = nullptr;
    job_.self = false;
    job_.stack = {stack_.data(), static_cast<std::uint32_t>(stack_.size()), 0};
    job_.found = {&found_, 1, 0};
    job_.box_tests = 0;
  }

  // Returns which of the given lanes have overlapping bounds.
  std::uint32_t overlap(const AabbTile& a, const AabbTile& b, std::uint32_t lanes) {
    job_.nodes_a = &a;
    job_.nodes_b = &b;
    job_.lanes = lanes;
    job_.found.clear();
    kernels_.descend_aabbs(job_);
    return job_.found.empty() ? 0 : found_.lanes;
  }
  std::uint64_t box_tests() const { return job_.box_tests; }

 private:
  const kernel::KernelTable& kernels_;
  Articulation leaf_;
  std::array<TilePair, 4> stack_ = {};
  TilePair found_ = {};
  kernel::TileDescent<AabbTile> job_ = {};
};

// The engine's descent, node by node, with refits on the way.
void descend(const kernel::KernelTable& kernels, PairTest& test, LazyTree& a, LazyTree& b, std::uint32_t live,
             std::vector<TilePair>& found) {
  const Articulation &art_a = a.articulation(), &art_b = b.articulation();
  std::vector<TilePair> stack = {{static_cast<std::uint16_t>(art_a.node_count - 1),
                                  static_cast<std::uint16_t>(art_b.node_count - 1), (2u << (live - 1)) - 1}};
  while (!stack.empty()) {
    const TilePair pair = stack.back();
    stack.pop_back();
    a.refresh(kernels, pair.a);
    b.refresh(kernels, pair.b);
    const std::uint32_t lanes = test.overlap(a.bounds(pair.a), b.bounds(pair.b), pair.lanes);
    if (!lanes) continue;
    if (pair.a < art_a.leaf_count && pair.b < art_b.leaf_count) {
      found.push_back({pair.a, pair.b, lanes});
    } else if (art_a.program.node_leaf_count[pair.a] >= art_b.program.node_leaf_count[pair.b]) {
      const MergeStep& step = art_a.program.steps[pair.a - art_a.leaf_count];
      stack.push_back({step.right, pair.b, lanes});
      stack.push_back({step.left, pair.b, lanes});
    } else {
      const MergeStep& step = art_b.program.steps[pair.b - art_b.leaf_count];
      stack.push_back({pair.a, step.right, lanes});
      stack.push_back({pair.a, step.left, lanes});
    }
  }
}

void add_touches(const LazyTree& a, const LazyTree& b, const scenes::CharacterPair& characters, std::uint32_t first,
                 const std::vector<TilePair>& found, std::vector<Touch>& touches) {
  for (const TilePair& pair : found)
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      if (pair.lanes >> lane & 1)
        touches.push_back({first + lane,
                           characters.a,
                           a.articulation().leaf_link[pair.a],
                           characters.b,
                           b.articulation().leaf_link[pair.b],
                           {}});
}

}  // namespace

FrameStats run_partial_update(const scenes::Scene& scene, Isa isa,
                              const std::function<void(const std::vector<Touch>&)>& on_touches) {
  const kernel::KernelTable* kernels = kernel::find_kernels(isa);
  if (!kernels || scene.pairs.empty()) throw std::runtime_error(scene.name + ": nothing to run a partial update on");
  const kernel::FloatMode mode;
  std::vector<std::unique_ptr<LazyTree>> trees;
  for (const scenes::Character& character : scene.characters) trees.push_back(std::make_unique<LazyTree>(character));
  PairTest test(*kernels);
  FrameStats stats;
  std::vector<std::vector<TilePair>> found(scene.pairs.size());
  std::vector<Touch> touches;
  for (std::uint32_t first = 0; first < scene.frame_count; first += kLanes) {
    const std::uint32_t live = std::min(kLanes, scene.frame_count - first);
    const auto descend_all = [&] {
      for (std::size_t p = 0; p < scene.pairs.size(); ++p) {
        found[p].clear();
        descend(*kernels, test, *trees[scene.pairs[p].a], *trees[scene.pairs[p].b], live, found[p]);
      }
    };
    const auto start = Clock::now();
    for (const auto& tree : trees) tree->begin_tile(*kernels, first, live);
    descend_all();
    const auto refitted = Clock::now();
    const std::uint64_t tests = test.box_tests();
    descend_all();  // every node that it visits is fresh, so only tests are timed
    const auto end = Clock::now();
    stats.box_tests += test.box_tests() - tests;
    stats.seconds_update += seconds(start, refitted) - seconds(refitted, end);
    stats.seconds_test += seconds(refitted, end);

    touches.clear();
    for (std::size_t p = 0; p < scene.pairs.size(); ++p)
      add_touches(*trees[scene.pairs[p].a], *trees[scene.pairs[p].b], scene.pairs[p], first, found[p], touches);
    std::sort(touches.begin(), touches.end(), [](const Touch& l, const Touch& r) {
      return std::tie(l.frame, l.character_a, l.character_b, l.link_a, l.link_b) <
             std::tie(r.frame, r.character_a, r.character_b, r.link_a, r.link_b);
    });
    stats.leaf_pairs += touches.size();
    on_touches(touches);
  }
  return stats;
}

}  // namespace cab::perf
