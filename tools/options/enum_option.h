// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "tools/cli/option_manager.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <glog/logging.h>

namespace semfoam {

// Adds an option that takes one of an enum's names, which must have static storage. `*value` before
// Parse is the default; Parse sets it and then calls `then`, if any.
template <typename Enum, size_t kCount>
void AddEnumOption(OptionManager* options,
                   const std::string& name,
                   Enum* value,
                   const EnumName<Enum> (&names)[kCount],
                   const std::string& help,
                   const std::function<void()>& then = nullptr) {
  // Exists as long as the option.
  const auto text = std::make_shared<std::string>(NameOf(names, *value));
  options->AddChoiceOption(
      name, text.get(), AllNames(names), help, [text, value, table = &names, then] {
        const std::optional<Enum> parsed = ParseEnum(*table, *text);
        CHECK(parsed.has_value()) << *text;
        *value = *parsed;
        if (then) then();
      });
}

}  // namespace semfoam
