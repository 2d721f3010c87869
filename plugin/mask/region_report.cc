// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/region_report.h"

#include <sstream>

#include <glog/logging.h>

namespace semfoam {

void LogChangedRegions(const Evidence& evidence,
                       const std::vector<PhotoRecord>& photos,
                       const std::vector<Label>& mask_labels,
                       const RegionLabels& labels) {
  for (size_t r = 0; r < evidence.regions.size(); ++r) {
    const Region& region = evidence.regions[r];
    if (region.label == labels.given[r]) continue;
    std::ostringstream text;
    text << photos[region.view].name << ", id " << mask_labels[Value(region.mask_class)].source_id
         << ", " << region.observations.size() << " points: ";
    if (region.label != kNoLabel) {
      text << "is " << labels.labels[Value(region.label)].id;
    } else if (region.parts.empty()) {
      text << "dropped";
    } else {
      text << "split into";
      for (const RegionLabel part : region.parts) text << " " << labels.labels[Value(part)].id;
    }
    VLOG(1) << text.str();
  }
}

void CountRegions(const std::vector<Region>& regions, MaskConsistencyReport* report) {
  for (const Region& region : regions) {
    report->num_split += !region.parts.empty();
    report->num_dropped += region.label == kNoLabel && region.parts.empty();
    report->num_unjudged += !region.is_judged && region.label != kNoLabel;
  }
}

std::vector<RegionReport> ReportRegions(const Evidence& evidence,
                                        const RegionLabels& labels,
                                        const std::vector<char>& is_contradicted,
                                        const std::vector<ClassIndex>& class_of_label) {
  std::vector<RegionReport> reports;
  for (size_t r = 0; r < evidence.regions.size(); ++r) {
    const Region& region = evidence.regions[r];
    RegionReport& report = reports.emplace_back();
    report.view = region.view;
    report.given_class = region.mask_class;
    report.num_pixels = region.num_pixels;
    if (region.label != kNoLabel) report.classes.push_back(class_of_label[Value(region.label)]);
    for (const RegionLabel part : region.parts)
      report.classes.push_back(class_of_label[Value(part)]);
    report.is_renamed = region.label != kNoLabel && region.label != labels.given[r];
    report.is_contradicted = is_contradicted[r] != 0;
    report.num_points = static_cast<int>(region.observations.size());
    for (const uint32_t i : region.observations) {
      const Observation& observation = evidence.observations[i];
      if (observation.verdict == kNoLabel) continue;
      ++report.num_judged;
      report.num_agreeing += observation.verdict == observation.label;
      report.num_as_given += observation.verdict == labels.believed[r];
    }
  }
  return reports;
}

}  // namespace semfoam
