// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace semfoam {

// Throws UserError, one sentence, unless `path` is a regular file (or a link to one) that may be
// read: a folder, a pipe that would block for ever and a device that never ends are no input.
// `what` says what it should be, with its article: "a COLMAP model's file".
void RequireRegularFile(const std::filesystem::path& path, const std::string& what);

// All bytes of a regular file, and as much memory as it has bytes. Throws UserError, one sentence
// that names the file, as RequireRegularFile does, and where it may not or cannot be read to its
// end.
std::string ReadFileBytes(const std::filesystem::path& path, const std::string& what);

// Without the three bytes that some editors put before UTF-8.
std::string_view WithoutByteOrderMark(std::string_view text);

// `text` as a sentence can quote it: on one line, without control characters, and cut after some 60
// bytes.
std::string Shortened(std::string_view text);

}  // namespace semfoam
