// How far inner boxes jump when a pose moves a little. Each figure has one pose parameter, which goes through the
// values at which a refit has to choose its axes. Prints the table of docs/policies.md.
#include "perf/harness/world.h"
#include "tests/sanitizers.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace {

using namespace cab;
using namespace cab::oracle;

using Double3 = Vec3<double>;

constexpr double kDegree = 3.14159265358979323846 / 180;

// A link with at most one leaf box (half extents 0: none). Its frame is at `offset` in the parent's frame, or in the
// instance's for link 0, and rotated about the unit vector `axis` by `rest` degrees, and by `sway` degrees more per
// degree of the parameter.
struct Link {
  std::int32_t parent;
  Double3 offset, axis;
  double rest, sway;
  float center[3], half[3];
};

// The parameter goes from `first` to `last` degrees.
struct Figure {
  std::string name;
  std::vector<Link> links;
  double first, last;
};

// ---------------------------------------------------------------------------------------------------- figures

// A limb that lies along x from its frame's origin, with the paper's proportions.
Link limb(std::int32_t parent, Double3 offset, Double3 axis, double rest, double sway) {
  return {parent, offset, axis, rest, sway, {0.5f, 0, 0}, {0.5f, 0.17f, 0.17f}};
}

// An axis of rotation that is not an axis of the world, so that no number is exact by chance.
constexpr Double3 kTilted = {{0.48, -0.6, 0.64}};
constexpr Double3 kOrigin = {}, kX = {{1, 0, 0}}, kY = {{0, 1, 0}}, kZ = {{0, 0, 1}};

// A chain of links, each rotated about its own axis by a multiple of the parameter.
std::vector<Link> chain(int count, float half_length, float half_width) {
  std::vector<Link> links;
  links.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    links.push_back({i - 1,
                     (i > 0 ? 2.0 * static_cast<double>(half_length) : 0.0) * kX,
                     {{0, std::sin(1.3 * i), std::cos(1.3 * i)}},
                     0,
                     0.5 + 0.5 * std::fabs(std::sin(2.0 * i + 1)),
                     {half_length, 0, 0},
                     {half_length, half_width, half_width}});
  return links;
}

std::vector<Figure> all_figures() {
  const Link first = limb(-1, kOrigin, kTilted, 20, 0.3);
  Link bar = first;
  bar.center[0] = 0;
  bar.center[1] = 0.3f;
  bar.half[0] = 0.8f;
  Link folded = limb(2, kX, kZ, 0, 1);
  folded.center[0] = folded.half[0] = 0.75f;
  std::vector<Link> star = {{-1, kOrigin, kTilted, 20, 1, {}, {}}};
  for (int i = 0; i < 6; ++i) {
    star.push_back(limb(0, kOrigin, i < 4 ? kZ : kY, i < 4 ? 90 * i : i < 5 ? 90 : 270, 1 + 0.1 * i));
    star.back().half[1] = star.back().half[2] = 0.1f;
  }
  return {{"sixty", {first, limb(0, kOrigin, kZ, 0, 1)}, 50, 70},
          {"straight", {first, limb(0, kOrigin, {{0, 0.8, 0.6}}, 180, 1)}, -10, 10},
          {"bar", {bar, limb(0, kOrigin, kZ, 0, -1)}, 70, 100},
          {"mid-plane", {first, limb(0, kX, kZ, 30, 0), limb(1, kX, {{0, 0.6, 0.8}}, 40, 0), folded}, 125, 160},
          {"cubes", chain(4, 0.25f, 0.25f), 10, 90},
          {"star", star, -10, 10},
          {"chain", chain(8, 0.5f, 0.17f), 10, 90}};
}

Figure figure(const std::string& name) {
  for (const Figure& one : all_figures())
    if (one.name == name) return one;
  throw std::runtime_error("no figure " + name);
}

// --------------------------------------------------------------------------------------------------- the sweep

struct Quaternion {
  Double3 xyz;
  double w;
};

Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz)};
}

// Appends the poses of all links at one value of the parameter.
void append_poses(const Figure& figure, double degrees, std::vector<float>& poses) {
  std::vector<Quaternion> turn;
  std::vector<Double3> at;
  for (const Link& link : figure.links) {
    const double angle = kDegree * (link.rest + link.sway * degrees);
    turn.push_back({std::sin(angle / 2) * link.axis, std::cos(angle / 2)});
    at.push_back(link.offset);
    if (link.parent >= 0) {
      const auto parent = static_cast<std::size_t>(link.parent);
      const Quaternion& up = turn[parent];
      at.back() = at[parent] + (up * Quaternion{link.offset, 0} * Quaternion{-1.0 * up.xyz, up.w}).xyz;
      turn.back() = up * turn.back();
    }
    for (const double v : turn.back().xyz.v) poses.push_back(static_cast<float>(v));
    poses.push_back(static_cast<float>(turn.back().w));
    for (const double v : at.back().v) poses.push_back(static_cast<float>(v));
  }
}

// One figure in an engine.
struct Sweep {
  const Figure& figure;
  EnginePtr engine;
  ArticulationId articulation;
  ArticulationInfo info;

  Sweep(const Figure& one, Isa isa) : figure(one) {
    EngineDesc desc;
    desc.isa = isa;
    engine = make_engine(desc);
    Rig rig;
    for (const Link& link : one.links) {
      if (link.half[0] > 0)
        rig.leaves.push_back({static_cast<std::uint32_t>(rig.parents.size()),
                              {{link.center[0], link.center[1], link.center[2]},
                               {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                               {link.half[0], link.half[1], link.half[2]}},
                              {}});
      rig.parents.push_back(link.parent);
    }
    articulation = add_rig(*engine, rig);
    require(articulation_info(*engine, articulation, &info));
  }

  BatchId add(std::size_t count) {
    return add_instances(*engine, articulation, static_cast<std::uint32_t>(count), BatchKind::kSequence);
  }

  // All boxes at each value of the parameter.
  std::vector<Box> boxes(BatchId batch, const std::vector<double>& degrees, const Policies& policies) {
    std::vector<float> poses;
    for (const double value : degrees) append_poses(figure, value, poses);
    BatchInput input;
    input.batch = batch;
    input.poses.data = poses.data();
    std::vector<Box> out(degrees.size() * info.node_count);
    require(compute_boxes(*engine, input, policies, out));
    return out;
  }
};

// --------------------------------------------------------------------------------------------------- the measure

// What the inner boxes of one figure did under one policy. Distances of boxes are Hausdorff distances, sizes are
// diagonals, and the motion of a step is the largest distance that any corner of any leaf box moves in it.
struct Continuity {
  double jump = 0;           // largest distance of a box from itself one step before, as a share of its size
  double closer_jump = 0;    // the same after that step was halved kHalvings times, the half with the larger jump each
  double closer_motion = 0;  // time; the motion then, by the same size: a jump that stays is a discontinuity
  double ratio = 0;          // largest distance in a step over the motion in it: the observed Lipschitz constant
  std::uint32_t steps_above = 0;  // steps in which a box moved by more than kJump of its size
  auto numbers() const { return std::make_tuple(jump, closer_jump, closer_motion, ratio, steps_above); }
};
constexpr int kHalvings = 5;
constexpr double kJump = 0.01;

Double3 corner(const Box& box, unsigned which) {
  Double3 out = convert<double>(to_vec3(box.center));
  for (unsigned k = 0; k < 3; ++k)
    out =
        out + (which >> k & 1u ? 1.0 : -1.0) * static_cast<double>(box.half[k]) * convert<double>(to_vec3(box.axis[k]));
  return out;
}

double distance(const Double3& point, const Box& box) {
  Double3 out{};
  for (std::size_t k = 0; k < 3; ++k)
    out[k] = std::max(
        0.0, std::fabs(dot(point - convert<double>(to_vec3(box.center)), convert<double>(to_vec3(box.axis[k])))) -
                 static_cast<double>(box.half[k]));
  return norm(out);
}

// Hausdorff distance of two boxes taken as sets: the largest distance of a corner of one to the other.
double box_change(const Box& a, const Box& b) {
  double out = 0;
  for (unsigned which = 0; which < 8; ++which)
    out = std::max({out, distance(corner(a, which), b), distance(corner(b, which), a)});
  return out;
}

// The largest distance that a corner of a leaf box moves from one instance to the next.
double motion(const Box* from, const Box* to, const ArticulationInfo& info) {
  double out = 0;
  for (std::uint32_t leaf = 0; leaf < info.leaf_count; ++leaf)
    for (unsigned which = 0; which < 8; ++which)
      out = std::max(out, norm(corner(from[leaf], which) - corner(to[leaf], which)));
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
    const double way = box_change(from[node], to[node]);
    const double size = 2 * norm(convert<double>(to_vec3(from[node].half)));
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
  const std::uint32_t nodes = sweep.info.node_count;
  for (int i = 0; i < kHalvings; ++i) {
    const std::vector<double> values = {first, (first + last) / 2, last};
    const std::vector<Box> boxes = sweep.boxes(three, values, policies);
    const std::vector<Box> posed = sweep.boxes(three, values, kForMotion);
    const Jump early = largest_jump(boxes.data(), boxes.data() + nodes, sweep.info);
    const Jump late = largest_jump(boxes.data() + nodes, boxes.data() + 2 * nodes, sweep.info);
    const bool first_half = early.part >= late.part;
    const Box* const from = posed.data() + (first_half ? 0 : nodes);
    const Jump& jump = first_half ? early : late;
    out.closer_jump = jump.part;
    out.closer_motion = motion(from, from + nodes, sweep.info) / jump.size;
    (first_half ? last : first) = values[1];
  }
}

// Takes a figure in equal steps through its range by each of the policies.
std::vector<Continuity> measure(const Figure& figure, const std::vector<Policies>& policies, std::uint32_t step_count,
                                Isa isa = Isa::kAuto) {
  Sweep sweep(figure, isa);
  const std::size_t nodes = sweep.info.node_count;
  std::vector<double> values;
  for (std::uint32_t i = 0; i <= step_count; ++i)
    values.push_back(figure.first + (figure.last - figure.first) * i / step_count);
  const BatchId all = sweep.add(values.size()), three = sweep.add(3);
  const std::vector<Box> posed = sweep.boxes(all, values, kForMotion);
  std::vector<double> motions;
  for (const Box* from = posed.data(); motions.size() < step_count; from += nodes)
    motions.push_back(motion(from, from + nodes, sweep.info));

  std::vector<Continuity> out;
  for (const Policies& policy : policies) {
    const std::vector<Box> boxes = sweep.boxes(all, values, policy);
    Continuity seen;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < step_count; ++i) {
      const Box* const from = boxes.data() + i * nodes;
      const Jump jump = largest_jump(from, from + nodes, sweep.info);
      if (jump.part > kJump) ++seen.steps_above;
      if (motions[i] > 0) seen.ratio = std::max(seen.ratio, jump.distance / motions[i]);
      if (jump.part <= seen.jump) continue;
      seen.jump = jump.part;
      worst = i;
    }
    look_closer(sweep, three, policy, values[worst], values[worst + 1], seen);
    out.push_back(seen);
  }
  return out;
}

Continuity measured(const char* name, Refit refit) { return measure(figure(name), {{refit}}, 2000)[0]; }

// A cell of the table: the jump that stays and the number of jumps, or the ratio if there is none.
std::string cell(const Continuity& seen) {
  char text[64];
  if (seen.closer_jump <= kJump && seen.steps_above == 0)
    std::snprintf(text, sizeof text, " %.2f |", seen.ratio);
  else if (seen.steps_above < 1000)
    std::snprintf(text, sizeof text, " %.1f %% (%u) |", 100 * seen.closer_jump, seen.steps_above);
  else
    std::snprintf(text, sizeof text, " %.1f %% (%u %03u) |", 100 * seen.closer_jump, seen.steps_above / 1000,
                  seen.steps_above % 1000);
  return text;
}

constexpr Box kUnit = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};

}  // namespace

TEST_CASE("the distance of boxes is that of the sets, in either order") {
  Box other = kUnit;
  CHECK(box_change(kUnit, other) == 0);
  other.center[0] = 0.25f;
  CHECK(box_change(kUnit, other) == 0.25);
  other.center[1] = 3;
  CHECK(box_change(kUnit, other) == std::sqrt(9.0625));
  Box renamed = kUnit;  // the same cube with its axes in another order and of other signs
  renamed.axis[0][0] = renamed.axis[1][1] = 0;
  renamed.axis[0][1] = 1;
  renamed.axis[1][0] = -1;
  CHECK(box_change(kUnit, renamed) == 0);
  Box inside = kUnit;  // only the corners of the outer box are outside the other
  for (float& half : inside.half) half = 0.5f;
  CHECK(box_change(kUnit, inside) == std::sqrt(0.75));
  CHECK(box_change(inside, kUnit) == std::sqrt(0.75));
}

// lo and hi of an axis-aligned box are minima and maxima of corner coordinates, each of which moves by no more than its
// corner; three of them at once move a corner of the box by at most sqrt(3) times that. Rounding adds some ulps per
// step, below a hundredth of the motion in steps as large as these. Measured: at most 1.13.
TEST_CASE("axis-aligned boxes move no more than sqrt(3) times as far as the farthest leaf corner") {
  for (const Figure& one : all_figures()) {
    CAPTURE(one.name);
    for (const Continuity& seen : measure(one, {{Refit::kAabbHull}, {Refit::kAabbVertices}}, 200)) {
      CHECK(seen.ratio <= 1.01 * std::sqrt(3.0));
      CHECK(seen.ratio > 0.5);
    }
  }
}

TEST_CASE("limbs folded through 60 degrees: cab jumps by a third of a box however little they move, cab_sum does not") {
  const Continuity cab = measured("sixty", Refit::kCab);
  CHECK(cab.jump > 0.3);
  CHECK(cab.closer_jump > 0.3);
  CHECK(cab.closer_motion < 1e-5);
  CHECK(cab.ratio > 1000);
  const Continuity sum = measured("sixty", Refit::kCabSum);
  CHECK(sum.steps_above == 0);
  CHECK(sum.closer_jump < 2 * sum.closer_motion);
  CHECK(sum.ratio < 2);
}

TEST_CASE("a joint through the mid-plane of a child: one jump of cab, none of the refits that do not look at joints") {
  CHECK(measured("mid-plane", Refit::kCab).steps_above == 1);
  CHECK(measured("mid-plane", Refit::kCabSum).steps_above == 1);
  for (const Refit refit : {Refit::kCovariance, Refit::kAabbHull, Refit::kAabbVertices}) {
    CAPTURE(static_cast<int>(refit));
    const Continuity seen = measured("mid-plane", refit);
    CHECK(seen.steps_above == 0);
    CHECK(seen.closer_jump < seen.jump / 8);
  }
}

TEST_CASE("jumps have the same bits on every instruction set") {
  for (const Figure& one : all_figures()) {
    CAPTURE(one.name);
    const std::vector<Continuity> expected = measure(one, all_refits(), 300, Isa::kScalar);
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      const std::vector<Continuity> got = measure(one, all_refits(), 300, isa);
      for (std::size_t p = 0; p < got.size(); ++p) CHECK(got[p].numbers() == expected[p].numbers());
    }
  }
}

TEST_CASE("docs/policies.md has the table of jumps") {
  if (tests::kThreadSanitizer) {
    MESSAGE("skipped: one thread computes for minutes under ThreadSanitizer");
    return;
  }
  const PolicyField& refit = policy_table()[0];
  std::vector<Policies> policies;
  std::string table = "| figure |", line = "|---|";
  for (std::uint32_t value = 0; value < refit.value_count; ++value) {
    policies.push_back({static_cast<Refit>(value)});
    table += std::string(" `") + refit.values[value].name + "` |";
    line += "---|";
  }
  table += '\n' + line + '\n';
  for (const Figure& one : all_figures()) {
    table += "| " + one.name + " |";
    for (const Continuity& seen : measure(one, policies, 20000)) {
      CHECK(seen.closer_motion < 6e-6);  // measured: 5.8e-6
      table += cell(seen);
    }
    table += '\n';
  }
  MESSAGE("table of docs/policies.md:\n", table);
  std::ifstream page(CAB_DOCS "/policies.md");
  const std::string text(std::istreambuf_iterator<char>(page), {});
  CHECK(text.find(table) != std::string::npos);
}
