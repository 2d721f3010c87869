// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/tools/report/browser.h"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr char kProgram[] = "/usr/bin/chromium";
constexpr auto kPatience = std::chrono::minutes(2);

// Characters of a path that an address may not hold, such as spaces, escaped.
std::string AddressOf(const fs::path& file) {
  std::string address = "file://";
  for (const char c : fs::absolute(file).string()) {
    if (std::isalnum(static_cast<unsigned char>(c)) ||
        std::string("/._-").find(c) != std::string::npos) {
      address += c;
    } else {
      char escaped[4];
      std::snprintf(escaped, sizeof(escaped), "%%%02X", static_cast<unsigned char>(c));
      address += escaped;
    }
  }
  return address;
}

}  // namespace

bool Browser::IsInstalled() { return fs::exists(kProgram); }

Browser::Browser(const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {kProgram,
                                        "--headless",
                                        "--no-sandbox",
                                        "--use-angle=swiftshader",
                                        "--enable-unsafe-swiftshader",
                                        "--disable-quic",
                                        "--no-first-run",
                                        "--disable-background-networking",
                                        "--disable-component-update",
                                        "--disable-dev-shm-usage",
                                        "--disable-sync",
                                        "--window-size=420,560",
                                        "--user-data-dir=" + profile_.path().string(),
                                        "--remote-debugging-pipe"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  arguments.push_back("about:blank");
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);

  int down[2], up[2];
  if (pipe2(down, O_CLOEXEC) != 0 || pipe2(up, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  process_ = fork();
  if (process_ == 0) {
    // Its descriptors 3 and 4 are those of the protocol. First out of the way of both.
    const int in = fcntl(down[0], F_DUPFD, 10), out = fcntl(up[1], F_DUPFD, 10);
    dup2(in, 3);
    dup2(out, 4);
    const int nowhere = open("/dev/null", O_RDWR);
    for (const int k : {0, 1, 2}) dup2(nowhere, k);
    setpgid(0, 0);
    execv(kProgram, pointers.data());
    _exit(127);
  }
  close(down[0]);
  close(up[1]);
  to_ = down[1];
  from_ = up[0];
  const json target = Call("Target.createTarget", {{"url", "about:blank"}});
  session_ = Call("Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}})
                 .at("sessionId");
  for (const char* domain : {"Runtime", "Log", "Network", "Page"}) {
    Call(std::string(domain) + ".enable", json::object());
  }
}

Browser::~Browser() {
  close(to_);
  close(from_);
  kill(-process_, SIGKILL);
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

json Browser::ReadMessage() {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (true) {
    if (const size_t zero = unread_.find('\0'); zero != std::string::npos) {
      json message = json::parse(unread_.substr(0, zero));
      unread_.erase(0, zero + 1);
      return message;
    }
    pollfd wait = {from_, POLLIN, 0};
    poll(&wait, 1, 1000);
    if (std::chrono::steady_clock::now() > end) throw std::runtime_error("the browser is silent");
    if ((wait.revents & (POLLIN | POLLHUP)) == 0) continue;
    char bytes[1 << 16];
    const ssize_t count = read(from_, bytes, sizeof(bytes));
    if (count <= 0) throw std::runtime_error("the browser has ended");
    unread_.append(bytes, count);
  }
}

void Browser::Note(const json& event) {
  const std::string method = event.value("method", "");
  const json& parameters = event.contains("params") ? event["params"] : json::object();
  if (method == "Runtime.consoleAPICalled" || method == "Runtime.exceptionThrown" ||
      method == "Log.entryAdded") {
    messages_.push_back(parameters.dump());
  } else if (method == "Network.requestWillBeSent") {
    const std::string url = parameters.at("request").at("url");
    if (url != address_ && url.rfind("data:", 0) != 0 && url.rfind("about:", 0) != 0) {
      requests_.push_back(url);
    }
  }
}

json Browser::Call(const std::string& method, json parameters) {
  const int id = next_id_++;
  json message = {{"id", id}, {"method", method}, {"params", std::move(parameters)}};
  if (!session_.empty()) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  for (size_t sent = 0; sent < text.size();) {
    const ssize_t count = write(to_, text.data() + sent, text.size() - sent);
    if (count <= 0) throw std::runtime_error("the browser does not listen");
    sent += count;
  }
  while (true) {
    json answer = ReadMessage();
    if (answer.value("id", 0) != id) {
      Note(answer);
      continue;
    }
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return std::move(answer["result"]);
  }
}

json Browser::Evaluate(const std::string& expression) {
  const json answer =
      Call("Runtime.evaluate",
           {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
  if (answer.contains("exceptionDetails")) {
    throw std::runtime_error(expression + ": " + answer["exceptionDetails"].dump());
  }
  return answer.at("result").value("value", json());
}

void Browser::WaitUntil(const std::string& condition) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (Evaluate("!!(" + condition + ")") != true) {
    if (std::chrono::steady_clock::now() > end) throw std::runtime_error(condition + ": never");
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

void Browser::Open(const fs::path& file,
                   const std::string& condition,
                   const std::string& fragment) {
  address_ = AddressOf(file);
  Call("Page.navigate", {{"url", address_ + (fragment.empty() ? "" : "#" + fragment)}});
  WaitUntil("location.protocol === 'file:' && " + condition);
}

void Browser::Move(double x, double y) {
  Call("Input.dispatchMouseEvent", {{"type", "mouseMoved"}, {"x", x}, {"y", y}});
}

void Browser::Click(double x, double y) {
  for (const char* type : {"mousePressed", "mouseReleased"}) {
    Call("Input.dispatchMouseEvent",
         {{"type", type}, {"x", x}, {"y", y}, {"button", "left"}, {"clickCount", 1}});
  }
}

}  // namespace semfoam
