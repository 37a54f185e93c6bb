// Verifies sequences of bodies that have balls and capsules alone, which are tested link by link without boxes. A judge
// in long double has the distance of every two leaves as given. Links that touch must be reported, those that are
// reported are at most a stated fraction of their lengths apart, and a contact is as deep as its leaves are. Frames by
// boxes, frames that only say who is in contact, and every instruction set must answer alike.
#include <cmath>

#include "layout/round_leaf.h"
#include "perf/base/report.h"
#include "perf/harness/round_rig.h"
#include "perf/harness/world.h"
#include "perf/judge/oracle/segment_distance.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {
namespace {

using oracle::Point;
using oracle::Real;

enum class Regime { kRegular, kNear, kFar, kUnits, kThin, kAligned, kConcentric };

// The methods of a task.
enum Method : std::size_t { kRoundHits, kBoxHits, kInContact };

constexpr std::uint32_t kWorlds = 4;  // of each regime, per round

// The judge's rounding, in parts of the lengths that went into a pair.
constexpr Real kRounding = 0x1p-54L;

// What float leaves of the depth of a contact, in parts of those lengths.
constexpr Real kContactRounding = 4e-7L;

// The widest gap of leaves that may be called touching, in parts of those lengths.
constexpr Real kWidest = 0x1p-40L;

struct RoundWorld {
  oracle::RoundRig rig;  // has the parts to which the world points
  oracle::World world;

  oracle::Poses& poses() { return world.members[0].poses; }
  const oracle::Poses& poses() const { return world.members[0].poses; }
};

// A leaf as given, and the lengths that went into it.
struct ExactLeaf {
  oracle::Segment segment;
  Real radius, lengths;
};

ExactLeaf exact_leaf(const RoundWorld& made, std::uint32_t instance, std::size_t leaf) {
  const ConvexPart& part = made.rig.parts[leaf];
  const oracle::ExactPose pose = exact_pose(made.poses(), instance, made.rig.links[leaf]);
  const Real q[4] = {part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]};
  Real own[3][3];
  oracle::quaternion_matrix(q, own);
  const Point at = oracle::convert<Real>(oracle::to_vec3(part.position));
  const Real half = part.kind == ShapeKind::kCapsule ? part.size[1] : 0;
  return {{pose.at + rotated(pose.column, at), rotated(pose.column, half * oracle::to_vec3(own[2]))},
          part.size[0],
          norm_1(pose.at) + norm_1(at) + half + Real{part.size[0]}};
}

bool is_tested(const oracle::RoundRig& rig, std::size_t a, std::size_t b) {
  const std::uint32_t link_a = rig.links[a], link_b = rig.links[b];
  return link_a != link_b && std::none_of(rig.ignored.begin(), rig.ignored.end(), [&](const LinkPair& pair) {
           return (pair.a == link_a && pair.b == link_b) || (pair.a == link_b && pair.b == link_a);
         });
}

// ------------------------------------------------------------------------------------------------------------- inputs

oracle::RoundRig random_rig(oracle::Random& random, Regime regime, float unit) {
  oracle::RoundRig rig = oracle::random_round_rig(random, 2 + random.index(9), 1 + random.index(4));
  for (std::size_t leaf = 0; leaf < rig.parts.size(); ++leaf) {
    ConvexPart& part = rig.parts[leaf];
    if (regime == Regime::kThin) {
      part.size[0] *= static_cast<float>(random.log_uniform(1e-5, 1));
      part.size[1] *= static_cast<float>(random.uniform(1, 4));
    }
    if (regime == Regime::kAligned) std::copy_n(std::initializer_list<float>{0, 0, 0, 1}.begin(), 4, part.rotation);
    for (float& size : part.size) size *= unit;
    for (std::size_t c = 0; c < 3; ++c) {
      part.position[c] *= regime == Regime::kConcentric ? 0 : unit;
      rig.boxes[leaf].center[c] = part.position[c];
      rig.boxes[leaf].half[c] = 1.001f * (part.size[0] + part.size[1]);
    }
  }
  return rig;
}

// The distance of two leaves of an instance, below 0 less their depth.
Real gap_of(const RoundWorld& made, std::uint32_t instance, std::size_t a, std::size_t b) {
  const ExactLeaf leaf_a = exact_leaf(made, instance, a), leaf_b = exact_leaf(made, instance, b);
  const Point between = shortest_between(leaf_a.segment, leaf_b.segment);
  return std::sqrt(dot(between, between)) - leaf_a.radius - leaf_b.radius;
}

// Moves a link of each instance so that one of its leaves is near one of another link: by 1e-2 to 1e-9 of their
// lengths, of either sign. Returns some gap that is left, or below 0.
Real bring_near(oracle::Random& random, RoundWorld& made) {
  const auto leaf_count = static_cast<unsigned>(made.rig.parts.size());
  Real some = -1;
  for (std::uint32_t i = 0; i < made.poses().instance_count; ++i) {
    const std::size_t a = random.index(leaf_count), b = random.index(leaf_count);
    if (made.rig.links[a] == made.rig.links[b]) continue;
    const ExactLeaf leaf_a = exact_leaf(made, i, a), leaf_b = exact_leaf(made, i, b);
    const Point between = shortest_between(leaf_a.segment, leaf_b.segment);
    const Real distance = std::sqrt(dot(between, between)), lengths = leaf_a.lengths + leaf_b.lengths;
    if (distance < 1e-3L * lengths) continue;
    const Real gap = random.sign() * random.log_uniform(1e-9, 1e-2) * lengths;
    float* const to = made.poses().pose(i, made.rig.links[b]) + 4;
    for (std::size_t c = 0; c < 3; ++c)
      to[c] = static_cast<float>(to[c] + ((leaf_a.radius + leaf_b.radius + gap) / distance - 1) * between[c]);
    if (const Real left = gap_of(made, i, a, b); left > 0) some = left;
  }
  return some;
}

RoundWorld random_world(oracle::Random& random, Regime regime) {
  RoundWorld out;
  const auto unit = static_cast<float>(regime == Regime::kUnits ? random.log_uniform(1e-24, 1e7) : 1);
  out.rig = random_rig(random, regime, unit);
  oracle::Member& member = out.world.members.emplace_back();
  member.kind = BatchKind::kSequence;
  const ArticulationDesc desc = out.rig.desc();
  member.rig.parents = out.rig.parents;
  member.rig.leaves.assign(desc.leaves.begin(), desc.leaves.end());
  member.rig.ignored = out.rig.ignored;
  out.poses().link_count = member.rig.link_count();
  out.poses().instance_count = 1 + random.index(40);
  const double spread = random.uniform(0.2, 1) * static_cast<double>(unit);
  const double away = regime == Regime::kFar ? random.log_uniform(10, 1e7) : 0;
  const auto origin = away * random.unit_vector();
  for (std::uint32_t i = 0; i < out.poses().instance_count; ++i) {
    const bool same_place = regime == Regime::kConcentric && random.chance(0.5);
    for (std::uint32_t link = 0; link < out.poses().link_count; ++link) {
      double q[4];
      oracle::random_turn(random, q);
      if (regime == Regime::kAligned)
        oracle::quaternion_about(random.unit_vector(), random.chance(0.3) ? 0 : random.log_uniform(1e-8, 1e-3), q);
      if (random.chance(0.1))
        for (double& x : q) x *= 30;
      float pose[7];
      const auto at = (same_place ? 0 : random.uniform(0, spread)) * random.unit_vector();
      oracle::write_pose(PoseFormat::kQuaternionTranslation, q, origin + at, pose);
      out.poses().data.insert(out.poses().data.end(), pose, pose + 7);
    }
  }
  const Real gap = regime == Regime::kNear || random.chance(0.1) ? bring_near(random, out) : -1;
  out.world.rules = {{{1}, {1}, Pairing::kWithin}};
  if (random.chance(0.3)) out.world.margin = static_cast<float>(random.log_uniform(1e-3, 0.3)) * unit;
  // Two leaves that are a margin apart, but for its rounding.
  if (gap > 0 && random.chance(0.7)) out.world.margin = static_cast<float>(gap);
  return out;
}

// ------------------------------------------------------------------------------------------------------------ judging

// Two leaves of an instance. gap: their distance less the margin, below 0 how much deeper they are.
struct JudgedPair {
  std::size_t a, b;
  Real gap, lengths;
  bool touches() const { return gap < -kRounding * lengths; }
  bool is_apart() const { return gap > kRounding * lengths; }
  double wide_as() const { return static_cast<double>(gap / (kWidest * lengths)); }
};

// All tested leaf pairs of an instance, by links and then by leaves, as hits are.
std::vector<JudgedPair> judge(const RoundWorld& made, std::uint32_t instance) {
  std::vector<ExactLeaf> leaves;
  for (std::size_t leaf = 0; leaf < made.rig.parts.size(); ++leaf) leaves.push_back(exact_leaf(made, instance, leaf));
  std::vector<JudgedPair> out;
  const auto links = [&](const JudgedPair& pair) {
    return std::make_pair(made.rig.links[pair.a], made.rig.links[pair.b]);
  };
  const Real margin = made.world.margin;
  for (std::size_t a = 0; a < leaves.size(); ++a)
    for (std::size_t b = a + 1; b < leaves.size(); ++b) {
      if (!is_tested(made.rig, a, b)) continue;
      const Point between = shortest_between(leaves[a].segment, leaves[b].segment);
      JudgedPair& pair = out.emplace_back();
      pair.a = a, pair.b = b;
      if (made.rig.links[b] < made.rig.links[a]) std::swap(pair.a, pair.b);
      pair.gap = std::sqrt(dot(between, between)) - (leaves[a].radius + leaves[b].radius + margin);
      pair.lengths = leaves[a].lengths + leaves[b].lengths + margin;
    }
  std::sort(out.begin(), out.end(), [&](const JudgedPair& p, const JudgedPair& q) {
    return std::make_tuple(links(p), p.a, p.b) < std::make_tuple(links(q), q.a, q.b);
  });
  return out;
}

void report(Task& task, Method method, const RoundWorld& made, std::uint32_t instance, const JudgedPair& pair,
            const std::string& what) {
  const auto leaf_text = [&](std::size_t leaf) {
    oracle::PosedPart posed = {made.rig.parts[leaf], {}, {}};
    std::copy_n(made.poses().pose(instance, made.rig.links[leaf]), 7, posed.pose);
    return to_text(posed);
  };
  task.violation(method, what + "; A: " + leaf_text(pair.a) + "; B: " + leaf_text(pair.b) + "; margin " +
                             shortest(made.world.margin));
}

void judge_contact(Task& task, Method method, const RoundWorld& made, std::uint32_t instance, const JudgedPair& of,
                   Real deepest, const Contact& contact) {
  Tally& tally = task.tallies[method];
  ++tally.contacts;
  if (!std::isfinite(contact.depth)) return report(task, method, made, instance, of, "a depth is not finite");
  const Real margin = made.world.margin;
  Real off = 0;
  for (const Real depth : {-of.gap - margin, deepest - margin}) off = std::max(off, std::fabs(contact.depth - depth));
  tally.off = std::max(tally.off, static_cast<double>(off / of.lengths * 0x1p24L));
  if (!(off <= kContactRounding * of.lengths))
    report(task, method, made, instance, of, "a contact is off by " + shortest(static_cast<double>(off)));
}

// The pairs of two links, and the hit about them if there is one.
void judge_links(Task& task, Method method, const RoundWorld& made, std::uint32_t instance,
                 Span<const JudgedPair> pairs, const Hit* hit, const Contact* contact) {
  Tally& tally = task.tallies[method];
  const JudgedPair* lowest = nullptr;  // that touches
  const JudgedPair* nearest = pairs.data;
  for (const JudgedPair& pair : pairs) {
    ++tally.judged;
    tally.touching += pair.touches();
    tally.undecided += !pair.touches() && !pair.is_apart();
    if (pair.touches() && !lowest) lowest = &pair;
    if (pair.gap < nearest->gap) nearest = &pair;
  }
  if (!hit) {
    tally.lost += lowest != nullptr;
    if (lowest) report(task, method, made, instance, *lowest, "leaves touch and are not reported");
    return;
  }
  const auto find = [&](std::uint16_t a, std::uint16_t b) {
    return std::find_if(pairs.begin(), pairs.end(), [&](const JudgedPair& pair) { return pair.a == a && pair.b == b; });
  };
  const JudgedPair* const named = find(hit->leaf_a, hit->leaf_b);
  if (named == pairs.end()) return report(task, method, made, instance, *nearest, "a hit names leaves of other links");
  if (lowest && lowest < named) report(task, method, made, instance, *lowest, "lower leaves touch than a hit says");
  if (named->is_apart()) {
    tally.false_positives += nearest->is_apart();
    tally.widest_gap = std::max(tally.widest_gap, named->wide_as());
    if (named->wide_as() > 1) report(task, method, made, instance, *named, "leaves that are apart are reported");
  }
  if (!contact) return;
  const JudgedPair* const of = find(contact->leaf_a, contact->leaf_b);
  if (of == pairs.end()) return report(task, method, made, instance, *nearest, "a contact names leaves of other links");
  judge_contact(task, method, made, instance, *of, -nearest->gap, *contact);
}

// Judges all links of all instances. found: by links, as a frame reports them.
void judge_hits(Task& task, Method method, const RoundWorld& made, const std::vector<std::vector<JudgedPair>>& truth,
                const oracle::Outcome& found) {
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < truth.size(); ++i) {
    for (std::size_t begin = 0, end = 0; begin < truth[i].size(); begin = end) {
      const std::uint32_t link_a = made.rig.links[truth[i][begin].a], link_b = made.rig.links[truth[i][begin].b];
      for (end = begin; end < truth[i].size(); ++end)
        if (made.rig.links[truth[i][end].a] != link_a || made.rig.links[truth[i][end].b] != link_b) break;
      const bool is_hit = next < found.hits.size() && found.hits[next].instance_a == i &&
                          found.hits[next].link_a == link_a && found.hits[next].link_b == link_b;
      judge_links(task, method, made, i, {truth[i].data() + begin, end - begin}, is_hit ? &found.hits[next] : nullptr,
                  is_hit && made.world.contacts ? &found.contacts[next] : nullptr);
      next += is_hit;
    }
  }
  if (next != found.hits.size()) task.violation(method, "hits are not in order, or of links that are not tested");
}

// Who is in contact, of frames that say no more.
void judge_in_contact(Task& task, const RoundWorld& made, const std::vector<std::vector<JudgedPair>>& truth,
                      const std::vector<std::uint8_t>& in_contact) {
  Tally& tally = task.tallies[kInContact];
  for (std::uint32_t i = 0; i < truth.size(); ++i) {
    if (truth[i].empty()) continue;
    ++tally.judged;
    const JudgedPair& nearest = *std::min_element(
        truth[i].begin(), truth[i].end(),
        [](const JudgedPair& a, const JudgedPair& b) { return a.gap / a.lengths < b.gap / b.lengths; });
    tally.touching += nearest.touches();
    tally.undecided += !nearest.touches() && !nearest.is_apart();
    if (!in_contact[i] && nearest.touches()) {
      ++tally.lost;
      report(task, kInContact, made, i, nearest, "leaves touch and their body is not in contact");
    }
    if (!in_contact[i] || !nearest.is_apart()) continue;
    ++tally.false_positives;
    tally.widest_gap = std::max(tally.widest_gap, nearest.wide_as());
    if (nearest.wide_as() > 1)
      report(task, kInContact, made, i, nearest, "a body is in contact whose leaves are apart");
  }
}

bool same_contacts(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Contact)) == 0);
}

void judge_world(Task& task) {
  RoundWorld made = random_world(task.random, static_cast<Regime>(task.regime));
  if (made.rig.parts.empty()) return;
  std::vector<std::vector<JudgedPair>> truth;
  for (std::uint32_t i = 0; i < made.poses().instance_count; ++i) truth.push_back(judge(made, i));
  Policies policies;
  policies.exact = Exact::kConvex;
  made.world.contacts = task.random.chance(0.3);
  const auto run_by = [&](Isa isa, Strategy strategy, Report report) {
    policies.strategy = strategy;
    return oracle::run_on(*oracle::make_engine_for(made.world, {.isa = isa}), made.world, policies,
                          task.subject->run_frame, report);
  };
  const Isa isa = task.subject->kernels->isa;
  const auto compare = [&](Method method, const oracle::Outcome& a, const oracle::Outcome& b, const char* what) {
    if (oracle::same_hits(a.hits, b.hits) && same_contacts(a.contacts, b.contacts)) return;
    ++task.tallies[method].differing;
    task.violation(method, what);
  };
  const oracle::Outcome round = run_by(isa, Strategy::kAuto, Report::kHits);
  judge_hits(task, kRoundHits, made, truth, round);
  for (const Isa other : oracle::available_isas())
    if (other != isa)
      compare(kRoundHits, run_by(other, Strategy::kAuto, Report::kHits), round, "instruction sets differ");
  const oracle::Outcome boxes =
      run_by(isa, task.random.chance(0.5) ? Strategy::kTree : Strategy::kBrute, Report::kHits);
  judge_hits(task, kBoxHits, made, truth, boxes);
  compare(kBoxHits, boxes, round, "frames by boxes and without them differ");
  made.world.contacts = false;
  judge_in_contact(task, made, truth, run_by(isa, Strategy::kAuto, Report::kInContact).in_contact[0]);
}

void run(Task& task) {
  for (std::uint32_t world = 0; world < kWorlds; ++world) judge_world(task);
}

}  // namespace

// The regimes are those of Regime, in its order; the methods those of Method.
VerifyPart round_part() {
  return {"round",
          "pairs",
          Columns::kRound,
          {"regular", "near", "far", "units", "thin", "aligned", "concentric"},
          {"without boxes", "by boxes", "in contact"},
          run};
}

}  // namespace cab::perf
