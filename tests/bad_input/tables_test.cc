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
      {"missing",
       Remove(file),
       "IN/labels.json: there is no such file, where a JSON file should be."},
      {"a folder", MakeFolder(file), "IN/labels.json: is a folder, where a JSON file should be."},
      {"a pipe", MakePipe(file), "IN/labels.json: is a pipe, where a JSON file should be."},
      {"a device", MakeDevice(file), "IN/labels.json: is a device, where a JSON file should be."},
      {"a link in a circle",
       [=](auto& f) {
         fs::remove(f / file);
         fs::create_symlink(f / file, f / file);
       },
       "IN/labels.json: cannot be read (Too many levels of symbolic links), where a JSON file "
       "should be; may you read it?"},
      {"empty",
       Put(file, ""),
       "IN/labels.json: ends after 0 bytes, before its JSON does; is the copy complete?"},
      {"blank",
       Put(file, " \n\t\n"),
       "IN/labels.json: ends after 4 bytes, before its JSON does; is the copy complete?"},
      {"cut",
       Put(file, "{\"labels\": {"),
       "IN/labels.json: ends after 12 bytes, before its JSON does; is the copy complete?"},
      {"no JSON",
       Put(file, "labels: 7 = mug"),
       "IN/labels.json: is no valid JSON from byte 1 of 15 on; a complete JSON file would be "
       "right."},
      {"single quotes",
       Put(file, "{'labels': {}}"),
       "IN/labels.json: is no valid JSON from byte 2 of 14 on; a complete JSON file would be "
       "right."},
      {"a comma too many",
       Put(file, "{\"labels\": {},}"),
       "IN/labels.json: is no valid JSON from byte 15 of 15 on; a complete JSON file would be "
       "right."},
      {"two values",
       Put(file, "{} {}"),
       "IN/labels.json: is no valid JSON from byte 4 of 5 on; a complete JSON file would be "
       "right."},
      {"nan",
       Put(file, "{\"labels\": NaN}"),
       "IN/labels.json: is no valid JSON from byte 12 of 15 on; a complete JSON file would be "
       "right."},
      {"UTF-16",
       Put(file, std::string("\xff\xfe{\0}\0", 6)),
       "IN/labels.json: is no valid JSON from byte 1 of 6 on; a complete JSON file would be "
       "right."},
      {"bad UTF-8",
       Put(file, "{\"lab\xffls\": 3}"),
       "IN/labels.json: is no valid JSON from byte 6 of 13 on; a complete JSON file would be "
       "right."},
      {"half a surrogate",
       Put(file, "{\"\\ud800\": 3}"),
       "IN/labels.json: is no valid JSON from byte 9 of 13 on; a complete JSON file would be "
       "right."},
      {"a NUL",
       Put(file, std::string("{\0}", 3)),
       "IN/labels.json: is no valid JSON from byte 2 of 3 on; a complete JSON file would be "
       "right."},
      {"beyond a double",
       Put(file, "{\"a\": 1e400}"),
       "IN/labels.json: has a number beyond 1.79769e+308, which a double does not hold; is it "
       "damaged?"},
      {"beneath a double",
       Put(file, "{\"a\": -1e400}"),
       "IN/labels.json: has a number beyond 1.79769e+308, which a double does not hold; is it "
       "damaged?"},
      {"nested 1e5 deep",
       Put(file, "{\"a\": " + kNested + "}"),
       "IN/labels.json: is nested deeper than 64 levels, where a few would be right; is it "
       "damaged?"},
      {"nested 66 deep",
       Put(file, std::string(66, '[') + std::string(66, ']')),
       "IN/labels.json: is nested deeper than 64 levels, where a few would be right; is it "
       "damaged?"},
      {"a key twice",
       Put(file, "{\"a\": 1, \"b\": {\"a\": 2}, \"a\": 3}"),
       "IN/labels.json: gives \"a\" twice in one place; once would be right."},
  };
}

TEST(Tables, LabelNames) {
  const auto put = [](const std::string& text) { return Put("labels.json", text); };
  std::vector<BadInput> cases = BadJson("labels.json");
  const std::vector<BadInput> more = {
      {"a number",
       put("7"),
       "IN/labels.json: has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right."},
      {"a list",
       put("[\"mug\"]"),
       "IN/labels.json: has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right."},
      {"null",
       put("null"),
       "IN/labels.json: has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right."},
      {"no labels",
       put("{\"label\": {\"7\": \"mug\"}}"),
       "IN/labels.json: has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right."},
      {"a list of labels",
       put("{\"labels\": [\"mug\"]}"),
       "IN/labels.json: has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right."},
      {"labels null",
       put("{\"labels\": null}"),
       "IN/labels.json: has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right."},
      {"no id",
       put("{\"labels\": {\"mug\": \"7\"}}"),
       "IN/labels.json: the label \"mug\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with "
       "a name."},
      {"empty id",
       put("{\"labels\": {\"\": \"mug\"}}"),
       "IN/labels.json: the label \"\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a "
       "name."},
      {"negative id",
       put("{\"labels\": {\"-7\": \"mug\"}}"),
       "IN/labels.json: the label \"-7\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a "
       "name."},
      {"id with a sign",
       put("{\"labels\": {\"+7\": \"mug\"}}"),
       "IN/labels.json: the label \"+7\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a "
       "name."},
      {"id with a fraction",
       put("{\"labels\": {\"7.0\": \"mug\"}}"),
       "IN/labels.json: the label \"7.0\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with "
       "a name."},
      {"id with a blank",
       put("{\"labels\": {\" 7\": \"mug\"}}"),
       "IN/labels.json: the label \" 7\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a "
       "name."},
      {"id beyond 32 bits",
       put("{\"labels\": {\"4294967296\": \"mug\"}}"),
       "IN/labels.json: the label \"4294967296\" is not as in {\"labels\": {\"7\": \"mug\"}}, an "
       "id with a name."},
      {"very long id",
       put("{\"labels\": {\"" + std::string(300, '1') + "\": \"mug\"}}"),
       "IN/labels.json: the label "
       "\"111111111111111111111111111111111111111111111111111111111111...\" is not as in "
       "{\"labels\": {\"7\": \"mug\"}}, an id with a name."},
      {"id with a line break",
       put("{\"labels\": {\"7\\n\": \"mug\"}}"),
       "IN/labels.json: the label \"7\\x0a\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id "
       "with a name."},
      {"name is a number",
       put("{\"labels\": {\"7\": 7}}"),
       "IN/labels.json: the label \"7\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a "
       "name."},
      {"name is null",
       put("{\"labels\": {\"7\": null}}"),
       "IN/labels.json: the label \"7\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a "
       "name."},
      {"name is an object",
       put("{\"labels\": {\"7\": {\"name\": \"mug\"}}}"),
       "IN/labels.json: the label \"7\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a "
       "name."},
      {"id twice",
       put("{\"labels\": {\"7\": \"mug\", \"7\": \"cup\"}}"),
       "IN/labels.json: gives \"7\" twice in one place; once would be right."},
      {"id twice, with a zero",
       put("{\"labels\": {\"7\": \"mug\", \"07\": \"cup\"}}"),
       "IN/labels.json: names the label 7 twice; one name for each id would be right."},
      {"source ids are a list",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": [7]}"),
       "IN/labels.json: its \"source_ids\" are not as in {\"source_ids\": {\"7\": 81234}}, ids of "
       "the masks for ids of its labels."},
      {"source id of no id",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"mug\": 7}}"),
       "IN/labels.json: the source id of \"mug\" is not as in {\"source_ids\": {\"7\": 81234}}, an "
       "id of the masks for an id of its labels."},
      {"source id is a text",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"7\": \"81234\"}}"),
       "IN/labels.json: the source id of \"7\" is not as in {\"source_ids\": {\"7\": 81234}}, an "
       "id "
       "of the masks for an id of its labels."},
      {"source id is negative",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"7\": -1}}"),
       "IN/labels.json: the source id of \"7\" is not as in {\"source_ids\": {\"7\": 81234}}, an "
       "id "
       "of the masks for an id of its labels."},
      {"source id beyond 32 bits",
       put("{\"labels\": {\"7\": \"mug\"}, \"source_ids\": {\"7\": 4294967296}}"),
       "IN/labels.json: the source id of \"7\" is not as in {\"source_ids\": {\"7\": 81234}}, an "
       "id "
       "of the masks for an id of its labels."},
  };
  cases.insert(cases.end(), more.begin(), more.end());
  ExpectSentencesOf(cases, "labels.json", R"({"labels": {"7": "mug"}})", [](const fs::path& f) {
    ReadLabelNames(f / "labels.json");
  });
}

TEST(Tables, PredictedIds) {
  const auto put = [](const std::string& text) { return Put("pred.json", text); };
  const auto id = [&](const std::string& text) {
    return put("{\"annotations\": [{\"segments_info\": [{\"id\": " + text + "}]}]}");
  };
  const std::vector<BadInput> cases = {
      {"a list",
       put("[]"),
       "IN/pred.json: is not as DEVA writes it (no list \"annotations\" where one belongs); "
       "annotations, each with segments_info, each with an id, would be right."},
      {"no annotations",
       put("{\"annotation\": []}"),
       "IN/pred.json: is not as DEVA writes it (no list \"annotations\" where one belongs); "
       "annotations, each with segments_info, each with an id, would be right."},
      {"annotations are an object",
       put("{\"annotations\": {}}"),
       "IN/pred.json: is not as DEVA writes it (no list \"annotations\" where one belongs); "
       "annotations, each with segments_info, each with an id, would be right."},
      {"annotation is a number",
       put("{\"annotations\": [3]}"),
       "IN/pred.json: is not as DEVA writes it (no list \"segments_info\" where one belongs); "
       "annotations, each with segments_info, each with an id, would be right."},
      {"no segments",
       put("{\"annotations\": [{\"file_name\": \"a.png\"}]}"),
       "IN/pred.json: is not as DEVA writes it (no list \"segments_info\" where one belongs); "
       "annotations, each with segments_info, each with an id, would be right."},
      {"segments are a text",
       put("{\"annotations\": [{\"segments_info\": \"no\"}]}"),
       "IN/pred.json: is not as DEVA writes it (no list \"segments_info\" where one belongs); "
       "annotations, each with segments_info, each with an id, would be right."},
      {"segment is a list",
       put("{\"annotations\": [{\"segments_info\": [[]]}]}"),
       "IN/pred.json: is not as DEVA writes it (a segment without id); an id from 0 to 16777215 "
       "for each segment would be right."},
      {"segment without id",
       put("{\"annotations\": [{\"segments_info\": [{}]}]}"),
       "IN/pred.json: is not as DEVA writes it (a segment without id); an id from 0 to 16777215 "
       "for each segment would be right."},
      {"id is a text",
       id("\"7\""),
       "IN/pred.json: is not as DEVA writes it (the id \"7\"); an id from 0 to 16777215 for each "
       "segment would be right."},
      {"id is negative",
       id("-1"),
       "IN/pred.json: is not as DEVA writes it (the id -1); an id from 0 to 16777215 for each "
       "segment would be right."},
      {"id has a fraction",
       id("7.5"),
       "IN/pred.json: is not as DEVA writes it (the id 7.5); an id from 0 to 16777215 for each "
       "segment would be right."},
      {"id is true",
       id("true"),
       "IN/pred.json: is not as DEVA writes it (the id true); an id from 0 to 16777215 for each "
       "segment would be right."},
      {"id has four bytes",
       id("16777216"),
       "IN/pred.json: is not as DEVA writes it (the id 16777216); an id from 0 to 16777215 for "
       "each segment would be right."},
      {"id is huge",
       id("1e300"),
       "IN/pred.json: is not as DEVA writes it (the id 1e+300); an id from 0 to 16777215 for each "
       "segment would be right."},
      {"id is beyond 64 bits",
       id("99999999999999999999"),
       "IN/pred.json: is not as DEVA writes it (the id 1e+20); an id from 0 to 16777215 for each "
       "segment would be right."},
  };
  ExpectSentencesOf(cases,
                    "pred.json",
                    R"({"annotations": [{"segments_info": [{"id": 7}]}]})",
                    [](const fs::path& f) { ReadPredictedIds(f / "pred.json"); });
}

}  // namespace
}  // namespace semfoam
