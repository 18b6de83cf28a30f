// SPDX-License-Identifier: MIT
/// A state machine over single bytes, so that the input may be cut anywhere and no line has to be stored.
#include "lecalib/events/text_decoder.hpp"

#include <limits>

#include "lecalib/events/header_text.hpp"

namespace lecalib {
namespace {

using header_text::is_blank;

constexpr std::int64_t kMaxInt64 = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kMaxUint16 = std::numeric_limits<std::uint16_t>::max();
constexpr std::uint8_t kDecimals = 6;  // of a second in microseconds

/// By the number of fields that are complete.
constexpr const char* kExpected[] = {"a time in seconds or microseconds", "x, an integer from 0 to 65535",
                                     "y, an integer from 0 to 65535", "polarity 0, 1 or -1", "the end of the row"};

constexpr bool is_digit(std::uint8_t byte) noexcept { return byte >= '0' && byte <= '9'; }
constexpr bool is_letter(std::uint8_t byte) noexcept {
  return (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z');
}
constexpr bool is_control(std::uint8_t byte) noexcept { return byte < ' ' && !is_blank(byte) && byte != '\n'; }

}  // namespace

Status TextDecoder::decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                           SideRecords*) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  std::size_t used = 0;
  while (used < input->size() && *count < out.size() && !is_error(status_)) {
    if (take((*input)[used])) out[(*count)++] = event_;
    if (is_error(status_)) break;
    ++used;
    ++offset_;
  }
  *input = input->subspan(used);
  stats_.events += *count;
  return status_;
}

Status TextDecoder::finish(Span<Event> out, std::size_t* count, SideRecords*) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_) || state_ == State::row_start) return status_;
  if (take('\n')) out[(*count)++] = event_;
  stats_.events += *count;
  return status_;
}

bool TextDecoder::take(std::uint8_t byte) noexcept {
  switch (state_) {
    case State::row_start: take_row_start(byte); return false;
    case State::passed_line:
      if (byte == '\n') end_line();
      if (is_control(byte)) fail("text");
      return false;
    case State::field_start:
      if (!is_blank(byte)) begin_field(byte);
      return false;
    case State::sign:
    case State::whole:
    case State::fraction:
      if (is_digit(byte)) {
        take_digit(byte);
      } else if (byte == '.' && field_ == kTime && !number_.has_point) {
        take_point();
      } else {
        return take_after_number(byte);
      }
      return false;
    case State::after_field:
      if (byte == '\n') return end_row();
      if (byte == ',') {
        state_ = State::field_start;
      } else if (!is_blank(byte)) {
        begin_field(byte);
      }
      return false;
  }
  return false;
}

void TextDecoder::take_row_start(std::uint8_t byte) noexcept {
  if (byte == '\n') {
    end_line();
  } else if (byte == '#') {
    state_ = State::passed_line;
  } else if (is_letter(byte) && !has_title_ && !has_rows_) {
    has_title_ = true;
    state_ = State::passed_line;
  } else if (!is_blank(byte)) {
    field_ = kTime;
    begin_field(byte);
  }
}

void TextDecoder::begin_field(std::uint8_t byte) noexcept {
  number_ = {};
  state_ = State::sign;
  if (field_ == kNumFields) {
    fail(kExpected[field_]);
  } else if (is_digit(byte)) {
    take_digit(byte);
  } else if (byte == '.' && field_ == kTime) {
    take_point();
  } else if (byte == '-') {
    number_.negative = true;
  } else if (byte != '+') {
    fail(kExpected[field_]);
  }
}

void TextDecoder::take_point() noexcept {
  number_.has_point = true;
  state_ = State::fraction;
}

void TextDecoder::take_digit(std::uint8_t byte) noexcept {
  const std::int64_t digit = byte - '0';
  number_.has_digits = true;
  if (number_.has_point) {
    if (number_.decimals > kDecimals) return;
    if (++number_.decimals > kDecimals) {
      number_.round_up = digit >= 5;
      return;
    }
  } else {
    state_ = State::whole;
  }
  if (number_.digits > (kMaxInt64 - digit) / 10) return fail("a number below 2^63");
  number_.digits = number_.digits * 10 + digit;
}

bool TextDecoder::take_after_number(std::uint8_t byte) noexcept {
  if (!number_.has_digits || !(is_blank(byte) || byte == ',' || byte == '\n')) {
    fail(kExpected[field_]);
    return false;
  }
  end_field();
  if (is_error(status_)) return false;
  if (byte == '\n') return end_row();
  state_ = byte == ',' ? State::field_start : State::after_field;
  return false;
}

void TextDecoder::end_field() noexcept {
  std::int64_t value = number_.digits;
  switch (field_) {
    case kTime:
      time_has_point_ = number_.has_point;
      if (number_.has_point && unit_ == TimeUnit::microseconds)
        return fail("a time in microseconds, as in rows before");
      if (!scale_time(&value)) return fail("a time below 2^63 microseconds");
      break;
    case kX:
    case kY:
      if (value > kMaxUint16 || (number_.negative && value > 0)) return fail(kExpected[field_]);
      break;
    default:
      if (value > 1) return fail(kExpected[field_]);
      break;
  }
  values_[field_++] = number_.negative ? -value : value;
}

/// Seconds to microseconds. The sign is still to be applied.
bool TextDecoder::scale_time(std::int64_t* t_us) const noexcept {
  if (unit_ != TimeUnit::seconds && !number_.has_point) return true;
  std::int64_t value = number_.digits;
  for (std::uint8_t i = number_.decimals; i < kDecimals; ++i) {
    if (value > kMaxInt64 / 10) return false;
    value *= 10;
  }
  if (number_.round_up) {
    if (value == kMaxInt64) return false;
    ++value;
  }
  *t_us = value;
  return true;
}

bool TextDecoder::end_row() noexcept {
  const bool is_first = !has_rows_;
  if (is_first && field_ == 2 && !time_has_point_ && values_[0] > 0 && values_[0] <= kMaxUint16 && values_[1] > 0) {
    stated_size_ = {static_cast<std::uint16_t>(values_[0]), static_cast<std::uint16_t>(values_[1])};
    size_ = stated_size_;
    has_rows_ = true;
    end_line();
    return false;
  }
  if (field_ != kNumFields) {
    fail(kExpected[field_]);
    return false;
  }
  has_rows_ = true;
  if (time_has_point_) unit_ = TimeUnit::seconds;
  if (unit_ == TimeUnit::open && values_[kTime] != 0) unit_ = TimeUnit::microseconds;
  event_ = {values_[kTime], static_cast<std::uint16_t>(values_[kX]), static_cast<std::uint16_t>(values_[kY]),
            static_cast<std::uint8_t>(values_[kPolarity] == 1)};
  if (event_.t_us < last_t_us_) ++stats_.time_steps_back;
  last_t_us_ = event_.t_us;
  end_line();
  if (!is_known(size_) || (event_.x < size_.width && event_.y < size_.height)) return true;
  ++stats_.outside;
  return false;
}

void TextDecoder::end_line() noexcept {
  ++line_;
  state_ = State::row_start;
}

void TextDecoder::fail(const char* expected) noexcept {
  error_ = {expected, offset_, line_};
  status_ = Status::malformed_input;
}

}  // namespace lecalib
