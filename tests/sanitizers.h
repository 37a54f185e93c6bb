// What tests leave out under a sanitizer. Each use prints it.
#pragma once

#ifdef __has_feature
#define CAB_TESTS_HAVE(sanitizer) __has_feature(sanitizer)
#else
#define CAB_TESTS_HAVE(sanitizer) 0
#endif

namespace cab::tests {

// Tests of one thread: ThreadSanitizer finds nothing in them and makes them ten to fifty times slower.
#if defined(__SANITIZE_THREAD__) || CAB_TESTS_HAVE(thread_sanitizer)
inline constexpr bool kThreadSanitizer = true;
#else
inline constexpr bool kThreadSanitizer = false;
#endif

// Limits on the address space, of which both sanitizers reserve more than any.
#if defined(__SANITIZE_ADDRESS__) || CAB_TESTS_HAVE(address_sanitizer)
inline constexpr bool kReservesAddressSpace = true;
#else
inline constexpr bool kReservesAddressSpace = kThreadSanitizer;
#endif

}  // namespace cab::tests

#undef CAB_TESTS_HAVE
