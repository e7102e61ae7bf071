#include "input/fair_openings.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "input/embedding_check.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

// Distances from the nearest sample, in its spacing. Of samples scattered evenly over a surface,
// one place in 25 has none within 1 and one in 300,000 none within 2: what is farther lies in an
// opening, which reaches to where samples are as near as anywhere. Towards its rim vertices move
// less and less.
constexpr double kInOpening = 2.0;
constexpr double kAtRim = 1.0;
constexpr double kFreely = 1.5;
// Every step moves a vertex this far towards its neighbours' mean, at most.
constexpr double kStep = 0.5;
// What is narrower than this many edge lengths is evened out.
constexpr double kFairedEdgeLengths = 1.5;
// Share of an opening's area that may have a wrong side once it is evened out.
constexpr double kMostMisbounded = 1e-3;

// A vertex that moves and the vertices next to it.
struct FreeVertex {
  int32_t vertex = 0;
  double step = 0;  // ]0, kStep]
  std::vector<int32_t> neighbours;
};
using Opening = std::vector<FreeVertex>;

// [vertex_count] of `mesh`, distance to the nearest sample in its spacing.
std::vector<double> DistanceRatios(const CloudSamples& samples, const PointTree& tree,
                                   const TriangleMesh& mesh, const StopPoll& poll) {
  std::vector<double> ratios(mesh.vertices.size());
  tbb::parallel_for(size_t{0}, ratios.size(), [&](size_t v) {
    poll.At(static_cast<int64_t>(v));
    const PointTree::Neighbour nearest = tree.Nearest(mesh.vertices[v]);
    const double spacing = samples.spacing[static_cast<size_t>(nearest.index)];
    ratios[v] = std::sqrt(nearest.squared_distance) / spacing;
  });
  return ratios;
}

// Vertices beyond the rim, connected by edges, with one in an opening among them.
std::vector<Opening> FindOpenings(const TriangleMesh& mesh, const std::vector<double>& ratios) {
  const auto is_in_opening = [](double ratio) { return ratio > kInOpening; };
  if (std::none_of(ratios.begin(), ratios.end(), is_in_opening)) return {};
  std::vector<std::vector<int32_t>> neighbours(ratios.size());
  for (const auto& t : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const auto v = static_cast<size_t>(t[i]);
      if (ratios[v] > kAtRim) neighbours[v].push_back(t[(i + 1) % 3]);
    }
  }
  std::vector<Opening> openings;
  std::vector<uint8_t> is_taken(ratios.size(), 0);
  for (size_t start = 0; start < ratios.size(); ++start) {
    if (!is_in_opening(ratios[start]) || is_taken[start] != 0) continue;
    Opening opening;
    std::vector<int32_t> reached = {static_cast<int32_t>(start)};
    is_taken[start] = 1;
    for (size_t i = 0; i < reached.size(); ++i) {
      const auto v = static_cast<size_t>(reached[i]);
      const double share = std::min(1.0, (ratios[v] - kAtRim) / (kFreely - kAtRim));
      for (const int32_t next : neighbours[v]) {
        const auto n = static_cast<size_t>(next);
        if (ratios[n] > kAtRim && is_taken[n] == 0) {
          is_taken[n] = 1;
          reached.push_back(next);
        }
      }
      opening.push_back({reached[i], kStep * share, std::move(neighbours[v])});
    }
    openings.push_back(std::move(opening));
  }
  return openings;
}

void Fair(const Opening& opening, int step_count, std::vector<Vec3d>& vertices,
          const StopPoll& poll) {
  std::vector<Vec3d> moved(opening.size());
  for (int step = 0; step < step_count; ++step) {
    poll.Now();
    tbb::parallel_for(size_t{0}, opening.size(), [&](size_t i) {
      const Vec3d& here = vertices[static_cast<size_t>(opening[i].vertex)];
      Vec3d mean{};
      for (const int32_t n : opening[i].neighbours) mean += vertices[static_cast<size_t>(n)];
      mean = mean / static_cast<double>(opening[i].neighbours.size());
      moved[i] = here + (mean - here) * opening[i].step;
    });
    for (size_t i = 0; i < opening.size(); ++i) {
      vertices[static_cast<size_t>(opening[i].vertex)] = moved[i];
    }
  }
}

// Whether the triangles with a moved vertex part inside from outside.
std::vector<uint8_t> AreEmbedded(const std::vector<Opening>& openings, const TriangleMesh& mesh,
                                 const StopPoll& poll) {
  std::vector<int32_t> opening_of(mesh.vertices.size(), -1);
  for (size_t o = 0; o < openings.size(); ++o) {
    for (const FreeVertex& free : openings[o]) {
      opening_of[static_cast<size_t>(free.vertex)] = static_cast<int32_t>(o);
    }
  }
  std::vector<TriangleMesh> parts(openings.size());
  for (const auto& t : mesh.triangles) {
    int32_t opening = -1;  // two of them never share a triangle: they would be one
    for (const int32_t v : t) opening = std::max(opening, opening_of[static_cast<size_t>(v)]);
    if (opening >= 0) parts[static_cast<size_t>(opening)].triangles.push_back(t);
  }
  const HullQueries queries(mesh.vertices, mesh.triangles, poll);
  std::vector<uint8_t> are_embedded(openings.size(), 0);
  TriangleMesh part{mesh.vertices, {}};
  for (size_t o = 0; o < openings.size(); ++o) {
    part.triangles = std::move(parts[o].triangles);
    are_embedded[o] = MisboundedAreaRatio(part, queries, poll) <= kMostMisbounded ? 1 : 0;
  }
  return are_embedded;
}

}  // namespace

void FairOpenings(const CloudSamples& samples, const PointTree& tree, double edge_length,
                  double spacing, TriangleMesh& mesh, const StopPoll& poll) {
  const std::vector<Opening> openings =
      FindOpenings(mesh, DistanceRatios(samples, tree, mesh, poll));
  if (openings.empty()) return;
  // Steps spread a vertex's place as diffusion does: over the square root of kStep times their
  // number, in distances between vertices.
  const double reach = kFairedEdgeLengths * edge_length / spacing;
  const int step_count = static_cast<int>(std::ceil(reach * reach / kStep));
  const std::vector<Vec3d> before = mesh.vertices;
  for (const Opening& opening : openings) Fair(opening, step_count, mesh.vertices, poll);
  const std::vector<uint8_t> are_embedded = AreEmbedded(openings, mesh, poll);
  for (size_t o = 0; o < openings.size(); ++o) {
    if (are_embedded[o] != 0) continue;
    for (const FreeVertex& free : openings[o]) {
      const auto v = static_cast<size_t>(free.vertex);
      mesh.vertices[v] = before[v];
    }
  }
}

}  // namespace amhex
