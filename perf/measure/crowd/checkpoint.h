// How far a run of several ranks has come: a small file beside the hits of all ranks, from which it goes on.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cab::perf {

// What a rank has found and sent in all frames so far.
struct RankTotals {
  std::uint64_t hits = 0;
  std::uint64_t hits_sum = 0;                     // of perf/base/hit_sum.h
  std::array<std::uint64_t, 4> messages = {};     // regions, bounds, requests, poses
  std::array<std::uint64_t, 4> bytes = {};        // likewise
  std::uint64_t bounds_sent = 0, poses_sent = 0;  // characters
};

struct Checkpoint {
  std::string program;       // of a run: the version of cab and all that decides hits
  std::uint32_t frames = 0;  // that all ranks have on disk
  std::vector<RankTotals> ranks;
};

// The checkpoint in a file, or nothing if there is no file. Throws std::runtime_error with the path for a file that is
// unreadable or none.
std::optional<Checkpoint> read_checkpoint(const std::string& path);

// Replaces the file. Throws as replace_file.
void write_checkpoint(const std::string& path, const Checkpoint& checkpoint);

}  // namespace cab::perf
