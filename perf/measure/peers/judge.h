// The judge of `cab peers`: which leaves of a posed crowd touch, by their boxes or by their shapes, in double and long
// double.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "perf/judge/oracle/convex_pairs.h"
#include "perf/judge/oracle/oracle_box.h"
#include "perf/measure/peers/crowd_leaves.h"
#include "perf/measure/peers/peer.h"

namespace cab::perf {

using Pairs = std::vector<LeafPair>;

// The judge's answer about a pair of leaves.
enum class LeafVerdict { kTouch, kApart, kThreshold };

// All leaves of a posed crowd. They are judged by their one part, or by their boxes if they have none.
class JudgedCrowd {
 public:
  JudgedCrowd(const scenes::Crowd& crowd, const std::vector<scenes::PosedGroup>& posed);

  LeafVerdict verdict(const LeafPair& pair) const;

  // Less the depth of two leaves, or their distance, in metres.
  double gap(const LeafPair& pair) const;

  // Brute force over all leaves of different characters: the pairs that touch, threshold pairs with a gap of at most
  // zero included.
  Pairs touching_pairs() const;

 private:
  void add(const scenes::CrowdGroup& group, const scenes::PosedGroup& posed);
  const double* origin_of(std::uint32_t leaf) const { return &origins_[std::size_t{leaves_.character_of(leaf)} * 3]; }
  oracle::Vec3<double> place_of(std::uint32_t leaf) const;
  oracle::Vec3<double> between(const LeafPair& pair) const { return place_of(pair.b) - place_of(pair.a); }
  bool boxes_overlap(const LeafPair& pair) const;
  oracle::ConvexCase case_of(const LeafPair& pair) const;

  CrowdLeaves leaves_;
  std::vector<double> origins_;                   // of all characters
  std::vector<oracle::OracleBox<double>> boxes_;  // relative to their characters' origins
  std::vector<oracle::PosedPart> parts_;          // likewise; empty: leaves are boxes
};

// How a set-up's pairs differ from reference pairs.
struct Differences {
  std::uint64_t pairs = 0;            // that it found
  std::uint64_t misses = 0;           // touch and were not found
  std::uint64_t false_positives = 0;  // found, and apart or found before
  std::uint64_t threshold = 0;        // found by one of the two alone, at the threshold
  std::vector<std::string> examples;  // the first misses and false positives, in words
};

// Adds to `found` how sorted pairs differ from sorted reference pairs. Each differing pair is judged, so the reference
// need not be right. Where the reference is wrong, of_reference counts it (null: the reference is brute force).
void add_differences(const JudgedCrowd& judge, const Pairs& pairs, const Pairs& reference, Differences& found,
                     Differences* of_reference);

}  // namespace cab::perf
