#include "input/sign_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace amhex {
namespace {

constexpr double kFarOutside = 1e30;
constexpr size_t kMostBlocks = 8'000'000;  // with their places less than 1 GiB
// Half of a block's width in cells, and a little more.
constexpr double kBlockReach = 0.5001;
// Turned nodes lie this much inside, in cells: the surface passes close to them.
constexpr double kTurnedDepth = 0.01;

NodeIndex Moved(NodeIndex node, int axis, int64_t by) {
  node[static_cast<size_t>(axis)] += by;
  return node;
}

}  // namespace

int64_t SignGrid::KeyOf(const NodeIndex& node) const {
  const int64_t nx = grid_.node_count[0] / kBlockSide + 1;
  const int64_t ny = grid_.node_count[1] / kBlockSide + 1;
  return (node[2] / kBlockSide * ny + node[1] / kBlockSide) * nx + node[0] / kBlockSide;
}

NodeIndex SignGrid::CornerOf(int64_t key) const {
  const int64_t nx = grid_.node_count[0] / kBlockSide + 1;
  const int64_t ny = grid_.node_count[1] / kBlockSide + 1;
  return {key % nx * kBlockSide, key / nx % ny * kBlockSide, key / nx / ny * kBlockSide};
}

bool SignGrid::IsOnGrid(const NodeIndex& node) const {
  for (size_t axis = 0; axis < 3; ++axis) {
    if (node[axis] < 0 || node[axis] >= grid_.node_count[axis]) return false;
  }
  return true;
}

Vec3d SignGrid::Position(const NodeIndex& node) const {
  return grid_.low + Vec3d{static_cast<double>(node[0]), static_cast<double>(node[1]),
                           static_cast<double>(node[2])} *
                         grid_.spacing;
}

float* SignGrid::Find(const NodeIndex& node) {
  const auto found = block_of_key_.find(KeyOf(node));
  if (found == block_of_key_.end()) return nullptr;
  const int64_t inside = (node[2] % kBlockSide * kBlockSide + node[1] % kBlockSide) * kBlockSide +
                         node[0] % kBlockSide;
  return &values_[static_cast<size_t>(found->second * kBlockNodes + inside)];
}

double SignGrid::Value(const NodeIndex& node) const {
  for (size_t axis = 0; axis < 3; ++axis) {
    if (node[axis] <= 1 || node[axis] >= grid_.node_count[axis] - 2) return kFarOutside;
  }
  const auto found = block_of_key_.find(KeyOf(node));
  if (found == block_of_key_.end()) return kFarOutside;
  const int64_t inside = (node[2] % kBlockSide * kBlockSide + node[1] % kBlockSide) * kBlockSide +
                         node[0] % kBlockSide;
  return static_cast<double>(values_[static_cast<size_t>(found->second * kBlockNodes + inside)]);
}

// The blocks of each seed's cell and of the cells around it.
std::vector<int64_t> SignGrid::BlocksAround(const std::vector<Vec3d>& seeds) const {
  std::vector<NodeIndex> cells;
  cells.reserve(seeds.size());
  for (const Vec3d& seed : seeds) {
    const Vec3d at = (seed - grid_.low) / grid_.spacing;
    cells.push_back({static_cast<int64_t>(std::floor(at.x)), static_cast<int64_t>(std::floor(at.y)),
                     static_cast<int64_t>(std::floor(at.z))});
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  // Of four nodes in a row these three are in all of their blocks.
  constexpr std::array<int64_t, 3> kSteps = {-1, 1, 2};
  std::vector<int64_t> keys;
  for (const NodeIndex& cell : cells) {
    for (const int64_t x : kSteps) {
      for (const int64_t y : kSteps) {
        for (const int64_t z : kSteps) {
          const NodeIndex near = {cell[0] + x, cell[1] + y, cell[2] + z};
          if (IsOnGrid(near)) keys.push_back(KeyOf(near));
        }
      }
    }
  }
  return keys;
}

absl::Status SignGrid::Fill(const std::vector<Vec3d>& seeds, RunContext& run) {
  std::vector<int64_t> wanted = BlocksAround(seeds);
  while (true) {
    AMHEX_RETURN_IF_ERROR(Evaluate(std::move(wanted), run));
    wanted = BlocksToFollow();
    if (!wanted.empty()) continue;
    if (Compose() == 0) return absl::OkStatus();
    wanted = BlocksToFollow();
  }
}

absl::Status SignGrid::Evaluate(std::vector<int64_t> keys, RunContext& run) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::erase_if(keys, [&](int64_t key) { return block_of_key_.count(key) > 0; });
  const size_t first = sorted_keys_.size();
  if (first + keys.size() > kMostBlocks) {
    return absl::ResourceExhaustedError(absl::StrCat("the surface to be rebuilt crosses more than ",
                                                     kMostBlocks,
                                                     " grid cells; choose a larger edge length"));
  }
  values_.resize((first + keys.size()) * kBlockNodes);
  for (size_t i = 0; i < keys.size(); ++i) {
    block_of_key_.emplace(keys[i], static_cast<int32_t>(first + i));
  }
  tbb::parallel_for(size_t{0}, keys.size(), [&](size_t i) {
    if (run.ShouldStop()) return;
    const NodeIndex corner = CornerOf(keys[i]);
    const double half = 0.5 * grid_.spacing;
    const auto around = field_.Around(Position(corner) + Vec3d{half, half, half},
                                      std::sqrt(3.0) * kBlockReach * grid_.spacing);
    const SurfaceField& field = around != nullptr ? *around : field_;
    EightPoints points;
    static_assert(points.size() == kBlockNodes);
    size_t count = 0;
    for (int64_t z = 0; z < kBlockSide; ++z) {
      for (int64_t y = 0; y < kBlockSide; ++y) {
        for (int64_t x = 0; x < kBlockSide; ++x) {
          points[count++] = Position({corner[0] + x, corner[1] + y, corner[2] + z});
        }
      }
    }
    const EightValues values = field.Values(points);
    float* value = &values_[(first + i) * kBlockNodes];
    for (size_t k = 0; k < count; ++k) value[k] = static_cast<float>(values[k]);
  });
  const auto middle = static_cast<std::ptrdiff_t>(sorted_keys_.size());
  sorted_keys_.insert(sorted_keys_.end(), keys.begin(), keys.end());
  std::inplace_merge(sorted_keys_.begin(), sorted_keys_.begin() + middle, sorted_keys_.end());
  return run.CheckStop();
}

// Every grid edge that crosses the surface needs all nodes of its four cells.
std::vector<int64_t> SignGrid::BlocksToFollow() const {
  std::vector<int64_t> missing;
  const auto want = [&](const NodeIndex& node) {
    if (!IsOnGrid(node)) return;
    const int64_t key = KeyOf(node);
    if (block_of_key_.count(key) == 0) missing.push_back(key);
  };
  ForEachNode([&](const NodeIndex& node) {
    const bool inside = IsInside(node);
    for (int axis = 0; axis < 3; ++axis) {
      const NodeIndex next = Moved(node, axis, 1);
      if (!Has(next) || IsInside(next) == inside) continue;
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const int64_t du : {-1, 0, 1}) {
        for (const int64_t dv : {-1, 0, 1}) {
          want(Moved(Moved(node, u, du), v, dv));
          want(Moved(Moved(next, u, du), v, dv));
        }
      }
    }
  });
  return missing;
}

bool SignGrid::TurnInside(const NodeIndex& node) {
  float* value = Find(node);
  if (value == nullptr) return false;
  *value = static_cast<float>(-kTurnedDepth * grid_.spacing);
  return IsInside(node);
}

// Two inside nodes diagonal in a square, the others outside: one of those turns.
bool SignGrid::ComposeFace(const NodeIndex& node, int axis_u, int axis_v) {
  const std::array<NodeIndex, 4> ring = {node, Moved(node, axis_u, 1),
                                         Moved(Moved(node, axis_u, 1), axis_v, 1),
                                         Moved(node, axis_v, 1)};
  if (!Has(ring[1]) || !Has(ring[2]) || !Has(ring[3])) return false;
  const bool even = IsInside(ring[0]), odd = IsInside(ring[1]);
  if (even == odd || IsInside(ring[2]) != even || IsInside(ring[3]) != odd) return false;
  const size_t first = even ? 1 : 0;
  return TurnInside(Value(ring[first]) <= Value(ring[first + 2]) ? ring[first] : ring[first + 2]);
}

// Two opposite corners of a cube differ from the six others.
bool SignGrid::ComposeCube(const NodeIndex& node) {
  std::array<NodeIndex, 8> corner;
  int mask = 0;
  for (int i = 0; i < 8; ++i) {
    corner[static_cast<size_t>(i)] = {node[0] + (i & 1), node[1] + (i >> 1 & 1),
                                      node[2] + (i >> 2)};
    if (!Has(corner[static_cast<size_t>(i)])) return false;
    if (IsInside(corner[static_cast<size_t>(i)])) mask |= 1 << i;
  }
  for (int i = 0; i < 4; ++i) {
    const int pair = 1 << i | 1 << (7 - i);
    if (mask != pair && mask != (0xff ^ pair)) continue;
    // The outside corner nearest to the surface turns; further turns follow until all is well.
    int nearest = -1;
    for (int k = 0; k < 8; ++k) {
      if ((mask >> k & 1) != 0) continue;
      if (nearest < 0 ||
          Value(corner[static_cast<size_t>(k)]) < Value(corner[static_cast<size_t>(nearest)])) {
        nearest = k;
      }
    }
    return TurnInside(corner[static_cast<size_t>(nearest)]);
  }
  return false;
}

int64_t SignGrid::Compose() {
  // Turned nodes stay inside, so this ends.
  int64_t turned = 0;
  ForEachNode([&](const NodeIndex& node) {
    for (int axis = 0; axis < 3; ++axis) {
      while (ComposeFace(node, axis, (axis + 1) % 3)) ++turned;
    }
    while (ComposeCube(node)) ++turned;
  });
  return turned;
}

}  // namespace amhex
