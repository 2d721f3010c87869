// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/label_choice.h"

#include "foam/util/error.h"

#include "tests/mistake.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Label 4 is named "2", label 5 "5", and two are called "cup".
const std::vector<NamedLabel> kLabels = {{LabelId{2}, "mug"},
                                         {LabelId{4}, "2"},
                                         {LabelId{5}, "5"},
                                         {LabelId{6}, "cup"},
                                         {LabelId{7}, "cup"},
                                         {LabelId{8}, "label_8"},
                                         {LabelId{9}, "id:2"}};

std::vector<int32_t> Ids(const std::string& text) {
  const std::vector<LabelText> found = FindLabels(text, kLabels);
  if (found.size() != 1) return {-1};
  std::vector<int32_t> ids;
  for (const LabelId id : found[0].ids) ids.push_back(Value(id));
  return ids;
}

template <typename Function>
std::string ErrorOf(const Function& function) {
  try {
    function();
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

std::string Error(const LabelChoice& choice) {
  return ErrorOf([&] { ChooseLabels(choice, kLabels); });
}

TEST(LabelChoice, TakesIdsAndNames) {
  EXPECT_THAT(Ids("mug"), ElementsAre(2));
  EXPECT_THAT(Ids("4"), ElementsAre(4));
  EXPECT_THAT(Ids(" label_8 "), ElementsAre(8));
  EXPECT_THAT(Ids("cup"), ElementsAre(6, 7)) << "all labels of a name are meant";
  EXPECT_THAT(Ids("5"), ElementsAre(5)) << "its name is its id";
  EXPECT_THAT(Ids("04"), IsEmpty());
  EXPECT_EQ(FindLabels("mug,,4", kLabels).size(), 3u);
}

TEST(LabelChoice, RefusesATextThatMeansTwoThings) {
  EXPECT_THAT(Error({"mug, 2"}),
              NamesMistake("", {"'2'", "mug (2)", "label 4", "id:2", "name:2"}, "is ambiguous"));
  EXPECT_EQ(Error({"", "2"}), Error({"2"}));
  EXPECT_THAT(Ids("id:2"), ElementsAre(2));
  EXPECT_THAT(Ids("name:2"), ElementsAre(4));
  EXPECT_THAT(Ids("name:id:2"), ElementsAre(9));
  EXPECT_THAT(Ids("name:mug"), ElementsAre(2));
  EXPECT_THAT(Ids("id:mug"), IsEmpty());
}

TEST(LabelChoice, TakesClassesWhereNoNameIsMeant) {
  const std::vector<NamedLabel> labels = {{LabelId{2}, "chair_1", "chair"},
                                          {LabelId{3}, "chair_2", "chair"},
                                          {LabelId{4}, "table", "desk"},
                                          {LabelId{5}, "desk", "table"},
                                          {LabelId{6}, "label_6"}};
  const auto ids = [&](const std::string& text) {
    const std::vector<LabelText> found = FindLabels(text, labels);
    std::vector<int32_t> values;
    for (const LabelId id : found.at(0).ids) values.push_back(Value(id));
    return values;
  };
  EXPECT_THAT(ids("chair"), ElementsAre(2, 3));
  EXPECT_THAT(ids("chair_1"), ElementsAre(2));
  EXPECT_THAT(ids("desk"), ElementsAre(5)) << "a name comes first";
  EXPECT_THAT(ids("class:desk"), ElementsAre(4));
  EXPECT_THAT(ids("class:chair_1"), IsEmpty());
  EXPECT_THAT(ids("name:chair"), IsEmpty());
  EXPECT_THAT(ids("class:"), IsEmpty()) << "no class is none";
  const auto error = [&](const std::string& text) {
    return ErrorOf([&] { ChooseLabels({text}, labels); });
  };
  EXPECT_THAT(
      error("chiar"),
      NamesMistake("", {"'chiar'", "2 (chair_1)", "is 'chair' meant"}, "which is no label"));
  EXPECT_THAT(error("tabel"), NamesMistake("", {"is 'table' meant"}, "which is no label"));
  EXPECT_THAT(error("elephant"), testing::EndsWith("6 (label_6)."));
}

TEST(LabelChoice, TakesAndLeavesOut) {
  EXPECT_TRUE(ChooseLabels({}, kLabels).IsAll());
  const LabelFilter some = ChooseLabels({"cup, mug", "7"}, kLabels);
  EXPECT_TRUE(some.Has(LabelId{2}));
  EXPECT_TRUE(some.Has(LabelId{6}));
  EXPECT_FALSE(some.Has(LabelId{7}));
  EXPECT_FALSE(some.Has(LabelId{8}));
  const LabelFilter most = ChooseLabels({"", "cup"}, kLabels);
  EXPECT_TRUE(most.Has(LabelId{2}));
  EXPECT_FALSE(most.Has(LabelId{6}));
  EXPECT_FALSE(most.Has(LabelId{7}));
  EXPECT_EQ(Error({"spoon"}).substr(0, 70),
            "The labels name 'spoon', which is no label; there are 2 (mug), 4 (2), ");
  EXPECT_EQ(Error({"", "spoon"}).substr(0, 51),
            "The excluded labels name 'spoon', which is no label");
  EXPECT_THAT(Error({"cup", "6,7"}), NamesMistake("", {"excluded labels", "'6,7'"}, "leave none"));
}

TEST(LabelChoice, SaysBeforeTheIdsAreKnownWhatCannotBe) {
  const std::vector<NamedLabel> names = {{LabelId{2}, "mug"}, {LabelId{70000}, "spoon"}};
  for (const char* possible : {"",
                               "7",
                               "mug",
                               "spoon, 12",
                               "id:7",
                               "name:mug",
                               "label_9",
                               "name:label_9",
                               "plate",
                               "class:plate"}) {
    EXPECT_NO_THROW(RequirePossible({possible, possible}, names, {"plate"}, "t.json")) << possible;
  }
  for (const char* impossible : {"mgu",
                                 "7a",
                                 "id:",
                                 "name:",
                                 "label_",
                                 "mug,,7",
                                 " ",
                                 "-1",
                                 "class:mug",
                                 "class:",
                                 "name:plate"}) {
    EXPECT_THROW(RequirePossible({impossible}, names, {"plate"}, "t.json"), UserError)
        << impossible;
    EXPECT_THROW(RequirePossible({"", impossible}, names, {"plate"}, "t.json"), UserError)
        << impossible;
  }
  EXPECT_THAT(ErrorOf([&] { RequirePossible({"mug, mgu"}, names, {"plate"}, "t.json"); }),
              NamesMistake("",
                           {"'mgu'", "t.json", "2 (mug)", "70000 (spoon)", "is 'mug' meant"},
                           "no id and no name"));
  EXPECT_THAT(ErrorOf([&] { RequirePossible({"plat"}, names, {"plate"}, "t.json"); }),
              NamesMistake("", {"'plat'", "is 'plate' meant"}, "no id and no name"));
}

}  // namespace
}  // namespace semfoam
