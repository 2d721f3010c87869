// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/run_command.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "foam/util/interruption.h"
#include "foam/util/scratch_folder.h"
#include "tools/support/memory_task.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>

#include <poll.h>
#include <unistd.h>

namespace semfoam {
namespace {

// What a command prints is its result too. A reader that had enough (`| head`) is no error.
void RequireWrittenOutput() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  pollfd reader{STDOUT_FILENO, 0, 0};
  if (::poll(&reader, 1, 0) == 1 && (reader.revents & POLLERR) != 0) return;
  throw UserError("The standard output cannot be written completely; is the disk full?");
}

// Options are spelled as the fields that they set, but for this one.
std::string OptionOf(const std::string& field) {
  return field == "mask_consistency" ? "Masks.consistency" : field;
}

}  // namespace

int PrintError(const std::string& sentence) {
  WaitIfExiting();
  std::fprintf(stderr,
               "%sERROR: %s\n",
               ::isatty(STDERR_FILENO) != 0 ? "\r\x1b[K" : "",
               OneLine(sentence).c_str());
  return EXIT_FAILURE;
}

int RunCommand(void (*run)(int argc, char** argv), int argc, char** argv) {
  try {
    HandleInterruptions();
    run(argc, argv);
    RequireWrittenOutput();
    return EXIT_SUCCESS;
  } catch (const Interruption& interruption) {
    return interruption.ExitCode();
  } catch (const FieldError& error) {
    const std::string rest = std::string(error.what()).substr(error.field().size());
    return PrintError("Failed to parse options - --" + OptionOf(error.field()) + rest);
  } catch (const UserError& error) {
    return PrintError(error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return PrintError(error.path1().string() + ": cannot be reached (" + error.code().message() +
                      "); may you read and enter its folders?");
  } catch (const std::bad_alloc&) {
    return PrintError(MemoryUsedUp());
  } catch (const std::exception& error) {
    return PrintError(std::string("something unexpected went wrong (") + error.what() + ").");
  }
}

}  // namespace semfoam
