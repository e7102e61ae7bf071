#include "picture/mesh_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "cells/boundary.h"
#include "cells/cells.h"

namespace amhex::client {
namespace {

constexpr int kFewestPixels = 16, kMostPixels = 8192;
constexpr double kFrame = 0.06;       // of the picture left free on each side
constexpr double kLineWidth = 1.1;    // pixels
constexpr double kLineNearer = 2e-3;  // of the mesh's diagonal
constexpr Colour kLineColour = {0.20f, 0.22f, 0.26f};
constexpr float kAmbient = 0.66f;  // light from everywhere; the rest comes from the lamp

// Where the viewer is: in front at the right, above.
Vec3d TowardsViewer(const PictureOptions& options) {
  Vec3d towards = {0.62, -0.80, 0.50};
  // The cut is looked at rather steeply.
  constexpr double kFacing = 1.25;
  if (options.cut) {
    towards[options.cut->axis] = std::copysign(kFacing, towards[options.cut->axis]);
  }
  return Normalized(towards);
}

// Parallel projection that shows all of `faces`.
class Camera {
 public:
  Camera(const std::vector<BoundaryFace>& faces, const std::vector<Vec3d>& vertices,
         const PictureOptions& options)
      : towards_(TowardsViewer(options)) {
    right_ = Normalized(Cross(Vec3d{0, 0, 1}, towards_));
    up_ = Cross(towards_, right_);
    Box3d seen;
    for (const BoundaryFace& b : faces) {
      for (int i = 0; i < b.face.count; ++i) {
        const Vec3d& v = vertices[b.face.vertex[i]];
        seen.Extend({Dot(v, right_), Dot(v, up_), Dot(v, towards_)});
      }
    }
    const Vec3d extent = seen.Extent();
    const double room = 1 - 2 * kFrame;
    scale_ = std::min(options.width * room / std::max(extent.x, 1e-300),
                      options.height * room / std::max(extent.y, 1e-300));
    middle_ = (seen.low + seen.high) / 2.0;
    centre_x_ = options.width / 2.0;
    centre_y_ = options.height / 2.0;
    diagonal_ = seen.Diagonal();
  }

  Vec3d Project(const Vec3d& v) const {
    return {centre_x_ + (Dot(v, right_) - middle_.x) * scale_,
            centre_y_ - (Dot(v, up_) - middle_.y) * scale_,
            (middle_.z - Dot(v, towards_)) / diagonal_};
  }
  const Vec3d& towards() const { return towards_; }
  // From above and a little left of the viewer.
  Vec3d Lamp() const { return Normalized(towards_ + up_ * 0.55 - right_ * 0.35); }

 private:
  Vec3d towards_, right_, up_, middle_;
  double scale_ = 1, centre_x_ = 0, centre_y_ = 0, diagonal_ = 1;
};

Vec3d NormalOf(const Face& face, const std::vector<Vec3d>& vertices) {
  const Vec3d origin = vertices[face.vertex[0]];
  Vec3d sum;
  for (int i = 1; i + 1 < face.count; ++i) {
    sum += Cross(vertices[face.vertex[i]] - origin, vertices[face.vertex[i + 1]] - origin);
  }
  return Normalized(sum);
}

Colour Shade(const Colour& colour, const Vec3d& normal, const Camera& camera) {
  const float lit = static_cast<float>(std::max(0.0, Dot(normal, camera.Lamp())));
  const float factor = kAmbient + (1 - kAmbient) * lit;
  return {colour[0] * factor, colour[1] * factor, colour[2] * factor};
}

// Faces on the hull are lighter than those inside where colours say the type.
const Colour& ColourOfFace(const Colour& cell, bool on_hull, const PictureOptions& options) {
  if (!on_hull || options.colouring != Colouring::kType) return cell;
  return cell == kHexahedronColour ? kHullColour : kHullOtherColour;
}

std::vector<bool> CellsBehind(const AtMostHexaMesh& mesh, const Cut& cut, const Vec3d& towards) {
  Box3d box;
  for (const Vec3d& v : mesh.vertices) box.Extend(v);
  const double plane = box.low[cut.axis] + cut.fraction * box.Extent()[cut.axis];
  std::vector<bool> keep(mesh.corners.size());
  for (size_t cell = 0; cell < keep.size(); ++cell) {
    const double offset = CentreOfCell(mesh.corners[cell], mesh.vertices)[cut.axis] - plane;
    keep[cell] = offset * towards[cut.axis] <= 0;
  }
  return keep;
}

void DrawFace(const Face& face, const std::vector<Vec3d>& vertices, const Colour& colour,
              const Camera& camera, Raster* raster) {
  const Vec3d normal = NormalOf(face, vertices);
  std::array<Vec3d, 4> corners;
  for (int i = 0; i < face.count; ++i) corners[i] = camera.Project(vertices[face.vertex[i]]);
  raster->FillPolygon({corners.data(), static_cast<size_t>(face.count)},
                      Shade(colour, normal, camera));
  if (Dot(normal, camera.towards()) <= 0) return;
  for (int i = 0; i < face.count; ++i) {
    raster->DrawLine(corners[i], corners[(i + 1) % face.count], kLineWidth, kLineNearer,
                     kLineColour);
  }
}

absl::Status CheckOptions(const PictureOptions& options) {
  for (int pixels : {options.width, options.height}) {
    if (pixels >= kFewestPixels && pixels <= kMostPixels) continue;
    return absl::InvalidArgumentError(absl::StrCat("a picture's sides must be in [", kFewestPixels,
                                                   ", ", kMostPixels, "] pixels, got ", pixels));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Cut> ParseCut(const std::string& text) {
  Cut cut;
  const std::string axes = "xyz";
  cut.axis = text.empty() ? -1 : static_cast<int>(axes.find(text[0]));
  bool good = cut.axis >= 0 && cut.axis < 3;
  if (good && text.size() > 1) {
    good = text[1] == ':' && absl::SimpleAtod(text.substr(2), &cut.fraction) && cut.fraction >= 0 &&
           cut.fraction <= 1;
  }
  if (good) return cut;
  return absl::InvalidArgumentError(absl::StrCat(
      "a cut is x, y or z, with a fraction in [0, 1] if need be, as in y:0.3; got \"", text, "\""));
}

Cut DefaultCut(const AtMostHexaMesh& mesh) {
  Box3d box;
  for (const Vec3d& v : mesh.vertices) box.Extend(v);
  const Vec3d extent = box.Extent();
  // The front is favoured where sides are nearly equal.
  constexpr double kFavour = 0.97;
  Cut cut;
  for (int axis : {0, 2}) {
    if (extent[axis] < kFavour * extent[cut.axis]) cut.axis = axis;
  }
  return cut;
}

absl::Status ParseSize(const std::string& text, PictureOptions* options) {
  const size_t times = text.find('x');
  if (times == std::string::npos || !absl::SimpleAtoi(text.substr(0, times), &options->width) ||
      !absl::SimpleAtoi(text.substr(times + 1), &options->height)) {
    return absl::InvalidArgumentError(
        absl::StrCat("a picture's size is given as in 1200x900, not as \"", text, "\""));
  }
  return CheckOptions(*options);
}

absl::StatusOr<Image> DrawMesh(const AtMostHexaMesh& mesh, const PictureOptions& options) {
  const absl::Status valid = CheckOptions(options);
  if (!valid.ok()) return valid;
  const absl::StatusOr<std::vector<BoundaryFace>> hull = BoundaryOf(mesh, {});
  if (!hull.ok()) return hull.status();
  std::vector<bool> keep(mesh.corners.size(), true);
  if (options.cut) keep = CellsBehind(mesh, *options.cut, TowardsViewer(options));
  const absl::StatusOr<std::vector<BoundaryFace>> shown = BoundaryOf(mesh, keep);
  if (!shown.ok()) return shown.status();
  if (shown->empty()) return absl::FailedPreconditionError("the cut leaves no cell to draw");
  const auto colours = ColoursOfCells(mesh, options.colouring, options.distances);
  if (!colours.ok()) return colours.status();
  const Camera camera(*shown, mesh.vertices, options);
  Raster raster(options.width, options.height, kBackgroundColour);
  // Both lists are ordered by cell and vertices, and the hull's faces that are left are in both.
  const auto before = [](const BoundaryFace& a, const BoundaryFace& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.face.vertex < b.face.vertex;
  };
  for (const BoundaryFace& b : *shown) {
    const bool on_hull = std::binary_search(hull->begin(), hull->end(), b, before);
    const Colour& colour = ColourOfFace((*colours)[b.cell], on_hull, options);
    DrawFace(b.face, mesh.vertices, colour, camera, &raster);
  }
  return raster.Resolve();
}

}  // namespace amhex::client
