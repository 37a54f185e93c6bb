// A frame of one engine whose hits grow until they fit.
#pragma once

#include <cab/cab.h>

#include <vector>

namespace cab::mpi {

struct LocalHits {
  std::vector<Hit> hits;
  std::vector<Contact> contacts;  // as many, or none
};

// Runs `job` with room for its hits, and for contacts if asked for.
Status run_local(Engine& engine, FrameJob& job, bool contacts, LocalHits& out);

// Merges two lists in the order of run_frame into the first one.
void merge_hits(LocalHits& into, const LocalHits& other);

}  // namespace cab::mpi
