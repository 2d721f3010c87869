// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace semfoam {

// Makes all drawings use the fonts that the program brings along (tools/package --portable), where
// there is share/semfoam/fonts.conf beside the program's folder. Must be called before threads are
// started and anything is drawn.
void UseFontsOfProgram();

}  // namespace semfoam
