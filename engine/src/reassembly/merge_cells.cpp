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
  for (int round = 0; round < kMostRounds; ++round) {
    size_t exchanges = 0;
    for (size_t i = 0; i < order.size(); ++i) {
      if (i % kPiecesPerStopCheck == 0) AMHEX_RETURN_IF_ERROR(run.CheckStop());
      const int32_t piece = order[i];
      if (mesh.piece_of(table.atoms(piece).front()) == piece) continue;
      if (search.BringIn(piece, &mesh)) ++exchanges;
    }
    Report(static_cast<double>(round + 1) / kMostRounds, run);
    if (static_cast<double>(exchanges) < kIdleShare * static_cast<double>(order.size())) break;
  }
  return mesh.Pieces();
}

}  // namespace amhex
