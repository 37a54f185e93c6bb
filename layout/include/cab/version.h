// The version of cab: of the headers that a program was compiled with, and of the library that it runs. Also, what that
// library was built with.
//
// The version is written only in the three numbers and the suffix below; CMake reads them here.
#pragma once

#include <cab/api.h>

#include <cstdint>

// The version of the headers, as three numbers and what follows them.
#define CAB_VERSION_MAJOR 1
#define CAB_VERSION_MINOR 0
#define CAB_VERSION_PATCH 0
#define CAB_VERSION_SUFFIX ""

// The version as text: "MAJOR.MINOR.PATCH", and "-rc" before the release of that version. The two other macros serve
// this one.
#define CAB_VERSION_STRING CAB_VERSION_TEXT(CAB_VERSION_MAJOR, CAB_VERSION_MINOR, CAB_VERSION_PATCH) CAB_VERSION_SUFFIX
#define CAB_VERSION_TEXT(major, minor, patch) \
  CAB_VERSION_QUOTE(major) "." CAB_VERSION_QUOTE(minor) "." CAB_VERSION_QUOTE(patch)
#define CAB_VERSION_QUOTE(number) #number

namespace cab {

// A version of cab.
struct Version {
  std::uint32_t major = 0;     // raised by what programs must adapt to, such as a name that goes
  std::uint32_t minor = 0;     // raised by what is added
  std::uint32_t patch = 0;     // raised by a release that leaves the API as it is
  const char* text = nullptr;  // CAB_VERSION_STRING; lives as long as the program
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
