// SPDX-License-Identifier: GPL-3.0-or-later
//
// All that knows MPI.
#include "tools/cli/mpi_ranks.h"

#include "foam/util/error.h"

#ifdef SEMFOAM_HAS_MPI

#include "foam/util/elapsed_time.h"
#include "foam/util/interruption.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <glog/logging.h>
#include <mpi.h>

namespace semfoam {
namespace {

using Clock = std::chrono::steady_clock;

// Ranks take the same time for an iteration, give or take less than this, or than twice the longest
// wait so far. Open MPI's mpirun kills all processes two seconds after it has lost one, unless it
// is told otherwise.
constexpr double kLongestAnswer = 0.5;
// While ranks wait for less than this, they do not sleep, which would cost some 50 us each time.
constexpr std::chrono::milliseconds kBusyWait(10);
// How long rank 0 tries to tell others that they may end.
constexpr std::chrono::seconds kLongestFarewell(2);

// Bytes are exchanged in units, so that MPI's counts, which are int, suffice for 128 GB.
constexpr size_t kUnit = 64;

enum Tag { kHeaderTag, kFarewellTag };

// Precedes each exchange. What fits into it needs no other message.
struct Header {
  // Of what is sent; kEnded: nothing comes any more.
  int64_t bytes = 0;
  std::byte content[kUnit - sizeof(int64_t)];
};
static_assert(sizeof(Header) == kUnit);
constexpr int64_t kEnded = -1;

// Whether the launcher has sent SIGCONT since the last exchange.
std::atomic<bool> was_continued = false;
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void NoteContinuation(int) { was_continued = true; }

class MpiRanks final : public RankGroup {
 public:
  MpiRanks() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);  // ends the job if it fails
    if (provided < MPI_THREAD_FUNNELED) {
      throw FieldError("mpi",
                       " is 1, and this MPI does not allow a process to have threads; one that "
                       "does, such as Debian's Open MPI, would be right.");
    }
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &num_ranks_);
    MPI_Type_contiguous(kUnit, MPI_BYTE, &unit_);
    MPI_Type_commit(&unit_);
    headers_.resize(num_ranks_);
    std::signal(SIGCONT, NoteContinuation);
  }

  // Where a rank is lost, MPI_Finalize would wait for it.
  ~MpiRanks() override {
    if (ends_in_order_) MPI_Finalize();
  }

  int rank() const override { return rank_; }
  int num_ranks() const override { return num_ranks_; }

  std::vector<std::span<const std::byte>> Gather(std::span<const std::byte> own) override {
    if (lost_) throw LostRank(*lost_);
    const Clock::time_point begin = Clock::now();
    Header& header = headers_[rank_];
    header.bytes = std::ssize(own);
    if (own.size() <= sizeof(header.content) && !own.empty()) {
      std::memcpy(header.content, own.data(), own.size());
    }
    ExchangeHeaders();
    bool has_more = false;
    for (int rank = 0; rank < num_ranks_; ++rank) {
      if (headers_[rank].bytes == kEnded) {
        Lose("Rank " + std::to_string(rank) + " of " + std::to_string(num_ranks_) +
             " has ended by an error of its own");
      }
      has_more |= headers_[rank].bytes > std::ssize(header.content);
    }
    std::vector<std::span<const std::byte>> all;
    if (has_more) {
      ExchangeContents(own);
      ++num_exchanges_;
      sent_bytes_ += std::ssize(own);
      received_bytes_ += std::ssize(received_) - std::ssize(own);
      const double seconds = SecondsSince(begin);
      seconds_ += seconds;
      longest_seconds_ = std::max(longest_seconds_, seconds);
      for (int rank = 0; rank < num_ranks_; ++rank) {
        all.emplace_back(received_.data() + begin_[rank] * kUnit, headers_[rank].bytes);
      }
    } else {
      for (const Header& of_rank : headers_) all.emplace_back(of_rank.content, of_rank.bytes);
    }
    was_continued = false;
    return all;
  }

  bool End(bool has_failed) override {
    ends_in_order_ = !lost_ && !has_failed;
    if (has_failed && !lost_) {
      headers_[rank_].bytes = kEnded;
      SendToAll(&headers_[rank_], 1, unit_, kHeaderTag);
    }
    uint8_t first_has_failed = has_failed;
    if (rank_ == 0) {
      if (ends_in_order_) LogExchanges();
      SendToAll(&first_has_failed, 1, MPI_BYTE, kFarewellTag);
      return has_failed;
    }
    MPI_Request request = MPI_REQUEST_NULL;
    int is_done = 0;
    bool is_reached =
        MPI_Irecv(&first_has_failed, 1, MPI_BYTE, 0, kFarewellTag, MPI_COMM_WORLD, &request) ==
        MPI_SUCCESS;
    while (is_reached && !is_done) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      is_reached = MPI_Test(&request, &is_done, MPI_STATUS_IGNORE) == MPI_SUCCESS;
    }
    return is_reached && first_has_failed != 0;
  }

 private:
  // Nearly all exchanges are those of iterations.
  void LogExchanges() const {
    if (num_exchanges_ == 0 || num_ranks_ == 1) return;
    const double count = static_cast<double>(num_exchanges_);
    char text[200];
    std::snprintf(text,
                  sizeof(text),
                  "On average, an iteration sent %.2f MB from rank 0 to each of the others, and "
                  "received %.2f MB; with the wait for the slowest rank that took %.1f ms",
                  static_cast<double>(sent_bytes_) / count / 1e6,
                  static_cast<double>(received_bytes_) / count / 1e6,
                  seconds_ / count * 1e3);
    LOG(INFO) << text;
  }

  [[noreturn]] void Lose(const std::string& what) {
    lost_.emplace(what,
                  "; the same command with ",
                  Field{"resume"},
                  " 1, on any number of ranks, goes on from the newest checkpoint.");
    throw LostRank(*lost_);
  }

  // Returns the name of the rank that is lost, where MPI does not tell which: of two, the other
  // one.
  std::string AnotherRank() const {
    const std::string of_all = " of " + std::to_string(num_ranks_);
    return num_ranks_ == 2 ? "Rank " + std::to_string(1 - rank_) + of_all : "A rank" + of_all;
  }

  void Require(int error) {
    if (error == MPI_SUCCESS) return;
    char text[MPI_MAX_ERROR_STRING] = "";
    int length = 0;
    MPI_Error_string(error, text, &length);
    Lose(AnotherRank() + " was lost (" + std::string(text, length) + ")");
  }

  void ExchangeHeaders() {
    std::vector<MPI_Request> requests;
    for (int rank = 0; rank < num_ranks_; ++rank) {
      if (rank == rank_) continue;
      Require(MPI_Irecv(&headers_[rank],
                        1,
                        unit_,
                        rank,
                        kHeaderTag,
                        MPI_COMM_WORLD,
                        &requests.emplace_back(MPI_REQUEST_NULL)));
    }
    const size_t num_received = requests.size();
    for (int rank = 0; rank < num_ranks_; ++rank) {
      if (rank == rank_) continue;
      Require(MPI_Isend(&headers_[rank_],
                        1,
                        unit_,
                        rank,
                        kHeaderTag,
                        MPI_COMM_WORLD,
                        &requests.emplace_back(MPI_REQUEST_NULL)));
    }
    if (Wait(&requests)) return;
    std::string silent;
    for (size_t k = 0; k < num_received; ++k) {
      int is_done = 0;
      if (requests[k] != MPI_REQUEST_NULL) MPI_Test(&requests[k], &is_done, MPI_STATUS_IGNORE);
      if (requests[k] == MPI_REQUEST_NULL) continue;
      silent += (silent.empty() ? "Rank " : ", ") + std::to_string(k < size_t(rank_) ? k : k + 1);
    }
    Lose((silent.empty() ? AnotherRank() : silent + " of " + std::to_string(num_ranks_)) +
         " was lost");
  }

  // Receives, into received_, what does not fit into headers.
  void ExchangeContents(std::span<const std::byte> own) {
    std::vector<int> units;
    begin_.clear();
    int64_t total = 0;
    for (const Header& header : headers_) {
      begin_.push_back(static_cast<int>(total));
      units.push_back(static_cast<int>((header.bytes + kUnit - 1) / kUnit));
      total += units.back();
      CHECK_LE(total, INT32_MAX);
    }
    received_.resize(total * kUnit);
    if (!own.empty()) std::memcpy(received_.data() + begin_[rank_] * kUnit, own.data(), own.size());
    std::vector<MPI_Request> request = {MPI_REQUEST_NULL};
    Require(MPI_Iallgatherv(MPI_IN_PLACE,
                            0,
                            MPI_DATATYPE_NULL,
                            received_.data(),
                            units.data(),
                            begin_.data(),
                            unit_,
                            MPI_COMM_WORLD,
                            request.data()));
    if (!Wait(&request)) Lose(AnotherRank() + " was lost");
  }

  // Waits for all requests. Returns false where they are not done, on rank 0, a while after the
  // launcher has begun to end the job, and on the others when rank 0 has allowed them to end.
  bool Wait(std::vector<MPI_Request>* requests) {
    const Clock::time_point begin = Clock::now();
    std::optional<Clock::time_point> ends_since;
    while (true) {
      int is_done = 0;
      Require(MPI_Testall(
          static_cast<int>(requests->size()), requests->data(), &is_done, MPI_STATUSES_IGNORE));
      if (is_done) return true;
      const Clock::time_point now = Clock::now();
      int may_end = 0;
      if (rank_ != 0) {
        Require(MPI_Iprobe(0, kFarewellTag, MPI_COMM_WORLD, &may_end, MPI_STATUS_IGNORE));
      }
      if (may_end) return false;
      if (rank_ == 0 && (was_continued || InterruptionRequested() != 0)) {
        if (!ends_since) ends_since = now;
        if (SecondsSince(*ends_since) > std::max(kLongestAnswer, 2 * longest_seconds_))
          return false;
      }
      if (now - begin < kBusyWait) {
        std::this_thread::yield();
      } else {
        std::this_thread::sleep_for(std::chrono::microseconds(50));
      }
    }
  }

  // Sends to all other ranks, some of which may be lost. `message` must live as long as this.
  void SendToAll(const void* message, int count, MPI_Datatype type, Tag tag) {
    std::vector<MPI_Request> requests;
    for (int rank = 0; rank < num_ranks_; ++rank) {
      if (rank == rank_) continue;
      MPI_Request request = MPI_REQUEST_NULL;
      if (MPI_Isend(message, count, type, rank, tag, MPI_COMM_WORLD, &request) == MPI_SUCCESS) {
        requests.push_back(request);
      }
    }
    const Clock::time_point begin = Clock::now();
    for (MPI_Request& request : requests) {
      int is_done = 0;
      while (!is_done && Clock::now() - begin < kLongestFarewell &&
             MPI_Test(&request, &is_done, MPI_STATUS_IGNORE) == MPI_SUCCESS) {
        std::this_thread::yield();
      }
    }
  }

  int rank_ = 0;
  int num_ranks_ = 1;
  MPI_Datatype unit_ = MPI_DATATYPE_NULL;
  std::optional<LostRank> lost_;
  bool ends_in_order_ = false;
  // Of exchanges that did not fit into headers.
  int64_t num_exchanges_ = 0;
  int64_t sent_bytes_ = 0;
  int64_t received_bytes_ = 0;
  double seconds_ = 0;
  double longest_seconds_ = 0;
  // [num_ranks] Of the last exchange.
  std::vector<Header> headers_;
  // What all have sent, and where that of each begins, in units.
  std::vector<std::byte> received_;
  std::vector<int> begin_;
};

}  // namespace

std::unique_ptr<RankGroup> JoinMpiRanks() { return std::make_unique<MpiRanks>(); }

}  // namespace semfoam

#else

namespace semfoam {

std::unique_ptr<RankGroup> JoinMpiRanks() {
  throw FieldError("mpi",
                   " is 1, and this program was built without MPI; build it with "
                   "-DSEMFOAM_MPI=ON, or leave the option out.");
}

}  // namespace semfoam

#endif
