// From the text of an option to its value. Each reader throws UsageError with the option's name and what to write.
#pragma once

#include <cab/types.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "scenes/crowd/ropes.h"

namespace cab::perf {

// X,Y,Z: three finite numbers.
std::array<double, 3> read_offset(const std::string& option, const std::string& text);

// A finite number above zero.
double read_positive(const std::string& option, const std::string& text);

// A:B with A < B.
FrameRange read_frame_range(const std::string& option, const std::string& text);

// An instruction set that this CPU and build can run, or auto.
Isa read_isa(const std::string& option, const std::string& text);

// frames or pairs.
LaneContent read_lanes(const std::string& option, const std::string& text);

// The name of a crowd scene; all names joined by a separator; what they are, a line each.
std::string read_crowd_scene(const std::string& option, const std::string& text);
std::string crowd_scene_names(const char* separator);
std::string crowd_scene_help();

// How many boxes a link of the scene `detailed` has; the numbers there are, joined by a separator.
std::uint32_t read_boxes_per_link(const std::string& option, const std::string& text);
std::string boxes_per_link_names(const char* separator);

// The shape of a rope; all names joined by a separator.
scenes::RopeShape read_rope_shape(const std::string& option, const std::string& text);
std::string rope_shape_names(const char* separator);

// Whole numbers separated by commas, each one once.
std::vector<std::uint32_t> read_number_list(const std::string& option, const std::string& text);

// The texts between commas.
std::vector<std::string> split_commas(const std::string& text);

// The names of all instruction sets but auto, or of those available here, joined by a separator.
std::string isa_names(const char* separator, bool available_only);

// One row of policy_table(): the names of its values joined by a separator; its meaning, its default and a line for
// each value.
std::string policy_names(std::uint32_t field, const char* separator);
std::string policy_help(const Policies& defaults, std::uint32_t field);

// Values of a field by their names, separated by commas, each one once; what may be given.
std::vector<std::uint32_t> read_policy_values(std::uint32_t field, const std::string& text);
std::string policy_list_help(std::uint32_t field);

// Scenes of `cab sweep` separated by commas, each one once; what there is, a line each.
std::vector<std::string> read_sweep_scenes(const std::string& option, const std::string& text);
std::string sweep_scene_help();

// Sets a field of policies by the name of a value.
void set_policy(Policies& policies, std::uint32_t field, const std::string& text);

// The names of all rows of preset_table() joined by a separator; what they are, a line each.
std::string preset_names(const char* separator);
std::string preset_help();

// Sets all policies by the name of a preset.
void set_preset(Policies& policies, const std::string& text);

}  // namespace cab::perf
