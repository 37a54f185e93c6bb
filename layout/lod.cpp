#include "layout/lod.h"

#include "layout/arena.h"
#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

namespace cab {
namespace {

using Double3 = std::array<double, 3>;

template <class T>
Double3 double3(const T* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}
double dot(const Double3& a, const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Double3& a) { return std::sqrt(dot(a, a)); }
double distance(const Double3& a, const Double3& b) { return length({a[0] - b[0], a[1] - b[1], a[2] - b[2]}); }

template <class T>
Span<const T> keep(const std::vector<T>& values, Arena& arena) {
  return constant(arena.copy(Span<const T>(values)));
}

constexpr std::uint32_t kNone = 0xffffffff;

// ------------------------------------------------------------------------------- links that one leaf stands for

// The links of one leaf of a level, and all links on the paths between them, ascending.
struct Group {
  std::vector<std::uint32_t> links;
  std::vector<bool> stands_for;  // by entry of `links`
};

// The group of links that are in one tree; none if they are in several. anchor: a link that is in it in any case, or
// kNone.
std::optional<Group> group_of(Span<const std::int32_t> parents, const std::vector<std::uint32_t>& links,
                              std::uint32_t anchor) {
  std::vector<std::uint32_t> below(parents.size, 0);
  std::vector<bool> stands_for(parents.size, false);
  for (const std::uint32_t link : links) below[link] = 1, stands_for[link] = true;
  if (anchor != kNone) below[anchor] = 1;
  const auto total = static_cast<std::uint32_t>(std::count(below.begin(), below.end(), 1u));
  std::vector<bool> in_group(parents.size, false);
  for (std::size_t link = parents.size; link-- > 0;) {
    in_group[link] = in_group[link] || stands_for[link] || link == anchor;
    if (below[link] == 0 || below[link] == total) continue;
    if (parents[link] < 0) return std::nullopt;
    in_group[link] = in_group[static_cast<std::size_t>(parents[link])] = true;
    below[static_cast<std::size_t>(parents[link])] += below[link];
  }
  Group out;
  for (std::uint32_t link = 0; link < parents.size; ++link) {
    if (!in_group[link]) continue;
    out.links.push_back(link);
    out.stands_for.push_back(stands_for[link]);
  }
  return out;
}

// The links with leaves below a node, ascending.
std::vector<std::uint32_t> links_below(const Articulation& fine, std::uint32_t node) {
  std::vector<std::uint32_t> out;
  const std::uint32_t first = fine.program.node_first_leaf[node];
  for (std::uint32_t i = first; i < first + fine.program.node_leaf_count[node]; ++i)
    out.push_back(fine.leaf_link[fine.program.leaf_sequence[i]]);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

// Cuts the hierarchy of an articulation into at most `most` nodes, ascending: again and again the node of highest cost
// is opened, as long as several links are below it.
std::vector<std::uint32_t> cut_nodes(const Articulation& fine, std::uint32_t most,
                                     const std::function<double(std::uint32_t)>& cost) {
  struct Cut {
    std::uint32_t node;
    double cost;
  };
  const auto cut_at = [&](std::uint32_t node) {
    return Cut{node, links_below(fine, node).size() > 1 ? cost(node) : -1};
  };
  std::vector<Cut> cuts = {cut_at(fine.node_count - 1)};
  while (cuts.size() < most) {
    const auto costliest =
        std::max_element(cuts.begin(), cuts.end(), [](const Cut& x, const Cut& y) { return x.cost < y.cost; });
    if (costliest->cost < 0) break;
    const MergeStep& step = fine.program.steps[costliest->node - fine.leaf_count];
    *costliest = cut_at(step.left);
    cuts.push_back(cut_at(step.right));
  }
  std::vector<std::uint32_t> out;
  for (const Cut& cut : cuts) out.push_back(cut.node);
  std::sort(out.begin(), out.end());
  return out;
}

// ------------------------------------------------------------------------------------------------ what links reach

// What a box on a link must hold for one group: balls, and leaf boxes of that link with room about them.
struct Reached {
  struct Ball {
    Double3 center;
    double radius;
  };
  std::vector<Ball> balls;
  std::vector<const Box*> boxes;

  // The interval that all of it covers along a unit vector.
  void along(const Double3& axis, double* lo, double* hi) const {
    *lo = std::numeric_limits<double>::infinity();
    *hi = -*lo;
    const auto add = [&](const Double3& center, double reach) {
      *lo = std::min(*lo, dot(center, axis) - reach);
      *hi = std::max(*hi, dot(center, axis) + reach);
    };
    for (const Ball& ball : balls) add(ball.center, ball.radius);
    for (const Box* box : boxes) {
      double reach = 0, size = length(double3(box->center));
      for (int k = 0; k < 3; ++k) {
        const auto half = static_cast<double>(box->half[k]);
        reach += half * std::fabs(dot(double3(box->axis[k]), axis));
        size += half;
      }
      add(double3(box->center), reach + kReachGrow * size);
    }
  }
};

// Finds what the links of one group reach, seen from any of them.
class GroupReach {
 public:
  GroupReach(const Articulation& fine, const std::vector<JointPlace>& joints, const Group& group)
      : fine_(fine),
        joints_(joints),
        group_(group),
        place_(fine.link_count, kNone),
        children_(group.links.size()),
        known_(2 * group.links.size(), -1) {
    for (std::uint32_t i = 0; i < group.links.size(); ++i) {
      place_[group.links[i]] = i;
      const std::int32_t parent = fine.link_parent[group.links[i]];
      if (parent >= 0 && place_[static_cast<std::size_t>(parent)] != kNone)
        children_[place_[static_cast<std::size_t>(parent)]].push_back(group.links[i]);
    }
  }

  Reached from(std::uint32_t link) {
    Reached out;
    const std::uint32_t at = place_[link];
    for (std::size_t i = 0; group_.stands_for[at] && i < leaves_of(fine_, link).size; ++i)
      out.boxes.push_back(&fine_.leaf_box[leaves_of(fine_, link)[i]]);
    for_each_neighbour(link, [&](std::uint32_t next) {
      const Seen joint = joint_between(link, next, link);
      out.balls.push_back({joint.at, joint.play + kReachGrow * length(joint.at) + reach(next, link)});
    });
    return out;
  }

 private:
  // A joint in the frame of one of its two links.
  struct Seen {
    Double3 at;
    double play;
  };

  Seen joint_between(std::uint32_t link, std::uint32_t other, std::uint32_t in_frame_of) const {
    const std::uint32_t child = std::max(link, other);
    if (in_frame_of == child) return {double3(fine_.link_joint.data + 3 * child), 0};
    return {double3(joints_[child].at), joints_[child].play};
  }

  template <class Visit>
  void for_each_neighbour(std::uint32_t link, Visit&& visit) const {
    for (const std::uint32_t child : children_[place_[link]]) visit(child);
    const std::int32_t parent = fine_.link_parent[link];
    if (parent >= 0 && place_[static_cast<std::size_t>(parent)] != kNone) visit(static_cast<std::uint32_t>(parent));
  }

  // How far from its joint with `from` a link, and all links behind it, can reach.
  double reach(std::uint32_t link, std::uint32_t from) {
    double& known = known_[2 * place_[std::max(link, from)] + (link < from)];
    if (known < 0) known = find_reach(link, from);
    return known;
  }

  double find_reach(std::uint32_t link, std::uint32_t from) {
    const Seen joint = joint_between(from, link, link);
    double out = 0;
    for (std::size_t i = 0; group_.stands_for[place_[link]] && i < leaves_of(fine_, link).size; ++i) {
      const Box& box = fine_.leaf_box[leaves_of(fine_, link)[i]];
      for (unsigned corner = 0; corner < 8; ++corner) {
        Double3 at = double3(box.center);
        for (unsigned k = 0; k < 3; ++k)
          for (std::size_t c = 0; c < 3; ++c)
            at[c] +=
                (corner >> k & 1 ? 1.0 : -1.0) * static_cast<double>(box.half[k]) * static_cast<double>(box.axis[k][c]);
        out = std::max(out, distance(at, joint.at) + kReachGrow * (length(at) + length(joint.at)));
      }
    }
    for_each_neighbour(link, [&](std::uint32_t next) {
      if (next == from) return;
      const Seen behind = joint_between(link, next, link);
      out = std::max(out, distance(behind.at, joint.at) + behind.play +
                              kReachGrow * (length(behind.at) + length(joint.at)) + reach(next, link));
    });
    return out + joint.play;
  }

  const Articulation& fine_;
  const std::vector<JointPlace>& joints_;
  const Group& group_;
  std::vector<std::uint32_t> place_;                  // by link: its entry in the group, or kNone
  std::vector<std::vector<std::uint32_t>> children_;  // by entry
  std::vector<double> known_;  // by entry: the reach of its link from its parent, and of its parent from it; or -1
};

// The box with the given axes about all that is reached.
Box box_about(const Reached& reached, const float (&axes)[3][3]) {
  Box out = {};
  double lo[3], hi[3];
  Double3 center = {0, 0, 0};
  for (int k = 0; k < 3; ++k) {
    std::copy(axes[k], axes[k] + 3, out.axis[k]);
    reached.along(double3(axes[k]), &lo[k], &hi[k]);
    for (std::size_t c = 0; c < 3; ++c) center[c] += 0.5 * (lo[k] + hi[k]) * static_cast<double>(axes[k][c]);
  }
  for (std::size_t c = 0; c < 3; ++c) out.center[c] = static_cast<float>(center[c]);
  const double rounding =
      kReachTiny + kReachRounding * (length(center) + hi[0] - lo[0] + hi[1] - lo[1] + hi[2] - lo[2]);
  for (int k = 0; k < 3; ++k) out.half[k] = rounded_up(0.5 * (hi[k] - lo[k]) + rounding);
  return out;
}

bool holds(const Box& box, const Reached& reached) {
  bool out = true;
  for (int k = 0; k < 3; ++k) {
    double lo, hi;
    reached.along(double3(box.axis[k]), &lo, &hi);
    const double center = dot(double3(box.center), double3(box.axis[k])), half = static_cast<double>(box.half[k]);
    out = out && lo >= center - half && hi <= center + half;
  }
  return out;
}

double area(const Box& box) {
  const auto half = [&box](int k) { return static_cast<double>(box.half[k]); };
  return half(0) * half(1) + half(1) * half(2) + half(2) * half(0);
}

// A box on one link.
struct LinkBox {
  std::uint32_t link = 0;
  Box box = {};
};

// The box of least area for a group, on any of its links: along that link's axes, or along those of its first leaf.
LinkBox smallest_box(const Articulation& fine, const std::vector<JointPlace>& joints, const Group& group) {
  constexpr float kOwnAxes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  GroupReach reach(fine, joints, group);
  LinkBox best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::uint32_t link : group.links) {
    const Reached reached = reach.from(link);
    const auto take = [&](const Box& box) {
      if (!(area(box) < least)) return;
      best = {link, box};
      least = area(box);
    };
    take(box_about(reached, kOwnAxes));
    if (const Span<const std::uint16_t> leaves = leaves_of(fine, link); !leaves.empty())
      take(box_about(reached, fine.leaf_box[leaves[0]].axis));
  }
  return best;
}

// ------------------------------------------------------------------------------------------------- the articulation

// The links that a level's leaf stands for, and the link that names it in hits.
struct LodSet {
  std::uint32_t link;
  std::vector<std::uint32_t> links;
};

// By link the leaf that stands for it. Empty if a link with leaves is in no set or in two.
std::vector<std::uint16_t> leaf_of_links(const Articulation& fine, const std::vector<LodSet>& sets) {
  std::vector<std::uint16_t> out(fine.link_count, kNoLeaf);
  for (std::size_t leaf = 0; leaf < sets.size(); ++leaf)
    for (const std::uint32_t link : sets[leaf].links) {
      if (out[link] != kNoLeaf) return {};
      out[link] = static_cast<std::uint16_t>(leaf);
    }
  for (std::uint32_t link = 0; link < fine.link_count; ++link) {
    const bool has_leaves = !leaves_of(fine, link).empty();
    if (has_leaves && out[link] == kNoLeaf) return {};
    if (!has_leaves) out[link] = kNoLeaf;
  }
  return out;
}

// The pairs of a level's leaves, by the links that name them, of which all links are ignored pairs.
std::vector<LinkPair> ignored_sets(const Articulation& fine, const std::vector<LodSet>& sets,
                                   const std::vector<std::uint16_t>& leaf_of_link) {
  std::vector<bool> reported(sets.size() * sets.size(), false);
  for (std::uint32_t a = 0; a < fine.link_count; ++a)
    for (std::uint32_t b = 0; b < fine.link_count; ++b)
      if (leaf_of_link[a] != kNoLeaf && leaf_of_link[b] != kNoLeaf && !is_ignored(fine, a, b))
        reported[leaf_of_link[a] * sets.size() + leaf_of_link[b]] = true;
  std::vector<LinkPair> out;
  for (std::size_t a = 0; a < sets.size(); ++a)
    for (std::size_t b = a + 1; b < sets.size(); ++b)
      if (!reported[a * sets.size() + b]) out.push_back({sets[a].link, sets[b].link});
  return out;
}

// Builds the articulation of boxes on links.
Status build_boxes(const Articulation& fine, const std::vector<LodSet>& sets, const std::vector<Box>& boxes,
                   const std::vector<std::uint16_t>& leaf_of_link, Arena& arena, Articulation* out,
                   std::uint32_t* bad_leaf) {
  std::vector<Leaf> leaves;
  for (std::size_t i = 0; i < sets.size(); ++i) leaves.push_back({sets[i].link, boxes[i], {}});
  const std::vector<LinkPair> ignored = ignored_sets(fine, sets, leaf_of_link);
  ArticulationDesc desc;
  desc.link_parents = fine.link_parent;
  desc.link_joints = fine.link_joint;
  desc.leaves = leaves;
  desc.ignored_pairs = ignored;
  const Status status = build_articulation(desc, arena, out, bad_leaf);
  if (status != Status::kOk) return status;
  out->lod.leaf_of_link = keep(leaf_of_link, arena);
  out->lod.finest_leaves = fine.leaf_count;
  return status;
}

Status made_by_library(const Articulation& fine, std::uint32_t max_leaves, const std::vector<JointPlace>& joints,
                       Arena& arena, Articulation* out) {
  constexpr double kSeveralTrees = std::numeric_limits<double>::infinity();
  const auto group_below = [&](std::uint32_t node) {
    return group_of(fine.link_parent, links_below(fine, node), kNone);
  };
  const std::vector<std::uint32_t> nodes = cut_nodes(fine, max_leaves, [&](std::uint32_t node) {
    const std::optional<Group> group = group_below(node);
    return group ? area(smallest_box(fine, joints, *group).box) : kSeveralTrees;
  });
  struct Made {
    LodSet set;
    Box box;
  };
  std::vector<Made> made;
  for (const std::uint32_t node : nodes) {
    const std::optional<Group> group = group_below(node);
    if (!group) return Status::kTooFewLeaves;
    const LinkBox on_link = smallest_box(fine, joints, *group);
    made.push_back({{on_link.link, links_below(fine, node)}, on_link.box});
  }
  std::sort(made.begin(), made.end(), [](const Made& x, const Made& y) { return x.set.link < y.set.link; });
  std::vector<LodSet> sets;
  std::vector<Box> boxes;
  for (Made& one : made) {
    boxes.push_back(one.box);
    sets.push_back(std::move(one.set));
  }
  return build_boxes(fine, sets, boxes, leaf_of_links(fine, sets), arena, out, nullptr);
}

Status made_by_caller(const Articulation& fine, Span<const LodLeaf> leaves, const std::vector<JointPlace>& joints,
                      Arena& arena, Articulation* out, std::uint32_t* bad_leaf) {
  const auto refuse = [bad_leaf](Status status, std::size_t leaf) {
    if (bad_leaf) *bad_leaf = static_cast<std::uint32_t>(leaf);
    return status;
  };
  if (!leaves.data) return refuse(Status::kBadLod, 0);
  if (leaves.size > kMaxLeaves) return refuse(Status::kTooManyLeaves, kMaxLeaves);
  std::vector<LodSet> sets;
  std::vector<Box> boxes;
  std::vector<bool> carries(fine.link_count, false);
  for (std::size_t i = 0; i < leaves.size; ++i) {
    const LodLeaf& leaf = leaves[i];
    const bool known = leaf.link < fine.link_count && (leaf.links.data || leaf.links.empty()) &&
                       std::all_of(leaf.links.begin(), leaf.links.end(),
                                   [&fine](std::uint32_t link) { return link < fine.link_count; });
    if (!known) return refuse(Status::kBadLeafLink, i);
    if (carries[leaf.link]) return refuse(Status::kBadLod, i);
    carries[leaf.link] = true;
    sets.push_back({leaf.link, {leaf.links.begin(), leaf.links.end()}});
    boxes.push_back(leaf.box);
  }
  const std::vector<std::uint16_t> leaf_of_link = leaf_of_links(fine, sets);
  if (leaf_of_link.empty()) return refuse(Status::kBadLod, 0);
  Articulation built;
  if (const Status status = build_boxes(fine, sets, boxes, leaf_of_link, arena, &built, bad_leaf);
      status != Status::kOk)
    return status;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const std::optional<Group> group = group_of(fine.link_parent, sets[i].links, sets[i].link);
    if (!group) return refuse(Status::kBadLod, i);
    if (!holds(built.leaf_box[i], GroupReach(fine, joints, *group).from(sets[i].link)))
      return refuse(Status::kLodLeafTooSmall, i);
  }
  *out = built;
  return Status::kOk;
}

// The merge program of the part of a hierarchy that is above some of its nodes, and those nodes as its leaves.
// level_node: by node of `fine` its node in the level, or kNone.
MergeProgram program_above(const Articulation& fine, const std::vector<std::uint32_t>& level_node, std::uint32_t leaves,
                           Arena& arena) {
  std::vector<MergeStep> steps;
  std::vector<std::uint16_t> count(leaves, 1), first(leaves, 0), sequence, depth(leaves, 0);
  for (std::uint32_t s = 0; s < fine.program.steps.size; ++s) {
    const std::uint32_t node = level_node[fine.leaf_count + s];
    if (node == kNone || node < leaves) continue;
    const MergeStep& from = fine.program.steps[s];
    const auto left = static_cast<std::uint16_t>(level_node[from.left]),
               right = static_cast<std::uint16_t>(level_node[from.right]);
    steps.push_back({left, right, from.joint_link});
    count.push_back(static_cast<std::uint16_t>(count[left] + count[right]));
    depth.push_back(static_cast<std::uint16_t>(1 + std::max(depth[left], depth[right])));
    first.push_back(0);
  }
  for (std::size_t node = count.size(); node-- > leaves;) {  // from the root down
    const MergeStep& step = steps[node - leaves];
    first[step.left] = first[node];
    first[step.right] = static_cast<std::uint16_t>(first[node] + count[step.left]);
  }
  sequence.resize(leaves);
  for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) sequence[first[leaf]] = static_cast<std::uint16_t>(leaf);
  MergeProgram out;
  out.steps = keep(steps, arena);
  out.node_leaf_count = keep(count, arena);
  out.node_first_leaf = keep(first, arena);
  out.leaf_sequence = keep(sequence, arena);
  out.depth = depth.back();
  return out;
}

}  // namespace

Status build_reach_lod(const Articulation& fine, const LodDesc& desc, const std::vector<JointPlace>& joints,
                       Arena& arena, Articulation* out, std::uint32_t* bad_leaf) {
  if (desc.leaves.size) return made_by_caller(fine, desc.leaves, joints, arena, out, bad_leaf);
  if (desc.max_leaves == 0 || desc.max_leaves > kMaxLeaves) return Status::kTooFewLeaves;
  return made_by_library(fine, desc.max_leaves, joints, arena, out);
}

Status build_node_lod(const Articulation& fine, std::uint32_t max_leaves, Arena& arena, Articulation* out) {
  if (max_leaves == 0 || max_leaves > kMaxLeaves) return Status::kTooFewLeaves;
  const std::vector<std::uint32_t> cut = cut_nodes(fine, max_leaves, [&fine](std::uint32_t node) {
    return static_cast<double>(fine.program.node_leaf_count[node]);
  });
  std::vector<LodSet> sets;
  std::vector<std::uint16_t> links, nodes;
  std::vector<std::uint32_t> level_node(fine.node_count, kNone);
  for (const std::uint32_t node : cut) {
    level_node[node] = static_cast<std::uint32_t>(nodes.size());
    nodes.push_back(static_cast<std::uint16_t>(node));
    sets.push_back({0, links_below(fine, node)});
    sets.back().link = sets.back().links.front();
    links.push_back(static_cast<std::uint16_t>(sets.back().link));
  }
  for (std::uint32_t node = fine.leaf_count; node < fine.node_count; ++node) {
    const MergeStep& step = fine.program.steps[node - fine.leaf_count];
    if (level_node[node] != kNone || level_node[step.left] == kNone || level_node[step.right] == kNone) continue;
    level_node[node] = static_cast<std::uint32_t>(nodes.size());
    nodes.push_back(static_cast<std::uint16_t>(node));
  }
  const std::vector<std::uint16_t> leaf_of_link = leaf_of_links(fine, sets);
  const std::vector<LinkPair> ignored = ignored_sets(fine, sets, leaf_of_link);
  Articulation level;
  level.link_count = fine.link_count;
  level.leaf_count = static_cast<std::uint32_t>(cut.size());
  level.node_count = 2 * level.leaf_count - 1;
  level.link_parent = constant(arena.copy(fine.link_parent));
  level.link_joint = constant(arena.copy(fine.link_joint));
  level.leaf_link = keep(links, arena);
  level.is_chain = fine.is_chain;
  level.leaves_by_link = std::is_sorted(links.begin(), links.end());
  level.program = program_above(fine, level_node, level.leaf_count, arena);
  level.lod = {keep(leaf_of_link, arena), fine.leaf_count, &fine, keep(nodes, arena)};
  ignore_pairs(ignored, arena, level);
  *out = level;
  return Status::kOk;
}

}  // namespace cab
