// Work that crashes, hangs, allocates, looks around or returns rubbish, in a child process with limits.
#include "scenes/sandbox/sandbox.h"

#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace {

using namespace cab::scenes;
using cab::tests::TemporaryFile;
using End = SandboxResult::End;
using Work = std::function<std::string()>;

constexpr SandboxLimits kSmall = {std::size_t{256} << 20, 1, 30, std::size_t{1} << 20};

// Why a piece of work was stopped.
std::string reason(const Work& work, const SandboxLimits& limits = kSmall, End end = End::kStopped) {
  const SandboxResult result = run_sandboxed(limits, {}, work);
  CHECK(result.end == end);
  return result.bytes;
}

// What a piece of work says that it saw.
std::string seen(const Work& work, const std::vector<std::string>& readable = {}) {
  const SandboxResult result = run_sandboxed(kSmall, readable, work);
  CHECK(result.end == End::kPayload);
  return result.bytes;
}

Work read_file(const std::string& path) {
  return [path]() -> std::string {
    std::ifstream file(path);
    if (!file) return "cannot be opened";
    return {std::istreambuf_iterator<char>(file), {}};
  };
}

// "done", or the reason of a system call that failed.
std::string outcome(long result) { return result < 0 ? std::strerror(errno) : "done"; }

// A function of its own, since clang 14 crashes where it knows so long a text.
std::string text_of(std::size_t size) { return std::string(size, 'x'); }

[[noreturn]] void spin() {
  for (std::atomic<unsigned> turns = 0;;) ++turns;
}

}  // namespace

TEST_CASE("the bytes that the work returns come back, all of them") {
  CHECK(seen([] { return std::string(); }).empty());
  std::string bytes;
  for (int i = 0; i < 1 << 20; ++i) bytes += static_cast<char>(i * 7 + (i >> 8));
  CHECK((seen([&] { return bytes; }) == bytes));
}

TEST_CASE("what the work does to memory and prints stays in the child") {
  int value = 1;
  CHECK(seen([&] {
          value = 2;
          std::cout << "printed in the child" << std::endl;
          return std::to_string(value);
        }) == "2");
  CHECK(value == 1);
}

TEST_CASE("an exception of the work comes back as its text") {
  const SandboxResult result =
      run_sandboxed(kSmall, {}, []() -> std::string { throw std::runtime_error("line 3: bad"); });
  CHECK(result.end == End::kRefused);
  CHECK(result.bytes == "line 3: bad");
}

TEST_CASE("a crash ends the child alone, and is named") {
  CHECK(reason([]() -> std::string {
          raise(SIGSEGV);
          return {};
        }) == "crashed: Segmentation fault");
  CHECK(reason([]() -> std::string { std::abort(); }) == "crashed: Aborted");
  CHECK(reason([]() -> std::string { throw 1; }) == "crashed: Aborted");
  CHECK(reason([]() -> std::string { _exit(7); }) == "ended without a result, with exit code 7");
  CHECK(reason([]() -> std::string { _exit(0); }) == "ended without a result, with exit code 0");
}

TEST_CASE("work without end is stopped by its processor time, and work that waits by the clock") {
  CHECK(reason([]() -> std::string { spin(); }) == "took more than 1 s of processor time");
  SandboxLimits limits = kSmall;
  limits.wall_seconds = 1;
  const auto waits = []() -> std::string {
    for (;;) sleep(1000);
  };
  CHECK(reason(waits, limits, End::kMachine) == "took more than 1 s");
}

TEST_CASE("what stops the work from outside is the machine's matter, not that of the work") {
  const auto ended_by = [](int signal) {
    return reason(
        [signal]() -> std::string {
          raise(signal);
          return {};
        },
        kSmall, End::kMachine);
  };
  CHECK(ended_by(SIGKILL) == "was stopped from outside: Killed, as where the machine runs out of memory");
  CHECK(ended_by(SIGTERM) == "was stopped from outside: Terminated");
  CHECK(ended_by(SIGINT) == "was stopped from outside: Interrupt");
  CHECK(ended_by(SIGHUP) == "was stopped from outside: Hangup");
}

TEST_CASE("a machine that gives less memory than the limit is told from work that asks for more") {
  if (!sandbox_limits_memory()) {
    MESSAGE("skipped: memory is not limited under AddressSanitizer and ThreadSanitizer");
    return;
  }
  // More than any machine gives at once; the work asks for a fraction of it.
  SandboxLimits limits = kSmall;
  limits.memory_bytes = std::size_t{1} << 46;
  const auto asks = []() -> std::string { return text_of(std::size_t{1} << 42); };
  CHECK(reason(asks, limits, End::kMachine) ==
        "ran out of memory: the machine gives less than the 67108864 MiB that it may take");
  limits.memory_bytes = std::size_t{64} << 20;
  CHECK(reason(asks, limits) == "needs more than 64 MiB of memory");
}

TEST_CASE("work that allocates without end is stopped at the limit of memory") {
  if (!sandbox_limits_memory()) {
    MESSAGE("skipped: memory is not limited under AddressSanitizer and ThreadSanitizer");
    return;
  }
  CHECK(reason([]() -> std::string {
          std::vector<std::string> all;
          for (;;) all.emplace_back(std::size_t{1} << 20, 'x');
        }) == "needs more than 256 MiB of memory");
  CHECK(reason([] { return text_of(std::size_t{1} << 40); }) == "needs more than 256 MiB of memory");
  // The limit is for the work, beyond what this process has.
  const std::string mine(std::size_t{300} << 20, 'x');
  CHECK(seen([&] { return std::to_string(std::string(mine.size() / 3, 'y').size()); }) == "104857600");
}

TEST_CASE("a result that is too large, or that breaks off, is no result") {
  CHECK(reason([] { return std::string((std::size_t{1} << 20) + 1, 'x'); }) == "gave a result of more than 1 MiB");
  const auto writes = [](const std::string& bytes) {
    return [bytes]() -> std::string {
      // The descriptor of the result is the first after standard error.
      if (write(3, bytes.data(), bytes.size()) < 0) _exit(2);
      _exit(0);
    };
  };
  const std::string one = {1, 0, 0, 0, 0, 0, 0, 0};
  CHECK(reason(writes("P")) == "ended without a result, with exit code 0");
  CHECK(reason(writes("P" + one)) == "ended without a result, with exit code 0");
  CHECK(reason(writes("P" + one + "ab")) == "ended without a result, with exit code 0");
  CHECK(reason(writes("X" + one + "a")) == "gave a result of no known kind");
  CHECK(seen(writes("P" + one + "a")) == "a");
}

TEST_CASE("the child reads below the folders that it is given, and nothing else") {
  const TemporaryFile inside("inside.txt", "inside"), outside("outside.txt", "outside");
  const std::string folder = inside.directory().string();
  CHECK(seen(read_file(inside.path()), {folder}) == "inside");
  const auto list = [&] { return std::filesystem::directory_iterator(folder)->path().filename().string(); };
  CHECK(seen(list, {folder}) == "inside.txt");
  CHECK(seen(read_file(outside.path()), {folder, outside.path()}) == "outside");
  if (!sandbox_limits_files()) {
    MESSAGE("skipped: this kernel has no Landlock");
    return;
  }
  CHECK(seen(read_file(outside.path()), {folder, "/nonexistent"}) == "cannot be opened");
  CHECK(seen(read_file(folder + "/../" + outside.directory().filename().string() + "/outside.txt"), {folder}) ==
        "cannot be opened");
  std::filesystem::create_symlink(outside.path(), folder + "/link");
  CHECK(seen(read_file(folder + "/link"), {folder}) == "cannot be opened");
}

TEST_CASE("of the root of all folders the child reads the files in it, and of links those to files of their kind") {
  const TemporaryFile inside("inside.txt", "inside"), outside("outside.txt", "outside");
  const std::string text = inside.directory() / "link.txt", model = inside.directory() / "link.obj";
  for (const std::string& link : {text, model}) std::filesystem::create_symlink(outside.path(), link);
  CHECK(seen(read_file(text), {text}) == "outside");
  if (!sandbox_limits_files()) {
    MESSAGE("skipped: this kernel has no Landlock");
    return;
  }
  CHECK(seen(read_file(model), {model}) == "cannot be opened");
  CHECK(seen(read_file(outside.path()), {"/"}) == "cannot be opened");
  CHECK(seen(read_file("/etc/passwd"), {"/", "/x.obj"}) == "cannot be opened");
}

#if defined(__x86_64__) || defined(__aarch64__)
namespace {

// What is told where the system forbids the calls that limit files and calls.
std::string unprotected_where_forbidden() {
  std::array<int, 2> ends;
  REQUIRE(pipe(ends.data()) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::array<sock_filter, 7> program = {{
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_landlock_restrict_self, 3, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_prctl, 0, 3),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PR_SET_SECCOMP, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    }};
    sock_fprog filter = {static_cast<unsigned short>(program.size()), program.data()};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0) != 0)
      _exit(1);
    const SandboxResult result = run_sandboxed(kSmall, {}, [] { return std::string("read"); });
    const std::string told = result.bytes + ": " + result.unprotected;
    if (write(ends[1], told.data(), told.size()) < 0) _exit(1);
    _exit(0);
  }
  close(ends[1]);
  std::string told(1000, '\0');
  const ssize_t size = read(ends[0], told.data(), told.size());
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return told.substr(0, static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
}

}  // namespace

TEST_CASE("where the system forbids a limit, the result names it") {
  if (!sandbox_limits_files()) {
    MESSAGE("skipped: this kernel has no Landlock");
    return;
  }
  CHECK(run_sandboxed(kSmall, {}, [] { return std::string(); }).unprotected.empty());
  CHECK(unprotected_where_forbidden() ==
        "read: Landlock (it can open every file that you can), seccomp (it can make every system call)");
}
#endif

TEST_CASE("the child can neither write to files, nor begin processes, nor reach a network or another process") {
  const TemporaryFile file("kept.txt", "kept");
  const std::string folder = file.directory().string();
  CHECK(seen(
            [&]() -> std::string {
              std::ofstream out(file.path());
              out << "changed" << std::flush;
              return out ? "changed" : "refused";
            },
            {folder}) == "refused");
  CHECK(read_file(file.path())() == "kept");
#if defined(__x86_64__) || defined(__aarch64__)
  const std::string refused = std::strerror(EPERM);
  CHECK(seen([] { return outcome(socket(AF_INET, SOCK_STREAM, 0)); }) == refused);
  CHECK(seen([] { return outcome(fork()); }) == refused);
  CHECK(seen([] { return outcome(execl("/bin/true", "true", nullptr)); }, {"/"}) == refused);
  CHECK(seen([] { return outcome(kill(getppid(), 0)); }) == refused);
  CHECK(seen([&] { return outcome(unlink(file.path().c_str())); }, {folder}) == refused);
#endif
}

TEST_CASE("the child has no descriptor of its parent") {
  std::array<int, 2> ends;
  REQUIRE(pipe(ends.data()) == 0);
  CHECK(seen([&] { return outcome(write(ends[1], "x", 1)); }) == std::strerror(EBADF));
  close(ends[0]);
  close(ends[1]);
}

TEST_CASE("children may be made beside idle threads, and where SIGCHLD is ignored") {
  std::atomic<bool> done = false;
  std::thread idle([&] {
    while (!done) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  for (int child = 0; child < 20; ++child) CHECK(seen([] { return std::string(100000, 'y'); }).size() == 100000);
  done = true;
  idle.join();
  const auto before = signal(SIGCHLD, SIG_IGN);
  CHECK(seen([] { return std::string("read"); }) == "read");
  signal(SIGCHLD, before);
}
