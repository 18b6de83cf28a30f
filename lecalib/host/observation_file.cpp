// SPDX-License-Identifier: MIT
#include "lecalib/host/observation_file.hpp"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>

#include "lecalib/host/file_io.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

/// Noise, lines that were extended to a window's end and what a pincushion lens throws out may lie outside of the
/// image; a wrong --sensor does it grossly.
constexpr double kMaxOutside = 0.25;

constexpr const char* kExpectedHeader = "expected the header 'view,line,u_px,v_px[,sigma_px][,t_us]'";
constexpr std::size_t kMinColumns = 4;

/// Three centuries: differences of times stay far from overflow.
constexpr std::int64_t kMaxTimeUs = 10'000'000'000'000'000;

struct Row {
  std::uint32_t view;
  std::size_t file_line;
  LinePoint point;
};

/// Reads the rows one by one and keeps what belongs to the whole table.
class TableParser {
 public:
  TableParser(const Model& model, const SensorSize& sensor) : sensor_(sensor) {
    for (std::size_t i = 0; i < model.names.size(); ++i) {
      line_of_name_.emplace(model.names[i], static_cast<std::uint16_t>(i));
    }
  }

  /// @return an Error without file and line.
  MaybeError header(std::string_view line) {
    static constexpr std::string_view kNames[] = {"view", "line", "u_px", "v_px"};
    const std::vector<Field> fields = split(line, ',');
    bool right = fields.size() >= kMinColumns;
    for (std::size_t i = 0; right && i < kMinColumns; ++i) right = fields[i].text == kNames[i];
    columns_ = kMinColumns;
    const auto take = [&](std::string_view name) {
      return columns_ < fields.size() && fields[columns_].text == name ? columns_++ : 0;
    };
    sigma_column_ = right ? take("sigma_px") : 0;
    time_column_ = right ? take("t_us") : 0;
    if (!right || columns_ != fields.size())
      return Error{std::string(kExpectedHeader) + ", found " + host::quoted(line)};
    return std::nullopt;
  }

  MaybeError row(std::string_view line, std::size_t file_line) {
    const std::vector<Field> fields = split(line, ',');
    if (fields.size() != columns_) {
      return Error{"expected " + std::to_string(columns_) + " fields, found " + std::to_string(fields.size())};
    }
    if (fields[0].text.empty()) return Error{"expected a view's label, found nothing", "", 0, fields[0].column};
    const auto line_index = line_of_name_.find(fields[1].text);
    if (line_index == line_of_name_.end()) {
      return Error{"the model has no line " + host::quoted(fields[1].text), "", 0, fields[1].column};
    }
    double values[3] = {0, 0, kDefaultSigmaPx};
    const std::size_t columns[3] = {2, 3, sigma_column_};
    for (std::size_t i = 0; i < 3; ++i) {
      if (columns[i] == 0) continue;
      const Field& field = fields[columns[i]];
      const std::optional<double> value = parse_number(field.text);
      if (!value)
        return Error{"expected a finite number of pixels, found " + host::quoted(field.text), "", 0, field.column};
      values[i] = *value;
    }
    if (values[2] <= 0) {
      const Field& field = fields[sigma_column_];
      return Error{"expected sigma_px > 0, found " + host::quoted(field.text), "", 0, field.column};
    }
    if (is_far_outside(values[0], sensor_.width)) return outside(fields[2]);
    if (is_far_outside(values[1], sensor_.height)) return outside(fields[3]);
    const std::uint32_t view = view_index(fields[0].text);
    if (time_column_ != 0) {
      if (MaybeError error = time_of_view(view, fields[time_column_])) return error;
    }
    rows_.push_back({view, file_line, {values[0], values[1], values[2], line_index->second}});
    return std::nullopt;
  }

  /// Groups the rows by view and line. @return an Error without file.
  Result<Observations> finish() {
    std::map<std::pair<std::uint32_t, std::uint16_t>, std::size_t> points_on_line;
    for (const Row& row : rows_) ++points_on_line[{row.view, row.point.line}];
    for (const Row& row : rows_) {
      if (points_on_line[{row.view, row.point.line}] == 1) {
        return Error{
            "the only point of its line in view " + host::quoted(view_names_[row.view]) + ", expected two or more", "",
            row.file_line};
      }
    }
    const auto key = [](const Row& row) { return std::pair(row.view, row.point.line); };
    std::stable_sort(rows_.begin(), rows_.end(), [key](const Row& a, const Row& b) { return key(a) < key(b); });
    Observations out;
    out.has_sigma = sigma_column_ != 0;
    out.has_times = time_column_ != 0;
    out.view_names = std::move(view_names_);
    for (const Row& row : rows_) {
      if (out.views.size() == row.view) {
        const auto t_us = out.has_times ? times_[row.view] : static_cast<std::int64_t>(row.view);
        out.views.push_back({t_us, static_cast<std::uint32_t>(out.points.size()), 0});
      }
      ++out.views.back().count;
      out.points.push_back(row.point);
    }
    return out;
  }

 private:
  static bool is_far_outside(double position, std::uint16_t size) {
    return position < -kMaxOutside * size || position > (1 + kMaxOutside) * size;
  }
  Error outside(const Field& field) const {
    return {std::string(field.text) + " px lies far outside of a sensor of " + to_string(sensor_), "", 0, field.column};
  }
  std::uint32_t view_index(std::string_view label) {
    const auto next = static_cast<std::uint32_t>(view_names_.size());
    const auto [known, is_new] = index_of_view_.emplace(std::string(label), next);
    if (is_new) view_names_.emplace_back(label);
    return known->second;
  }

  /// A view has one time.
  MaybeError time_of_view(std::uint32_t view, const Field& field) {
    const std::optional<unsigned long long> time = parse_count(field.text);
    if (!time || *time > static_cast<unsigned long long>(kMaxTimeUs)) {
      return Error{"expected a whole number of microseconds, found " + host::quoted(field.text), "", 0, field.column};
    }
    const auto t_us = static_cast<std::int64_t>(*time);
    if (times_.size() <= view) times_.push_back(t_us);
    if (times_[view] == t_us) return std::nullopt;
    return Error{"the view had the time " + std::to_string(times_[view]) + " before, found " + host::quoted(field.text),
                 "", 0, field.column};
  }

  SensorSize sensor_;
  std::map<std::string, std::uint16_t, std::less<>> line_of_name_;
  std::unordered_map<std::string, std::uint32_t> index_of_view_;
  std::vector<std::string> view_names_;
  std::vector<Row> rows_;
  std::vector<std::int64_t> times_;  // of views
  std::size_t columns_ = 0;
  std::size_t sigma_column_ = 0;  // 0: there is none
  std::size_t time_column_ = 0;
};

}  // namespace

Result<Observations> parse_observations(std::string_view text, const std::string& file_name, const Model& model,
                                        const SensorSize& sensor) {
  TableParser table(model, sensor);
  LineReader reader(text);
  std::string_view raw;
  bool has_header = false;
  bool has_rows = false;
  while (reader.next(&raw)) {
    const std::string_view line = without_comment(raw);
    if (line.empty()) continue;
    const MaybeError error = has_header ? table.row(line, reader.number()) : table.header(line);
    if (error) return Error{error->message, file_name, reader.number(), error->column};
    has_rows = has_header;
    has_header = true;
  }
  if (!has_header) return Error{std::string(kExpectedHeader) + ", found nothing", file_name};
  if (!has_rows) return Error{"expected rows below the header, found none", file_name, reader.number()};
  Result<Observations> out = table.finish();
  if (!out.ok()) return Error{out.error().message, file_name, out.error().line};
  return out;
}

Result<Observations> read_observations(const std::string& path, const Model& model, const SensorSize& sensor) {
  const Result<std::string> text = read_text_file(path);
  if (!text.ok()) return text.error();
  return parse_observations(text.value(), path, model, sensor);
}

}  // namespace lecalib::host
