// Where the characters of ranks are, and which rank tests two of them.
#pragma once

#include "engine/mpi/bounds.h"
#include "engine/mpi/mail.h"

#include <cstdint>
#include <optional>
#include <unordered_set>
#include <vector>

namespace cab::mpi {

// The size of a character: its largest extent in the world, margins included, by powers of four.
std::int32_t size_class(const WorldBounds& bounds);

// A rank with a character of some size class.
struct Owner {
  std::int32_t rank;
  std::int32_t size;
};

// Whether `a` tests its character against that of `b`, which is another rank. The rank with the smaller one does: a
// giant meets many, so its pose travels to them, not theirs to it. Of equal sizes, the lower rank does if the sum of
// both is odd, so that a rank in the middle tests with half of its neighbours.
bool tests(const Owner& a, const Owner& b);

// Characters of one rank, batch and size class, and where they are. It is sent as it lies in memory.
struct Region {
  std::uint32_t batch;    // slot
  std::uint32_t members;  // members_of the batch's input
  std::int32_t size;      // class
  std::uint32_t count;
  WorldBounds bounds;
};

// The format of poses and which spans are given, as bits.
inline constexpr std::uint32_t kHasOrigins = 1, kHasOrientations = 2, kHasLayers = 4, kHasMasks = 8, kHasScales = 16,
                               kHasMargins = 32, kHasPoseScale = 64;
std::uint32_t members_of(const BatchInput& input);
PoseFormat format_of(std::uint32_t members);

// Which batches rules pair, static bodies apart.
class Partners {
 public:
  void add(std::uint32_t a, std::uint32_t b) {
    pairs_.insert(key(a, b));
    pairs_.insert(key(b, a));
  }
  bool has(std::uint32_t a, std::uint32_t b) const { return pairs_.count(key(a, b)) != 0; }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) { return std::uint64_t{a} << 32 | b; }
  std::unordered_set<std::uint64_t> pairs_;
};

// The regions of all ranks.
struct RegionTable {
  std::vector<Region> regions;      // by rank
  std::vector<std::size_t> begins;  // of each rank's, and their end
  std::size_t room = 0;             // how many regions all ranks have room for; the same on every rank
  // What gathering needs, by rank, in bytes.
  std::vector<int> sizes, offsets;

  RegionTable() = default;
  // Throws std::bad_alloc.
  explicit RegionTable(std::int32_t rank_count)
      : begins(static_cast<std::size_t>(rank_count) + 1),
        sizes(static_cast<std::size_t>(rank_count)),
        offsets(static_cast<std::size_t>(rank_count)) {}
  Span<const Region> of(std::int32_t rank) const {
    const auto r = static_cast<std::size_t>(rank);
    return {regions.data() + begins[r], begins[r + 1] - begins[r]};
  }
};

// Gathers the regions of all ranks that know theirs. The answer is the status of the lowest rank that is not kOk; else
// kOutOfMemory, if a rank has no room for the table. Collective.
Answer gather_regions(MPI_Comm comm, Status status, const std::vector<Region>& own, RegionTable& table) noexcept;

// The middle of a region, to which bounds of its characters are relative when they are sent. None of a region
// wider than kMaxCoordinate: there each character's are relative to its own origin, which is sent too.
struct Point {
  double at[3];
};
std::optional<Point> middle_of(const Region& region);

// Whether `to` tests some character of region `there` against one of `from`'s in region `here`.
bool needs(const Partners& partners, std::int32_t to, const Region& there, std::int32_t from, const Region& here);

}  // namespace cab::mpi
