// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"

#include <gtest/gtest.h>

namespace semfoam {
namespace {

std::string AsOption(const std::string& field) { return "--" + field; }

TEST(Error, FieldsAreSpelledAsTheProgramSpellsThem) {
  const UserError error("a\x1f.foam: exists, ", Field{"x"}, "; ", Field{"overwrite"}, " ", 1, ".");
  EXPECT_STREQ(error.what(), "a\x1f.foam: exists, x; overwrite 1.");
  EXPECT_EQ(error.Spelled(AsOption), "a\x1f.foam: exists, --x; --overwrite 1.");
  EXPECT_EQ(UserError("nothing to spell.").Spelled(AsOption), "nothing to spell.");
}

TEST(Error, OfAFieldBeginsWithItsName) {
  const FieldError error("num_rays", " is ", 0, "; it must be greater than 0.");
  EXPECT_EQ(error.field(), "num_rays");
  EXPECT_STREQ(error.what(), "num_rays is 0; it must be greater than 0.");
  EXPECT_EQ(error.Spelled(AsOption), "--num_rays is 0; it must be greater than 0.");
}

}  // namespace
}  // namespace semfoam
