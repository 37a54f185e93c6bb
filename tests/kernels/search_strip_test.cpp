// Which rows of two strips meet, judged by a plain loop over all pairs, and the sides of rows, judged in long double.
#include "layout/error_bounds.h"

#include "kernels/search_strip.h"

#include "perf/judge/oracle/random.h"
#include "perf/judge/oracle/real.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace cab::tests {
namespace {

using kernel::StripSearch;
using oracle::Random;
using oracle::Real;

constexpr std::uint64_t kSeed = 61;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// What rows are like. kCancel: those of the next strip begin at zero, and reach as far as those of the first begin.
enum class Regime { kSpread, kDuplicates, kInfinite, kAllMeet, kCancel };
constexpr Regime kRegimes[] = {Regime::kSpread, Regime::kDuplicates, Regime::kInfinite, Regime::kAllMeet,
                               Regime::kCancel};

using Row = std::array<float, 6>;

// The rows of a strip, whose lower sides along the first axis do not fall.
std::vector<Row> random_rows(Random& random, Regime regime, bool is_next, std::uint32_t count) {
  std::vector<Row> rows(count);
  const double dense = random.log_uniform(0.05, 1);  // how long rows are
  const bool infinite = regime == Regime::kInfinite && random.chance(0.7);
  for (Row& row : rows) {
    for (std::size_t c = 0; c < 3; ++c) {
      float &lo = row[c], &hi = row[3 + c];
      const double at = random.uniform(0, 10);
      lo = static_cast<float>(at);
      hi = static_cast<float>(at + dense * random.uniform(0, c == 0 ? 3 : 10));
      if (regime == Regime::kDuplicates) {
        lo = static_cast<float>(random.index(4));
        hi = lo + static_cast<float>(random.index(2));
      }
      if (regime == Regime::kAllMeet) lo = static_cast<float>(-at), hi = static_cast<float>(1 + at);
      if (regime == Regime::kCancel) {
        const auto near_one = static_cast<float>(1 + 0x1p-23 * (random.index(5) - 2.0));
        lo = is_next ? static_cast<float>(random.sign() * random.log_uniform(1e-40, 1e-6)) : near_one;
        hi = is_next ? near_one : 2;
      }
      if (infinite && random.chance(0.2)) {
        const float ends[] = {kInfinity, 3.4e38f};
        const float end = ends[random.index(2)];
        const std::uint32_t kind = random.index(4);
        if (kind != 1) lo = kind == 3 ? end : -end;
        if (kind != 0) hi = kind == 2 ? -end : end;
      }
    }
    if (random.chance(0.03))
      for (std::size_t s = 0; s < 6; ++s) row[s] = s < 3 ? kernel::kNowhere : -kernel::kNowhere;
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a[0] < b[0]; });
  return rows;
}

// The least float that is not below the extent of any row along the first axis, and not below 0.
float reach_of(const std::vector<Row>& rows) {
  float out = 0;
  for (const Row& row : rows) {
    // The sum and its rest are the exact difference.
    const double lo = static_cast<double>(row[0]), hi = static_cast<double>(row[3]), sum = hi - lo, part = sum - hi;
    const double rest = (hi - (sum - part)) - (lo + part);
    if (!(sum > 0)) continue;
    auto extent = static_cast<float>(sum);
    const double as_double = static_cast<double>(extent);
    if (as_double < sum || (as_double <= sum && rest > 0)) extent = std::nextafter(extent, kInfinity);
    out = std::max(out, extent);
  }
  return out;
}

// Two strips in the arrays of sides: rows `own` to own_end - 1 and `next` to next_end - 1. Before, between and behind
// them is what may be anything.
struct Strips {
  std::uint32_t own, own_end, next, next_end;
  std::vector<float> side[6];
  kernel::CrowdSides sides;

  Strips(Random& random, const std::vector<Row>& first, const std::vector<Row>& second) {
    const auto count = [](const std::vector<Row>& rows) { return static_cast<std::uint32_t>(rows.size()); };
    own = random.index(20);
    own_end = own + count(first);
    next = own_end + (random.chance(0.5) ? 0 : random.index(40));
    next_end = next + count(second);
    const std::uint32_t kind = random.index(6);
    for (std::uint32_t row = 0; row < next_end + kLanes; ++row)
      for (std::size_t s = 0; s < 6; ++s) {
        const bool low = s < 3;
        const float around[] = {-kInfinity, kInfinity, kNan, low ? kernel::kNowhere : -kernel::kNowhere,
                                low ? -kernel::kNowhere : kernel::kNowhere};
        side[s].push_back(around[kind < 5 ? kind : random.index(5)]);
      }
    for (std::size_t s = 0; s < 6; ++s) {
      for (std::uint32_t i = 0; i < count(first); ++i) side[s][own + i] = first[i][s];
      for (std::uint32_t i = 0; i < count(second); ++i) side[s][next + i] = second[i][s];
      sides.side[s] = side[s].data();
    }
  }
  Strips(const Strips&) = delete;
  Strips& operator=(const Strips&) = delete;

  bool meet(std::uint32_t a, std::uint32_t b) const {
    bool out = true;
    for (std::size_t c = 0; c < 3; ++c) out = out && side[c][b] <= side[3 + c][a] && side[c][a] <= side[3 + c][b];
    return out;
  }
  // The first row from `begin` to end - 1 that one of the others meets, or `end`.
  std::uint32_t first_met(std::uint32_t others, std::uint32_t others_end, std::uint32_t begin,
                          std::uint32_t end) const {
    for (; begin < end; ++begin)
      for (std::uint32_t other = others; other < others_end; ++other)
        if (meet(other, begin)) return begin;
    return end;
  }
};

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

// The pairs that a search finds, pausing at `most`. Some are left where they are at a pause, as if they waited there.
Pairs found_by(const kernel::KernelTable& kernels, StripSearch job, std::uint32_t most, std::size_t& pauses) {
  constexpr std::uint32_t kUntouched = 0xabababab;
  const std::uint32_t step = kernels.isa == Isa::kScalar ? 1 : kLanes;  // rows compared at a time, or more
  const std::size_t room = most + std::size_t{2} * kLanes;
  std::vector<std::uint32_t> a(room + 1, kUntouched), b(room + 1, kUntouched);
  job.most = most;
  job.count = 0;
  job.found_a = a.data();
  job.found_b = b.data();
  Pairs out;
  for (std::uint32_t before = 0, calls = 1;; ++calls) {
    const bool done = kernels.search_strip(job);
    const bool fits = job.count >= before && job.count < most + step && a[room] == kUntouched && b[room] == kUntouched;
    REQUIRE(fits);
    for (std::uint32_t i = before; i < job.count; ++i) out.emplace_back(a[i], b[i]);
    if (done) break;
    REQUIRE(job.count >= most);  // else there was room to go on
    ++pauses;
    before = job.count = calls % most;
  }
  const std::uint32_t count = job.count;
  const bool stays_done = job.at >= job.end && kernels.search_strip(job) && job.count == count;
  CHECK(stays_done);
  return out;
}

constexpr std::uint32_t kNeverPauses = 20000;
constexpr std::uint32_t kMosts[] = {kNeverPauses, 1, 3, 16, 128};

}  // namespace

TEST_CASE(
    "search_strip finds exactly the pairs of rows that meet, in order, with and without pauses, the same on every "
    "instruction set") {
  // What is searched: both strips, one of them, or for one row any strip.
  enum class Searched { kBoth, kOwn, kNext, kAnyForOne };
  const std::uint64_t usual = 400;
  std::size_t found_own = 0, found_next = 0, pauses = 0, skipped = 0, at_reach = 0, began_later = 0, empty = 0;
  for (const Regime regime : kRegimes) {
    Random random(kSeed + static_cast<std::uint64_t>(regime));
    for (std::uint64_t round = 0; round < rounds(usual); ++round) {
      const auto count = [&] { return random.chance(0.2) ? random.index(4) : random.index(101); };
      const std::vector<Row> first = random_rows(random, regime, false, count());
      const std::vector<Row> second = random_rows(random, regime, true, count());
      const Strips strips(random, first, second);
      const auto searched = static_cast<Searched>(random.index(4));
      empty += first.empty() || second.empty();

      StripSearch job = {};
      job.sides = strips.sides;
      const auto rows = static_cast<std::uint32_t>(first.size());
      const bool whole = random.chance(0.4);
      job.at = strips.own + (whole ? 0 : random.index(rows + 1));
      job.end = whole ? strips.own_end : job.at + random.index(strips.own_end - job.at + 1);
      if (searched == Searched::kAnyForOne) job.end = std::min(job.at + 1, strips.own_end);
      job.first = job.at + 1;
      job.second = StripSearch::kFromNext;
      job.own_end = searched == Searched::kNext ? random.index(job.first + 1) : strips.own_end;
      job.reach = reach_of(second) * (random.chance(0.5) ? 1.0f : 1.5f);
      if (searched == Searched::kBoth || searched == Searched::kNext) {
        const std::uint32_t last = strips.first_met(job.at, job.end, strips.next, strips.next_end);
        const std::uint32_t later = random.chance(0.3) ? last - strips.next : random.index(last - strips.next + 1);
        job.next = strips.next + (random.chance(0.5) ? 0 : later);
        job.next_end = strips.next_end;
        began_later += job.next > strips.next;
      } else {
        job.next = job.next_end = random.chance(0.5) ? 0 : strips.next_end;
      }
      if (searched == Searched::kAnyForOne) {
        const std::uint32_t last = strips.first_met(job.at, job.end, strips.next, strips.next_end);
        job.first = strips.next + random.index(last - strips.next + 1);
        job.own_end = strips.next_end;
      }

      Pairs expected;
      for (std::uint32_t at = job.at; at < job.end; ++at) {
        if (searched != Searched::kNext) {
          const bool any = searched == Searched::kAnyForOne;
          for (std::uint32_t row = any ? strips.next : at + 1; row < job.own_end; ++row)
            if (strips.meet(at, row)) expected.emplace_back(at, row), ++found_own;
        }
        if (searched == Searched::kOwn || searched == Searched::kAnyForOne) continue;
        const float from = strips.side[0][at] - job.reach;
        for (std::uint32_t row = strips.next; row < strips.next_end; ++row) {
          skipped += strips.side[0][row] < from && strips.next_end > job.next;
          if (!strips.meet(at, row)) continue;
          expected.emplace_back(at, row);
          ++found_next;
          at_reach += strips.side[0][row] <= from;
        }
      }
      CAPTURE(kSeed);
      CAPTURE(static_cast<int>(regime));
      CAPTURE(static_cast<int>(searched));
      CAPTURE(round);
      for (const kernel::KernelTable* kernels : available_kernels())
        for (const std::uint32_t most : kMosts) {
          CAPTURE(name_of(*kernels));
          CAPTURE(most);
          const bool right = found_by(*kernels, job, most, pauses) == expected;
          CHECK(right);
        }
    }
  }
  MESSAGE("pairs of one strip: " << found_own << ", of two: " << found_next << ", of those just in reach: " << at_reach
                                 << "; pauses: " << pauses << ", rows skipped: " << skipped);
  CHECK(found_own >= least_count(100000, usual));
  CHECK(found_next >= least_count(100000, usual));
  CHECK(pauses >= least_count(100000, usual));
  CHECK(skipped >= least_count(100000, usual));
  CHECK(at_reach >= least_count(1000, usual));
  CHECK(began_later >= least_count(100, usual));
  CHECK(empty >= least_count(100, usual));
}

TEST_CASE("search_strip finds all pairs of strips of one lower side, of any length, and stops behind runs of it") {
  Random random(kSeed + 10);
  std::size_t pauses = 0;
  for (std::uint32_t count = 0; count <= 100; ++count) {
    // Points, so that only equal rows meet: one run of them with others around it, which may be none.
    const auto points = [&](std::uint32_t rows) {
      std::vector<Row> out(rows);
      const std::uint32_t begin = random.index(rows + 1) / 2, end = rows - random.index(rows + 1) / 2;
      for (std::uint32_t row = 0; row < rows; ++row) out[row].fill(row < begin ? 0.0f : row < end ? 1.0f : 2.0f);
      return out;
    };
    const Strips strips(random, points(count), points(100 - count));
    StripSearch job = {};
    job.sides = strips.sides;
    job.at = strips.own;
    job.end = job.own_end = strips.own_end;
    job.first = job.at + 1;
    job.second = StripSearch::kFromNext;
    job.next = strips.next;
    job.next_end = strips.next_end;
    Pairs expected;
    for (std::uint32_t at = job.at; at < job.end; ++at) {
      for (std::uint32_t row = at + 1; row < strips.own_end; ++row)
        if (strips.side[0][row] <= strips.side[0][at]) expected.emplace_back(at, row);
      for (std::uint32_t row = strips.next; row < strips.next_end; ++row)
        if (!(strips.side[0][row] < strips.side[0][at]) && !(strips.side[0][row] > strips.side[0][at]))
          expected.emplace_back(at, row);
    }
    CAPTURE(count);
    for (const kernel::KernelTable* kernels : available_kernels())
      for (const std::uint32_t most : kMosts) {
        CAPTURE(name_of(*kernels));
        CAPTURE(most);
        const bool right = found_by(*kernels, job, most, pauses) == expected;
        CHECK(right);
      }
  }
  CHECK(pauses > 10000);
}

namespace {

// Sides exceed what they contain by at most this many u of it, besides what kSideOwn and kSideTiny add: 3 u that are
// added, and two roundings. Worst measured 5.00.
constexpr Real kMostExcess = 5.01L;

// What a tile of sixteen instances becomes.
struct Placed {
  alignas(64) float side[6][kLanes];
};

// Where origins are: about as far as bounds, far away, where they cancel one of the bounds, and where they cancel both,
// each exactly.
enum class Where { kNear, kFar, kCancelsOne, kCancelsBoth };

// Fills a lane of bounds and of moved origins along one axis.
void fill_lane(Random& random, std::size_t c, std::size_t lane, AabbTile& all, kernel::PlaceTile& tile) {
  const double size = random.chance(0.1) ? random.log_uniform(1e-44, 1e-36) : random.log_uniform(1e-6, 1e6);
  const double at = random.chance(0.1) ? 0 : size * random.uniform(-1, 1);
  const double half = random.chance(0.1) ? 0 : size * random.log_uniform(1e-6, 1);
  const float lo = static_cast<float>(at - half), hi = static_cast<float>(at + half);
  all.lo[c][lane] = lo;
  all.hi[c][lane] = hi;
  double origin = 0;
  double &from_lo = tile.from_lo[c][lane], &from_hi = tile.from_hi[c][lane];
  switch (static_cast<Where>(random.index(4))) {
    case Where::kNear: origin = random.chance(0.1) ? 0 : size * random.uniform(-2, 2); break;
    case Where::kFar: origin = random.sign() * random.log_uniform(1, 1e22); break;
    case Where::kCancelsOne: origin = -static_cast<double>(random.chance(0.5) ? lo : hi); break;
    case Where::kCancelsBoth:
      from_lo = -static_cast<double>(lo) * (1 + 0x1p-52 * (random.index(9) - 4.0));
      from_hi = -static_cast<double>(hi) * (1 + 0x1p-52 * (random.index(9) - 4.0));
      return;
  }
  from_lo = origin - kWorldPad * std::fabs(origin);
  from_hi = origin + kWorldPad * std::fabs(origin);
}

}  // namespace

TEST_CASE(
    "place_tile's sides contain bounds about moved origins, exceed them by a few roundings, leave out lanes that take "
    "no part, and enter the survey, the same on every instruction set") {
  const std::uint64_t usual = 2000;
  std::size_t checked = 0, cancelled = 0, outside = 0, bad_nowhere = 0, bad_survey = 0, differing = 0;
  Real worst = 0;
  Random random(kSeed + 20);
  const std::vector<const kernel::KernelTable*> tables = available_kernels();
  for (std::uint64_t round = 0; round < rounds(usual); ++round) {
    kernel::CrowdSurvey cleared;
    for (std::size_t c = 0; c < 3; ++c) {
      std::fill_n(cleared.low[c], kLanes, kernel::kNowhere);
      std::fill_n(cleared.high[c], kLanes, -kernel::kNowhere);
      std::fill_n(cleared.wide[c], kLanes, 0.0f);
      std::fill_n(cleared.narrow[c], kLanes, kernel::kNowhere);
    }
    kernel::CrowdSurvey expected = cleared;
    std::vector<kernel::CrowdSurvey> surveys(tables.size(), cleared);
    const std::uint32_t tiles = 1 + random.index(4);
    for (std::uint32_t t = 0; t < tiles; ++t) {
      AabbTile all;
      kernel::PlaceTile tile;
      tile.all = &all;
      tile.there = random.chance(0.2) ? 0xffff : random.index(0x10000);
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          fill_lane(random, c, lane, all, tile);
          if (tile.there >> lane & 1 || random.chance(0.5)) continue;
          const float any[] = {kInfinity, -kInfinity, kNan, 0, -3.4e38f, 3.4e38f};
          all.lo[c][lane] = any[random.index(6)];
          all.hi[c][lane] = any[random.index(6)];
          tile.from_lo[c][lane] = static_cast<double>(any[random.index(6)]);
          tile.from_hi[c][lane] = static_cast<double>(any[random.index(6)]);
        }
      Placed first;
      for (std::size_t k = 0; k < tables.size(); ++k) {
        Placed placed;
        std::memset(static_cast<void*>(&placed), 0x5a, sizeof placed);
        for (std::size_t s = 0; s < 6; ++s) tile.to[s] = placed.side[s];
        tables[k]->place_tile(tile, surveys[k]);
        if (k == 0) first = placed;
        differing += !same_bits(first, placed) + !same_bits(surveys[0], surveys[k]);
      }
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          const float lo = first.side[c][lane], hi = first.side[3 + c][lane];
          if (!(tile.there >> lane & 1)) {
            bad_nowhere += !same_bits(lo, kernel::kNowhere) + !same_bits(hi, -kernel::kNowhere);
            continue;
          }
          // Moved origins, which contain the origin.
          const auto check = [&](double from, float bound, Real beyond) {
            const Real exact = static_cast<Real>(from) + static_cast<Real>(bound);
            const Real own = std::fabs(static_cast<Real>(bound)), pad = 0x1p-50L * own + 0x1p-120L;
            const Real excess = beyond * (static_cast<Real>(beyond > 0 ? hi : lo) - exact);
            outside += !(excess >= 0);
            const Real more = excess - pad * (1 + 0x1p-20L);
            if (std::fabs(exact) > 0) worst = std::max(worst, more / (0x1p-24L * std::fabs(exact)));
            outside += std::fabs(exact) <= 0 && more > 0;
            cancelled += std::fabs(exact) < 0x1p-40L * own;
            ++checked;
          };
          check(tile.from_lo[c][lane], all.lo[c][lane], -1);
          check(tile.from_hi[c][lane], all.hi[c][lane], 1);
          expected.low[c][lane] = std::min(expected.low[c][lane], lo);
          expected.high[c][lane] = std::max(expected.high[c][lane], lo);
          expected.wide[c][lane] = std::max(expected.wide[c][lane], hi - lo);
          expected.narrow[c][lane] = std::min(expected.narrow[c][lane], hi - lo);
        }
    }
    bad_survey += !same_bits(expected, surveys[0]);
  }
  MESSAGE(checked << " sides, " << cancelled << " where bound and origin cancel: worst excess "
                  << static_cast<double>(worst) << " u");
  CAPTURE(kSeed);
  CHECK(outside == 0);
  CHECK(bad_nowhere == 0);
  CHECK(bad_survey == 0);
  CHECK(differing == 0);
  CHECK(worst <= kMostExcess);
  CHECK(worst >= 3);
  CHECK(cancelled >= least_count(10000, usual));
}

TEST_CASE("place_tile's survey tells of an origin beyond all floats, whatever tiles come after it") {
  for (const kernel::KernelTable* kernels : available_kernels())
    for (const double far : {1e39, -1e39, 1e300, -1e300}) {
      CAPTURE(name_of(*kernels));
      CAPTURE(far);
      kernel::CrowdSurvey survey = {};
      Placed placed;
      AabbTile all;
      kernel::PlaceTile tile;
      tile.all = &all;
      tile.there = 0xffff;
      for (std::size_t s = 0; s < 6; ++s) tile.to[s] = placed.side[s];
      for (std::size_t c = 0; c < 3; ++c) std::fill_n(all.lo[c], kLanes, -1.0f), std::fill_n(all.hi[c], kLanes, 1.0f);
      for (int t = 0; t < 3; ++t) {
        for (std::size_t c = 0; c < 3; ++c)
          for (std::size_t lane = 0; lane < kLanes; ++lane)
            tile.from_lo[c][lane] = tile.from_hi[c][lane] = t == 1 && c == lane ? far : 0;
        kernels->place_tile(tile, survey);
      }
      for (std::size_t c = 0; c < 3; ++c) {
        CHECK((far > 0 ? survey.high[c][c] : -survey.low[c][c]) == kernel::kMostSide);
        CHECK(survey.high[c][c + 1] < 2);
      }
    }
}

}  // namespace cab::tests
