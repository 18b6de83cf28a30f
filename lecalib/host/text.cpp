// SPDX-License-Identifier: MIT
#include "lecalib/host/text.hpp"

#include <charconv>
#include <cmath>

namespace lecalib::host {
namespace {

constexpr std::string_view kBlanks = " \t";
constexpr std::size_t kMaxQuoted = 40;

std::string_view trim_end(std::string_view text) {
  const std::size_t last = text.find_last_not_of(" \t\r");
  return last == std::string_view::npos ? std::string_view() : text.substr(0, last + 1);
}

/// from_chars knows no plus sign. "+-1" stays as it is and fails later.
std::string_view without_plus(std::string_view text) {
  const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
  return plus ? text.substr(1) : text;
}

template <class Number>
bool parse_all(std::string_view text, Number* value) {
  const char* end = text.data() + text.size();
  const std::from_chars_result result = std::from_chars(text.data(), end, *value);
  return result.ec == std::errc() && result.ptr == end;
}

}  // namespace

LineReader::LineReader(std::string_view text) : rest_(text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest_.substr(0, kByteOrderMark.size()) == kByteOrderMark) rest_.remove_prefix(kByteOrderMark.size());
}

bool LineReader::next(std::string_view* line) {
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  *line = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (!line->empty() && line->back() == '\r') line->remove_suffix(1);
  ++number_;
  return true;
}

std::string_view without_comment(std::string_view line) { return trim_end(line.substr(0, line.find('#'))); }

std::vector<Field> split_blanks(std::string_view line) {
  std::vector<Field> fields;
  std::size_t begin = line.find_first_not_of(kBlanks);
  while (begin != std::string_view::npos) {
    const std::size_t end = line.find_first_of(kBlanks, begin);
    fields.push_back({line.substr(begin, end - begin), begin + 1});
    begin = line.find_first_not_of(kBlanks, end);
  }
  return fields;
}

std::vector<Field> split(std::string_view line, char separator) {
  std::vector<Field> fields;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = line.find(separator, begin);
    std::string_view piece = line.substr(begin, end - begin);
    const std::size_t lead = piece.find_first_not_of(kBlanks);
    if (lead != std::string_view::npos) piece.remove_prefix(lead);
    fields.push_back({trim_end(piece), static_cast<std::size_t>(piece.data() - line.data()) + 1});
    if (end == std::string_view::npos) return fields;
    begin = end + 1;
  }
}

std::optional<double> parse_number(std::string_view text) {
  double value = 0;
  if (!parse_all(without_plus(text), &value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<unsigned long long> parse_count(std::string_view text) {
  unsigned long long value = 0;
  if (!parse_all(without_plus(text), &value)) return std::nullopt;
  return value;
}

std::string quoted(std::string_view text) {
  std::string shown = "'";
  for (const char c : text.substr(0, kMaxQuoted)) shown += c >= ' ' && c <= '~' ? c : '?';
  return shown + (text.size() > kMaxQuoted ? "...'" : "'");
}

std::string fixed(double value, int decimals) {
  char text[400];  // 309 digits before the point at most.
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, decimals);
  return {text, end.ptr};
}

std::string shortest(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value);
  return {text, end.ptr};
}

}  // namespace lecalib::host
