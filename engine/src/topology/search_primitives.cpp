#include "topology/search_primitives.h"

#include <utility>

#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "topology/parallel_blocks.h"
#include "topology/primitive_search.h"
#include "topology/search_primitives_task.h"

namespace amhex {
namespace {

constexpr int64_t kPrimitivesPerBlock = 4096;
// On a device fewer faces cost more than they save (a guess, as in input/ask_hull.h: some forty
// copies and launches against ten microseconds per face).
constexpr int64_t kFewestForDevice = 1024;

std::vector<TypeSearch> AllTypes() {
  std::vector<TypeSearch> types;
  for (const PrimitiveType type : kPrimitiveTypes) {
    const PrimitiveShape& shape = ShapeOf(type);
    types.push_back({ProgramOf(type), shape, *FindCellPattern(shape.pattern)});
  }
  return types;
}

absl::StatusOr<std::vector<Primitive>> SearchOnCpu(const FaceComplex& complex,
                                                   const SearchPrimitivesTask& task,
                                                   RunContext& context) {
  std::vector<Primitive> primitives;
  Progress progress = context.progress();
  for (size_t i = 0; i < task.types.size(); ++i) {
    const TypeSearch& type = task.types[i];
    std::vector<FoundPrimitive> found;
    AMHEX_RETURN_IF_ERROR(FindPrimitives(complex, type.program.type, context, &found));
    const PrimitiveJudge judge{task.vertices, {&type.pattern, 1}, task.min_quality};
    AMHEX_RETURN_IF_ERROR(CollectFromBlocks(
        static_cast<int64_t>(found.size()), kPrimitivesPerBlock, context, &primitives,
        [&](int64_t begin, int64_t end, std::vector<Primitive>* good) {
          for (int64_t j = begin; j < end; ++j) {
            Primitive primitive;
            if (judge.Judge(type.shape, found[j], primitive)) good->push_back(primitive);
          }
        }));
    progress.stage_fraction = double(i + 1) / double(task.types.size());
    context.Report(progress);
  }
  return primitives;
}

}  // namespace

absl::StatusOr<std::vector<Primitive>> SearchPrimitives(const FaceComplex& complex,
                                                        const std::vector<Vec3d>& vertices,
                                                        double min_quality, RunContext& context,
                                                        DeviceUse* device) {
  SearchPrimitivesTask task{complex.view(),
                            {vertices.data(), static_cast<int64_t>(vertices.size())},
                            AllTypes(),
                            min_quality,
                            {},
                            [&context] { return context.ShouldStop(); }};
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    AMHEX_ASSIGN_OR_RETURN(task.primitives, SearchOnCpu(complex, task, context));
    return true;
  };
  DeviceUse* const where = complex.face_count() < kFewestForDevice ? nullptr : device;
  AMHEX_RETURN_IF_ERROR(RunWhereChosen(where, &task, on_cpu).status());
  AMHEX_RETURN_IF_ERROR(context.CheckStop());
  return std::move(task.primitives);
}

}  // namespace amhex
