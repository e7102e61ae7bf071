#include "topology/face_table.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace amhex {
namespace {

// Counting sort by smallest vertex; `first` becomes the rows' offsets.
std::vector<CellFace> SortIntoRows(const std::vector<CellFace>& faces,
                                   std::vector<int32_t>* first) {
  const auto smallest = [](const CellFace& face) {
    return *std::min_element(face.v.begin(), face.v.begin() + face.count);
  };
  for (const CellFace& face : faces) ++(*first)[smallest(face) + 1];
  for (size_t v = 1; v < first->size(); ++v) (*first)[v] += (*first)[v - 1];
  std::vector<int32_t> next(first->begin(), first->end() - 1);
  std::vector<CellFace> rows(faces.size());
  for (const CellFace& face : faces) rows[next[smallest(face)]++] = StandingHalfFace(face);
  return rows;
}

}  // namespace

FaceTable FaceTable::Build(int32_t vertex_count, const std::vector<CellFace>& faces) {
  std::vector<int32_t> first(static_cast<size_t>(vertex_count) + 1, 0);
  std::vector<CellFace> rows = SortIntoRows(faces, &first);
  std::vector<int32_t> kept(static_cast<size_t>(vertex_count), 0);
  tbb::parallel_for(tbb::blocked_range<int32_t>(0, vertex_count, 1024), [&](const auto& range) {
    for (int32_t v = range.begin(); v < range.end(); ++v) {
      const auto begin = rows.begin() + first[v], end = rows.begin() + first[v + 1];
      std::sort(begin, end);
      kept[v] = static_cast<int32_t>(std::unique(begin, end) - begin);
    }
  });
  FaceTable table;
  table.first_face_.assign(first.size(), 0);
  for (int32_t v = 0; v < vertex_count; ++v) {
    table.first_face_[v + 1] = table.first_face_[v] + kept[v];
  }
  table.faces_.reserve(table.first_face_[vertex_count]);
  for (int32_t v = 0; v < vertex_count; ++v) {
    const auto begin = rows.begin() + first[v];
    table.faces_.insert(table.faces_.end(), begin, begin + kept[v]);
  }
  return table;
}

CellFace FaceTable::half_face(HalfFaceId id) const {
  const CellFace& stored = faces_[FaceOf(id)];
  return (id & 1) == 0 ? stored : OppositeHalfFace(stored);
}

HalfFaceId FaceTable::Find(const CellFace& half_face) const {
  CellFace key = CanonicalHalfFace(half_face);
  const bool is_stored_direction = StandsForFace(key);
  if (!is_stored_direction) key = OppositeHalfFace(key);
  const int32_t smallest = key.v[0];
  if (smallest < 0 || smallest + 1 >= static_cast<int32_t>(first_face_.size())) return kNoHalfFace;
  const auto begin = faces_.begin() + first_face_[smallest];
  const auto end = faces_.begin() + first_face_[smallest + 1];
  const auto found = std::lower_bound(begin, end, key);
  if (found == end || !(*found == key)) return kNoHalfFace;
  return 2 * static_cast<HalfFaceId>(found - faces_.begin()) + (is_stored_direction ? 0 : 1);
}

}  // namespace amhex
