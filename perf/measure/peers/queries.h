// The query tables of `cab peers --queries`.
#pragma once

#include "perf/measure/peers/options.h"

namespace cab::perf {

// Options are checked by peers_command.
int queries_command(const PeersOptions& options);

}  // namespace cab::perf
