// SPDX-License-Identifier: MIT
#include "lecalib/host/event_writer.hpp"

#include <utility>

namespace lecalib::host {
namespace {

constexpr char kCsvTitle[] = "t_us,x,y,p\n";
constexpr std::size_t kMaxRow = 64;  // a row has 36 characters at most

/// Writes the decimal digits of `value` before `end`. @return where they begin
char* put_before(std::uint64_t value, char* end) {
  do {
    *--end = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value > 0);
  return end;
}

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() > end.size() && text.substr(text.size() - end.size()) == end;
}

}  // namespace

std::optional<OutputFormat> output_format_named(std::string_view name) {
  if (name == "evt3") return OutputFormat::evt3;
  if (name == "csv") return OutputFormat::csv;
  return std::nullopt;
}

std::optional<OutputFormat> output_format_of_path(std::string_view path) {
  if (ends_with(path, ".raw")) return OutputFormat::evt3;
  if (ends_with(path, ".csv") || ends_with(path, ".txt")) return OutputFormat::csv;
  return std::nullopt;
}

void append_csv(Span<const Event> events, std::string* text) {
  char row[kMaxRow];
  for (const Event& event : events) {
    char* begin = row + kMaxRow;
    *--begin = '\n';
    *--begin = event.polarity != 0 ? '1' : '0';
    *--begin = ',';
    begin = put_before(event.y, begin);
    *--begin = ',';
    begin = put_before(event.x, begin);
    *--begin = ',';
    const auto t_us = static_cast<std::uint64_t>(event.t_us);
    begin = put_before(event.t_us < 0 ? 0 - t_us : t_us, begin);
    if (event.t_us < 0) *--begin = '-';
    text->append(begin, row + kMaxRow);
  }
}

EventWriter::EventWriter(OutputFile file, OutputFormat format, SensorSize sensor)
    : file_(std::move(file)), format_(format), evt3_(sensor.width, sensor.height) {}

Result<EventWriter> EventWriter::create(const std::string& path, OutputFormat format, SensorSize sensor) {
  std::string begin = kCsvTitle;
  if (format == OutputFormat::evt3) {
    begin.clear();
    if (MaybeError error = Evt3Encoder(sensor.width, sensor.height).begin(&begin)) return *std::move(error);
  }
  Result<OutputFile> file = OutputFile::create(path);
  if (!file.ok()) return file.error();
  EventWriter writer(std::move(file).value(), format, sensor);
  if (MaybeError error = writer.file_.write(begin)) return *std::move(error);
  return writer;
}

MaybeError EventWriter::write(Span<const Event> events) {
  buffer_.clear();
  if (format_ == OutputFormat::csv) {
    append_csv(events, &buffer_);
  } else if (MaybeError error = evt3_.append(events, &buffer_)) {
    return error;
  }
  return file_.write(buffer_);
}

}  // namespace lecalib::host
