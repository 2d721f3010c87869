// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/label_choice.h"

#include "foam/util/error.h"
#include "foam/util/suggestion.h"

#include <algorithm>
#include <utility>

namespace semfoam {
namespace {

std::string Trim(const std::string& text) {
  const size_t begin = text.find_first_not_of(' ');
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

// Returns the texts between the commas; none of an empty text.
std::vector<std::string> Parts(const std::string& labels) {
  std::vector<std::string> parts;
  if (labels.empty()) return parts;
  size_t begin = 0;
  for (size_t comma; (comma = labels.find(',', begin)) != std::string::npos; begin = comma + 1) {
    parts.push_back(Trim(labels.substr(begin, comma - begin)));
  }
  parts.push_back(Trim(labels.substr(begin)));
  return parts;
}

bool IsNumber(const std::string& text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// What follows `prefix` in a text; nothing where the text begins otherwise.
std::optional<std::string> After(const std::string& prefix, const std::string& text) {
  if (text.compare(0, prefix.size(), prefix) != 0) return std::nullopt;
  return text.substr(prefix.size());
}

template <typename Means>
std::vector<LabelId> IdsOf(const std::vector<NamedLabel>& among, const Means& means) {
  std::vector<LabelId> ids;
  for (const NamedLabel& label : among) {
    if (means(label)) ids.push_back(label.id);
  }
  return ids;
}

std::vector<LabelId> IdsMeant(const std::string& text, const std::vector<NamedLabel>& among) {
  const auto with_id = [&](const std::string& id) {
    return IdsOf(among,
                 [&](const NamedLabel& label) { return std::to_string(Value(label.id)) == id; });
  };
  const auto with_name = [&](const std::string& name) {
    return IdsOf(among, [&](const NamedLabel& label) { return label.name == name; });
  };
  const auto of_class = [&](const std::string& name) {
    return IdsOf(
        among, [&](const NamedLabel& label) { return !name.empty() && label.class_name == name; });
  };
  if (const auto id = After("id:", text); id && IsNumber(*id)) return with_id(*id);
  if (const auto name = After("name:", text)) {
    if (std::vector<LabelId> ids = with_name(*name); !ids.empty()) return ids;
  }
  if (const auto name = After("class:", text)) {
    if (std::vector<LabelId> ids = of_class(*name); !ids.empty()) return ids;
  }
  const std::vector<LabelId> by_id = with_id(text);
  const std::vector<LabelId> by_name = with_name(text);
  const auto other = std::find_if(by_name.begin(), by_name.end(), [&](LabelId id) {
    return !by_id.empty() && id != by_id.front();
  });
  if (other != by_name.end()) {
    const auto label = std::find_if(
        among.begin(), among.end(), [&](const NamedLabel& one) { return one.id == by_id.front(); });
    throw UserError("The label '",
                    text,
                    "' is ambiguous: it is the id of ",
                    label->name,
                    " (",
                    label->id,
                    ") and the name of label ",
                    *other,
                    "; write id:",
                    text,
                    " or name:",
                    text,
                    ".");
  }
  if (!by_id.empty()) return by_id;
  return by_name.empty() ? of_class(text) : by_name;
}

std::string Listed(const std::vector<NamedLabel>& labels) {
  if (labels.empty()) return "there are none";
  std::string text;
  for (const NamedLabel& label : labels) {
    text += (text.empty() ? "there are " : ", ") + std::to_string(Value(label.id)) + " (" +
            label.name + ")";
  }
  return text;
}

// The end of a sentence about a text that is none of `names`: the nearest of them, if one is near.
std::string EndWithNearest(const std::string& text, const std::vector<std::string>& names) {
  const std::string nearest = NearestName(text, names);
  return nearest.empty() ? "." : "; is '" + nearest + "' meant?";
}

}  // namespace

std::string WhetherMeant(const std::string& text, const std::vector<NamedLabel>& among) {
  std::vector<std::string> names;
  for (const NamedLabel& label : among) names.push_back(label.name);
  for (const NamedLabel& label : among) names.push_back(label.class_name);
  return EndWithNearest(text, names);
}

std::vector<LabelText> FindLabels(const std::string& labels, const std::vector<NamedLabel>& among) {
  std::vector<LabelText> found;
  for (const std::string& part : Parts(labels)) found.push_back({part, IdsMeant(part, among)});
  return found;
}

LabelFilter ChooseLabels(const LabelChoice& choice,
                         const std::vector<NamedLabel>& labels,
                         const std::function<std::string(const LabelText&)>& why_not) {
  const auto ids_of = [&](const std::string& text, const char* what) {
    std::set<LabelId> ids;
    for (const LabelText& part : FindLabels(text, labels)) {
      if (const std::string why = why_not(part); !why.empty()) {
        throw UserError("The ", what, " name '", part.text, "', ", why);
      }
      ids.insert(part.ids.begin(), part.ids.end());
    }
    return ids;
  };
  LabelFilter filter;
  if (!choice.labels.empty()) filter.only = ids_of(choice.labels, "labels");
  filter.excluded = ids_of(choice.exclude_labels, "excluded labels");
  if (!choice.exclude_labels.empty() &&
      std::none_of(labels.begin(), labels.end(), [&](const NamedLabel& label) {
        return filter.Has(label.id);
      })) {
    throw UserError("The excluded labels '",
                    choice.exclude_labels,
                    "' leave none of the labels that are chosen; exclude fewer.");
  }
  return filter;
}

LabelFilter ChooseLabels(const LabelChoice& choice, const std::vector<NamedLabel>& labels) {
  return ChooseLabels(choice, labels, [&](const LabelText& part) {
    return part.ids.empty()
               ? "which is no label; " + Listed(labels) + WhetherMeant(part.text, labels)
               : "";
  });
}

void RequirePossible(const LabelChoice& choice,
                     const std::vector<NamedLabel>& names,
                     const std::set<std::string>& classes,
                     const std::string& table) {
  std::vector<std::string> known(classes.begin(), classes.end());
  for (const NamedLabel& label : names) known.push_back(label.name);
  const auto is_name = [&](const std::string& text) {
    if (const auto id = After("label_", text); id && IsNumber(*id)) return true;
    return std::any_of(
        names.begin(), names.end(), [&](const NamedLabel& label) { return label.name == text; });
  };
  const auto is_possible = [&](const std::string& text) {
    if (IsNumber(text) || is_name(text) || classes.contains(text)) return true;
    if (const auto id = After("id:", text); id && IsNumber(*id)) return true;
    if (const auto name = After("class:", text); name && classes.contains(*name)) return true;
    const auto name = After("name:", text);
    return name && is_name(*name);
  };
  for (const auto& [labels, what] :
       {std::pair(choice.labels, "labels"), std::pair(choice.exclude_labels, "excluded labels")}) {
    for (const std::string& part : Parts(labels)) {
      if (is_possible(part)) continue;
      throw UserError("The ",
                      what,
                      " name '",
                      part,
                      "', which is no id and no name in ",
                      table,
                      "; ",
                      Listed(names),
                      EndWithNearest(part, known));
    }
  }
}

}  // namespace semfoam
