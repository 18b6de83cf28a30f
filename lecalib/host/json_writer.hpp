// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "lecalib/core/span.hpp"

namespace lecalib::host {

/// Writes JSON text from front to back, indented for people: members on lines of their own, or a whole object or array
/// on one line. Numbers read back the same; what JSON cannot say (not a number, infinity) becomes null. Keeping begin
/// and end in step is the caller's duty.
class JsonWriter {
 public:
  enum class Layout { lines, one_line };

  void begin_object(Layout layout = Layout::lines) { begin('{', '}', layout); }
  void begin_array(Layout layout = Layout::lines) { begin('[', ']', layout); }
  /// Ends the object or array begun last.
  void end();

  /// In an object, before the value (or the begin) that belongs to it.
  void key(std::string_view name);

  void value(std::string_view text);
  void value(const char* text) { value(std::string_view(text)); }
  void value(bool flag) { literal(flag ? "true" : "false"); }
  void value(double number);
  template <class Integer, class = std::enable_if_t<std::is_integral_v<Integer> && !std::is_same_v<Integer, bool>>>
  void value(Integer number) {
    literal(std::to_string(number));
  }
  void null() { literal("null"); }

  /// An array of numbers on one line.
  void numbers(Span<const double> values);

  template <class Value>
  void member(std::string_view name, const Value& content) {
    key(name);
    value(content);
  }

  /// The text so far, with a line end: all of it once every begin has its end.
  [[nodiscard]] std::string text() const { return text_ + "\n"; }

 private:
  struct Level {
    char end;
    Layout layout;
    bool empty;
  };
  void begin(char open, char close, Layout layout);
  void literal(std::string_view text);
  void next_item();
  void new_line();

  std::string text_;
  std::vector<Level> levels_;
  bool after_key_ = false;
};

}  // namespace lecalib::host
