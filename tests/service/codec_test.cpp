// Bytes to the engine's types and back.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <draco/point_cloud/point_cloud_builder.h>
#include <gtest/gtest.h>

#include <cstring>

#include "errors.h"
#include "files.h"
#include "hull_arrays.h"
#include "mesh_codec.h"
#include "service_fixtures.h"
#include "surface_codec.h"

namespace amhex::server {
namespace {

constexpr auto kDraco = amhex::v1::INPUT_ENCODING_DRACO;
constexpr auto kArrays = amhex::v1::INPUT_ENCODING_ARRAYS;

TriangleMesh Cube() {
  const auto hull = DecodeInput(kArrays, CubeInput(), Limits());
  return hull.ok() ? std::get<TriangleMesh>(hull->hull) : TriangleMesh();
}

std::string Bytes(const draco::EncoderBuffer& buffer) {
  return std::string(buffer.data(), buffer.size());
}

std::string DracoCube() {
  const TriangleMesh cube = Cube();
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(cube.triangles.size()));
  const int position =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (size_t i = 0; i < cube.triangles.size(); ++i) {
    float corners[3][3];
    for (size_t c = 0; c < 3; ++c) {
      const Vec3d& p = cube.vertices[static_cast<size_t>(cube.triangles[i][c])];
      for (int axis = 0; axis < 3; ++axis) corners[c][axis] = static_cast<float>(p[axis]);
    }
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(static_cast<uint32_t>(i)),
                                      corners[0], corners[1], corners[2]);
  }
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*builder.Finalize(), &buffer).ok());
  return Bytes(buffer);
}

std::string DracoCloud(int method) {
  draco::PointCloudBuilder builder;
  constexpr uint32_t kPoints = 100;
  builder.Start(kPoints);
  const int position =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int normal = builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
  for (uint32_t i = 0; i < kPoints; ++i) {
    const float point[3] = {static_cast<float>(i), static_cast<float>(i % 7), 0.5f};
    const float up[3] = {0, 0, 1};
    builder.SetAttributeValueForPoint(position, draco::PointIndex(i), point);
    builder.SetAttributeValueForPoint(normal, draco::PointIndex(i), up);
  }
  draco::Encoder encoder;
  encoder.SetEncodingMethod(method);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, 10);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodePointCloudToBuffer(*builder.Finalize(false), &buffer).ok());
  return Bytes(buffer);
}

AtMostHexaMesh SmallMesh() {
  AtMostHexaMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1.0 / 3}};
  mesh.corners = {{0, 1, 1, 2, 0, 4, 4, 2}, {0, 1, 2, 3, 4, 4, 4, 4}};
  mesh.types = {PrimitiveType::kTetrahedron, PrimitiveType::kPyramid};
  mesh.quality = {0.5f, 0.75f};
  return mesh;
}

TEST(SurfaceCodec, ArraysComeBackBitForBit) {
  TriangleMesh cube = Cube();
  ASSERT_EQ(cube.triangles.size(), 12u);
  cube.vertices[0].x = 1.0 / 3;
  const auto back = DecodeInput(kArrays, EncodeHullArrays({cube, {}}), Limits());
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(std::get<TriangleMesh>(back->hull).vertices, cube.vertices);
  EXPECT_EQ(std::get<TriangleMesh>(back->hull).triangles, cube.triangles);
  const PointCloud cloud{cube.vertices, cube.vertices};
  const auto points = DecodeInput(kArrays, EncodeHullArrays({cloud, {}}), Limits());
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(std::get<PointCloud>(points->hull).normals, cloud.normals);
}

MeshingInput GuidedVolume() {
  VolumeMesh volume;
  volume.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1.0 / 3}};
  volume.cell_faces = {4};
  volume.face_corners = {3, 3, 3, 3};
  volume.corners = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  return {volume, {{{{1, 2, 3}, {0, 0, 1}, {1, 0, 0}}}, {{{4, 5, 6}, {0, 1, 0}}}}};
}

TEST(SurfaceCodec, CellsAndGuidanceComeBackBitForBit) {
  const MeshingInput input = GuidedVolume();
  const auto back = DecodeInput(kArrays, EncodeHullArrays(input), Limits());
  ASSERT_TRUE(back.ok()) << back.status();
  const auto& volume = std::get<VolumeMesh>(back->hull);
  const auto& sent = std::get<VolumeMesh>(input.hull);
  EXPECT_EQ(volume.vertices, sent.vertices);
  EXPECT_EQ(volume.cell_faces, sent.cell_faces);
  EXPECT_EQ(volume.face_corners, sent.face_corners);
  EXPECT_EQ(volume.corners, sent.corners);
  ASSERT_EQ(back->guidance.samples.size(), 1u);
  EXPECT_EQ(back->guidance.samples[0].second_axis, (Vec3d{1, 0, 0}));
  ASSERT_EQ(back->guidance.planes.size(), 1u);
  EXPECT_EQ(back->guidance.planes[0].point, (Vec3d{4, 5, 6}));

  MeshingInput guided{Cube(), input.guidance};
  const auto surface = DecodeInput(kArrays, EncodeHullArrays(guided), Limits());
  ASSERT_TRUE(surface.ok()) << surface.status();
  EXPECT_EQ(std::get<TriangleMesh>(surface->hull).triangles, Cube().triangles);
  EXPECT_EQ(surface->guidance.samples.size(), 1u);
}

TEST(SurfaceCodec, ExtendedArraysAreCheckedBeforeTheyAreRead) {
  const std::string bytes = EncodeHullArrays(GuidedVolume());
  for (size_t size = 0; size < bytes.size(); size += 5) {
    const auto cut = DecodeInput(kArrays, bytes.substr(0, size), Limits());
    EXPECT_FALSE(cut.ok()) << size;
  }
  for (const size_t count_at : {16, 24, 32, 40, 48, 56, 64}) {
    for (const int64_t count : {int64_t{-1}, int64_t{1} << 40, int64_t{2}}) {
      std::string wrong = bytes;
      std::memcpy(wrong.data() + count_at, &count, sizeof(count));
      EXPECT_FALSE(DecodeInput(kArrays, wrong, Limits()).ok()) << count_at << " " << count;
    }
  }
  Limits limits;
  limits.max_triangle_count = 3;
  EXPECT_EQ(ReasonOf(DecodeInput(kArrays, bytes, limits).status()), "INPUT_TOO_LARGE");
}

TEST(SurfaceCodec, IndexOutOfRangeIsNamed) {
  TriangleMesh cube = Cube();
  cube.triangles[5][1] = 8;
  const auto refused = DecodeInput(kArrays, EncodeHullArrays({cube, {}}), Limits());
  EXPECT_EQ(ReasonOf(refused.status()), "INPUT_INVALID");
  EXPECT_NE(std::string(refused.status().message()).find("triangle 5"), std::string::npos);
}

TEST(SurfaceCodec, DracoMeshKeepsItsTopologyWithCornersWelded) {
  const auto hull = DecodeInput(kDraco, DracoCube(), Limits());
  ASSERT_TRUE(hull.ok()) << hull.status();
  const auto& mesh = std::get<TriangleMesh>(hull->hull);
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.triangles.size(), 12u);
}

TEST(SurfaceCodec, DracoCloudsOfBothMethodsKeepPointsAndNormals) {
  for (const int method :
       {draco::POINT_CLOUD_SEQUENTIAL_ENCODING, draco::POINT_CLOUD_KD_TREE_ENCODING}) {
    const auto hull = DecodeInput(kDraco, DracoCloud(method), Limits());
    ASSERT_TRUE(hull.ok()) << hull.status();
    const auto& cloud = std::get<PointCloud>(hull->hull);
    ASSERT_EQ(cloud.points.size(), 100u);
    ASSERT_EQ(cloud.normals.size(), 100u);
    for (const Vec3d& normal : cloud.normals) EXPECT_NEAR(normal.z, 1.0, 1e-2);
  }
}

TEST(SurfaceCodec, DamagedDracoFilesNeverCrash) {
  const std::string files[] = {DracoCube(), DracoCloud(draco::POINT_CLOUD_SEQUENTIAL_ENCODING)};
  for (const std::string& file : files) {
    for (size_t size = 0; size < file.size(); ++size) {
      const auto hull = DecodeInput(kDraco, file.substr(0, size), Limits());
      EXPECT_FALSE(ReasonOf(hull.status()).empty()) << size << " bytes";
    }
  }
}

TEST(SurfaceCodec, InputBeyondTheLimitsIsRefused) {
  Limits limits;
  limits.max_triangle_count = 11;
  EXPECT_EQ(ReasonOf(DecodeInput(kArrays, CubeInput(), limits).status()), "INPUT_TOO_LARGE");
  EXPECT_EQ(ReasonOf(DecodeInput(kDraco, DracoCube(), limits).status()), "INPUT_TOO_LARGE");
}

TEST(MeshCodec, MeshComesBackBitForBit) {
  TemporaryFolder folder;
  const AtMostHexaMesh mesh = SmallMesh();
  ASSERT_TRUE(WriteMeshFile(mesh, folder / "mesh").ok());
  const auto bytes = ReadWholeFile(folder / "mesh");
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(static_cast<int64_t>(bytes->size()), EncodedMeshBytes(mesh));
  const auto back = DecodeMesh(*bytes);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->vertices, mesh.vertices);
  EXPECT_EQ(back->corners, mesh.corners);
  EXPECT_EQ(back->types, mesh.types);
  EXPECT_EQ(back->quality, mesh.quality);
}

TEST(MeshCodec, LayoutIsAsDocumented) {
  TemporaryFolder folder;
  const AtMostHexaMesh mesh = SmallMesh();
  ASSERT_TRUE(WriteMeshFile(mesh, folder / "mesh").ok());
  const std::string bytes = *ReadWholeFile(folder / "mesh");
  EXPECT_EQ(bytes.substr(0, 8), "AMHEXVOL");
  EXPECT_EQ(bytes.substr(8, 4), LittleEndian(1, 4));
  EXPECT_EQ(bytes.substr(12, 4), LittleEndian(0, 4));
  EXPECT_EQ(bytes.substr(16, 8), LittleEndian(5, 8));
  EXPECT_EQ(bytes.substr(24, 8), LittleEndian(2, 8));
  const size_t corners = 32 + 24 * 5;
  EXPECT_EQ(bytes.substr(corners + 4, 4), LittleEndian(1, 4));
  EXPECT_EQ(bytes.substr(bytes.size() - 2), std::string("\1\4"));
}

TEST(MeshCodec, EveryTruncationAndBadIndexIsRefused) {
  TemporaryFolder folder;
  ASSERT_TRUE(WriteMeshFile(SmallMesh(), folder / "mesh").ok());
  const std::string bytes = *ReadWholeFile(folder / "mesh");
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeMesh(bytes.substr(0, size)).ok()) << size;
  }
  std::string bad_index = bytes;
  bad_index[32 + 24 * 5] = 5;
  EXPECT_FALSE(DecodeMesh(bad_index).ok());
  std::string bad_type = bytes;
  bad_type.back() = 3;
  EXPECT_FALSE(DecodeMesh(bad_type).ok());
  std::string huge = bytes;
  huge.replace(16, 8, LittleEndian(uint64_t{1} << 62, 8));
  EXPECT_FALSE(DecodeMesh(huge).ok());
}

TEST(MeshCodec, EmptyMeshComesBack) {
  TemporaryFolder folder;
  ASSERT_TRUE(WriteMeshFile(AtMostHexaMesh(), folder / "mesh").ok());
  EXPECT_TRUE(DecodeMesh(*ReadWholeFile(folder / "mesh")).ok());
}

}  // namespace
}  // namespace amhex::server
