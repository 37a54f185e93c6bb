#include "perf/tools/replay/options.h"

#include <cab/policy.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <vector>

#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

// Scenes that need nothing but their name.
bool can_be_recorded(const scenes::NamedScene& scene) {
  if (scene.is_for(scenes::kSweepCommand)) return true;
  const auto* const crowd = std::get_if<scenes::CrowdScene>(&scene.source);
  return crowd != nullptr && crowd->clips != scenes::ClipUse::kNeeded;
}

std::string recorded_scene_help() {
  std::string help = "which scene";
  for (const scenes::NamedScene& scene : scenes::scene_list())
    if (can_be_recorded(scene)) help += std::string("\n  ") + scene.name + ": " + scene.meaning;
  return help;
}

std::string read_recorded_scene(const std::string& option, const std::string& text) {
  std::vector<std::string> names;
  for (const scenes::NamedScene& scene : scenes::scene_list())
    if (can_be_recorded(scene)) {
      if (text == scene.name) return text;
      names.emplace_back(scene.name);
    }
  reject(option, text, "a scene; choose " + joined(names, ", "));
}

}  // namespace

CLI::Option* add_record_file(CLI::App& command, const std::string& option, RecordFileOptions& file,
                             const std::string& meaning) {
  CLI::Option* const path = add_path(command, option, file.path, meaning);
  path->type_name("FILE.cab");
  command.add_flag("--compress", file.compress, "compress the recording by zstd")->needs(path);
  add_read(command, "--pose-step", "LENGTH", file.pose_step,
           "round poses to 16 bits per number, translations to multiples of this power of two; frames run with the "
           "rounded poses",
           read_positive)
      ->needs(path);
  return path;
}

Command add_record(CLI::App& app) {
  auto options = std::make_shared<RecordOptions>();
  RecordOptions& o = *options;
  CLI::App& command = *app.add_subcommand("record", "record a built-in scene");
  add_read(command, "--scene", "NAME", o.scene, recorded_scene_help(), read_recorded_scene)->required();
  add_record_file(command, "--out", o.file, "the recording to write")->required();
  add_read(command, "--frames", "N|A:B", o.frames,
           "only the first N frames, or frames A to B - 1, counted from 0; of a crowd A is 0 (default all; of a crowd"
           " 30)",
           read_frame_range);
  add_number(command, "--characters", o.character_count, "of a crowd, how many characters (default 1000)", 1,
             kMaxCrowd);
  add_read(command, "--margin", "LENGTH", o.margin, "record links that are at most this far apart too", read_positive);
  add_policies(command, o.policies);
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  return {&command, [options] { return record_command(*options); }};
}

Command add_replay(CLI::App& app) {
  auto options = std::make_shared<ReplayOptions>();
  ReplayOptions& o = *options;
  CLI::App& command = *app.add_subcommand("replay", "run a recording again, and compare its hits bit by bit");
  add_path(command, "FILE", o.file, "recording")->required()->type_name("");
  for (std::uint32_t field = 0; field < policy_table().size; ++field) {
    const PolicyField& row = policy_table()[field];
    add_text(command, std::string("--") + row.name, policy_names(field, "|"),
             std::string(row.meaning) + " (default as recorded)", [&o, field](const std::string& text) {
               set_policy(o.policies, field, text);
               o.changed_policies |= 1u << field;
             });
  }
  add_isas(command, o.isas, "the best");
  add_threads(command, o.thread_count);
  add_json(command, o.json_path, "write the table as JSON");
  return {&command, [options] { return replay_command(*options); }};
}

}  // namespace cab::perf
