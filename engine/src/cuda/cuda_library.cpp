#include "cuda/cuda_library.h"

#include <dlfcn.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "amhex/mesher.h"
#include "base/status_macros.h"
#include "cuda/device_time.h"

namespace amhex {
namespace {

constexpr size_t kTextCapacity = 512;
std::atomic<bool> is_device_lost{false};
thread_local double device_seconds = 0;

struct CudaLibrary {
  AmhexDescribeCudaFunction* describe = nullptr;
  AmhexRunOnCudaFunction* run = nullptr;
};

// AMHEX_CUDA_LIBRARY names the file; otherwise it lies beside the program, in the lib folder of
// the same prefix, in the engine's build folder, or where the loader looks.
std::vector<std::string> PossiblePaths() {
  // No thread of these programs changes the environment.
  const char* named = std::getenv("AMHEX_CUDA_LIBRARY");  // NOLINT(concurrency-mt-unsafe)
  if (named != nullptr) return {named};
  std::vector<std::string> paths;
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) {
    const std::filesystem::path folder = program.parent_path();
    for (const char* relative : {".", "../lib", "../lib/amhex", "../engine"}) {
      const std::filesystem::path path = folder / relative / kCudaLibraryName;
      if (std::filesystem::exists(path, error)) paths.push_back(path.string());
    }
  }
  paths.emplace_back(kCudaLibraryName);
  return paths;
}

// Why dlopen refused `path`: NOT_FOUND where the loader was asked to search and found nothing,
// which is how a machine for the CPU looks; a library that lacks one of its own names that other
// one.
absl::Status WhyNotOpened(const std::string& path, const std::string& text) {
  const bool is_missing =
      path == kCudaLibraryName && absl::StartsWith(text, path + ": cannot open");
  if (is_missing) return absl::NotFoundError(absl::StrCat("no CUDA library is installed: ", text));
  return absl::FailedPreconditionError(absl::StrCat("the library could not be loaded: ", text));
}

absl::StatusOr<CudaLibrary> OpenLibrary() {
  absl::Status reason;  // of the first file that is there
  for (const std::string& path : PossiblePaths()) {
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
      // glibc keeps it per thread.
      reason.Update(WhyNotOpened(path, dlerror()));  // NOLINT(concurrency-mt-unsafe)
      continue;
    }
    CudaLibrary library;
    library.describe =
        reinterpret_cast<AmhexDescribeCudaFunction*>(dlsym(handle, kDescribeCudaSymbol));
    library.run = reinterpret_cast<AmhexRunOnCudaFunction*>(dlsym(handle, kRunOnCudaSymbol));
    if (library.describe != nullptr && library.run != nullptr) return library;
    reason.Update(
        absl::FailedPreconditionError(absl::StrCat(kCudaLibraryName, " is of another version")));
    dlclose(handle);
  }
  return reason;
}

const absl::StatusOr<CudaLibrary>& Library() {
  static const absl::StatusOr<CudaLibrary> kLibrary = OpenLibrary();
  return kLibrary;
}

struct CudaDevice {
  std::string description;
  int64_t memory_bytes = 0;
};

absl::StatusOr<CudaDevice> AskForDevice() {
  AMHEX_ASSIGN_OR_RETURN(const CudaLibrary library, Library());
  std::array<char, kTextCapacity> text{};
  CudaDevice device;
  if (library.describe(&device.memory_bytes, text.data(), text.size()) != CudaResult::kDone) {
    return absl::FailedPreconditionError(text.data());
  }
  device.description = text.data();
  return device;
}

const absl::StatusOr<CudaDevice>& Device() {
  static const absl::StatusOr<CudaDevice> kDevice = AskForDevice();
  return kDevice;
}

}  // namespace

double DeviceSecondsOfThread() { return device_seconds; }

bool IsDeviceLost() { return is_device_lost; }

absl::StatusOr<std::string> DescribeCuda() {
  if (!Device().ok()) return Device().status();
  return Device()->description;
}

int64_t CudaMemoryBytes() { return Device().ok() ? Device()->memory_bytes : 0; }

absl::StatusOr<bool> RunOnCuda(const CudaTask& task) {
  AMHEX_ASSIGN_OR_RETURN(const CudaLibrary library, Library());
  std::array<char, kTextCapacity> text{};
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const CudaResult result = library.run(&task, text.data(), text.size());
  device_seconds += std::chrono::duration<double>(Clock::now() - start).count();
  switch (result) {
    case CudaResult::kDone:
      return true;
    case CudaResult::kStopped:
      return false;
    case CudaResult::kNoDevice:
      return absl::FailedPreconditionError(text.data());
    case CudaResult::kOutOfMemory:
      return absl::ResourceExhaustedError(text.data());
    case CudaResult::kDeviceLost:
      is_device_lost = true;
      return absl::InternalError(absl::StrCat(
          "the CUDA device failed and this process cannot use it any more: ", text.data()));
    case CudaResult::kFailed:
      return absl::InternalError(text.data());
  }
  return absl::InternalError("the CUDA library answered with an unknown result");
}

}  // namespace amhex
