// Solids that need no file: each a signed distance, negative inside.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/vec3.h"

namespace amhex::client {

struct Shape {
  std::string name;
  // Never larger in magnitude than sqrt(2) times the true distance, and exact on flat and round
  // parts near the surface; zero on the surface and nowhere else.
  std::function<double(const Vec3d&)> distance;
  Box3d box;  // encloses the solid
};

// "bracket", "sphere", "cube", "torus".
std::vector<std::string> ShapeNames();

// The bracket is a machined part in millimetres: a base plate with rounded corners, an upright
// flange and a rib between them, five through holes, fillets of 8 and 4 mm in the inner edges.
// The others are centred at the origin with a size of about one.
// INVALID_ARGUMENT for an unknown name; the message lists the known ones.
absl::StatusOr<Shape> MakeShape(const std::string& name);

// Unit outward normal: the distance's gradient by central differences.
Vec3d NormalAt(const Shape& shape, const Vec3d& p);

}  // namespace amhex::client
