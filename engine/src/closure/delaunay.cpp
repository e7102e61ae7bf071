#include "closure/delaunay.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace amhex {
namespace {

// 22 bits per coordinate keep the in-sphere determinant within 127 bits:
// 3 * 23 (differences) + 2 * 23 + 2 (squared length) + 5 (24 terms) = 122.
constexpr int kLatticeBits = 22;
constexpr int kJitter = 5;  // lattice units
__extension__ using Int128 = __int128;

struct LatticePoint {
  int64_t x, y, z;
};

uint64_t Hash(uint64_t value) {  // SplitMix64's finaliser
  value += 0x9e3779b97f4a7c15ULL;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebULL;
  return value ^ (value >> 31);
}

int Sign(Int128 value) { return value > 0 ? 1 : (value < 0 ? -1 : 0); }

// Sign of det(b - a, c - a, d - a); a double filter decides all but the nearly flat cases.
int Orientation(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                const LatticePoint& d) {
  const int64_t bx = b.x - a.x, by = b.y - a.y, bz = b.z - a.z;
  const int64_t cx = c.x - a.x, cy = c.y - a.y, cz = c.z - a.z;
  const int64_t dx = d.x - a.x, dy = d.y - a.y, dz = d.z - a.z;
  // 2 x 2 minors fit in 64 bits.
  const int64_t mx = cy * dz - cz * dy, my = cz * dx - cx * dz, mz = cx * dy - cy * dx;
  const double px = static_cast<double>(bx) * static_cast<double>(mx);
  const double py = static_cast<double>(by) * static_cast<double>(my);
  const double pz = static_cast<double>(bz) * static_cast<double>(mz);
  const double sum = px + py + pz;
  constexpr double kRelativeError = 1e-15;
  if (std::abs(sum) > kRelativeError * (std::abs(px) + std::abs(py) + std::abs(pz))) {
    return sum > 0 ? 1 : -1;
  }
  return Sign(Int128{bx} * mx + Int128{by} * my + Int128{bz} * mz);
}

// Positive if e lies inside the sphere through the positively oriented a, b, c, d.
int InSphere(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
             const LatticePoint& d, const LatticePoint& e) {
  struct Row {
    int64_t x, y, z, square;
  };
  const auto row = [&](const LatticePoint& p) {
    const int64_t x = p.x - e.x, y = p.y - e.y, z = p.z - e.z;
    return Row{x, y, z, x * x + y * y + z * z};
  };
  const Row ra = row(a), rb = row(b), rc = row(c), rd = row(d);
  // 2 x 2 minors of the x and y columns.
  const int64_t ab = ra.x * rb.y - rb.x * ra.y, bc = rb.x * rc.y - rc.x * rb.y;
  const int64_t cd = rc.x * rd.y - rd.x * rc.y, da = rd.x * ra.y - ra.x * rd.y;
  const int64_t ac = ra.x * rc.y - rc.x * ra.y, bd = rb.x * rd.y - rd.x * rb.y;
  const auto minor = [](int64_t z1, int64_t m1, int64_t z2, int64_t m2, int64_t z3, int64_t m3) {
    return Int128{z1} * m1 + Int128{z2} * m2 + Int128{z3} * m3;
  };
  const Int128 abc = minor(ra.z, bc, -rb.z, ac, rc.z, ab);
  const Int128 bcd = minor(rb.z, cd, -rc.z, bd, rd.z, bc);
  const Int128 cda = minor(rc.z, da, rd.z, ac, ra.z, cd);
  const Int128 dab = minor(rd.z, ab, ra.z, bd, rb.z, da);
  const double t1 = static_cast<double>(rd.square) * static_cast<double>(abc);
  const double t2 = static_cast<double>(rc.square) * static_cast<double>(dab);
  const double t3 = static_cast<double>(rb.square) * static_cast<double>(cda);
  const double t4 = static_cast<double>(ra.square) * static_cast<double>(bcd);
  const double sum = (t1 - t2) + (t3 - t4);
  constexpr double kRelativeError = 1e-14;
  const double magnitude = std::abs(t1) + std::abs(t2) + std::abs(t3) + std::abs(t4);
  // The determinant of the rows is negative inside for a positive orientation.
  if (std::abs(sum) > kRelativeError * magnitude) return sum < 0 ? 1 : -1;
  return -Sign(rd.square * abc - rc.square * dab + rb.square * cda - ra.square * bcd);
}

// Vertices of the face opposite each corner, so that (face, corner) is positively oriented.
constexpr int kOpposite[4][3] = {{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};

class Triangulator {
 public:
  Triangulator(const std::vector<Vec3d>& points, uint64_t seed) { Snap(points, seed); }

  Tetrahedra Run() {
    if (!Start()) return {};
    for (const int32_t p : order_) {
      if (p != start_[0] && p != start_[1] && p != start_[2] && p != start_[3]) Insert(p);
    }
    return Compact();
  }

 private:
  void Snap(const std::vector<Vec3d>& points, uint64_t seed) {
    Box3d box;
    for (const Vec3d& p : points) box.Extend(p);
    const Vec3d extent = points.empty() ? Vec3d{1, 1, 1} : box.Extent();
    const double size = std::max({extent.x, extent.y, extent.z, 1e-300});
    const double scale = (double{1 << kLatticeBits} - 4.0 * kJitter) / size;
    lattice_.resize(points.size());
    std::vector<std::pair<uint64_t, int32_t>> keyed(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      const auto coordinate = [&](int axis) {
        const uint64_t noise = Hash(Hash(seed) ^ (3 * i + static_cast<uint64_t>(axis)));
        const auto jitter = static_cast<int64_t>(noise % (2 * kJitter + 1)) - kJitter;
        return std::llround((points[i][axis] - box.low[axis]) * scale) + int64_t{2} * kJitter +
               jitter;
      };
      lattice_[i] = {coordinate(0), coordinate(1), coordinate(2)};
      keyed[i] = {MortonKey(lattice_[i]), static_cast<int32_t>(i)};
    }
    std::sort(keyed.begin(), keyed.end());
    order_.resize(points.size());
    for (size_t i = 0; i < keyed.size(); ++i) order_[i] = keyed[i].second;
  }

  // Interleaved leading bits: neighbours in space are neighbours in the order of insertion.
  static uint64_t MortonKey(const LatticePoint& p) {
    uint64_t key = 0;
    for (int bit = kLatticeBits; bit-- > 2;) {
      key = (key << 3) | (static_cast<uint64_t>((p.x >> bit) & 1) << 2) |
            (static_cast<uint64_t>((p.y >> bit) & 1) << 1) |
            static_cast<uint64_t>((p.z >> bit) & 1);
    }
    return key;
  }

  int Orient(int a, int b, int c, int d) const {
    return Orientation(lattice_[a], lattice_[b], lattice_[c], lattice_[d]);
  }

  // First tetrahedron from four points that are not coplanar, with its four infinite neighbours.
  bool Start() {
    if (order_.size() < 4) return false;
    start_[0] = order_[0];
    start_[1] = order_[order_.size() / 2];
    bool found = false;
    for (size_t i = 0; i < order_.size() && !found; ++i) {
      for (size_t j = i + 1; j < std::min(order_.size(), i + 50) && !found; ++j) {
        start_[2] = order_[i];
        start_[3] = order_[j];
        if (start_[2] == start_[0] || start_[2] == start_[1] || start_[3] == start_[0] ||
            start_[3] == start_[1]) {
          continue;
        }
        found = Orient(start_[0], start_[1], start_[2], start_[3]) != 0;
      }
    }
    if (!found) return false;
    if (Orient(start_[0], start_[1], start_[2], start_[3]) < 0) std::swap(start_[2], start_[3]);
    const int32_t inf = Tetrahedra::kInfinite;
    const auto [a, b, c, d] = start_;
    mesh_.vertices = {{a, b, c, d}, {b, c, d, inf}, {a, d, c, inf}, {a, b, d, inf}, {a, c, b, inf}};
    mesh_.neighbours.assign(5, {-1, -1, -1, -1});
    for (int s = 0; s < 5; ++s) {
      for (int t = s + 1; t < 5; ++t) LinkIfAdjacent(s, t);
    }
    dead_.assign(5, 0);
    last_ = 0;
    return true;
  }

  void LinkIfAdjacent(int s, int t) {
    const auto missing = [](const std::array<int32_t, 4>& a, const std::array<int32_t, 4>& b) {
      int index = -1, count = 0;
      for (int i = 0; i < 4; ++i) {
        if (std::find(b.begin(), b.end(), a[i]) == b.end()) index = i, ++count;
      }
      return count == 1 ? index : -1;
    };
    const int i = missing(mesh_.vertices[s], mesh_.vertices[t]);
    const int j = missing(mesh_.vertices[t], mesh_.vertices[s]);
    if (i >= 0 && j >= 0) mesh_.neighbours[s][i] = t, mesh_.neighbours[t][j] = s;
  }

  int InfiniteCorner(int t) const {
    for (int i = 0; i < 4; ++i) {
      if (mesh_.vertices[t][i] == Tetrahedra::kInfinite) return i;
    }
    return -1;
  }

  bool InConflict(int t, int32_t p) const {
    const auto& v = mesh_.vertices[t];
    const int inf = InfiniteCorner(t);
    if (inf < 0) {
      return InSphere(lattice_[v[0]], lattice_[v[1]], lattice_[v[2]], lattice_[v[3]], lattice_[p]) >
             0;
    }
    const int* f = kOpposite[inf];
    const int side = Orient(v[f[0]], v[f[1]], v[f[2]], p);
    // On the face's plane the sphere of the finite neighbour decides.
    return side != 0 ? side > 0 : InConflict(mesh_.neighbours[t][inf], p);
  }

  // Walks to a tetrahedron in conflict with p; -1 if p coincides with a vertex.
  int Locate(int32_t p) const {
    int t = last_;
    const int limit = 100 + 4 * static_cast<int>(mesh_.vertices.size());
    for (int step = 0; step < limit; ++step) {
      const int inf = InfiniteCorner(t);
      if (inf >= 0) {
        if (InConflict(t, p)) return t;
        t = mesh_.neighbours[t][inf];
        continue;
      }
      const auto& v = mesh_.vertices[t];
      int next = -1;
      const int first = step % 4;  // rotating the first face tried keeps the walk from cycling
      for (int k = 0; k < 4 && next < 0; ++k) {
        const int i = (first + k) % 4;
        const int* f = kOpposite[i];
        if (Orient(v[f[0]], v[f[1]], v[f[2]], p) < 0) next = mesh_.neighbours[t][i];
      }
      if (next < 0) return InConflict(t, p) ? t : -1;
      t = next;
    }
    return -1;
  }

  struct CavityFace {
    std::array<int32_t, 3> v;  // (v, p) is positively oriented
    int outside;               // tetrahedron beyond
    int outside_corner;        // its vertex opposite the face
  };

  void Insert(int32_t p) {
    const int seed = Locate(p);
    if (seed < 0) return;
    conflict_.assign(1, seed);
    dead_[seed] = 1;
    boundary_.clear();
    bool degenerate = false;
    for (size_t k = 0; k < conflict_.size(); ++k) {
      const int t = conflict_[k];
      for (int i = 0; i < 4; ++i) {
        const int n = mesh_.neighbours[t][i];
        if (dead_[n]) continue;
        if (InConflict(n, p)) {
          dead_[n] = 1;
          conflict_.push_back(n);
        }
      }
    }
    for (const int t : conflict_) {
      for (int i = 0; i < 4; ++i) {
        const int n = mesh_.neighbours[t][i];
        if (dead_[n]) continue;
        const auto& v = mesh_.vertices[t];
        const int* f = kOpposite[i];
        const auto& back = mesh_.neighbours[n];
        const int corner = static_cast<int>(std::find(back.begin(), back.end(), t) - back.begin());
        boundary_.push_back({{v[f[0]], v[f[1]], v[f[2]]}, n, corner});
        const auto& b = boundary_.back().v;
        if (b[0] >= 0 && b[1] >= 0 && b[2] >= 0) {
          degenerate |= Orient(b[0], b[1], b[2], p) <= 0;
        }
      }
    }
    if (degenerate) {  // p lies on a face of the cavity: leave it out rather than flatten a cell
      for (const int t : conflict_) dead_[t] = 0;
      return;
    }
    FillCavity(p);
  }

  void FillCavity(int32_t p) {
    links_.clear();
    size_t reused = 0;
    for (const CavityFace& face : boundary_) {
      int t;
      if (reused < conflict_.size()) {
        t = conflict_[reused++];
        dead_[t] = 0;
      } else if (!free_.empty()) {
        t = free_.back();
        free_.pop_back();
        dead_[t] = 0;
      } else {
        t = mesh_.count();
        mesh_.vertices.push_back({});
        mesh_.neighbours.push_back({});
        dead_.push_back(0);
      }
      mesh_.vertices[t] = {face.v[0], face.v[1], face.v[2], p};
      mesh_.neighbours[t] = {-1, -1, -1, face.outside};
      mesh_.neighbours[face.outside][face.outside_corner] = t;
      for (int i = 0; i < 3; ++i) {
        const int32_t a = face.v[(i + 1) % 3], b = face.v[(i + 2) % 3];
        links_.push_back({std::min(a, b), std::max(a, b), t, i});
      }
      last_ = t;
    }
    for (; reused < conflict_.size(); ++reused) free_.push_back(conflict_[reused]);
    std::sort(links_.begin(), links_.end(), [](const Link& a, const Link& b) {
      return a.low != b.low ? a.low < b.low : (a.high != b.high ? a.high < b.high : a.t < b.t);
    });
    for (size_t k = 0; k + 1 < links_.size(); k += 2) {
      mesh_.neighbours[links_[k].t][links_[k].corner] = links_[k + 1].t;
      mesh_.neighbours[links_[k + 1].t][links_[k + 1].corner] = links_[k].t;
    }
  }

  Tetrahedra Compact() const {
    std::vector<int32_t> number(mesh_.vertices.size(), -1);
    Tetrahedra out;
    for (int t = 0; t < mesh_.count(); ++t) {
      if (dead_[t]) continue;
      number[t] = out.count();
      out.vertices.push_back(mesh_.vertices[t]);
    }
    for (int t = 0; t < mesh_.count(); ++t) {
      if (dead_[t]) continue;
      auto n = mesh_.neighbours[t];
      for (int32_t& id : n) id = number[id];
      out.neighbours.push_back(n);
    }
    return out;
  }

  struct Link {
    int32_t low, high;
    int t, corner;
  };

  std::vector<LatticePoint> lattice_;
  std::vector<int32_t> order_;
  std::array<int32_t, 4> start_{};
  Tetrahedra mesh_;
  std::vector<uint8_t> dead_;
  std::vector<int> free_, conflict_;
  std::vector<CavityFace> boundary_;
  std::vector<Link> links_;
  int last_ = 0;
};

}  // namespace

Tetrahedra DelaunayTetrahedralization(const std::vector<Vec3d>& points, uint64_t seed) {
  return Triangulator(points, seed).Run();
}

}  // namespace amhex
