// Tests on the emulated device start here.
#pragma once

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "absl/status/status.h"
#include "cuda/cuda_library.h"
#include "emulated_cuda/emulated_device.h"
#include "optimize/worth_device.h"

namespace amhex {

#if !defined(__SANITIZE_THREAD__)  // which does not follow fibers: the parity tests then skip, too
// Before the engine looks for its library, once per process.
inline const int kLibraryIsNamed = setenv("AMHEX_CUDA_LIBRARY", AMHEX_EMULATED_LIBRARY, 1);
#endif
// All sweeps of these small meshes are the device's.
inline const int64_t kVisitsWorthDevice = visits_worth_device.exchange(0);

inline emulated::Device* FindDevice() {
  void* library = dlopen(AMHEX_EMULATED_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return nullptr;
  auto* find = reinterpret_cast<emulated::DeviceFunction*>(dlsym(library, emulated::kDeviceSymbol));
  return find == nullptr ? nullptr : find();
}

class EmulatedDeviceTest : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the thread sanitizer does not follow fibers";
#endif
    device_ = FindDevice();
    ASSERT_NE(device_, nullptr);
    ASSERT_TRUE(DescribeCuda().ok()) << DescribeCuda().status();
    device_->Restart();
    ASSERT_EQ(device_->controls.used, 0);
  }

  void TearDown() override {
    if (device_ != nullptr) device_->Restart();
  }

  emulated::Controls& controls() { return device_->controls; }

  emulated::Device* device_ = nullptr;
};

// What a refusal says is needed.
inline double Announced(const absl::Status& refusal) {
  EXPECT_EQ(refusal.code(), absl::StatusCode::kResourceExhausted) << refusal;
  const std::string text(refusal.message());
  constexpr char kAnnouncement[] = "needs about ";
  const size_t at = text.find(kAnnouncement);
  EXPECT_NE(at, std::string::npos) << text;
  return at == std::string::npos ? 0 : std::stod(text.substr(at + sizeof(kAnnouncement) - 1));
}

}  // namespace amhex
