// The random blocks of the verification, by the names that tests use.
#pragma once

#include "perf/judge/verify/random_block.h"

namespace cab::tests {

using oracle::ConvexCase;
using oracle::ConvexRegime;
using oracle::Random;
using perf::RandomBlock;
using perf::ShapeBlock;

}  // namespace cab::tests
