// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "support/temporary_folder.hpp"

namespace lecalib::test {

/// What a program did.
struct CommandRun {
  int exit_code = -1;  ///< -1 when a signal ended it
  std::string out;
  std::string err;
};

/// Who runs the program: a test of file permissions means nothing when run by root.
enum class RunAs { me, nobody };

/// The built `lecalib` program while it runs. See run_lecalib().
class StartedCommand {
 public:
  explicit StartedCommand(const std::vector<std::string>& arguments, RunAs who = RunAs::me,
                          const std::string& output = "");
  [[nodiscard]] pid_t pid() const { return pid_; }
  bool has_ended();
  /// Waits for its end.
  CommandRun finish();

 private:
  TemporaryFolder folder_;
  pid_t pid_;
  bool has_ended_ = false;
  int status_ = 0;
};

/// Runs the built `lecalib` program with these arguments and waits for it.
/// RunAs::nobody needs to be root and a build folder that others may enter; otherwise the program cannot start and the
/// exit code is kCannotRun.
/// @param output where its standard output goes; empty: into CommandRun::out
CommandRun run_lecalib(const std::vector<std::string>& arguments, RunAs who = RunAs::me,
                       const std::string& output = "");

inline constexpr int kCannotRun = 127;

/// How soon the program ends once it has to, s. Another build that the environment names is given ten times as long: it
/// may be one for ThreadSanitizer or valgrind.
double max_hang_s();

}  // namespace lecalib::test
