#include "fuzz/fuzz_inputs.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "amhex/mesher.h"
#include "input/guidance_checks.h"
#include "input/hull_checks.h"
#include "reassembly/break_down.h"
#include "support/mesh_invariants.h"

namespace amhex::fuzz {
namespace {

constexpr int kMostPoints = 24;
constexpr int kMostTriangles = 48;
constexpr int kMostCells = 12;
// Hundreds of soups a minute find more than fewer larger ones. Of most of them come more cells, for
// few cells fit their corners; those that take seconds nevertheless end with the deadline.
constexpr int64_t kCells = 12;
constexpr auto kPatience = std::chrono::seconds(4);

[[noreturn]] void Fail(const std::string& what) {
  std::fprintf(stderr, "promise broken: %s\n", what.c_str());
  std::abort();
}

void ExpectReasonable(const absl::Status& status) {
  if (status.ok()) return;
  if (status.message().empty()) Fail("an error without a message");
  // Of a soup that hardly bounds a cell the engine may say that it found no mesh.
  const std::string message(status.message());
  const bool found_none = message.find("no valid mesh was found") != std::string::npos;
  if (absl::IsInternal(status) && found_none) return;
  if (absl::IsInternal(status) || absl::IsUnknown(status)) Fail(message);
}

std::vector<Vec3d> Points(ByteSource* bytes, int most) {
  std::vector<Vec3d> points(static_cast<size_t>(bytes->Below(most + 1)));
  for (Vec3d& p : points) p = {bytes->Number(), bytes->Number(), bytes->Number()};
  return points;
}

}  // namespace

double ByteSource::Number() {
  const uint8_t first = Byte();
  if (first < 240) return (first % 16 - 8) / 4.0;
  uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) bits = bits << 8 | Byte();
  double number = 0;
  std::memcpy(&number, &bits, sizeof(number));
  return number;
}

MeshingInput AnyInput(ByteSource* bytes) {
  MeshingInput input;
  const int kind = bytes->Below(3);
  std::vector<Vec3d> points = Points(bytes, kMostPoints);
  const auto index = [&] { return bytes->Byte() % (kMostPoints + 3) - 1; };
  if (kind == 0) {
    TriangleMesh mesh{points, {}};
    for (int i = bytes->Below(kMostTriangles); i > 0; --i) {
      mesh.triangles.push_back({index(), index(), index()});
    }
    input.hull = mesh;
  } else if (kind == 1) {
    input.hull = PointCloud{points, Points(bytes, kMostPoints)};
  } else {
    VolumeMesh volume;
    volume.vertices = points;
    for (int i = bytes->Below(kMostCells); i > 0; --i) volume.cell_faces.push_back(index());
    for (int i = bytes->Below(kMostTriangles); i > 0; --i) volume.face_corners.push_back(index());
    for (int i = bytes->Byte(); i > 0; --i) volume.corners.push_back(index());
    input.hull = volume;
  }
  for (int i = bytes->Below(3); i > 0; --i) {
    const auto vector = [&] { return Vec3d{bytes->Number(), bytes->Number(), bytes->Number()}; };
    input.guidance.samples.push_back({vector(), vector(), vector()});
    input.guidance.planes.push_back({vector(), vector()});
  }
  return input;
}

TriangleMesh SmallSoup(ByteSource* bytes) {
  TriangleMesh soup{Points(bytes, kMostPoints), {}};
  const auto count = static_cast<int>(soup.vertices.size());
  for (int i = bytes->Below(kMostTriangles + 1); i > 0 && count > 0; --i) {
    soup.triangles.push_back({bytes->Below(count), bytes->Below(count), bytes->Below(count)});
  }
  return soup;
}

void CheckAnyInput(const uint8_t* data, size_t size) {
  ByteSource bytes(data, size);
  const MeshingInput input = AnyInput(&bytes);
  const absl::Status verdict = CheckInput(input.hull);
  ExpectReasonable(verdict);
  ExpectReasonable(CheckGuidance(input.guidance, {}));
  ExpectReasonable(EstimateCost(input.hull, {}).status());
  if (const auto* volume = std::get_if<VolumeMesh>(&input.hull); volume && verdict.ok()) {
    RunContext run;
    ExpectReasonable(BreakDown(*volume, run).status());
  }
}

void MeshSmallSoup(const uint8_t* data, size_t size) {
  ByteSource bytes(data, size);
  const TriangleMesh soup = SmallSoup(&bytes);
  MeshingParams params;
  params.sizing.cell_count = kCells;
  // More do the same again, and a solid this small would have twelve.
  params.sizing.trial_count = 1;
  params.run.thread_count = 1;
  params.run.backend = Backend::kCpu;
  RunContext run;
  run.SetDeadline(RunContext::Clock::now() + kPatience);
  const absl::StatusOr<MeshingResult> result = Mesh(InputHull(soup), params, run);
  ExpectReasonable(result.status());
  if (!result.ok()) return;
  const std::vector<std::string> broken = testing_support::BrokenLaws(result->mesh);
  if (!broken.empty()) Fail(broken.front());
}

}  // namespace amhex::fuzz
