// VTK's legacy unstructured grids, as volume meshes and as meshes with what is known about them.
#include <cstring>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "formats/byte_reader.h"
#include "formats/mesh_completion.h"
#include "formats/mesh_file.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"
#include "formats/volume_builder.h"
#include "formats/volume_reader.h"

namespace amhex::client {
namespace {

class VtkReader {
 public:
  explicit VtkReader(std::string_view bytes) : bytes_(bytes) {}

  absl::StatusOr<VolumeMesh> ReadVolume() {
    AMHEX_RETURN_IF_ERROR(ReadGrid());
    return std::move(builder_.mesh);
  }

  absl::StatusOr<MeshDocument> ReadDocument() {
    AMHEX_RETURN_IF_ERROR(ReadGrid());
    MeshDocument document;
    for (const Array& array : arrays_) document.facts.push_back(FactOf(array));
    AMHEX_ASSIGN_OR_RETURN(document.mesh, MeshOf(std::move(builder_)));
    arrays_.clear();
    AMHEX_RETURN_IF_ERROR(ReadCellData());
    // Cells of fewer dimensions have data as well, but are not cells of the mesh.
    if (types_.size() != document.mesh.corners.size()) return document;
    for (const Array& array : arrays_) {
      if (array.numbers.size() != types_.size()) continue;
      const std::vector<float> values(array.numbers.begin(), array.numbers.end());
      if (array.name == "scaled_jacobian") document.mesh.quality = values;
      if (array.name == "distance_to_input") document.distances = values;
    }
    return document;
  }

 private:
  struct Array {
    std::string name;
    bool is_text = false;
    std::vector<double> numbers;
  };

  static MeshFact FactOf(const Array& array) {
    if (array.is_text) return {array.name, TextOfCodes(array.numbers)};
    if (array.numbers.size() == 1) return {array.name, array.numbers.front()};
    return {array.name, array.numbers};
  }

  absl::Status ReadGrid() {
    AMHEX_RETURN_IF_ERROR(ReadHeader());
    while (position_ < bytes_.size() && !has_types_) {
      AMHEX_RETURN_IF_ERROR(ReadSection(NextWord()));
    }
    if (!has_types_) return absl::InvalidArgumentError("the file ends without CELL_TYPES");
    AMHEX_RETURN_IF_ERROR(BuildCells());
    if (builder_.mesh.cell_faces.empty()) {
      return absl::InvalidArgumentError("the file contains no volume cell");
    }
    return absl::OkStatus();
  }

  // What follows the types, as far as it is data of cells in the forms that are known here.
  absl::Status ReadCellData() {
    bool is_of_cells = false;
    while (position_ < bytes_.size()) {
      const std::string_view keyword = NextWord();
      if (keyword == "CELL_DATA") {
        is_of_cells = NextWord() == absl::StrCat(types_.size());
      } else if (is_of_cells && keyword == "SCALARS") {
        AMHEX_RETURN_IF_ERROR(ReadScalars());
      } else if (is_of_cells && keyword == "FIELD") {
        AMHEX_RETURN_IF_ERROR(ReadField());
      } else {
        return absl::OkStatus();
      }
    }
    return absl::OkStatus();
  }

  absl::Status ReadScalars() {
    Array array;
    array.name = std::string(NextWord());
    const std::string type(NextWord());
    AMHEX_ASSIGN_OR_RETURN(const int64_t components, NextComponents());
    if (NextWord() != "LOOKUP_TABLE" || NextWord().empty()) {
      return absl::InvalidArgumentError("the scalars " + Quoted(array.name) +
                                        " have no LOOKUP_TABLE");
    }
    const auto count = components * static_cast<int64_t>(types_.size());
    AMHEX_RETURN_IF_ERROR(ReadNumbers(type, count, &array.numbers));
    arrays_.push_back(std::move(array));
    return absl::OkStatus();
  }

  // Left out in some files: then there is one.
  absl::StatusOr<int64_t> NextComponents() {
    constexpr int64_t kMostComponents = 4;
    int64_t components = 1;
    const size_t end_of_type = position_;
    const std::string_view rest = NextLine();
    position_ = end_of_type;
    if (absl::StripAsciiWhitespace(absl::string_view(rest.data(), rest.size())).empty()) return 1;
    if (ParseInteger(NextWord(), &components) && components >= 1 && components <= kMostComponents) {
      return components;
    }
    return absl::InvalidArgumentError(
        absl::StrCat("scalars have 1 to ", kMostComponents, " components"));
  }

  absl::Status ReadHeader() {
    if (!NextLine().starts_with("# vtk DataFile Version")) {
      return absl::InvalidArgumentError("a legacy VTK file begins with # vtk DataFile Version");
    }
    NextLine();  // the title
    const std::string_view kind = NextWord();
    is_binary_ = kind == "BINARY";
    if (!is_binary_ && kind != "ASCII") {
      return absl::InvalidArgumentError("line 3 says " + Quoted(kind) + ", not ASCII or BINARY");
    }
    if (NextWord() != "DATASET" || NextWord() != "UNSTRUCTURED_GRID") {
      return absl::InvalidArgumentError("the VTK file holds no unstructured grid");
    }
    return absl::OkStatus();
  }

  absl::Status ReadSection(std::string_view keyword) {
    if (keyword.empty()) return absl::OkStatus();
    if (keyword == "POINTS") return ReadPoints();
    if (keyword == "CELLS") return ReadCells();
    if (keyword == "CELL_TYPES") return ReadTypes();
    if (keyword == "FIELD") return ReadField();
    if (keyword == "METADATA") {
      NextLine();
      while (position_ < bytes_.size() && !NextLine().empty()) {
      }
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError("unknown section " + Quoted(keyword));
  }

  absl::Status ReadPoints() {
    AMHEX_ASSIGN_OR_RETURN(const int64_t count, NextCount("points", 3));
    const std::string_view type = NextWord();
    std::vector<double> numbers;
    AMHEX_RETURN_IF_ERROR(ReadNumbers(type, 3 * count, &numbers));
    for (size_t i = 0; i + 2 < numbers.size(); i += 3) {
      builder_.mesh.vertices.push_back({numbers[i], numbers[i + 1], numbers[i + 2]});
    }
    return absl::OkStatus();
  }

  absl::Status ReadCells() {
    AMHEX_ASSIGN_OR_RETURN(const int64_t first, NextCount("cells", 1));
    AMHEX_ASSIGN_OR_RETURN(const int64_t second, NextCount("cell numbers", 1));
    const size_t before = position_;
    if (NextWord() == "OFFSETS") {  // version 5
      const std::string offset_type(NextWord());
      AMHEX_RETURN_IF_ERROR(ReadIntegers(offset_type, first, &offsets_));
      if (NextWord() != "CONNECTIVITY") {
        return absl::InvalidArgumentError("OFFSETS are not followed by CONNECTIVITY");
      }
      const std::string type(NextWord());
      return ReadIntegers(type, second, &connectivity_);
    }
    position_ = before;
    std::vector<int64_t> numbers;
    AMHEX_RETURN_IF_ERROR(ReadIntegers("int", second, &numbers));
    offsets_ = {0};
    for (size_t at = 0; at < numbers.size();) {
      const int64_t count = numbers[at++];
      if (count < 0 || count > static_cast<int64_t>(numbers.size() - at)) {
        return absl::InvalidArgumentError(absl::StrCat("cell ", offsets_.size() - 1, " promises ",
                                                       count, " numbers, which are not there"));
      }
      const auto begin = numbers.begin() + static_cast<std::ptrdiff_t>(at);
      connectivity_.insert(connectivity_.end(), begin, begin + count);
      offsets_.push_back(static_cast<int64_t>(connectivity_.size()));
      at += static_cast<size_t>(count);
    }
    return absl::OkStatus();
  }

  absl::Status ReadTypes() {
    AMHEX_ASSIGN_OR_RETURN(const int64_t count, NextCount("cell types", 1));
    has_types_ = true;
    return ReadIntegers("int", count, &types_);
  }

  absl::Status BuildCells() {
    if (offsets_.size() != types_.size() + 1) {
      return absl::InvalidArgumentError(absl::StrCat(
          "there are ", types_.size(), " cell types for ", offsets_.size(), " offsets of cells"));
    }
    const std::span<const int64_t> all(connectivity_);
    for (size_t i = 0; i < types_.size(); ++i) {
      const int64_t begin = offsets_[i], end = offsets_[i + 1];
      if (begin < 0 || end < begin || end > static_cast<int64_t>(all.size())) {
        return absl::InvalidArgumentError(absl::StrCat("the offset of cell ", i, " is wrong"));
      }
      const auto numbers =
          all.subspan(static_cast<size_t>(begin), static_cast<size_t>(end - begin));
      AMHEX_RETURN_IF_ERROR(types_[i] == kVtkPolyhedron ? builder_.AddPolyhedron(numbers)
                                                        : builder_.AddCell(types_[i], numbers));
    }
    return absl::OkStatus();
  }

  absl::Status ReadField() {
    NextWord();
    AMHEX_ASSIGN_OR_RETURN(const int64_t arrays, NextCount("field arrays", 1));
    for (int64_t i = 0; i < arrays; ++i) {
      Array array;
      array.name = std::string(NextWord());
      AMHEX_ASSIGN_OR_RETURN(const int64_t components, NextCount("components", 0));
      AMHEX_ASSIGN_OR_RETURN(const int64_t tuples, NextCount("tuples", 0));
      const std::string type(NextWord());
      if (components > 0 && tuples > static_cast<int64_t>(bytes_.size()) / components) {
        return absl::InvalidArgumentError("a field promises more numbers than the file has bytes");
      }
      array.is_text = type == "unsigned_char";
      AMHEX_RETURN_IF_ERROR(ReadNumbers(type, components * tuples, &array.numbers));
      arrays_.push_back(std::move(array));
    }
    return absl::OkStatus();
  }

  absl::Status ReadIntegers(std::string_view type, int64_t count, std::vector<int64_t>* integers) {
    std::vector<double> numbers;
    AMHEX_RETURN_IF_ERROR(ReadNumbers(type, count, &numbers));
    for (const double number : numbers) integers->push_back(static_cast<int64_t>(number));
    return absl::OkStatus();
  }

  // Every number that VTK files of meshes hold fits a double.
  absl::Status ReadNumbers(std::string_view type, int64_t count, std::vector<double>* numbers) {
    if (!is_binary_) return ReadAscii(count, numbers);
    if (position_ < bytes_.size()) ++position_;  // the line's end
    if (type == "double") return ReadBinary<double>(count, numbers);
    if (type == "float") return ReadBinary<float>(count, numbers);
    if (type == "int" || type == "vtktypeint32") return ReadBinary<int32_t>(count, numbers);
    if (type == "vtktypeint64" || type == "long") return ReadBinary<int64_t>(count, numbers);
    if (type == "unsigned_char") return ReadBinary<uint8_t>(count, numbers);
    return absl::InvalidArgumentError("numbers of type " + Quoted(type) + " are not read");
  }

  template <class T>
  absl::Status ReadBinary(int64_t count, std::vector<double>* numbers) {
    ByteReader reader(bytes_.substr(position_), std::endian::big);
    numbers->reserve(static_cast<size_t>(count));
    for (int64_t i = 0; i < count; ++i) {
      T value{};
      if (!reader.Read(&value)) return absl::InvalidArgumentError("the file is cut short");
      numbers->push_back(static_cast<double>(value));
    }
    position_ += reader.position();
    return absl::OkStatus();
  }

  absl::Status ReadAscii(int64_t count, std::vector<double>* numbers) {
    numbers->reserve(static_cast<size_t>(count));
    for (int64_t i = 0; i < count; ++i) {
      const std::string_view word = NextWord();
      double value = 0;
      if (!ParseDouble(word, &value)) {
        return absl::InvalidArgumentError(
            absl::StrCat("number ", i, " of ", count, " is ", Quoted(word)));
      }
      numbers->push_back(value);
    }
    return absl::OkStatus();
  }

  // A count of things that take at least `numbers_each` bytes each.
  absl::StatusOr<int64_t> NextCount(std::string_view what, int64_t numbers_each) {
    int64_t count = 0;
    const std::string_view word = NextWord();
    const auto left = static_cast<int64_t>(bytes_.size() - position_);
    if (!ParseInteger(word, &count) || count < 0 ||
        (numbers_each > 0 && count > left / numbers_each + 1)) {
      return absl::InvalidArgumentError(absl::StrCat("the number of ", std::string(what), " is ",
                                                     Quoted(word), ", but ", left,
                                                     " bytes follow"));
    }
    return count;
  }

  std::string_view NextLine() {
    const size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
    std::string_view line = bytes_.substr(position_, end - position_);
    position_ = std::min(end + 1, bytes_.size());
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    return line;
  }

  std::string_view NextWord() {
    while (position_ < bytes_.size() && absl::ascii_isspace(Byte(position_))) ++position_;
    const size_t begin = position_;
    while (position_ < bytes_.size() && !absl::ascii_isspace(Byte(position_))) ++position_;
    return bytes_.substr(begin, position_ - begin);
  }

  unsigned char Byte(size_t at) const { return static_cast<unsigned char>(bytes_[at]); }

  std::string_view bytes_;
  size_t position_ = 0;
  bool is_binary_ = false, has_types_ = false;
  std::vector<int64_t> offsets_, connectivity_, types_;
  std::vector<Array> arrays_;
  VolumeBuilder builder_;
};

}  // namespace

absl::StatusOr<VolumeMesh> ReadVtkVolume(std::string_view bytes) {
  return VtkReader(bytes).ReadVolume();
}

absl::StatusOr<MeshDocument> ReadVtk(std::string_view bytes) {
  return VtkReader(bytes).ReadDocument();
}

}  // namespace amhex::client
