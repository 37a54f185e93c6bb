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

class HitBuffer {
 public:
  // storage: where hits are stored. wanted: how many at most. after: if it is not null, only hits that come after it.
  HitBuffer(Span<QueryHit> storage, std::size_t wanted, const QueryHit* after = nullptr)
      : storage_(storage), wanted_(wanted), after_(after) {}

  void add(const QueryHit& hit) {
    if (after_ && !precedes(*after_, hit)) return;
    ++found_;
    if (stored_ < std::min(storage_.size, wanted_)) {
      is_sorted_ = is_sorted_ && (stored_ == 0 || precedes(storage_[stored_ - 1], hit));
      storage_[stored_++] = hit;
      if (!is_sorted_ && stored_ == wanted_) std::make_heap(storage_.data, storage_.data + stored_, precedes);
    } else if (is_full() && precedes(hit, last())) {
      if (is_sorted_) std::make_heap(storage_.data, storage_.data + stored_, precedes);
      is_sorted_ = false;
      std::pop_heap(storage_.data, storage_.data + stored_, precedes);
      storage_[stored_ - 1] = hit;
      std::push_heap(storage_.data, storage_.data + stored_, precedes);
    }
  }

  // No hit that is farther is wanted any more.
  float most() const { return is_full() ? last().distance : std::numeric_limits<float>::infinity(); }

  // Whether no hit is wanted that comes after all others.
  bool has_all_wanted() const { return found_ >= wanted_; }

  // How many hits the query has, and whether all of them are stored.
  std::size_t count() const { return std::min(found_, wanted_); }
  bool is_complete() const { return stored_ == count(); }

  void sort() {
    if (!is_sorted_) std::sort(storage_.data, storage_.data + stored_, precedes);
    is_sorted_ = true;
  }

 private:
  bool is_full() const { return stored_ == wanted_ && wanted_ > 0; }

  // Of the hits of a buffer that is full, which are sorted or a heap.
  const QueryHit& last() const { return storage_[is_sorted_ ? stored_ - 1 : 0]; }

  Span<QueryHit> storage_;
  std::size_t wanted_;
  const QueryHit* after_;
  std::size_t found_ = 0, stored_ = 0;
  bool is_sorted_ = true;
};

}  // namespace cab
