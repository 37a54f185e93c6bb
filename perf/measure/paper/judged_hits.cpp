#include "perf/measure/paper/judged_hits.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>

#include "perf/base/report.h"
#include "perf/judge/oracle/convex_pairs.h"
#include "perf/measure/paper/judged_character.h"

namespace cab::perf {
namespace {

using oracle::JudgeShape;
using oracle::Point;
using oracle::Real;

// A pair that convex reports is at most this share of T_a + T_b apart (docs/proof.md, part 9).
constexpr Real kTouching = 0x1p-40L;

// One convex shape, posed for the judge, and its T: the sum of the lengths that its points are made of.
struct PosedShape {
  JudgeShape shape;
  std::vector<Point> vertices;
  Real lengths = 0;
};

Real length(const Point& v) { return std::sqrt(dot(v, v)); }

PosedShape pose_part(const scenes::ShapePart& part, const oracle::ExactPose& link, const Point& shift) {
  const ConvexPart& local = part.shape;
  PosedShape out;
  out.shape.kind = oracle::judge_kind(local.kind);
  for (std::size_t v = 0; v < part.vertices.size(); v += 3)
    out.vertices.push_back({{part.vertices[v], part.vertices[v + 1], part.vertices[v + 2]}});
  Real reach = 0;
  for (const Point& vertex : out.vertices) reach = std::max(reach, length(vertex));
  for (std::size_t c = 0; c < 3; ++c) {
    out.shape.size[c] = local.size[c];
    reach += local.kind == ShapeKind::kConvexHull ? 0 : out.shape.size[c];
  }
  const Real turn[4] = {local.rotation[0], local.rotation[1], local.rotation[2], local.rotation[3]};
  Real column[3][3];
  oracle::quaternion_matrix(turn, column);
  for (std::size_t k = 0; k < 3; ++k)
    oracle::store(rotated(link.column, oracle::to_vec3(column[k])), out.shape.pose.column[k]);
  const Point position = {{local.position[0], local.position[1], local.position[2]}};
  out.shape.pose.at = link.at + rotated(link.column, position) + shift;
  out.lengths = length(link.at) + length(position) + length(shift) + reach;
  return out;
}

PosedShape pose_box(const oracle::ExactBox& box, const oracle::ExactPose& link, const Point& shift) {
  PosedShape out;
  for (std::size_t k = 0; k < 3; ++k) {
    out.shape.size[k] = box.half[k];
    oracle::store(axis_of(box, k), out.shape.pose.column[k]);
  }
  out.shape.pose.at = center_of(box) + shift;
  out.lengths = 2 * length(link.at) + length(center_of(box)) + length(shift) + half_sum(box);
  return out;
}

// A leaf of a link: its parts, or its box if it has none.
struct PosedLeaf {
  std::uint32_t leaf;
  std::vector<PosedShape> shapes;
};

std::vector<PosedLeaf> pose_link(const scenes::Character& source, std::uint32_t frame, std::uint32_t link,
                                 const Point& origin) {
  const JudgedCharacter judged(source);
  const oracle::ExactPose pose = judged.pose(frame, link);
  const Point shift = judged.origin(frame) - origin;
  std::vector<oracle::ExactBox> boxes;
  std::vector<PosedLeaf> out;
  for (std::uint32_t leaf = 0; leaf < source.leaves.size(); ++leaf) {
    if (source.leaves[leaf].link != link) continue;
    out.push_back({leaf, {}});
    for (const scenes::ShapePart& part : source.leaves[leaf].parts)
      out.back().shapes.push_back(pose_part(part, pose, shift));
    if (!out.back().shapes.empty()) continue;
    if (boxes.empty()) boxes = judged.boxes(frame);
    out.back().shapes.push_back(pose_box(boxes[leaf], pose, shift));
  }
  for (PosedLeaf& leaf : out)
    for (PosedShape& shape : leaf.shapes) shape.shape.vertices = shape.vertices;
  return out;
}

JudgedHit judge_hit(const scenes::Scene& scene, const Touch& touch, bool by_convex) {
  const scenes::Character &a = scene.characters[touch.character_a], &b = scene.characters[touch.character_b];
  const Point origin = JudgedCharacter(a).origin(touch.frame);
  JudgedHit out = {touch, by_convex, 0, 0, 0, true, {}};
  Real least = std::numeric_limits<Real>::infinity(), within = least;
  bool all_apart = true;
  const std::vector<PosedLeaf> leaves_b = pose_link(b, touch.frame, touch.link_b, origin);
  for (const PosedLeaf& leaf_a : pose_link(a, touch.frame, touch.link_a, origin))
    for (const PosedLeaf& leaf_b : leaves_b)
      for (const PosedShape& part_a : leaf_a.shapes)
        for (const PosedShape& part_b : leaf_b.shapes) {
          const oracle::Verdict verdict = judge(part_a.shape, part_b.shape, oracle::Effort::kMeasure);
          all_apart = all_apart && are_apart(verdict);
          within = std::min(within, verdict.gap_at_least / (part_a.lengths + part_b.lengths));
          const Real gap = are_apart(verdict) ? verdict.gap_at_least : verdict.gap_at_most;
          if (gap >= least) continue;
          least = gap;
          out.leaf_a = leaf_a.leaf;
          out.leaf_b = leaf_b.leaf;
        }
  out.gap = static_cast<double>(least);
  out.convex_is_right = by_convex ? within <= kTouching : all_apart;
  out.text = describe(scene, touch) + ", leaves " + std::to_string(out.leaf_a) + " and " + std::to_string(out.leaf_b) +
             ", by " + (by_convex ? "convex" : "FCL") + " alone; by the judge " +
             (out.gap > 0 ? "apart by " : "they overlap by ") + shortest(std::fabs(out.gap));
  return out;
}

}  // namespace

HitDifference difference_of(const std::vector<Touch>& first, const std::vector<Touch>& second) {
  const auto less = [](const Touch& l, const Touch& r) {
    return std::tie(l.frame, l.character_a, l.character_b, l.link_a, l.link_b) <
           std::tie(r.frame, r.character_a, r.character_b, r.link_a, r.link_b);
  };
  HitDifference out;
  std::set_difference(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(out.only_first),
                      less);
  std::set_difference(second.begin(), second.end(), first.begin(), first.end(), std::back_inserter(out.only_second),
                      less);
  return out;
}

std::string describe(const scenes::Scene& scene, const Touch& touch) {
  const scenes::Character &a = scene.characters[touch.character_a], &b = scene.characters[touch.character_b];
  return "frame " + std::to_string(touch.frame) + ", " + a.name + " " + a.link_names[touch.link_a] + " and " + b.name +
         " " + b.link_names[touch.link_b];
}

std::vector<JudgedHit> judge_differences(const scenes::Scene& scene, const std::vector<Touch>& by_fcl,
                                         const std::vector<Touch>& by_convex) {
  const HitDifference difference = difference_of(by_fcl, by_convex);
  std::vector<JudgedHit> out;
  for (const Touch& touch : difference.only_first) out.push_back(judge_hit(scene, touch, false));
  for (const Touch& touch : difference.only_second) out.push_back(judge_hit(scene, touch, true));
  return out;
}

Gate convex_gate(std::uint64_t hits, const std::vector<JudgedHit>& differences) {
  std::string text = "true hits by convex " + std::to_string(hits) + " are those by FCL";
  if (!differences.empty())
    text += ", but for " + std::to_string(differences.size()) + " in which the judge agrees with convex";
  bool passed = true;
  for (const JudgedHit& hit : differences) {
    text += "; " + hit.text + (hit.convex_is_right ? "" : " (convex is wrong)");
    passed = passed && hit.convex_is_right;
  }
  return {text, passed};
}

}  // namespace cab::perf
