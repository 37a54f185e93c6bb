// Searches the strips of a crowd for candidates.
#pragma once

#include "engine/broad_phase/crowd.h"
#include "engine/step/frame_context.h"
#include "kernels/search_strip.h"

namespace cab {

struct CrowdScratch;

// Sorted rows from `first` to end - 1, and what they are paired with: in their strip the rows after each of them up to
// own_end, the first one from `from` on; in the next strip rows from `next` on.
struct StripRows {
  std::uint32_t first, end, from, own_end, next, next_end;
  float reach;
};

// The search of one worker for candidates. What is done with them is for others to say.
class StripSearcher {
 public:
  StripSearcher(const FrameContext& frame, const Crowd& crowd, CrowdScratch& scratch);
  virtual ~StripSearcher() = default;
  StripSearcher(const StripSearcher&) = delete;
  StripSearcher& operator=(const StripSearcher&) = delete;

  const Crowd& crowd() const { return crowd_; }

  // Takes as candidates what kernel::StripSearch finds, of those that some rule pairs and whose layers match. Tests
  // whenever there are enough.
  void search(const StripRows& rows);

  // Tests the candidates that are left: the sorted rows scratch.a and scratch.b. Empties the list.
  virtual void test() = 0;

 protected:
  const FrameContext& frame_;
  const Crowd& crowd_;
  CrowdScratch& scratch_;

 private:
  std::uint32_t keep_paired(std::uint32_t begin, std::uint32_t end) const;

  kernel::CrowdSides sides_;
};

// Takes the candidates of sorted rows that follow each other in one strip of a class. reach: the greatest extent along
// the first axis in that strip and the next one. has_next: whether there is a next one. Rows of smaller classes are
// searched as well.
void pair_in_strip(StripSearcher& searcher, std::uint32_t number, float reach, std::uint32_t strip, std::uint32_t first,
                   std::uint32_t end, bool has_next);

// Takes the candidates of the rows of a strip of class 0 with those of the next one alone.
void pair_with_next(StripSearcher& searcher, std::uint32_t strip);

// Takes the candidates of the sorted rows of `classes` from `first` to `end` - 1, in all strips that they are in. Rows
// that are not kept are searched for among those that are, as well.
void pair_rows(StripSearcher& searcher, const CrowdClasses& classes, std::uint32_t first, std::uint32_t end);

}  // namespace cab
