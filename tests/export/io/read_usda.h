// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cctype>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

// A small reader of USD's text format, strict about what it knows: metadata, prims, attributes,
// relationships; numbers, strings, assets, paths, tuples, arrays, dictionaries. Anything else is an
// exception that says where.
namespace semfoam {

// A prim is {"type", "metadata", "properties": {name: {"type", "value", "metadata"}}, "children":
// {name: prim}}; the stage is one too. Tuples and arrays are arrays.
class UsdaReader {
 public:
  static nlohmann::json Read(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    EXPECT_TRUE(in.good()) << path;
    UsdaReader reader;
    reader.text_ = {std::istreambuf_iterator<char>(in), {}};
    return reader.Stage();
  }

 private:
  using Json = nlohmann::json;

  [[noreturn]] void Fail(const std::string& expected) {
    throw std::runtime_error("at byte " + std::to_string(at_) + ": expected " + expected +
                             ", found '" + text_.substr(at_, 40) + "'");
  }

  char Next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool Accept(char c) {
    if (Next() != c) return false;
    ++at_;
    return true;
  }
  void Expect(char c) {
    if (!Accept(c)) Fail(std::string(1, c));
  }
  // Names of properties have namespaces.
  std::string Word() {
    Next();
    const size_t from = at_;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) ||
                                  text_[at_] == '_' || text_[at_] == ':')) {
      ++at_;
    }
    if (at_ == from || std::isdigit(static_cast<unsigned char>(text_[from]))) Fail("a name");
    return text_.substr(from, at_ - from);
  }
  std::string Type() {
    std::string type = Word();
    if (Accept('[')) {
      Expect(']');
      type += "[]";
    }
    return type;
  }

  std::string Between(char open, char close) {
    Expect(open);
    std::string inside;
    while (at_ < text_.size() && text_[at_] != close) {
      if (text_[at_] == '\n') Fail("no line break");
      if (text_[at_] == '\\' && open == '"') ++at_;
      inside += text_[at_++];
    }
    if (at_ == text_.size()) Fail(std::string(1, close));
    ++at_;
    return inside;
  }

  Json List(char open, char close) {
    Expect(open);
    Json list = Json::array();
    while (!Accept(close)) {
      if (!list.empty()) Expect(',');
      list.push_back(Value());
    }
    return list;
  }

  Json Value() {
    switch (Next()) {
      case '(':
        return List('(', ')');
      case '[':
        return List('[', ']');
      case '"':
        return Between('"', '"');
      case '@':
        return Between('@', '@');
      case '<':
        return Between('<', '>');
      case '{':
        return Dictionary();
    }
    const size_t from = at_;
    while (at_ < text_.size() &&
           std::string("+-.0123456789eE").find(text_[at_]) != std::string::npos) {
      ++at_;
    }
    const Json number = Json::parse(text_.substr(from, at_ - from), nullptr, false);
    if (!number.is_number()) Fail("a value");
    return number;
  }

  Json Dictionary() {
    Expect('{');
    Json dictionary = Json::object();
    while (!Accept('}')) {
      Type();
      const std::string name = Word();
      Expect('=');
      if (!dictionary.emplace(name, Value()).second) Fail("another key");
    }
    return dictionary;
  }

  Json Metadata() {
    Json metadata = Json::object();
    if (!Accept('(')) return metadata;
    while (!Accept(')')) {
      const std::string name = Word();
      Expect('=');
      if (!metadata.emplace(name, Value()).second) Fail("another key");
    }
    return metadata;
  }

  // What stands between a prim's braces, until `end`.
  void Body(char end, Json* prim) {
    (*prim)["properties"] = Json::object();
    (*prim)["children"] = Json::object();
    while (Next() != end) {
      std::string type = Type();
      if (type == "def") {
        Json child;
        child["type"] = Word();
        const std::string name = Between('"', '"');
        child["metadata"] = Metadata();
        Expect('{');
        Body('}', &child);
        Expect('}');
        for (const char c : name) {
          if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_') Fail("a prim's name");
        }
        if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])))
          Fail("a prim's name");
        if (!(*prim)["children"].emplace(name, child).second) Fail("another prim's name");
        continue;
      }
      if (type == "uniform") type = Type();
      std::string name = Word();
      if (Accept('.')) name += "." + Word();
      Json property = {{"type", type}};
      // An output is declared alone; what it is connected to has a value.
      if (!name.starts_with("outputs:") || name.ends_with(".connect")) {
        Expect('=');
        property["value"] = Value();
      }
      property["metadata"] = Metadata();
      if (!(*prim)["properties"].emplace(name, property).second) Fail("another property");
    }
  }

  Json Stage() {
    const std::string head = "#usda 1.0\n";
    if (text_.compare(0, head.size(), head) != 0) Fail(head);
    at_ = head.size();
    Json stage;
    stage["metadata"] = Metadata();
    Body('\0', &stage);
    if (at_ != text_.size()) Fail("the end");
    return stage;
  }

  std::string text_;
  size_t at_ = 0;
};

}  // namespace semfoam
