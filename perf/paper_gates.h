// What must hold between the methods of one table, and between them and the paper.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/paper_tables.h"

namespace cab::perf {

// A row of our tables: a set of policies, and the paper's row that it stands beside.
struct Method {
  const char* name;
  std::optional<PaperMethod> paper;  // none: the paper has no such row
  Policies policies;
};

// What one method counted over one scene.
struct MethodRun {
  Method method;
  FrameStats stats;
  std::uint64_t hits = 0;
  std::uint64_t hits_hash = 0;  // FNV-1a of every hit's frame, characters and links, in order
};

struct Gate {
  std::string text;
  bool passed;
};

// Compares the methods with each other; for a full run also with the paper.
std::vector<Gate> check_gates(const PaperTable& table, const std::vector<MethodRun>& runs, bool full_run);

}  // namespace cab::perf
