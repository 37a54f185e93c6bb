// Merge cases: two links with their ends near a joint, then bent, thinned, scaled or moved as the regime asks.
#include "perf/judge/oracle/merge_regimes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "perf/judge/oracle/float_frame.h"

namespace cab::oracle {
namespace {

// What a link looks like before it is rounded to float.
struct LinkShape {
  double longest;          // half extent
  double aspect;           // longest over shortest half
  Vec3<double> direction;  // unit, from the joint along the link
  double overhang;         // distance of the centre from the joint over the longest half extent
};

// A link in float: random stored order and sign of its axes, other halves between longest / aspect and that times 1.5.
OracleBox<float> make_link(Random& random, const LinkShape& shape, const Vec3<double>& joint) {
  OracleBox<double> link{};
  const unsigned along = random.index(3);
  random.rotation_about(random.sign() * shape.direction, along, link.axis);
  for (unsigned k = 0; k < 3; ++k) {
    const double thickness = shape.longest / shape.aspect * random.uniform(1.0, 1.5);
    link.half[k] = k == along ? shape.longest : std::min(thickness, shape.longest);
  }
  store(joint + (shape.overhang * shape.longest) * shape.direction, link.center);
  return convert<float>(link);
}

// A direction at a small or any angle to another, both unit.
Vec3<double> bent_direction(Random& random, const Vec3<double>& from, double angle) {
  const Vec3<double> side = random.unit_vector();
  const Vec3<double> across = side - dot(side, from) * from;
  if (norm(across) < 1e-3) return from;
  return std::cos(angle) * from + std::sin(angle) * normalized(across);
}

// The two links of a limb around a joint.
MergeCase make_limb(Random& random, const LinkShape& shape1, const LinkShape& shape2, const Vec3<double>& joint) {
  MergeCase out{};
  out.child1 = make_link(random, shape1, joint);
  out.child2 = make_link(random, shape2, joint);
  out.has_joint = !random.chance(0.2);
  store(convert<float>(joint), out.joint);
  return out;
}

// A link of human size and proportions in a random direction.
LinkShape random_shape(Random& random) {
  return {random.uniform(0.02, 0.5), random.uniform(1.0, 6.0), random.unit_vector(), random.uniform(0.8, 1.1)};
}

// A partner for a link, in any direction. Half of the time it has the same size, as in a chain.
LinkShape partner_shape(Random& random, const LinkShape& of) {
  LinkShape shape = random_shape(random);
  if (random.chance(0.5)) shape.longest = of.longest;
  if (random.chance(0.5)) shape.aspect = of.aspect;
  return shape;
}

// A point within 2 m of the origin.
Vec3<double> random_joint(Random& random) { return random.uniform(0.0, 2.0) * random.unit_vector(); }

// The two shapes and the joint of a regime.
struct LimbPlan {
  LinkShape shape1, shape2;
  Vec3<double> joint;
};

// A limb with any joint angle.
LimbPlan plan_limb(Random& random) {
  const LinkShape shape = random_shape(random);
  return {shape, partner_shape(random, shape), random_joint(random)};
}

// Turns the second link to a small angle from the first's direction (folded) or its opposite (straight).
void align_links(Random& random, bool folded, LimbPlan& plan) {
  const double angle = random.log_uniform(1e-7, 0.1);
  const Vec3<double> along = (folded ? 1.0 : -1.0) * plan.shape1.direction;
  plan.shape2.direction = bent_direction(random, along, angle);
}

// Makes one or both links slender, and some of the pairs nearly straight.
void slim_links(Random& random, LimbPlan& plan) {
  plan.shape1.aspect = random.log_uniform(1e3, 1e6);
  if (random.chance(0.7)) plan.shape2.aspect = random.log_uniform(1e3, 1e6);
  if (random.chance(0.3)) align_links(random, random.chance(0.5), plan);
}

// Multiplies a whole case by a factor. At times one child's size is multiplied by another factor.
void scale_case(Random& random, MergeCase& out) {
  const double all = random.log_uniform(1e-30, 1e18);
  const double one = random.chance(0.2) ? random.log_uniform(1e-30, 1e18) : all;
  for (std::size_t k = 0; k < 3; ++k) {
    out.child1.half[k] = static_cast<float>(all * static_cast<double>(out.child1.half[k]));
    out.child2.half[k] = static_cast<float>(one * static_cast<double>(out.child2.half[k]));
    out.child1.center[k] = static_cast<float>(all * static_cast<double>(out.child1.center[k]));
    out.child2.center[k] = static_cast<float>(all * static_cast<double>(out.child2.center[k]));
    out.joint[k] = static_cast<float>(all * static_cast<double>(out.joint[k]));
  }
}

// Sets 0 to 3 half extents of a box to zero, starting at a random one.
void flatten_box(Random& random, OracleBox<float>& box) {
  const unsigned count = random.index(4);
  const unsigned first = random.index(3);
  for (unsigned i = 0; i < count; ++i) box.half[(first + i) % 3] = 0.0f;
}

// The box of a random hierarchy with the given number of levels above its leaves. Of the two children of a node, one is
// at the joint and the other beside it.
OracleBox<float> make_subtree(Random& random, unsigned levels, const Vec3<double>& joint,
                              const ParentMaker& make_parent) {
  if (levels == 0) return make_link(random, random_shape(random), joint);
  const Vec3<double> beside = joint + random.uniform(0.0, 0.5) * random.unit_vector();
  const OracleBox<float> child1 = make_subtree(random, levels - 1, joint, make_parent);
  const OracleBox<float> child2 = make_subtree(random, levels - 1, beside, make_parent);
  const Vec3<float> rounded = convert<float>(joint);
  return make_parent(child1, child2, random.chance(0.7) ? rounded.v : nullptr);
}

// Children that are parents themselves.
MergeCase make_parents_case(Random& random, const ParentMaker& make_parent) {
  MergeCase out{};
  const Vec3<double> joint = random_joint(random);
  out.child1 = make_subtree(random, 1 + random.index(4), joint, make_parent);
  out.child2 = make_subtree(random, random.index(4), joint, make_parent);
  out.has_joint = !random.chance(0.2);
  store(convert<float>(joint), out.joint);
  return out;
}

}  // namespace

OracleBox<float> oracle_parent(const OracleBox<float>& child1, const OracleBox<float>& child2, const float* joint) {
  const Vec3<double> wide =
      joint == nullptr ? Vec3<double>{} : convert<double>(Vec3<float>{{joint[0], joint[1], joint[2]}});
  const OracleMerge merge =
      merge_cab(convert<double>(child1), convert<double>(child2), joint == nullptr ? nullptr : wide.v);
  return padded_to_float(merge.box);
}

MergeCase make_merge_case(Random& random, MergeRegime regime, const ParentMaker& make_parent) {
  if (regime == MergeRegime::kParents) return make_parents_case(random, make_parent);
  LimbPlan plan = plan_limb(random);
  if (regime == MergeRegime::kStraight) align_links(random, false, plan);
  if (regime == MergeRegime::kFolded) align_links(random, true, plan);
  if (regime == MergeRegime::kHighAspect) slim_links(random, plan);
  if (regime == MergeRegime::kTinyHuge) plan.shape2.longest *= random.log_uniform(1e-12, 1e-2);
  if (regime == MergeRegime::kFar) { plan.joint = random.log_uniform(1e5, 1e7) * random.unit_vector(); }
  if (random.chance(0.5)) std::swap(plan.shape1, plan.shape2);
  MergeCase out = make_limb(random, plan.shape1, plan.shape2, plan.joint);
  if (regime == MergeRegime::kExtremeScale) scale_case(random, out);
  if (regime == MergeRegime::kDegenerate) {
    flatten_box(random, out.child1);
    flatten_box(random, out.child2);
  }
  if (regime == MergeRegime::kDrifting) {
    drift_frame(random, out.child1);
    drift_frame(random, out.child2);
  }
  return out;
}

std::vector<OracleMerge> merge_cab_candidates(const MergeCase& merge_case, const MarginThresholds& thresholds) {
  const Vec3<double> joint = convert<double>(to_vec3(merge_case.joint));
  return merge_cab_candidates(convert<double>(merge_case.child1), convert<double>(merge_case.child2),
                              merge_case.has_joint ? joint.v : nullptr, thresholds);
}

}  // namespace cab::oracle
