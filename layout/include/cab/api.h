// CAB_API marks what a shared libcab exports. On Windows a program that uses the DLL defines CAB_SHARED, as the target
// cab::cab does for it. A static library needs nothing.
#pragma once

#if !defined(_WIN32)
// Marks a call that a shared libcab exports.
#define CAB_API __attribute__((visibility("default")))
#elif !defined(CAB_SHARED)
#define CAB_API
#elif defined(CAB_BUILDING)
#define CAB_API __declspec(dllexport)
#else
#define CAB_API __declspec(dllimport)
#endif
