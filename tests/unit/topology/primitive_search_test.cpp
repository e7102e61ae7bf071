#include "topology/primitive_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "topology/half_face.h"
#include "topology/primitive_catalog.h"
#include "topology/primitive_programs.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

using FaceIds = std::vector<int32_t>;

CellFace FaceKey(const CellFace& face) {
  const CellFace canonical = CanonicalHalfFace(face);
  return StandsForFace(canonical) ? canonical : OppositeHalfFace(canonical);
}

std::vector<CellFace> FacesOfCells(const std::vector<CellCorners>& cells) {
  std::set<CellFace> faces;
  for (const CellCorners& cell : cells) {
    for (const CellFace& face : FacesOf(cell)) faces.insert(FaceKey(face));
  }
  return {faces.begin(), faces.end()};
}

std::vector<FoundPrimitive> Search(const FaceComplex& complex, PrimitiveType type) {
  RunContext context;
  std::vector<FoundPrimitive> found;
  EXPECT_TRUE(FindPrimitives(complex, type, context, &found).ok());
  return found;
}

// True if some renumbering of the shape's vertices makes its faces the given ones.
bool IsShape(const PrimitiveShape& shape, const std::vector<CellFace>& faces) {
  std::set<int32_t> ids;
  std::set<CellFace> wanted;
  for (const CellFace& face : faces) {
    ids.insert(face.v.begin(), face.v.begin() + face.count);
    wanted.insert(FaceKey(face));
  }
  if (static_cast<int>(ids.size()) != shape.vertex_count) return false;
  std::vector<int32_t> renumbered(ids.begin(), ids.end());
  do {
    const bool fits = std::all_of(shape.faces.begin(), shape.faces.begin() + shape.face_count(),
                                  [&](CellFace face) {
                                    for (int i = 0; i < face.count; ++i)
                                      face.v[i] = renumbered[face.v[i]];
                                    return wanted.count(FaceKey(face)) == 1;
                                  });
    if (fits) return true;
  } while (std::next_permutation(renumbered.begin(), renumbered.end()));
  return false;
}

bool IsClosed(const std::vector<CellFace>& faces) {
  std::map<std::pair<int32_t, int32_t>, int> uses;
  for (const CellFace& face : faces) {
    for (int i = 0; i < face.count; ++i) {
      ++uses[std::minmax(face.v[i], face.v[(i + 1) % face.count])];
    }
  }
  return std::all_of(uses.begin(), uses.end(), [](const auto& use) { return use.second == 2; });
}

// All subsets of the faces that have the shape; the search's brute-force twin.
std::set<FaceIds> Enumerate(const std::vector<CellFace>& faces, const PrimitiveShape& shape) {
  std::set<FaceIds> subsets;
  const int count = static_cast<int>(faces.size());
  std::vector<int> chosen(static_cast<size_t>(count), 0);
  std::fill_n(chosen.begin(), std::min(count, shape.face_count()), 1);
  if (count < shape.face_count()) return subsets;
  do {
    FaceIds ids;
    std::vector<CellFace> subset;
    for (int i = 0; i < count; ++i) {
      if (chosen[i] == 0) continue;
      ids.push_back(i);
      subset.push_back(faces[i]);
    }
    if (IsClosed(subset) && IsShape(shape, subset)) subsets.insert(ids);
  } while (std::prev_permutation(chosen.begin(), chosen.end()));
  return subsets;
}

// The faces of one primitive of the type plus random loops over its vertices and one more.
std::vector<CellFace> RandomFaces(const PrimitiveShape& shape, int count, std::mt19937* random) {
  std::vector<CellFace> faces = FacesOfCells({shape.pattern});
  const auto vertex_count = static_cast<uint32_t>(shape.vertex_count + 1);
  while (static_cast<int>(faces.size()) < count) {
    std::vector<int32_t> ids(vertex_count);
    for (uint32_t v = 0; v < vertex_count; ++v) ids[v] = static_cast<int32_t>(v);
    for (uint32_t v = vertex_count - 1; v > 0; --v) std::swap(ids[v], ids[(*random)() % (v + 1)]);
    const bool is_quad = (*random)() % 2 == 0;
    const CellFace face =
        FaceKey(is_quad ? Quad(ids[0], ids[1], ids[2], ids[3]) : Triangle(ids[0], ids[1], ids[2]));
    if (std::find(faces.begin(), faces.end(), face) == faces.end()) faces.push_back(face);
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

TEST(PrimitiveSearch, FindsNothingInNothing) {
  const FaceComplex empty = FaceComplex::Build(0, {});
  for (const PrimitiveType type : kPrimitiveTypes) EXPECT_TRUE(Search(empty, type).empty());
}

TEST(PrimitiveSearch, FindsExactlyOneHexahedronInACube) {
  const FaceComplex cube = FaceComplex::Build(8, FacesOfCells({{0, 1, 2, 3, 4, 5, 6, 7}}));
  ASSERT_EQ(Search(cube, PrimitiveType::kHexahedron).size(), 1u);
  for (const PrimitiveType type : kPrimitiveTypes) {
    if (type == PrimitiveType::kHexahedron) continue;
    EXPECT_TRUE(Search(cube, type).empty());
  }
}

TEST(PrimitiveSearch, FindsEveryCubeOfAGridOnce) {
  const MergedCubes grid = testing::MakeCubeGrid(3, 2, 2);
  const FaceComplex complex =
      FaceComplex::Build(static_cast<int32_t>(grid.vertices.size()), FacesOfCells(grid.corners));
  std::set<FaceIds> cubes;
  for (const FoundPrimitive& found : Search(complex, PrimitiveType::kHexahedron)) {
    cubes.insert(FaceIds(found.faces.begin(), found.faces.end()));
  }
  EXPECT_EQ(cubes.size(), 12u);
}

TEST(PrimitiveSearch, TwoPrismsInACutCubeAreFoundBesidesTheHexahedron) {
  const FaceComplex complex = FaceComplex::Build(
      8,
      FacesOfCells({{0, 1, 2, 3, 4, 5, 6, 7}, {0, 1, 1, 2, 4, 5, 5, 6}, {0, 2, 2, 3, 4, 6, 6, 7}}));
  EXPECT_EQ(Search(complex, PrimitiveType::kHexahedron).size(), 1u);
  EXPECT_EQ(Search(complex, PrimitiveType::kPrism).size(), 2u);
}

TEST(PrimitiveSearch, EveryProgramEqualsSubsetEnumeration) {
  std::mt19937 random(7);
  for (const PrimitiveType type : kPrimitiveTypes) {
    const PrimitiveShape& shape = ShapeOf(type);
    for (int trial = 0; trial < 10; ++trial) {
      const std::vector<CellFace> faces = RandomFaces(shape, 15, &random);
      const FaceComplex complex = FaceComplex::Build(shape.vertex_count + 1, faces);
      std::multiset<FaceIds> found;
      for (const FoundPrimitive& primitive : Search(complex, type)) {
        found.insert(
            FaceIds(primitive.faces.begin(), primitive.faces.begin() + primitive.face_count));
      }
      const std::set<FaceIds> expected = Enumerate(faces, shape);
      EXPECT_GE(expected.size(), 1u);
      EXPECT_EQ(found, std::multiset<FaceIds>(expected.begin(), expected.end())) << shape.name;
    }
  }
}

TEST(PrimitiveSearch, CornersHaveTheFoundFacesAndTheMirrorImageTheirOpposites) {
  for (const PrimitiveShape& shape : kPrimitiveCatalog) {
    const FaceComplex complex = FaceComplex::Build(8, FacesOfCells({shape.pattern}));
    const auto found = Search(complex, shape.type);
    ASSERT_EQ(found.size(), 1u) << shape.name;
    const CellCorners mirrored = MirrorCorners(shape.type, found[0].corners);
    std::set<CellFace> front, back;
    for (const CellFace& face : FacesOf(found[0].corners)) front.insert(CanonicalHalfFace(face));
    for (const CellFace& face : FacesOf(mirrored)) back.insert(OppositeHalfFace(face));
    EXPECT_EQ(front, back) << shape.name;
    EXPECT_EQ(RecognizeCell(mirrored), shape.type);
  }
}

TEST(PrimitiveSearch, IsCancelledByTheContext) {
  RunContext context;
  context.RequestStop();
  std::vector<FoundPrimitive> found;
  const FaceComplex cube = FaceComplex::Build(8, FacesOfCells({{0, 1, 2, 3, 4, 5, 6, 7}}));
  EXPECT_EQ(FindPrimitives(cube, PrimitiveType::kHexahedron, context, &found).code(),
            absl::StatusCode::kCancelled);
}

TEST(PrimitivePrograms, EndWithThePatternsFaces) {
  for (const PrimitiveProgram& program : kPrimitivePrograms) {
    const PrimitiveShape& shape = ShapeOf(program.type);
    EXPECT_EQ(program.final_state().quads, shape.quad_count);
    EXPECT_EQ(program.final_state().triangles, shape.triangle_count);
    EXPECT_EQ(program.final_state().open_edges, 0);
  }
}

TEST(PrimitivePrograms, EveryStateIsReachedByAddingFacesToThePrimary) {
  for (const PrimitiveProgram& program : kPrimitivePrograms) {
    const PrimitiveShape& shape = ShapeOf(program.type);
    // A state is reached if some subset of the shape's faces has its counts.
    for (int i = 0; i < program.state_count; ++i) {
      bool is_reached = false;
      for (int mask = 1; mask < 1 << shape.face_count(); ++mask) {
        std::map<std::pair<int32_t, int32_t>, int> uses;
        ProgramState state;
        for (int f = 0; f < shape.face_count(); ++f) {
          if ((mask >> f & 1) == 0) continue;
          const CellFace& face = shape.faces[f];
          (face.count == 4 ? state.quads : state.triangles) += 1;
          for (int j = 0; j < face.count; ++j) {
            ++uses[std::minmax(face.v[j], face.v[(j + 1) % face.count])];
          }
        }
        for (const auto& use : uses) state.open_edges += use.second == 1 ? 1 : 0;
        is_reached = is_reached || state == program.states[i];
      }
      EXPECT_TRUE(is_reached) << shape.name << " state " << i;
    }
  }
}

}  // namespace
}  // namespace amhex
