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
#include <numeric>
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
  int64_t missed = 0;  // the latest that somebody asked for too early
};

// Blocks that were freed wait here for somebody who wants as many bytes; nothing is cut or joined,
// so that memory is in as many pieces as it can be.
struct Pool {
  int64_t used = 0;
  std::multiset<size_t> unused;
  uint64_t kept_bytes = 0;  // when somebody has waited

  int64_t unused_bytes() const {
    return std::accumulate(unused.begin(), unused.end(), int64_t{0},
                           [](int64_t sum, size_t bytes) { return sum + int64_t(bytes); });
  }
};

struct Graph {
  std::vector<Command> commands;
};

// What tests read and set; only while no call is under way.
struct Controls {
  int64_t capacity = int64_t{8} << 30;
  int64_t used = 0;
  int64_t unused = 0;    // held by pools
  int64_t peak = 0;      // of what is used
  int64_t calls = 0;     // that may fail, so far
  int64_t waits = 0;     // calls that blocked the host
  int64_t looks = 0;     // events that the host asked for before they were reached
  int64_t made = 0;      // streams, pools and pieces of pinned memory
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
    // Somebody else has taken the rest.
    if (controls.failure == kOutOfMemory) controls.capacity = controls.used;
    return controls.failure;
  }

  // As after a new start of the process.
  void Restart() {
    lasting_failure_ = kSuccess;
    const int64_t used = controls.used, unused = controls.unused;
    controls = Controls();
    controls.used = controls.peak = used;
    controls.unused = unused;
  }

  Stream* CreateStream() {
    ++controls.made;
    streams_.push_back(std::make_unique<Stream>());
    return streams_.back().get();
  }
  void DestroyStream(Stream* stream) {
    Drain(*stream);
    std::erase_if(streams_, [=](const auto& own) { return own.get() == stream; });
  }

  Pool* CreatePool() {
    ++controls.made;
    pools_.push_back(std::make_unique<Pool>());
    return pools_.back().get();
  }
  // It ends with what is taken from it.
  void DestroyPool(Pool* pool) {
    Trim(*pool);
    pool->kept_bytes = 0;
  }
  void Trim(Pool& pool) {
    controls.unused -= pool.unused_bytes();
    pool.unused.clear();
  }
  // Somebody has waited.
  void ReleaseUnused() {
    for (const auto& pool : pools_) {
      const int64_t held = pool->used + pool->unused_bytes();
      if (held > static_cast<int64_t>(pool->kept_bytes)) Trim(*pool);
    }
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

  int Allocate(Stream& stream, Pool& pool, size_t bytes, void** memory) {
    if (stream.is_capturing) return kCaptureUnsupported;
    const auto size = static_cast<int64_t>(bytes);
    const auto again = pool.unused.find(bytes);
    if (again != pool.unused.end()) {
      pool.unused.erase(again);
      controls.unused -= size;
    } else if (controls.used + controls.unused + size > controls.capacity) {
      return kOutOfMemory;
    }
    *memory = std::malloc(bytes);
    std::memset(*memory, kFreshMemory, bytes);
    pool.used += size;
    controls.used += size;
    controls.peak = std::max(controls.peak, controls.used);
    blocks_[*memory] = {bytes, &pool};
    return kSuccess;
  }
  // What is asked for later in the same stream may take its place.
  int Free(Stream& stream, void* memory) {
    if (stream.is_capturing) return kCaptureUnsupported;
    const auto found = blocks_.find(memory);
    if (found == blocks_.end()) {
      ++controls.stray_frees;
      return kInvalidValue;
    }
    const auto [bytes, pool] = found->second;
    blocks_.erase(found);
    pool->used -= static_cast<int64_t>(bytes);
    controls.used -= static_cast<int64_t>(bytes);
    if (pool->kept_bytes > 0) {
      pool->unused.insert(bytes);
      controls.unused += static_cast<int64_t>(bytes);
    }
    Enqueue(stream, [memory = memory, bytes = bytes] {
      std::memset(memory, kFreedMemory, bytes);
      std::free(memory);
    });
    return kSuccess;
  }

  void* AllocatePinned(size_t bytes) {
    ++controls.made;
    void* const memory = std::malloc(bytes);
    pinned_[static_cast<const char*>(memory)] = bytes;
    return memory;
  }
  void FreePinned(void* memory) {
    pinned_.erase(static_cast<const char*>(memory));
    std::free(memory);
  }
  bool IsPinned(const void* place) const {
    const auto* const byte = static_cast<const char*>(place);
    auto next = pinned_.upper_bound(byte);
    if (next == pinned_.begin()) return false;
    --next;
    return byte < next->first + next->second;
  }

  // Host memory that is not pinned is read at once, and written before the call returns.
  int Copy(Stream& stream, void* to, const void* from, size_t bytes, bool is_upload,
           bool is_download) {
    if (is_upload) ++controls.uploads, controls.uploaded_bytes += static_cast<int64_t>(bytes);
    if (is_download) ++controls.downloads, controls.downloaded_bytes += static_cast<int64_t>(bytes);
    if (is_upload && !IsPinned(from)) {
      const auto* first = static_cast<const char*>(from);
      Enqueue(stream, [to, staged = std::vector<char>(first, first + bytes)] {
        std::memcpy(to, staged.data(), staged.size());
      });
      return kSuccess;
    }
    Enqueue(stream, [=] { std::memcpy(to, from, bytes); });
    if (is_download && !IsPinned(to)) {
      if (stream.is_capturing) return kCaptureUnsupported;
      ++controls.waits;
      Drain(stream);
    }
    return kSuccess;
  }

  Controls controls;

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
  std::vector<std::unique_ptr<Pool>> pools_;
  struct Block {
    size_t bytes;
    Pool* pool;
  };
  std::map<void*, Block> blocks_;
  std::map<const char*, size_t> pinned_;
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
