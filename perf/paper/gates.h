// Gates: conditions that the methods of one table must meet, compared with each other and with the paper.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/paper/tables.h"

namespace cab::perf {

// A row of our tables: a set of policies, and the paper's row that it stands beside.
struct Method {
  const char* name;
  std::optional<PaperMethod> paper;  // empty: the paper has no such row
  Policies policies;
  bool on_demand = false;  // perf/paper/partial_update instead of the engine; policies are those of the boxes it equals
  bool on_meshes = false;  // exact queries by perf/paper/mesh_query instead of the engine
};

// What one method counted over one scene.
struct MethodRun {
  Method method;
  FrameStats stats;        // seconds as the tables print them; total is by the clock, of the first run with exact tests
  std::uint64_t hits = 0;  // between two characters
  std::uint64_t hits_hash = 0;      // FNV-1a of every hit's frame, characters and links, in order
  std::uint64_t box_hits_hash = 0;  // likewise of the pairs whose leaf boxes overlap; 0 where the method has no boxes
  std::uint64_t contact_count = 0;  // hits with a normal and a depth
  std::uint64_t nested_count = 0;   // hits on meshes in which one link lies inside the other
  std::vector<std::string> differences;  // hits on meshes and on convex pieces that are not the same ones, in words
  double mean_area = 0;  // surface of the inner boxes, in the scene's units squared; 0 without inner boxes

  // The paper's #false: exact queries that found no hit between two characters.
  std::uint64_t false_positives() const { return stats.leaf_pairs - hits; }
  double total_seconds() const { return stats.seconds_query + stats.seconds_update + stats.seconds_test; }
};

struct Gate {
  std::string text;
  bool passed;
};

// Compares the methods with each other; for a full run also with the paper.
std::vector<Gate> check_gates(const PaperTable& table, const std::vector<MethodRun>& runs, bool full_run);

}  // namespace cab::perf
