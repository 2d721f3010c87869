// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/util/parallel.h"
#include "tools/benchmark/bytes.h"
#include "tools/benchmark/case.h"
#include "tools/benchmark/cases.h"
#include "tools/benchmark/peak_memory.h"
#include "tools/benchmark/scenes.h"

#include <string>
#include <vector>

namespace semfoam {

// From sites to tetrahedra and neighbours. The triangulation itself is sequential; only the lists
// of neighbours are made in parallel. The minimum of its memory traffic is unknown; reading the
// sites and writing the result is a lower bound.
void RegisterDelaunayCases(int64_t num_sites) {
  RegisterParallelCase(
      "delaunay/" + std::to_string(num_sites), [num_sites](benchmark::State& state, int threads) {
        const std::vector<Eigen::Vector3f> cells =
            WithGuardSites(MakeShellSites(num_sites).positions);
        const ThreadLimit limit(threads);
        Stopwatch watch;
        int64_t sites = 0;
        size_t bytes = 0;
        const PeakMemory peak;
        for ([[maybe_unused]] auto iteration : state) {
          const Stopwatch::Lap lap(&watch);
          const Delaunay delaunay = Triangulate(cells);
          sites += delaunay.num_sites;
          bytes = BytesOf(delaunay);
        }
        const double peak_bytes = static_cast<double>(peak.BytesAbove());
        state.counters["sites_per_second"] = Rate(sites, watch);
        state.counters["bytes_per_site"] = Same(double(bytes) / num_sites);
        state.counters["touched_per_site"] = Same(double(bytes + BytesOf(cells)) / num_sites);
        if (peak_bytes > 0) state.counters["peak_bytes"] = Same(peak_bytes);
      });
}

}  // namespace semfoam
