// A child process with limits, for work on files that nobody vouches for.
#include "scenes/sandbox/sandbox.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iterator>
#include <new>
#include <optional>
#include <system_error>

namespace cab::scenes {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kHasShadow = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kHasShadow = true;
#else
constexpr bool kHasShadow = false;
#endif
#else
constexpr bool kHasShadow = false;
#endif

// What the child writes first, before it works on the file: a byte with these bits, of what the system has not granted.
enum Missing : std::uint8_t { kMissingLimits = 1, kMissingFiles = 2, kMissingCalls = 4 };

// What it writes then: one of these, the number of bytes as std::uint64_t, and the bytes.
enum class Message : char { kPayload = 'P', kRefused = 'R', kNoMemory = 'M', kMachineMemory = 'L' };
constexpr std::size_t kHeaderBytes = 1 + sizeof(std::uint64_t);
constexpr int kResultDescriptor = 3;  // in the child, after standard input, output and error
constexpr rlim_t kOpenFiles = 64;     // a file, the files that it names, and what libraries keep open
constexpr int kNoStart = 125;         // exit code of a child that could not begin, or could not hand over its result

// Closes a descriptor when it goes.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  int number() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

// Below: in the child.

void write_all(const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t written = write(kResultDescriptor, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) _exit(kNoStart);
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

[[noreturn]] void send_and_exit(Message message, const char* bytes, std::size_t size) {
  char header[kHeaderBytes] = {static_cast<char>(message)};
  const std::uint64_t count = size;
  std::memcpy(header + 1, &count, sizeof count);
  write_all(header, sizeof header);
  write_all(bytes, size);
  _exit(0);
}

// The address space that this process may have, and /proc/self/statm, which it cannot open any more; 0 and -1: unknown.
std::size_t allowed_bytes = 0;
int statm = -1;

// Pages of this process that are mapped, times their size; 0 if that is unknown. Allocates nothing.
std::size_t bytes_in(int descriptor) {
  char text[32] = {};
  if (pread(descriptor, text, sizeof text - 1, 0) <= 0) return 0;
  return std::strtoull(text, nullptr, 10) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

// Whether the machine refuses this process what is left to its limit. If not, the work asked for more than that.
bool is_short_of_memory() {
  constexpr std::size_t kSlack = std::size_t{16} << 20;  // for what is mapped in between, such as stacks
  const std::size_t mapped = bytes_in(statm);
  if (mapped == 0 || mapped + kSlack >= allowed_bytes) return false;
  const std::size_t left = allowed_bytes - mapped - kSlack;
  void* const probe = mmap(nullptr, left, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (probe != MAP_FAILED) munmap(probe, left);
  return probe == MAP_FAILED;
}

[[noreturn]] void out_of_memory() {
  send_and_exit(is_short_of_memory() ? Message::kMachineMemory : Message::kNoMemory, nullptr, 0);
}

// `beyond` is how far the hard limit, which ends the process without a name for the reason, is above the soft one.
// Returns whether the limit holds.
bool limit(__rlimit_resource_t resource, rlim_t most, rlim_t beyond = 0) {
  rlimit now = {};
  if (getrlimit(resource, &now) != 0) return false;
  now.rlim_max = std::min(most + beyond, now.rlim_max);
  now.rlim_cur = std::min(most, now.rlim_max);
  return setrlimit(resource, &now) == 0;
}

// These functions return whether the system grants the limits.

bool limit_memory(std::size_t most) {
  statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  const std::size_t mapped = bytes_in(statm);
  if (!sandbox_limits_memory()) return true;
  if (mapped == 0) return false;  // there is no /proc
  allowed_bytes = mapped + most;
  return limit(RLIMIT_AS, allowed_bytes);
}

bool limit_resources(const SandboxLimits& limits) {
  bool holds = limit_memory(limits.memory_bytes);
  holds = limit(RLIMIT_CPU, limits.cpu_seconds, 1) && holds;
  holds = limit(RLIMIT_CORE, 0) && holds;
  holds = limit(RLIMIT_FSIZE, 0) && holds;
  holds = limit(RLIMIT_NPROC, 0) && holds;
  return limit(RLIMIT_NOFILE, kOpenFiles) && holds;
}

// A new Landlock ruleset that takes away every access to files that its first version knows, or -1.
int new_file_ruleset() {
  landlock_ruleset_attr attributes = {};
  attributes.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;
  return static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0));
}

// Lets a file, or a folder with all below it, be read.
void let_read(const Descriptor& ruleset, const std::string& path) {
  const Descriptor place(open(path.c_str(), O_PATH | O_CLOEXEC));
  landlock_path_beneath_attr rule = {};
  rule.allowed_access = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
  rule.parent_fd = place.number();
  if (place.number() < 0) return;
  if (syscall(SYS_landlock_add_rule, ruleset.number(), LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0) return;
  rule.allowed_access = LANDLOCK_ACCESS_FS_READ_FILE;  // all that a rule for a file may name
  syscall(SYS_landlock_add_rule, ruleset.number(), LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
}

bool limit_files(const std::vector<std::string>& readable) {
  namespace fs = std::filesystem;
  const Descriptor ruleset(new_file_ruleset());
  if (ruleset.number() < 0) return false;
  for (const std::string& path : readable) {
    std::error_code error;
    const fs::path target = fs::canonical(path, error);
    if (error) continue;
    if (target == target.root_path()) {
      for (fs::directory_iterator entry(target, error), end; !error && entry != end; entry.increment(error))
        if (std::error_code status; entry->symlink_status(status).type() == fs::file_type::regular)
          let_read(ruleset, entry->path().string());
    } else if (fs::is_directory(target, error) || target.extension() == fs::path(path).extension()) {
      let_read(ruleset, target.string());
    }
  }
  return syscall(SYS_landlock_restrict_self, ruleset.number(), 0) == 0;
}

#if defined(__x86_64__)
#define CAB_AUDIT_ARCH AUDIT_ARCH_X86_64
#elif defined(__aarch64__)
#define CAB_AUDIT_ARCH AUDIT_ARCH_AARCH64
#endif

#ifdef CAB_AUDIT_ARCH
// What reading, allocating and ending need, and a pipe, by which UndefinedBehaviorSanitizer tests memory. All else
// fails with EPERM, so that a library that asks for more goes on.
constexpr std::uint32_t kAllowedCalls[] = {
    SYS_pipe2,         SYS_read,
    SYS_write,         SYS_readv,
    SYS_writev,        SYS_pread64,
    SYS_lseek,         SYS_close,
    SYS_fstat,         SYS_newfstatat,
    SYS_statx,         SYS_getdents64,
    SYS_readlinkat,    SYS_faccessat,
    SYS_faccessat2,    SYS_getcwd,
    SYS_mmap,          SYS_munmap,
    SYS_mremap,        SYS_mprotect,
    SYS_madvise,       SYS_brk,
    SYS_futex,         SYS_getpid,
    SYS_gettid,        SYS_rt_sigaction,
    SYS_rt_sigreturn,  SYS_rt_sigprocmask,
    SYS_sigaltstack,   SYS_getrandom,
    SYS_clock_gettime, SYS_clock_nanosleep,
    SYS_nanosleep,     SYS_restart_syscall,
    SYS_sched_yield,   SYS_exit,
    SYS_exit_group,
#ifdef SYS_stat
    SYS_stat,          SYS_lstat,
    SYS_access,        SYS_readlink,
#endif
};

// Lets the call with this number pass if `mask` has no bit of its argument `index`.
void allow_without_bits(std::vector<sock_filter>& program, std::uint32_t call, std::uint32_t index,
                        std::uint32_t mask) {
  const auto argument = static_cast<std::uint32_t>(offsetof(seccomp_data, args) + index * sizeof(std::uint64_t));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 4));
  program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, argument));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, mask, 0, 1));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EACCES));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
}

// Lets the call with this number pass if its argument `index` is one of `values`.
void allow_with_values(std::vector<sock_filter>& program, std::uint32_t call, std::uint32_t index,
                       const std::vector<std::uint32_t>& values) {
  const auto argument = static_cast<std::uint32_t>(offsetof(seccomp_data, args) + index * sizeof(std::uint64_t));
  const auto count = static_cast<std::uint8_t>(values.size());
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, static_cast<std::uint8_t>(count + 3)));
  program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, argument));
  for (std::uint8_t v = 0; v < count; ++v)
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, values[v], static_cast<std::uint8_t>(count - v), 0));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
}

bool limit_calls() {
  constexpr std::uint32_t kWriting = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC | O_APPEND;
  std::vector<sock_filter> program;
  program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, CAB_AUDIT_ARCH, 1, 0));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)));
  allow_without_bits(program, SYS_openat, 2, kWriting);
#ifdef SYS_open
  allow_without_bits(program, SYS_open, 1, kWriting);
#endif
  allow_with_values(program, SYS_fcntl, 1, {F_GETFL, F_SETFD});                       // listing a folder
  allow_with_values(program, SYS_tgkill, 0, {static_cast<std::uint32_t>(getpid())});  // abort() signals its own process
  for (const std::uint32_t call : kAllowedCalls) {
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1));
    program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  }
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  sock_fprog filter = {};
  filter.len = static_cast<unsigned short>(program.size());
  filter.filter = program.data();
  return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0) == 0;
}
#else
bool limit_calls() { return false; }
#endif

// Leaves standard input, output and error, which read and write nothing, and the result's descriptor.
void keep_only(int result) {
  if (dup2(result, kResultDescriptor) < 0) _exit(kNoStart);
  const int nothing = open("/dev/null", O_RDWR);
  if (nothing < 0) _exit(kNoStart);
  dup2(nothing, STDIN_FILENO);
  dup2(nothing, STDOUT_FILENO);
  if (!kHasShadow) dup2(nothing, STDERR_FILENO);
  if (syscall(SYS_close_range, kResultDescriptor + 1, ~0U, 0) == 0) return;
  const auto most = static_cast<int>(std::min<long>(sysconf(_SC_OPEN_MAX), 1 << 20));
  for (int other = kResultDescriptor + 1; other < most; ++other) close(other);
}

[[noreturn]] void run_child(int result, pid_t parent, const SandboxLimits& limits,
                            const std::vector<std::string>& readable, const std::function<std::string()>& work) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kNoStart);
  // The handlers of the host program have no business here.
  for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGILL, SIGTRAP, SIGABRT, SIGBUS, SIGFPE, SIGSEGV, SIGTERM, SIGALRM,
                           SIGXCPU, SIGXFSZ, SIGSYS})
    signal(number, SIG_DFL);
  signal(SIGPIPE, SIG_IGN);
  keep_only(result);
  std::uint8_t missing = limit_resources(limits) ? 0 : kMissingLimits;
  // Without it the next two are refused too, but for a process with many rights.
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  if (!limit_files(readable)) missing |= kMissingFiles;
  if (!limit_calls()) missing |= kMissingCalls;
  const char first = static_cast<char>(missing);
  write_all(&first, sizeof first);
  std::set_new_handler(out_of_memory);
  try {
    const std::string payload = work();
    send_and_exit(Message::kPayload, payload.data(), payload.size());
  } catch (const std::bad_alloc&) { out_of_memory(); } catch (const std::exception& error) {
    send_and_exit(Message::kRefused, error.what(), std::strlen(error.what()));
  } catch (...) { abort(); }
}

// Below: in the parent.

using Clock = std::chrono::steady_clock;

// The milliseconds until `end`, rounded up, at least 0.
int milliseconds_until(Clock::time_point end) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
  return static_cast<int>(std::clamp<decltype(left)>(left, 0, 1 << 30));
}

enum class Reading : std::uint8_t { kEnded, kTooLong, kTooMany };

// Reads until the child closes its end.
Reading read_all(int descriptor, const SandboxLimits& limits, std::string& bytes) {
  const Clock::time_point end = Clock::now() + std::chrono::seconds(limits.wall_seconds);
  std::vector<char> buffer(std::size_t{1} << 16);
  for (;;) {
    pollfd waiting = {descriptor, POLLIN, 0};
    const int ready = poll(&waiting, 1, milliseconds_until(end));
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0) throw std::system_error(errno, std::generic_category(), "poll");
    if (ready == 0 || Clock::now() >= end) return Reading::kTooLong;
    const ssize_t count = read(descriptor, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Reading::kEnded;
    bytes.append(buffer.data(), static_cast<std::size_t>(count));
    if (bytes.size() > sizeof(Missing) + kHeaderBytes + limits.payload_bytes) return Reading::kTooMany;
  }
}

// The exit status; empty if the system gave it away, as it does where SIGCHLD is ignored.
std::optional<int> wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return {};
  }
  return status;
}

std::string mebibytes(std::size_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

std::string words_for(std::uint8_t missing) {
  std::string out;
  const auto add = [&](Missing one, const char* words) {
    if (missing & one) out += (out.empty() ? "" : ", ") + std::string(words);
  };
  add(kMissingFiles, "Landlock (it can open every file that you can)");
  add(kMissingCalls, "seccomp (it can make every system call)");
  add(kMissingLimits, "limits of memory, time and files");
  return out;
}

SandboxResult stopped(const std::string& reason) { return {SandboxResult::End::kStopped, reason}; }

SandboxResult by_machine(const std::string& reason) { return {SandboxResult::End::kMachine, reason}; }

// Signals that a process brings upon itself. All others come from outside.
bool is_own_fault(int signal) {
  constexpr int kOwn[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS, SIGXCPU, SIGXFSZ};
  return std::find(std::begin(kOwn), std::end(kOwn), signal) != std::end(kOwn);
}

SandboxResult result_of(const std::string& bytes, std::optional<int> status, const SandboxLimits& limits) {
  if (status && WIFSIGNALED(*status)) {
    const int signal = WTERMSIG(*status);
    if (signal == SIGXCPU)
      return stopped("took more than " + std::to_string(limits.cpu_seconds) + " s of processor time");
    if (is_own_fault(signal)) return stopped(std::string("crashed: ") + strsignal(signal));
    return by_machine(std::string("was stopped from outside: ") + strsignal(signal) +
                      (signal == SIGKILL ? ", as where the machine runs out of memory" : ""));
  }
  std::uint64_t count = 0;
  if (bytes.size() >= kHeaderBytes) std::memcpy(&count, bytes.data() + 1, sizeof count);
  const bool is_whole = bytes.size() >= kHeaderBytes && count == bytes.size() - kHeaderBytes;
  if (!status && !is_whole) return by_machine("ended without a result, and the system does not say how");
  const int code = status ? WEXITSTATUS(*status) : 0;
  if (code == kNoStart) return by_machine("could not begin, or not hand over its result");
  if (code != 0 || !is_whole) return stopped("ended without a result, with exit code " + std::to_string(code));
  switch (static_cast<Message>(bytes[0])) {
    case Message::kPayload: return {SandboxResult::End::kPayload, bytes.substr(kHeaderBytes)};
    case Message::kRefused: return {SandboxResult::End::kRefused, bytes.substr(kHeaderBytes)};
    case Message::kNoMemory: return stopped("needs more than " + mebibytes(limits.memory_bytes) + " of memory");
    case Message::kMachineMemory:
      return by_machine("ran out of memory: the machine gives less than the " + mebibytes(limits.memory_bytes) +
                        " that it may take");
  }
  return stopped("gave a result of no known kind");
}

}  // namespace

bool sandbox_limits_memory() { return !kHasShadow; }

bool sandbox_limits_files() {
  static const bool has_landlock = Descriptor(new_file_ruleset()).number() >= 0;
  return has_landlock;
}

SandboxResult run_sandboxed(const SandboxLimits& limits, const std::vector<std::string>& readable,
                            const std::function<std::string()>& work) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  const Descriptor reading(ends[0]);
  Descriptor writing(ends[1]);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) run_child(writing.number(), parent, limits, readable, work);
  writing.close();

  std::string bytes;
  Reading reading_end;
  try {
    reading_end = read_all(reading.number(), limits, bytes);
  } catch (...) {
    kill(child, SIGKILL);
    wait_for(child);
    throw;
  }
  if (reading_end != Reading::kEnded) kill(child, SIGKILL);
  const std::optional<int> status = wait_for(child);
  switch (reading_end) {
    case Reading::kTooLong: return by_machine("took more than " + std::to_string(limits.wall_seconds) + " s");
    case Reading::kTooMany: return stopped("gave a result of more than " + mebibytes(limits.payload_bytes));
    case Reading::kEnded: break;
  }
  if (bytes.empty()) return result_of(bytes, status, limits);
  SandboxResult result = result_of(bytes.substr(sizeof(Missing)), status, limits);
  result.unprotected = words_for(static_cast<std::uint8_t>(bytes[0]));
  return result;
}

}  // namespace cab::scenes
