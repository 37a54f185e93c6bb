// Gates: conditions that the methods of one table must meet, compared with each other and with the paper.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/measure/paper/tables.h"

namespace cab::perf {

// A row of our tables: a set of policies, and the paper's row that it stands beside.
struct Method {
  const char* name;
  std::optional<PaperMethod> paper;  // empty: the paper has no such row
  Policies policies;
  bool on_demand = false;  // partial_update.h instead of the engine; policies are those of the boxes it equals
  bool on_meshes = false;  // exact queries by mesh_query.h instead of the engine
  bool all_pairs = false;  // run_all_pairs instead of run_frame: there are no boxes, and of the policies `exact` counts
};

// What a method found by one exact test, and what the test cost.
struct ExactRun {
  std::uint64_t hits = 0;           // between two characters
  std::uint64_t hits_hash = 0;      // FNV-1a of every hit's frame, characters and links, in order
  std::uint64_t contact_count = 0;  // hits with a normal and a depth
  double seconds_query = 0;         // of exact tests, with normal and depth of every hit
  double seconds_contact = 0;       // of normal and depth alone
};

// What one method counted over one scene.
struct MethodRun {
  Method method;
  // Counts and seconds as the tables print them, but for exact tests; total is by the clock, of the first run by FCL.
  FrameStats stats;
  ExactRun fcl;
  std::optional<ExactRun> convex;   // by the kernels; empty on meshes
  std::uint64_t box_hits_hash = 0;  // of the pairs whose leaf boxes overlap, as hits_hash; 0 if the method has no boxes
  std::uint64_t nested_count = 0;   // hits on meshes in which one link lies inside the other
  std::vector<std::string> differences;  // hits on meshes and on convex pieces that are not the same ones, in words
  double mean_area = 0;  // surface of the inner boxes, in the scene's units squared; 0 without inner boxes

  // The paper's #false: exact queries that found no hit between two characters.
  std::uint64_t false_positives() const { return stats.leaf_pairs - fcl.hits; }
  double total_seconds(const ExactRun& exact) const {
    return exact.seconds_query + stats.seconds_update + stats.seconds_test;
  }
};

struct Gate {
  std::string text;
  bool passed;
};

// Compares the methods with each other; for a full run also with the paper.
std::vector<Gate> check_gates(const PaperTable& table, const std::vector<MethodRun>& runs, bool full_run);

}  // namespace cab::perf
