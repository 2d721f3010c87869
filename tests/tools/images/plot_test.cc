// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/plot.h"

#include "foam/util/error.h"

#include <cmath>
#include <memory>
#include <sstream>
#include <string>

#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <boost/property_tree/xml_parser.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// One blue series with markers, from the lower left to the upper right, and a second panel.
Plot TwoPanels() {
  Plot plot{"Quality", "front", {}};
  plot.panels.push_back({"seconds", "PSNR", true, {}, {}});
  plot.panels[0].series.push_back({"run", {{1, 20}, {10, 25, "mid"}, {100, 30}}, true, true});
  plot.panels[0].series.push_back({"other", {{2, 22}, {NAN, 1}, {-1, 25}}, false, true});
  plot.panels[0].front = {{1, 20}, {10, 25}, {100, 30}};
  plot.panels.push_back({"seconds", "mIoU", false, {{"run", {{0, 0.1}, {5, 0.4}}}}, {}});
  return plot;
}

struct Pixels {
  int width = 0, height = 0, channels = 0;
  std::vector<uint8_t> data;

  bool IsBlue(int x, int y) const {
    const uint8_t* pixel = &data[(size_t{1} * y * width + x) * channels];
    return pixel[0] < 30 && pixel[1] > 90 && pixel[1] < 140 && pixel[2] > 160 && pixel[2] < 200;
  }
};

Pixels Decode(const std::filesystem::path& path) {
  const auto input = OIIO::ImageInput::open(path.string());
  EXPECT_NE(input, nullptr) << path;
  Pixels pixels{input->spec().width, input->spec().height, input->spec().nchannels, {}};
  pixels.data.resize(size_t{1} * pixels.width * pixels.height * pixels.channels);
  EXPECT_TRUE(input->read_image(0, 0, 0, -1, OIIO::TypeDesc::UINT8, pixels.data.data()));
  return pixels;
}

TEST(Plot, DrawsAValidSvg) {
  const TempFolder folder;
  WritePlot(folder / "a" / "plot", TwoPanels());
  std::istringstream text(ReadFile(folder / "a" / "plot.svg"));
  boost::property_tree::ptree tree;
  boost::property_tree::read_xml(text, tree);  // throws where it is no XML
  EXPECT_EQ(tree.count("svg"), 1u);
  // Cairo 1.16 writes style="stroke:rgb(0%,45%,70%)", 1.18 stroke="rgb(0%, 45%, 70%)".
  const std::string svg = text.str();
  const auto drawn = [](const std::string& what, const std::string& color) {
    return ContainsRegex(what + "(:|=\"?)rgb\\(" + color);
  };
  EXPECT_THAT(svg, drawn("stroke", "0%, ?45%, ?70%\\)"));    // the line
  EXPECT_THAT(svg, drawn("fill", "0%, ?45%, ?70%\\)"));      // its markers
  EXPECT_THAT(svg, HasSubstr("stroke-dasharray"));           // the front
  EXPECT_THAT(svg, drawn("fill", "84%, ?37%, ?0%\\)"));      // the second series
  EXPECT_THAT(svg, ::testing::Not(drawn("stroke", "84%")));  // which has no line
  EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("nan")));
}

TEST(Plot, DrawsPointsWhereTheyBelong) {
  const TempFolder folder;
  WritePlot(folder / "plot", TwoPanels());
  const Pixels pixels = Decode(folder / "plot.png");
  ASSERT_GT(pixels.width, 1000);
  ASSERT_GT(pixels.height, 400);
  // In the left panel the line rises from left to right, and in powers of ten it is straight.
  std::vector<double> x, y;
  for (int column = 150; column < 700; column += 5) {
    double sum = 0;
    int count = 0;
    for (int row = 0; row < 600; ++row) {
      if (!pixels.IsBlue(column, row)) continue;
      sum += row;
      ++count;
    }
    if (count == 0) continue;
    x.push_back(column);
    y.push_back(sum / count);
  }
  ASSERT_GT(x.size(), 80u);
  const double slope = (y.back() - y.front()) / (x.back() - x.front());
  EXPECT_LT(slope, -0.5);
  for (size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(y[i], y.front() + slope * (x[i] - x.front()), 6) << x[i];
  }
}

TEST(Plot, GivesTheSameBytesForTheSamePlot) {
  const TempFolder folder;
  WritePlot(folder / "a", TwoPanels());
  WritePlot(folder / "b", TwoPanels());
  EXPECT_EQ(ReadFile(folder / "a.svg"), ReadFile(folder / "b.svg"));
  EXPECT_EQ(ReadFile(folder / "a.png"), ReadFile(folder / "b.png"));
  Plot other = TwoPanels();
  other.panels[0].series[0].points[0].y = 21;
  WritePlot(folder / "c", other);
  EXPECT_NE(ReadFile(folder / "a.svg"), ReadFile(folder / "c.svg"));
  EXPECT_NE(ReadFile(folder / "a.png"), ReadFile(folder / "c.png"));
}

TEST(Plot, TakesSeriesWithoutPointsAndWithOne) {
  const TempFolder folder;
  Plot plot{"", "", {}};
  plot.panels.push_back({"x", "y", true, {{"none", {{0, 1}, {NAN, NAN}}}}, {}});
  plot.panels.push_back({"x", "y", false, {{"one", {{3, 3}}, true, true}}, {}});
  WritePlot(folder / "plot", plot);
  Decode(folder / "plot.png");
  WritePlot(folder / "empty", Plot{});
  Decode(folder / "empty.png");
}

TEST(Plot, NamesTheFileThatCannotBeWritten) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "plot.svg" / "in the way");
  try {
    WritePlot(folder / "plot", TwoPanels());
    FAIL() << "wrote over a folder";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("plot.svg: cannot be written"));
  }
}

TEST(PlotTicks, AreRoundNumbersWithin) {
  EXPECT_THAT(PlotTicks(0, 10, 7, false), ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(PlotTicks(19.7, 26.4, 7, false), ElementsAre(20, 21, 22, 23, 24, 25, 26));
  EXPECT_THAT(PlotTicks(-0.011, 0.011, 7, false), ElementsAre(-0.01, -0.005, 0, 0.005, 0.01));
  EXPECT_THAT(PlotTicks(8, 240, 7, true), ElementsAre(10, 20, 50, 100, 200));
  EXPECT_THAT(PlotTicks(0.5, 20000, 7, true), ElementsAre(1, 10, 100, 1000, 10000));
  EXPECT_THAT(PlotTicks(21, 49, 7, true), ElementsAre(25, 30, 35, 40, 45));
}

}  // namespace
}  // namespace semfoam
