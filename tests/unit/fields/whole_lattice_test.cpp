// Laws of telling a lattice that fits its solid: a block of sites does, and no damaged one.
#include "fields/whole_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "input/sample_hull.h"
#include "support/grid_hull.h"

namespace amhex::fields {
namespace {

constexpr testing_support::GridSize kBlock{4, 3, 2};

int32_t SiteAt(int x, int y, int z) { return (z * kBlock.ny + y) * kBlock.nx + x; }

FaceLink LinkUp(int32_t a, int32_t b, int axis, int32_t votes = 4) {
  return {a, b, static_cast<uint8_t>(2 * axis + 1), static_cast<uint8_t>(2 * axis), votes};
}

// A site in the middle of every unit cube of the block, glued to those beside it.
Sites SitesOfBlock() {
  Sites sites;
  for (int z = 0; z < kBlock.nz; ++z) {
    for (int y = 0; y < kBlock.ny; ++y) {
      for (int x = 0; x < kBlock.nx; ++x) {
        const int32_t here = SiteAt(x, y, z);
        sites.position.push_back({x + 0.5, y + 0.5, z + 0.5});
        if (x + 1 < kBlock.nx) sites.links.push_back(LinkUp(here, SiteAt(x + 1, y, z), 0));
        if (y + 1 < kBlock.ny) sites.links.push_back(LinkUp(here, SiteAt(x, y + 1, z), 1));
        if (z + 1 < kBlock.nz) sites.links.push_back(LinkUp(here, SiteAt(x, y, z + 1), 2));
      }
    }
  }
  sites.frame.resize(sites.position.size());
  sites.size.resize(sites.position.size(), {1, 1, 1});
  sites.cell_volume.resize(sites.position.size(), 0);
  return sites;
}

bool IsWhole(const Sites& sites, const testing_support::GridSize& solid = kBlock) {
  RunContext run;
  const Hull hull = testing_support::GridHull(solid, 0.5);
  const auto samples = SampleHull(hull, Backend::kCpu, run);
  EXPECT_TRUE(samples.ok()) << samples.status();
  return IsWholeLattice(sites, *samples, StopPoll());
}

// Turns the site's own axes by a quarter around z, and renames the faces of its links.
void Turn(int32_t site, Sites* sites) {
  AxisFrame& frame = sites->frame[site];
  frame.axis = {frame.axis[1], -frame.axis[0], frame.axis[2]};
  constexpr uint8_t kRenamed[] = {3, 2, 0, 1, 4, 5};  // -x is +y of the turned site
  for (FaceLink& link : sites->links) {
    if (link.site_a == site) link.direction_a = kRenamed[link.direction_a];
    if (link.site_b == site) link.direction_b = kRenamed[link.direction_b];
  }
}

TEST(WholeLattice, ABlockThatFillsItsSolidIsWhole) { EXPECT_TRUE(IsWhole(SitesOfBlock())); }

TEST(WholeLattice, NamesOfAxesDoNotMatter) {
  Sites sites = SitesOfBlock();
  Turn(SiteAt(1, 1, 0), &sites);
  Turn(SiteAt(3, 0, 1), &sites);
  EXPECT_TRUE(IsWhole(sites));
}

TEST(WholeLattice, FewVotesForAnotherPartnerDoNotMatter) {
  Sites sites = SitesOfBlock();
  sites.links.push_back(LinkUp(SiteAt(0, 0, 0), SiteAt(1, 1, 0), 0, 2));
  EXPECT_TRUE(IsWhole(sites));
}

TEST(WholeLattice, NothingIsNot) { EXPECT_FALSE(IsWhole(Sites())); }

TEST(WholeLattice, WithoutAnyOneOfItsLinksItIsNot) {
  const Sites whole = SitesOfBlock();
  for (size_t i = 0; i < whole.links.size(); ++i) {
    Sites sites = whole;
    sites.links.erase(sites.links.begin() + static_cast<int64_t>(i));
    EXPECT_FALSE(IsWhole(sites)) << i;
  }
}

TEST(WholeLattice, WithTwoPartnersExchangedItIsNot) {
  Sites sites = SitesOfBlock();
  // Layers shifted by one cell against each other along x.
  for (FaceLink& link : sites.links) {
    if (link.direction_a == 5) link.site_b = SiteAt((link.site_b + 1) % kBlock.nx, 0, 1);
  }
  EXPECT_FALSE(IsWhole(sites));
  sites = SitesOfBlock();
  const auto along_x = [](const FaceLink& link) { return link.direction_a == 1; };
  const auto first = std::find_if(sites.links.begin(), sites.links.end(), along_x);
  const auto other = std::find_if(first + 1, sites.links.end(), [&](const FaceLink& link) {
    return along_x(link) && link.site_a == SiteAt(0, 1, 0);
  });
  ASSERT_NE(other, sites.links.end());
  std::swap(first->site_b, other->site_b);
  EXPECT_FALSE(IsWhole(sites));
}

TEST(WholeLattice, IsTornWhereAPartnerHasAnotherPartner) {
  EXPECT_EQ(ShareOfTornSites(Sites()), 0);
  Sites sites = SitesOfBlock();
  EXPECT_EQ(ShareOfTornSites(sites), 0);
  // The first site wants the one beside its neighbour, which keeps to that, and leaves its
  // neighbour without itself.
  sites.links.push_back(LinkUp(SiteAt(0, 0, 0), SiteAt(2, 0, 0), 0, 4 + 1));
  sites.links.push_back(LinkUp(SiteAt(1, 0, 0), SiteAt(2, 0, 0), 0, 4 + 2));
  EXPECT_EQ(ShareOfTornSites(sites), 2.0 / static_cast<double>(sites.count()));
}

TEST(WholeLattice, ThatEndsBeforeItsSolidIsNot) {
  EXPECT_FALSE(IsWhole(SitesOfBlock(), {kBlock.nx + 2, kBlock.ny, kBlock.nz}));
  EXPECT_FALSE(IsWhole(SitesOfBlock(), {kBlock.nx, kBlock.ny, kBlock.nz + 2}));
}

}  // namespace
}  // namespace amhex::fields
