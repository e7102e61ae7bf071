#include "relax/device_memory.h"

#include <cmath>

#include "exec/cpu_executor.h"
#include "relax/label_groups.h"
#include "relax/relaxation.h"
#include "relax/relaxation_arrays.h"

namespace amhex {
namespace {

// Layers of outside sites around a grid's inside ones, and of room around the hull, with and
// without them (input/site_grid.cpp, relax/relaxation.cpp); edge lengths.
constexpr double kOutsideLayers = 1.0;
constexpr double kRoomWithOutside = 3.0;
constexpr double kRoomInsideOnly = 1.0;

// A cube of this volume, wider by so much on every side.
double Widened(double volume, double by) { return std::pow(std::cbrt(volume) + 2 * by, 3); }

// The arrays of one site, and its places in the bins and in the sort.
double BytesPerSite() {
  constexpr int64_t kBinsAndSort = 16 + 8;
  int64_t sum = kBinsAndSort;
  RelaxationArrays<CpuExecutor>().VisitAll(1, [&sum](auto& array, int64_t count) {
    sum += count * static_cast<int64_t>(sizeof(*array.View().data));
  });
  return static_cast<double>(sum);
}

}  // namespace

int64_t ExpectedRelaxationBytes(int64_t cell_count, double fill, const RelaxationParams& params) {
  const auto cells = static_cast<double>(cell_count);
  const bool has_outside = params.initialization != Initialization::kField;
  const double sites = has_outside ? Widened(cells, kOutsideLayers) : cells;
  const double capacity = ResolveIterationCount(params) > 0 ? sites * (1 + kLargestGrowth) : sites;
  const double box = Widened(cells / fill, has_outside ? kRoomWithOutside : kRoomInsideOnly);
  const double tiles_per_cell = params.lattice_points_per_site / static_cast<double>(kTilePoints);
  // Two sets of bins of one edge length, and the side of every tile.
  constexpr double kBytesPerBin = 2 * sizeof(int32_t), kBytesPerTile = sizeof(int32_t);
  const FccLattice lattice{std::cbrt(0.5 / params.lattice_points_per_site), 0, 0, 0};
  const LabelShape shape = ShapeOf(lattice);
  const double bytes_per_labelled_tile =
      static_cast<double>(sizeof(LabelItem)) +
      static_cast<double>(LabelBytesPerGroup(shape)) / TilesPerGroup(shape);
  return static_cast<int64_t>(capacity * BytesPerSite() +
                              box * (kBytesPerBin + tiles_per_cell * kBytesPerTile) +
                              sites * tiles_per_cell * bytes_per_labelled_tile);
}

}  // namespace amhex
