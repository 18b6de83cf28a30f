// SPDX-License-Identifier: MIT
#include "lecalib/events/event_stream.hpp"

namespace lecalib {

Status EventStreamDecoder::decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                                  SideRecords* side) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  if (!has_begun_) {
    const Status head_status = head_.read(input);
    if (head_status == Status::in_progress) return Status::ok;
    if (is_error(begin_events(head_status))) return status_;
  }
  return decode_events(input, out, count, side);
}

Status EventStreamDecoder::finish(Span<Event> out, std::size_t* count, SideRecords* side) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  if (!has_begun_ && is_error(begin_events(head_.finish()))) return status_;
  Span<const std::uint8_t> nothing;
  const Status status = decode_events(&nothing, out, count, side);
  if (is_error(status) || *count == out.size()) return status;
  std::size_t more = 0;
  run_decoder([&](auto* decoder) { return decoder->finish(out.subspan(*count), &more, side); });
  *count += more;
  return status_;
}

Status EventStreamDecoder::begin_events(Status head_status) noexcept {
  has_begun_ = true;
  status_ = head_status;
  const HeaderFacts& facts = head_.facts();
  if (is_error(status_)) {
    error_ = {"Prophesee RAW (EVT2, EVT2.1, EVT3) or DAT, AEDAT 2, Event Stream 2 or text", 0, 0};
  } else if (facts.format == EventFormat::aedat2 && !is_known(size())) {
    status_ = Status::unsupported_format;
    error_ = {"the sensor's size, or a line '# AEChip: NAME' with a known chip", 0, 0};
  }
  evt2_ = Evt2Decoder(size());
  evt21_ = Evt21Decoder(Evt21Format(size(), facts.evt21_order));
  evt3_ = Evt3Decoder(size());
  dat_ = DatDecoder(DatFormat(size(), facts.dat_version, facts.dat_content));
  // A file that names no chip: only the DVS128 is as small, and only its addresses are other.
  const bool is_dvs128 = !is_known(facts.size) && given_size_.width == 128 && given_size_.height == 128;
  aedat2_ = Aedat2Decoder(Aedat2Format(size(), is_dvs128 ? Aedat2Layout::dvs128 : facts.aedat2_layout));
  es_ = EsDecoder(EsFormat(size(), facts.es_content));
  text_ = TextDecoder(size());
  return status_;
}

/// What the head read too far comes first.
Status EventStreamDecoder::decode_events(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                                         SideRecords* side) noexcept {
  Span<const std::uint8_t> unread = head_.unread().subspan(replayed_);
  run_decoder([&](auto* decoder) { return decoder->decode(&unread, out, count, side); });
  replayed_ = head_.unread().size() - unread.size();
  if (is_error(status_) || !unread.empty() || *count == out.size()) return status_;
  std::size_t more = 0;
  run_decoder([&](auto* decoder) { return decoder->decode(input, out.subspan(*count), &more, side); });
  *count += more;
  return status_;
}

/// Calls the decoder of the format; that of text where there is none.
template <class Self, class Call>
void EventStreamDecoder::with_decoder(Self* self, Call&& call) noexcept {
  switch (self->format()) {
    case EventFormat::evt2: return call(&self->evt2_);
    case EventFormat::evt21: return call(&self->evt21_);
    case EventFormat::evt3: return call(&self->evt3_);
    case EventFormat::dat: return call(&self->dat_);
    case EventFormat::aedat2: return call(&self->aedat2_);
    case EventFormat::event_stream: return call(&self->es_);
    case EventFormat::text:
    case EventFormat::unknown: return call(&self->text_);
  }
}

/// Calls the decoder and takes over its status and error.
template <class Call>
void EventStreamDecoder::run_decoder(Call&& call) noexcept {
  with_decoder(this, [&](auto* decoder) {
    status_ = call(decoder);
    if (!is_error(status_)) return;
    error_ = decoder->error();
    error_.offset += head_.events_offset();
  });
}

SensorSize EventStreamDecoder::stated_size() const noexcept {
  return format() == EventFormat::text ? text_.stated_size() : head_.facts().size;
}

SensorSize EventStreamDecoder::size() const noexcept { return is_known(stated_size()) ? stated_size() : given_size_; }

const DecoderStats& EventStreamDecoder::stats() const noexcept {
  const DecoderStats* stats = nullptr;
  with_decoder(this, [&](const auto* decoder) { stats = &decoder->stats(); });
  return *stats;
}

}  // namespace lecalib
