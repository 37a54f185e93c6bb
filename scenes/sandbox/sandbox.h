// A child process with limits, for work on files that nobody vouches for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace cab::scenes {

struct SandboxLimits {
  std::size_t memory_bytes;    // address space of the work, beyond what this process has mapped, used or not
  std::uint32_t cpu_seconds;   // processor time
  std::uint32_t wall_seconds;  // time until the result is here
  std::size_t payload_bytes;   // size of the result
};

struct SandboxResult {
  enum class End : std::uint8_t {
    kPayload,  // bytes is what the work returned
    kRefused,  // the work threw a std::exception; bytes is its what()
    kStopped,  // the work crashed or broke a limit; bytes says which, such as "crashed: Segmentation fault"
    kMachine,  // the machine, or who uses it, stopped the work; bytes says how. Another try may succeed
  };
  End end;
  std::string bytes;
  std::string unprotected = {};  // what the system did not grant, in words, such as "Landlock"; empty: nothing
};

// Runs `work` in a child process and returns its result. The child is a copy of this process (fork). Whatever `work`
// does to memory stays there. `readable` names files and folders. What does not exist is left out, and so is a symbolic
// link to a file with another suffix, for such names come out of files that nobody vouches for. Of the root of all
// folders, only the files in it are readable. Throws std::system_error if there can be no child. The end is kMachine
// after a signal from outside, such as SIGKILL of a machine that runs out of memory, where the machine gives less
// memory than the limit, and after wall_seconds.
//
// The child has, on every Linux: the limits above, no descriptor of this process but the one for its result, nothing on
// standard output and standard error, no right to write to files or to dump core, and its end when this process ends.
// Where the kernel has seccomp (x86-64 and 64-bit ARM), it can only read files, map memory and end itself: no network,
// no other programs, no other processes. Where the kernel has Landlock, it can open only what is in `readable`
// (sandbox_limits_files). SandboxResult::unprotected names what of this a system lacks or
// forbids. Under AddressSanitizer and ThreadSanitizer, whose shadow is larger than any limit, memory is not limited; a
// sanitizer's reports stay on standard error.
//
// Threads. A child of fork has only the thread that called it, and a lock that another thread held stays locked. The C
// library makes its own locks, those of malloc and of streams, usable in the child. So `work` may allocate and read
// files beside idle threads, such as those of a pool. No other thread may hold a lock that `work` takes. The cab
// command reads its files before it starts threads.
//
// What comes back is bytes of a process that may have been taken over. Read them with PayloadReader, which checks every
// count, and print what() only through printable().
SandboxResult run_sandboxed(const SandboxLimits& limits, const std::vector<std::string>& readable,
                            const std::function<std::string()>& work);

// Whether run_sandboxed limits memory in this build.
bool sandbox_limits_memory();

// Whether the kernel keeps the child from files that are not in `readable`.
bool sandbox_limits_files();

}  // namespace cab::scenes
