// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "lecalib/core/records.hpp"
#include "lecalib/events/decoder.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/raw_writer.hpp"

namespace lecalib::host {

enum class OutputFormat : std::uint8_t {
  evt3,  ///< Prophesee RAW, see Evt3Encoder
  csv,   ///< a title, then rows "t_us,x,y,p"; any time and any order
};

/// By its name ("evt3", "csv"), or by the end of a file's name (".raw"; ".csv", ".txt").
std::optional<OutputFormat> output_format_named(std::string_view name);
std::optional<OutputFormat> output_format_of_path(std::string_view path);

/// Appends events as rows of a CSV file.
void append_csv(Span<const Event> events, std::string* text);

/// Writes a recording piece by piece. The file appears under its name once commit() is called.
class EventWriter {
 public:
  /// @param sensor its size, which EVT3 wants to know
  static Result<EventWriter> create(const std::string& path, OutputFormat format, SensorSize sensor);
  /// @return an error with the first event that the format cannot hold, or what the operating system refused
  MaybeError write(Span<const Event> events);
  MaybeError commit() { return file_.commit(); }

 private:
  EventWriter(OutputFile file, OutputFormat format, SensorSize sensor);

  OutputFile file_;
  OutputFormat format_;
  Evt3Encoder evt3_;
  std::string buffer_;
};

}  // namespace lecalib::host
