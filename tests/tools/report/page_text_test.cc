// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/report/page_text.h"

#include <string>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

namespace semfoam {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string Unzipped(const std::string& zipped) {
  std::string text(1 << 22, '\0');
  z_stream stream = {};
  EXPECT_EQ(inflateInit2(&stream, MAX_WBITS + 16), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(zipped.data()));
  stream.avail_in = zipped.size();
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = text.size();
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  text.resize(stream.total_out);
  inflateEnd(&stream);
  return text;
}

TEST(Gzip, ComesBack) {
  std::string noise;
  for (unsigned i = 0, x = 1; i < 3'000'000; ++i, x = x * 1664525 + 1013904223) {
    noise.push_back(static_cast<char>(x >> 24));
  }
  for (const std::string& text : {std::string(), std::string("a"), noise}) {
    EXPECT_TRUE(Unzipped(Gzip(text)) == text) << text.size();
  }
}

TEST(Gzip, HasNoTime) {
  const std::string zipped = Gzip("foam");
  EXPECT_EQ(zipped.substr(4, 4), std::string(4, '\0'));
  EXPECT_EQ(zipped, Gzip("foam"));
}

// RFC 4648, section 10.
TEST(Base64, EncodesTheStandardsExamples) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foob"), "Zm9vYg==");
  EXPECT_EQ(Base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
}

TEST(DataUrl, NamesTheType) { EXPECT_EQ(DataUrl("image/png", "fo"), "data:image/png;base64,Zm8="); }

TEST(JsonForHtml, CannotEndItsElement) {
  const nlohmann::ordered_json json = {
      {"name", "</script><script>alert(\"1\")</script> <!-- & \xF0\x9F\x8D\xB5"}, {"b", "\xff"}};
  const std::string text = JsonForHtml(json);
  EXPECT_THAT(text, Not(HasSubstr("<")));
  EXPECT_THAT(text, Not(HasSubstr(">")));
  EXPECT_THAT(text, Not(HasSubstr("&")));
  for (const char c : text) EXPECT_TRUE(c >= 32 && c < 127) << int{c};
  const auto back = nlohmann::json::parse(text);
  EXPECT_EQ(back["name"], json["name"]);
  EXPECT_EQ(back["b"], "\xEF\xBF\xBD");
}

TEST(FillPage, FillsEveryPlaceOnce) {
  EXPECT_EQ(FillPage("<a>{{x}}</a>{{y}}{{x}}.", {{"x", "{{y}}"}, {"y", "2"}}),
            "<a>{{y}}</a>2{{y}}.");
  EXPECT_EQ(FillPage("no place", {}), "no place");
  EXPECT_DEATH(FillPage("{{z}}", {{"x", ""}}), "z");
}

}  // namespace
}  // namespace semfoam
