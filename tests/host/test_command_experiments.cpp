// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "lecalib/host/file_io.hpp"
#include "support/run_command.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;
using lecalib::host::read_text_file;

namespace {

/// One short line on stderr, nothing on stdout.
void check_complaint(const CommandRun& run) {
  INFO(run.err);
  CHECK(run.exit_code > 0);
  CHECK(run.out.empty());
  CHECK(run.err.rfind("lecalib: ", 0) == 0);
  CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
}

}  // namespace

TEST_CASE("lecalib experiments: writes the table and the figures asked for, the same for any number of threads") {
  const TemporaryFolder folder;
  const auto run_with = [&](const std::string& threads) {
    const std::string out = folder / threads;
    const CommandRun run = run_lecalib({"experiments", "--out", out, "--trials", "6", "--seed", "3", "--only", "table",
                                        "--only", "distortion", "--protocol", "P", "--threads", threads});
    CHECK(run.exit_code == 0);
    CHECK(run.err.empty());  // no terminal, no progress
    CHECK(run.out == out + "/experiments.csv\n" + out + "/experiments.md\n" + out + "/distortion_P.svg\n");
    return out;
  };
  const std::string one = run_with("1");
  const std::string three = run_with("3");
  for (const char* name : {"/experiments.csv", "/experiments.md", "/distortion_P.svg"}) {
    INFO(name);
    const auto text = read_text_file(one + name);
    REQUIRE(text.ok());
    CHECK(text.value().size() > 500);
    CHECK((text.value() == read_text_file(three + name).value()));
  }
}

TEST_CASE("lecalib experiments: a wrong option is one line on stderr, and nothing is written") {
  const TemporaryFolder folder;
  const std::string out = folder / "out";
  const std::vector<std::vector<std::string>> wrong = {
      {"--trials", "0"},  {"--trials", "-3"},    {"--trials", "many"}, {"--trials", "100000000"}, {"--seed", "x"},
      {"--threads", "0"}, {"--threads", "9999"}, {"--only", "figure"}, {"--protocol", "Q"},       {"surplus"},
  };
  for (const std::vector<std::string>& options : wrong) {
    std::vector<std::string> arguments = {"experiments", "--out", out};
    arguments.insert(arguments.end(), options.begin(), options.end());
    check_complaint(run_lecalib(arguments));
    CHECK(folder.count() == 0);
  }
  check_complaint(run_lecalib({"experiments"}));
}

TEST_CASE("lecalib experiments: a folder that cannot be written to is told before any trial is run") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(lecalib::host::write_file(folder / "file", "x"));
  check_complaint(run_lecalib({"experiments", "--out", folder / "file"}));
  check_complaint(run_lecalib({"experiments", "--out", folder / "file/inside"}));

  REQUIRE(::mkdir((folder / "closed").c_str(), 0755) == 0);
  REQUIRE(::chmod(folder.path().c_str(), 0755) == 0);
  REQUIRE(::chmod((folder / "closed").c_str(), 0555) == 0);
  const RunAs who = ::getuid() == 0 ? RunAs::nobody : RunAs::me;
  const CommandRun run = run_lecalib({"experiments", "--out", folder / "closed"}, who);
  if (run.exit_code == kCannotRun) {
    MESSAGE("skipped: nobody may run the program in this folder");
    return;
  }
  check_complaint(run);
}
