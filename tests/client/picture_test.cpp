#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "picture/mesh_picture.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

// Share of pixels whose colour is `colour` dimmed by any light, i.e. of the same hue.
double ShareOf(const Image& image, const Colour& colour) {
  int64_t count = 0;
  const int64_t pixels = int64_t{image.width} * image.height;
  for (int64_t i = 0; i < pixels; ++i) {
    const uint8_t* p = &image.rgb[static_cast<size_t>(3 * i)];
    const double factor = p[0] / (255.0 * colour[0]);
    if (factor < 0.45 || (p[0] == 255 && p[1] == 255 && p[2] == 255)) continue;
    bool same = true;
    for (int c = 0; c < 3; ++c) same = same && std::abs(p[c] - 255 * colour[c] * factor) < 4;
    if (same) ++count;
  }
  return static_cast<double>(count) / static_cast<double>(pixels);
}

PictureOptions Small(std::optional<Cut> cut) {
  PictureOptions options;
  options.width = 240;
  options.height = 200;
  options.cut = cut;
  return options;
}

TEST(Picture, FromOutsideABlockShowsItsHullOnly) {
  const auto image = DrawMesh(Block(3, 0), Small(std::nullopt));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_GT(ShareOf(*image, kHullColour), 0.2);
  EXPECT_LT(ShareOf(*image, kHexahedronColour), 0.001);
}

TEST(Picture, CutOpenABlockShowsHexahedraWithin) {
  const auto image = DrawMesh(Block(4, 0), Small(Cut{1, 0.5}));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_GT(ShareOf(*image, kHexahedronColour), 0.1);
  EXPECT_LT(ShareOf(*image, kOtherCellColour), 0.001);
}

TEST(Picture, OtherCellsWithinAreYellow) {
  const auto image = DrawMesh(Block(4, 1), Small(Cut{1, 0.5}));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_GT(ShareOf(*image, kOtherCellColour), 0.1);
  EXPECT_LT(ShareOf(*image, kHexahedronColour), 0.001);
}

TEST(Picture, EveryAxisCanBeCut) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto image = DrawMesh(Block(4, 0), Small(Cut{axis, 0.5}));
    ASSERT_TRUE(image.ok()) << image.status();
    EXPECT_GT(ShareOf(*image, kHexahedronColour), 0.1) << axis;
  }
}

TEST(Picture, EdgesAreDrawn) {
  const auto image = DrawMesh(Block(3, 0), Small(std::nullopt));
  ASSERT_TRUE(image.ok());
  int64_t dark = 0;
  for (size_t i = 0; i < image->rgb.size(); i += 3) {
    if (image->rgb[i] < 110) ++dark;
  }
  EXPECT_GT(dark, 300);
}

TEST(Picture, TheFrameStaysFree) {
  const auto image = DrawMesh(Block(3, 0), Small(std::nullopt));
  ASSERT_TRUE(image.ok());
  for (int x = 0; x < image->width; ++x) EXPECT_EQ(image->Pixel(x, 0)[0], 255);
  for (int y = 0; y < image->height; ++y) EXPECT_EQ(image->Pixel(0, y)[2], 255);
}

TEST(Picture, PngsBeginWithTheirSignature) {
  const auto image = DrawMesh(Block(2, 0), Small(std::nullopt));
  ASSERT_TRUE(image.ok());
  const auto bytes = EncodePng(*image);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(bytes->substr(0, 8), std::string("\x89PNG\r\n\x1a\n", 8));
}

TEST(Picture, ACutThatLeavesNothingSaysSo) {
  AtMostHexaMesh mesh = Block(2, 0);
  EXPECT_EQ(DrawMesh(mesh, Small(Cut{0, 0.0})).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(Picture, ColoursMaySayTheQuality) {
  AtMostHexaMesh mesh = Block(3, 0);
  PictureOptions options = Small(std::nullopt);
  options.colouring = Colouring::kQuality;
  for (float quality : {0.0f, 0.5f, 1.0f}) {
    mesh.quality.assign(mesh.quality.size(), quality);
    const auto image = DrawMesh(mesh, options);
    ASSERT_TRUE(image.ok()) << image.status();
    EXPECT_GT(ShareOf(*image, RampColour(quality)), 0.2) << quality;
  }
}

TEST(Picture, ColoursMaySayTheDistance) {
  const AtMostHexaMesh mesh = Block(3, 0);
  PictureOptions options = Small(std::nullopt);
  options.colouring = Colouring::kDistance;
  EXPECT_EQ(DrawMesh(mesh, options).status().code(), absl::StatusCode::kFailedPrecondition);
  std::vector<float> distances(mesh.corners.size(), 0.0f);
  options.distances = distances;
  // Where all are as near as can be, all are blue.
  EXPECT_GT(ShareOf(*DrawMesh(mesh, options), RampColour(1)), 0.2);
  distances.assign(distances.size(), 3.0f);
  EXPECT_GT(ShareOf(*DrawMesh(mesh, options), RampColour(0)), 0.2);
  distances.assign(distances.size(), std::numeric_limits<float>::quiet_NaN());
  EXPECT_GT(ShareOf(*DrawMesh(mesh, options), kNotMeasuredColour), 0.2);
}

TEST(CellColours, OneFarCellLeavesTheOthersTheirColours) {
  const AtMostHexaMesh mesh = Block(6, 0);  // 216 cells
  std::vector<float> distances(mesh.corners.size(), 1.0f);
  distances[0] = 1000.0f;
  distances[1] = 0.5f;
  const auto colours = ColoursOfCells(mesh, Colouring::kDistance, distances);
  ASSERT_TRUE(colours.ok());
  EXPECT_EQ((*colours)[0], RampColour(0));
  EXPECT_EQ((*colours)[1], RampColour(0.5));
  EXPECT_EQ((*colours)[2], RampColour(0));
}

TEST(Picture, OptionsAreReadFromTextOrRefused) {
  const auto cut = ParseCut("z:0.25");
  ASSERT_TRUE(cut.ok());
  EXPECT_EQ(cut->axis, 2);
  EXPECT_EQ(cut->fraction, 0.25);
  EXPECT_EQ(ParseCut("x")->fraction, 0.5);
  for (const char* bad : {"", "w", "x0.5", "x:2", "y:-1", "z:half"}) {
    EXPECT_FALSE(ParseCut(bad).ok()) << bad;
  }
  PictureOptions options;
  EXPECT_TRUE(ParseSize("640x480", &options).ok());
  EXPECT_EQ(options.width, 640);
  EXPECT_EQ(options.height, 480);
  for (const char* bad : {"", "640", "640x", "1x1", "99999x10", "axb"}) {
    EXPECT_FALSE(ParseSize(bad, &options).ok()) << bad;
  }
}

}  // namespace
}  // namespace amhex::client
