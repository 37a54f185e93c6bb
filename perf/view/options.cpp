#include "perf/view/options.h"

#include <CLI/CLI.hpp>
#include <limits>
#include <memory>

namespace cab::perf {

Command add_view(CLI::App& app) {
  auto options = std::make_shared<ViewOptions>();
  ViewOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("view", "write a page that plays recordings in any browser, without a network");
  CLI::Option* files = command.add_option("FILE", o.files, "recordings")->required()->type_name("");
  refuse_empty(*files);
  add_path(command, "--out", o.out_path, "the page to write (default: the first recording's name with .html)")
      ->type_name("PAGE.html");
  add_number(command, "--frame", o.frame, "frame that the printed address opens (default 0)", 0,
             std::numeric_limits<std::uint32_t>::max());
  add_path(command, "--page", o.page_path, "cab_view.html (default: the one beside the command)")->type_name("FILE");
  return {&command, [options] { return view_command(*options); }};
}

}  // namespace cab::perf
