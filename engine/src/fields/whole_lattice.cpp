#include "fields/whole_lattice.h"

#include <cstdint>
#include <vector>

#include "fields/nearest_axis.h"
#include "fields/point_index.h"

namespace amhex::fields {
namespace {

// Edge lengths: from where the next site would be to one that is there for another lattice; from
// the middle of a cube's outer face to the nearest sample of the hull, a quarter of an edge length
// apart; from a sample to the nearest site, whose cube has its corners 0.87 away.
constexpr double kSameSite = 0.6;
constexpr double kFaceToHull = 0.6;
constexpr double kHullToSite = 1.1;
// Cubes around an edge inside; four but for singular ones.
constexpr int kFewestAroundEdge = 3;
constexpr int kMostAroundEdge = 5;
constexpr int32_t kNone = -1;

// By face, numbered 6 * site + direction: of several that it might be glued to the one with most
// votes is its partner, the first of these.
std::vector<int32_t> PartnersOf(const Sites& sites) {
  const auto face_of = [](int32_t site, int direction) {
    return kDirectionCount * site + direction;
  };
  std::vector<int32_t> partner(static_cast<size_t>(kDirectionCount * sites.count()), kNone);
  std::vector<int32_t> votes(partner.size(), 0);
  for (const FaceLink& link : sites.links) {
    const int32_t a = face_of(link.site_a, link.direction_a);
    const int32_t b = face_of(link.site_b, link.direction_b);
    if (link.votes > votes[a]) votes[a] = link.votes, partner[a] = b;
    if (link.votes > votes[b]) votes[b] = link.votes, partner[b] = a;
  }
  return partner;
}

// Sites with a face whose partner has another one.
int64_t CountTornSites(const std::vector<int32_t>& partner) {
  const auto face_count = static_cast<int32_t>(partner.size());
  int64_t torn = 0;
  for (int32_t first = 0; first < face_count; first += kDirectionCount) {
    bool is_torn = false;
    for (int32_t face = first; face < first + kDirectionCount; ++face) {
      is_torn |= partner[face] != kNone && partner[partner[face]] != face;
    }
    torn += is_torn ? 1 : 0;
  }
  return torn;
}

class LatticeCheck {
 public:
  LatticeCheck(const Sites& sites, const HullSamples& samples, const StopPoll& poll)
      : sites_(sites), samples_(samples), poll_(poll), partner_(PartnersOf(sites)) {}

  bool IsWhole() const {
    return CountTornSites(partner_) == 0 && ClosesEverywhere() && MeetsHull();
  }

 private:
  bool ClosesEverywhere() const {
    for (int32_t face = 0; face < FaceCount(); ++face) {
      poll_.At(face);
      if (partner_[face] == kNone) continue;
      for (int side = 0; side < kDirectionCount; ++side) {
        if (side / 2 != DirectionOf(face) / 2 && !ClosesBeside(face, side)) return false;
      }
    }
    return true;
  }

  // Around the edge of the face with that on one side of it, from cube to cube: back to the first
  // one, or out of the solid.
  bool ClosesBeside(int32_t face, int side) const {
    int32_t ahead = face, beside = FaceOf(SiteOf(face), side);
    for (int cubes = 1; cubes <= kMostAroundEdge; ++cubes) {
      const int32_t entered = partner_[ahead];
      if (entered == kNone) return true;
      const int32_t next = SiteOf(entered);
      ahead = FaceOf(next, Named(SiteOf(beside), DirectionOf(beside), next));
      beside = entered;
      if (ahead == face) return cubes >= kFewestAroundEdge;
      if (DirectionOf(ahead) / 2 == DirectionOf(beside) / 2) return false;
    }
    return false;
  }

  // Outer faces have the hull next to them, and no site of another lattice; the hull has sites.
  bool MeetsHull() const {
    const PointIndex sites(sites_.position, 1.0), samples(samples_.position, 1.0);
    const auto is_near = [](const PointIndex& index, const std::vector<Vec3d>& points,
                            const Vec3d& p, double distance, int32_t but = kNone) {
      bool is_found = false;
      index.VisitNear(p, distance, [&](int32_t i) {
        is_found = is_found || (i != but && SquaredNorm(points[i] - p) < distance * distance);
      });
      return is_found;
    };
    for (int32_t face = 0; face < FaceCount(); ++face) {
      poll_.At(face);
      if (partner_[face] != kNone) continue;
      const int32_t site = SiteOf(face);
      const Vec3d step =
          Towards(site, DirectionOf(face)) * sites_.size[site][DirectionOf(face) / 2];
      const Vec3d& centre = sites_.position[site];
      if (is_near(sites, sites_.position, centre + step, kSameSite, site)) return false;
      if (!is_near(samples, samples_.position, centre + step * 0.5, kFaceToHull)) return false;
    }
    for (size_t i = 0; i < samples_.position.size(); ++i) {
      poll_.At(static_cast<int64_t>(i));
      if (!is_near(sites, sites_.position, samples_.position[i], kHullToSite)) return false;
    }
    return true;
  }

  int32_t FaceCount() const { return static_cast<int32_t>(partner_.size()); }
  static int32_t SiteOf(int32_t face) { return face / kDirectionCount; }
  static int DirectionOf(int32_t face) { return face % kDirectionCount; }
  static int32_t FaceOf(int32_t site, int direction) { return kDirectionCount * site + direction; }
  Vec3d Towards(int32_t site, int direction) const {
    return sites_.frame[site].axis[direction / 2] * (direction % 2 == 0 ? -1.0 : 1.0);
  }
  // A direction of one site as its neighbour has it.
  int Named(int32_t site, int direction, int32_t neighbour) const {
    const NearestAxis nearest = FindNearestAxis(sites_.frame[neighbour], Towards(site, direction));
    return 2 * nearest.axis + (nearest.sign > 0 ? 1 : 0);
  }

  const Sites& sites_;
  const HullSamples& samples_;
  const StopPoll& poll_;
  const std::vector<int32_t> partner_;  // [face]
};

}  // namespace

bool IsWholeLattice(const Sites& sites, const HullSamples& samples, const StopPoll& poll) {
  return sites.count() > 0 && LatticeCheck(sites, samples, poll).IsWhole();
}

double ShareOfTornSites(const Sites& sites) {
  if (sites.count() == 0) return 0;
  return static_cast<double>(CountTornSites(PartnersOf(sites))) /
         static_cast<double>(sites.count());
}

}  // namespace amhex::fields
