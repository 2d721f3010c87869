# SPDX-License-Identifier: MIT
#
# Writes OUTPUT, a C++ source with the texts of PAGE and of the bundled script and style in BUNDLE.
set(source "// SPDX-License-Identifier: GPL-3.0-or-later\n#include \"tools/report/report_page.h\"\n\nnamespace semfoam {\n\n")
foreach(part Html Style Script)
  if(part STREQUAL Html)
    file(READ "${PAGE}" text)
  elseif(part STREQUAL Style)
    file(READ "${BUNDLE}/style.css" text)
  else()
    file(READ "${BUNDLE}/main.js" text)
  endif()
  string(APPEND source "std::string_view ReportPage${part}() {\n  return R\"semfoam(${text})semfoam\";\n}\n\n")
endforeach()
string(APPEND source "}  // namespace semfoam\n")
file(WRITE "${OUTPUT}" "${source}")
