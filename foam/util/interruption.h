// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <exception>
#include <functional>

namespace semfoam {

// What the program does when it is told to end: by SIGINT (Ctrl-C), SIGTERM or SIGHUP (the terminal
// is gone).

// From now on these signals end the process with exit code 128 + signal (130, 143, 129), after
// everything unfinished (foam/util/scratch_folder.h) has been removed, except while a
// DeferInterruption lives. A signal that the process was started to ignore (nohup) stays ignored.
// Writing beyond a limit of the file size, or to a closed pipe, becomes an error of that write
// instead of a signal that kills.
//
// A thread of its own waits for the signals, so that no handler ever interrupts another thread:
// nothing has to be async-signal-safe, no system call ends with EINTR. Call it once, before any
// other thread is started, for they inherit what is blocked here. Throws std::system_error where no
// thread can be started. Libraries leave the signals to the program that uses them.
void HandleInterruptions();

// While one lives, the first signal only makes InterruptionRequested() true; a second one (another
// one, or the same after a second) ends the process as if there were none. When the last one goes
// with a signal that nobody has answered by an exception, the process ends then.
class DeferInterruption {
 public:
  DeferInterruption();
  ~DeferInterruption();
  DeferInterruption(const DeferInterruption&) = delete;
  DeferInterruption& operator=(const DeferInterruption&) = delete;

 private:
  const int exceptions_at_begin_;
};

// While one lives, a signal that ends the process calls `say` before it does, in the thread that
// waits for signals: to tell what is left to do. It must not wait for other threads, nor throw. One
// at a time (CHECK).
class OnInterrupt {
 public:
  explicit OnInterrupt(std::function<void()> say);
  ~OnInterrupt();
  OnInterrupt(const OnInterrupt&) = delete;
  OnInterrupt& operator=(const OnInterrupt&) = delete;
};

// The signal that a DeferInterruption has held back, 0 where there was none. Costs one load: loops
// may ask at every turn.
int InterruptionRequested();

// The answer to InterruptionRequested() of a loop that has brought its work to safety: leaves all
// scopes; the program then exits with ExitCode().
class Interruption : public std::exception {
 public:
  explicit Interruption(int signal) : signal_(signal) {}
  const char* what() const noexcept override { return "interrupted by a signal"; }
  int ExitCode() const { return 128 + signal_; }

 private:
  int signal_;
};

}  // namespace semfoam
