// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace semfoam {

// Counter-based random numbers: the k-th number of a stream is a function of (seed, purpose, index,
// k) alone, so a run draws the same numbers for any scheduling of its threads, and can be resumed
// at any point.
class CounterRandom {
 public:
  CounterRandom(uint64_t seed, uint64_t purpose, uint64_t index)
      : key_(Mix(Mix(Mix(seed) ^ purpose) ^ index)) {}

  uint64_t Next() { return Mix(key_ + kGolden * ++counter_); }

  // Returns a uniform number in [0, 1).
  double Uniform() { return (Next() >> 11) * 0x1p-53; }

  // Returns a uniform number in [0, bound), bound > 0. The bias is below bound / 2^32.
  uint32_t Below(uint32_t bound) { return static_cast<uint32_t>(((Next() >> 32) * bound) >> 32); }

  // Returns a standard normal number (Box and Muller).
  double Normal() {
    const double radius = std::sqrt(-2 * std::log(1 - Uniform()));
    return radius * std::cos(2 * std::numbers::pi * Uniform());
  }

 private:
  static constexpr uint64_t kGolden = 0x9e3779b97f4a7c15;

  // Computes the finaliser of SplitMix64 (Steele, Lea and Flood 2014).
  static uint64_t Mix(uint64_t x) {
    x += kGolden;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return x ^ (x >> 31);
  }

  uint64_t key_;
  uint64_t counter_ = 0;
};

}  // namespace semfoam
