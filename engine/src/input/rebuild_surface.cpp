#include "input/rebuild_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/cloud_field.h"
#include "input/cloud_samples.h"
#include "input/edge_length.h"
#include "input/fair_openings.h"
#include "input/hull_queries.h"
#include "input/level_surface.h"
#include "input/orient_components.h"
#include "input/query_cost.h"
#include "input/surface_topology.h"
#include "input/thin_cloud.h"
#include "input/triangle_math.h"
#include "input/winding_in_lanes.h"

namespace amhex {
namespace {

// Grid cells per edge length: enough for what cells of that length can follow; finer where the
// samples are denser, as far as that helps.
constexpr double kCoarsestCells = 2.5;
constexpr double kFinestCells = 6.0;
constexpr double kSoupCells = 4.0;
// The surface may cross this many grid cells, and no more than so many for the size asked for: of a
// cube of 300 cells it crosses 4,000, of a scan twice that.
constexpr double kMostSurfaceCells = 4e6;
constexpr double kSurfaceCells = 5e4;
constexpr double kSurfaceCellsPerCell = 300;
// The box is divided into this many blocks per axis to guess the volume. Blocks near a triangle or
// where the winding number is between these bounds (openings) are halved along every axis, this
// often at most.
constexpr int kVolumeBlocks = 7;
constexpr int kVolumeHalvings = 3;
constexpr double kSurelyOutside = 0.1;
constexpr double kSurelyInside = 0.9;
// Discs leave gaps: a block is near them within this many of its half diagonals.
constexpr double kNearBlock = 1.25;
// Clouds of more points are thinned to this many points per edge length; a first, coarse thinning
// to this many cubes along the box's diagonal tells the volume.
constexpr size_t kManyPoints = 200'000;
constexpr double kPointsPerEdgeLength = 8;
constexpr double kCoarseCubes = 150;
// Pieces below this many cells are left out.
constexpr double kSmallestPieceCells = 0.5;
// Telling inside from outside of a soup may look at so many nodes and triangles of its hierarchy,
// ten to twenty seconds of one core, and at so many more for every cell wanted, ten times what the
// cell costs later. Scans need a quarter of it or less.
constexpr double kMostSteps = 1e9;
constexpr double kMostStepsPerCell = 2e5;
// Winding numbers that a soup is asked for: to count the volume where no block is sure, and per
// grid cell that a triangle crosses (measured: 14 to 21 on scans, 4 where they fill the box).
constexpr double kVolumeQuestions = 343 * (1 + 8 + 64 + 512);
constexpr double kQuestionsPerCrossing = 17;
// Rows of seeds on all triangles hold no more.
constexpr double kMostSeeds = 4e7;

class VolumeCount {
 public:
  VolumeCount(const Box3d& box, const HullQueries& queries, const RunContext& run)
      : low_(box.low), side_(box.Extent() / kVolumeBlocks), queries_(queries), run_(run) {}

  double Count() const {
    std::vector<int64_t> inside(size_t{kVolumeBlocks} * kVolumeBlocks * kVolumeBlocks, 0);
    tbb::parallel_for(size_t{0}, inside.size(), [&](size_t i) {
      const size_t x = i % kVolumeBlocks, y = i / kVolumeBlocks % kVolumeBlocks,
                   z = i / kVolumeBlocks / kVolumeBlocks;
      const Vec3d at{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
      const Vec3d low = low_ + Scaled(at, side_);
      inside[i] = CountIn(low, side_, kVolumeHalvings, queries_.WindingNumber(low + side_ / 2.0));
    });
    const int64_t total = std::accumulate(inside.begin(), inside.end(), int64_t{0});
    return static_cast<double>(total) * side_.x * side_.y * side_.z /
           static_cast<double>(SmallestIn(kVolumeHalvings));
  }

 private:
  static int64_t SmallestIn(int halvings) { return int64_t{1} << (3 * halvings); }
  static Vec3d Scaled(const Vec3d& a, const Vec3d& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

  // In smallest blocks; `winding` around the block's centre.
  int64_t CountIn(const Vec3d& low, const Vec3d& side, int halvings, double winding) const {
    if (run_.ShouldStop()) return 0;
    const Vec3d centre = low + side / 2.0;
    const bool is_sure = halvings == 0 || ((winding < kSurelyOutside || winding > kSurelyInside) &&
                                           !queries_.IsWithin(centre, kNearBlock * Norm(side) / 2));
    if (is_sure) return winding > 0.5 ? SmallestIn(halvings) : 0;
    std::array<Vec3d, 8> eighth, middle;
    for (size_t i = 0; i < 8; ++i) {
      const size_t x = i % 2, y = i / 2 % 2, z = i / 4;
      const Vec3d at{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
      eighth[i] = low + Scaled(at, side / 2.0);
      middle[i] = eighth[i] + side / 2.0 / 2.0;
    }
    const auto around = WindingNumbers(queries_.view(), middle.data(), 8);
    int64_t count = 0;
    for (size_t i = 0; i < 8; ++i) count += CountIn(eighth[i], side / 2.0, halvings - 1, around[i]);
    return count;
  }

  const Vec3d low_, side_;
  const HullQueries& queries_;
  const RunContext& run_;
};

// In the user's units.
double GuessEdgeLength(const WantedSize& wanted, const Box3d& box, const HullQueries& queries,
                       RunContext& run) {
  if (wanted.user_edge_length > 0) return wanted.user_edge_length;
  const double volume = VolumeCount(box, queries, run).Count();
  const int64_t cells = wanted.cell_count > 0 ? wanted.cell_count : kDefaultCellCount;
  // A solid too thin for the counting grid still gets a usable length.
  const double least = box.Diagonal() * box.Diagonal() * box.Diagonal() * 1e-4;
  return std::cbrt(std::max(volume, least) / static_cast<double>(cells)) * wanted.user_scale;
}

std::array<Vec3d, 3> CornersOf(const TriangleMesh& mesh, size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return {mesh.vertices[static_cast<size_t>(t[0])], mesh.vertices[static_cast<size_t>(t[1])],
          mesh.vertices[static_cast<size_t>(t[2])]};
}

double AreaOf(const TriangleMesh& mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = CornersOf(mesh, t);
    area += Norm(DoubleAreaVector(a, b, c)) / 2;
  }
  return area;
}

Box3d BoxOf(const std::vector<Vec3d>& points) {
  Box3d box;
  for (const Vec3d& p : points) box.Extend(p);
  return box;
}

// Leaves out components that could hold no cell.
absl::StatusOr<ClosedSurface> KeepPieces(TriangleMesh mesh, double edge_length) {
  ClosedSurface surface;
  const Components components = FindComponents(FindEdgeAdjacency(mesh));
  const std::vector<double> volumes = ComponentVolumes(mesh, components);
  const double least = kSmallestPieceCells * edge_length * edge_length * edge_length;
  int64_t dropped = 0;
  for (const double volume : volumes) dropped += std::abs(volume) < least;
  size_t kept = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto component = static_cast<size_t>(components.of_triangle[t]);
    if (std::abs(volumes[component]) >= least) mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  DropUnusedVertices(mesh);
  if (mesh.triangles.empty()) return absl::InvalidArgumentError("the input encloses no volume");
  if (dropped > 0) {
    surface.warnings.push_back(
        absl::StrCat("pieces too small for half a cell, left out: ", dropped));
  }
  surface.mesh = std::move(mesh);
  return surface;
}

// The solid of a triangle soup: its winding number jumps at the triangles.
class SoupField : public SurfaceField {
 public:
  explicit SoupField(const HullQueries& queries) : queries_(queries) {}
  double Value(const Vec3d& p) const override { return 0.5 - queries_.WindingNumber(p); }
  EightValues Values(const EightPoints& p) const override {
    EightValues values = WindingNumbers(queries_.view(), p.data(), 8);
    for (double& value : values) value = 0.5 - value;
    return values;
  }
  Vec3d Normal(const Vec3d& p, double spacing) const override {
    // At a triangle its normal; in an opening the slope of the winding number.
    const HullPoint closest = queries_.Closest(p, kAtTriangle * spacing);
    if (closest.triangle >= 0) {
      const Vec3d probe = closest.normal * (2 * kAtTriangle * spacing);
      const bool looks_outward = Value(p + probe) >= Value(p - probe);
      return looks_outward ? closest.normal : -closest.normal;
    }
    const double step = spacing / 4;
    const auto slope = [&](const Vec3d& d) { return Value(p + d) - Value(p - d); };
    return Normalized(Vec3d{slope({step, 0, 0}), slope({0, step, 0}), slope({0, 0, step})});
  }

 private:
  static constexpr double kAtTriangle = 0.02;  // grid cells
  const HullQueries& queries_;
};

// About how many cells, where only their size is given: as many as fill the box.
double CellsWanted(const WantedSize& wanted, const Box3d& box) {
  if (wanted.cell_count > 0) return static_cast<double>(wanted.cell_count);
  if (!(wanted.user_edge_length > 0)) return static_cast<double>(kDefaultCellCount);
  const Vec3d extent = box.Extent() * (wanted.user_scale / wanted.user_edge_length);
  return std::min(extent.x * extent.y * extent.z, static_cast<double>(kMaxCellCount));
}

// The grid for a surface of this area: as wanted, coarser where that is too much for the cells.
absl::StatusOr<double> SpacingFor(double area, double spacing, double edge_length, double cells) {
  const double most = std::min(kMostSurfaceCells, kSurfaceCells + kSurfaceCellsPerCell * cells);
  const double needed = std::sqrt(area / most);
  if (needed <= edge_length) return std::max(spacing, needed);
  return absl::InvalidArgumentError(absl::StrCat(
      "the surface to be rebuilt has an area of ", area / (edge_length * edge_length),
      " squared edge lengths, the limit is ", most, " for ", cells,
      " cells: stray vertices or points, most likely, or too few cells for so much surface"));
}

double QuestionsAbout(const TriangleMesh& soup, const Box3d& box, double spacing) {
  const LevelGrid grid = GridAround(box, spacing);
  double nodes = 1;
  for (const int64_t count : grid.node_count) nodes *= static_cast<double>(count);
  return kQuestionsPerCrossing * std::min(nodes, AreaOf(soup) / (spacing * spacing));
}

absl::Status CheckSteps(double questions, double steps_each, double cells) {
  const double steps = questions * steps_each, limit = kMostSteps + kMostStepsPerCell * cells;
  if (steps <= limit) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "the input's triangles bound no solid and reach so far across each other that telling inside "
      "from outside would take about ",
      steps, " steps, ", steps_each, " for each place; the limit is ", limit, " for ", cells,
      " cells: mend the input, stray vertices most likely, or remesh it"));
}

// Points of a triangle of which any other one is within a grid cell: along rows that are parallel
// to its longest edge, so that a needle gets few.
void AppendSeeds(std::array<Vec3d, 3> corners, double spacing, std::vector<Vec3d>& seeds) {
  const auto length = [&](size_t i) { return Norm(corners[(i + 1) % 3] - corners[i]); };
  size_t first = 0;
  for (size_t i = 1; i < 3; ++i) {
    if (length(i) > length(first)) first = i;
  }
  std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(first), corners.end());
  const Vec3d along = corners[1] - corners[0], aside = corners[2] - corners[0];
  const double longest = Norm(along);
  if (longest <= spacing) {
    seeds.push_back(corners[0]);
    return;
  }
  const double height = Norm(Cross(along, aside)) / longest;
  const int rows = std::max(1, static_cast<int>(std::ceil(height / spacing)));
  for (int row = 0; row <= rows; ++row) {
    const double up = static_cast<double>(row) / rows;
    const Vec3d begin = corners[0] + aside * up, row_along = along * (1 - up);
    const int count = std::max(1, static_cast<int>(std::ceil(longest * (1 - up) / spacing)));
    for (int i = 0; i <= count; ++i) {
      seeds.push_back(begin + row_along * (static_cast<double>(i) / count));
    }
  }
}

absl::StatusOr<std::vector<Vec3d>> SeedsOn(const TriangleMesh& mesh, double spacing,
                                           const StopPoll& poll) {
  std::vector<Vec3d> seeds;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    AppendSeeds(CornersOf(mesh, t), spacing, seeds);
    if (static_cast<double>(seeds.size()) > kMostSeeds) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the triangles to be rebuilt cross more than ", kMostSeeds,
                       " grid cells; choose a larger edge length"));
    }
  }
  return seeds;
}

// Centres of the triangles that part inside from outside; the others lie within the solid.
std::vector<Vec3d> BoundaryCentres(const TriangleMesh& mesh, const SoupField& field,
                                   double spacing) {
  constexpr double kProbe = 0.05;  // grid cells
  std::vector<Vec3d> centres;
  for (const auto& t : mesh.triangles) {
    const Vec3d& a = mesh.vertices[static_cast<size_t>(t[0])];
    const Vec3d& b = mesh.vertices[static_cast<size_t>(t[1])];
    const Vec3d& c = mesh.vertices[static_cast<size_t>(t[2])];
    const Vec3d offset = Normalized(DoubleAreaVector(a, b, c)) * (kProbe * spacing);
    const Vec3d centre = (a + b + c) / 3.0;
    const bool above = field.Value(centre + offset) < 0, below = field.Value(centre - offset) < 0;
    if (above != below) centres.push_back(centre);
  }
  return centres;
}

// Millions of points cost time and memory that cells of the wanted size cannot make use of.
absl::StatusOr<PointCloud> ThinToUse(PointCloud cloud, const WantedSize& wanted, RunContext& run,
                                     std::vector<std::string>& warnings) {
  if (cloud.points.size() <= kManyPoints) return cloud;
  const Box3d box = BoxOf(cloud.points);
  PointCloud coarse = cloud;
  ThinCloud(box.Diagonal() / kCoarseCubes, coarse, StopPoll(run));
  std::vector<std::string> ignored;
  AMHEX_ASSIGN_OR_RETURN(const CloudSamples samples, PrepareCloud(coarse, run, ignored));
  const TriangleMesh discs = DiscSoup(samples);
  const double edge_length =
      GuessEdgeLength(wanted, box, HullQueries(discs.vertices, discs.triangles, StopPoll(run)),
                      run) /
      wanted.user_scale;
  const int64_t taken = ThinCloud(edge_length / kPointsPerEdgeLength, cloud, StopPoll(run));
  if (taken > 0) {
    warnings.push_back(
        absl::StrCat("points denser than the cells can use, merged with neighbours: ", taken));
  }
  return cloud;
}

}  // namespace

absl::StatusOr<ClosedSurface> RebuildFromCloud(const PointCloud& cloud, const WantedSize& wanted,
                                               RunContext& run) {
  std::vector<std::string> warnings;
  AMHEX_ASSIGN_OR_RETURN(const PointCloud thinned, ThinToUse(cloud, wanted, run, warnings));
  AMHEX_ASSIGN_OR_RETURN(CloudSamples samples, PrepareCloud(thinned, run, warnings));
  const CloudField field(std::move(samples));
  const CloudSamples& used = field.samples();
  const Box3d box = BoxOf(used.position);
  const double user_edge_length = GuessEdgeLength(wanted, box, field.discs(), run);
  const double edge_length = user_edge_length / wanted.user_scale;
  double area = 0;
  std::vector<double> spacings = used.spacing;
  for (const double s : spacings) area += s * s;
  std::nth_element(spacings.begin(),
                   spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2),
                   spacings.end());
  const double wanted_spacing = std::clamp(
      spacings[spacings.size() / 2], edge_length / kFinestCells, edge_length / kCoarsestCells);
  AMHEX_ASSIGN_OR_RETURN(const double spacing,
                         SpacingFor(area, wanted_spacing, edge_length, CellsWanted(wanted, box)));
  AMHEX_ASSIGN_OR_RETURN(TriangleMesh mesh,
                         ExtractLevel(GridAround(box, spacing), field, used.position, run));
  FairOpenings(used, field.tree(), edge_length, spacing, mesh, StopPoll(run));
  AMHEX_ASSIGN_OR_RETURN(ClosedSurface surface, KeepPieces(std::move(mesh), edge_length));
  surface.warnings.insert(surface.warnings.begin(), warnings.begin(), warnings.end());
  surface.input_points = used.position;
  surface.user_edge_length = user_edge_length;
  return surface;
}

absl::StatusOr<ClosedSurface> RebuildFromSoup(const TriangleMesh& soup, const WantedSize& wanted,
                                              RunContext& run) {
  const HullQueries queries(soup.vertices, soup.triangles, StopPoll(run));
  const Box3d box = BoxOf(soup.vertices);
  const double steps_each = MeanWindingSteps(queries.view());
  const double cells = CellsWanted(wanted, box);
  AMHEX_RETURN_IF_ERROR(CheckSteps(kVolumeQuestions, steps_each, cells));
  const double user_edge_length = GuessEdgeLength(wanted, box, queries, run);
  const double edge_length = user_edge_length / wanted.user_scale;
  AMHEX_ASSIGN_OR_RETURN(const double spacing,
                         SpacingFor(AreaOf(soup), edge_length / kSoupCells, edge_length, cells));
  const SoupField field(queries);
  AMHEX_RETURN_IF_ERROR(CheckSteps(QuestionsAbout(soup, box, spacing), steps_each, cells));
  AMHEX_ASSIGN_OR_RETURN(const std::vector<Vec3d> seeds, SeedsOn(soup, spacing, StopPoll(run)));
  AMHEX_ASSIGN_OR_RETURN(TriangleMesh mesh,
                         ExtractLevel(GridAround(box, spacing), field, seeds, run));
  AMHEX_ASSIGN_OR_RETURN(ClosedSurface surface, KeepPieces(std::move(mesh), edge_length));
  surface.input_points = BoundaryCentres(soup, field, spacing);
  surface.user_edge_length = user_edge_length;
  return surface;
}

}  // namespace amhex
