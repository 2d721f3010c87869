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
#include <vector>

#include <pthread.h>

namespace semfoam {
namespace {

// A signal that arrives again within this time is the same one: timeout(1) sends it to the process
// and then to its group, and so do some batch systems.
constexpr std::chrono::seconds kRepetition(1);

struct State {
  // Guards num_deferrals and callbacks.
  std::mutex mutex;
  // Number of objects of DeferInterruption.
  int num_deferrals = 0;
  // The functions of all OnInterrupt, the oldest first.
  std::vector<std::pair<const OnInterrupt*, std::function<void()>>> callbacks;
  // The signal held back; 0: none.
  std::atomic<int> requested = 0;
};

// Returns the state of the process. Never destroyed: the waiting thread outlives the end of main.
State& GlobalState() {
  static State& state = *new State;
  return state;
}

// Ends the process. The caller holds the state's mutex.
[[noreturn]] void End(int signal) {
  for (const auto& [owner, callback] : GlobalState().callbacks) callback();
  RemoveScratchFoldersAndExit(Interruption(signal).ExitCode());
}

[[noreturn]] void WaitForSignals(const sigset_t& signals) {
  using Clock = std::chrono::steady_clock;
  State& state = GlobalState();
  Clock::time_point requested_at;
  while (true) {
    int signal = 0;
    if (sigwait(&signals, &signal) != 0) continue;
    const std::lock_guard lock(state.mutex);
    if (state.requested == signal && Clock::now() - requested_at < kRepetition) continue;
    if (state.num_deferrals == 0 || state.requested != 0) End(signal);
    state.requested = signal;
    requested_at = Clock::now();
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
  const std::lock_guard lock(GlobalState().mutex);
  ++GlobalState().num_deferrals;
}

DeferInterruption::~DeferInterruption() {
  State& state = GlobalState();
  const std::lock_guard lock(state.mutex);
  --state.num_deferrals;
  const bool is_unwinding = std::uncaught_exceptions() > exceptions_at_begin_;
  if (state.num_deferrals == 0 && state.requested != 0 && !is_unwinding) End(state.requested);
}

OnInterrupt::OnInterrupt(std::function<void()> callback) {
  const std::lock_guard lock(GlobalState().mutex);
  GlobalState().callbacks.emplace_back(this, std::move(callback));
}

OnInterrupt::~OnInterrupt() {
  const std::lock_guard lock(GlobalState().mutex);
  std::erase_if(GlobalState().callbacks, [this](const auto& entry) { return entry.first == this; });
}

int InterruptionRequested() { return GlobalState().requested.load(std::memory_order_relaxed); }

}  // namespace semfoam
