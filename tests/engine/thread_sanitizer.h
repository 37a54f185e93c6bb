// Less work under ThreadSanitizer for tests of one thread. It finds nothing in them and makes them ten to fifty times
// slower. Each use prints what it leaves out.
#pragma once

namespace cab::tests {

#if defined(__SANITIZE_THREAD__)
inline constexpr bool kThreadSanitizer = true;
#else
inline constexpr bool kThreadSanitizer = false;
#endif

}  // namespace cab::tests
