// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include <cairo.h>

namespace semfoam {

// Common functions of all drawings with cairo. The same drawing gives the same bytes (with the same
// cairo and fonts).

struct DrawingColor {
  double r = 0, g = 0, b = 0;
};
inline constexpr DrawingColor kInk = {0.15, 0.15, 0.15};

enum class TextAlign { kLeft, kCenter, kRight };

using DrawingSurface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using DrawingContext = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

// Returns a context that draws on `surface` with `scale` of its units for each unit of the drawing,
// in the font of all drawings.
DrawingContext BeginDrawing(cairo_surface_t* surface, double scale);

void SetColor(cairo_t* cairo, const DrawingColor& color);

double TextWidth(cairo_t* cairo, const std::string& text, double size);

// Draws a text; `y` is the base line.
void DrawText(cairo_t* cairo,
              const std::string& text,
              double x,
              double y,
              double size,
              TextAlign align,
              const DrawingColor& color = kInk);

// Appends to the std::string that `text` points to: a cairo_write_func_t.
cairo_status_t AppendBytes(void* text, const unsigned char* data, unsigned int length);

// Returns the bytes of a PNG file.
std::string EncodePng(cairo_surface_t* surface);

}  // namespace semfoam
