// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/cli/run_command.h"

#include "export/scene/names.h"
#include "foam/train/training_options.h"
#include "foam/util/interruption.h"
#include "foam/util/scratch_folder.h"
#include "tools/cli/rank_command.h"
#include "tools/support/memory_task.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <set>

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

// Collects the names of TrainingOptions, as Serialize describes them.
class NameCollector {
 public:
  template <typename T>
  void Number(const std::string& name, T*) {
    names_.insert(name);
  }
  const std::set<std::string>& names() const { return names_; }

 private:
  std::set<std::string> names_;
};

bool IsTrainingOption(const std::string& field) {
  static const std::set<std::string> names = [] {
    NameCollector collector;
    TrainingOptions().Serialize(&collector);
    std::set<std::string> all = collector.names();
    all.insert({"max_image_size", "time_budget"});
    return all;
  }();
  return names.count(field) != 0;
}

// Options are called as the fields that they set, some within a group: "--overwrite".
std::string OptionOf(const std::string& field) {
  if (IsTrainingOption(field)) return "--FoamTraining." + field;
  return field == "mask_consistency" ? "--Masks.consistency" : "--" + field;
}

}  // namespace

std::string ErrorSentence(const UserError& error) {
  const bool is_option = dynamic_cast<const FieldError*>(&error) != nullptr;
  return (is_option ? "Failed to parse options - " : "") + error.Spelled(OptionOf);
}

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
  } catch (const PrintedElsewhere&) {
    return EXIT_FAILURE;
  } catch (const UserError& error) {
    return PrintError(ErrorSentence(error));
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
