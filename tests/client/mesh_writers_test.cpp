// The formats that are written only; other software reads them in tests/formats.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "cli/progress_events.h"
#include "cli/report.h"
#include "formats/boundary_surface.h"
#include "formats/mesh_file.h"
#include "page/report_data.h"
#include "page/report_page.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(MeshFormats, AreChosenByExtensionInAnyCase) {
  EXPECT_EQ(MeshFormatOfPath("a/b.VTU"), MeshFormat::kVtu);
  EXPECT_EQ(MeshFormatOfPath("b.msh"), MeshFormat::kGmsh);
  EXPECT_EQ(MeshFormatOfPath("case/constant/polyMesh"), MeshFormat::kFoam);
  EXPECT_EQ(MeshFormatOfPath("polyMesh.d/part"), std::nullopt);
  EXPECT_EQ(MeshFormatOfPath("noextension"), std::nullopt);
  EXPECT_TRUE(IsWritableMeshPath("hull.stl"));
  EXPECT_FALSE(IsWritableMeshPath("hull.step"));
  EXPECT_FALSE(IsWritableMeshPath("cloud.xyz"));
}

TEST(MeshFormats, WithoutAWordForHexprismsAndSlicesRefuseThem) {
  const MeshDocument document{OneOfEach(), {}};
  for (const auto& status : {FormatGmsh(document).status(), FormatAbaqus(document).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(status.message()), HasSubstr("1 hexprisms and 1 slices"));
  }
  EXPECT_THAT(std::string(FormatFoam(document).status().message()), HasSubstr("1 slices"));
}

TEST(Foam, OrdersFacesByOwnerThenNeighbour) {
  const auto files = FormatFoam({Block(3, 2), {}});
  ASSERT_TRUE(files.ok()) << files.status();
  const auto numbers = [&](size_t file) {
    const std::string& text = (*files)[file].content;
    std::istringstream in(text.substr(text.find("\n(\n") + 3));
    std::vector<int> list;
    for (int number = 0; in >> number;) list.push_back(number);
    return list;
  };
  const std::vector<int> owner = numbers(2), neighbour = numbers(3);
  ASSERT_GT(owner.size(), neighbour.size());
  for (size_t i = 0; i < neighbour.size(); ++i) {
    EXPECT_LT(owner[i], neighbour[i]);
    if (i == 0) continue;
    EXPECT_LT(std::pair(owner[i - 1], neighbour[i - 1]), std::pair(owner[i], neighbour[i]));
  }
  EXPECT_TRUE(std::is_sorted(owner.begin() + static_cast<long>(neighbour.size()), owner.end()));
}

TEST(BoundarySurface, OfABlockIsItsSixSides) {
  const auto surface = BoundarySurface(Block(4, 0));
  ASSERT_TRUE(surface.ok()) << surface.status();
  EXPECT_EQ(surface->faces.size(), 6u * 16u);
  EXPECT_EQ(surface->vertices.size(), 5u * 5 * 5 - 3 * 3 * 3);
  const TriangleMesh triangles = Triangulated(*surface);
  double volume = 0;
  for (const auto& t : triangles.triangles) {
    volume +=
        Determinant(triangles.vertices[t[0]], triangles.vertices[t[1]], triangles.vertices[t[2]]) /
        6;
  }
  EXPECT_NEAR(volume, 1, 1e-12) << "outward, and closed";
}

TEST(ReportData, LayersCountFromTheHull) {
  const auto neighbours = NeighboursOf(Block(5, 0));
  ASSERT_TRUE(neighbours.ok()) << neighbours.status();
  const std::vector<uint16_t> layers = LayersOf(*neighbours);
  for (int k = 0; k < 5; ++k) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 5; ++i) {
        const int depth = std::min({i, j, k, 4 - i, 4 - j, 4 - k});
        EXPECT_EQ(layers[static_cast<size_t>((k * 5 + j) * 5 + i)], depth);
      }
    }
  }
}

TEST(ReportData, NeighboursAreMutualAndFollowTheSides) {
  const AtMostHexaMesh mesh = Block(3, 2);
  const auto neighbours = NeighboursOf(mesh);
  ASSERT_TRUE(neighbours.ok()) << neighbours.status();
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    const FaceList faces = FacesOfCell(mesh.corners[cell]);
    int there = 0;
    for (int32_t other : (*neighbours)[cell]) {
      if (other != kVanished) ++there;
      if (other < 0) continue;
      const CellNeighbours& back = (*neighbours)[static_cast<size_t>(other)];
      EXPECT_THAT(back, ::testing::Contains(static_cast<int32_t>(cell)));
    }
    EXPECT_EQ(there, faces.count);
  }
}

TEST(ReportData, EdgesOfABlockAreCountedOnce) {
  const EdgeLengths lengths = EdgeLengthsOf(Block(4, 0));
  EXPECT_EQ(lengths.count, 3 * 4 * 5 * 5);
  EXPECT_DOUBLE_EQ(lengths.least, 0.25);
  EXPECT_DOUBLE_EQ(lengths.most, 0.25);
  EXPECT_EQ(EdgeLengthsOf(AtMostHexaMesh()).count, 0);
}

TEST(ReportPage, CannotBeBrokenByTexts) {
  const auto page = FormatReportPage(
      {OneOfEach(), {{"warnings", std::string("</script><script>alert(1)</script> @TITLE@")}}},
      "</title> & \"quotes\"");
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_THAT(*page, Not(HasSubstr("alert(1)</script>")));
  EXPECT_THAT(*page, HasSubstr("\\u003c/script>\\u003cscript>alert(1)"));
  EXPECT_THAT(*page, HasSubstr("<title>&lt;/title&gt; &amp; \"quotes\"</title>"));
  EXPECT_THAT(*page, HasSubstr("@TITLE@\"]"));
}

TEST(Vtu, GivesBackListsOfNumbers) {
  const std::vector<double> movements = {0.5, 0.25, 0.125};
  const auto read = ReadVtu(FormatVtu({OneOfEach(), {{"convergence.movement", movements}}}));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->facts.size(), 1u);
  EXPECT_EQ(NumbersOf(read->facts[0]), movements);
  EXPECT_EQ(TextOf(read->facts[0]), "3 numbers");
}

amhex::v1::WatchJobResponse RelaxFrame(int iteration, double movement) {
  amhex::v1::WatchJobResponse frame;
  frame.mutable_progress()->set_stage(amhex::v1::STAGE_RELAX);
  frame.mutable_progress()->set_iteration(iteration);
  frame.mutable_progress()->set_mean_movement(movement);
  return frame;
}

TEST(ConvergenceRecord, BeginsAnewWithEveryAttempt) {
  ConvergenceRecord record;
  EXPECT_TRUE(record.Facts().empty());
  for (int iteration : {1, 2, 2, 5, 1, 3}) record.OnFrame(RelaxFrame(iteration, 1.0 / iteration));
  const std::vector<MeshFact> facts = record.Facts();
  ASSERT_EQ(facts.size(), 2u);
  EXPECT_THAT(NumbersOf(facts[0]), ElementsAre(1, 3));
  EXPECT_THAT(NumbersOf(facts[1]), ElementsAre(1, 1.0 / 3));
}

TEST(ProgressEvents, AreOneLineEach) {
  for (const std::string& event :
       {MessageEvent("two\nlines \"quoted\""), TransferEvent("uploading", 5, 10),
        ConnectionEvent(absl::UnavailableError("gone")), FrameEvent(RelaxFrame(3, 0.1)),
        EndEvent(3, "{\n  \"a\": 1\n}\n")}) {
    EXPECT_THAT(event, Not(HasSubstr("\n")));
    EXPECT_EQ(event.front(), '{');
    EXPECT_EQ(event.back(), '}');
  }
  EXPECT_THAT(MessageEvent("two\nlines"), HasSubstr("two\\nlines"));
  EXPECT_EQ(EndEvent(3, ""), "{\"event\": \"end\", \"exit_status\": 3}");
}

}  // namespace
}  // namespace amhex::client
