#include "backends.h"

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "amhex/mesher.h"
#include "base/used_threads.h"
#include "build_version.h"
#include "cuda/cuda_library.h"

namespace amhex {
namespace {

std::string DescribeCpu() {
  const int64_t threads = UsedThreads();
  return absl::StrCat("cpu (", threads, threads == 1 ? " thread)" : " threads)");
}

}  // namespace

absl::StatusOr<BackendChoice> ChooseBackend(Backend requested) {
  if (requested == Backend::kCpu) return BackendChoice{Backend::kCpu, DescribeCpu()};
  const absl::StatusOr<std::string> cuda = DescribeCuda();
  if (cuda.ok()) return BackendChoice{Backend::kCuda, *cuda};
  const std::string reason(cuda.status().message());
  if (requested == Backend::kCuda) {
    return absl::FailedPreconditionError(
        absl::StrCat("run.backend: cuda was requested and is not usable: ", reason));
  }
  // Nothing is amiss there; ListBackends has the loader's own words.
  const std::string note =
      absl::IsNotFound(cuda.status()) ? "no CUDA library is installed" : "cuda not used: " + reason;
  return BackendChoice{Backend::kCpu, absl::StrCat(DescribeCpu(), "; ", note)};
}

std::vector<BackendInfo> ListBackends() {
  const absl::StatusOr<std::string> cuda = DescribeCuda();
  return {{Backend::kCpu, true, DescribeCpu(), 0},
          {Backend::kCuda, cuda.ok(),
           cuda.ok() ? *cuda : absl::StrCat("cuda: ", std::string(cuda.status().message())),
           CudaMemoryBytes()}};
}

std::string EngineVersion() { return absl::StrCat("amhex ", kVersion, " (", kRevision, ")"); }

}  // namespace amhex
