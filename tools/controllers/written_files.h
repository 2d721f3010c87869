// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

namespace semfoam {

// Logs the path and the summary of a file that an exporter wrote, and its warning, if any.
void LogWritten(const WrittenFile& file);

}  // namespace semfoam
