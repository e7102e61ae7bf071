#include "input/clean_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "base/sort_polling.h"

namespace amhex {
namespace {

using Key = std::array<double, 3>;

Key KeyOf(const Vec3d& p, double tolerance, double shift) {
  if (!(tolerance > 0)) return {p.x + 0.0, p.y + 0.0, p.z + 0.0};  // + 0.0 makes -0 and 0 one
  return {std::floor(p.x / tolerance + shift), std::floor(p.y / tolerance + shift),
          std::floor(p.z / tolerance + shift)};
}

int32_t RootOf(std::vector<int32_t>& parent, int32_t i) {
  while (parent[static_cast<size_t>(i)] != i) {
    int32_t& up = parent[static_cast<size_t>(i)];
    up = parent[static_cast<size_t>(up)];
    i = up;
  }
  return i;
}

// Joins the points that fall into the same grid cell.
void JoinCells(const std::vector<Vec3d>& points, double tolerance, double shift,
               const StopPoll& poll, std::vector<int32_t>& parent) {
  std::vector<std::pair<Key, int32_t>> keys(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    keys[i] = {KeyOf(points[i], tolerance, shift), static_cast<int32_t>(i)};
  }
  ParallelSortPolling(keys.begin(), keys.end(), poll);
  for (size_t i = 1; i < keys.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    if (keys[i].first != keys[i - 1].first) continue;
    const int32_t a = RootOf(parent, keys[i - 1].second), b = RootOf(parent, keys[i].second);
    parent[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
  }
}

}  // namespace

CleanCounts DropEmptyAndRepeatedTriangles(TriangleMesh& mesh, const StopPoll& poll) {
  CleanCounts counts;
  auto& triangles = mesh.triangles;
  const size_t before = triangles.size();
  std::erase_if(triangles,
                [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  counts.empty_triangles = static_cast<int64_t>(before - triangles.size());

  std::vector<std::pair<std::array<int32_t, 3>, int32_t>> keys(triangles.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    std::array<int32_t, 3> corners = triangles[i];
    std::sort(corners.begin(), corners.end());
    keys[i] = {corners, static_cast<int32_t>(i)};
  }
  ParallelSortPolling(keys.begin(), keys.end(), poll);
  std::vector<uint8_t> repeated(triangles.size(), 0);
  for (size_t i = 1; i < keys.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    if (keys[i].first != keys[i - 1].first) continue;
    repeated[static_cast<size_t>(keys[i].second)] = 1;
    ++counts.repeated_triangles;
  }
  if (counts.repeated_triangles > 0) {
    size_t kept = 0;
    for (size_t i = 0; i < triangles.size(); ++i) {
      if (repeated[i] == 0) triangles[kept++] = triangles[i];
    }
    triangles.resize(kept);
  }
  return counts;
}

CleanCounts MergeVertices(double tolerance, TriangleMesh& mesh, const StopPoll& poll) {
  std::vector<int32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  JoinCells(mesh.vertices, tolerance, 0, poll, parent);
  // A second grid, shifted by half a cell, joins most pairs that a cell wall of the first parts.
  if (tolerance > 0) JoinCells(mesh.vertices, tolerance, 0.5, poll, parent);
  for (auto& t : mesh.triangles) {
    for (int32_t& v : t) v = RootOf(parent, v);
  }
  int64_t merged = 0;
  for (size_t v = 0; v < parent.size(); ++v) merged += parent[v] != static_cast<int32_t>(v);
  poll.Now();
  CleanCounts counts = DropEmptyAndRepeatedTriangles(mesh, poll);
  counts.merged_vertices = merged;
  return counts;
}

}  // namespace amhex
