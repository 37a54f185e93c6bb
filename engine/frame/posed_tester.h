// Tests candidates whose instances are posed before they are tested: all but those that are tested by words.
#pragma once

#include "engine/broad_phase/crowd.h"
#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"

namespace cab {

struct HitSink;
struct Worker;

// The candidates of one task. They are tested whenever the worker's list or its set of posed instances is full.
class PosedTester {
 public:
  PosedTester(const FrameContext& frame, const Crowd& crowd, Worker& worker, HitSink& sink)
      : frame_(frame), crowd_(crowd), worker_(worker), sink_(sink) {}

  // Adds those of the pairs of sorted rows, a[n] and b[n], whose bounds overlap in double.
  void add(const std::uint32_t* a, const std::uint32_t* b, std::uint32_t count);

  // Adds an instance with itself, if a rule asks for it.
  void add_within(std::uint32_t batch, std::uint32_t instance);

  // Tests all candidates that are left.
  void finish();

 private:
  bool is_candidate(const RowPair& pair) const;
  bool has_large(const RowPair& pair) const;
  void add(const CrowdRow& a, const CrowdRow& b);
  void add(const RowPair& pair);
  void add_waiting();
  void test();

  const FrameContext& frame_;
  const Crowd& crowd_;
  Worker& worker_;
  HitSink& sink_;
};

// Runs the exact test, and reports hits, for the candidates `begin` to `end` - 1, whose leaf pairs are in
// worker.pairs.found, sorted by candidate.
void report_leaves(const FrameContext& frame, const Candidate* candidates, std::uint32_t begin, std::uint32_t end,
                   Worker& worker, HitSink& sink);

}  // namespace cab
