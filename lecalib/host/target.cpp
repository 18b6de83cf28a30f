// SPDX-License-Identifier: MIT
#include <cmath>

#include "lecalib/host/model_file.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr unsigned long long kMaxCorners = 1000;

Error expected(std::string_view spec, const char* form) { return {"target " + quoted(spec) + ": expected " + form}; }

void add(Model* model, const ModelLine& line, std::string name) {
  model->lines.push_back(line);
  model->names.push_back(std::move(name));
}

/// "0.4x0.3x0.25" into that many lengths a model may have; empty when it is anything else.
std::vector<double> sizes(std::string_view text, std::size_t count) {
  std::vector<double> values;
  for (const Field& field : split(text, 'x')) {
    const std::optional<double> value = parse_number(field.text);
    if (!value || *value < kMinModelMetres || *value > kMaxModelMetres) return {};
    values.push_back(*value);
  }
  return values.size() == count ? values : std::vector<double>();
}

Result<Model> rectangle(std::string_view spec, std::string_view arguments) {
  const std::vector<double> size = sizes(arguments, 2);
  if (size.empty()) return expected(spec, "rectangle:WxH in metres, as in rectangle:0.297x0.210");
  const double w = size[0];
  const double h = size[1];
  Model model;
  add(&model, {{0, 0, 0}, {w, 0, 0}}, "bottom");
  add(&model, {{w, 0, 0}, {w, h, 0}}, "right");
  add(&model, {{w, h, 0}, {0, h, 0}}, "top");
  add(&model, {{0, h, 0}, {0, 0, 0}}, "left");
  return model;
}

/// Names tell direction and place: "x_y0_z1" runs along x at y = 0 and z = D.
Result<Model> box(std::string_view spec, std::string_view arguments) {
  const std::vector<double> size = sizes(arguments, 3);
  if (size.empty()) return expected(spec, "box:WxHxD in metres, as in box:0.40x0.30x0.25");
  constexpr const char* kAxes[3] = {"x", "y", "z"};
  Model model;
  for (std::size_t along = 0; along < 3; ++along) {
    const std::size_t a = along == 0 ? 1 : 0;
    const std::size_t b = along == 2 ? 1 : 2;
    for (int corner = 0; corner < 4; ++corner) {
      ModelLine line{};
      const int at_a = corner % 2;
      const int at_b = corner / 2;
      line.p[a] = line.q[a] = at_a * size[a];
      line.p[b] = line.q[b] = at_b * size[b];
      line.q[along] = size[along];
      add(&model, line,
          std::string(kAxes[along]) + "_" + kAxes[a] + std::to_string(at_a) + "_" + kAxes[b] + std::to_string(at_b));
    }
  }
  return model;
}

Result<Model> checkerboard(std::string_view spec, std::string_view arguments) {
  constexpr const char* kForm = "checkerboard:CxR:S, inner corners and square in metres, as in checkerboard:9x6:0.030";
  const std::vector<Field> parts = split(arguments, ':');
  const std::vector<Field> counts = split(parts.front().text, 'x');
  if (parts.size() != 2 || counts.size() != 2) return expected(spec, kForm);
  const auto columns = parse_count(counts[0].text);
  const auto rows = parse_count(counts[1].text);
  const std::vector<double> square = sizes(parts[1].text, 1);
  const bool sound = columns && rows && *columns >= 2 && *rows >= 2 && *columns <= kMaxCorners && *rows <= kMaxCorners;
  if (!sound || square.empty()) return expected(spec, kForm);
  const double s = square[0];
  const double right = static_cast<double>(*columns) * s;
  const double bottom = static_cast<double>(*rows) * s;
  Model model;
  for (unsigned long long c = 0; c < *columns; ++c) {
    const double x = static_cast<double>(c) * s;
    add(&model, {{x, -s, 0}, {x, bottom, 0}}, "col" + std::to_string(c));
  }
  for (unsigned long long r = 0; r < *rows; ++r) {
    const double y = static_cast<double>(r) * s;
    add(&model, {{-s, y, 0}, {right, y, 0}}, "row" + std::to_string(r));
  }
  add(&model, {{-s, -s, 0}, {right, -s, 0}}, "rim_top");
  add(&model, {{right, -s, 0}, {right, bottom, 0}}, "rim_right");
  add(&model, {{right, bottom, 0}, {-s, bottom, 0}}, "rim_bottom");
  add(&model, {{-s, bottom, 0}, {-s, -s, 0}}, "rim_left");
  return model;
}

}  // namespace

Result<Model> make_target(std::string_view spec) {
  const std::size_t colon = spec.find(':');
  const std::string_view kind = spec.substr(0, colon);
  const std::string_view arguments = colon == std::string_view::npos ? std::string_view() : spec.substr(colon + 1);
  if (kind == "rectangle") return rectangle(spec, arguments);
  if (kind == "box") return box(spec, arguments);
  if (kind == "checkerboard") return checkerboard(spec, arguments);
  if (kind == "file" && !arguments.empty()) return read_model(std::string(arguments));
  return expected(spec, "rectangle:WxH, box:WxHxD, checkerboard:CxR:S or file:PATH");
}

}  // namespace lecalib::host
