// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include <cairo.h>

namespace semfoam {

// What all drawings with cairo have in common. The same drawing gives the same bytes (with the same
// cairo and fonts).

struct DrawingColor {
  double r = 0, g = 0, b = 0;
};
inline constexpr DrawingColor kInk = {0.15, 0.15, 0.15};

enum class TextAlign { kLeft, kCenter, kRight };

using DrawingSurface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using DrawingContext = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

// A context that draws on `surface`, `scale` of its units for each of the drawing's, with the font
// of all drawings.
DrawingContext BeginDrawing(cairo_surface_t* surface, double scale);

void SetColor(cairo_t* cairo, const DrawingColor& color);

double TextWidth(cairo_t* cairo, const std::string& text, double size);

// `y` is the base line.
void DrawText(cairo_t* cairo,
              const std::string& text,
              double x,
              double y,
              double size,
              TextAlign align,
              const DrawingColor& color = kInk);

// A cairo_write_func_t that appends to the std::string that `text` points to.
cairo_status_t AppendBytes(void* text, const unsigned char* data, unsigned int length);

// The bytes of a PNG file.
std::string EncodePng(cairo_surface_t* surface);

}  // namespace semfoam
