// Random rays that are aimed at targets.
#pragma once

#include <cab/query.h>

#include <cstdint>
#include <vector>

#include "perf/tools/query/targets.h"

namespace cab::perf {

// Rays through random points of random leaf boxes of random characters, as these are posed, and as far beyond the point
// as they begin before it. Ray i does not depend on `count`. The poses must be quaternions with translations.
std::vector<Query> aimed_rays(const Targets& targets, std::uint32_t count, std::uint64_t seed);

}  // namespace cab::perf
