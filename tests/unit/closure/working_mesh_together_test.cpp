// A large mesh is made on all threads and is the same as one whose cells come one after the other.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "closure/working_mesh.h"
#include "support/grid_complex.h"

namespace amhex {
namespace {

using oneapi::tbb::global_control;
using testing_support::GridComplex;
using testing_support::GridSize;
using testing_support::ListHullFaces;

// Enough for all threads.
constexpr GridSize kLarge{30, 28, 26};

// Some cubes are missing, some are two prisms; vertices and cells have any numbers.
CellComplex ManyCells() {
  std::mt19937_64 random(3);
  CellComplex complex = GridComplex(kLarge);
  std::vector<CellCorners> cells;
  for (const CellCorners& c : complex.cells) {
    const uint64_t draw = random() % 10;
    if (draw == 0) continue;
    if (draw > 1) {
      cells.push_back(c);
      continue;
    }
    cells.push_back({c[0], c[1], c[1], c[2], c[4], c[5], c[5], c[6]});
    cells.push_back({c[0], c[2], c[2], c[3], c[4], c[6], c[6], c[7]});
  }
  std::vector<int32_t> number(complex.vertices.size());
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), random);
  std::shuffle(cells.begin(), cells.end(), random);
  for (CellCorners& cell : cells) {
    for (int32_t& v : cell) v = number[static_cast<size_t>(v)];
  }
  complex.cells = std::move(cells);
  ListHullFaces(complex);
  // Half of the boundary stays open.
  complex.hull_faces.resize(complex.hull_faces.size() / 2);
  return complex;
}

WorkingMesh OneByOne(const CellComplex& complex) {
  CellComplex empty;
  empty.vertices = complex.vertices;
  WorkingMesh mesh(empty);
  for (const CellCorners& cell : complex.cells) mesh.AddCell(cell);
  for (const CellFace& face : complex.hull_faces) mesh.MarkHull(face);
  return mesh;
}

void ExpectSame(const WorkingMesh& a, const WorkingMesh& b) {
  ASSERT_EQ(a.cell_slots(), b.cell_slots());
  ASSERT_EQ(a.half_face_count(), b.half_face_count());
  for (int c = 0; c < a.cell_slots(); ++c) {
    ASSERT_EQ(a.corners(c), b.corners(c));
    ASSERT_EQ(a.type(c), b.type(c));
    ASSERT_EQ(a.alive(c), b.alive(c));
    ASSERT_EQ(a.half_faces(c), b.half_faces(c)) << c;
  }
  for (int half = 0; half < a.half_face_count(); ++half) {
    ASSERT_EQ(a.owner(half), b.owner(half)) << half;
  }
  EXPECT_EQ(a.CellsAtVertices(), b.CellsAtVertices());
  const std::vector<CellFace> open = a.OpenFaces(), also_open = b.OpenFaces();
  ASSERT_EQ(open.size(), also_open.size());
  for (size_t i = 0; i < open.size(); ++i) EXPECT_EQ(open[i].v, also_open[i].v);
  // Faces are found, and cells in the same order.
  for (int c = 0; c < a.cell_slots(); c += 7) {
    for (const CellFace& face : FacesOf(a.corners(c))) {
      ASSERT_EQ(a.FindHalfFace(face), b.FindHalfFace(face));
    }
    const int32_t v = a.corners(c)[0];
    std::vector<int> cells_of_a, cells_of_b;
    a.AnyCellAt(v, [&](int cell) { return cells_of_a.push_back(cell), false; });
    b.AnyCellAt(v, [&](int cell) { return cells_of_b.push_back(cell), false; });
    ASSERT_EQ(cells_of_a, cells_of_b);
  }
}

TEST(WorkingMesh, MadeOnAllThreadsIsTheSame) {
  const CellComplex complex = ManyCells();
  ASSERT_GT(complex.cells.size(), 16384U);
  const WorkingMesh expected = OneByOne(complex);
  for (const size_t threads : {1, 4}) {
    const global_control limit(global_control::max_allowed_parallelism, threads);
    ExpectSame(WorkingMesh(complex), expected);
  }
}

// As one after the other, where what comes later finds its place taken or is none.
TEST(WorkingMesh, CellsThatCannotBeAddedAreLeftOutOfALargeOne) {
  CellComplex complex = ManyCells();
  complex.cells.push_back(complex.cells[100]);
  ExpectSame(WorkingMesh(complex), OneByOne(complex));
  complex.cells.pop_back();
  CellCorners crossed = complex.cells[200];
  std::swap(crossed[0], crossed[6]), crossed[1] = crossed[6];
  complex.cells.insert(complex.cells.begin() + 500, crossed);
  ExpectSame(WorkingMesh(complex), OneByOne(complex));
  EXPECT_LT(WorkingMesh(complex).cell_slots(), static_cast<int>(complex.cells.size()));
}

}  // namespace
}  // namespace amhex
