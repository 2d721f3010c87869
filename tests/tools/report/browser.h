// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/temp_folder.h"
#include <nlohmann/json.hpp>
#include <sys/types.h>

namespace semfoam {

// A headless Chromium with one page, driven by the DevTools protocol over a pipe. Draws WebGL on
// the CPU (SwiftShader), so that it needs no GPU.
class Browser {
 public:
  // Whether Chromium is installed.
  static bool IsInstalled();

  // `more` are further switches. Throws std::runtime_error where it does not start.
  explicit Browser(const std::vector<std::string>& more = {});
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  // Opens a file at a fragment (what follows # in its address), and waits until `condition`, a
  // JavaScript expression, is true. Throws std::runtime_error after two minutes.
  void Open(const std::filesystem::path& file,
            const std::string& condition,
            const std::string& fragment = "");
  // Returns the value of a JavaScript expression (of a promise: what it becomes). Throws
  // std::runtime_error where the expression throws.
  nlohmann::json Evaluate(const std::string& expression);
  void WaitUntil(const std::string& condition);

  // Moves the mouse to a place of the window, and clicks there.
  void Move(double x, double y);
  void Click(double x, double y);

  // What the page wrote to the console, and its uncaught exceptions.
  const std::vector<std::string>& messages() const { return messages_; }
  // The addresses that it asked for, its own file and data: apart.
  const std::vector<std::string>& requests() const { return requests_; }

 private:
  nlohmann::json Call(const std::string& method, nlohmann::json parameters);
  nlohmann::json ReadMessage();
  void Note(const nlohmann::json& event);

  TempFolder profile_;
  pid_t process_ = -1;
  int to_ = -1;
  int from_ = -1;
  int next_id_ = 1;
  std::string session_;
  std::string unread_;
  std::string address_;
  std::vector<std::string> messages_;
  std::vector<std::string> requests_;
};

}  // namespace semfoam
