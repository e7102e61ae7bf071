// The solid that an oriented cloud describes: smooth near the samples, closed where there are none.
#pragma once

#include <memory>
#include <vector>

#include "input/cloud_samples.h"
#include "input/hull_queries.h"
#include "input/level_surface.h"
#include "input/point_tree.h"
#include "input/smooth_pieces.h"

namespace amhex {

// Near samples: robust implicit moving least squares (Oztireli et al. 2009), its radius following
// the local spacing; where faces meet sharply each has its own, and their solid's edge is kept
// sharp (after Ohtake et al. 2003). Where that goes on past the last sample of a face, a winding
// number of next to nothing ends it. Away from them: one half minus the winding number
// of the samples' discs (Barill et al. 2018), which spans openings. Blended in between.
class CloudField : public SurfaceField {
 public:
  explicit CloudField(CloudSamples samples);

  double Value(const Vec3d& p) const override;
  Vec3d Normal(const Vec3d& p, double spacing) const override;
  std::unique_ptr<SurfaceField> Around(const Vec3d& centre, double reach) const override;

  const HullQueries& discs() const { return discs_; }
  const CloudSamples& samples() const { return samples_; }
  const PointTree& tree() const { return tree_; }  // of their positions

 private:
  struct Local {
    bool is_near = false;  // some sample's radius reaches the point
    double unit = 0;       // radius of the samples' influence
    double ratio = 0;      // distance to the nearest sample in its spacing
    double distance = 0;   // signed, of the moving least squares surface
    Vec3d gradient;
    double nearness = 0;  // [0, 1]; 1 = only the samples decide
  };
  struct Reach;
  class Part;
  // `near`: the nearest samples.
  Local MovingLeastSquares(const Vec3d& p, const std::vector<PointTree::Neighbour>& near) const;
  // Whether the samples alone decide.
  static bool IsByPlanes(const Local& local);
  static double ValueOf(const Local& local, double winding);
  double ValueOf(const Local& local, const Vec3d& p) const;
  // `local_at(p)` tells what the samples around p say.
  template <class Ask>
  Vec3d NormalBy(const Vec3d& p, double spacing, const Ask& local_at) const;
  Local LocalAt(const Vec3d& p) const;
  static void FitPiece(const Vec3d& p, const Reach& reach, const SmoothPieces& pieces,
                       uint8_t piece, Local& local);

  const CloudSamples samples_;
  const PointTree tree_;
  const HullQueries discs_;
};

}  // namespace amhex
