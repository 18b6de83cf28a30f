// SPDX-License-Identifier: MIT
/// What the subcommands that read a recording have in common.
#pragma once

#include <string>

#include "commands.hpp"
#include "lecalib/host/event_file.hpp"

namespace lecalib::command {

void add_sensor_option(CLI::App* command, std::string* sensor);
void add_events_option(CLI::App* command, std::string* events);

/// The size in the words of --sensor; 0 x 0 when it is empty.
SensorSize sensor_size(const std::string& sensor);

/// Opens a recording; says on stderr when its sensor's size had to be guessed.
host::EventFile open_events(const std::string& path, const std::string& sensor);

}  // namespace lecalib::command
