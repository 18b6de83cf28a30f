// SPDX-License-Identifier: MIT
/// Small tools for text files: lines, fields, numbers. Nothing depends on the locale.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lecalib::host {

/// A piece of a line and where it starts (1-based byte).
struct Field {
  std::string_view text;
  std::size_t column = 1;
};

/// Walks over the lines of a text: ends at LF or CRLF, skips a byte order mark, a last line needs no line end.
class LineReader {
 public:
  explicit LineReader(std::string_view text);
  /// @return false at the end of the text; *line is then unchanged.
  bool next(std::string_view* line);
  /// Number of the line given last, from 1.
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// The line up to its comment ('#'), without white space at its end.
std::string_view without_comment(std::string_view line);

/// Fields between runs of blanks and tabs.
std::vector<Field> split_blanks(std::string_view line);

/// Fields between single separators, blanks around them removed; "a,,b" has an empty field.
std::vector<Field> split(std::string_view line, char separator);

/// A finite decimal number that uses all of `text` ("+1.5e-3"); none for "nan", "inf", "1.5px", "".
std::optional<double> parse_number(std::string_view text);

/// A whole number >= 0 that uses all of `text`.
std::optional<unsigned long long> parse_count(std::string_view text);

/// `text` in quotes for an error message: shortened, with unprintable bytes shown as '?'.
std::string quoted(std::string_view text);

/// Decimal text that does not depend on the locale: a fixed number of decimals, or the shortest that reads back the
/// same.
std::string fixed(double value, int decimals);
std::string shortest(double value);

}  // namespace lecalib::host
