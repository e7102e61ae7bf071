#include "exec/uploaded_arrays.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "exec/cpu_executor.h"

namespace amhex {
namespace {

struct ThreeArrays {
  ArrayView<uint8_t> bytes;
  ArrayView<double> doubles;
  ArrayView<int32_t> numbers;
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(bytes), visit(doubles), visit(numbers);
  }
};

// The arrays that a structure views.
struct OwnedArrays {
  std::vector<uint8_t> bytes;
  std::vector<double> doubles;
  std::vector<int32_t> numbers;
  ThreeArrays View() {
    return {{bytes.data(), static_cast<int64_t>(bytes.size())},
            {doubles.data(), static_cast<int64_t>(doubles.size())},
            {numbers.data(), static_cast<int64_t>(numbers.size())}};
  }
  bool operator==(const OwnedArrays&) const = default;
};

OwnedArrays ArraysOf(size_t byte_count, size_t double_count, size_t number_count) {
  OwnedArrays arrays;
  for (size_t i = 0; i < byte_count; ++i) arrays.bytes.push_back(static_cast<uint8_t>(i * 7));
  for (size_t i = 0; i < double_count; ++i) arrays.doubles.push_back(static_cast<double>(i) / 3);
  for (size_t i = 0; i < number_count; ++i) arrays.numbers.push_back(static_cast<int32_t>(i) - 5);
  return arrays;
}

// Small ones, large ones, both, and none.
TEST(UploadedArrays, GoThereAndComeBackAsTheyAre) {
  for (const auto& [bytes, doubles, numbers] :
       {std::array<size_t, 3>{3, 5, 7}, std::array<size_t, 3>{100000, 20000, 30000},
        std::array<size_t, 3>{3, 20000, 7}, std::array<size_t, 3>{100000, 1, 2},
        std::array<size_t, 3>{0, 2, 0}, std::array<size_t, 3>{0, 0, 0}}) {
    OwnedArrays there = ArraysOf(bytes, doubles, numbers), back = there;
    const OwnedArrays expected = there;
    CpuExecutor executor;
    UploadedArrays<CpuExecutor> arrays(executor);
    const ThreeArrays copies = arrays.Upload(there.View());
    there = ArraysOf(0, 0, 0);
    back.bytes.assign(bytes, 0), back.doubles.assign(doubles, 0), back.numbers.assign(numbers, 0);
    arrays.Download(copies, back.View());
    EXPECT_TRUE(back == expected);
  }
}

// Whatever bodies read at once.
TEST(UploadedArrays, AreAlignedForTheirElements) {
  OwnedArrays host = ArraysOf(3, 5, 7);
  CpuExecutor executor;
  UploadedArrays<CpuExecutor> arrays(executor);
  const ThreeArrays copies = arrays.Upload(host.View());
  EXPECT_EQ(reinterpret_cast<uintptr_t>(copies.doubles.data) % alignof(double), 0U);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(copies.numbers.data) % alignof(int32_t), 0U);
  copies.bytes[2] = 9;
  EXPECT_EQ(copies.doubles[4], host.doubles[4]);
}

}  // namespace
}  // namespace amhex
