// SPDX-License-Identifier: MIT
#include "support/run_command.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <stdexcept>

#include "support/temporary_folder.hpp"

namespace lecalib::test {
namespace {

constexpr uid_t kNobody = 65534;

std::string content(const std::string& path) {
  std::string text;
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return text;
  char chunk[4096];
  for (std::size_t n = 0; (n = std::fread(chunk, 1, sizeof chunk, file)) > 0;) text.append(chunk, n);
  std::fclose(file);
  return text;
}

/// In the child: sends a stream into a file.
void redirect(int stream, const std::string& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file < 0 || ::dup2(file, stream) < 0) ::_exit(kCannotRun);
}

/// Another build of the program than the tests' own: one with ThreadSanitizer, say. Null: the environment names none.
const char* other_lecalib() { return ::getenv("LECALIB_COMMAND"); }

const char* path_of_lecalib() {
  const char* const other = other_lecalib();
  return other != nullptr ? other : LECALIB_COMMAND;
}

[[noreturn]] void become_lecalib(const std::vector<std::string>& arguments, RunAs who) {
  // What runs the programs of another processor, told to show the program its name; or nothing.
  std::vector<std::string> words = {LECALIB_EMULATOR};
  const bool emulated = !words.empty();
  if (emulated) {
    words.insert(words.end(), {"-0", "lecalib", path_of_lecalib()});
  } else {
    words.emplace_back("lecalib");
  }
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  if (who == RunAs::nobody && (::setgid(kNobody) != 0 || ::setuid(kNobody) != 0)) ::_exit(kCannotRun);
  ::execvp(emulated ? argv[0] : path_of_lecalib(), argv.data());
  ::_exit(kCannotRun);
}

}  // namespace

StartedCommand::StartedCommand(const std::vector<std::string>& arguments, RunAs who, const std::string& output)
    : pid_(::fork()) {
  if (pid_ < 0) throw std::runtime_error("fork failed");
  if (pid_ > 0) return;
  redirect(STDOUT_FILENO, output.empty() ? folder_ / "out" : output);
  redirect(STDERR_FILENO, folder_ / "err");
  become_lecalib(arguments, who);
}

bool StartedCommand::has_ended() {
  if (!has_ended_) has_ended_ = ::waitpid(pid_, &status_, WNOHANG) == pid_;
  return has_ended_;
}

CommandRun StartedCommand::finish() {
  if (!has_ended_ && ::waitpid(pid_, &status_, 0) != pid_) throw std::runtime_error("waitpid failed");
  has_ended_ = true;
  return {WIFEXITED(status_) ? WEXITSTATUS(status_) : -1, content(folder_ / "out"), content(folder_ / "err")};
}

CommandRun run_lecalib(const std::vector<std::string>& arguments, RunAs who, const std::string& output) {
  return StartedCommand(arguments, who, output).finish();
}

double max_hang_s() { return other_lecalib() == nullptr ? 2 : 20; }

}  // namespace lecalib::test
