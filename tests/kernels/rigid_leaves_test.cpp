// Leaves that are posed by one quaternion: their bounds contain what pose_leaves makes of them, and the test of their
// boxes keeps the pairs that the leaf predicate keeps, bit for bit.
#include "kernels/rigid_leaves.h"

#include "kernels/leaf_words.h"
#include "layout/arena.h"
#include "layout/articulation.h"
#include "perf/judge/oracle/exact_pose.h"
#include "perf/judge/oracle/overlap_exact.h"
#include "perf/judge/oracle/random.h"
#include "perf/judge/oracle/real.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>

namespace cab::tests {
namespace {

using oracle::Point;
using oracle::Random;
using oracle::Real;
using ExactBox = oracle::OracleBox<Real>;

constexpr std::uint64_t kSeed = 81;

// By how much bounds of leaves may exceed those of the exactly posed box: twice what the kernel adds. Worst measured
// 0.55 of it.
Real most_excess(bool placed, Real size, Real away) {
  const Real of_size = placed ? kPlacedBoundsSize : kRigidBoundsSize,
             of_away = placed ? kPlacedBoundsCenter : kRigidBoundsCenter;
  return 2 * (of_size * size + of_away * away + Real{kOverlapTiny});
}

// Whether a centre is within the kernel's range is not judged closer to its end than this.
constexpr Real kRangeRounding = 1e-5L;

Real sum_of(const float (&v)[3]) {
  Real out = 0;
  for (const float c : v) out += std::fabs(Real{c});
  return out;
}

// --------------------------------------------------------------------------------------------------------- shapes

// A rotation that maps axes to axes.
Eigen::Quaterniond quarter_turn(Random& random) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  const int i = static_cast<int>(random.index(3)), j = (i + 1 + static_cast<int>(random.index(2))) % 3;
  m(i, 0) = random.sign();
  m(j, 1) = random.sign();
  m.col(2) = m.col(0).cross(m.col(1));
  return Eigen::Quaterniond(m);
}

Eigen::Quaterniond any_turn(Random& random) {
  return Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
}

Eigen::Quaterniond small_turn(Random& random) {
  const auto axis = random.unit_vector();
  return Eigen::Quaterniond(
      Eigen::AngleAxisd(random.log_uniform(1e-9, 1e-2), Eigen::Vector3d(axis[0], axis[1], axis[2])));
}

enum class Halves { kOrdinary, kNeedle, kFlat };
constexpr unsigned kHalvesCount = 3;

// Half extents of about 1: within a factor of 20, thin along one or two axes, or zero along some.
void random_halves(Random& random, Halves halves, double (&out)[3]) {
  const std::uint32_t along = random.index(3);
  for (std::uint32_t k = 0; k < 3; ++k) {
    out[k] = random.log_uniform(0.05, 1);
    if (halves == Halves::kNeedle) out[k] = k == along || random.chance(0.2) ? 1e-4 : 1;
    if (halves == Halves::kFlat && (k == along || random.chance(0.4))) out[k] = 0;
  }
}

// What places an instance besides its origin.
struct Place {
  float turn[4] = {0, 0, 0, 1};
  float scale = 1;
  float grown = 0;  // half extents, by its margin
};

// What an articulation is like. placed: its instances have orientations, scales or margins of their own. scale: of its
// boxes, in metres. away: how far they are from their links, over that.
struct RigKind {
  std::uint32_t links, leaves;
  bool turned, placed;
  Halves halves;
  double scale, away, margin;
  std::size_t link_stride;
};

// An articulation and its shape.
struct Rig {
  Rig(Random& random, const RigKind& of) : kind(of), arena(default_allocator()) {
    std::vector<std::int32_t> parents;
    std::vector<float> joints;
    std::vector<Leaf> described;
    for (std::uint32_t link = 0; link < kind.links; ++link) {
      parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(random.index(link)));
      for (int c = 0; c < 3; ++c) joints.push_back(static_cast<float>(kind.scale * random.uniform(-1, 1)));
    }
    for (std::uint32_t n = 0; n < kind.leaves; ++n) described.push_back(random_leaf(random));
    ArticulationDesc desc;
    desc.link_parents = parents;
    desc.link_joints = joints;
    desc.leaves = described;
    REQUIRE(build_articulation(desc, arena, &articulation, nullptr) == Status::kOk);
    make_shape();
    make_places(random);
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  std::uint32_t blocks() const { return static_cast<std::uint32_t>(block.size()); }
  std::size_t stride() const { return kind.links * kind.link_stride; }
  float grown() const { return kMarginShare * static_cast<float>(kind.margin); }
  float size_of(std::uint32_t instance) const { return size * places[instance].scale + 3 * own_growth(instance); }
  // By how much an instance's half extents are larger than its scale makes those of the shape.
  float own_growth(std::uint32_t instance) const { return kind.placed ? places[instance].grown : 0; }

  RigKind kind;
  Arena arena;
  Articulation articulation;
  std::vector<RigidBlock> block;
  std::vector<RigidLeaf> leaf;
  std::vector<BoxAos> exact;
  std::vector<std::uint32_t> offset, bare;
  RigidShape shape;
  float size = 0;  // the largest S + |c|_1 of the shape
  Place places[kLanes];
  bool rotated = false, scaled = false;

 private:
  void make_places(Random& random) {
    rotated = kind.placed && random.chance(0.8);
    scaled = kind.placed && kind.scale < 1e12 && random.chance(0.5);  // else beyond the range
    const bool has_margins = kind.placed && random.chance(0.5);
    const Eigen::Quaterniond common = any_turn(random);
    for (Place& place : places) {
      place.grown = grown();
      if (rotated) {
        const Eigen::Quaterniond turns[] = {any_turn(random), quarter_turn(random), common,
                                            common * small_turn(random)};
        const double length = random.chance(0.5) ? 1 : random.log_uniform(1e-2, 1e2);
        const Eigen::Vector4d turn = length * turns[random.index(4)].coeffs();
        for (int k = 0; k < 4; ++k) place.turn[k] = static_cast<float>(turn[k]);
      }
      if (scaled) {
        const double factors[] = {
            1, 2, kMinScale, kMaxScale, random.log_uniform(0.3, 3), random.log_uniform(1e-3, 1e3)};
        place.scale = std::clamp(static_cast<float>(factors[random.index(6)]), kMinScale, kMaxScale);
      }
      if (has_margins) place.grown += static_cast<float>(kind.scale * random.log_uniform(1e-3, 1));
    }
  }

  Leaf random_leaf(Random& random) const {
    Leaf out;
    out.link = random.index(kind.links);
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    if (kind.turned && random.chance(0.9))
      turn = random.chance(0.5) ? any_turn(random) : random.chance(0.5) ? quarter_turn(random) : small_turn(random);
    const Eigen::Matrix3d axes = turn.toRotationMatrix();
    double half[3];
    random_halves(random, kind.halves, half);
    const double away = kind.scale * kind.away * (random.chance(0.2) ? 0 : 1);
    for (int k = 0; k < 3; ++k) {
      out.box.center[k] = static_cast<float>(away * random.uniform(-1, 1));
      out.box.half[k] = static_cast<float>(kind.scale * half[k]);
      for (int c = 0; c < 3; ++c) out.box.axis[k][c] = static_cast<float>(axes(c, k));
    }
    // Axes whose lengths and angles err almost as much as an articulation keeps.
    if (kind.turned && random.chance(0.3))
      for (auto& axis : out.box.axis)
        for (float& c : axis) c *= 1 + static_cast<float>(random.uniform(-0.4, 0.4) * kAxesExact);
    return out;
  }

  void make_shape() {
    block.assign((articulation.leaf_count + kLanes - 1) / kLanes, RigidBlock{});
    leaf.assign(articulation.leaf_count, RigidLeaf{});
    exact.assign(articulation.leaf_count, BoxAos{});
    offset.assign(articulation.leaf_count, 0);
    for (const PosedLink& posed : articulation.posed_links)
      if (posed.leaf_begin == posed.leaf_end) bare.push_back(static_cast<std::uint32_t>(posed.link * kind.link_stride));
    for (std::uint32_t n = 0; n < articulation.leaf_count; ++n) {
      const Box& box = articulation.leaf_box[n];
      RigidBlock& of = block[n / kLanes];
      RigidLeaf& to = leaf[n];
      const std::uint32_t at = n % kLanes;
      of.leaves = at + 1;
      Eigen::Matrix3d axes;
      for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 3; ++c) axes(c, k) = static_cast<double>(box.axis[k][c]);
      shape.turned = shape.turned || axes != Eigen::Matrix3d::Identity();
      const Eigen::Vector3d center(static_cast<double>(box.center[0]), static_cast<double>(box.center[1]),
                                   static_cast<double>(box.center[2]));
      const Eigen::Vector4d turn = Eigen::Quaterniond(axes).coeffs();
      for (int k = 0; k < 4; ++k) of.turn[k][at] = to.turn[k] = static_cast<float>(turn[k]);
      for (int c = 0; c < 3; ++c) {
        of.middle[c][at] = to.middle[c] = static_cast<float>(axes.col(c).dot(center));
        of.half[c][at] = to.half[c] = kind.placed ? box.half[c] : box.half[c] + grown();
        exact[n].half[c] = box.half[c];
        exact[n].center[c] = box.center[c];
        for (int k = 0; k < 3; ++k) exact[n].axis[3 * k + c] = box.axis[k][c];
      }
      // Padding as kernel::pose_box has it, operation by operation.
      const float sum = box.half[0] + box.half[1] + box.half[2];
      const float out = std::fabs(box.center[0]) + std::fabs(box.center[1]) + std::fabs(box.center[2]);
      exact[n].unused = (kPosePad.body * (sum + out) + kMergePadTiny) + grown();
      const auto all = static_cast<float>(sum_of(to.half) + sum_of(box.center)) * (1 + 0x1p-20f);
      size = std::max(size, all);
      of.reach[at] = kind.placed ? kPlacedBoundsSize * all : kRigidBoundsSize * all + kOverlapTiny;
      of.offset[at] = offset[n] = static_cast<std::uint32_t>(articulation.leaf_link[n] * kind.link_stride);
    }
    shape.block = block.data();
    shape.leaf = leaf.data();
    shape.exact = exact.data();
    shape.offset = offset.data();
    shape.bare = bare.data();
    shape.bare_count = static_cast<std::uint32_t>(bare.size());
    shape.placed = kind.placed;
    shape.extent = size;
    for (const PosedLink& posed : articulation.posed_links) {
      const float* const joint = articulation.link_joint.data + 3 * posed.link;
      if (posed.needs_joint)
        shape.extent = std::max(shape.extent, std::fabs(joint[0]) + std::fabs(joint[1]) + std::fabs(joint[2]));
    }
  }
};

// ---------------------------------------------------------------------------------------------------------- poses

// How the rotations of links are drawn: at random, parallel to each other or nearly so, or along the axes.
enum class Turns { kAny, kParallel, kQuarters };
constexpr unsigned kTurnsCount = 3;

// Poses of the links of sixteen instances, whose translations are about `place`.
std::vector<float> random_poses(Random& random, const Rig& rig, Turns turns, const Eigen::Quaterniond& base,
                                double place) {
  std::vector<float> out(kLanes * rig.stride());
  for (std::size_t i = 0; i < kLanes; ++i)
    for (std::size_t link = 0; link < rig.kind.links; ++link) {
      Eigen::Quaterniond turn = any_turn(random);
      if (turns == Turns::kQuarters) turn = quarter_turn(random);
      if (turns == Turns::kParallel) {
        turn = base * quarter_turn(random);
        if (random.chance(0.4)) turn = turn * small_turn(random);
      }
      const double length = random.chance(0.5) ? 1 : random.log_uniform(1e-2, 1e2);
      float* const to = out.data() + i * rig.stride() + link * rig.kind.link_stride;
      for (int k = 0; k < 4; ++k) to[k] = static_cast<float>(length * turn.coeffs()[k]);
      for (int c = 0; c < 3; ++c) to[4 + c] = static_cast<float>(place * random.uniform(-1, 1));
    }
  return out;
}

// A leaf's box about its instance's origin, with its margin, exactly. poses: of all sixteen instances.
ExactBox exact_box(const Rig& rig, const float* poses, std::uint32_t instance, std::uint32_t leaf) {
  const Box& local = rig.articulation.leaf_box[leaf];
  const float* const q = poses + instance * rig.stride() + rig.offset[leaf];
  const Place& place = rig.places[instance];
  const Real quaternion[4] = {q[0], q[1], q[2], q[3]};
  const Real turn[4] = {place.turn[0], place.turn[1], place.turn[2], place.turn[3]};
  const Real scale = place.scale;
  Real column[3][3], turned[3][3];
  oracle::quaternion_matrix(quaternion, column);
  oracle::quaternion_matrix(turn, turned);
  ExactBox out{};
  const Point at = {{q[4], q[5], q[6]}};
  oracle::store(
      oracle::rotated(turned,
                      scale * (at + oracle::rotated(column, oracle::convert<Real>(oracle::to_vec3(local.center))))),
      out.center);
  for (std::size_t k = 0; k < 3; ++k) {
    const Point axis = oracle::rotated(column, oracle::convert<Real>(oracle::to_vec3(local.axis[k])));
    oracle::store(oracle::rotated(turned, axis), out.axis[k]);
    out.half[k] = scale * Real{local.half[k]} + Real{place.grown};
  }
  return out;
}

// How far a box reaches from its centre along the world's axes.
template <class T>
Point world_halves(const oracle::OracleBox<T>& box) {
  Point out{};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < 3; ++k) out[c] += Real{box.half[k]} * std::fabs(Real{box.axis[k][c]});
  return out;
}

// What pose_leaves makes of sixteen instances.
struct Posed {
  std::vector<BoxTile> leaves;
  std::uint8_t flags[kLanes];
};

Posed pose(const kernel::KernelTable& kernels, const Rig& rig, const std::vector<float>& poses) {
  Posed out;
  out.leaves.resize(rig.articulation.leaf_count);
  std::vector<PointTile> joints(rig.articulation.link_count);
  kernel::PoseTile job = {};
  job.articulation = &rig.articulation;
  job.coding = {PoseFormat::kQuaternionTranslation, rig.scaled ? Scaling::kPerInstance : Scaling::kNone};
  job.link_stride = rig.kind.link_stride;
  kernel::point_lanes(poses.data(), rig.stride(), kLanes, job.poses);
  for (std::uint32_t i = 0; i < kLanes; ++i) {
    job.orientations[i] = rig.rotated ? rig.places[i].turn : nullptr;
    job.scales[i] = rig.places[i].scale;
    job.margins[i] = rig.places[i].grown;
  }
  job.leaves = out.leaves.data();
  job.joints = joints.data();
  job.flags = out.flags;
  kernels.pose_leaves(job);
  return out;
}

// A tile that bounds these instances, `live` of which differ.
std::unique_ptr<kernel::RigidTile> rigid_tile(const Rig& rig, const std::vector<float>& poses, std::uint32_t next_bytes,
                                              std::uint32_t live = kLanes) {
  auto out = std::make_unique<kernel::RigidTile>();
  std::memset(static_cast<void*>(out.get()), 0x5a, sizeof *out);
  out->shape = &rig.shape;
  kernel::point_lanes(poses.data(), rig.stride(), live, out->poses);
  kernel::point_lanes(poses.data(), rig.stride(), kLanes, out->next);
  out->next_bytes = next_bytes;
  for (std::uint32_t lane = 0; lane < kLanes && rig.kind.placed; ++lane) {
    const Place& place = rig.places[std::min(lane, live - 1)];
    out->orientations[lane] = place.turn;
    out->scales[lane] = place.scale;
    out->grown[lane] = place.grown;
  }
  return out;
}

}  // namespace

// ----------------------------------------------------------------------------------------------------------- bounds

namespace {

// Spoils a pose in one of the ways that make an instance take no part, or that leave it to pose_leaves.
void spoil(Random& random, float* q) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  double length_sq = 0;
  for (int k = 0; k < 4; ++k) length_sq += static_cast<double>(q[k]) * static_cast<double>(q[k]);
  const auto set_length = [&](double length) {
    for (int k = 0; k < 4; ++k) q[k] = static_cast<float>(static_cast<double>(q[k]) * length / std::sqrt(length_sq));
  };
  const auto sign = static_cast<float>(random.sign());
  switch (random.index(12)) {
    case 0: q[random.index(7)] = nan; break;
    case 1: q[random.index(7)] = sign * infinity; break;
    case 2: set_length(0); break;
    case 3: set_length(1.001e3); break;
    case 4: set_length(0.999e-3); break;
    case 5: set_length(1e25); break;
    case 6: q[4 + random.index(3)] = sign * 1.01f * kernel::kRigidRange; break;
    case 7: q[4 + random.index(3)] = sign * 0.99f * kernel::kRigidRange; break;  // still in range, often
    case 8: q[4 + random.index(3)] = sign * 0.9f * kMaxCoordinate; break;
    case 9: q[4 + random.index(3)] = sign * 1.1f * kMaxCoordinate; break;
    case 10: set_length(0.999e3); break;
    default: set_length(1.001e-3); break;
  }
}

// The same for what places an instance.
void spoil(Random& random, const Rig& rig, Place& place) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const float scales[] = {0, -1, nan, infinity, 0.999f * kMinScale, 1.001f * kMaxScale};
  const float factors[] = {0, 1e-20f, 1e4f, 1e-4f, infinity, nan};
  if (rig.scaled && random.chance(0.5)) place.scale = scales[random.index(6)];
  const float factor = factors[random.index(6)];
  for (float& c : place.turn)
    if (rig.rotated && random.chance(0.9)) c *= factor;
}

// Whether an instance's leaf centres and links are within the kernel's range: 1 if so, 0 if not, -1 if near it.
int is_in_range(const Rig& rig, const float* poses, std::uint32_t instance) {
  const float* const pose = poses + instance * rig.stride();
  const Place& place = rig.places[instance];
  Real most = 0;
  for (std::uint32_t n = 0; n < rig.articulation.leaf_count; ++n) {
    Real away = 0;
    for (const Real c : exact_box(rig, poses, instance, n).center) away += std::fabs(c);
    most = std::max(most, away);
  }
  const auto check_link = [&](std::uint32_t link, Real scale) {
    for (int c = 4; c < 7; ++c)
      most = std::max(most, scale * std::fabs(Real{pose[link + static_cast<std::size_t>(c)]}));
  };
  for (const std::uint32_t link : rig.bare) check_link(link, std::max(Real{1}, Real{place.scale}));
  if (rig.kind.placed) {
    for (const std::uint32_t link : rig.offset) check_link(link, 1);
    most = std::max(most, Real{place.scale} * Real{rig.shape.extent} + 3 * Real{place.grown});
  }
  const Real range = kernel::kRigidRange;
  return most <= (1 - kRangeRounding) * range ? 1 : most > (1 + kRangeRounding) * range ? 0 : -1;
}

RigKind random_kind(Random& random) {
  const double scales[] = {1, 1, 1e-6, 1e6, random.log_uniform(1e-30, 1e15)};
  const double scale = scales[random.index(5)];
  const double margins[] = {0, 0, 0.01 * scale, 0.5};
  const bool many = random.chance(0.2);
  return {1 + random.index(8),
          1 + random.index(many ? 40 : kLanes),
          random.chance(0.5),
          random.chance(0.5),
          static_cast<Halves>(random.index(kHalvesCount)),
          scale,
          random.chance(0.8) ? 1 : 30.0,
          margins[random.index(4)],
          7 + random.index(3)};
}

}  // namespace

TEST_CASE(
    "bounds of rigid leaves contain the box that pose_leaves makes and the exactly posed one, and exceed it by "
    "little, and are the same on every instruction set") {
  const std::uint64_t usual = 400;
  Random random(kSeed);
  std::size_t checked = 0, outside_posed = 0, outside_exact = 0, too_wide = 0, wrong_lanes = 0, wrong_block = 0;
  std::size_t differing = 0, good = 0, refused = 0, out_of_range = 0, several_blocks = 0, bare_links = 0;
  Real worst = 0;
  for (std::uint64_t round = 0; round < rounds(usual); ++round) {
    Rig rig(random, random_kind(random));
    const double places[] = {0, 1e-30, 1e-3, 1, 1e6, rig.kind.scale, 1e15};
    std::vector<float> poses = random_poses(random, rig, static_cast<Turns>(random.index(kTurnsCount)),
                                            any_turn(random), places[random.index(7)]);
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (random.chance(0.3))
        spoil(random, poses.data() + lane * rig.stride() + random.index(rig.kind.links) * rig.kind.link_stride);
      else if (rig.kind.placed && random.chance(0.1))
        spoil(random, rig, rig.places[lane]);
    const Posed posed = pose(*kernel::find_kernels(Isa::kScalar), rig, poses);
    const std::uint32_t next_bytes = random.chance(0.5) ? 0 : random.index(300);
    const auto first = rigid_tile(rig, poses, next_bytes);
    std::vector<std::unique_ptr<kernel::RigidTile>> others;
    for (std::size_t k = 1; k < available_kernels().size(); ++k) others.push_back(rigid_tile(rig, poses, next_bytes));
    several_blocks += rig.blocks() > 1;
    bare_links += !rig.bare.empty();
    for (std::uint32_t b = 0; b < rig.blocks(); ++b) {
      first->block = b;
      available_kernels().front()->bound_rigid_leaves(*first);
      const std::uint32_t leaves = rig.block[b].leaves;
      for (std::size_t k = 1; k < available_kernels().size(); ++k) {
        kernel::RigidTile& other = *others[k - 1];
        other.block = b;
        available_kernels()[k]->bound_rigid_leaves(other);
        differing += other.rigid != first->rigid;
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          if (!(first->rigid >> lane & 1)) continue;
          for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t leaf = 0; leaf < leaves; ++leaf)
              differing += !same_bits(other.lo[leaf][c][lane], first->lo[leaf][c][lane]) +
                           !same_bits(other.hi[leaf][c][lane], first->hi[leaf][c][lane]);
            differing += !same_bits(other.of_block.lo[c][lane], first->of_block.lo[c][lane]) +
                         !same_bits(other.of_block.hi[c][lane], first->of_block.hi[c][lane]);
          }
        }
      }
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        if (!(first->rigid >> lane & 1) || posed.flags[lane] != kInstanceOk) continue;  // a later block may refuse it
        for (std::uint32_t n = 0; n < leaves; ++n) {
          const std::uint32_t leaf = b * kLanes + n;
          const auto box = get(posed.leaves[leaf], lane);
          const ExactBox exact = exact_box(rig, poses.data(), lane, leaf);
          const Point reached = world_halves(box), reached_exactly = world_halves(exact);
          const Real slack = Real{kSlackWorld} * (sum_of(box.half) + Real{kOverlapTiny});
          const Real size = Real{rig.places[lane].scale} *
                                (sum_of(rig.leaf[leaf].half) + sum_of(rig.articulation.leaf_box[leaf].center)) +
                            3 * Real{rig.own_growth(lane)};
          Real away = 0;
          for (const Real c : exact.center) away += std::fabs(c);
          const Real most = most_excess(rig.kind.placed, size, away);
          for (std::size_t c = 0; c < 3; ++c) {
            const Real lo = first->lo[n][c][lane], hi = first->hi[n][c][lane], at = box.center[c];
            outside_posed += !(lo <= at - reached[c] - slack) + !(hi >= at + reached[c] + slack);
            const Real exact_lo = exact.center[c] - reached_exactly[c], exact_hi = exact.center[c] + reached_exactly[c];
            outside_exact += !(lo <= exact_lo) + !(hi >= exact_hi);
            too_wide += !(exact_lo - lo <= most) + !(hi - exact_hi <= most);
            worst = std::max({worst, (exact_lo - lo) / most, (hi - exact_hi) / most});
          }
          ++checked;
        }
        for (std::size_t c = 0; c < 3; ++c) {
          float lo = first->lo[0][c][lane], hi = first->hi[0][c][lane];
          for (std::size_t n = 1; n < leaves; ++n) {
            lo = std::min(lo, first->lo[n][c][lane]);
            hi = std::max(hi, first->hi[n][c][lane]);
          }
          wrong_block += first->of_block.lo[c][lane] != lo || first->of_block.hi[c][lane] != hi;
        }
      }
    }
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const bool rigid = first->rigid >> lane & 1;
      if (posed.flags[lane] != kInstanceOk) {
        wrong_lanes += rigid;
        ++refused;
        continue;
      }
      const int in_range = is_in_range(rig, poses.data(), lane);
      wrong_lanes += in_range == 1 && !rigid;
      wrong_lanes += in_range == 0 && rigid;
      good += in_range == 1;
      out_of_range += in_range == 0;
    }
    wrong_lanes += first->rigid >> kLanes != 0;
  }
  MESSAGE(checked << " bounds: worst excess " << static_cast<double>(worst) << " of its limit; " << good
                  << " instances are rigid, " << refused << " refused, " << out_of_range << " out of range");
  CAPTURE(kSeed);
  CHECK(outside_posed == 0);
  CHECK(outside_exact == 0);
  CHECK(too_wide == 0);
  CHECK(wrong_lanes == 0);
  CHECK(wrong_block == 0);
  CHECK(differing == 0);
  if (!runs_fewer_rounds()) CHECK(worst > 0.4L);
  CHECK(good >= least_count(3000, usual));
  CHECK(refused >= least_count(500, usual));
  CHECK(out_of_range >= least_count(50, usual));
  CHECK(several_blocks >= least_count(20, usual));
  CHECK(bare_links >= least_count(20, usual));
}

TEST_CASE("bounds of rigid leaves do not depend on the other lanes, for every number of live ones") {
  Random random(kSeed + 1);
  for (int round = 0; round < 20; ++round) {
    const Rig rig(random, random_kind(random));
    const std::vector<float> poses = random_poses(random, rig, Turns::kAny, any_turn(random), 1);
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(name_of(*kernels));
      const auto all = rigid_tile(rig, poses, 0);
      all->block = 0;
      kernels->bound_rigid_leaves(*all);
      CHECK(all->rigid == 0xffff);
      for (const std::uint32_t live : {1u, 7u, 15u, 16u}) {
        const auto some = rigid_tile(rig, poses, 1, live);
        some->block = 0;
        kernels->bound_rigid_leaves(*some);
        CHECK(some->rigid == 0xffff);
        bool same = true;
        for (std::uint32_t lane = 0; lane < kLanes; ++lane)
          for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t leaf = 0; leaf < rig.block[0].leaves; ++leaf)
              same = same && same_bits(some->lo[leaf][c][lane], all->lo[leaf][c][std::min(lane, live - 1)]) &&
                     same_bits(some->hi[leaf][c][lane], all->hi[leaf][c][std::min(lane, live - 1)]);
        CHECK(same);
      }
    }
  }
}

// ------------------------------------------------------------------------------------------------------ pairs of boxes

namespace {

// Sixteen posed instances, with what both tests of their leaves read.
struct Side {
  Side(Random& random, const RigKind& kind, Turns turns, const Eigen::Quaterniond& base, double place)
      : rig(random, kind), poses(random_poses(random, rig, turns, base, place)) {
    const kernel::KernelTable& scalar = *kernel::find_kernels(Isa::kScalar);
    const std::uint32_t leaves = rig.articulation.leaf_count;
    const Posed posed = pose(scalar, rig, poses);
    for (const std::uint8_t flag : posed.flags) REQUIRE(flag == kInstanceOk);
    boxes.resize(std::size_t{kLanes} * leaves);
    scalar.boxes_to_aos(posed.leaves.data(), leaves, kLanes, boxes.data(), leaves);
    for (std::uint32_t i = 0; i < kLanes; ++i)
      for (std::uint32_t n = 0; n < leaves; ++n) exact.push_back(exact_box(rig, poses.data(), i, n));
    words.resize(std::size_t{kLanes} * rig.blocks());
    const auto tile = rigid_tile(rig, poses, 0);
    for (std::uint32_t b = 0; b < rig.blocks(); ++b) {
      tile->block = b;
      scalar.bound_rigid_leaves(*tile);
      REQUIRE(tile->rigid == 0xffff);
      LeafWords* rows[kLanes];
      for (std::uint32_t i = 0; i < kLanes; ++i) rows[i] = &words[i * rig.blocks() + b];
      scalar.make_leaf_words(*tile, rows);
    }
  }
  const float* pose_of(std::uint32_t instance) const { return poses.data() + instance * rig.stride(); }
  const BoxAos& box(std::uint32_t instance, std::uint32_t leaf) const {
    return boxes[instance * rig.articulation.leaf_count + leaf];
  }
  const ExactBox& exactly(std::uint32_t instance, std::uint32_t leaf) const {
    return exact[instance * rig.articulation.leaf_count + leaf];
  }
  Rig rig;
  std::vector<float> poses;
  std::vector<BoxAos> boxes;
  std::vector<ExactBox> exact;
  std::vector<LeafWords> words;  // by instance and block
};

// A block of one instance and one of another. touches: whether they are placed for leaves `touch_a` and `touch_b` to
// touch, or nearly so.
struct Entry {
  std::uint32_t a, block_a, b, block_b;
  double origin_a[3], origin_b[3];
  bool touches;
  std::uint32_t touch_a, touch_b;
};

// Moves b's instance so that one leaf of each is apart by `gap` along one of the fifteen axes: a point of a's box and a
// point of b's are that far apart in its direction, and both boxes end there. A gap of 0 or more is the largest of all.
void place_touching(Random& random, const ExactBox& a, const ExactBox& b, Real gap, const double (&origin_a)[3],
                    double (&origin_b)[3]) {
  const std::uint32_t axis = random.index(15), i = axis % 3, j = axis / 3 % 3;
  const bool of_a = axis < 3, of_b = axis >= 3 && axis < 6;
  Point along = of_a ? oracle::axis_of(a, i) : oracle::axis_of(b, i);
  bool edges = false;
  if (!of_a && !of_b) {
    const Point edge = cross(oracle::axis_of(a, i), oracle::axis_of(b, j));
    edges = dot(edge, edge) > 1e-12L;
    if (edges) along = edge;
  }
  along = (static_cast<Real>(random.sign()) / std::sqrt(dot(along, along))) * along;
  // A point of the box that is farthest along `direction`; anywhere along the axes across it.
  const auto farthest = [&](const ExactBox& box, bool face, std::uint32_t free, Real direction) {
    Point out = {};
    for (std::size_t k = 0; k < 3; ++k) {
      const bool is_free = face ? k != i : edges && k == free;
      const Real side = dot(oracle::axis_of(box, k), along) * direction < 0 ? -1 : 1;
      out = out + (is_free ? static_cast<Real>(random.uniform(-1, 1)) : side) * box.half[k] * oracle::axis_of(box, k);
    }
    return out;
  };
  const bool face_of_b = !of_a && !edges;
  const Point from_a = farthest(a, of_a, i, 1), from_b = farthest(b, face_of_b, j, -1);
  for (std::size_t c = 0; c < 3; ++c)
    origin_b[c] =
        static_cast<double>(origin_a[c] + (a.center[c] + from_a[c] + gap * along[c]) - (b.center[c] + from_b[c]));
}

// The sum of the largest S + |c|_1 of both instances.
double size_of(const Side& a, const Side& b, const Entry& entry) {
  return static_cast<double>(a.rig.size_of(entry.a)) + static_cast<double>(b.rig.size_of(entry.b));
}

double unsure_of(const Side& a, const Side& b, const Entry& entry) {
  const auto reach = [](const Side& side, std::uint32_t instance, std::uint32_t block) {
    return std::ldexp(1.0, side.words[instance * side.rig.blocks() + block].exponent + kWordBits);
  };
  const bool placed = a.rig.kind.placed || b.rig.kind.placed;
  return static_cast<double>(placed ? kPlacedUnsureSize : kRigidUnsureSize) * size_of(a, b, entry) +
         static_cast<double>(placed ? kPlacedUnsureCenter : kRigidUnsureCenter) *
             (reach(a, entry.a, entry.block_a) + reach(b, entry.b, entry.block_b));
}

// A leaf of each that nearly touch, by what decides; or instances near each other.
Entry random_entry(Random& random, const Side& a, const Side& b) {
  Entry out{};
  out.a = random.index(kLanes);
  out.b = random.index(kLanes);
  out.block_a = random.index(a.rig.blocks());
  out.block_b = random.index(b.rig.blocks());
  const double far = random.chance(0.8) ? 0 : 1e3 * static_cast<double>(std::min(a.rig.size, b.rig.size));
  for (double& c : out.origin_a) c = far * random.uniform(-1, 1);
  const std::uint32_t i = out.block_a * kLanes + random.index(a.rig.block[out.block_a].leaves);
  const std::uint32_t j = out.block_b * kLanes + random.index(b.rig.block[out.block_b].leaves);
  const ExactBox &box_a = a.exactly(out.a, i), &box_b = b.exactly(out.b, j);
  const double size = size_of(a, b, out), unsure = unsure_of(a, b, out);
  out.touches = random.chance(0.85);
  if (out.touches) {
    const double gaps[] = {0, random.uniform(-0x1p-14, 0x1p-14) * size,
                           random.sign() * random.log_uniform(1e-3, 1e2) * unsure, random.uniform(-2, 2) * unsure,
                           random.uniform(-1, 256) * 0x1p-24 * size};
    out.touch_a = i;
    out.touch_b = j;
    place_touching(random, box_a, box_b, static_cast<Real>(gaps[random.index(5)]), out.origin_a, out.origin_b);
  } else {
    for (std::size_t c = 0; c < 3; ++c)
      out.origin_b[c] =
          static_cast<double>(out.origin_a[c] + box_a.center[c] - box_b.center[c]) + random.uniform(-1.5, 1.5) * size;
  }
  return out;
}

void fill_places(const Side& a, const Side& b, const Entry& entry, std::uint32_t slot, kernel::PairSlots& slots) {
  const auto fill = [&](int side, const Rig& rig, std::uint32_t instance) {
    const Place& place = rig.places[instance];
    for (int k = 0; k < 4; ++k) slots.turn[side][k][slot] = place.turn[k];
    slots.scale[side][slot] = place.scale;
    slots.grown[side][slot] = rig.own_growth(instance);
    slots.margin[side][slot] = place.grown;
    slots.rotated[side][slot] = rig.rotated;
  };
  fill(0, a.rig, entry.a);
  fill(1, b.rig, entry.b);
  slots.unsure[slot] = static_cast<float>(unsure_of(a, b, entry)) + kOverlapTiny;
}

kernel::RigidAs rigid_as(const Side& a, const Side& b) {
  return std::max(kernel::rigid_as(a.rig.shape), kernel::rigid_as(b.rig.shape));
}

void fill_slot(const Side& a, const Side& b, const Entry& entry, std::uint32_t slot, kernel::PairSlots& slots) {
  slots.shape_a[slot] = &a.rig.shape;
  slots.shape_b[slot] = &b.rig.shape;
  slots.pose_a[slot] = a.pose_of(entry.a);
  slots.pose_b[slot] = b.pose_of(entry.b);
  slots.at_a[slot] = static_cast<std::uint32_t>(slots.pose_a[slot] - a.poses.data());
  slots.at_b[slot] = static_cast<std::uint32_t>(slots.pose_b[slot] - b.poses.data());
  for (std::size_t c = 0; c < 3; ++c) {
    slots.exact_shift[slot][c] = entry.origin_b[c] - entry.origin_a[c];
    slots.shift[c][slot] = static_cast<float>(slots.exact_shift[slot][c]);
  }
  slots.unsure[slot] = static_cast<float>(unsure_of(a, b, entry));
  if (rigid_as(a, b) == kernel::RigidAs::kPlaced) fill_places(a, b, entry, slot, slots);
}

// The centre of b's leaf less that of a's.
Point between_leaves(const ExactBox& a, const ExactBox& b, const Entry& entry) {
  Point out;
  for (std::size_t c = 0; c < 3; ++c) out[c] = (b.center[c] - a.center[c]) + (entry.origin_b[c] - entry.origin_a[c]);
  return out;
}

bool exactly_meet(const Side& a, const Side& b, const Entry& entry, std::uint32_t pair) {
  const ExactBox &of_a = a.exactly(entry.a, kernel::leaf_a_of(pair)),
                 &of_b = b.exactly(entry.b, kernel::leaf_b_of(pair));
  return oracle::exactly_overlap(of_a, of_b, between_leaves(of_a, of_b, entry));
}

// The largest gap along the fifteen axes.
double gap_of(const Side& a, const Side& b, const Entry& entry, std::uint32_t pair) {
  const ExactBox &of_a = a.exactly(entry.a, kernel::leaf_a_of(pair)),
                 &of_b = b.exactly(entry.b, kernel::leaf_b_of(pair));
  const auto gaps = oracle::axis_gaps(oracle::convert<double>(of_a), oracle::convert<double>(of_b),
                                      oracle::convert<double>(between_leaves(of_a, of_b, entry)));
  return *std::max_element(gaps.begin(), gaps.end());
}

// The pairs of leaves that pass the leaf predicate of the boxes that pose_leaves makes.
std::vector<std::uint32_t> kept_by_predicate(const Side& a, const Side& b, const std::vector<Entry>& entries,
                                             const std::vector<std::uint32_t>& pairs, Sat sat) {
  std::vector<std::uint32_t> out;
  for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
    kernel::BoxPairs<BoxAos> job;
    ShiftTile shift;
    job.shift = &shift;
    job.leaves = 0xffff;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t pair = pairs[std::min(first + lane, pairs.size() - 1)];
      const Entry& entry = entries[kernel::slot_of(pair)];
      job.a[lane] = &a.box(entry.a, kernel::leaf_a_of(pair));
      job.b[lane] = &b.box(entry.b, kernel::leaf_b_of(pair));
      for (std::size_t c = 0; c < 3; ++c) shift.by[c][lane] = entry.origin_b[c] - entry.origin_a[c];
    }
    const std::uint32_t kept = kernel::find_kernels(Isa::kScalar)->overlap_boxes[static_cast<std::size_t>(sat)](job);
    for (std::size_t lane = 0; lane < std::min<std::size_t>(kLanes, pairs.size() - first); ++lane)
      if (kept >> lane & 1) out.push_back(pairs[first + lane]);
  }
  return out;
}

// All that decides about a pair, for a failure's message.
std::string describe(const Side& a, const Side& b, const std::vector<Entry>& entries, std::uint32_t pair) {
  const Entry& entry = entries[kernel::slot_of(pair)];
  std::ostringstream out;
  const auto leaf = [&](const Side& side, std::uint32_t instance, std::uint32_t n) {
    const float* const q = side.pose_of(instance) + side.rig.offset[n];
    const Box& box = side.rig.articulation.leaf_box[n];
    out << std::hexfloat << "\n  pose";
    for (int k = 0; k < 7; ++k) out << ' ' << q[k];
    out << "\n  centre";
    for (const float v : box.center) out << ' ' << v;
    out << "\n  half";
    for (const float v : box.half) out << ' ' << v;
    out << "\n  axes";
    for (const auto& axis : box.axis)
      for (const float v : axis) out << ' ' << v;
    const Place& place = side.rig.places[instance];
    out << "\n  turn";
    for (const float v : place.turn) out << ' ' << v;
    out << "\n  scale " << place.scale << " grown " << place.grown << std::defaultfloat;
  };
  out << "slot " << kernel::slot_of(pair);
  leaf(a, entry.a, kernel::leaf_a_of(pair));
  leaf(b, entry.b, kernel::leaf_b_of(pair));
  out << std::hexfloat << "\n  shift";
  for (std::size_t c = 0; c < 3; ++c) out << ' ' << entry.origin_b[c] - entry.origin_a[c];
  out << "\n  unsure " << unsure_of(a, b, entry) << std::defaultfloat;
  out << "\n  gap " << gap_of(a, b, entry, pair) / unsure_of(a, b, entry) << " of that";
  return out.str();
}

// The first pair that only one of two lists holds.
std::string first_difference(const Side& a, const Side& b, const std::vector<Entry>& entries,
                             const std::vector<std::uint32_t>& expected, const std::vector<std::uint32_t>& got) {
  if (expected == got) return "none";
  const auto at = std::mismatch(expected.begin(), expected.end(), got.begin(), got.end());
  const bool is_missing = at.second == got.end() || (at.first != expected.end() && *at.first < *at.second);
  return (is_missing ? "kept by the predicate only: " : "kept by the kernel only: ") +
         describe(a, b, entries, is_missing ? *at.first : *at.second);
}

// Two kinds of articulations and how their instances are placed.
enum class Scene { kOrdinary, kFar, kTinyBesideHuge, kAwayFromLinks, kAnyScale, kLarge };
constexpr unsigned kSceneCount = 6;

struct ScenePair {
  RigKind a, b;
  double place_a, place_b;
};

ScenePair random_scene(Random& random, Scene scene) {
  const auto kind = [&](double scale, double away) {
    const std::uint32_t leaves = scene == Scene::kLarge ? 17 + random.index(40) : 1 + random.index(6);
    return RigKind{1 + random.index(4),
                   leaves,
                   random.chance(0.5),
                   random.chance(0.4),
                   static_cast<Halves>(random.index(kHalvesCount)),
                   scale,
                   away,
                   0,
                   7 + random.index(2)};
  };
  ScenePair out;
  double scale_a = random.log_uniform(0.3, 3), scale_b = random.log_uniform(0.3, 3);
  if (scene == Scene::kTinyBesideHuge) scale_a = 1e-6, scale_b = random.chance(0.5) ? 1e6 : 1;
  if (scene == Scene::kAnyScale)
    scale_a = random.log_uniform(1e-30, 1e14), scale_b = scale_a * random.log_uniform(0.1, 10);
  const double away = scene == Scene::kAwayFromLinks ? random.log_uniform(1, 100) : random.chance(0.3) ? 0 : 1;
  out.a = kind(scale_a, away);
  out.b = kind(scale_b, away);
  const bool grows = random.chance(0.5);
  out.a.margin = out.b.margin = grows ? std::min(scale_a, scale_b) * random.log_uniform(1e-3, 1) : 0;
  const double far = scene == Scene::kFar ? 1e5 : random.chance(0.2) ? 0 : random.log_uniform(1e-3, 3);
  out.place_a = far * (scene == Scene::kFar ? 1 : scale_a);
  out.place_b = far * (scene == Scene::kFar ? 1 : scale_b);
  if (scene == Scene::kTinyBesideHuge && random.chance(0.5))
    std::swap(out.a, out.b), std::swap(out.place_a, out.place_b);
  return out;
}

}  // namespace

TEST_CASE(
    "overlap_rigid_leaves keeps exactly the pairs that pass the leaf predicate, from tables and from records, on "
    "every instruction set") {
  const std::uint64_t usual = 200;
  const auto slots = std::make_unique<kernel::PairSlots>();
  for (unsigned scene = 0; scene < kSceneCount; ++scene) {
    Random random(kSeed + 20 + scene);
    std::size_t kept_count = 0, dropped_count = 0, near_kept = 0, near_dropped = 0, open = 0, decided = 0, lost = 0;
    for (std::uint64_t round = 0; round < rounds(usual); ++round) {
      const ScenePair kinds = random_scene(random, static_cast<Scene>(scene));
      const auto turns = static_cast<Turns>(random.index(kTurnsCount));
      const Eigen::Quaterniond base = any_turn(random);
      const Side a(random, kinds.a, turns, base, kinds.place_a), b(random, kinds.b, turns, base, kinds.place_b);
      const std::uint32_t counts[] = {1, 15, 16, 17, 64, kernel::kPairEntries};
      std::vector<Entry> entries(counts[random.index(6)]);
      for (Entry& entry : entries) entry = random_entry(random, a, b);
      std::memset(static_cast<void*>(slots.get()), 0x5a, sizeof *slots);
      for (std::uint32_t s = 0; s < entries.size(); ++s) fill_slot(a, b, entries[s], s, *slots);

      // All pairs, or few of them, so that slots are left out.
      const double shares[] = {1, 0.3, 0.02};
      const double share = shares[random.index(3)];
      std::vector<std::uint32_t> pairs;
      for (std::uint32_t s = 0; s < entries.size(); ++s) {
        const Entry& entry = entries[s];
        for (std::uint32_t i = 0; i < a.rig.block[entry.block_a].leaves; ++i)
          for (std::uint32_t j = 0; j < b.rig.block[entry.block_b].leaves; ++j)
            if (random.chance(share))
              pairs.push_back(s << 16 | (entry.block_a * kLanes + i) << 8 | (entry.block_b * kLanes + j));
      }
      if (random.chance(0.2)) pairs.resize(std::min<std::size_t>(pairs.size(), 14 + random.index(5)));
      const auto count = static_cast<std::uint32_t>(pairs.size());

      CAPTURE(kSeed);
      CAPTURE(scene);
      CAPTURE(round);
      for (const Sat sat : {Sat::kAll15, Sat::kFaces6}) {
        const std::vector<std::uint32_t> expected = kept_by_predicate(a, b, entries, pairs, sat);
        for (const kernel::KernelTable* kernels : available_kernels()) {
          CAPTURE(name_of(*kernels));
          for (const bool tables : {false, true}) {
            if (tables && (a.rig.blocks() > 1 || b.rig.blocks() > 1)) continue;
            std::vector<std::uint32_t> read = pairs, out(count + kLanes + 1, 0xcdcdcdcd);
            read.resize(count + kLanes, 0xefefefef);
            kernel::RigidPairs job = {};
            job.slots = slots.get();
            job.pairs = read.data();
            job.count = count;
            job.out = out.data();
            if (tables) {
              job.block_a = a.rig.block.data();
              job.block_b = b.rig.block.data();
              job.base_a = a.poses.data();
              job.base_b = b.poses.data();
            }
            job.as = std::max(rigid_as(a, b), round % 8 == 0 ? kernel::RigidAs::kTurned : kernel::RigidAs::kPlain);
            job.sat = sat;
            const std::uint32_t n = kernels->overlap_rigid_leaves(job);
            REQUIRE(n <= count);
            CHECK(out.back() == 0xcdcdcdcd);
            out.resize(n);
            INFO(first_difference(a, b, entries, expected, out));
            CHECK(out == expected);
          }
        }
        if (sat == Sat::kFaces6) continue;
        kept_count += expected.size();
        dropped_count += pairs.size() - expected.size();
        for (const std::uint32_t pair : pairs) {
          const Entry& entry = entries[kernel::slot_of(pair)];
          lost += exactly_meet(a, b, entry, pair) && !std::binary_search(expected.begin(), expected.end(), pair);
          if (!entry.touches || entry.touch_a != kernel::leaf_a_of(pair) || entry.touch_b != kernel::leaf_b_of(pair))
            continue;
          const double unsure = unsure_of(a, b, entry), gap = gap_of(a, b, entry, pair);
          const bool kept = std::binary_search(expected.begin(), expected.end(), pair);
          if (std::fabs(gap) < 4 * unsure) ++(kept ? near_kept : near_dropped);
          ++(std::fabs(gap) < unsure ? open : decided);
        }
      }
    }
    MESSAGE("scene " << scene << ": " << kept_count << " pairs are kept and " << dropped_count << " not; of those near "
                     << near_kept << " and " << near_dropped << "; " << open << " unsure and " << decided << " not");
    CAPTURE(kSeed);
    CHECK(lost == 0);
    CHECK(kept_count >= least_count(1000, usual));
    CHECK(dropped_count >= least_count(10000, usual));
    CHECK(near_kept >= least_count(500, usual));
    CHECK(near_dropped >= least_count(300, usual));
    CHECK(open >= least_count(1000, usual));
    CHECK(decided >= least_count(300, usual));
  }
}

TEST_CASE("the crowd's passes together keep exactly the leaf pairs of two instances that pass the leaf predicate") {
  const std::uint64_t usual = 40;
  const auto slots = std::make_unique<kernel::PairSlots>();
  for (unsigned scene = 0; scene < kSceneCount; ++scene) {
    Random random(kSeed + 40 + scene);
    std::size_t kept_count = 0, left_out = 0;
    for (std::uint64_t round = 0; round < rounds(usual); ++round) {
      const ScenePair kinds = random_scene(random, static_cast<Scene>(scene));
      const auto turns = static_cast<Turns>(random.index(kTurnsCount));
      const Eigen::Quaterniond base = any_turn(random);
      const Side a(random, kinds.a, turns, base, kinds.place_a), b(random, kinds.b, turns, base, kinds.place_b);
      std::vector<Entry> entries(kernel::kPairEntries);
      std::vector<LeafWords> words_a, words_b;
      std::vector<const LeafWords*> rows_a, rows_b;
      std::vector<std::uint32_t> head, pairs;
      for (std::uint32_t s = 0; s < entries.size(); ++s) {
        Entry& entry = entries[s];
        entry = random_entry(random, a, b);
        words_a.push_back(a.words[entry.a * a.rig.blocks() + entry.block_a]);
        words_b.push_back(b.words[entry.b * b.rig.blocks() + entry.block_b]);
        std::copy_n(entry.origin_a, 3, words_a.back().origin);
        std::copy_n(entry.origin_b, 3, words_b.back().origin);
        head.push_back((entry.block_a * kLanes) << 8 | entry.block_b * kLanes);
        for (std::uint32_t i = 0; i < a.rig.block[entry.block_a].leaves; ++i)
          for (std::uint32_t j = 0; j < b.rig.block[entry.block_b].leaves; ++j)
            pairs.push_back(s << 16 | (entry.block_a * kLanes + i) << 8 | (entry.block_b * kLanes + j));
      }
      for (std::size_t s = 0; s < entries.size(); ++s) {
        rows_a.push_back(&words_a[s]);
        rows_b.push_back(&words_b[s]);
      }
      const auto expected = kept_by_predicate(a, b, entries, pairs, Sat::kAll15);
      kept_count += expected.size();
      CAPTURE(kSeed);
      CAPTURE(scene);
      CAPTURE(round);
      for (const kernel::KernelTable* kernels : available_kernels()) {
        CAPTURE(name_of(*kernels));
        std::vector<std::uint32_t> listed(256 * entries.size() + kLanes), out(256 * entries.size() + kLanes);
        std::uint32_t used = 0;
        const std::uint32_t count =
            kernels->overlapping_words({rows_a.data(), rows_b.data(), head.data(),
                                        static_cast<std::uint32_t>(entries.size()), a.rig.size + b.rig.size},
                                       *slots, listed.data(), &used);
        for (std::uint32_t s = 0; s < used; ++s) {
          const Entry& entry = entries[slots->entry[s]];
          slots->shape_a[s] = &a.rig.shape;
          slots->shape_b[s] = &b.rig.shape;
          slots->pose_a[s] = a.pose_of(entry.a);
          slots->pose_b[s] = b.pose_of(entry.b);
          slots->at_a[s] = static_cast<std::uint32_t>(slots->pose_a[s] - a.poses.data());
          slots->at_b[s] = static_cast<std::uint32_t>(slots->pose_b[s] - b.poses.data());
          if (rigid_as(a, b) == kernel::RigidAs::kPlaced) fill_places(a, b, entry, s, *slots);
        }
        kernel::RigidPairs job = {};
        job.slots = slots.get();
        job.pairs = listed.data();
        job.count = count;
        job.out = out.data();
        if (a.rig.blocks() == 1 && b.rig.blocks() == 1) {
          job.block_a = a.rig.block.data();
          job.block_b = b.rig.block.data();
          job.base_a = a.poses.data();
          job.base_b = b.poses.data();
        }
        job.as = rigid_as(a, b);
        job.sat = Sat::kAll15;
        out.resize(kernels->overlap_rigid_leaves(job));
        for (std::uint32_t& pair : out) pair = slots->entry[kernel::slot_of(pair)] << 16 | (pair & 0xffff);
        INFO(first_difference(a, b, entries, expected, out));
        CHECK(out == expected);
        left_out += pairs.size() - count;
      }
    }
    CHECK(kept_count >= least_count(1000, usual));
    CHECK(left_out >= least_count(500, usual));
  }
}

}  // namespace cab::tests
