#include "fields/closure_system.h"

#include <gtest/gtest.h>

#include <random>

#include "base/platform.h"
#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

constexpr int kUnknowns = ClosureOperator::kUnknowns;

// A ball's grid, at whose edges axes are renamed here and there.
class ClosureSystemTest : public testing::Test {
 protected:
  ClosureSystemTest() : hull_(HullOf(fixtures::MakeSphere(4, 0.5))) {
    auto grid = BuildBackgroundGrid(hull_, 1.0 / kNodesPerEdge, ProgressSlice(run_, 0, 1));
    EXPECT_TRUE(grid.ok());
    grid_ = *std::move(grid);
    std::mt19937 random(1);
    codes_.assign(grid_.count(), {});
    follows_.assign(grid_.count(), 0);
    for (int64_t i = 0; i < grid_.count(); ++i) {
      if (random() % 5 == 0) follows_[i] = static_cast<uint16_t>(random() % 512);
      for (int d = 0; d < 3; ++d) {
        if (grid_.fine().neighbours[i][d] < 0 || random() % 10 != 0) continue;
        codes_[i][d] = static_cast<uint8_t>(random() % kRotationCount);
      }
    }
  }

  ClosureSystem System() const { return {{grid_.fine(), codes_, run_}, {}, follows_}; }

  // Zero in slots without a node.
  std::vector<float> RandomNumbers(const NodeSlots& slots) const {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> number(-1, 1);
    std::vector<float> x(kUnknowns * slots.count(), 0.0F);
    for (int64_t i = 0; i < slots.node_count(); ++i) {
      for (int k = 0; k < kUnknowns; ++k) {
        x[PlaceInCube(slots.SlotOf(i), kUnknowns, k)] = number(random);
      }
    }
    return x;
  }

  static std::vector<float> Product(const ClosureSystem& system, const std::vector<float>& x) {
    std::vector<float> curls(x.size()), product(x.size());
    system.ApplyCurl(0, system.slots().count(), x.data(), curls.data());
    system.ApplyAdjoint(0, system.slots().count(), {x.data(), curls.data(), product.data()});
    return product;
  }

  RunContext run_;
  Hull hull_;
  BackgroundGrid grid_;
  ForwardCodes codes_;
  std::vector<uint16_t> follows_;
};

TEST_F(ClosureSystemTest, EverySlotOfANodeIsItsOwn) {
  const NodeSlots slots(grid_.fine(), codes_, run_);
  ASSERT_EQ(slots.node_count(), grid_.count());
  for (int64_t i = 0; i < grid_.count(); ++i) EXPECT_EQ(slots.NodeOf(slots.SlotOf(i)), i);
  int64_t nodes = 0;
  for (int64_t slot = 0; slot < slots.count(); ++slot) nodes += slots.NodeOf(slot) >= 0 ? 1 : 0;
  EXPECT_EQ(nodes, grid_.count());
}

TEST_F(ClosureSystemTest, EightSlotsAtATimeGiveTheBitsOfOneAtATime) {
  const ClosureSystem system = System();
  const SlotLinks links = system.Links();
  const ClosureOperator matrix = system.Matrix(links.View());
  const std::vector<float> x = RandomNumbers(system.slots());
  std::vector<float> curls(x.size()), product(x.size());
  for (int pass = 0; pass < ClosureOperator::kPasses; ++pass) {
    for (int64_t slot = 0; slot < system.slots().count(); ++slot) {
      matrix.Apply(pass, slot, x.data(), curls.data(), product.data());
    }
  }
  EXPECT_EQ(Product(system, x), product);
}

// Of every node, and where there is none: one.
TEST_F(ClosureSystemTest, TheMatrixKnowsItsDiagonal) {
  const ClosureSystem system = System();
  const SlotLinks links = system.Links();
  const ClosureOperator matrix = system.Matrix(links.View());
  for (int64_t slot = 0; slot < system.slots().count(); ++slot) {
    const int64_t node = system.slots().NodeOf(slot);
    for (int k = 0; k < kUnknowns; ++k) {
      const float expected = node < 0 ? 1.0F : system.DiagonalAt(node, k / 3)[k % 3];
      ASSERT_EQ(matrix.Diagonal(slot, k), expected) << "slot " << slot << ", number " << k;
    }
  }
}

TEST_F(ClosureSystemTest, AllVectorWidthsGiveTheSameBits) {
  const ClosureSystem system = System();
  const std::vector<float> x = RandomNumbers(system.slots());
  const std::vector<float> widest = Product(system, x);
  for (const VectorWidth width : {VectorWidth::kBaseline, VectorWidth::k256}) {
    vector_width_limit = width;
    EXPECT_EQ(Product(system, x), widest);
  }
  vector_width_limit = VectorWidth::k512;
}

TEST_F(ClosureSystemTest, TheProductIsThatOfTheCurlsAroundTheRegularSquares) {
  const ClosureSystem system = System();
  const NodeSlots& slots = system.slots();
  const std::vector<float> x = RandomNumbers(slots), product = Product(system, x);
  Increments increments(grid_.count()), curls(grid_.count());
  for (int64_t i = 0; i < grid_.count(); ++i) {
    for (int d = 0; d < 3; ++d) {
      for (int a = 0; a < 3; ++a) {
        increments[i][d][a] = x[ClosureSystem::Place(slots.SlotOf(i), d, a)];
      }
    }
  }
  for (int64_t i = 0; i < grid_.count(); ++i) {
    for (int d = 0; d < 3; ++d) {
      if (!IsRegularSquare(grid_.fine(), codes_, i, d)) continue;
      curls[i][d] = CurlAround(grid_.fine(), codes_, increments, i, d);
    }
  }
  const LatticeSettings settings;
  for (int64_t i = 0; i < grid_.count(); ++i) {
    for (int d = 0; d < 3; ++d) {
      const Vec3f adjoint = system.Adjoint(curls, i, d);
      for (int a = 0; a < 3; ++a) {
        const double own = Follows(follows_, i, d, a) ? settings.hull_edge_weight : 1;
        const double expected =
            own * increments[i][d][a] + settings.closure_weight * static_cast<double>(adjoint[a]);
        EXPECT_NEAR(product[ClosureSystem::Place(slots.SlotOf(i), d, a)], expected, 0.01);
      }
    }
  }
}

TEST_F(ClosureSystemTest, SlotsWithoutANodeStayZero) {
  const ClosureSystem system = System();
  const std::vector<float> product = Product(system, RandomNumbers(system.slots()));
  for (int64_t slot = 0; slot < system.slots().count(); ++slot) {
    if (system.slots().NodeOf(slot) >= 0) continue;
    for (int k = 0; k < kUnknowns; ++k) EXPECT_EQ(product[PlaceInCube(slot, kUnknowns, k)], 0);
  }
}

}  // namespace
}  // namespace amhex::fields
