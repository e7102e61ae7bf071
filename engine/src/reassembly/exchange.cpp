#include "reassembly/exchange.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace amhex {
namespace {

// Steps of one search, and pieces it may bring in one after another. (On 2632 tetrahedra 50 steps
// lead as far as 2000, in a hundredth of the time.)
constexpr int kBudget = 50;
constexpr int kMostTaken = 16;
// What a cell costs, the gain of a hexahedron being 1.
constexpr double kCellCost = 0.25;
constexpr double kLeastGain = 1e-9;

}  // namespace

PieceMesh::PieceMesh(const PieceTable& table)
    : table_(table),
      piece_of_atom_(static_cast<size_t>(table.atom_count), kNoPiece),
      owner_(static_cast<size_t>(table.faces.half_face_count()), kNoPiece) {
  for (int32_t atom = 0; atom < table.atom_count; ++atom) Add(atom);
}

void PieceMesh::Remove(int32_t piece) {
  for (const int32_t atom : table_.atoms(piece)) {
    piece_of_atom_[static_cast<size_t>(atom)] = kNoPiece;
  }
  const Primitive& primitive = table_.pieces[static_cast<size_t>(piece)];
  for (int i = 0; i < primitive.face_count; ++i) {
    owner_[static_cast<size_t>(primitive.half_faces[i])] = kNoPiece;
  }
}

void PieceMesh::Add(int32_t piece) {
  for (const int32_t atom : table_.atoms(piece)) piece_of_atom_[static_cast<size_t>(atom)] = piece;
  const Primitive& primitive = table_.pieces[static_cast<size_t>(piece)];
  for (int i = 0; i < primitive.face_count; ++i) {
    owner_[static_cast<size_t>(primitive.half_faces[i])] = piece;
  }
}

std::vector<int32_t> PieceMesh::Pieces() const {
  std::vector<int32_t> pieces = piece_of_atom_;
  std::sort(pieces.begin(), pieces.end());
  pieces.erase(std::unique(pieces.begin(), pieces.end()), pieces.end());
  return pieces;
}

ExchangeSearch::ExchangeSearch(const PieceTable& table)
    : table_(table), is_taken_(table.pieces.size(), 0) {
  const PieceMesh atoms(table);
  const HalfFaceId face_count = table.faces.half_face_count();
  may_be_free_ = table.on_hull;
  for (HalfFaceId face = 0; face < face_count; ++face) {
    const bool is_free = atoms.owner(face) != PieceMesh::kNoPiece &&
                         atoms.owner(OppositeOf(face)) == PieceMesh::kNoPiece;
    if (is_free) may_be_free_[static_cast<size_t>(face)] = 1;
  }
  FindHopeless();
  // The largest and best pieces come first in every row.
  std::vector<int32_t> order;
  const auto piece_count = static_cast<int32_t>(table.pieces.size());
  for (int32_t piece = table.atom_count; piece < piece_count; ++piece) {
    if (!IsHopeless(piece)) order.push_back(piece);
  }
  std::sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    const auto key = [&](int32_t piece) {
      const Primitive& p = table.pieces[static_cast<size_t>(piece)];
      return std::make_tuple(table.InnerQuads(piece), -p.quality, piece);
    };
    return key(a) < key(b);
  });
  first_piece_.assign(static_cast<size_t>(face_count) + 1, 0);
  for (const int32_t piece : order) {
    ForEachQuad(piece, [&](size_t face) { ++first_piece_[face + 1]; });
  }
  std::partial_sum(first_piece_.begin(), first_piece_.end(), first_piece_.begin());
  pieces_at_.resize(static_cast<size_t>(first_piece_.back()));
  std::vector<int32_t> next(first_piece_.begin(), first_piece_.end() - 1);
  for (const int32_t piece : order) {
    ForEachQuad(piece, [&](size_t face) { pieces_at_[static_cast<size_t>(next[face]++)] = piece; });
  }
}

template <class Visit>
void ExchangeSearch::ForEachQuad(int32_t piece, const Visit& visit) const {
  const Primitive& primitive = table_.pieces[static_cast<size_t>(piece)];
  for (int i = 0; i < primitive.face_count; ++i) {
    const HalfFaceId face = primitive.half_faces[i];
    if (table_.faces.face(FaceOf(face)).count == 4) visit(static_cast<size_t>(face));
  }
}

// A piece is hopeless if one of its quads has no piece on its other side but hopeless ones: most of
// what tetrahedra could become is.
void ExchangeSearch::FindHopeless() {
  const auto piece_count = static_cast<int32_t>(table_.pieces.size());
  is_hopeless_.assign(table_.pieces.size(), 0);
  std::vector<int32_t> owners(static_cast<size_t>(table_.faces.half_face_count()), 0);
  for (int32_t piece = 0; piece < piece_count; ++piece) {
    ForEachQuad(piece, [&](size_t face) { ++owners[face]; });
  }
  for (bool is_settled = false; !is_settled;) {
    is_settled = true;
    for (int32_t piece = table_.atom_count; piece < piece_count; ++piece) {
      if (IsHopeless(piece)) continue;
      bool is_met = true;
      ForEachQuad(piece, [&](size_t face) {
        const auto other = static_cast<size_t>(OppositeOf(static_cast<HalfFaceId>(face)));
        is_met = is_met && (may_be_free_[face] != 0 || owners[other] > 0);
      });
      if (is_met) continue;
      is_hopeless_[static_cast<size_t>(piece)] = 1;
      ForEachQuad(piece, [&](size_t face) { --owners[face]; });
      is_settled = false;
    }
  }
}

bool ExchangeSearch::BringIn(int32_t piece, PieceMesh* mesh) {
  mesh_ = mesh;
  changes_.clear(), best_changes_.clear();
  GiveUpTaken(0);
  gain_ = 0, best_gain_ = kLeastGain;
  budget_ = kBudget;
  if (!IsHopeless(piece) && Take(piece)) Explore(0);
  UndoTo(0);
  for (const Change& change : best_changes_) {
    if (change.is_added) {
      mesh->Add(change.piece);
    } else {
      mesh->Remove(change.piece);
    }
  }
  return !best_changes_.empty();
}

// Depth first: the first unmet quad is met in every way there is.
void ExchangeSearch::Explore(int depth) {
  if (--budget_ < 0) return;
  const HalfFaceId unmet = FindUnmet();
  if (unmet == kNoHalfFace) {
    if (gain_ > best_gain_) {
      best_gain_ = gain_;
      best_changes_ = changes_;
    }
    return;
  }
  const size_t change_count = changes_.size(), taken_count = taken_.size();
  const auto wanted = static_cast<size_t>(OppositeOf(unmet));
  for (int32_t k = first_piece_[wanted]; k < first_piece_[wanted + 1] && depth < kMostTaken; ++k) {
    if (Take(pieces_at_[static_cast<size_t>(k)])) Explore(depth + 1);
    UndoTo(change_count);
    GiveUpTaken(taken_count);
    if (budget_ < 0) return;
  }
  const int32_t holder = mesh_->owner(unmet);
  if (IsTaken(holder)) return;
  Dissolve(holder);
  Explore(depth);
  UndoTo(change_count);
}

// Empties the piece's place and puts it there; false if that would undo what was taken before.
bool ExchangeSearch::Take(int32_t piece) {
  if (!CanTake(piece)) return false;
  for (const int32_t atom : table_.atoms(piece)) {
    const int32_t there = mesh_->piece_of(atom);
    if (there != atom) Dissolve(there);
  }
  for (const int32_t atom : table_.atoms(piece)) Apply(atom, false);
  Apply(piece, true);
  taken_.push_back(piece);
  is_taken_[static_cast<size_t>(piece)] = 1;
  return true;
}

void ExchangeSearch::Dissolve(int32_t piece) {
  Apply(piece, false);
  for (const int32_t atom : table_.atoms(piece)) Apply(atom, true);
}

void ExchangeSearch::Apply(int32_t piece, bool is_added) {
  if (is_added) {
    mesh_->Add(piece);
  } else {
    mesh_->Remove(piece);
  }
  gain_ += is_added ? ValueOf(piece) : -ValueOf(piece);
  changes_.push_back({piece, is_added});
}

void ExchangeSearch::UndoTo(size_t change_count) {
  while (changes_.size() > change_count) {
    const Change change = changes_.back();
    Apply(change.piece, !change.is_added);
    changes_.resize(changes_.size() - 2);
  }
}

HalfFaceId ExchangeSearch::FindUnmet() const {
  HalfFaceId best = kNoHalfFace;
  int fewest = 1 << 30;
  const auto consider = [&](HalfFaceId face) {
    if (!IsUnmet(face)) return;
    int ways = IsTaken(mesh_->owner(face)) ? 0 : 1;
    const auto wanted = static_cast<size_t>(OppositeOf(face));
    for (int32_t k = first_piece_[wanted]; k < first_piece_[wanted + 1] && ways < fewest; ++k) {
      ways += CanTake(pieces_at_[static_cast<size_t>(k)]) ? 1 : 0;
    }
    if (ways < fewest) fewest = ways, best = face;
  };
  for (const Change& change : changes_) {
    const Primitive& primitive = table_.pieces[static_cast<size_t>(change.piece)];
    for (int i = 0; i < primitive.face_count; ++i) {
      consider(primitive.half_faces[i]);
      consider(OppositeOf(primitive.half_faces[i]));
      if (fewest == 0) return best;
    }
  }
  return best;
}

bool ExchangeSearch::CanTake(int32_t piece) const {
  for (const int32_t atom : table_.atoms(piece)) {
    if (IsTaken(mesh_->piece_of(atom))) return false;
  }
  return true;
}

bool ExchangeSearch::IsUnmet(HalfFaceId face) const {
  return table_.faces.face(FaceOf(face)).count == 4 &&
         may_be_free_[static_cast<size_t>(face)] == 0 &&
         mesh_->owner(face) != PieceMesh::kNoPiece &&
         mesh_->owner(OppositeOf(face)) == PieceMesh::kNoPiece;
}

// All but the first `count`.
void ExchangeSearch::GiveUpTaken(size_t count) {
  for (size_t i = count; i < taken_.size(); ++i) is_taken_[static_cast<size_t>(taken_[i])] = 0;
  taken_.resize(count);
}

double ExchangeSearch::ValueOf(int32_t piece) const {
  const Primitive& primitive = table_.pieces[static_cast<size_t>(piece)];
  return (primitive.type == PrimitiveType::kHexahedron ? 1 : 0) - kCellCost;
}

}  // namespace amhex
