// Fills triangles and draws lines with a depth buffer, at several samples per pixel.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "amhex/vec3.h"
#include "picture/image.h"

namespace amhex::client {

using Colour = std::array<float, 3>;  // red, green, blue in [0, 1]

class Raster {
 public:
  // Samples per pixel and axis: edges come out smooth.
  static constexpr int kSamples = 3;

  Raster(int width, int height, const Colour& background);

  // Corners are (x, y, depth): pixels from the top left, and a depth that grows away from the
  // viewer. Polygons are convex, flat in colour and drawn from both sides.
  void FillPolygon(std::span<const Vec3d> corners, const Colour& colour);

  // A line of the given width in pixels, drawn as if `nearer` closer to the viewer, so that it
  // wins over the faces that it bounds.
  void DrawLine(const Vec3d& a, const Vec3d& b, double width, double nearer, const Colour& colour);

  // The mean of every pixel's samples.
  Image Resolve() const;

 private:
  void FillTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Colour& colour);

  int width_, height_;  // in samples
  std::vector<float> depth_;
  std::vector<std::array<uint8_t, 3>> colour_;
};

}  // namespace amhex::client
