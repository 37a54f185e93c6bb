// The table of `cab peers --robot`.
#pragma once

#include "perf/measure/peers/options.h"

namespace cab::perf {

// Options are checked when they are parsed.
int robots_command(const PeersOptions& options);

}  // namespace cab::perf
