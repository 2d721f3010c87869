// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"
#include "plugin/photo/size_text.h"
#include "tools/masks/mask_analysis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostPhotos = 20;    // of the suspicious ones, in the text
constexpr size_t kMostIds = 40;       // in the text
constexpr size_t kMostFindings = 4;   // of a photo, in the text
constexpr double kSmallShare = 0.01;  // of the photo: a small fragment

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

std::string Count(size_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

// "7 (mug)", or "7".
std::string LabelText(const std::vector<Label>& labels, ClassIndex class_index) {
  const Label& label = labels[Value(class_index)];
  const std::string id = std::to_string(Value(label.source_id));
  return label.name.empty() ? id : id + " (" + OneLine(label.name) + ")";
}

// "a, b and c".
std::string Enumerate(const std::vector<Label>& labels, const std::vector<ClassIndex>& classes) {
  std::string text;
  for (size_t i = 0; i < classes.size(); ++i) {
    if (i > 0) text += i + 1 == classes.size() ? " and " : ", ";
    text += LabelText(labels, classes[i]);
  }
  return text;
}

// Returns how many there are of each, "62 of 640 x 480, 2 of 320 x 240".
std::string Tally(const std::map<std::string, int>& counts) {
  std::string text;
  for (const auto& [what, count] : counts) {
    if (!text.empty()) text += ", ";
    if (counts.size() > 1) text += std::to_string(count) + " of ";
    text += what;
  }
  return text;
}

void AppendFileLines(const MaskAnalysis& analysis, std::vector<std::string>* lines) {
  std::map<std::string, int> formats, sizes;
  int other_size = 0;
  for (size_t i = 0; i < analysis.files.size(); ++i) {
    const MaskFile& file = analysis.files[i];
    if (file.format.empty()) continue;
    ++formats[file.format];
    ++sizes[SizeText(file.size)];
    other_size += file.size != analysis.sizes[i];
  }
  const auto paired = static_cast<size_t>(analysis.pairing.NumPaired());
  lines->push_back(Count(paired, "mask") + " for " + Count(analysis.files.size(), "photo") + ", " +
                   std::to_string(analysis.pairing.unused.size()) + " more of no photo");
  if (!formats.empty()) lines->push_back("Format: " + Tally(formats));
  if (!sizes.empty()) {
    lines->push_back("Size: " + Tally(sizes) +
                     (other_size > 0
                          ? "; " + std::to_string(other_size) + " of another size than the photo"
                          : std::string()));
  }
  lines->push_back(std::string("pred.json: ") + (analysis.has_predictions ? "yes" : "none"));
}

void AppendCoverageLines(const MaskAnalysis& analysis, std::vector<std::string>* lines) {
  std::vector<double> shares;
  for (const double share : analysis.coverage.unlabelled) {
    if (std::isfinite(share)) shares.push_back(share);
  }
  if (shares.empty()) return;
  std::sort(shares.begin(), shares.end());
  const bool zero_is_class = !analysis.photos.given.labels.empty() &&
                             analysis.photos.given.labels[0].source_id == kZeroMaskId;
  lines->push_back(
      Format("Id 0 covers %.1f %% to %.1f %% of a photo, half of them %.1f %% or more; "
             "it is taken for %s",
             100 * shares.front(),
             100 * shares.back(),
             100 * shares[shares.size() / 2],
             zero_is_class ? "the background" : "unlabelled"));
}

void AppendIdLines(const MaskAnalysis& analysis, std::vector<std::string>* lines) {
  const std::vector<Label>& labels = analysis.photos.given.labels;
  std::vector<const IdSurvey*> ids;
  ids.reserve(analysis.coverage.ids.size());
  for (const IdSurvey& id : analysis.coverage.ids) ids.push_back(&id);
  // Those of the most photos, if not all have room; but in their order.
  const size_t all = ids.size();
  std::stable_sort(ids.begin(), ids.end(), [](const IdSurvey* a, const IdSurvey* b) {
    return a->views.size() > b->views.size();
  });
  ids.resize(std::min(ids.size(), kMostIds));
  std::sort(ids.begin(), ids.end(), [](const IdSurvey* a, const IdSurvey* b) {
    return a->given_class < b->given_class;
  });
  lines->push_back(Count(all, "id") + " (share of the photos that have it)");
  lines->push_back(
      Format("  %8s  %-20s %6s %8s %8s %8s", "id", "name", "photos", "least", "median", "most"));
  for (const IdSurvey* id : ids) {
    const Label& label = labels[Value(id->given_class)];
    lines->push_back(Format("  %8u  %-20.100s %6zu %6.2f %% %6.2f %% %6.2f %%",
                            Value(label.source_id),
                            OneLine(label.name).c_str(),
                            id->views.size(),
                            100 * id->least,
                            100 * id->median,
                            100 * id->most));
  }
  if (all > ids.size()) {
    lines->push_back("  and " + std::to_string(all - ids.size()) + " more, in fewer photos");
  }
}

void AppendSuspicionLines(const MaskAnalysis& analysis, std::vector<std::string>* lines) {
  const auto small = std::count_if(
      analysis.suspicious.begin(), analysis.suspicious.end(), [](const SuspiciousPhoto& photo) {
        return std::all_of(photo.findings.begin(), photo.findings.end(), [](const MaskFinding& f) {
          return f.fault == MaskFault::kFragment && f.share < kSmallShare;
        });
      });
  std::string head = Count(analysis.suspicious.size(), "suspicious photo");
  if (small > 0) head += ", " + std::to_string(small) + " of them only for small fragments";
  lines->push_back(head + (analysis.suspicious.empty() ? "" : "; the most suspicious first"));
  for (size_t i = 0; i < std::min(kMostPhotos, analysis.suspicious.size()); ++i) {
    const SuspiciousPhoto& photo = analysis.suspicious[i];
    std::string line = "  " + analysis.photos.photos[photo.view].name + ": ";
    for (size_t k = 0; k < photo.findings.size(); ++k) {
      if (k > 0) line += "; ";
      if (k == kMostFindings) {
        line += std::to_string(photo.findings.size() - k) + " more";
        break;
      }
      line += DescribeFinding(analysis, photo.findings[k]);
    }
    lines->push_back(OneLine(line));
  }
  if (analysis.suspicious.size() > kMostPhotos) {
    lines->push_back("  and " + std::to_string(analysis.suspicious.size() - kMostPhotos) + " more");
  }
}

Json LabelJson(const std::vector<Label>& labels, ClassIndex class_index) {
  Json json = {{"id", Value(labels[Value(class_index)].source_id)}};
  if (!labels[Value(class_index)].name.empty()) json["name"] = labels[Value(class_index)].name;
  return json;
}

Json FindingJson(const MaskAnalysis& analysis, const MaskFinding& finding) {
  Json json = {{"fault", FaultName(finding.fault)}};
  if (finding.given_class != kUnlabelled) {
    json["region"] = LabelJson(analysis.photos.given.labels, finding.given_class);
  }
  json["is"] = Json::array();
  for (const ClassIndex c : finding.classes) {
    json["is"].push_back(LabelJson(analysis.photos.labels, c));
  }
  json["points"] = finding.num_points;
  if (finding.given_class != kUnlabelled) json["share"] = finding.share;
  json["text"] = DescribeFinding(analysis, finding);
  return json;
}

Json ConsistencyJson(const MaskConsistencyReport& report) {
  Json json = {{"method",
                report.used == MaskConsistency::kTracks        ? "tracks"
                : report.used == MaskConsistency::kIndependent ? "independent"
                                                               : "off"}};
  if (report.used == MaskConsistency::kOff) return json;
  json["regions"] = report.num_regions;
  json["renamed"] = report.num_renamed;
  json["split"] = report.num_split;
  json["dropped"] = report.num_dropped;
  json["unjudged"] = report.num_unjudged;
  json["labels_before"] = report.labels_before;
  json["labels_after"] = report.labels_after;
  json["agreement_before"] = report.agreement_before;
  json["agreement_after"] = report.agreement_after;
  return json;
}

}  // namespace

std::string DescribeFinding(const MaskAnalysis& analysis, const MaskFinding& finding) {
  const std::string what =
      finding.given_class == kUnlabelled
          ? ""
          : "id " + LabelText(analysis.photos.given.labels, finding.given_class);
  const std::string others = Enumerate(analysis.photos.labels, finding.classes);
  const std::string points = ": " + Count(finding.num_points, "point");
  const MaskFile& file = analysis.files[finding.view];
  switch (finding.fault) {
    case MaskFault::kUnreadable:
      return "its mask is unreadable: " + file.error;
    case MaskFault::kWrongAspect:
      return "its mask is " + SizeText(file.size) + ", the photo " +
             SizeText(analysis.sizes[finding.view]);
    case MaskFault::kNone:
      return "has no mask";
    case MaskFault::kMissing:
      return others + " is missing" + points;
    case MaskFault::kSwitched:
    case MaskFault::kNewId:
      return what + " is " + others + points;
    case MaskFault::kMerged:
      return what + " holds " + others + points;
    case MaskFault::kContradicted:
      return what + " is something else" + points;
    case MaskFault::kFragment:
      if (finding.share < kSmallShare) {
        return what + Format(" is a fragment: %.1f %%", 100 * finding.share);
      }
      return what + Format(" is in hardly any photo, and nothing tells what it is: %.1f %%",
                           100 * finding.share);
  }
  return "";
}

std::vector<std::string> MaskReportLines(const MaskAnalysis& analysis) {
  std::vector<std::string> lines;
  AppendFileLines(analysis, &lines);
  AppendCoverageLines(analysis, &lines);
  AppendIdLines(analysis, &lines);
  if (analysis.has_model) {
    lines.push_back(analysis.photos.consistency.Line());
  } else {
    lines.push_back(
        "Without a COLMAP model (input_path) nothing tells whether the ids agree from photo to "
        "photo");
  }
  AppendSuspicionLines(analysis, &lines);
  return lines;
}

std::string MaskReportJson(const MaskAnalysis& analysis) {
  Json json = {{"version", 1},
               {"photos", analysis.files.size()},
               {"masks", analysis.pairing.NumPaired()},
               {"unused_masks", Json::array()},
               {"pred_json", analysis.has_predictions},
               {"model", analysis.has_model}};
  for (const auto& path : analysis.pairing.unused) {
    json["unused_masks"].push_back(
        path.lexically_relative(analysis.paths.mask_folder).generic_string());
  }
  const std::vector<Label>& labels = analysis.photos.given.labels;
  json["ids"] = Json::array();
  for (const IdSurvey& id : analysis.coverage.ids) {
    Json one = LabelJson(labels, id.given_class);
    one["photos"] = id.views.size();
    one["area"] = {{"least", id.least}, {"median", id.median}, {"most", id.most}};
    json["ids"].push_back(one);
  }
  if (analysis.has_model) json["consistency"] = ConsistencyJson(analysis.photos.consistency);
  json["files"] = Json::array();
  for (size_t i = 0; i < analysis.files.size(); ++i) {
    Json one = {{"photo", analysis.photos.photos[i].name}};
    if (!analysis.pairing.masks[i].empty()) {
      one["mask"] =
          analysis.pairing.masks[i].lexically_relative(analysis.paths.mask_folder).generic_string();
    }
    if (!analysis.files[i].format.empty()) {
      one["format"] = analysis.files[i].format;
      one["size"] = {analysis.files[i].size.width, analysis.files[i].size.height};
    }
    one["photo_size"] = {analysis.sizes[i].width, analysis.sizes[i].height};
    if (analysis.photos.HasMask(static_cast<int>(i))) {
      one["unlabelled"] = analysis.coverage.unlabelled[i];
    }
    json["files"].push_back(one);
  }
  json["suspicious"] = Json::array();
  for (const SuspiciousPhoto& photo : analysis.suspicious) {
    Json one = {{"photo", analysis.photos.photos[photo.view].name},
                {"weight", photo.weight},
                {"findings", Json::array()}};
    for (const MaskFinding& finding : photo.findings) {
      one["findings"].push_back(FindingJson(analysis, finding));
    }
    json["suspicious"].push_back(one);
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace semfoam
