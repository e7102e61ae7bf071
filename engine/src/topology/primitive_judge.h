// Which of the found primitives are good; usable where bodies run. Section 5.2, II.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "optimize/pattern_quality.h"
#include "topology/primitive_growth.h"
#include "topology/primitive_table.h"
#include "topology/trilinear_volume.h"

namespace amhex {

struct PrimitiveJudge {
  ArrayView<const Vec3d> vertices;
  ArrayView<const CellPattern> pattern;  // one: of the shape that is judged
  double min_quality = 0;

  // Turns the found primitive the right way round; false if it is not good enough either way.
  AMHEX_HD bool Judge(const PrimitiveShape& shape, const FoundPrimitive& found,
                      Primitive& primitive) const {
    primitive.type = found.type;
    primitive.corners = found.corners;
    if (TrilinearVolume(PositionsOf(found.corners)) < 0) {
      primitive.corners = Mirrored(shape, found.corners);
    }
    primitive.quality = QualityOf(pattern[0], PositionsOf(primitive.corners));
    return primitive.quality > min_quality;
  }

 private:
  AMHEX_HD CellPositions PositionsOf(const CellCorners& corners) const {
    CellPositions positions;
    for (int slot = 0; slot < 8; ++slot) positions[slot] = vertices[corners[slot]];
    return positions;
  }
};

// One element per starting face.
struct GoodPrimitiveSearch {
  using Item = Primitive;
  PrimitiveGrowth growth;
  PrimitiveJudge judge;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t start, const Visit& visit) const {
    growth.VisitItems(start, [&](const FoundPrimitive& found) {
      Primitive primitive;
      if (judge.Judge(growth.shape, found, primitive)) visit(primitive);
    });
  }
};

}  // namespace amhex
