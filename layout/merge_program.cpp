#include "layout/merge_program.h"

#include "layout/arena.h"

#include <algorithm>
#include <vector>

namespace cab {
namespace {

class Builder {
 public:
  Builder(Span<const std::int32_t> parents, Span<const std::uint16_t> leaf_links)
      : parents_(parents),
        leaves_of_(parents.size),
        weight_(parents.size, 0),
        below_(parents.size, 0),
        side_(parents.size, 0) {
    for (std::size_t leaf = 0; leaf < leaf_links.size; ++leaf) {
      leaves_of_[leaf_links[leaf]].push_back(static_cast<std::uint16_t>(leaf));
      ++weight_[leaf_links[leaf]];
      node_leaf_count_.push_back(1);
      node_first_leaf_.push_back(0);
      node_depth_.push_back(0);
    }
  }

  // Emits the steps of all links: each tree's, and then merges of the trees in pairs.
  void build() {
    std::vector<std::vector<std::uint32_t>> trees;
    std::vector<std::size_t> tree_of(parents_.size);
    for (std::uint32_t link = 0; link < parents_.size; ++link) {
      if (parents_[link] < 0) trees.emplace_back();
      tree_of[link] = parents_[link] < 0 ? trees.size() - 1 : tree_of[static_cast<std::size_t>(parents_[link])];
      trees[tree_of[link]].push_back(link);
    }
    std::vector<std::uint16_t> roots;
    for (const std::vector<std::uint32_t>& links : trees) {
      const bool has_leaf = std::any_of(links.begin(), links.end(), [this](std::uint32_t l) { return weight_[l] > 0; });
      if (has_leaf) roots.push_back(build_links(links));
    }
    while (roots.size() > 1) {
      std::vector<std::uint16_t> merged;
      for (std::size_t i = 0; i < roots.size(); i += 2)
        merged.push_back(i + 1 < roots.size() ? emit(roots[i], roots[i + 1], kNoJoint) : roots[i]);
      roots = std::move(merged);
    }
  }

  const std::vector<MergeStep>& steps() const { return steps_; }
  const std::vector<std::uint16_t>& node_leaf_count() const { return node_leaf_count_; }
  const std::vector<std::uint16_t>& node_first_leaf() const { return node_first_leaf_; }
  const std::vector<std::uint16_t>& leaf_sequence() const { return leaf_sequence_; }
  std::uint32_t root_depth() const { return node_depth_.back(); }

 private:
  // Emits the steps of a connected set of links, in ascending order, with at least one leaf. Returns the node it makes.
  std::uint16_t build_links(const std::vector<std::uint32_t>& links) {
    const std::uint32_t cut = best_cut(links);
    if (cut == 0) return build_leaves_of(links);
    std::vector<std::uint32_t> upper, lower;
    for (const std::uint32_t link : links) {
      side_[link] = link == cut || (link > cut && side_[static_cast<std::size_t>(parents_[link])] == cut) ? cut : 0;
      (side_[link] == cut ? lower : upper).push_back(link);
    }
    const std::uint16_t left = build_links(upper);
    const std::uint16_t right = build_links(lower);
    return emit(left, right, static_cast<std::uint16_t>(cut));
  }

  // The link whose joint with its parent halves the leaves of the set best, or 0 if no joint has leaves on both sides.
  // (The first link of the set has no parent in it, so it is never cut.)
  std::uint32_t best_cut(const std::vector<std::uint32_t>& links) {
    for (const std::uint32_t link : links) below_[link] = weight_[link];
    for (std::size_t i = links.size(); i-- > 1;)
      below_[static_cast<std::size_t>(parents_[links[i]])] += below_[links[i]];
    const std::uint32_t total = below_[links.front()];
    std::uint32_t best = 0;
    std::uint32_t best_larger = total;
    for (std::size_t i = 1; i < links.size(); ++i) {
      const std::uint32_t larger = std::max(below_[links[i]], total - below_[links[i]]);
      if (larger < best_larger) {
        best_larger = larger;
        best = links[i];
      }
    }
    return best;
  }

  // Emits the steps of a set of links if exactly one link of the set carries leaves. Returns the node.
  std::uint16_t build_leaves_of(const std::vector<std::uint32_t>& links) {
    const auto carrier =
        std::find_if(links.begin(), links.end(), [&](std::uint32_t link) { return weight_[link] > 0; });
    const auto& leaves = leaves_of_[*carrier];
    return build_leaf_range(leaves, 0, leaves.size());
  }

  std::uint16_t build_leaf_range(const std::vector<std::uint16_t>& leaves, std::size_t begin, std::size_t end) {
    if (end - begin == 1) {
      node_first_leaf_[leaves[begin]] = static_cast<std::uint16_t>(leaf_sequence_.size());
      leaf_sequence_.push_back(leaves[begin]);
      return leaves[begin];
    }
    const std::size_t middle = begin + (end - begin + 1) / 2;
    const std::uint16_t left = build_leaf_range(leaves, begin, middle);
    const std::uint16_t right = build_leaf_range(leaves, middle, end);
    return emit(left, right, kNoJoint);
  }

  std::uint16_t emit(std::uint16_t left, std::uint16_t right, std::uint16_t joint_link) {
    steps_.push_back({left, right, joint_link});
    node_leaf_count_.push_back(static_cast<std::uint16_t>(node_leaf_count_[left] + node_leaf_count_[right]));
    node_first_leaf_.push_back(node_first_leaf_[left]);
    node_depth_.push_back(1 + std::max(node_depth_[left], node_depth_[right]));
    return static_cast<std::uint16_t>(node_depth_.size() - 1);
  }

  Span<const std::int32_t> parents_;
  std::vector<std::vector<std::uint16_t>> leaves_of_;
  std::vector<std::uint32_t> weight_;  // leaves on a link
  std::vector<std::uint32_t> below_;   // leaves at and below a link, within the current set
  std::vector<std::uint32_t> side_;    // the last cut that a link was found below
  std::vector<MergeStep> steps_;
  std::vector<std::uint16_t> node_leaf_count_;
  std::vector<std::uint16_t> node_first_leaf_;  // an index into the sequence; the left child's leaves come first
  std::vector<std::uint16_t> leaf_sequence_;
  std::vector<std::uint32_t> node_depth_;
};

template <class T>
Span<const T> keep(const std::vector<T>& values, Arena& arena) {
  const auto kept = arena.copy(Span<const T>(values));
  return {kept.data, kept.size};
}

}  // namespace

MergeProgram build_merge_program(Span<const std::int32_t> link_parents, Span<const std::uint16_t> leaf_links,
                                 Arena& arena) {
  Builder builder(link_parents, leaf_links);
  builder.build();
  MergeProgram program;
  program.steps = keep(builder.steps(), arena);
  program.node_leaf_count = keep(builder.node_leaf_count(), arena);
  program.node_first_leaf = keep(builder.node_first_leaf(), arena);
  program.leaf_sequence = keep(builder.leaf_sequence(), arena);
  program.depth = builder.root_depth();
  return program;
}

}  // namespace cab
