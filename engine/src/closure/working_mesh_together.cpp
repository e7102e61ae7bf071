// Making a large mesh on all threads: the same as adding its cells one after the other, whose faces
// have numbers in the order in which they come first.
#include <algorithm>
#include <atomic>
#include <numeric>
#include <utility>

#include "base/loop_polling.h"
#include "closure/working_mesh.h"

namespace amhex {

// Cells without a mesh around them yet, and their faces.
class WorkingMesh::Together {
 public:
  Together(const std::vector<CellCorners>& cells, size_t vertex_count, const StopPoll& poll)
      : poll_(poll), types_(cells.size()), coming_(kFacesOfCell * cells.size()) {
    FindFaces(cells);
    if (!is_lawful_) return;
    GroupByVertex(vertex_count);
    FindFirst();
    if (is_lawful_) Number();
  }

  // False where a cell is none, or two have a face that looks the same way.
  bool is_lawful() const { return is_lawful_; }

  void PutInto(WorkingMesh& mesh) {
    mesh.faces_.resize(static_cast<size_t>(face_count_));
    mesh.owners_.assign(2 * mesh.faces_.size(), kOpen);
    ForVertices([&](size_t v, const int32_t* faces, const int32_t* end) {
      for (const int32_t* i = faces; i < end; ++i) {
        const Coming& face = coming_[*i];
        if (face.number == kEnd) continue;
        mesh.faces_[face.number] = face.entry;
        mesh.faces_[face.number].next = mesh.first_face_[v];
        mesh.first_face_[v] = face.number;
      }
    });
    mesh.half_faces_.resize(types_.size());
    ForAllPolling(types_.size(), kAtOnce, poll_, [&](size_t c) {
      HalfFaces& halves = mesh.half_faces_[c];
      halves.fill(-1);
      for (size_t k = 0; k < kFacesOfCell; ++k) {
        const Coming& face = coming_[kFacesOfCell * c + k];
        if (face.smallest == kEnd) break;
        halves[k] = 2 * coming_[face.first].number + face.orientation;
        mesh.owners_[halves[k]] = static_cast<int32_t>(c);
      }
    });
    mesh.types_ = std::move(types_);
  }

 private:
  static constexpr size_t kFacesOfCell = std::tuple_size_v<HalfFaces>;
  static constexpr size_t kAtOnce = 1024;

  // A face of a cell as it comes: face k of cell c has place kFacesOfCell * c + k.
  struct Coming {
    int32_t smallest = kEnd;  // of its vertices; kEnd: the cell has fewer faces
    FaceEntry entry;
    int orientation = 0;
    int32_t first = kEnd;   // place of the one with the same vertices that comes first
    int32_t number = kEnd;  // in the mesh; of those that come first
    bool IsLike(const Coming& other) const {
      return entry.low == other.entry.low && entry.high == other.entry.high &&
             entry.opposite == other.entry.opposite;
    }
  };

  // visit(vertex, first place, end of the places) of the faces whose smallest vertex it is.
  template <class Visit>
  void ForVertices(const Visit& visit) const {
    ForAllPolling(begin_.size() - 1, kAtOnce, poll_, [&](size_t v) {
      visit(v, at_vertex_.data() + begin_[v], at_vertex_.data() + begin_[v + 1]);
    });
  }
  void NoteUnlawful() { is_lawful_.store(false, std::memory_order_relaxed); }

  void FindFaces(const std::vector<CellCorners>& cells) {
    ForAllPolling(cells.size(), kAtOnce, poll_, [&](size_t c) {
      const CellShape shape = ShapeOf(cells[c]);
      if (!shape.type) return NoteUnlawful();
      types_[c] = *shape.type;
      for (int k = 0; k < shape.faces.count; ++k) {
        Coming& face = coming_[kFacesOfCell * c + static_cast<size_t>(k)];
        face.smallest = EntryOf(shape.faces.face[k], &face.entry, &face.orientation);
      }
    });
  }

  void GroupByVertex(size_t vertex_count) {
    begin_.assign(vertex_count + 1, 0);
    for (const Coming& face : coming_) {
      if (face.smallest != kEnd) ++begin_[static_cast<size_t>(face.smallest) + 1];
    }
    poll_.Now();
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    at_vertex_.resize(begin_.back());
    std::vector<size_t> next(begin_.begin(), begin_.end() - 1);
    for (size_t i = 0; i < coming_.size(); ++i) {
      poll_.At(static_cast<int64_t>(i));
      if (coming_[i].smallest == kEnd) continue;
      at_vertex_[next[static_cast<size_t>(coming_[i].smallest)]++] = static_cast<int32_t>(i);
    }
  }

  void FindFirst() {
    ForVertices([&](size_t, const int32_t* faces, const int32_t* end) {
      for (const int32_t* i = faces; i < end; ++i) {
        Coming& own = coming_[*i];
        own.first = *i;
        for (const int32_t* k = faces; k < i; ++k) {
          const Coming& other = coming_[*k];
          if (!own.IsLike(other)) continue;
          own.first = other.first;
          if (other.orientation == own.orientation) NoteUnlawful();
        }
      }
    });
  }

  void Number() {
    for (size_t i = 0; i < coming_.size(); ++i) {
      poll_.At(static_cast<int64_t>(i));
      if (coming_[i].first == static_cast<int32_t>(i)) coming_[i].number = face_count_++;
    }
  }

  const StopPoll& poll_;
  std::atomic<bool> is_lawful_{true};
  std::vector<PrimitiveType> types_;
  std::vector<Coming> coming_;
  std::vector<size_t> begin_;       // [vertex] in the next one
  std::vector<int32_t> at_vertex_;  // places, ascending at each
  int32_t face_count_ = 0;
};

bool WorkingMesh::AppendTogether(const std::vector<CellCorners>& cells, const StopPoll& poll) {
  Together together(cells, vertices_.size(), poll);
  if (!together.is_lawful()) return false;
  together.PutInto(*this);
  cells_ = cells;
  alive_.assign(cells.size(), 1);
  has_open_.assign((cells.size() + 63) / 64, 0);
  for (int cell = 0; cell < cell_slots(); ++cell) {
    poll.At(cell);
    LinkCell(cell);
  }
  return true;
}

}  // namespace amhex
