// OpenFOAM's polyMesh, ascii.
#include <algorithm>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cells/boundary.h"
#include "cells/cells.h"
#include "formats/mesh_file.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

struct InnerFace {
  Face face;  // outward of `owner`
  int32_t owner = 0, neighbour = -1;
};

struct FoamFaces {
  std::vector<InnerFace> inner;
  std::vector<BoundaryFace> hull;
};

// OpenFOAM's order: inner faces by owner, those of one owner by neighbour; then the hull's. The
// cell of smaller number owns a face.
absl::StatusOr<FoamFaces> CollectFaces(const AtMostHexaMesh& mesh) {
  FoamFaces faces;
  AMHEX_ASSIGN_OR_RETURN(faces.hull, BoundaryOf(mesh, {}));
  absl::flat_hash_map<std::array<int32_t, 4>, int32_t> numbers;
  numbers.reserve(4 * mesh.corners.size());
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    for (const Face& face : FacesOfCell(mesh.corners[cell])) {
      std::array<int32_t, 4> key = face.vertex;
      std::sort(key.begin(), key.end());
      const auto [entry, is_new] =
          numbers.try_emplace(key, static_cast<int32_t>(faces.inner.size()));
      if (is_new) {
        faces.inner.push_back({face, static_cast<int32_t>(cell), -1});
      } else {
        faces.inner[entry->second].neighbour = static_cast<int32_t>(cell);
      }
    }
  }
  std::erase_if(faces.inner, [](const InnerFace& face) { return face.neighbour < 0; });
  std::sort(faces.inner.begin(), faces.inner.end(), [](const InnerFace& a, const InnerFace& b) {
    return a.owner != b.owner ? a.owner < b.owner : a.neighbour < b.neighbour;
  });
  return faces;
}

std::string Header(const std::string& kind, const std::string& object, const std::string& note) {
  return absl::StrCat("FoamFile\n{\n    version 2.0;\n    format ascii;\n    class ", kind, ";\n",
                      note.empty() ? "" : absl::StrCat("    note \"", note, "\";\n"),
                      "    location \"constant/polyMesh\";\n    object ", object, ";\n}\n\n");
}

void AppendFace(const Face& face, std::string* text) {
  absl::StrAppend(text, face.count, "(");
  for (int i = 0; i < face.count; ++i) absl::StrAppend(text, i == 0 ? "" : " ", face.vertex[i]);
  *text += ")\n";
}

std::string FoamPoints(const AtMostHexaMesh& mesh) {
  std::string text =
      absl::StrCat(Header("vectorField", "points", ""), mesh.vertices.size(), "\n(\n");
  for (const Vec3d& v : mesh.vertices) {
    absl::StrAppendFormat(&text, "(%.17g %.17g %.17g)\n", v.x, v.y, v.z);
  }
  return text + ")\n";
}

}  // namespace

absl::StatusOr<std::vector<FoamFile>> FormatFoam(const MeshDocument& document) {
  const AtMostHexaMesh& mesh = document.mesh;
  const auto slices = std::count(mesh.types.begin(), mesh.types.end(), PrimitiveType::kSlice);
  if (slices > 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "polyMesh does not permit two faces of a cell to share two edges, as those of the mesh's ",
        slices, " slices do; --solver-ready divides them"));
  }
  AMHEX_ASSIGN_OR_RETURN(const FoamFaces faces, CollectFaces(mesh));
  const size_t inner = faces.inner.size(), all = inner + faces.hull.size();
  const std::string note =
      absl::StrCat("nPoints:", mesh.vertices.size(), " nCells:", mesh.corners.size(),
                   " nFaces:", all, " nInternalFaces:", inner);
  std::string face_text = absl::StrCat(Header("faceList", "faces", ""), all, "\n(\n");
  std::string owner = absl::StrCat(Header("labelList", "owner", note), all, "\n(\n");
  std::string neighbour = absl::StrCat(Header("labelList", "neighbour", note), inner, "\n(\n");
  for (const InnerFace& face : faces.inner) {
    AppendFace(face.face, &face_text);
    absl::StrAppend(&owner, face.owner, "\n");
    absl::StrAppend(&neighbour, face.neighbour, "\n");
  }
  for (const BoundaryFace& face : faces.hull) {
    AppendFace(face.face, &face_text);
    absl::StrAppend(&owner, face.cell, "\n");
  }
  const std::string boundary =
      absl::StrCat(Header("polyBoundaryMesh", "boundary", ""), "1\n(\n    hull\n    {\n",
                   "        type patch;\n        nFaces ", faces.hull.size(),
                   ";\n        startFace ", inner, ";\n    }\n)\n");
  return std::vector<FoamFile>{{"points", FoamPoints(mesh)},
                               {"faces", face_text + ")\n"},
                               {"owner", owner + ")\n"},
                               {"neighbour", neighbour + ")\n"},
                               {"boundary", boundary}};
}

}  // namespace amhex::client
