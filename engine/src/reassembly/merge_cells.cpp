#include "reassembly/merge_cells.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "base/status_macros.h"
#include "reassembly/exchange.h"

namespace amhex {
namespace {

// Rounds over all pieces; each finds less than the one before.
constexpr int kMostRounds = 4;
constexpr double kIdleShare = 0.002;  // of the pieces; rounds that gain less are the last
constexpr size_t kPiecesPerStopCheck = 16;

// Largest type first, then best quality.
std::vector<int32_t> MergedPieces(const PieceTable& table) {
  std::vector<int32_t> order(table.pieces.size() - static_cast<size_t>(table.atom_count));
  std::iota(order.begin(), order.end(), table.atom_count);
  std::sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    const auto key = [&](int32_t piece) {
      const Primitive& p = table.pieces[static_cast<size_t>(piece)];
      return std::make_tuple(-static_cast<int>(p.type), -p.quality, piece);
    };
    return key(a) < key(b);
  });
  return order;
}

// Hexahedra that fit each other as they are: the best ones that share no atom, without those that
// have a merged quad which no other of them meets. In tetrahedra that a hexahedral mesh was cut
// into, these are its hexahedra; one at a time they would not be found.
std::vector<int32_t> FittingHexahedra(const PieceTable& table, const std::vector<int32_t>& order) {
  std::vector<uint8_t> is_used(static_cast<size_t>(table.atom_count), 0);
  std::vector<int32_t> chosen;
  for (const int32_t piece : order) {
    if (table.pieces[static_cast<size_t>(piece)].type != PrimitiveType::kHexahedron) break;
    const auto atoms = table.atoms(piece);
    const auto used = [&](int32_t atom) { return is_used[static_cast<size_t>(atom)] != 0; };
    if (std::any_of(atoms.begin(), atoms.end(), used)) continue;
    for (const int32_t atom : atoms) is_used[static_cast<size_t>(atom)] = 1;
    chosen.push_back(piece);
  }
  // A quad of a hexahedron that was one before is there, whatever is chosen.
  std::vector<int32_t> owners(static_cast<size_t>(table.faces.half_face_count()), 0);
  const auto count_faces = [&](int32_t piece, int change) {
    const Primitive& p = table.pieces[static_cast<size_t>(piece)];
    for (int i = 0; i < p.face_count; ++i) owners[static_cast<size_t>(p.half_faces[i])] += change;
  };
  for (int32_t atom = 0; atom < table.atom_count; ++atom) {
    if (!is_used[static_cast<size_t>(atom)]) count_faces(atom, 1);
  }
  for (const int32_t piece : chosen) count_faces(piece, 1);
  for (bool is_settled = false; !is_settled;) {
    is_settled = true;
    std::vector<int32_t> kept;
    for (const int32_t piece : chosen) {
      const Primitive& p = table.pieces[static_cast<size_t>(piece)];
      const bool fits = std::all_of(p.half_faces.begin(), p.half_faces.begin() + p.face_count,
                                    [&](HalfFaceId face) {
                                      return table.on_hull[static_cast<size_t>(face)] != 0 ||
                                             owners[static_cast<size_t>(OppositeOf(face))] > 0;
                                    });
      if (fits) {
        kept.push_back(piece);
        continue;
      }
      count_faces(piece, -1);
      for (const int32_t atom : table.atoms(piece)) count_faces(atom, 1);
      is_settled = false;
    }
    chosen = std::move(kept);
  }
  return chosen;
}

// Where the mesh has changed since a piece was tried last: elsewhere trying again finds the same.
class Changes {
 public:
  explicit Changes(const PieceTable& table)
      : table_(table),
        neighbours_(static_cast<size_t>(table.atom_count)),
        changed_(static_cast<size_t>(table.atom_count), 1),
        tried_(table.pieces.size(), 0) {
    std::vector<int32_t> owner(static_cast<size_t>(table.faces.half_face_count()), -1);
    ForEachFace([&](int32_t atom, HalfFaceId face) { owner[static_cast<size_t>(face)] = atom; });
    ForEachFace([&](int32_t atom, HalfFaceId face) {
      const int32_t other = owner[static_cast<size_t>(OppositeOf(face))];
      if (other >= 0) neighbours_[static_cast<size_t>(atom)].push_back(other);
    });
  }

  // Whether anything changed within two atoms of the piece since this was asked for it last.
  bool AskAbout(int32_t piece) {
    int64_t& tried = tried_[static_cast<size_t>(piece)];
    const auto is_new = [&](int32_t atom) { return changed_[static_cast<size_t>(atom)] > tried; };
    bool any = false;
    for (const int32_t atom : table_.atoms(piece)) {
      const auto& around = neighbours_[static_cast<size_t>(atom)];
      any = any || is_new(atom) || std::any_of(around.begin(), around.end(), is_new);
    }
    tried = now_;
    return any;
  }

  void Note(const std::vector<ExchangeSearch::Change>& changes) {
    ++now_;
    for (const ExchangeSearch::Change& change : changes) {
      for (const int32_t atom : table_.atoms(change.piece)) {
        changed_[static_cast<size_t>(atom)] = now_;
        for (const int32_t other : neighbours_[static_cast<size_t>(atom)]) {
          changed_[static_cast<size_t>(other)] = now_;
        }
      }
    }
  }

 private:
  template <class Visit>
  void ForEachFace(const Visit& visit) const {
    for (int32_t atom = 0; atom < table_.atom_count; ++atom) {
      const Primitive& piece = table_.pieces[static_cast<size_t>(atom)];
      for (int i = 0; i < piece.face_count; ++i) visit(atom, piece.half_faces[i]);
    }
  }

  const PieceTable& table_;
  std::vector<std::vector<int32_t>> neighbours_;  // [atom_count]
  std::vector<int64_t> changed_;                  // [atom_count] when
  std::vector<int64_t> tried_;                    // [piece_count] when
  int64_t now_ = 1;                               // one more with every exchange
};

void Report(double fraction, RunContext& run) {
  Progress progress = run.progress();
  progress.stage_fraction = fraction;
  run.Report(progress);
}

}  // namespace

absl::StatusOr<std::vector<int32_t>> MergeCells(const PieceTable& table, RunContext& run) {
  PieceMesh mesh(table);
  ExchangeSearch search(table);
  const std::vector<int32_t> order = MergedPieces(table);
  for (const int32_t piece : FittingHexahedra(table, order)) {
    for (const int32_t atom : table.atoms(piece)) mesh.Remove(atom);
    mesh.Add(piece);
  }
  Changes changes(table);
  for (int round = 0; round < kMostRounds; ++round) {
    size_t exchanges = 0;
    for (size_t i = 0; i < order.size(); ++i) {
      if (i % kPiecesPerStopCheck == 0) AMHEX_RETURN_IF_ERROR(run.CheckStop());
      const int32_t piece = order[i];
      if (mesh.piece_of(table.atoms(piece).front()) == piece) continue;
      if (!changes.AskAbout(piece) || !search.BringIn(piece, &mesh)) continue;
      changes.Note(search.last_changes());
      ++exchanges;
    }
    Report(static_cast<double>(round + 1) / kMostRounds, run);
    if (static_cast<double>(exchanges) < kIdleShare * static_cast<double>(order.size())) break;
  }
  return mesh.Pieces();
}

}  // namespace amhex
