// The operator new of the engine tests: it counts its calls, and fails when it is told to.
#pragma once

#include <atomic>
#include <cstdint>

// Sanitizers bring their own malloc; without them the C library's is counted as well.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define CAB_TEST_SANITIZED 1
#endif
#endif
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    !defined(CAB_TEST_SANITIZED)
#define CAB_TEST_COUNTS_MALLOC 1
#else
#define CAB_TEST_COUNTS_MALLOC 0
#endif

namespace cab::tests {

// Calls of operator new and of malloc since the program began, by all threads.
extern std::atomic<std::uint64_t> new_calls, malloc_calls;
inline std::uint64_t new_call_count() { return new_calls; }

// How many results of operator new have not been given back.
extern std::atomic<std::int64_t> news_held;

// Lets calls of operator new fail on every thread.
extern std::atomic<bool> all_news_fail;

// After how many more calls operator new fails on this thread. -1: never.
std::int64_t& news_until_failure();
inline void fail_new_after(std::int64_t calls) { news_until_failure() = calls; }

}  // namespace cab::tests
