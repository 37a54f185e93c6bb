// The indexes of an engine, which its calls of run_queries share: the first call about a frame makes one, and further
// calls search it, on other threads too.
#pragma once

#include "engine/queries/query_index.h"
#include "layout/arena.h"

#include <cab/query.h>

#include <memory>
#include <mutex>
#include <vector>

namespace cab {

// An index and which calls have it.
struct StoredIndex {
  explicit StoredIndex(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  QueryIndex index;          // changed by the call that makes it alone; what it is made for, under the mutex
  std::uint64_t serial = 0;  // differs for every index that was ever made; 0: none has been
  bool is_made = false;      // else it is empty, or a call is making it
  std::uint32_t users = 0;   // calls that search it, or make it
};

// As many indexes as there may be calls at a time, which is one per reader.
struct QueryIndexes {
  std::mutex mutex;
  std::vector<std::unique_ptr<StoredIndex>> all;
  std::uint64_t serial = 0;    // of the index that was begun last
  std::uint64_t of_frame = 0;  // what `gain` counts
  std::size_t gain = 0;        // what halving gains for queries about that frame, in rays; as far as it matters
};

// What a call asks of an index.
struct IndexWanted {
  std::uint64_t of_frame;  // the frame whose bounds the caller states to be those of the inputs, and stored; else 0
  StoredBatches batches;   // of the call, bound
  std::size_t instances;   // how many are given
  Span<const Query> queries;
};

// The index that a call searches, until the call ends. Nothing here waits for another call: where the index that a call
// wants is being made, it searches a worse one of the same frame, or makes one for itself.
class IndexLease {
 public:
  IndexLease(QueryIndexes& indexes, const IndexWanted& wanted);
  ~IndexLease();
  IndexLease(const IndexLease&) = delete;
  IndexLease& operator=(const IndexLease&) = delete;

  // Whether the call has to make the index, arranged as it says, and to call finish() then.
  bool is_to_make() const { return is_to_make_; }
  QueryIndex& index_to_make() { return stored_->index; }
  void finish();

  const QueryIndex& index() const { return stored_->index; }
  std::uint64_t serial() const { return stored_->serial; }

 private:
  QueryIndexes& indexes_;
  StoredIndex* stored_ = nullptr;
  bool is_to_make_ = false;
};

}  // namespace cab
