// Nearest neighbours among points of any density: a balanced k-d tree.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

// Immutable after construction; queries are const and safe from any number of threads.
// Neighbours at equal distance are ordered by index.
class PointTree {
 public:
  struct Neighbour {
    double squared_distance = 0;
    int32_t index = -1;
    friend bool operator<(const Neighbour& a, const Neighbour& b) {
      return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                      : a.index < b.index;
    }
  };

  explicit PointTree(const std::vector<Vec3d>& points);  // O(n log n)

  // The `count` nearest points, nearest first (fewer if there are fewer); replaces `result`.
  void Nearest(const Vec3d& p, int count, std::vector<Neighbour>& result) const;

  // The nearest point; index -1 if there is none within `max_distance`.
  Neighbour Nearest(const Vec3d& p, double max_distance = 1e150) const;

  // All points within `radius`, ascending by index; replaces `result`.
  void Within(const Vec3d& p, double radius, std::vector<Neighbour>& result) const;

 private:
  void Build(int32_t begin, int32_t end);
  std::pair<int32_t, int32_t> RangeAround(const Vec3d& p, int32_t count) const;
  // Visits leaves in order of rising distance bound while `limit()` permits.
  template <class Visit, class Limit>
  void Search(const Vec3d& p, const Visit& visit, const Limit& limit) const;

  // A range of points is halved at its middle element along `axis_`; ranges of up to 8 are leaves.
  std::vector<Vec3d> points_;   // in tree order
  std::vector<int32_t> index_;  // tree order -> caller's index
  std::vector<uint8_t> axis_;   // of the range whose middle is here
};

}  // namespace amhex
