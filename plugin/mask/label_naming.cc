// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/label_naming.h"

#include "foam/util/ids.h"
#include "foam/util/input_file.h"
#include "plugin/mask/mask_tables.h"

#include <algorithm>
#include <map>
#include <set>

namespace semfoam {

namespace fs = std::filesystem;

void NameLabels(const fs::path& labels_file, std::vector<Label>* labels) {
  std::multimap<MaskId, LabelName> names;  // by the masks' ids
  for (LabelName& name : ReadLabelNames(labels_file)) names.emplace(name.source_id, name);
  for (Label& label : *labels) {
    const auto [begin, end] = names.equal_range(label.source_id);
    if (begin == end) continue;
    const auto same_id =
        std::find_if(begin, end, [&](const auto& entry) { return entry.second.id == label.id; });
    label.name = (same_id != end ? same_id : begin)->second.name;
  }
}

std::string UnusedNamesWarning(const fs::path& labels_file, const std::vector<Label>& labels) {
  constexpr size_t kMostNamed = 3;
  std::set<MaskId> ids = {kZeroMaskId};
  for (const Label& label : labels) ids.insert(label.source_id);
  const std::vector<LabelName> names = ReadLabelNames(labels_file);
  size_t unused = 0;
  std::string first;
  for (const LabelName& name : names) {
    if (ids.contains(name.source_id)) continue;
    if (++unused > kMostNamed) continue;
    first += (unused == 1 ? "" : ", ") + std::to_string(Value(name.source_id)) + " (" +
             Shortened(name.name) + ")";
  }
  if (unused == 0) return "";
  return labels_file.string() + ": " + std::to_string(unused) + " of its " +
         std::to_string(names.size()) + " names are of ids that no mask has: " + first +
         (unused > kMostNamed ? ", ..." : "") + "; names of the masks' own ids would be right.";
}

}  // namespace semfoam
