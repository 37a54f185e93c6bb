// Compact bounds of leaves: what words stand for, judged exactly, and which leaves of two instances meet.
#include "kernels/leaf_words.h"

#include "perf/judge/oracle/random.h"
#include "perf/judge/oracle/real.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace cab::tests {
namespace {

using oracle::Random;
using oracle::Real;

constexpr std::uint64_t kSeed = 71;

// By how many units a word exceeds its bound at most. Worst measured 1.014.
constexpr double kMostExcess = 1.02;

// Bounds of two leaves that are listed are apart by at most this many of the larger units: what both words exceed, and
// what rounding down adds when they are brought to one unit and moved. Worst measured 3.01.
constexpr Real kMostApart = 3.04L;

// The bounds of up to sixteen leaves of one instance about its origin.
struct Bounds {
  std::uint32_t leaves;
  float lo[kLanes][3], hi[kLanes][3];
};

// Sixteen instances, their bounds as a tile and their words.
struct Tile {
  RigidBlock block = {};
  RigidShape shape;
  kernel::RigidTile tile;
  std::vector<LeafWords> rows = std::vector<LeafWords>(kLanes);

  explicit Tile(const Bounds (&bounds)[kLanes]) {
    std::memset(static_cast<void*>(&tile), 0x7f, sizeof tile);  // bounds of leaves that are not there: 3.4e38
    block.leaves = bounds[0].leaves;
    shape.block = &block;
    tile.shape = &shape;
    tile.block = 0;
    tile.rigid = 0xffff;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (std::size_t c = 0; c < 3; ++c) {
        float &lo = tile.of_block.lo[c][lane], &hi = tile.of_block.hi[c][lane];
        lo = std::numeric_limits<float>::max(), hi = -lo;
        for (std::size_t leaf = 0; leaf < block.leaves; ++leaf) {
          tile.lo[leaf][c][lane] = bounds[lane].lo[leaf][c];
          tile.hi[leaf][c][lane] = bounds[lane].hi[leaf][c];
          lo = std::min(lo, bounds[lane].lo[leaf][c]);
          hi = std::max(hi, bounds[lane].hi[leaf][c]);
        }
      }
  }
  Tile(const Tile&) = delete;
  Tile& operator=(const Tile&) = delete;

  void make(const kernel::KernelTable& kernels) {
    LeafWords* to[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      std::memset(static_cast<void*>(&rows[lane]), 0x5a, sizeof(LeafWords));
      to[lane] = &rows[lane];
    }
    kernels.make_leaf_words(tile, to);
  }
};

double low_word(std::uint32_t dword) { return static_cast<std::int16_t>(dword & 0xffff); }
double high_word(std::uint32_t dword) { return static_cast<std::int16_t>(dword >> 16); }

// What bounds are like: of any size, on multiples of the unit, at powers of two, nothing, or too small for the unit.
enum class Regime { kOrdinary, kWhole, kPowers, kZero, kTiny };
constexpr unsigned kRegimeCount = 5;

Bounds random_bounds(Random& random, Regime regime, std::uint32_t leaves) {
  Bounds out{};
  out.leaves = leaves;
  const double size = regime == Regime::kTiny   ? random.log_uniform(1e-44, 1e-27)
                      : regime == Regime::kZero ? 0
                                                : random.log_uniform(1e-20, 1e18);
  const double away = random.chance(0.5) ? 0 : size * random.log_uniform(1e-2, 10);
  for (std::uint32_t leaf = 0; leaf < leaves; ++leaf)
    for (std::size_t c = 0; c < 3; ++c) {
      const double at = away * random.sign() + size * random.uniform(-1, 1);
      const double half = size * (random.chance(0.1) ? 0 : random.log_uniform(1e-5, 1));
      double lo = at - half, hi = at + half;
      if (regime == Regime::kWhole) {
        lo = random.uniform(-16384, 16384), hi = lo + random.uniform(0, 16384 - lo);
        lo = std::floor(lo), hi = std::floor(hi);
        if (random.chance(0.1)) lo = -16384 + 0x1p-10, hi = 16384 - 0x1p-10;
      }
      if (regime == Regime::kPowers) {
        const double power = std::ldexp(1.0, static_cast<int>(random.index(4)) + 20);
        lo = -power * (random.chance(0.5) ? 1 : 1 - 0x1p-24), hi = power * (random.chance(0.5) ? 1 : 1 - 0x1p-24);
        if (random.chance(0.2)) lo = hi;
      }
      out.lo[leaf][c] = static_cast<float>(lo);
      out.hi[leaf][c] = static_cast<float>(hi);
    }
  return out;
}

}  // namespace

TEST_CASE(
    "words of leaves contain the bounds they are made of, exceed them by hardly more than a unit, and are the "
    "same on every instruction set") {
  const std::uint64_t usual = 300;
  double worst = 0;
  std::size_t outside = 0, checked = 0, far_words = 0, bad_fields = 0, differing = 0;
  for (unsigned regime = 0; regime < kRegimeCount; ++regime) {
    Random random(kSeed + regime);
    for (std::uint64_t round = 0; round < rounds(usual); ++round) {
      const std::uint32_t leaves = 1 + random.index(kLanes);
      Bounds bounds[kLanes];
      for (Bounds& b : bounds) b = random_bounds(random, static_cast<Regime>(regime), leaves);
      Tile tile(bounds);
      std::vector<LeafWords> first;
      for (const kernel::KernelTable* kernels : available_kernels()) {
        tile.make(*kernels);
        if (first.empty()) first = tile.rows;
        differing += std::memcmp(first.data(), tile.rows.data(), kLanes * sizeof(LeafWords)) != 0;
      }
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const LeafWords& row = first[lane];
        LeafWords untouched;
        std::memset(static_cast<void*>(&untouched), 0x5a, sizeof untouched);
        bad_fields += !same_bits(row.origin, untouched.origin);
        bad_fields += row.leaves != (1u << leaves) - 1;
        double most = 0;
        for (std::size_t leaf = 0; leaf < leaves; ++leaf)
          for (std::size_t c = 0; c < 3; ++c)
            most = std::max({most, std::fabs(static_cast<double>(bounds[lane].lo[leaf][c])),
                             std::fabs(static_cast<double>(bounds[lane].hi[leaf][c]))});
        // 2^(exponent + 14) is the least power of two above all bounds, or 2^-95.
        int power = 0;
        std::frexp(most, &power);
        if (most < 0x1p-96) power = -95;
        bad_fields += row.exponent != power - kWordBits;
        const double unit = std::ldexp(1.0, row.exponent);
        const auto check = [&](std::uint32_t dword, double lo, double hi) {
          const double word_lo = low_word(dword) * unit, word_hi = -high_word(dword) * unit;
          outside += !(word_lo <= lo) + !(word_hi >= hi);
          worst = std::max({worst, (lo - word_lo) / unit, (word_hi - hi) / unit});
          far_words += std::fabs(low_word(dword)) > 16385 || std::fabs(high_word(dword)) > 16385;
          ++checked;
        };
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t leaf = 0; leaf < kLanes; ++leaf)
            if (leaf < leaves)
              check(row.side[c][leaf], static_cast<double>(bounds[lane].lo[leaf][c]),
                    static_cast<double>(bounds[lane].hi[leaf][c]));
            else
              bad_fields += row.side[c][leaf] != 0x7fff7fff;
          check(row.all[c], static_cast<double>(tile.tile.of_block.lo[c][lane]),
                static_cast<double>(tile.tile.of_block.hi[c][lane]));
        }
      }
    }
  }
  MESSAGE(checked << " bounds: worst excess " << worst << " units");
  CAPTURE(kSeed);
  CHECK(outside == 0);
  CHECK(far_words == 0);
  CHECK(bad_fields == 0);
  CHECK(differing == 0);
  CHECK(worst <= kMostExcess);
  if (!runs_fewer_rounds()) CHECK(worst > 0.9);
}

namespace {

// An entry's instances: their bounds and words.
struct Placed {
  Bounds bounds;
  LeafWords words;
};

// Entries of two instances each, by what is far from what.
enum class Apart { kTogether, kOrdinary, kFar, kTinyBesideHuge, kJustTouching, kOutOfReach };
constexpr unsigned kApartCount = 6;

// Instances of up to sixteen leaves that reach about `size`. full: some of them have one leaf, which reaches as far as
// words do.
std::vector<Placed> make_instances(Random& random, const std::vector<double>& sizes, bool full) {
  const kernel::KernelTable& kernels = *kernel::find_kernels(Isa::kScalar);
  std::vector<Placed> out;
  for (const double size : sizes) {
    Placed placed{};
    placed.bounds.leaves = 1 + random.index(kLanes);
    for (std::size_t leaf = 0; leaf < placed.bounds.leaves; ++leaf)
      for (std::size_t c = 0; c < 3; ++c) {
        const double at = size * random.uniform(-1, 1), half = size * random.log_uniform(2e-2, 0.5);
        placed.bounds.lo[leaf][c] = static_cast<float>(at - half);
        placed.bounds.hi[leaf][c] = static_cast<float>(at + half);
      }
    if (full && random.chance(0.5)) {
      placed.bounds.leaves = 1;
      const auto most = static_cast<float>(std::ldexp(1 - 0x1p-24, std::ilogb(size)));
      for (std::size_t c = 0; c < 3; ++c) placed.bounds.lo[0][c] = -most, placed.bounds.hi[0][c] = most;
    }
    Bounds of_tile[kLanes];
    for (Bounds& b : of_tile) b = placed.bounds;
    Tile tile(of_tile);
    tile.make(kernels);
    placed.words = tile.rows[random.index(kLanes)];
    out.push_back(placed);
  }
  return out;
}

// The largest gap between the bounds of two leaves along the axes, at most zero if they meet.
Real gap_of(const Placed& a, const Placed& b, std::size_t i, std::size_t j) {
  Real out = -std::numeric_limits<Real>::infinity();
  for (std::size_t c = 0; c < 3; ++c) {
    const Real shift = static_cast<Real>(b.words.origin[c]) - static_cast<Real>(a.words.origin[c]);
    out = std::max({out, static_cast<Real>(b.bounds.lo[j][c]) + shift - static_cast<Real>(a.bounds.hi[i][c]),
                    static_cast<Real>(a.bounds.lo[i][c]) - shift - static_cast<Real>(b.bounds.hi[j][c])});
  }
  return out;
}

// Moves b so that a leaf of each nearly touch along one axis, up to `units` of the larger unit, and overlap along the
// others.
void make_touch(Random& random, double units, const Placed& a, Placed& b) {
  const std::size_t i = random.index(a.bounds.leaves), j = random.index(b.bounds.leaves), along = random.index(3);
  const double unit = std::ldexp(1.0, std::max(a.words.exponent, b.words.exponent));
  for (std::size_t c = 0; c < 3; ++c) {
    const double lo = static_cast<double>(a.bounds.lo[i][c]), hi = static_cast<double>(a.bounds.hi[i][c]);
    const double lo_b = static_cast<double>(b.bounds.lo[j][c]), hi_b = static_cast<double>(b.bounds.hi[j][c]);
    double by = random.uniform(lo, hi) - random.uniform(lo_b, hi_b);
    if (c == along) by = random.chance(0.5) ? hi - lo_b + units * unit : lo - hi_b - units * unit;
    b.words.origin[c] = a.words.origin[c] + by;
  }
}

}  // namespace

TEST_CASE(
    "overlapping_words lists every pair of leaves whose bounds meet, in order, and no pair that is far apart, "
    "the same on every instruction set") {
  const std::uint64_t usual = 150;
  std::size_t needed = 0, listed_count = 0, near_listed = 0, near_left_out = 0, lost = 0, far_listed = 0;
  std::size_t bad_slots = 0, bad_pairs = 0, differing = 0, overrun = 0, entries_checked = 0, tiny_beside_huge = 0;
  Real worst = -1e30L;
  const auto slots = std::make_unique<kernel::PairSlots>();
  for (unsigned apart = 0; apart < kApartCount; ++apart) {
    Random random(kSeed + 10 + apart);
    for (std::uint64_t round = 0; round < rounds(usual); ++round) {
      const std::uint32_t counts[] = {1, 15, 16, 17, 31, 32, 33, 64, 65, kernel::kPairEntries};
      const std::uint32_t count = counts[random.index(10)];
      const double size = random.log_uniform(1e-3, 1e3);
      std::vector<double> sizes_a, sizes_b;
      for (std::uint32_t n = 0; n < count; ++n) {
        const double fall = static_cast<Apart>(apart) == Apart::kTinyBesideHuge
                                ? std::ldexp(1.0, -static_cast<int>(random.index(41)))
                                : random.log_uniform(0.2, 1);
        const bool first = random.chance(0.5);
        sizes_a.push_back(first ? size * fall : size);
        sizes_b.push_back(first ? size : size * fall);
      }
      const bool full = static_cast<Apart>(apart) == Apart::kOutOfReach;
      std::vector<Placed> a = make_instances(random, sizes_a, full), b = make_instances(random, sizes_b, full);
      std::vector<const LeafWords*> rows_a, rows_b;
      std::vector<std::uint32_t> head;
      for (std::uint32_t n = 0; n < count; ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
          const bool together = static_cast<Apart>(apart) == Apart::kTogether;
          const bool far = static_cast<Apart>(apart) == Apart::kFar || random.chance(0.2);
          a[n].words.origin[c] = together ? 0 : random.uniform(-1, 1) * (far ? 1e9 : size);
          b[n].words.origin[c] = a[n].words.origin[c] + (together ? 0 : random.uniform(-1, 1) * size);
        }
        switch (static_cast<Apart>(apart)) {
          case Apart::kTogether:
          case Apart::kOrdinary: break;
          case Apart::kFar:
            if (random.chance(0.3)) b[n].words.origin[random.index(3)] = random.uniform(-1e9, 1e9);
            break;
          case Apart::kTinyBesideHuge:
          case Apart::kJustTouching: make_touch(random, random.uniform(-5, 5), a[n], b[n]); break;
          case Apart::kOutOfReach:
            if (random.chance(0.5)) {
              make_touch(random, random.uniform(-0.1, 0.1), a[n], b[n]);
              break;
            }
            // About as far as words reach, where their sums saturate.
            for (std::size_t c = 0; c < 3; ++c)
              if (random.chance(0.5))
                b[n].words.origin[c] =
                    a[n].words.origin[c] +
                    random.sign() * std::ldexp(random.chance(0.3) ? 32768 : random.uniform(16000, 40000),
                                               std::max(a[n].words.exponent, b[n].words.exponent));
            break;
        }
        rows_a.push_back(&a[n].words);
        rows_b.push_back(&b[n].words);
        head.push_back((kLanes * random.index(8)) << 8 | kLanes * random.index(8));
      }
      const kernel::WordEntries entries = {rows_a.data(), rows_b.data(), head.data(), count,
                                           static_cast<float>(2 * size)};
      CAPTURE(round);

      // The pairs that each instruction set lists: entry, leaf of a, leaf of b.
      struct Listed {
        std::uint32_t entry, a, b;
        bool operator==(const Listed& o) const { return entry == o.entry && a == o.a && b == o.b; }
        bool operator<(const Listed& o) const {
          return std::make_pair(entry, a * 256 + b) < std::make_pair(o.entry, o.a * 256 + o.b);
        }
      };
      std::vector<Listed> first;
      std::vector<std::uint32_t> first_words, first_entries;
      for (const kernel::KernelTable* kernels : available_kernels()) {
        std::memset(static_cast<void*>(slots.get()), 0x5a, sizeof *slots);
        constexpr std::uint32_t kUntouched = 0xcdcdcdcd;
        std::vector<std::uint32_t> to(std::size_t{256} * count + 17, kUntouched);
        std::uint32_t used = kUntouched;
        const std::uint32_t n = kernels->overlapping_words(entries, *slots, to.data(), &used);
        overrun += to.back() != kUntouched;
        REQUIRE(used <= count);
        REQUIRE(n <= 256 * count);
        std::vector<Listed> list;
        std::vector<std::uint32_t> words(to.data(), to.data() + n), of_slot(slots->entry, slots->entry + used);
        for (const std::uint32_t word : words) {
          REQUIRE(kernel::slot_of(word) < used);
          list.push_back({of_slot[kernel::slot_of(word)], kernel::leaf_a_of(word), kernel::leaf_b_of(word)});
        }
        for (std::uint32_t s = 0; s < used; ++s) {
          bad_slots += of_slot[s] >= count || (s > 0 && of_slot[s] <= of_slot[s - 1]);
          REQUIRE(of_slot[s] < count);
          const LeafWords &of_a = *rows_a[of_slot[s]], &of_b = *rows_b[of_slot[s]];
          for (std::size_t c = 0; c < 3; ++c) {
            const double by = of_b.origin[c] - of_a.origin[c];
            bad_slots += slots->exact_shift[s][c] != by || slots->shift[c][s] != static_cast<float>(by);
          }
          // Step 14.5, in double: how far both reach are powers of two.
          const double unsure = static_cast<double>(kRigidUnsureSize) * static_cast<double>(entries.size) +
                                static_cast<double>(kRigidUnsureCenter) *
                                    (std::ldexp(1.0, of_a.exponent + 14) + std::ldexp(1.0, of_b.exponent + 14));
          bad_slots += std::fabs(static_cast<double>(slots->unsure[s]) - unsure) > 0x1p-22 * unsure;
        }
        if (kernels == available_kernels().front()) {
          first = list;
          first_words = words;
          first_entries = of_slot;
        }
        differing += words != first_words || of_slot != first_entries;
      }
      bad_pairs +=
          !std::is_sorted(first.begin(), first.end()) || std::adjacent_find(first.begin(), first.end()) != first.end();
      listed_count += first.size();
      std::size_t seen = 0;
      for (std::uint32_t n = 0; n < count; ++n) {
        ++entries_checked;
        const std::uint32_t at_a = head[n] >> 8, at_b = head[n] & 0xff;
        const Real unit = std::ldexp(Real{1}, std::max(a[n].words.exponent, b[n].words.exponent));
        tiny_beside_huge += std::abs(a[n].words.exponent - b[n].words.exponent) > 15;
        for (std::uint32_t i = 0; i < a[n].bounds.leaves; ++i)
          for (std::uint32_t j = 0; j < b[n].bounds.leaves; ++j) {
            const Real gap = gap_of(a[n], b[n], i, j);
            const bool listed = std::binary_search(first.begin(), first.end(), Listed{n, at_a + i, at_b + j});
            seen += listed;
            needed += gap <= 0;
            lost += gap <= 0 && !listed;
            far_listed += listed && gap > kMostApart * unit;
            if (listed) worst = std::max(worst, gap / unit);
            if (std::fabs(gap) < 4 * unit) ++(listed ? near_listed : near_left_out);
          }
      }
      bad_pairs += seen != first.size();  // a pair that is listed is of leaves that are there
    }
  }
  MESSAGE(entries_checked << " entries: " << needed << " pairs meet, " << listed_count << " are listed, of those near "
                          << near_listed << " and " << near_left_out << " not; the farthest that is listed is apart by "
                          << static_cast<double>(worst) << " units");
  CAPTURE(kSeed);
  CHECK(lost == 0);
  CHECK(far_listed == 0);
  CHECK(bad_pairs == 0);
  CHECK(bad_slots == 0);
  CHECK(differing == 0);
  CHECK(overrun == 0);
  CHECK(needed >= least_count(20000, usual));
  CHECK(near_listed >= least_count(10000, usual));
  CHECK(near_left_out >= least_count(1000, usual));
  CHECK(tiny_beside_huge >= least_count(1000, usual));
}

}  // namespace cab::tests
