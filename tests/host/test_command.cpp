// SPDX-License-Identifier: MIT
/// What holds for every subcommand, seen from the outside.
#include <doctest/doctest.h>

#include <algorithm>

#include "support/run_command.hpp"

using lecalib::test::CommandRun;
using lecalib::test::run_lecalib;
using lecalib::test::RunAs;

TEST_CASE("lecalib: help and version succeed and go to stdout") {
  const CommandRun help = run_lecalib({"--help"});
  CHECK(help.exit_code == 0);
  CHECK(help.err.empty());
  CHECK(help.out.find("lecalib calibrates event cameras") != std::string::npos);
  const CommandRun version = run_lecalib({"--version"});
  CHECK(version.exit_code == 0);
  CHECK(version.out.rfind("lecalib ", 0) == 0);
}

TEST_CASE("lecalib: an answer that cannot be written is none") {
  for (const auto& arguments : std::vector<std::vector<std::string>>{{"--version"}, {"info", "--help"}}) {
    const CommandRun run = run_lecalib(arguments, RunAs::me, "/dev/full");
    CHECK(run.exit_code == 1);
    CHECK(run.err == "lecalib: cannot write to the standard output\n");
  }
}

TEST_CASE("lecalib: a wrong command line is one line on stderr") {
  for (const auto& arguments : std::vector<std::vector<std::string>>{{}, {"nonsense"}, {"--nonsense"}}) {
    const CommandRun run = run_lecalib(arguments);
    CHECK(run.exit_code == 2);
    CHECK(run.out.empty());
    CHECK(run.err.rfind("lecalib: ", 0) == 0);
    CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
  }
}
