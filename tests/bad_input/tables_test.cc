// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad JSON: names of labels, DEVA's list of ids.
#include "plugin/mask/mask_tables.h"

#include "tests/bad_input/bad_input.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

const std::string kNested = std::string(100'000, '[') + std::string(100'000, ']');

// What every file of JSON can have.
std::vector<BadInput> BadJson(const std::string& file) {
  return {
      {"missing", Remove(file), {"IN/labels.json", {}, "no such file"}},
      {"a folder", MakeFolder(file), {"IN/labels.json", {}, "is a folder"}},
      {"a pipe", MakePipe(file), {"IN/labels.json", {}, "is a pipe"}},
      {"a device", MakeDevice(file), {"IN/labels.json", {}, "is a device"}},
      {"a link in a circle",
       [=](auto& f) {
         fs::remove(f / file);
         fs::create_symlink(f / file, f / file);
       },
       {"IN/labels.json", {"Too many levels of symbolic links"}, "cannot be read"}},
      {"empty", Put(file, ""), {"IN/labels.json", {}, "ends after 0 bytes"}},
      {"blank", Put(file, " \n\t\n"), {"IN/labels.json", {}, "ends after 4 bytes"}},
      {"cut", Put(file, "{\"labels\": {"), {"IN/labels.json", {}, "ends after 12 bytes"}},
      {"no JSON",
       Put(file, "labels: 7 = mug"),
       {"IN/labels.json", {"byte 1 of 15"}, "no valid JSON"}},
      {"single quotes",
       Put(file, "{'labels': {}}"),
       {"IN/labels.json", {"byte 2 of 14"}, "no valid JSON"}},
      {"a comma too many",
       Put(file, "{\"labels\": {},}"),
       {"IN/labels.json", {"byte 15 of 15"}, "no valid JSON"}},
      {"two values", Put(file, "{} {}"), {"IN/labels.json", {"byte 4 of 5"}, "no valid JSON"}},
      {"nan",
       Put(file, "{\"labels\": NaN}"),
       {"IN/labels.json", {"byte 12 of 15"}, "no valid JSON"}},
      {"UTF-16",
       Put(file, std::string("\xff\xfe{\0}\0", 6)),
       {"IN/labels.json", {"byte 1 of 6"}, "no valid JSON"}},
      {"bad UTF-8",
       Put(file, "{\"lab\xffls\": 3}"),
       {"IN/labels.json", {"byte 6 of 13"}, "no valid JSON"}},
      {"half a surrogate",
       Put(file, "{\"\\ud800\": 3}"),
       {"IN/labels.json", {"byte 9 of 13"}, "no valid JSON"}},
      {"a NUL",
       Put(file, std::string("{\0}", 3)),
       {"IN/labels.json", {"byte 2 of 3"}, "no valid JSON"}},
      {"beyond a double", Put(file, "{\"a\": 1e400}"), {"IN/labels.json", {}, "number beyond"}},
      {"beneath a double", Put(file, "{\"a\": -1e400}"), {"IN/labels.json", {}, "number beyond"}},
      {"nested 1e5 deep",
       Put(file, "{\"a\": " + kNested + "}"),
       {"IN/labels.json", {}, "nested deeper"}},
      {"nested 66 deep",
       Put(file, std::string(66, '[') + std::string(66, ']')),
       {"IN/labels.json", {}, "nested deeper"}},
      {"a key twice",
       Put(file, "{\"a\": 1, \"b\": {\"a\": 2}, \"a\": 3}"),
       {"IN/labels.json", {"\"a\""}, "twice in one place"}},
  };
}

TEST(Tables, LabelNames) {
  const auto put = [](const std::string& text) { return Put("labels.json", text); };
  std::vector<BadInput> cases = BadJson("labels.json");
  const std::vector<BadInput> more = {
      {"a number", put("7"), {"IN/labels.json", {}, "has no \"labels\""}},
      {"a list", put("[\"mug\"]"), {"IN/labels.json", {}, "has no \"labels\""}},
      {"null", put("null"), {"IN/labels.json", {}, "has no \"labels\""}},
      {"no labels",
       put("{\"label\": {\"7\": \"mug\"}}"),
       {"IN/labels.json", {}, "has no \"labels\""}},
      {"a list of labels",
       put("{\"labels\": [\"mug\"]}"),
       {"IN/labels.json", {}, "has no \"labels\""}},
      {"labels null", put("{\"labels\": null}"), {"IN/labels.json", {}, "has no \"labels\""}},
      {"no id",
       put("{\"labels\": {\"mug\": \"7\"}}"),
       {"IN/labels.json", {"label \"mug\""}, "is not as in"}},
      {"empty id",
       put("{\"labels\": {\"\": \"mug\"}}"),
       {"IN/labels.json", {"label \"\""}, "is not as in"}},
      {"negative id",
       put("{\"labels\": {\"-7\": \"mug\"}}"),
       {"IN/labels.json", {"label \"-7\""}, "is not as in"}},
      {"id with a sign",
       put("{\"labels\": {\"+7\": \"mug\"}}"),
       {"IN/labels.json", {"label \"+7\""}, "is not as in"}},
      {"id with a fraction",
       put("{\"labels\": {\"7.0\": \"mug\"}}"),
       {"IN/labels.json", {"label \"7.0\""}, "is not as in"}},
      {"id with a blank",
       put("{\"labels\": {\" 7\": \"mug\"}}"),
       {"IN/labels.json", {"label \" 7\""}, "is not as in"}},
      {"id beyond 32 bits",
       put("{\"labels\": {\"4294967296\": \"mug\"}}"),
       {"IN/labels.json", {"label \"4294967296\""}, "is not as in"}},
      {"very long id",
       put("{\"labels\": {\"" + std::string(300, '1') + "\": \"mug\"}}"),
       {"IN/labels.json",
        {"label \"111111111111111111111111111111111111111111111111111111111111...\""},
        "is not as in"}},
      {"id with a line break",
       put("{\"labels\": {\"7\\n\": \"mug\"}}"),
       {"IN/labels.json", {"label \"7\\x0a\""}, "is not as in"}},
      {"name is a number",
       put("{\"labels\": {\"7\": 7}}"),
       {"IN/labels.json", {"label \"7\""}, "is not as in"}},
      {"name is null",
       put("{\"labels\": {\"7\": null}}"),
       {"IN/labels.json", {"label \"7\""}, "is not as in"}},
      {"name is an object",
       put("{\"labels\": {\"7\": {\"name\": \"mug\"}}}"),
       {"IN/labels.json", {"label \"7\""}, "is not as in"}},
      {"id twice",
       put("{\"labels\": {\"7\": \"mug\", \"7\": \"cup\"}}"),
       {"IN/labels.json", {"\"7\""}, "twice in one place"}},
      {"id twice, with a zero",
       put("{\"labels\": {\"7\": \"mug\", \"07\": \"cup\"}}"),
       {"IN/labels.json", {"label 7"}, "twice"}},
      {"source ids are a list",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": [7]}"),
       {"IN/labels.json", {"source_ids"}, "are not as in"}},
      {"source id of no id",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"mug\": 7}}"),
       {"IN/labels.json", {"source id of \"mug\""}, "is not as in"}},
      {"source id is a text",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"7\": \"81234\"}}"),
       {"IN/labels.json", {"source id of \"7\""}, "is not as in"}},
      {"source id is negative",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"7\": -1}}"),
       {"IN/labels.json", {"source id of \"7\""}, "is not as in"}},
      {"source id beyond 32 bits",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"7\": 4294967296}}"),
       {"IN/labels.json", {"source id of \"7\""}, "is not as in"}},
  };
  cases.insert(cases.end(), more.begin(), more.end());
  ExpectMistakesIn("labels.json", R"({"labels": {"7": "mug"}})", cases, [](const fs::path& f) {
    ReadLabelNames(f / "labels.json");
  });
}

TEST(Tables, PredictedIds) {
  const auto put = [](const std::string& text) { return Put("pred.json", text); };
  const auto id = [&](const std::string& text) {
    return put("{\"annotations\": [{\"segments_info\": [{\"id\": " + text + "}]}]}");
  };
  const std::vector<BadInput> cases = {
      {"a list", put("[]"), {"IN/pred.json", {"DEVA"}, "no list \"annotations\""}},
      {"no annotations",
       put("{\"annotation\": []}"),
       {"IN/pred.json", {"DEVA"}, "no list \"annotations\""}},
      {"annotations are an object",
       put("{\"annotations\": {}}"),
       {"IN/pred.json", {"DEVA"}, "no list \"annotations\""}},
      {"annotation is a number",
       put("{\"annotations\": [3]}"),
       {"IN/pred.json", {"DEVA"}, "no list \"segments_info\""}},
      {"no segments",
       put("{\"annotations\": [{\"file_name\": \"a.png\"}]}"),
       {"IN/pred.json", {"DEVA"}, "no list \"segments_info\""}},
      {"segments are a text",
       put("{\"annotations\": [{\"segments_info\": \"no\"}]}"),
       {"IN/pred.json", {"DEVA"}, "no list \"segments_info\""}},
      {"segment is a list",
       put("{\"annotations\": [{\"segments_info\": [[]]}]}"),
       {"IN/pred.json", {"DEVA"}, "segment without id"}},
      {"segment without id",
       put("{\"annotations\": [{\"segments_info\": [{}]}]}"),
       {"IN/pred.json", {"DEVA"}, "segment without id"}},
      {"id is a text", id("\"7\""), {"IN/pred.json", {"id \"7\""}, "not as DEVA writes it"}},
      {"id is negative", id("-1"), {"IN/pred.json", {"id -1"}, "not as DEVA writes it"}},
      {"id has a fraction", id("7.5"), {"IN/pred.json", {"id 7.5"}, "not as DEVA writes it"}},
      {"id is true", id("true"), {"IN/pred.json", {"id true"}, "not as DEVA writes it"}},
      {"id has four bytes",
       id("16777216"),
       {"IN/pred.json", {"id 16777216"}, "not as DEVA writes it"}},
      {"id is huge", id("1e300"), {"IN/pred.json", {"id 1e+300"}, "not as DEVA writes it"}},
      {"id is beyond 64 bits",
       id("99999999999999999999"),
       {"IN/pred.json", {"id 1e+20"}, "not as DEVA writes it"}},
  };
  ExpectMistakesIn("pred.json",
                   R"({"annotations": [{"segments_info": [{"id": 7}]}]})",
                   cases,
                   [](const fs::path& f) { ReadPredictedIds(f / "pred.json"); });
}

}  // namespace
}  // namespace semfoam
