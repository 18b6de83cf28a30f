// SPDX-License-Identifier: MIT
#include "lecalib/host/json_writer.hpp"

#include <cmath>

#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

std::string escaped(std::string_view text) {
  constexpr const char* kHex = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20U) {
      out += "\\u00";
      out += kHex[byte >> 4U];
      out += kHex[byte & 15U];
    } else {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace

void JsonWriter::begin(char open, char close, Layout layout) {
  next_item();
  text_ += open;
  const bool inside_one_line = !levels_.empty() && levels_.back().layout == Layout::one_line;
  levels_.push_back({close, inside_one_line ? Layout::one_line : layout, true});
}

void JsonWriter::end() {
  const Level level = levels_.back();
  levels_.pop_back();
  if (level.layout == Layout::lines && !level.empty) new_line();
  text_ += level.end;
}

void JsonWriter::key(std::string_view name) {
  next_item();
  text_ += escaped(name) + ": ";
  after_key_ = true;
}

void JsonWriter::value(std::string_view text) { literal(escaped(text)); }

void JsonWriter::value(double number) { literal(std::isfinite(number) ? shortest(number) : "null"); }

void JsonWriter::numbers(Span<const double> values) {
  begin_array(Layout::one_line);
  for (const double number : values) value(number);
  end();
}

void JsonWriter::literal(std::string_view text) {
  next_item();
  text_ += text;
}

/// Separates an item from the one before it; the value of a key stands on the key's line.
void JsonWriter::next_item() {
  if (after_key_ || levels_.empty()) {
    after_key_ = false;
    return;
  }
  Level& level = levels_.back();
  if (!level.empty) text_ += level.layout == Layout::lines ? "," : ", ";
  level.empty = false;
  if (level.layout == Layout::lines) new_line();
}

void JsonWriter::new_line() { text_ += "\n" + std::string(2 * levels_.size(), ' '); }

}  // namespace lecalib::host
