#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "absl/strings/str_cat.h"
#include "formats/draco_encoder.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/hull_writer.h"

namespace amhex::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr HullFormat kFormats[] = {HullFormat::kDraco, HullFormat::kPly, HullFormat::kObj,
                                   HullFormat::kOff, HullFormat::kStl};

TriangleMesh Tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
}

PointCloud Cloud(int count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  PointCloud cloud;
  for (int i = 0; i < count; ++i) {
    const Vec3d n = Normalized(Vec3d{normal(random), normal(random), normal(random)});
    cloud.normals.push_back(n);
    cloud.points.push_back(n * 3.0);
  }
  return cloud;
}

std::string Message(const absl::StatusOr<InputHull>& hull) {
  return hull.ok() ? "accepted" : std::string(hull.status().message());
}

double Volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += Determinant(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) / 6;
  }
  return sum;
}

TEST(Readers, EveryFormatGivesBackTheSurfaceThatWasWritten) {
  for (HullFormat format : kFormats) {
    const auto bytes = FormatHull(Tetrahedron(), format);
    ASSERT_TRUE(bytes.ok());
    const auto hull = ReadHull(format, *bytes);
    ASSERT_TRUE(hull.ok()) << static_cast<int>(format) << ": " << hull.status();
    const auto& mesh = std::get<TriangleMesh>(*hull);
    EXPECT_EQ(mesh.vertices.size(), 4u) << static_cast<int>(format);
    EXPECT_EQ(mesh.triangles.size(), 4u) << static_cast<int>(format);
    EXPECT_NEAR(Volume(mesh), 1.0 / 6, 1e-7) << static_cast<int>(format);
  }
}

TEST(Readers, PlyDracoObjAndXyzKeepCloudsWithTheirNormals) {
  const PointCloud cloud = Cloud(50);
  for (HullFormat format :
       {HullFormat::kPly, HullFormat::kDraco, HullFormat::kObj, HullFormat::kXyz}) {
    const auto bytes = FormatHull(cloud, format);
    ASSERT_TRUE(bytes.ok());
    const auto hull = ReadHull(format, *bytes);
    ASSERT_TRUE(hull.ok()) << hull.status();
    const auto& read = std::get<PointCloud>(*hull);
    ASSERT_EQ(read.points.size(), 50u);
    ASSERT_EQ(read.normals.size(), 50u);
    for (size_t i = 0; i < 50; ++i) {
      EXPECT_LT(Norm(read.points[i] - read.normals[i] * 3.0), 1e-5);
    }
  }
}

TEST(Readers, EveryTruncationIsRefusedOrCompleteAndNeverCrashes) {
  for (HullFormat format : kFormats) {
    const auto bytes = FormatHull(Tetrahedron(), format);
    ASSERT_TRUE(bytes.ok());
    for (size_t length = 0; length < bytes->size(); ++length) {
      const auto hull = ReadHull(format, std::string_view(*bytes).substr(0, length));
      if (hull.ok()) continue;  // text formats are whole after any line
      EXPECT_FALSE(hull.status().message().empty());
    }
  }
}

TEST(Readers, BinaryFormatsRefuseEveryTruncation) {
  for (HullFormat format : {HullFormat::kDraco, HullFormat::kPly, HullFormat::kStl}) {
    const auto bytes = FormatHull(Tetrahedron(), format);
    ASSERT_TRUE(bytes.ok());
    for (size_t length = 0; length < bytes->size(); ++length) {
      EXPECT_FALSE(ReadHull(format, std::string_view(*bytes).substr(0, length)).ok())
          << static_cast<int>(format) << " cut to " << length << " of " << bytes->size();
    }
  }
}

TEST(Readers, ChangedBytesNeverCrash) {
  std::mt19937 random(11);
  for (HullFormat format : kFormats) {
    const auto bytes = FormatHull(Tetrahedron(), format);
    ASSERT_TRUE(bytes.ok());
    for (int round = 0; round < 2000; ++round) {
      std::string damaged = *bytes;
      for (int change = 0; change < 3; ++change) {
        damaged[random() % damaged.size()] = static_cast<char>(random());
      }
      const auto hull = ReadHull(format, damaged);
      if (!hull.ok()) {
        EXPECT_FALSE(hull.status().message().empty());
      }
    }
  }
}

TEST(Readers, EmptyFilesAreNamedAsSuch) {
  for (HullFormat format : kFormats) EXPECT_EQ(Message(ReadHull(format, "")), "the file is empty");
}

TEST(Readers, MissingFilesAreNotFoundByName) {
  const auto hull = ReadHullFile("/nowhere/part.stl");
  EXPECT_EQ(hull.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(Message(hull), HasSubstr("/nowhere/part.stl: No such file"));
}

TEST(Readers, UnknownExtensionsListTheKnownOnes) {
  EXPECT_THAT(Message(ReadHullFile("/proc/self/exe")),
              HasSubstr(".drc, .ply, .obj, .off, .stl, .xyz"));
  EXPECT_THAT(Message(ReadHullFile("/nowhere/part")), HasSubstr("/nowhere/part: No such file"));
}

TEST(Obj, ReadsPolygonsNegativeNumbersAndSlashes) {
  const auto hull = ReadObj(
      "# comment\nmtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
      "f 1/1/1 2/1/1 3//1 4\nf -4 -3 \\\n-2\n");
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(std::get<TriangleMesh>(*hull).triangles.size(), 3u);
}

TEST(Obj, NamesTheLineOfAnError) {
  EXPECT_THAT(Message(ReadObj("v 0 0 0\nv 1 zero 0\n")), HasSubstr("line 2"));
  EXPECT_THAT(Message(ReadObj("v 0 0 0\nv 1 0\n")), HasSubstr("2 of 3 coordinates"));
  EXPECT_THAT(Message(ReadObj("v 0 0 0\nf 1 2\n")), HasSubstr("at least 3"));
  EXPECT_THAT(Message(ReadObj("v 0 0 0\nf 1 2 9\n")), HasSubstr("only 1 vertices"));
  EXPECT_THAT(Message(ReadObj("v 0 0 0\nf 0 1 1\n")), HasSubstr("not a vertex number"));
  EXPECT_THAT(Message(ReadObj("hello\n")), HasSubstr("no line of the file is an OBJ vertex"));
}

TEST(Off, ReadsCommentsColoursAndPrefixes) {
  const auto hull = ReadOff(
      "COFF # colours\n4 2 0\n0 0 0 255 0 0 1\n1 0 0 9 9 9 1\n1 1 0 9 9 9 1\n0 1 0 9 9 9 1\n"
      "3 0 1 2 7 7 7\n3 0 2 3\n");
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(std::get<TriangleMesh>(*hull).triangles.size(), 2u);
}

TEST(Off, RefusesCountsThatTheFileCannotHold) {
  EXPECT_THAT(Message(ReadOff("OFF\n2000000000 1 0\n0 0 0\n")), HasSubstr("promises 2000000000"));
  EXPECT_THAT(Message(ReadOff("OFF\n-3 1 0\n0 0 0\n")), HasSubstr("promises -3"));
  EXPECT_THAT(Message(ReadOff("OFF\n1 1 0\n0 0 0\n3 0 0 99999999999\n")), HasSubstr("line 4"));
}

TEST(Ply, ReadsBothByteOrdersAndAscii) {
  const std::string properties =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar uint vertex_index\nend_header\n";
  const auto ascii =
      ReadPly("ply\nformat ascii 1.0\n" + properties + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  ASSERT_TRUE(ascii.ok()) << ascii.status();
  std::string big = "ply\nformat binary_big_endian 1.0\n" + properties;
  const char one[] = {0x3f, static_cast<char>(0x80), 0, 0};
  for (int i = 0; i < 9; ++i)
    big.append(i == 3 || i == 7 ? std::string(one, 4) : std::string(4, '\0'));
  big += '\3';
  for (char i = 0; i < 3; ++i) big += std::string(3, '\0') + i;
  const auto binary = ReadPly(big);
  ASSERT_TRUE(binary.ok()) << binary.status();
  EXPECT_EQ(std::get<TriangleMesh>(*ascii).vertices, std::get<TriangleMesh>(*binary).vertices);
  EXPECT_EQ(std::get<TriangleMesh>(*ascii).triangles, std::get<TriangleMesh>(*binary).triangles);
}

TEST(Ply, SkipsElementsAndPropertiesItDoesNotKnow) {
  const auto hull = ReadPly(
      "ply\nformat ascii 1.0\nelement camera 1\nproperty list int float pose\n"
      "element vertex 1\nproperty uchar red\nproperty double x\nproperty double y\n"
      "property double z\nend_header\n2 0.5 0.5\n255 1 2 3\n");
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(std::get<PointCloud>(*hull).points[0], (Vec3d{1, 2, 3}));
}

TEST(Ply, RefusesHeadersThatPromiseTooMuchOrTooLittle) {
  const std::string start = "ply\nformat binary_little_endian 1.0\n";
  EXPECT_THAT(Message(ReadPly(start + "element vertex 2000000000\nproperty float x\nend_header\n")),
              HasSubstr("promises 2000000000"));
  EXPECT_THAT(Message(ReadPly(start + "element vertex 1\nproperty float x\nend_header\nabcd")),
              HasSubstr("no properties x, y, z"));
  EXPECT_THAT(Message(ReadPly(start + "property float x\n")), HasSubstr("before any element"));
  EXPECT_THAT(Message(ReadPly(start + "element vertex 1\n")), HasSubstr("ends inside"));
  EXPECT_THAT(Message(ReadPly("ply\nformat middle_endian 1.0\n")), HasSubstr("middle_endian"));
  EXPECT_THAT(Message(ReadPly("ply\nelement vertex 0\nend_header\n")), HasSubstr("no format"));
}

TEST(Ply, RefusesListsLongerThanTheFile) {
  const auto hull = ReadPly(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n"
      "0 0 0\n4000000000 1 2 3\n");
  EXPECT_THAT(Message(hull), HasSubstr("a list has"));
}

TEST(Readers, CoordinatesThatAreNotFiniteAreRefusedByVertex) {
  EXPECT_THAT(Message(ReadObj("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")),
              HasSubstr("vertex 1 (counted from 0) is not finite"));
  EXPECT_THAT(Message(ReadOff("OFF\n1 0 0\n0 inf 0\n")), HasSubstr("not finite"));
}

TEST(Xyz, ReadsWhatScannersAddToThePoints) {
  for (const char* const text :
       {"0 0 0\n1 0 0\n0 1 0\n0 0 1", "4\r\n0 0 0 17\r\n1 0 0 17\r\n0 1 0 18\r\n0 0 1 19\r\n",
        "# scan\nX,Y,Z,R,G,B\n0,0,0,255,0,0\n1,0,0,255,1,9\n0,1,0,0,1,0\n\n0,0,1,9,9,9\n",
        "//x;y;z\n0;0;0;name\n1;0;0;name\n0;1;0;name\n0;0;1;name\n"}) {
    const auto hull = ReadXyz(text);
    ASSERT_TRUE(hull.ok()) << hull.status() << "\n" << text;
    const auto& cloud = std::get<PointCloud>(*hull);
    ASSERT_EQ(cloud.points.size(), 4u) << text;
    EXPECT_TRUE(cloud.normals.empty()) << text;
    EXPECT_EQ(Norm(cloud.points[3] - Vec3d{0, 0, 1}), 0) << text;
  }
}

TEST(Xyz, TakesForNormalsWhatHasUnitLengthEverywhere) {
  for (const char* const text :
       {"0 0 0 0 0 1\n1 0 0 0.6 0 0.8\n", "0 0 0 9 9 9 0 0 1\n1 0 0 1 0 0 .6 0 .8\n",
        "0 0 0 0 0 1 0.25\n1 0 0 0.6 0 0.8 0.5\n"}) {
    const auto hull = ReadXyz(text);
    ASSERT_TRUE(hull.ok()) << hull.status();
    const auto& cloud = std::get<PointCloud>(*hull);
    ASSERT_EQ(cloud.normals.size(), 2u) << text;
    EXPECT_LT(Norm(cloud.normals[1] - Vec3d{0.6, 0, 0.8}), 1e-12) << text;
  }
}

TEST(Xyz, DamagedFilesAreRefusedOrReadAndNeverCrash) {
  std::mt19937 random(13);
  const auto bytes = FormatHull(Cloud(20), HullFormat::kXyz);
  ASSERT_TRUE(bytes.ok());
  for (int round = 0; round < 5000; ++round) {
    std::string damaged = bytes->substr(0, random() % (bytes->size() + 1));
    for (int change = 0; change < 3 && !damaged.empty(); ++change) {
      damaged[random() % damaged.size()] = static_cast<char>(random());
    }
    const auto hull = ReadHull(HullFormat::kXyz, damaged);
    if (!hull.ok()) {
      EXPECT_FALSE(hull.status().message().empty());
      continue;
    }
    const auto& cloud = std::get<PointCloud>(*hull);
    EXPECT_TRUE(cloud.normals.empty() || cloud.normals.size() == cloud.points.size());
  }
}

TEST(Xyz, NamesTheLineThatIsNoPoint) {
  EXPECT_THAT(Message(ReadXyz("0 0 0\n# remark\n1 2\n")), HasSubstr("line 3"));
  EXPECT_THAT(Message(ReadXyz("0 0 0\n1 2 three\n")), HasSubstr("\"three\""));
  EXPECT_THAT(Message(ReadXyz("x y z\n")), Not(HasSubstr("accepted")));
}

TEST(Stl, WeldsEqualCornersAndDropsTrianglesWithoutArea) {
  const auto hull = ReadStl(
      "solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\n"
      "vertex -0 1 0\nendloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 1 1 0\n"
      "vertex 1 1 0\nvertex 0 0 0\nendloop\nendfacet\nendsolid part\n");
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(std::get<TriangleMesh>(*hull).vertices.size(), 4u);
  EXPECT_EQ(std::get<TriangleMesh>(*hull).triangles.size(), 2u);
}

TEST(Stl, BinaryFilesMayBeginWithTheWordSolid) {
  auto bytes = FormatHull(Tetrahedron(), HullFormat::kStl);
  ASSERT_TRUE(bytes.ok());
  bytes->replace(0, 5, "solid");
  EXPECT_TRUE(ReadStl(*bytes).ok());
}

TEST(Stl, NamesTheLineOfAnUnfinishedFacet) {
  EXPECT_THAT(Message(ReadStl("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n")),
              HasSubstr("line 5: a facet does not have three vertices"));
}

TEST(Draco, FilesThatClaimMoreThanTheirBytesAreRefusedBeforeDecoding) {
  // A sequential point cloud of 2^31 - 1 points in 23 bytes.
  std::string bytes("DRACO\x02\x03\x00\x00\x00\x00\xff\xff\xff\x7f", 15);
  bytes += std::string(8, '\0');
  EXPECT_THAT(Message(ReadDraco(bytes)), HasSubstr("claim 2147483647 points"));
  // A sequential mesh with as many faces (variable-length count).
  std::string mesh("DRACO\x02\x02\x01\x00\x00\x00\xff\xff\xff\xff\x07\x03", 17);
  EXPECT_THAT(Message(ReadDraco(mesh)), HasSubstr("claim 2147483647 faces"));
}

TEST(Draco, OtherFilesAreNamedAsSuch) {
  EXPECT_THAT(Message(ReadDraco("ply\nformat ascii")), HasSubstr("do not begin with \"DRACO\""));
  EXPECT_THAT(Message(ReadDraco("DRACO")), HasSubstr("end inside the header"));
}

TEST(Polygons, ConcaveOnesKeepTheirAreaAndOrientation) {
  // An arrow with two reflex corners, and a star of many corners.
  std::vector<Vec3d> vertices = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 0.5, 0}, {0, 2, 0}};
  std::vector<std::array<int32_t, 3>> triangles;
  TriangulatePolygon(std::vector<int32_t>{0, 1, 2, 3, 4}, vertices, &triangles);
  EXPECT_EQ(triangles.size(), 3u);
  double area = 0;
  for (const auto& t : triangles) {
    const Vec3d twice = Cross(vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]]);
    EXPECT_GT(twice.z, 0);
    area += twice.z / 2;
  }
  EXPECT_NEAR(area, 4 - 1.5, 1e-12);
}

TEST(Polygons, AQuadWithAReflexCornerIsSplitThere) {
  const std::vector<Vec3d> vertices = {{0, 0, 0}, {2, 0, 0}, {0.4, 0.4, 0}, {0, 2, 0}};
  std::vector<std::array<int32_t, 3>> triangles;
  TriangulatePolygon(std::vector<int32_t>{0, 1, 2, 3}, vertices, &triangles);
  for (const auto& t : triangles) {
    EXPECT_GT(Cross(vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]]).z, 0);
  }
}

TEST(Polygons, AreRefusedAboveTheirLimit) {
  std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf";
  for (int i = 0; i <= kMaxPolygonCorners; ++i) absl::StrAppend(&obj, " ", i % 3 + 1);
  EXPECT_THAT(Message(ReadObj(obj + "\n")), HasSubstr("at most 1024"));
}

}  // namespace
}  // namespace amhex::client
