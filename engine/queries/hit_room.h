// Where the hits of one query go: the first ones in the order of QueryHit, as many as are wanted.
#pragma once

#include <cab/query.h>

#include <algorithm>
#include <limits>
#include <tuple>

namespace cab {

// The order of the hits of one query.
inline bool precedes(const QueryHit& x, const QueryHit& y) {
  return std::make_tuple(x.distance, x.batch.value, x.instance, x.link) <
         std::make_tuple(y.distance, y.batch.value, y.instance, y.link);
}

class HitRoom {
 public:
  // room: where hits are stored. wanted: how many at most.
  HitRoom(Span<QueryHit> room, std::size_t wanted) : room_(room), wanted_(wanted) {}

  void add(const QueryHit& hit) {
    ++found_;
    if (stored_ < std::min(room_.size, wanted_)) {
      room_[stored_++] = hit;
      if (stored_ == wanted_) std::make_heap(room_.data, room_.data + stored_, precedes);
    } else if (stored_ == wanted_ && wanted_ > 0 && precedes(hit, room_[0])) {
      std::pop_heap(room_.data, room_.data + stored_, precedes);
      room_[stored_ - 1] = hit;
      std::push_heap(room_.data, room_.data + stored_, precedes);
    }
  }

  // No hit that is farther is wanted any more.
  float most() const {
    return stored_ == wanted_ && wanted_ > 0 ? room_[0].distance : std::numeric_limits<float>::infinity();
  }

  bool has_found() const { return found_ > 0; }

  // How many hits the query has, and whether all of them are stored.
  std::size_t count() const { return std::min(found_, wanted_); }
  bool is_complete() const { return stored_ == count(); }

  void sort() { std::sort(room_.data, room_.data + stored_, precedes); }

 private:
  Span<QueryHit> room_;
  std::size_t wanted_, found_ = 0, stored_ = 0;
};

}  // namespace cab
