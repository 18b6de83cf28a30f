// SPDX-License-Identifier: MIT
/// The lecalib program: reads the command line and runs one subcommand.
/// Exit code 0: a usable answer. 1: no usable answer, one line on stderr says why. Above 1: the command line is wrong.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>

#include "commands.hpp"

namespace {

/// One line whatever the message quotes: a file's name may hold line ends and escape codes.
int report(std::string message, int exit_code) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; };
  std::replace_if(message.begin(), message.end(), is_control, '?');
  std::fprintf(stderr, "lecalib: %s\n", message.c_str());
  return exit_code;
}

/// An answer that did not reach its reader is none.
int finish_output() {
  const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  return written ? 0 : report("cannot write to the standard output", 1);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace lecalib::command;
  (void)std::signal(SIGXFSZ, SIG_IGN);  // a limit to files is an error of the write that meets it
  CLI::App app{"lecalib calibrates event cameras from straight lines."};
  app.name("lecalib");
  app.set_version_flag("--version", "lecalib " LECALIB_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  add_calibrate(app);
  add_detect(app);
  add_simulate(app);
  add_info(app);
  add_convert(app);
  add_experiments(app);
#ifdef LECALIB_HAS_USB
  add_devices(app);
  add_record(app);
  add_live(app);
#endif
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help and --version
      app.exit(error);
      std::cout.flush();
      return finish_output();
    }
    return report(std::string(error.what()) + " (lecalib --help lists what there is)", 2);
  } catch (const Failure& failure) {
    return report(lecalib::host::to_string(failure.error), 1);
  } catch (const std::bad_alloc&) {
    return report("not enough memory", 1);
  } catch (const std::exception& error) {
    return report(error.what(), 1);
  }
  return finish_output();
}
