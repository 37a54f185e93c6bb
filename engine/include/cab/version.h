// The version of cab: of the headers that a program was compiled with, and of the library that it runs. Also, what that
// library was built with.
//
// The version is written only in the three numbers below; CMake reads them here. Before 1.0 each change of the API
// raises the minor version.
#pragma once

#include <cab/api.h>

#include <cstdint>

#define CAB_VERSION_MAJOR 0
#define CAB_VERSION_MINOR 2
#define CAB_VERSION_PATCH 0

// The version as text: "MAJOR.MINOR.PATCH". The two other macros serve this one.
#define CAB_VERSION_STRING CAB_VERSION_TEXT(CAB_VERSION_MAJOR, CAB_VERSION_MINOR, CAB_VERSION_PATCH)
#define CAB_VERSION_TEXT(major, minor, patch) \
  CAB_VERSION_QUOTE(major) "." CAB_VERSION_QUOTE(minor) "." CAB_VERSION_QUOTE(patch)
#define CAB_VERSION_QUOTE(number) #number

namespace cab {

// A version of cab.
struct Version {
  std::uint32_t major = 0;     // 0 until the API is stable; later raised by changes to which programs must adapt
  std::uint32_t minor = 0;     // raised by every other change of the API, and by every change while major is 0
  std::uint32_t patch = 0;     // raised by a release that leaves the API as it is
  const char* text = nullptr;  // "MAJOR.MINOR.PATCH"; lives as long as the program
};

// Returns the version of the library that runs. It differs from the macros above if a program was compiled with the
// headers of one version and loads the shared libcab of another.
// Cost: constant time; allocates nothing. Thread: any.
CAB_API Version version() noexcept;

// Which optional packages a library was built with.
struct BuildInfo {
  bool fcl = false;    // Exact::kFcl can be asked for; without it, the answer is kExactNotBuilt
  bool qhull = false;  // vertices inside a hull are left out of it; without it they stay, and cost time per exact test
  bool tbb = false;    // thread_count has an effect; without it, engines without a caller's scheduler have one thread
};

// Returns which optional packages the library that runs was built with.
// Cost: constant time; allocates nothing. Thread: any.
CAB_API BuildInfo build_info() noexcept;

}  // namespace cab
