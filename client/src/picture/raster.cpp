#include "picture/raster.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amhex::client {
namespace {

std::array<uint8_t, 3> ToBytes(const Colour& colour) {
  std::array<uint8_t, 3> bytes{};
  for (int i = 0; i < 3; ++i) {
    bytes[i] = static_cast<uint8_t>(std::lround(std::clamp(colour[i], 0.0f, 1.0f) * 255.0f));
  }
  return bytes;
}

// Twice the signed area of (a, b, p) in the picture's plane.
double Side(const Vec3d& a, const Vec3d& b, double x, double y) {
  return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

}  // namespace

Raster::Raster(int width, int height, const Colour& background)
    : width_(width * kSamples),
      height_(height * kSamples),
      depth_(size_t(width_) * size_t(height_), std::numeric_limits<float>::infinity()),
      colour_(size_t(width_) * size_t(height_), ToBytes(background)) {}

void Raster::FillPolygon(std::span<const Vec3d> corners, const Colour& colour) {
  for (size_t i = 2; i < corners.size(); ++i) {
    FillTriangle(corners[0], corners[i - 1], corners[i], colour);
  }
}

void Raster::FillTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Colour& colour) {
  const Vec3d pa{a.x * kSamples, a.y * kSamples, a.z};
  const Vec3d pb{b.x * kSamples, b.y * kSamples, b.z};
  const Vec3d pc{c.x * kSamples, c.y * kSamples, c.z};
  const double area = Side(pa, pb, pc.x, pc.y);
  if (area == 0 || !std::isfinite(area)) return;
  const auto bound = [](double value, int most) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
  };
  const int x0 = bound(std::floor(std::min({pa.x, pb.x, pc.x})), width_ - 1);
  const int x1 = bound(std::ceil(std::max({pa.x, pb.x, pc.x})), width_ - 1);
  const int y0 = bound(std::floor(std::min({pa.y, pb.y, pc.y})), height_ - 1);
  const int y1 = bound(std::ceil(std::max({pa.y, pb.y, pc.y})), height_ - 1);
  const std::array<uint8_t, 3> bytes = ToBytes(colour);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const double u = Side(pb, pc, x + 0.5, y + 0.5) / area;
      const double v = Side(pc, pa, x + 0.5, y + 0.5) / area;
      const double w = 1 - u - v;
      if (u < 0 || v < 0 || w < 0) continue;
      const float depth = static_cast<float>(u * pa.z + v * pb.z + w * pc.z);
      const size_t at = size_t(y) * size_t(width_) + size_t(x);
      if (depth >= depth_[at]) continue;
      depth_[at] = depth;
      colour_[at] = bytes;
    }
  }
}

void Raster::DrawLine(const Vec3d& a, const Vec3d& b, double width, double nearer,
                      const Colour& colour) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double length = std::hypot(dx, dy);
  if (length == 0) return;
  const Vec3d across = Vec3d{-dy, dx, 0} * (0.5 * width / length);
  const Vec3d shift{0, 0, -nearer};
  const std::array<Vec3d, 4> ribbon = {a + across + shift, b + across + shift, b - across + shift,
                                       a - across + shift};
  FillPolygon(ribbon, colour);
}

Image Raster::Resolve() const {
  Image image;
  image.width = width_ / kSamples;
  image.height = height_ / kSamples;
  image.rgb.resize(size_t(image.width) * size_t(image.height) * 3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      std::array<int, 3> sum{};
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const int sample_x = x * kSamples + s % kSamples, sample_y = y * kSamples + s / kSamples;
        const auto& sample = colour_[size_t(sample_y) * size_t(width_) + size_t(sample_x)];
        for (int i = 0; i < 3; ++i) sum[i] += sample[i];
      }
      uint8_t* pixel = &image.rgb[3 * (size_t(y) * size_t(image.width) + size_t(x))];
      for (int i = 0; i < 3; ++i) {
        pixel[i] = static_cast<uint8_t>(sum[i] / (kSamples * kSamples));
      }
    }
  }
  return image;
}

}  // namespace amhex::client
