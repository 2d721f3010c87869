// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <exception>
#include <functional>

// Handles the signals that ask the process to end: SIGINT (Ctrl-C), SIGTERM, and SIGHUP (its
// terminal was closed).
//
// A program calls HandleInterruptions() once. A loop that must not be cut off defers the signal and
// leaves at a safe point:
//
//   const DeferInterruption until_saved;
//   for (...) {
//     ...
//     if (const int signal = InterruptionRequested()) {
//       Save();
//       throw Interruption(signal);
//     }
//   }
//
// Without HandleInterruptions() no signal is ever held back. All functions are thread-safe.

namespace semfoam {

// Ends the process from now on, when one of these signals arrives, with the exit code 128 + signal
// (SIGINT 130, SIGTERM 143, SIGHUP 129), after removing all unfinished files
// (foam/util/scratch_folder.h). Signals that the process was started to ignore (nohup) stay
// ignored. Writing beyond a limit of the file size (SIGXFSZ) or to a closed pipe (SIGPIPE) becomes
// an error of that write.
//
// Blocks the signals and waits for them in a thread of its own, so that no signal handler ever runs
// in another thread: no code has to be async-signal-safe, and no system call ends with EINTR. Must
// be called once, by the program and not by a library, and before any other thread is started:
// threads inherit which signals are blocked. Throws std::system_error where the signals cannot be
// blocked or no thread can be started.
void HandleInterruptions();

// Returns the signal that a DeferInterruption has held back; 0: none. Costs one load of an atomic,
// so loops may ask in every iteration.
int InterruptionRequested();

// Defers the end of the process until no object of this class exists. The first signal that arrives
// in the meantime is stored for InterruptionRequested(). A second one ends the process at once: any
// other signal, or the same one a second later or more; repetitions within a second are ignored,
// because timeout(1) and some batch systems signal the process and then its group.
//
// When the last object is destroyed and a signal is stored, the process ends then, unless an
// exception (Interruption, or an error) is leaving the object's scope.
class DeferInterruption {
 public:
  DeferInterruption();
  ~DeferInterruption();
  DeferInterruption(const DeferInterruption&) = delete;
  DeferInterruption& operator=(const DeferInterruption&) = delete;

 private:
  // std::uncaught_exceptions() at the construction.
  const int exceptions_at_begin_;
};

// Ends the work of a loop that has answered InterruptionRequested(): leaves all scopes up to the
// program's main function, which exits with ExitCode().
class Interruption : public std::exception {
 public:
  explicit Interruption(int signal) : signal_(signal) {}
  const char* what() const noexcept override { return "interrupted by a signal"; }

  // Returns 128 + signal.
  int ExitCode() const { return 128 + signal_; }

 private:
  int signal_;
};

// Calls a function before a signal ends the process, as long as the object exists: to print what is
// left to do. The function runs in the thread that waits for signals, and must neither wait for
// other threads nor throw. It is not called when the process ends by an Interruption. Several
// objects may exist at a time, on any threads: their functions are called one after another.
class OnInterrupt {
 public:
  explicit OnInterrupt(std::function<void()> callback);
  ~OnInterrupt();
  OnInterrupt(const OnInterrupt&) = delete;
  OnInterrupt& operator=(const OnInterrupt&) = delete;
};

}  // namespace semfoam
