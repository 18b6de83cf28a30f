// SPDX-License-Identifier: MIT
#include "lecalib/usb/live_decoder.hpp"

#include <utility>

namespace lecalib::usb {
namespace {

/// Between the last event before a camera was plugged in anew and the first one after.
constexpr std::int64_t kRestartGapUs = 1'000'000;

}  // namespace

Status LiveDecoder::begin(const std::string& header) {
  if (decoder_) {
    before_ = stats();
    shift_us_ = last_us_ + kRestartGapUs;
    gap_is_ahead_ = true;
  }
  decoder_ = std::make_unique<EventStreamDecoder>();
  buffers_to_leave_out_ = 0;
  is_behind_ = false;
  Span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(header.data()), header.size());
  std::size_t count = 0;
  return decoder_->decode(&bytes, events_, &count);
}

void LiveDecoder::take(const BufferRing::Buffer& buffer, std::size_t waiting) {
  if (buffers_to_leave_out_ > 0) --buffers_to_leave_out_;
  const bool falls_behind = !is_behind_ && waiting >= most_waiting_;
  is_behind_ = waiting >= most_waiting_;
  const bool has_lost = buffer.lost_before > 0;
  skips_ = has_lost || (skips_ && buffers_to_leave_out_ > 0);
  if (has_lost || (falls_behind && buffers_to_leave_out_ == 0)) {
    buffers_to_leave_out_ = 1 + waiting;
    ++left_out_.times;
    gap_is_ahead_ = true;
  }
  if (skips_) ++left_out_.buffers;
  bytes_ = skips_ ? Span<const std::uint8_t>() : buffer.bytes;
}

Status LiveDecoder::next(Span<const Event>* events) {
  Status status = Status::ok;
  std::size_t count = 0;
  do {
    status = decoder_->decode(&bytes_, events_, &count);
    if (count > 0) last_us_ = events_[count - 1].t_us + shift_us_;
    if (buffers_to_leave_out_ == 0) break;
    left_out_.events += count;
  } while (count > 0);
  for (std::size_t i = 0; i < count; ++i) events_[i].t_us += shift_us_;
  if (count > 0) has_gap_ = std::exchange(gap_is_ahead_, false);
  *events = {events_.data(), count};
  return status;
}

DecoderStats LiveDecoder::stats() const {
  DecoderStats all = before_;
  if (decoder_) add_counts(decoder_->stats(), &all);
  return all;
}

}  // namespace lecalib::usb
