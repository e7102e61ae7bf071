// A look at processes from outside.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace amhex::server {

std::vector<pid_t> ChildrenOf(pid_t parent);

// What each open descriptor stands for, e.g. "socket:[123]" or a path, in no order.
std::vector<std::string> DescriptorsOf(pid_t pid);

// The address sanitizer keeps that much of what is freed, to notice its use.
#if defined(__SANITIZE_ADDRESS__)
#define AMHEX_HAS_QUARANTINE 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define AMHEX_HAS_QUARANTINE 1
#endif
#endif
#if defined(AMHEX_HAS_QUARANTINE)
inline constexpr int64_t kQuarantineBytes = 256 << 20;
#else
inline constexpr int64_t kQuarantineBytes = 0;
#endif

// In kB: resident memory now ("VmRSS:") or at its most ("VmHWM:").
int64_t MemoryOf(pid_t pid, const std::string& which = "VmRSS:");

// A process that a test starts: `arguments` begins with the program's path. The process's standard
// error is appended to `log` unless that is empty.
pid_t StartProcess(std::vector<std::string> arguments, const std::string& log = "");
// Waits for its end: the exit code, or -1 after death by a signal.
int WaitForEnd(pid_t pid);

}  // namespace amhex::server
