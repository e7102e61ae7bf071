#include "formats/volume_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "cli/load_guidance.h"
#include "formats/hull_writer.h"
#include "formats/mesh_file.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class T>
std::string Message(const absl::StatusOr<T>& result) {
  return result.ok() ? "accepted" : std::string(result.status().message());
}

// Every file of ours that holds a volume, read as an input.
TEST(VolumeReader, ReadsWhatTheWritersWrite) {
  const MeshDocument document{Block(2, 3), {}};
  const size_t cells = document.mesh.corners.size();
  const absl::StatusOr<std::string> gmsh = FormatGmsh(document);
  ASSERT_TRUE(gmsh.ok()) << gmsh.status();
  for (const absl::StatusOr<VolumeMesh>& volume :
       {ReadVtkVolume(FormatVtk(document)), ReadGmshVolume(*gmsh),
        ReadVtuVolume(FormatVtu(document)), ReadMeditVolume(FormatMedit(document))}) {
    ASSERT_TRUE(volume.ok()) << volume.status();
    EXPECT_EQ(volume->vertices, document.mesh.vertices);
    EXPECT_EQ(volume->cell_faces.size(), cells);
    size_t faces = 0, corners = 0;
    for (const int32_t count : volume->cell_faces) faces += static_cast<size_t>(count);
    for (const int32_t count : volume->face_corners) corners += static_cast<size_t>(count);
    EXPECT_EQ(faces, volume->face_corners.size());
    EXPECT_EQ(corners, volume->corners.size());
  }
}

TEST(VolumeReader, CollapsedCellsLoseTheFacesThatCollapsed) {
  const MeshDocument document{OneOfEach(), {}};
  const auto volume = ReadVtkVolume(FormatVtk(document));
  ASSERT_TRUE(volume.ok()) << volume.status();
  EXPECT_THAT(volume->cell_faces, ElementsAre(6, 6, 5, 4, 5, 4));
}

constexpr char kHeader[] = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n";
constexpr char kPoints[] = "POINTS 5 float\n0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\n";

TEST(VolumeReader, VtkCellsOfFewerDimensionsAreSkipped) {
  const auto volume = ReadVtkVolume(absl::StrCat(
      kHeader, kPoints, "CELLS 3 13\n3 0 1 2\n4 0 1 2 3\n3 0 2 3\nCELL_TYPES 3\n5 10 5\n"));
  ASSERT_TRUE(volume.ok()) << volume.status();
  EXPECT_THAT(volume->cell_faces, ElementsAre(4));
}

TEST(VolumeReader, VtkPolyhedraKeepTheirFaces) {
  const auto volume = ReadVtkVolume(absl::StrCat(
      kHeader, kPoints, "CELLS 1 18\n17 4 3 0 1 2 3 0 1 3 3 1 2 3 3 2 0 3\nCELL_TYPES 1\n42\n"));
  ASSERT_TRUE(volume.ok()) << volume.status();
  EXPECT_THAT(volume->cell_faces, ElementsAre(4));
  EXPECT_THAT(volume->face_corners, ElementsAre(3, 3, 3, 3));
}

// A tetrahedron, a polyhedron with the same faces, and what the file says of the latter's faces.
std::string VtuOfPolyhedron(const std::string& faces, const std::string& face_offsets) {
  const auto array = [](const char* type, const char* name, const std::string& numbers) {
    return absl::StrCat("<DataArray type=\"", type, "\" Name=\"", name, "\" format=\"ascii\">",
                        numbers, "</DataArray>\n");
  };
  return absl::StrCat(
      "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>\n"
      "<Piece NumberOfPoints=\"5\" NumberOfCells=\"2\"><Points>\n"
      "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">"
      "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataArray></Points><Cells>\n",
      array("Int64", "connectivity", "1 2 3 4 0 1 2 3"), array("Int64", "offsets", "4 8"),
      array("UInt8", "types", "10 42"), array("Int64", "faces", faces),
      array("Int64", "faceoffsets", face_offsets), "</Cells></Piece></UnstructuredGrid></VTKFile>");
}

TEST(VolumeReader, VtuPolyhedraKeepTheirFaces) {
  const auto volume = ReadVtuVolume(VtuOfPolyhedron("4 3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3", "-1 17"));
  ASSERT_TRUE(volume.ok()) << volume.status();
  EXPECT_THAT(volume->cell_faces, ElementsAre(4, 4));
  EXPECT_THAT(std::vector<int32_t>(volume->corners.end() - 12, volume->corners.end()),
              ElementsAre(0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3));
}

TEST(VolumeReader, VtuPolyhedraWithoutTheirFacesAreRefused) {
  const char* const faces = "4 3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3";
  EXPECT_THAT(Message(ReadVtuVolume(VtuOfPolyhedron(faces, "17"))), HasSubstr("lists no faces"));
  EXPECT_THAT(Message(ReadVtuVolume(VtuOfPolyhedron(faces, "-1 18"))),
              HasSubstr("offset of cell 1 is wrong"));
  EXPECT_THAT(Message(ReadVtuVolume(VtuOfPolyhedron(faces, "-1 16"))), HasSubstr("cut short"));
  EXPECT_THAT(Message(ReadVtuVolume(VtuOfPolyhedron("4 3 0 2 9 3 0 1 3 3 1 2 3 3 2 0 3", "-1 17"))),
              HasSubstr("names vertex 9"));
  EXPECT_THAT(Message(ReadVtuVolume(VtuOfPolyhedron("1 3 0 0.5 1", "-1 5"))),
              HasSubstr("no index"));
}

TEST(VolumeReader, VtkVersionFiveHasOffsets) {
  const auto volume = ReadVtkVolume(absl::StrCat(
      "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n", kPoints,
      "CELLS 3 8\nOFFSETS vtktypeint64\n0 4 8\nCONNECTIVITY vtktypeint64\n0 1 2 3\n1 2 3 4\n",
      "CELL_TYPES 2\n10\n10\n"));
  ASSERT_TRUE(volume.ok()) << volume.status();
  EXPECT_THAT(volume->cell_faces, ElementsAre(4, 4));
}

TEST(VolumeReader, GmshTwoNumbersItsNodesFreely) {
  const auto volume = ReadGmshVolume(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n7 0 0 0\n9 1 0 0\n11 0 1 0\n13 0 0 1\n"
      "$EndNodes\n$Elements\n2\n1 2 2 0 1 7 9 11\n2 4 2 0 1 7 9 11 13\n$EndElements\n");
  ASSERT_TRUE(volume.ok()) << volume.status();
  EXPECT_THAT(volume->cell_faces, ElementsAre(4));
}

TEST(VolumeReader, WhatIsWrongIsSaid) {
  EXPECT_THAT(Message(ReadVtkVolume("solid x")), HasSubstr("# vtk DataFile Version"));
  EXPECT_THAT(Message(ReadVtkVolume(absl::StrCat(kHeader, "POINTS 99999999 float\n0"))),
              HasSubstr("the number of points is"));
  EXPECT_THAT(Message(ReadVtkVolume(
                  absl::StrCat(kHeader, kPoints, "CELLS 1 5\n4 0 1 2 9\nCELL_TYPES 1\n10\n"))),
              HasSubstr("names vertex 9"));
  EXPECT_THAT(Message(ReadVtkVolume(
                  absl::StrCat(kHeader, kPoints, "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n25\n"))),
              HasSubstr("VTK type 25"));
  EXPECT_THAT(Message(ReadVtkVolume(
                  absl::StrCat(kHeader, kPoints, "CELLS 1 5\n9 0 1 2 3\nCELL_TYPES 1\n10\n"))),
              HasSubstr("promises 9"));
  EXPECT_THAT(Message(ReadGmshVolume("$Nodes\n")), HasSubstr("line 1"));
  EXPECT_THAT(Message(ReadGmshVolume("$MeshFormat\n4.1 1 8\n")), HasSubstr("in ascii"));
  EXPECT_THAT(Message(ReadVolumeFile("part.step")), HasSubstr(".vtk, .msh, .vtu, .mesh"));
}

TEST(VolumeReader, NoTruncatedFileIsTakenForWhole) {
  const MeshDocument document{Block(1, 0), {}};
  const std::string vtk = FormatVtk(document);
  const size_t needed = vtk.find("CELL_TYPES") + 15;
  for (size_t size = 0; size < needed; size += 3) {
    EXPECT_FALSE(ReadVtkVolume(vtk.substr(0, size)).ok()) << size;
  }
  const std::string gmsh = FormatGmsh(document).value();
  for (size_t size = 0; size + 15 < gmsh.size(); size += 7) {
    EXPECT_FALSE(ReadGmshVolume(gmsh.substr(0, size)).ok()) << size;
  }
}

TEST(LoadGuidance, ReadsSamplesPlanesAndOrientations) {
  const std::string folder = testing::TempDir();
  const std::string cloud = folder + "/guides.ply", lines = folder + "/frames.txt";
  ASSERT_TRUE(WriteHullFile(PointCloud{{{1, 2, 3}}, {{0, 0, 1}}}, cloud).ok());
  ASSERT_TRUE(WriteWholeFile(lines, "# frames\n0 0 0 1 0 0\n1 1 1 0 1 0 0 0 1\n").ok());
  const auto guidance = LoadGuidance({{cloud}, {"0,0,1,0,0,2"}, {lines}});
  ASSERT_TRUE(guidance.ok()) << guidance.status();
  ASSERT_EQ(guidance->samples.size(), 3u);
  EXPECT_EQ(guidance->samples[0].axis, (Vec3d{0, 0, 1}));
  EXPECT_EQ(guidance->samples[1].second_axis, (Vec3d{}));
  EXPECT_EQ(guidance->samples[2].second_axis, (Vec3d{0, 0, 1}));
  ASSERT_EQ(guidance->planes.size(), 1u);
  EXPECT_EQ(guidance->planes[0].normal, (Vec3d{0, 0, 2}));
  EXPECT_EQ(DescribeGuidance(*guidance), "3 guide samples, 1 guide plane");
}

TEST(LoadGuidance, NamesTheFlagOrTheLine) {
  const std::string lines = testing::TempDir() + "/bad_frames.txt";
  ASSERT_TRUE(WriteWholeFile(lines, "0 0 0 1 0 0\n1 1 1 0 1\n").ok());
  EXPECT_THAT(Message(LoadGuidance({{}, {"0,0,1"}, {}})), HasSubstr("x,y,z,nx,ny,nz"));
  EXPECT_THAT(Message(LoadGuidance({{}, {}, {lines}})), HasSubstr("line 2 has 5 numbers"));
}

}  // namespace
}  // namespace amhex::client
