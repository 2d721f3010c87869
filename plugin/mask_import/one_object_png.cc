// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/one_object_png.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_png.h"

#include <utility>

namespace semfoam {

OneObject ReadOneObject(const std::filesystem::path& file) {
  OneObject object;
  ReadMaskRows(file, [&](const MaskHeader& header, int y, std::span<const uint32_t> values) {
    object.size = header.size;
    const int64_t row = static_cast<int64_t>(y) * header.size.width;
    for (size_t x = 0; x < values.size(); ++x) {
      if (values[x] == 0) continue;
      if (object.value == 0) object.value = values[x];
      if (values[x] != object.value) {
        throw UserError(file.string(),
                        ": holds the values ",
                        object.value,
                        " and ",
                        values[x],
                        ", where 0 and one other value, the mask of one object, would be right.");
      }
      const int64_t at = row + static_cast<int64_t>(x);
      AppendRun({at, at + 1}, &object.runs);
    }
  });
  return object;
}

}  // namespace semfoam
