// SPDX-License-Identifier: MIT
#include "lecalib/events/event_stream.hpp"

namespace lecalib {

Status EventStreamDecoder::decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  if (!has_begun_) {
    const Status head_status = head_.read(input);
    if (head_status == Status::in_progress) return Status::ok;
    if (is_error(begin_events(head_status))) return status_;
  }
  return decode_events(input, out, count);
}

Status EventStreamDecoder::finish(Span<Event> out, std::size_t* count) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  if (!has_begun_ && is_error(begin_events(head_.finish()))) return status_;
  Span<const std::uint8_t> nothing;
  const Status status = decode_events(&nothing, out, count);
  if (is_error(status) || *count == out.size()) return status;
  std::size_t more = 0;
  with_decoder([&](auto* decoder) { return decoder->finish(out.subspan(*count), &more); });
  *count += more;
  return status_;
}

Status EventStreamDecoder::begin_events(Status head_status) noexcept {
  has_begun_ = true;
  status_ = head_status;
  if (is_error(status_)) {
    error_ = {"Prophesee RAW (EVT2, EVT3) or text", 0, 0};
    return status_;
  }
  evt2_ = Evt2Decoder(size());
  evt3_ = Evt3Decoder(size());
  text_ = TextDecoder(size());
  return status_;
}

/// What the head read too far comes first.
Status EventStreamDecoder::decode_events(Span<const std::uint8_t>* input, Span<Event> out,
                                         std::size_t* count) noexcept {
  Span<const std::uint8_t> unread = head_.unread().subspan(replayed_);
  with_decoder([&](auto* decoder) { return decoder->decode(&unread, out, count); });
  replayed_ = head_.unread().size() - unread.size();
  if (is_error(status_) || !unread.empty() || *count == out.size()) return status_;
  std::size_t more = 0;
  with_decoder([&](auto* decoder) { return decoder->decode(input, out.subspan(*count), &more); });
  *count += more;
  return status_;
}

/// Calls the decoder of the format and takes over its status and error.
template <class Call>
void EventStreamDecoder::with_decoder(Call&& call) noexcept {
  const auto run = [&](auto* decoder) {
    status_ = call(decoder);
    if (!is_error(status_)) return;
    error_ = decoder->error();
    error_.offset += head_.events_offset();
  };
  switch (format()) {
    case EventFormat::evt2: return run(&evt2_);
    case EventFormat::evt3: return run(&evt3_);
    case EventFormat::text: return run(&text_);
    case EventFormat::unknown: return;
  }
}

SensorSize EventStreamDecoder::stated_size() const noexcept {
  return format() == EventFormat::text ? text_.stated_size() : head_.size();
}

SensorSize EventStreamDecoder::size() const noexcept { return is_known(stated_size()) ? stated_size() : given_size_; }

const DecoderStats& EventStreamDecoder::stats() const noexcept {
  switch (format()) {
    case EventFormat::evt2: return evt2_.stats();
    case EventFormat::evt3: return evt3_.stats();
    case EventFormat::text:
    case EventFormat::unknown: break;
  }
  return text_.stats();
}

}  // namespace lecalib
