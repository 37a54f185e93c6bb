// Less work under ThreadSanitizer for tests of one thread. It finds nothing in them and makes them ten to fifty times
// slower. Each use prints what it leaves out.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>

namespace cab::tests {

#if defined(__SANITIZE_THREAD__)
inline constexpr bool kThreadSanitizer = true;
#else
inline constexpr bool kThreadSanitizer = false;
#endif

// How many of `count` seeds to run: all, or three under ThreadSanitizer.
inline std::uint64_t seeds_to_run(std::uint64_t count) {
  if (!kThreadSanitizer) return count;
  const std::uint64_t run = std::min<std::uint64_t>(count, 3);
  MESSAGE("under ThreadSanitizer " << run << " of " << count << " seeds: the test has one thread");
  return run;
}

}  // namespace cab::tests
