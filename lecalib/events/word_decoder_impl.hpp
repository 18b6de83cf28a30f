// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/word_decoder.hpp"

namespace lecalib {

template <class Format>
Status WordDecoder<Format>::decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                                   SideRecords* side) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  Format format = format_;  // copies that the compiler can keep in registers
  DecoderStats stats = stats_;
  EventRoom room{out.begin(), out.end(), side};
  format.flush(&room);
  if (room.next != room.end) {
    // Inlined or not decides whether format and room live in registers: a factor of two in speed.
    reader_.read(
        input,
        [&](typename Format::Word word) __attribute__((always_inline)) {
          format.take(word, &room, &stats);
          return room.next != room.end;
        },
        [&](std::uint64_t words, std::size_t * bytes) __attribute__((always_inline)) {
          *bytes = format.take_group(words, &room, &stats);
          return room.next != room.end;
        });
  }
  *count = static_cast<std::size_t>(room.next - out.begin());
  stats.events += *count;
  format_ = format;
  stats_ = stats;
  return Status::ok;
}

template <class Format>
Status WordDecoder<Format>::finish(Span<Event> out, std::size_t* count, SideRecords* side) noexcept {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  EventRoom room{out.begin(), out.end(), side};
  format_.flush(&room);
  *count = static_cast<std::size_t>(room.next - out.begin());
  stats_.events += *count;
  const std::size_t unfinished = reader_.carried() + format_.held() * sizeof(typename Format::Word);
  if (format_.is_flushed() && unfinished > 0) {
    error_ = {"a whole last word", reader_.offset() - unfinished, 0};
    status_ = Status::malformed_input;
  }
  return status_;
}

}  // namespace lecalib
