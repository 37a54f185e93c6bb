// From the hits of frames to intervals of contact, and from intervals to pairs of links. Plain data in, plain data out.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace cab::perf {

// A link of a recording: index of the batch, of the instance in it, and of the link.
struct LinkPlace {
  std::uint32_t batch = 0;
  std::uint32_t instance = 0;
  std::uint32_t link = 0;
  auto operator<=>(const LinkPlace&) const = default;
};

// Two links of a recording, in the order of its hits: a pair has one order in all of them.
struct LinkPlaces {
  LinkPlace a;
  LinkPlace b;
  auto operator<=>(const LinkPlaces&) const = default;
};

// A point in the world. NaN if it is not known.
struct WorldPoint {
  double x = std::numeric_limits<double>::quiet_NaN();
  double y = x;
  double z = x;
};

// A hit of two links. The depth is NaN if none is known.
struct LinkHit {
  LinkPlaces links;
  float depth;
  std::uint32_t triangles = 0;  // pairs of triangles of skins that touch
  WorldPoint point = {};
};

// A frame of an interval, and when it was.
struct Moment {
  std::uint32_t frame = 0;
  double seconds = 0;
};

// A maximal run of consecutive frames in which two links are in a hit.
struct Interval {
  std::uint32_t file = 0;
  LinkPlaces links;
  Moment first;
  Moment last;
  Moment worst;  // the first frame of the worst depth; without depths that of most triangles, without those the first
  float worst_depth = 0;              // the largest depth of all frames; NaN if none is known
  std::uint32_t worst_triangles = 0;  // in that frame
  WorldPoint worst_point = {};        // likewise
  std::uint32_t frames() const { return last.frame - first.frame + 1; }
};

// All intervals of two links in one recording.
struct PairTotals {
  std::uint32_t file = 0;
  LinkPlaces links;
  std::uint32_t frames = 0;
  std::uint32_t intervals = 0;
  std::uint32_t longest = 0;          // frames of the longest interval
  Moment worst;                       // of the worst interval
  float worst_depth = 0;              // likewise; NaN if none is known
  std::uint32_t worst_triangles = 0;  // likewise
  WorldPoint worst_point = {};        // likewise
};

// Finds intervals in frames that come one after the other. It keeps the pairs of one frame alone.
class IntervalFinder {
 public:
  // `found` is told each interval when it has ended. Those that end at the same frame come in the order of their links.
  IntervalFinder(std::uint32_t file, std::function<void(const Interval&)> found)
      : file_(file), found_(std::move(found)) {}

  // Frames ascend. A frame that is left out ends every interval. Hits are in any order; of several hits of one pair the
  // worst counts.
  void add_frame(const Moment& moment, std::vector<LinkHit> hits);

  // Ends every interval.
  void finish();

 private:
  std::uint32_t file_;
  std::function<void(const Interval&)> found_;
  std::vector<Interval> open_;  // sorted by links
  std::vector<Interval> next_;  // what becomes of open_ in a frame; kept for its memory
};

// Whether the first stands before the second, worst first: the deeper one, what has no depth last; then the one of more
// triangles; then that of more frames; then by file, links and first frame.
bool is_worse(const Interval& one, const Interval& other);
bool is_worse(const PairTotals& one, const PairTotals& other);

// Adds intervals of one pair after the other, sorted by file and links, to what is known of the pair.
class PairCounter {
 public:
  explicit PairCounter(std::function<void(const PairTotals&)> found) : found_(std::move(found)) {}
  void add(const Interval& interval);
  void finish();

 private:
  std::function<void(const PairTotals&)> found_;
  PairTotals pair_;
  Interval worst_;
};

}  // namespace cab::perf
