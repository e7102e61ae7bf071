// A CUDA device on the host, as far as the engine uses one: streams that run late, memory that is
// counted, graphs that are recorded and replayed, and failures on demand.
//
// Nothing runs when it is asked for: commands wait in their streams until somebody waits for them
// or asks whether they are done, and then one command of every stream runs at a time. So memory
// that goes too early, or a stream that relies on another without an event, shows in the results.
// Fresh and freed memory holds a pattern that no result survives.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace amhex::emulated {

// Values of cudaError_t.
inline constexpr int kSuccess = 0;
inline constexpr int kInvalidValue = 1;
inline constexpr int kOutOfMemory = 2;
inline constexpr int kInvalidConfiguration = 9;
inline constexpr int kNotReady = 600;
inline constexpr int kIllegalAddress = 700;
inline constexpr int kCaptureUnsupported = 900;

using Command = std::function<void()>;

struct Stream {
  std::deque<Command> waiting;
  bool is_capturing = false;
  std::vector<Command> captured;
};

struct Event {
  int64_t recorded = 0;
  int64_t reached = 0;
};

struct Graph {
  std::vector<Command> commands;
};

// What tests read and set; only while no call is under way.
struct Controls {
  int64_t capacity = int64_t{8} << 30;
  int64_t used = 0;
  int64_t peak = 0;
  int64_t calls = 0;     // that may fail, so far
  int64_t waits = 0;     // calls that blocked the host
  int64_t launches = 0;  // kernels run
  int64_t replays = 0;   // graphs launched
  int64_t uploads = 0;   // copies from the host
  int64_t uploaded_bytes = 0;
  int64_t downloads = 0;  // copies to the host
  int64_t downloaded_bytes = 0;
  int64_t stray_frees = 0;
  // The call of this number fails with this code; a sticky failure is that of all that follow.
  int64_t failing_call = -1;
  int failure = kInvalidValue;
  bool is_sticky = false;
};

// Programs that nobody can reach into are told by this variable, which call of theirs fails for
// ever with an illegal access.
inline constexpr char kLastingFailureVariable[] = "AMHEX_EMULATED_LASTING_FAILURE";

class Device {
 public:
  Device() {
    const char* call = std::getenv(kLastingFailureVariable);
    if (call == nullptr) return;
    controls.failing_call = std::atoll(call);
    controls.failure = kIllegalAddress;
    controls.is_sticky = true;
  }

  std::unique_lock<std::recursive_mutex> Lock() {
    return std::unique_lock<std::recursive_mutex>(mutex_);
  }

  // The code of a call that may fail.
  int Enter() {
    if (lasting_failure_ != kSuccess) return lasting_failure_;
    if (controls.calls++ != controls.failing_call) return kSuccess;
    if (controls.is_sticky) lasting_failure_ = controls.failure;
    return controls.failure;
  }

  // As after a new start of the process.
  void Restart() {
    lasting_failure_ = kSuccess;
    const int64_t used = controls.used;
    controls = Controls();
    controls.used = controls.peak = used;
  }

  Stream* CreateStream() {
    streams_.push_back(std::make_unique<Stream>());
    return streams_.back().get();
  }
  void DestroyStream(Stream* stream) {
    Drain(*stream);
    std::erase_if(streams_, [=](const auto& own) { return own.get() == stream; });
  }

  void Enqueue(Stream& stream, Command command) {
    if (stream.is_capturing) {
      stream.captured.push_back(std::move(command));
    } else {
      stream.waiting.push_back(std::move(command));
    }
  }
  // Runs one command of every stream, the youngest stream first.
  void Advance() {
    for (size_t i = streams_.size(); i-- > 0;) {
      if (i < streams_.size() && !streams_[i]->waiting.empty()) RunNext(*streams_[i]);
    }
  }
  void Drain(Stream& stream) {
    while (!stream.waiting.empty()) RunNext(stream);
  }

  int Allocate(Stream& stream, size_t bytes, void** memory) {
    if (stream.is_capturing) return kCaptureUnsupported;
    if (controls.used + static_cast<int64_t>(bytes) > controls.capacity) return kOutOfMemory;
    *memory = std::malloc(bytes);
    std::memset(*memory, kFreshMemory, bytes);
    controls.used += static_cast<int64_t>(bytes);
    controls.peak = std::max(controls.peak, controls.used);
    sizes_[*memory] = bytes;
    return kSuccess;
  }
  // What is asked for later in the same stream may take its place.
  int Free(Stream& stream, void* memory) {
    if (stream.is_capturing) return kCaptureUnsupported;
    const auto found = sizes_.find(memory);
    if (found == sizes_.end()) {
      ++controls.stray_frees;
      return kInvalidValue;
    }
    const size_t bytes = found->second;
    sizes_.erase(found);
    controls.used -= static_cast<int64_t>(bytes);
    Enqueue(stream, [memory, bytes] {
      std::memset(memory, kFreedMemory, bytes);
      std::free(memory);
    });
    return kSuccess;
  }

  // Host memory that is not pinned is read at once, and written before the call returns.
  int Copy(Stream& stream, void* to, const void* from, size_t bytes, bool is_upload,
           bool is_download) {
    if (is_upload) ++controls.uploads, controls.uploaded_bytes += static_cast<int64_t>(bytes);
    if (is_download) ++controls.downloads, controls.downloaded_bytes += static_cast<int64_t>(bytes);
    if (is_upload && !pinned.contains(from)) {
      const auto* first = static_cast<const char*>(from);
      Enqueue(stream, [to, staged = std::vector<char>(first, first + bytes)] {
        std::memcpy(to, staged.data(), staged.size());
      });
      return kSuccess;
    }
    Enqueue(stream, [=] { std::memcpy(to, from, bytes); });
    if (is_download && !pinned.contains(to)) {
      if (stream.is_capturing) return kCaptureUnsupported;
      ++controls.waits;
      Drain(stream);
    }
    return kSuccess;
  }

  Controls controls;
  std::set<const void*> pinned;

 private:
  static constexpr int kFreshMemory = 0xCD;
  static constexpr int kFreedMemory = 0xDB;

  static void RunNext(Stream& stream) {
    const Command command = std::move(stream.waiting.front());
    stream.waiting.pop_front();
    command();
  }

  std::recursive_mutex mutex_;
  std::vector<std::unique_ptr<Stream>> streams_;
  std::map<void*, size_t> sizes_;
  int lasting_failure_ = kSuccess;
};

// The one device of the library that is built for it.
inline Device& TheDevice() {
  static Device device;
  return device;
}

inline constexpr char kDeviceSymbol[] = "AmhexEmulatedDevice";
using DeviceFunction = Device*();

}  // namespace amhex::emulated
