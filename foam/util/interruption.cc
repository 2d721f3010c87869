// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/interruption.h"

#include "foam/util/scratch_folder.h"

#include <atomic>
#include <chrono>
#include <csignal>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <glog/logging.h>
#include <pthread.h>

namespace semfoam {
namespace {

// A signal that comes again so soon is the same one: timeout(1) sends it to the process and then to
// its group, and so do some batch systems.
constexpr std::chrono::seconds kEcho(1);

// Never destroyed: the waiting thread outlives the end of main.
struct State {
  std::mutex mutex;
  int num_deferrals = 0;      // guarded by the mutex
  std::function<void()> say;  // likewise; empty: nothing
  std::atomic<int> requested = 0;
};

State& TheState() {
  static State& state = *new State;
  return state;
}

// The state's mutex is held.
[[noreturn]] void End(int signal) {
  if (const auto& say = TheState().say) say();
  RemoveScratchFoldersAndExit(Interruption(signal).ExitCode());
}

[[noreturn]] void WaitForSignals(const sigset_t& signals) {
  using Clock = std::chrono::steady_clock;
  State& state = TheState();
  Clock::time_point asked;
  while (true) {
    int signal = 0;
    if (sigwait(&signals, &signal) != 0) continue;
    const std::lock_guard lock(state.mutex);
    if (state.requested == signal && Clock::now() - asked < kEcho) continue;
    if (state.num_deferrals == 0 || state.requested != 0) End(signal);
    state.requested = signal;
    asked = Clock::now();
  }
}

}  // namespace

void HandleInterruptions() {
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action;
    sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_IGN) sigaddset(&signals, signal);
  }
  if (const int error = pthread_sigmask(SIG_BLOCK, &signals, nullptr)) {
    throw std::system_error(error, std::generic_category());
  }
  std::thread([signals] { WaitForSignals(signals); }).detach();
}

DeferInterruption::DeferInterruption() : exceptions_at_begin_(std::uncaught_exceptions()) {
  const std::lock_guard lock(TheState().mutex);
  ++TheState().num_deferrals;
}

DeferInterruption::~DeferInterruption() {
  State& state = TheState();
  const std::lock_guard lock(state.mutex);
  --state.num_deferrals;
  const bool is_answered = std::uncaught_exceptions() > exceptions_at_begin_;
  if (state.num_deferrals == 0 && state.requested != 0 && !is_answered) End(state.requested);
}

OnInterrupt::OnInterrupt(std::function<void()> say) {
  const std::lock_guard lock(TheState().mutex);
  CHECK(!TheState().say);
  TheState().say = std::move(say);
}

OnInterrupt::~OnInterrupt() {
  const std::lock_guard lock(TheState().mutex);
  TheState().say = nullptr;
}

int InterruptionRequested() { return TheState().requested.load(std::memory_order_relaxed); }

}  // namespace semfoam
