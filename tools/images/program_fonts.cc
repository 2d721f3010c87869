// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/program_fonts.h"

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace semfoam {

void UseFontsOfProgram() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path fonts = program.parent_path().parent_path() / "share/semfoam/fonts.conf";
  // What the user has chosen stays.
  if (!error && fs::exists(fonts, error)) ::setenv("FONTCONFIG_FILE", fonts.c_str(), 0);
}

}  // namespace semfoam
