// Memory that runs out, in words.
#pragma once

#include <string>

namespace cab::perf {

// How much memory this process has, and which limit it has reached: "out of memory: ...".
std::string out_of_memory();

}  // namespace cab::perf
