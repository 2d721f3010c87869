// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"

namespace semfoam {

std::string UserError::Spelled(
    const std::function<std::string(const std::string& field)>& spell) const {
  const std::string text = what();
  std::string spelled;
  size_t end = 0;
  for (const Place& field : fields_) {
    spelled.append(text, end, field.begin - end);
    spelled += spell(text.substr(field.begin, field.end - field.begin));
    end = field.end;
  }
  return spelled.append(text, end);
}

}  // namespace semfoam
