// The surface that bounds the mesh, as every stage after the input sees it.
//
// Normalised frame: translated and scaled so that the wanted edge length e is 1, and turned so that
// flat parts look along the axes (upright_axes.h). Tolerances are pure numbers from here on; the
// frame is undone once, at output.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "amhex/input_hull.h"
#include "amhex/vec3.h"
#include "base/axis_frame.h"

namespace amhex {

// user = origin + normalised along the axes * scale
struct Frame {
  Vec3d origin;
  double scale = 1.0;
  AxisFrame axes = {};  // where those of the normalised frame point in the user's
  Vec3d ToUser(const Vec3d& p) const {
    return origin + (axes.axis[0] * p.x + axes.axis[1] * p.y + axes.axis[2] * p.z) * scale;
  }
  Vec3d ToNormalized(const Vec3d& p) const { return DirectionToNormalized(p - origin) / scale; }
  Vec3d DirectionToNormalized(const Vec3d& v) const {
    return {Dot(axes.axis[0], v), Dot(axes.axis[1], v), Dot(axes.axis[2], v)};
  }
};

// A hull edge whose dihedral angle exceeds the sharp angle.
struct SharpEdge {
  int32_t vertex_a = 0;
  int32_t vertex_b = 0;
  int32_t triangle_left = 0;
  int32_t triangle_right = 0;
};

// Closest point of the hull to a query.
struct HullPoint {
  Vec3d point;
  Vec3d normal;  // of the triangle, outward, unit
  int32_t triangle = -1;
  double distance = 0;  // >= 0, edge lengths
};

class HullQueries;  // hull_queries.h: BVH; closest point and winding number

// Closed and outward oriented: inputs that are open or clouds of points have been closed already.
struct Hull {
  std::vector<Vec3d> vertices;                    // [vertex_count] edge lengths
  std::vector<std::array<int32_t, 3>> triangles;  // [triangle_count] outward
  std::vector<Vec3d> triangle_normals;            // [triangle_count] unit
  std::vector<SharpEdge> sharp_edges;
  std::vector<uint8_t> sharp_degree;  // [vertex_count] sharp edges that meet there
  std::vector<int32_t> patch;         // [triangle_count] smooth patch between sharp edges
  Box3d box;
  double input_diagonal = 0;  // of the box along the user's axes, edge lengths
  double volume = 0;          // edge lengths cubed
  int64_t genus = 0;          // summed over components; -1 if not manifold
  int64_t component_count = 0;
  bool is_given = false;  // of the user's triangles, not rebuilt: handles and parts are meant
  Frame frame;
  std::shared_ptr<const HullQueries> queries;  // shared: hulls are immutable once built
  // The input's own points (cloud) or vertices, normalised: distance is measured against these.
  std::vector<Vec3d> input_points;
  Guidance guidance;  // edge lengths, directions of unit length
  std::vector<std::string> warnings;
  std::vector<std::string> device_notes;  // why steps that were to run on a device did not
};

// A point on the hull with its surface frame. Paper: S_pc, section 4.3.
struct HullSamples {
  std::vector<Vec3d> position;  // [sample_count] edge lengths
  std::vector<Vec3d> normal;    // [sample_count] unit, outward
  std::vector<Vec3d> tangent;   // [sample_count] unit, principal direction of largest curvature
  std::vector<float> curvature_confidence;  // [sample_count] [0, 1]; 0 on planes and spheres
  std::vector<std::string> device_notes;    // as the hull's
};

}  // namespace amhex
