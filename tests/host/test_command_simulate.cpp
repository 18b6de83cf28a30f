// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <sstream>

#include "lecalib/host/file_io.hpp"
#include "support/run_command.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"

using lecalib::host::read_text_file;
using namespace lecalib::test;

namespace {

/// The arguments of the `lecalib simulate` line in a text, without --out and what follows.
std::vector<std::string> simulate_line(const std::string& text) {
  const std::size_t first = text.find(" simulate ");
  std::istringstream words(text.substr(first, text.find("--out", first) - first));
  std::vector<std::string> arguments;
  for (std::string word; words >> word;) arguments.push_back(word);
  return arguments;
}

}  // namespace

TEST_CASE("lecalib simulate: the shipped recording is what its README says") {
  const std::string shipped = (source_dir() / "examples" / "data").string();
  std::vector<std::string> arguments = simulate_line(read_text_file(shipped + "/README.md").value());
  const TemporaryFolder folder;
  arguments.insert(arguments.end(), {"--out", folder.path()});
  const CommandRun run = run_lecalib(arguments);
  REQUIRE(run.exit_code == 0);
  CHECK(run.err.empty());  // no terminal, no progress
  for (const char* name : {"events.raw", "model.txt", "truth.json"}) {
    INFO(name);
    CHECK((read_text_file(shipped + "/" + name).value() == read_text_file(folder / name).value()));
  }
}

TEST_CASE("lecalib simulate: the firmware's clip is what its README says") {
  const std::string firmware = (source_dir() / "examples" / "firmware").string();
  std::vector<std::string> arguments = simulate_line(read_text_file(firmware + "/README.md").value());
  const TemporaryFolder folder;
  arguments.insert(arguments.end(), {"--out", folder.path()});
  REQUIRE(run_lecalib(arguments).exit_code == 0);
  CHECK((read_text_file(firmware + "/clip.raw").value() == read_text_file(folder / "events.raw").value()));
}

TEST_CASE("lecalib simulate: what cannot be simulated is one line on stderr, and no file") {
  const TemporaryFolder folder;
  const std::string out = folder / "out";
  const std::vector<std::vector<std::string>> wrong = {
      {"--target", "box:0.4x0.3"},
      {"--target", "file:" + (folder / "missing.txt")},
      {"--target", "box:1x1x1", "--sensor", "346"},
      {"--target", "box:1x1x1", "--sensor", "4000x3000"},
      {"--target", "box:1x1x1", "--fx", "-5"},
      {"--target", "box:1x1x1", "--fx", "300", "--fov", "60"},
      {"--target", "box:1x1x1", "--motion", "fly"},
      {"--target", "box:1x1x1", "--duration-s", "0"},
      {"--target", "box:1x1x1", "--threshold", "0"},
      {"--target", "box:1x1x1", "--noise", "-1"},
      {"--target", "box:1x1x1", "--seed", "x"},
      {"--target", "box:1x1x1", "--start-us", "9000000000000000000"},
      {},
  };
  for (const std::vector<std::string>& options : wrong) {
    std::vector<std::string> arguments = {"simulate", "--out", out};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const CommandRun run = run_lecalib(arguments);
    INFO(run.err);
    CHECK(run.exit_code > 0);
    CHECK(run.out.empty());
    CHECK(run.err.rfind("lecalib: ", 0) == 0);
    CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
    CHECK(folder.count() == 0);
  }
}
