#include "perf/tools/report/options.h"

#include <CLI/CLI.hpp>
#include <limits>
#include <memory>

namespace cab::perf {

Command add_report(CLI::App& app) {
  auto options = std::make_shared<ReportOptions>();
  ReportOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("report", "report which links touch, when and how deep: recordings to one page");
  CLI::Option* files = command.add_option("FILE", o.files, "recordings, as `cab run --record` writes them");
  files->required()->type_name("");
  refuse_empty(*files);
  add_path(command, "--out", o.out_path, "write a page that a browser opens, with tables, a matrix and the viewer")
      ->type_name("OUT.html");
  add_csv(command, o.csv_path, "write all intervals of contact as CSV (default: beside the page, with its name)");
  add_path(command, "--pairs", o.pairs_path, "write all pairs of links as CSV")->type_name("OUT.csv");
  add_read(command, "--min-depth", "METRES", o.min_depth, "only intervals that are so deep somewhere",
           read_not_negative);
  add_number(command, "--min-frames", o.min_frames, "only intervals of at least N frames (default 1)", 1,
             std::numeric_limits<std::uint32_t>::max());
  add_path(command, "--page", o.page_path, "the page of the viewer (default: cab_view.html beside this command)")
      ->type_name("FILE.html");
  return {&command, [options] { return report_command(*options); }};
}

}  // namespace cab::perf
