// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

namespace semfoam {

// Logs what is left out of the objects of a scene, and which labels have no object.
void LogLeftOut(const ExportableScene& scene);

}  // namespace semfoam
