// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/drawing.h"

#include <glog/logging.h>
#ifdef __SANITIZE_ADDRESS__
#include <fontconfig/fontconfig.h>
#endif

namespace semfoam {
namespace {

#ifdef __SANITIZE_ADDRESS__
// Cairo and fontconfig keep the fonts they found until the process ends, and fontconfig links them
// by offsets, which LeakSanitizer does not follow: to it they are leaks. It looks after the static
// objects are gone, so the caches go with this one. Both functions are for memory checkers only.
struct FontCaches {
  ~FontCaches() {
    cairo_debug_reset_static_data();
    FcFini();
  }
};
#endif

}  // namespace

DrawingContext BeginDrawing(cairo_surface_t* surface, double scale) {
#ifdef __SANITIZE_ADDRESS__
  static const FontCaches released_at_exit;
#endif
  DrawingContext cairo(cairo_create(surface), cairo_destroy);
  cairo_scale(cairo.get(), scale, scale);
  // Debian's cairo brings this font along.
  cairo_select_font_face(
      cairo.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  return cairo;
}

void SetColor(cairo_t* cairo, const DrawingColor& color) {
  cairo_set_source_rgb(cairo, color.r, color.g, color.b);
}

double TextWidth(cairo_t* cairo, const std::string& text, double size) {
  cairo_text_extents_t extents;
  cairo_set_font_size(cairo, size);
  cairo_text_extents(cairo, text.c_str(), &extents);
  return extents.x_advance;
}

void DrawText(cairo_t* cairo,
              const std::string& text,
              double x,
              double y,
              double size,
              TextAlign align,
              const DrawingColor& color) {
  const double width = TextWidth(cairo, text, size);
  SetColor(cairo, color);
  cairo_move_to(cairo,
                align == TextAlign::kLeft     ? x
                : align == TextAlign::kCenter ? x - width / 2
                                              : x - width,
                y);
  cairo_show_text(cairo, text.c_str());
}

cairo_status_t AppendBytes(void* text, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

std::string EncodePng(cairo_surface_t* surface) {
  std::string bytes;
  CHECK_EQ(cairo_surface_write_to_png_stream(surface, AppendBytes, &bytes), CAIRO_STATUS_SUCCESS);
  return bytes;
}

}  // namespace semfoam
