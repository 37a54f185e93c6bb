#include "perf/continuity/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "perf/oracle/engine_ptr.h"

namespace cab::perf {
namespace {

using Vec3 = std::array<double, 3>;

constexpr double kRadians = 3.14159265358979323846 / 180;

void require(Status status) {
  if (status != Status::kOk) throw std::runtime_error(to_string(status));
}

// ---------------------------------------------------------------------------------------------------- figures

// A limb that lies along x from its frame's origin, with the paper's proportions.
SweepLink limb(std::int32_t parent, Vec3 offset, Vec3 axis, double rest, double sway) {
  return {parent,
          {offset[0], offset[1], offset[2]},
          {axis[0], axis[1], axis[2]},
          rest,
          sway,
          {0.5f, 0, 0},
          {0.5f, 0.17f, 0.17f}};
}

// An axis of rotation that is not an axis of the world, so that no number is exact by chance.
constexpr Vec3 kTilted = {0.48, -0.6, 0.64};

// A chain of links, each rotated about its own axis by a multiple of the parameter.
std::vector<SweepLink> chain(int count, float half_length, float half_width) {
  std::vector<SweepLink> links;
  for (int i = 0; i < count; ++i) {
    SweepLink link = {i - 1,
                      {i > 0 ? 2.0 * static_cast<double>(half_length) : 0.0, 0, 0},
                      {0, 0, 1},
                      0,
                      0,
                      {half_length, 0, 0},
                      {half_length, half_width, half_width}};
    link.axis[1] = std::sin(1.3 * i);
    link.axis[2] = std::cos(1.3 * i);
    link.sway = 0.5 + 0.5 * std::fabs(std::sin(2.0 * i + 1));
    links.push_back(link);
  }
  return links;
}

// Arms along both directions of each axis, each swaying about another one.
std::vector<SweepLink> star() {
  std::vector<SweepLink> links = {{-1, {0, 0, 0}, {kTilted[0], kTilted[1], kTilted[2]}, 20, 1, {0, 0, 0}, {0, 0, 0}}};
  const Vec3 toward[6] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 1, 0}, {0, 1, 0}};
  const double rest[6] = {0, 90, 180, 270, 90, 270};
  for (int i = 0; i < 6; ++i) {
    SweepLink arm = limb(0, {0, 0, 0}, toward[i], rest[i], 1 + 0.1 * i);
    arm.half[1] = arm.half[2] = 0.1f;
    links.push_back(arm);
  }
  return links;
}

// --------------------------------------------------------------------------------------------------- the sweep

// The product a b of two quaternions x y z w.
std::array<double, 4> product(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

Vec3 rotated(const std::array<double, 4>& q, const double (&v)[3]) {
  const std::array<double, 4> out = product(product(q, {v[0], v[1], v[2], 0}), {-q[0], -q[1], -q[2], q[3]});
  return {out[0], out[1], out[2]};
}

// Appends the poses of all links at one value of the parameter.
void append_poses(const SweepCase& figure, double degrees, std::vector<float>& poses) {
  std::vector<std::array<double, 4>> turn;
  std::vector<Vec3> at;
  for (const SweepLink& link : figure.links) {
    const double angle = kRadians * (link.rest + link.sway * degrees);
    const double s = std::sin(angle / 2);
    const std::array<double, 4> own = {s * link.axis[0], s * link.axis[1], s * link.axis[2], std::cos(angle / 2)};
    if (link.parent < 0) {
      turn.push_back(own);
      at.push_back({link.offset[0], link.offset[1], link.offset[2]});
    } else {
      const auto parent = static_cast<std::size_t>(link.parent);
      const Vec3 way = rotated(turn[parent], link.offset);
      at.push_back({at[parent][0] + way[0], at[parent][1] + way[1], at[parent][2] + way[2]});
      turn.push_back(product(turn[parent], own));
    }
    for (const double v : turn.back()) poses.push_back(static_cast<float>(v));
    for (const double v : at.back()) poses.push_back(static_cast<float>(v));
  }
}

// One figure in an engine.
class Sweep {
 public:
  Sweep(const SweepCase& figure, Isa isa) : figure_(figure) {
    EngineDesc desc;
    desc.isa = isa;
    Engine* engine = nullptr;
    require(create_engine(desc, &engine));
    engine_.reset(engine);
    std::vector<std::int32_t> parents;
    std::vector<Leaf> leaves;
    for (std::uint32_t i = 0; i < figure.links.size(); ++i) {
      const SweepLink& link = figure.links[i];
      parents.push_back(link.parent);
      if (link.half[0] == 0) continue;
      Leaf leaf;
      leaf.link = i;
      leaf.box = {{link.center[0], link.center[1], link.center[2]},
                  {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                  {link.half[0], link.half[1], link.half[2]}};
      leaves.push_back(leaf);
    }
    ArticulationDesc articulation;
    articulation.link_parents = parents;
    articulation.leaves = leaves;
    require(add_articulation(*engine_, articulation, &articulation_));
    require(articulation_info(*engine_, articulation_, &info_));
  }

  const ArticulationInfo& info() const { return info_; }

  // Adds a batch with room for `count` values of the parameter.
  BatchId add(std::size_t count) {
    BatchId batch;
    require(add_batch(*engine_, {articulation_, static_cast<std::uint32_t>(count), BatchKind::kSequence}, &batch));
    return batch;
  }

  // All boxes at each value of the parameter.
  std::vector<Box> boxes(BatchId batch, const std::vector<double>& degrees, const Policies& policies) {
    std::vector<float> poses;
    for (const double value : degrees) append_poses(figure_, value, poses);
    BatchInput input;
    input.batch = batch;
    input.poses.data = poses.data();
    std::vector<Box> out(degrees.size() * info_.node_count);
    require(compute_boxes(*engine_, input, policies, out));
    return out;
  }

 private:
  const SweepCase& figure_;
  oracle::EnginePtr engine_;
  ArticulationId articulation_;
  ArticulationInfo info_;
};

// --------------------------------------------------------------------------------------------------- the measure

Vec3 corner(const Box& box, unsigned which) {
  Vec3 out;
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = static_cast<double>(box.center[c]);
    for (unsigned k = 0; k < 3; ++k)
      out[c] += (which >> k & 1u ? 1.0 : -1.0) * static_cast<double>(box.half[k]) * static_cast<double>(box.axis[k][c]);
  }
  return out;
}

double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

double distance(const Vec3& point, const Box& box) {
  double sq = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c)
      along += (point[c] - static_cast<double>(box.center[c])) * static_cast<double>(box.axis[k][c]);
    const double out = std::max(0.0, std::fabs(along) - static_cast<double>(box.half[k]));
    sq += out * out;
  }
  return std::sqrt(sq);
}

double diagonal(const Box& box) {
  return 2 * std::hypot(static_cast<double>(box.half[0]), static_cast<double>(box.half[1]),
                        static_cast<double>(box.half[2]));
}

double volume(const Box& box) {
  return 8 * static_cast<double>(box.half[0]) * static_cast<double>(box.half[1]) * static_cast<double>(box.half[2]);
}

double area(const Box& box) {
  const double x = static_cast<double>(box.half[0]), y = static_cast<double>(box.half[1]),
               z = static_cast<double>(box.half[2]);
  return 8 * (x * y + y * z + z * x);
}

double change(double a, double b) { return std::fabs(a - b) / std::max(a, b); }

// The largest distance that a corner of a leaf box moves from one instance to the next.
double motion(const Box* from, const Box* to, std::uint32_t leaf_count) {
  double out = 0;
  for (std::uint32_t leaf = 0; leaf < leaf_count; ++leaf)
    for (unsigned which = 0; which < 8; ++which)
      out = std::max(out, distance(corner(from[leaf], which), corner(to[leaf], which)));
  return out;
}

// How far the inner box that moves most between two instances moves, as a share of its size.
struct Jump {
  double part = 0;
  double size = 1;  // of the box that jumped most
  double distance = 0;
};

Jump largest_jump(const Box* from, const Box* to, const ArticulationInfo& info) {
  Jump out;
  for (std::uint32_t node = info.leaf_count; node < info.node_count; ++node) {
    const double way = box_change(from[node], to[node]), size = diagonal(from[node]);
    out.distance = std::max(out.distance, way);
    if (way <= out.part * size) continue;
    out.part = way / size;
    out.size = size;
  }
  return out;
}

// The policies for measuring motion, which is that of oriented leaf boxes. Other policies may make axis-aligned ones.
constexpr Policies kForMotion = {};

// Halves the step from `first` to `last` kHalvings times, and keeps the half with the larger jump each time.
void look_closer(Sweep& sweep, BatchId three, const Policies& policies, double first, double last, Continuity& out) {
  const std::uint32_t nodes = sweep.info().node_count;
  for (int i = 0; i < kHalvings; ++i) {
    const std::vector<double> values = {first, (first + last) / 2, last};
    const std::vector<Box> boxes = sweep.boxes(three, values, policies);
    const std::vector<Box> posed = sweep.boxes(three, values, kForMotion);
    const Jump early = largest_jump(boxes.data(), boxes.data() + nodes, sweep.info());
    const Jump late = largest_jump(boxes.data() + nodes, boxes.data() + 2 * nodes, sweep.info());
    const bool first_half = early.part >= late.part;
    const Box* const from = posed.data() + (first_half ? 0 : nodes);
    const Jump& jump = first_half ? early : late;
    out.closer_jump = jump.part;
    out.closer_motion = motion(from, from + nodes, sweep.info().leaf_count) / jump.size;
    (first_half ? last : first) = values[1];
  }
}

}  // namespace

std::vector<SweepCase> sweep_cases() {
  std::vector<SweepCase> out;
  out.push_back({"sixty",
                 "two equal limbs at one joint, folded to 50..70 degrees: |E| passes |a1| at 60",
                 {limb(-1, {0, 0, 0}, kTilted, 20, 0.3), limb(0, {0, 0, 0}, {0, 0, 1}, 0, 1)},
                 50,
                 70});
  out.push_back({"straight",
                 "two equal limbs that bend through the straight, about an axis between those of their boxes",
                 {limb(-1, {0, 0, 0}, kTilted, 20, 0.3), limb(0, {0, 0, 0}, {0, 0.8, 0.6}, 180, 1)},
                 -10,
                 10});
  SweepLink bar = limb(-1, {0, 0, 0}, kTilted, 20, 0.3);
  bar.center[0] = 0;
  bar.half[0] = 0.8f;
  bar.center[1] = 0.3f;
  out.push_back({"bar",
                 "a limb that turns about the mid-plane of a bar: rounding says which end of the bar is away",
                 {bar, limb(0, {0, 0, 0}, {0, 0, 1}, 0, -1)},
                 70,
                 100});
  // The joint of the two pairs is left of the second pair's middle, then right of it.
  SweepLink last = limb(2, {1, 0, 0}, {0, 0, 1}, 0, 1);
  last.center[0] = last.half[0] = 0.75f;
  out.push_back({"mid-plane",
                 "four limbs, the last folded back over the third: the joint passes through the mid-plane of their box",
                 {limb(-1, {0, 0, 0}, kTilted, 20, 0.3), limb(0, {1, 0, 0}, {0, 0, 1}, 30, 0),
                  limb(1, {1, 0, 0}, {0, 0.6, 0.8}, 40, 0), last},
                 125,
                 160});
  out.push_back({"cubes", "a chain of four cubes that curls up", chain(4, 0.25f, 0.25f), 10, 90});
  out.push_back({"star", "six arms along the axes that sway through their symmetric pose", star(), -10, 10});
  out.push_back({"chain", "a chain of eight limbs that curls up, no place special", chain(8, 0.5f, 0.17f), 10, 90});
  return out;
}

double box_change(const Box& a, const Box& b) {
  double out = 0;
  for (unsigned which = 0; which < 8; ++which)
    out = std::max({out, distance(corner(a, which), b), distance(corner(b, which), a)});
  return out;
}

std::vector<Continuity> measure_continuity(const SweepCase& figure, const std::vector<Policies>& policies,
                                           std::uint32_t step_count, Isa isa) {
  Sweep sweep(figure, isa);
  const ArticulationInfo info = sweep.info();
  std::vector<double> values;
  for (std::uint32_t i = 0; i <= step_count; ++i)
    values.push_back(figure.first + (figure.last - figure.first) * i / step_count);
  const BatchId all = sweep.add(values.size()), three = sweep.add(3);
  const std::vector<Box> posed = sweep.boxes(all, values, kForMotion);
  std::vector<double> motions;
  for (std::size_t i = 0; i < step_count; ++i) {
    const Box* const from = posed.data() + i * info.node_count;
    motions.push_back(motion(from, from + info.node_count, info.leaf_count));
  }

  std::vector<Continuity> out;
  for (const Policies& policy : policies) {
    const std::vector<Box> boxes = sweep.boxes(all, values, policy);
    Continuity seen;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < step_count; ++i) {
      const Box* const from = boxes.data() + i * info.node_count;
      const Box* const to = from + info.node_count;
      const Jump jump = largest_jump(from, to, info);
      if (jump.part > kJump) ++seen.steps_above;
      if (jump.part > seen.jump) {
        seen.jump = jump.part;
        seen.jump_motion = motions[i] / jump.size;
        worst = i;
      }
      if (motions[i] > 0) seen.ratio = std::max(seen.ratio, jump.distance / motions[i]);
      for (std::uint32_t node = info.leaf_count; node < info.node_count; ++node) {
        seen.volume_change = std::max(seen.volume_change, change(volume(from[node]), volume(to[node])));
        seen.area_change = std::max(seen.area_change, change(area(from[node]), area(to[node])));
      }
    }
    look_closer(sweep, three, policy, values[worst], values[worst + 1], seen);
    out.push_back(seen);
  }
  return out;
}

}  // namespace cab::perf
