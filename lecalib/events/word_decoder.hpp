// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/bytes.hpp"
#include "lecalib/events/side_records.hpp"

namespace lecalib {

/// Room for events: [next, end), and for what comes beside them.
struct EventRoom {
  Event* next;
  Event* end;
  SideRecords* side;  ///< null: nobody takes it
};

/// Base of formats that have neither groups nor events of more than a word.
struct WordByWord {
  [[nodiscard]] static std::size_t held() noexcept { return 0; }
  static std::size_t take_group(std::uint64_t, EventRoom*, DecoderStats*) noexcept { return 0; }
};

/// Base of formats in which a word is at most one event.
struct EventPerWord : WordByWord {
  static void flush(EventRoom*) noexcept {}
  [[nodiscard]] static bool is_flushed() noexcept { return true; }
};

/// The decoder of a format whose stream is a row of equal words. Contract: decoder.hpp.
///
/// Format holds what one word leaves for the next ones:
///     using Word = ...;                            // little-endian in the stream
///     explicit Format(SensorSize);
///     void take(Word, EventRoom*, DecoderStats*);  // called with room for at least one event
///     void flush(EventRoom*);                      // gives events of the last word that found no room
///     bool is_flushed() const;
///     std::size_t held() const;                    // words of an unfinished event
///     // Takes words that often come together from the front of the next 8 bytes, at most one event, and gives their
///     // bytes, or 0; called like take().
///     std::size_t take_group(std::uint64_t, EventRoom*, DecoderStats*);
/// The bodies stand in word_decoder_impl.hpp, which only the format's own source includes.
template <class Format>
class WordDecoder {
 public:
  explicit WordDecoder(SensorSize size = {}) noexcept : format_(size) {}
  /// For formats that need to know more than the size.
  explicit WordDecoder(const Format& format) noexcept : format_(format) {}

  /// @return ok | invalid_argument (`out` is empty) | malformed_input (after finish() found a cut word)
  Status decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                SideRecords* side = nullptr) noexcept;
  /// @return ok | invalid_argument (`out` is empty) | malformed_input (the stream ended within a word)
  Status finish(Span<Event> out, std::size_t* count, SideRecords* side = nullptr) noexcept;

  [[nodiscard]] const DecoderStats& stats() const noexcept { return stats_; }
  [[nodiscard]] const DecodeError& error() const noexcept { return error_; }

 private:
  WordReader<typename Format::Word> reader_;
  Format format_;
  DecoderStats stats_;
  DecodeError error_;
  Status status_ = Status::ok;
};

}  // namespace lecalib
