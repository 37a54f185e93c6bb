// The shots at past moments of `cab peers --past`.
#pragma once

#include "perf/measure/peers/options.h"

namespace cab::perf {

// Options are checked by peers_command.
int past_command(const PeersOptions& options);

}  // namespace cab::perf
