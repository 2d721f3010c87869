// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/progress_option.h"

#include "tools/options/enum_option.h"
#include "tools/support/progress.h"

#include <memory>

namespace semfoam {
namespace {

constexpr EnumName<ProgressStyle> kProgressStyleNames[] = {{ProgressStyle::kAuto, "auto"},
                                                           {ProgressStyle::kBar, "bar"},
                                                           {ProgressStyle::kLines, "lines"},
                                                           {ProgressStyle::kJson, "json"}};

}  // namespace

void AddProgressOption(OptionManager* options) {
  // Exists as long as the option.
  const auto style = std::make_shared<ProgressStyle>(ProgressStyle::kAuto);
  AddEnumOption(options,
                "progress",
                style.get(),
                kProgressStyleNames,
                "on stderr: one line that moves, plain lines, or one JSON object a line; auto = "
                "bar on a terminal, else lines",
                [style] { SetProgressStyle(*style); });
}

}  // namespace semfoam
