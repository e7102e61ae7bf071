#include "topology/search_primitives.h"

#include <optional>

#include "base/status_macros.h"
#include "optimize/cell_quality.h"
#include "topology/parallel_blocks.h"
#include "topology/primitive_search.h"

namespace amhex {
namespace {

constexpr int64_t kPrimitivesPerBlock = 4096;

// The found primitive the right way round, or nullopt if it is not good enough either way.
std::optional<Primitive> Judge(const FoundPrimitive& found, const std::vector<Vec3d>& vertices,
                               double min_quality) {
  Primitive primitive;
  primitive.type = found.type;
  primitive.corners = found.corners;
  if (CellVolume(found.corners, vertices) < 0) {
    primitive.corners = MirrorCorners(found.type, found.corners);
  }
  primitive.quality = CellQuality(primitive.corners, vertices);
  if (!(primitive.quality > min_quality)) return std::nullopt;
  return primitive;
}

}  // namespace

absl::StatusOr<std::vector<Primitive>> SearchPrimitives(const FaceComplex& complex,
                                                        const std::vector<Vec3d>& vertices,
                                                        double min_quality, RunContext& context) {
  std::vector<Primitive> primitives;
  Progress progress = context.progress();
  for (size_t i = 0; i < kPrimitiveTypes.size(); ++i) {
    std::vector<FoundPrimitive> found;
    AMHEX_RETURN_IF_ERROR(FindPrimitives(complex, kPrimitiveTypes[i], context, &found));
    const auto judge = [&](int64_t begin, int64_t end, std::vector<Primitive>* good) {
      for (int64_t j = begin; j < end; ++j) {
        if (auto primitive = Judge(found[j], vertices, min_quality)) good->push_back(*primitive);
      }
    };
    AMHEX_RETURN_IF_ERROR(CollectFromBlocks(static_cast<int64_t>(found.size()), kPrimitivesPerBlock,
                                            context, &primitives, judge));
    progress.stage_fraction = double(i + 1) / kPrimitiveTypes.size();
    context.Report(progress);
  }
  return primitives;
}

}  // namespace amhex
