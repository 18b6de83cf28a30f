// SPDX-License-Identifier: MIT
#include "lecalib/host/gyro_file.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "lecalib/host/event_file.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr const char* kGyroColumns = "t_us,wx,wy,wz";
constexpr std::size_t kColumns = 4;

/// @param[out] columns  how many there are
MaybeError check_header(std::string_view line, std::size_t* columns) {
  static constexpr std::string_view kNames[kColumns] = {"t_us", "wx", "wy", "wz"};
  const std::vector<Field> fields = split(line, ',');
  bool right = fields.size() >= kColumns;
  for (std::size_t i = 0; right && i < kColumns; ++i) right = fields[i].text == kNames[i];
  if (!right) return Error{std::string("expected the header '") + kGyroColumns + "', found " + quoted(line)};
  *columns = fields.size();
  return std::nullopt;
}

/// Times below are exact as doubles.
constexpr double kMaxTime = 9e15;

MaybeError add_row(std::string_view line, std::size_t columns, std::vector<GyroSample>* samples) {
  const std::vector<Field> fields = split(line, ',');
  if (fields.size() != columns) {
    return Error{"expected " + std::to_string(columns) + " fields, found " + std::to_string(fields.size())};
  }
  double values[kColumns];
  for (std::size_t i = 0; i < kColumns; ++i) {
    const std::optional<double> value = parse_number(fields[i].text);
    if (!value || (i == 0 && !(*value > -kMaxTime && *value < kMaxTime))) {
      return Error{"expected a finite number, found " + quoted(fields[i].text), "", 0, fields[i].column};
    }
    values[i] = *value;
  }
  const GyroSample sample{static_cast<std::int64_t>(values[0]), {values[1], values[2], values[3]}};
  if (!samples->empty() && sample.t_us <= samples->back().t_us) {
    return Error{"expected a time above the last one, found " + quoted(fields[0].text), "", 0, fields[0].column};
  }
  samples->push_back(sample);
  return std::nullopt;
}

}  // namespace

Result<std::vector<GyroSample>> parse_gyro(std::string_view text, const std::string& file_name) {
  std::vector<GyroSample> samples;
  LineReader reader(text);
  std::string_view raw;
  std::size_t columns = 0;
  while (reader.next(&raw)) {
    const std::string_view line = without_comment(raw);
    if (line.empty()) continue;
    const MaybeError error = columns > 0 ? add_row(line, columns, &samples) : check_header(line, &columns);
    if (error) return Error{error->message, file_name, reader.number(), error->column};
  }
  if (columns == 0) return Error{std::string("expected the header '") + kGyroColumns + "', found nothing", file_name};
  if (samples.empty()) return Error{"expected rows below the header, found none", file_name, reader.number()};
  return samples;
}

Result<std::vector<GyroSample>> read_gyro(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text.ok()) return text.error();
  return parse_gyro(text.value(), path);
}

Result<std::vector<GyroSample>> read_gyro_of_recording(const std::string& path, SensorSize sensor) {
  Result<EventFile> file = EventFile::open(path, sensor);
  if (!file.ok()) return file.error();
  std::vector<GyroSample> samples;
  for (bool is_over = false; !is_over;) {
    const Result<Span<const Event>> events = file.value().read();
    if (!events.ok()) return events.error();
    is_over = events.value().empty();
    for (const ImuSample& sample : file.value().imu_samples()) {
      const bool is_measured =
          std::none_of(sample.gyro_rad_s, sample.gyro_rad_s + 3, [](float w) { return std::isnan(w); });
      if (!is_measured || (!samples.empty() && sample.t_us <= samples.back().t_us)) continue;
      samples.push_back({sample.t_us, {}});
      std::copy_n(sample.gyro_rad_s, 3, samples.back().rate);
    }
  }
  if (samples.empty()) return Error{"holds no IMU samples", path};
  if (std::string_view(file.value().format_name()) == "EVT2") {
    return Error{"EVT2 does not tell the range of its gyro: scale what `lecalib convert --imu` writes for 2000 deg/s",
                 path};
  }
  return samples;
}

std::vector<RelativePrior> pair_views(const GyroOptions& options, Span<const GyroSample> samples,
                                      Span<const View> views) {
  std::vector<std::uint32_t> order(views.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [views](std::uint32_t a, std::uint32_t b) { return views[a].t_us < views[b].t_us; });
  std::vector<RelativePrior> priors;
  for (std::size_t i = 0; i + 1 < order.size(); i += 2) {
    RelativePrior prior;
    prior.view_a = order[i];
    prior.view_b = order[i + 1];
    if (integrate_gyro(options, samples, views[prior.view_a].t_us, views[prior.view_b].t_us, &prior) == Status::ok) {
      priors.push_back(prior);
    }
  }
  return priors;
}

}  // namespace lecalib::host
