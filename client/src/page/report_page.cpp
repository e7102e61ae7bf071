#include "page/report_page.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <map>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "cells/cells.h"
#include "formats/status_macros.h"
#include "page/page_assets.h"
#include "page/report_data.h"

namespace amhex::client {
namespace {

// A JSON string that may stand inside a script element.
std::string Quote(std::string_view text) {
  std::string quoted = "\"";
  for (unsigned char c : text) {
    if (c < 0x20 || c == '"' || c == '\\' || c == '<' || c == '&' || c == 0x7f) {
      absl::StrAppendFormat(&quoted, "\\u%04x", c);
    } else {
      quoted += static_cast<char>(c);
    }
  }
  return quoted + "\"";
}

std::string Number(double value) { return absl::StrFormat("%.9g", value); }

template <class List, class Format>
std::string JsonList(const List& list, const Format& format) {
  return absl::StrCat(
      "[",
      absl::StrJoin(list, ",", [&](std::string* out, const auto& entry) { *out += format(entry); }),
      "]");
}

class Facts {
 public:
  explicit Facts(const std::vector<MeshFact>& facts) : facts_(facts) {}

  const MeshFact* Find(const std::string& name) const {
    const auto found = std::find_if(facts_.begin(), facts_.end(),
                                    [&](const MeshFact& fact) { return fact.name == name; });
    return found == facts_.end() ? nullptr : &*found;
  }

  std::vector<double> Numbers(const std::string& name) const {
    const MeshFact* fact = Find(name);
    return fact == nullptr ? std::vector<double>() : NumbersOf(*fact);
  }

  double NumberOr(const std::string& name, double otherwise) const {
    const std::vector<double> numbers = Numbers(name);
    return numbers.empty() ? otherwise : numbers.front();
  }

  // [[name without prefix, text], ...]
  std::string Table(const std::string& prefix) const {
    std::vector<std::string> rows;
    for (const MeshFact& fact : facts_) {
      if (!absl::StartsWith(fact.name, prefix) || TextOf(fact).empty()) continue;
      const std::string name =
          absl::StrReplaceAll(fact.name.substr(prefix.size()), {{"_", " "}, {".", ": "}});
      rows.push_back(absl::StrCat("[", Quote(name), ",", Quote(TextOf(fact)), "]"));
    }
    return absl::StrCat("[", absl::StrJoin(rows, ","), "]");
  }

  std::string Timings() const {
    constexpr absl::string_view kPrefix = "timings.";
    std::vector<std::string> rows;
    for (const MeshFact& fact : facts_) {
      if (!absl::StartsWith(fact.name, kPrefix)) continue;
      const std::string name = absl::StrReplaceAll(fact.name.substr(kPrefix.size()), {{"_", " "}});
      const std::vector<double> seconds = NumbersOf(fact);
      if (!seconds.empty()) {
        rows.push_back(absl::StrCat("[", Quote(name), ",", Number(seconds.front()), "]"));
      }
    }
    return absl::StrCat("[", absl::StrJoin(rows, ","), "]");
  }

 private:
  const std::vector<MeshFact>& facts_;
};

std::string Types(const AtMostHexaMesh& mesh) {
  return JsonList(kPrimitiveTypes, [&](PrimitiveType type) {
    const auto count = std::count(mesh.types.begin(), mesh.types.end(), type);
    return absl::StrCat("{\"type\":", static_cast<int>(type),
                        ",\"name\":", Quote(PrimitiveName(type)), ",\"count\":", count, "}");
  });
}

std::string Edges(const AtMostHexaMesh& mesh, const Facts& facts) {
  const EdgeLengths lengths = EdgeLengthsOf(mesh);
  return absl::StrCat("{\"count\":", lengths.count, ",\"least\":", Number(lengths.least),
                      ",\"mean\":", Number(lengths.mean), ",\"most\":", Number(lengths.most),
                      ",\"wanted\":", Number(facts.NumberOr("statistics.edge_length", 0)),
                      ",\"binsEnd\":", Number(EdgeLengths::kBinsEnd), ",\"bins\":[",
                      absl::StrJoin(lengths.bins, ","), "]}");
}

std::string Distances(const Facts& facts) {
  constexpr std::array<std::pair<const char*, const char*>, 3> kDistances = {
      {{"statistics.mesh_to_input_max", "mesh to input, most"},
       {"statistics.input_to_mesh_max", "input to mesh, most"},
       {"statistics.input_to_mesh_mean", "input to mesh, mean"}}};
  std::vector<std::string> rows;
  for (const auto& [name, words] : kDistances) {
    const std::vector<double> distance = facts.Numbers(name);
    if (distance.empty()) continue;
    rows.push_back(absl::StrCat("[", Quote(words), ",", Number(distance.front()), "]"));
  }
  return absl::StrCat("[", absl::StrJoin(rows, ","), "]");
}

std::string Convergence(const Facts& facts) {
  const std::vector<double> iterations = facts.Numbers("convergence.iteration");
  const std::vector<double> movements = facts.Numbers("convergence.movement");
  const char* note = "The file does not say how the relaxation went.";
  const double wanted = facts.NumberOr("parameters.relaxation.iteration_count", 1);
  const MeshFact* start = facts.Find("parameters.relaxation.initialization");
  // Below 0: as many as the start needs, and sites from the fields need none.
  if (wanted == 0 || (wanted < 0 && start != nullptr && TextOf(*start) == "field")) {
    note = "There were no iterations: the sites stayed where the start had put them.";
  }
  return absl::StrCat("{\"iterations\":", JsonList(iterations, Number),
                      ",\"movements\":", JsonList(movements, Number), ",\"note\":", Quote(note),
                      "}");
}

std::string Summary(const AtMostHexaMesh& mesh) {
  double least = 1, sum = 0;
  for (float quality : mesh.quality) {
    least = std::min<double>(least, quality);
    sum += quality;
  }
  const auto cells = static_cast<double>(mesh.corners.size());
  const auto hexahedra =
      std::count(mesh.types.begin(), mesh.types.end(), PrimitiveType::kHexahedron);
  return absl::StrFormat(
      "%d cells, %d vertices; %.1f %% hexahedra; scaled Jacobian at least %.3f, on average %.3f",
      mesh.corners.size(), mesh.vertices.size(), 100.0 * static_cast<double>(hexahedra) / cells,
      least, sum / cells);
}

struct Frame {
  Vec3d centre;
  int shortest_side = 1;
};

Frame FrameOf(const AtMostHexaMesh& mesh) {
  Box3d box;
  for (const Vec3d& v : mesh.vertices) box.Extend(v);
  Frame frame{(box.low + box.high) / 2.0, 1};
  // The front is favoured where sides are nearly equal, as in pictures.
  constexpr double kFavour = 0.97;
  for (int axis : {0, 2}) {
    if (box.Extent()[axis] < kFavour * box.Extent()[frame.shortest_side]) {
      frame.shortest_side = axis;
    }
  }
  return frame;
}

std::string FactsJson(const MeshDocument& document, const Frame& frame, const std::string& title) {
  const AtMostHexaMesh& mesh = document.mesh;
  const Facts facts(document.facts);
  return absl::StrCat(
      "{\"title\":", Quote(title), ",\"summary\":", Quote(Summary(mesh)),
      ",\"vertexCount\":", mesh.vertices.size(), ",\"cellCount\":", mesh.corners.size(),
      ",\"centre\":[", Number(frame.centre.x), ",", Number(frame.centre.y), ",",
      Number(frame.centre.z), "],\"firstCut\":", frame.shortest_side, ",\"types\":", Types(mesh),
      ",\"hasDistances\":", document.distances.empty() ? "false" : "true",
      ",\"edges\":", Edges(mesh, facts), ",\"timings\":", facts.Timings(),
      ",\"distance\":", Distances(facts), ",\"convergence\":", Convergence(facts),
      ",\"tables\":[[\"Statistics\",", facts.Table("statistics."), "],[\"Parameters\",",
      facts.Table("parameters."), "],[\"For solvers\",", facts.Table("solver_ready."),
      "],[\"Engine\",", facts.Table("engine_"), "],[\"Backend\",", facts.Table("backend_"),
      "],[\"Warnings\",", facts.Table("warnings"), "]]}");
}

template <class T>
void AppendArray(const std::vector<T>& array, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(array.data()), array.size() * sizeof(T));
}

// In the order in which report_page.js takes them out; wider numbers first, so that each array
// begins at a multiple of its number's size.
absl::StatusOr<std::string> Arrays(const MeshDocument& document, const Vec3d& centre) {
  const AtMostHexaMesh& mesh = document.mesh;
  AMHEX_ASSIGN_OR_RETURN(const std::vector<CellNeighbours> neighbours, NeighboursOf(mesh));
  std::vector<Vec3f> vertices;
  for (const Vec3d& v : mesh.vertices) {
    const Vec3d moved = v - centre;
    vertices.push_back(
        {static_cast<float>(moved.x), static_cast<float>(moved.y), static_cast<float>(moved.z)});
  }
  std::string bytes;
  AppendArray(vertices, &bytes);
  AppendArray(mesh.quality, &bytes);
  AppendArray(document.distances, &bytes);
  AppendArray(mesh.corners, &bytes);
  AppendArray(neighbours, &bytes);
  AppendArray(LayersOf(neighbours), &bytes);
  AppendArray(mesh.types, &bytes);
  uLongf length = compressBound(bytes.size());
  std::string packed(length, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &length,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(),
                Z_DEFAULT_COMPRESSION) != Z_OK) {
    return absl::InternalError("zlib failed");
  }
  packed.resize(length);
  return absl::Base64Escape(packed);
}

// Replaces @NAME@ by its text; what is put in is not searched again.
std::string Fill(std::string_view form, const std::map<std::string_view, std::string_view>& texts) {
  std::string page;
  for (size_t at = 0; at < form.size();) {
    const size_t begin = form.find('@', at);
    const size_t end = begin == form.npos ? form.npos : form.find('@', begin + 1);
    const auto text =
        end == form.npos ? texts.end() : texts.find(form.substr(begin + 1, end - begin - 1));
    if (text == texts.end()) {
      const size_t stop = begin == form.npos ? form.size() : begin + 1;
      page += form.substr(at, stop - at);
      at = stop;
    } else {
      page += form.substr(at, begin - at);
      page += text->second;
      at = end + 1;
    }
  }
  return page;
}

}  // namespace

absl::StatusOr<std::string> FormatReportPage(const MeshDocument& document,
                                             const std::string& title) {
  const Frame frame = FrameOf(document.mesh);
  AMHEX_ASSIGN_OR_RETURN(const std::string arrays, Arrays(document, frame.centre));
  const std::string facts = FactsJson(document, frame, title);
  const std::string escaped_title =
      absl::StrReplaceAll(title, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}});
  const PageAssets assets = ReportAssets();
  return Fill(assets.html, {{"TITLE", escaped_title},
                            {"STYLE", assets.style},
                            {"THREE", assets.three},
                            {"CONTROLS", assets.controls},
                            {"FACTS", facts},
                            {"ARRAYS", arrays},
                            {"CHARTS", assets.charts},
                            {"FACES", assets.faces},
                            {"VIEWER", assets.viewer},
                            {"PAGE", assets.page}});
}

}  // namespace amhex::client
