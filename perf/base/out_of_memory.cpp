#include "perf/base/out_of_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>

namespace cab::perf {

std::string out_of_memory() {
  const auto megabytes = [](std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MB"; };
  rlimit limit = {};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    return "out of memory: the limit on address space (ulimit -v) is " + megabytes(limit.rlim_cur);
  std::uint64_t all_pages = 0, pages = 0;
  std::ifstream("/proc/self/statm") >> all_pages >> pages;
  return "out of memory: the system gives no more than the " +
         megabytes(pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE))) + " that this process has";
}

}  // namespace cab::perf
