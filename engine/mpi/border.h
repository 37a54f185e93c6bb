// Pairs of this rank's characters with those of other ranks: who is told of whom, and the frame that tests them.
#pragma once

#include "engine/mpi/local_frame.h"
#include "engine/mpi/own_part.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cab::mpi {

// Another rank's character, as far as this rank has been told of it.
struct Ghost {
  Owner owner;
  std::uint32_t batch;    // slot
  const Region* region;   // of its rank
  RelativeBounds bounds;  // relative to the region's middle
  std::uint32_t layers, layer_mask;
  std::uint32_t number = 0;  // in the whole batch, once its pose is here
  bool wanted = false;       // whether it is in a pair that this rank tests
};

class Border {
 public:
  Border(DistributedEngine& engine, const DistributedJob& job, const OwnPart& own, const RegionTable& table,
         Traffic& traffic);

  // The steps of a frame, in this order. What can be done while messages travel goes between them.
  void send_bounds();
  void receive_bounds();
  Status find_pairs();
  void send_requests();
  void answer_requests();
  void receive_poses();
  // Tests the pairs. `out` receives the hits of this rank's characters with others', FrameStats what was tested.
  Status test(LocalHits& out, FrameStats& stats);
  // Waits until all messages are sent.
  void end() { mail_.wait_for_sent(); }
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
  std::vector<std::vector<Sent>> sent_;    // by rank
  std::vector<Ghost> ghosts_;              // by rank, as they came
  std::vector<std::size_t> ghost_begins_;  // of each rank, and their end
  std::vector<GhostGroup> groups_;
  std::vector<std::vector<std::uint32_t>> near_own_;    // by slot - 1: who may meet a ghost; then who does
  std::vector<std::vector<std::uint32_t>> near_ghost_;  // by slot - 1: ghosts
  std::vector<Bytes> poses_;                            // by rank
  bool has_twice_ = false;
};

}  // namespace cab::mpi
