// SPDX-License-Identifier: MIT
/// The subcommands of the lecalib program. Each is one file with one function that adds it to the program: its options
/// with units and defaults, and a callback that runs it once the command line is read. A callback that returns has
/// succeeded; one that cannot ends the program through fail() or take().
#pragma once

#include <CLI/CLI.hpp>
#include <utility>

#include "lecalib/host/error.hpp"

namespace lecalib::command {

/// Thrown by a callback, caught by main(): no usable answer. Exit code 1.
struct Failure {
  host::Error error;
};

[[noreturn]] inline void fail(host::Error error) { throw Failure{std::move(error)}; }

/// The value, or the end of the command.
template <class T>
T take(host::Result<T> result) {
  if (!result.ok()) fail(result.error());
  return std::move(result).value();
}

inline void check(const host::MaybeError& error) {
  if (error) fail(*error);
}

// The subcommands, in the order in which --help lists them: main() calls each.
void add_calibrate(CLI::App& app);
void add_detect(CLI::App& app);
void add_simulate(CLI::App& app);
void add_info(CLI::App& app);
void add_convert(CLI::App& app);
void add_experiments(CLI::App& app);
// Where lecalib::usb is built.
void add_devices(CLI::App& app);
void add_record(CLI::App& app);
void add_live(CLI::App& app);

}  // namespace lecalib::command
