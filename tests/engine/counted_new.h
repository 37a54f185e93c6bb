// The operator new of the engine tests, in allocation_test.cpp: it counts its calls, and fails when it is told to.
#pragma once

#include <cstdint>

namespace cab::tests {

// The calls so far, by all threads.
std::uint64_t new_call_count();

// Lets this thread's calls fail after so many more. -1: never.
void fail_new_after(std::int64_t calls);

}  // namespace cab::tests
