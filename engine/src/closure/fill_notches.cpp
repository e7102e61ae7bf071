#include "closure/fill_notches.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "closure/cavities.h"
#include "closure/hull_side.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// Vertices of a flat notch slide along the hull once they are placed, which makes it a better
// prism.
constexpr double kMinNotchQuality = 0.1;

struct Notch {
  double quality;
  CellCorners prism;
};

class NotchFiller {
 public:
  NotchFiller(const Hull& hull, WorkingMesh* mesh, const StopPoll& poll)
      : mesh_(*mesh), poll_(poll), side_(hull, mesh, poll) {}

  int Run() {
    int added = 0;
    for (const std::vector<CellFace>& faces : CollectCavities(mesh_).faces) {
      poll_.Now();
      added += FillCavity(faces);
    }
    return added;
  }

 private:
  int FillCavity(const std::vector<CellFace>& faces) {
    std::vector<Notch> notches = NotchesOf(faces);
    std::stable_sort(notches.begin(), notches.end(),
                     [](const Notch& a, const Notch& b) { return a.quality > b.quality; });
    std::vector<int> cells;
    for (const Notch& notch : notches) {
      const int cell = mesh_.AddCell(notch.prism);
      if (cell >= 0) cells.push_back(cell);
    }
    std::sort(cells.begin(), cells.end());
    return KeepRows(cells);
  }

  // Rows of prisms stand or fall together: their ends match only between them.
  int KeepRows(const std::vector<int>& cells) {
    int kept = 0;
    std::vector<uint8_t> seen(cells.size(), 0);
    const auto index_of = [&](int32_t cell) {
      const auto it = std::lower_bound(cells.begin(), cells.end(), cell);
      return it != cells.end() && *it == cell ? it - cells.begin() : -1;
    };
    for (size_t first = 0; first < cells.size(); ++first) {
      if (seen[first] != 0) continue;
      std::vector<int> row = {cells[first]};
      seen[first] = 1;
      for (size_t i = 0; i < row.size(); ++i) {
        for (const CellFace& face : FacesOf(mesh_.corners(row[i]))) {
          const auto next = index_of(mesh_.Across(face));
          if (next < 0 || seen[next] != 0) continue;
          seen[next] = 1;
          row.push_back(cells[next]);
        }
      }
      int change = 0;
      const auto is_new = [&](int32_t cell) { return index_of(cell) >= 0; };
      for (const int cell : row) change += side_.MarkFacesOf(cell, is_new);
      if (change < 0) {
        kept += static_cast<int>(row.size());
      } else {
        for (const int cell : row) mesh_.RemoveCell(cell);
      }
    }
    return kept;
  }

  std::vector<Notch> NotchesOf(const std::vector<CellFace>& faces) const {
    std::map<std::pair<int32_t, int32_t>, std::pair<const CellFace*, int>> after;  // by edge
    for (const CellFace& face : faces) {
      for (int j = 0; face.count == 4 && j < 4; ++j) {
        after[{face.v[j], face.v[(j + 1) % 4]}] = {&face, j};
      }
    }
    std::vector<Notch> notches;
    for (const auto& [edge, first] : after) {
      const auto second = after.find({edge.second, edge.first});
      if (edge.first > edge.second || second == after.end()) continue;
      AddNotch(*first.first, first.second, *second->second.first, second->second.second, &notches);
    }
    return notches;
  }

  // Of the faces whose edges from corner j and k are the same, seen from either side.
  void AddNotch(const CellFace& f, int j, const CellFace& g, int k,
                std::vector<Notch>* notches) const {
    const int32_t a = f.v[j], b = f.v[(j + 1) % 4];
    const int32_t f_b = f.v[(j + 2) % 4], f_a = f.v[(j + 3) % 4];
    const int32_t g_a = g.v[(k + 2) % 4], g_b = g.v[(k + 3) % 4];
    if (f_a == g_a || f_b == g_b) return;
    const CellCorners prism = {a, f_a, f_a, g_a, b, f_b, f_b, g_b};
    const double quality = CellQuality(prism, mesh_.vertices());
    if (quality < kMinNotchQuality || !side_.Holds(CellFace{4, {f_b, f_a, g_a, g_b}})) return;
    notches->push_back({quality, prism});
  }

  WorkingMesh& mesh_;
  const StopPoll poll_;
  HullSide side_;
};

}  // namespace

int FillNotches(const Hull& hull, WorkingMesh* mesh, const StopPoll& poll) {
  return mesh->HasOpenFaces() ? NotchFiller(hull, mesh, poll).Run() : 0;
}

}  // namespace amhex
