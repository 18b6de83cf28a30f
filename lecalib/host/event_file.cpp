// SPDX-License-Identifier: MIT
#include "lecalib/host/event_file.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr std::size_t kBytesPerRead = std::size_t{1} << 18U;
constexpr std::size_t kEventsPerRead = std::size_t{1} << 16U;
constexpr std::size_t kTriggersPerRead = std::size_t{1} << 17U;
constexpr std::size_t kMaxTriggersPerRead = std::size_t{1} << 22U;
constexpr std::size_t kMinTriggerBytes = 2;  // in EVT3
constexpr std::size_t kImuSamplesPerRead = std::size_t{1} << 14U;

/// More events than this share (1 of kOutsideShare) beside the sensor, and it is the wrong size; fewer are bit errors.
constexpr std::uint64_t kOutsideShare = 100;
constexpr std::uint64_t kMinOutside = 50;

/// Sensors on the market. A short recording seldom reaches the last column and row.
constexpr SensorSize kKnownSensors[] = {{128, 128}, {240, 180}, {304, 240}, {320, 240},  {320, 320},
                                        {346, 260}, {480, 360}, {640, 480}, {1280, 720}, {1280, 800}};
constexpr double kAlmost = 0.95;

/// The known sensor that `seen` almost fills, else `seen` itself.
SensorSize likely_sensor(SensorSize seen) {
  for (const SensorSize& known : kKnownSensors) {
    const bool fits = seen.width <= known.width && seen.height <= known.height;
    if (fits && seen.width > kAlmost * known.width && seen.height > kAlmost * known.height) return known;
  }
  return seen;
}

constexpr char kReads[] = "expected Prophesee RAW (EVT2, EVT2.1, EVT3) or DAT, AEDAT 2 or 4, Event Stream 2 or text";

/// What a user can do about a format that is not read.
const char* advice(std::string_view format) {
  if (format == "gzip" || format == "zip" || format == "xz" || format == "zstd") return ": unpack it first";
  const bool is_bag = format == "ROS bag" || format == "SQLite (ROS 2 bag)" || format == "MCAP";
  return is_bag || format == "HDF5" ? ": the README tells how to convert it" : "";
}

/// Line `number` of a text file in quotes, for a message.
std::string quoted_line(const std::string& path, std::uint64_t number) {
  Result<InputFile> input = InputFile::open(path);
  if (!input.ok()) return "";
  std::vector<std::uint8_t> chunk(kBytesPerRead);
  std::string line;
  for (std::uint64_t at = 1; at <= number;) {
    const Result<std::size_t> count = input.value().read(chunk);
    if (!count.ok() || count.value() == 0) break;
    for (std::size_t i = 0; i < count.value() && at <= number; ++i) {
      if (chunk[i] == '\n')
        ++at;
      else if (at == number && line.size() < 100)
        line += static_cast<char>(chunk[i]);
    }
  }
  while (!line.empty() && line.back() == '\r') line.pop_back();
  return quoted(line);
}

}  // namespace

EventFile::EventFile(InputFile input, SensorSize size)
    : input_(std::move(input)),
      decoder_(size),
      sensor_(size),
      bytes_(kBytesPerRead),
      events_(kEventsPerRead),
      triggers_(kTriggersPerRead),
      imu_samples_(kImuSamplesPerRead) {
  side_ = {FixedVector<TriggerEvent>(triggers_), FixedVector<ImuSample>(imu_samples_)};
}

Result<EventFile> EventFile::open(const std::string& path, SensorSize given, Needs needs) {
  Result<EventFile> opened = open_with_head(path, given, needs);
  if (!opened.ok()) return opened;
  EventFile& file = opened.value();
  const SensorSize stated = file.decoder_.stated_size();
  const bool both_known = is_known(stated) && is_known(given);
  if (both_known && (stated.width != given.width || stated.height != given.height)) {
    return Error{"the file is of a sensor of " + to_string(stated) + ", not " + to_string(given), path};
  }
  file.sensor_ = file.decoder_.size();
  if (is_known(file.sensor_) || file.num_ahead_ == std::size_t{0}) return opened;
  if (file.size_bytes() == 0) return Error{"does not state the sensor's size: give --sensor WxH", path};
  const Result<SensorSize> guess = size_of_all_events(path);
  if (!guess.ok()) return guess.error();
  file.sensor_ = guess.value();
  file.sensor_is_guess_ = true;
  return opened;
}

/// The first events are read ahead: what a file states about itself is known after that.
Result<EventFile> EventFile::open_with_head(const std::string& path, SensorSize given, Needs needs) {
  Result<InputFile> input = InputFile::open(path);
  if (!input.ok()) return input.error();
  EventFile file(std::move(input).value(), given);
  const Result<std::size_t> ahead = file.decode();
  if (!ahead.ok()) return ahead.error();
  if (ahead.value() == 0) {
    const bool has_others = file.stats().triggers + file.stats().imu_samples > 0;
    if (!has_others) return Error{"holds no events", path};
    if (needs == Needs::events) return Error{"holds no events, only triggers or IMU samples", path};
  }
  file.num_ahead_ = ahead.value();
  return file;
}

Result<SensorSize> EventFile::size_of_all_events(const std::string& path) {
  Result<EventFile> file = open_with_head(path, {}, Needs::events);
  if (!file.ok()) return file.error();
  SensorSize size;
  while (true) {
    const Result<Span<const Event>> events = file.value().read();
    if (!events.ok()) return events.error();
    if (events.value().empty()) return likely_sensor(size);
    for (const Event& event : events.value()) {
      size.width = std::max(size.width, static_cast<std::uint16_t>(event.x + 1));
      size.height = std::max(size.height, static_cast<std::uint16_t>(event.y + 1));
    }
  }
}

Result<Span<const Event>> EventFile::read() {
  const Result<std::size_t> count = num_ahead_ ? Result<std::size_t>(*num_ahead_) : decode();
  num_ahead_.reset();
  if (!count.ok()) return count.error();
  if (const MaybeError error = check_sensor()) return *error;
  return Span<const Event>(events_.data(), count.value());
}

std::uint64_t EventFile::side_dropped() const {
  return side_dropped_ + side_.triggers.dropped() + side_.imu_samples.dropped();
}

/// Fills events_ from its begin. @return how many; 0 at the end of the file.
Result<std::size_t> EventFile::decode() {
  side_dropped_ = side_dropped();
  side_.triggers.clear();
  side_.imu_samples.clear();
  while (true) {
    if (unread_.empty() && !at_end_) {
      if (const MaybeError error = fill()) return *error;
    }
    make_room_for_triggers();
    std::size_t count = 0;
    const std::uint64_t begin_ns = thread_cpu_ns();
    const bool finishing = unread_.empty() && at_end_;
    const Status status =
        finishing ? decoder_.finish(events_, &count, &side_) : decoder_.decode(&unread_, events_, &count, &side_);
    decode_cpu_ns_ += thread_cpu_ns() - begin_ns;
    if (is_error(status)) return decode_error(status);
    if (count > 0 || finishing) return count;
  }
}

/// A row of triggers without an event between them, as files of triggers alone are, comes with one read().
void EventFile::make_room_for_triggers() {
  const std::size_t wanted = side_.triggers.size() + unread_.size() / kMinTriggerBytes;
  if (wanted <= triggers_.size() || triggers_.size() == kMaxTriggersPerRead || side_.triggers.dropped() > 0) return;
  const std::size_t count = side_.triggers.size();
  triggers_.resize(std::min(std::max(wanted, 2 * triggers_.size()), kMaxTriggersPerRead));
  side_.triggers = FixedVector<TriggerEvent>(triggers_);
  for (std::size_t i = 0; i < count; ++i) (void)side_.triggers.try_push(TriggerEvent(triggers_[i]));
}

/// The file's next bytes as they are; at_end_ where there are none.
MaybeError EventFile::read_bytes(Span<const std::uint8_t>* out) {
  const Result<std::size_t> count = input_.read(bytes_);
  if (!count.ok()) return count.error();
  at_end_ = count.value() == 0;
  bytes_read_ += count.value();
  *out = Span<const std::uint8_t>(bytes_.data(), count.value());
  return std::nullopt;
}

MaybeError EventFile::fill() {
  if (gzip_) return fill_from_gzip();
  if (MaybeError error = read_bytes(&unread_)) return error;
  if (bytes_read_ == 0) return Error{"the file is empty", path()};
  const bool is_begin = bytes_read_ == unread_.size();
  if (!is_begin || !GzipReader::is_available() || !GzipReader::is_gzip(unread_)) return std::nullopt;
  gzip_.emplace();
  packed_ = unread_;
  unpacked_.resize(kBytesPerRead);
  return fill_from_gzip();
}

MaybeError EventFile::fill_from_gzip() {
  std::size_t count = 0;
  unread_ = {};
  while (true) {
    if (!gzip_->read(&packed_, unpacked_, &count)) break;
    unread_ = Span<const std::uint8_t>(unpacked_.data(), count);
    if (count > 0) return std::nullopt;
    if (MaybeError error = read_bytes(&packed_)) return error;
    if (!at_end_) continue;
    if (gzip_->is_between_members()) return std::nullopt;
    break;
  }
  return Error{"expected a whole gzip file", path(), 0, 0, bytes_read_ - packed_.size()};
}

double EventFile::fraction_read() const {
  return size_bytes() > 0 ? static_cast<double>(bytes_read_) / static_cast<double>(size_bytes()) : 0;
}

Error EventFile::decode_error(Status status) const {
  const DecodeError& cause = decoder_.error();
  std::string expected = std::string("expected ") + cause.expected;
  if (status == Status::unsupported_format) {
    const std::string_view name = format_name();
    const std::string found = name == "unknown" ? "something else" : std::string(name);
    if (name != "AEDAT 2") expected = kReads;
    return {expected + ", found " + found + advice(name), path(), 0, 0, std::nullopt, status};
  }
  if (cause.line == 0) return {expected, path(), 0, 0, cause.offset};
  const bool is_pipe = size_bytes() == 0;  // opened anew it would block, or go on elsewhere
  const std::string found = is_pipe || gzip_ ? "" : quoted_line(path(), cause.line);
  return {expected + (found.empty() ? "" : ", found " + found), path(), static_cast<std::size_t>(cause.line)};
}

MaybeError EventFile::check_sensor() const {
  const DecoderStats& counts = stats();
  if (counts.outside < kMinOutside || counts.outside * kOutsideShare < counts.events + counts.outside)
    return std::nullopt;
  return Error{std::to_string(counts.outside) + " of " + std::to_string(counts.events + counts.outside) +
                   " events lie outside of a sensor of " + to_string(sensor_) + ": is its size right?",
               path()};
}

}  // namespace lecalib::host
