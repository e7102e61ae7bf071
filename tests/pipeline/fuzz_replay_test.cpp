// The engine on arbitrary bytes: the corpus and many small variants of it.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "fixtures/damage.h"
#include "fuzz/fuzz_inputs.h"

namespace amhex {
namespace {

using Bytes = std::vector<uint8_t>;

std::vector<Bytes> Corpus(const std::string& target) {
  std::vector<Bytes> files;
  const std::filesystem::path folder = std::filesystem::path(AMHEX_FUZZ_CORPUS) / target;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path(), std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return files;
}

// Variants of the corpus with some bytes changed, and bytes from nowhere.
Bytes Variant(const std::vector<Bytes>& corpus, fixtures::Chance* chance) {
  Bytes bytes = corpus[chance->Below(corpus.size())];
  if (chance->Unit() < 0.3) bytes.assign(1 + chance->Below(300), 0);
  const double share = chance->Unit() * chance->Unit();
  for (uint8_t& byte : bytes) {
    if (chance->Unit() < share) byte = static_cast<uint8_t>(chance->Below(256));
  }
  return bytes;
}

TEST(FuzzReplay, AnyInputIsCheckedWithoutHarm) {
  const std::vector<Bytes> corpus = Corpus("check_input");
  ASSERT_GE(corpus.size(), 3u);
  for (const Bytes& bytes : corpus) fuzz::CheckAnyInput(bytes.data(), bytes.size());
  fixtures::Chance chance(1);
  for (int i = 0; i < 20'000; ++i) {
    const Bytes bytes = Variant(corpus, &chance);
    fuzz::CheckAnyInput(bytes.data(), bytes.size());
  }
}

TEST(FuzzReplay, SmallSoupsEndInAMeshOrAnError) {
  const std::vector<Bytes> corpus = Corpus("small_soup");
  ASSERT_GE(corpus.size(), 3u);
  for (const Bytes& bytes : corpus) fuzz::MeshSmallSoup(bytes.data(), bytes.size());
  fixtures::Chance chance(2);
  for (int i = 0; i < 150; ++i) {
    const Bytes bytes = Variant(corpus, &chance);
    fuzz::MeshSmallSoup(bytes.data(), bytes.size());
  }
}

}  // namespace
}  // namespace amhex
