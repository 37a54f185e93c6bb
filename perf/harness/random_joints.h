// Random bodies with joints of all kinds, for tests of forward kinematics.
#pragma once

#include "perf/harness/random_rig.h"
#include "perf/judge/oracle/random.h"

#include <cab/kinematics.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace cab::oracle {

// A body with joints of all kinds.
struct JointedBody {
  std::vector<std::int32_t> parents;
  std::vector<LinkPlaceDesc> links;
  std::vector<JointDesc> joints;
  std::uint32_t variable_count = 0;

  KinematicsDesc desc() const { return {parents, links, joints, variable_count}; }
};

inline JointedBody random_joints(Random& random, unsigned most_links) {
  JointedBody out;
  const unsigned count = 1 + random.index(most_links);
  out.variable_count = 3 + random.index(2 * most_links);
  const auto set = [](double(&to)[3], const Vec3<double>& v) { to[0] = v[0], to[1] = v[1], to[2] = v[2]; };
  for (unsigned l = 0; l < count; ++l) {
    out.parents.push_back(l == 0 || random.chance(0.05) ? -1 : static_cast<std::int32_t>(random.index(l)));
    LinkPlaceDesc& link = out.links.emplace_back();
    double n = 0;
    for (double& x : link.rotation) x = random.uniform(-1, 1), n += x * x;
    for (double& x : link.rotation) x /= std::sqrt(n);
    for (double& x : link.translation) x = random.uniform(-1, 1);
    link.joint_count = random.index(4);
    for (std::uint32_t j = 0; j < link.joint_count; ++j) {
      JointDesc& joint = out.joints.emplace_back();
      joint.kind = static_cast<JointKind>(random.index(3));
      joint.variable = random.index(out.variable_count - 2);
      set(joint.axis, random.unit_vector());
      if (random.chance(0.5)) set(joint.anchor, random.uniform(0, 1) * random.unit_vector());
      if (random.chance(0.3)) joint.multiplier = random.uniform(-2, 2), joint.offset = random.uniform(-1, 1);
    }
  }
  return out;
}

// A rig on the links of a body with joints.
struct JointedRig {
  JointedBody body;
  Rig rig;
};

// length: by what the translations of links are multiplied.
inline JointedRig random_jointed_rig(Random& random, unsigned most_links, unsigned most_leaves, double length) {
  JointedRig out;
  out.body = random_joints(random, most_links);
  for (LinkPlaceDesc& link : out.body.links)
    for (double& x : link.translation) x *= length;
  out.rig = random_rig(random, Topology::kTree, static_cast<unsigned>(out.body.parents.size()), most_leaves);
  out.rig.parents = out.body.parents;
  return out;
}

}  // namespace cab::oracle
