// SPDX-License-Identifier: MIT
#pragma once

#include <limits>

#include "lecalib/core/span.hpp"
#include "lecalib/events/decoder.hpp"

namespace lecalib {

/// Events as text, one a row: time, x, y, polarity, with blanks or one comma between them. Contract: decoder.hpp.
///
/// Time: a row whose time has a '.' is in seconds, and so are all rows after it; they are rounded to microseconds,
/// halves away from zero. Without a '.' in the first row's time all times are microseconds (0 leaves it open).
/// Polarity: 1 is ON, 0 or -1 is OFF. Lines may end in LF or CR LF; empty lines and lines that begin with '#' are
/// passed over. The first other line may be a title that begins with a letter ("t_us,x,y,p") and a first row of two
/// integers is the sensor's width and height.
///
/// Numbers are read as integers, exactly and without regard to a locale.
class TextDecoder {
 public:
  explicit TextDecoder(SensorSize size = {}) noexcept : size_(size) {}

  /// @return ok | invalid_argument (`out` is empty) | malformed_input (see error(): what was expected, line, byte)
  Status decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                SideRecords* side = nullptr) noexcept;
  /// Gives the event of a last row without line end. @return as decode().
  Status finish(Span<Event> out, std::size_t* count, SideRecords* side = nullptr) noexcept;

  [[nodiscard]] const DecoderStats& stats() const noexcept { return stats_; }
  [[nodiscard]] const DecodeError& error() const noexcept { return error_; }
  /// The size that the text's first row states; 0 x 0 when it does not.
  [[nodiscard]] SensorSize stated_size() const noexcept { return stated_size_; }

 private:
  enum class State : std::uint8_t { row_start, passed_line, field_start, sign, whole, fraction, after_field };
  enum class TimeUnit : std::uint8_t { open, microseconds, seconds };
  enum Field : std::uint8_t { kTime, kX, kY, kPolarity, kNumFields };

  /// The number being read.
  struct Number {
    std::int64_t digits = 0;    ///< without sign and '.', at most 6 decimals
    std::uint8_t decimals = 0;  ///< up to 7, the seventh stands in round_up
    bool negative = false;
    bool has_digits = false;
    bool has_point = false;
    bool round_up = false;  ///< the seventh decimal is 5 or more
  };

  // Each returns true when event_ is complete.
  bool take(std::uint8_t byte) noexcept;
  bool take_after_number(std::uint8_t byte) noexcept;
  bool end_row() noexcept;

  void take_row_start(std::uint8_t byte) noexcept;
  void begin_field(std::uint8_t byte) noexcept;
  void take_digit(std::uint8_t byte) noexcept;
  void take_point() noexcept;
  void end_field() noexcept;
  bool scale_time(std::int64_t* t_us) const noexcept;
  void end_line() noexcept;
  void fail(const char* expected) noexcept;

  SensorSize size_;  ///< events are checked against
  SensorSize stated_size_;
  State state_ = State::row_start;
  std::uint8_t field_ = 0;  ///< fields of this row that are complete
  TimeUnit unit_ = TimeUnit::open;
  bool has_title_ = false;
  bool has_rows_ = false;
  bool time_has_point_ = false;  ///< in this row
  Number number_;
  std::int64_t values_[kNumFields] = {};
  Event event_ = {};
  std::int64_t last_t_us_ = std::numeric_limits<std::int64_t>::min();
  std::uint64_t offset_ = 0;
  std::uint64_t line_ = 1;
  DecoderStats stats_;
  DecodeError error_;
  Status status_ = Status::ok;
};

}  // namespace lecalib
