// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// Which labels a user means: ids and names, separated by commas ("mug, 7").
//
// A name is the label's own, or "label_<id>" where it has none; where several labels share a name,
// all of them are meant. "id:7" is an id and "name:7" a name, whatever else is called "7". A plain
// text that is the id of one label and the name of another one is refused as ambiguous.
struct LabelChoice {
  std::string labels = {};          // these alone; empty = all
  std::string exclude_labels = {};  // but not these; empty = none

  bool IsAll() const { return labels.empty() && exclude_labels.empty(); }
};

// A label as users see it.
struct NamedLabel {
  LabelId id = kNoObject;
  std::string name;  // DisplayName
};

// What a LabelChoice comes to among the labels that there are.
struct LabelFilter {
  std::optional<std::set<LabelId>> only = {};  // nothing = all
  std::set<LabelId> excluded = {};

  bool IsAll() const { return !only && excluded.empty(); }
  bool Has(LabelId id) const { return (!only || only->count(id) != 0) && excluded.count(id) == 0; }
};

// One text of a choice, and the ids that it means: none where no label is so called.
struct LabelText {
  std::string text;
  std::vector<LabelId> ids;
};

// Looks up the texts between the commas of `labels`, which is not empty. Throws UserError where one
// is ambiguous.
std::vector<LabelText> FindLabels(const std::string& labels, const std::vector<NamedLabel>& among);

// The filter that `choice` means among `labels`, all that there are. Throws UserError where a text
// is ambiguous or means no label, and where every label is excluded.
LabelFilter ChooseLabels(const LabelChoice& choice, const std::vector<NamedLabel>& labels);

// As above, where more is known of what is chosen: `why_not(text)` is empty where the label may be
// chosen, else the end of the sentence that refuses it ("which is no object; ..."), and
// `labels` are those that ids and names are looked up in.
LabelFilter ChooseLabels(const LabelChoice& choice,
                         const std::vector<NamedLabel>& labels,
                         const std::function<std::string(const LabelText&)>& why_not);

// To be called before the ids are known, with the `names` that a table gives them: throws UserError
// where a text is neither a number nor "id:" and a number nor "label_" and a number nor one of the
// names, so that no mask can make it right. `table` says in the sentence what the names are from.
void RequirePossible(const LabelChoice& choice,
                     const std::vector<NamedLabel>& names,
                     const std::string& table);

}  // namespace semfoam
