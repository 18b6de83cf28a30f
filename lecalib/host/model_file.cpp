// SPDX-License-Identifier: MIT
#include "lecalib/host/model_file.hpp"

#include <cmath>
#include <unordered_map>

#include "lecalib/host/file_io.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr const char* kRow = "'x1 y1 z1 x2 y2 z2 name'";
constexpr std::size_t kFields = 7;
constexpr std::size_t kMaxModelLines = 65535;  // LinePoint::line has 16 bits.

double length(const ModelLine& line) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += (line.q[k] - line.p[k]) * (line.q[k] - line.p[k]);
  return std::sqrt(sum);
}

/// @return an Error without file and line.
Result<ModelLine> parse_row(const std::vector<Field>& fields) {
  if (fields.size() != kFields) {
    return Error{std::string("expected ") + kRow + " (7 fields), found " + std::to_string(fields.size()), "", 0,
                 fields.front().column};
  }
  ModelLine line{};
  for (std::size_t i = 0; i < 6; ++i) {
    const std::optional<double> value = parse_number(fields[i].text);
    if (!value)
      return Error{"expected a finite number of metres, found " + quoted(fields[i].text), "", 0, fields[i].column};
    if (std::abs(*value) > kMaxModelMetres)
      return Error{"expected metres between -1e6 and 1e6, found " + quoted(fields[i].text), "", 0, fields[i].column};
    (i < 3 ? line.p[i] : line.q[i - 3]) = *value;
  }
  if (length(line) < kMinModelMetres)
    return Error{"expected two end points 1e-6 m or more apart", "", 0, fields.front().column};
  return line;
}

}  // namespace

Result<Model> parse_model(std::string_view text, const std::string& file_name) {
  Model model;
  std::unordered_map<std::string_view, std::size_t> line_of_name;
  LineReader reader(text);
  std::string_view raw;
  while (reader.next(&raw)) {
    const std::vector<Field> fields = split_blanks(without_comment(raw));
    if (fields.empty()) continue;
    const Result<ModelLine> row = parse_row(fields);
    if (!row.ok()) return Error{row.error().message, file_name, reader.number(), row.error().column};
    const auto [known, is_new] = line_of_name.emplace(fields[6].text, reader.number());
    if (!is_new) {
      return Error{"the name " + quoted(fields[6].text) + " is already used in line " + std::to_string(known->second),
                   file_name, reader.number(), fields[6].column};
    }
    if (model.lines.size() == kMaxModelLines) return Error{"more than 65535 lines", file_name, reader.number()};
    model.lines.push_back(row.value());
    model.names.emplace_back(fields[6].text);
  }
  if (model.lines.size() < kMinModelLines) {
    return Error{"expected at least " + std::to_string(kMinModelLines) + " lines in the model, found " +
                     std::to_string(model.lines.size()),
                 file_name, reader.number()};
  }
  return model;
}

Result<Model> read_model(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text.ok()) return text.error();
  return parse_model(text.value(), path);
}

}  // namespace lecalib::host
