// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace semfoam {

// Text for an HTML page that carries its data.

// Compresses bytes as a gzip stream without name and time: same bytes in, same bytes out.
std::string Gzip(std::string_view bytes);

// Encodes bytes in base64 (RFC 4648, padded).
std::string Base64(std::string_view bytes);

// Returns "data:<type>;base64,<bytes>".
std::string DataUrl(std::string_view type, std::string_view bytes);

// Returns JSON in ASCII that can stand inside a <script> element whatever its texts hold: "<", ">"
// and "&" are escaped. Bytes that are no UTF-8 become U+FFFD.
std::string JsonForHtml(const nlohmann::ordered_json& json);

// Returns `page` with each {{name}} replaced by `parts`[name], once, without looking into what was
// put in. CHECKs that every name has a part.
std::string FillPage(std::string_view page, const std::map<std::string, std::string>& parts);

}  // namespace semfoam
