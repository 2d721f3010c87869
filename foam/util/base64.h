// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace semfoam {

// Decodes base64 (RFC 4648, with or without the '=' at its end); line breaks are skipped. Returns
// nothing where there is another character, or where the last group is cut.
std::optional<std::string> DecodeBase64(std::string_view text);

}  // namespace semfoam
