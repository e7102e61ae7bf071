#include "topology/primitive_search.h"

#include "topology/parallel_blocks.h"
#include "topology/primitive_catalog.h"
#include "topology/primitive_programs.h"

namespace amhex {
namespace {

constexpr int64_t kFacesPerBlock = 256;

}  // namespace

absl::Status FindPrimitives(const FaceComplex& complex, PrimitiveType type,
                            const RunContext& context, std::vector<FoundPrimitive>* found) {
  const PrimitiveGrowth growth{complex.view(), ProgramOf(type), ShapeOf(type)};
  return CollectFromBlocks(complex.face_count(), kFacesPerBlock, context, found,
                           [&](int64_t begin, int64_t end, std::vector<FoundPrimitive>* list) {
                             for (int64_t f = begin; f < end && !context.ShouldStop(); ++f) {
                               growth.VisitItems(f, [list](const FoundPrimitive& primitive) {
                                 list->push_back(primitive);
                               });
                             }
                           });
}

CellCorners MirrorCorners(PrimitiveType type, const CellCorners& corners) {
  return Mirrored(ShapeOf(type), corners);
}

}  // namespace amhex
