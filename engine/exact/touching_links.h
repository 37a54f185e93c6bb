// From the overlapping leaf pairs of a candidate to its touching link pairs, by the exact test if there is one.
#pragma once

#include "engine/exact/exact.h"
#include "engine/step/candidate.h"
#include "engine/step/in_contact.h"
#include "layout/pair_list.h"

#include <algorithm>
#include <tuple>

namespace cab {

// A leaf pair and the links of its leaves. Within one instance link_a is lower than link_b.
struct LinkedPair {
  std::uint16_t link_a, link_b;
  std::uint16_t leaf_a, leaf_b;
};

inline Hit hit_of(const Candidate& candidate, const LinkedPair& pair) {
  return {{candidate.batch_a + 1},
          candidate.instance_a,
          {candidate.batch_b + 1},
          candidate.instance_b,
          pair.link_a,
          pair.link_b,
          pair.leaf_a,
          pair.leaf_b};
}

// Looks up the links of a leaf pair. `within`: both leaves are of one instance.
inline LinkedPair linked(const Articulation& a, const Articulation& b, const LeafPair& pair, bool within) {
  const LinkedPair out = {a.leaf_link[pair.a], b.leaf_link[pair.b], pair.a, pair.b};
  if (within && out.link_b < out.link_a) return {out.link_b, out.link_a, out.leaf_b, out.leaf_a};
  return out;
}

// Calls report(candidate, its pairs) for every candidate in a list of leaf pairs, which must be sorted by candidate.
template <class ReportPairs>
void for_each_candidate(const Candidate* candidates, const FixedList<LeafPair>& list, ReportPairs&& report) {
  for (LeafPair* begin = list.begin(); begin != list.end();) {
    LeafPair* end = begin;
    while (end != list.end() && end->candidate == begin->candidate) ++end;
    report(candidates[begin->candidate], Span<LeafPair>{begin, static_cast<std::size_t>(end - begin)});
    begin = end;
  }
}

// Sorts the leaf pairs of one candidate by links, then by leaves. Pairs in the order of leaves are sorted already if
// both articulations list their leaves in the order of links; strategy `rows` finds them in that order.
inline void sort_by_links(const Articulation& a, const Articulation& b, bool within, Span<LeafPair> pairs) {
  const auto by_leaves = [](const LeafPair& x, const LeafPair& y) {
    return (std::uint32_t{x.a} << 16 | x.b) < (std::uint32_t{y.a} << 16 | y.b);
  };
  if (a.leaves_by_link && b.leaves_by_link && !within && std::is_sorted(pairs.begin(), pairs.end(), by_leaves)) return;
  std::sort(pairs.begin(), pairs.end(), [&](const LeafPair& x, const LeafPair& y) {
    const LinkedPair lx = linked(a, b, x, within), ly = linked(a, b, y, within);
    return std::tie(lx.link_a, lx.link_b, lx.leaf_a, lx.leaf_b) < std::tie(ly.link_a, ly.link_b, ly.leaf_a, ly.leaf_b);
  });
}

// Runs the exact test on two leaves whose boxes overlap, and counts it.
inline bool confirm(const FrameContext& frame, const ExactTest& test, const Candidate& candidate,
                    const LinkedPair& pair, FrameStats& stats) {
  ++stats.exact_tests;
  const ExactLeaf a = exact_leaf(frame, candidate.batch_a, candidate.instance_a, pair.leaf_a),
                  b = exact_leaf(frame, candidate.batch_b, candidate.instance_b, pair.leaf_b);
  if (test.touch(a, b, margin_between(a, b, frame.margin))) return true;
  ++stats.false_positives;
  return false;
}

// Sorts the overlapping leaf pairs of a candidate by links, and calls take(pair) with the lowest touching leaf pair of
// every link pair that touches. Without an exact test every overlapping leaf pair touches. Marks both instances as in
// contact if a leaf pair touches.
template <class Take>
void for_each_touching(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, FrameStats& stats,
                       Take&& take) {
  const Articulation& a = *frame.batch(candidate.batch_a).articulation;
  const Articulation& b = *frame.batch(candidate.batch_b).articulation;
  const bool within = is_within(candidate);
  const ExactTest* const test = find_exact_test(frame.policies.exact);
  sort_by_links(a, b, within, pairs);
  std::uint16_t link_a = 0xffff, link_b = 0xffff;
  bool any = false;
  for (const LeafPair& leaves : pairs) {
    const LinkedPair pair = linked(a, b, leaves, within);
    if (pair.link_a == link_a && pair.link_b == link_b) continue;
    if (test && test->touch && !confirm(frame, *test, candidate, pair, stats)) continue;
    take(pair);
    link_a = pair.link_a;
    link_b = pair.link_b;
    any = true;
  }
  if (any) set_in_contact(frame, candidate);
}

// Whether any overlapping leaf pair of a candidate touches. The exact test gets the two leaves in the same order as for
// hits, since its answer may depend on the order.
inline bool any_touching(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs,
                         FrameStats& stats) {
  const ExactTest* const test = find_exact_test(frame.policies.exact);
  if (!test || !test->touch) return !pairs.empty();
  const Articulation& a = *frame.batch(candidate.batch_a).articulation;
  const Articulation& b = *frame.batch(candidate.batch_b).articulation;
  return std::any_of(pairs.begin(), pairs.end(), [&](const LeafPair& pair) {
    return confirm(frame, *test, candidate, linked(a, b, pair, is_within(candidate)), stats);
  });
}

}  // namespace cab
