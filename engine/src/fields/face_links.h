// Which cube faces the fields want glued: background edges whose ends belong to two sites that are
// one lattice step apart vote for the pair of faces between them.
#pragma once

#include <vector>

#include "fields/background_grid.h"
#include "fields/face_votes.h"
#include "fields/lattice_form.h"
#include "relax/sites.h"

namespace amhex::fields {

// From node i to its neighbour j.
LatticeTransition TransitionBetween(const BackgroundGrid& grid, const LatticeForm& form,
                                    const std::vector<Vec3d>& positions, int64_t i, int64_t j);

// Pairs with at least two votes, sorted by their faces. O(nodes log nodes).
std::vector<VotedFaces> VoteFaces(const BackgroundGrid& grid, const LatticeForm& form,
                                  const std::vector<Vec3d>& positions, const Sites& sites,
                                  const RunContext& run);

// The same as they travel with the sites: sorted by (site_a, direction_a, site_b, direction_b).
std::vector<FaceLink> LinksOf(const std::vector<VotedFaces>& voted);

// Squares of the grid around which the lattice does not close. Few of both = few open faces later.
struct FieldDefects {
  int64_t square_count = 0;
  int64_t singular = 0;    // the frames turn once around
  int64_t dislocated = 0;  // the frames close, the lattice is shifted
};
FieldDefects CountDefects(const BackgroundGrid& grid, const LatticeForm& form,
                          const std::vector<Vec3d>& positions, const RunContext& run);

}  // namespace amhex::fields
