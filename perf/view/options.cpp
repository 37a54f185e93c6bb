#include "perf/view/options.h"

#include <CLI/CLI.hpp>
#include <limits>
#include <memory>
#include <set>

namespace cab::perf {

Command add_view(CLI::App& app) {
  auto options = std::make_shared<ViewOptions>();
  ViewOptions& o = *options;
  CLI::App& command = *app.add_subcommand(
      "view", "write a page that plays recordings, motion files or a robot in any browser, without a network");
  add_path(command, "--out", o.out_path, "the page to write (default: the first file's name with .html)")
      ->type_name("PAGE.html");
  add_number(command, "--frame", o.frame, "frame that the printed address opens (default 0)", 0,
             std::numeric_limits<std::uint32_t>::max());
  add_path(command, "--page", o.page_path, "cab_view.html (default: the one beside the command)")->type_name("FILE");

  std::set<const CLI::Option*> known;
  const auto add_group = [&](const char* name, const auto& add) {
    for (const CLI::Option* option : command.get_options()) known.insert(option);
    add();
    std::vector<const CLI::Option*> added;
    for (CLI::Option* option : command.get_options()) {
      if (known.count(option) > 0 || option->get_positional() || option->get_name() == "--no-sandbox") continue;
      option->group(name);
      added.push_back(option);
    }
    return added;
  };
  const auto motion = add_group("Of motion files", [&] {
    add_run_of_files(command, o.run,
                     "recordings (.cab); or motion files, one character each, which are tested and recorded first; or "
                     "a robot (.urdf, .xml, .mjcf)");
  });
  o.robot.policies.exact = Exact::kConvex;
  const auto robot = add_group("Of a robot", [&] {
    add_states(command, o.robot.states_path);
    add_packages(command, o.robot.import);
    add_srdf(command, o.robot.srdf_path);
  });
  return {&command, [options, motion, robot] {
            for (const CLI::Option* option : motion)
              if (option->count() > 0) options->motion_options.push_back(option->get_name());
            for (const CLI::Option* option : robot)
              if (option->count() > 0) options->robot_options.push_back(option->get_name());
            options->robot.import.sandbox = options->run.world.sandbox;
            return view_command(*options);
          }};
}

}  // namespace cab::perf
