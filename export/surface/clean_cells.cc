// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/clean_cells.h"

#include <algorithm>
#include <array>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// A cell is added only if its radius is at most this many times the mean of those around it.
constexpr double kMaxRadii = 2;
// A cell that photos show is added only if its density times radius is at least this: air that one
// looks through is no mistake.
constexpr float kClear = 0.01f;
// A bridge is cut only where the way around the tunnel has at most this many cells.
constexpr int kMaxLoop = 8;
constexpr double kPitShare = 0.62;
// Pits of several cells fill from their walls.
constexpr int kPitRounds = 5;
// Rounds of the search for tunnels, each of which makes all changes that do not touch each other.
constexpr int kMaxRounds = 20;

constexpr uint32_t kNone = 0xffffffff;

// One or two cells that change sides together.
struct Change {
  double volume;
  std::array<uint32_t, 2> cells;
};

class CellCleaner {
 public:
  CellCleaner(const ExportableScene& scene, const std::vector<uint32_t>& cells)
      : scene_(scene),
        inside_(scene.delaunay.num_cells, 0),
        place_(scene.delaunay.num_cells, kNone),
        mark_(scene.delaunay.num_cells, 0) {
    for (const uint32_t cell : cells) inside_[cell] = 1;
    near_ = cells;
    for (const uint32_t cell : cells) {
      for (const uint32_t next : scene.delaunay.Neighbors(cell)) near_.push_back(next);
    }
    std::sort(near_.begin(), near_.end());
    near_.erase(std::unique(near_.begin(), near_.end()), near_.end());
  }

  CleanCells Clean() {
    CleanCells result;
    FillPits(&result);
    for (int round = 0; round < kMaxRounds; ++round) {
      int64_t closed = Round(/*in_pairs=*/false);
      if (closed == 0) closed = Round(/*in_pairs=*/true);
      if (closed == 0) break;
      result.tunnels += closed;
    }
    for (const uint32_t cell : near_) {
      if (inside_[cell]) result.cells.push_back(cell);
    }
    return result;
  }

 private:
  void FillPits(CleanCells* result) {
    for (int round = 0; round < kPitRounds; ++round) {
      for (const uint32_t cell : near_) {
        if (inside_[cell] || !MayChange(cell) || !IsPit(cell) || Gain(cell) != 0) continue;
        inside_[cell] = 1;
        ++result->pits;
      }
    }
  }

  bool IsPit(uint32_t cell) const {
    double in = 0, all = 0;
    for (const uint32_t next : scene_.delaunay.Neighbors(cell)) {
      const double weight =
          1 / (scene_.cell_positions[next] - scene_.cell_positions[cell]).cast<double>().norm();
      all += weight;
      if (inside_[next]) in += weight;
    }
    return in > kPitShare * all;
  }

  // Makes the changes that lower the genus, those of little volume first. Returns by how much.
  int64_t Round(bool in_pairs) {
    std::vector<Change> changes;
    for (const uint32_t cell : near_) {
      if (!MayChange(cell)) continue;
      const int gain = Gain(cell);
      if (!in_pairs) {
        if (gain > 0) changes.push_back({scene_.volume[cell], {cell, kNone}});
        continue;
      }
      if (gain != 0) continue;
      inside_[cell] ^= 1;
      for (const uint32_t next : scene_.delaunay.Neighbors(cell)) {
        if (next < scene_.NumSites() && inside_[next] != inside_[cell] && MayChange(next) &&
            Gain(next) > 0) {
          changes.push_back({scene_.volume[cell] + scene_.volume[next], {cell, next}});
        }
      }
      inside_[cell] ^= 1;
    }
    std::stable_sort(changes.begin(), changes.end(), [](const Change& a, const Change& b) {
      return a.volume < b.volume;
    });
    int64_t closed = 0;
    for (const Change& change : changes) closed += Make(change);
    return closed;
  }

  // Makes a change if it still lowers the genus. Returns by how much.
  int64_t Make(const Change& change) {
    const bool is_pair = change.cells[1] != kNone;
    if (!MayChange(change.cells[0])) return 0;
    if (!is_pair) {
      const int gain = Gain(change.cells[0]);
      if (gain <= 0 || Splits(change.cells[0])) return 0;
      inside_[change.cells[0]] ^= 1;
      return gain;
    }
    if (inside_[change.cells[1]] != inside_[change.cells[0]] || Gain(change.cells[0]) != 0)
      return 0;
    inside_[change.cells[0]] ^= 1;
    const int gain = MayChange(change.cells[1]) ? Gain(change.cells[1]) : 0;
    const bool is_good = gain > 0 && !Splits(change.cells[1]);
    inside_[change.cells[0]] ^= 1;
    if (!is_good) return 0;
    for (const uint32_t cell : change.cells) inside_[cell] ^= 1;
    return gain;
  }

  bool MayChange(uint32_t cell) const {
    if (cell >= scene_.NumSites()) return false;
    if (inside_[cell]) return true;
    if (scene_.object_of_cell[cell] >= 0) return false;
    if (IsClearAir(scene_, cell)) return false;
    double sum = 0;
    int count = 0;
    for (const uint32_t next : scene_.delaunay.Neighbors(cell)) {
      if (!inside_[next]) continue;
      sum += scene_.radius[next];
      ++count;
    }
    return count > 0 && scene_.radius[cell] * count <= kMaxRadii * sum;
  }

  // By how much the Euler characteristic of the object rises if the cell changes sides; -1 where it
  // falls, or where the cell would join parts of the other side.
  int Gain(uint32_t cell) {
    const auto neighbors = scene_.delaunay.Neighbors(cell);
    // Union-find over the link: neighbours on the same side that share a triangle's edge.
    root_.resize(neighbors.size());
    for (uint32_t k = 0; k < root_.size(); ++k) {
      root_[k] = k;
      place_[neighbors[k]] = k;
    }
    int parts[2] = {0, 0};
    for (const uint32_t next : neighbors) ++parts[inside_[next]];
    if (parts[0] == 0 || parts[1] == 0) return -1;
    for (const uint32_t tet : scene_.tets_of_cells.Of(cell)) {
      const auto& corners = scene_.delaunay.tets[tet];
      for (int a = 0; a < 4; ++a) {
        for (int b = a + 1; b < 4; ++b) {
          if (corners[a] == cell || corners[b] == cell) continue;
          if (inside_[corners[a]] != inside_[corners[b]]) continue;
          const uint32_t x = Root(place_[corners[a]]), y = Root(place_[corners[b]]);
          if (x == y) continue;
          root_[std::max(x, y)] = std::min(x, y);
          --parts[inside_[corners[a]]];
        }
      }
    }
    const int side = inside_[cell];
    return parts[1 - side] == 1 ? parts[side] - 1 : -1;
  }

  uint32_t Root(uint32_t k) const {
    while (root_[k] != k) k = root_[k];
    return k;
  }

  // Whether the neighbours of a cell on the side that it would leave are no longer connected
  // without it, or, for a cell of the object, only on a long way around: then it is part of a
  // handle.
  bool Splits(uint32_t cell) {
    const uint8_t side = inside_[cell];
    ++stamp_;
    mark_[cell] = stamp_;
    std::vector<uint32_t> reached;
    size_t to_find = 0, end_of_step = 1;
    int steps = 0;
    for (const uint32_t next : scene_.delaunay.Neighbors(cell)) {
      if (inside_[next] != side) continue;
      ++to_find;
      if (!reached.empty()) continue;
      reached.push_back(next);
      mark_[next] = stamp_;
    }
    for (size_t k = 0; k < reached.size(); ++k) {
      if (k == end_of_step) {
        end_of_step = reached.size();
        if (side == 1 && ++steps > kMaxLoop) return true;
      }
      if (IsNeighbor(reached[k], cell) && --to_find == 0) return false;
      for (const uint32_t next : scene_.delaunay.Neighbors(reached[k])) {
        if (inside_[next] != side || mark_[next] == stamp_) continue;
        mark_[next] = stamp_;
        reached.push_back(next);
      }
    }
    return to_find > 0;
  }

  bool IsNeighbor(uint32_t a, uint32_t b) const {
    const auto neighbors = scene_.delaunay.Neighbors(a);
    return std::binary_search(neighbors.begin(), neighbors.end(), b);
  }

  const ExportableScene& scene_;
  std::vector<uint8_t> inside_;
  // The object's cells and their neighbours, ascending.
  std::vector<uint32_t> near_;
  // Place of a cell among the neighbours of the one that is looked at.
  std::vector<uint32_t> place_;
  std::vector<uint32_t> root_;
  std::vector<uint32_t> mark_;
  uint32_t stamp_ = 0;
};

}  // namespace

bool IsClearAir(const ExportableScene& scene, uint32_t cell) {
  return scene.seen[cell] != 0 && scene.density[cell] * scene.radius[cell] < kClear;
}

CleanCells FillPitsAndTunnels(const ExportableScene& scene, const std::vector<uint32_t>& cells) {
  CHECK(std::is_sorted(cells.begin(), cells.end()));
  return CellCleaner(scene, cells).Clean();
}

}  // namespace semfoam
