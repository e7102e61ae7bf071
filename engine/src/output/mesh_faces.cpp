#include "output/mesh_faces.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/loop_polling.h"

namespace amhex {
namespace {

// A sorted vertex set of fixed width and what it belongs to; unused entries are the largest id.
template <size_t kWidth>
struct Keyed {
  std::array<int32_t, kWidth> key;
  int32_t owner = 0;
};

constexpr int32_t kNoVertex = INT32_MAX;

constexpr size_t kPerBlock = 4096;

// Groups records with equal keys next to each other, in linear time: a counting sort by the
// smallest vertex leaves a handful of records to sort by comparison at each vertex.
template <size_t kWidth>
void GroupByKey(int64_t vertex_count, const StopPoll& poll, std::vector<Keyed<kWidth>>& records) {
  std::vector<int64_t> begin(static_cast<size_t>(vertex_count) + 1, 0);
  for (const auto& record : records) ++begin[record.key[0] + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  poll.Now();
  std::vector<Keyed<kWidth>> grouped(records.size());
  std::vector<int64_t> cursor(begin.begin(), begin.end() - 1);
  for (const auto& record : records) {
    poll.At(&record - records.data());
    grouped[cursor[record.key[0]]++] = record;
  }
  ForAllPolling(static_cast<size_t>(vertex_count), kPerBlock, poll, [&](size_t v) {
    std::sort(grouped.begin() + begin[v], grouped.begin() + begin[v + 1],
              [](const auto& a, const auto& b) {
                return a.key != b.key ? a.key < b.key : a.owner < b.owner;
              });
  });
  records.swap(grouped);
}

// True if `b` runs around the same ring as `a` the other way.
bool IsReversed(const OutwardFace& a, const OutwardFace& b) {
  if (a.count != b.count) return false;
  int start = 0;
  while (start < b.count && b.v[start] != a.v[0]) ++start;
  for (int j = 0; j < a.count; ++j) {
    if (a.v[j] != b.v[(start + b.count - j) % b.count]) return false;
  }
  return true;
}

// Of all cells, in their order.
std::vector<BoundaryFace> AllFaces(const std::vector<CellCorners>& cells, const StopPoll& poll) {
  const auto find = [&](size_t c, std::vector<BoundaryFace>& faces) {
    for (const OutwardFace& face : OutwardFacesOf(cells[c])) {
      faces.push_back({face, static_cast<int32_t>(c)});
    }
  };
  return FindAllPolling<BoundaryFace>(cells.size(), kPerBlock, poll, find);
}

}  // namespace

FaceCensus CountFaces(const std::vector<CellCorners>& cells, int64_t vertex_count,
                      const StopPoll& poll) {
  const std::vector<BoundaryFace> faces = AllFaces(cells, poll);
  std::vector<Keyed<4>> records(faces.size());
  ForAllPolling(faces.size(), kPerBlock, poll, [&](size_t i) {
    records[i].key = faces[i].face.v;
    if (faces[i].face.count == 3) records[i].key[3] = kNoVertex;
    std::sort(records[i].key.begin(), records[i].key.end());
    records[i].owner = static_cast<int32_t>(i);
  });
  GroupByKey(vertex_count, poll, records);

  poll.Now();
  FaceCensus census;
  std::vector<uint8_t> is_boundary(faces.size(), 0);
  for (size_t first = 0; first < records.size();) {
    size_t last = first + 1;
    while (last < records.size() && records[last].key == records[first].key) ++last;
    if (last - first == 1) {
      is_boundary[records[first].owner] = 1;
    } else if (last - first > 2) {
      ++census.overused_count;
    } else if (IsReversed(faces[records[first].owner].face, faces[records[first + 1].owner].face)) {
      ++census.interior_count;
    } else {
      ++census.same_side_count;
    }
    first = last;
  }
  for (size_t i = 0; i < faces.size(); ++i) {
    if (is_boundary[i]) census.boundary.push_back(faces[i]);
  }
  return census;
}

int64_t CountDuplicateCells(const std::vector<CellCorners>& cells, int64_t vertex_count,
                            const StopPoll& poll) {
  std::vector<Keyed<8>> records(cells.size());
  for (size_t c = 0; c < cells.size(); ++c) {
    poll.At(static_cast<int64_t>(c));
    auto& key = records[c].key;
    key = cells[c];
    std::sort(key.begin(), key.end());
    std::fill(std::unique(key.begin(), key.end()), key.end(), kNoVertex);
    records[c].owner = static_cast<int32_t>(c);
  }
  GroupByKey(vertex_count, poll, records);
  poll.Now();
  int64_t duplicates = 0;
  for (size_t i = 1; i < records.size(); ++i) duplicates += records[i].key == records[i - 1].key;
  return duplicates;
}

}  // namespace amhex
