// Pairs of this rank's characters with those of other ranks: who is told of whom, and the frame that tests them.
#pragma once

#include "engine/mpi/local_frame.h"
#include "engine/mpi/mail.h"
#include "engine/mpi/out_of_memory.h"
#include "engine/mpi/own_part.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cab::mpi {

// Another rank's character, as far as this rank has been told of it.
struct Ghost {
  Owner owner;
  std::uint32_t batch;   // slot
  const Region* region;  // of its rank
  Point about;           // what its bounds are relative to
  RelativeBounds bounds;
  std::uint32_t layers, layer_mask;
  std::uint32_t number = 0;  // in the whole batch, once its pose is here
  bool wanted = false;       // whether it is in a pair that this rank tests
};

class Border {
 public:
  // The table of regions, engine.near, may be filled later. Throws std::bad_alloc.
  Border(DistributedEngine& engine, const DistributedJob& job, const OwnPart& own, Traffic& traffic);

  // The steps of a frame, in this order. What can be done while messages travel goes between them. A step that fails
  // sends empty messages and takes all that others send, and so do the steps after it.
  void send_bounds() noexcept;
  void receive_bounds() noexcept;
  void find_pairs() noexcept;
  void send_requests() noexcept;
  void answer_requests() noexcept;
  void receive_poses() noexcept;
  // Tests the pairs. `out` receives the hits of this rank's characters with others', FrameStats what was tested.
  void test(LocalHits& out, FrameStats& stats) noexcept;
  // Waits until all messages are sent.
  void end() noexcept { mail_.wait_for_sent(); }
  // Of the first step that failed.
  Status status() const { return status_; }
  // Whether some instance is on two ranks.
  bool has_twice() const { return has_twice_; }

 private:
  // A character whose bounds were sent.
  struct Sent {
    std::uint32_t batch, index;
  };
  // A character of the border frame: this rank's if there is no ghost.
  struct Entry {
    std::uint32_t number;
    std::uint32_t index;  // of this rank's input
    const Ghost* ghost;
    Owner owner;
  };
  // What the ghosts of one message have in common.
  struct GhostGroup {
    const Region* region;
    std::int32_t rank;
    WorldBounds bounds;  // of them all
  };

  // What this rank and another have sent each other.
  struct Exchange {
    std::vector<Sent> sent;  // whose bounds the other one got
    bool heard = false;      // of bounds: the other one waits for a request
    bool asked = false;      // for poses
    Bytes poses;
  };

  // Calls `work` unless a step has failed. Whether it did not fail.
  template <class Work>
  bool attempt(Work&& work) noexcept {
    if (status_ == Status::kOk) status_ = or_out_of_memory(work);
    return status_ == Status::kOk;
  }
  // Takes a message, and fails if there is no memory for it. Whether it has bytes.
  bool receive(int from, MessageKind kind, Bytes& out) noexcept;
  Exchange& with(std::int32_t rank) { return exchanges_[static_cast<std::size_t>(rank)]; }
  void compose_bounds(std::int32_t to);
  void read_bounds(std::int32_t from, const Bytes& message);
  Status choose_pairs();
  Status test_pairs(LocalHits& out, FrameStats& stats);
  bool sends_to(std::int32_t to, std::int32_t from) const;
  void choose_own();
  std::uint32_t members_of_batch(std::uint32_t batch) const;
  Owner owner_of(std::uint32_t batch, std::size_t index) const;
  std::vector<PairRule> rules() const;
  void keep_pairs(const std::vector<std::vector<Entry>>& entries, LocalHits& out) const;

  DistributedEngine& engine_;
  const DistributedJob& job_;
  const OwnPart& own_;
  const RegionTable& table_;
  Traffic& traffic_;
  Mail mail_;
  Status status_ = Status::kOk;
  std::vector<Exchange> exchanges_;        // by rank
  std::vector<Ghost> ghosts_;              // by rank, as they came
  std::vector<std::size_t> ghost_begins_;  // of each rank, and their end
  std::vector<GhostGroup> groups_;
  std::vector<std::vector<std::uint32_t>> near_own_;    // by slot - 1: who may meet a ghost; then who does
  std::vector<std::vector<std::uint32_t>> near_ghost_;  // by slot - 1: ghosts
  bool is_complete_ = true;                             // whether all poses are here that were asked for
  bool has_twice_ = false;
};

}  // namespace cab::mpi
