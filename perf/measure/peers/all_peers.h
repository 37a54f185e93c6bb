// The libraries that `cab peers` knows, and which of them this build has.
#pragma once

#include <string>
#include <vector>

#include "perf/measure/peers/peer.h"

namespace cab::perf {

// The peers of these names, or all. Throws UsageError for a name that is none, is given twice, or is not built in.
std::vector<Peer> choose_peers(const std::vector<std::string>& names);

// The peers that are in this build with their versions, or those that are not with their packages, as one line.
std::string versions(const std::vector<Peer>& peers, bool built);

}  // namespace cab::perf
