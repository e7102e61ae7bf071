// Runs a fuzz target over files, without a fuzzer: the corpus as an ordinary test. Each file is
// also tried cut short at every length and with each of its first bytes changed.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

constexpr size_t kMaxVariedBytes = 512;

void Run(const std::string& bytes) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

void RunVariants(const std::string& bytes) {
  Run(bytes);
  const size_t varied = std::min(bytes.size(), kMaxVariedBytes);
  for (size_t i = 0; i < varied; ++i) {
    Run(bytes.substr(0, i));
    for (const char mask : {'\x01', '\x80', '\xff'}) {
      std::string changed = bytes;
      changed[i] = static_cast<char>(changed[i] ^ mask);
      Run(changed);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  int count = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
      std::ifstream file(entry.path(), std::ios::binary);
      RunVariants({std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()});
      ++count;
    }
  }
  std::cout << count << " files\n";
  return count > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
