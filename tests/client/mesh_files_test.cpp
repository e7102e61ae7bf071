#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "absl/strings/str_cat.h"
#include "cells/mesh_check.h"
#include "formats/mesh_file.h"
#include "formats/vtk_arrays.h"
#include "formats/vtk_cells.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

using ::testing::HasSubstr;

MeshDocument Document() {
  return {OneOfEach(), {{"statistics.cell_count", 6.0}, {"backend", std::string("cpu <&> 2")}}};
}

void ExpectSameMesh(const AtMostHexaMesh& a, const AtMostHexaMesh& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.types, b.types);
  ASSERT_EQ(a.corners.size(), b.corners.size());
  for (size_t cell = 0; cell < a.corners.size(); ++cell) {
    EXPECT_NEAR(VolumeOfCell(a.corners[cell], a.vertices),
                VolumeOfCell(b.corners[cell], b.vertices), 1e-12);
    EXPECT_NEAR(a.quality[cell], b.quality[cell], 1e-6);
  }
  EXPECT_TRUE(CheckMesh(b).ok()) << CheckMesh(b);
}

TEST(Vtu, GivesBackEveryTypeOfCell) {
  const MeshDocument document = Document();
  const auto read = ReadVtu(FormatVtu(document));
  ASSERT_TRUE(read.ok()) << read.status();
  ExpectSameMesh(document.mesh, read->mesh);
}

TEST(Vtu, GivesBackTheFactsWithAnyCharacters) {
  const auto read = ReadVtu(FormatVtu(Document()));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->facts.size(), 2u);
  EXPECT_EQ(read->facts[0].name, "statistics.cell_count");
  EXPECT_EQ(std::get<double>(read->facts[0].value), 6.0);
  EXPECT_EQ(std::get<std::string>(read->facts[1].value), "cpu <&> 2");
}

TEST(Vtu, GivesBackDistancesAndWhereThereAreNone) {
  MeshDocument document = Document();
  EXPECT_TRUE(ReadVtu(FormatVtu(document))->distances.empty());
  document.distances = {0.5F, std::nanf(""), 0, 1e-9F, std::nanf(""), 7};
  const auto read = ReadVtu(FormatVtu(document));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->distances.size(), document.distances.size());
  for (size_t cell = 0; cell < document.distances.size(); ++cell) {
    EXPECT_EQ(std::isnan(read->distances[cell]), std::isnan(document.distances[cell]));
    if (!std::isnan(document.distances[cell])) {
      EXPECT_EQ(read->distances[cell], document.distances[cell]);
    }
  }
}

TEST(Vtu, GivesBackMeshesOfManyBlocks) {
  const MeshDocument document{Block(20, 7), {}};
  ASSERT_GT(document.mesh.vertices.size() * 24, 5 * kVtkBlockBytes);
  const auto read = ReadVtu(FormatVtu(document));
  ASSERT_TRUE(read.ok()) << read.status();
  ExpectSameMesh(document.mesh, read->mesh);
}

TEST(Vtu, RefusesEveryTruncation) {
  const std::string bytes = FormatVtu(Document());
  for (size_t length = 0; length + 12 < bytes.size(); length += 7) {
    EXPECT_FALSE(ReadVtu(std::string_view(bytes).substr(0, length)).ok()) << length;
  }
}

TEST(Vtu, ChangedBytesNeverCrash) {
  const std::string bytes = FormatVtu(Document());
  std::mt19937 random(5);
  for (int round = 0; round < 3000; ++round) {
    std::string damaged = bytes;
    for (int i = 0; i < 2; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
    const auto read = ReadVtu(damaged);
    if (!read.ok()) {
      EXPECT_FALSE(read.status().message().empty());
    }
  }
}

TEST(Medit, GivesBackEveryTypeOfCellAndEveryBitOfTheVertices) {
  MeshDocument document = Document();
  document.mesh.vertices[3].x += 1.0 / 3;
  const auto read = ReadMedit(FormatMedit(document));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->mesh.corners.size(), document.mesh.corners.size());
  for (size_t cell = 0; cell < document.mesh.corners.size(); ++cell) {
    EXPECT_EQ(read->mesh.corners[cell], OrderedCorners(document.mesh.corners[cell]));
  }
  EXPECT_EQ(read->mesh.vertices, document.mesh.vertices);
  EXPECT_EQ(read->mesh.types, document.mesh.types);
}

TEST(Medit, ReadsPrismsPyramidsAndTetrahedraOfOthersAsPositiveCells) {
  const auto read = ReadMedit(
      "MeshVersionFormatted 1\nDimension\n3\nVertices\n6\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
      "1 0 1 0\n0 1 1 0\nTriangles\n1\n1 2 3 0\nPrisms\n1\n1 2 3 4 5 6 0\nTetrahedra\n1\n"
      "1 2 3 4 0\nPyramids\n1\n1 3 6 4 2 0\nEnd\n");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->mesh.corners.size(), 3u);
  EXPECT_NEAR(VolumeOfCell(read->mesh.corners[0], read->mesh.vertices), 0.5, 1e-12);
  EXPECT_NEAR(VolumeOfCell(read->mesh.corners[1], read->mesh.vertices), 1.0 / 6, 1e-12);
  EXPECT_NEAR(VolumeOfCell(read->mesh.corners[2], read->mesh.vertices), 1.0 / 3, 1e-12);
}

TEST(Medit, NamesTheLineOfAnError) {
  const std::string start = "MeshVersionFormatted 2\nDimension 3\n";
  const auto message = [&](const std::string& rest) {
    return std::string(ReadMedit(start + rest).status().message());
  };
  EXPECT_THAT(message("Vertices\n99999999999\n"), HasSubstr("line 4"));
  EXPECT_THAT(message("Vertices\n1\n0 0 0 0\nHexahedra\n1\n1 1 1 1 1 1 1 2 0\nEnd\n"),
              HasSubstr("names vertex 2"));
  EXPECT_THAT(message("Splines\n1\n"), HasSubstr("unknown section \"Splines\""));
  EXPECT_THAT(message("Vertices\n1\n0 0 0 0\n"), HasSubstr("without the word End"));
  EXPECT_THAT(message("End\n"), HasSubstr("no volume cell"));
}

TEST(Vtk, GivesBackCellsFactsAndData) {
  MeshDocument document = Document();
  document.facts.push_back({"convergence.movement", std::vector<double>{0.5, 0.25}});
  document.mesh.quality[2] = 0.125F;  // as the file has it, not as geometry would
  document.distances = {0.5F, std::nanf(""), 0, 1e-9F, 3, 7};
  const auto read = ReadVtk(FormatVtk(document));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->mesh.vertices, document.mesh.vertices);
  EXPECT_EQ(read->mesh.types, document.mesh.types);
  EXPECT_EQ(read->mesh.quality, document.mesh.quality);
  EXPECT_TRUE(CheckMesh(read->mesh).ok()) << CheckMesh(read->mesh);
  ASSERT_EQ(read->facts.size(), document.facts.size());
  for (size_t i = 0; i < read->facts.size(); ++i) {
    EXPECT_EQ(read->facts[i].name, document.facts[i].name);
    EXPECT_EQ(read->facts[i].value, document.facts[i].value);
  }
  ASSERT_EQ(read->distances.size(), 6u);
  EXPECT_TRUE(std::isnan(read->distances[1]));
  EXPECT_EQ(read->distances[3], 1e-9F);
}

constexpr char kVtkOfOthers[] =
    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n";

TEST(Vtk, ReadsWhatOthersSayAboutCells) {
  const std::string one_cell =
      absl::StrCat(kVtkOfOthers, "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n");
  for (const char* data :
       {"CELL_DATA 1\nSCALARS scaled_jacobian double\nLOOKUP_TABLE default\n0.25\n",
        "CELL_DATA 1\nFIELD FieldData 1\nscaled_jacobian 1 1 float\n0.25\n",
        "CELL_DATA 1\nSCALARS colour int 3\nLOOKUP_TABLE default\n1 2 3\n"
        "SCALARS scaled_jacobian float 1\nLOOKUP_TABLE default\n0.25\n"}) {
    const auto read = ReadVtk(absl::StrCat(one_cell, data));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->mesh.quality.at(0), 0.25F) << data;
  }
  const auto of_points = ReadVtk(absl::StrCat(
      one_cell, "POINT_DATA 4\nSCALARS scaled_jacobian float\nLOOKUP_TABLE default\n9 9 9 9\n"));
  ASSERT_TRUE(of_points.ok()) << of_points.status();
  EXPECT_LE(of_points->mesh.quality.at(0), 1);
}

TEST(Vtk, DataOfOtherNumbersOfCellsIsNotTaken) {
  // A triangle beside the tetrahedron: two data, one cell.
  const auto read = ReadVtk(
      absl::StrCat(kVtkOfOthers, "CELLS 2 9\n3 0 1 2\n4 0 1 2 3\nCELL_TYPES 2\n5 10\n",
                   "CELL_DATA 2\nSCALARS scaled_jacobian float\nLOOKUP_TABLE default\n9 9\n"));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->mesh.quality.size(), 1u);
  EXPECT_LE(read->mesh.quality[0], 1);
}

TEST(Vtk, CellsThatAreNoHexahedraAreNamed) {
  const auto read = ReadVtk(
      absl::StrCat(kVtkOfOthers, "CELLS 2 23\n4 0 1 2 3\n17 4 3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3\n",
                   "CELL_TYPES 2\n10 42\n"));
  EXPECT_THAT(std::string(read.status().message()), HasSubstr("cell 1 is not one of the six"));
}

TEST(Vtk, ChangedOrLostBytesNeverCrash) {
  MeshDocument document = Document();
  document.distances.assign(6, 1);
  const std::string bytes = FormatVtk(document);
  std::mt19937 random(6);
  for (int round = 0; round < 3000; ++round) {
    std::string damaged = bytes;
    for (int i = 0; i < 2; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
    if (round % 2 == 0) damaged.resize(random() % damaged.size());
    const auto read = ReadVtk(damaged);
    if (!read.ok()) {
      EXPECT_FALSE(read.status().message().empty());
    }
  }
}

TEST(Gmsh, GivesBackEveryBitOfTheVerticesAndTheCellsByType) {
  MeshDocument document{Block(3, 4), {}};
  document.mesh.vertices[3].x += 1.0 / 300;
  const auto read = ReadGmsh(FormatGmsh(document).value());
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->mesh.vertices, document.mesh.vertices);
  ASSERT_EQ(read->mesh.types.size(), document.mesh.types.size());
  for (PrimitiveType type : kPrimitiveTypes) {
    EXPECT_EQ(std::count(read->mesh.types.begin(), read->mesh.types.end(), type),
              std::count(document.mesh.types.begin(), document.mesh.types.end(), type));
  }
  EXPECT_TRUE(CheckMesh(read->mesh).ok()) << CheckMesh(read->mesh);
}

TEST(VtkArrays, GiveBackAnyLength) {
  for (size_t length : {size_t{0}, size_t{1}, kVtkBlockBytes - 1, kVtkBlockBytes,
                        kVtkBlockBytes + 1, 3 * kVtkBlockBytes}) {
    std::string raw;
    for (size_t i = 0; i < length; ++i) raw += static_cast<char>(i * 7 + i / 251);
    const auto decoded = DecodeVtkArray(EncodeVtkArray(raw), length);
    ASSERT_TRUE(decoded.ok()) << length << ": " << decoded.status();
    EXPECT_EQ(*decoded, raw);
  }
}

TEST(VtkArrays, NeverInflateBeyondTheLimit) {
  const std::string text = EncodeVtkArray(std::string(size_t{1} << 20, 'a'));
  EXPECT_FALSE(DecodeVtkArray(text, 1000).ok());
}

// The orders as VTK's manual states them, tested by signed volumes of tetrahedra.
TEST(VtkCells, BasesAreOrientedAsVtkWants) {
  const auto volume = [](const VtkCell& cell, const std::vector<Vec3d>& vertices, int a, int b,
                         int c, int apex) {
    const Vec3d o = vertices[cell.vertex[a]];
    return Determinant(vertices[cell.vertex[b]] - o, vertices[cell.vertex[c]] - o,
                       vertices[cell.vertex[apex]] - o);
  };
  const AtMostHexaMesh tetra = OneCell(PrimitiveType::kTetrahedron);
  EXPECT_GT(volume(ToVtkCell(tetra.corners[0]), tetra.vertices, 0, 1, 2, 3), 0);
  const AtMostHexaMesh pyramid = OneCell(PrimitiveType::kPyramid);
  EXPECT_GT(volume(ToVtkCell(pyramid.corners[0]), pyramid.vertices, 0, 1, 2, 4), 0);
  EXPECT_GT(volume(ToVtkCell(pyramid.corners[0]), pyramid.vertices, 0, 2, 3, 4), 0);
  const AtMostHexaMesh prism = OneCell(PrimitiveType::kPrism);
  const VtkCell wedge = ToVtkCell(prism.corners[0]);
  EXPECT_LT(volume(wedge, prism.vertices, 0, 1, 2, 3), 0) << "0 1 2 looks away from 3 4 5";
  EXPECT_GT(volume(wedge, prism.vertices, 3, 4, 5, 0), 0) << "and 3 4 5 towards 0 1 2";
}

TEST(VtkCells, TypesAreThoseOfVtk) {
  EXPECT_EQ(ToVtkCell(OneCell(PrimitiveType::kTetrahedron).corners[0]).type, 10);
  EXPECT_EQ(ToVtkCell(OneCell(PrimitiveType::kHexahedron).corners[0]).type, 12);
  EXPECT_EQ(ToVtkCell(OneCell(PrimitiveType::kHexprism).corners[0]).type, 12);
  EXPECT_EQ(ToVtkCell(OneCell(PrimitiveType::kSlice).corners[0]).type, 12);
  EXPECT_EQ(ToVtkCell(OneCell(PrimitiveType::kPrism).corners[0]).type, 13);
  EXPECT_EQ(ToVtkCell(OneCell(PrimitiveType::kPyramid).corners[0]).type, 14);
}

// Every rotation of the cube's numbering must lead to the same solid.
TEST(VtkCells, AnyRotationOfAPatternGivesAPositiveCell) {
  constexpr CellCorners kAboutZ = {1, 2, 3, 0, 5, 6, 7, 4};
  constexpr CellCorners kAboutX = {3, 2, 6, 7, 0, 1, 5, 4};
  for (PrimitiveType type : kPrimitiveTypes) {
    const AtMostHexaMesh mesh = OneCell(type);
    CellCorners corners = mesh.corners[0];
    for (int turn = 0; turn < 16; ++turn) {
      CellCorners turned{};
      const CellCorners& rotation = turn % 4 == 3 ? kAboutX : kAboutZ;
      for (int i = 0; i < 8; ++i) turned[i] = corners[rotation[i]];
      corners = turned;
      const auto back = FromVtkCell(ToVtkCell(corners));
      ASSERT_TRUE(back.has_value());
      EXPECT_EQ(TypeOfCell(*back), type);
      EXPECT_EQ(ToVtkCell(*back).vertex, ToVtkCell(corners).vertex)
          << PrimitiveName(type) << " is written in another order once it has been read";
      MeshDocument document{mesh, {}};
      document.mesh.corners[0] = corners;
      const auto read = ReadVtu(FormatVtu(document));
      ASSERT_TRUE(read.ok()) << read.status();
      EXPECT_EQ(FormatMedit(*read), FormatMedit(document)) << PrimitiveName(type);
      EXPECT_NEAR(VolumeOfCell(*back, mesh.vertices), VolumeOfCell(mesh.corners[0], mesh.vertices),
                  1e-12)
          << PrimitiveName(type) << " turn " << turn;
    }
  }
}

}  // namespace
}  // namespace amhex::client
