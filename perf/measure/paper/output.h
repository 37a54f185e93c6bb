// The output of `cab paper`: tables with our figures beside the paper's, JSON, CSV.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "perf/base/output_file.h"
#include "perf/measure/paper/added_false_positives.h"
#include "perf/measure/paper/gates.h"

namespace cab::perf {

// The run of one table.
struct TableRun {
  const PaperTable* table;
  std::uint32_t frame_count;
  Isa isa;
  std::uint32_t thread_count;
  std::uint64_t pose_hash;
  std::uint64_t box_hash;      // of every box of CAB in every frame
  std::uint64_t box_hit_hash;  // of every pair of leaf boxes that overlap, by CAB
  AddedFalsePositives added;   // of CAB, against boxes without padding and tests without slack
  std::vector<MethodRun> runs;
  std::vector<Gate> gates;

  bool is_full() const { return frame_count == table->frame_count; }
};

void print_table(const TableRun& run);

// Each writes and closes a file, and does nothing if the file is none.
void write_paper_json(OutputFile& file, const std::vector<TableRun>& tables);
void write_paper_csv(OutputFile& file, const std::vector<TableRun>& tables);

}  // namespace cab::perf
