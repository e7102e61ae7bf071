#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "fields/node_links.h"
#include "fields/owned_node_order.h"
#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

TEST(NodeOrder, HasEveryNodeOnceAndEvenOnesFirst) {
  SolvedFields fields(fixtures::MakeSphere(3, 0.5));
  ASSERT_TRUE(fields.ok);
  const OwnedLinks links(fields.grid.fine(), fields.codes, fields.run);
  const ArrayView<const uint64_t> keys = fields.grid.Cells().keys;
  const OwnedNodeOrder owned(keys, links.View(), fields.run);
  const NodeOrder order = owned.View();
  std::vector<int32_t> nodes(order.node_of.data, order.node_of.data + order.node_of.size);
  for (int64_t number = 0; number < order.node_of.size; ++number) {
    EXPECT_EQ(order.number_of[order.node_of[number]], number);
    EXPECT_EQ(IsOfEvenCell(keys[order.node_of[number]]), number < order.even_count);
  }
  std::sort(nodes.begin(), nodes.end());
  for (int64_t node = 0; node < fields.grid.count(); ++node) EXPECT_EQ(nodes[node], node);
}

TEST(NodeOrder, EveryEdgeLeadsFromAnEvenNodeToAnOddOneAndIsThatOfTheGrid) {
  SolvedFields fields(fixtures::MakeSphere(3, 0.5));
  ASSERT_TRUE(fields.ok);
  const OwnedLinks owned_links(fields.grid.fine(), fields.codes, fields.run);
  const NodeLinks links = owned_links.View();
  const OwnedNodeOrder owned(fields.grid.Cells().keys, links, fields.run);
  const NodeOrder order = owned.View();
  const NodeLinks renumbered = owned.Links();
  for (int64_t number = 0; number < fields.grid.count(); ++number) {
    const int64_t node = order.node_of[number];
    for (int d = 0; d < 3; ++d) {
      const int64_t other = renumbered.Ahead(number, d);
      ASSERT_EQ(other < 0, links.Ahead(node, d) < 0);
      if (other < 0) continue;
      EXPECT_NE(number < order.even_count, other < order.even_count);
      EXPECT_EQ(order.node_of[other], links.Ahead(node, d));
      EXPECT_EQ(renumbered.Behind(other, d), number);
      EXPECT_EQ(renumbered.codes[3 * number + d], links.codes[3 * node + d]);
    }
  }
}

TEST(HalfSlots, AreNumberedOnceEachTheEvenOnesFirstAndFourToACube) {
  constexpr int64_t kCubes = 5, kEven = kHalfSlots * kCubes;
  std::vector<bool> is_taken(2 * kEven);
  for (int64_t slot = 0; slot < kCubeSlots * kCubes; ++slot) {
    const int64_t number = NumberOfSlot(slot, kEven);
    EXPECT_EQ(SlotOfNumber(number, kEven), slot);
    EXPECT_EQ(number < kEven, (slot ^ slot >> 1 ^ slot >> 2) % 2 == 0);
    EXPECT_EQ(number % kEven / kHalfSlots, slot / kCubeSlots);
    EXPECT_FALSE(is_taken[number]);
    is_taken[number] = true;
  }
}

}  // namespace
}  // namespace amhex::fields
