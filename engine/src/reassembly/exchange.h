// One exchange of a few pieces of a mesh for others that fill the same place.
#pragma once

#include <cstdint>
#include <vector>

#include "reassembly/merge_candidates.h"

namespace amhex {

// The mesh under reassembly: which piece fills each atom's place.
class PieceMesh {
 public:
  static constexpr int32_t kNoPiece = -1;

  // Every atom is its own piece. The table must outlive this.
  explicit PieceMesh(const PieceTable& table);

  int32_t piece_of(int32_t atom) const { return piece_of_atom_[static_cast<size_t>(atom)]; }
  // The piece whose outward face this is, or kNoPiece.
  int32_t owner(HalfFaceId face) const { return owner_[static_cast<size_t>(face)]; }

  void Remove(int32_t piece);
  void Add(int32_t piece);  // its atoms must be free

  // Ascending.
  std::vector<int32_t> Pieces() const;

 private:
  const PieceTable& table_;
  std::vector<int32_t> piece_of_atom_;  // [atom_count]
  std::vector<int32_t> owner_;          // [half_face_count]
};

// Searches for exchanges. A merged quad of a piece must meet the same quad of another one: what an
// exchange breaks around it is mended within it, by merging what lies there too or by giving up
// what was merged there.
class ExchangeSearch {
 public:
  explicit ExchangeSearch(const PieceTable& table);

  // Brings the piece, which must not be in the mesh, into it by the best exchange found within a
  // fixed budget; false, with the mesh unchanged, if none gains anything.
  bool BringIn(int32_t piece, PieceMesh* mesh);

  // What the last exchange added and removed, in order.
  struct Change {
    int32_t piece;
    bool is_added;
  };
  const std::vector<Change>& last_changes() const { return best_changes_; }

 private:
  template <class Visit>
  void ForEachQuad(int32_t piece, const Visit& visit) const;
  void FindHopeless();
  bool IsHopeless(int32_t piece) const { return is_hopeless_[static_cast<size_t>(piece)] != 0; }

  void Explore(int depth);
  bool CanTake(int32_t piece) const;
  bool Take(int32_t piece);
  void Dissolve(int32_t piece);
  void Apply(int32_t piece, bool is_added);
  void UndoTo(size_t change_count);
  HalfFaceId FindUnmet() const;
  bool IsUnmet(HalfFaceId face) const;
  void GiveUpTaken(size_t count);
  bool IsTaken(int32_t piece) const { return is_taken_[static_cast<size_t>(piece)] != 0; }
  double ValueOf(int32_t piece) const;

  const PieceTable& table_;
  std::vector<uint8_t> may_be_free_;  // [half_face_count] free before anything was merged
  std::vector<uint8_t> is_hopeless_;  // [piece_count] can be in no conforming mesh
  std::vector<int32_t> first_piece_;  // [half_face_count + 1] rows of pieces_at_
  std::vector<int32_t> pieces_at_;    // merged pieces by their quads, best first
  PieceMesh* mesh_ = nullptr;         // while searching
  std::vector<Change> changes_;       // the exchange under way
  std::vector<int32_t> taken_;        // pieces it brings in
  std::vector<uint8_t> is_taken_;     // [piece_count] the same
  std::vector<Change> best_changes_;
  double gain_ = 0, best_gain_ = 0;
  int budget_ = 0;
};

}  // namespace amhex
