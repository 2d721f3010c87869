// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// A user's selection of labels: ids and names, separated by commas ("mug, 7").
//
// A name is the label's own, or "label_<id>" where it has none; a name selects all labels that
// share it. A text that is neither an id nor a name selects all labels of the class of this name
// (LabelFeatures::class_name). "id:7" is always an id, "name:7" always a name and "class:chair"
// always a class. A plain text that is the id of one label and the name of another one is refused
// as ambiguous.
struct LabelChoice {
  // Labels to select; empty: all.
  std::string labels = {};
  // Labels to exclude from these; empty: none.
  std::string exclude_labels = {};

  bool IsAll() const { return labels.empty() && exclude_labels.empty(); }
};

// A label as displayed.
struct NamedLabel {
  LabelId id = kNoObject;
  // DisplayName.
  std::string name;
  // Empty: none.
  std::string class_name = {};
};

// The result of a LabelChoice among the existing labels.
struct LabelFilter {
  // Selected ids; nothing: all.
  std::optional<std::set<LabelId>> only = {};
  // Excluded ids.
  std::set<LabelId> excluded = {};

  bool IsAll() const { return !only && excluded.empty(); }
  bool Has(LabelId id) const { return (!only || only->count(id) != 0) && excluded.count(id) == 0; }
};

// One text of a choice, and the ids that it selects; none if no label has this id or name.
struct LabelText {
  std::string text;
  std::vector<LabelId> ids;
};

// Looks up the texts between the commas of `labels`, which is not empty. Throws UserError where one
// is ambiguous.
std::vector<LabelText> FindLabels(const std::string& labels, const std::vector<NamedLabel>& among);

// Returns the end of a sentence about a text that selects no label: "; is 'mug' meant?" where the
// name or class of a label is near (NearestName), else ".".
std::string WhetherMeant(const std::string& text, const std::vector<NamedLabel>& among);

// Returns the filter for a choice among all existing `labels`. Throws UserError where a text is
// ambiguous or selects no label, and where every label is excluded.
LabelFilter ChooseLabels(const LabelChoice& choice, const std::vector<NamedLabel>& labels);

// Does the same with further conditions: `why_not(text)` returns an empty string if the label may
// be selected, else the end of the sentence that refuses it ("which is no object; ..."). Ids and
// names are looked up in `labels`.
LabelFilter ChooseLabels(const LabelChoice& choice,
                         const std::vector<NamedLabel>& labels,
                         const std::function<std::string(const LabelText&)>& why_not);

// Checks a choice before the ids are known, with the `names` of a table and the names of `classes`.
// Throws UserError where a text is neither a number nor "id:" and a number nor "label_" and a
// number nor one of the names or classes, so that it is wrong for any masks. `table` describes the
// source of the names in the sentence.
void RequirePossible(const LabelChoice& choice,
                     const std::vector<NamedLabel>& names,
                     const std::set<std::string>& classes,
                     const std::string& table);

}  // namespace semfoam
