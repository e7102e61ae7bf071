#include "reassembly/merge_candidates.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "base/status_macros.h"
#include "optimize/cell_quality.h"
#include "reassembly/merged_quads.h"
#include "topology/direct_cells.h"
#include "topology/parallel_blocks.h"
#include "topology/search_primitives.h"

namespace amhex {
namespace {

constexpr int64_t kPiecesPerBlock = 1024;
// A hexahedron is five or six tetrahedra; slivers between them make it more.
constexpr size_t kMostAtoms = 20;

// The faces the search walks on: those of all atoms that may be merged, and the merged quads.
std::vector<CellFace> FacesToSearch(const BrokenVolume& volume,
                                    const std::vector<CellFace>& quads) {
  std::vector<CellFace> faces = quads;
  for (const CellCorners& atom : volume.cells) {
    if (RecognizeCell(atom) == PrimitiveType::kHexahedron) continue;
    for (const CellFace& face : FacesOf(atom)) faces.push_back(StandingHalfFace(face));
  }
  tbb::parallel_sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  return faces;
}

std::vector<Primitive> AtomsAsPieces(const BrokenVolume& volume) {
  std::vector<Primitive> pieces(volume.cells.size());
  for (size_t i = 0; i < pieces.size(); ++i) {
    pieces[i].corners = volume.cells[i];
    pieces[i].type = RecognizeCell(volume.cells[i]).value();
    pieces[i].quality = CellQuality(volume.cells[i], volume.vertices);
  }
  return pieces;
}

// Which atom lies on the inner side of each half-face; -1 outside.
std::vector<int32_t> OwnersOf(const PieceTable& table) {
  std::vector<int32_t> owner(static_cast<size_t>(table.faces.half_face_count()), -1);
  for (int32_t atom = 0; atom < table.atom_count; ++atom) {
    const Primitive& piece = table.pieces[static_cast<size_t>(atom)];
    for (int i = 0; i < piece.face_count; ++i) {
      owner[static_cast<size_t>(piece.half_faces[i])] = atom;
    }
  }
  return owner;
}

// Collects the atoms a primitive encloses.
class AtomFinder {
 public:
  AtomFinder(const PieceTable& table, const std::vector<int32_t>& owner)
      : table_(table), owner_(owner) {}

  // Ascending; empty if the primitive's surface does not consist of atoms' faces, or encloses a
  // hexahedron, or too many atoms.
  std::vector<int32_t> AtomsIn(const Primitive& primitive) {
    wall_.clear();
    for (int i = 0; i < primitive.face_count; ++i) {
      if (!AddWall(primitive.half_faces[i])) return {};
    }
    std::vector<int32_t> atoms = {owner_[static_cast<size_t>(wall_.front())]};
    for (size_t head = 0; head < atoms.size(); ++head) {
      const Primitive& atom = table_.pieces[static_cast<size_t>(atoms[head])];
      if (atom.type == PrimitiveType::kHexahedron || atoms.size() > kMostAtoms) return {};
      for (int i = 0; i < atom.face_count; ++i) {
        const HalfFaceId face = atom.half_faces[i];
        if (IsWall(face)) continue;
        const int32_t next = owner_[static_cast<size_t>(OppositeOf(face))];
        if (next < 0) return {};
        if (std::find(atoms.begin(), atoms.end(), next) == atoms.end()) atoms.push_back(next);
      }
    }
    std::sort(atoms.begin(), atoms.end());
    return AllWallsBelongTo(atoms) ? atoms : std::vector<int32_t>();
  }

 private:
  bool IsWall(HalfFaceId face) const {
    return std::find(wall_.begin(), wall_.end(), face) != wall_.end();
  }

  bool IsOnHull(HalfFaceId face) const { return table_.on_hull[static_cast<size_t>(face)] != 0; }

  // The face itself if it is an atom's, else the two triangles of the diagonal that has atoms. A
  // flat atom has either diagonal, one on each side: a quad on the hull is the outer one.
  bool AddWall(HalfFaceId face) {
    if (owner_[static_cast<size_t>(face)] >= 0) {
      wall_.push_back(face);
      return true;
    }
    const CellFace quad = table_.faces.half_face(face);
    if (quad.count != 4) return false;
    const bool is_on_hull = IsOnHull(face);
    for (int i = 0; i < 2; ++i) {
      const auto at = [&](int k) { return quad.v[(i + k) % 4]; };
      const HalfFaceId one = table_.faces.Find({3, {at(0), at(1), at(2), -1}});
      const HalfFaceId two = table_.faces.Find({3, {at(0), at(2), at(3), -1}});
      if (one == kNoHalfFace || two == kNoHalfFace) continue;
      if (owner_[static_cast<size_t>(one)] < 0 || owner_[static_cast<size_t>(two)] < 0) continue;
      if (is_on_hull && !(IsOnHull(one) && IsOnHull(two))) continue;
      wall_.push_back(one);
      wall_.push_back(two);
      return true;
    }
    return false;
  }

  bool AllWallsBelongTo(const std::vector<int32_t>& atoms) const {
    return std::all_of(wall_.begin(), wall_.end(), [&](HalfFaceId face) {
      return std::binary_search(atoms.begin(), atoms.end(), owner_[static_cast<size_t>(face)]);
    });
  }

  const PieceTable& table_;
  const std::vector<int32_t>& owner_;
  std::vector<HalfFaceId> wall_;
};

void MarkHull(const BrokenVolume& volume, PieceTable* table) {
  table->on_hull.assign(static_cast<size_t>(table->faces.half_face_count()), 0);
  for (const CellFace& face : volume.boundary) {
    const HalfFaceId id = table->faces.Find(face);
    if (id != kNoHalfFace) table->on_hull[static_cast<size_t>(id)] = 1;
  }
  const auto is_hull = [&](int32_t a, int32_t b, int32_t c) {
    const HalfFaceId id = table->faces.Find({3, {a, b, c, -1}});
    return id != kNoHalfFace && table->on_hull[static_cast<size_t>(id)] != 0;
  };
  for (HalfFaceId id = 0; id < table->faces.half_face_count(); ++id) {
    const CellFace quad = table->faces.half_face(id);
    if (quad.count != 4) continue;
    const auto& v = quad.v;
    if ((is_hull(v[0], v[1], v[2]) && is_hull(v[0], v[2], v[3])) ||
        (is_hull(v[1], v[2], v[3]) && is_hull(v[1], v[3], v[0]))) {
      table->on_hull[static_cast<size_t>(id)] = 1;
    }
  }
}

struct Merged {
  Primitive piece;
  std::vector<int32_t> atoms;
};

absl::Status AppendMerged(std::vector<Primitive> found, const RunContext& run, PieceTable* table) {
  const std::vector<int32_t> owner = OwnersOf(*table);
  std::vector<Merged> merged;
  const auto collect = [&](int64_t begin, int64_t end, std::vector<Merged>* list) {
    AtomFinder finder(*table, owner);
    for (int64_t i = begin; i < end; ++i) {
      Primitive& piece = found[static_cast<size_t>(i)];
      LookUpHalfFaces(table->faces, &piece);
      std::vector<int32_t> atoms = finder.AtomsIn(piece);
      if (atoms.size() > 1) list->push_back({piece, std::move(atoms)});
    }
  };
  AMHEX_RETURN_IF_ERROR(CollectFromBlocks(static_cast<int64_t>(found.size()), kPiecesPerBlock, run,
                                          &merged, collect));
  for (int32_t atom = 0; atom < table->atom_count; ++atom) {
    table->first_atom.push_back(atom);
    table->atoms_of.push_back(atom);
  }
  for (const Merged& entry : merged) {
    table->pieces.push_back(entry.piece);
    table->first_atom.push_back(static_cast<int32_t>(table->atoms_of.size()));
    table->atoms_of.insert(table->atoms_of.end(), entry.atoms.begin(), entry.atoms.end());
  }
  table->first_atom.push_back(static_cast<int32_t>(table->atoms_of.size()));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PieceTable> FindPieces(const BrokenVolume& volume, const PieceLimits& limits,
                                      RunContext& run) {
  const auto vertex_count = static_cast<int32_t>(volume.vertices.size());
  const std::vector<CellFace> quads = FindMergedQuads(volume, limits.quads);
  std::vector<CellFace> faces = FacesToSearch(volume, quads);
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  PieceTable table;
  table.pieces = AtomsAsPieces(volume);
  table.atom_count = static_cast<int32_t>(table.pieces.size());
  std::vector<CellFace> all = faces;
  for (const CellCorners& atom : volume.cells) {
    for (const CellFace& face : FacesOf(atom)) all.push_back(face);
  }
  table.faces = FaceTable::Build(vertex_count, all);
  for (Primitive& piece : table.pieces) LookUpHalfFaces(table.faces, &piece);
  MarkHull(volume, &table);
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  const auto complex = FaceComplex::Build(vertex_count, std::move(faces));
  AMHEX_ASSIGN_OR_RETURN(std::vector<Primitive> found,
                         SearchPrimitives(complex, volume.vertices, limits.min_quality, run));
  AMHEX_RETURN_IF_ERROR(AppendMerged(std::move(found), run, &table));
  return table;
}

}  // namespace amhex
