// Posing: the posed box contains the exactly posed one, in every pose format. A bad lane does not change other lanes.
#include "kernels/pose_leaves.h"

#include "layout/arena.h"
#include "layout/articulation.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/oracle/random.h"
#include "tests/kernels/isas.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab::tests {
namespace {

using oracle::Quad;
using oracle::Vec3;

constexpr std::uint64_t kSeed = 7;

// A rigid motion, exact to Quad: columns of the rotation and the translation.
struct Motion {
  Vec3<Quad> column[3];
  Vec3<Quad> translation;
};

// The rotation of a float quaternion, normalised exactly.
void exact_rotation(const float* q, Vec3<Quad> (&column)[3]) {
  const Quad x = static_cast<Quad>(q[0]), y = static_cast<Quad>(q[1]), z = static_cast<Quad>(q[2]),
             w = static_cast<Quad>(q[3]);
  const Quad s = 2 / (x * x + y * y + z * z + w * w);
  column[0] = {{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)}};
  column[1] = {{s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)}};
  column[2] = {{s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}};
}

Vec3<Quad> turn(const Vec3<Quad> (&column)[3], const Vec3<Quad>& p) {
  return p[0] * column[0] + p[1] * column[1] + p[2] * column[2];
}

// Random articulation: links with one or two leaves each, placed anywhere in their frames.
struct Rig {
  explicit Rig(oracle::Random& random) : arena(default_allocator()) {
    const std::size_t links = 1 + random.index(6);
    std::vector<std::int32_t> parents;
    std::vector<float> joints;
    std::vector<Leaf> leaves;
    for (std::size_t link = 0; link < links; ++link) {
      parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(random.index(static_cast<unsigned>(link))));
      for (int c = 0; c < 3; ++c) joints.push_back(static_cast<float>(random.uniform(-1, 1)));
      for (unsigned n = 0; n <= random.index(2); ++n) {
        Leaf leaf;
        leaf.link = static_cast<std::uint32_t>(link);
        double axis[3][3];
        random.rotation(axis);
        for (std::size_t k = 0; k < 3; ++k) {
          leaf.box.center[k] = static_cast<float>(random.uniform(-2, 2));
          leaf.box.half[k] = static_cast<float>(random.log_uniform(1e-4, 1));
          for (std::size_t c = 0; c < 3; ++c) leaf.box.axis[k][c] = static_cast<float>(axis[k][c]);
        }
        leaves.push_back(leaf);
      }
    }
    ArticulationDesc desc;
    desc.link_parents = parents;
    desc.link_joints = joints;
    desc.leaves = leaves;
    REQUIRE(build_articulation(desc, arena, &articulation, nullptr) == Status::kOk);
  }
  Arena arena;
  Articulation articulation;
};

// The poses of sixteen instances as quaternions and translations, and the same poses as matrices.
struct Poses {
  std::vector<float> quaternions, rows, columns, rotations;
};

Poses random_poses(oracle::Random& random, std::uint32_t links, double place) {
  Poses out;
  for (std::uint32_t i = 0; i < kLanes; ++i) {
    for (int c = 0; c < 4; ++c) out.rotations.push_back(static_cast<float>(random.normal()));
    for (std::uint32_t link = 0; link < links; ++link) {
      float q[4], t[3];
      double n = 0;
      for (float& v : q) v = static_cast<float>(random.normal());
      for (const float v : q) n += static_cast<double>(v) * static_cast<double>(v);
      for (float& v : q) v = static_cast<float>(static_cast<double>(v) / std::sqrt(n));
      for (float& v : t) v = static_cast<float>(random.uniform(-place, place));
      Vec3<Quad> column[3];
      exact_rotation(q, column);
      out.quaternions.insert(out.quaternions.end(), q, q + 4);
      out.quaternions.insert(out.quaternions.end(), t, t + 3);
      for (std::size_t r = 0; r < 3; ++r) {
        for (const auto& k : column) out.rows.push_back(static_cast<float>(k[r]));
        out.rows.push_back(t[r]);
      }
      for (const auto& k : column) {
        for (std::size_t r = 0; r < 3; ++r) out.columns.push_back(static_cast<float>(k[r]));
        out.columns.push_back(0);
      }
      out.columns.insert(out.columns.end(), {t[0], t[1], t[2], 1});
    }
  }
  return out;
}

struct Posed {
  std::vector<BoxTile> leaves;
  std::vector<PointTile> joints;
  std::uint8_t flags[kLanes];
};

Posed pose(const kernel::KernelTable& kernels, const Articulation& articulation, PoseFormat format,
           const std::vector<float>& poses, const float* rotations, std::uint32_t live = kLanes) {
  Posed out;
  out.leaves.resize(articulation.leaf_count);
  out.joints.resize(articulation.link_count);
  std::memset(static_cast<void*>(out.joints.data()), 0, out.joints.size() * sizeof(PointTile));
  kernel::PoseTile job = {};
  job.articulation = &articulation;
  job.coding = {format, Scaling::kNone};
  job.link_stride = pose_floats(format);
  kernel::point_lanes(poses.data(), articulation.link_count * job.link_stride, live, job.poses);
  if (rotations) kernel::point_lanes(rotations, 4, live, job.orientations);
  job.leaves = out.leaves.data();
  job.joints = out.joints.data();
  job.flags = out.flags;
  kernels.pose_leaves(job);
  return out;
}

const std::vector<float>& poses_of(const Poses& poses, PoseFormat format) {
  return format == PoseFormat::kQuaternionTranslation ? poses.quaternions
         : format == PoseFormat::kMatrix3x4Rows       ? poses.rows
                                                      : poses.columns;
}

// The exact pose of a link of an instance, by the rule of its format, with the instance's orientation. A float matrix
// becomes a rotation by Gram-Schmidt in Quad; its first column is kept.
Motion exact_motion(const Poses& poses, PoseFormat format, std::size_t index, const float* rotations) {
  Motion out;
  if (format == PoseFormat::kQuaternionTranslation) {
    const float* f = poses.quaternions.data() + 7 * index;
    exact_rotation(f, out.column);
    out.translation = oracle::convert<Quad>(Vec3<float>{{f[4], f[5], f[6]}});
  } else {
    const float* f = poses.rows.data() + 12 * index;
    for (std::size_t k = 0; k < 3; ++k) out.column[k] = oracle::convert<Quad>(Vec3<float>{{f[k], f[4 + k], f[8 + k]}});
    out.translation = oracle::convert<Quad>(Vec3<float>{{f[3], f[7], f[11]}});
    // From a length within 1e-6 of 1, one Newton step is exact to 1e-12. Two are exact enough for Quad.
    const auto unit = [](Vec3<Quad> v) {
      for (int i = 0; i < 4; ++i) v = (Quad(3) - dot(v, v)) / 2 * v;
      return v;
    };
    out.column[0] = unit(out.column[0]);
    out.column[1] = unit(out.column[1] - dot(out.column[1], out.column[0]) * out.column[0]);
    out.column[2] = cross(out.column[0], out.column[1]);
  }
  if (!rotations) return out;
  Vec3<Quad> by[3];
  exact_rotation(rotations, by);
  for (auto& column : out.column) column = turn(by, column);
  out.translation = turn(by, out.translation);
  return out;
}

oracle::OracleBox<Quad> exact_box(const Motion& motion, const Box& local) {
  oracle::OracleBox<Quad> out{};
  const Vec3<Quad> center =
      motion.translation + turn(motion.column, oracle::convert<Quad>(oracle::to_vec3(local.center)));
  oracle::store(center, out.center);
  for (std::size_t k = 0; k < 3; ++k) {
    oracle::store(turn(motion.column, oracle::convert<Quad>(oracle::to_vec3(local.axis[k]))), out.axis[k]);
    out.half[k] = static_cast<Quad>(local.half[k]);
  }
  return out;
}

constexpr PoseFormat kFormats[] = {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows,
                                   PoseFormat::kMatrix4x4Columns};

}  // namespace

TEST_CASE("a posed leaf box contains the exactly posed one and its axes err no more than derived, near and far") {
  oracle::Random random(kSeed);
  double worst_crooked = 0, worst_excess = -1e300;
  std::size_t outside = 0, checked = 0;
  for (int round = 0; round < 400; ++round) {
    const Rig rig(random);
    const Poses poses = random_poses(random, rig.articulation.link_count, random.log_uniform(1e-3, 1e4));
    for (const PoseFormat format : kFormats) {
      const float* rotations = random.chance(0.5) ? poses.rotations.data() : nullptr;
      const Posed posed =
          pose(*kernel::find_kernels(Isa::kAuto), rig.articulation, format, poses_of(poses, format), rotations);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        REQUIRE(posed.flags[lane] == kInstanceOk);
        for (std::uint32_t leaf = 0; leaf < rig.articulation.leaf_count; ++leaf) {
          const std::size_t index = std::size_t{lane} * rig.articulation.link_count + rig.articulation.leaf_link[leaf];
          const auto expected =
              exact_box(exact_motion(poses, format, index, rotations ? rotations + 4 * lane : nullptr),
                        rig.articulation.leaf_box[leaf]);
          const oracle::OracleBox<float> got = get(posed.leaves[leaf], lane);
          const auto verdict = oracle::judge_containment_exactly(got, expected);
          outside += !verdict.inside;
          worst_excess = std::max(worst_excess, verdict.excess_ulps);
          worst_crooked = std::max(worst_crooked, oracle::frame_error(got));
          ++checked;
        }
      }
    }
  }
  MESSAGE(checked << " boxes: worst excess " << worst_excess << " u (S + M), axes " << worst_crooked
                  << " of their limits");
  CAPTURE(kSeed);
  CHECK(outside == 0);
  CHECK(worst_crooked <= 1);
}

TEST_CASE("posing gives the same bits on every instruction set and for every number of live lanes") {
  oracle::Random random(kSeed + 1);
  for (int round = 0; round < 40; ++round) {
    const Rig rig(random);
    const Poses poses = random_poses(random, rig.articulation.link_count, 3);
    for (const PoseFormat format : kFormats) {
      const float* rotations = random.chance(0.5) ? poses.rotations.data() : nullptr;
      const Posed all =
          pose(*kernel::find_kernels(Isa::kScalar), rig.articulation, format, poses_of(poses, format), rotations);
      for (const std::uint32_t live : {1u, 7u, 15u, 16u}) {
        const Posed expected = pose(*kernel::find_kernels(Isa::kScalar), rig.articulation, format,
                                    poses_of(poses, format), rotations, live);
        for (const kernel::KernelTable* kernels : available_kernels()) {
          const Posed got = pose(*kernels, rig.articulation, format, poses_of(poses, format), rotations, live);
          CAPTURE(name_of(*kernels));
          for (std::uint32_t leaf = 0; leaf < rig.articulation.leaf_count; ++leaf) {
            REQUIRE(same_bits(got.leaves[leaf], expected.leaves[leaf]));
            for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
              const auto box = get(got.leaves[leaf], lane), source = get(all.leaves[leaf], std::min(lane, live - 1));
              REQUIRE(same_bits(box, source));  // lanes past the last live one copy it
            }
          }
          REQUIRE(std::memcmp(got.joints.data(), expected.joints.data(), got.joints.size() * sizeof(PointTile)) == 0);
        }
      }
    }
  }
}

TEST_CASE("a lane that holds no pose is named and cleared, and its neighbours keep their bits") {
  oracle::Random random(kSeed + 2);
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  struct Fault {
    PoseFormat format;
    int at;       // float of the last link's pose
    float value;  // put there; for matrices, factor of the whole first column when at is negative
    std::uint8_t flag;
  };
  const Fault faults[] = {
      {PoseFormat::kQuaternionTranslation, 0, nan, kInstanceNotFinite},
      {PoseFormat::kQuaternionTranslation, 3, infinity, kInstanceNotFinite},
      {PoseFormat::kQuaternionTranslation, 4, 1e30f, kInstanceNotFinite},
      {PoseFormat::kQuaternionTranslation, 6, nan, kInstanceNotFinite},
      {PoseFormat::kQuaternionTranslation, -1, 0, kInstanceNotRigid},
      {PoseFormat::kMatrix3x4Rows, 5, nan, kInstanceNotFinite},
      {PoseFormat::kMatrix3x4Rows, -1, 1.01f, kInstanceNotRigid},
      {PoseFormat::kMatrix3x4Rows, -1, -1.01f, kInstanceNotRigid},
      {PoseFormat::kMatrix4x4Columns, -1, 0, kInstanceNotRigid},
      {PoseFormat::kMatrix4x4Columns, 14, -infinity, kInstanceNotFinite},
  };
  for (const Fault& fault : faults) {
    const Rig rig(random);
    const Poses poses = random_poses(random, rig.articulation.link_count, 3);
    const std::vector<float>& clean = poses_of(poses, fault.format);
    const std::uint32_t floats = pose_floats(fault.format), bad = random.index(kLanes);
    std::vector<float> spoiled = clean;
    // The first link carries leaves in every rig, so its pose is always read.
    float* at = spoiled.data() + std::size_t{bad} * rig.articulation.link_count * floats;
    if (fault.at >= 0) {
      at[fault.at] = fault.value;
    } else {
      const int count = fault.format == PoseFormat::kQuaternionTranslation ? 4 : 3,
                step = fault.format == PoseFormat::kMatrix3x4Rows ? 4 : 1;
      for (int i = 0; i < count; ++i) at[i * step] *= fault.value;
    }
    for (const kernel::KernelTable* kernels : available_kernels()) {
      const Posed expected = pose(*kernels, rig.articulation, fault.format, clean, nullptr);
      const Posed got = pose(*kernels, rig.articulation, fault.format, spoiled, nullptr);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        CHECK(got.flags[lane] == (lane == bad ? fault.flag : std::uint8_t{kInstanceOk}));
        for (std::uint32_t leaf = 0; leaf < rig.articulation.leaf_count; ++leaf) {
          const auto box = get(got.leaves[leaf], lane), neighbour = get(expected.leaves[leaf], lane);
          const oracle::OracleBox<float> zero = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
          REQUIRE(same_bits(box, lane == bad ? zero : neighbour));
        }
      }
    }
  }
}

TEST_CASE("a matrix within a thousandth of a rotation is taken, and its box is orthonormal") {
  oracle::Random random(kSeed + 3);
  for (int round = 0; round < 100; ++round) {
    const Rig rig(random);
    Poses poses = random_poses(random, rig.articulation.link_count, 3);
    for (std::size_t f = 0; f < poses.rows.size(); ++f)
      if (f % 4 != 3) poses.rows[f] *= 1 + static_cast<float>(random.uniform(-2e-4, 2e-4));
    const Posed posed =
        pose(*kernel::find_kernels(Isa::kAuto), rig.articulation, PoseFormat::kMatrix3x4Rows, poses.rows, nullptr);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      CHECK(posed.flags[lane] == kInstanceOk);
      for (const BoxTile& leaf : posed.leaves) CHECK(oracle::frame_error(get(leaf, lane)) <= 1);
    }
  }
}

}  // namespace cab::tests
