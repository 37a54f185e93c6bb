// The world of motion files that `cab run` and `cab sweep` are given.
#pragma once

#include "perf/commands.h"
#include "scenes/scene.h"

namespace cab::perf {

// Throws UsageError where offsets or units do not fit the files.
void check_files(const RunOptions& options);

// One character a file, named apart, in one world and on one clock. Throws UsageError for a rest frame that is none,
// scenes::ImportError for bad files.
scenes::Scene import_world(const RunOptions& options);

}  // namespace cab::perf
