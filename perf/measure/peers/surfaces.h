// The table of `cab peers --surfaces`.
#pragma once

#include "perf/measure/peers/options.h"

namespace cab::perf {

// Options are checked when they are parsed.
int surfaces_command(const PeersOptions& options);

}  // namespace cab::perf
