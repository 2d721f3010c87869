// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/contact_sheet.h"

#include "export/scene/names.h"
#include "foam/util/output_file.h"
#include "plugin/photo/photo.h"
#include "plugin/util/files.h"
#include "tools/images/drawing.h"
#include "tools/images/image_files.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int kColumns = 6;
constexpr int kGap = 14;
constexpr int kCaption = 34;  // two lines of text
constexpr int kTop = 34, kLegendLine = 18;
constexpr double kTitleSize = 15, kTextSize = 11;
constexpr int kWidth = kColumns * (kTileSide + kGap) + kGap;
constexpr uint8_t kGrey = 200;
constexpr DrawingColor kAlarm = {0.80, 0.05, 0.05};

// Returns the text, cut to the width of a tile.
std::string Fitted(cairo_t* cairo, const std::string& text, double size) {
  std::string fitted = text;
  const std::string dots = "...";
  while (!fitted.empty() && TextWidth(cairo, fitted, size) > kTileSide) {
    if (fitted.ends_with(dots)) fitted.resize(fitted.size() - dots.size());
    // A whole character of UTF-8.
    while (!fitted.empty() && (static_cast<unsigned char>(fitted.back()) & 0xC0) == 0x80) {
      fitted.pop_back();
    }
    if (!fitted.empty()) fitted.pop_back();
    fitted += dots;
    if (fitted == dots) break;
  }
  return fitted;
}

void DrawPicture(cairo_t* cairo, const Image8& picture, double x, double y) {
  CHECK(picture.width <= kTileSide && picture.height <= kTileSide);
  if (picture.data.empty()) return;
  const DrawingSurface surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, picture.width, picture.height),
      cairo_surface_destroy);
  const int stride = cairo_image_surface_get_stride(surface.get());
  uint8_t* pixels = cairo_image_surface_get_data(surface.get());
  for (int row = 0; row < picture.height; ++row) {
    auto* out = reinterpret_cast<uint32_t*>(pixels + static_cast<ptrdiff_t>(row) * stride);
    const uint8_t* in = &picture.data[size_t{3} * row * picture.width];
    for (int column = 0; column < picture.width; ++column, in += 3) {
      out[column] = uint32_t{in[0]} << 16 | uint32_t{in[1]} << 8 | in[2];
    }
  }
  cairo_surface_mark_dirty(surface.get());
  cairo_set_source_surface(cairo, surface.get(), x, y);
  cairo_paint(cairo);
}

void DrawTile(cairo_t* cairo, const SheetTile& tile, double x, double y, int height) {
  DrawPicture(cairo, tile.picture, x, y);
  DrawText(cairo,
           Fitted(cairo, tile.caption, kTextSize),
           x,
           y + height + 14,
           kTextSize,
           TextAlign::kLeft);
  if (tile.remark.empty()) return;
  DrawText(cairo,
           Fitted(cairo, tile.remark, kTextSize),
           x,
           y + height + 28,
           kTextSize,
           TextAlign::kLeft,
           kAlarm);
  SetColor(cairo, kAlarm);
  cairo_set_line_width(cairo, 3);
  cairo_rectangle(cairo, x - 1.5, y - 1.5, tile.picture.width + 3, tile.picture.height + 3);
  cairo_stroke(cairo);
}

// Returns the height that the legend takes; draws it only if `draws`.
int DrawLegend(cairo_t* cairo, bool draws, const std::vector<SheetLegendEntry>& legend) {
  if (legend.empty()) return 0;
  double x = kGap;
  int y = kTop;
  for (const SheetLegendEntry& entry : legend) {
    const double width = 18 + TextWidth(cairo, entry.name, kTextSize) + 14;
    if (x > kGap && x + width > kWidth) {
      x = kGap;
      y += kLegendLine;
    }
    if (draws) {
      const auto [r, g, b] = entry.color;
      SetColor(cairo, {r / 255.0, g / 255.0, b / 255.0});
      cairo_rectangle(cairo, x, y, 12, 12);
      cairo_fill(cairo);
      DrawText(cairo, entry.name, x + 17, y + 10, kTextSize, TextAlign::kLeft);
    }
    x += width;
  }
  return y + kLegendLine - kTop;
}

std::string Page(const std::string& title,
                 const std::vector<SheetLegendEntry>& legend,
                 const std::vector<SheetTile>& tiles) {
  const DrawingSurface probe(cairo_image_surface_create(CAIRO_FORMAT_RGB24, 1, 1),
                             cairo_surface_destroy);
  const int top =
      kTop + kGap / 2 + DrawLegend(BeginDrawing(probe.get(), 1).get(), /*draws=*/false, legend);
  int tile_height = 1;
  for (const SheetTile& tile : tiles) tile_height = std::max(tile_height, tile.picture.height);
  const int row_height = tile_height + kCaption + kGap;
  const int rows = (static_cast<int>(tiles.size()) + kColumns - 1) / kColumns;
  const int height = top + rows * row_height;
  const DrawingSurface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, kWidth, height),
                               cairo_surface_destroy);
  {
    const DrawingContext cairo = BeginDrawing(surface.get(), 1);
    SetColor(cairo.get(), {1, 1, 1});
    cairo_paint(cairo.get());
    DrawText(cairo.get(), title, kGap, kTop - 12, kTitleSize, TextAlign::kLeft);
    DrawLegend(cairo.get(), /*draws=*/true, legend);
    for (size_t i = 0; i < tiles.size(); ++i) {
      const int column = static_cast<int>(i) % kColumns;
      const int row = static_cast<int>(i) / kColumns;
      DrawTile(cairo.get(),
               tiles[i],
               kGap + column * (kTileSide + kGap),
               top + row * row_height,
               tile_height);
    }
    CHECK_EQ(cairo_status(cairo.get()), CAIRO_STATUS_SUCCESS);
  }
  return EncodePng(surface.get());
}

fs::path PagePath(const fs::path& stem, int page) {
  return stem.string() + "_" + std::to_string(page) + ".png";
}

}  // namespace

Image8 OverlayTile(const Image8& photo, const LabelImage& labels) {
  const PhotoSize full = photo.data.empty() ? PhotoSize{labels.width, labels.height}
                                            : PhotoSize{photo.width, photo.height};
  if (full.width <= 0 || full.height <= 0) return {};
  const PhotoSize size = ReducedSize(full, kTileSide);
  Image8 tile{size.width, size.height, {}};
  if (photo.data.empty()) {
    tile.data.assign(size_t{3} * size.width * size.height, kGrey);
  } else {
    tile = ReducePhoto(photo, size);
  }
  if (labels.data.empty()) return tile;
  const LabelImage ids = ResizeNearest(labels, size.width, size.height);
  std::map<int32_t, std::array<uint8_t, 3>> palette;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const size_t pixel = static_cast<size_t>(y) * size.width + x;
      const int32_t id = ids.data[pixel];
      if (id == 0) continue;
      const auto [entry, is_new] = palette.try_emplace(id);
      if (is_new) entry->second = LabelColor(LabelId{id});
      const bool is_border = (x + 1 < size.width && ids.data[pixel + 1] != id) ||
                             (x > 0 && ids.data[pixel - 1] != id) ||
                             (y + 1 < size.height && ids.data[pixel + size.width] != id) ||
                             (y > 0 && ids.data[pixel - size.width] != id);
      for (int c = 0; c < 3; ++c) {
        uint8_t& value = tile.data[3 * pixel + c];
        const int color = entry->second[c];
        value = static_cast<uint8_t>(is_border ? color : (value + color) / 2);
      }
    }
  }
  return tile;
}

int WriteContactSheet(const fs::path& stem,
                      const std::string& title,
                      const std::vector<SheetLegendEntry>& legend,
                      int num_tiles,
                      const std::function<SheetTile(int index)>& tile) {
  const int pages = (num_tiles + kTilesPerPage - 1) / kTilesPerPage;
  for (int page = 1; page <= pages; ++page) {
    const int begin = (page - 1) * kTilesPerPage;
    std::vector<SheetTile> tiles(std::min(kTilesPerPage, num_tiles - begin));
    ForEachFile(static_cast<int64_t>(tiles.size()),
                [&](int64_t i) { tiles[i] = tile(begin + static_cast<int>(i)); });
    const std::string number =
        pages > 1 ? ", page " + std::to_string(page) + " of " + std::to_string(pages) : "";
    WriteTextFile(PagePath(stem, page), Page(title + number, legend, tiles));
  }
  for (int page = pages + 1; fs::is_regular_file(PagePath(stem, page)); ++page) {
    fs::remove(PagePath(stem, page));
  }
  return pages;
}

}  // namespace semfoam
