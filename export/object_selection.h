// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"

#include <string>
#include <vector>

namespace semfoam {

// The objects that `labels` names: ids or names, separated by commas ("mug, 7"); all of them where
// it is empty. By ascending id, each once. A name is the label's own, or "label_<id>"; where
// several labels share it, all of them are meant. Throws UserError, with the objects that there
// are, when one of them is no object of the scene.
std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const std::string& labels);

}  // namespace semfoam
