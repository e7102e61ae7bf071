#include "draco_preflight.h"

#include <gtest/gtest.h>

#include <random>

#include "errors.h"
#include "input_preflight.h"
#include "service_fixtures.h"

namespace amhex::server {
namespace {

constexpr int kCloud = 0;
constexpr int kMesh = 1;
constexpr int kMetadata = 0x8000;

InputBytes Whole(const std::string& bytes) {
  return {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(),
          static_cast<int64_t>(bytes.size())};
}

std::string Refusal(const std::string& bytes) {
  return ReasonOf(PreflightDraco(Whole(bytes), Limits()).status());
}

std::string SequentialCloud(uint32_t point_count) {
  return DracoFileHeader(2, 3, kCloud, 0) + LittleEndian(point_count, 4) + '\1' + Varint(1) +
         std::string(32, 'x');
}

std::string EdgebreakerMesh(uint64_t vertices, uint64_t faces, uint64_t symbols) {
  return DracoFileHeader(2, 2, kMesh, 1) + '\0' + Varint(vertices) + Varint(faces) + '\1' +
         Varint(symbols) + Varint(0) + std::string(32, 'x');
}

TEST(DracoPreflight, ReadsTheCountsOfAPointCloud) {
  const auto header = PreflightDraco(Whole(SequentialCloud(1000)), Limits());
  ASSERT_TRUE(header.ok()) << header.status();
  EXPECT_FALSE(header->is_mesh);
  EXPECT_EQ(header->point_count, 1000);
  EXPECT_EQ(header->attribute_count, 1);
}

TEST(DracoPreflight, ReadsTheCountsOfBothKindsOfMesh) {
  const auto edgebreaker = PreflightDraco(Whole(EdgebreakerMesh(500, 900, 880)), Limits());
  ASSERT_TRUE(edgebreaker.ok()) << edgebreaker.status();
  EXPECT_EQ(edgebreaker->point_count, 500);
  EXPECT_EQ(edgebreaker->triangle_count, 900);
  const auto sequential =
      PreflightDraco(Whole(DracoFileHeader(2, 2, kMesh, 0) + Varint(900) + Varint(500)), Limits());
  ASSERT_TRUE(sequential.ok()) << sequential.status();
  EXPECT_EQ(sequential->point_count, 500);
  EXPECT_EQ(sequential->triangle_count, 900);
}

TEST(DracoPreflight, EmptyInputIsEmpty) { EXPECT_EQ(Refusal(""), "INPUT_EMPTY"); }

TEST(DracoPreflight, EveryTruncationIsMalformed) {
  const std::string whole = EdgebreakerMesh(500, 900, 880);
  const size_t header_size = whole.size() - 32;
  for (size_t size = 1; size < header_size; ++size) {
    EXPECT_EQ(Refusal(whole.substr(0, size)), "INPUT_MALFORMED") << size << " bytes";
  }
}

TEST(DracoPreflight, OtherFilesAreMalformed) {
  EXPECT_EQ(Refusal("ply\nformat ascii 1.0\n"), "INPUT_MALFORMED");
  EXPECT_EQ(Refusal(DracoFileHeader(9, 9, kMesh, 1) + std::string(20, '\1')), "INPUT_MALFORMED");
  EXPECT_EQ(Refusal(DracoFileHeader(2, 2, 7, 1) + std::string(20, '\1')), "INPUT_MALFORMED");
  EXPECT_EQ(Refusal(DracoFileHeader(2, 2, kMesh, 7) + std::string(20, '\1')), "INPUT_MALFORMED");
}

TEST(DracoPreflight, AbsurdCountsInSmallFilesAreTooLarge) {
  for (const uint32_t count : {100'000u, 100'000'000u, 2'147'483'647u}) {
    EXPECT_EQ(Refusal(SequentialCloud(count)), "INPUT_TOO_LARGE") << count;
    EXPECT_EQ(Refusal(DracoFileHeader(2, 3, kCloud, 1) + LittleEndian(count, 4) + '\1'),
              "INPUT_TOO_LARGE")
        << count;
    EXPECT_EQ(Refusal(EdgebreakerMesh(count, count, count)), "INPUT_TOO_LARGE") << count;
    EXPECT_EQ(Refusal(DracoFileHeader(2, 2, kMesh, 0) + Varint(count) + Varint(3)),
              "INPUT_TOO_LARGE")
        << count;
  }
}

TEST(DracoPreflight, KdTreesWhoseOwnCountNothingBoundsAreMalformed) {
  const auto cloud = [](int major, int minor) {
    return DracoFileHeader(major, minor, kCloud, 1) + LittleEndian(65, 4) + std::string(40, '\1');
  };
  EXPECT_EQ(Refusal(cloud(2, 2)), "INPUT_MALFORMED");
  EXPECT_EQ(Refusal(cloud(1, 127)), "INPUT_MALFORMED");
  EXPECT_TRUE(PreflightDraco(Whole(cloud(2, 3)), Limits()).ok());
}

TEST(DracoPreflight, NegativeCountIsMalformed) {
  EXPECT_EQ(Refusal(SequentialCloud(0x80000000u)), "INPUT_MALFORMED");
}

TEST(DracoPreflight, OverlongNumbersAreMalformed) {
  EXPECT_EQ(Refusal(DracoFileHeader(2, 2, kMesh, 0) + std::string(20, '\xff')), "INPUT_MALFORMED");
}

TEST(DracoPreflight, ContradictoryMeshCountsAreMalformed) {
  EXPECT_EQ(Refusal(EdgebreakerMesh(100, 900, 1000)), "INPUT_MALFORMED");
  EXPECT_EQ(Refusal(EdgebreakerMesh(100, 900, 10)), "INPUT_MALFORMED");
  EXPECT_EQ(Refusal(EdgebreakerMesh(4000, 900, 880)), "INPUT_MALFORMED");
}

TEST(DracoPreflight, InputsWithoutElementsAreEmpty) {
  EXPECT_EQ(Refusal(SequentialCloud(0)), "INPUT_EMPTY");
  EXPECT_EQ(Refusal(DracoFileHeader(2, 2, kMesh, 0) + Varint(0) + Varint(3)), "INPUT_EMPTY");
}

TEST(DracoPreflight, TooManyAttributesAreTooLarge) {
  EXPECT_EQ(
      Refusal(DracoFileHeader(2, 3, kCloud, 0) + LittleEndian(10, 4) + '\1' + Varint(1'000'000)),
      "INPUT_TOO_LARGE");
}

TEST(DracoPreflight, MetadataIsSkipped) {
  const std::string entry = std::string("\4name", 5) + Varint(3) + "abc";
  const std::string child = std::string("\5child", 6) + Varint(1) + entry + Varint(0);
  const std::string metadata = Varint(0) + Varint(1) + entry + Varint(1) + child;
  const std::string file =
      DracoFileHeader(2, 2, kMesh, 0, kMetadata) + metadata + Varint(4) + Varint(4);
  const auto header = PreflightDraco(Whole(file), Limits());
  ASSERT_TRUE(header.ok()) << header.status();
  EXPECT_EQ(header->triangle_count, 4);
}

TEST(DracoPreflight, DeepOrEndlessMetadataIsMalformed) {
  std::string nested = Varint(0);
  for (int i = 0; i < 1000; ++i) nested += Varint(0) + Varint(1) + std::string("\1x", 2);
  EXPECT_EQ(Refusal(DracoFileHeader(2, 2, kMesh, 0, kMetadata) + nested), "INPUT_MALFORMED");
  EXPECT_EQ(Refusal(DracoFileHeader(2, 2, kMesh, 0, kMetadata) + Varint(0) + Varint(4'000'000'000) +
                    std::string(100, '\0')),
            "INPUT_MALFORMED");
}

TEST(DracoPreflight, CountsBeyondTheBytesAtHandAreLeftOpen) {
  const std::string file = EdgebreakerMesh(500, 900, 880);
  InputBytes beginning = Whole(file);
  beginning.size = 12;
  EXPECT_TRUE(absl::IsOutOfRange(PreflightDraco(beginning, Limits()).status()));
  EXPECT_TRUE(PreflightInput(amhex::v1::INPUT_ENCODING_DRACO, beginning, Limits()).ok());
}

TEST(DracoPreflight, RandomBytesNeverPassAsMoreThanTheLimits) {
  std::mt19937 random(20240601);
  const Limits limits;
  for (int round = 0; round < 20'000; ++round) {
    std::string file =
        DracoFileHeader(2, 2, static_cast<int>(random() % 2), static_cast<int>(random() % 2),
                        random() % 4 == 0 ? kMetadata : 0);
    const size_t size = random() % 60;
    for (size_t i = 0; i < size; ++i) file.push_back(static_cast<char>(random()));
    const auto header = PreflightDraco(Whole(file), limits);
    if (!header.ok()) {
      EXPECT_FALSE(ReasonOf(header.status()).empty());
      continue;
    }
    EXPECT_LE(header->point_count, 65'536);
    EXPECT_LE(header->triangle_count, 65'536);
  }
}

TEST(ArraysPreflight, AcceptsTheCube) {
  const std::string cube = CubeInput();
  const auto header = PreflightHullArrays(Whole(cube), Limits());
  ASSERT_TRUE(header.ok()) << header.status();
  EXPECT_EQ(header->point_count, 8);
  EXPECT_EQ(header->triangle_count, 12);
}

TEST(ArraysPreflight, EverySizeButTheAnnouncedOneIsMalformed) {
  const std::string cube = CubeInput();
  for (size_t size = 1; size < cube.size(); ++size) {
    const std::string part = cube.substr(0, size);
    EXPECT_EQ(ReasonOf(PreflightHullArrays(Whole(part), Limits()).status()), "INPUT_MALFORMED");
  }
  const std::string more = cube + "x";
  EXPECT_EQ(ReasonOf(PreflightHullArrays(Whole(more), Limits()).status()), "INPUT_MALFORMED");
}

TEST(ArraysPreflight, AbsurdCountsAreTooLarge) {
  std::string cube = CubeInput();
  cube.replace(16, 8, LittleEndian(uint64_t{1} << 60, 8));
  EXPECT_EQ(ReasonOf(PreflightHullArrays(Whole(cube), Limits()).status()), "INPUT_TOO_LARGE");
}

}  // namespace
}  // namespace amhex::server
