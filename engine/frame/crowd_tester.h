// Tests candidates whose instances all have words: compares the words of their leaves, and tests the boxes of those
// that are left.
#pragma once

#include "engine/broad_phase/strip_searcher.h"
#include "engine/step/candidate.h"

namespace cab {

struct HitSink;
struct Worker;

// The candidates of one task.
class CrowdTester final : public StripSearcher {
 public:
  CrowdTester(const FrameContext& frame, const Crowd& crowd, Worker& worker, HitSink& sink);

  void test() override;

 private:
  const CrowdBatch& batch_of(std::uint32_t batch) const { return frame_.batches[batch]->crowd; }
  void drop_reported();
  Candidate candidate_of(std::uint32_t n, CrowdRow& a, CrowdRow& b) const;
  struct Entries;
  void make_plain_entries(Entries& entries);
  std::uint32_t make_entries(std::uint32_t begin, Entries& entries);
  void place_slots(const Entries& entries, std::uint32_t used);
  std::uint32_t test_from(std::uint32_t begin);
  void report(const std::uint32_t* pairs, std::uint32_t count, std::uint32_t begin, std::uint32_t end);
  void report_direct(std::uint32_t* pairs, std::uint32_t count, bool in_order);

  Worker& worker_;
  HitSink& sink_;
};

}  // namespace cab
