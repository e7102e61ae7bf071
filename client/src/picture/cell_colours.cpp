#include "picture/cell_colours.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace amhex::client {
namespace {

// A single cell far away would leave one colour for all others.
constexpr double kFarPercentile = 0.99;

// The distance that is shown in red.
double FarDistance(std::span<const float> distances) {
  std::vector<float> measured;
  for (float distance : distances) {
    if (!std::isnan(distance)) measured.push_back(distance);
  }
  if (measured.empty()) return 0;
  std::sort(measured.begin(), measured.end());
  const double last = static_cast<double>(measured.size() - 1);
  const float far = measured[static_cast<size_t>(kFarPercentile * last)];
  return far > 0 ? far : measured.back();
}

}  // namespace

Colour RampColour(double fraction) {
  constexpr std::array<Colour, 5> kStops = {{{0.70f, 0.09f, 0.17f},
                                             {0.94f, 0.54f, 0.38f},
                                             {0.99f, 0.86f, 0.47f},
                                             {0.65f, 0.81f, 0.78f},
                                             {0.26f, 0.47f, 0.75f}}};
  const double place = std::clamp(fraction, 0.0, 1.0) * (kStops.size() - 1);
  const size_t low = std::min(static_cast<size_t>(place), kStops.size() - 2);
  const auto share = static_cast<float>(place - static_cast<double>(low));
  Colour colour;
  for (size_t i = 0; i < colour.size(); ++i) {
    colour[i] = kStops[low][i] + (kStops[low + 1][i] - kStops[low][i]) * share;
  }
  return colour;
}

absl::StatusOr<std::vector<Colour>> ColoursOfCells(const AtMostHexaMesh& mesh, Colouring colouring,
                                                   std::span<const float> distances) {
  std::vector<Colour> colours(mesh.corners.size());
  if (colouring == Colouring::kDistance && distances.size() != colours.size()) {
    return absl::FailedPreconditionError(
        "the mesh does not know its distance to the input; --input FILE measures it");
  }
  const double far = colouring == Colouring::kDistance ? FarDistance(distances) : 0;
  for (size_t cell = 0; cell < colours.size(); ++cell) {
    if (colouring == Colouring::kType) {
      const bool is_hexahedron = mesh.types[cell] == PrimitiveType::kHexahedron;
      colours[cell] = is_hexahedron ? kHexahedronColour : kOtherCellColour;
    } else if (colouring == Colouring::kQuality) {
      colours[cell] = RampColour(mesh.quality[cell]);
    } else if (std::isnan(distances[cell])) {
      colours[cell] = kNotMeasuredColour;
    } else {
      colours[cell] = RampColour(far > 0 ? 1 - distances[cell] / far : 1);
    }
  }
  return colours;
}

}  // namespace amhex::client
