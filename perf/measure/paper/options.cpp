#include "perf/measure/paper/options.h"

#include <CLI/CLI.hpp>
#include <memory>

namespace cab::perf {
namespace {

// A run keeps the poses of all its frames: this many take about 800 MB.
constexpr std::uint32_t kMaxPaperFrames = 1000000;

}  // namespace

Command add_paper(CLI::App& app) {
  auto options = std::make_shared<PaperOptions>();
  PaperOptions& o = *options;
  CLI::App& command = *app.add_subcommand("paper", "run the paper's scenes and tables, beside the paper's own figures");
  add_read(command, "--tables", "LIST", o.tables, "tables, separated by commas (default 1,2,3,4,5)", read_number_list);
  add_number(command, "--frames", o.frame_count,
             "frames per table (default: as many as the paper, 10000, and 4001 of table 5)", 1, kMaxPaperFrames);
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  add_json(command, o.json_path, "write the tables as JSON");
  add_csv(command, o.csv_path, "write the tables as CSV");
  return {&command, [options] { return paper_command(*options); }};
}

}  // namespace cab::perf
