// A world to run frames on: rigs with poses, the rules, and the outcome of a frame.
#pragma once

#include "perf/harness/engine_ptr.h"
#include "perf/judge/oracle/box_distance.h"
#include "perf/judge/oracle/exact_pose.h"

#include <cab/cab.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <tuple>
#include <vector>

namespace cab::oracle {

// Throws the status of a call in words, unless it is kOk.
inline void require(Status status) {
  if (status != Status::kOk) throw std::runtime_error(to_string(status));
}

inline EnginePtr make_engine(const EngineDesc& desc = {}) {
  Engine* engine = nullptr;
  require(create_engine(desc, &engine));
  return EnginePtr(engine);
}

inline std::vector<Isa> available_isas() {
  std::vector<Isa> out;
  for (std::uint8_t i = 1; i < kIsaCount; ++i)  // 0 is kAuto
    if (isa_available(static_cast<Isa>(i))) out.push_back(static_cast<Isa>(i));
  return out;
}

inline ArticulationId add_rig(Engine& engine, const Rig& rig) {
  ArticulationId id;
  require(add_articulation(engine, rig.desc(), &id));
  return id;
}

inline BatchId add_instances(Engine& engine, ArticulationId articulation, std::uint32_t count,
                             BatchKind kind = BatchKind::kCharacters) {
  BatchId id;
  require(add_batch(engine, {articulation, count, kind}, &id));
  return id;
}

// One batch of a world. Batch m of the world has id m + 1.
struct Member {
  Rig rig;
  Poses poses;
  BatchKind kind = BatchKind::kCharacters;
  std::vector<std::uint32_t> layers = {}, layer_masks = {};
};

struct World {
  std::vector<Member> members;
  std::vector<PairRule> rules;
  float margin = 0;
  float min_depth = 0;
  bool contacts = false;  // whether to ask for contacts
};

struct Outcome {
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  FrameStats stats;
  std::vector<std::vector<std::uint8_t>> flags;       // of each member's instances
  std::vector<std::vector<std::uint8_t>> in_contact;  // likewise
};

// One frame of a world on an engine that holds its batches; frame does what run_frame does.
inline Outcome run_on(Engine& engine, const World& world, const Policies& policies,
                      decltype(&run_frame) frame = run_frame, Report report = Report::kHits) {
  Outcome out;
  std::vector<BatchInput> inputs;
  for (const Member& member : world.members) {
    out.flags.emplace_back(member.poses.instance_count, std::uint8_t{0xee});
    out.in_contact.emplace_back(member.poses.instance_count, std::uint8_t{0xee});
  }
  for (std::size_t m = 0; m < world.members.size(); ++m) {
    const Member& member = world.members[m];
    inputs.push_back(member.poses.input({static_cast<std::uint32_t>(m + 1)}));
    inputs.back().flags = out.flags[m];
    inputs.back().layers = member.layers;
    inputs.back().layer_masks = member.layer_masks;
    inputs.back().in_contact = out.in_contact[m];
  }
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.policies = policies;
  job.margin = world.margin;
  job.min_depth = world.min_depth;
  job.report = report;
  Status status = frame(engine, job);
  while (status == Status::kHitsOverflow) {
    out.hits.resize(job.hits_needed);
    out.contacts.resize(world.contacts ? job.hits_needed : 0);
    job.hits = out.hits;
    job.contacts = out.contacts;
    status = frame(engine, job);
  }
  require(status);
  if (job.hits_needed != out.hits.size()) throw std::runtime_error("a retry found another number of hits");
  out.hits.resize(job.hit_count);
  if (world.contacts) out.contacts.resize(job.hit_count);
  out.stats = job.stats;
  return out;
}

// The instances that a list of hits names, as Outcome::in_contact.
inline std::vector<std::vector<std::uint8_t>> in_contact_by(const World& world, const std::vector<Hit>& hits) {
  std::vector<std::vector<std::uint8_t>> out;
  for (const Member& member : world.members) out.emplace_back(member.poses.instance_count, std::uint8_t{0});
  for (const Hit& hit : hits)
    out[hit.batch_a.value - 1][hit.instance_a] = out[hit.batch_b.value - 1][hit.instance_b] = 1;
  return out;
}

inline EnginePtr make_engine_for(const World& world, const EngineDesc& desc = {}) {
  EnginePtr engine = make_engine(desc);
  for (const Member& member : world.members)
    add_instances(*engine, add_rig(*engine, member.rig), member.poses.instance_count, member.kind);
  return engine;
}

inline Outcome run_world(const World& world, const Policies& policies = {}, const EngineDesc& desc = {}) {
  return run_on(*make_engine_for(world, desc), world, policies);
}

inline auto link_key(const Hit& hit) {
  return std::make_tuple(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a, hit.link_b);
}
inline auto leaf_key(const Hit& hit) { return std::make_tuple(hit.leaf_a, hit.leaf_b); }
inline bool link_less(const Hit& a, const Hit& b) { return link_key(a) < link_key(b); }

inline bool same_bits(const Box* a, const Box* b, std::size_t count) {
  return std::memcmp(a, b, count * sizeof(Box)) == 0;
}

// Policies for every way to refit: each value of `refit` with each value of `extents`, with strategy tree.
inline std::vector<Policies> all_refits() {
  std::vector<Policies> out;
  for (std::uint32_t refit = 0; refit < policy_table()[0].value_count; ++refit)
    for (const Extents extents : {Extents::kChildren, Extents::kLeaves})
      out.push_back({static_cast<Refit>(refit), Strategy::kTree, Exact::kNone, extents});
  return out;
}

inline bool same_hits(const std::vector<Hit>& a, const std::vector<Hit>& b) {
  static_assert(sizeof(Hit) == 24, "no padding to compare");
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Hit)) == 0);
}

// The number of link pairs of a that b lacks.
inline std::size_t missing_from(const std::vector<Hit>& a, const std::vector<Hit>& b) {
  std::vector<Hit> out;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out), link_less);
  return out.size();
}

inline bool same_counts(const FrameStats& a, const FrameStats& b) {
  return a.box_tests == b.box_tests && a.leaf_pairs == b.leaf_pairs && a.exact_tests == b.exact_tests &&
         a.false_positives == b.false_positives && a.instances_masked == b.instances_masked;
}

// Whether some bit of an instance's mask is a layer of another instance. Without layers or masks all bits are set.
inline bool sees(const Member& a, std::uint32_t instance_a, const Member& b, std::uint32_t instance_b) {
  for (int bit = 0; bit < 32; ++bit)
    if ((a.layer_masks.empty() || a.layer_masks[instance_a] >> bit & 1) &&
        (b.layers.empty() || b.layers[instance_b] >> bit & 1))
      return true;
  return false;
}

// The link pairs that touch in a world, or are no farther apart than its margin, by the judge of exact_pose.h: sorted,
// with the lowest leaf pair of each. grow widens each half extent by this fraction of the box's size and of its
// distance from its origin. masked(member, instance) says which instances take no part.
template <class Masked>
std::vector<Hit> judge_world(const World& world, double grow, Masked&& masked) {
  std::vector<Hit> out;
  std::vector<std::vector<std::vector<ExactBox>>> boxes;
  for (const Member& member : world.members) {
    boxes.emplace_back();
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i) {
      boxes.back().push_back(exact_leaf_boxes(member.rig, member.poses, i));
      for (ExactBox& box : boxes.back().back()) {
        const Real by = static_cast<Real>(grow) * (half_sum(box) + norm_1(center_of(box)));
        for (Real& half : box.half) half += by;
      }
    }
  }
  const auto judge = [&](std::size_t ma, std::uint32_t ia, std::size_t mb, std::uint32_t ib) {
    if (masked(ma, ia) || masked(mb, ib)) return;
    const bool within = ma == mb && ia == ib;
    const Member &a = world.members[ma], &b = world.members[mb];
    if (!within && !(sees(a, ia, b, ib) && sees(b, ib, a, ia))) return;
    const Point shift = exact_origin(b.poses, ib) - exact_origin(a.poses, ia);
    for (std::size_t la = 0; la < a.rig.leaves.size(); ++la) {
      for (std::size_t lb = within ? la + 1 : 0; lb < b.rig.leaves.size(); ++lb) {
        std::uint32_t link_a = a.rig.leaves[la].link, link_b = b.rig.leaves[lb].link;
        if (within && link_a == link_b) continue;
        if (within && std::any_of(a.rig.ignored.begin(), a.rig.ignored.end(), [&](const LinkPair& pair) {
              return (pair.a == link_a && pair.b == link_b) || (pair.a == link_b && pair.b == link_a);
            }))
          continue;
        const ExactBox &box_a = boxes[ma][ia][la], &box_b = boxes[mb][ib][lb];
        const Point between = shift + (center_of(box_b) - center_of(box_a));
        const Real reach = half_sum(box_a) + half_sum(box_b) + static_cast<Real>(world.margin);
        if (dot(between, between) > 1.01L * reach * reach) continue;
        if (world.margin > 0 ? box_distance(box_a, box_b, between) > static_cast<Real>(world.margin)
                             : !exactly_overlap(box_a, box_b, between))
          continue;
        std::size_t leaf_a = la, leaf_b = lb;
        if (within && link_b < link_a) {
          std::swap(link_a, link_b);
          std::swap(leaf_a, leaf_b);
        }
        out.push_back({{static_cast<std::uint32_t>(ma + 1)},
                       ia,
                       {static_cast<std::uint32_t>(mb + 1)},
                       ib,
                       static_cast<std::uint16_t>(link_a),
                       static_cast<std::uint16_t>(link_b),
                       static_cast<std::uint16_t>(leaf_a),
                       static_cast<std::uint16_t>(leaf_b)});
      }
    }
  };
  for (const PairRule& rule : world.rules) {
    const std::size_t ma = std::min(rule.a.value, rule.b.value) - 1, mb = std::max(rule.a.value, rule.b.value) - 1;
    const std::uint32_t na = world.members[ma].poses.instance_count, nb = world.members[mb].poses.instance_count;
    const bool frames = world.members[ma].kind == BatchKind::kSequence;
    if (rule.pairing == Pairing::kWithin) {
      for (std::uint32_t i = 0; i < na; ++i) judge(ma, i, ma, i);
    } else if (frames) {
      for (std::uint32_t i = 0; i < std::max(na, nb); ++i) judge(ma, na == 1 ? 0 : i, mb, nb == 1 ? 0 : i);
    } else {
      for (std::uint32_t i = 0; i < na; ++i)
        for (std::uint32_t j = ma == mb ? i + 1 : 0; j < nb; ++j) judge(ma, i, mb, j);
    }
  }
  std::sort(out.begin(), out.end(), [](const Hit& a, const Hit& b) {
    return std::tuple_cat(link_key(a), leaf_key(a)) < std::tuple_cat(link_key(b), leaf_key(b));
  });
  out.erase(std::unique(out.begin(), out.end(), [](const Hit& a, const Hit& b) { return link_key(a) == link_key(b); }),
            out.end());
  return out;
}

inline std::vector<Hit> judge_world(const World& world, double grow = 0) {
  return judge_world(world, grow, [](std::size_t, std::uint32_t) { return false; });
}

// The link pairs that a frame may report: those whose leaf boxes touch when each half extent grows by half the world's
// margin, and by a fraction of size and distance on top.
inline std::vector<Hit> judge_widened(World world, double grow) {
  for (Member& member : world.members)
    for (Leaf& leaf : member.rig.leaves)
      for (float& half : leaf.box.half) half = std::nextafter(half + world.margin / 2, HUGE_VALF);
  world.margin = 0;
  return judge_world(world, grow);
}

}  // namespace cab::oracle
