// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace semfoam {

// The parts of tools/report_page, bundled when the program was built and part of it:

// index.html, with {{names}} for what a report fills in (FillPage).
std::string_view ReportPageHtml();
// style.css.
std::string_view ReportPageStyle();
// main.ts and all that it imports, as one script.
std::string_view ReportPageScript();

}  // namespace semfoam
