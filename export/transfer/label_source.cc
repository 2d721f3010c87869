// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_source.h"

#include "foam/util/median.h"
#include "foam/util/parallel.h"

#include <iterator>
#include <sstream>
#include <utility>

namespace semfoam {
namespace {

std::string Text(const Eigen::Vector3d& x) {
  std::ostringstream text;
  text.precision(6);
  text << "(" << x.x() << ", " << x.y() << ", " << x.z() << ")";
  return text.str();
}

}  // namespace

LabelSource::Answer FoamLabels::Ask(const Eigen::Vector3d& x,
                                    const Eigen::Vector3d& normal,
                                    uint32_t* hint) const {
  const MatterSearch::Found found = search_.Find(x, normal, hint);
  return {search_.LabelOf(found), found.cell != kNoCell};
}

std::string FoamLabels::Why(const std::vector<Eigen::Vector3d>& places) const {
  std::vector<double> distances(places.size());
  ParallelForBlocks(std::ssize(places), 8, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) distances[k] = search_.DistanceToMatter(places[k]);
  });
  std::ostringstream text;
  text.precision(6);
  text << "are farther than " << search_.tolerance()
       << " from all matter of the foam, half of them farther than " << Median(std::move(distances))
       << MeansApart(places, "the matter", search_.MiddleOfMatter());
  return text.str();
}

std::string MeansApart(const std::vector<Eigen::Vector3d>& places,
                       const std::string& what,
                       const Eigen::Vector3d& mean_of_what) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : places) mean += x / static_cast<double>(places.size());
  std::ostringstream text;
  text.precision(6);
  text << ", and their mean, " << Text(mean) << ", is off that of " << what << ", "
       << Text(mean_of_what) << ", by " << (mean - mean_of_what).norm();
  return text.str();
}

}  // namespace semfoam
