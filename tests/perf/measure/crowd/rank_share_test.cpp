// How the ranks of `cab crowd --mpi` cut a crowd.
#include "perf/measure/crowd/rank_share.h"
#include "tests/engine/mpi/short_of_memory.h"

#include <doctest/doctest.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace cab::tests {

TEST_CASE("if an allocation of one rank fails while a crowd is cut, all ranks are told which rank and why") {
  const Ranks ranks;
  const perf::Ranks together;
  scenes::Crowd crowd;
  for (const std::uint32_t count : {30u, 60u}) {
    crowd.groups.emplace_back().count = count;
    crowd.groups.back().pose = [](double, const scenes::Chosen& chosen, scenes::PosedGroup& posed) {
      posed.origins.clear();
      for (std::uint32_t i = 0; i < chosen.count(); ++i)
        posed.origins.insert(posed.origins.end(), {static_cast<double>(chosen[i]), 0, 0});
    };
  }
  const std::string victim = "rank " + std::to_string(ranks.victim()) + ": ";
  bool failed = true;
  long nth = 0;
  for (; failed && nth < 1000; ++nth) {
    CAPTURE(nth);
    perf::RankShare share(crowd, together);
    std::string told;
    failed = run_short_of_memory(ranks, nth, false, [&] {
      try {
        share.cut(0);
      } catch (const perf::AgreedFailure& failure) { told = failure.what(); }
    });
    CAPTURE(told);
    CHECK(failed == (told.rfind(victim, 0) == 0 && told.find("out of memory") != std::string::npos));
    CHECK(failed == !told.empty());
    if (!failed) CHECK(share.count() >= crowd.count() / static_cast<std::uint32_t>(ranks.ranks) - 3);
  }
  CHECK_FALSE(failed);  // there was a cut without a failure
  CHECK(nth > 10);
}

TEST_CASE("values of all ranks follow each other, and more of them than MPI counts are refused") {
  const perf::Layout layout = perf::layout_of({3, 0, 2});
  CHECK(layout.counts == std::vector<int>{3, 0, 2});
  CHECK(layout.begins == std::vector<int>{0, 3, 3});
  CHECK(layout.sum == 5);
  constexpr std::uint64_t kMost = 0x7fffffff;
  CHECK(perf::layout_of({kMost - 1, 1}).sum == kMost);
  CHECK_THROWS_AS(perf::layout_of({kMost, 1}), std::runtime_error);
  CHECK_THROWS_AS(perf::layout_of({kMost + 1}), std::runtime_error);
}

}  // namespace cab::tests
