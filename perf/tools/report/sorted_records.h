// Sorts more records than memory holds: what is over a limit goes sorted to an unnamed temporary file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <queue>
#include <type_traits>
#include <vector>

namespace cab::perf {

// A file without a name, which is gone when it is closed. A failure throws std::runtime_error.
class TemporaryStore {
 public:
  TemporaryStore() = default;
  ~TemporaryStore();
  TemporaryStore(const TemporaryStore&) = delete;
  TemporaryStore& operator=(const TemporaryStore&) = delete;

  // Writes after what was written before, and returns where that is.
  std::uint64_t append(const void* bytes, std::size_t count);

  // What was written is gone; its place is used again.
  void clear() { size_ = 0; }
  void read(std::uint64_t offset, void* bytes, std::size_t count) const;

 private:
  int file_ = -1;
  std::uint64_t size_ = 0;
};

// Records go in by add and come out of take_all in order. Equal records come out in any order.
template <class Record, class Less>
class SortedRecords {
  static_assert(std::is_trivially_copyable_v<Record>);

 public:
  // `most_in_memory` is how many records are kept before they are sorted and written.
  SortedRecords(std::size_t most_in_memory, Less less) : most_in_memory_(most_in_memory), less_(less) {}

  void add(const Record& record) {
    recent_.push_back(record);
    ++count_;
    if (recent_.size() == most_in_memory_) write_run();
  }

  std::uint64_t count() const { return count_; }

  // Calls `take` with each record in order, and is empty afterwards.
  void take_all(const std::function<void(const Record&)>& take) {
    std::sort(recent_.begin(), recent_.end(), less_);
    std::vector<Run> runs;
    for (const Extent& extent : written_) runs.push_back({extent, {}, 0});
    runs.push_back({{0, 0}, std::move(recent_), 0});
    const auto later = [&](const Run* one, const Run* other) { return less_(other->front(), one->front()); };
    std::priority_queue<Run*, std::vector<Run*>, decltype(later)> queue(later);
    for (Run& run : runs)
      if (refill(run)) queue.push(&run);
    while (!queue.empty()) {
      Run* const run = queue.top();
      queue.pop();
      take(run->front());
      ++run->at;
      if (refill(*run)) queue.push(run);
    }
    recent_.clear();
    written_.clear();
    store_.clear();
    count_ = 0;
  }

 private:
  // Records of the store that are still to be read.
  struct Extent {
    std::uint64_t offset;
    std::uint64_t records;
  };
  struct Run {
    Extent rest;
    std::vector<Record> records;  // those that were read
    std::size_t at;
    const Record& front() const { return records[at]; }
  };

  void write_run() {
    std::sort(recent_.begin(), recent_.end(), less_);
    written_.push_back({store_.append(recent_.data(), recent_.size() * sizeof(Record)), recent_.size()});
    recent_.clear();
  }

  // Whether a run has a front. Reads more of it if need be.
  bool refill(Run& run) const {
    constexpr std::size_t kRecordsPerRead = 1024;
    if (run.at < run.records.size()) return true;
    run.records.resize(static_cast<std::size_t>(std::min<std::uint64_t>(run.rest.records, kRecordsPerRead)));
    run.at = 0;
    const std::size_t bytes = run.records.size() * sizeof(Record);
    if (bytes > 0) store_.read(run.rest.offset, run.records.data(), bytes);
    run.rest.offset += bytes;
    run.rest.records -= run.records.size();
    return !run.records.empty();
  }

  std::size_t most_in_memory_;
  Less less_;
  std::vector<Record> recent_;
  std::vector<Extent> written_;
  TemporaryStore store_;
  std::uint64_t count_ = 0;
};

}  // namespace cab::perf
