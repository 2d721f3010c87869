// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/error.h"

#include <string>

namespace semfoam {

// The sentence as a user of the command line reads it: fields are spelled as their options, and a
// FieldError begins as the parser's own errors do.
std::string ErrorSentence(const UserError& error);

// Prints "ERROR: <sentence>" to stderr as one line, without control characters, which names of
// files and of labels could contain. Returns the exit code 1.
int PrintError(const std::string& sentence);

// What the exit codes of the program mean, for help and manuals.
inline constexpr char kExitCodes[] =
    "0 = done; 1 = an error, told in one sentence on stderr; 128 + N = stopped by signal N (130 "
    "for "
    "Ctrl-C, 143 for SIGTERM), after a checkpoint where the command writes them.";

// Runs a command as a whole program: handles signals, prints exceptions as one sentence, and checks
// that all output was written. Returns the exit code: 0, 1 after an error, 128 + the signal's
// number after an interruption (130 for Ctrl-C, 143 for SIGTERM).
int RunCommand(void (*run)(int argc, char** argv), int argc, char** argv);

}  // namespace semfoam
