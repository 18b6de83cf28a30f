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
    static constexpr std::string_view kNames[] = {"view", "line", "u_px", "v_px", "sigma_px"};
    const std::vector<Field> fields = split(line, ',');
    bool right = fields.size() == 4 || fields.size() == 5;
    for (std::size_t i = 0; right && i < fields.size(); ++i) right = fields[i].text == kNames[i];
    if (!right) return Error{"expected the header 'view,line,u_px,v_px[,sigma_px]', found " + quoted(line)};
    columns_ = fields.size();
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
      return Error{"the model has no line " + quoted(fields[1].text), "", 0, fields[1].column};
    }
    double values[3] = {0, 0, kDefaultSigmaPx};
    for (std::size_t i = 2; i < columns_; ++i) {
      const std::optional<double> value = parse_number(fields[i].text);
      if (!value)
        return Error{"expected a finite number of pixels, found " + quoted(fields[i].text), "", 0, fields[i].column};
      values[i - 2] = *value;
    }
    if (values[2] <= 0) return Error{"expected sigma_px > 0, found " + quoted(fields[4].text), "", 0, fields[4].column};
    if (is_far_outside(values[0], sensor_.width)) return outside(fields[2]);
    if (is_far_outside(values[1], sensor_.height)) return outside(fields[3]);
    rows_.push_back({view_index(fields[0].text), file_line, {values[0], values[1], values[2], line_index->second}});
    return std::nullopt;
  }

  /// Groups the rows by view and line. @return an Error without file.
  Result<Observations> finish() {
    std::map<std::pair<std::uint32_t, std::uint16_t>, std::size_t> points_on_line;
    for (const Row& row : rows_) ++points_on_line[{row.view, row.point.line}];
    for (const Row& row : rows_) {
      if (points_on_line[{row.view, row.point.line}] == 1) {
        return Error{"the only point of its line in view " + quoted(view_names_[row.view]) + ", expected two or more",
                     "", row.file_line};
      }
    }
    const auto key = [](const Row& row) { return std::pair(row.view, row.point.line); };
    std::stable_sort(rows_.begin(), rows_.end(), [key](const Row& a, const Row& b) { return key(a) < key(b); });
    Observations out;
    out.has_sigma = columns_ == 5;
    out.view_names = std::move(view_names_);
    for (const Row& row : rows_) {
      if (out.views.size() == row.view) {
        out.views.push_back({static_cast<std::int64_t>(row.view), static_cast<std::uint32_t>(out.points.size()), 0});
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

  SensorSize sensor_;
  std::map<std::string, std::uint16_t, std::less<>> line_of_name_;
  std::unordered_map<std::string, std::uint32_t> index_of_view_;
  std::vector<std::string> view_names_;
  std::vector<Row> rows_;
  std::size_t columns_ = 0;
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
  if (!has_header) return Error{"expected the header 'view,line,u_px,v_px[,sigma_px]', found nothing", file_name};
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
