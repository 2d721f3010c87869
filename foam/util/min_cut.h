// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace semfoam {

// A minimum cut of a network between two terminals, the source and the sink (Boykov and Kolmogorov,
// 2004). In whole numbers, so that it is exact; the sum of all capacities must stay below 2^62. The
// same calls in the same order give the same cut.
class MinCut {
 public:
  explicit MinCut(size_t num_nodes);
  ~MinCut();
  MinCut(const MinCut&) = delete;
  MinCut& operator=(const MinCut&) = delete;

  // Adds an edge between two nodes. `forth` is what it costs if `from` is on the source's side and
  // `to` on the sink's, `back` the reverse; both >= 0.
  void AddEdge(size_t from, size_t to, int64_t forth, int64_t back);
  // Adds what it costs to separate a node from the source and from the sink; both >= 0. Once for
  // each node.
  void AddTerminals(size_t node, int64_t from_source, int64_t to_sink);

  // Computes the cut. Returns [nodes] whether each is on the source's side; of several minimum cuts
  // it is the one with the fewest nodes there. Must be called once.
  std::vector<uint8_t> SourceSide();

 private:
  struct Network;
  const size_t num_nodes_;
  std::unique_ptr<Network> network_;
};

}  // namespace semfoam
