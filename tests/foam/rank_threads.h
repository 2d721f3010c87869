// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/rank_group.h"

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

namespace semfoam {

// Ranks that are threads of this process.
class RankThreads {
 public:
  explicit RankThreads(int num_ranks) {
    for (int rank = 0; rank < num_ranks; ++rank) {
      ranks_.push_back(std::make_unique<Member>(this, rank));
    }
    called_.assign(num_ranks, 0);
    ended_.assign(num_ranks, false);
    for (auto& sent : sent_) sent.resize(num_ranks);
  }

  // Calls `body` on each rank, and ends it. Returns what each has thrown, or null [num_ranks].
  std::vector<std::exception_ptr> Run(const std::function<void(RankGroup*)>& body) {
    std::vector<std::exception_ptr> thrown(ranks_.size());
    std::vector<std::thread> threads;
    for (size_t rank = 0; rank < ranks_.size(); ++rank) {
      threads.emplace_back([&, rank] {
        try {
          body(ranks_[rank].get());
        } catch (...) {
          thrown[rank] = std::current_exception();
        }
        ranks_[rank]->End(thrown[rank] != nullptr);
      });
    }
    for (std::thread& thread : threads) thread.join();
    return thrown;
  }

 private:
  class Member final : public RankGroup {
   public:
    Member(RankThreads* all, int rank) : all_(*all), rank_(rank) {}
    int rank() const override { return rank_; }
    int num_ranks() const override { return static_cast<int>(all_.ranks_.size()); }

    std::vector<std::span<const std::byte>> Gather(std::span<const std::byte> own) override {
      std::unique_lock lock(all_.mutex_);
      // Whoever reads the call before this one has not begun the one after it.
      std::vector<std::vector<std::byte>>& sent = all_.sent_[all_.called_[rank_]++ % 2];
      sent[rank_].assign(own.begin(), own.end());
      all_.changed_.notify_all();
      const int call = all_.called_[rank_];
      for (int other = 0; other < num_ranks(); ++other) {
        all_.changed_.wait(lock, [&] { return all_.called_[other] >= call || all_.ended_[other]; });
        if (all_.called_[other] < call) throw LostRank("Rank ", other, " was lost.");
      }
      return {sent.begin(), sent.end()};
    }

    bool End(bool has_failed) override {
      std::unique_lock lock(all_.mutex_);
      if (rank_ == 0 && !all_.ended_[0]) all_.first_has_failed_ = has_failed;
      all_.ended_[rank_] = true;
      all_.changed_.notify_all();
      all_.changed_.wait(lock, [&] { return all_.ended_[0]; });
      return all_.first_has_failed_;
    }

   private:
    RankThreads& all_;
    const int rank_;
  };

  std::vector<std::unique_ptr<Member>> ranks_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // [num_ranks] Number of calls of Gather, and whether the rank has ended.
  std::vector<int> called_;
  std::vector<bool> ended_;
  bool first_has_failed_ = false;
  // What each has sent in this call and in the one before or after it.
  std::vector<std::vector<std::byte>> sent_[2];
};

}  // namespace semfoam
